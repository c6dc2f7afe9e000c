/* Batches that see air alone, which changes so little within a pixel that one sample does for all. */
#ifndef NB_CPU_UNIFORM_BATCH_H
#define NB_CPU_UNIFORM_BATCH_H

#include "cpu_renderer.h"

/* Whether a frame may have such batches at all. */
int nb_uniform_batch_may_be(const nb_frame *frame);

/* Renders the centres of a batch's pixels into scratch->samples where they do for the samples 0 to count - 1, which
 * belong to the members of scratch->points_of_region: *is_even says so. Else what it leaves in scratch means nothing.
 * Errors: as nb_batch_render. */
nebel_result nb_uniform_batch_render(const nb_frame *frame, const nb_batch_place *place, uint32_t count,
                                     nb_scratch *scratch, int *is_even);

#endif
