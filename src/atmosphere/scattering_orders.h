/* Where rounds of light that is scattered again and again lead. */
#ifndef NB_ATMOSPHERE_SCATTERING_ORDERS_H
#define NB_ATMOSPHERE_SCATTERING_ORDERS_H

#include "multiple_scattering.h"

enum { NB_MAX_ROUNDS = 16 };

/* Tables of moments that are not yet logarithms, of all light so far: each round has what was scattered once, and what air and
 * ground make of the round before. `all` becomes about what endless rounds would bring. Returns which part of light may be missing
 * from it, or be too much, for want of rounds. count: of rounds behind the first table, 2 to NB_MAX_ROUNDS; slowest: by colour, the
 * largest part of a round's gain that a next one was seen to bring, 0 at first. */
double nb_orders_extrapolate(int count, const nb_scattering_table tables[], double slowest[3],
                             nb_scattering_table *all);

#endif
