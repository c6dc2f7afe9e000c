/* Free flights through fog, by chance: what the reference renderer knows of fog. It asks for the fog at places and for
 * bounds of it alone, never for the closed forms that it is to judge. */
#ifndef NB_CPU_TRACK_H
#define NB_CPU_TRACK_H

#include "base/base.h"
#include "chance.h"

#include <nebel/places.h>

/* A way through the fog. One channel's extinction rules. */
typedef struct nb_track {
    const nebel_snapshot *fog;
    nebel_ray ray; /* with a direction of length 1 */
    int ignore_distances;
    int channel;
} nb_track;

typedef struct nb_flight {
    int collided; /* else t_max was reached */
    double t;     /* m; there */
    nebel_place place;
    nebel_matter matter; /* there */
    double shone[3];     /* what the fog on the way emits towards the start, dimmed */
} nb_flight;

/* How far along the ray there may be fog, m: what is farther than places may be counts as none. */
double nb_track_reach(const nebel_ray *ray);

/* The fog at t. */
nebel_result nb_track_look(const nb_track *track, double t, nebel_place *place, nebel_matter *matter);

/* Delta tracking: Woodcock et al., "Techniques used in the GEM code", 1965. The mean of `collided` is the opacity; that
 * of `shone` the integral of emission times transmittance, which is gathered wherever the bound's rate stops the flight.
 * Errors: UNBOUNDED (emission without end and without extinction). */
nebel_result nb_track_fly(const nb_track *track, nb_chance *chance, nb_flight *flight);

/* Ratio tracking: Novak, Selle and Jarosz, "Residual Ratio Tracking", 2014. The mean is the transmittance. Below 1e-3
 * roulette decides, by which the variance grows by less than 1e-3 of the transmittance. */
nebel_result nb_track_transmittance(const nb_track *track, nb_chance *chance, double *transmittance);

#endif
