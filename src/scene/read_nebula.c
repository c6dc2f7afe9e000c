/* One entry of the section "nebula". nebel_generate_scene_particles makes the particles later. */
#include "keys/key_table.h"
#include "scene_data.h"

#include <string.h>

enum {
    NEBULA_NAME,
    NEBULA_SHAPE,
    NEBULA_POINTS,
    NEBULA_DENSITY,
    NEBULA_COUNT,
    NEBULA_DIMMING,
    NEBULA_SEED,
    NEBULA_PROFILE,
    NEBULA_RADIUS_RANGE,
    NEBULA_ABSORPTION,
    NEBULA_EMISSION,
    NEBULA_COLORS,
    NEBULA_TURBULENCE,
    NEBULA_TURBULENCE_SCALE,
    NEBULA_KEY_COUNT
};

static const char *const nebula_key_names[] = {"name",     "shape",  "points",     "density",         "count",
                                               "dimming",  "seed",   "profile",    "radius_range",    "absorption",
                                               "emission", "colors", "turbulence", "turbulence_scale"};

static const nb_key_set nebula_keys = {nebula_key_names, NEBULA_KEY_COUNT, NB_BIT(NEBULA_KEY_COUNT) - 1, 0, "a nebula"};

#define MOST_PARTICLES 1000000
#define MOST_COLORS 64

static bool read_counts(nb_json *json, const nb_json_node *const *found, nebel_nebula_desc *nebula)
{
    int count = 10000, seed = 0;
    if (!nb_key_value_integer(json, found[NEBULA_COUNT], 1, MOST_PARTICLES, &count) ||
        !nb_key_value_number(json, found[NEBULA_DIMMING], &nb_range_fraction, &nebula->dimming) ||
        !nb_key_value_integer(json, found[NEBULA_SEED], 0, INT32_MAX, &seed))
        return false;
    nebula->count = (size_t)count;
    nebula->seed = (uint64_t)seed;
    return true;
}

/* In the order of nebel_particle_profile. */
static bool read_profile(nb_json *json, const nb_json_node *node, nebel_particle_profile *profile)
{
    static const char *const names[] = {"soft", "gaussian", "uniform"};
    if (node == NULL) return true;
    const int choice = nb_key_value_choice(json, node, names, NEBEL_PARTICLE_PROFILE_COUNT);
    if (choice >= 0) *profile = (nebel_particle_profile)choice;
    return choice >= 0;
}

static bool read_nebula_sizes(nb_json *json, const nb_json_node *const *found, nebel_nebula_desc *nebula)
{
    nb_range radius = nb_range_extent;
    if (nebula->profile == NEBEL_PARTICLE_GAUSSIAN) radius.low *= 3; /* its sigma is a third of the radius */
    if (!nb_key_value_numbers(json, found[NEBULA_RADIUS_RANGE], &radius, 2, nebula->radius_range) ||
        !nb_key_value_number(json, found[NEBULA_TURBULENCE], &nb_range_distance, &nebula->turbulence) ||
        !nb_key_value_number(json, found[NEBULA_TURBULENCE_SCALE], &nb_range_extent, &nebula->turbulence_scale))
        return false;
    if (nebula->radius_range[0] <= nebula->radius_range[1]) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, found[NEBULA_RADIUS_RANGE],
                        "is larger first; must be [smallest, largest] radius");
}

/* Of a particle of this color. */
static bool check_emission(nb_json *json, const nb_json_node *color, const nebel_nebula_desc *nebula,
                           const double factors[3])
{
    char wanted[NB_RANGE_TEXT];
    for (int c = 0; c < 3; c++) {
        const double product = nebula->emission[c] * factors[c];
        if (!nb_range_holds(&nb_range_amount, json->unit, product))
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, color, "times the emission is %.15g; that must be %s",
                                product, nb_range_describe(&nb_range_amount, json->unit, wanted));
    }
    return true;
}

static bool read_colors(nb_scene_reader *in, const nb_json_node *node, nebel_nebula_desc *nebula)
{
    nb_json *json = in->json;
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of colors")) return false;
    if (node->count < 1 || node->count > MOST_COLORS)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "has %u colors; 1 to %d are possible",
                            (unsigned)node->count, MOST_COLORS);
    double(*colors)[3] = nb_arena_allocate(&in->scene->arena, node->count, sizeof *colors);
    if (colors == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    nebula->colors = (const double(*)[3])colors;
    for (const nb_json_node *color = nb_json_first(json, node); color != NULL; color = nb_json_next(json, color)) {
        double *factors = colors[nebula->color_count++];
        if (!nb_key_value_color(json, color, &nb_range_light, factors) || !check_emission(json, color, nebula, factors))
            return false;
    }
    return true;
}

static bool keep_nebula(nb_scene_reader *in, const nb_json_node *node, const nebel_nebula_desc *nebula,
                        const nebel_transform *place, const char *name)
{
    nebel_scene *scene = in->scene;
    const size_t count = scene->data.nebula_count;
    void *nebulae = scene->nebulae;
    void *names = (void *)scene->nebula_names;
    const bool room = nb_grow(&scene->allocator, &nebulae, sizeof *nebula, count, &scene->nebula_capacity, count + 1);
    scene->nebulae = nebulae;
    const bool name_room =
        nb_grow(&scene->allocator, &names, sizeof name, count, &scene->nebula_name_capacity, count + 1);
    scene->nebula_names = names;
    void *places = scene->nebula_places;
    const bool place_room =
        nb_grow(&scene->allocator, &places, sizeof *place, count, &scene->nebula_place_capacity, count + 1);
    scene->nebula_places = places;
    if (!room || !name_room || !place_room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->nebulae[count] = *nebula;
    scene->nebula_names[count] = name;
    scene->nebula_places[count] = *place;
    scene->data.nebula_count = count + 1;
    scene->data.particle_count += nebula->count;
    return true;
}

static bool check_nebula_kind(nb_json *json, const nb_json_node *node, const nb_json_node *const *found)
{
    static const int generated[] = {NEBULA_SHAPE, NEBULA_DENSITY, NEBULA_COUNT, NEBULA_DIMMING};
    if (found[NEBULA_POINTS] == NULL && found[NEBULA_SHAPE] == NULL)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is nowhere; a nebula has \"shape\" or \"points\"");
    for (size_t i = 0; i < sizeof generated / sizeof *generated && found[NEBULA_POINTS] != NULL; i++)
        if (found[generated[i]] != NULL)
            return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[generated[i]],
                                    "does not go with \"points\", of which each is a particle");
    return true;
}

static bool check_bounds(nb_json *json, const nb_json_node *shape, nebel_shape_type type)
{
    if (shape == NULL) return true;
    if (type != NEBEL_SHAPE_WORLD && type != NEBEL_SHAPE_HALF_SPACE) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, shape,
                        "has no bounds; particles need a shape that has, a sphere or a box");
}

/* The core's own checks: of nothing distributed, so quick. */
static bool try_nebula(nb_scene_reader *in, const nb_json_node *node, const nebel_nebula_desc *nebula)
{
    static const char subject[] = "nebula: ";
    nebel_nebula_desc empty = *nebula;
    empty.count = 0;
    empty.host.allocator = in->scene->allocator;
    empty.host.log = (nebel_log){nb_keys_read_keep_message, in};
    in->core_message[0] = '\0';
    const nebel_result result = nebel_generate_nebula(&empty, NULL);
    if (result == NEBEL_OK) return true;
    const char *text = in->core_message;
    if (strncmp(text, subject, strlen(subject)) == 0) text += strlen(subject);
    return nb_json_fail(in->json, result == NEBEL_ERROR_VALUE ? NEBEL_ERROR_FORMAT : result, node, "%s",
                        text[0] != '\0' ? text : nebel_result_text(result));
}

static bool check_total(nb_scene_reader *in, const nb_json_node *node, const nebel_nebula_desc *nebula)
{
    if (in->scene->data.particle_count + nebula->count <= MOST_PARTICLES) return true;
    return nb_json_fail(in->json, NEBEL_ERROR_LIMIT, node,
                        "brings the particles of this scene above %d, the most it may have", MOST_PARTICLES);
}

/* What only the core knows is about the shape: its bounds. */
static bool finish_nebula(nb_scene_reader *in, const nb_json_node *node, const nb_json_node *shape,
                          nebel_nebula_desc *nebula, const nebel_transform *place, const char *name)
{
    nb_file_units_convert_nebula(&in->space, nebula);
    return try_nebula(in, shape != NULL ? shape : node, nebula) && check_total(in, node, nebula) &&
           nb_scene_charge(in, node, (double)nebula->count * NB_PARTICLE_BYTES,
                           (double)nebula->count * NB_PARTICLE_SECONDS) &&
           keep_nebula(in, node, nebula, place, name);
}

bool nb_keys_read_nebula(nb_scene_reader *in, const nb_json_node *node)
{
    const nb_json_node *found[NEBULA_KEY_COUNT];
    nb_json *json = in->json;
    /* The defaults of the core, in the numbers of the file. */
    nebel_nebula_desc nebula = {.radius_range = {0.05 / in->space.unit, 0.2 / in->space.unit}};
    nebel_transform place = nb_plain_transform;
    const char *name = "";
    return nb_key_value_is(json, node, NB_JSON_OBJECT, "a nebula {\"shape\": ...}") &&
           nb_key_value_members(json, node, &nebula_keys, found) &&
           nb_key_value_text(json, found[NEBULA_NAME], &in->scene->arena, &name) &&
           check_nebula_kind(json, node, found) &&
           (found[NEBULA_SHAPE] == NULL || nb_keys_read_shape(in, found[NEBULA_SHAPE], &nebula.shape)) &&
           check_bounds(json, found[NEBULA_SHAPE], nebula.shape.type) &&
           nb_keys_read_density(in, found[NEBULA_DENSITY], nebula.shape.type, &nebula.density) &&
           read_counts(json, found, &nebula) && read_profile(json, found[NEBULA_PROFILE], &nebula.profile) &&
           read_nebula_sizes(json, found, &nebula) &&
           nb_key_value_amount(json, found[NEBULA_ABSORPTION], &nb_range_amount, nebula.absorption) &&
           nb_key_value_color(json, found[NEBULA_EMISSION], &nb_range_amount, nebula.emission) &&
           read_colors(in, found[NEBULA_COLORS], &nebula) &&
           nb_keys_read_points(in, found[NEBULA_POINTS], MOST_PARTICLES, &nebula, &place) &&
           finish_nebula(in, node, found[NEBULA_SHAPE], &nebula, &place, name);
}
