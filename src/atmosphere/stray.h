/* Light that forward peaks turn comes from around where it seems to come from: by how much it is another than if it went straight. */
#ifndef NB_ATMOSPHERE_STRAY_H
#define NB_ATMOSPHERE_STRAY_H

#include "in_scattering.h"

#include <math.h>

/* Sunlight at a place: what of it comes straight, as a part of what smooth air lets through; and the logarithm of what peaks
 * turn, which comes from around the sun. */
typedef struct nb_stray_sun {
    double straight[3], around[3];
} nb_stray_sun;

/* By height, the sun's height and direction: what peaks make of light from everywhere, for a scattering of 1/m. Directions are those from which light was gathered, on both sides of the horizon. */
struct nb_stray {
    int heights, suns, count; /* count: of kinds of air that have it */
    nb_strays strays;
    int airs[NEBEL_MAX_COMPONENTS];
    nb_gauss_rule slopes; /* over the part of the way from the horizon, of which the cosine is the square */
    nb_stray_sun *sun;    /* [height][sun] */
    /* [air][height][sun][side][slope]: NB_STRAY_SIZE, [order of the turn][colour], as parts of the first moment there. */
    float *parts;
    /* [height][sun][side][slope]: NB_BENT_SIZE, [mean, rest][order of the turn][colour]. */
    float *bent;
};

/* Turns: directions around, the middles of even parts of half a circle, and orders that are kept of them; five were too few
 * on the edge of the night. Size: numbers of a slope. */
enum { NB_STRAY_TURNS = 8, NB_STRAY_SIDES = 2, NB_STRAY_SIZE = 3 * NB_STRAY_TURNS };

/* Sunlight that peaks turned, by the direction to which it is scattered next. mean: how much there is, in the mean of the
 * directions from which it can come; the closed form for straight ways is multiplied by it. rest: what is then missing of the
 * scattered light, for a scattering of 1/m. */
enum { NB_BENT_SIZE = 2 * NB_STRAY_SIZE };

/* Which airs have it; allocates nothing. orders: of moments that are kept. */
nb_stray nb_stray_plan(const nb_air_components *airs, int orders, const nb_scattering_table *layout,
                       const nb_gauss_rule *slopes);

static inline void nb_stray_free(const nebel_allocator *allocator, nb_stray *stray)
{
    nb_release(allocator, stray->parts);
    nb_release(allocator, stray->sun);
    nb_release(allocator, stray->bent);
}

/* Numbers of one entry. */
static inline size_t nb_stray_entry(const nb_stray *stray)
{
    return (size_t)(NB_STRAY_SIDES * stray->slopes.count * NB_STRAY_SIZE);
}

static inline size_t nb_bent_entry(const nb_stray *stray)
{
    return (size_t)(NB_STRAY_SIDES * stray->slopes.count * NB_BENT_SIZE);
}

/* How many directions the light of one entry comes from. */
static inline size_t nb_stray_ways(const nb_stray *stray)
{
    return (size_t)(NB_STRAY_SIDES * stray->slopes.count * NB_STRAY_TURNS);
}

/* Cosine of the angle to the zenith of a direction on a side of the horizon (0: below), and what it counts in an integral over cosines. */
double nb_stray_zenith(const nb_stray *stray, double horizon, int side, int slope, double *weight);

/* Cosine to the zenith of the horizon. */
static inline double nb_stray_horizon(const nb_air_components *airs, double radius)
{
    const double ratio = airs->radius / radius;
    return -sqrt(fmax(0, (1 - ratio) * (1 + ratio)));
}

/* Fills the parts of one height. radiance: [sun][side][slope][turn][colour]. */
void nb_stray_fill(nb_stray *stray, const nb_air_components *airs, int orders, int height, double radius,
                   const double *radiance, const nb_radiance_moments *fields);

/* Fills the sunlight of one height, by the cosines of suns. radiance: of sunlight that peaks turn once, for a phase function of 1. */
void nb_stray_fill_sun(nb_stray *stray, const nb_air_components *airs, const nb_air_components *smooth, int orders,
                       int height, double radius, const double suns[], const double *radiance);

/* From sunlight that comes to the nodes of a job through smooth air, sets that which smooth air scatters there. */
void nb_stray_add_sun(const nb_stray *stray, const nb_scattering_table *scatter, const nb_gather_job *job,
                      nb_node_light *light);

/* Adds what strays to the light of the nodes that are at hand: to that scattered often, and sets that which smooth air scatters. */
void nb_stray_add(const nb_stray *stray, const nb_gather_job *job, nb_node_light *light);

#endif
