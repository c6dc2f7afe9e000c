/* The landscape of the benchmark scenes: fractal value noise over 100 x 100 units, heights from -2 to 12. */
#ifndef NB_BENCH_TERRAIN_H
#define NB_BENCH_TERRAIN_H

#include <stdint.h>

typedef struct nb_terrain {
    uint32_t vertex_count, triangle_count;
    float *positions; /* 3 per vertex, row by row */
    uint32_t *indices;
} nb_terrain;

/* quads x quads quads of two triangles each. Returns 0, or -1 without memory. */
int nb_terrain_make(uint32_t quads, nb_terrain *terrain);
void nb_terrain_free(nb_terrain *terrain);

#endif
