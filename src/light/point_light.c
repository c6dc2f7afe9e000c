#include "point_light.h"

#include "light_radius.h"

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

static const char *fault_of_cone(const nebel_light *lamp)
{
    const double length = length_of(lamp->direction);
    if (!(length >= NEBEL_MIN_DIRECTION && length <= NEBEL_MAX_DIRECTION))
        return "direction: must be three finite numbers, not all zero, of a length from " NB_TEXT(
            NEBEL_MIN_DIRECTION) " to " NB_TEXT(NEBEL_MAX_DIRECTION);
    if (!(lamp->outer_angle > 0 && lamp->outer_angle <= 180))
        return "outer_angle: must be more than 0 and at most 180 degrees";
    if (!(lamp->inner_angle >= 0 && lamp->inner_angle <= lamp->outer_angle))
        return "inner_angle: must be from 0 to outer_angle";
    return NULL;
}

static const char *fault_of_lamp(const nebel_light *lamp)
{
    if (lamp->type != NEBEL_LIGHT_POINT && lamp->type != NEBEL_LIGHT_SPOT) return "the type is unknown";
    if (!is_within(lamp->position, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH))
        return "position: must be three finite numbers, at most " NB_TEXT(NEBEL_MAX_LENGTH) " m from the origin";
    if (!is_within(lamp->intensity, 0, NEBEL_MAX_AMOUNT))
        return "intensity: every channel must be within 0 and " NB_TEXT(NEBEL_MAX_AMOUNT);
    if (lamp->radius != 0 && !(lamp->radius >= NB_MIN_LIGHT_RADIUS && lamp->radius <= largest_radius))
        return "radius: must be 0 or a length from 1e-3 to 1e6 m";
    return lamp->type == NEBEL_LIGHT_SPOT ? fault_of_cone(lamp) : NULL;
}

nebel_result nb_check_lights(const nebel_log *log, size_t count, const nebel_light *lamps)
{
    for (size_t i = 0; i < count; i++) {
        const char *fault = fault_of_lamp(&lamps[i]);
        if (fault != NULL) return nb_fail(log, NEBEL_ERROR_VALUE, "lamp %zu: %s", i, fault);
    }
    return NEBEL_OK;
}

/* Adding +0 makes every zero positive, as the march does with directions of its own. */
static void set_cone(const nebel_light *lamp, nb_light *made)
{
    const double length = length_of(lamp->direction);
    for (int i = 0; i < 3; i++) made->axis[i] = lamp->direction[i] / length + 0;
    made->is_spot = 1;
    made->edge = cos(lamp->outer_angle * (PI / 180));
    made->inner = cos(lamp->inner_angle * (PI / 180));
    made->rise = fmin(1 / (made->inner - made->edge), 1e30);
}

nb_light nb_light_resolve(const nebel_light *lamp)
{
    const double radius = nb_light_radius(lamp->radius);
    nb_light made = {.radius2 = radius * radius, .clear = lamp->radius};
    for (int i = 0; i < 3; i++) {
        made.place[i] = lamp->position[i] + 0;
        made.intensity[i] = lamp->intensity[i] + 0;
    }
    if (lamp->type == NEBEL_LIGHT_SPOT) set_cone(lamp, &made);
    return made;
}
