/* Noise that clouds are made of: see docs/clouds.md. */
#ifndef NB_CLOUDS_CLOUD_NOISE_H
#define NB_CLOUDS_CLOUD_NOISE_H

#include "base/base.h"

#include <string.h>

enum {
    NB_CLOUD_LATTICE = 64, /* points of gradient noise before it repeats, on each axis */
    NB_CLOUD_DIRECTIONS = 256,
    NB_WORLEY_SIZE = 64,  /* numbers of Worley noise before it repeats */
    NB_WORLEY_LEVELS = 6, /* each half the one before */
    NB_WORLEY_CELLS = 4,  /* of the largest scale, before it repeats */
    NB_MAX_WORLEY = 65535,
};

/* Of numbers; fminf and fmaxf are calls. */
static inline float nb_smaller(float a, float b)
{
    return a < b ? a : b;
}

static inline float nb_larger(float a, float b)
{
    return a > b ? a : b;
}

/* About how often `times` can be halved until it is 1: 0 below 1, the logarithm at powers of two, linear between. */
static inline float nb_level_of(float times)
{
    int32_t bits; /* exponent and mantissa as one number */
    memcpy(&bits, &times, sizeof bits);
    return times > 1 ? (float)(bits - 0x3f800000) * 0x1p-23f : 0;
}

typedef struct nb_cloud_noise {
    uint8_t *turns; /* [z][y][x]: which direction */
    float (*directions)[4];
    uint16_t
        *worley; /* tables: NB_MAX_WORLEY in the middle of one; a number more on each side, as if it went on there */
    float worley_starts[NB_WORLEY_LEVELS];   /* of each level, whole numbers */
    float worley_mean;                       /* where they are halved more often */
    float worley_variance[NB_WORLEY_LEVELS]; /* what a level has lost of the first one's */
} nb_cloud_noise;

/* Errors: MEMORY. */
nebel_result nb_cloud_noise_make(const nebel_allocator *allocator, nb_cloud_noise *noise);
void nb_cloud_noise_free(const nebel_allocator *allocator, nb_cloud_noise *noise);

/* Perlin's gradient noise at a place in units of its lattice; the mean is 0, the variance NB_GRADIENT_VARIANCE. */
float nb_gradient_noise(const nb_cloud_noise *noise, const double place[3]);

/* Asserted by test_clouds: variance, and the largest slope per length of the lattice. */
#define NB_GRADIENT_VARIANCE 0.0364f
#define NB_GRADIENT_SLOPE 2.3f
#define NB_WORLEY_SLOPE 7.f /* of Worley noise, per period: each octave's is that of a distance */

#endif
