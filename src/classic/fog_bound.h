/* How far fog that is linear over a triangle is from the exact one, proven for the whole triangle. */
#ifndef NB_CLASSIC_FOG_BOUND_H
#define NB_CLASSIC_FOG_BOUND_H

#include "march/snapshot.h"

/* m along an axis: places farther from the eye have no bound. */
#define NB_FARTHEST_BOUND 5e5

/* Whether nb_bound_fog knows the fog: volumes of constant density, each world, box, convex body, sphere, ellipsoid or
 * cylinder, that only add up and begin at the eye. */
int nb_fog_can_be_bounded(const nebel_snapshot *snapshot);

/* A bound of |f - L| anywhere on a triangle, where f is the exact transmittance of a channel between the eye and the
 * place and L is linear between the exact f of the three corners; `ways` go from the eye to the corners. At most 1. */
double nb_bound_fog(const nebel_snapshot *snapshot, const double eye[3], int channel, const double ways[3][3]);

#endif
