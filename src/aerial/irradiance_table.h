/* What the air of a planet leaves of the sun, and the light of its sky, by place: tables that renderers ask. */
#ifndef NB_AERIAL_IRRADIANCE_TABLE_H
#define NB_AERIAL_IRRADIANCE_TABLE_H

#include "math/vector.h"

#include <nebel/scene.h>

#include <string.h>

enum { NB_IRRADIANCE_HEIGHTS = 65, NB_IRRADIANCE_SUNS = 65, NB_IRRADIANCE_SKIES = 129 };

/* Whose light of the sky: level surfaces have what falls on them, fog what comes from all sides, the ground below included. Under a
 * sun in the zenith that is 18 times as much, by night 3 times. */
typedef enum nb_irradiance_receiver {
    NB_IRRADIANCE_OF_SURFACES,
    NB_IRRADIANCE_OF_FOG,
    NB_IRRADIANCE_OF_COUNT
} nb_irradiance_receiver;

typedef struct nb_irradiance_table {
    const nebel_atmosphere *atmosphere;
    nebel_sun sun; /* of irradiance 1 */
    double center[3], radius, thickness;
    /* Optical depth of the way to a sun that is not below the level: denser near the ground, and where the sun is low. Where
     * it is lower the air is asked itself: the edge of the planet's shadow bears no interpolation. */
    float depth[NB_IRRADIANCE_HEIGHTS][NB_IRRADIANCE_SUNS][3];
    float sky[NB_IRRADIANCE_OF_COUNT][NB_IRRADIANCE_SKIES][3]; /* logarithms of parts of that at the scene's origin */
} nb_irradiance_table;

/* Deeper than this counts as night. */
#define NB_MAX_IRRADIANCE_DEPTH 80.

/* Of a sun of irradiance 1: less counts as none. */
#define NB_MIN_IRRADIANCE_SKY 2e-30

/* Skies lie evenly over this function of the cosine of the sun's angle to the zenith. */
#define NB_IRRADIANCE_TWILIGHT 0.05

static inline double nb_irradiance_spread(double sun)
{
    return copysign(log(1 + fabs(sun) / NB_IRRADIANCE_TWILIGHT), sun);
}

static inline nebel_irradiance nb_irradiance_ask(const nebel_sun *sun, const nebel_atmosphere *atmosphere,
                                                 const double place[3])
{
    nebel_irradiance light;
    /* Places and suns are in order, so that it cannot fail. */
    memset(&light, 0, sizeof light);
    (void)nebel_compute_atmosphere_irradiance(atmosphere, sun, 1, (const double(*)[3])place, 0, &light, 0);
    return light;
}

/* Fog that is all so near the origin along each axis, m and parts of the planet's radius, takes the origin's light, */
#define NB_IRRADIANCE_NEAR 1e4
#define NB_IRRADIANCE_NEAR_PART (1 / 600.)

/* unless the sun is so much brighter somewhere about it, or dimmer, as a part of the brighter one. */
#define NB_IRRADIANCE_OTHER (1 / 16.)

static inline int nb_irradiance_is_other(const nebel_irradiance *a, const nebel_irradiance *b)
{
    double brightest = 0, change = 0;
    for (int c = 0; c < 3; c++) {
        brightest = fmax(brightest, fmax(a->sun[c], b->sun[c]));
        change = fmax(change, fabs(a->sun[c] - b->sun[c]));
    }
    return change > NB_IRRADIANCE_OTHER * brightest;
}

/* The box is that of all fog. What of it is below the ground has light of the ground. */
static inline int nb_irradiance_is_near(const nebel_planet *home, const double to_sun[3], const double min[3],
                                        const double max[3])
{
    static const double origin[3] = {0, 0, 0};
    const double most = fmin(NB_IRRADIANCE_NEAR, NB_IRRADIANCE_NEAR_PART * home->atmosphere_desc.radius);
    for (int c = 0; c < 3; c++)
        if (min[c] < -most || max[c] > most) return 0;
    const nebel_sun sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
    const nebel_irradiance here = nb_irradiance_ask(&sun, home->atmosphere, origin);
    for (int corner = 0; corner < 8; corner++) {
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = (corner >> c & 1) != 0 ? max[c] : min[c];
        place[1] = fmax(0, place[1]);
        const nebel_irradiance there = nb_irradiance_ask(&sun, home->atmosphere, place);
        if (nb_irradiance_is_other(&here, &there)) return 0;
    }
    return 1;
}

/* At a height, with the sun so high. `across` is at right angles to the way to it. */
static inline void nb_irradiance_place(const nb_irradiance_table *daylight, const double across[3], double height,
                                       double sun, double place[3])
{
    const double radius = daylight->radius + height, side = sqrt(fmax(0, 1 - sun * sun));
    for (int c = 0; c < 3; c++)
        place[c] = daylight->center[c] + radius * (sun * daylight->sun.direction[c] + side * across[c]);
}

static inline void nb_irradiance_set_depths(nb_irradiance_table *daylight, const double across[3])
{
    for (int h = 0; h < NB_IRRADIANCE_HEIGHTS; h++) {
        const double part = h / (NB_IRRADIANCE_HEIGHTS - 1.), height = daylight->thickness * part * part;
        for (int s = 0; s < NB_IRRADIANCE_SUNS; s++) {
            const double root = s / (NB_IRRADIANCE_SUNS - 1.);
            double place[3];
            nb_irradiance_place(daylight, across, height, root * root, place);
            const nebel_irradiance light = nb_irradiance_ask(&daylight->sun, daylight->atmosphere, place);
            for (int c = 0; c < 3; c++)
                daylight->depth[h][s][c] = (float)(light.sun[c] > 0 ? fmin(NB_MAX_IRRADIANCE_DEPTH, -log(light.sun[c]))
                                                                    : NB_MAX_IRRADIANCE_DEPTH);
        }
    }
}

/* Axes at right angles at a place: up, level towards the sun, across. */
static inline void nb_irradiance_turn(const double center[3], const double to_sun[3], const double place[3],
                                      double axes[3][3])
{
    for (int c = 0; c < 3; c++) axes[0][c] = place[c] - center[c];
    if (!nb_vector_make_unit(axes[0])) axes[0][1] = 1;
    const double rise = nb_vector_dot(axes[0], to_sun);
    for (int c = 0; c < 3; c++) axes[1][c] = to_sun[c] - rise * axes[0][c];
    if (!(fabs(rise) < 1 - 1e-12) || !nb_vector_make_unit(axes[1])) {
        const double other[3] = {fabs(axes[0][0]) < 0.5, 0, !(fabs(axes[0][0]) < 0.5)};
        nb_vector_cross(axes[0], other, axes[1]);
        (void)nb_vector_make_unit(axes[1]);
    }
    nb_vector_cross(axes[0], axes[1], axes[2]);
}

/* The light from all sides at the ground below a place: of the sky, by Gauss's rule over slopes, the same on both sides of the
 * sun, and of the ground. */
static inline void nb_irradiance_around(const nebel_planet *planet, const nebel_sun *sun, const double place[3],
                                        double light[3])
{
    enum { SLOPES = 5, TURNS = 6 };
    static const double pi = 3.14159265358979323846;
    static const double slopes[SLOPES] = {0.04691007703066802, 0.23076534494715845, 0.5, 0.76923465505284155,
                                          0.95308992296933198};
    static const double weights[SLOPES] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                           0.23931433524968324, 0.11846344252809454};
    const nebel_atmosphere_desc *const air = &planet->atmosphere_desc;
    double center[3], axes[3][3], ground[3];
    nebel_ray rays[SLOPES * TURNS];
    nebel_transfer found[SLOPES * TURNS];
    nb_sphere_center_below(air->ground_point, air->radius, center);
    nb_irradiance_turn(center, sun->direction, place, axes);
    for (int c = 0; c < 3; c++) ground[c] = center[c] + air->radius * axes[0][c];
    for (int i = 0; i < SLOPES * TURNS; i++) {
        const double slope = slopes[i / TURNS], level = sqrt(1 - slope * slope), turn = pi * (i % TURNS + 0.5) / TURNS;
        rays[i].t_max = HUGE_VAL;
        for (int c = 0; c < 3; c++) {
            rays[i].origin[c] = ground[c];
            rays[i].direction[c] = slope * axes[0][c] + level * (cos(turn) * axes[1][c] + sin(turn) * axes[2][c]);
        }
    }
    memset(found, 0, sizeof found);
    (void)nebel_trace_atmosphere(planet->atmosphere, sun, SLOPES * TURNS, rays, sizeof *rays, found, sizeof *found);
    const nebel_irradiance on_ground = nb_irradiance_ask(sun, planet->atmosphere, ground);
    const double rise = fmax(0, nb_vector_dot(axes[0], sun->direction));
    for (int c = 0; c < 3; c++) {
        light[c] = 2 * air->ground_albedo[c] * (on_ground.sky[c] + rise * on_ground.sun[c]);
        for (int i = 0; i < SLOPES * TURNS; i++)
            light[c] += 2 * pi / TURNS * weights[i / TURNS] * (double)found[i].in_scattering[c];
    }
}

static inline float nb_irradiance_part(double light, double there)
{
    return (float)(there > NB_MIN_IRRADIANCE_SKY ? log(fmax(light, NB_MIN_IRRADIANCE_SKY) / there) : 0);
}

/* The place on the ground that a row of skies is of. */
static inline void nb_irradiance_place_of(const nb_irradiance_table *daylight, const double across[3], int row,
                                          double place[3])
{
    const double part = (2. * row / (NB_IRRADIANCE_SKIES - 1) - 1) * nb_irradiance_spread(1);
    const double sun = copysign(NB_IRRADIANCE_TWILIGHT * expm1(fabs(part)), part);
    nb_irradiance_place(daylight, across, 0, fmax(-1, fmin(1, sun)), place);
}

static inline void nb_irradiance_set_level_skies(nb_irradiance_table *daylight, const nebel_planet *home,
                                                 const double across[3])
{
    static const double origin[3] = {0, 0, 0};
    const nebel_irradiance there = nb_irradiance_ask(&daylight->sun, home->atmosphere, origin);
    for (int row = 0; row < NB_IRRADIANCE_SKIES; row++) {
        double place[3];
        nb_irradiance_place_of(daylight, across, row, place);
        const nebel_irradiance light = nb_irradiance_ask(&daylight->sun, daylight->atmosphere, place);
        for (int c = 0; c < 3; c++)
            daylight->sky[NB_IRRADIANCE_OF_SURFACES][row][c] = nb_irradiance_part(light.sky[c], there.sky[c]);
    }
}

/* Every second row is asked for, which takes thirty rays each. */
static inline void nb_irradiance_set_round_skies(nb_irradiance_table *daylight, const nebel_planet *planet,
                                                 const nebel_planet *home, const double across[3])
{
    static const double origin[3] = {0, 0, 0};
    float(*const skies)[3] = daylight->sky[NB_IRRADIANCE_OF_FOG];
    double there[3];
    nb_irradiance_around(home, &daylight->sun, origin, there);
    for (int row = 0; row < NB_IRRADIANCE_SKIES; row += 2) {
        double place[3], light[3];
        nb_irradiance_place_of(daylight, across, row, place);
        nb_irradiance_around(planet, &daylight->sun, place, light);
        for (int c = 0; c < 3; c++) skies[row][c] = nb_irradiance_part(light[c], there[c]);
    }
    for (int row = 1; row < NB_IRRADIANCE_SKIES; row += 2)
        for (int c = 0; c < 3; c++) skies[row][c] = 0.5f * (skies[row - 1][c] + skies[row + 1][c]);
}

/* Tables for a sun in a direction of length 1. `home` is the planet whose sky is that of the scene's origin. Both have
 * their atmosphere. */
static inline void nb_irradiance_set(nb_irradiance_table *daylight, const nebel_planet *planet,
                                     const nebel_planet *home, const double to_sun[3])
{
    daylight->atmosphere = planet->atmosphere;
    daylight->radius = planet->atmosphere_desc.radius;
    daylight->thickness = planet->atmosphere_desc.thickness;
    daylight->sun = (nebel_sun){.irradiance = {1, 1, 1}};
    memcpy(daylight->sun.direction, to_sun, sizeof daylight->sun.direction);
    nb_sphere_center_below(planet->atmosphere_desc.ground_point, planet->atmosphere_desc.radius, daylight->center);
    const double axis[3] = {fabs(to_sun[0]) < 0.5, 0, !(fabs(to_sun[0]) < 0.5)};
    double across[3];
    nb_vector_cross(to_sun, axis, across);
    nb_vector_make_unit(across);
    nb_irradiance_set_depths(daylight, across);
    nb_irradiance_set_level_skies(daylight, home, across);
    nb_irradiance_set_round_skies(daylight, planet, home, across);
}

#endif
