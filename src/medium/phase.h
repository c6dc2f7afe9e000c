/* Phase functions as the core keeps them: a weighted sum of lobes, see formulas/phase.inc. */
#ifndef NB_MEDIUM_PHASE_H
#define NB_MEDIUM_PHASE_H

#include "base/base.h"

#include <nebel/nebel.h>

typedef struct nb_lobe {
    double g, alpha, weight;
    double factor, peak, slope; /* what nb_phase_lobe takes; the factor holds the weight */
} nb_lobe;

enum { NB_MAX_LOBES = 2 };

typedef struct nb_phase {
    nb_lobe lobes[NB_MAX_LOBES];
    int lobe_count;
} nb_phase;

/* NULL when the phase function is in order, else the member that is not and its rule, as one text. */
const char *nb_phase_fault(const nebel_phase *phase);

/* Of a phase function that is in order. */
nb_phase nb_phase_resolve(const nebel_phase *phase);

/* 1/sr for a cosine within -1 and 1. */
double nb_phase_at(const nb_phase *phase, double cosine);

/* An order of all of them, by what their lobes are made of; 0: the same. */
int nb_phase_compare(const nb_phase *a, const nb_phase *b);

double nb_phase_mean_cosine(const nb_phase *phase);

/* A lobe without alpha has the part (1 + s) / 2 of its light below a cosine: that cosine, and for g >= 0 s of the cosine
 * 1 - ahead. */
double nb_phase_cosine_of_part(double g, double s);
double nb_phase_part_of_cosine(double g, double ahead);

#endif
