/* One kernel per instruction set, from one text; the table is filled in trace.c. */
#ifndef NB_TRACE_TRACE_KERNEL_H
#define NB_TRACE_TRACE_KERNEL_H

#include "fog/snapshot.h"
#include "light/environment.h"
#include "light/light_lattice.h"
#include "light/point_light.h"
#include "light/sun_lattice.h"

/* In which group light of the environment and of fog itself belongs, which are gathered as one. */
typedef enum nb_group_of_rest {
    NB_REST_IS_ENVIRONMENT = 0,
    NB_REST_IS_LOCAL,
    NB_REST_IS_BOTH /* what is in the planes of the local group already is that of fog itself */
} nb_group_of_rest;

/* Rays and lights are structures or, in float, planes. */
typedef struct nb_trace_job {
    const nebel_snapshot *snapshot;
    const nebel_lighting *lighting; /* of the snapshot */
    double budget;                  /* what adaptive integration may add to the error of in-scattering, absolute */
    double promised;                /* where the error would be larger than this, more digits are asked */
    int transmittance_only;
    int wants_error;
    int wants_groups;      /* of planes alone */
    nb_group_of_rest rest; /* whose light all is that neither the sun nor lights give */
    double max_opacity;    /* of the snapshot, or 1 */
    int ignore_distances;
    size_t count;
    const nebel_ray *rays; /* checked; strides in bytes */
    size_t ray_stride, transfer_stride;
    nebel_transfer *transfers;
    const nebel_ray_planes *ray_planes; /* NULL: structures. What all rays share is checked, no stride is 0 */
    const nebel_transfer_planes *light_planes;
    const uint32_t
        *first_boundary;     /* of each ray in `boundaries`, and one more; NULL: the sun reaches all of every ray */
    const float *boundaries; /* checked */
    const nebel_ray_visibility
        *light_visibility;   /* of each point light; NULL: every point light reaches all of every ray. Checked */
    size_t first_visibility; /* by which number the job's first ray goes there */
    const nb_light_lattices *light_lattices; /* NULL: none */
    size_t failed;                           /* out: the ray that was an error */
} nb_trace_job;

typedef nebel_result nb_trace_fn(nb_trace_job *job);

nb_trace_fn nb_trace_scalar, nb_trace_sse2, nb_trace_avx2, nb_trace_avx512, nb_trace_neon, nb_trace_double,
    nb_trace_quad;

/* A ray of planes none of whose strides is 0. */
nebel_ray nb_trace_ray_in_planes(const nebel_ray_planes *planes, size_t i);

/* The first of `count` rays in planes that is none; first + count where all are right. A ray of no length is, whatever
 * else it says. */
size_t nb_trace_first_fault(const nebel_ray_planes *rays, size_t first, size_t count);

/* Distances to a transmittance; only the double kernels have it. */
typedef struct nb_invert_job {
    const nebel_snapshot *snapshot;
    double depth; /* optical depth sought, > 0 */
    int channel;
    size_t count;
    const nebel_ray *rays;
    size_t ray_stride;
    double *distances;
} nb_invert_job;

nebel_result nb_invert_double(nb_invert_job *job);
nebel_result nb_invert_quad(nb_invert_job *job);

#endif
