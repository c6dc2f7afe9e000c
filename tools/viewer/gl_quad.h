/* Programs of OpenGL that fill the target: one triangle, one fragment shader. */
#ifndef NB_TOOLS_VIEWER_GL_QUAD_H
#define NB_TOOLS_VIEWER_GL_QUAD_H

#include <nebel/nebel.h>

/* `fragment` is GLSL 3.30 without its first line. Errors: UNSUPPORTED, with the driver's words in the log. */
nebel_result nb_program_make(const char *fragment, const nebel_log *log, unsigned *program);

/* Binds a texture to a unit and to the sampler of that name, in the program that is in use. */
void nb_program_bind(unsigned program, const char *sampler, int unit, unsigned texture);

#endif
