/* The sections "sun" and "lights". */
#include "scene/scene_internal.h"

bool nb_read_sun(nb_scene_reader *in, const nb_json_node *node)
{
    enum { DIRECTION, IRRADIANCE, COUNT };
    static const char *const names[] = {"direction", "irradiance"};
    static const nb_keys keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(COUNT) - 1, "a sun"};
    const nb_json_node *found[COUNT];
    nebel_scene_data *data = &in->scene->data;
    if (!nb_value_members(in->json, node, &keys, found) ||
        !nb_value_direction(in->json, found[DIRECTION], data->sun_direction) ||
        !nb_value_color(in->json, found[IRRADIANCE], &nb_range_light, data->sun_irradiance))
        return false;
    nb_space_convert_direction(&in->space, data->sun_direction);
    nb_vector_normalize(data->sun_direction, 3);
    data->has_sun = 1;
    return true;
}

enum { TYPE, NAME, POSITION, INTENSITY, RADIUS, DIRECTION, INNER_ANGLE, OUTER_ANGLE, LIGHT_KEY_COUNT };

static const char *const light_names[] = {"type",   "name",      "position",    "intensity",
                                          "radius", "direction", "inner_angle", "outer_angle"};

#define POINT_REQUIRED (NB_BIT(TYPE) | NB_BIT(POSITION) | NB_BIT(INTENSITY))
#define POINT_KEYS (POINT_REQUIRED | NB_BIT(NAME) | NB_BIT(RADIUS))
#define SPOT_REQUIRED (POINT_REQUIRED | NB_BIT(DIRECTION) | NB_BIT(OUTER_ANGLE))

static const nb_keys light_keys[] = {
    {light_names, LIGHT_KEY_COUNT, POINT_KEYS, POINT_REQUIRED, "a point light"},
    {light_names, LIGHT_KEY_COUNT, SPOT_REQUIRED | POINT_KEYS | NB_BIT(INNER_ANGLE), SPOT_REQUIRED, "a spot light"}};

static bool read_cone(nb_json *json, const nb_json_node *const *found, nebel_lamp *lamp)
{
    static const nb_range outer_range = {
        .low = 0, .high = 180, .open = true, .text = "a number of degrees from the axis, > 0 and < 180"};
    static const nb_range inner_range = {
        .low = 0, .high = 180, .text = "a number of degrees from the axis, from 0 to outer_angle"};
    if (!nb_value_direction(json, found[DIRECTION], lamp->direction) ||
        !nb_value_number(json, found[OUTER_ANGLE], &outer_range, &lamp->outer_angle) ||
        !nb_value_number(json, found[INNER_ANGLE], &inner_range, &lamp->inner_angle))
        return false;
    if (lamp->inner_angle <= lamp->outer_angle) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, found[INNER_ANGLE], "is %.15g; must be %s", lamp->inner_angle,
                        inner_range.text);
}

static bool keep_lamp(nb_scene_reader *in, const nb_json_node *node, const nebel_lamp *lamp, const char *name)
{
    nebel_scene *scene = in->scene;
    const size_t count = scene->data.lamp_count;
    void *lamps = scene->lamps, *names = (void *)scene->lamp_names;
    const bool room = nb_grow(&scene->allocator, &lamps, sizeof *lamp, count, &scene->lamp_capacity, count + 1);
    scene->lamps = lamps;
    const bool name_room =
        nb_grow(&scene->allocator, &names, sizeof name, count, &scene->lamp_name_capacity, count + 1);
    scene->lamp_names = names;
    if (!room || !name_room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->lamps[count] = *lamp;
    scene->lamp_names[count] = name;
    scene->data.lamp_count = count + 1;
    return true;
}

bool nb_read_light(nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const types[] = {"point", "spot"};
    static const nb_range radius_range = {.low = 1e-3, .high = 1e6, .dimension = NB_LENGTH, .text = "a length"};
    const nb_json_node *found[LIGHT_KEY_COUNT];
    const char *name = "";
    nebel_lamp lamp = {0};
    const int type = nb_value_type(in->json, node, types, 2);
    if (type < 0 || !nb_value_members(in->json, node, &light_keys[type], found) ||
        !nb_value_text(in->json, found[NAME], &in->scene->arena, &name) ||
        !nb_value_place(in->json, found[POSITION], lamp.position) ||
        !nb_value_color(in->json, found[INTENSITY], &nb_range_light, lamp.intensity) ||
        !nb_value_number(in->json, found[RADIUS], &radius_range, &lamp.radius) || !read_cone(in->json, found, &lamp))
        return false;
    lamp.type = (nebel_lamp_type)type;
    lamp.radius *= in->space.unit;
    nb_space_convert_place(&in->space, lamp.position);
    nb_space_convert_direction(&in->space, lamp.direction);
    nb_vector_normalize(lamp.direction, 3);
    return keep_lamp(in, node, &lamp, name);
}
