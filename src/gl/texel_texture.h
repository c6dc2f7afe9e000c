/* Textures that shaders read as words: nothing between texels, one level, NEBEL_TEXTURE_WIDTH texels a row. */
#ifndef NB_GL_TEXEL_TEXTURE_H
#define NB_GL_TEXEL_TEXTURE_H

#include "gl_caps.h"

#include <nebel/shader.h>

/* Binds texture *name to the active unit, which is made where it is 0. */
void nb_texel_texture_bind(unsigned *name);

/* Makes *name a texture of whole rows of words of four floats, bound to the active unit; wants the usual unpacking. A
 * failure names `what`, and one of LIMIT ends with `remedy`. LIMIT, MEMORY. */
nebel_result nb_texel_texture_upload(unsigned *name, const nebel_log *log, const nb_context *context,
                                     const nebel_texel_f32 *words, size_t rows, const char *what, const char *remedy);

#endif
