/* Where the rays of a packet pass walls (shadow_boundaries.h). */
#ifndef NB_CPU_BOUNDARY_CROSSINGS_H
#define NB_CPU_BOUNDARY_CROSSINGS_H

#include "packet_beam.h"

#include <string.h>

enum { NB_MAX_PASSAGES = 48 };

/* The first of each ray, the second of each, and so on, in m from the start of the ray, INFINITY where there is none.
 * The last bit of the number is not a part of it: it is 1 where the ray enters a shadow. */
typedef struct nb_boundary_crossings {
    float rows[NB_MAX_PASSAGES][NB_PACKET];
    int count; /* of rows */
} nb_boundary_crossings;

static inline int nb_enters(float passage)
{
    uint32_t bits;
    memcpy(&bits, &passage, sizeof bits);
    return (int)(bits & 1);
}

/* Of rays that begin where a place is in shadow, or not, and end before they pass a surface. Returns 0 where light and
 * shadow do not alternate, or where there are too many passages: then rounding has hidden a wall, or it is not known. */
int nb_boundary_crossings_find(const nb_shadow_boundaries *walls, const nb_beam *beam, const nb_shaft_rays *rays,
                               int is_dark, nb_boundary_crossings *passages);

#endif
