/* Classic fog on surfaces, per vertex or per pixel. */
#ifndef NB_CPU_CPU_CLASSIC_H
#define NB_CPU_CPU_CLASSIC_H

#include "cpu_renderer.h"

/* The fog of every vertex for the view of the frame, where the frame's method wants it. Errors: MEMORY. */
nebel_result nb_classic_fog_set_vertices(const nb_frame *frame);

/* Transmittance and in-scattering of a batch whose hits are known; where nothing is hit there is no fog. */
void nb_classic_fog_trace(const nb_frame *frame, nb_scratch *scratch);

/* Lays fog over samples->color, the light behind it, as hardware does that blends what it has stored. */
void nb_classic_fog_blend(const nb_light_samples *fog, nb_light_samples *samples);

#endif
