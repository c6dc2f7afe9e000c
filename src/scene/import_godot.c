/* Godot 4: the fog of an Environment, its volumetric fog, FogVolume with FogMaterial. Our axes and metres. */
#include "scene/import.h"

#include <math.h>

#define LN2 0.69314718055994530942

/* Color(r, g, b, a) holds sRGB values, also beyond 1. */
static bool read_color(nb_json *json, const nb_json_node *node, const nb_range *range, double color[3])
{
    double rgba[4];
    if (node == NULL || node->type != NB_JSON_ARRAY) return nb_key_value_color(json, node, range, color);
    if (!nb_key_value_numbers(json, node, range, node->count == 4 ? 4 : 3, rgba)) return false;
    for (int c = 0; c < 3; c++) color[c] = nb_key_value_linear_from_srgb(rgba[c]);
    return true;
}

/* ---- fog of the environment ------------------------------------------------------------------ */

bool nb_import_godot_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, MODE, DENSITY, COLOR, ENERGY, HEIGHT_DENSITY, COUNT };
    static const char *const names[] = {
        "type", "fog_mode", "fog_density", "fog_light_color", "fog_light_energy", "fog_height_density"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a godot_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double density = 0.01, energy = 1;
    double color[3] = {nb_key_value_linear_from_srgb(0.518), nb_key_value_linear_from_srgb(0.553),
                       nb_key_value_linear_from_srgb(0.608)};
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_import_refuse_other(json, found[MODE], 0, "depth fog is not the integral of a density") ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_amount, &density) ||
        !read_color(json, found[COLOR], &nb_range_light, color) ||
        !nb_key_value_number(json, found[ENERGY], &nb_range_light, &energy) ||
        !nb_import_refuse_other(json, found[HEIGHT_DENSITY], 0,
                                "Godot's height fog depends on the height of the surface alone"))
        return false;
    fog->volumes[0] = nb_import_world(density);
    for (int c = 0; c < 3; c++) fog->volumes[0].source[c] = color[c] * energy;
    fog->causes[0].source = nb_import_either(found[COLOR], found[ENERGY]);
    fog->count = 1;
    return true;
}

/* Of an Environment, whose volumetric fog and fog volumes have one phase function. */
static const double usual_anisotropy = 0.2;

bool nb_import_godot_volumetric_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, DENSITY, ALBEDO, EMISSION, ENERGY, ANISOTROPY, COUNT };
    static const char *const names[] = {"type",
                                        "volumetric_fog_density",
                                        "volumetric_fog_albedo",
                                        "volumetric_fog_emission",
                                        "volumetric_fog_emission_energy",
                                        "volumetric_fog_anisotropy"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a godot_volumetric_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double density = 0.05, albedo[3] = {1, 1, 1}, emission[3] = {0}, energy = 1;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_amount, &density) ||
        !read_color(json, found[ALBEDO], &nb_range_fraction, albedo) ||
        !read_color(json, found[EMISSION], &nb_range_light, emission) ||
        !nb_key_value_number(json, found[ENERGY], &nb_range_light, &energy))
        return false;
    fog->volumes[0] = nb_import_world(density);
    if (!nb_import_phase(json, found[ANISOTROPY], usual_anisotropy, &fog->volumes[0].phase)) return false;
    for (int c = 0; c < 3; c++) {
        fog->volumes[0].albedo[c] = albedo[c];
        fog->volumes[0].emission[c] = emission[c] * energy * density;
    }
    fog->causes[0].emission = nb_import_either(found[EMISSION], found[ENERGY]);
    fog->count = 1;
    return true;
}

/* ---- fog volumes ----------------------------------------------------------------------------- */

enum { ELLIPSOID, CONE, CYLINDER, BOX, WORLD, SHAPE_COUNT };

/* The largest upright shape that fits into `size`; cylinders and cones are round. */
static void set_shape(nebel_shape *shape, int kind, const double size[3])
{
    static const nebel_shape_type types[SHAPE_COUNT] = {NEBEL_SHAPE_ELLIPSOID, NEBEL_SHAPE_CONE, NEBEL_SHAPE_CYLINDER,
                                                        NEBEL_SHAPE_BOX, NEBEL_SHAPE_WORLD};
    shape->type = types[kind];
    for (int i = 0; i < 3; i++) {
        shape->radii[i] = shape->max[i] = size[i] / 2;
        shape->min[i] = -size[i] / 2;
    }
    shape->from[1] = -size[1] / 2;
    shape->to[1] = size[1] / 2;
    shape->radius = shape->radius_from = fmin(size[0], size[2]) / 2;
}

/* The engine's density is the depth below the surface, in terms of half the least size, to the power of `fade`. A soft
 * edge rises linearly; this one has as much fog on the way from a face to that depth, and is the same where the power
 * is 1. */
static double edge_of(const double size[3], double fade)
{
    const double depth = fmin(size[0], fmin(size[1], size[2])) / 2;
    return fade <= 1 ? depth * 2 * fade / (1 + fade) : depth * (1 + fade) / 2;
}

/* The nearest face counts, as in the engine; the soft edge of a box is the product over its axes. */
static bool make_faces(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape)
{
    nebel_plane *planes = nb_arena_allocate(&in->scene->arena, 6, sizeof *planes);
    if (planes == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    for (int i = 0; i < 3; i++) {
        planes[2 * i] = planes[2 * i + 1] = (nebel_plane){.distance = shape->max[i]};
        planes[2 * i].normal[i] = 1;
        planes[2 * i + 1].normal[i] = -1;
    }
    shape->type = NEBEL_SHAPE_CONVEX;
    shape->planes = planes;
    shape->plane_count = 6;
    return true;
}

static bool soften(nb_scene_reader *in, const nb_json_node *node, nebel_volume_desc *volume, double edge)
{
    if (edge == 0 || volume->shape.type == NEBEL_SHAPE_WORLD) return true;
    volume->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = edge};
    return volume->shape.type != NEBEL_SHAPE_BOX || make_faces(in, node, &volume->shape);
}

/* Three rows of the basis, then the origin, as in a scene file. */
static bool read_godot_transform(nb_json *json, const nb_json_node *node, nebel_transform *transform)
{
    double numbers[12];
    nb_affine map;
    if (node == NULL) return true;
    if (!nb_key_value_numbers(json, node, &nb_range_any, 12, numbers)) return false;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) map.m[i][j] = numbers[3 * i + j];
        map.m[i][3] = numbers[9 + i];
    }
    return nb_affine_to_transform(&map, transform) ||
           nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is flat or sheared; a volume needs a basis of right angles");
}

bool nb_import_godot_fog_volume(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, SHAPE, SIZE, TRANSFORM, DENSITY, ALBEDO, EMISSION, FALLOFF, FADE, ANISOTROPY, COUNT };
    static const char *const names[] = {
        "type",   "shape",    "size",           "transform", "density",
        "albedo", "emission", "height_falloff", "edge_fade", "volumetric_fog_anisotropy"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a godot_fog_volume"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    int shape = BOX;
    double size[3] = {2, 2, 2}, density = 1, falloff = 0, emission[3] = {0}, fade = 0.1;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(0);
    for (int c = 0; c < 3; c++) volume->albedo[c] = 1;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_integer(json, found[SHAPE], 0, WORLD, &shape) ||
        !nb_key_value_numbers(json, found[SIZE], &nb_range_extent, 3, size) ||
        !read_godot_transform(json, found[TRANSFORM], &volume->shape.transform) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_amount, &density) ||
        !read_color(json, found[ALBEDO], &nb_range_fraction, volume->albedo) ||
        !read_color(json, found[EMISSION], &nb_range_light, emission) ||
        !nb_key_value_number(json, found[FALLOFF], &nb_range_light, &falloff) ||
        !nb_key_value_number(json, found[FADE], &nb_range_light, &fade) ||
        !nb_import_phase(json, found[ANISOTROPY], usual_anisotropy, &volume->phase))
        return false;
    set_shape(&volume->shape, shape, size);
    for (int c = 0; c < 3; c++) {
        volume->extinction[c] = density;
        volume->emission[c] = emission[c] * density;
    }
    fog->causes[0] = (nb_import_causes){.emission = found[EMISSION],
                                        .scale_height = found[FALLOFF],
                                        .base = found[TRANSFORM],
                                        .edge = nb_import_either(found[FADE], found[SIZE]),
                                        .lengths = found[SIZE],
                                        .placement = found[TRANSFORM]};
    fog->count = 1;
    if (falloff == 0) return soften(in, node, volume, edge_of(size, fade));
    nb_import_set_height(volume, volume->shape.transform.position[1], 1 / (falloff * LN2), NEBEL_BELOW_CONSTANT);
    return true;
}
