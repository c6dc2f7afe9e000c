/* What an atmosphere is made of, for those who ask for its light. */
#ifndef NB_ATMOSPHERE_ATMOSPHERE_H
#define NB_ATMOSPHERE_ATMOSPHERE_H

#include "in_scattering.h"
#include "math/gauss_rule.h"
#include "stray.h"

struct nebel_atmosphere {
    nebel_allocator allocator;
    double center[3];
    nb_air_components airs, smooth; /* smooth: that by which light scattered often is found */
    double ground_albedo[3];
    nb_gauss_rule rule;
    nb_scattering_table scatter;
    nb_stray stray;
    nb_gather_fn *gather;
    double share_off; /* how much of light that was scattered often may be wrong for want of entries and directions */
};

/* NULL where no air has a peak. */
static inline const nb_air_components *nb_atmosphere_smooth(const nebel_atmosphere *atmosphere)
{
    return atmosphere->smooth.is_smooth ? NULL : &atmosphere->smooth;
}

/* In units of what was scattered once: what quadrature along a ray misses. */
#define NB_ONCE_OFF 2e-3

/* Half of the last digit of a transmittance in floats, and what its integral is off. */
#define NB_LIGHT_ROUNDING 4e-8

/* What a ray gathers for a sun of irradiance 1: scattered once, by each kind of air, for phase functions of 1; more
 * often; and about how much of that is missing for want of moments, and in twilight for want of entries. */
typedef struct nb_in_scattered {
    double once[NEBEL_MAX_COMPONENTS][3], often[3], missing[3];
} nb_in_scattered;

/* Where the ray enters and leaves the shadow of the planet, in any order; below 0 where it does not. */
void nb_find_shadow(const nb_air_components *airs, nb_atmosphere_ray track, nb_moment_basis aspect, double cuts[2]);

/* Over the nodes of a path, up to each of `count` ends, ascending; the last one is the path's, where it leaves the air or meets the
 * ground. Returns what is scattered just where the ray begins, per metre. `aspect` is that of the ray's direction there. */
nb_in_scattered nb_gather_path(const nebel_atmosphere *atmosphere, nb_atmosphere_ray track, nb_moment_basis aspect,
                               const nb_ray_nodes *path, int count, const double ends[], nb_in_scattered gathered[]);

/* Along a ray that stays within the air up to the last end, as above; at most NB_PATH_CUTS - 2 of them. */
nb_in_scattered nb_gather(const nebel_atmosphere *atmosphere, const nb_gauss_rule *rule, nb_atmosphere_ray track,
                          nb_moment_basis aspect, int count, const double ends[], nb_in_scattered gathered[]);

/* What was scattered once by phase functions as they are; `sun` is the cosine between ray and sun. */
void nb_gathered_once(const nebel_atmosphere *atmosphere, const nb_in_scattered *gathered, double sun, double once[3]);

/* What of gathered light may be wrong: `once` is that of nb_gathered_once. */
double nb_gathered_off(const nebel_atmosphere *atmosphere, const nb_in_scattered *gathered, const double once[3],
                       int c);

/* The sun as all rays see it, its direction made a unit one; NULL: none. A sun without light may come from nowhere. 0
 * where it is not in order. */
int nb_air_resolve_sun(const nebel_sun *sun, nebel_sun *resolved);
/* What to say where it returns 0. */
extern const char nb_air_sun_fault[];

int nb_air_is_place(const double place[3]);

/* A place of the scene from the planet's centre. */
static inline void nb_air_from_center(const nebel_atmosphere *atmosphere, const double place[3], double from[3])
{
    for (int c = 0; c < 3; c++) from[c] = place[c] - atmosphere->center[c];
}

/* A place from the centre, of which one below the ground becomes that straight above it; the centre itself that at y. */
void nb_air_raise(double ground, double from[3]);

/* Whether a ray is in order; `unit` is its direction, made a unit one. */
int nb_air_is_ray(const nebel_ray *ray, double unit[3]);

#endif
