/* Free flights through fog, air and clouds, by chance: what the reference renderer knows of media. It asks for the media at
 * places and for bounds of them alone, never for what it is to judge; but for the transmittance of air, whose closed form
 * is right to 1e-9. */
#ifndef NB_CPU_DELTA_TRACKING_H
#define NB_CPU_DELTA_TRACKING_H

#include "base/base.h"
#include "rng.h"

#include "media.h"

/* A way through the media. One channel's extinction rules. */
typedef struct nb_tracker {
    const nb_media *media;
    nebel_ray ray; /* with a direction of length 1 */
    int ignore_distances;
    int channel;
    int is_boosted; /* flights collide with air more often than light does, and weigh less */
} nb_tracker;

typedef struct nb_free_flight {
    int collided;  /* else t_max was reached */
    double t;      /* m; there */
    double weight; /* of what comes from there, mean 1 for the chances of analog flights */
    nebel_sample_point place;
    nb_matter matter; /* there */
    double shone[3];  /* what the fog on the way emits towards the start, dimmed */
} nb_free_flight;

/* How far along the ray there may be media, m: what is farther than places may be counts as none. */
double nb_tracking_reach(const nebel_ray *ray);

/* The media at t. */
nebel_result nb_tracking_look(const nb_tracker *track, double t, nb_media_part part, nebel_sample_point *place,
                              nb_matter *matter);

/* Delta tracking: Woodcock et al., "Techniques used in the GEM code", 1965. The mean of `collided` times weight is the
 * opacity; that of `shone` the integral of emission times transmittance, which is gathered wherever the bound's rate stops
 * the flight. In pieces of nothing but air flights collide more often than light does, and weigh less (weighted delta
 * tracking, Galtier et al., "Integral formulation of null-collision Monte Carlo algorithms", 2013): air is thin where it is
 * bright at dusk. Elsewhere the weight stays as it is.
 * Errors: UNBOUNDED (emission without end and without extinction). */
nebel_result nb_tracking_fly(const nb_tracker *track, nb_rng *chance, nb_free_flight *flight);

/* Ratio tracking: Novak, Selle and Jarosz, "Residual Ratio Tracking", 2014, times what air leaves. The mean is the
 * transmittance. Below 1e-3 roulette decides, by which the variance grows by less than 1e-3 of the transmittance. */
nebel_result nb_tracking_transmittance(const nb_tracker *track, nb_rng *chance, double *transmittance);

#endif
