/* The passes leave all state of OpenGL as they found it: everything is set to odd values, every function is called, and
 * what glGet tells before and after must be the same. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

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
static void use_all(nebel_gl *gl, const nebel_snapshot *fog, const pass_picture *picture, unsigned depth,
                    unsigned color, const unsigned targets[2], nebel_gl_output output, int desktop)
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
static void draw_in(nebel_gl *gl, const nebel_snapshot *fog, int desktop, int odd_state, nebel_gl_output output,
                    outcome *out)
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
    nebel_snapshot *const fog = pass_fog(volumes);
    pass_open(&context, language);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    draw_in(gl, fog, language == NB_GL_330, odd_state, output, out);
    nebel_destroy_gl(gl);
    pass_close(&context);
    nebel_release_snapshot(fog);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_neither_changes_nor_matters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
