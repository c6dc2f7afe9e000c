/* Clouds of a planet in pictures, and their shadows on surfaces. */
#ifndef NB_CPU_CPU_CLOUDS_H
#define NB_CPU_CPU_CLOUDS_H

#include "cpu_renderer.h"

/* Finds what the frame's clouds are; a planet without them has none. Errors: VALUE, MEMORY. */
nebel_result nb_cpu_clouds_set(nb_frame *frame, const nebel_frame_desc *desc);
void nb_cpu_clouds_free(nb_frame *frame);

/* Traces fog and air up to scratch->distance, to scratch->samples. */
typedef nebel_result (*nb_aerial_fn)(const nb_frame *frame, nb_scratch *scratch);

/* For the samples of a batch to come: clouds are found once for all samples of a pixel, along the ray through its middle
 * and as wide as it; so is their shade on the air. */
nebel_result nb_cpu_clouds_start(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch);

/* Puts clouds among the air and fog of a batch that scratch->samples holds up to scratch->distance. With T and S of clouds
 * (c) and of what else is there (h), light up to a node is the sum of T_h dS_c + T_c dS_h with the means of both ends. */
nebel_result nb_cpu_clouds_add(const nb_frame *frame, nb_aerial_fn haze, nb_scratch *scratch);

/* What clouds leave of the sun's light where it is lit at all, times `color`. */
nebel_result nb_cpu_clouds_shade(const nb_frame *frame, nb_scratch *scratch, float (*color)[NB_BATCH]);

/* The same of the sky's light on the ground, and on models where that is their ambient light, in scratch->air. */
nebel_result nb_cpu_clouds_shade_sky(const nb_frame *frame, nb_scratch *scratch);

#endif
