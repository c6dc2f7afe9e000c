/* The state of the context that nebel changes, kept and put back. nebel/gl.h has the list in words. */
#ifndef NB_GL_GL_STATE_H
#define NB_GL_GL_STATE_H

#include "gl_caps.h"

#include <epoxy/gl.h>

enum { NB_STATE_UNITS = 7, NB_STATE_BUFFERS = 4, NB_STATE_UNPACK = 6, NB_STATE_BLENDING = 6 };

typedef struct nb_unit {
    GLint texture, multisample, sampler;
} nb_unit;

/* How draw buffers blend. */
typedef struct nb_blending {
    GLboolean on[NB_STATE_BUFFERS];
    GLint how[NB_STATE_BUFFERS][NB_STATE_BLENDING]; /* the first alone where buffers cannot differ */
} nb_blending;

/* For drawing. */
typedef struct nb_gl_state {
    GLint program, vertex_array, active_unit, framebuffer;
    nb_unit units[NB_STATE_UNITS];
    GLint uniform_buffer, block;
    GLint64 block_start, block_size;
    GLfloat viewport[4];
    uint32_t switches, clip_distances, scissors; /* bits: which were on */
    int feedback;                                /* transform feedback was under way */
    GLboolean mask[NB_STATE_BUFFERS][4];
    nb_blending blending;
    GLint polygon_mode[2], sample_mask;
} nb_gl_state;

/* For uploads. */
typedef struct nb_unpacking {
    GLint active_unit, texture, buffer, uniform_buffer;
    GLint parameters[NB_STATE_UNPACK];
} nb_unpacking;

/* Saves, and pauses transform feedback where it is under way, which would keep programs from changing. */
void nb_state_save(const nb_context *context, nb_gl_state *state);
void nb_state_restore(const nb_context *context, const nb_gl_state *state);

/* Everything that would keep fragments away or change them is switched off; fragments cover the rectangle alone. */
void nb_state_clear(const nb_context *context, uint32_t x, uint32_t y, uint32_t width, uint32_t height);

/* glEnable or glDisable. */
void nb_state_switch(GLenum name, int on);

/* Of nb_gl_state alone. */
void nb_blending_save(const nb_context *context, nb_blending *blending);
void nb_blending_restore(const nb_context *context, const nb_blending *blending);

/* Blending of draw buffer 0: source * factor + target * factor, alpha of the target as it is. */
void nb_state_blend(const nb_context *context, GLenum source_factor, GLenum target_factor);

/* Blending of draw buffers: source + target * source's alpha; alpha: target * source. */
void nb_state_layer(const nb_context *context, int buffers);

/* Blending of draw buffer 0: target + the target's alpha * source; alpha: target * (1 - source). */
void nb_state_lay_under(const nb_context *context);

/* Fragments go to one sample of each pixel alone. OpenGL only. */
void nb_state_choose_sample(uint32_t sample);

/* Blending of all four draw buffers: source + target, alpha too. */
void nb_state_add(const nb_context *context);

/* Unit 0 is active afterwards, and memory is read as C arrays lie. */
void nb_state_save_unpacking(const nb_context *context, nb_unpacking *unpacking);
void nb_state_restore_unpacking(const nb_context *context, const nb_unpacking *unpacking);

#endif
