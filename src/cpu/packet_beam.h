/* A packet of rays as one ray that has a width, for trees of boxes. */
#ifndef NB_CPU_PACKET_BEAM_H
#define NB_CPU_PACKET_BEAM_H

#include "shaft_rays.h"

/* A border that a beam comes to at `scale` (border - at) m from its beginning, or later by `never`. */
typedef struct nb_border {
    float at, scale, never;
} nb_border;

/* Of each axis of the plane, where the first of its rays may enter a box and the last may leave it; and depths of the
 * rays that are deepest and least deep. */
typedef struct nb_beam {
    float from, length; /* m along the rays */
    int falls[2];       /* it comes to the high border first */
    nb_border enter[2], leave[2], depth;
    int rises; /* towards where shadows are */
    float most, most_rise, least, least_rise;
} nb_beam;

/* Of those rays of which anything is asked for; at least one. */
void nb_beam_set(nb_beam *beam, const nb_shaft_rays *rays);

/* Where the beam may be between borders of the plane, in m from its beginning: nowhere if enter > leave. Macro, because
 * compilers make vectors of loops without calls only. */
#define NB_BEAM_CROSS(beam, first_x, last_x, first_y, last_y, enter, leave)                                            \
    do {                                                                                                               \
        const float in_x = ((first_x) - (beam)->enter[0].at) * (beam)->enter[0].scale;                                 \
        const float in_y = ((first_y) - (beam)->enter[1].at) * (beam)->enter[1].scale;                                 \
        const float out_x = ((last_x) - (beam)->leave[0].at) * (beam)->leave[0].scale + (beam)->leave[0].never;        \
        const float out_y = ((last_y) - (beam)->leave[1].at) * (beam)->leave[1].scale + (beam)->leave[1].never;        \
        const float in = in_x > in_y ? in_x : in_y, out = out_x < out_y ? out_x : out_y;                               \
        (enter) = in > 0 ? in : 0;                                                                                     \
        (leave) = out < (beam)->length ? out : (beam)->length;                                                         \
    } while (0)

#endif
