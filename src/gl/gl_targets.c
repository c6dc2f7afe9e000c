#include "gl_targets.h"

#include <epoxy/gl.h>

unsigned nb_targets_make_texture(uint32_t width, uint32_t height, GLenum internal, GLenum format, GLenum type)
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
    return nb_targets_make_texture(t->width, t->height, GL_RGBA32F, GL_RGBA, GL_FLOAT);
}

int nb_targets_make_buffer(unsigned *name, const unsigned *textures, int count, unsigned depth)
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
    return nb_targets_make_buffer(&t->surface_buffer, surfaces, 3, t->depth) &&
           nb_targets_make_buffer(&t->fog_buffer, fog, 2, 0) &&
           nb_targets_make_buffer(&t->picture_buffer, t->picture, 4, 0) &&
           nb_targets_make_buffer(&t->survey_buffer, &t->survey, 1, 0) &&
           nb_targets_make_buffer(&t->dimming_buffer, &t->dimming, 1, 0);
}

nebel_result nb_targets_refuse(const nebel_log *log)
{
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "OpenGL: the driver (%s) does not draw into textures of floats of 32 bits; "
                   "update it, or take Mesa's software (LIBGL_ALWAYS_SOFTWARE=1) or the CPU renderer",
                   (const char *)glGetString(GL_RENDERER));
}

nebel_result nb_targets_fit(nb_targets *t, const nebel_log *log, uint32_t width, uint32_t height)
{
    if (t->width == width && t->height == height) return NEBEL_OK;
    nb_targets_delete(t);
    t->width = width;
    t->height = height;
    t->depth = nb_targets_make_texture(width, height, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
    t->place = make_floats(t);
    t->normal = make_floats(t);
    t->reflectance = make_floats(t);
    t->in_scattering = make_floats(t);
    t->transmittance = make_floats(t);
    t->dimming = make_floats(t);
    for (int i = 0; i < 4; i++) t->picture[i] = make_floats(t);
    t->survey_width = (width + NB_SURVEY_BLOCK - 1) / NB_SURVEY_BLOCK;
    t->survey_height = (height + NB_SURVEY_BLOCK - 1) / NB_SURVEY_BLOCK;
    t->survey = nb_targets_make_texture(t->survey_width, t->survey_height, GL_RGBA32F, GL_RGBA, GL_FLOAT);
    nebel_result result = nb_context_check_memory(log, "the picture; ask for fewer pixels");
    if (result == NEBEL_OK && !make_buffers(t)) {
        result = nb_targets_refuse(log);
    }
    if (result != NEBEL_OK) nb_targets_delete(t);
    return result;
}

static void delete_veil(nb_targets *t)
{
    glDeleteFramebuffers(1, &t->veil_buffer);
    glDeleteTextures(1, &t->veil);
    t->veil = t->veil_buffer = 0;
    t->veil_layers = 0;
}

unsigned nb_targets_make_array(void)
{
    unsigned texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
    return texture;
}

/* A layer for a colour: blending takes its factor from the fragment's alpha also where the target has none. */
static void make_veil(nb_targets *t, int layers)
{
    t->veil = nb_targets_make_array();
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, layers == 1 ? GL_RGBA32F : GL_RG32F, (GLsizei)t->width, (GLsizei)t->height,
                 layers, 0, layers == 1 ? GL_RGBA : GL_RG, GL_FLOAT, NULL);
    t->veil_layers = layers;
}

static int make_veil_buffer(nb_targets *t)
{
    GLenum all[3];
    glGenFramebuffers(1, &t->veil_buffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, t->veil_buffer);
    for (int i = 0; i < t->veil_layers; i++) {
        all[i] = (GLenum)(GL_COLOR_ATTACHMENT0 + i);
        glFramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, all[i], t->veil, 0, i);
    }
    glDrawBuffers(t->veil_layers, all);
    return glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

nebel_result nb_targets_fit_veil(nb_targets *t, const nebel_log *log, int layers)
{
    if (t->veil_layers == layers) return NEBEL_OK;
    delete_veil(t);
    make_veil(t, layers);
    nebel_result result = nb_context_check_memory(log, "the light of particles; ask for fewer pixels");
    if (result == NEBEL_OK && !make_veil_buffer(t)) result = nb_targets_refuse(log);
    if (result != NEBEL_OK) delete_veil(t);
    return result;
}

void nb_targets_delete(nb_targets *t)
{
    delete_veil(t);
    const GLuint textures[] = {t->depth,         t->place,         t->normal, t->reflectance,
                               t->in_scattering, t->transmittance, t->survey, t->dimming};
    const GLuint buffers[] = {t->surface_buffer, t->fog_buffer, t->picture_buffer, t->survey_buffer, t->dimming_buffer};
    glDeleteFramebuffers(5, buffers);
    glDeleteTextures(8, textures);
    glDeleteTextures(4, t->picture);
    *t = (nb_targets){0};
}
