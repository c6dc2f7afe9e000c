#include "turbulence.h"

#include <nebel/nebel.h>

#include <math.h>

static uint64_t mix(uint64_t z)
{
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

double nb_chance(uint64_t seed, uint64_t i)
{
    return (double)(mix(mix(seed) + (i + 1) * UINT64_C(0x9e3779b97f4a7c15)) >> 11) * 0x1p-53;
}

/* Within -1 and 1, one for each corner of the lattice. */
static double corner(uint64_t seed, const int64_t at[3])
{
    const uint64_t row = mix((uint64_t)at[0] + mix((uint64_t)at[1] + mix((uint64_t)at[2] + mix(seed))));
    return (double)(row >> 11) * 0x1p-52 - 1;
}

/* 0 to 1 with no slope and no curvature at either end. */
static double fade(double x)
{
    return x * x * x * (x * (x * 6 - 15) + 10);
}

static double octave(uint64_t seed, const double place[3])
{
    int64_t low[3];
    double weight[3];
    for (int i = 0; i < 3; i++) {
        const double whole = floor(place[i]);
        low[i] = (int64_t)whole;
        weight[i] = fade(place[i] - whole);
    }
    double sum = 0;
    for (int k = 0; k < 8; k++) {
        const int64_t at[3] = {low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)};
        double share = 1;
        for (int i = 0; i < 3; i++) share *= k >> i & 1 ? weight[i] : 1 - weight[i];
        sum += share * corner(seed, at);
    }
    return sum;
}

/* Places farther than any of the core are not told apart; corners of the lattice must fit their integers. */
static double within_reach(double x)
{
    return fmin(fmax(x, -NEBEL_MAX_LENGTH), NEBEL_MAX_LENGTH);
}

double nb_eddies(uint64_t seed, const double place[3])
{
    enum { OCTAVES = 5 };
    double p[3], sum = 0, strength = 16.0 / 31; /* of 1 + 1/2 + ... + 1/16 */
    for (int i = 0; i < 3; i++) p[i] = within_reach(place[i]);
    for (uint64_t k = 0; k < OCTAVES; k++) {
        sum += strength * octave(seed + k, p);
        strength /= 2;
        for (int i = 0; i < 3; i++) p[i] *= 2;
    }
    return sum;
}
