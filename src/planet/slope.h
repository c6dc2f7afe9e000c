/* Slopes of rays from one place: which row of a table a slope is, and where its ray goes. */
#ifndef NB_PLANET_SLOPE_H
#define NB_PLANET_SLOPE_H

#include "air.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/planet.inc"

/* `radius` is at least the ground's. */
nb_outlook nb_outlook_make(const nb_airs *airs, double radius);

/* Cosine and sine of the angle to the zenith. */
typedef struct nb_slope {
    double cosine, sine;
} nb_slope;

/* What follows is asked for every ray, and inline for that reason. */

/* fmin and fmax are calls, which here take as long as all else. */
static inline double nb_larger(double a, double b)
{
    return a > b ? a : b;
}

static inline double nb_smaller(double a, double b)
{
    return a < b ? a : b;
}

/* Whether a ray of a slope meets the ground. */
static inline int nb_outlook_falls(const nb_outlook *outlook, nb_slope slope)
{
    return nb_above_horizon(*outlook, slope.cosine, slope.sine) < 0;
}

static inline nb_reach nb_outlook_reach(const nb_outlook *outlook, nb_slope slope)
{
    return nb_outlook_falls(outlook, slope) ? nb_falling_reach(*outlook, slope.cosine, slope.sine)
                                            : nb_rising_reach(*outlook, slope.cosine, slope.sine);
}

/* The other way: the slope of a row, with its reach. */
nb_slope nb_outlook_slope(const nb_outlook *outlook, int falls, double row, nb_reach *reach);

#endif
