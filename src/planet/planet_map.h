/* Maps of planets, with coarser ones for what is far away. */
#ifndef NB_PLANET_PLANET_MAP_H
#define NB_PLANET_PLANET_MAP_H

#include "base/base.h"

#include <nebel/planet.h>

enum { NB_MAP_LEVELS = 15 }; /* of NEBEL_MAX_PLANET_MAP_SIZE, each half the one before */

/* Level 0 is the map, each texel of the next the mean of what it covers. */
typedef struct nb_planet_map {
    int channels, level_count;
    size_t width[NB_MAP_LEVELS], height[NB_MAP_LEVELS];
    float *levels[NB_MAP_LEVELS]; /* in one piece of memory, at levels[0] */
} nb_planet_map;

/* Copies the map. Errors: MEMORY. */
nebel_result nb_planet_map_make(const nebel_allocator *allocator, const nebel_planet_map *desc, nb_planet_map *map);

void nb_planet_map_free(const nebel_allocator *allocator, nb_planet_map *map);

/* One of its levels; {0} of a map that was not made. */
nebel_planet_map nb_planet_map_level(const nb_planet_map *map, int level);

/* NULL, or what is wrong with one. */
const char *nb_map_fault(const nebel_planet_map *map, int channels);

/* Linear between texels, whose middles are half a texel from the edges, and between levels; `level` is how often the
 * map is halved, any number. Columns repeat; rows do where `repeats`, and end else. Writes map->channels numbers. */
void nb_planet_map_read(const nb_planet_map *map, double u, double v, double level, int repeats, double *values);

#endif
