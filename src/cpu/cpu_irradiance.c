#include "cpu_irradiance.h"

#include <math.h>
#include <string.h>

static double fraction_of(double place, int count, int *first)
{
    *first = place < count - 2 ? (int)place : count - 2;
    return place - *first;
}

/* Light that falls by powers of ten is interpolated by its logarithm. */
static void find_sun(const nb_irradiance_table *daylight, double height, double cosine, double light[3])
{
    int h, s;
    const double v =
        fraction_of(sqrt(height / daylight->thickness) * (NB_IRRADIANCE_HEIGHTS - 1), NB_IRRADIANCE_HEIGHTS, &h);
    const double u = fraction_of(sqrt(cosine) * (NB_IRRADIANCE_SUNS - 1), NB_IRRADIANCE_SUNS, &s);
    for (int c = 0; c < 3; c++) {
        const double low = (1 - u) * (double)daylight->depth[h][s][c] + u * (double)daylight->depth[h][s + 1][c];
        const double high =
            (1 - u) * (double)daylight->depth[h + 1][s][c] + u * (double)daylight->depth[h + 1][s + 1][c];
        light[c] = exp(-((1 - v) * low + v * high));
    }
}

void nb_irradiance_at(const nb_irradiance_table *daylight, nb_irradiance_receiver of, const double place[3],
                      double sun[3], double sky[3])
{
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = place[c] - daylight->center[c];
    const double radius = nb_vector_length(from);
    const double cosine = radius > 0 ? fmax(-1, fmin(1, nb_vector_dot(from, daylight->sun.direction) / radius)) : 1;
    const double height = fmax(0, radius - daylight->radius);
    int s;
    const double part =
        fraction_of(0.5 * (nb_irradiance_spread(cosine) / nb_irradiance_spread(1) + 1) * (NB_IRRADIANCE_SKIES - 1),
                    NB_IRRADIANCE_SKIES, &s);
    for (int c = 0; c < 3; c++)
        sky[c] = exp((1 - part) * (double)daylight->sky[of][s][c] + part * (double)daylight->sky[of][s + 1][c]);
    if (height <= daylight->thickness && cosine >= 0) {
        find_sun(daylight, height, cosine, sun);
    } else {
        const nebel_irradiance light = nb_irradiance_ask(&daylight->sun, daylight->atmosphere, place);
        memcpy(sun, light.sun, sizeof light.sun);
    }
}
