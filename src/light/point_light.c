#include "point_light.h"

#include <math.h>

#define PI 3.14159265358979323846

static const double largest_radius = 1e6;

static int is_within(const double v[3], double low, double high)
{
    for (int i = 0; i < 3; i++)
        if (!(v[i] >= low && v[i] <= high)) return 0;
    return 1;
}

static double length_of(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

static const char *fault_of_cone(const nebel_light *light)
{
    const double length = length_of(light->direction);
    if (!(length >= NEBEL_MIN_DIRECTION && length <= NEBEL_MAX_DIRECTION))
        return "direction: must be three finite numbers, not all zero, of a length from " NB_TEXT(
            NEBEL_MIN_DIRECTION) " to " NB_TEXT(NEBEL_MAX_DIRECTION);
    if (!(light->outer_angle > 0 && light->outer_angle <= 180))
        return "outer_angle: must be more than 0 and at most 180 degrees";
    if (!(light->inner_angle >= 0 && light->inner_angle <= light->outer_angle))
        return "inner_angle: must be from 0 to outer_angle";
    return NULL;
}

static const char *fault_of_light(const nebel_light *light)
{
    if (light->type != NEBEL_LIGHT_POINT && light->type != NEBEL_LIGHT_SPOT) return "the type is unknown";
    if (!is_within(light->position, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH))
        return "position: must be three finite numbers, at most " NB_TEXT(NEBEL_MAX_LENGTH) " m from the origin";
    if (!is_within(light->intensity, 0, NEBEL_MAX_AMOUNT))
        return "intensity: every channel must be within 0 and " NB_TEXT(NEBEL_MAX_AMOUNT);
    if (light->radius != 0 && !(light->radius >= NEBEL_MIN_LIGHT_RADIUS && light->radius <= largest_radius))
        return "radius: must be 0 or a length from 1e-3 to 1e6 m";
    return light->type == NEBEL_LIGHT_SPOT ? fault_of_cone(light) : NULL;
}

nebel_result nb_check_lights(const nebel_log *log, size_t count, const nebel_light *lights)
{
    for (size_t i = 0; i < count; i++) {
        const char *fault = fault_of_light(&lights[i]);
        if (fault != NULL) return nb_fail(log, NEBEL_ERROR_VALUE, "light %zu: %s", i, fault);
    }
    return NEBEL_OK;
}

/* Adding +0 makes every zero positive, as the march does with directions of its own. */
static void set_cone(const nebel_light *light, nb_light *made)
{
    const double length = length_of(light->direction);
    for (int i = 0; i < 3; i++) made->axis[i] = light->direction[i] / length + 0;
    made->is_spot = 1;
    made->edge = cos(light->outer_angle * (PI / 180));
    made->inner = cos(light->inner_angle * (PI / 180));
    made->rise = fmin(1 / (made->inner - made->edge), 1e30);
}

nb_light nb_light_resolve(const nebel_light *light)
{
    const double radius = fmax(light->radius, NEBEL_MIN_LIGHT_RADIUS);
    nb_light made = {.radius2 = radius * radius, .clear = light->radius};
    for (int i = 0; i < 3; i++) {
        made.place[i] = light->position[i] + 0;
        made.intensity[i] = light->intensity[i] + 0;
    }
    if (light->type == NEBEL_LIGHT_SPOT) set_cone(light, &made);
    return made;
}
