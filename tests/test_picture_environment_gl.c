/* Ambient light by direction in OpenGL is that of the CPU: in fog of every kind, on surfaces, behind everything, seen by
 * every projection. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "pass_help.h"
#include "picture_help.h"
#include "random_fog.h"
#include "test_render_scene.h"

enum { WIDTH = 96, HEIGHT = 64, SMALL_WIDTH = 48, SMALL_HEIGHT = 32, MAP_HEIGHT = 48 };

static const nb_gl_language languages[] = {NB_GL_330, NB_GL_300ES};

/* Smooth, but for a small bright sun and rows that differ. */
static nebel_environment_map *make_map(uint64_t seed)
{
    static float pixels[3 * 2 * MAP_HEIGHT * MAP_HEIGHT];
    uint64_t numbers = seed;
    const double turn = dice(&numbers, 0, 6);
    for (int y = 0; y < MAP_HEIGHT; y++) {
        for (int x = 0; x < 2 * MAP_HEIGHT; x++) {
            for (int c = 0; c < 3; c++) {
                const double wave = .5 + .5 * sin(turn + c + 3 * x * test_pi / MAP_HEIGHT + .1 * y);
                pixels[3 * (2 * MAP_HEIGHT * y + x) + c] = (float)(wave + .2 * dice(&numbers, 0, 1));
            }
        }
    }
    for (int c = 0; c < 3; c++) pixels[3 * (2 * MAP_HEIGHT * 12 + 1) + c] = 40;
    nebel_environment_map *map = NULL;
    const nebel_environment_map_desc desc = {.width = 2 * MAP_HEIGHT, .height = MAP_HEIGHT, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_OK);
    return map;
}

/* map NULL: a gradient. */
static nebel_environment sky_of(uint64_t seed, nebel_environment_map *map)
{
    uint64_t numbers = seed;
    nebel_environment sky = {.type = map != NULL ? NEBEL_ENVIRONMENT_MAP : NEBEL_ENVIRONMENT_GRADIENT,
                             .map = map,
                             .rotation = dice(&numbers, -400, 400),
                             .intensity = dice(&numbers, .2, 1)};
    for (int c = 0; c < 3; c++) {
        sky.zenith[c] = dice(&numbers, 0, 1);
        sky.horizon[c] = dice(&numbers, 0, 2);
        sky.ground[c] = dice(&numbers, 0, .3);
    }
    return sky;
}

static nebel_lighting *commit(const nebel_fog_desc *desc, const nebel_environment *sky, size_t count,
                              const nebel_volume_desc *volumes)
{
    const nebel_lighting_desc lights = {.environment = *sky};
    return fog_commit_lit(desc, volumes, count, &lights);
}

/* ---- comparison ------------------------------------------------------------------------------ */

static double largest_light(const picture_pair *pair)
{
    double most = 1;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++)
        most = fmax(most, (double)pair->cpu.in_scattering[i]);
    return most;
}

/* Of the colours where both see nothing but the sky, as a share of the brightest there, and how many such pixels. */
static double background_difference(const picture_pair *pair, size_t *count)
{
    double apart = 0, most = 1e-30;
    *count = 0;
    for (size_t i = 0; i < (size_t)pair->width * pair->height; i++) {
        if (!isinf(pair->cpu.depth[i]) || !isinf(pair->gl.depth[i])) continue;
        ++*count;
        for (size_t c = 0; c < 3; c++) {
            most = fmax(most, (double)pair->cpu.color[3 * i + c]);
            apart = fmax(apart, fabs((double)pair->cpu.color[3 * i + c] - (double)pair->gl.color[3 * i + c]));
        }
    }
    return apart / most;
}

/* `most`: of the sky, which fog that is within its tolerance may be before. */
static picture_difference check(const char *name, int number, const picture_pair *pair, double most)
{
    size_t open;
    const picture_difference d = picture_compare(pair, largest_light(pair));
    const double background = background_difference(pair, &open);
    print_message("%s %d: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255, color %.2g, sky of %zu pixels %.2g\n",
                  name, number, d.fogged, d.beyond_step, 255 * d.largest, d.color, open, background);
    assert_true(open == 0 || background < most);
    return d;
}

/* ---- surfaces and the background ------------------------------------------------------------- */

static const nebel_projection cameras[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_PANORAMA,
                                           NEBEL_PROJECTION_ORTHOGRAPHIC};

/* A ball over a floor, with fog and without, under either kind of sky. */
static void surfaces_reflect_the_sky(void **state)
{
    (void)state;
    static test_stage s;
    nebel_environment_map *const map = make_map(1);
    for (int i = 0; i < 3; i++) {
        static const nebel_volume_desc mist = {.extinction = {.02, .03, .04},
                                               .albedo = {.9, 1, .8},
                                               .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8}};
        nb_gl context;
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
        nebel_release_lighting(s.fog);
        s.ball.scene.has_sun = 0;
        s.ball.scene.environment = sky_of((uint64_t)i, i % 2 != 0 ? map : NULL);
        s.ball.scene.shows_ambient = i != 1;
        s.camera.projection = cameras[i % 3];
        s.fog = i == 0 ? NULL : commit(&(nebel_fog_desc){0}, &s.ball.scene.environment, 1, &mist);
        pass_open(&context, languages[i / 2]);
        const int objects = pass_count_objects();
        picture_render(&s.ball.scene, s.fog, &s.camera, 1, &pair);
        assert_int_equal(pass_count_objects(), objects);
        pass_close(&context);
        const picture_difference d = check("stage", i, &pair, 1e-5);
        assert_true(d.largest < .1 / 255);
        assert_true(d.color < 1e-3);
        picture_free(&pair);
        nebel_release_lighting(s.fog);
    }
    nebel_release_environment_map(map);
}

/* Of pixels more than 1/255 apart: edges are. */
static double share_apart(const float *a, const float *b)
{
    int apart = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double most = 0;
        for (int c = 0; c < 3; c++) most = fmax(most, fabs((double)a[3 * i + c] - (double)b[3 * i + c]));
        apart += !(most <= 1. / 255);
    }
    return (double)apart / (WIDTH * HEIGHT);
}

/* Light that changes between the frames of one renderer. */
static void changes_are_seen(void **state)
{
    (void)state;
    static test_stage s;
    static float first[3 * WIDTH * HEIGHT], other[3 * WIDTH * HEIGHT];
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    nebel_environment_map *const map = make_map(2);
    test_stage_set(&s, (const double[3]){0, 0, 0}, (const double[3]){3, 2, 5});
    s.ball.scene.shows_ambient = 1;
    s.ball.scene.has_sun = 0;
    const nebel_gl_frame_desc frame = {.camera = s.camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, NULL, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    for (int i = 0; i < 5; i++) {
        test_picture cpu = test_picture_make(WIDTH, HEIGHT);
        nebel_environment *const sky = &s.ball.scene.environment;
        if (i != 2) *sky = sky_of((uint64_t)(i / 2), i > 1 ? map : NULL);
        if (i == 2) *sky = (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT};
        if (i == 4) sky->rotation += 50;
        assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
        assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = other}), NEBEL_OK);
        test_render(&s.ball.scene, NULL, &(nebel_cpu_renderer_desc){0}, &s.camera, 1, &cpu);
        assert_true(share_apart(cpu.planes.color, other) < .01);
        const int same = memcmp(first, other, sizeof first) == 0;
        assert_true(i == 1 ? same : !same);
        memcpy(first, other, sizeof first);
        test_picture_free(&cpu);
    }
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_release_lighting(s.fog);
    nebel_release_environment_map(map);
}

/* ---- fog ------------------------------------------------------------------------------------- */

static int random_scenes = 2;

/* Fog of all kinds under both kinds of sky; the eye is within it or beside it. */
static picture_difference check_random(int number, nebel_environment_map *map)
{
    static random_fog fog;
    static test_stage s;
    nb_gl context;
    uint64_t numbers = (uint64_t)number;
    random_fog_make(&fog, (random_fog_kind)((4 * number + 3) % RANDOM_FOG_KIND_COUNT), (uint64_t)number);
    random_fog_light(&fog, &numbers);
    const double far = number % 3 == 0 ? .4 : 1;
    test_stage_set(&s, fog.shift, (const double[3]){12 * far, 3 * far, 14 * far});
    nebel_release_lighting(s.fog);
    s.ball.scene.environment = sky_of((uint64_t)number, number % 2 != 0 ? map : NULL);
    s.ball.scene.shows_ambient = 1;
    s.ball.scene.has_sun = 0;
    nebel_fog_desc desc = random_fog_desc(&fog);
    desc.max_opacity = number % 5 == 0 ? .8 : 0;
    s.fog = commit(&desc, &s.ball.scene.environment, fog.count, fog.volumes);
    s.camera.projection = cameras[number % 3];
    s.camera.view_height = 24;
    picture_pair pair = picture_make(SMALL_WIDTH, SMALL_HEIGHT);
    pass_open(&context, languages[number % 2]);
    picture_render(&s.ball.scene, s.fog, &s.camera, 1, &pair);
    pass_close(&context);
    const picture_difference d = check("random", number, &pair, 1. / 255);
    picture_free(&pair);
    nebel_release_lighting(s.fog);
    return d;
}

static void fog_scatters_the_sky(void **state)
{
    (void)state;
    picture_difference all = {.fogged = 0};
    nebel_environment_map *const map = make_map(3);
    for (int i = 0; i < random_scenes; i++) {
        const picture_difference d = check_random(i, map);
        all.fogged += d.fogged;
        all.beyond_step += d.beyond_step;
        all.largest = fmax(all.largest, d.largest);
    }
    nebel_release_environment_map(map);
    print_message("all: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255\n", all.fogged, all.beyond_step,
                  255 * all.largest);
    assert_true(all.fogged > (size_t)random_scenes * SMALL_WIDTH * SMALL_HEIGHT / 8);
    assert_true((double)all.beyond_step <= 1e-3 * (double)all.fogged);
    assert_true(all.largest <= 3. / 255);
}

/* An argument is how many random scenes are tried. */
int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_reflect_the_sky),
        cmocka_unit_test(changes_are_seen),
        cmocka_unit_test(fog_scatters_the_sky),
    };
    if (argc > 1) random_scenes = atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
