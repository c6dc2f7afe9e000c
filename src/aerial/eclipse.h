/* How much of the sun is seen past a ball. */
#ifndef NB_AERIAL_ECLIPSE_H
#define NB_AERIAL_ECLIPSE_H

#include "math/vector.h"

/* The part of a disc that another leaves of it: discs of angular radii `sun` and `ball`, `apart` between their middles. Both
 * count as flat, where the area of two circles' overlap is that of two segments. */
static inline double nb_eclipse_discs(double sun, double ball, double apart)
{
    if (!(apart < sun + ball)) return 1;
    if (apart <= ball - sun) return 0;
    if (apart <= sun - ball) return 1 - ball * ball / (sun * sun);
    /* Half the angles of the segments, from the law of cosines. */
    const double of_sun = acos(fmax(-1, fmin(1, ((apart - ball) * (apart + ball) + sun * sun) / (2 * apart * sun))));
    const double of_ball = acos(fmax(-1, fmin(1, ((apart - sun) * (apart + sun) + ball * ball) / (2 * apart * ball))));
    const double overlap =
        sun * sun * (of_sun - sin(of_sun) * cos(of_sun)) + ball * ball * (of_ball - sin(of_ball) * cos(of_ball));
    return fmax(0, fmin(1, 1 - overlap / (3.14159265358979323846 * sun * sun)));
}

/* At a place, for a ball around `center`; `to_sun` has the length 1, `sun` is the radius of the sun's disc, 0: a point. */
static inline double nb_eclipse_left(const double place[3], const double center[3], double radius,
                                     const double to_sun[3], double sun)
{
    double to_ball[3], across[3];
    for (int c = 0; c < 3; c++) to_ball[c] = center[c] - place[c];
    const double far = nb_vector_length(to_ball);
    if (!(far > radius)) return 0;
    nb_vector_cross(to_ball, to_sun, across);
    return nb_eclipse_discs(sun, asin(radius / far), atan2(nb_vector_length(across), nb_vector_dot(to_ball, to_sun)));
}

#endif
