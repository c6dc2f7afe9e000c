#include "scene/import.h"

static const struct {
    bool (*read)(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
} importers[] = {
    {nb_import_unreal_height_fog},    {nb_import_unreal_local_fog},  {nb_import_godot_fog},
    {nb_import_godot_volumetric_fog}, {nb_import_godot_fog_volume},  {nb_import_hdrp_fog},
    {nb_import_hdrp_local_fog},       {nb_import_bevy_distance_fog}, {nb_import_bevy_fog_volume},
};

enum { IMPORTER_COUNT = sizeof importers / sizeof *importers };

bool nb_read_import(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    static const char *const types[IMPORTER_COUNT] = {
        "unreal_height_fog",         "unreal_local_fog_volume", "godot_fog",
        "godot_volumetric_fog",      "godot_fog_volume",        "hdrp_fog",
        "hdrp_local_volumetric_fog", "bevy_distance_fog",       "bevy_fog_volume"};
    const int type = nb_value_type(in->json, node, types, IMPORTER_COUNT);
    return type >= 0 && importers[type].read(in, node, fog);
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

bool nb_import_refuse_other(nb_json *json, const nb_json_node *node, double neutral, const char *reason)
{
    double value = neutral;
    if (!nb_value_number(json, node, &nb_range_any, &value)) return false;
    return value == neutral || nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, node, "is %.15g; %s, so it must be %.15g",
                                            value, reason, neutral);
}
