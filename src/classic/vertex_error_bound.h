/* How far fog that is linear over a triangle is from the exact one, proven for the whole triangle. */
#ifndef NB_CLASSIC_VERTEX_ERROR_BOUND_H
#define NB_CLASSIC_VERTEX_ERROR_BOUND_H

#include "fog/snapshot.h"

/* m along an axis: places farther from the eye have no bound. */
#define NB_FARTHEST_BOUND 5e5

typedef struct nb_fog_bound nb_fog_bound;

/* What nb_bound_fog wants to know of the fog of a channel as seen from an eye. The snapshot must outlive it.
 * UNSUPPORTED, after a message: grids; soft edges of a cylinder, a cone, a capsule or a body of more than 32 planes; a body
 * that is, with those that take its fog away, of more than 8 leaves. */
nebel_result nb_make_fog_bound(const nebel_allocator *allocator, const nebel_snapshot *snapshot, const double eye[3],
                               int channel, nb_fog_bound **bound);
void nb_free_fog_bound(nb_fog_bound *bound); /* NULL is fine */

/* Intervals in which the exact transmittance f of every place of a triangle lies, and its derivatives along the edges
 * from each corner to the next, per edge, where it has any; but for rounding. f may jump only where the latter
 * have no bound. `ways` go from the eye to the corners. */
void nb_enclose_fog(const nb_fog_bound *bound, const double ways[3][3], double range[2], double slopes[3][2]);

/* A bound of |f - L| anywhere on a triangle, where f is the exact transmittance between the eye and the place and L is
 * linear between the exact f of the three corners. At most 1. */
double nb_bound_fog(const nb_fog_bound *bound, const double ways[3][3]);

#endif
