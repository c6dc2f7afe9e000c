/* Light from everywhere at one place, by its moments. */
#ifndef NB_ATMOSPHERE_RADIANCE_MOMENTS_H
#define NB_ATMOSPHERE_RADIANCE_MOMENTS_H

#include "optical_depth.h"

/* Of each order those that tell the sun's side from the other; light is the same on both sides of the plane through the
 * zenith and the sun. */
enum { NB_FIELD = NB_MOMENTS * (NB_MOMENTS + 1) / 2 };

/* The frame of a field has z towards the sun and x towards the zenith. Air asks for the orders 0 to 2, dust for those that its phase
 * function has: `orders` says how many are kept. */
typedef struct nb_radiance_moments {
    double moments[NB_FIELD][3];
} nb_radiance_moments;

/* The cosines of a direction to the zenith and to the sun, and of the sun to the zenith. */
typedef struct nb_moment_basis {
    double zenith, sun, height_of_sun;
} nb_moment_basis;

/* Adds light (radiance times solid angle) that comes from a direction. */
void nb_radiance_moments_add(nb_radiance_moments *field, int orders, nb_moment_basis from, const double light[3]);

#endif
