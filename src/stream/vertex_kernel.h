/* From transmittances to what the vertices of a program hold, one kernel per instruction set. */
#ifndef NB_STREAM_VERTEX_KERNEL_H
#define NB_STREAM_VERTEX_KERNEL_H

#include <stddef.h>

/* In the order of nebel_curve_type and of nebel_vertex_format. */
typedef enum nb_curve_kind {
    NB_CURVE_PHYSICAL = 0,
    NB_CURVE_LINEAR,
    NB_CURVE_EXP,
    NB_CURVE_EXP2,
    NB_CURVE_TABLE
} nb_curve_kind;

typedef enum nb_vertex_kind {
    NB_VERTEX_FACTOR = 0,
    NB_VERTEX_COORDINATE,
    NB_VERTEX_RGBA_FLOAT,
    NB_VERTEX_RGBA8,
    NB_VERTEX_SPECULAR_ALPHA,
    NB_VERTEX_ALPHA
} nb_vertex_kind;

/* The most vertices of a block, a multiple of every number of lanes. */
enum { NB_VERTEX_BLOCK = 1024 };

/* One stream of a block. `factor` and `light` have room for NB_VERTEX_BLOCK numbers, and numbers they are beyond count,
 * too. */
typedef struct nb_vertices_job {
    size_t count;
    nb_vertex_kind kind;
    unsigned char *data;   /* of the first vertex */
    size_t stride;         /* bytes */
    float *factor;         /* transmittance; the curve is put in */
    const float *light[3]; /* that fog adds; NULL: the amount of fog times color */
    float color[3];
    nb_curve_kind curve;
    const float *table; /* 256 weights */
    float coordinate_end;
} nb_vertices_job;

typedef void nb_vertices_fn(const nb_vertices_job *job);

nb_vertices_fn nb_vertices_scalar, nb_vertices_sse2, nb_vertices_avx2, nb_vertices_avx512, nb_vertices_neon;

#endif
