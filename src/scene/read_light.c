/* The sections "sun" and "lights". */
#include "scene_data.h"

#include <float.h>
#include <string.h>

enum { SUN_FRAME, SUN_DIRECTION, SUN_IRRADIANCE, SUN_KEYS, SUN_KEY_COUNT };

static const char *const sun_names[] = {"frame", "direction", "irradiance", "keys"};

#define SUN_LIGHT (NB_BIT(SUN_DIRECTION) | NB_BIT(SUN_IRRADIANCE))

/* What is not there stays as it is. */
static bool read_sunlight(const nb_scene_reader *in, const nb_json_node *const *found, nebel_sun *sun)
{
    if (!nb_key_value_color(in->json, found[SUN_IRRADIANCE], &nb_range_light, sun->irradiance)) return false;
    if (found[SUN_DIRECTION] == NULL) return true;
    if (!nb_key_value_direction(in->json, found[SUN_DIRECTION], sun->direction)) return false;
    nb_file_units_convert_direction(&in->space, sun->direction);
    nb_vector_normalize(sun->direction, 3);
    return true;
}

static bool read_sun_key(const nb_scene_reader *in, const nb_json_node *node, nebel_sun_key *key)
{
    static const nb_key_set keys = {sun_names, SUN_KEY_COUNT, NB_BIT(SUN_FRAME) | SUN_LIGHT, NB_BIT(SUN_FRAME),
                                    "a key of the sun"};
    const nb_json_node *found[SUN_KEY_COUNT];
    return nb_key_value_members(in->json, node, &keys, found) &&
           nb_key_value_number(in->json, found[SUN_FRAME], &nb_range_frame, &key->frame) &&
           read_sunlight(in, found, &key->sun);
}

static bool read_sun_keys(nb_scene_reader *in, const nb_json_node *node, const nebel_sun *sun)
{
    nebel_scene_data *data = &in->scene->data;
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array of keys of the sun")) return false;
    if (node->count == 0) return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "holds no key; give one or more");
    nebel_sun_key *keys = nb_arena_allocate(&in->scene->arena, node->count, sizeof *keys);
    if (keys == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(in->json, node); at != NULL; at = nb_json_next(in->json, at), i++) {
        keys[i].sun = *sun;
        if (!read_sun_key(in, at, &keys[i])) return false;
        if (i > 0 && keys[i].frame <= keys[i - 1].frame)
            return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, at,
                                "its frame %.15g is not after the key before it, %.15g; frames must ascend",
                                keys[i].frame, keys[i - 1].frame);
    }
    data->sun_keys = keys;
    data->sun_key_count = node->count;
    return true;
}

bool nb_keys_read_sun(nb_scene_reader *in, const nb_json_node *node)
{
    static const nb_key_set keys = {sun_names, SUN_KEY_COUNT, SUN_LIGHT | NB_BIT(SUN_KEYS), SUN_LIGHT, "a sun"};
    const nb_json_node *found[SUN_KEY_COUNT];
    nebel_scene_data *data = &in->scene->data;
    nebel_sun sun;
    if (!nb_key_value_members(in->json, node, &keys, found) || !read_sunlight(in, found, &sun) ||
        !read_sun_keys(in, found[SUN_KEYS], &sun))
        return false;
    memcpy(data->sun_direction, sun.direction, sizeof sun.direction);
    memcpy(data->sun_irradiance, sun.irradiance, sizeof sun.irradiance);
    data->has_sun = 1;
    return true;
}

enum {
    LIGHT_TYPE,
    LIGHT_NAME,
    LIGHT_POSITION,
    LIGHT_INTENSITY,
    LIGHT_RADIUS,
    LIGHT_DIRECTION,
    LIGHT_INNER_ANGLE,
    LIGHT_OUTER_ANGLE,
    LIGHT_KEY_COUNT
};

static const char *const light_names[] = {"type",   "name",      "position",    "intensity",
                                          "radius", "direction", "inner_angle", "outer_angle"};

#define POINT_REQUIRED (NB_BIT(LIGHT_TYPE) | NB_BIT(LIGHT_POSITION) | NB_BIT(LIGHT_INTENSITY))
#define POINT_KEYS (POINT_REQUIRED | NB_BIT(LIGHT_NAME) | NB_BIT(LIGHT_RADIUS))
#define SPOT_REQUIRED (POINT_REQUIRED | NB_BIT(LIGHT_DIRECTION) | NB_BIT(LIGHT_OUTER_ANGLE))

static const nb_key_set light_keys[] = {{light_names, LIGHT_KEY_COUNT, POINT_KEYS, POINT_REQUIRED, "a point light"},
                                        {light_names, LIGHT_KEY_COUNT,
                                         SPOT_REQUIRED | POINT_KEYS | NB_BIT(LIGHT_INNER_ANGLE), SPOT_REQUIRED,
                                         "a spot light"}};

static bool read_cone(nb_json *json, const nb_json_node *const *found, nebel_light *light)
{
    static const nb_range outer_range = {
        .low = DBL_TRUE_MIN, .high = 180, .text = "a number of degrees from the axis, > 0 and <= 180"};
    static const nb_range inner_range = {
        .low = 0, .high = 180, .text = "a number of degrees from the axis, from 0 to outer_angle"};
    if (!nb_key_value_direction(json, found[LIGHT_DIRECTION], light->direction) ||
        !nb_key_value_number(json, found[LIGHT_OUTER_ANGLE], &outer_range, &light->outer_angle) ||
        !nb_key_value_number(json, found[LIGHT_INNER_ANGLE], &inner_range, &light->inner_angle))
        return false;
    if (light->inner_angle <= light->outer_angle) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, found[LIGHT_INNER_ANGLE], "is %.15g; must be %s", light->inner_angle,
                        inner_range.text);
}

static bool keep_light(nb_scene_reader *in, const nb_json_node *node, const nebel_light *light, const char *name)
{
    nebel_scene *scene = in->scene;
    const size_t count = scene->data.light_count;
    void *lights = scene->lights, *names = (void *)scene->light_names;
    const bool room = nb_grow(&scene->allocator, &lights, sizeof *light, count, &scene->light_capacity, count + 1);
    scene->lights = lights;
    const bool name_room =
        nb_grow(&scene->allocator, &names, sizeof name, count, &scene->light_name_capacity, count + 1);
    scene->light_names = names;
    if (!room || !name_room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->lights[count] = *light;
    scene->light_names[count] = name;
    scene->data.light_count = count + 1;
    return true;
}

/* The other word for what a point with a radius is: a list of the words that there are would not help. */
static const nb_json_node *find_sphere(const nb_json *json, const nb_json_node *node)
{
    static const char word[] = "sphere";
    if (node->type != NB_JSON_OBJECT) return NULL;
    for (const nb_json_node *child = nb_json_first(json, node); child != NULL; child = nb_json_next(json, child))
        if (nb_json_has_key(child, "type") && child->type == NB_JSON_STRING && child->string_size == strlen(word) &&
            memcmp(child->string, word, strlen(word)) == 0)
            return child;
    return NULL;
}

bool nb_keys_read_light(nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const types[] = {"point", "spot"};
    static const nb_range radius_range = {.low = 1e-3, .high = 1e6, .dimension = NB_LENGTH, .text = "a length"};
    const nb_json_node *found[LIGHT_KEY_COUNT];
    const char *name = "";
    nebel_light light = {0};
    const nb_json_node *sphere = find_sphere(in->json, node);
    if (sphere != NULL)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, sphere,
                            "unknown; must be one of: point, spot; a ball that shines is a point with a \"radius\"");
    const int type = nb_key_value_type(in->json, node, types, 2);
    if (type < 0 || !nb_key_value_members(in->json, node, &light_keys[type], found) ||
        !nb_key_value_text(in->json, found[LIGHT_NAME], &in->scene->arena, &name) ||
        !nb_key_value_place(in->json, found[LIGHT_POSITION], light.position) ||
        !nb_key_value_color(in->json, found[LIGHT_INTENSITY], &nb_range_light, light.intensity) ||
        !nb_key_value_number(in->json, found[LIGHT_RADIUS], &radius_range, &light.radius) ||
        !read_cone(in->json, found, &light))
        return false;
    light.type = (nebel_light_type)type;
    light.radius *= in->space.unit;
    nb_file_units_convert_place(&in->space, light.position);
    nb_file_units_convert_direction(&in->space, light.direction);
    nb_vector_normalize(light.direction, 3);
    return keep_light(in, node, &light, name);
}
