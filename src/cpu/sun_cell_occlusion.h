/* Whether triangles hide all of a cell from the sun, and from which depth on. */
#ifndef NB_CPU_SUN_CELL_OCCLUSION_H
#define NB_CPU_SUN_CELL_OCCLUSION_H

#include "occluders.h"

enum { NB_MAX_COVER = 200 }; /* triangles; of more nothing is known */

/* A part of the plane that the sun looks at. */
typedef struct nb_sun_cell {
    float low[2], high[2];
} nb_sun_cell;

/* Depths of a triangle within a cell: all that it has there, and perhaps some that it has beside it. */
typedef struct nb_occlusion_depths {
    float nearest, farthest;
} nb_occlusion_depths;

/* Of two places in the plane, in an order that does not depend on how they are given. */
static inline int nb_comes_first(const float a[3], const float b[3])
{
    for (int i = 0; i < 2; i++)
        if (a[i] != b[i]) return a[i] < b[i];
    return a[2] < b[2];
}

nb_occlusion_depths nb_depths_in(const nb_occluder *triangle, const nb_sun_cell *bounds, const nb_sun_cell *cell);

/* The depth from which on all of the cell is in shadow, INFINITY where that is not known. `list` has all triangles whose
 * bounds touch the cell, and `depths` those of each. Triangles with holes cover nothing.
 *
 * Triangles whose depths overlap are taken together, and each such layer is asked by itself. Where neighbours have a
 * common edge it cancels in the sum over both; where nothing is left of the edges within the cell the layer has no
 * border there, and passes over each place as often, counted with its sign: once, that is as often as over any place,
 * or not at all. Edges are known by their ends' coordinates, to 64 bits of a hash. */
float nb_covered_from(const nb_occluders *casters, const uint32_t *list, const nb_occlusion_depths *depths,
                      size_t count, const nb_sun_cell *cell);

#endif
