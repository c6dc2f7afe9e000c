/* Numbers that should be near others. */
#ifndef NEAR_H
#define NEAR_H

#include "unit.h"

#include <math.h>

static inline void assert_near(double got, double wanted, double tolerance)
{
    if (!(fabs(got - wanted) <= tolerance)) fail_msg("%.17g should be %.17g within %g", got, wanted, tolerance);
}

/* As a number is read and converted: to some units of its last digit. */
static inline void assert_number(double got, double wanted)
{
    assert_near(got, wanted, 1e-15 * fabs(wanted));
}

static inline void assert_vector(const double *got, double x, double y, double z)
{
    const double wanted[3] = {x, y, z};
    for (int i = 0; i < 3; i++) assert_number(got[i], wanted[i]);
}

#endif
