/* The standard fog factors in double, from the one formula text. */
#include <nebel/classic.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/medium.inc"

double nebel_fog_factor_linear(double c, double start, double end)
{
    return nb_fog_linear(c, start, end);
}

double nebel_fog_factor_exp(double c, double density)
{
    return nb_fog_exp(c, density);
}

double nebel_fog_factor_exp2(double c, double density)
{
    return nb_fog_exp2(c, density);
}
