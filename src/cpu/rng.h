/* Random numbers of the reference renderer: a stream for each sample of each pixel, whoever computes it. */
#ifndef NB_CPU_RNG_H
#define NB_CPU_RNG_H

#include <stdint.h>

typedef struct nb_rng {
    uint64_t state;
} nb_rng;

/* Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014: splitmix64. */
static inline uint64_t nb_rng_bits(nb_rng *chance)
{
    uint64_t z = chance->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

/* 0 <= x < 1, a multiple of 2^-53. */
static inline double nb_rng_next(nb_rng *chance)
{
    return (double)(nb_rng_bits(chance) >> 11) * 0x1p-53;
}

/* The stream of four numbers: they are stirred in one after the other. */
static inline nb_rng nb_rng_of(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    nb_rng chance = {(uint64_t)a << 32 | b};
    chance.state = nb_rng_bits(&chance) ^ ((uint64_t)c << 32 | d);
    chance.state = nb_rng_bits(&chance);
    return chance;
}

#endif
