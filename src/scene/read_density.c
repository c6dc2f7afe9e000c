/* Density profiles and phase functions. */
#include "scene_data.h"

#include <string.h>

/* ---- density --------------------------------------------------------------------------------- */

enum {
    DENSITY_TYPE,
    DENSITY_BASE,
    DENSITY_SCALE_HEIGHT,
    DENSITY_BELOW,
    DENSITY_FROM,
    DENSITY_TO,
    DENSITY_POWER,
    DENSITY_CENTER,
    DENSITY_SIGMA,
    DENSITY_DISTANCE,
    DENSITY_RADIUS,
    DENSITY_KEY_COUNT
};

static const char *const density_key_names[] = {"type",  "base",   "scale_height", "below",    "from",  "to",
                                                "power", "center", "sigma",        "distance", "radius"};

/* In the order of nebel_density_type. */
static const char *const density_type_names[] = {"constant",  "height", "linear",   "radial", "gaussian",
                                                 "soft_edge", "grid",   "altitude", "noise"};

/* Noise is a grid to the core. */
enum {
    DENSITY_TYPE_COUNT = sizeof density_type_names / sizeof *density_type_names,
    DENSITY_NOISE = NEBEL_DENSITY_COUNT
};

#define DENSITY_KEYS(required, optional, owner)                                                                        \
    {                                                                                                                  \
        density_key_names, DENSITY_KEY_COUNT, (required) | (optional) | NB_BIT(DENSITY_TYPE), (required), owner        \
    }

/* In the order of nebel_density_type. */
static const nb_key_set density_keys[NEBEL_DENSITY_COUNT] = {
    DENSITY_KEYS(0, 0, "a constant density"),
    DENSITY_KEYS(NB_BIT(DENSITY_SCALE_HEIGHT), NB_BIT(DENSITY_BASE) | NB_BIT(DENSITY_BELOW), "a height density"),
    DENSITY_KEYS(NB_BIT(DENSITY_FROM) | NB_BIT(DENSITY_TO), 0, "a linear density"),
    DENSITY_KEYS(0, NB_BIT(DENSITY_POWER), "a radial density"),
    DENSITY_KEYS(NB_BIT(DENSITY_CENTER) | NB_BIT(DENSITY_SIGMA), 0, "a gaussian density"),
    DENSITY_KEYS(NB_BIT(DENSITY_DISTANCE), 0, "a soft edge"),
    DENSITY_KEYS(0, 0, "a grid"),
    DENSITY_KEYS(NB_BIT(DENSITY_SCALE_HEIGHT),
                 NB_BIT(DENSITY_BASE) | NB_BIT(DENSITY_BELOW) | NB_BIT(DENSITY_CENTER) | NB_BIT(DENSITY_RADIUS),
                 "an altitude density"),
};

static bool fail_shape(nb_json *json, const nb_json_node *node, const char *wanted)
{
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "\"%.*s\" does not fit this shape; it needs %s",
                        (int)node->string_size, node->string, wanted);
}

static bool check_type(nb_json *json, const nb_json_node *node, int type, nebel_shape_type shape)
{
    if (type == NEBEL_DENSITY_RADIAL && shape != NEBEL_SHAPE_SPHERE && shape != NEBEL_SHAPE_ELLIPSOID)
        return fail_shape(json, node, "a sphere or an ellipsoid");
    if (type == NEBEL_DENSITY_SOFT_EDGE && (shape == NEBEL_SHAPE_WORLD || shape >= NEBEL_SHAPE_UNION))
        return fail_shape(json, node, "a shape with a surface that is no union or intersection");
    if ((type == NEBEL_DENSITY_GRID || type == DENSITY_NOISE) && shape != NEBEL_SHAPE_BOX)
        return fail_shape(json, node, "a box");
    return true;
}

static bool read_below(nb_json *json, const nb_json_node *node, nebel_below *below)
{
    static const char *const names[] = {"grow", "constant"};
    if (node == NULL) return true;
    const int choice = nb_key_value_choice(json, node, names, 2);
    if (choice >= 0) *below = (nebel_below)choice;
    return choice >= 0;
}

static bool check_ends(nb_json *json, const nb_json_node *const *found, const nebel_density *density)
{
    const nb_json_node *end = found[DENSITY_TO] != NULL ? found[DENSITY_TO] : found[DENSITY_FROM];
    return end == NULL ||
           nb_keys_read_check_apart(json, end, found[DENSITY_TO] != NULL ? "from" : "to", density->from, density->to);
}

static const nb_json_node *find_type(const nb_json *json, const nb_json_node *object)
{
    const nb_json_node *node = nb_json_first(json, object);
    while (!nb_json_has_key(node, "type")) node = nb_json_next(json, node);
    return node;
}

static bool read_density_members(nb_json *json, const nb_json_node *const *found, nebel_density *density)
{
    return nb_key_value_number(json, found[DENSITY_BASE], &nb_range_place, &density->base) &&
           nb_key_value_number(json, found[DENSITY_SCALE_HEIGHT], &nb_range_extent, &density->scale_height) &&
           read_below(json, found[DENSITY_BELOW], &density->below) &&
           nb_key_value_place(json, found[DENSITY_FROM], density->from) &&
           nb_key_value_place(json, found[DENSITY_TO], density->to) && check_ends(json, found, density) &&
           nb_key_value_integer(json, found[DENSITY_POWER], 1, 3, &density->power) &&
           nb_key_value_place(json, found[DENSITY_CENTER], density->center) &&
           nb_key_value_number(json, found[DENSITY_SIGMA], &nb_range_extent, &density->sigma) &&
           nb_key_value_number(json, found[DENSITY_DISTANCE], &nb_range_extent, &density->edge_width) &&
           nb_key_value_number(json, found[DENSITY_RADIUS], &nb_range_extent, &density->radius);
}

/* The ball is that of the first planet, in terms of the file. Where that has no center the ground is at the origin. */
static bool read_altitude(nb_scene_reader *in, const nb_json_node *const *found, nebel_density *density)
{
    const nb_ground_sphere *const ball = &in->ball;
    density->radius = ball->radius > 0 ? ball->radius : ball->preset_radius / in->space.unit;
    if (!read_density_members(in->json, found, density)) return false;
    if (found[DENSITY_CENTER] == NULL && ball->has_center) {
        memcpy(density->center, ball->center, sizeof density->center);
    } else if (found[DENSITY_CENTER] == NULL) {
        density->center[1] = -density->radius * in->space.unit;
        nb_file_units_restore_place(&in->space, density->center);
    }
    if (density->radius + density->base >= NEBEL_MIN_ALTITUDE_RATIO * density->scale_height) return true;
    return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, found[DENSITY_SCALE_HEIGHT],
                        "is %g; must be at most a %dth of the distance of the base from the center, %g",
                        density->scale_height, NEBEL_MIN_ALTITUDE_RATIO, density->radius + density->base);
}

bool nb_keys_read_density_key(nb_scene_reader *in, const nb_json_node *node, nebel_density *density)
{
    const nb_json_node *found[DENSITY_KEY_COUNT];
    nb_key_set keys = density_keys[density->type];
    keys.allowed &= ~(NB_BIT(DENSITY_TYPE) | NB_BIT(DENSITY_BELOW) | NB_BIT(DENSITY_POWER));
    keys.required = 0;
    if (node == NULL) return true;
    if (keys.allowed == 0)
        return nb_json_fail_key(in->json, NEBEL_ERROR_FORMAT, node, "does not move; %s has no numbers for that",
                                keys.owner);
    return nb_key_value_members(in->json, node, &keys, found) && read_density_members(in->json, found, density);
}

/* In a node of a model a text may name a density that needs no numbers. */
static bool read_named(nb_json *json, const nb_json_node *node, nebel_shape_type shape, nebel_density *density)
{
    static const char *const names[] = {"constant", "radial"};
    static const nebel_density_type types[] = {NEBEL_DENSITY_CONSTANT, NEBEL_DENSITY_RADIAL};
    const int choice = nb_key_value_choice(json, node, names, 2);
    if (choice < 0 || !check_type(json, node, (int)types[choice], shape)) return false;
    *density = (nebel_density){.type = types[choice], .power = types[choice] == NEBEL_DENSITY_RADIAL ? 1 : 0};
    return true;
}

bool nb_keys_read_density(nb_scene_reader *in, const nb_json_node *node, nebel_shape_type shape, nebel_density *density)
{
    const nb_json_node *found[DENSITY_KEY_COUNT];
    nb_json *json = in->json;
    if (node == NULL) return true;
    if (in->node != NULL && node->type == NB_JSON_STRING) return read_named(json, node, shape, density);
    const int type = nb_key_value_type(json, node, density_type_names, DENSITY_TYPE_COUNT);
    if (type < 0 || !check_type(json, find_type(json, node), type, shape)) return false;
    if (type == NEBEL_DENSITY_GRID) return nb_keys_read_grid(in, node, density);
    if (type == DENSITY_NOISE) return nb_keys_read_noise(in, node, density);
    if (!nb_key_value_members(json, node, &density_keys[type], found)) return false;
    *density = (nebel_density){.type = (nebel_density_type)type, .power = type == NEBEL_DENSITY_RADIAL ? 1 : 0};
    return type == NEBEL_DENSITY_ALTITUDE ? read_altitude(in, found, density)
                                          : read_density_members(json, found, density);
}

/* ---- phase ----------------------------------------------------------------------------------- */

bool nb_keys_read_phase(nb_scene_reader *in, const nb_json_node *node, nebel_phase *phase)
{
    enum { PHASE_TYPE, G, ALPHA, DIAMETER, COUNT };
    static const char *const names[] = {"type", "g", "alpha", "diameter"};
    static const char *const phase_names[] = {"isotropic", "henyey_greenstein", "rayleigh", "cornette_shanks",
                                              "draine",    "droplets"};
    static const nebel_phase_type types[] = {NEBEL_PHASE_ISOTROPIC, NEBEL_PHASE_HENYEY_GREENSTEIN,
                                             NEBEL_PHASE_RAYLEIGH,  NEBEL_PHASE_CORNETTE_SHANKS,
                                             NEBEL_PHASE_DRAINE,    NEBEL_PHASE_DROPLETS};
    static const nb_key_set keys[] = {
        {names, COUNT, NB_BIT(PHASE_TYPE), 0, "an isotropic phase function"},
        {names, COUNT, NB_BIT(PHASE_TYPE) | NB_BIT(G), NB_BIT(G), "a henyey_greenstein phase function"},
        {names, COUNT, NB_BIT(PHASE_TYPE), 0, "a rayleigh phase function"},
        {names, COUNT, NB_BIT(PHASE_TYPE) | NB_BIT(G), NB_BIT(G), "a cornette_shanks phase function"},
        {names, COUNT, NB_BIT(PHASE_TYPE) | NB_BIT(G) | NB_BIT(ALPHA), NB_BIT(G) | NB_BIT(ALPHA),
         "a draine phase function"},
        {names, COUNT, NB_BIT(PHASE_TYPE) | NB_BIT(DIAMETER), NB_BIT(DIAMETER), "a droplets phase function"}};
    static const nb_range alpha_range = {.low = 0, .high = NEBEL_MAX_ALPHA, .text = "a number from 0 to 1e9"};
    static const nb_range diameter_range = {
        .low = 1e-6, .high = NEBEL_MAX_DROPLET_DIAMETER, .text = "a diameter within 1e-6 and 50 micrometres"};
    const nb_json_node *found[COUNT];
    if (node == NULL) return true;
    const int type = nb_key_value_type(in->json, node, phase_names, (int)(sizeof types / sizeof *types));
    if (type < 0) return false;
    phase->type = types[type];
    return nb_key_value_members(in->json, node, &keys[type], found) &&
           nb_key_value_number(in->json, found[G], &nb_range_asymmetry, &phase->g) &&
           nb_key_value_number(in->json, found[ALPHA], &alpha_range, &phase->alpha) &&
           nb_key_value_number(in->json, found[DIAMETER], &diameter_range, &phase->diameter);
}
