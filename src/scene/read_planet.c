/* The section "planet". */
#include "keys/key_table.h"
#include "scene_data.h"

#include "math/vector.h"

#include <string.h>

static const nb_range length_range = {
    .low = 1e-9, .high = NEBEL_MAX_LENGTH, .dimension = NB_LENGTH, .text = "a length"};

/* ---- kinds of air ---------------------------------------------------------------------------- */

enum {
    AIR_TYPE,
    AIR_SCATTERING,
    AIR_ABSORPTION,
    AIR_PHASE,
    AIR_SCALE_HEIGHT,
    AIR_CENTER_HEIGHT,
    AIR_HALF_WIDTH,
    AIR_KEY_COUNT
};

static const char *const air_names[] = {"type",         "scattering",    "absorption", "phase",
                                        "scale_height", "center_height", "half_width"};

#define AIR_KEYS (NB_BIT(AIR_TYPE) | NB_BIT(AIR_SCATTERING) | NB_BIT(AIR_ABSORPTION) | NB_BIT(AIR_PHASE))

static const nb_key_set air_keys[NEBEL_COMPONENT_PROFILE_COUNT] = {
    [NEBEL_COMPONENT_EXPONENTIAL] = {air_names, AIR_KEY_COUNT, AIR_KEYS | NB_BIT(AIR_SCALE_HEIGHT),
                                     NB_BIT(AIR_TYPE) | NB_BIT(AIR_SCALE_HEIGHT), "air that thins out"},
    [NEBEL_COMPONENT_TENT] = {air_names, AIR_KEY_COUNT, AIR_KEYS | NB_BIT(AIR_CENTER_HEIGHT) | NB_BIT(AIR_HALF_WIDTH),
                              NB_BIT(AIR_TYPE) | NB_BIT(AIR_CENTER_HEIGHT) | NB_BIT(AIR_HALF_WIDTH), "a layer of air"}};

static bool read_air_component(nb_scene_reader *in, const nb_json_node *node, nebel_atmosphere_component *air)
{
    static const nb_range amount_range = {
        .low = 0, .high = NEBEL_MAX_COMPONENT_EXTINCTION, .dimension = NB_PER_LENGTH, .text = "an amount"};
    static const nb_range height_range = {.low = 0, .high = 1e12, .dimension = NB_LENGTH, .text = "a height"};
    const nb_json_node *found[AIR_KEY_COUNT];
    nb_json *json = in->json;
    *air = (nebel_atmosphere_component){.scale_height = 0};
    const int type = nb_key_value_type(json, node, nb_air_profile_names, NEBEL_COMPONENT_PROFILE_COUNT);
    if (type < 0 || !nb_key_value_members(json, node, &air_keys[type], found) ||
        !nb_key_value_amount(json, found[AIR_SCATTERING], &amount_range, air->scattering) ||
        !nb_key_value_amount(json, found[AIR_ABSORPTION], &amount_range, air->absorption) ||
        !nb_keys_read_phase(in, found[AIR_PHASE], &air->phase) ||
        !nb_key_value_number(json, found[AIR_SCALE_HEIGHT], &length_range, &air->scale_height) ||
        !nb_key_value_number(json, found[AIR_CENTER_HEIGHT], &height_range, &air->center_height) ||
        !nb_key_value_number(json, found[AIR_HALF_WIDTH], &length_range, &air->half_width))
        return false;
    air->profile = (nebel_component_profile)type;
    for (int c = 0; c < 3; c++) {
        air->scattering[c] /= in->space.unit;
        air->absorption[c] /= in->space.unit;
    }
    air->scale_height *= in->space.unit;
    air->center_height *= in->space.unit;
    air->half_width *= in->space.unit;
    return true;
}

static bool read_components(nb_scene_reader *in, const nb_json_node *node, nebel_atmosphere_desc *desc)
{
    uint32_t count = 0;
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array of kinds of air") ||
        !nb_key_value_at_most(in->json, node, NEBEL_MAX_COMPONENTS, "a planet", "kinds of air"))
        return false;
    for (const nb_json_node *one = nb_json_first(in->json, node); one != NULL; one = nb_json_next(in->json, one))
        if (!read_air_component(in, one, &desc->components[count++])) return false;
    /* None is one that does nothing to light. */
    if (count == 0) desc->components[count++] = (nebel_atmosphere_component){.scale_height = desc->thickness};
    desc->component_count = count;
    return true;
}

/* ---- planets --------------------------------------------------------------------------------- */

enum {
    PLANET_MODEL,
    PLANET_PRESET,
    PLANET_CENTER,
    PLANET_RADIUS,
    PLANET_GRAVITY,
    PLANET_THICKNESS,
    PLANET_COMPONENTS,
    PLANET_GROUND_ALBEDO,
    PLANET_QUALITY,
    PLANET_SUN_ANGULAR_DIAMETER,
    PLANET_CLOUDS,
    PLANET_KEY_COUNT
};

static const char *const planet_names[] = {
    "model",     "preset",     "center",        "radius",  "gravity",
    "thickness", "components", "ground_albedo", "quality", "sun_angular_diameter",
    "clouds"};
static const nb_key_set planet_keys = {planet_names, PLANET_KEY_COUNT, NB_BIT(PLANET_KEY_COUNT) - 1,
                                       NB_BIT(PLANET_MODEL), "a physical planet"};

/* The sun in degrees, as seen from there: Earth's and Mars's mean distances from the sun, whose diameter is 1.3927e9 m. Gravity in
 * m/s^2: NASA's fact sheets; of the toy the Earth's. */
static const struct {
    const char *name;
    double sun_angular_diameter, gravity;
} planet_presets[] = {{"earth", 0.5334, 9.82}, {"mars", 0.3501, 3.73}, {"toy", 0.5334, 9.82}, {"moon", 0.5334, 1.62}};

/* Air of the same pressure and temperature at the ground: heights go by 1 / gravity, R T / (M g) of each gas. */
static void stretch(nebel_atmosphere_desc *desc, double times)
{
    desc->thickness *= times;
    for (uint32_t i = 0; i < desc->component_count; i++) {
        desc->components[i].scale_height *= times;
        desc->components[i].center_height *= times;
        desc->components[i].half_width *= times;
    }
}

static bool read_planet_preset(nb_json *json, const nb_json_node *const *found, nebel_planet *planet)
{
    static const char *const preset_names[] = {"earth", "mars", "toy", "moon"};
    static const nb_range gravity_range = {.low = 0.1, .high = 1000, .text = "a number from 0.1 to 1000, in m/s^2"};
    const int preset =
        found[PLANET_PRESET] != NULL ? nb_key_value_choice(json, found[PLANET_PRESET], preset_names, 4) : 0;
    if (preset < 0) return false;
    double gravity = planet_presets[preset].gravity;
    if (!nb_key_value_number(json, found[PLANET_GRAVITY], &gravity_range, &gravity)) return false;
    planet->atmosphere_desc = *nebel_lookup_atmosphere(planet_presets[preset].name);
    planet->sun_angular_diameter = planet_presets[preset].sun_angular_diameter;
    if (found[PLANET_GRAVITY] != NULL) stretch(&planet->atmosphere_desc, planet_presets[preset].gravity / gravity);
    return true;
}

static bool read_planet_sizes(nb_scene_reader *in, const nb_json_node *const *found, nebel_planet *planet)
{
    static const nb_range radius_range = {.low = 1, .high = 1e12, .dimension = NB_LENGTH, .text = "a length"};
    static const nb_range diameter_range = {.low = 0, .high = 10, .text = "a number of degrees from 0 to 10"};
    nebel_atmosphere_desc *desc = &planet->atmosphere_desc;
    double radius = desc->radius / in->space.unit, thickness = desc->thickness / in->space.unit, center[3];
    if (!nb_key_value_number(in->json, found[PLANET_RADIUS], &radius_range, &radius) ||
        !nb_key_value_place(in->json, found[PLANET_CENTER], center) ||
        !nb_key_value_number(in->json, found[PLANET_SUN_ANGULAR_DIAMETER], &diameter_range,
                             &planet->sun_angular_diameter))
        return false;
    if (found[PLANET_RADIUS] != NULL) desc->radius = radius * in->space.unit;
    const nb_range thickness_range = {
        .low = desc->radius / 1e6, .high = 1e12, .dimension = NB_LENGTH, .text = "a length (radius / 1e6 or more)"};
    if (!nb_key_value_number(in->json, found[PLANET_THICKNESS], &thickness_range, &thickness)) return false;
    if (found[PLANET_THICKNESS] != NULL) desc->thickness = thickness * in->space.unit;
    if (found[PLANET_CENTER] == NULL) return true;
    nb_file_units_convert_place(&in->space, center);
    memcpy(desc->ground_point, center, sizeof center);
    desc->ground_point[1] += desc->radius;
    return desc->ground_point[1] <= NEBEL_MAX_LENGTH ||
           nb_json_fail(in->json, NEBEL_ERROR_FORMAT, found[PLANET_CENTER],
                        "lies so high that the ground above it is more than 1e15 m from the origin");
}

static bool is_text(const nb_json_node *node, const char *text)
{
    return node->type == NB_JSON_STRING && node->string_size == strlen(text) &&
           memcmp(node->string, text, node->string_size) == 0;
}

static void find_center(const nb_json *json, const nb_json_node *node, nb_ground_sphere *ball)
{
    int i = 0;
    for (const nb_json_node *one = nb_json_first(json, node); one != NULL && i < 3; one = nb_json_next(json, one))
        ball->center[i++] = one->type == NB_JSON_NUMBER ? one->number : 0;
    ball->has_center = i == 3;
}

nb_ground_sphere nb_find_sphere(const nb_json *json, const nb_json_node *planet)
{
    nb_ground_sphere ball = {.preset_radius = nebel_lookup_atmosphere(planet_presets[0].name)->radius};
    const nb_json_node *const first =
        planet != NULL && planet->type == NB_JSON_ARRAY ? nb_json_first(json, planet) : planet;
    if (first == NULL || first->type != NB_JSON_OBJECT) return ball;
    for (const nb_json_node *one = nb_json_first(json, first); one != NULL; one = nb_json_next(json, one)) {
        for (size_t i = 0; i < sizeof planet_presets / sizeof *planet_presets && nb_key_value_is_key(one, "", "preset");
             i++)
            if (is_text(one, planet_presets[i].name))
                ball.preset_radius = nebel_lookup_atmosphere(planet_presets[i].name)->radius;
        if (nb_key_value_is_key(one, "", "radius") && one->type == NB_JSON_NUMBER) ball.radius = one->number;
        if (nb_key_value_is_key(one, "", "center")) find_center(json, one, &ball);
    }
    return ball;
}

/* The core knows what numbers do not go with each other. */
static bool try_planet(nb_scene_reader *in, const nb_json_node *node, bool has_components, nebel_planet *planet)
{
    static const char subject[] = "atmosphere: ",
                      advice[] = "; these components are the preset's: give \"components\" that go with the other keys";
    planet->atmosphere_desc.host.log = (nebel_log){nb_keys_read_keep_message, in};
    const nebel_result result = nebel_resolve_atmosphere(&planet->atmosphere_desc, &planet->atmosphere_desc);
    planet->atmosphere_desc.host.log = (nebel_log){NULL, NULL};
    if (result == NEBEL_OK) return true;
    const char *message = in->core_message;
    if (strncmp(message, subject, sizeof subject - 1) == 0) message += sizeof subject - 1;
    const bool is_of_preset = !has_components && strncmp(message, "components[", 11) == 0;
    return nb_key_value_fail_within(in->json, node, message, is_of_preset ? advice : "");
}

static bool charge(nb_scene_reader *in, const nb_json_node *node, const nebel_planet *planet)
{
    const bool is_precise = planet->atmosphere_desc.quality == NEBEL_ATMOSPHERE_PRECISE,
               has_clouds = planet->cloud_layer_count > 0;
    return nb_scene_charge(in, node, NB_PLANET_BYTES + (has_clouds ? NB_CLOUDS_BYTES : 0),
                           (is_precise ? NB_PRECISE_PLANET_SECONDS : NB_PLANET_SECONDS) +
                               (has_clouds ? NB_CLOUDS_SECONDS : 0));
}

static bool read_physical(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planet)
{
    static const char *const quality_names[] = {"fast", "precise"};
    const nb_json_node *found[PLANET_KEY_COUNT];
    nb_json *json = in->json;
    if (!nb_key_value_members(json, node, &planet_keys, found) || !read_planet_preset(json, found, planet) ||
        !read_planet_sizes(in, found, planet) ||
        !read_components(in, found[PLANET_COMPONENTS], &planet->atmosphere_desc) ||
        !nb_key_value_color(json, found[PLANET_GROUND_ALBEDO], &nb_range_fraction,
                            planet->atmosphere_desc.ground_albedo))
        return false;
    const int quality =
        found[PLANET_QUALITY] != NULL ? nb_key_value_choice(json, found[PLANET_QUALITY], quality_names, 2) : 0;
    if (quality < 0) return false;
    planet->atmosphere_desc.quality = (nebel_atmosphere_quality)quality;
    return try_planet(in, node, found[PLANET_COMPONENTS] != NULL, planet) &&
           nb_keys_read_clouds(in, found[PLANET_CLOUDS], planet) && charge(in, node, planet);
}

/* The model says which keys there may be. */
static int read_planet_model(nb_json *json, const nb_json_node *node)
{
    static const char *const model_names[] = {"physical", "textured"};
    for (const nb_json_node *one = nb_json_first(json, node); one != NULL; one = nb_json_next(json, one))
        if (nb_key_value_is_key(one, "", "model"))
            return nb_key_value_choice(json, one, model_names, NEBEL_PLANET_MODEL_COUNT);
    (void)nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                       "the key \"model\" is missing; must be one of: physical, textured");
    return -1;
}

static bool read_planet(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planet)
{
    if (!nb_key_value_is(in->json, node, NB_JSON_OBJECT, "an object {\"model\": ...}, or an array of those"))
        return false;
    const int model = read_planet_model(in->json, node);
    if (model < 0) return false;
    planet->model = (nebel_planet_model)model;
    for (int c = 0; c < 3; c++) planet->sun_left[c] = 1;
    return model == NEBEL_PLANET_TEXTURED ? nb_keys_read_layers(in, node, &planet->textured_desc)
                                          : read_physical(in, node, planet);
}

/* Planets that overlap would need air of air. */
static bool check_planets_apart(nb_scene_reader *in, const nb_json_node *node, const nebel_planet *planets,
                                size_t number)
{
    const nebel_atmosphere_desc *air = &planets[number].atmosphere_desc;
    double middle[3];
    nb_sphere_center_below(air->ground_point, air->radius, middle);
    for (size_t i = 0; i < number; i++) {
        const nebel_atmosphere_desc *other = &planets[i].atmosphere_desc;
        double between[3];
        nb_sphere_center_below(other->ground_point, other->radius, between);
        for (int c = 0; c < 3; c++) between[c] = middle[c] - between[c];
        if (nb_vector_length(between) > air->radius + air->thickness + other->radius + other->thickness) continue;
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node,
                            "overlaps planet[%zu], air included; give it a \"center\" of its own", i);
    }
    return true;
}

static bool read_one_of_many(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planets, size_t number)
{
    if (!read_planet(in, node, &planets[number])) return false;
    if (planets[number].model != NEBEL_PLANET_PHYSICAL)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "is a textured planet, which stands alone");
    if (number > 0 && planets[number].cloud_layer_count > 0)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "has clouds; the first planet alone may");
    return check_planets_apart(in, node, planets, number);
}

static bool read_planets(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planets, size_t *count)
{
    if (node->type != NB_JSON_ARRAY) {
        *count = 1;
        return read_planet(in, node, planets);
    }
    if (!nb_key_value_at_most(in->json, node, NEBEL_MAX_PLANETS, "a scene", "planets")) return false;
    for (const nb_json_node *one = nb_json_first(in->json, node); one != NULL; one = nb_json_next(in->json, one))
        if (!read_one_of_many(in, one, planets, (*count)++)) return false;
    return *count > 0 || nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "is empty; leave it out for no planet");
}

bool nb_keys_read_planet(nb_scene_reader *in, const nb_json_node *node)
{
    size_t count = 0;
    nebel_planet *planets = nb_arena_allocate(&in->scene->arena, NEBEL_MAX_PLANETS, sizeof *planets);
    if (planets == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    memset(planets, 0, NEBEL_MAX_PLANETS * sizeof *planets);
    if (!read_planets(in, node, planets, &count)) return false;
    in->scene->planets = planets;
    in->scene->data.planets = planets;
    in->scene->data.planet_count = count;
    return true;
}
