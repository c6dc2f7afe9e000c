/* What the air of a planet leaves of the sun, and the light of its sky, by place. */
#ifndef NB_CPU_DAYLIGHT_H
#define NB_CPU_DAYLIGHT_H

#include <nebel/scene.h>

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

/* Tables for a sun in a direction of length 1. `home` is the planet whose sky is that of the scene's origin. Both have
 * their atmosphere. */
void nb_daylight_set(nb_daylight *daylight, const nebel_planet *planet, const nebel_planet *home,
                     const double to_sun[3]);

/* What is left of the sun, 0 in the planet's shadow, and how much brighter the sky is than at the scene's origin. */
void nb_daylight_at(const nb_daylight *daylight, const double place[3], double sun[3], double sky[3]);

#endif
