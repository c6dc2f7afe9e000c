/* Rays through a table of air, one kernel per instruction set. */
#ifndef NB_ATMOSPHERE_SKY_VIEW_LOOKUP_H
#define NB_ATMOSPHERE_SKY_VIEW_LOOKUP_H

#include "multiple_scattering.h"

/* Numbers of an entry, three of each kind of air that scatters, and five; a multiple of four. */
enum { NB_VIEW_SIZE = 3 * NEBEL_MAX_COMPONENTS + 8 };

/* A view in plain numbers: kernels have the structures of formulas in lanes. */
typedef struct nb_sky_view_table {
    double radius, ground, thickness, height, dip, ratio, horizon, half_arc; /* an nb_elevation_map */
    double up[3], ahead[3], aside[3], sun_cosine, sun_sine;
    int falling, rising, columns, levels, size, suns;
    const float *entries;
    const double (*extinction)[4], (*sunlight)[3];
    int scatterer_count;
    const nb_phase *phases[NEBEL_MAX_COMPONENTS]; /* of those that scatter */
    double irradiance[3], least_off;
    const nb_scattering_table *scatter;
} nb_sky_view_table;

typedef struct nb_sky_view_job {
    const nb_sky_view_table *table;
    size_t count;
    const double *direction[3];
    const float *t_max; /* NULL: as far as they go */
    nebel_transfer_planes transfers;
    nebel_ground_planes ground;
} nb_sky_view_job;

/* Of an instruction set: light along rays, and the ground that they meet. */
typedef struct nb_sky_view_kernel {
    void (*along)(const nb_sky_view_job *job);
    void (*down)(const nb_sky_view_job *job);
} nb_sky_view_kernel;

extern const nb_sky_view_kernel nb_sky_view_kernel_scalar, nb_sky_view_kernel_sse2, nb_sky_view_kernel_avx2,
    nb_sky_view_kernel_avx512, nb_sky_view_kernel_neon;

/* For DEFAULT that of the best one; NULL where this build or processor has not got it. */
const nb_sky_view_kernel *nb_sky_view_choose(nebel_isa isa);

#endif
