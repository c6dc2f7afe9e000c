/* What the scene renderer cannot do is said, with what to do; nothing is left behind, and the host's state is as it
 * was. Where this machine's driver is too good to fail, one of its functions is replaced. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "odd_state.h"
#include "pass_help.h"
#include "test_render_scene.h"

#include <epoxy/gl.h>
#include <nebel/gl.h>

#include "gl_errors.h"

/* ---- a stage --------------------------------------------------------------------------------- */

enum { TEXELS = 4, PARTICLES = 5 };

typedef struct stage {
    nb_gl context;
    nb_gl_language language;
    test_ball ball;
    uint8_t texels[4 * TEXELS * TEXELS];
    nebel_texture texture;
    nebel_particle particles[PARTICLES];
    nebel_lighting *fog;
    nebel_gl_renderer *renderer;
    int objects;
    odd_snapshot before;
} stage;

static nebel_result create(stage *s, fog_memory *memory)
{
    nebel_gl_renderer_desc desc = {.host.log = fog_messages_log(&messages)};
    if (memory != NULL) desc.host.allocator = fog_memory_allocator(memory);
    return nebel_create_gl_renderer(&s->ball.scene, s->fog, &desc, &s->renderer);
}

static void open_stage(stage *s, nb_gl_language language)
{
    const nebel_volume_desc volumes[] = {{.extinction = {.02, .03, .04}, .source = {.5, .6, .7}}};
    s->language = language;
    test_ball_make(&s->ball, (double[3]){0, 0, 0});
    s->texture = (nebel_texture){TEXELS, TEXELS, s->texels};
    s->ball.meshes[1].uvs = test_square_uvs;
    s->ball.meshes[1].texture = 0;
    s->ball.scene.texture_count = 1;
    s->ball.scene.textures = &s->texture;
    for (int i = 0; i < PARTICLES; i++)
        s->particles[i] = (nebel_particle){.center = {.3 * i, .5, 0}, .radius = .4, .extinction = {1, 1, 1}};
    s->fog = test_fog(1, volumes);
    messages.count = 0;
    pass_open(&s->context, language);
    s->objects = pass_count_objects();
}

/* After what went wrong: nothing of it is left. */
static void expect_nothing_left(stage *s)
{
    static odd_snapshot after;
    nebel_destroy_gl_renderer(s->renderer);
    s->renderer = NULL;
    assert_int_equal(pass_count_objects(), s->objects);
    odd_take(&after, s->language == NB_GL_330);
    odd_expect_same(&s->before, &after);
}

static void start(stage *s, nb_gl_language language)
{
    open_stage(s, language);
    odd_take(&s->before, language == NB_GL_330);
}

static void start_with_renderer(stage *s, nb_gl_language language)
{
    start(s, language);
    assert_int_equal(create(s, NULL), NEBEL_OK);
    assert_int_equal(nebel_set_gl_renderer_particles(s->renderer, s->particles, PARTICLES), NEBEL_OK);
    messages.count = 0;
}

static void end(stage *s)
{
    expect_nothing_left(s);
    nebel_release_lighting(s->fog);
    pass_close(&s->context);
}

static nebel_result draw(stage *s, uint32_t width, uint32_t samples)
{
    const nebel_gl_frame_desc desc = {
        .camera = test_camera(3, 2, 5, 0, 0, 0), .width = width, .height = 24, .samples = samples};
    return nebel_gl_render_frame(s->renderer, &desc);
}

/* All around, with fog at vertices and without. */
static nebel_result draw_round(stage *s)
{
    nebel_gl_frame_desc desc = {.camera = test_camera(3, 2, 5, 0, 0, 0),
                                .width = 32,
                                .height = 16,
                                .samples = 1,
                                .method = NEBEL_GL_METHOD_VERTEX};
    desc.camera.projection = NEBEL_PROJECTION_PANORAMA;
    const nebel_result result = nebel_gl_render_frame(s->renderer, &desc);
    desc.method = NEBEL_GL_METHOD_EXACT;
    return result == NEBEL_OK ? nebel_gl_render_frame(s->renderer, &desc) : result;
}

static nebel_result draw_all(stage *s)
{
    const nebel_result result = draw(s, 32, 1);
    return result == NEBEL_OK ? draw_round(s) : result;
}

/* ---- contexts -------------------------------------------------------------------------------- */

static const char *version_text, *hidden;
static PFNGLGETSTRINGPROC true_get_string;
static PFNGLGETSTRINGIPROC true_get_stringi;

static const GLubyte *EPOXY_CALLSPEC fake_get_string(GLenum name)
{
    return name == GL_VERSION && version_text != NULL ? (const GLubyte *)version_text : true_get_string(name);
}

static const GLubyte *EPOXY_CALLSPEC hide_extension(GLenum name, GLuint index)
{
    const GLubyte *const text = true_get_stringi(name, index);
    return strcmp((const char *)text, hidden) == 0 ? (const GLubyte *)"GL_hidden" : text;
}

static void pretend(const char *version, const char *without)
{
    (void)glGetString(GL_VENDOR);
    (void)glGetStringi(GL_EXTENSIONS, 0);
    version_text = version;
    hidden = without;
    true_get_string = epoxy_glGetString;
    true_get_stringi = epoxy_glGetStringi;
    epoxy_glGetString = fake_get_string;
    epoxy_glGetStringi = hide_extension;
}

static void stop_pretending(void)
{
    epoxy_glGetString = true_get_string;
    epoxy_glGetStringi = true_get_stringi;
}

static void test_contexts_that_are_not_enough(void **state)
{
    (void)state;
    static stage s;
    const nebel_scene_data empty = {0};
    nebel_gl_renderer_desc desc = {.host.log = fog_messages_log(&messages)};
    messages.count = 0;
    expect_message(nebel_create_gl_renderer(&empty, NULL, &desc, &s.renderer), NEBEL_ERROR_UNSUPPORTED,
                   "no context is current");
    start(&s, NB_GL_330);
    pretend("3.2 Old Driver", "none");
    const nebel_result old = create(&s, NULL);
    stop_pretending();
    expect_message(old, NEBEL_ERROR_UNSUPPORTED, "needed is OpenGL 3.3");
    end(&s);
}

static void test_extensions_that_are_missing(void **state)
{
    (void)state;
    static stage s;
    start(&s, NB_GL_300ES);
    pretend("OpenGL ES 3.0 Small Driver", "GL_EXT_color_buffer_float");
    const nebel_result floats = create(&s, NULL);
    stop_pretending();
    expect_message(floats, NEBEL_ERROR_UNSUPPORTED, "GL_EXT_color_buffer_float");
    assert_int_equal(create(&s, NULL), NEBEL_OK);
    pretend(NULL, "GL_EXT_float_blend");
    const nebel_result particles = nebel_set_gl_renderer_particles(s.renderer, s.particles, PARTICLES);
    expect_message(particles, NEBEL_ERROR_UNSUPPORTED, "GL_EXT_float_blend");
    expect_message(draw(&s, 32, 2), NEBEL_ERROR_UNSUPPORTED, "GL_EXT_float_blend");
    assert_int_equal(draw(&s, 32, 1), NEBEL_OK);
    stop_pretending();
    end(&s);
}

static nebel_result draw_narrow(stage *s, nebel_projection projection, double size)
{
    nebel_gl_frame_desc desc = {.camera = test_camera(3, 2, 5, 0, 0, 0), .width = 32, .height = 24, .samples = 1};
    desc.camera.projection = projection;
    desc.camera.view_height = desc.camera.vertical_fov = size;
    return nebel_gl_render_frame(s->renderer, &desc);
}

/* Of them triangles would vanish, and outlines of fog go astray; fog everywhere has none. */
static void test_views_that_are_too_narrow(void **state)
{
    (void)state;
    static stage s;
    start(&s, NB_GL_330);
    assert_int_equal(create(&s, NULL), NEBEL_OK);
    expect_message(draw_narrow(&s, NEBEL_PROJECTION_ORTHOGRAPHIC, 1e-8), NEBEL_ERROR_LIMIT, "view_height is 1e-08 m");
    expect_message(draw_narrow(&s, NEBEL_PROJECTION_PERSPECTIVE, 1e-8), NEBEL_ERROR_LIMIT, "vertical_fov is 1e-08 deg");
    assert_int_equal(draw_narrow(&s, NEBEL_PROJECTION_ORTHOGRAPHIC, 1e-3), NEBEL_OK);
    assert_int_equal(draw_narrow(&s, NEBEL_PROJECTION_PERSPECTIVE, 1.2e-3), NEBEL_OK);
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1}, .extinction = {2, 2, 2}};
    nebel_lighting *const fog = test_fog(1, &ball);
    assert_int_equal(nebel_set_gl_renderer_lighting(s.renderer, fog), NEBEL_OK);
    expect_message(draw_narrow(&s, NEBEL_PROJECTION_PERSPECTIVE, 1.4e-2), NEBEL_ERROR_LIMIT,
                   "make vertical_fov at least 0.0154");
    assert_int_equal(draw_narrow(&s, NEBEL_PROJECTION_PERSPECTIVE, 1.6e-2), NEBEL_OK);
    nebel_release_lighting(fog);
    end(&s);
}

/* The test deletes what the renderer must leave alone. */
static void test_a_lost_context_is_survived(void **state)
{
    (void)state;
    static stage s;
    static float depth[32 * 24];
    start_with_renderer(&s, NB_GL_330);
    assert_int_equal(draw(&s, 32, 1), NEBEL_OK);
    const PFNGLISVERTEXARRAYPROC true_is = epoxy_glIsVertexArray;
    epoxy_glIsVertexArray = is_nothing;
    expect_message(draw(&s, 32, 1), NEBEL_ERROR_UNSUPPORTED, "lost");
    expect_message(nebel_gl_read_planes(s.renderer, &(nebel_gl_planes){.depth = depth}), NEBEL_ERROR_ARGUMENT,
                   "no frame was drawn");
    nebel_destroy_gl_renderer(s.renderer);
    epoxy_glIsVertexArray = true_is;
    nebel_release_lighting(s.fog);
    pass_close(&s.context);
}

/* ---- what is not drawn ----------------------------------------------------------------------- */

static nebel_lighting *commit_sunlit_box(double x, double y)
{
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {x, y, -1}, .max = {x + 1, y + 1, 1}},
                                   .extinction = {1, 1, 1},
                                   .albedo = {1, 1, 1}};
    const nebel_lighting_desc lights = {.sun = {{0, 1, 0}, {3, 3, 3}}};
    return fog_light(&lights, &box, 1);
}

/* Draws twice: what is said is said once. word NULL: nothing is. */
static void expect_said(stage *s, double x, double y, const char *word)
{
    nebel_lighting *const fog = commit_sunlit_box(x, y);
    messages.count = 0;
    assert_int_equal(nebel_set_gl_renderer_lighting(s->renderer, fog), NEBEL_OK);
    for (int i = 0; i < 2; i++) assert_int_equal(draw(s, 32, 1), NEBEL_OK);
    assert_int_equal(messages.count, word != NULL);
    if (word != NULL && strstr(messages.text, word) == NULL) fail_msg("it says: %s", messages.text);
    nebel_release_lighting(fog);
}

/* Fog under particles, beside them and above; a point light. */
static void test_shadows_of_particles_are_missed(void **state)
{
    (void)state;
    static stage s;
    const nebel_light light = {.position = {0, 3, 0}, .intensity = {1, 1, 1}};
    start_with_renderer(&s, NB_GL_330);
    expect_said(&s, 0, -2, "light of the sun from fog");
    expect_said(&s, 9, -2, NULL);
    expect_said(&s, 0, 2, NULL);
    s.ball.scene.lights = &light;
    s.ball.scene.light_count = 1;
    expect_said(&s, 9, -2, "light of point lights");
    for (int i = 0; i < PARTICLES; i++) memset(s.particles[i].extinction, 0, sizeof s.particles[i].extinction);
    assert_int_equal(nebel_set_gl_renderer_particles(s.renderer, s.particles, PARTICLES), NEBEL_OK);
    expect_said(&s, 0, -2, NULL);
    s.ball.scene.light_count = 0;
    end(&s);
}

/* ---- drivers that fail ----------------------------------------------------------------------- */

static PFNGLSHADERSOURCEPROC true_shader_source;
static int spared; /* shaders, before one is spoiled */

static void EPOXY_CALLSPEC spoil_source(GLuint shader, GLsizei count, const GLchar *const *texts, const GLint *lengths)
{
    const GLchar *const text = "#version 330 core\nvoid main() { no_such_function(); }\n";
    if (spared-- > 0) {
        true_shader_source(shader, count, texts, lengths);
    } else {
        true_shader_source(shader, 1, &text, NULL);
    }
}

/* Whichever of the shaders it is. */
static void test_shaders_that_the_driver_refuses(void **state)
{
    (void)state;
    static stage s;
    int refused = 0;
    start_with_renderer(&s, NB_GL_330);
    assert_int_equal(draw(&s, 32, 1), NEBEL_OK);
    expect_nothing_left(&s);
    true_shader_source = epoxy_glShaderSource;
    for (nebel_result result = NEBEL_ERROR_UNSUPPORTED; result != NEBEL_OK; refused++) {
        spared = refused;
        epoxy_glShaderSource = spoil_source;
        result = create(&s, NULL);
        if (result == NEBEL_OK) result = nebel_set_gl_renderer_particles(s.renderer, s.particles, PARTICLES);
        if (result == NEBEL_OK) result = draw_all(&s);
        epoxy_glShaderSource = true_shader_source;
        if (result != NEBEL_OK) expect_message(result, NEBEL_ERROR_UNSUPPORTED, "no_such_function");
        assert_int_equal(pass_take_errors(), result != NEBEL_OK);
        expect_nothing_left(&s);
        assert_true(refused < 100);
    }
    print_message("%d shaders, each refused once\n", refused - 1);
    assert_true(refused > 8);
    end(&s);
}

static void test_pictures_that_do_not_fit(void **state)
{
    (void)state;
    static stage s;
    GLint widest = 0;
    start(&s, NB_GL_330);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &widest);
    true_get_integer = epoxy_glGetIntegerv;
    epoxy_glGetIntegerv = narrow_textures;
    const nebel_result texture = create(&s, NULL);
    epoxy_glGetIntegerv = true_get_integer;
    expect_message(texture, NEBEL_ERROR_LIMIT, "4 x 4");
    assert_int_equal(create(&s, NULL), NEBEL_OK);
    expect_message(draw(&s, (uint32_t)widest + 1, 1), NEBEL_ERROR_LIMIT, "The CPU renders larger pictures");
    expect_message(draw(&s, 0, 1), NEBEL_ERROR_VALUE, "0 x 24 pixels");
    for (int i = 0; i < 5; i++) {
        nebel_particle bad = {.radius = 1};
        if (i == 0) bad.center[2] = (double)NAN;
        if (i == 1) bad.radius = -1;
        if (i == 2) bad.extinction[1] = -.1;
        if (i == 3) bad.emission[0] = (double)NAN;
        if (i == 4) bad.radius = 0;
        expect_message(nebel_set_gl_renderer_particles(s.renderer, &bad, 1), NEBEL_ERROR_VALUE, "particle 0");
    }
    const nebel_gl_frame_desc late = {.camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}, .vertical_fov = 50},
                                      .width = 1,
                                      .height = 1,
                                      .time = (double)NAN};
    expect_message(nebel_gl_render_frame(s.renderer, &late), NEBEL_ERROR_VALUE, "time is nan");
    assert_int_equal(draw(&s, 1, 1), NEBEL_OK);
    end(&s);
}

static PFNGLGETERRORPROC true_get_error;
static int errors_left; /* that are none */

static GLenum EPOXY_CALLSPEC run_out(void)
{
    return errors_left-- == 0 ? GL_OUT_OF_MEMORY : true_get_error();
}

/* Wherever the driver is asked. */
static void test_a_driver_without_memory(void **state)
{
    (void)state;
    static stage s;
    int failures = 0;
    start(&s, NB_GL_330);
    (void)glGetError();
    true_get_error = epoxy_glGetError;
    for (nebel_result result = NEBEL_ERROR_MEMORY; result != NEBEL_OK; failures++) {
        errors_left = failures;
        epoxy_glGetError = run_out;
        result = create(&s, NULL);
        if (result == NEBEL_OK) result = nebel_set_gl_renderer_particles(s.renderer, s.particles, PARTICLES);
        if (result == NEBEL_OK) result = draw_all(&s);
        epoxy_glGetError = true_get_error;
        if (result != NEBEL_OK) expect_message(result, NEBEL_ERROR_MEMORY, "no memory for");
        if (s.renderer != NULL) assert_int_equal(draw_all(&s), NEBEL_OK);
        expect_nothing_left(&s);
        assert_true(failures < 100);
    }
    print_message("out of memory at %d places\n", failures - 1);
    assert_true(failures > 4);
    end(&s);
}

static PFNGLMAPBUFFERRANGEPROC true_map;
static int maps_left; /* that work */

static void *EPOXY_CALLSPEC refuse_map(GLenum target, GLintptr offset, GLsizeiptr length, GLbitfield access)
{
    return maps_left-- == 0 ? NULL : true_map(target, offset, length, access);
}

/* Each buffer in turn; the next frame is whole again. */
static void test_a_driver_that_maps_nothing(void **state)
{
    (void)state;
    static stage s;
    int failures = 0;
    start(&s, NB_GL_330);
    assert_int_equal(create(&s, NULL), NEBEL_OK);
    assert_int_equal(draw_all(&s), NEBEL_OK);
    expect_nothing_left(&s);
    true_map = epoxy_glMapBufferRange;
    for (nebel_result result = NEBEL_ERROR_MEMORY; result != NEBEL_OK; failures++) {
        assert_int_equal(create(&s, NULL), NEBEL_OK);
        maps_left = failures;
        epoxy_glMapBufferRange = refuse_map;
        result = draw_round(&s);
        epoxy_glMapBufferRange = true_map;
        if (result != NEBEL_OK) expect_message(result, NEBEL_ERROR_MEMORY, "no access to the");
        assert_int_equal(draw_round(&s), NEBEL_OK);
        expect_nothing_left(&s);
        assert_true(failures < 100);
    }
    print_message("no access at %d places\n", failures - 1);
    assert_true(failures > 4);
    end(&s);
}

/* ---- memory ---------------------------------------------------------------------------------- */

static nebel_result use_all(stage *s, fog_memory *memory)
{
    static float depth[32 * 24];
    nebel_result result = create(s, memory);
    if (result == NEBEL_OK) result = nebel_set_gl_renderer_particles(s->renderer, s->particles, PARTICLES);
    if (result == NEBEL_OK) result = draw(s, 32, 2);
    if (result == NEBEL_OK) result = draw_round(s);
    if (result == NEBEL_OK) result = nebel_gl_read_planes(s->renderer, &(nebel_gl_planes){.depth = depth});
    return result;
}

static void test_memory_that_runs_out(void **state)
{
    (void)state;
    static stage s;
    size_t calls = 0;
    start(&s, NB_GL_330);
    for (nebel_result result = NEBEL_ERROR_MEMORY; result != NEBEL_OK; calls++) {
        fog_memory memory = {.fail_first = calls + 1, .fail_count = 1};
        result = use_all(&s, &memory);
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        expect_nothing_left(&s);
        assert_int_equal(memory.live, 0);
    }
    print_message("%zu allocations, each failed once\n", calls - 1);
    assert_true(calls > 10);
    end(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contexts_that_are_not_enough),    cmocka_unit_test(test_extensions_that_are_missing),
        cmocka_unit_test(test_a_lost_context_is_survived),      cmocka_unit_test(test_shaders_that_the_driver_refuses),
        cmocka_unit_test(test_pictures_that_do_not_fit),        cmocka_unit_test(test_a_driver_without_memory),
        cmocka_unit_test(test_a_driver_that_maps_nothing),      cmocka_unit_test(test_memory_that_runs_out),
        cmocka_unit_test(test_shadows_of_particles_are_missed), cmocka_unit_test(test_views_that_are_too_narrow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
