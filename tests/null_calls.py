#!/usr/bin/env python3
"""Writes the calls of tests/test_null.c and tests/test_null_gl.c: each public function with NULL for all of its pointers, and for
each in turn while the others are good; and each that takes a host with an allocator that has one of its two functions.

    tests/null_calls.py INCLUDE_FOLDER OUTPUT HEADER...

A function whose parameter has a type without a good value here is an error, so that no function is left out."""

import pathlib
import re
import sys

# Good values by type; those of output are members of `out`, those of objects members of `made`.
OBJECTS = ["cells", "fog", "snapshot", "lighting", "environment_map", "grid", "textured_planet", "atmosphere", "sky_view", "clouds", "cloud_lighting",
           "cloud_workspace", "scene", "renderer", "movie", "image_writer", "gl", "gl_classic", "gl_renderer"]
INPUTS = ["cell", "cells_desc", "cell_view", "cell_point", "factor_desc", "d3d9_fog", "d3d9_vertex", "curve", "vertex_desc", "vertices",
          "vertex_output", "tessellation_desc", "triangles", "cloud_layer", "log", "clouds_desc", "cloud_lighting_desc", "ray",
          "diffusion_desc", "lighting_desc", "environment_map_desc", "environment", "planet_map_desc", "planet_map", "textured_planet_desc", "textured_planet_query", "grid_desc",
          "noise_desc", "phase", "droplet_distribution", "fog_desc", "volume_desc", "sun", "trace_desc", "ray_planes", "transfer_planes",
          "segments", "pixels", "transfer", "particle", "nebula_desc", "sample_point", "atmosphere_desc", "sky_view_desc", "ground_planes",
          "cpu_renderer_desc", "method_desc", "frame_desc", "frame", "scene_desc", "planet", "scene_model", "camera_key", "sun_key", "volume_key",
          "scene_noise", "image", "image_desc", "movie_desc", "grid_file", "view", "depth_desc", "camera", "gl_desc", "gl_pass", "gl_classic_desc",
          "gl_renderer_desc", "host", "gl_frame_desc", "gl_planes", "photograph", "intrinsics", "depth_source"]
OUTPUTS = ["cell_fog", "cell_segment", "factor_desc", "d3d9_fog", "curve", "vertex_desc", "cloud_layer", "cloud_transfer", "air_shadow",
           "fog_shadow", "planet_map", "shell_hits", "droplet_properties", "volume_id", "bounds", "transfer", "particle", "medium_properties",
           "scatterer", "majorant_segment", "atmosphere_desc", "irradiance", "sun", "environment", "scene_noise", "image", "rays", "view_error", "texel_f32", "texel_u32",
           "gl_fog_resources", "gl_textures", "view", "photograph", "intrinsics", "pixels", "depth_map"]
FRESH = OBJECTS + ["particle", "tessellation"]
POINTERS = {"const char": '"test_null"', "const float": "floats", "float": "out.floats", "double": "&out.number", "const double": "numbers", "size_t": "&out.count",
            "const size_t": "&zero", "uint32_t": "out.entries", "void": "&out"}
VALUES = {"nebel_isa": "NEBEL_ISA_DEFAULT", "nebel_method": "NEBEL_METHOD_VERTEX", "nebel_cell_stage": "NEBEL_CELLS_PER_VERTEX",
          "nebel_blend_mode": "NEBEL_BLEND_OVER", "nebel_shader_dialect": "NEBEL_DIALECT_GLSL_330", "nebel_volume_id": "made.id",
          "nebel_result": "NEBEL_OK"}
NAMED = {"pixel_spread": ".5", "transmittance": ".5", "f": ".5", "chance": ".5", "tile_size": "16", "capacity": "64", "size": "2", "n": "1", "count": "1",
         "output_count": "1", "room": "1", "parts": "1", "width": "1", "height": "1", "thickness": "1e5", "scale": "1"}

# These make nothing, and read the host's log alone.
LOG_ALONE = {"nebel_resolve_atmosphere", "nebel_get_planet_map_size", "nebel_generate_planet_map"}


def declarations(text):
    """(result, name, [parameter, ...]) of each function."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r"^NEBEL_API ", "", text, flags=re.M)
    text = re.sub(r"^\s*#.*(?:\\\n.*)*", "", text, flags=re.M)
    for found in re.finditer(r"^([A-Za-z_][\w \*]*?\b\**)(nebel_\w+)\(([^;{]*?)\);", text, flags=re.M | re.S):
        if "typedef" not in found[1]:
            yield found[1].strip(), found[2], split(" ".join(found[3].split()))


def split(parameters):
    parts, depth = [""], 0
    for letter in parameters:
        depth += letter in "(["
        depth -= letter in ")]"
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip() not in ("", "void")]


def of_structure(kind, is_const):
    """The good value of a pointer to nebel_KIND."""
    if kind == "scene_data":
        return "made.contents"
    if kind in OBJECTS:
        return f"made.{kind}"
    if is_const and kind in INPUTS:
        return f"&good_{kind}"
    if not is_const and kind in OUTPUTS:
        return f"out.{kind}" if kind in ("texel_f32", "texel_u32") else f"&out.{kind}"
    return None


def good_value(parameter):
    """(expression, whether it is a pointer)"""
    if "(*part)" in parameter:
        return "do_nothing", True
    if re.match(r"const double \(\*\w+\)\[3\]", parameter):
        return "places", True
    if parameter.startswith("const double *const direction[3]"):
        return "directions", True
    if parameter.startswith("const nebel_light **"):
        return "&out.lights", True
    if re.match(r"char \w+\[NEBEL_MAX_RECORD \+ 1\]", parameter):
        return "out.record", True
    array = re.match(r"(const )?(double|float) \w+\[(\d+)\]", parameter)
    if array:
        names = {"double": "matrix" if array[3] == "16" else "vector", "float": "floats"}
        return (names[array[2]] if array[1] else f"out.{'vector' if array[2] == 'double' else 'floats'}"), True
    fresh = re.match(r"nebel_(\w+) \*\*\w+$", parameter)
    if fresh and fresh[1] in FRESH:
        return f"&fresh.{fresh[1]}", True
    pointer = re.match(r"(const )?(\w+) \*(\w+)$", parameter)
    if pointer:
        kind = (pointer[1] or "") + pointer[2]
        value = "path" if pointer[3] == "path" else POINTERS.get(kind)
        value = value or of_structure(pointer[2].removeprefix("nebel_"), bool(pointer[1]))
        if value is None:
            sys.exit(f"null_calls: no good value for \"{parameter}\"; give one to tests/null_calls.py and tests/test_null.c")
        return value, True
    kind, name = parameter.rsplit(" ", 1)
    return VALUES.get(kind, NAMED.get(name, "0")), False


def calls(result, name, parameters):
    macro = "TRY" if result == "nebel_result" else "RUN"
    if len(parameters) == 1 and "*" in parameters[0]:
        yield f"    {macro}({name}(NULL));"
        return
    values = [good_value(parameter) for parameter in parameters]
    pointers = [i for i, (_, is_pointer) in enumerate(values) if is_pointer]
    gone = [set(pointers)] + [{i} for i in pointers if len(pointers) > 1]
    for missing in gone if pointers else []:
        words = ", ".join("NULL" if i in missing else value for i, (value, _) in enumerate(values))
        yield f"    {macro}({name}({words}));"


HALF_HOSTS = """\
static void *allocate_nothing(size_t size, void *user)
{
    (void)size;
    (void)user;
    return NULL;
}

static void check_half(const char *call, nebel_result result)
{
    if (result != NEBEL_ERROR_ARGUMENT) fail_msg("%s with half an allocator: %s", call, nebel_result_text(result));
}

#define CHECK_HALF(call) check_half(#call, call)
"""


def hosted_types(folder):
    """Structures that begin with a host, and the host itself; each with what leads to the host."""
    texts = (path.read_text(encoding="utf-8") for path in folder.glob("*.h"))
    found = {name: ".host" for text in texts for name in re.findall(r"^typedef struct (\w+) \{\n    nebel_host host;", text, re.M)}
    return found | {"nebel_host": ""}


def half_host_calls(hosted, result, name, parameters):
    """With a host whose allocator has no second function, in a copy named `half` of what is good."""
    for i, parameter in enumerate(parameters):
        pointer = re.match(r"const (nebel_\w+) \*\w+$", parameter)
        if not pointer or pointer[1] not in hosted or name in LOG_ALONE:
            continue
        words = ", ".join("&half" if k == i else good_value(other)[0] for k, other in enumerate(parameters))
        macro = "CHECK_HALF" if result == "nebel_result" else "RUN"
        yield f"""    {{
        {pointer[1]} half = good_{pointer[1].removeprefix("nebel_")};
        half{hosted[pointer[1]]}.allocator = (nebel_allocator){{.allocate = allocate_nothing}};
        {macro}({name}({words}));
    }}"""


def main():
    folder, output, headers = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
    lines, tests, hosted = [HALF_HOSTS], [], hosted_types(folder)
    for header in headers:
        declared = list(declarations((folder / f"{header}.h").read_text(encoding="utf-8")))
        for test, body in ((f"null_in_{header}", [line for each in declared for line in calls(*each)]),
                           (f"half_hosts_in_{header}", [line for each in declared for line in half_host_calls(hosted, *each)])):
            lines += [f"static void {test}(void **state)", "{", "    (void)state;", *body, "}", ""]
            tests.append(f"cmocka_unit_test({test})")
    output.write_text("\n".join([*lines, f"#define NULL_TESTS {', '.join(tests)}", ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
