#include "targets.h"

#include <epoxy/gl.h>

static unsigned make_texture(uint32_t width, uint32_t height, GLenum internal, GLenum format, GLenum type)
{
    unsigned name = 0;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)internal, (GLsizei)width, (GLsizei)height, 0, format, type, NULL);
    return name;
}

static unsigned make_floats(const nb_targets *t)
{
    return make_texture(t->width, t->height, GL_RGBA32F, GL_RGBA, GL_FLOAT);
}

static int make_buffer(unsigned *name, const unsigned *textures, int count, unsigned depth)
{
    static const GLenum all[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2,
                                 GL_COLOR_ATTACHMENT3};
    glGenFramebuffers(1, name);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, *name);
    for (int i = 0; i < count; i++) {
        glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, all[i], GL_TEXTURE_2D, textures[i], 0);
    }
    if (depth != 0) glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    glDrawBuffers(count, all);
    return glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

static int make_buffers(nb_targets *t)
{
    const unsigned surfaces[] = {t->place, t->normal, t->reflectance}, fog[] = {t->in_scattering, t->transmittance};
    return make_buffer(&t->surface_buffer, surfaces, 3, t->depth) && make_buffer(&t->fog_buffer, fog, 2, 0) &&
           make_buffer(&t->picture_buffer, t->picture, 4, 0) && make_buffer(&t->survey_buffer, &t->survey, 1, 0) &&
           make_buffer(&t->dimming_buffer, &t->dimming, 1, 0);
}

nebel_result nb_targets_fit(nb_targets *t, const nebel_log *log, uint32_t width, uint32_t height)
{
    if (t->width == width && t->height == height) return NEBEL_OK;
    nb_targets_delete(t);
    t->width = width;
    t->height = height;
    t->depth = make_texture(width, height, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
    t->place = make_floats(t);
    t->normal = make_floats(t);
    t->reflectance = make_texture(width, height, GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT);
    t->in_scattering = make_floats(t);
    t->transmittance = make_floats(t);
    t->dimming = make_texture(width, height, GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT);
    for (int i = 0; i < 4; i++) t->picture[i] = make_floats(t);
    t->survey_width = (width + NB_SURVEY_BLOCK - 1) / NB_SURVEY_BLOCK;
    t->survey_height = (height + NB_SURVEY_BLOCK - 1) / NB_SURVEY_BLOCK;
    t->survey = make_texture(t->survey_width, t->survey_height, GL_RGBA32F, GL_RGBA, GL_FLOAT);
    nebel_result result = nb_context_check_memory(log, "the picture; ask for fewer pixels");
    if (result == NEBEL_OK && !make_buffers(t)) {
        result = nb_fail(log, NEBEL_ERROR_UNSUPPORTED, "OpenGL: the driver (%s) does not draw into textures of floats",
                         (const char *)glGetString(GL_RENDERER));
    }
    if (result != NEBEL_OK) nb_targets_delete(t);
    return result;
}

void nb_targets_delete(nb_targets *t)
{
    const GLuint textures[] = {t->depth,         t->place,         t->normal, t->reflectance,
                               t->in_scattering, t->transmittance, t->survey, t->dimming};
    const GLuint buffers[] = {t->surface_buffer, t->fog_buffer, t->picture_buffer, t->survey_buffer, t->dimming_buffer};
    glDeleteFramebuffers(5, buffers);
    glDeleteTextures(8, textures);
    glDeleteTextures(4, t->picture);
    *t = (nb_targets){0};
}
