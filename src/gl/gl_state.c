#include "gl_state.h"

/* Which contexts know a switch. */
typedef enum nb_capability { EVERYWHERE, DESKTOP, SAMPLE_MASKS, SAMPLE_SHADING, DEPTH_BOUNDS } nb_capability;

static const struct {
    GLenum name;
    nb_capability known;
} switches[] = {
    {GL_STENCIL_TEST, EVERYWHERE},     {GL_DEPTH_TEST, EVERYWHERE},
    {GL_CULL_FACE, EVERYWHERE},        {GL_RASTERIZER_DISCARD, EVERYWHERE},
    {GL_SAMPLE_COVERAGE, EVERYWHERE},  {GL_SAMPLE_ALPHA_TO_COVERAGE, EVERYWHERE},
    {GL_SAMPLE_MASK, SAMPLE_MASKS},    {GL_SAMPLE_SHADING, SAMPLE_SHADING},
    {GL_SAMPLE_ALPHA_TO_ONE, DESKTOP}, {GL_COLOR_LOGIC_OP, DESKTOP},
    {GL_POLYGON_SMOOTH, DESKTOP},      {GL_MULTISAMPLE, DESKTOP},
    {GL_PRIMITIVE_RESTART, DESKTOP},   {GL_DEPTH_BOUNDS_TEST_EXT, DEPTH_BOUNDS},
};
enum { SWITCHES = sizeof switches / sizeof *switches };

static const GLenum blending_names[NB_STATE_BLENDING] = {GL_BLEND_SRC_RGB,      GL_BLEND_DST_RGB,
                                                         GL_BLEND_SRC_ALPHA,    GL_BLEND_DST_ALPHA,
                                                         GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA};

/* The last two are of OpenGL alone. */
static const GLenum unpack_names[NB_STATE_UNPACK] = {GL_UNPACK_ALIGNMENT,   GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS,
                                                     GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST};

static int knows(const nb_context *c, nb_capability known)
{
    switch (known) {
    case DESKTOP:
        return !c->es;
    case SAMPLE_MASKS:
        return c->sample_mask;
    case SAMPLE_SHADING:
        return c->version >= (c->es ? 32 : 40);
    case DEPTH_BOUNDS:
        return c->depth_bounds;
    default:
        return 1;
    }
}

void nb_state_switch(GLenum name, int on)
{
    if (on) {
        glEnable(name);
    } else {
        glDisable(name);
    }
}

static void set_indexed_switch(int by_index, GLenum name, GLuint index, int on)
{
    if (!by_index) {
        if (index == 0) nb_state_switch(name, on);
    } else if (on) {
        glEnablei(name, index);
    } else {
        glDisablei(name, index);
    }
}

static GLboolean indexed_switch(int by_index, GLenum name, GLuint index)
{
    return by_index ? glIsEnabledi(name, index) : glIsEnabled(name);
}

/* ---- reading --------------------------------------------------------------------------------- */

static void save_units(const nb_context *c, nb_gl_state *s)
{
    glGetIntegerv(GL_ACTIVE_TEXTURE, &s->active_unit);
    for (int i = 0; i < NB_STATE_UNITS; i++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + i));
        glGetIntegerv(GL_TEXTURE_BINDING_2D, &s->units[i].texture);
        if (!c->es) glGetIntegerv(GL_TEXTURE_BINDING_2D_MULTISAMPLE, &s->units[i].multisample);
        glGetIntegerv(GL_SAMPLER_BINDING, &s->units[i].sampler);
    }
}

static void save_block(nb_gl_state *s)
{
    glGetIntegerv(GL_UNIFORM_BUFFER_BINDING, &s->uniform_buffer);
    glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, 0, &s->block);
    glGetInteger64i_v(GL_UNIFORM_BUFFER_START, 0, &s->block_start);
    glGetInteger64i_v(GL_UNIFORM_BUFFER_SIZE, 0, &s->block_size);
}

static void save_switches(const nb_context *c, nb_gl_state *s)
{
    s->switches = s->clip_distances = s->scissors = 0;
    for (unsigned i = 0; i < SWITCHES; i++) {
        if (knows(c, switches[i].known) && glIsEnabled(switches[i].name)) s->switches |= 1u << i;
    }
    for (int i = 0; i < c->clip_distances; i++) {
        if (glIsEnabled((GLenum)(GL_CLIP_DISTANCE0 + i))) s->clip_distances |= 1u << i;
    }
    for (GLuint i = 0; i < c->viewports; i++) {
        if (indexed_switch(c->viewport_arrays, GL_SCISSOR_TEST, i)) s->scissors |= 1u << i;
    }
}

/* How many draw buffers blend each in its own way. */
static GLuint blending_count(const nb_context *c)
{
    return c->blending_by_buffer ? NB_STATE_BUFFERS : 1;
}

void nb_blending_save(const nb_context *c, nb_blending *b)
{
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) b->on[i] = indexed_switch(c->switches_by_buffer, GL_BLEND, i);
    for (GLuint i = 0; i < blending_count(c); i++) {
        for (int k = 0; k < NB_STATE_BLENDING; k++) {
            if (c->blending_by_buffer) {
                glGetIntegeri_v(blending_names[k], i, &b->how[i][k]);
            } else {
                glGetIntegerv(blending_names[k], &b->how[i][k]);
            }
        }
    }
}

static void save_masks(const nb_context *c, nb_gl_state *s)
{
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) {
        if (c->switches_by_buffer) {
            GLint mask[4];
            glGetIntegeri_v(GL_COLOR_WRITEMASK, i, mask); /* OpenGL ES 3.0 has no glGetBooleani_v */
            for (int k = 0; k < 4; k++) s->mask[i][k] = mask[k] != 0;
        } else {
            glGetBooleanv(GL_COLOR_WRITEMASK, s->mask[i]);
        }
    }
}

static void pause_feedback(const nb_context *c, nb_gl_state *s)
{
    GLboolean active = GL_FALSE, paused = GL_FALSE;
    if (c->pauses_feedback) {
        glGetBooleanv(GL_TRANSFORM_FEEDBACK_ACTIVE, &active);
        glGetBooleanv(GL_TRANSFORM_FEEDBACK_PAUSED, &paused);
    }
    s->feedback = active && !paused;
    if (s->feedback) glPauseTransformFeedback();
}

void nb_state_save(const nb_context *c, nb_gl_state *s)
{
    pause_feedback(c, s);
    glGetIntegerv(GL_CURRENT_PROGRAM, &s->program);
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &s->vertex_array);
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &s->framebuffer);
    save_units(c, s);
    save_block(s);
    save_switches(c, s);
    save_masks(c, s);
    nb_blending_save(c, &s->blending);
    if (c->viewport_arrays) {
        glGetFloati_v(GL_VIEWPORT, 0, s->viewport);
    } else {
        glGetFloatv(GL_VIEWPORT, s->viewport);
    }
    if (c->es) return;
    glGetIntegerv(GL_POLYGON_MODE, s->polygon_mode);
    glGetIntegeri_v(GL_SAMPLE_MASK_VALUE, 0, &s->sample_mask);
}

/* ---- writing --------------------------------------------------------------------------------- */

static void restore_units(const nb_context *c, const nb_gl_state *s)
{
    for (int i = 0; i < NB_STATE_UNITS; i++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + i));
        glBindTexture(GL_TEXTURE_2D, (GLuint)s->units[i].texture);
        if (!c->es) glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, (GLuint)s->units[i].multisample);
        glBindSampler((GLuint)i, (GLuint)s->units[i].sampler);
    }
    glActiveTexture((GLenum)s->active_unit);
}

/* Size 0 says that the whole buffer is bound. */
static void restore_block(const nb_gl_state *s)
{
    if (s->block_size > 0) {
        glBindBufferRange(GL_UNIFORM_BUFFER, 0, (GLuint)s->block, (GLintptr)s->block_start, (GLsizeiptr)s->block_size);
    } else {
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, (GLuint)s->block);
    }
    glBindBuffer(GL_UNIFORM_BUFFER, (GLuint)s->uniform_buffer);
}

/* Those of all viewports: where one is on, Mesa 22 cuts off what goes through others, too. */
static void set_scissors(const nb_context *c, uint32_t on)
{
    for (GLuint i = 0; i < c->viewports; i++) set_indexed_switch(c->viewport_arrays, GL_SCISSOR_TEST, i, on >> i & 1);
}

static void set_switches(const nb_context *c, uint32_t on, uint32_t clip_distances)
{
    for (unsigned i = 0; i < SWITCHES; i++) {
        if (knows(c, switches[i].known)) nb_state_switch(switches[i].name, on >> i & 1);
    }
    for (int i = 0; i < c->clip_distances; i++)
        nb_state_switch((GLenum)(GL_CLIP_DISTANCE0 + i), clip_distances >> i & 1);
}

static void set_mask(const nb_context *c, GLuint buffer, const GLboolean mask[4])
{
    if (c->switches_by_buffer) {
        glColorMaski(buffer, mask[0], mask[1], mask[2], mask[3]);
    } else if (buffer == 0) {
        glColorMask(mask[0], mask[1], mask[2], mask[3]);
    }
}

static void set_blending(const nb_context *c, GLuint buffer, const GLint b[NB_STATE_BLENDING])
{
    if (c->blending_by_buffer) {
        glBlendFuncSeparatei(buffer, (GLenum)b[0], (GLenum)b[1], (GLenum)b[2], (GLenum)b[3]);
        glBlendEquationSeparatei(buffer, (GLenum)b[4], (GLenum)b[5]);
    } else {
        glBlendFuncSeparate((GLenum)b[0], (GLenum)b[1], (GLenum)b[2], (GLenum)b[3]);
        glBlendEquationSeparate((GLenum)b[4], (GLenum)b[5]);
    }
}

static void set_viewport(const nb_context *c, const GLfloat v[4])
{
    if (c->viewport_arrays) {
        glViewportIndexedfv(0, v);
    } else {
        glViewport((GLint)v[0], (GLint)v[1], (GLsizei)v[2], (GLsizei)v[3]);
    }
}

void nb_blending_restore(const nb_context *c, const nb_blending *b)
{
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) set_indexed_switch(c->switches_by_buffer, GL_BLEND, i, b->on[i]);
    for (GLuint i = 0; i < blending_count(c); i++) set_blending(c, i, b->how[i]);
}

/* A program that was deleted while it was current is gone for good once another takes its place. Core profiles have one
 * polygon mode for both faces. */
void nb_state_restore(const nb_context *c, const nb_gl_state *s)
{
    glUseProgram(glIsProgram((GLuint)s->program) ? (GLuint)s->program : 0);
    glBindVertexArray((GLuint)s->vertex_array);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, (GLuint)s->framebuffer);
    restore_units(c, s);
    restore_block(s);
    set_switches(c, s->switches, s->clip_distances);
    set_scissors(c, s->scissors);
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) set_mask(c, i, s->mask[i]);
    nb_blending_restore(c, &s->blending);
    set_viewport(c, s->viewport);
    if (!c->es) {
        glPolygonMode(GL_FRONT_AND_BACK, (GLenum)s->polygon_mode[0]);
        glSampleMaski(0, (GLbitfield)s->sample_mask);
    }
    if (s->feedback) glResumeTransformFeedback();
}

void nb_state_clear(const nb_context *c, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    const GLfloat viewport[4] = {(GLfloat)x, (GLfloat)y, (GLfloat)width, (GLfloat)height};
    const GLboolean all[4] = {GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE};
    set_switches(c, 0, 0);
    glDisable(GL_SCISSOR_TEST);
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) {
        set_indexed_switch(c->switches_by_buffer, GL_BLEND, i, 0);
        set_mask(c, i, all);
    }
    set_viewport(c, viewport);
    if (!c->es) glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

void nb_state_blend(const nb_context *c, GLenum source_factor, GLenum target_factor)
{
    const GLint blending[NB_STATE_BLENDING] = {(GLint)source_factor, (GLint)target_factor, GL_ZERO, GL_ONE,
                                               GL_FUNC_ADD,          GL_FUNC_ADD};
    set_indexed_switch(c->switches_by_buffer, GL_BLEND, 0, 1);
    set_blending(c, 0, blending);
}

void nb_state_lay_under(const nb_context *c)
{
    const GLint blending[NB_STATE_BLENDING] = {GL_DST_ALPHA,           GL_ONE,      GL_ZERO,
                                               GL_ONE_MINUS_SRC_ALPHA, GL_FUNC_ADD, GL_FUNC_ADD};
    set_indexed_switch(c->switches_by_buffer, GL_BLEND, 0, 1);
    set_blending(c, 0, blending);
}

void nb_state_layer(const nb_context *c, int buffers)
{
    const GLint blending[NB_STATE_BLENDING] = {GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_SRC_ALPHA, GL_FUNC_ADD, GL_FUNC_ADD};
    for (GLuint i = 0; i < (GLuint)buffers; i++) set_indexed_switch(c->switches_by_buffer, GL_BLEND, i, 1);
    for (GLuint i = 0; i < (c->blending_by_buffer ? (GLuint)buffers : 1); i++) set_blending(c, i, blending);
}

void nb_state_add(const nb_context *c)
{
    const GLint blending[NB_STATE_BLENDING] = {GL_ONE, GL_ONE, GL_ONE, GL_ONE, GL_FUNC_ADD, GL_FUNC_ADD};
    for (GLuint i = 0; i < NB_STATE_BUFFERS; i++) set_indexed_switch(c->switches_by_buffer, GL_BLEND, i, 1);
    for (GLuint i = 0; i < blending_count(c); i++) set_blending(c, i, blending);
}

void nb_state_choose_sample(uint32_t sample)
{
    glEnable(GL_MULTISAMPLE);
    glEnable(GL_SAMPLE_MASK);
    glSampleMaski(0, 1u << sample);
}

/* ---- uploads --------------------------------------------------------------------------------- */

static int unpack_count(const nb_context *c)
{
    return c->es ? NB_STATE_UNPACK - 2 : NB_STATE_UNPACK;
}

void nb_state_save_unpacking(const nb_context *c, nb_unpacking *u)
{
    glGetIntegerv(GL_ACTIVE_TEXTURE, &u->active_unit);
    glActiveTexture(GL_TEXTURE0);
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &u->texture);
    glGetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &u->buffer);
    glGetIntegerv(GL_UNIFORM_BUFFER_BINDING, &u->uniform_buffer);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    for (int i = 0; i < unpack_count(c); i++) {
        glGetIntegerv(unpack_names[i], &u->parameters[i]);
        glPixelStorei(unpack_names[i], i == 0 ? 4 : 0);
    }
}

void nb_state_restore_unpacking(const nb_context *c, const nb_unpacking *u)
{
    for (int i = 0; i < unpack_count(c); i++) glPixelStorei(unpack_names[i], u->parameters[i]);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, (GLuint)u->buffer);
    glBindBuffer(GL_UNIFORM_BUFFER, (GLuint)u->uniform_buffer);
    glBindTexture(GL_TEXTURE_2D, (GLuint)u->texture);
    glActiveTexture((GLenum)u->active_unit);
}
