/* Clouds with volume in OpenGL, where the processor walks through them, are those of the CPU renderer: from below, within and
 * above, behind and before models, in fog. With an argument in pictures so many times wider. */
#include "odd_state.h"
#include "pass_help.h"
#include "picture_help.h"
#include "planet_help.h"

#include <nebel/planet.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale = 1;

static const float wall[4][3] = {{-400, -20, 0}, {400, -20, 0}, {400, 300, 0}, {-400, 300, 0}};
static const uint32_t wall_indices[6] = {0, 1, 2, 0, 2, 3};

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
    nebel_planet planet;
    nebel_mesh mesh;
    nebel_scene_data scene;
} world;

/* `lift`: of the origin above the ground. */
static void make_world_under(const nebel_cloud_layer *layer, double lift, world *w)
{
    static const double sun[3] = {.6, .64, .48};
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                            .sun_angular_diameter = .53,
                            .cloud_layer_count = 1},
                 .mesh = {.origin = {200, -100, -2500},
                          .positions = wall[0],
                          .indices = wall_indices,
                          .vertex_count = 4,
                          .triangle_count = 2,
                          .base_color = {.8f, .8f, .8f},
                          .texture = -1}};
    w->planet.atmosphere_desc.ground_point[1] = -lift;
    assert_int_equal(nebel_create_atmosphere(&w->planet.atmosphere_desc, &w->atmosphere), NEBEL_OK);
    const nebel_clouds_desc desc = {.atmosphere = w->atmosphere, .layers = {*layer}, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&desc, &w->clouds), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->planet.clouds = w->clouds;
    w->scene = (nebel_scene_data){.has_sun = 1,
                                  .sun_irradiance = {5, 4, 3},
                                  .ambient = {.1, .1, .1},
                                  .planet_count = 1,
                                  .planets = &w->planet,
                                  .meshes = &w->mesh};
    memcpy(w->scene.sun_direction, sun, sizeof sun);
}

static void make_world(double coverage, double lift, world *w)
{
    make_world_under(&(nebel_cloud_layer){.coverage = coverage, .wind = {100, 0}}, lift, w);
}

static void free_world(world *w)
{
    nebel_destroy_clouds(w->clouds);
    nebel_destroy_atmosphere(w->atmosphere);
}

/* Whether clouds are there at all: without them transmittance is as smooth as the air. */
static double least_transmittance(const picture_pair *pair)
{
    double least = 1;
    for (size_t i = 0; i < (size_t)pair->width * pair->height; i++)
        least = fmin(least, (double)pair->cpu.transmittance[3 * i]);
    return least;
}

static void compare(const char *name, double most, const picture_pair *pair)
{
    const double shown = picture_shown_apart(pair);
    size_t apart = 0;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++)
        apart += fabs((double)pair->cpu.transmittance[i] - (double)pair->gl.transmittance[i]) > 1. / 255;
    const double left = (double)apart / (3. * pair->width * pair->height);
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have another transmittance\n", name, 1e3 * shown,
                  1e3 * left);
    assert_true(least_transmittance(pair) < .05);
    assert_true(shown <= most && left <= most);
}

static void check_samples(const char *name, const world *w, nebel_lighting *fog, const nebel_camera *camera,
                          uint32_t samples)
{
    picture_pair pair = picture_make(96 * scale, 54 * scale);
    const int objects = pass_count_objects();
    pair.time = 5;
    pair.tolerance = NEBEL_DEFAULT_TOLERANCE; /* that OpenGL takes for clouds */
    picture_render(&w->scene, fog, camera, samples, &pair);
    assert_int_equal(pass_count_objects(), objects);
    /* Of clouds one pixel: a ray whose digits round apart takes other pieces, as rays do that end at models, at floats. */
    compare(name, w->scene.mesh_count > 0 ? 1e-3 : 2e-4, &pair);
    picture_free(&pair);
}

static void check(const char *name, const world *w, nebel_lighting *fog, const nebel_camera *camera)
{
    check_samples(name, w, fog, camera, 1);
}

static void clouds_are_the_same_from_everywhere(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world(.5, 1500, &w);
    pass_open(&context, NB_GL_330);
    nebel_camera camera = planet_camera(-1200, .4);
    check("from below", &w, NULL, &camera);
    camera = planet_camera(-700, -.05);
    check_samples("over their shadows, four samples", &w, NULL, &camera, 4);
    camera = planet_camera(7500, -.3);
    check("from above", &w, NULL, &camera);
    camera = planet_camera(4e5, -.4);
    check("from orbit", &w, NULL, &camera);
    w.scene.mesh_count = 1;
    camera = planet_camera(0, .02);
    check("within, a wall in them", &w, NULL, &camera);
    pass_close(&context);
    pass_open(&context, NB_GL_300ES);
    camera.projection = NEBEL_PROJECTION_PANORAMA;
    check("all around", &w, NULL, &camera);
    pass_close(&context);
    free_world(&w);
}

/* Most of the light of a low sun does not reach them: the ground and models that the sky alone lights, through clouds. */
static void the_sky_comes_through_them(void **state)
{
    (void)state;
    static const double low[3] = {.2, .12, -.97};
    nb_gl context;
    world w;
    make_world(.7, 0, &w);
    nebel_environment_map *const map = planet_even_sky(&w.scene);
    w.scene.mesh_count = 1;
    memcpy(w.scene.sun_direction, low, sizeof low);
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = planet_camera(150, .05);
    check("in the sky's light", &w, NULL, &camera);
    pass_close(&context);
    nebel_release_environment_map(map);
    free_world(&w);
}

/* Clouds before a wall, and none for a long way before those behind it. */
static void walls_stand_amid_clouds(void **state)
{
    (void)state;
    static const float far[4][3] = {{-9000, -4000, 0}, {9000, -4000, -6000}, {9000, 2500, -6000}, {-9000, 2500, 0}};
    nb_gl context;
    world w;
    make_world(.5, 1500, &w);
    w.mesh.origin[0] = w.mesh.origin[1] = 0;
    w.mesh.origin[2] = -9000;
    w.mesh.positions = far[0];
    w.scene.mesh_count = 1;
    pass_open(&context, NB_GL_330);
    nebel_camera camera = planet_camera(200, .02);
    check("a wall amid them", &w, NULL, &camera);
    pass_close(&context);
    free_world(&w);
}

/* Gives the world back. */
static void check_in_fog(const char *name, world *w, const nebel_camera *camera, uint32_t samples)
{
    nb_gl context;
    nebel_lighting *const fog = planet_fog(w->scene.sun_direction);
    pass_open(&context, NB_GL_330);
    check_samples(name, w, fog, camera, samples);
    pass_close(&context);
    nebel_release_lighting(fog);
    free_world(w);
}

static void clouds_lie_in_fog(void **state)
{
    (void)state;
    const nebel_camera camera = planet_camera(120, .25);
    world w;
    make_world(.4, 0, &w);
    check_in_fog("in fog", &w, &camera, 1);
}

/* A camera under a low sun that sees the horizon so many pixels below the middle of the picture, which is that of the first row of a
 * block, so that no clouds are shared with pixels of the ground; the middles of pixels are half of one away. */
static nebel_camera make_horizon(double below, world *w)
{
    const double pixel = 2 * tan(30 * acos(-1) / 180) / (54 * scale), dip = below * pixel;
    make_world(.4, 0, w);
    return planet_camera(.5 * dip * dip * w->planet.atmosphere_desc.radius, pixel);
}

/* Of two samples one sees the ground, the other clouds beyond the horizon; the middle of the pixel sees either. */
static void the_horizon_lies_between_samples(void **state)
{
    (void)state;
    static const double low[3] = {.2, -.03, -.97};
    nb_gl context;
    world w;
    nebel_camera camera = make_horizon(.62, &w);
    check_in_fog("the horizon below the middle of a pixel", &w, &camera, 2);
    camera = make_horizon(.4, &w);
    memcpy(w.scene.sun_direction, low, sizeof low);
    pass_open(&context, NB_GL_330);
    check_samples("above it, without fog", &w, NULL, &camera, 2);
    pass_close(&context);
    check_in_fog("above it, in fog", &w, &camera, 2);
}

/* From orbit all mist is at the end of long rays, under a sheet and a low sun: pieces that are too long must not be walked to the end again
 * and again, or llvmpipe has no turns left. */
static void sheets_lie_over_mist(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world_under(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .base = 1500, .coverage = .5}, 0, &w);
    memcpy(w.scene.sun_direction, (const double[3]){.78, .046, -.624}, sizeof w.scene.sun_direction);
    nebel_lighting *const mist = planet_mist(w.planet.atmosphere_desc.radius, w.scene.sun_direction);
    memset(w.scene.ambient, 0, sizeof w.scene.ambient);
    for (int c = 0; c < 3; c++) w.scene.sun_irradiance[c] = 20;
    nebel_camera camera = planet_camera(3e5, -.41);
    camera.look_at[0] = -.29;
    camera.vertical_fov = 5;
    picture_pair pair = picture_make(32 * scale, 9 * scale);
    pair.tolerance = NEBEL_DEFAULT_TOLERANCE;
    pass_open(&context, NB_GL_330);
    picture_render(&w.scene, mist, &camera, 1, &pair);
    compare("a sheet over mist", 1e-3, &pair);
    pass_close(&context);
    picture_free(&pair);
    nebel_release_lighting(mist);
    free_world(&w);
}

/* ---- threads, refusals, memory --------------------------------------------------------------- */

enum { WIDTH = 24, HEIGHT = 16 };

static const nebel_gl_frame_desc small = {.width = WIDTH, .height = HEIGHT, .samples = 2, .clouds_by_processor = 1};

static void draw(nebel_gl_renderer *renderer, double time, float *color)
{
    nebel_gl_frame_desc frame = small;
    frame.camera = planet_camera(300, .4);
    frame.time = time;
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = color}), NEBEL_OK);
}

static void threads_and_frames_change_nothing(void **state)
{
    (void)state;
    static float once[3 * WIDTH * HEIGHT], later[3 * WIDTH * HEIGHT], again[3 * WIDTH * HEIGHT];
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    make_world(.5, 0, &w);
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&w.scene, NULL, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    draw(renderer, 0, once);
    nebel_destroy_gl_renderer(renderer);
    const nebel_gl_renderer_desc threaded = {.host.parallel.run = nebel_parallel_for_openmp};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, NULL, &threaded, &renderer), NEBEL_OK);
    draw(renderer, 7, later);
    draw(renderer, 0, again);
    assert_memory_equal(once, again, sizeof once);
    assert_memory_not_equal(once, later, sizeof once);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    free_world(&w);
}

typedef struct memory {
    size_t in_use, calls, fails_at; /* the call that fails, from 1; 0: none */
} memory;

static void *allocate(size_t size, void *user)
{
    memory *const m = user;
    if (++m->calls == m->fails_at) return NULL;
    m->in_use++;
    return malloc(size);
}

static void release(void *block, void *user)
{
    memory *const m = user;
    if (block != NULL) m->in_use--;
    free(block);
}

typedef struct stopper {
    size_t calls, stops_at, early; /* early: calls before the first sample was done */
} stopper;

static int stop(size_t done, size_t total, void *user)
{
    stopper *const s = user;
    assert_int_equal(total, 2);
    s->early += done == 0;
    return ++s->calls == s->stops_at;
}

/* Wherever that is asked, and it is tried at some of these times, a frame stops, the state of OpenGL is as before, nothing is lost, and the next frame is whole. */
static void frames_stop_amid_clouds(void **state)
{
    (void)state;
    enum { WIDE = 6, HIGH = 32 };
    static float once[3 * WIDE * HIGH], again[3 * WIDE * HIGH];
    static odd_snapshot before, after;
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    memory m = {0};
    stopper s = {0};
    make_world(.5, 0, &w);
    nebel_lighting *const fog = planet_fog(w.scene.sun_direction);
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.host.allocator = {allocate, release, &m}};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, fog, &desc, &renderer), NEBEL_OK);
    nebel_gl_frame_desc frame = small;
    frame.camera = planet_camera(300, .4);
    frame.width = WIDE;
    frame.height = HIGH;
    frame.progress = stop;
    frame.progress_user = &s;
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = once}), NEBEL_OK);
    const stopper whole = s;
    const int objects = pass_count_objects();
    odd_take(&before, 1);
    for (size_t i = 1; i < whole.calls; i += 1 + i / 4) {
        const size_t held = m.in_use;
        s = (stopper){.stops_at = i};
        assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_ERROR_CANCELLED);
        assert_int_equal(s.calls, i);
        odd_take(&after, 1);
        odd_expect_same(&before, &after);
        assert_true(m.in_use <= held && pass_count_objects() <= objects);
    }
    s = (stopper){0};
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = again}), NEBEL_OK);
    assert_memory_equal(once, again, sizeof once);
    print_message("%zu times asked, %zu of them before the first sample\n", whole.calls, whole.early);
    assert_true(whole.early >= 6); /* two rounds of rows each: nodes, fog among them, and their sums */
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    assert_int_equal(m.in_use, 0);
    nebel_release_lighting(fog);
    free_world(&w);
}

static void keep(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    snprintf(user, 256, "%s", message);
}

static void the_processor_must_be_asked(void **state)
{
    (void)state;
    char said[256] = "";
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    make_world(.5, 0, &w);
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.host.log = {keep, said}};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, NULL, &desc, &renderer), NEBEL_OK);
    nebel_gl_frame_desc frame = small;
    frame.camera = planet_camera(300, .4);
    frame.clouds_by_processor = 0;
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_ERROR_UNSUPPORTED);
    assert_non_null(strstr(said, "clouds"));
    frame.clouds_by_processor = 1;
    frame.time = (double)NAN;
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_ERROR_VALUE);
    assert_non_null(strstr(said, "time"));
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    free_world(&w);
}

/* Each of the allocations of a frame fails once; the next frame is whole. */
static void memory_that_runs_out_is_told(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    memory m = {0};
    size_t failed = 0;
    make_world(.5, 0, &w);
    w.scene.mesh_count = 1; /* whose light has a table */
    nebel_lighting *const fog = planet_fog(w.scene.sun_direction);
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.host.allocator = {allocate, release, &m}};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, fog, &desc, &renderer), NEBEL_OK);
    nebel_gl_frame_desc frame = small;
    frame.camera = planet_camera(300, .4);
    frame.width = frame.height = 2;
    frame.samples = 1;
    for (size_t i = 1;; i++) {
        m.calls = 0;
        m.fails_at = i;
        w.scene.sun_irradiance[0] += .01; /* tables and clouds are made anew */
        const nebel_result result = nebel_gl_render_frame(renderer, &frame);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        failed++;
    }
    print_message("%zu failures\n", failed);
    assert_true(failed > 15);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    assert_int_equal(m.in_use, 0);
    nebel_release_lighting(fog);
    free_world(&w);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clouds_are_the_same_from_everywhere),
        cmocka_unit_test(the_sky_comes_through_them),
        cmocka_unit_test(walls_stand_amid_clouds),
        cmocka_unit_test(clouds_lie_in_fog),
        cmocka_unit_test(the_horizon_lies_between_samples),
        cmocka_unit_test(sheets_lie_over_mist),
        cmocka_unit_test(threads_and_frames_change_nothing),
        cmocka_unit_test(frames_stop_amid_clouds),
        cmocka_unit_test(the_processor_must_be_asked),
        cmocka_unit_test(memory_that_runs_out_is_told),
    };
    if (argc > 1) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
