#include "gl_scene_state.h"

#include "scene_programs.h"

/* Which contexts know a switch. */
typedef enum nb_scene_capability { SCENE_EVERYWHERE, SCENE_DESKTOP, SCENE_FIXED_INDEX } nb_scene_capability;

static const struct {
    GLenum name;
    nb_scene_capability known;
} scene_switches[] = {
    {GL_POLYGON_OFFSET_FILL, SCENE_EVERYWHERE},
    {GL_DEPTH_CLAMP, SCENE_DESKTOP},
    {GL_PRIMITIVE_RESTART_FIXED_INDEX, SCENE_FIXED_INDEX},
};
enum { SCENE_SWITCHES = sizeof scene_switches / sizeof *scene_switches, FIRST_UNIT = NB_STATE_UNITS };

static const GLenum array_units[NB_SCENE_ARRAYS] = {GL_TEXTURE0 + NB_UNIT_SHADOWS, GL_TEXTURE0 + NB_UNIT_SHADE,
                                                    GL_TEXTURE0 + NB_UNIT_VEIL, GL_TEXTURE0 + NB_UNIT_LIGHT_MAPS};

/* The last two are of OpenGL alone. */
static const GLenum pack_names[NB_SCENE_PACK] = {GL_PACK_ALIGNMENT,   GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS,
                                                 GL_PACK_SKIP_PIXELS, GL_PACK_SWAP_BYTES, GL_PACK_LSB_FIRST};

static int knows_scene_switch(const nb_context *c, nb_scene_capability known)
{
    switch (known) {
    case SCENE_DESKTOP:
        return !c->es;
    case SCENE_FIXED_INDEX:
        return c->es || c->version >= 43;
    default:
        return 1;
    }
}

static int has_clip_control(const nb_context *c)
{
    return c->es ? epoxy_has_gl_extension("GL_EXT_clip_control")
                 : c->version >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control");
}

static void set_clip_control(const nb_context *c, GLenum origin, GLenum depth)
{
    if (c->es) {
        glClipControlEXT(origin, depth);
    } else {
        glClipControl(origin, depth);
    }
}

static int pack_count(const nb_context *c)
{
    return c->es ? NB_SCENE_PACK - 2 : NB_SCENE_PACK;
}

/* ---- reading --------------------------------------------------------------------------------- */

static void save_scene_units(nb_scene_state *s)
{
    for (int i = 0; i < NB_SCENE_UNITS; i++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + FIRST_UNIT + i));
        glGetIntegerv(GL_TEXTURE_BINDING_2D, &s->textures[i]);
        glGetIntegerv(GL_SAMPLER_BINDING, &s->samplers[i]);
    }
    for (int i = 0; i < NB_SCENE_ARRAYS; i++) {
        glActiveTexture(array_units[i]);
        glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &s->array_textures[i]);
    }
}

static void save_buffers(const nb_context *c, nb_scene_state *s)
{
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &s->read_framebuffer);
    glGetIntegerv(GL_ARRAY_BUFFER_BINDING, &s->array_buffer);
    glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &s->pack_buffer);
    for (int i = 0; i < pack_count(c); i++) glGetIntegerv(pack_names[i], &s->pack[i]);
    if (!c->es) glGetIntegerv(GL_CLAMP_READ_COLOR, &s->clamp_read);
}

static void save_depth(const nb_context *c, nb_scene_state *s)
{
    glGetIntegerv(GL_DEPTH_FUNC, &s->depth_function);
    glGetBooleanv(GL_DEPTH_WRITEMASK, &s->depth_mask);
    glGetFloatv(GL_DEPTH_RANGE, s->depth_range);
    s->switches = 0;
    for (unsigned i = 0; i < SCENE_SWITCHES; i++) {
        if (knows_scene_switch(c, scene_switches[i].known) && glIsEnabled(scene_switches[i].name))
            s->switches |= 1u << i;
    }
    if (!c->es) glGetIntegerv(GL_PROVOKING_VERTEX, &s->provoking_vertex);
    if (has_clip_control(c)) {
        glGetIntegerv(GL_CLIP_ORIGIN, &s->clip_control[0]);
        glGetIntegerv(GL_CLIP_DEPTH_MODE, &s->clip_control[1]);
    }
}

/* ---- setting --------------------------------------------------------------------------------- */

static void set_scene_switches(const nb_context *c, uint32_t on)
{
    for (unsigned i = 0; i < SCENE_SWITCHES; i++) {
        if (knows_scene_switch(c, scene_switches[i].known)) nb_state_switch(scene_switches[i].name, on >> i & 1);
    }
}

static void set_depth_range(const nb_context *c, const GLfloat range[2])
{
    if (c->viewport_arrays) {
        glDepthRangeIndexed(0, (GLdouble)range[0], (GLdouble)range[1]);
    } else {
        glDepthRangef(range[0], range[1]);
    }
}

void nb_scene_state_enter(const nb_context *c, nb_scene_state *s)
{
    const GLfloat range[2] = {0, 1};
    nb_state_save(c, &s->base);
    save_scene_units(s);
    save_buffers(c, s);
    save_depth(c, s);
    nb_state_save_unpacking(c, &s->unpacking);
    for (GLuint i = 0; i < NB_SCENE_UNITS; i++) glBindSampler((GLuint)FIRST_UNIT + i, 0);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    for (int i = 0; i < pack_count(c); i++) glPixelStorei(pack_names[i], i == 0 ? 4 : 0);
    if (!c->es) glClampColor(GL_CLAMP_READ_COLOR, GL_FALSE);
    set_scene_switches(c, 0);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    set_depth_range(c, range);
    if (!c->es) glProvokingVertex(GL_LAST_VERTEX_CONVENTION);
    if (has_clip_control(c)) set_clip_control(c, GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
}

static void restore_scene_units(const nb_scene_state *s)
{
    for (int i = 0; i < NB_SCENE_UNITS; i++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + FIRST_UNIT + i));
        glBindTexture(GL_TEXTURE_2D, (GLuint)s->textures[i]);
        glBindSampler((GLuint)(FIRST_UNIT + i), (GLuint)s->samplers[i]);
    }
    for (int i = 0; i < NB_SCENE_ARRAYS; i++) {
        glActiveTexture(array_units[i]);
        glBindTexture(GL_TEXTURE_2D_ARRAY, (GLuint)s->array_textures[i]);
    }
}

static void restore_buffers(const nb_context *c, const nb_scene_state *s)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)s->read_framebuffer);
    glBindBuffer(GL_ARRAY_BUFFER, (GLuint)s->array_buffer);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, (GLuint)s->pack_buffer);
    for (int i = 0; i < pack_count(c); i++) glPixelStorei(pack_names[i], s->pack[i]);
    if (!c->es) glClampColor(GL_CLAMP_READ_COLOR, (GLenum)s->clamp_read);
}

void nb_scene_state_leave(const nb_context *c, const nb_scene_state *s)
{
    set_scene_switches(c, s->switches);
    glDepthFunc((GLenum)s->depth_function);
    glDepthMask(s->depth_mask);
    set_depth_range(c, s->depth_range);
    if (!c->es) glProvokingVertex((GLenum)s->provoking_vertex);
    if (has_clip_control(c)) set_clip_control(c, (GLenum)s->clip_control[0], (GLenum)s->clip_control[1]);
    nb_state_restore_unpacking(c, &s->unpacking);
    restore_scene_units(s);
    nb_state_restore(c, &s->base);
    restore_buffers(c, s);
}
