/* Random numbers, the same for the same seed everywhere: splitmix64. */
#ifndef DICE_H
#define DICE_H

#include <stdint.h>

static inline uint64_t dice_next(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline double dice(uint64_t *state, double from, double to)
{
    return from + (to - from) * (double)(dice_next(state) >> 11) * 0x1p-53;
}

static inline int dice_below(uint64_t *state, int n)
{
    return (int)(dice_next(state) % (uint64_t)n);
}

#endif
