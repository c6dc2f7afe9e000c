#include "sampling.h"

/* The bits of i mirrored: the van der Corput sequence in base 2. */
static uint32_t mirror(uint32_t i)
{
    uint32_t digits = 0;
    for (int bit = 0; bit < 32; bit++) digits |= (i >> bit & 1) << (31 - bit);
    return digits;
}

/* The second dimension of the Sobol sequence: column k of its matrix is row k of Pascal's triangle modulo 2. */
static uint32_t sobol(uint32_t i)
{
    uint32_t digits = 0;
    for (uint32_t column = 1u << 31; i != 0; i >>= 1, column ^= column >> 1) {
        if (i & 1) digits ^= column;
    }
    return digits;
}

/* A mixing function of two multiplications, found by search for small bias (C. Wellons, "Prospecting for hash
 * functions"). */
static inline uint32_t mix(uint32_t h)
{
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
}

/* As many digits as a float has beside those of a column of a region, so that no point is rounded, and none into the
 * next pixel. */
static inline float fraction(uint32_t digits)
{
    return (float)(digits >> 14) * 0x1p-18f;
}

/* Digits of the sample before the shift. */
NB_CLONES static void shift_points(uint32_t digits_x, uint32_t digits_y, uint32_t left, uint32_t top, float *restrict x,
                                   float *restrict y)
{
    NB_SIMD
    for (uint32_t i = 0; i < NB_PIXELS; i++) {
        const uint32_t column = nb_lane_x(i), row = nb_lane_y(i);
        const uint32_t pixel = (left + column) | (top + row) << 16;
        const uint32_t seed = mix(pixel ^ 0x85ebca6bu); /* mix(0) is 0: no shift at all */
        x[i] = (float)column + fraction(digits_x ^ seed);
        y[i] = (float)row + fraction(digits_y ^ mix(seed + 0x9e3779b9u));
    }
}

NB_CLONES static void center_points(float *restrict x, float *restrict y)
{
    NB_SIMD
    for (uint32_t i = 0; i < NB_PIXELS; i++) {
        x[i] = (float)nb_lane_x(i) + .5f;
        y[i] = (float)nb_lane_y(i) + .5f;
    }
}

void nb_sample_region(uint32_t index, uint32_t count, uint32_t left, uint32_t top, nb_region_points *points)
{
    if (count == 1) {
        center_points(points->x, points->y);
    } else {
        shift_points(mirror(index), sobol(index), left, top, points->x, points->y);
    }
}
