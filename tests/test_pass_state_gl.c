/* The passes leave all state of OpenGL as they found it: everything is set to odd values, every function is called, and
 * what glGet tells before and after must be the same. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "odd_state.h"
#include "pass_help.h"

#include <epoxy/gl.h>

/* ---- tests ----------------------------------------------------------------------------------- */

typedef struct outcome {
    float first[4 * PASS_PIXELS], second[4 * PASS_PIXELS];
} outcome;

/* So that tests of depth and stencil have something to test. */
static GLuint attach_depth_and_stencil(void)
{
    GLuint name;
    glGenRenderbuffers(1, &name);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH24_STENCIL8, PASS_WIDTH, PASS_HEIGHT);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, name);
    return name;
}

/* All functions, in the state as it is, between two snapshots of it. */
static void use_all(nebel_gl *gl, nebel_lighting *fog, const pass_picture *picture, unsigned depth, unsigned color,
                    const unsigned targets[2], nebel_gl_output output, int desktop)
{
    static odd_snapshot before, after;
    nebel_gl *made = NULL;
    const nebel_gl_pass pass = {.output = output, .depth_texture = depth, .color_texture = color};
    const nebel_gl_pass wrong = {.output = output, .depth_texture = 9999, .color_texture = color};
    const unsigned framebuffer = pass_framebuffer(targets[0], output == NEBEL_GL_OUTPUT_SPLIT ? targets[1] : 0);
    const GLuint tested = attach_depth_and_stencil();
    odd_take(&before, desktop);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &made), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture->view), NEBEL_OK);
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    assert_int_equal(nebel_gl_draw_fog(gl, &wrong), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_gl(made);
    odd_take(&after, desktop);
    odd_expect_same(&before, &after);
    pass_delete_framebuffer(framebuffer);
    glDeleteRenderbuffers(1, &tested);
}

/* What a pass draws in a state. */
static void draw_in(nebel_gl *gl, nebel_lighting *fog, int desktop, int odd_state, nebel_gl_output output, outcome *out)
{
    static float color_texels[4 * PASS_PIXELS];
    odd o;
    pass_picture picture = {.view = pass_view(PERSPECTIVE, (range){-1, 0}, .3, -.1), .clip = {-1, 0}};
    pass_fill(&picture);
    for (int i = 0; i < 4 * PASS_PIXELS; i++) color_texels[i] = (float)(i % 7) / 7;
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture.stored);
    const unsigned color = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, color_texels);
    const unsigned targets[2] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, color_texels),
                                 pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, color_texels)};
    if (odd_state >= 0) odd_set(&o, desktop, odd_state);
    use_all(gl, fog, &picture, depth, color, targets, output, desktop);
    if (odd_state >= 0) odd_delete(&o);
    if (odd_state >= 0) odd_plain_reading(desktop);
    pass_read(targets[0], PASS_WIDTH, PASS_HEIGHT, out->first);
    pass_read(targets[1], PASS_WIDTH, PASS_HEIGHT, out->second);
    pass_delete_texture(depth);
    pass_delete_texture(color);
    for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
}

/* In a context of its own, because odd state is not taken back. */
static void draw_alone(nb_gl_language language, int volumes, int odd_state, nebel_gl_output output, outcome *out)
{
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_lighting *const fog = pass_fog(volumes);
    pass_open(&context, language);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    draw_in(gl, fog, language == NB_GL_330, odd_state, output, out);
    nebel_destroy_gl(gl);
    pass_close(&context);
    nebel_release_lighting(fog);
}

/* The same pixels in a new context and in the oddest one, and no state changed. */
static void test_state_neither_changes_nor_matters(void **state)
{
    (void)state;
    static outcome plain, strange;
    for (int language = 0; language < 2; language++) {
        for (int output = 0; output < NEBEL_GL_OUTPUT_COUNT; output++) {
            const int volumes = output == NEBEL_GL_OUTPUT_SPLIT ? 60 : 0;
            draw_alone((nb_gl_language)language, volumes, -1, (nebel_gl_output)output, &plain);
            for (int on = 0; on < 2; on++) {
                draw_alone((nb_gl_language)language, volumes, on, (nebel_gl_output)output, &strange);
                assert_memory_equal(&plain, &strange, sizeof plain);
            }
        }
    }
}

/* ---- one thing at a time --------------------------------------------------------------------- */

/* Into two targets with depth and stencil beside them. */
static void draw_split(nebel_gl *gl, const nebel_gl_pass *pass, const unsigned targets[2], outcome *out)
{
    static odd_snapshot before, after;
    const unsigned framebuffer = pass_framebuffer(targets[0], targets[1]);
    const GLuint tested = attach_depth_and_stencil();
    odd_take(&before, 1);
    assert_int_equal(nebel_gl_draw_fog(gl, pass), NEBEL_OK);
    odd_take(&after, 1);
    odd_expect_same(&before, &after);
    pass_delete_framebuffer(framebuffer);
    glDeleteRenderbuffers(1, &tested);
    pass_read(targets[0], PASS_WIDTH, PASS_HEIGHT, out->first);
    pass_read(targets[1], PASS_WIDTH, PASS_HEIGHT, out->second);
}

static void expect_outcome(const outcome *wanted, const outcome *got, const char *name)
{
    if (memcmp(wanted, got, sizeof *got) != 0) fail_msg("%s changes the picture", name);
}

/* Names what went wrong, where all at once may hide each other. */
static void test_each_odd_thing_alone(void **state)
{
    (void)state;
    static outcome plain, strange;
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_lighting *const fog = pass_fog(60);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, (range){-1, 0}, .3, -.1), .clip = {-1, 0}};
    pass_fill(&picture);
    pass_open(&context, NB_GL_330);
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture.stored);
    const nebel_gl_pass pass = {.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth};
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture.view), NEBEL_OK);
    for (int which = -1;; which++) {
        const unsigned targets[2] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL),
                                     pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL)};
        if (which == 0) odd_prepare();
        const char *const name = which < 0 ? "nothing" : odd_set_alone(which, 1);
        draw_split(gl, &pass, targets, which < 0 ? &plain : &strange);
        if (which >= 0) expect_outcome(&plain, &strange, name);
        for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
        if (name[0] == '\0') break;
        if (which >= 0) (void)odd_set_alone(which, 0);
    }
    pass_delete_texture(depth);
    nebel_destroy_gl(gl);
    pass_close(&context);
    nebel_release_lighting(fog);
}

/* ---- what odd state does not hold ------------------------------------------------------------ */

/* A plain picture in its context. */
typedef struct stage {
    nb_gl context;
    nebel_gl *gl;
    nebel_lighting *fog;
    nebel_gl_pass pass;
    unsigned target, framebuffer;
} stage;

static void open_stage(stage *s)
{
    pass_picture picture = {.view = pass_view(PERSPECTIVE, (range){-1, 0}, .3, -.1), .clip = {-1, 0}};
    pass_fill(&picture);
    pass_open(&s->context, NB_GL_330);
    s->pass.depth_texture = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture.stored);
    s->pass.color_texture = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    s->target = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    s->framebuffer = pass_framebuffer(s->target, 0);
    s->fog = pass_fog(0);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &s->gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(s->gl, s->fog, &picture.view), NEBEL_OK);
}

static void close_stage(stage *s)
{
    nebel_destroy_gl(s->gl);
    nebel_release_lighting(s->fog);
    pass_delete_framebuffer(s->framebuffer);
    pass_close(&s->context);
}

/* A host that counts what it draws, with nebel in between. */
static void test_transform_feedback_waits(void **state)
{
    (void)state;
    static stage s;
    GLuint array, buffer, query, written = 0;
    GLboolean active = GL_FALSE, paused = GL_TRUE;
    open_stage(&s);
    const unsigned counter = nb_gl_compile(&s.context, "", "out0 = vec4(1.0);", 0, 1);
    assert_int_not_equal(counter, 0);
    glGenBuffers(1, &buffer);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, 1024, NULL, GL_STREAM_READ);
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glGenQueries(1, &query);
    glUseProgram(counter);
    glBeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, query);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, 3);
    assert_int_equal(nebel_gl_draw_fog(s.gl, &s.pass), NEBEL_OK);
    glGetBooleanv(GL_TRANSFORM_FEEDBACK_ACTIVE, &active);
    glGetBooleanv(GL_TRANSFORM_FEEDBACK_PAUSED, &paused);
    assert_true(active && !paused);
    glDrawArrays(GL_POINTS, 0, 4);
    glEndTransformFeedback();
    glEndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN);
    glGetQueryObjectuiv(query, GL_QUERY_RESULT, &written);
    assert_int_equal(written, 7);
    close_stage(&s);
}

/* Conditional rendering is of the host's target: a pass that is not wanted draws nothing, and harms nothing. */
static void test_conditional_rendering_stays(void **state)
{
    (void)state;
    static stage s;
    static float texels[4 * PASS_PIXELS];
    const float grey[4] = {.5f, .25f, .125f, 1};
    GLuint nothing;
    open_stage(&s);
    glClearBufferfv(GL_COLOR, 0, grey);
    glGenQueries(1, &nothing);
    glBeginQuery(GL_SAMPLES_PASSED, nothing);
    glEndQuery(GL_SAMPLES_PASSED);
    glBeginConditionalRender(nothing, GL_QUERY_WAIT);
    assert_int_equal(nebel_gl_draw_fog(s.gl, &s.pass), NEBEL_OK);
    glEndConditionalRender();
    pass_read(s.target, PASS_WIDTH, PASS_HEIGHT, texels);
    for (int i = 0; i < 4 * PASS_PIXELS; i++) assert_true(texels[i] == grey[i % 4]);
    assert_int_equal(nebel_gl_draw_fog(s.gl, &s.pass), NEBEL_OK);
    pass_read(s.target, PASS_WIDTH, PASS_HEIGHT, texels);
    assert_true(texels[0] != grey[0]);
    close_stage(&s);
}

/* The conversion to sRGB is the target's, too. */
static void test_targets_in_srgb(void **state)
{
    (void)state;
    static stage s;
    static float linear[4 * PASS_PIXELS];
    static uint8_t bytes[4 * PASS_PIXELS];
    unsigned target;
    open_stage(&s);
    assert_int_equal(nebel_gl_draw_fog(s.gl, &s.pass), NEBEL_OK);
    pass_read(s.target, PASS_WIDTH, PASS_HEIGHT, linear);
    glGenTextures(1, &target);
    glBindTexture(GL_TEXTURE_2D, target);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, PASS_WIDTH, PASS_HEIGHT, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    const unsigned framebuffer = pass_framebuffer(target, 0);
    glEnable(GL_FRAMEBUFFER_SRGB);
    assert_int_equal(nebel_gl_draw_fog(s.gl, &s.pass), NEBEL_OK);
    assert_true(glIsEnabled(GL_FRAMEBUFFER_SRGB));
    glReadPixels(0, 0, PASS_WIDTH, PASS_HEIGHT, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    for (int i = 0; i < 4 * PASS_PIXELS; i++) {
        const double light = fmin(1, (double)linear[i]);
        const double wanted = light < .0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - .055;
        if (i % 4 < 3) assert_true(fabs(bytes[i] - 255 * wanted) < 1);
    }
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(target);
    close_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_neither_changes_nor_matters),
        cmocka_unit_test(test_each_odd_thing_alone),
        cmocka_unit_test(test_transform_feedback_waits),
        cmocka_unit_test(test_conditional_rendering_stays),
        cmocka_unit_test(test_targets_in_srgb),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
