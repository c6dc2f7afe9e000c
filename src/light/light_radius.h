/* The ball that a point light shines from. */
#ifndef NB_LIGHT_LIGHT_RADIUS_H
#define NB_LIGHT_LIGHT_RADIUS_H

#define NB_MIN_LIGHT_RADIUS                                                                                            \
    1e-3 /* m, radius of point lights that are given none: what a ray through a point light sees has no bound without one */

/* What is nearer gets no more light than at this distance [m], and casts no shadow: a point light may stand on a
 * surface, or lie in it, without rounding deciding what it lights. */
static inline double nb_light_radius(double radius)
{
    return radius > NB_MIN_LIGHT_RADIUS ? radius : NB_MIN_LIGHT_RADIUS;
}

#endif
