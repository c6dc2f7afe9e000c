/* What the air of a planet leaves of the sun, and the light of its sky, by place: tables that renderers ask. */
#ifndef NB_DAYLIGHT_H
#define NB_DAYLIGHT_H

#include "vector.h"

#include <nebel/scene.h>

#include <string.h>

enum { NB_DAYLIGHT_HEIGHTS = 65, NB_DAYLIGHT_SUNS = 65, NB_DAYLIGHT_SKIES = 129 };

typedef struct nb_daylight {
    const nebel_atmosphere *atmosphere;
    nebel_sun sun; /* of irradiance 1 */
    double center[3], radius, thickness;
    /* Optical depth of the way to a sun that is not below the level: denser near the ground, and where the sun is low. Where
     * it is lower the air is asked itself: the edge of the planet's shadow bears no interpolation. */
    float depth[NB_DAYLIGHT_HEIGHTS][NB_DAYLIGHT_SUNS][3];
    float sky[NB_DAYLIGHT_SKIES][3]; /* logarithm of the sky's irradiance, as parts of that at the scene's origin */
} nb_daylight;

/* Deeper than this counts as night. */
#define NB_DAYLIGHT_MOST_DEPTH 80.

/* Of a sun of irradiance 1: less counts as none. */
#define NB_DAYLIGHT_LEAST_SKY 2e-30

/* Skies lie evenly over this function of the cosine of the sun's angle to the zenith. */
#define NB_DAYLIGHT_TWILIGHT 0.05

static inline double nb_daylight_spread(double sun)
{
    return copysign(log(1 + fabs(sun) / NB_DAYLIGHT_TWILIGHT), sun);
}

static inline nebel_air_light nb_daylight_ask(const nebel_sun *sun, const nebel_atmosphere *atmosphere,
                                              const double place[3])
{
    nebel_air_light light;
    /* Places and suns are in order, so that it cannot fail. */
    memset(&light, 0, sizeof light);
    (void)nebel_light_air(atmosphere, sun, 1, (const double(*)[3])place, 0, &light, 0);
    return light;
}

/* Fog that is all so near the origin along each axis, m and parts of the planet's radius, takes the origin's light, */
#define NB_DAYLIGHT_NEAR 1e4
#define NB_DAYLIGHT_NEAR_PART (1 / 600.)

/* unless the sun is so much brighter somewhere about it, or dimmer, as a part of the brighter one. */
#define NB_DAYLIGHT_OTHER (1 / 16.)

static inline int nb_daylight_is_other(const nebel_air_light *a, const nebel_air_light *b)
{
    double brightest = 0, change = 0;
    for (int c = 0; c < 3; c++) {
        brightest = fmax(brightest, fmax(a->sun[c], b->sun[c]));
        change = fmax(change, fabs(a->sun[c] - b->sun[c]));
    }
    return change > NB_DAYLIGHT_OTHER * brightest;
}

/* The box is that of all fog. What of it is below the ground has light of the ground. */
static inline int nb_daylight_is_near(const nebel_planet *home, const double to_sun[3], const double min[3],
                                      const double max[3])
{
    static const double origin[3] = {0, 0, 0};
    const double most = fmin(NB_DAYLIGHT_NEAR, NB_DAYLIGHT_NEAR_PART * home->air.radius);
    for (int c = 0; c < 3; c++)
        if (min[c] < -most || max[c] > most) return 0;
    const nebel_sun sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
    const nebel_air_light here = nb_daylight_ask(&sun, home->atmosphere, origin);
    for (int corner = 0; corner < 8; corner++) {
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = (corner >> c & 1) != 0 ? max[c] : min[c];
        place[1] = fmax(0, place[1]);
        const nebel_air_light there = nb_daylight_ask(&sun, home->atmosphere, place);
        if (nb_daylight_is_other(&here, &there)) return 0;
    }
    return 1;
}

/* At a height, with the sun so high. `across` is at right angles to the way to it. */
static inline nebel_air_light nb_daylight_under(const nb_daylight *daylight, const double across[3], double height,
                                                double sun)
{
    const double radius = daylight->radius + height, side = sqrt(fmax(0, 1 - sun * sun));
    double place[3];
    for (int c = 0; c < 3; c++)
        place[c] = daylight->center[c] + radius * (sun * daylight->sun.direction[c] + side * across[c]);
    return nb_daylight_ask(&daylight->sun, daylight->atmosphere, place);
}

static inline void nb_daylight_set_depths(nb_daylight *daylight, const double across[3])
{
    for (int h = 0; h < NB_DAYLIGHT_HEIGHTS; h++) {
        const double part = h / (NB_DAYLIGHT_HEIGHTS - 1.), height = daylight->thickness * part * part;
        for (int s = 0; s < NB_DAYLIGHT_SUNS; s++) {
            const double root = s / (NB_DAYLIGHT_SUNS - 1.);
            const nebel_air_light light = nb_daylight_under(daylight, across, height, root * root);
            for (int c = 0; c < 3; c++)
                daylight->depth[h][s][c] = (float)(light.sun[c] > 0 ? fmin(NB_DAYLIGHT_MOST_DEPTH, -log(light.sun[c]))
                                                                    : NB_DAYLIGHT_MOST_DEPTH);
        }
    }
}

static inline void nb_daylight_set_skies(nb_daylight *daylight, const nebel_atmosphere *home, const double across[3])
{
    static const double origin[3] = {0, 0, 0};
    const nebel_air_light there = nb_daylight_ask(&daylight->sun, home, origin);
    for (int s = 0; s < NB_DAYLIGHT_SKIES; s++) {
        const double place = (2. * s / (NB_DAYLIGHT_SKIES - 1) - 1) * nb_daylight_spread(1);
        const nebel_air_light light = nb_daylight_under(
            daylight, across, 0, fmax(-1, fmin(1, copysign(NB_DAYLIGHT_TWILIGHT * expm1(fabs(place)), place))));
        for (int c = 0; c < 3; c++)
            daylight->sky[s][c] = (float)(there.sky[c] > NB_DAYLIGHT_LEAST_SKY
                                              ? log(fmax(light.sky[c], NB_DAYLIGHT_LEAST_SKY) / there.sky[c])
                                              : 0);
    }
}

/* Tables for a sun in a direction of length 1. `home` is the planet whose sky is that of the scene's origin. Both have
 * their atmosphere. */
static inline void nb_daylight_set(nb_daylight *daylight, const nebel_planet *planet, const nebel_planet *home,
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
    nb_daylight_set_depths(daylight, across);
    nb_daylight_set_skies(daylight, home->atmosphere, across);
}

#endif
