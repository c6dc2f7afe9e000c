/* Shaders of point lights: maps of what stands around them, and their light on surfaces. */
#include "light_maps.h"

#define NB_LIGHT_TEXT_OF(x) #x
#define NB_LIGHT_TEXT(x) NB_LIGHT_TEXT_OF(x)

/* ---- maps ----------------------------------------------------------------------------------------------------------
 * Six faces around a point light, as of a cube. Coordinates of a face are two across it and one away from the point
 * light, which follow each other as x, y and z do. Depth is 1 at the point light and falls to 0: floats are as fine in
 * all distances. */

const char nb_light_map_vertex_text[] =
    "layout(location = 0) in vec3 mesh_position;\n"
    "layout(location = 2) in vec2 mesh_uv;\n"
    "out vec2 surface_uv;\n"
    "uniform vec3 scene_offset;\n"
    "uniform mat3 map_turn;\n"   /* to coordinates of the face */
    "uniform float map_share;\n" /* of the face, without what is its neighbours' */
    "uniform float map_near;\n"
    "out vec3 map_place;\n"
    "void main()\n"
    "{\n"
    "    map_place = map_turn * (mesh_position + scene_offset);\n"
    "    surface_uv = mesh_uv;\n"
    "    gl_Position = vec4(map_share * map_place.xy, map_place.z - 2.0 * map_near, "
    "map_place.z);\n"
    "}\n";

const char nb_light_map_fragment_text[] = "in vec3 map_place;\n"
                                          "in vec2 surface_uv;\n"
                                          "uniform float map_radius;\n"
                                          "void main()\n"
                                          "{\n"
                                          "    if (dot(map_place, map_place) < map_radius * map_radius) discard;\n"
                                          "    if (is_hole(surface_uv)) discard;\n"
                                          "    gl_FragDepth = 1.0 / (1.0 + map_place.z);\n"
                                          "}\n";

/* The words of a point light: its place, relative to the eye, and its layer of the maps, -1: none; its intensity, and
 * the square of its radius; its axis, and the cosine at the edge of its cone; what formulas/point_light.inc calls rise,
 * its radius as it was given, and its layer if it lights fog, too.
 *
 * The reciprocal of the distance away from the point light is linear on a plane, as it is in a picture. As in the
 * sun's maps each texel is compared with the plane of the surface continued to the texel's centre; `slack` is a share
 * of the distance, for neighbours that rise above the plane. */
const char nb_light_map_text[] = "#define NB_LIGHT_MAP_TEXELS " NB_LIGHT_TEXT(
    NB_LIGHT_MAP_TEXELS) "\n"
                         "uniform highp sampler2D scene_lights;\n"
                         "uniform int light_count;\n"
                         "vec4 light_texel(int light, int i)\n"
                         "{\n"
                         "    int texel = NB_LIGHT_MAP_TEXELS * light + i;\n"
                         "    return texelFetch(scene_lights, ivec2(texel & 1023, texel >> 10), 0);\n"
                         "}\n"
                         "uniform highp sampler2DArray light_maps;\n"
                         "uniform float map_face;\n" /* texels of a face's side */
                         "uniform float map_share;\n"
                         "struct light_face { ivec3 corner; vec3 at; vec3 side; };\n" /* in the map; coordinates of the face */
                         "light_face find_light_face(int layer, vec3 at, vec3 side)\n"
                         "{\n"
                         "    vec3 size = abs(at);\n"
                         "    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;\n"
                         "    light_face face;\n"
                         "    face.at = axis == 0 ? at.yzx : axis == 1 ? at.zxy : at;\n"
                         "    face.side = axis == 0 ? side.yzx : axis == 1 ? side.zxy : side;\n"
                         "    int row = face.at.z < 0.0 ? 1 : 0;\n"
                         "    if (row == 1) { face.at.z = -face.at.z; face.side.z = -face.side.z; }\n"
                         "    face.corner = ivec3(axis * int(map_face), row * int(map_face), layer);\n"
                         "    return face;\n"
                         "}\n"
                         "float light_tap(ivec3 texel, float nearness, float slack)\n"
                         "{\n"
                         "    float depth = texelFetch(light_maps, texel, 0).x;\n"
                         "    return depth * (1.0 - slack) <= nearness * (1.0 - depth) ? 1.0 : 0.0;\n"
                         "}\n"
                         /* How much of a point light passes surfaces to a point on one that faces `side`, `at` m from
                          * it.
     */
                         "float light_visible(int layer, vec3 at, vec3 side)\n"
                         "{\n"
                         "    light_face face = find_light_face(layer, at, side);\n"
                         "    vec2 across = face.at.xy / face.at.z;\n"
                         "    float cell = 2.0 / (map_face * map_share);\n"
                         "    vec2 place = (across * map_share * 0.5 + 0.5) * map_face, corner = floor(place), part = "
                         "place "
                         "- corner;\n"
                         "    float lean = dot(face.side, vec3(across, 1.0));\n"
                         "    vec2 slope = face.side.xy / min(lean, -0.05 * length(vec3(across, 1.0)));\n"
                         "    float slack = cell * (0.5 + 0.5 * length(slope)) + 4e-6, sum = 0.0;\n"
                         "    for (int y = -1; y <= 1; y++) {\n"
                         "        for (int x = -1; x <= 1; x++) {\n"
                         "            vec2 way = (vec2(float(x), float(y)) + 0.5 - part) * cell;\n"
                         "            vec2 weight = vec2(x < 0 ? 1.0 - part.x : x > 0 ? part.x : 1.0,\n"
                         "                               y < 0 ? 1.0 - part.y : y > 0 ? part.y : 1.0);\n"
                         "            ivec3 texel = face.corner + ivec3(ivec2(corner) + ivec2(x, y), 0);\n"
                         "            sum += weight.x * weight.y * light_tap(texel, (1.0 + dot(slope, way)) / "
                         "face.at.z, "
                         "slack);\n"
                         "        }\n"
                         "    }\n"
                         "    return 0.25 * sum;\n"
                         "}\n";

/* ---- light on surfaces ----------------------------------------------------------------------- */

/* As in src/cpu/surface_lights.c, point lights light the sides of triangles that face them. What no pixel shows is
 * left out. */
const char nb_light_text[] =
    "vec3 light_transmittance(vec3 place, vec3 direction, float reach)\n"
    "{\n"
    "#ifdef SCENE_FOG\n"
    "    return nebel_transmit_shadow(place, direction, reach);\n"
    "#else\n"
    "    return vec3(1.0);\n"
    "#endif\n"
    "}\n"
    "vec3 point_light(vec3 place, vec3 normal, vec3 side)\n"
    "{\n"
    "    vec3 sum = vec3(0.0);\n"
    "    for (int i = 0; i < light_count; i++) {\n"
    "        vec4 middle = light_texel(i, 0), intensity = light_texel(i, 1);\n"
    "        vec3 way = middle.xyz - place;\n"
    "        float square = dot(way, way), distance = sqrt(square);\n"
    "        vec3 direction = way / max(distance, 1e-18);\n"
    "        float cosine = dot(normal, direction), nearest = max(square, intensity.w);\n"
    "        if (!(cosine > 0.0 && dot(side, direction) > 0.0)) continue;\n"
    "        vec3 light = intensity.rgb * (cosine / nearest * 0.31830988618379067);\n"
    "        if (!(max(light.r, max(light.g, light.b)) * float(light_count) > 1e-5)) continue;\n"
    "        vec4 axis = light_texel(i, 2), cone = light_texel(i, 3);\n"
    "        float s = clamp((-dot(axis.xyz, direction) - axis.w) * cone.x, 0.0, 1.0);\n"
    "        if (!(s > 0.0)) continue;\n"
    "        light *= s * s * (3.0 - 2.0 * s);\n"
    "        float reach = max(distance - cone.y, 0.0);\n"
    "        if (middle.w >= 0.0 && reach > 0.0) light *= light_visible(int(middle.w), -way, side);\n"
    "        if (!(max(light.r, max(light.g, light.b)) > 0.0)) continue;\n"
    "        sum += light * light_transmittance(place, direction, reach);\n"
    "    }\n"
    "    return sum;\n"
    "}\n";

/* ---- light in fog ---------------------------------------------------------------------------------------------------
 * Where along a ray surfaces keep a point light's light away: looked up in steps of an angle as the point light sees
 * it, the end of such a place by halving. The nearer the ray is to the point light the brighter is what a step may pass
 * over, and the finer are steps; those of a few texels are the finest. */

const char nb_light_shade_text[] =
    "#define NEBEL_LIGHT_VISIBILITY(light, origin, direction, t, end) light_lit(light, origin, direction, t, end)\n"
    "bool light_reaches(int layer, vec3 at)\n"
    "{\n"
    "    light_face face = find_light_face(layer, at, vec3(0.0));\n"
    "    ivec2 texel = ivec2((face.at.xy / face.at.z * map_share * 0.5 + 0.5) * map_face);\n"
    "    return light_tap(face.corner + ivec3(texel, 0), 1.0 / face.at.z, 2.0 / map_face) > 0.0;\n"
    "}\n"
    "vec2 light_lit(int light, vec3 origin, vec3 direction, float t, float end)\n"
    "{\n"
    "    float layer = light < light_count ? light_texel(light, 3).z : -1.0;\n"
    "    if (layer < 0.0) return vec2(1.0, end);\n"
    "    vec3 from = origin - light_texel(light, 0).xyz;\n"
    "    float closest = -dot(from, direction), u = t - closest, last = end - closest;\n"
    "    vec3 foot = from + direction * closest;\n"
    "    float aside = max(length(foot), 1e-4), stride = clamp(0.03 * aside, 6.0 / map_face, 0.06);\n"
    "    bool lit = light_reaches(int(layer), foot + direction * u);\n"
    "    for (int i = 0; i < 1024; i++) {\n"
    "        if (!(u < last)) break;\n"
    "        float down = aside - u * stride, next = last;\n"
    "        if (down > 0.0) next = min(aside * (u + aside * stride) / down, last);\n"
    "        if (light_reaches(int(layer), foot + direction * next) != lit) {\n"
    "            for (int k = 0; k < 8; k++) {\n"
    "                float middle = 0.5 * (u + next);\n"
    "                if (light_reaches(int(layer), foot + direction * middle) == lit) u = middle;\n"
    "                else next = middle;\n"
    "            }\n"
    "            last = min(next, last);\n"
    "        }\n"
    "        u = next;\n"
    "    }\n"
    "    return vec2(lit ? 1.0 : 0.0, min(last + closest, end));\n"
    "}\n";
