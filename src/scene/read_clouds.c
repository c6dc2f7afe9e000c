/* The clouds of a physical planet. */
#include "scene_data.h"

#include <stdio.h>
#include <string.h>

enum {
    CLOUD_TYPE,
    CLOUD_BASE,
    CLOUD_TOP,
    CLOUD_COVERAGE,
    CLOUD_EXTINCTION,
    CLOUD_CELL_SIZE,
    CLOUD_EROSION,
    CLOUD_PATCHINESS,
    CLOUD_DROPLET_DIAMETER,
    CLOUD_SEED,
    CLOUD_WIND,
    CLOUD_WEATHER_MAP,
    CLOUD_KEY_COUNT
};

static const char *const cloud_key_names[] = {"type",      "base",       "top",        "coverage",         "extinction",
                                              "cell_size", "erosion",    "patchiness", "droplet_diameter", "seed",
                                              "wind",      "weather_map"};
static const nb_key_set cloud_keys = {cloud_key_names, CLOUD_KEY_COUNT, NB_BIT(CLOUD_KEY_COUNT) - 1, 0,
                                      "a layer of clouds"};

/* A part that 0 leaves nothing of. */
static bool read_part(nb_json *json, const nb_json_node *node, double *value)
{
    if (!nb_key_value_number(json, node, &nb_range_fraction, value)) return false;
    if (node != NULL && *value == 0) *value = NEBEL_ZERO;
    return true;
}

static bool read_numbers(nb_scene_reader *in, const nb_json_node *const *found, nebel_cloud_layer *layer)
{
    static const nb_range height_range = {
        .low = 1e-15, .high = 1e12, .dimension = NB_LENGTH, .text = "a height above the ground"};
    static const nb_range size_range = {.low = 1e-3, .high = 1e9, .dimension = NB_LENGTH, .text = "a length"};
    static const nb_range amount_range = {
        .low = 1e-12, .high = NEBEL_MAX_COMPONENT_EXTINCTION, .dimension = NB_PER_LENGTH, .text = "an amount"};
    static const nb_range diameter_range = {
        .low = 4, .high = NEBEL_MAX_DROPLET_DIAMETER, .text = "a number of micrometres from 4 to 50"};
    static const nb_range wind_range = {.low = -1e12, .high = 1e12, .dimension = NB_LENGTH, .text = "a length"};
    nb_json *json = in->json;
    if (!nb_key_value_number(json, found[CLOUD_BASE], &height_range, &layer->base) ||
        !nb_key_value_number(json, found[CLOUD_TOP], &height_range, &layer->top) ||
        !nb_key_value_number(json, found[CLOUD_COVERAGE], &nb_range_fraction, &layer->coverage) ||
        !nb_key_value_number(json, found[CLOUD_EXTINCTION], &amount_range, &layer->extinction) ||
        !nb_key_value_number(json, found[CLOUD_CELL_SIZE], &size_range, &layer->cell_size) ||
        !read_part(json, found[CLOUD_EROSION], &layer->erosion) ||
        !read_part(json, found[CLOUD_PATCHINESS], &layer->patchiness) ||
        !nb_key_value_number(json, found[CLOUD_DROPLET_DIAMETER], &diameter_range, &layer->droplet_diameter) ||
        !nb_key_value_numbers(json, found[CLOUD_WIND], &wind_range, 2, layer->wind))
        return false;
    const double unit = in->space.unit;
    layer->base *= unit;
    layer->top *= unit;
    layer->cell_size *= unit;
    layer->extinction /= unit;
    /* Level axes of the file: x and z, or x and y where z is up. */
    for (int i = 0; i < 2; i++) layer->wind[i] *= i == 1 && in->space.z_up ? -unit : unit;
    return true;
}

/* Says what the core finds wrong with numbers that do not go with each other. */
static bool try_layer(nb_scene_reader *in, const nb_json_node *node, double thickness, const nebel_cloud_layer *layer,
                      nebel_cloud_layer *resolved)
{
    static const char subject[] = "cloud layer: ";
    const nebel_log log = {nb_keys_read_keep_message, in};
    const nebel_result result = nebel_resolve_cloud_layer(thickness, layer, &log, resolved);
    if (result == NEBEL_OK) return true;
    const char *message = in->core_message;
    if (strncmp(message, subject, sizeof subject - 1) == 0) message += sizeof subject - 1;
    return nb_key_value_fail_within(in->json, node, message, "");
}

static bool check_layers_apart(nb_scene_reader *in, const nb_json_node *node, const nebel_planet *planet,
                               const nebel_cloud_layer *layer)
{
    for (uint32_t i = 0; i < planet->cloud_layer_count; i++) {
        nebel_cloud_layer other;
        char note[NB_UNIT_NOTE];
        (void)nebel_resolve_cloud_layer(planet->atmosphere_desc.thickness, &planet->cloud_layers[i], NULL, &other);
        if (layer->base >= other.top || other.base >= layer->top) continue;
        return nb_json_fail(
            in->json, NEBEL_ERROR_FORMAT, node,
            "lies from %g to %g m and overlaps another, from %g to %g m; give each heights of its own%s", layer->base,
            layer->top, other.base, other.top, nb_key_value_note_unit(in->json, note));
    }
    return true;
}

static bool check_size(nb_json *json, const nb_json_node *node, const nebel_planet *planet, bool is_given, double size)
{
    const double most = NEBEL_MAX_CLOUD_CELL_RADII * planet->atmosphere_desc.radius;
    char message[140];
    snprintf(message, sizeof message, "cell_size: is %g m%s; must be at most %g m, which is %g times the radius", size,
             is_given ? "" : ", as none is given", most, NEBEL_MAX_CLOUD_CELL_RADII);
    return size <= most || nb_key_value_fail_within(json, node, message, "");
}

/* Of no coverage: no layer. */
static bool read_layer(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planet)
{
    static const char *const type_names[] = {"cumulus", "stratus", "cirrus"};
    const nb_json_node *found[CLOUD_KEY_COUNT];
    nb_json *json = in->json;
    nebel_cloud_layer *layer = &planet->cloud_layers[planet->cloud_layer_count];
    *layer = (nebel_cloud_layer){.seed = 1 + planet->cloud_layer_count};
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {...}") ||
        !nb_key_value_members(json, node, &cloud_keys, found))
        return false;
    const int type = found[CLOUD_TYPE] != NULL
                         ? nb_key_value_choice(json, found[CLOUD_TYPE], type_names, NEBEL_CLOUD_TYPE_COUNT)
                         : 0;
    if (type < 0 || !read_numbers(in, found, layer) || !nb_keys_read_seed(in, found[CLOUD_SEED], &layer->seed) ||
        !nb_keys_read_map(in, found[CLOUD_WEATHER_MAP], 1, &layer->weather_map))
        return false;
    layer->type = (nebel_cloud_type)type;
    nebel_cloud_layer resolved;
    if (!try_layer(in, node, planet->atmosphere_desc.thickness, layer, &resolved)) return false;
    if (found[CLOUD_COVERAGE] != NULL && layer->coverage == 0) return true;
    if (!check_size(json, node, planet, found[CLOUD_CELL_SIZE] != NULL, resolved.cell_size) ||
        !check_layers_apart(in, node, planet, &resolved))
        return false;
    planet->cloud_layer_count++;
    in->scene->data.has_endless_motion |= layer->wind[0] != 0 || layer->wind[1] != 0;
    return true;
}

static bool has_air(const nebel_atmosphere_desc *desc)
{
    for (uint32_t i = 0; i < desc->component_count; i++)
        for (int c = 0; c < 3; c++)
            if (desc->components[i].scattering[c] > 0 || desc->components[i].absorption[c] > 0) return true;
    return false;
}

bool nb_keys_read_clouds(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planet)
{
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array of layers of clouds") ||
        !nb_key_value_at_most(in->json, node, NEBEL_MAX_CLOUD_LAYERS, "a planet", "layers of clouds"))
        return false;
    for (const nb_json_node *one = nb_json_first(in->json, node); one != NULL; one = nb_json_next(in->json, one))
        if (!read_layer(in, one, planet)) return false;
    return planet->cloud_layer_count == 0 || has_air(&planet->atmosphere_desc) ||
           nb_json_fail(
               in->json, NEBEL_ERROR_FORMAT, node,
               "need air, and the planet has none; leave them out, or give it another \"preset\" or \"components\"");
}
