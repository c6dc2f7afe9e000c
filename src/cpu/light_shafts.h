/* Where the point lights reach the rays of a batch past the surfaces. */
#ifndef NB_CPU_LIGHT_SHAFTS_H
#define NB_CPU_LIGHT_SHAFTS_H

#include "shadow_bvh.h"
#include "sun_shafts.h"

#include <nebel/nebel.h>

/* What a thread works in; all zero at first. */
typedef struct nb_light_shafts {
    nb_sun_shafts shafts; /* the boundaries of all point lights */
    uint32_t *numbers;    /* the member `first` of all pieces */
    size_t number_capacity;
    nebel_ray_visibility
        *pieces; /* one for each point light of the fog: what nebel_trace_desc.light_visibility takes */
    size_t piece_capacity;
} nb_light_shafts;

/* As nb_sun_shafts_find, for all point lights of the fog. What is nearer to a point light than its radius casts no
 * shadow. Errors:
 * MEMORY. */
nebel_result nb_light_shafts_find(nb_light_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                                  const nebel_lighting *lighting, const nb_lit_box *box, const nb_ray_batch *rays,
                                  double advance, const float *distance);

void nb_light_shafts_free(nb_light_shafts *shafts, const nebel_allocator *allocator);

#endif
