/* The terrain as a 16-bit grey picture. */
#ifndef NB_BENCH_HEIGHT_MAP_H
#define NB_BENCH_HEIGHT_MAP_H

#include "terrain.h"

#include <stdio.h>

/* Writes a PNG that is not compressed, the lowest point black and the highest white. Returns 0, or -1 without memory.
 */
int nb_height_map_write(const nb_terrain *terrain, FILE *file);

#endif
