/* Skies in a picture: see environment_map.c. */
#ifndef NB_LIGHT_ENVIRONMENT_MAP_H
#define NB_LIGHT_ENVIRONMENT_MAP_H

#include "medium/phase.h"
#include "environment.h"

#include <stdatomic.h>

/* Cubic B-splines over longitude and latitude; `columns` is twice `rows`. */
typedef struct nb_environment_table {
    size_t rows, columns;
    float *coefficients; /* 3 for each node, the top row first */
} nb_environment_table;

/* Nodes of a gradient's filter: see sky.c. */
enum { NB_SKY_NODES = 129 };

struct nb_environment_filter {
    nebel_allocator allocator;
    atomic_size_t owners;
    nb_phase phase;
    nb_environment_table table;     /* of a map */
    double mean_cosine, width;      /* of a gradient */
    double rectified[NB_SKY_NODES]; /* the same */
};

/* An empty one with one owner; NULL when memory is out. */
nb_environment_filter *nb_environment_filter_create(const nebel_allocator *allocator, const nb_phase *phase);

/* The map's filter for a phase function, made where it has none. The caller becomes an owner. NULL when memory is out. */
nb_environment_filter *nb_environment_map_filter(nebel_environment_map *map, const nb_phase *phase);

/* In the map's own frame and at intensity 1; direction of unit length. */
void nb_environment_map_radiance(const nebel_environment_map *map, const double direction[3], double radiance[3]);
void nb_environment_map_reflected(const nebel_environment_map *map, const double normal[3], double radiance[3]);
void nb_environment_map_scattered(const nb_environment_table *table, const double direction[3], double radiance[3]);

/* What a white surface reflects, and the pixels: as above. */
const nb_environment_table *nb_environment_map_reflection(const nebel_environment_map *map);
const float *nb_environment_map_pixels(const nebel_environment_map *map, size_t *width, size_t *height);

/* The largest of all pixels. */
void nb_environment_map_most(const nebel_environment_map *map, double most[3]);

#endif
