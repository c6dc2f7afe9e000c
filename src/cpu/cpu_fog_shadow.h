/* Clouds' shade on fog by its place: what they leave of the sun and of the sky along the ray through the middle of each pixel. */
#ifndef NB_CPU_CPU_FOG_SHADOW_H
#define NB_CPU_CPU_FOG_SHADOW_H

#include "cpu_renderer.h"

/* Whether it is not the same all over the frame's fog, once clouds are set; all that is needed for rays is then in frame->air.
 * Errors: MEMORY. */
nebel_result nb_fog_shadow_set(nb_frame *frame);

/* For a batch to come: no ray has any. */
void nb_fog_shadow_start(nb_scratch *scratch);

/* Along the rays that see fog up to scratch->air.nodes[0] and have none yet. */
nebel_result nb_fog_shadow_find(const nb_frame *frame, nb_scratch *scratch);

/* Between two places of a ray. */
nb_segment_shadow nb_fog_shadow_between(const nb_fog_shadow *shade, float a, float b);

/* A place between two others at which pieces of shade meet, with as many on both sides; 0: they are in one. */
float nb_fog_shadow_cut(const nb_fog_shadow *shade, float a, float b);

#endif
