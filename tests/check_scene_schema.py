#!/usr/bin/env python3
"""Checks that the reader, the schema, the manual and the fuzzer of the scene file speak of the same keys, and, where
python3-jsonschema is installed, that good scenes conform to the schema and bad ones do not."""

import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
READERS = ["import", "import_bevy", "import_godot", "import_unity", "import_unreal", "node_shape", "scene", "read_ambient", "read_camera", "read_cells", "read_classic", "read_clouds", "read_diffusion", "read_density", "read_grid", "read_layers", "read_light", "read_model", "read_nebula", "read_noise", "read_planet", "read_shape", "read_volume", "key_table"]
TABLE = re.compile(r"^ *(?:static )?const char \*const (?:\w+_)?(?:names|types)\[\w*\] = \{(.*?)\}", re.S | re.M)
COMMENT = re.compile(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', re.S)
BAD = ["[]", '{"nebel": 1}', '{"nebel": 2, "fog": []}', '{"nebel": 1, "fog": [], "planet": {}}', '{"nebel": 1, "fog": [], "planet": []}', '{"nebel": 1, "fog": [], "planet": [{"model": "textured"}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "visibility": 2}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "source": 1, "albedo": 1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world", "radius": 1}, "extinction": 1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 0}, "extinction": 1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "operation": "exclude", "extinction": 1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "contrast": 0.1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "preset": "fog"}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "preset": "mist", "contrast": 0.1}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "preset": "mist", "extinction": 1, "visibility": 2}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "preset": "mist", "source": 1, "phase": {"type": "rayleigh"}}]}',
       '{"nebel": 1, "fog": [], "camera": {"vertical_fov": 180}}',
       '{"nebel": 1, "fog": [], "models": [{"file": "a", "scale": 0}]}',
       '{"nebel": 1, "fog": [], "models": [{}]}',
       '{"nebel": 1, "fog": [], "nebula": [{}]}',
       '{"nebel": 1, "fog": [], "cells": {"cells": []}}',
       '{"nebel": 1, "fog": [], "cells": {"cells": [{"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 1}}]}}',
       '{"nebel": 1, "fog": [], "classic": {"density": 0}}',
       '{"nebel": 1, "fog": [], "classic": {"coordinate": "up"}}',
       '{"nebel": 1, "fog": [], "classic": {"curve": "table"}}',
       '{"nebel": 1, "fog": [], "classic": {"table": [1]}}',
       '{"nebel": 1, "fog": [], "classic": {"table": [0, 2]}}',
       '{"nebel": 1, "fog": [], "classic": {"curve": "exp", "table": [0, 1]}}',
       '{"nebel": 1, "fog": [], "classic": {"d3d9": {"fog_color": 2}}}',
       '{"nebel": 1, "fog": [], "classic": {"d3d9": {"fog_vertex_mode": "exp3"}}}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "keys": []}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "keys": [{"extinction": 1}]}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "keys": [{"frame": 1, "name": "a"}]}]}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": 1, "frame": 1}]}',
       '{"nebel": 1, "fog": [], "nebula": [{"points": {"file": "a.ply"}, "count": 3}]}',
       '{"nebel": 1, "fog": [{"import": {"type": "unity_fog"}}]}',
       '{"nebel": 1, "fog": [{"import": {"type": "unreal_height_fog", "FogMaxOpacity": 1.5}}]}',
       '{"nebel": 1, "fog": [{"import": {"type": "hdrp_fog"}, "extinction": 1}]}',
       '{"nebel": 1, "fog": [{"import": {"type": "bevy_distance_fog"}}]}',
       '{"nebel": 1, "fog": [], "background": "red"}',
       '{"nebel": 1, "fog": [{"shape": {"type": "world"}, "extinction": "#fff"}]}',
       '{"nebel": 1, "fog": [], "nebula": [{"shape": {"type": "world"}, "count": 0}]}']


def reader_names():
    """Every key and every choice that the reader's tables hold."""
    found = set()
    for name in READERS:
        file = next((ROOT / "src").glob(f"*/{name}.c"))
        for table in TABLE.findall(file.read_text()):
            found |= set(re.findall(r'"([A-Za-z_0-9]+)"', table))
    presets = (ROOT / "src/medium/fog_presets.c").read_text()
    return found | set(re.findall(r'\.name = "(\w+)"', presets))


def schema_names(node):
    """Every key and every choice that the schema allows."""
    found = set()
    if isinstance(node, list):
        for item in node:
            found |= schema_names(item)
    elif isinstance(node, dict):
        found |= set(node.get("properties", {}))
        found |= {v for v in [node.get("const"), *node.get("enum", [])] if isinstance(v, str)}
        for key, item in node.items():
            if key not in ("const", "enum", "required", "dependentRequired"):
                found |= schema_names(item)
    return found


def without_comments(text):
    return COMMENT.sub(lambda match: match[1] or " ", text)


def judge(schema, faults):
    try:
        import jsonschema
    except ImportError:
        print("check_scene_schema: python3-jsonschema is not installed; scenes are not tried")
        return
    validator = jsonschema.Draft202012Validator(schema)
    validator.check_schema(schema)
    for path in sorted([*ROOT.glob("fuzz/corpus/scene/*.json"), *ROOT.glob("examples/scenes/*.json"), *ROOT.glob("examples/engines/*.json")]):
        for error in validator.iter_errors(json.loads(without_comments(path.read_text()))):
            faults.append(f"{path.relative_to(ROOT)}: {error.json_path}: {error.message[:200]}")
    for text in BAD:
        if validator.is_valid(json.loads(text)):
            faults.append(f"the schema lets this pass: {text}")


def main():
    schema = json.loads((ROOT / "docs/scene.schema.json").read_text())
    pages = "".join((ROOT / "docs" / page).read_text() for page in ("scene-file.md", "engines.md"))
    manual = set(re.findall(r"`([A-Za-z_0-9]+)`", pages))
    names = reader_names()
    faults = [f"not in docs/scene.schema.json: {name}" for name in sorted(names - schema_names(schema))]
    faults += [f"not read by src/scene: {name}" for name in sorted(schema_names(schema) - names)]
    faults += [f"in no manual: {name}" for name in sorted(names - manual)]
    words = set(re.findall(r'^"\\"([A-Za-z_0-9]+)\\""$', (ROOT / "fuzz/scene.dict").read_text(), re.M))
    faults += [f"not in fuzz/scene.dict: {name}" for name in sorted(names - words)]
    if len(names) < 50:
        faults.append(f"only {len(names)} keys found in src/scene: this check needs mending")
    judge(schema, faults)
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
