/* Numbers that should be near others. */
#ifndef NEAR_H
#define NEAR_H

#include "unit.h"

#include <math.h>

static inline void assert_near(double got, double wanted, double tolerance)
{
    if (!(fabs(got - wanted) <= tolerance)) fail_msg("%.17g should be %.17g within %g", got, wanted, tolerance);
}

#endif
