/* What fog is at a place, for light that is scattered many times. */
#ifndef NB_FOG_MEDIUM_SAMPLING_H
#define NB_FOG_MEDIUM_SAMPLING_H

#include "snapshot.h"

/* Sums over volumes [1/m]. Of what a volume scatters, a part (nb_medium.ahead) is taken to go straight on. */
typedef struct nb_medium_transport {
    double extinction[3], scattering[3];
    double turned[3];   /* what is scattered and does not go straight on */
    double forward[3];  /* the same times its mean cosine */
    double emission[3]; /* radiance per metre: emission, and source times extinction */
} nb_medium_transport;

/* Adds what is at the place. `start` and `cutoff` do not count. */
void nb_sample_medium_transport(const nebel_snapshot *snapshot, const double position[3], nb_medium_transport *sum);

#endif
