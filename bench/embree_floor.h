/* What Embree's rays alone cost: coherent packets from the camera, and from what they hit to the sun. */
#ifndef NB_BENCH_EMBREE_FLOOR_H
#define NB_BENCH_EMBREE_FLOOR_H

#include "scenes.h"

#include <stddef.h>

typedef struct nb_embree_floor nb_embree_floor;

/* Builds the acceleration structure with all processors. NULL without memory or Embree. */
nb_embree_floor *nb_embree_floor_make(const nb_bench_scene *scene, uint32_t width, uint32_t height);
void nb_embree_floor_free(nb_embree_floor *floor);

/* What Embree has allocated. */
size_t nb_embree_floor_bytes(const nb_embree_floor *floor);

/* CPU seconds of one ray for each pixel and of the sun's rays, in this thread. */
typedef struct nb_embree_rays {
    double primary_seconds, shadow_seconds;
    size_t hits;
    size_t shadow_rays;
} nb_embree_rays;

nb_embree_rays nb_embree_floor_trace(const nb_embree_floor *floor);

#endif
