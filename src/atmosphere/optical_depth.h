/* The air along a ray, as far as it does not depend on the sun. */
#ifndef NB_ATMOSPHERE_OPTICAL_DEPTH_H
#define NB_ATMOSPHERE_OPTICAL_DEPTH_H

#include "base/base.h"
#include "medium/phase.h"

#include <nebel/planet.h>

/* Orders of phase functions that light scattered often is kept by: NB_MOMENTS, or so few. */
enum { NB_MOMENTS = 5, NB_FEW_MOMENTS = 3 };

/* One kind of air, ready for evaluation. */
typedef struct nb_air_component {
    double scattering[3], extinction[3]; /* 1/m where the density is 1 */
    double scale;                        /* m; 0: a layer */
    double center, width;                /* of a layer */
    nb_phase phase;
    double moments[NB_MOMENTS + 1]; /* of the phase function: the means of Legendre's polynomials */
    double peak; /* by nb_air_components_smooth: the part of scattered light that goes nearly straight ahead */
} nb_air_component;

enum { NB_MAX_SHELLS = 3 + 3 * NEBEL_MAX_COMPONENTS };

/* Air around a ball. */
typedef struct nb_air_components {
    double radius, top;           /* m from the centre */
    double shells[NB_MAX_SHELLS]; /* m from the centre: where rays are cut, since the air is another above */
    int shell_count;
    nb_air_component airs[NEBEL_MAX_COMPONENTS];
    int count;
    int is_smooth; /* of nb_air_components_smooth: nothing had to be changed */
} nb_air_components;

/* A ray through air: `radius` m from the centre at its start, and how far that is behind the place where the ray is
 * lowest, which may lie ahead (below 0). */
typedef struct nb_atmosphere_ray {
    double radius, rise;
} nb_atmosphere_ray;

double nb_air_density(const nb_air_component *air, double height);

/* Whether there is no air at all. */
int nb_air_components_are_empty(const nb_air_components *airs);

/* Whether peaks turn so much light that it matters where it comes from (nb_stray). */
int nb_airs_are_hazy(const nb_air_components *airs);

/* Sets the peaks of airs, and `smooth` to air whose phase functions have no more than `orders` moments. It scatters light that comes from
 * all sides as the other does: the part that goes nearly straight ahead counts as not scattered at all (delta-M: Wiscombe, Journal of the
 * Atmospheric Sciences 34, 1977). is_smooth says that both are the same. */
void nb_air_components_smooth(nb_air_components *airs, int orders, nb_air_components *smooth);

/* Sets the shells of airs that have everything else. */
void nb_air_components_cut(nb_air_components *airs);

/* The same ray further on. */
nb_atmosphere_ray nb_atmosphere_ray_ahead(nb_atmosphere_ray track, double length);

/* How far a ray that starts within a sphere around the planet's centre, or on it, goes until it leaves it. */
double nb_atmosphere_ray_leave(nb_atmosphere_ray track, double sphere);

/* How far a ray from outside goes until it enters the sphere; HUGE_VAL where it never does. */
double nb_atmosphere_ray_enter(nb_atmosphere_ray track, double sphere);

/* Optical depth of `length` m of a ray that stays within the air. */
void nb_atmosphere_ray_depth(const nb_air_components *airs, nb_atmosphere_ray track, double length, double depth[3]);

/* What air leaves of the light of a sun in a direction: 0 in the shadow of the planet. */
void nb_atmosphere_ray_sunlight(const nb_air_components *airs, nb_atmosphere_ray track, double light[3]);

#endif
