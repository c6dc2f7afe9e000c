/* Clouds in the shadow of other planets. */
#ifndef NB_AERIAL_CLOUD_ECLIPSE_H
#define NB_AERIAL_CLOUD_ECLIPSE_H

#include "planets.h"

#include <nebel/planet.h>

/* What other planets leave of the light of clouds at a place: of the sun's part, which is as large as in what falls on level ground
 * and from all sides there. */
static inline void nb_cloud_uneclipsed(const nb_planet *worlds, int count, int cloudy, const double place[3],
                                       const double to_sun[3], double disc, double part[3])
{
    const double left = nb_planets_uneclipsed(worlds, count, cloudy, place, to_sun, disc);
    const nebel_sun sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
    nebel_irradiance light;
    for (int c = 0; c < 3; c++) part[c] = 1;
    if (left == 1) return;
    if (nebel_compute_atmosphere_irradiance(worlds[cloudy].planet->atmosphere, &sun, 1, (const double(*)[3])place, 0,
                                            &light, 0) != NEBEL_OK)
        return; /* places and suns are in order, so that it cannot fail */
    for (int c = 0; c < 3; c++) {
        const double all = light.sun[c] + light.sky[c];
        if (all > 0) part[c] = (light.sky[c] + left * light.sun[c]) / all;
    }
}

/* Dims what clouds send from between two places of a ray by what is left in the middle. `to_sun` and `disc` as of
 * nb_planets_light. */
static inline void nb_cloud_eclipse(const nb_planet *worlds, int count, const nebel_ray *ray, const double to_sun[3],
                                    double disc, nebel_cloud_transfer *nodes)
{
    const nb_planet *const cloudy = nb_planets_cloudy(worlds, count);
    const double length = nb_vector_length(ray->direction);
    float before[3] = {0, 0, 0}, light[3] = {0, 0, 0};
    if (cloudy == NULL || count < 2) return;
    for (uint32_t k = 0; k < nodes->count; k++) {
        const double t = 0.5 * ((double)nodes->t[k > 0 ? k - 1 : 0] + (double)nodes->t[k]) / length;
        double place[3], part[3];
        for (int c = 0; c < 3; c++) place[c] = ray->origin[c] + t * ray->direction[c];
        nb_cloud_uneclipsed(worlds, count, (int)(cloudy - worlds), place, to_sun, disc, part);
        for (int c = 0; c < 3; c++) {
            light[c] += (float)part[c] * (nodes->in_scattering[k][c] - before[c]);
            before[c] = nodes->in_scattering[k][c];
            nodes->in_scattering[k][c] = light[c];
        }
    }
}

#endif
