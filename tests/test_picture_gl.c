/* The picture of OpenGL is that of the CPU: the demo scenes, and random fog around boxes. */
#define _POSIX_C_SOURCE 200809L

#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"
#include "random_fog.h"
#include "random_grid.h"

enum {
    DEMO_WIDTH = 320,
    DEMO_HEIGHT = 180,
    ROUND_WIDTH = 288,
    ROUND_HEIGHT = 144,
    RANDOM_WIDTH = 96,
    RANDOM_HEIGHT = 64,
    RANDOM_SCENES = RANDOM_FOG_KIND_COUNT,
    REPORTED_SCENES = 40, /* each kind in both languages */
    GRID_SCENES = 5,
    SUNLIT_SCENES = 4
};

static picture_report report;

/* The largest radiance, which in-scattering is measured by: at least 1. */
static double largest_light(const picture_pair *pair)
{
    const size_t count = 3 * (size_t)pair->width * pair->height;
    double most = 1;
    for (size_t i = 0; i < count; i++) most = fmax(most, (double)pair->cpu.in_scattering[i]);
    return most;
}

static picture_difference check(const char *name, const picture_pair *pair)
{
    const picture_difference d = picture_compare(pair, largest_light(pair));
    print_message("%s: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255 at %u, %u, color %.2g\n", name, d.fogged,
                  d.beyond_step, 255 * d.largest, (unsigned)d.x, (unsigned)d.y, d.color);
    picture_report_add(&report, name, pair, &d);
    return d;
}

/* Off borders light on surfaces is the same. At them texels of shadow maps show; all around, where a pixel is wider than
 * the shadows of leaves, some borders are between pixels. */
static void expect_same_light(const picture_pair *pair, int around)
{
    const picture_light d = picture_compare_light(pair);
    print_message("light: of %zu pixels %zu apart; off borders of %zu %zu apart, worst %.2f/255 at %u, %u\n", d.seen,
                  d.apart, d.inner, d.inner_apart, 255 * d.largest, (unsigned)d.x, (unsigned)d.y);
    assert_true(d.inner_apart * (around ? 500 : 5000) <= d.inner);
    assert_true(d.apart * (around ? 10 : 50) <= d.seen);
}

static void expect_sameness(const picture_difference *d)
{
    assert_true((double)d->beyond_step <= 1e-3 * (double)d->fogged);
    assert_true(d->largest <= 3. / 255);
}

/* ---- demo scenes ----------------------------------------------------------------------------- */

static void render_demo(const nebel_scene *scene, const nebel_camera *camera, picture_pair *pair)
{
    const nebel_scene_data *const data = nebel_get_scene_data(scene);
    nebel_particle *made = NULL;
    nb_gl context;
    picture_particles particles = {.count = data->particle_count};
    assert_int_equal(nebel_generate_scene_particles(scene, &made), NEBEL_OK);
    nebel_lighting *const fog = picture_commit_scene(scene, 1);
    particles.others = picture_commit_scene(scene, 0);
    particles.list = made;
    pass_open(&context, NB_GL_330);
    const int objects = pass_count_objects();
    picture_render_particles(data, fog, &particles, camera, 1, pair);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    nebel_release_lighting(fog);
    nebel_release_lighting(particles.others);
    nebel_free_scene_particles(scene, made);
}

static void check_demo(const nebel_scene *scene, const char *name)
{
    /* Each pixel of this cloud walks through dense noise, over and over: a quarter of them shows the same. */
    const uint32_t coarse = strcmp(name, "cloud.json") == 0 ? 2 : 1, width = DEMO_WIDTH / coarse;
    picture_pair pair = picture_make(width, DEMO_HEIGHT / coarse);
    const nebel_scene_data *const data = nebel_get_scene_data(scene);
    render_demo(scene, &data->camera, &pair);
    const picture_difference d = check(name, &pair);
    expect_sameness(&d);
    assert_int_equal(pair.messages, 0);                /* no ray had more loops than the driver allows to all passes */
    if (data->volume_count + data->particle_count > 0) /* else the scene shows factors alone */
        assert_true(d.fogged > width * pair.height / 16);
    assert_true(d.color < .02);
    expect_same_light(&pair, 0);
    picture_free(&pair);
}

/* All around the same place. */
static void check_panorama(const nebel_scene *scene, const char *name)
{
    char title[128];
    picture_pair pair = picture_make(ROUND_WIDTH, ROUND_HEIGHT);
    nebel_camera camera = nebel_get_scene_data(scene)->camera;
    camera.projection = NEBEL_PROJECTION_PANORAMA;
    render_demo(scene, &camera, &pair);
    snprintf(title, sizeof title, "%s-around", name);
    const picture_difference d = check(title, &pair);
    expect_sameness(&d);
    assert_true(d.color < .02);
    expect_same_light(&pair, 1);
    picture_free(&pair);
}

/* Models and voxels that are made or installed, not kept, may be missing. Every fourth scene is seen all around, too, for
 * which the driver compiles everything anew. */
static int try_demo(const char *path, int number)
{
    nebel_scene *scene = NULL;
    const char *const name = strrchr(path, '/') + 1;
    const nebel_result loaded = nebel_load_scene(path, &(nebel_scene_desc){0}, &scene);
    if (loaded == NEBEL_ERROR_FILE) {
        print_message("%s: left out: %s\n", name, nebel_result_text(loaded));
        return 0;
    }
    assert_int_equal(loaded, NEBEL_OK);
    const nebel_result models = nebel_load_scene_models(scene);
    if (models == NEBEL_OK && nebel_get_scene_data(scene)->planet_count > 0) {
        print_message("%s: left out: test_picture_planet_gl compares planets\n", name);
        nebel_destroy_scene(scene);
        return 0;
    }
    if (models == NEBEL_OK) {
        check_demo(scene, name);
        if (number % 4 == 0) check_panorama(scene, name);
    } else {
        print_message("%s: left out: %s\n", name, nebel_result_text(models));
    }
    nebel_destroy_scene(scene);
    return models == NEBEL_OK;
}

static void test_demo_scenes(void **state)
{
    (void)state;
    glob_t paths;
    int count = 0;
    assert_int_equal(glob(NEBEL_SOURCE "/examples/scenes/*.json", 0, NULL, &paths), 0);
    for (size_t i = 0; i < paths.gl_pathc; i++) count += try_demo(paths.gl_pathv[i], count);
    globfree(&paths);
    assert_true(count >= 3);
}

/* ---- random fog ------------------------------------------------------------------------------ */

static const float box_positions[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                          {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
static const uint32_t box_indices[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

static void shape_box(const float size[3], nebel_mesh *mesh, float positions[8][3])
{
    for (int v = 0; v < 8; v++) {
        for (int k = 0; k < 3; k++) positions[v][k] = size[k] * box_positions[v][k];
    }
    *mesh = (nebel_mesh){.positions = positions[0],
                         .indices = box_indices,
                         .vertex_count = 8,
                         .triangle_count = 12,
                         .base_color = {.5f, .6f, .7f},
                         .texture = -1};
}

/* A floor and some boxes around the fog's middle. No sun: only fog is compared. */
static nebel_scene_data scene_around(const double middle[3], nebel_mesh meshes[4], float positions[4][8][3])
{
    static const float sizes[4][3] = {{60, .5f, 60}, {2, 3, 1}, {1, 1, 4}, {3, .7f, 1}};
    static const double places[4][3] = {{0, -6, 0}, {3, -1, -4}, {-5, 0, 2}, {1, 4, 6}};
    for (int m = 0; m < 4; m++) {
        shape_box(sizes[m], &meshes[m], positions[m]);
        for (int k = 0; k < 3; k++) meshes[m].origin[k] = middle[k] + places[m][k];
    }
    return (nebel_scene_data){.background = {.3, .4, .5}, .ambient = {1, 1, 1}, .mesh_count = 4, .meshes = meshes};
}

/* With point lights it scatters light; sun NULL: there is none. */
static nebel_lighting *commit(random_fog *random, const nebel_sun *sun, size_t light_count,
                              const nebel_light *point_lights)
{
    uint64_t numbers = random->seed;
    nebel_lighting_desc lights = random_fog_lights(random);
    if (sun != NULL) lights.sun = *sun;
    lights.lights = point_lights;
    lights.light_count = light_count;
    if (light_count > 0) random_fog_light(random, &numbers);
    return fog_light(&lights, random->volumes, random->count);
}

/* Every fourth scene has point lights: a ball beside the boxes and a spot between them. Mesa's software ends the
 * loops of very many volumes in their light, and of those that cover others in that of both. */
static size_t place_lights(const random_fog *fog, int number, nebel_light lights[2])
{
    static const double places[2][3] = {{6, 5, 3}, {-1, 2, -2}};
    for (int i = 0; i < 2; i++) {
        lights[i] = (nebel_light){.intensity = {20, 15, 10}, .radius = .1 * i, .direction = {1, -2, -1}};
        for (int k = 0; k < 3; k++) lights[i].position[k] = fog->shift[k] + places[i][k];
    }
    lights[1].type = NEBEL_LIGHT_SPOT;
    lights[1].inner_angle = 20;
    lights[1].outer_angle = 50;
    if (number % 4 != 1 || fog->kind == RANDOM_FOG_MANY) return 0;
    return fog->kind == RANDOM_FOG_EXCLUDE ? 1 : 2;
}

/* Every third camera is orthographic, every fifth sees all around. */
static nebel_camera camera_for(const random_fog *fog, int number)
{
    nebel_camera camera = {.up = {0, 1, 0}, .vertical_fov = 60, .view_height = 24};
    const double turn = .9 * number, far = number % 2 == 0 ? 22 : 4;
    const double from[3] = {far * cos(turn), -3 + .2 * number, far * sin(turn)};
    for (int k = 0; k < 3; k++) {
        camera.position[k] = fog->shift[k] + from[k];
        camera.look_at[k] = fog->shift[k] + (far < 5 ? 2 * from[k] * (k != 1) : 0);
    }
    if (number % 3 == 2) camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    if (number % 5 == 3) camera.projection = NEBEL_PROJECTION_PANORAMA;
    return camera;
}

/* sun NULL: there is none. */
static picture_difference check_random(random_fog *random, const nebel_sun *sun, const char *kind, int number)
{
    static float positions[4][8][3];
    nebel_mesh meshes[4];
    char name[64];
    nb_gl context;
    nebel_light lights[2];
    const size_t light_count = sun != NULL ? 0 : place_lights(random, number, lights);
    nebel_lighting *const fog = commit(random, sun, light_count, lights);
    nebel_scene_data scene = scene_around(random->shift, meshes, positions);
    scene.light_count = light_count;
    scene.lights = lights;
    scene.has_sun = sun != NULL;
    for (int k = 0; k < 3 && sun != NULL; k++) {
        scene.sun_direction[k] = sun->direction[k];
        scene.sun_irradiance[k] = sun->irradiance[k];
    }
    const nebel_camera camera = camera_for(random, number);
    picture_pair pair = picture_make(RANDOM_WIDTH, RANDOM_HEIGHT);
    pass_open(&context, number % 2 == 0 ? NB_GL_330 : NB_GL_300ES);
    picture_render(&scene, fog, &camera, 1, &pair);
    pass_close(&context);
    snprintf(name, sizeof name, "%s-%d", kind, number);
    const picture_difference d = check(name, &pair);
    picture_free(&pair);
    nebel_release_lighting(fog);
    return d;
}

/* The scenes are small, so that their pixels are counted together. */
static void count(picture_difference *all, const picture_difference *d)
{
    all->fogged += d->fogged;
    all->beyond_step += d->beyond_step;
    all->largest = fmax(all->largest, d->largest);
}

static void expect_all(const picture_difference *all, int scenes)
{
    print_message("all: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255\n", all->fogged, all->beyond_step,
                  255 * all->largest);
    assert_true(all->fogged > (size_t)scenes * RANDOM_WIDTH * RANDOM_HEIGHT / 4);
    expect_sameness(all);
}

static void test_random_fog_around_boxes(void **state)
{
    (void)state;
    static random_fog random;
    picture_difference all = {.fogged = 0};
    const int scenes = report.folder != NULL ? REPORTED_SCENES : RANDOM_SCENES;
    for (int i = 0; i < scenes; i++) {
        random_fog_make(&random, (random_fog_kind)(i % RANDOM_FOG_KIND_COUNT), (uint64_t)i);
        const picture_difference d = check_random(&random, NULL, "random", i);
        count(&all, &d);
    }
    expect_all(&all, scenes);
}

/* Voxels alone, and among others of any shape and profile. */
static void test_random_grids_around_boxes(void **state)
{
    (void)state;
    static random_fog random;
    picture_difference all = {.fogged = 0};
    for (int i = 0; i < GRID_SCENES; i++) {
        nebel_grid *grids[RANDOM_GRIDS];
        random_grids_make(&random, (random_fog_kind)(i % RANDOM_FOG_MANY), (uint64_t)i, grids);
        const picture_difference d = check_random(&random, NULL, "grids", i);
        count(&all, &d);
        random_grids_release(grids);
    }
    expect_all(&all, GRID_SCENES);
}

/* The boxes cut shadows out of it. */
static void test_sunlit_fog_around_boxes(void **state)
{
    (void)state;
    static random_fog random;
    picture_difference all = {.fogged = 0};
    for (int i = 0; i < SUNLIT_SCENES; i++) {
        uint64_t numbers = (uint64_t)i + 1;
        random_fog_make(&random, (random_fog_kind)i, (uint64_t)i);
        random_fog_light(&random, &numbers);
        const nebel_sun sun = {{dice(&numbers, -1, 1), dice(&numbers, .3, 1), dice(&numbers, -1, 1)}, {3, 2.5, 2}};
        const picture_difference d = check_random(&random, &sun, "sunlit", i);
        count(&all, &d);
    }
    expect_all(&all, SUNLIT_SCENES);
}

enum { BARS = 5 };

/* Upright bars on a wide plain. */
static void make_bars(nebel_mesh meshes[1 + BARS], float positions[1 + BARS][8][3])
{
    static const float plain[3] = {2000, .5f, 2000}, bar[3] = {.4f, 4, .4f};
    static const double places[BARS][2] = {{2.5, 3}, {-.5, 4}, {3.5, -2}, {-3, 1}, {.5, -4}};
    shape_box(plain, &meshes[0], positions[0]);
    meshes[0].origin[1] = -2;
    for (int i = 0; i < BARS; i++) {
        shape_box(bar, &meshes[1 + i], positions[1 + i]);
        meshes[1 + i].origin[0] = places[i][0];
        meshes[1 + i].origin[2] = places[i][1];
    }
}

/* Dense fog, the sun low and nearly in view: many rays run along the borders of shadows. */
static void test_borders_of_shadows_in_dense_fog(void **state)
{
    (void)state;
    static float positions[1 + BARS][8][3];
    static random_fog dense = {.count = 1,
                               .volumes = {{.shape = {.type = NEBEL_SHAPE_BOX, .min = {-5, -1.5, -5}, .max = {5, 3, 5}},
                                            .extinction = {1.2, 1.4, 1.6},
                                            .albedo = {.9, .9, .9},
                                            .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4}}}};
    const nebel_sun sun = {{-.62, .24, -.72}, {10, 8, 6}};
    const nebel_camera camera = {
        .position = {8, 1.2, 15}, .look_at = {-.5, .8, 0}, .up = {0, 1, 0}, .vertical_fov = 38};
    nebel_mesh meshes[1 + BARS];
    nebel_scene_data scene = {.mesh_count = 1 + BARS, .meshes = meshes, .has_sun = 1};
    nb_gl context;
    make_bars(meshes, positions);
    for (int k = 0; k < 3; k++) {
        scene.sun_direction[k] = sun.direction[k];
        scene.sun_irradiance[k] = sun.irradiance[k];
    }
    nebel_lighting *const fog = commit(&dense, &sun, 0, NULL);
    picture_pair pair = picture_make(DEMO_WIDTH, DEMO_HEIGHT);
    pass_open(&context, NB_GL_330);
    picture_render(&scene, fog, &camera, 1, &pair);
    pass_close(&context);
    const picture_difference d = check("borders", &pair);
    assert_true(d.fogged > DEMO_WIDTH * DEMO_HEIGHT / 4);
    assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
    assert_true(d.largest <= 5. / 255); /* of a ray that lies in a border itself, within a texel */
    picture_free(&pair);
    nebel_release_lighting(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_demo_scenes),
        cmocka_unit_test(test_random_fog_around_boxes),
        cmocka_unit_test(test_random_grids_around_boxes),
        cmocka_unit_test(test_sunlit_fog_around_boxes),
        cmocka_unit_test(test_borders_of_shadows_in_dense_fog),
    };
    report = picture_report_open("nebel: OpenGL beside the CPU");
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    picture_report_close(&report);
    return failed;
}
