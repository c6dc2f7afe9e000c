/* Light in level slabs of cloud that absorbs nothing: what comes through them, and the source function of sunlight that
 * is scattered more than once, as a table for one phase function. See docs/clouds.md. */
#ifndef NB_CLOUDS_CLOUD_SLAB_H
#define NB_CLOUDS_CLOUD_SLAB_H

#include "cloud_phase.h"

#include "base/base.h"

enum {
    NB_SLAB_ORDERS = 8, /* moments of the phase function, from 0 on */
    NB_SLAB_COEFFICIENTS = NB_SLAB_ORDERS * (NB_SLAB_ORDERS + 1) / 2,
    NB_SLAB_DEPTHS = 13, /* 0, 2^-4, 2^-3 ... 2^7 */
    NB_SLAB_SUNS = 8,
    /* Depths of what comes through: so many from one to twice that, from 2^-8 to 2^8. */
    NB_SLAB_FINER = 4,
    NB_SLAB_OCTAVES = 16,
    NB_SLAB_THROUGH_SUNS = 2 * NB_SLAB_SUNS,
    NB_SLAB_THROUGH = NB_SLAB_FINER * NB_SLAB_OCTAVES,
};

/* Four numbers that are counted together; allocators need not align them. */
typedef float nb_slab_four __attribute__((vector_size(16), aligned(4)));

/* Depths are scaled: a part 1 - `apart` of all scattering goes straight on and is left out (delta-M: Wiscombe 1977). */
typedef struct nb_slab {
    float apart, through_apart; /* through_apart: of depths of what comes through */
    float
        cap[3]; /* each color's phase function held below that is the part of scattering that does not go straight on */
    /* By depth above, depth below and sun: coefficients of the source function (nb_slab_source). */
    nb_slab_four source[NB_SLAB_DEPTHS][NB_SLAB_DEPTHS][NB_SLAB_SUNS][NB_SLAB_COEFFICIENTS / 4];
    float through[NB_SLAB_THROUGH][NB_SLAB_THROUGH_SUNS]; /* 1 by the part of light that comes through */
} nb_slab;

/* NULL: out of memory. */
nb_slab *nb_slab_make(const nebel_allocator *allocator, const nb_cloud_phase *phase);

/* A place in a slab under the sun, and a way to look at it. */
typedef struct nb_slab_place {
    float above, below; /* scaled depths */
    float sun;          /* cosine of the sun to the slab's normal */
    float rise, ahead;  /* cosines of the ray to that normal and to the sun */
} nb_slab_place;

/* Radiance per unit of scaled depth, for irradiance 1 across sunlight. */
float nb_slab_source(const nb_slab *slab, const nb_slab_place *place);

/* Part of sunlight that comes through a slab, straight or scattered; its depth is not scaled. */
float nb_slab_through(const nb_slab *slab, float depth, float sun);

#endif
