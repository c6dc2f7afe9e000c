#include "scene_programs.h"

#include "aerial_text.h"
#include "classic_text.h"
#include "triangle_instances.h"
#include "light_maps.h"
#include "gl_panorama.h"
#include "particles_text.h"
#include "shaft_maps.h"
#include "textured_planet_text.h"
#include "surface_text.h"
#include "gl_targets.h"

#include <epoxy/gl.h>
#include <stdio.h>

_Static_assert((int)NB_SCENE_UNIT_END <= (int)NB_UNIT_AIR, "no unit is two");

/* ---- surfaces ------------------------------------------------------------------------------------------------------
 * Positions are relative to the eye. The distance of a surface is where the ray of the pixel's centre meets the plane
 * of the triangle, which the last vertex of each triangle brings: interpolation between far corners would be off by
 * more. */

static const char surface_vertex_text[] = "layout(location = 0) in vec3 mesh_position;\n"
                                          "layout(location = 1) in vec3 mesh_normal;\n"
                                          "layout(location = 2) in vec2 mesh_uv;\n"
                                          "layout(location = 3) in vec3 mesh_face;\n"
                                          "layout(location = 5) in vec3 mesh_edge_a;\n"
                                          "layout(location = 6) in vec3 mesh_edge_b;\n"
                                          "uniform mat4 scene_clip;\n"
                                          "uniform vec3 scene_offset;\n"
                                          "out vec3 surface_place;\n"
                                          "out vec3 surface_normal;\n"
                                          "out float surface_support;\n"
                                          "out vec2 surface_uv;\n"
                                          "flat out vec3 surface_corner;\n"
                                          "flat out vec3 surface_face;\n"
                                          "flat out vec3 surface_edge_a, surface_edge_b;\n"
                                          "void main()\n"
                                          "{\n"
                                          "    surface_place = surface_corner = mesh_position + scene_offset;\n"
                                          "    surface_edge_a = mesh_edge_a;\n"
                                          "    surface_edge_b = mesh_edge_b;\n"
                                          "    surface_normal = mesh_normal;\n"
                                          "    surface_support = dot(surface_place, mesh_normal);\n"
                                          "    surface_uv = mesh_uv;\n"
                                          "    surface_face = mesh_face;\n"
                                          "    gl_Position = scene_clip * vec4(surface_place, 1.0);\n"
                                          "}\n";

/* The ray of a pixel: scene_rays are the words of nebel_compute_view_rays, or of a panorama. */
const char nb_texel_texture_text[] = "uniform vec3 scene_rays[6];\n"
                                     "#define RAY_WORD(i) scene_rays[i]\n";

const char nb_ray_text[] = "vec3 ray_origin(vec2 pixel)\n"
                           "{\n"
                           "    return RAY_WORD(0) + pixel.x * RAY_WORD(1) + pixel.y * RAY_WORD(2);\n"
                           "}\n"
                           "vec3 ray_direction(vec2 pixel)\n"
                           "{\n"
                           "    return normalize(RAY_WORD(3) + pixel.x * RAY_WORD(4) + pixel.y * RAY_WORD(5));\n"
                           "}\n";

/* Where a ray grazes its triangle the plane alone would be met anywhere: the interpolated distance, which is off by
 * rounding of far corners only, bounds it. Depth is 1 at the eye and falls to 0: floats are as fine in all distances.
 */
static const char interpolated_text[] = "in vec3 surface_place;\n"
                                        "flat in vec3 surface_corner;\n"
                                        "flat in vec3 surface_face;\n";

/* A mask and its cutoff, which is 0 where there are no holes. */
static const char hole_text[] =
    "uniform float scene_cutoff;\n"
    "uniform highp sampler2D scene_mask;\n"
    "bool is_hole(vec2 uv) { return scene_cutoff > 0.0 && textureLod(scene_mask, uv, 0.0).a < scene_cutoff; }\n";

static const char attributes_text[] = "in vec3 surface_normal;\n"
                                      "in float surface_support;\n"
                                      "in vec2 surface_uv;\n"
                                      "flat in vec3 surface_edge_a, surface_edge_b;\n"
                                      "bool surface_is_met(vec3 direction) { return true; }\n";

/* rise: how far the round surface that the normals stand for lies above the triangle, as height_of_tangents of
 * the CPU renderer has it: sum w_i V_i . N_i, which is surface_support, less P . sum w_i N_i. */
static const char surface_fragment_text[] =
    "uniform vec3 scene_color;\n"
    "uniform bool scene_has_texture;\n"
    "uniform highp sampler2D scene_texture;\n"
    "uniform vec3 scene_sun;\n"    /* 0: none */
    "uniform float scene_reach;\n" /* where depth is 0.5 */
    "layout(location = 0) out vec4 out_place;\n"
    "layout(location = 1) out vec4 out_normal;\n"
    "layout(location = 2) out vec4 out_reflectance;\n"
    /* Whether the way to the sun from the round surface above a place (from the last corner) meets the triangle itself,
       which is too near for a shadow map. Where the round surface is none it does at once; a triangle with holes is left
       to the map. */
    "bool shades_itself(vec3 place, vec3 normal, float rise, vec3 side)\n"
    "{\n"
    "    float lean = dot(side, scene_sun);\n"
    "    if (lean > 0.0 || !(dot(normal, scene_sun) > 0.0)) return false;\n"
    "    if (!(rise > 1e-6 * length(surface_place))) return true;\n"
    "    if (scene_cutoff > 0.0) return false;\n"
    "    vec3 met = place + rise * (normal + scene_sun * (dot(side, normal) / max(-lean, 1e-9)));\n"
    "    float a = dot(cross(met, surface_edge_b), surface_face), b = dot(cross(surface_edge_a, met), surface_face);\n"
    "    return a >= 0.0 && b >= 0.0 && a + b <= dot(cross(surface_edge_a, surface_edge_b), surface_face);\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    vec3 origin = ray_origin(gl_FragCoord.xy), direction = ray_direction(gl_FragCoord.xy);\n"
    "    if (!surface_is_met(direction) || is_hole(surface_uv)) discard;\n"
    "    float t = surface_inset(origin, direction, surface_distance(origin, direction));\n"
    "    if (!(t > 0.0)) discard;\n"
    "    vec3 side = dot(surface_face, direction) > 0.0 ? -surface_face : surface_face;\n"
    "    float size = dot(surface_normal, surface_normal);\n"
    "    bool is_smooth = size > 1e-12 && size < 1e12;\n"
    "    float turn = is_smooth && dot(surface_normal, side) < 0.0 ? -1.0 : 1.0;\n"
    "    vec3 normal = is_smooth ? surface_normal * (turn * inversesqrt(size)) : side;\n"
    "    float rise = is_smooth ? max(turn * (surface_support - dot(surface_place, surface_normal)), 0.0) : 0.0;\n"
    "    if (shades_itself(origin + t * direction - surface_corner, normal, rise, side)) rise = -1.0;\n"
    "    vec3 reflectance = scene_color;\n"
    "    if (scene_has_texture) reflectance *= textureLod(scene_texture, surface_uv, 0.0).rgb;\n"
    "    out_place = vec4(t, side);\n"
    "    out_normal = vec4(normal, rise);\n"
    "    out_reflectance = vec4(reflectance, 0.0);\n"
    "    gl_FragDepth = surface_rank * scene_reach / (scene_reach + t);\n"
    "}\n";

/* ---- fog at vertices ------------------------------------------------------------------------- */

static const char vertex_fog_vertex_text[] = "layout(location = 0) in vec3 mesh_position;\n"
                                             "layout(location = 3) in vec3 mesh_face;\n"
                                             "layout(location = 4) in vec4 mesh_fog;\n"
                                             "layout(location = 5) in vec3 mesh_edge_a;\n"
                                             "layout(location = 6) in vec3 mesh_edge_b;\n"
                                             "uniform mat4 scene_clip;\n"
                                             "uniform vec3 scene_offset;\n"
                                             "out vec3 surface_place;\n"
                                             "out vec4 surface_fog;\n"
                                             "flat out vec3 surface_corner;\n"
                                             "flat out vec3 surface_face;\n"
                                             "flat out vec3 surface_edge_a, surface_edge_b;\n"
                                             "void main()\n"
                                             "{\n"
                                             "    surface_place = surface_corner = mesh_position + scene_offset;\n"
                                             "    surface_edge_a = mesh_edge_a;\n"
                                             "    surface_edge_b = mesh_edge_b;\n"
                                             "    surface_face = mesh_face;\n"
                                             "    surface_fog = mesh_fog;\n"
                                             "    gl_Position = scene_clip * vec4(surface_place, 1.0);\n"
                                             "}\n";

static const char fog_attribute_text[] = "in vec4 surface_fog;\n"
                                         "flat in vec3 surface_edge_a, surface_edge_b;\n"
                                         "bool surface_is_met(vec3 direction) { return true; }\n";

/* Of the surface that is seen alone; two programs need not find the same distance to the last bit. What is nearer is a
 * hole. */
static const char vertex_fog_fragment_text[] =
    "uniform highp sampler2D scene_place;\n"
    "uniform float scene_weakening;\n" /* 1: fog hides the surface, 0: it only adds */
    "layout(location = 0) out vec4 out_in_scattering;\n"
    "layout(location = 1) out vec4 out_transmittance;\n"
    "void main()\n"
    "{\n"
    "    vec3 direction = ray_direction(gl_FragCoord.xy);\n"
    "    if (!surface_is_met(direction)) discard;\n"
    "    vec3 origin = ray_origin(gl_FragCoord.xy);\n"
    "    float t = surface_inset(origin, direction, surface_distance(origin, direction));\n"
    "    float seen = texelFetch(scene_place, ivec2(gl_FragCoord.xy), 0).x;\n"
    "    if (!(t > 0.0 && t <= 1.0001 * seen) || (scene_cutoff > 0.0 && t < 0.999 * seen)) discard;\n"
    "    vec4 fog = surface_fog;\n"
    "    if (factor_mode >= 0) fog = (1.0 - fog_factor(fog.a)) * vec4(factor_color, 1.0);\n"
    /* Rounding leaves the range. */
    "    out_in_scattering = vec4(max(fog.rgb, 0.0), 1.0);\n"
    "    out_transmittance = vec4(vec3(clamp(1.0 - scene_weakening * fog.a, 0.0, 1.0)), 1.0);\n"
    "}\n";

/* ---- surfaces of panoramas
 * ------------------------------------------------------------------------------------------- Triangles are boxes here,
 * and fragments ask whether their rays hit. Edges count from the nearer of their ends, which neighbours choose alike:
 * no ray passes between them. */

static const char round_surface_vertex_text[] =
    "layout(location = 0) in mat3 corner_position;\n"
    "layout(location = 9) in vec3 corner_face;\n"
    "#ifdef SCENE_VERTEX_FOG\n"
    "layout(location = 10) in mat3x4 corner_fog;\n"
    "flat out mat3x4 corners_fog;\n"
    "#else\n"
    "layout(location = 3) in mat3 corner_normal;\n"
    "layout(location = 6) in mat3x2 corner_uv;\n"
    "flat out mat3 corners_normal;\n"
    "flat out mat3x2 corners_uv;\n"
    "#endif\n"
    "uniform vec3 scene_offset;\n"
    "flat out mat3 corners_place;\n"
    "flat out vec3 surface_face;\n"
    "void main()\n"
    "{\n"
    "    vec3 a = corner_position[0] + scene_offset, b = corner_position[1] + scene_offset,\n"
    "         c = corner_position[2] + scene_offset;\n"
    "    corners_place = mat3(a, b, c);\n"
    "    surface_face = corner_face;\n"
    "#ifdef SCENE_VERTEX_FOG\n"
    "    corners_fog = corner_fog;\n"
    "#else\n"
    "    corners_normal = corner_normal;\n"
    "    corners_uv = corner_uv;\n"
    "#endif\n"
    "    gl_Position = box_corner(box_of_three(a, b, c), gl_VertexID);\n"
    "}\n";

static const char round_surface_text[] =
    "flat in mat3 corners_place;\n"
    "flat in vec3 surface_face;\n"
    "vec3 surface_place, surface_corner;\n"
    "#ifdef SCENE_VERTEX_FOG\n"
    "flat in mat3x4 corners_fog;\n"
    "vec4 surface_fog;\n"
    "#else\n"
    "flat in mat3 corners_normal;\n"
    "flat in mat3x2 corners_uv;\n"
    "vec3 surface_normal, surface_edge_a, surface_edge_b;\n"
    "float surface_support;\n"
    "vec2 surface_uv;\n"
    "#endif\n"
    "bool surface_is_met(vec3 direction)\n"
    "{\n"
    "    vec2 a = edge_volume(direction, corners_place[1], corners_place[2]);\n"
    "    vec2 b = edge_volume(direction, corners_place[2], corners_place[0]);\n"
    "    vec2 c = edge_volume(direction, corners_place[0], corners_place[1]);\n"
    "    float whole = a.x + b.x + c.x, side = whole < 0.0 ? -1.0 : 1.0;\n"
    "    vec3 weights = side * vec3(a.x, b.x, c.x);\n"
    "    if (!(whole != 0.0 && all(greaterThanEqual(weights, -vec3(a.y, b.y, c.y))))) return false;\n"
    "    weights = max(weights, 0.0);\n"
    "    weights /= weights.x + weights.y + weights.z;\n"
    "    surface_corner = corners_place[2];\n"
    "    surface_place = corners_place * weights;\n"
    "#ifdef SCENE_VERTEX_FOG\n"
    "    surface_fog = corners_fog * weights;\n"
    "#else\n"
    "    surface_edge_a = corners_place[0] - surface_corner;\n"
    "    surface_edge_b = corners_place[1] - surface_corner;\n"
    "    surface_normal = corners_normal * weights;\n"
    "    surface_support = dot(weights, vec3(dot(corners_place[0], corners_normal[0]),\n"
    "        dot(corners_place[1], corners_normal[1]), dot(corners_place[2], corners_normal[2])));\n"
    "    surface_uv = corners_uv * weights;\n"
    "#endif\n"
    "    return true;\n"
    "}\n"
    "const float surface_rank = 1.0;\n"
    "float surface_inset(vec3 origin, vec3 direction, float t) { return t; }\n";

/* ---- shadow maps ---------------------------------------------------------------------------------------------------
 * Light coordinates are relative to the eye, too: across the sun's light, and against it. */

static const char shadow_vertex_text[] =
    "layout(location = 0) in vec3 mesh_position;\n"
    "layout(location = 2) in vec2 mesh_uv;\n"
    "out vec2 surface_uv;\n"
    "uniform vec3 scene_offset;\n"
    "uniform mat3 scene_light;\n" /* to light coordinates */
    "uniform vec3 map_low;\n"
    "uniform vec3 map_scale;\n" /* to 0 ... 2 */
    "void main()\n"
    "{\n"
    "    vec3 at = (scene_light * (mesh_position + scene_offset) - map_low) * map_scale - 1.0;\n"
    "    surface_uv = mesh_uv;\n"
    "    gl_Position = vec4(at.xy, -at.z, 1.0);\n"
    "}\n";

/* Depth at the farthest corner of the texel, as far as map_lean. */
static const char shadow_fragment_text[] =
    "in vec2 surface_uv;\n"
    "uniform float map_lean;\n"
    "void main()\n"
    "{\n"
    "    float lean = 0.5 * (abs(dFdx(gl_FragCoord.z)) + abs(dFdy(gl_FragCoord.z)));\n"
    "    if (is_hole(surface_uv)) discard;\n"
    "    gl_FragDepth = gl_FragCoord.z + min(lean, map_lean);\n"
    "}\n";

/* ---- light ----------------------------------------------------------------------------------- */

/* Each texel of the map is compared with the plane of the surface continued to the texel's centre, so that a surface
 * does not shade itself however it leans; `rise` is for neighbours that rise above that plane, map_heights.z for rounding. A
 * square of two texels smooths the edge.
 *
 * A texel in which the plane is far above what the sun sees lies beyond the end of the surface, and says nothing of it. Where
 * there are such texels, or where what rises is most of what is there, the surface may end at another that covers it, as a
 * wall under a ceiling: then what shades any texel shades the place. What steep surfaces shade near their end is uncertain by a texel
 * or two, so that a place which is partly lit is looked at again off its surface: a texel and a half, and where two texels lie
 * beside it. */
static const char shadow_text[] =
    "uniform mat3 scene_light;\n"
    "uniform highp sampler2DArray scene_shadows;\n"
    "uniform float map_size;\n"
    "uniform vec4 map_places[NB_CASCADES];\n" /* low corner in light coordinates, texels per metre */
    "uniform vec4 map_ends;\n"                /* distance up to which a map is the finest */
    "uniform vec3 map_heights;\n"             /* of depth 1 and of depth 0; what rounding may amount to */
    "float shadow_filter(int map, vec2 place, float height, vec2 slope)\n"
    "{\n"
    "    vec2 cell = 1.0 / map_places[map].zw, corner = floor(place), part = place - corner;\n"
    "    float rise = max(cell.x, cell.y) * (0.5 + 0.5 * length(slope));\n"
    "    vec2 lit = vec2(0.0);\n"
    "    float there = 0.0;\n"
    "    for (int y = -1; y <= 1; y++) {\n"
    "        for (int x = -1; x <= 1; x++) {\n"
    "            vec2 way = (vec2(float(x), float(y)) + 0.5 - part) * cell;\n"
    "            float weight = (x < 0 ? 1.0 - part.x : x > 0 ? part.x : 1.0) * (y < 0 ? 1.0 - part.y : y > 0 ? part.y "
    ": 1.0);\n"
    "            float depth = texelFetch(scene_shadows, ivec3(ivec2(corner) + ivec2(x, y), map), 0).x;\n"
    "            float above = mix(map_heights.y, map_heights.x, depth) - (height + dot(slope, way) + map_heights.z);\n"
    "            if (depth == 1.0 || above < -8.0 * rise) continue;\n"
    "            lit += weight * vec2(lessThanEqual(vec2(above), vec2(rise, 0.1 * rise)));\n"
    "            there += weight;\n"
    "        }\n"
    "    }\n"
    "    if (!(there > 0.0)) return 1.0;\n"
    "    if (there < 3.999) return lit.y < 0.999 * there ? 0.0 : 1.0;\n"
    "    return lit.x > lit.y && lit.y < 0.45 * there ? 0.0 : lit.x / there;\n"
    "}\n"
    "float shadow(vec3 at, vec3 side, float t)\n"
    "{\n"
    "    vec3 leaning = scene_light * side;\n"
    "    vec2 slope = -leaning.xy / max(leaning.z, 0.01);\n"
    "    for (int map = 0; map < NB_CASCADES; map++) {\n"
    "        vec2 place = (at.xy - map_places[map].xy) * map_places[map].zw;\n"
    "        bool inside = all(greaterThan(place, vec2(1.0))) && all(lessThan(place, vec2(map_size - 1.0)));\n"
    "        if (!(t <= map_ends[map] && inside)) continue;\n"
    "        float lit = shadow_filter(map, place, at.z, slope);\n"
    "        if (lit == 0.0 || lit == 1.0) return lit;\n"
    "        float cell = 1.0 / min(map_places[map].z, map_places[map].w);\n"
    "        vec2 beside = cell * vec2(1.5, 2.0 / max(length(leaning.xy), 0.2));\n"
    "        for (int i = 0; i < 2; i++) {\n"
    "            vec3 off = leaning * beside[i];\n"
    "            lit = min(lit, shadow_filter(map, place + off.xy * map_places[map].zw, at.z + off.z, slope));\n"
    "        }\n"
    "        return lit;\n"
    "    }\n"
    "    return 1.0;\n"
    "}\n";

/* How much of the sun's light comes through the fog to a place, which is `at` in light coordinates. */
static const char sun_text[] =
    "uniform vec3 scene_sun;\n"
    "#ifdef SCENE_DIMMED\n"
    "uniform highp sampler2D scene_dimming;\n" /* of the sun's light; alpha: of the sky's, under clouds */
    "#endif\n"
    "#ifdef NEBEL_TILES\n"
    "uniform vec4 tile_place;\n" /* low corner in light coordinates, pixels per metre */
    "uniform ivec4 tile_grid;\n" /* pixels in all, in a tile, and tiles in a row */
    "#endif\n"
    "vec3 sun_transmittance(vec3 place, vec2 at)\n"
    "{\n"
    "#if !defined(SCENE_FOG)\n"
    "    return vec3(1.0);\n"
    "#elif defined(NEBEL_TILES)\n"
    "    ivec2 pixel = clamp(ivec2((at - tile_place.xy) * tile_place.zw), ivec2(0), tile_grid.xy - 1);\n"
    "    ivec2 tile = pixel / tile_grid.z;\n"
    "    int entry = 2 * (tile.x + tile.y * tile_grid.w);\n"
    "    return nebel_transmit_shadow_list(place, scene_sun, 1e18, NEBEL_TILE_ENTRY(entry), NEBEL_TILE_ENTRY(entry + "
    "1));\n"
    "#else\n"
    "    return nebel_transmit_shadow(place, scene_sun, 1e18);\n"
    "#endif\n"
    "}\n";

/* One triangle that covers the picture. */
const char nb_whole_vertex_text[] =
    "void main()\n"
    "{\n"
    "    gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

/* The fog is that of particles here. */
static const char dimming_text[] = "uniform mat3 scene_light;\n"
                                   "uniform highp sampler2D scene_place;\n"
                                   "out highp vec4 out_dimming;\n"
                                   "void main()\n"
                                   "{\n"
                                   "    float t = texelFetch(scene_place, ivec2(gl_FragCoord.xy), 0).x;\n"
                                   "    vec3 at = ray_origin(gl_FragCoord.xy) + t * ray_direction(gl_FragCoord.xy);\n"
                                   "    out_dimming = vec4(1.0);\n"
                                   "    if (t > 0.0) out_dimming.rgb = sun_transmittance(at, (scene_light * at).xy);\n"
                                   "}\n";

static const char light_text[] =
    "uniform highp sampler2D scene_place, scene_normal, scene_reflectance, scene_in_scattering, scene_transmittance;\n"
    "uniform vec3 scene_background;\n"
    "#ifdef NEBEL_ENVIRONMENT\n" /* the scene's, whatever lights the fog: that is asked for transmittance alone */
    "uniform bool scene_shows_ambient;\n"
    "vec3 background(vec3 direction)\n"
    "{\n"
    "    return scene_shows_ambient ? nebel_evaluate_environment(direction) : scene_background;\n"
    "}\n"
    "vec3 ambient(vec3 normal) { return nebel_evaluate_environment_diffuse(normal); }\n"
    "#else\n"
    "uniform vec3 scene_ambient;\n"
    "vec3 background(vec3 direction) { return scene_background; }\n"
    "vec3 ambient(vec3 normal) { return scene_ambient; }\n"
    "#endif\n"
    "#ifdef SCENE_CLOUDS\n"
    "uniform highp sampler2D scene_clouds;\n"
    "#endif\n"
    "#ifdef SCENE_SHELLS\n"
    "uniform highp sampler2D scene_shells;\n"
    "uniform vec3 shell_ambient;\n"
    "#endif\n"
    "uniform vec3 scene_sunlight;\n" /* reflected by a white surface that faces the sun, before shadows and fog */
    "uniform float scene_share;\n"   /* of this sample */
    "uniform float scene_ahead;\n"   /* how far before the camera the eye is [m] */
    "layout(location = 0) out highp vec4 out_color;\n"
    "layout(location = 1) out highp vec4 out_transmittance;\n"
    "layout(location = 2) out highp vec4 out_in_scattering;\n"
    "layout(location = 3) out highp vec4 out_surface;\n"
    /* Triangles that face away from the sun where their normals do not are lit as the round surface that the normals
       stand for, unless they shade it themselves (rise -1). */
    "vec3 sunlight(vec3 place, vec3 normal, float rise, vec3 side, float t, vec3 shining)\n"
    "{\n"
    "#if !defined(SCENE_SUNLIT) && !defined(NEBEL_SKY_VIEW)\n"
    "    return vec3(0.0);\n"
    "#else\n"
    "    float cosine = dot(normal, scene_sun);\n"
    "    if (!(cosine > 0.0 && rise >= 0.0)) return vec3(0.0);\n"
    "    bool away = !(dot(side, scene_sun) > 0.0);\n"
    "    vec3 at = scene_light * (away ? place + rise * normal : place);\n"
    "#ifdef SCENE_SUNLIT\n"
    "    shining *= shadow(at, away ? normal : side, t);\n"
    "    if (shining == vec3(0.0)) return vec3(0.0);\n"
    "#endif\n"
    "    vec3 light = cosine * shining * sun_transmittance(place, at.xy);\n"
    "#ifdef SCENE_DIMMED\n"
    "    light *= texelFetch(scene_dimming, ivec2(gl_FragCoord.xy), 0).rgb;\n"
    "#endif\n"
    "    return light;\n"
    "#endif\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    ivec2 texel = ivec2(gl_FragCoord.xy);\n"
    "#ifdef SCENE_SURFACES\n"
    "    vec4 place = texelFetch(scene_place, texel, 0);\n"
    "#else\n"
    "    vec4 place = vec4(0.0);\n"
    "#endif\n"
    "#ifdef SCENE_IN_FOG\n"
    "    vec3 transmittance = texelFetch(scene_transmittance, texel, 0).rgb;\n"
    "    vec3 in_scattering = texelFetch(scene_in_scattering, texel, 0).rgb;\n"
    "#else\n"
    "    vec3 transmittance = vec3(1.0), in_scattering = vec3(0.0);\n"
    "#endif\n"
    "    device_open(transmittance, in_scattering);\n"
    "    see_through_veil(texel, transmittance, in_scattering);\n"
    "#ifdef SCENE_CLOUDS\n"
    "    vec4 clouds = texelFetch(scene_clouds, texel, 0);\n"
    "    transmittance *= clouds.a;\n"
    "    in_scattering = max(clouds.a * in_scattering + clouds.rgb, 0.0);\n"
    "#endif\n"
    "    vec4 normal = texelFetch(scene_normal, texel, 0);\n"
    "    vec3 direction = ray_direction(gl_FragCoord.xy), surface;\n"
    "    if (!(place.x > 0.0)) {\n"
    "        surface = background(direction);\n"
    "#ifdef NEBEL_SKY_VIEW\n"
    "        surface += sun_disc(direction, gl_FragCoord.xy);\n"
    "#endif\n"
    "    } else {\n"
    "        vec3 at = ray_origin(gl_FragCoord.xy) + place.x * direction;\n"
    "        vec4 reflectance = texelFetch(scene_reflectance, texel, 0);\n"
    "        vec3 light = ambient(normal.xyz), shining = scene_sunlight;\n"
    "#ifdef NEBEL_SKY_VIEW\n"
    "        if (reflectance.a > 0.5) light_ground(direction, at, light, shining);\n"
    "        else light_model(at, light, shining);\n"
    "#endif\n"
    "        light += sunlight(at, normal.xyz, normal.w, place.yzw, place.x, shining);\n"
    "#ifdef SCENE_POINT_LIT\n"
    "        light += point_light(at, normal.xyz, place.yzw);\n"
    "#endif\n"
    "#ifdef SCENE_SHELLS\n"
    "        if (reflectance.a > 0.5) light = max(dot(normal.xyz, scene_sun), 0.0) * scene_sunlight + shell_ambient;\n"
    "#endif\n"
    "        surface = reflectance.rgb * light;\n"
    "    }\n"
    "    float hit = place.x > 0.0 ? scene_share : 0.0;\n"
    "    surface = device_blend(surface);\n"
    "    vec3 color = transmittance * surface + in_scattering;\n"
    "    device_close(transmittance, in_scattering);\n"
    "#ifdef SCENE_SHELLS\n"
    "    vec4 shells = texelFetch(scene_shells, texel, 0);\n"
    "    color = shells.rgb + shells.a * color;\n"
    "#endif\n"
    "    out_color = vec4(scene_share * color, hit);\n"
    "    out_transmittance = vec4(scene_share * transmittance, scene_share);\n"
    "    out_in_scattering = vec4(scene_share * in_scattering, scene_share);\n"
    "    out_surface = place.x > 0.0 ? hit * vec4(normal.xyz, place.x + scene_ahead) : vec4(0.0);\n"
    "}\n";

/* ---- the survey ------------------------------------------------------------------------------ */

/* Of each block of pixels the nearest and the farthest surface, 0 where there is none; whether some pixel has none. */
static const char survey_text[] = "uniform highp sampler2D scene_place;\n"
                                  "uniform ivec2 scene_size;\n"
                                  "out highp vec4 out_distances;\n"
                                  "void main()\n"
                                  "{\n"
                                  "    ivec2 first = ivec2(gl_FragCoord.xy) * NB_SURVEY_BLOCK;\n"
                                  "    ivec2 end = min(first + NB_SURVEY_BLOCK, scene_size);\n"
                                  "    float nearest = 0.0, farthest = 0.0, open = 0.0;\n"
                                  "    for (int y = first.y; y < end.y; y++) {\n"
                                  "        for (int x = first.x; x < end.x; x++) {\n"
                                  "            float t = texelFetch(scene_place, ivec2(x, y), 0).x;\n"
                                  "            if (t > 0.0) nearest = nearest > 0.0 ? min(nearest, t) : t;\n"
                                  "            farthest = max(farthest, t);\n"
                                  "            if (!(t > 0.0)) open = 1.0;\n"
                                  "        }\n"
                                  "    }\n"
                                  "    out_distances = vec4(nearest, farthest, open, 0.0);\n"
                                  "}\n";

/* ---- programs -------------------------------------------------------------------------------- */

static const char *precision_of(const nb_context *context)
{
    return context->es ? "precision highp float;\nprecision highp int;\n" : "";
}

static void set_unit(unsigned program, const char *sampler, int unit)
{
    glUniform1i(glGetUniformLocation(program, sampler), unit);
}

nebel_result nb_scene_programs_make(nb_scene_programs *shading, const nb_context *context, const nebel_log *log)
{
    const char *const version = nb_program_version(context), *const precision = precision_of(context);
    const nb_shader_parts surface_vertex = {{version, surface_vertex_text}, 2};
    const nb_shader_parts surface_fragment = {
        {version, precision, nb_texel_texture_text, nb_ray_text, interpolated_text, attributes_text,
         nb_surface_edge_text, nb_surface_distance_text, nb_surface_inset_text, hole_text, surface_fragment_text},
        11};
    char block[64];
    (void)snprintf(block, sizeof block, "#define NB_SURVEY_BLOCK %d\n", (int)NB_SURVEY_BLOCK);
    const nb_shader_parts survey_vertex = {{version, nb_whole_vertex_text}, 2};
    const nb_shader_parts survey_fragment = {{version, precision, block, survey_text}, 4};
    const nb_shader_parts shadow_vertex = {{version, shadow_vertex_text}, 2};
    const nb_shader_parts shadow_fragment = {{version, precision, hole_text, shadow_fragment_text}, 4};
    nebel_result result = nb_program_build(log, &surface_vertex, &surface_fragment, &shading->surface);
    if (result == NEBEL_OK) result = nb_program_build(log, &survey_vertex, &survey_fragment, &shading->survey);
    if (result == NEBEL_OK) result = nb_program_build(log, &shadow_vertex, &shadow_fragment, &shading->shadow);
    if (result != NEBEL_OK) return result;
    glUseProgram(shading->surface);
    set_unit(shading->surface, "scene_texture", NB_UNIT_REFLECTANCE);
    set_unit(shading->surface, "scene_mask", NB_UNIT_MASK);
    glUseProgram(shading->shadow);
    set_unit(shading->shadow, "scene_mask", NB_UNIT_MASK);
    glUseProgram(shading->survey);
    set_unit(shading->survey, "scene_place", NB_UNIT_PLACE);
    return NEBEL_OK;
}

nebel_result nb_scene_programs_make_vertex_fog(nb_scene_programs *shading, const nb_context *context,
                                               const nebel_log *log)
{
    const char *const version = nb_program_version(context);
    const nb_shader_parts vertex = {{version, vertex_fog_vertex_text}, 2};
    const nb_shader_parts fragment = {{version, precision_of(context), nb_texel_texture_text, nb_ray_text,
                                       interpolated_text, fog_attribute_text, nb_surface_edge_text,
                                       nb_surface_distance_text, nb_surface_inset_text, hole_text, nb_factor_text,
                                       vertex_fog_fragment_text},
                                      12};
    if (shading->vertex_fog != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, &shading->vertex_fog);
    if (result != NEBEL_OK) return result;
    glUseProgram(shading->vertex_fog);
    set_unit(shading->vertex_fog, "scene_place", NB_UNIT_PLACE);
    return NEBEL_OK;
}

nebel_result nb_scene_programs_make_light_map(nb_scene_programs *shading, const nb_context *context,
                                              const nebel_log *log)
{
    const char *const version = nb_program_version(context);
    const nb_shader_parts vertex = {{version, nb_light_map_vertex_text}, 2};
    const nb_shader_parts fragment = {{version, precision_of(context), hole_text, nb_light_map_fragment_text}, 4};
    if (shading->light_map != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, &shading->light_map);
    if (result != NEBEL_OK) return result;
    glUseProgram(shading->light_map);
    set_unit(shading->light_map, "scene_mask", NB_UNIT_MASK);
    return NEBEL_OK;
}

nebel_result nb_scene_programs_make_factor(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                           int panorama)
{
    const char *const version = nb_program_version(context), *const ray = panorama ? nb_panorama_ray_text : nb_ray_text;
    const nb_shader_parts vertex = {{version, nb_whole_vertex_text}, 2};
    const nb_shader_parts fragment = {
        {version, precision_of(context), nb_texel_texture_text, ray, nb_factor_text, nb_pixel_factor_text}, 6};
    unsigned *const name = panorama ? &shading->round_factor : &shading->factor;
    if (*name != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, name);
    if (result != NEBEL_OK) return result;
    glUseProgram(*name);
    set_unit(*name, "scene_place", NB_UNIT_PLACE);
    return NEBEL_OK;
}

nebel_result nb_scene_programs_make_ground(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                           int panorama, int worlds)
{
    const char *const fog = nebel_get_shader_source(context->es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330);
    char head[NB_AIR_HEAD];
    const nb_shader_parts vertex = {{nb_program_version(context), nb_whole_vertex_text}, 2};
    const nb_shader_parts fragment = {
        {nb_program_version(context), nb_air_head(worlds, head), precision_of(context), nb_air_words_text, fog,
         nb_texel_texture_text, panorama ? nb_panorama_ray_text : nb_ray_text, nb_air_planets_text, nb_air_ground_text},
        9};
    unsigned *const name = panorama ? &shading->round_ground : &shading->ground;
    if (shading->ground_worlds != worlds) {
        glDeleteProgram(shading->ground);
        glDeleteProgram(shading->round_ground);
        shading->ground = shading->round_ground = 0;
        shading->ground_worlds = worlds;
    }
    if (*name != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, name);
    if (result != NEBEL_OK) return result;
    glUseProgram(*name);
    set_unit(*name, "nebel_sky_view_texture", NB_UNIT_AIR);
    return NEBEL_OK;
}

/* A program of panoramas' surfaces; what it looks up is on `unit`. */
static nebel_result make_round(const nb_context *context, const nebel_log *log, const char *option,
                               const char *fragment_text, const char *sampler, int unit, unsigned *name)
{
    const char *const version = nb_program_version(context), *const precision = precision_of(context);
    const nb_shader_parts vertex = {
        {version, option, nb_texel_texture_text, nb_panorama_box_text, round_surface_vertex_text}, 5};
    const nb_shader_parts fragment = {{version, option, precision, nb_texel_texture_text, nb_panorama_ray_text,
                                       nb_surface_edge_text, round_surface_text, nb_surface_distance_text, hole_text,
                                       nb_factor_text, fragment_text},
                                      11};
    if (*name != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, name);
    if (result != NEBEL_OK) return result;
    glUseProgram(*name);
    set_unit(*name, sampler, unit);
    set_unit(*name, "scene_mask", NB_UNIT_MASK);
    return NEBEL_OK;
}

nebel_result nb_scene_programs_make_round(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                          int with_fog)
{
    const nebel_result result = make_round(context, log, "", surface_fragment_text, "scene_texture",
                                           NB_UNIT_REFLECTANCE, &shading->round_surface);
    if (result != NEBEL_OK || !with_fog) return result;
    return make_round(context, log, "#define SCENE_VERTEX_FOG\n", vertex_fog_fragment_text, "scene_place",
                      NB_UNIT_PLACE, &shading->round_vertex_fog);
}

static void write_composite_head(const nb_context *context, const nb_composite_key *kind, char *text, size_t size)
{
    char limits[128], air[NB_AIR_HEAD];
    (void)snprintf(
        text, size,
        "%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s#define SCENE_PARTICLES %d\n#define SCENE_VEIL_LAYERS %d\n#define "
        "NB_CASCADES "
        "%d\n#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n%s",
        nb_program_version(context), nb_program_limits(context, "", limits, sizeof limits),
        kind->has_fog ? "#define SCENE_FOG\n" : "", kind->has_surfaces ? "#define SCENE_SURFACES\n" : "",
        kind->in_fog ? "#define SCENE_IN_FOG\n" : "", kind->dimmed ? "#define SCENE_DIMMED\n" : "",
        kind->sunlit ? "#define SCENE_SUNLIT\n" : "", kind->lights ? "#define SCENE_POINT_LIT\n" : "",
        kind->panorama ? "#define SCENE_PANORAMA\n" : "", kind->of_particles ? "#define NEBEL_TRANSPARENT\n" : "",
        kind->in_texture ? "#define NEBEL_FOG_TEXTURE\n" : "", kind->tiled ? "#define NEBEL_TILES\n" : "",
        (kind->features & NEBEL_FEATURE_GRID) != 0 ? "#define NEBEL_VOXELS\n" : "",
        (kind->features & NEBEL_FEATURE_DIFFUSION) != 0 ? "#define NEBEL_DIFFUSION\n" : "",
        kind->environment || (kind->features & NEBEL_FEATURE_ENVIRONMENT) != 0 ? "#define NEBEL_ENVIRONMENT\n" : "",
        nb_air_head(kind->air, air), kind->shells ? "#define SCENE_SHELLS\n" : "",
        kind->clouds ? "#define SCENE_CLOUDS\n" : "", kind->of_particles, kind->veil_layers, NB_CASCADES,
        (unsigned)kind->features, precision_of(context));
}

static void set_composite_units(unsigned program)
{
    const unsigned block = glGetUniformBlockIndex(program, "nebel_fog_block");
    if (block != GL_INVALID_INDEX) glUniformBlockBinding(program, block, 0);
    glUseProgram(program);
    set_unit(program, "nebel_fog_texture", NB_UNIT_FOG);
    set_unit(program, "nebel_tile_texture", NB_UNIT_TILES);
    set_unit(program, "nebel_voxel_texture", NB_UNIT_VOXELS);
    set_unit(program, "nebel_diffusion_texture", NB_UNIT_NODES);
    set_unit(program, "nebel_environment_texture", NB_UNIT_ENVIRONMENT);
    set_unit(program, "scene_place", NB_UNIT_PLACE);
    set_unit(program, "scene_depth", NB_UNIT_PLACE);
    set_unit(program, "scene_normal", NB_UNIT_NORMAL);
    set_unit(program, "scene_reflectance", NB_UNIT_REFLECTANCE);
    set_unit(program, "scene_in_scattering", NB_UNIT_IN_SCATTERING);
    set_unit(program, "scene_transmittance", NB_UNIT_TRANSMITTANCE);
    set_unit(program, "scene_shadows", NB_UNIT_SHADOWS);
    set_unit(program, "scene_dimming", NB_UNIT_DIMMING);
    set_unit(program, "scene_veil", NB_UNIT_VEIL);
    set_unit(program, "scene_lights", NB_UNIT_LIGHTS);
    set_unit(program, "light_maps", NB_UNIT_LIGHT_MAPS);
    set_unit(program, "nebel_sky_view_texture", NB_UNIT_AIR);
    set_unit(program, "scene_shells", NB_UNIT_SHELLS);
    set_unit(program, "scene_clouds", NB_UNIT_CLOUDS);
    set_unit(program, "shell_seen", NB_UNIT_REFLECTANCE);
}

static nb_shader_parts light_vertex(const nb_context *context, const nb_composite_key *kind)
{
    const char *const version = nb_program_version(context);
    if (!kind->of_particles) return (nb_shader_parts){{version, nb_whole_vertex_text}, 2};
    if (!kind->panorama) return (nb_shader_parts){{version, nb_particle_vertex_text}, 2};
    return (nb_shader_parts){{version, nb_texel_texture_text, nb_panorama_box_text, nb_round_particle_vertex_text}, 4};
}

static nebel_result make_light(const nb_context *context, const nebel_log *log, const nb_composite_key *kind,
                               unsigned *name)
{
    char head[1280];
    write_composite_head(context, kind, head, sizeof head);
    const char *const fog = nebel_get_shader_source(context->es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330);
    const char *const ray = kind->panorama ? nb_panorama_ray_text : nb_ray_text;
    const char *const tile = kind->panorama && kind->tiled ? nb_panorama_tile_text : "";
    const nb_shader_parts light = {{head, kind->air ? nb_air_words_text : "",
                                    kind->has_fog || kind->environment || kind->air ? fog : "", nb_texel_texture_text,
                                    ray, shadow_text, sun_text, kind->lights ? nb_light_map_text : "",
                                    kind->lights ? nb_light_text : "", kind->air ? nb_air_planets_text : "",
                                    kind->air ? nb_air_places_text : "", kind->air ? nb_air_sun_text : "",
                                    kind->air ? nb_air_light_text : "", nb_veil_text, nb_device_text, light_text},
                                   16};
    const nb_shader_parts shell = {{head, nb_veil_text, nb_shell_over_text}, 3};
    const nb_shader_parts dimming = {{head, fog, nb_texel_texture_text, ray, sun_text, dimming_text}, 6};
    const nb_shader_parts particle = {{head, kind->five_taps ? nb_five_tap_text : "", kind->shafts ? nb_shaft_text : "",
                                       fog, nb_texel_texture_text, ray, tile, nb_particle_start_text, nb_particle_text},
                                      9};
    const nb_shader_parts vertex = light_vertex(context, kind);
    const nebel_result result = nb_program_build(log, &vertex,
                                                 kind->of_particles ? &particle
                                                 : kind->of_dimming ? &dimming
                                                 : kind->of_shells  ? &shell
                                                                    : &light,
                                                 name);
    if (result == NEBEL_OK) set_composite_units(*name);
    return result;
}

static int is_same_composite(const nb_composite_key *a, const nb_composite_key *b)
{
    return a->of_particles == b->of_particles && a->of_dimming == b->of_dimming && a->dimmed == b->dimmed &&
           a->sunlit == b->sunlit && a->environment == b->environment && a->lights == b->lights &&
           a->five_taps == b->five_taps && a->veil_layers == b->veil_layers && a->panorama == b->panorama &&
           a->has_surfaces == b->has_surfaces && a->in_fog == b->in_fog && a->has_fog == b->has_fog &&
           a->shafts == b->shafts && a->air == b->air && a->shells == b->shells && a->of_shells == b->of_shells &&
           a->clouds == b->clouds && a->in_texture == b->in_texture && a->tiled == b->tiled &&
           a->features == b->features;
}

nebel_result nb_scene_programs_find_light(nb_scene_programs *shading, const nb_context *context,
                                          const nebel_allocator *allocator, const nebel_log *log,
                                          const nb_composite_key *kind, unsigned *program)
{
    for (size_t i = 0; i < shading->light_count; i++) {
        *program = shading->lights[i].name;
        if (is_same_composite(&shading->lights[i].kind, kind)) return NEBEL_OK;
    }
    void *list = shading->lights;
    if (!nb_grow(allocator, &list, sizeof *shading->lights, shading->light_count, &shading->light_capacity,
                 shading->light_count + 1)) {
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory");
    }
    shading->lights = list;
    const nebel_result result = make_light(context, log, kind, program);
    if (result == NEBEL_OK) shading->lights[shading->light_count++] = (nb_composite_program){*kind, *program};
    return result;
}

void nb_scene_programs_delete(const nb_scene_programs *shading)
{
    glDeleteProgram(shading->surface);
    glDeleteProgram(shading->survey);
    glDeleteProgram(shading->shadow);
    glDeleteProgram(shading->vertex_fog);
    glDeleteProgram(shading->round_surface);
    glDeleteProgram(shading->round_vertex_fog);
    glDeleteProgram(shading->factor);
    glDeleteProgram(shading->round_factor);
    glDeleteProgram(shading->ground);
    glDeleteProgram(shading->round_ground);
    glDeleteProgram(shading->light_map);
    for (size_t i = 0; i < shading->light_count; i++) glDeleteProgram(shading->lights[i].name);
}
