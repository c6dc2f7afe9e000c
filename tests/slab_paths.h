/* Paths of light through plane-parallel slabs of drops that absorb nothing. */
#ifndef SLAB_PATHS_H
#define SLAB_PATHS_H

#include "clouds/cloud_phase.h"

#include "dice.h"

#include <math.h>

static inline double slab_phase(const nb_cloud_phase *phase, double cosine)
{
    float values[4];
    nb_cloud_phase_at(phase, cosine, values);
    return (double)values[1];
}

/* Cosines below which green light is scattered with the probability of their number by their count. */
enum { SLAB_PARTS = 4096 };

static inline void slab_invert(const nb_cloud_phase *phase, double cosines[SLAB_PARTS + 1])
{
    enum { ANGLES = 100000 };
    double sum = 0, whole = 0;
    int next = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < ANGLES; i++) {
            /* Finer ahead, where the peak is. */
            const double part = 1 - (i + .5) / ANGLES, angle = 3.14159265358979323846 * part * part * part;
            const double light = slab_phase(phase, cos(angle)) * sin(angle) * 3 * part * part;
            if (pass == 0) whole += light;
            if (pass == 1)
                for (sum += light; next <= SLAB_PARTS && sum >= whole * next / SLAB_PARTS; next++)
                    cosines[next] = cos(angle);
        }
    while (next <= SLAB_PARTS) cosines[next++] = 1;
}

/* Sunlight at a cosine into a slab: returns the depth at which it leaves, below 0 or beyond the slab's, and its cosine to straight down
 * there. */
static inline double slab_path(double depth, double cosine, const double turns[SLAB_PARTS + 1], uint64_t *numbers,
                               double *out)
{
    double z = 0, mu = cosine;
    for (;;) {
        z -= mu * log(dice(numbers, 1e-12, 1));
        if (!(z >= 0 && z <= depth)) break;
        const double place = dice(numbers, 0, SLAB_PARTS);
        const int low = (int)place;
        const double turn = turns[low] + (place - low) * (turns[low + 1] - turns[low]);
        const double sine = sqrt(fmax(0, 1 - turn * turn));
        mu = turn * mu + sine * sqrt(fmax(0, 1 - mu * mu)) * cos(dice(numbers, 0, 2 * 3.14159265358979323846));
    }
    *out = mu;
    return z;
}

#endif
