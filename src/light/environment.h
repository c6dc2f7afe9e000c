/* The sky: ambient light that is not the same from everywhere, and what fog and surfaces make of it. */
#ifndef NB_LIGHT_ENVIRONMENT_H
#define NB_LIGHT_ENVIRONMENT_H

#include "base/base.h"
#include "medium/phase.h"

#include <nebel/light.h>

/* What a phase function makes of a sky: of a gradient the mean of |sine of elevation| about a direction, of a map
 * a table of the radiance that is scattered. Never changes; counted by its owners. */
typedef struct nb_environment_filter nb_environment_filter;

/* Of a map's frame about the vertical. */
typedef struct nb_environment_rotation {
    double cosine, sine;
} nb_environment_rotation;

/* A sky and a filter of it, both of which it needs. */
typedef struct nb_environment_light {
    const nebel_environment *sky;
    nb_environment_filter *filter;
    nb_environment_rotation turn;
} nb_environment_light;

/* Errors: ARGUMENT, VALUE. */
nebel_result nb_check_sky(const nebel_log *log, const nebel_environment *sky);

/* The largest radiance of a sky that is in order, in each channel. */
void nb_environment_most(const nebel_environment *sky, double most[3]);

/* Of a gradient or a map that is in order, with one owner. Filters of maps are shared. NULL when memory is
 * out. */
nb_environment_filter *nb_environment_filter_make(const nebel_allocator *allocator, const nebel_environment *sky,
                                                  const nb_phase *phase);
nb_environment_filter *nb_environment_filter_retain(nb_environment_filter *filter);
void nb_environment_filter_release(nb_environment_filter *filter); /* NULL is fine */

nb_environment_light nb_environment_light_of(const nebel_environment *sky, nb_environment_filter *filter);

/* The phase function of a filter. */
const nb_phase *nb_environment_filter_phase(const nb_environment_filter *filter);

/* What fog scatters of the sky along a ray of a direction of unit length, at albedo 1, where it is opaque. */
void nb_environment_scattered(const nb_environment_light *light, const double direction[3], double radiance[3]);

#endif
