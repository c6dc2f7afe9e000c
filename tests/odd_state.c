#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "odd_state.h"
#include "pass_help.h"

#include <epoxy/gl.h>

enum { BUFFERS = 4, BLOCKS = 3 };

/* ---- what glGet tells ------------------------------------------------------------------------ */

/* `count` numbers; `kind`: e everywhere, d OpenGL alone. */
static const struct {
    GLenum name;
    int count;
    char kind;
} numbers[] = {
    {GL_CURRENT_PROGRAM, 1, 'e'},
    {GL_VERTEX_ARRAY_BINDING, 1, 'e'},
    {GL_ARRAY_BUFFER_BINDING, 1, 'e'},
    {GL_ELEMENT_ARRAY_BUFFER_BINDING, 1, 'e'},
    {GL_ACTIVE_TEXTURE, 1, 'e'},
    {GL_UNIFORM_BUFFER_BINDING, 1, 'e'},
    {GL_PIXEL_PACK_BUFFER_BINDING, 1, 'e'},
    {GL_PIXEL_UNPACK_BUFFER_BINDING, 1, 'e'},
    {GL_COPY_READ_BUFFER_BINDING, 1, 'e'},
    {GL_COPY_WRITE_BUFFER_BINDING, 1, 'e'},
    {GL_TRANSFORM_FEEDBACK_BUFFER_BINDING, 1, 'e'},
    {GL_DRAW_FRAMEBUFFER_BINDING, 1, 'e'},
    {GL_READ_FRAMEBUFFER_BINDING, 1, 'e'},
    {GL_RENDERBUFFER_BINDING, 1, 'e'},
    {GL_READ_BUFFER, 1, 'e'},
    {GL_DRAW_BUFFER0, 1, 'e'},
    {GL_DRAW_BUFFER1, 1, 'e'},
    {GL_VIEWPORT, 4, 'e'},
    {GL_SCISSOR_BOX, 4, 'e'},
    {GL_DEPTH_RANGE, 2, 'e'},
    {GL_CULL_FACE_MODE, 1, 'e'},
    {GL_FRONT_FACE, 1, 'e'},
    {GL_LINE_WIDTH, 1, 'e'},
    {GL_POLYGON_OFFSET_FACTOR, 1, 'e'},
    {GL_POLYGON_OFFSET_UNITS, 1, 'e'},
    {GL_SAMPLE_COVERAGE_VALUE, 1, 'e'},
    {GL_SAMPLE_COVERAGE_INVERT, 1, 'e'},
    {GL_STENCIL_FUNC, 1, 'e'},
    {GL_STENCIL_REF, 1, 'e'},
    {GL_STENCIL_VALUE_MASK, 1, 'e'},
    {GL_STENCIL_WRITEMASK, 1, 'e'},
    {GL_STENCIL_BACK_FUNC, 1, 'e'},
    {GL_STENCIL_BACK_WRITEMASK, 1, 'e'},
    {GL_STENCIL_FAIL, 1, 'e'},
    {GL_STENCIL_PASS_DEPTH_PASS, 1, 'e'},
    {GL_DEPTH_FUNC, 1, 'e'},
    {GL_DEPTH_WRITEMASK, 1, 'e'},
    {GL_COLOR_WRITEMASK, 4, 'e'},
    {GL_BLEND_SRC_RGB, 1, 'e'},
    {GL_BLEND_DST_RGB, 1, 'e'},
    {GL_BLEND_SRC_ALPHA, 1, 'e'},
    {GL_BLEND_DST_ALPHA, 1, 'e'},
    {GL_BLEND_EQUATION_RGB, 1, 'e'},
    {GL_BLEND_EQUATION_ALPHA, 1, 'e'},
    {GL_BLEND_COLOR, 4, 'e'},
    {GL_COLOR_CLEAR_VALUE, 4, 'e'},
    {GL_DEPTH_CLEAR_VALUE, 1, 'e'},
    {GL_STENCIL_CLEAR_VALUE, 1, 'e'},
    {GL_UNPACK_ALIGNMENT, 1, 'e'},
    {GL_UNPACK_ROW_LENGTH, 1, 'e'},
    {GL_UNPACK_SKIP_ROWS, 1, 'e'},
    {GL_UNPACK_SKIP_PIXELS, 1, 'e'},
    {GL_UNPACK_IMAGE_HEIGHT, 1, 'e'},
    {GL_UNPACK_SKIP_IMAGES, 1, 'e'},
    {GL_PACK_ALIGNMENT, 1, 'e'},
    {GL_PACK_ROW_LENGTH, 1, 'e'},
    {GL_PACK_SKIP_ROWS, 1, 'e'},
    {GL_PACK_SKIP_PIXELS, 1, 'e'},
    {GL_PACK_SWAP_BYTES, 1, 'd'},
    {GL_PACK_LSB_FIRST, 1, 'd'},
    {GL_CLIP_ORIGIN, 1, 'd'},
    {GL_CLIP_DEPTH_MODE, 1, 'd'},
    {GL_GENERATE_MIPMAP_HINT, 1, 'e'},
    {GL_UNPACK_SWAP_BYTES, 1, 'd'},
    {GL_UNPACK_LSB_FIRST, 1, 'd'},
    {GL_POLYGON_MODE, 1, 'd'},
    {GL_LOGIC_OP_MODE, 1, 'd'},
    {GL_POINT_SIZE, 1, 'd'},
    {GL_PROVOKING_VERTEX, 1, 'd'},
    {GL_CLAMP_READ_COLOR, 1, 'd'},
    {GL_PRIMITIVE_RESTART_INDEX, 1, 'd'},
    {GL_PROGRAM_PIPELINE_BINDING, 1, 'e'},
    {GL_TRANSFORM_FEEDBACK_BINDING, 1, 'e'},
    {GL_TRANSFORM_FEEDBACK_ACTIVE, 1, 'e'},
    {GL_TRANSFORM_FEEDBACK_PAUSED, 1, 'e'},
    {GL_DRAW_INDIRECT_BUFFER_BINDING, 1, 'e'},
    {GL_SHADER_STORAGE_BUFFER_BINDING, 1, 'e'},
    {GL_MIN_SAMPLE_SHADING_VALUE, 1, 'd'},
    {GL_PATCH_VERTICES, 1, 'd'},
    {GL_SAMPLE_MASK_VALUE, 1, 'i'},
};

static const struct {
    GLenum name;
    char kind;
} switches[] = {
    {GL_BLEND, 'e'},
    {GL_CULL_FACE, 'e'},
    {GL_DEPTH_TEST, 'e'},
    {GL_DITHER, 'e'},
    {GL_POLYGON_OFFSET_FILL, 'e'},
    {GL_PRIMITIVE_RESTART_FIXED_INDEX, 'e'},
    {GL_RASTERIZER_DISCARD, 'e'},
    {GL_SAMPLE_ALPHA_TO_COVERAGE, 'e'},
    {GL_SAMPLE_COVERAGE, 'e'},
    {GL_SCISSOR_TEST, 'e'},
    {GL_STENCIL_TEST, 'e'},
    {GL_SAMPLE_MASK, 'e'},
    {GL_SAMPLE_ALPHA_TO_ONE, 'd'},
    {GL_COLOR_LOGIC_OP, 'd'},
    {GL_POLYGON_SMOOTH, 'd'},
    {GL_LINE_SMOOTH, 'd'},
    {GL_MULTISAMPLE, 'd'},
    {GL_DEPTH_CLAMP, 'd'},
    {GL_FRAMEBUFFER_SRGB, 'd'},
    {GL_PROGRAM_POINT_SIZE, 'd'},
    {GL_PRIMITIVE_RESTART, 'd'},
    {GL_TEXTURE_CUBE_MAP_SEAMLESS, 'd'},
    {GL_SAMPLE_SHADING, 'd'},
    {GL_CLIP_DISTANCE0, 'd'},
    {GL_CLIP_DISTANCE0 + 1, 'd'},
    {GL_CLIP_DISTANCE0 + 5, 'd'},
};

/* The last two are of OpenGL alone. */
static const GLenum textures[] = {GL_TEXTURE_BINDING_2D,       GL_TEXTURE_BINDING_3D,
                                  GL_TEXTURE_BINDING_CUBE_MAP, GL_TEXTURE_BINDING_2D_ARRAY,
                                  GL_SAMPLER_BINDING,          GL_TEXTURE_BINDING_2D_MULTISAMPLE,
                                  GL_TEXTURE_BINDING_1D,       GL_TEXTURE_BINDING_RECTANGLE};

static void add(odd_snapshot *s, GLenum name, int index, double value)
{
    assert_true(s->count < ODD_MOST);
    snprintf(s->labels[s->count], sizeof s->labels[0], "0x%x [%d]", name, index);
    s->values[s->count++] = value;
}

static void take_numbers(odd_snapshot *s, int desktop)
{
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        GLfloat values[4] = {0};
        GLint bits = 0;
        if (numbers[i].kind == 'd' && !desktop) continue;
        if (numbers[i].kind == 'i') {
            glGetIntegeri_v(numbers[i].name, 0, &bits);
            values[0] = (GLfloat)bits;
        } else {
            glGetFloatv(numbers[i].name, values);
        }
        for (int k = 0; k < numbers[i].count; k++) add(s, numbers[i].name, k, (double)values[k]);
    }
    for (size_t i = 0; i < sizeof switches / sizeof *switches; i++) {
        if (switches[i].kind == 'e' || desktop) add(s, switches[i].name, 0, glIsEnabled(switches[i].name));
    }
}

static void take_units(odd_snapshot *s, int desktop)
{
    GLint active;
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
    for (int unit = 0; unit < ODD_UNITS; unit++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
        for (size_t i = 0; i < sizeof textures / sizeof *textures - (desktop ? 0 : 2); i++) {
            GLint name = 0;
            glGetIntegerv(textures[i], &name);
            add(s, textures[i], unit, name);
            add(s, textures[i], unit, name);
        }
    }
    glActiveTexture((GLenum)active);
}

static void take_viewport(odd_snapshot *s, GLuint i)
{
    GLfloat viewport[4];
    GLdouble depths[2];
    GLint box[4];
    glGetFloati_v(GL_VIEWPORT, i, viewport);
    glGetDoublei_v(GL_DEPTH_RANGE, i, depths);
    glGetIntegeri_v(GL_SCISSOR_BOX, i, box);
    for (int k = 0; k < 4; k++) add(s, GL_VIEWPORT, (int)i * 4 + k, (double)viewport[k]);
    for (int k = 0; k < 2; k++) add(s, GL_DEPTH_RANGE, (int)i * 2 + k, depths[k]);
    for (int k = 0; k < 4; k++) add(s, GL_SCISSOR_BOX, (int)i * 4 + k, box[k]);
    add(s, GL_SCISSOR_TEST, (int)i, glIsEnabledi(GL_SCISSOR_TEST, i));
}

static void take_buffers(odd_snapshot *s, int desktop)
{
    const GLenum blending[] = {GL_BLEND_SRC_RGB,   GL_BLEND_DST_RGB,      GL_BLEND_SRC_ALPHA,
                               GL_BLEND_DST_ALPHA, GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA};
    for (GLuint i = 0; i < BUFFERS; i++) {
        GLboolean mask[4];
        glGetBooleani_v(GL_COLOR_WRITEMASK, i, mask);
        for (int c = 0; c < 4; c++) add(s, GL_COLOR_WRITEMASK, (int)i * 4 + c, mask[c]);
        add(s, GL_BLEND, (int)i, glIsEnabledi(GL_BLEND, i));
        for (int k = 0; k < 6; k++) {
            GLint value = 0;
            glGetIntegeri_v(blending[k], i, &value);
            add(s, blending[k], (int)i, value);
        }
    }
    for (GLuint i = 0; i < BLOCKS; i++) {
        GLint name = 0;
        GLint64 start = 0, size = 0;
        glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, i, &name);
        glGetInteger64i_v(GL_UNIFORM_BUFFER_START, i, &start);
        glGetInteger64i_v(GL_UNIFORM_BUFFER_SIZE, i, &size);
        add(s, GL_UNIFORM_BUFFER_BINDING, (int)i, name);
        add(s, GL_UNIFORM_BUFFER_START, (int)i, (double)start);
        add(s, GL_UNIFORM_BUFFER_SIZE, (int)i, (double)size);
    }
    for (GLuint i = 0; i < 16 && desktop; i++) take_viewport(s, i);
}

void odd_take(odd_snapshot *s, int desktop)
{
    s->count = 0;
    take_numbers(s, desktop);
    take_units(s, desktop);
    take_buffers(s, desktop);
    pass_expect_no_errors();
}

void odd_expect_same(const odd_snapshot *before, const odd_snapshot *after)
{
    assert_int_equal(before->count, after->count);
    for (int i = 0; i < before->count; i++) {
        if (before->values[i] == after->values[i]) continue;
        fail_msg("%s was %g, is %g", before->labels[i], before->values[i], after->values[i]);
    }
}

/* ---- odd state ------------------------------------------------------------------------------- */

static GLuint make_program(int desktop)
{
    const char *const vertex = desktop ? "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n"
                                       : "#version 300 es\nvoid main() { gl_Position = vec4(0.0); }\n";
    const char *const fragment = desktop ? "#version 330 core\nout vec4 c; void main() { c = vec4(0.0); }\n"
                                         : "#version 300 es\nout highp vec4 c; void main() { c = vec4(0.0); }\n";
    const GLuint program = glCreateProgram(),
                 shaders[] = {glCreateShader(GL_VERTEX_SHADER), glCreateShader(GL_FRAGMENT_SHADER)};
    glShaderSource(shaders[0], 1, &vertex, NULL);
    glShaderSource(shaders[1], 1, &fragment, NULL);
    for (int i = 0; i < 2; i++) {
        glCompileShader(shaders[i]);
        glAttachShader(program, shaders[i]);
        glDeleteShader(shaders[i]);
    }
    glLinkProgram(program);
    return program;
}

static void bind_odd_textures(odd *o, int desktop)
{
    const GLenum targets[] = {GL_TEXTURE_2D, GL_TEXTURE_3D, GL_TEXTURE_CUBE_MAP, GL_TEXTURE_2D_ARRAY,
                              GL_TEXTURE_2D_MULTISAMPLE};
    glGenSamplers(ODD_UNITS, o->samplers);
    for (int unit = 0; unit < ODD_UNITS; unit++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
        glGenTextures(5, o->textures[unit]);
        for (int i = 0; i < 4 + desktop; i++) glBindTexture(targets[i], o->textures[unit][i]);
        glBindSampler((GLuint)unit, o->samplers[unit]);
        glSamplerParameteri(o->samplers[unit], GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        glSamplerParameteri(o->samplers[unit], GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    }
    glActiveTexture(GL_TEXTURE3);
}

static void bind_odd_buffers(odd *o)
{
    glGenBuffers(4, o->buffers);
    for (int i = 0; i < 4; i++) {
        glBindBuffer(GL_UNIFORM_BUFFER, o->buffers[i]);
        glBufferData(GL_UNIFORM_BUFFER, 4096, NULL, GL_STATIC_DRAW);
    }
    glBindBufferRange(GL_UNIFORM_BUFFER, 0, o->buffers[0], 256, 512);
    glBindBufferBase(GL_UNIFORM_BUFFER, 1, o->buffers[1]);
    glBindBuffer(GL_UNIFORM_BUFFER, o->buffers[2]);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, o->buffers[3]);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, o->buffers[3]);
    glBindBuffer(GL_ARRAY_BUFFER, o->buffers[0]);
    glBindBuffer(GL_COPY_READ_BUFFER, o->buffers[1]);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 8);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 77);
    glPixelStorei(GL_UNPACK_SKIP_ROWS, 3);
    glPixelStorei(GL_UNPACK_SKIP_PIXELS, 5);
    glPixelStorei(GL_UNPACK_IMAGE_HEIGHT, 9);
    glPixelStorei(GL_UNPACK_SKIP_IMAGES, 2);
    glPixelStorei(GL_PACK_ALIGNMENT, 8);
    glPixelStorei(GL_PACK_ROW_LENGTH, 99);
    glPixelStorei(GL_PACK_SKIP_ROWS, 2);
    glPixelStorei(GL_PACK_SKIP_PIXELS, 7);
}

/* Whatever could keep a fragment away, does. */
static void set_odd_fragments(void)
{
    glViewport(3, 4, 5, 6);
    glScissor(1, 1, 2, 2);
    glDepthFunc(GL_NEVER);
    glDepthMask(GL_FALSE);
    glDepthRangef(.75f, .25f);
    glPolygonOffset(3, 1000);
    glStencilFunc(GL_NEVER, 1, 2);
    glCullFace(GL_FRONT_AND_BACK);
    glSampleCoverage(.25f, GL_TRUE);
    glSampleMaski(0, 0x55);
    glColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_FALSE);
    glColorMaski(1, GL_FALSE, GL_FALSE, GL_TRUE, GL_FALSE);
    glBlendFuncSeparate(GL_DST_COLOR, GL_ONE_MINUS_DST_ALPHA, GL_ZERO, GL_SRC_ALPHA);
    glBlendFuncSeparatei(1, GL_ZERO, GL_ZERO, GL_ONE, GL_DST_ALPHA);
    glBlendFuncSeparatei(2, GL_ONE, GL_ONE, GL_ZERO, GL_ONE);
    glBlendEquationSeparate(GL_FUNC_REVERSE_SUBTRACT, GL_MIN);
    glBlendEquationSeparatei(1, GL_MAX, GL_FUNC_SUBTRACT);
    glBlendColor(.1f, .2f, .3f, .4f);
}

static void set_odd_switches(int desktop, int on)
{
    for (size_t i = 0; i < sizeof switches / sizeof *switches; i++) {
        if (switches[i].kind == 'd' && !desktop) continue;
        if (on) {
            glEnable(switches[i].name);
        } else {
            glDisable(switches[i].name);
        }
    }
    glDisablei(GL_BLEND, 1);
}

static void set_odd_desktop(void)
{
    const GLfloat viewport[4] = {7.5f, 8.25f, 9, 10};
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glLogicOp(GL_CLEAR);
    glProvokingVertex(GL_FIRST_VERTEX_CONVENTION);
    glPrimitiveRestartIndex(1);
    glPixelStorei(GL_PACK_SWAP_BYTES, GL_TRUE);
    glPixelStorei(GL_UNPACK_SWAP_BYTES, GL_TRUE);
    glPixelStorei(GL_UNPACK_LSB_FIRST, GL_TRUE);
    glClampColor(GL_CLAMP_READ_COLOR, GL_TRUE);
    glMinSampleShading(.5f);
    glPatchParameteri(GL_PATCH_VERTICES, 7);
    glViewportIndexedfv(1, viewport);
    glDepthRangeIndexed(1, .5, .125);
    glScissorIndexed(1, 5, 6, 7, 8);
    glDisablei(GL_SCISSOR_TEST, 2);
}

/* A program pipeline counts where there is no program. */
static void bind_odd_programs(odd *o, int desktop, int on)
{
    o->program = make_program(desktop);
    glUseProgram(on ? o->program : 0);
    glGenProgramPipelines(1, &o->pipeline);
    glBindProgramPipeline(o->pipeline);
}

void odd_set(odd *o, int desktop, int on)
{
    glGenVertexArrays(1, &o->array);
    glBindVertexArray(o->array);
    bind_odd_programs(o, desktop, on);
    bind_odd_textures(o, desktop);
    bind_odd_buffers(o);
    set_odd_fragments();
    set_odd_switches(desktop, on);
    if (desktop) set_odd_desktop();
}

void odd_plain_reading(int desktop)
{
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    glPixelStorei(GL_PACK_SKIP_ROWS, 0);
    glPixelStorei(GL_PACK_SKIP_PIXELS, 0);
    if (desktop) glPixelStorei(GL_PACK_SWAP_BYTES, GL_FALSE);
}

/* ---- one thing alone ------------------------------------------------------------------------- */

static void set_usual_masks(void)
{
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glViewport(0, 0, PASS_WIDTH, PASS_HEIGHT);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

static int is_on_at_first(GLenum name)
{
    return name == GL_DITHER || name == GL_MULTISAMPLE;
}

static void set_switch(GLenum name, int on)
{
    if (on) {
        glEnable(name);
    } else {
        glDisable(name);
    }
}

void odd_prepare(void)
{
    set_odd_fragments();
    set_odd_desktop();
    set_usual_masks();
    odd_plain_reading(1);
    glPixelStorei(GL_UNPACK_SWAP_BYTES, GL_FALSE);
    glPixelStorei(GL_UNPACK_LSB_FIRST, GL_FALSE);
    glClampColor(GL_CLAMP_READ_COLOR, GL_FALSE);
    for (size_t i = 0; i < sizeof switches / sizeof *switches; i++) {
        set_switch(switches[i].name, is_on_at_first(switches[i].name));
    }
}

static const char *set_mask_alone(int which)
{
    switch (which) {
    case 0:
        glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
        return "the color mask";
    case 1:
        glColorMaski(1, GL_FALSE, GL_TRUE, GL_FALSE, GL_TRUE);
        return "the color mask of draw buffer 1";
    case 2:
        glViewport(3, 4, 5, 6);
        return "the viewport";
    case 3:
        glPolygonMode(GL_FRONT_AND_BACK, GL_POINT);
        return "the polygon mode";
    default:
        return "";
    }
}

const char *odd_set_alone(int which, int on)
{
    static char name[32];
    const int count = sizeof switches / sizeof *switches;
    set_usual_masks();
    if (which >= count) return on ? set_mask_alone(which - count) : "";
    set_switch(switches[which].name, on != is_on_at_first(switches[which].name));
    snprintf(name, sizeof name, "switch 0x%x", switches[which].name);
    return name;
}

void odd_delete(odd *o)
{
    for (int unit = 0; unit < ODD_UNITS; unit++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
        glDeleteTextures(5, o->textures[unit]);
    }
    glDeleteSamplers(ODD_UNITS, o->samplers);
    glDeleteBuffers(4, o->buffers);
    glDeleteVertexArrays(1, &o->array);
    glUseProgram(0);
    glDeleteProgram(o->program);
    glDeleteProgramPipelines(1, &o->pipeline);
}
