/* One kernel per instruction set, from one text; the table is filled in trace.c. */
#ifndef NB_MARCH_TRACE_KERNEL_H
#define NB_MARCH_TRACE_KERNEL_H

#include "snapshot.h"

typedef struct nb_trace_job {
    const nebel_snapshot *snapshot;
    double budget; /* what adaptive integration may add to the error of in-scattering, absolute */
    int transmittance_only;
    size_t count;
    const nebel_ray *rays; /* checked; strides in bytes */
    size_t ray_stride, light_stride;
    nebel_light *lights;
    size_t failed; /* out: the ray that was an error */
} nb_trace_job;

typedef nebel_result nb_trace_fn(nb_trace_job *job);

nb_trace_fn nb_trace_scalar, nb_trace_sse2, nb_trace_avx2, nb_trace_avx512, nb_trace_neon, nb_trace_double;

/* Distances to a transmittance; only the double kernel has it. */
typedef struct nb_find_job {
    const nebel_snapshot *snapshot;
    double depth; /* optical depth sought, > 0 */
    int channel;
    size_t count;
    const nebel_ray *rays;
    size_t ray_stride;
    double *distances;
} nb_find_job;

nebel_result nb_find_double(nb_find_job *job);

#endif
