/* Point lights of OpenGL are those of the CPU: on surfaces, past others, through fog, near the origin and far out;
 * one, a hundred, and more than there is room for. */
#include <math.h>
#include <string.h>

#include "pass_help.h"
#include "picture_help.h"
#include "random_fog.h"
#include "test_render_scene.h"

enum { WIDTH = 128, HEIGHT = 96, MANY = 100, BEYOND_ROOM = 700, FOG_LIGHTS = 3, FOG_WIDTH = 48, FOG_HEIGHT = 32 };

static const double pi = 3.14159265358979323846;

/* What a spot, a ball and a point above the stage shine on. */
static void set_lights(const test_stage *s, nebel_light lights[3])
{
    static const double places[3][3] = {{2.5, 2, .5}, {-1.5, 1.8, 1}, {.3, .4, 2.6}};
    for (int i = 0; i < 3; i++) {
        lights[i] = (nebel_light){.intensity = {6 - 2 * i, 4, 2 + 2 * i}, .radius = i == 1 ? .2 : 0};
        for (int k = 0; k < 3; k++) lights[i].position[k] = s->camera.look_at[k] + places[i][k];
    }
    lights[0].type = NEBEL_LIGHT_SPOT;
    memcpy(lights[0].direction, (const double[3]){-2, -2.2, -.4}, sizeof lights[0].direction);
    lights[0].inner_angle = 15;
    lights[0].outer_angle = 40;
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

static void expect_same_light(const nebel_scene_data *scene, nebel_lighting *fog, const nebel_camera *camera,
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
        nebel_light lights[3];
        test_stage_set(&s, centers[i % 2], (const double[3]){3, 2, 5});
        set_lights(&s, lights);
        s.ball.scene.has_sun = i != 1;
        s.ball.scene.light_count = 3;
        s.ball.scene.lights = lights;
        if (i == 3) s.camera.projection = NEBEL_PROJECTION_PANORAMA;
        expect_same_light(&s.ball.scene, i == 2 ? NULL : s.fog, &s.camera, i % 2 == 0 ? NB_GL_330 : NB_GL_300ES, .005);
        nebel_release_lighting(s.fog);
    }
}

/* In the very floor, and within the least radius below it: the side that is seen is lit. */
static void test_lights_may_lie_in_surfaces(void **state)
{
    (void)state;
    static test_stage s;
    for (int i = 0; i < 2; i++) {
        test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
        const nebel_light light = {.position = {1.8, i == 0 ? -1 : -1 - 1e-4, 1.6}, .intensity = {6, 5, 4}};
        s.ball.scene.has_sun = 0;
        s.ball.scene.light_count = 1;
        s.ball.scene.lights = &light;
        expect_same_light(&s.ball.scene, NULL, &s.camera, NB_GL_330, .005);
        nebel_release_lighting(s.fog);
    }
}

/* Each shines past the ball on the floor. */
static void set_ring(const test_stage *s, nebel_light *lights, int count)
{
    for (int i = 0; i < count; i++) {
        const double angle = 2 * pi * i / count, from[3] = {4 * cos(angle), .5 + .01 * (i % 7), 4 * sin(angle)};
        lights[i] = (nebel_light){.intensity = {40. / count, 30. / count, 20. / count}, .radius = .05};
        for (int k = 0; k < 3; k++) lights[i].position[k] = s->camera.look_at[k] + from[k];
    }
}

static void test_many_lights_cast_shadows(void **state)
{
    (void)state;
    static test_stage s;
    static nebel_light lights[MANY];
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_ring(&s, lights, MANY);
    s.ball.scene.has_sun = 0;
    s.ball.scene.light_count = MANY;
    s.ball.scene.lights = lights;
    expect_same_light(&s.ball.scene, NULL, &s.camera, NB_GL_330, .002);
    nebel_release_lighting(s.fog);
}

static void render(nebel_gl_renderer *renderer, const test_stage *s, float *color)
{
    const nebel_gl_frame_desc desc = {.camera = s->camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = color}), NEBEL_OK);
}

/* Point lights that move, go out and come back: the maps are those of a renderer that has drawn nothing before. */
static void test_lights_may_change_from_frame_to_frame(void **state)
{
    (void)state;
    static test_stage s;
    static float own[WIDTH * HEIGHT * 3], changed[WIDTH * HEIGHT * 3], first[WIDTH * HEIGHT * 3];
    nb_gl context;
    nebel_light lights[3], usual[3];
    nebel_gl_renderer *renderer = NULL;
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_lights(&s, usual);
    memcpy(lights, usual, sizeof lights);
    s.ball.scene.light_count = 3;
    s.ball.scene.lights = lights;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    render(renderer, &s, first);
    for (int i = 0; i < 4; i++) {
        nebel_gl_renderer *fresh = NULL;
        memcpy(lights, usual, sizeof lights);
        if (i == 0) lights[1].position[0] += 1;
        if (i == 1) memset(lights[2].intensity, 0, sizeof lights[2].intensity);
        if (i == 2) lights[0] = usual[2], lights[2] = usual[0];
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
    nebel_release_lighting(s.fog);
}

/* More point lights than the context has layers for, or than are drawn at all. */
static void test_lights_have_a_limit(void **state)
{
    (void)state;
    static test_stage s;
    static nebel_light lights[4097];
    static float color[WIDTH * HEIGHT * 3];
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    set_ring(&s, lights, 4097);
    s.ball.scene.has_sun = 0;
    s.ball.scene.light_count = BEYOND_ROOM;
    s.ball.scene.lights = lights;
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.shadow_map_size = 256};
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, NULL, &desc, &renderer), NEBEL_OK);
    render(renderer, &s, color);
    s.ball.scene.light_count = 4097;
    const nebel_gl_frame_desc frame = {.camera = s.camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_ERROR_LIMIT);
    s.ball.scene.light_count = 0;
    render(renderer, &s, color);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_release_lighting(s.fog);
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* Point lights among the volumes, and one of them beside. */
static void distribute_lights(const random_fog *fog, uint64_t *numbers, nebel_light lights[FOG_LIGHTS])
{
    for (int i = 0; i < FOG_LIGHTS; i++) {
        lights[i] = (nebel_light){.radius = i == 1 ? dice(numbers, .05, 1) : 0};
        for (int k = 0; k < 3; k++) {
            lights[i].position[k] = fog->shift[k] + dice(numbers, -6, 6) * (i == 2 ? 3 : 1);
            lights[i].intensity[k] = dice(numbers, 2, 30);
            lights[i].direction[k] = dice(numbers, -1, 1);
        }
    }
    lights[0].type = NEBEL_LIGHT_SPOT;
    lights[0].outer_angle = dice(numbers, 20, 120);
    lights[0].inner_angle = dice(numbers, 0, 1) * lights[0].outer_angle;
}

static nebel_lighting *commit_lit(const random_fog *random, const nebel_light *point_lights)
{
    const nebel_fog_desc desc = random_fog_desc(random);
    nebel_lighting_desc lights = random_fog_lights(random);
    lights.lights = point_lights;
    lights.light_count = random->kind == RANDOM_FOG_EXCLUDE ? 1 : FOG_LIGHTS;
    return fog_commit_lit(&desc, random->volumes, random->count, &lights);
}

static picture_difference check_random(random_fog_kind kind, uint64_t seed)
{
    static random_fog random;
    nebel_light lights[FOG_LIGHTS];
    nb_gl context;
    uint64_t numbers = seed + 7;
    random_fog_make(&random, kind, seed);
    random_fog_light(&random, &numbers);
    distribute_lights(&random, &numbers, lights);
    nebel_lighting *const fog = commit_lit(&random, lights);
    nebel_camera camera = test_camera(dice(&numbers, -20, 20), dice(&numbers, -4, 8), dice(&numbers, -20, 20), 0, 0, 0);
    for (int k = 0; k < 3; k++) {
        camera.position[k] += random.shift[k];
        camera.look_at[k] += random.shift[k];
    }
    if ((seed + kind) % 3 == 1) camera.projection = NEBEL_PROJECTION_PANORAMA;
    if ((seed + kind) % 3 == 2) camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    const nebel_scene_data scene = {.background = {.1, .1, .1}, .light_count = FOG_LIGHTS, .lights = lights};
    picture_pair pair = picture_make(FOG_WIDTH, FOG_HEIGHT);
    pass_open(&context, seed % 2 == 0 ? NB_GL_330 : NB_GL_300ES);
    picture_render(&scene, fog, &camera, 1, &pair);
    pass_close(&context);
    double most = 1;
    for (size_t i = 0; i < 3 * (size_t)FOG_WIDTH * FOG_HEIGHT; i++)
        most = fmax(most, (double)pair.cpu.in_scattering[i]);
    const picture_difference d = picture_compare(&pair, most);
    print_message("kind %d, seed %d: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255 at %u, %u\n", (int)kind,
                  (int)seed, d.fogged, d.beyond_step, 255 * d.largest, (unsigned)d.x, (unsigned)d.y);
    picture_free(&pair);
    nebel_release_lighting(fog);
    return d;
}

/* Mesa's software ends the loops of many volumes in the light of point lights, and of those that cover others in that
 * of several: see docs/shaders.md. */
static void test_lights_light_fog_as_on_the_cpu(void **state)
{
    (void)state;
    picture_difference all = {.fogged = 0};
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        if (kind == RANDOM_FOG_MANY) continue;
        for (uint64_t seed = 0; seed < 2; seed++) {
            const picture_difference d = check_random((random_fog_kind)kind, seed);
            all.fogged += d.fogged;
            all.beyond_step += d.beyond_step;
            all.largest = fmax(all.largest, d.largest);
        }
    }
    print_message("all: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255\n", all.fogged, all.beyond_step,
                  255 * all.largest);
    assert_true(all.fogged > FOG_WIDTH * FOG_HEIGHT);
    assert_int_equal(all.beyond_step, 0);
    assert_true(all.largest <= .5 / 255);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lights_light_fog_as_on_the_cpu),
        cmocka_unit_test(test_surfaces_are_lit_as_on_the_cpu),
        cmocka_unit_test(test_lights_may_lie_in_surfaces),
        cmocka_unit_test(test_many_lights_cast_shadows),
        cmocka_unit_test(test_lights_may_change_from_frame_to_frame),
        cmocka_unit_test(test_lights_have_a_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
