#include "texel_texture.h"

#include <epoxy/gl.h>

void nb_texel_texture_bind(unsigned *name)
{
    const int is_new = *name == 0;
    if (is_new) glGenTextures(1, name);
    glBindTexture(GL_TEXTURE_2D, *name);
    if (!is_new) return;
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
}

nebel_result nb_texel_texture_upload(unsigned *name, const nebel_log *log, const nb_context *context,
                                     const nebel_texel_f32 *words, size_t rows, const char *what, const char *remedy)
{
    if (rows > context->widest)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "%s needs %zu rows, this context has %u (GL_MAX_TEXTURE_SIZE)%s", what,
                       rows, (unsigned)context->widest, remedy);
    nb_texel_texture_bind(name);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, 0, GL_RGBA, GL_FLOAT, words);
    return nb_context_check_memory(log, what);
}
