/* What the current context is, and can. */
#ifndef NB_GL_GL_CAPS_H
#define NB_GL_GL_CAPS_H

#include "base/base.h"

typedef struct nb_context {
    int es;
    int version; /* 33: 3.3 */
    int switches_by_buffer, blending_by_buffer, viewport_arrays, pauses_feedback;
    uint32_t viewports; /* with a scissor each, 32 at most; 1 where there are no viewport arrays */
    int sample_mask, tells_sizes, clip_distances, depth_bounds;
    int dual_source; /* 0: no, 1: yes, 2: through an extension of the shading language */
    uint32_t widest; /* texture */
    int most_turns;  /* of the walk through a ray's fog in one shader; 0: any number */
} nb_context;

/* Of the current context: whether it has an extension, and a number that it tells. */
int nb_context_has(const char *extension);
int nb_context_integer(unsigned name);

/* Reads what the current context is. UNSUPPORTED where there is none or it is too old. */
nebel_result nb_context_read(const nebel_log *log, nb_context *context);

/* NEBEL_OK while `vertex_array`, which is of this nebel_gl, exists here: it belongs to one context alone, and goes when
 * that is lost. */
nebel_result nb_context_check(const nebel_log *log, unsigned vertex_array);

/* After OpenGL was asked for memory: MEMORY where it had none. */
nebel_result nb_context_check_memory(const nebel_log *log, const char *what);

#endif
