/* Bounds of a convex body given as half spaces, and whether there is a body at all. */
#ifndef NB_MEDIUM_CONVEX_H
#define NB_MEDIUM_CONVEX_H

#include <stddef.h>

/* The body is the intersection of n half spaces planes[i][0..2] . x <= planes[i][3], normals of unit length.
 *
 * Returns 0 when the body is empty, else 1 and its axis-aligned bounds, -INFINITY or INFINITY where it has no end. n ==
 * 0 is all of space. No allocation; a handful of passes over the planes.
 *
 * Empty: let r be the radius of the largest ball in the body (negative: how far the half spaces are from meeting), and
 * D the mean of |distance| over the planes that hold that ball, weighted by how strongly they hold it. The body is
 * empty when r <= 16 * 2^-52 * D: a plate has to be thicker than what rounding its planes can do. Planes that do not
 * touch the ball have no say, so a small body stays a body beside a far redundant plane.
 *
 * The bounds enclose the body in spite of rounding: they are certificates of linear programming duality, not computed
 * corners, so they hold however badly the planes are conditioned, and are then merely wider. A body that ends only
 * beyond 2^35 times its largest distance counts as endless. Planes that lean by less than 1e-14 against an axis count
 * as parallel to it as far as that. */
int nb_convex_bounds(const double (*planes)[4], size_t n, double low[3], double high[3]);

#endif
