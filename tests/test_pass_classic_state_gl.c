#define _POSIX_C_SOURCE 200809L
/* What the methods of classic fog touch, and that it comes back; every way in which a stream is fed; contexts that lack
 * fog coordinates; calls that are wrong. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "classic_help.h"
#include "fog_help.h"
#include "odd_state.h"

#include <epoxy/gl.h>

static classic_mesh mesh;

static nebel_vertex_format format_of(nebel_gl_classic_kind kind)
{
    static const nebel_vertex_format formats[NEBEL_GL_CLASSIC_COUNT] = {
        [NEBEL_GL_CLASSIC_FOG_COORD] = NEBEL_VERTEX_COORDINATE,
        [NEBEL_GL_CLASSIC_TWO_PASS] = NEBEL_VERTEX_RGBA8,
        [NEBEL_GL_CLASSIC_ADDITIVE] = NEBEL_VERTEX_RGBA_FLOAT,
        [NEBEL_GL_CLASSIC_ALPHA] = NEBEL_VERTEX_ALPHA};
    return formats[kind];
}

/* ---- the state of the fixed pipeline --------------------------------------------------------- */

/* Which methods touch a state: 'a' all, 'f' FOG_COORD, 'p' the second passes, '-' none. */
typedef struct fixed_state {
    GLenum name;
    int count;
    char touched;
} fixed_state;

static const fixed_state fixed_numbers[] = {
    {GL_CURRENT_COLOR, 4, '-'},
    {GL_CURRENT_SECONDARY_COLOR, 4, '-'},
    {GL_CURRENT_NORMAL, 3, '-'},
    {GL_CURRENT_FOG_COORDINATE, 1, '-'},
    {GL_FOG_MODE, 1, 'f'},
    {GL_FOG_START, 1, 'f'},
    {GL_FOG_END, 1, 'f'},
    {GL_FOG_DENSITY, 1, '-'},
    {GL_FOG_COLOR, 4, 'f'},
    {GL_FOG_COORDINATE_SOURCE, 1, 'f'},
    {GL_FOG_HINT, 1, '-'},
    {GL_SHADE_MODEL, 1, 'p'},
    {GL_ALPHA_TEST_FUNC, 1, '-'},
    {GL_ALPHA_TEST_REF, 1, '-'},
    {GL_COLOR_MATERIAL_FACE, 1, '-'},
    {GL_COLOR_MATERIAL_PARAMETER, 1, '-'},
    {GL_MATRIX_MODE, 1, '-'},
    {GL_MODELVIEW_MATRIX, 16, '-'},
    {GL_PROJECTION_MATRIX, 16, '-'},
    {GL_MODELVIEW_STACK_DEPTH, 1, '-'},
    {GL_CLIENT_ACTIVE_TEXTURE, 1, '-'},
    {GL_COLOR_ARRAY_SIZE, 1, 'p'},
    {GL_COLOR_ARRAY_TYPE, 1, 'p'},
    {GL_COLOR_ARRAY_STRIDE, 1, 'p'},
    {GL_COLOR_ARRAY_BUFFER_BINDING, 1, 'p'},
    {GL_FOG_COORDINATE_ARRAY_TYPE, 1, '-'},
    {GL_FOG_COORDINATE_ARRAY_STRIDE, 1, 'f'},
    {GL_FOG_COORDINATE_ARRAY_BUFFER_BINDING, 1, 'f'},
    {GL_VERTEX_ARRAY_SIZE, 1, '-'},
    {GL_VERTEX_ARRAY_STRIDE, 1, '-'},
    {GL_VERTEX_ARRAY_BUFFER_BINDING, 1, '-'},
    {GL_BLEND_SRC_RGB, 1, 'p'},
    {GL_BLEND_DST_RGB, 1, 'p'},
    {GL_BLEND_SRC_ALPHA, 1, 'p'},
    {GL_BLEND_DST_ALPHA, 1, 'p'},
    {GL_BLEND_EQUATION_RGB, 1, 'p'},
    {GL_BLEND_EQUATION_ALPHA, 1, 'p'},
    {GL_COLOR_WRITEMASK, 4, 'p'},
    {GL_DEPTH_FUNC, 1, 'p'},
    {GL_DEPTH_WRITEMASK, 1, 'p'},
    {GL_STENCIL_FUNC, 1, '-'},
    {GL_STENCIL_WRITEMASK, 1, '-'},
    {GL_CULL_FACE_MODE, 1, '-'},
    {GL_CURRENT_PROGRAM, 1, '-'},
    {GL_ACTIVE_TEXTURE, 1, '-'},
    {GL_ARRAY_BUFFER_BINDING, 1, '-'},
};

static const fixed_state fixed_switches[] = {
    {GL_FOG, 1, 'a'},
    {GL_LIGHTING, 1, 'p'},
    {GL_LIGHT0, 1, '-'},
    {GL_COLOR_MATERIAL, 1, '-'},
    {GL_NORMALIZE, 1, '-'},
    {GL_ALPHA_TEST, 1, 'p'},
    {GL_COLOR_SUM, 1, 'p'},
    {GL_COLOR_LOGIC_OP, 1, 'p'},
    {GL_BLEND, 1, 'p'},
    {GL_DEPTH_TEST, 1, '-'},
    {GL_STENCIL_TEST, 1, '-'},
    {GL_SCISSOR_TEST, 1, '-'},
    {GL_CULL_FACE, 1, '-'},
    {GL_POLYGON_OFFSET_FILL, 1, '-'},
    {GL_LINE_SMOOTH, 1, '-'},
    {GL_VERTEX_ARRAY, 1, '-'},
    {GL_NORMAL_ARRAY, 1, '-'},
    {GL_TEXTURE_COORD_ARRAY, 1, '-'},
    {GL_SECONDARY_COLOR_ARRAY, 1, '-'},
    {GL_COLOR_ARRAY, 1, 'p'},
    {GL_FOG_COORDINATE_ARRAY, 1, 'f'},
};

static const GLenum texture_switches[] = {GL_TEXTURE_1D,       GL_TEXTURE_2D,        GL_TEXTURE_3D,
                                          GL_TEXTURE_CUBE_MAP, GL_TEXTURE_RECTANGLE, GL_TEXTURE_GEN_S};

enum {
    NUMBERS = sizeof fixed_numbers / sizeof *fixed_numbers,
    SWITCHES = sizeof fixed_switches / sizeof *fixed_switches
};
enum { TEXTURES = sizeof texture_switches / sizeof *texture_switches, UNITS = 4 };

typedef struct fixed_snapshot {
    GLfloat numbers[NUMBERS][16];
    GLboolean switches[SWITCHES], textures[UNITS][TEXTURES];
    const void *color, *coordinate, *positions;
} fixed_snapshot;

static void take_fixed(fixed_snapshot *s)
{
    GLint active;
    memset(s, 0, sizeof *s);
    for (int i = 0; i < NUMBERS; i++) glGetFloatv(fixed_numbers[i].name, s->numbers[i]);
    for (int i = 0; i < SWITCHES; i++) s->switches[i] = glIsEnabled(fixed_switches[i].name);
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
    for (int unit = 0; unit < UNITS; unit++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
        for (int i = 0; i < TEXTURES; i++) s->textures[unit][i] = glIsEnabled(texture_switches[i]);
    }
    glActiveTexture((GLenum)active);
    glGetPointerv(GL_COLOR_ARRAY_POINTER, (GLvoid **)&s->color);
    glGetPointerv(GL_FOG_COORDINATE_ARRAY_POINTER, (GLvoid **)&s->coordinate);
    glGetPointerv(GL_VERTEX_ARRAY_POINTER, (GLvoid **)&s->positions);
}

static int touches(char touched, nebel_gl_classic_kind kind)
{
    return touched == 'a' || touched == (kind == NEBEL_GL_CLASSIC_FOG_COORD ? 'f' : 'p');
}

/* Between begin and end: nothing changes that the header does not name. */
static void expect_only_named(const fixed_snapshot *before, const fixed_snapshot *during, nebel_gl_classic_kind kind)
{
    for (int i = 0; i < NUMBERS; i++) {
        const int same = memcmp(before->numbers[i], during->numbers[i], sizeof before->numbers[i]) == 0;
        if (!same && !touches(fixed_numbers[i].touched, kind)) fail_msg("0x%x has changed", fixed_numbers[i].name);
    }
    for (int i = 0; i < SWITCHES; i++) {
        const int same = before->switches[i] == during->switches[i];
        if (!same && !touches(fixed_switches[i].touched, kind)) fail_msg("0x%x has changed", fixed_switches[i].name);
    }
    for (int unit = 0; unit < UNITS; unit++) {
        for (int i = 0; i < TEXTURES - 1; i++) {
            const int wanted = kind == NEBEL_GL_CLASSIC_FOG_COORD && before->textures[unit][i];
            assert_int_equal(during->textures[unit][i], wanted);
        }
    }
    assert_true(during->positions == before->positions);
}

/* Everything that a second pass must not have. */
static void set_old_state(void)
{
    const GLfloat color[4] = {.9f, .8f, .7f, .6f};
    glEnable(GL_FOG);
    glFogi(GL_FOG_MODE, GL_EXP2);
    glFogf(GL_FOG_DENSITY, .3f);
    glFogf(GL_FOG_START, 5);
    glFogf(GL_FOG_END, 6);
    glFogfv(GL_FOG_COLOR, color);
    glColor4fv(color);
    glSecondaryColor3f(.25f, .5f, .75f);
    glFogCoordf(3);
    for (int i = 1; i < SWITCHES - 6; i++) glEnable(fixed_switches[i].name);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_CULL_FACE);
    glDisable(GL_COLOR_LOGIC_OP);
    glLogicOp(GL_XOR);
    glAlphaFunc(GL_NEVER, .5f);
    glStencilFunc(GL_ALWAYS, 1, 2);
    glShadeModel(GL_FLAT);
    glBlendFuncSeparate(GL_DST_COLOR, GL_ONE_MINUS_DST_ALPHA, GL_ZERO, GL_SRC_ALPHA);
    glBlendEquationSeparate(GL_FUNC_REVERSE_SUBTRACT, GL_MIN);
    glDepthFunc(GL_LEQUAL);
    for (int unit = 0; unit < UNITS; unit++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
        glEnable(unit % 2 ? GL_TEXTURE_2D : GL_TEXTURE_3D);
        glEnable(GL_TEXTURE_1D);
    }
    glActiveTexture(GL_TEXTURE2);
    glClientActiveTexture(GL_TEXTURE1);
}

static void use(nebel_gl_classic_kind kind, fixed_snapshot *during)
{
    const float color[3] = {.1f, .2f, .3f};
    const nebel_vertex_output stream = classic_stream(&mesh, format_of(kind));
    nebel_gl_classic *const classic = classic_create(kind);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, color), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    take_fixed(during);
    classic_draw_positions(&mesh);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
}

static void test_named_state_alone_changes_and_comes_back(void **state)
{
    (void)state;
    static fixed_snapshot before, during, after;
    for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        classic_stage stage;
        classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA8, &mesh);
        classic_set_mesh(&mesh);
        for (int old = 0; old < 2; old++) {
            if (old) set_old_state();
            take_fixed(&before);
            use((nebel_gl_classic_kind)kind, &during);
            take_fixed(&after);
            expect_only_named(&before, &during, (nebel_gl_classic_kind)kind);
            assert_memory_equal(&before, &after, sizeof before);
        }
        assert_true(glIsEnabled(GL_FOG));
        classic_end(&stage);
    }
}

/* The pixels of a second pass are the same whatever the engine had set. The first pass is drawn before. */
static void test_old_state_does_not_show_in_second_passes(void **state)
{
    (void)state;
    static classic_image plain, old;
    static fixed_snapshot during;
    for (int kind = NEBEL_GL_CLASSIC_TWO_PASS; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        classic_stage stage;
        classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
        for (int turn = 0; turn < 2; turn++) {
            classic_clear();
            classic_set_mesh(&mesh);
            classic_draw_plain(&mesh);
            if (turn) set_old_state();
            use((nebel_gl_classic_kind)kind, &during);
            classic_read(turn ? &old : &plain);
        }
        assert_memory_equal(&plain, &old, sizeof plain);
        classic_end(&stage);
    }
}

/* All that newer contexts have, beside. */
static void check_odd_state(nb_gl_language language)
{
    static odd_snapshot before, after;
    const int desktop = language != NB_GL_300ES;
    for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        for (int on = 0; on < 2; on++) {
            nb_gl context;
            odd o;
            classic_open(&context, language);
            const classic_target target = classic_make_target(GL_RGBA8);
            odd_set(&o, desktop, on);
            odd_take(&before, desktop);
            nebel_gl_classic *const classic = classic_create((nebel_gl_classic_kind)kind);
            assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
            if (kind != NEBEL_GL_CLASSIC_FOG_COORD) {
                GLint function;
                glGetIntegerv(GL_DEPTH_FUNC, &function);
                assert_true(function == GL_EQUAL && glIsEnabled(GL_BLEND));
            }
            assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
            nebel_destroy_gl_classic(classic);
            odd_take(&after, desktop);
            odd_expect_same(&before, &after);
            odd_delete(&o);
            classic_delete_target(&target);
            pass_close(&context);
        }
    }
}

static void test_odd_state_comes_back(void **state)
{
    (void)state;
    check_odd_state(NB_GL_330);
    check_odd_state(NB_GL_300ES);
    check_odd_state(NB_GL_COMPATIBILITY);
}

/* ---- streams --------------------------------------------------------------------------------- */

typedef enum feeding { INTERLEAVED, PACKED, INTERLEAVED_BUFFER, PACKED_BUFFER, IMMEDIATE, FEEDINGS } feeding;

static size_t size_of(nebel_vertex_format format)
{
    return format == NEBEL_VERTEX_RGBA_FLOAT ? 16 : 4;
}

static unsigned make_buffer(const void *data, size_t size)
{
    unsigned name;
    glGenBuffers(1, &name);
    glBindBuffer(GL_ARRAY_BUFFER, name);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)size, data, GL_STATIC_DRAW);
    glBindBuffer(GL_ARRAY_BUFFER, 0);
    return name;
}

static void draw_immediate(nebel_vertex_format format)
{
    glBegin(GL_TRIANGLES);
    for (int i = 0; i < CLASSIC_INDICES; i++) {
        const classic_vertex *const v = &mesh.vertices[mesh.indices[i]];
        if (format == NEBEL_VERTEX_COORDINATE) glFogCoordf(v->coordinate), glColor4fv(v->color);
        if (format == NEBEL_VERTEX_RGBA_FLOAT) glColor4fv(v->light);
        if (format == NEBEL_VERTEX_RGBA8) glColor4ubv(v->bytes);
        if (format == NEBEL_VERTEX_ALPHA) glColor4ubv(v->alpha);
        glVertex3fv(v->place);
    }
    glEnd();
}

/* The stream in the layout of a feeding, drawn within begin and end. */
static void draw_fed(nebel_gl_classic *classic, nebel_vertex_format format, feeding how)
{
    static unsigned char packed[CLASSIC_VERTICES][16];
    const size_t size = size_of(format);
    nebel_vertex_output stream = classic_stream(&mesh, format);
    const size_t offset = (size_t)((const char *)stream.data - (const char *)mesh.vertices);
    unsigned buffer = 0;
    for (size_t i = 0; i < CLASSIC_VERTICES; i++)
        memcpy(&packed[0][0] + i * size, (const char *)stream.data + i * stream.stride, size);
    if (how == PACKED || how == PACKED_BUFFER) stream = (nebel_vertex_output){format, packed, 0};
    if (how == INTERLEAVED_BUFFER) {
        buffer = make_buffer(mesh.vertices, sizeof mesh.vertices);
        stream.data = (void *)(uintptr_t)offset;
    }
    if (how == PACKED_BUFFER) {
        buffer = make_buffer(packed, CLASSIC_VERTICES * size);
        stream.data = NULL;
    }
    if (how != IMMEDIATE) assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, buffer), NEBEL_OK);
    if (how == IMMEDIATE)
        draw_immediate(format);
    else if (format == NEBEL_VERTEX_COORDINATE)
        classic_draw_plain(&mesh);
    else
        classic_draw_positions(&mesh);
    glDeleteBuffers(1, &buffer);
}

static void draw_feeding(nebel_vertex_format format, nebel_gl_classic_kind kind, feeding how, classic_image *image)
{
    nebel_gl_classic *const classic = classic_create(kind);
    classic_clear();
    classic_set_mesh(&mesh);
    if (kind != NEBEL_GL_CLASSIC_FOG_COORD) classic_draw_plain(&mesh);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
    draw_fed(classic, format, how);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
    classic_read(image);
}

/* Mesa makes floats of glColor4ubv with other bits than of an array of bytes. */
static void test_every_feeding_draws_the_same_bits(void **state)
{
    (void)state;
    static classic_image first, other;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        draw_feeding(format_of((nebel_gl_classic_kind)kind), (nebel_gl_classic_kind)kind, INTERLEAVED, &first);
        for (int how = PACKED; how < FEEDINGS; how++) {
            draw_feeding(format_of((nebel_gl_classic_kind)kind), (nebel_gl_classic_kind)kind, (feeding)how, &other);
            if (how != IMMEDIATE) assert_memory_equal(&first, &other, sizeof first);
            assert_true(classic_compare(&first, &other) <= 1e-6);
        }
    }
    classic_end(&stage);
}

/* Several meshes within one begin: each feed holds until the next. */
static void test_a_feed_replaces_the_last(void **state)
{
    (void)state;
    static classic_image right, refed;
    static classic_mesh other;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    classic_draw(NEBEL_GL_CLASSIC_TWO_PASS, &mesh, NEBEL_VERTEX_RGBA8, 0);
    classic_read(&right);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_TWO_PASS);
    const nebel_vertex_output nothing = classic_stream(&other, NEBEL_VERTEX_RGBA8);
    const nebel_vertex_output stream = classic_stream(&mesh, NEBEL_VERTEX_RGBA_FLOAT);
    const nebel_vertex_output bytes = classic_stream(&mesh, NEBEL_VERTEX_RGBA8);
    classic_clear();
    classic_draw_plain(&mesh);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, NULL), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &nothing, 0), NEBEL_OK);
    classic_draw_positions(&mesh);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &bytes, 0), NEBEL_OK);
    classic_draw_positions(&mesh);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    classic_read(&refed);
    assert_memory_equal(&right, &refed, sizeof right);
    nebel_destroy_gl_classic(classic);
    classic_end(&stage);
}

/* ---- contexts -------------------------------------------------------------------------------- */

/* Two passes in a context that has no function for alpha alone and no blending by buffer. 0: all is well. */
static int draw_in_old_context(nebel_gl_classic *classic)
{
    static classic_image surface, fogged;
    const nebel_vertex_output stream = classic_stream(&mesh, NEBEL_VERTEX_RGBA8);
    GLboolean mask[4];
    GLint factor, function;
    classic_clear();
    classic_set_mesh(&mesh);
    classic_draw_plain(&mesh);
    classic_read(&surface);
    if (nebel_gl_begin_classic_fog(classic, NULL) != NEBEL_OK) return 10;
    if (nebel_gl_bind_classic_stream(classic, &stream, 0) != NEBEL_OK) return 11;
    classic_draw_positions(&mesh);
    if (nebel_gl_end_classic_fog(classic) != NEBEL_OK || glGetError() != GL_NO_ERROR) return 12;
    classic_read(&fogged);
    glGetBooleanv(GL_COLOR_WRITEMASK, mask);
    glGetIntegerv(GL_BLEND_DST, &factor);
    glGetIntegerv(GL_DEPTH_FUNC, &function);
    if (!mask[3] || glIsEnabled(GL_BLEND) || glIsEnabled(GL_COLOR_ARRAY)) return 13;
    if (factor != GL_ZERO || function != GL_LESS) return 14;
    return classic_compare(&surface, &fogged) > .1 && classic_compare_alpha(&surface, &fogged) == 0 ? 0 : 15;
}

/* OpenGL 1.3 without GL_EXT_fog_coord, for which Mesa's environment asks in a process of its own. */
static int draw_without_fog_coordinates(void)
{
    nb_gl context;
    fog_messages messages = {0};
    nebel_gl_classic *classic = NULL;
    if (!nb_gl_open(&context, NB_GL_COMPATIBILITY)) return 2;
    if (epoxy_gl_version() != 13 || epoxy_has_gl_extension("GL_EXT_fog_coord")) return 3;
    const nebel_gl_classic_desc desc = {.host.log = fog_messages_log(&messages)};
    if (nebel_create_gl_classic(&desc, &classic) != NEBEL_OK) return 4;
    if (nebel_gl_get_classic_method(classic) != NEBEL_GL_CLASSIC_TWO_PASS) return 5;
    if (messages.count != 1 || strstr(messages.text, "two passes") == NULL) return 6;
    const classic_target target = classic_make_target(GL_RGBA8);
    classic_make_mesh(&mesh);
    const int fault = draw_in_old_context(classic);
    nebel_destroy_gl_classic(classic);
    classic_delete_target(&target);
    nb_gl_close(&context);
    return fault;
}

static const char without[] = "--without-fog-coordinates";

static void test_without_fog_coordinates_there_are_two_passes(void **state)
{
    (void)state;
    nb_gl context;
    int status = 0;
    classic_open(&context, NB_GL_COMPATIBILITY);
    pass_close(&context);
    const pid_t child = fork();
    if (child == 0) {
        setenv("MESA_GL_VERSION_OVERRIDE", "1.3COMPAT", 1);
        setenv("MESA_EXTENSION_OVERRIDE", "-GL_EXT_fog_coord", 1);
        execl("/proc/self/exe", "nebel_test_gl", "test_pass_classic_state_gl", without, (char *)NULL);
        _exit(99);
    }
    assert_true(child > 0 && waitpid(child, &status, 0) == child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void test_without_a_context_nothing_is_made(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl_classic *classic = (nebel_gl_classic *)&context;
    fog_messages messages = {0};
    classic_open(&context, NB_GL_COMPATIBILITY);
    pass_close(&context);
    const nebel_gl_classic_desc desc = {.host.log = fog_messages_log(&messages)};
    assert_int_equal(nebel_create_gl_classic(&desc, &classic), NEBEL_ERROR_UNSUPPORTED);
    assert_true(classic == NULL && messages.count == 1);
}

/* ---- calls that are wrong -------------------------------------------------------------------- */

static void test_descriptions_that_are_none_are_refused(void **state)
{
    (void)state;
    nb_gl context;
    fog_memory memory = {.fail_first = 1, .fail_count = 1};
    nebel_gl_classic *classic = NULL;
    const nebel_gl_classic_desc kind = {.kind = NEBEL_GL_CLASSIC_COUNT}, negative = {.coordinate_end = -1},
                                endless = {.coordinate_end = HUGE_VAL},
                                full = {.host.allocator = fog_memory_allocator(&memory)},
                                half = {.host.allocator = {fog_memory_allocate, NULL, NULL}};
    classic_open(&context, NB_GL_COMPATIBILITY);
    assert_int_equal(nebel_create_gl_classic(NULL, &classic), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl_classic(&kind, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl_classic(&kind, &classic), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl_classic(&half, &classic), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl_classic(&negative, &classic), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_create_gl_classic(&endless, &classic), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_create_gl_classic(&full, &classic), NEBEL_ERROR_MEMORY);
    assert_null(classic);
    assert_int_equal(nebel_create_gl_classic(&full, &classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
    assert_int_equal(memory.live, 0);
    nebel_destroy_gl_classic(NULL);
    pass_close(&context);
}

static void test_streams_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    nb_gl context;
    unsigned array;
    classic_open(&context, NB_GL_COMPATIBILITY);
    classic_make_mesh(&mesh);
    for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        nebel_gl_classic *const classic = classic_create((nebel_gl_classic_kind)kind);
        const nebel_vertex_output good = classic_stream(&mesh, format_of((nebel_gl_classic_kind)kind));
        nebel_vertex_output bad = good;
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &good, 0), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
        assert_int_equal(nebel_gl_bind_classic_stream(classic, NULL, 0), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &good, 9999), NEBEL_ERROR_ARGUMENT);
        bad.data = NULL;
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &bad, 0), NEBEL_ERROR_ARGUMENT);
        bad = (nebel_vertex_output){NEBEL_VERTEX_SPECULAR_ALPHA, mesh.vertices, 0};
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &bad, 0), NEBEL_ERROR_ARGUMENT);
        bad = (nebel_vertex_output){good.format, good.data, size_of(good.format) - 1};
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &bad, 0), NEBEL_ERROR_ARGUMENT);
        bad.stride = (size_t)INT32_MAX + 1;
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &bad, 0), NEBEL_ERROR_ARGUMENT);
        glGenVertexArrays(1, &array);
        glBindVertexArray(array);
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &good, 0), NEBEL_ERROR_ARGUMENT);
        glBindVertexArray(0);
        glDeleteVertexArrays(1, &array);
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &good, 0), NEBEL_OK);
        assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
        nebel_destroy_gl_classic(classic);
    }
    pass_close(&context);
}

static void test_begin_and_end_come_in_pairs(void **state)
{
    (void)state;
    static fixed_snapshot before, after;
    nb_gl context;
    GLint depth;
    classic_open(&context, NB_GL_COMPATIBILITY);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_FOG_COORD);
    take_fixed(&before);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, NULL), NEBEL_ERROR_ARGUMENT);
    glGetIntegerv(GL_MAX_ATTRIB_STACK_DEPTH, &depth);
    for (int i = 0; i < depth; i++) glPushAttrib(GL_FOG_BIT);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_ERROR_LIMIT);
    glPopAttrib();
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_ERROR_ARGUMENT);
    for (int i = 1; i < depth; i++) glPopAttrib();
    take_fixed(&after);
    assert_memory_equal(&before, &after, sizeof before);
    assert_int_equal(nebel_gl_begin_classic_fog(NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_bind_classic_stream(NULL, NULL, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_end_classic_fog(NULL), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_gl_classic(classic);
    pass_close(&context);
}

static void test_without_a_fixed_pipeline_nothing_is_fed(void **state)
{
    (void)state;
    nb_gl context;
    classic_make_mesh(&mesh);
    const nebel_vertex_output stream = classic_stream(&mesh, NEBEL_VERTEX_RGBA8);
    classic_open(&context, NB_GL_330);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_TWO_PASS);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, NULL), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_ERROR_UNSUPPORTED);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
    pass_close(&context);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_named_state_alone_changes_and_comes_back),
        cmocka_unit_test(test_old_state_does_not_show_in_second_passes),
        cmocka_unit_test(test_odd_state_comes_back),
        cmocka_unit_test(test_every_feeding_draws_the_same_bits),
        cmocka_unit_test(test_a_feed_replaces_the_last),
        cmocka_unit_test(test_without_fog_coordinates_there_are_two_passes),
        cmocka_unit_test(test_without_a_context_nothing_is_made),
        cmocka_unit_test(test_descriptions_that_are_none_are_refused),
        cmocka_unit_test(test_streams_that_do_not_fit_are_refused),
        cmocka_unit_test(test_begin_and_end_come_in_pairs),
        cmocka_unit_test(test_without_a_fixed_pipeline_nothing_is_fed),
    };
    if (argc == 2 && strcmp(argv[1], without) == 0) return draw_without_fog_coordinates();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
