/* Crowds: more volumes of different light in one place than Mesa's llvmpipe has turns of loops for. What comes out then
 * is what nebel/gl.h promises, and the log is told. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>

enum { MOST = 1000, GAUSSIAN = 0, PARTS = 1, EVEN = 2 };

/* Balls of every colour around one place, Gaussian ones; of PARTS half are unions, of EVEN all have a constant density. */
static nebel_snapshot *make_crowd(int count, int kind)
{
    static nebel_volume_desc volumes[MOST];
    static nebel_shape pieces[MOST][2];
    uint64_t state = 9;
    for (int i = 0; i < count; i++) {
        nebel_volume_desc *const v = &volumes[i];
        *v = (nebel_volume_desc){.density = {.sigma = dice(&state, 1, 2)}};
        v->density.type = kind == EVEN ? NEBEL_DENSITY_CONSTANT : NEBEL_DENSITY_GAUSSIAN;
        nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(&state, 3, 5)};
        for (int k = 0; k < 3; k++) {
            ball.center[k] = pass_eye[k] + (k == 2 ? -12 : 0) + dice(&state, -2, 2);
            v->density.center[k] = ball.center[k];
            v->extinction[k] = dice(&state, .002, .02);
            v->source[k] = dice(&state, 0, 1);
        }
        v->shape = ball;
        if (kind != PARTS || i % 2 == 0) continue;
        pieces[i][0] = pieces[i][1] = ball;
        pieces[i][1].center[0] += 1;
        v->shape = (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = pieces[i], .part_count = 2};
    }
    return fog_commit(&(nebel_fog_desc){0}, volumes, (size_t)count);
}

typedef struct split {
    float in_scattering[4 * PASS_PIXELS], transmittance[4 * PASS_PIXELS];
} split;

/* Returns how many messages there were. */
static int draw(nebel_snapshot *fog, pass_picture *picture, split *out)
{
    fog_messages messages = {.count = 0};
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_gl_fog told;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){.log = fog_messages_log(&messages)}, &gl), NEBEL_OK);
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture->stored);
    const unsigned targets[] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL),
                                pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL)};
    const unsigned framebuffer = pass_framebuffer(targets[0], targets[1]);
    const nebel_gl_pass pass = {.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth};
    for (int i = 0; i < 2; i++) {
        picture->view.eye_from_world[12] += 1e-6; /* not the same fog again: the message comes once all the same */
        assert_int_equal(nebel_gl_set_fog(gl, fog, &picture->view), NEBEL_OK);
    }
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    assert_int_equal(nebel_gl_get_fog(gl, &told), NEBEL_OK);
    assert_int_equal(told.tile_most, nebel_snapshot_volume_count(fog));
    if (messages.count > 0)
        assert_true(messages.result == NEBEL_OK && strncmp(messages.text, "warning: ", 9) == 0 &&
                    strstr(messages.text, "evenly mixed") != NULL);
    pass_read(targets[0], PASS_WIDTH, PASS_HEIGHT, out->in_scattering);
    pass_read(targets[1], PASS_WIDTH, PASS_HEIGHT, out->transmittance);
    pass_delete_framebuffer(framebuffer);
    for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
    pass_delete_texture(depth);
    nebel_destroy_gl(gl);
    pass_close(&context);
    return (int)messages.count;
}

/* How far off light may be: `most`. The processor takes N^2 for each ray of N volumes: of many it looks at fewer. */
static void check(int count, int kind, int messages, double most)
{
    static split got;
    nebel_snapshot *const fog = make_crowd(count, kind);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, (range){-1, 0}, 0, 0), .clip = {-1, 0}};
    double light = 0, transmittance = 0;
    pass_fill(&picture);
    const int told = draw(fog, &picture, &got);
    for (int i = 0; i<PASS_PIXELS; i += count> 300 ? 61 : 7) {
        const nebel_light wanted = pass_trace(fog, &picture, i % PASS_WIDTH, i / PASS_WIDTH);
        for (int c = 0; c < 3; c++) {
            light = fmax(light, fabs((double)got.in_scattering[4 * i + c] - wanted.in_scattering[c]));
            transmittance = fmax(transmittance, fabs((double)got.transmittance[4 * i + c] - wanted.transmittance[c]));
        }
    }
    print_message("%d volumes: transmittance %.1e off, light %.1e\n", count, transmittance, light);
    assert_true(transmittance < 1e-4);
    assert_true(light < most);
    assert_int_equal(told, messages);
    nebel_release_snapshot(fog);
}

static int is_llvmpipe(void)
{
    nb_gl context;
    pass_open(&context, NB_GL_330);
    const int is = strstr((const char *)glGetString(GL_RENDERER), "llvmpipe") != NULL;
    pass_close(&context);
    return is;
}

static void test_crowds_are_as_promised(void **state)
{
    (void)state;
    const int short_loops = is_llvmpipe();
    check(60, GAUSSIAN, 0, 2e-4);
    check(300, GAUSSIAN, short_loops, 1e-3);
    check(120, PARTS, short_loops, .02);
    check(120, EVEN, short_loops, 5e-4);
    check(MOST, EVEN, short_loops, .01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crowds_are_as_promised),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
