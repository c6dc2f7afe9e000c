/* How much fog lies between any place in voxels and a point light, on a lattice.
 *
 * Nodes lie on the axes of the voxels and hold the mean density on the way to the light, which unlike the depth has no cusp
 * there: the depth is that times the way's length, and so is what interpolation may be off by. It is estimated by second
 * differences. */
#ifndef NB_LIGHT_LIGHT_LATTICE_H
#define NB_LIGHT_LIGHT_LATTICE_H

#include "fog/snapshot.h"
#include "point_light.h"

#include <stdatomic.h>

/* A place of p cells along an axis is (p - first) per_cell nodes from the first one. */
typedef struct nb_light_lattice {
    double first, per_cell[3];
    int count[3];     /* nodes along each axis, two at least */
    float *mean;      /* density on the way from each node, those along x in turn, then along y */
    float *deviation; /* the same of each cell between eight nodes: what interpolation may be off by there */
} nb_light_lattice;

/* Of all voxels and lights of a lighting. */
typedef struct nb_light_lattices {
    nebel_allocator allocator;
    size_t medium_count, light_count, grid_count;
    size_t *grids;                /* the media that have lattices */
    nb_light_lattice **of_medium; /* of each medium one for each light; NULL: none */
    atomic_size_t begun, done;    /* lattices, light by light of each grid */
} nb_light_lattices;

/* Room for those of the linear voxels among the media, as fine as some 2^20 nodes in all allow; where that is too coarse there are none.
 * NULL where memory is out. */
nb_light_lattices *nb_light_lattices_open(const nebel_allocator *allocator, const nebel_snapshot *snapshot,
                                          size_t light_count);

/* Fills them, which costs some 2 us a node. Threads that come while others fill them help, and none returns before all is done. */
void nb_light_lattices_fill(nb_light_lattices *lattices, const nebel_snapshot *snapshot, const nb_light *lights);

/* NULL: nothing happens. */
void nb_light_lattices_free(nb_light_lattices *lattices);

#endif
