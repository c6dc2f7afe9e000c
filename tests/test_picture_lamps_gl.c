/* Lamps of OpenGL are those of the CPU: on surfaces, past others, through fog, near the origin and far out; one, a
 * hundred, and more than there is room for. */
#include <math.h>
#include <string.h>

#include "pass_help.h"
#include "picture_help.h"
#include "test_render_scene.h"

enum { WIDTH = 128, HEIGHT = 96, MANY = 100, BEYOND_ROOM = 700 };

static const double pi = 3.14159265358979323846;

/* What a spot, a ball and a point above the stage shine on. */
static void set_lamps(const test_stage *s, nebel_lamp lamps[3])
{
    static const double places[3][3] = {{2.5, 2, .5}, {-1.5, 1.8, 1}, {.3, .4, 2.6}};
    for (int i = 0; i < 3; i++) {
        lamps[i] = (nebel_lamp){.intensity = {6 - 2 * i, 4, 2 + 2 * i}, .radius = i == 1 ? .2 : 0};
        for (int k = 0; k < 3; k++) lamps[i].position[k] = s->camera.look_at[k] + places[i][k];
    }
    lamps[0].type = NEBEL_LAMP_SPOT;
    memcpy(lamps[0].direction, (const double[3]){-2, -2.2, -.4}, sizeof lamps[0].direction);
    lamps[0].inner_angle = 15;
    lamps[0].outer_angle = 40;
}

/* The share of pixels whose colours are more than 2/255 of `peak` apart. Edges of shadows are a texel wide. */
static double share_apart(const picture_pair *pair, double peak)
{
    const size_t count = (size_t)pair->width * pair->height;
    size_t apart = 0;
    for (size_t i = 0; i < count; i++) {
        double most = 0;
        for (size_t c = 0; c < 3; c++)
            most = fmax(most, fabs((double)pair->cpu.color[3 * i + c] - (double)pair->gl.color[3 * i + c]));
        apart += !(most <= 2. / 255 * peak);
    }
    return (double)apart / (double)count;
}

static double mean_light(const nebel_frame *frame, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * count; i++) sum += (double)frame->color[i];
    return sum / (3 * (double)count);
}

static void expect_same_light(const nebel_scene_data *scene, nebel_snapshot *fog, const nebel_camera *camera,
                              nb_gl_language language, double most)
{
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    pass_open(&context, language);
    const int objects = pass_count_objects();
    picture_render(scene, fog, camera, 1, &pair);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    const double apart = share_apart(&pair, 1), light = mean_light(&pair.cpu, (size_t)WIDTH * HEIGHT);
    print_message("%.3g %% of the pixels apart; mean %.5g and %.5g\n", 100 * apart, light,
                  mean_light(&pair.gl, (size_t)WIDTH * HEIGHT));
    assert_true(apart <= most);
    assert_true(fabs(mean_light(&pair.gl, (size_t)WIDTH * HEIGHT) - light) < 5e-4 * light);
    picture_free(&pair);
}

static void test_surfaces_are_lit_as_on_the_cpu(void **state)
{
    (void)state;
    static test_stage s;
    static const double centers[2][3] = {{0, 0, 0}, {1e6, -3e5, 5e5}};
    for (int i = 0; i < 4; i++) {
        nebel_lamp lamps[3];
        test_stage_set(&s, centers[i % 2], (const double[3]){3, 2, 5});
        set_lamps(&s, lamps);
        s.ball.scene.has_sun = i != 1;
        s.ball.scene.lamp_count = 3;
        s.ball.scene.lamps = lamps;
        if (i == 3) s.camera.projection = NEBEL_PROJECTION_PANORAMA;
        expect_same_light(&s.ball.scene, i == 2 ? NULL : s.fog, &s.camera, i % 2 == 0 ? NB_GL_330 : NB_GL_300ES, .005);
        nebel_release_snapshot(s.fog);
    }
}

/* Each shines past the ball on the floor. */
static void set_ring(const test_stage *s, nebel_lamp *lamps, int count)
{
    for (int i = 0; i < count; i++) {
        const double angle = 2 * pi * i / count, from[3] = {4 * cos(angle), .5 + .01 * (i % 7), 4 * sin(angle)};
        lamps[i] = (nebel_lamp){.intensity = {40. / count, 30. / count, 20. / count}, .radius = .05};
        for (int k = 0; k < 3; k++) lamps[i].position[k] = s->camera.look_at[k] + from[k];
    }
}

static void test_many_lamps_cast_shadows(void **state)
{
    (void)state;
    static test_stage s;
    static nebel_lamp lamps[MANY];
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_ring(&s, lamps, MANY);
    s.ball.scene.has_sun = 0;
    s.ball.scene.lamp_count = MANY;
    s.ball.scene.lamps = lamps;
    expect_same_light(&s.ball.scene, NULL, &s.camera, NB_GL_330, .002);
    nebel_release_snapshot(s.fog);
}

static void render(nebel_gl_renderer *renderer, const test_stage *s, float *color)
{
    const nebel_gl_frame_desc desc = {.camera = s->camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = color}), NEBEL_OK);
}

/* Lamps that move, go out and come back: the maps are those of a renderer that has drawn nothing before. */
static void test_lamps_may_change_from_frame_to_frame(void **state)
{
    (void)state;
    static test_stage s;
    static float own[WIDTH * HEIGHT * 3], changed[WIDTH * HEIGHT * 3], first[WIDTH * HEIGHT * 3];
    nb_gl context;
    nebel_lamp lamps[3], usual[3];
    nebel_gl_renderer *renderer = NULL;
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_lamps(&s, usual);
    memcpy(lamps, usual, sizeof lamps);
    s.ball.scene.lamp_count = 3;
    s.ball.scene.lamps = lamps;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    render(renderer, &s, first);
    for (int i = 0; i < 4; i++) {
        nebel_gl_renderer *fresh = NULL;
        memcpy(lamps, usual, sizeof lamps);
        if (i == 0) lamps[1].position[0] += 1;
        if (i == 1) memset(lamps[2].intensity, 0, sizeof lamps[2].intensity);
        if (i == 2) lamps[0] = usual[2], lamps[2] = usual[0];
        assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &(nebel_gl_renderer_desc){0}, &fresh),
                         NEBEL_OK);
        render(fresh, &s, own);
        render(renderer, &s, changed);
        assert_memory_equal(changed, own, sizeof own);
        if (i < 2) assert_memory_not_equal(changed, first, sizeof own);
        nebel_destroy_gl_renderer(fresh);
    }
    assert_memory_equal(changed, first, sizeof first);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_release_snapshot(s.fog);
}

/* More lamps than the context has layers for, or than are drawn at all. */
static void test_lamps_have_a_limit(void **state)
{
    (void)state;
    static test_stage s;
    static nebel_lamp lamps[4097];
    static float color[WIDTH * HEIGHT * 3];
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_ring(&s, lamps, 4097);
    s.ball.scene.has_sun = 0;
    s.ball.scene.lamp_count = BEYOND_ROOM;
    s.ball.scene.lamps = lamps;
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.shadow_size = 256};
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, NULL, &desc, &renderer), NEBEL_OK);
    render(renderer, &s, color);
    s.ball.scene.lamp_count = 4097;
    const nebel_gl_frame_desc frame = {.camera = s.camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_ERROR_LIMIT);
    s.ball.scene.lamp_count = 0;
    render(renderer, &s, color);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_release_snapshot(s.fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surfaces_are_lit_as_on_the_cpu),
        cmocka_unit_test(test_many_lamps_cast_shadows),
        cmocka_unit_test(test_lamps_may_change_from_frame_to_frame),
        cmocka_unit_test(test_lamps_have_a_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
