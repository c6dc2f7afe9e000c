/* Fog per vertex as programs had it around 2000: one vertex after the other, by cases. What the kernels are measured
 * against. */
#ifndef NB_BENCH_SCALAR_BASELINE_H
#define NB_BENCH_SCALAR_BASELINE_H

#include <stddef.h>

typedef struct nb_old_vector {
    float x, y, z;
} nb_old_vector;

typedef struct nb_old_vertex {
    nb_old_vector position, normal;
    float u, v;
    float transmittance; /* out */
} nb_old_vertex;

typedef struct nb_old_colored_vertex {
    nb_old_vector position, normal;
    float u, v;
    unsigned char color[4]; /* out: fog times its color, fog */
} nb_old_colored_vertex;

typedef struct nb_old_camera {
    nb_old_vector position;
} nb_old_camera;

typedef struct nb_old_box {
    nb_old_vector low, high;
    float extinction;
} nb_old_box;

void nb_magazine_fog(const nb_old_camera *camera, const nb_old_box *boxes, size_t box_count, nb_old_vertex *vertices,
                     size_t vertex_count);

void nb_magazine_color(const nb_old_camera *camera, const nb_old_box *boxes, size_t box_count, const float color[3],
                       nb_old_colored_vertex *vertices, size_t vertex_count);

#endif
