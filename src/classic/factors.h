/* The one place where a standard fog factor is evaluated for a state. */
#ifndef NB_CLASSIC_FACTORS_H
#define NB_CLASSIC_FACTORS_H

#include <nebel/classic.h>

/* f by mode, stage, start, end and density as they stand, which may be any numbers; 1 where it is none. */
double nb_factor_evaluate(const nebel_factor_desc *d, double c);

#endif
