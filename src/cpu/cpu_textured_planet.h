/* A textured planet in pictures: its ground ends rays, its shells lie before it. */
#ifndef NB_CPU_CPU_TEXTURED_PLANET_H
#define NB_CPU_CPU_TEXTURED_PLANET_H

#include "cpu_renderer.h"

/* Finds what the frame's layers are; without a textured planet there are none. Errors: UNSUPPORTED. */
nebel_result nb_cpu_textured_set(nb_frame *frame, const nebel_frame_desc *desc);

/* What rays meet before their surfaces; behind the planet's ground nothing is a hit. */
nebel_result nb_cpu_textured_find(const nb_frame *frame, nb_scratch *scratch);

/* Fog up to each shell, and the shells over each other: with A what those before leave, the sum of
 *     A (S(shell) - S(shell before) + T(shell) radiance).
 * `fog` are the rays and `trace` is how their fog is found; fog NULL: there is none. */
nebel_result nb_cpu_textured_trace(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                                   nb_scratch *scratch);

/* Lays that over samples->color, whose light they leave a part of, and makes the ground a hit. */
void nb_cpu_textured_blend(const nb_frame *frame, nb_scratch *scratch);

#endif
