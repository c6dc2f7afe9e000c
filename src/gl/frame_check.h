/* What a frame may ask for. */
#ifndef NB_GL_FRAME_CHECK_H
#define NB_GL_FRAME_CHECK_H

#include "gl_renderer.h"

/* Size, samples, method, taps, and whether floats hold the meshes. VALUE, LIMIT, ARGUMENT, UNSUPPORTED, with a message. */
nebel_result nb_gl_frame_check(const nebel_gl_renderer *renderer, const nebel_gl_frame_desc *desc, uint32_t samples);

#endif
