#include "daylight.h"

#include "base/vector.h"

#include <math.h>
#include <string.h>

/* Deeper than this counts as night. */
#define MOST_DEPTH 80.

/* Of a sun of irradiance 1: less counts as none. */
#define LEAST_SKY 2e-30

/* Skies lie evenly over this function of the cosine of the sun's angle to the zenith. */
#define TWILIGHT 0.05

static double spread(double sun)
{
    return copysign(log(1 + fabs(sun) / TWILIGHT), sun);
}

static nebel_air_light light_at(const nb_daylight *daylight, const nebel_atmosphere *atmosphere, const double place[3])
{
    nebel_air_light light;
    /* Places and suns are in order, so that it cannot fail. */
    memset(&light, 0, sizeof light);
    (void)nebel_light_air(atmosphere, &daylight->sun, 1, (const double(*)[3])place, 0, &light, 0);
    return light;
}

/* At a height, with the sun so high. `across` is at right angles to the way to it. */
static nebel_air_light light_under(const nb_daylight *daylight, const double across[3], double height, double sun)
{
    const double radius = daylight->radius + height, side = sqrt(fmax(0, 1 - sun * sun));
    double place[3];
    for (int c = 0; c < 3; c++)
        place[c] = daylight->center[c] + radius * (sun * daylight->sun.direction[c] + side * across[c]);
    return light_at(daylight, daylight->atmosphere, place);
}

static void set_depths(nb_daylight *daylight, const double across[3])
{
    for (int h = 0; h < NB_DAYLIGHT_HEIGHTS; h++) {
        const double part = h / (NB_DAYLIGHT_HEIGHTS - 1.), height = daylight->thickness * part * part;
        for (int s = 0; s < NB_DAYLIGHT_SUNS; s++) {
            const double root = s / (NB_DAYLIGHT_SUNS - 1.);
            const nebel_air_light light = light_under(daylight, across, height, root * root);
            for (int c = 0; c < 3; c++)
                daylight->depth[h][s][c] =
                    (float)(light.sun[c] > 0 ? fmin(MOST_DEPTH, -log(light.sun[c])) : MOST_DEPTH);
        }
    }
}

static void set_skies(nb_daylight *daylight, const nebel_atmosphere *home, const double across[3])
{
    static const double origin[3] = {0, 0, 0};
    const nebel_air_light there = light_at(daylight, home, origin);
    for (int s = 0; s < NB_DAYLIGHT_SKIES; s++) {
        const double place = (2. * s / (NB_DAYLIGHT_SKIES - 1) - 1) * spread(1);
        const nebel_air_light light =
            light_under(daylight, across, 0, fmax(-1, fmin(1, copysign(TWILIGHT * expm1(fabs(place)), place))));
        for (int c = 0; c < 3; c++)
            daylight->sky[s][c] =
                (float)(there.sky[c] > LEAST_SKY ? log(fmax(light.sky[c], LEAST_SKY) / there.sky[c]) : 0);
    }
}

void nb_daylight_set(nb_daylight *daylight, const nebel_planet *planet, const nebel_planet *home,
                     const double to_sun[3])
{
    daylight->atmosphere = planet->atmosphere;
    daylight->radius = planet->air.radius;
    daylight->thickness = planet->air.thickness;
    daylight->sun = (nebel_sun){.irradiance = {1, 1, 1}};
    memcpy(daylight->sun.direction, to_sun, sizeof daylight->sun.direction);
    for (int c = 0; c < 3; c++) daylight->center[c] = planet->air.ground[c] - (c == 1 ? planet->air.radius : 0);
    const double axis[3] = {fabs(to_sun[0]) < 0.5, 0, !(fabs(to_sun[0]) < 0.5)};
    double across[3];
    nb_vector_cross(to_sun, axis, across);
    nb_vector_make_unit(across);
    set_depths(daylight, across);
    set_skies(daylight, home->atmosphere, across);
}

static double part_of(double place, int count, int *first)
{
    *first = place < count - 2 ? (int)place : count - 2;
    return place - *first;
}

/* Light that falls by powers of ten is interpolated by its logarithm. */
static void find_sun(const nb_daylight *daylight, double height, double cosine, double light[3])
{
    int h, s;
    const double v = part_of(sqrt(height / daylight->thickness) * (NB_DAYLIGHT_HEIGHTS - 1), NB_DAYLIGHT_HEIGHTS, &h);
    const double u = part_of(sqrt(cosine) * (NB_DAYLIGHT_SUNS - 1), NB_DAYLIGHT_SUNS, &s);
    for (int c = 0; c < 3; c++) {
        const double low = (1 - u) * (double)daylight->depth[h][s][c] + u * (double)daylight->depth[h][s + 1][c];
        const double high =
            (1 - u) * (double)daylight->depth[h + 1][s][c] + u * (double)daylight->depth[h + 1][s + 1][c];
        light[c] = exp(-((1 - v) * low + v * high));
    }
}

void nb_daylight_at(const nb_daylight *daylight, const double place[3], double sun[3], double sky[3])
{
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = place[c] - daylight->center[c];
    const double radius = nb_vector_length(from);
    const double cosine = radius > 0 ? fmax(-1, fmin(1, nb_vector_dot(from, daylight->sun.direction) / radius)) : 1;
    const double height = fmax(0, radius - daylight->radius);
    int s;
    const double part =
        part_of(0.5 * (spread(cosine) / spread(1) + 1) * (NB_DAYLIGHT_SKIES - 1), NB_DAYLIGHT_SKIES, &s);
    for (int c = 0; c < 3; c++)
        sky[c] = exp((1 - part) * (double)daylight->sky[s][c] + part * (double)daylight->sky[s + 1][c]);
    if (height <= daylight->thickness && cosine >= 0) {
        find_sun(daylight, height, cosine, sun);
    } else {
        const nebel_air_light light = light_at(daylight, daylight->atmosphere, place);
        memcpy(sun, light.sun, sizeof light.sun);
    }
}
