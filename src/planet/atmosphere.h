/* What an atmosphere is made of, for those who ask for its light. */
#ifndef NB_PLANET_ATMOSPHERE_H
#define NB_PLANET_ATMOSPHERE_H

#include "rule.h"
#include "path.h"
#include "scatter.h"

struct nebel_atmosphere {
    nebel_allocator allocator;
    double center[3];
    nb_airs airs;
    nb_rule rule;
    nb_scatter scatter;
    double share_off; /* how much of light that was scattered often may be wrong for want of entries and directions */
};

/* In units of what was scattered once: what quadrature along a ray misses. */
#define NB_ONCE_OFF 2e-3

/* What a ray gathers for a sun of irradiance 1: scattered once, by each kind of air, for phase functions of 1; more
 * often; and about how much of that is missing for want of moments, and in twilight for want of entries. */
typedef struct nb_gathered {
    double once[NEBEL_MAX_AIRS][3], often[3], missing[3];
} nb_gathered;

/* Adds what comes to the ray at a node. */
void nb_gather_node(const nebel_atmosphere *atmosphere, nb_track track, nb_aspect aspect, const nb_path_node *node,
                    nb_gathered *gathered);

/* Up to each of `count` ends, ascending, at most NB_PATH_CUTS - 2. `aspect` is that of the ray's direction where it
 * starts; the ray must stay within the air up to the last end. */
void nb_gather(const nebel_atmosphere *atmosphere, const nb_rule *rule, nb_track track, nb_aspect aspect, int count,
               const double ends[], nb_gathered gathered[]);

/* What was scattered once by phase functions as they are; `sun` is the cosine between ray and sun. */
void nb_gathered_once(const nebel_atmosphere *atmosphere, const nb_gathered *gathered, double sun, double once[3]);

/* What of gathered light may be wrong: `once` is that of nb_gathered_once. */
double nb_gathered_off(const nebel_atmosphere *atmosphere, const nb_gathered *gathered, const double once[3], int c);

/* The sun as all rays see it, its direction made a unit one; NULL: none. A sun without light may come from nowhere. 0
 * where it is not in order. */
int nb_air_resolve_sun(const nebel_sun *sun, nebel_sun *resolved);

int nb_air_is_place(const double place[3]);

/* Whether a ray is in order; `unit` is its direction, made a unit one. */
int nb_air_is_ray(const nebel_ray *ray, double unit[3]);

#endif
