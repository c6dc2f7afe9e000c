/* What the formulas of formula_level.h should give, written the plain way: intervals from where a ray meets each
 * surface and which pieces between are inside, integrals by quadrature between kinks. In twice the digits of a double
 * or more. */
#ifndef NB_FORMULA_TRUTH_H
#define NB_FORMULA_TRUTH_H

#include "formula_level.h"

#include <float.h>

#if defined(__SIZEOF_FLOAT128__) && LDBL_MANT_DIG < 113
__extension__ typedef __float128 nb_quad;
enum { NB_QUAD_DIGITS = 113 };
#else
typedef long double nb_quad;
enum { NB_QUAD_DIGITS = LDBL_MANT_DIG };
#endif

typedef struct nb_quad_interval {
    int hit;
    nb_quad enter, leave;
} nb_quad_interval;

/* Whether x is in the box, half space, ball, tube, cone or capsule that `in` describes. */
int nb_truth_inside(nb_formula shape, const long double *in, const nb_quad x[3]);

/* Where p + t d is inside, anywhere on the line. Ends that do not exist are at -1e18 and 1e18. */
nb_quad_interval nb_truth_interval(nb_formula shape, const long double *in, const nb_quad p[3], const nb_quad d[3]);

/* The density of an integral's profile after s metres. */
long double nb_truth_density(nb_formula integral, const long double *in, long double s);

/* The integral from its start over h metres, by 10-point Gauss rules between kinks. */
long double nb_truth_integral(nb_formula integral, const long double *in);

#endif
