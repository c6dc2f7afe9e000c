/* Phase functions of a layer of clouds, for light of three colors. Drops of water are those of Mie's theory, by a table that
 * scripts/make_droplets.py wrote: it has the fogbow and the glory. Cirrus is of ice, which has neither, and has the fit for
 * droplets of medium/phase.c. See docs/clouds.md. */
#ifndef NB_CLOUDS_CLOUD_PHASE_H
#define NB_CLOUDS_CLOUD_PHASE_H

#include "medium/phase.h"

#include <nebel/planet.h>

enum {
    NB_CLOUD_PHASE_DIAMETERS = 12, /* from 4 to 50 micrometers, evenly spread logarithms */
    NB_CLOUD_PHASE_ANGLES = 224,
    NB_CLOUD_PHASE_FINER = 4, /* steps of a layer's own table between two angles of the other */
    NB_CLOUD_PHASE_STEPS = (NB_CLOUD_PHASE_ANGLES - 1) * NB_CLOUD_PHASE_FINER,
    NB_CLOUD_PHASE_MOMENTS = 17,
};

/* 2048 times the logarithm of 1/sr, from straight ahead to straight back. */
extern const int16_t nb_cloud_phase_table[3][NB_CLOUD_PHASE_DIAMETERS][NB_CLOUD_PHASE_ANGLES];

typedef struct nb_cloud_phase {
    float values[NB_CLOUD_PHASE_STEPS + 1][4]; /* 1/sr: red, green, blue and their mean */
    double moments[NB_CLOUD_PHASE_MOMENTS];    /* of the mean: integrals of Legendre's polynomials times it */
} nb_cloud_phase;

/* Diameters of less than 4 micrometers count as 4, and above 50 as 50. */
void nb_cloud_phase_make(nebel_cloud_type kind, double diameter, nb_cloud_phase *phase);

/* Of red, green, blue and their mean at a cosine within -1 and 1. */
void nb_cloud_phase_at(const nb_cloud_phase *phase, double cosine, float values[4]);

#endif
