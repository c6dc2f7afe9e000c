/* The density of a volume at a place, and how much of it there may be along a ray. */
#ifndef NB_MEDIUM_DENSITY_H
#define NB_MEDIUM_DENSITY_H

#include "overlap_test.h"

/* Whether the body is at `place` [m]. */
int nb_volume_holds(const nb_volume *volume, const double place[3]);

/* What fraction of its extinction a volume has at a place that it holds. */
double nb_density_within(const nb_volume *volume, const double place[3]);

/* The same at any place: 0 outside. */
double nb_density_at(const nb_volume *volume, const double place[3]);

/* The most that voxels have; 1 for densities in closed form. */
double nb_density_peak(const nebel_density *density);

/* No place of the piece from `from` to `to` [m], which may be infinite, has more. */
double nb_density_most(const nb_volume *volume, const nb_line *line, double from, double to);

/* Over this length [m] behind `from` the bound is within a few times of the density, as far as bounds are known that are
 * better than the largest density; HUGE_VAL where shorter pieces would not be bounded better. */
double nb_density_scale(const nb_volume *volume, const nb_line *line, double from);

#endif
