/* The state in which an engine's own draw calls make classic fog: on the attribute stacks where the context has the
 * fixed pipeline, as numbers where it has not. */
#include "gl_state.h"

#include <nebel/gl.h>

#include <math.h>

struct nebel_gl_classic {
    nebel_allocator allocator;
    nebel_log log;
    nebel_gl_classic_kind kind;
    float coordinate_end;
    int is_fixed, version; /* of the context */
    nb_context context;    /* where it is new enough for nb_state; version 0 where it is not */

    /* What begin found. */
    int is_begun;
    nb_blending blending;
    GLint depth_function, coordinate_source;
    GLboolean depth_mask, color_sum;
};

static const char classic_text[] =
    "#ifdef GL_ES\n"
    "precision highp float;\n"
    "#endif\n"
    "vec4 nebel_classic_fog_coord(vec4 surface, float coordinate, float end, vec3 color)\n"
    "{\n"
    "    float factor = clamp((end - coordinate) / end, 0.0, 1.0);\n"
    "    return vec4(factor * surface.rgb + (1.0 - factor) * color, surface.a);\n"
    "}\n"
    "vec4 nebel_classic_alpha(vec3 color, float amount)\n"
    "{\n"
    "    return vec4(color, clamp(amount, 0.0, 1.0));\n"
    "}\n";

const char *nebel_gl_classic_shader_source(void)
{
    return classic_text;
}

static int has_since(const nebel_gl_classic *classic, int version, const char *extension)
{
    return classic->version >= version || nb_context_has(extension);
}

/* ---- making ---------------------------------------------------------------------------------- */

/* OpenGL 3.0 and older always have the fixed pipeline, 3.1 with the extension, from 3.2 on there are profiles. */
static int has_fixed_pipeline(int version)
{
    if (!epoxy_is_desktop_gl()) return 0;
    if (version <= 30) return 1;
    if (version == 31) return nb_context_has("GL_ARB_compatibility");
    return (nb_context_integer(GL_CONTEXT_PROFILE_MASK) & GL_CONTEXT_COMPATIBILITY_PROFILE_BIT) != 0;
}

static nebel_result read_context(const nebel_log *log, nebel_gl_classic *classic)
{
    classic->version = epoxy_gl_version();
    classic->is_fixed = classic->version >= 11 && has_fixed_pipeline(classic->version);
    return classic->is_fixed && classic->version < 33 ? NEBEL_OK : nb_context_read(log, &classic->context);
}

static void choose_kind(nebel_gl_classic *classic)
{
    const int has_coordinates = !classic->is_fixed || has_since(classic, 14, "GL_EXT_fog_coord");
    if (classic->kind != NEBEL_GL_CLASSIC_FOG_COORD || has_coordinates) return;
    classic->kind = NEBEL_GL_CLASSIC_TWO_PASS;
    nb_log_message(
        &classic->log, NEBEL_LOG_WARNING, NEBEL_OK,
        "nebel_create_gl_classic: OpenGL %d.%d (%s) has no fog coordinates (OpenGL 1.4 or GL_EXT_fog_coord); "
        "fog is drawn in two passes instead",
        classic->version / 10, classic->version % 10, (const char *)glGetString(GL_RENDERER));
}

static nebel_result check_desc(const nebel_gl_classic_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->host.allocator) || (unsigned)desc->kind >= NEBEL_GL_CLASSIC_COUNT)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "nebel_create_gl_classic: there is no such kind, or the allocator has one function of two");
    if (!(desc->coordinate_end >= 0 && desc->coordinate_end < HUGE_VAL))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                       "nebel_create_gl_classic: coordinate_end %g must be finite and not negative",
                       desc->coordinate_end);
    return NEBEL_OK;
}

nebel_result nebel_create_gl_classic(const nebel_gl_classic_desc *desc, nebel_gl_classic **classic)
{
    if (classic == NULL) return NEBEL_ERROR_ARGUMENT;
    *classic = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check_desc(desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_gl_classic *const made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "nebel_create_gl_classic: out of memory");
    made->allocator = allocator;
    made->log = desc->host.log;
    made->kind = desc->kind;
    made->coordinate_end = desc->coordinate_end > 0 ? (float)desc->coordinate_end : 100;
    result = read_context(&desc->host.log, made);
    if (result != NEBEL_OK) {
        nb_release(&allocator, made);
        return result;
    }
    choose_kind(made);
    *classic = made;
    return NEBEL_OK;
}

void nebel_destroy_gl_classic(nebel_gl_classic *classic)
{
    if (classic == NULL) return;
    const nebel_allocator allocator = classic->allocator;
    nb_release(&allocator, classic);
}

nebel_gl_classic_kind nebel_gl_get_classic_method(const nebel_gl_classic *classic)
{
    if (classic == NULL) return NEBEL_GL_CLASSIC_FOG_COORD;
    return classic->kind;
}

/* ---- state ----------------------------------------------------------------------------------- */

static const struct {
    GLenum source, target;
} factors[NEBEL_GL_CLASSIC_COUNT] = {
    [NEBEL_GL_CLASSIC_TWO_PASS] = {GL_ONE, GL_ONE_MINUS_SRC_ALPHA},
    [NEBEL_GL_CLASSIC_ADDITIVE] = {GL_ONE, GL_ONE},
    [NEBEL_GL_CLASSIC_ALPHA] = {GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA},
};

static nebel_result fail_classic(const nebel_gl_classic *classic, nebel_result result, const char *what)
{
    return nb_fail(&classic->log, result, "nebel_gl_classic: %s", what);
}

static void switch_textures_off(const nebel_gl_classic *classic)
{
    const int many = has_since(classic, 13, "GL_ARB_multitexture");
    const GLint units = many ? nb_context_integer(GL_MAX_TEXTURE_UNITS) : 1;
    const GLint active = many ? nb_context_integer(GL_ACTIVE_TEXTURE) : 0;
    for (GLint i = 0; i < units; i++) {
        if (many) glActiveTexture((GLenum)(GL_TEXTURE0 + i));
        glDisable(GL_TEXTURE_1D);
        glDisable(GL_TEXTURE_2D);
        if (has_since(classic, 12, "GL_EXT_texture3D")) glDisable(GL_TEXTURE_3D);
        if (has_since(classic, 13, "GL_ARB_texture_cube_map")) glDisable(GL_TEXTURE_CUBE_MAP);
        if (has_since(classic, 31, "GL_ARB_texture_rectangle")) glDisable(GL_TEXTURE_RECTANGLE);
    }
    if (many) glActiveTexture((GLenum)active);
}

static void begin_fog(nebel_gl_classic *classic, const float color[3])
{
    const GLfloat opaque[4] = {color[0], color[1], color[2], 1};
    classic->coordinate_source = nb_context_integer(GL_FOG_COORDINATE_SOURCE);
    glEnable(GL_FOG);
    glFogi(GL_FOG_MODE, GL_LINEAR);
    glFogf(GL_FOG_START, 0);
    glFogf(GL_FOG_END, classic->coordinate_end);
    glFogfv(GL_FOG_COLOR, opaque);
    glFogi(GL_FOG_COORDINATE_SOURCE, GL_FOG_COORDINATE);
}

/* In contexts that have one blend function for all four colours, where a mask keeps alpha. */
static void set_old_blending(const nebel_gl_classic *classic)
{
    GLboolean mask[4];
    glGetBooleanv(GL_COLOR_WRITEMASK, mask);
    glColorMask(mask[0], mask[1], mask[2], GL_FALSE);
    glEnable(GL_BLEND);
    glBlendFunc(factors[classic->kind].source, factors[classic->kind].target);
    if (has_since(classic, 14, "GL_EXT_blend_minmax")) glBlendEquation(GL_FUNC_ADD);
}

static int has_color_sum(const nebel_gl_classic *classic)
{
    return classic->is_fixed && has_since(classic, 14, "GL_EXT_secondary_color");
}

static void set_fixed_pass(const nebel_gl_classic *classic)
{
    glDisable(GL_FOG);
    glDisable(GL_LIGHTING);
    glDisable(GL_ALPHA_TEST);
    glDisable(GL_COLOR_LOGIC_OP);
    if (has_color_sum(classic)) glDisable(GL_COLOR_SUM);
    switch_textures_off(classic);
    glShadeModel(GL_SMOOTH);
}

static int is_full(GLenum depth, GLenum most)
{
    return nb_context_integer(depth) >= nb_context_integer(most);
}

static nebel_result push_fixed(const nebel_gl_classic *classic)
{
    if (is_full(GL_ATTRIB_STACK_DEPTH, GL_MAX_ATTRIB_STACK_DEPTH) ||
        is_full(GL_CLIENT_ATTRIB_STACK_DEPTH, GL_MAX_CLIENT_ATTRIB_STACK_DEPTH))
        return fail_classic(classic, NEBEL_ERROR_LIMIT, "an attribute stack of the context is full; pop before begin");
    glPushAttrib(GL_CURRENT_BIT | GL_ENABLE_BIT | GL_FOG_BIT | GL_COLOR_BUFFER_BIT | GL_LIGHTING_BIT);
    glPushClientAttrib(GL_CLIENT_VERTEX_ARRAY_BIT);
    return NEBEL_OK;
}

static void begin_pass(nebel_gl_classic *classic)
{
    classic->depth_function = nb_context_integer(GL_DEPTH_FUNC);
    glGetBooleanv(GL_DEPTH_WRITEMASK, &classic->depth_mask);
    if (has_color_sum(classic)) classic->color_sum = glIsEnabled(GL_COLOR_SUM);
    glDepthFunc(GL_EQUAL);
    glDepthMask(GL_FALSE);
    if (classic->is_fixed) set_fixed_pass(classic);
    if (classic->context.version == 0) {
        set_old_blending(classic);
    } else {
        nb_blending_save(&classic->context, &classic->blending);
        nb_state_blend(&classic->context, factors[classic->kind].source, factors[classic->kind].target);
    }
}

static void end_pass(const nebel_gl_classic *classic)
{
    glDepthFunc((GLenum)classic->depth_function);
    glDepthMask(classic->depth_mask);
    if (has_color_sum(classic) && classic->color_sum) glEnable(GL_COLOR_SUM);
    if (classic->context.version != 0) nb_blending_restore(&classic->context, &classic->blending);
}

nebel_result nebel_gl_begin_classic_fog(nebel_gl_classic *classic, const float color[3])
{
    nebel_result result = NEBEL_OK;
    if (classic == NULL) return NEBEL_ERROR_ARGUMENT;
    if (classic->is_begun) return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "begin after begin; call end first");
    if (classic->kind == NEBEL_GL_CLASSIC_FOG_COORD && color == NULL)
        return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "fog coordinates need the color of the fog");
    if (classic->is_fixed) result = push_fixed(classic);
    if (result != NEBEL_OK) return result;
    if (classic->kind != NEBEL_GL_CLASSIC_FOG_COORD)
        begin_pass(classic);
    else if (classic->is_fixed)
        begin_fog(classic, color);
    classic->is_begun = 1;
    return NEBEL_OK;
}

/* What Mesa 22 leaves out of its stacks comes behind them: the source of fog coordinates, the colour sum, the blend
 * functions of draw buffers that differ. */
nebel_result nebel_gl_end_classic_fog(nebel_gl_classic *classic)
{
    if (classic == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!classic->is_begun) return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "end without begin");
    classic->is_begun = 0;
    if (classic->is_fixed) {
        glPopClientAttrib();
        glPopAttrib();
    }
    if (classic->kind != NEBEL_GL_CLASSIC_FOG_COORD)
        end_pass(classic);
    else if (classic->is_fixed)
        glFogi(GL_FOG_COORDINATE_SOURCE, classic->coordinate_source);
    return NEBEL_OK;
}

/* ---- streams --------------------------------------------------------------------------------- */

static int fits(nebel_gl_classic_kind kind, nebel_vertex_format format)
{
    switch (kind) {
    case NEBEL_GL_CLASSIC_FOG_COORD:
        return format == NEBEL_VERTEX_COORDINATE;
    case NEBEL_GL_CLASSIC_ALPHA:
        return format == NEBEL_VERTEX_ALPHA;
    default:
        return format == NEBEL_VERTEX_RGBA8 || format == NEBEL_VERTEX_RGBA_FLOAT;
    }
}

static size_t size_of(nebel_vertex_format format)
{
    return format == NEBEL_VERTEX_RGBA_FLOAT ? 4 * sizeof(float) : sizeof(float);
}

static int has_buffers(const nebel_gl_classic *classic)
{
    return has_since(classic, 15, "GL_ARB_vertex_buffer_object");
}

static nebel_result check_stream(const nebel_gl_classic *classic, const nebel_vertex_output *stream, unsigned buffer)
{
    if (!classic->is_fixed)
        return fail_classic(classic, NEBEL_ERROR_UNSUPPORTED,
                            "this context has no fixed pipeline; hand the stream to an attribute of your program");
    if (!classic->is_begun) return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "feed without begin");
    if (stream == NULL || (buffer == 0 && stream->data == NULL))
        return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "the stream has no data");
    if (!fits(classic->kind, stream->format))
        return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "the stream's format is not one of this method");
    if (stream->stride > INT32_MAX || (stream->stride != 0 && stream->stride < size_of(stream->format)))
        return fail_classic(classic, NEBEL_ERROR_ARGUMENT,
                            "the stream's stride is shorter than its format, or too long");
    if (buffer != 0 && !(has_buffers(classic) && glIsBuffer(buffer)))
        return fail_classic(classic, NEBEL_ERROR_ARGUMENT, "there is no buffer of that name");
    if (buffer == 0 && classic->version >= 30 && nb_context_integer(GL_VERTEX_ARRAY_BINDING) != 0)
        return fail_classic(
            classic, NEBEL_ERROR_ARGUMENT,
            "a vertex array object takes no arrays from memory; bind 0, or put the stream into a buffer");
    return NEBEL_OK;
}

static void point(const nebel_vertex_output *stream)
{
    const GLsizei stride = (GLsizei)stream->stride;
    if (stream->format == NEBEL_VERTEX_COORDINATE) {
        glEnableClientState(GL_FOG_COORDINATE_ARRAY);
        glFogCoordPointer(GL_FLOAT, stride, stream->data);
    } else {
        glEnableClientState(GL_COLOR_ARRAY);
        glColorPointer(4, stream->format == NEBEL_VERTEX_RGBA_FLOAT ? GL_FLOAT : GL_UNSIGNED_BYTE, stride,
                       stream->data);
    }
}

nebel_result nebel_gl_bind_classic_stream(nebel_gl_classic *classic, const nebel_vertex_output *stream, unsigned buffer)
{
    if (classic == NULL || stream == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = check_stream(classic, stream, buffer);
    if (result != NEBEL_OK) return result;
    const int binds = has_buffers(classic);
    const GLint bound = binds ? nb_context_integer(GL_ARRAY_BUFFER_BINDING) : 0;
    if (binds) glBindBuffer(GL_ARRAY_BUFFER, buffer);
    point(stream);
    if (binds) glBindBuffer(GL_ARRAY_BUFFER, (GLuint)bound);
    return NEBEL_OK;
}
