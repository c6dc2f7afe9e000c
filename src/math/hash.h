/* Whole numbers to whole numbers, for noise. */
#ifndef NB_MATH_HASH_H
#define NB_MATH_HASH_H

#include <stdint.h>

/* All bits of the result hang on all bits of x. Source: Wellons, Prospecting for Hash Functions, 2018. */
static inline uint32_t nb_mix_bits(uint32_t x)
{
    x = (x ^ x >> 16) * UINT32_C(0x7feb352d);
    x = (x ^ x >> 15) * UINT32_C(0x846ca68b);
    return x ^ x >> 16;
}

#endif
