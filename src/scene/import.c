#include "scene/import.h"

static const struct {
    bool (*read)(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
} importers[] = {
    {nb_import_unreal_height_fog},    {nb_import_unreal_local_fog},  {nb_import_godot_fog},
    {nb_import_godot_volumetric_fog}, {nb_import_godot_fog_volume},  {nb_import_hdrp_fog},
    {nb_import_hdrp_local_fog},       {nb_import_bevy_distance_fog}, {nb_import_bevy_fog_volume},
};

enum { IMPORTER_COUNT = sizeof importers / sizeof *importers };

/* ---- what settings make together ------------------------------------------------------------- */

/* In metres, whatever the unit of the settings. */
static bool check(nb_json *json, const nb_json_node *cause, const char *what, const double *numbers, int count,
                  const nb_range *range)
{
    char wanted[NB_RANGE_TEXT];
    for (int i = 0; i < count; i++)
        if (!nb_range_holds(range, 1, numbers[i]))
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, cause, "makes %s %.15g; must be %s", what, numbers[i],
                                nb_range_describe(range, 1, wanted));
    return true;
}

static bool check_light(nb_json *json, const nb_json_node *node, const nb_import_causes *from,
                        const nebel_volume_desc *volume)
{
    return check(json, nb_import_either(from->extinction, node), "the extinction", volume->extinction, 3,
                 &nb_range_amount) &&
           check(json, nb_import_either(from->source, node), "the source", volume->source, 3, &nb_range_light) &&
           check(json, nb_import_either(from->emission, node), "the emission", volume->emission, 3, &nb_range_amount);
}

static bool check_density(nb_json *json, const nb_json_node *node, const nb_import_causes *from,
                          const nebel_density *density)
{
    if (density->type == NEBEL_DENSITY_HEIGHT)
        return check(json, nb_import_either(from->base, node), "the base", &density->base, 1, &nb_range_place) &&
               check(json, nb_import_either(from->scale_height, node), "the scale height", &density->scale_height, 1,
                     &nb_range_extent);
    return density->type != NEBEL_DENSITY_SOFT_EDGE ||
           check(json, nb_import_either(from->edge, node), "the depth of the edge", &density->edge_width, 1,
                 &nb_range_extent);
}

static bool check_placement(nb_json *json, const nb_json_node *node, const nb_import_causes *from,
                            const nebel_transform *transform)
{
    const nb_json_node *cause = nb_import_either(from->placement, node);
    return check(json, cause, "a coordinate of the place", transform->position, 3, &nb_range_place) &&
           check(json, cause, "the scale", transform->scale, 3, &nb_range_factor);
}

static bool check_imported_shape(nb_json *json, const nb_json_node *node, const nb_import_causes *from,
                                 const nebel_shape *shape)
{
    const nb_json_node *cause = nb_import_either(from->lengths, node);
    const bool has_radius =
        shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_CYLINDER || shape->type == NEBEL_SHAPE_CONE;
    const double radius = shape->type == NEBEL_SHAPE_CONE ? shape->radius_from : shape->radius;
    if (has_radius && !check(json, cause, "the radius", &radius, 1, &nb_range_extent)) return false;
    if (shape->type == NEBEL_SHAPE_CYLINDER || shape->type == NEBEL_SHAPE_CONE)
        return nb_keys_read_check_apart(json, cause, "from", shape->from, shape->to);
    if (shape->type == NEBEL_SHAPE_ELLIPSOID) return check(json, cause, "a radius", shape->radii, 3, &nb_range_extent);
    return true;
}

static bool check_numbers(nb_json *json, const nb_json_node *node, const nb_import *fog)
{
    for (size_t i = 0; i < fog->count; i++) {
        const nb_import_causes *from = &fog->causes[i];
        const nebel_volume_desc *volume = &fog->volumes[i];
        if (!check_light(json, node, from, volume) || !check_density(json, node, from, &volume->density) ||
            !check_placement(json, node, from, &volume->shape.transform) ||
            !check_imported_shape(json, node, from, &volume->shape))
            return false;
    }
    return true;
}

bool nb_keys_read_import(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    static const char *const types[IMPORTER_COUNT] = {
        "unreal_height_fog",         "unreal_local_fog_volume", "godot_fog",
        "godot_volumetric_fog",      "godot_fog_volume",        "hdrp_fog",
        "hdrp_local_volumetric_fog", "bevy_distance_fog",       "bevy_fog_volume"};
    const int type = nb_key_value_type(in->json, node, types, IMPORTER_COUNT);
    const double unit = in->json->unit;
    in->json->unit = 1;
    const bool good = type >= 0 && importers[type].read(in, node, fog) && check_numbers(in->json, node, fog);
    in->json->unit = unit;
    return good;
}

const nb_json_node *nb_import_either(const nb_json_node *first, const nb_json_node *second)
{
    return first != NULL ? first : second;
}

nebel_volume_desc nb_import_world(double extinction)
{
    return (nebel_volume_desc){
        .shape = {.type = NEBEL_SHAPE_WORLD, .transform = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}}},
        .extinction = {extinction, extinction, extinction}};
}

void nb_import_set_height(nebel_volume_desc *volume, double base, double scale_height, nebel_below below)
{
    volume->density =
        (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .below = below, .base = base, .scale_height = scale_height};
}

bool nb_import_phase(nb_json *json, const nb_json_node *node, double usual, nebel_phase *phase)
{
    phase->g = usual;
    if (!nb_key_value_number(json, node, &nb_range_asymmetry, &phase->g)) return false;
    phase->type = phase->g != 0 ? NEBEL_PHASE_HENYEY_GREENSTEIN : NEBEL_PHASE_ISOTROPIC;
    return true;
}

bool nb_import_refuse_other(nb_json *json, const nb_json_node *node, double neutral, const char *reason)
{
    double value = neutral;
    if (!nb_key_value_number(json, node, &nb_range_any, &value)) return false;
    return value == neutral || nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, node, "is %.15g; %s, so it must be %.15g",
                                            value, reason, neutral);
}
