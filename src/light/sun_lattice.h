/* How much fog lies between any place in voxels and the sun, on a lattice.
 *
 * The lattice is sheared: its columns run along the way to the sun, and its layers are the faces of cells across the
 * axis that this way follows most, or lie between them, too. So the integral at every node of a column is had in one walk, exactly. Between nodes
 * it is interpolated, whose error is estimated by second differences.
 *
 * Where the box ends within fog, at one face here and at another one there, the depth has bends that no node sees. So
 * columns do not end there: beside the box the density goes on as it is at its faces. What lies outside is taken off
 * again: it is the integral at the place where the way to the sun leaves the box, on the same column. */
#ifndef NB_LIGHT_SUN_LATTICE_H
#define NB_LIGHT_SUN_LATTICE_H

#include "medium/grid.h"

#include <stddef.h>

/* Nodes of a block along an axis. The estimate of the error is one for each. */
#define NB_LATTICE_BLOCK 2

/* With p a place in cells, nodes are at whole numbers of
 *
 *     (p[side[0]] - lean[0] p[axis]) per_cell - first[0], the same of [1], and p[axis] per_layer,
 *
 * which count columns along both sides and layers. */
typedef struct nb_sun_lattice {
    int axis, side[2];
    double lean[2];  /* cells that the way moves aside from one layer to the next */
    int up;          /* whether the sun is where layers have larger numbers */
    int ends_in_fog; /* whether there is any at the faces of the box; 0: nothing lies outside */
    double end[3];   /* the faces towards the sun, in cells along both sides and the axis */
    double first[2];
    double per_cell, per_layer; /* columns along a side, layers along the axis */
    int count[3];               /* nodes: columns along both sides, layers; two at least */
    int blocks[3];              /* of nodes */
    double step;                /* what numbers of nodes are multiples of [m] */
    uint16_t *
        amount; /* integral of the density from the node to the last layer; columns along side[0] in turn. Less a twelfth
                            of its second differences, by which linear interpolation of a parabola is too large on average
                            */
    uint16_t *deviation; /* of each block: what interpolation may be off by in its cells, with one more node */
    size_t bytes;
} nb_sun_lattice;

/* How fine a lattice is at most. */
typedef struct nb_sun_lattice_limit {
    double per_cell;   /* columns */
    size_t most_nodes; /* columns are halved in number until they are no more */
    double per_layer;  /* layers in a cell */
} nb_sun_lattice_limit;

/* Lays a lattice out: axes and counts, without nodes. `to_sun`: cells per metre of the way to the sun, not all 0. */
void nb_sun_lattice_lay(nb_sun_lattice *lattice, const nebel_grid *grid, const double to_sun[3],
                        nb_sun_lattice_limit limit);

/* Lays it out and finds its nodes. The lattice keeps the grid. NULL where memory is out. */
nb_sun_lattice *nb_sun_lattice_make(nebel_grid *grid, const nebel_allocator *allocator, const double to_sun[3],
                                    nb_sun_lattice_limit limit);

/* What interpolation may be off by: so much of the light that comes through fog of this extinction [1/m]. */
typedef struct nb_lattice_demand {
    double extinction, tolerance;
} nb_lattice_demand;

/* Which cells between eight nodes are off by more, 1 or 0 for each, columns along side[0] in turn, then those along side[1].
 * Costs as much as making the lattice. Returns 0 where memory is out. */
int nb_sun_lattice_find_flaws(const nb_sun_lattice *lattice, const nb_lattice_demand *demand, uint8_t *flawed);

nb_sun_lattice *nb_sun_lattice_retain(nb_sun_lattice *lattice);

/* NULL: nothing happens. */
void nb_sun_lattice_release(nb_sun_lattice *lattice);

/* Whether this is the lattice that nb_sun_lattice_make would make. */
int nb_sun_lattice_is_of(const nb_sun_lattice *lattice, const nebel_grid *grid, const double to_sun[3],
                         nb_sun_lattice_limit limit);

#endif
