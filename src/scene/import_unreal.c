/* Unreal Engine 4 and 5: exponential height fog, local fog volumes. Centimetres, z up, left-handed. */
#include "scene/import.h"

#include <math.h>

#define LN2 0.69314718055994530942

static const double centimetre = 0.01;

/* As the engine's own glTF exporter does it, so that models exported from there fit. */
static void convert_location(double location[3])
{
    const double y = location[1];
    location[1] = location[2];
    location[2] = y;
    for (int i = 0; i < 3; i++) location[i] *= centimetre;
}

/* ---- height fog ------------------------------------------------------------------------------ */

typedef struct height_layer {
    double density, falloff, offset; /* as the editor has them; cm */
    nb_import_causes causes;
} height_layer;

/* The shader's line integral over 2^(-f (z - h)) leaves out 1 / ln 2, and transmittance is 2 to the power of its
 * negative: the extinction is (ln 2)^2 times the density. Both settings are scaled by 1/1000 per cm, which is 1/10 per
 * m. */
static void add_layer(nb_import *fog, const height_layer *from, double height, double start, const double color[3])
{
    if (from->density == 0) return;
    nebel_volume_desc *volume = &fog->volumes[fog->count];
    fog->causes[fog->count++] = from->causes;
    *volume = nb_import_world(LN2 * LN2 * from->density / 10);
    volume->start = start;
    if (from->falloff > 0)
        nb_import_set_height(volume, height + centimetre * from->offset, 10 / (from->falloff * LN2), NEBEL_BELOW_GROW);
    for (int c = 0; c < 3; c++) volume->source[c] = color[c];
}

static bool read_second(nb_json *json, const nb_json_node *node, height_layer *second)
{
    enum { DENSITY, FALLOFF, OFFSET, COUNT };
    static const char *const names[] = {"FogDensity", "FogHeightFalloff", "FogHeightOffset"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "SecondFogData"};
    const nb_json_node *found[COUNT];
    if (node == NULL) return true;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_light, &second->density) ||
        !nb_key_value_number(json, found[FALLOFF], &nb_range_light, &second->falloff) ||
        !nb_key_value_number(json, found[OFFSET], &nb_range_place, &second->offset))
        return false;
    second->causes = (nb_import_causes){.scale_height = found[FALLOFF], .base = found[OFFSET]};
    return true;
}

bool nb_import_unreal_height_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, DENSITY, FALLOFF, SECOND, COLOR, START, END, CUTOFF, OPACITY, LOCATION, COUNT };
    static const char *const names[] = {
        "type",          "FogDensity",  "FogHeightFalloff",  "SecondFogData", "FogInscatteringLuminance",
        "StartDistance", "EndDistance", "FogCutoffDistance", "FogMaxOpacity", "RelativeLocation"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "an unreal_height_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    json->unit = centimetre;
    height_layer first = {.density = 0.02, .falloff = 0.2}, second = {.falloff = 0.2};
    double color[3] = {0}, location[3] = {0}, start = 0, opacity = 1;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_light, &first.density) ||
        !nb_key_value_number(json, found[FALLOFF], &nb_range_light, &first.falloff) ||
        !read_second(json, found[SECOND], &second) || !nb_key_value_color(json, found[COLOR], &nb_range_light, color) ||
        !nb_key_value_number(json, found[START], &nb_range_distance, &start) ||
        !nb_import_refuse_other(json, found[END], 0, "the engine measures it along the ground") ||
        !nb_import_refuse_other(json, found[CUTOFF], 0,
                                "behind it the engine draws no fog at all, also not what lies before") ||
        !nb_key_value_number(json, found[OPACITY], &nb_range_fraction, &opacity) ||
        !nb_key_value_place(json, found[LOCATION], location))
        return false;
    convert_location(location);
    if (opacity == 0) return true;
    if (opacity < 1) fog->max_opacity = opacity;
    first.causes = (nb_import_causes){.scale_height = found[FALLOFF], .base = found[LOCATION]};
    add_layer(fog, &first, location[1], centimetre * start, color);
    add_layer(fog, &second, location[1], centimetre * start, color);
    return true;
}

/* ---- local fog volumes ----------------------------------------------------------------------- */

/* The radius of a volume of scale 1. */
static const double base_radius = 5;

bool nb_import_unreal_local_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, EXTINCTION, ALBEDO, PHASE_G, LOCATION, SCALE, COUNT };
    static const char *const names[] = {"type",      "RadialFogExtinction", "FogAlbedo",
                                        "FogPhaseG", "RelativeLocation",    "RelativeScale3D"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "an unreal_local_fog_volume"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    json->unit = centimetre;
    double extinction = 1, scale[3] = {1, 1, 1};
    nebel_volume_desc volume = nb_import_world(0);
    volume.shape.type = NEBEL_SHAPE_SPHERE;
    volume.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1};
    for (int c = 0; c < 3; c++) volume.albedo[c] = 1;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[EXTINCTION], &nb_range_light, &extinction) ||
        !nb_key_value_color(json, found[ALBEDO], &nb_range_fraction, volume.albedo) ||
        !nb_import_phase(json, found[PHASE_G], 0.2, &volume.phase) ||
        !nb_key_value_place(json, found[LOCATION], volume.shape.center) ||
        !nb_key_value_scale(json, found[SCALE], scale))
        return false;
    convert_location(volume.shape.center);
    volume.shape.radius = base_radius * fmax(fabs(scale[0]), fmax(fabs(scale[1]), fabs(scale[2])));
    for (int c = 0; c < 3; c++) volume.extinction[c] = extinction / volume.shape.radius;
    fog->causes[fog->count] =
        (nb_import_causes){.extinction = nb_import_either(found[EXTINCTION], found[SCALE]), .lengths = found[SCALE]};
    fog->volumes[fog->count++] = volume;
    return true;
}
