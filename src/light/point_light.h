/* Point lights as the core keeps them, see formulas/point_light.inc. */
#ifndef NB_LIGHT_POINT_LIGHT_H
#define NB_LIGHT_POINT_LIGHT_H

#include "base/base.h"

#include <nebel/light.h>

typedef struct nb_light {
    double place[3], intensity[3];
    double radius2; /* > 0 */
    double clear;   /* m from its centre that light does not pass through fog; 0 where no radius was given */
    int is_spot;
    double axis[3];           /* of length 1 */
    double edge, inner, rise; /* cosines of the outer and the inner angle; what nb_light_cone takes */
} nb_light;

/* Says through the log which of the point lights is not in order, and why. */
nebel_result nb_check_lights(const nebel_log *log, size_t count, const nebel_light *lights);

/* Of a point light that is in order. */
nb_light nb_light_resolve(const nebel_light *light);

#endif
