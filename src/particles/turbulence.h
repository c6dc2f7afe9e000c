/* Smooth random fields for what drifts through a nebula. */
#ifndef NB_PARTICLES_TURBULENCE_H
#define NB_PARTICLES_TURBULENCE_H

#include <stdint.h>

/* A number in [0, 1) for each i of a seed's sequence. Source of the mixing: Steele, Lea and Flood 2014 (SplitMix64). */
double nb_chance(uint64_t seed, uint64_t i);

/* Five octaves of noise, each half as large and half as strong as the one before, the first of size 1: within -1 and 1,
 * near 0 on average, twice continuously differentiable. */
double nb_eddies(uint64_t seed, const double place[3]);

#endif
