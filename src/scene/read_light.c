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

enum { TYPE, NAME, POSITION, INTENSITY, DIRECTION, INNER_ANGLE, OUTER_ANGLE, LIGHT_KEY_COUNT };

static const char *const light_names[] = {"type",      "name",        "position",   "intensity",
                                          "direction", "inner_angle", "outer_angle"};

#define POINT_REQUIRED (NB_BIT(TYPE) | NB_BIT(POSITION) | NB_BIT(INTENSITY))
#define SPOT_REQUIRED (POINT_REQUIRED | NB_BIT(DIRECTION) | NB_BIT(OUTER_ANGLE))

static const nb_keys light_keys[] = {
    {light_names, LIGHT_KEY_COUNT, POINT_REQUIRED | NB_BIT(NAME), POINT_REQUIRED, "a point light"},
    {light_names, LIGHT_KEY_COUNT, SPOT_REQUIRED | NB_BIT(NAME) | NB_BIT(INNER_ANGLE), SPOT_REQUIRED, "a spot light"}};

static bool check_cone(nb_json *json, const nb_json_node *const *found)
{
    static const nb_range outer_range = {
        .low = 0, .high = 180, .open = true, .text = "a number of degrees from the axis, > 0 and < 180"};
    static const nb_range inner_range = {
        .low = 0, .high = 180, .text = "a number of degrees from the axis, from 0 to outer_angle"};
    double inner = 0, outer = 0;
    if (!nb_value_number(json, found[OUTER_ANGLE], &outer_range, &outer) ||
        !nb_value_number(json, found[INNER_ANGLE], &inner_range, &inner))
        return false;
    if (inner <= outer) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, found[INNER_ANGLE], "is %.15g; must be %s", inner, inner_range.text);
}

/* A light is checked as a whole before it is refused, so that a scene is right on the day lights are built. */
bool nb_read_light(nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const types[] = {"point", "spot"};
    const nb_json_node *found[LIGHT_KEY_COUNT];
    double vector[3];
    const char *name;
    const int type = nb_value_type(in->json, node, types, 2);
    if (type < 0 || !nb_value_members(in->json, node, &light_keys[type], found) ||
        !nb_value_text(in->json, found[NAME], &in->scene->arena, &name) ||
        !nb_value_place(in->json, found[POSITION], vector) ||
        !nb_value_color(in->json, found[INTENSITY], &nb_range_light, vector) ||
        !nb_value_direction(in->json, found[DIRECTION], vector) || !check_cone(in->json, found))
        return false;
    return nb_json_fail(in->json, NEBEL_ERROR_UNSUPPORTED, node,
                        "this version cannot light with %s lights; remove \"lights\", or use \"sun\" and \"ambient\"",
                        types[type]);
}
