/* What chance leaves unknown of a picture. */
#ifndef NB_TOOLS_NOISE_ESTIMATE_H
#define NB_TOOLS_NOISE_ESTIMATE_H

#include <stddef.h>
#include <stdint.h>

/* Tells the standard error of a number of a picture, in the quadratic mean, and of the mean of all its `count` numbers,
 * from those of each. */
void nb_spread_report(const float *errors, size_t count, uint32_t samples);

#endif
