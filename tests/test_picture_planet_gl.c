/* Planets in OpenGL are those of the CPU: the scenes of planets, a flight from the ground into space, fog and models in air. With
 * an argument all of the scenes and heights, in pictures so many times wider. */
#include "pass_help.h"
#include "picture_help.h"
#include "planet_help.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale = 1;
static int all;

static void compare(const char *name, const picture_pair *pair)
{
    const double shown = picture_shown_apart(pair), fog = picture_fog_apart(pair), depth = picture_depth_apart(pair, 1);
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have other fog or air, %.2f another depth\n",
                  name, 1e3 * shown, 1e3 * fog, 1e3 * depth);
    assert_true(picture_largest_light(pair) > .01);
    assert_true(shown <= 1e-3 && fog <= 1e-3 && depth <= 5e-3);
}

static picture_pair make_pair(uint32_t width, uint32_t height)
{
    return picture_make(scale * width, scale * height);
}

static void render(const nebel_scene_data *data, nebel_lighting *fog, const nebel_camera *camera, picture_pair *pair)
{
    const int objects = pass_count_objects();
    picture_render(data, fog, camera, 1, pair);
    assert_int_equal(pass_count_objects(), objects);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

static nebel_scene *load(const char *name)
{
    char path[512];
    nebel_scene *scene = NULL;
    snprintf(path, sizeof path, NEBEL_SOURCE "/examples/scenes/%s", name);
    assert_int_equal(nebel_load_scene(path, &(nebel_scene_desc){0}, &scene), NEBEL_OK);
    if (nebel_load_scene_models(scene) == NEBEL_OK && nebel_load_scene_planets(scene) == NEBEL_OK) return scene;
    print_message("%s: left out: its models are made, not kept\n", name);
    nebel_destroy_scene(scene);
    return NULL;
}

static void check_scene(const char *name, int around)
{
    nebel_scene *const scene = load(name);
    if (scene == NULL) return;
    const nebel_scene_data *const data = nebel_get_scene_data(scene);
    nebel_camera camera = data->camera;
    if (around) camera.projection = NEBEL_PROJECTION_PANORAMA;
    picture_pair pair = around ? make_pair(96, 48) : make_pair(96, 54);
    nebel_lighting *const fog = picture_commit_scene(scene, 1);
    render(data, fog, &camera, &pair);
    compare(around ? "all around" : name, &pair);
    picture_free(&pair);
    nebel_release_lighting(fog);
    nebel_destroy_scene(scene);
}

static void scenes_are_the_same(void **state)
{
    (void)state;
    nb_gl context;
    pass_open(&context, NB_GL_330);
    check_scene("sunset.json", 0);
    check_scene("terminator.json", 0);
    if (all) {
        check_scene("noon.json", 0);
        check_scene("mars.json", 0);
        check_scene("sunset.json", 1);
    }
    pass_close(&context);
}

/* ---- heights --------------------------------------------------------------------------------- */

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_planet planet;
    nebel_scene_data scene;
} world;

static void make_world(const char *name, double elevation, world *w)
{
    const double angle = elevation * acos(-1) / 180, sun[3] = {.3 * cos(angle), sin(angle), -.95 * cos(angle)};
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere(name), .sun_angular_diameter = .53}};
    assert_int_equal(nebel_create_atmosphere(&w->planet.atmosphere_desc, &w->atmosphere), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->scene =
        (nebel_scene_data){.has_sun = 1, .sun_irradiance = {20, 19, 18}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, sun, sizeof sun);
}

static void a_flight_is_the_same(void **state)
{
    (void)state;
    static const double heights[] = {-3, 2e4, 2e7, 2, 300, 9e4, 2e5, 3e6};
    nb_gl context;
    world w;
    make_world("earth", 8, &w);
    pass_open(&context, NB_GL_300ES);
    for (int i = 0; i < (all ? 8 : 3); i++) {
        char name[64];
        const double dip =
            heights[i] > 0 ? acos(w.planet.atmosphere_desc.radius / (w.planet.atmosphere_desc.radius + heights[i])) : 0;
        nebel_camera camera = planet_camera(heights[i], -dip);
        if (i == 1) camera.projection = NEBEL_PROJECTION_PANORAMA;
        picture_pair pair = make_pair(96, 48);
        render(&w.scene, NULL, &camera, &pair);
        snprintf(name, sizeof name, "from %g m", heights[i]);
        compare(name, &pair);
        picture_free(&pair);
    }
    pass_close(&context);
    nebel_destroy_atmosphere(w.atmosphere);
}

/* ---- fog ------------------------------------------------------------------------------------- */

static const float wall[4][3] = {{-400, -20, 0}, {400, -20, 0}, {400, 300, 0}, {-400, 300, 0}};
static const uint32_t wall_indices[6] = {0, 1, 2, 0, 2, 3};

/* A bank of fog far away in air, ground fog, and a wall that shades both and the ground. */
static void fog_lies_in_air(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world("earth", 15, &w);
    pass_open(&context, NB_GL_330);
    nebel_lighting *const fog = planet_fog(w.scene.sun_direction);
    const nebel_mesh mesh = {.origin = {300, 0, -2500},
                             .positions = wall[0],
                             .indices = wall_indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .base_color = {.8f, .8f, .8f},
                             .texture = -1};
    const nebel_camera camera = planet_camera(120, .05);
    picture_pair pair = make_pair(72, 48);
    if (all) {
        render(&w.scene, fog, &camera, &pair);
        compare("fog in air", &pair);
    }
    w.scene.mesh_count = 1;
    w.scene.meshes = &mesh;
    render(&w.scene, fog, &camera, &pair);
    compare("a wall in fog in air", &pair);
    picture_free(&pair);
    pass_close(&context);
    nebel_release_lighting(fog);
    nebel_destroy_atmosphere(w.atmosphere);
}

/* Rays to the horizon go through it level: the walk through fog is long, and air counts all along it. */
static void mist_bends_with_the_ground(void **state)
{
    (void)state;
    nb_gl context;
    nebel_scene *scene = NULL;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_load_scene(NEBEL_SOURCE "/examples/scenes/mist-sea.json", &(nebel_scene_desc){0}, &scene),
                     NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    nebel_lighting *const fog = picture_commit_scene(scene, 1);
    nebel_scene_data data = *nebel_get_scene_data(scene);
    data.mesh_count = 0;
    picture_pair pair = make_pair(64, 36);
    render(&data, fog, &data.camera, &pair);
    compare("mist without its hills", &pair);
    picture_free(&pair);
    nebel_release_lighting(fog);
    nebel_destroy_scene(scene);
    pass_close(&context);
}

/* ---- what is kept, and what is refused ------------------------------------------------------- */

/* Allocations of the size of a table. */
static void *count_large(size_t size, void *user)
{
    *(int *)user += size > 100000;
    return malloc(size);
}

static void release(void *memory, void *user)
{
    (void)user;
    free(memory);
}

static void the_table_stays_while_the_camera_turns(void **state)
{
    (void)state;
    int tables = 0;
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    make_world("toy", 30, &w);
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.host.allocator = {count_large, release, &tables}};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, NULL, &desc, &renderer), NEBEL_OK);
    nebel_gl_frame_desc frame = {.camera = planet_camera(20, 0), .width = 8, .height = 8, .samples = 1};
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    const int first = tables;
    assert_true(first > 0);
    frame.camera = planet_camera(20, .4);
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(tables, first);
    frame.camera = planet_camera(21, .4);
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(tables, 2 * first);
    w.scene.sun_irradiance[0] = 7;
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(tables, 3 * first);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_destroy_atmosphere(w.atmosphere);
}

static void keep(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    snprintf(user, 256, "%s", message);
}

static void expect_refusal(nebel_gl_renderer *renderer, const nebel_gl_frame_desc *frame, char *said, const char *words)
{
    assert_int_equal(nebel_gl_render_frame(renderer, frame), NEBEL_ERROR_UNSUPPORTED);
    if (strstr(said, words) == NULL) fail_msg("'%s' does not say '%s'", said, words);
}

static void what_is_not_drawn_is_refused_by_name(void **state)
{
    (void)state;
    char said[256] = "";
    nb_gl context;
    nebel_gl_renderer *renderer;
    world w;
    make_world("toy", 30, &w);
    pass_open(&context, NB_GL_330);
    const nebel_gl_renderer_desc desc = {.host.log = {keep, said}};
    assert_int_equal(nebel_create_gl_renderer(&w.scene, NULL, &desc, &renderer), NEBEL_OK);
    nebel_gl_frame_desc frame = {.camera = planet_camera(20, 0), .width = 8, .height = 8, .samples = 1};
    frame.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    frame.camera.view_height = 10;
    expect_refusal(renderer, &frame, said, "orthographic");
    frame.camera = planet_camera(20, 0);
    frame.method = NEBEL_GL_METHOD_VERTEX;
    expect_refusal(renderer, &frame, said, "method");
    frame.method = NEBEL_GL_METHOD_EXACT;
    const nebel_particle particle = {.center = {0, 20, -5}, .radius = 1, .extinction = {1, 1, 1}};
    assert_int_equal(nebel_set_gl_renderer_particles(renderer, &particle, 1), NEBEL_OK);
    expect_refusal(renderer, &frame, said, "particles");
    assert_int_equal(nebel_set_gl_renderer_particles(renderer, NULL, 0), NEBEL_OK);
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
    nebel_destroy_atmosphere(w.atmosphere);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_are_the_same),
        cmocka_unit_test(a_flight_is_the_same),
        cmocka_unit_test(fog_lies_in_air),
        cmocka_unit_test(mist_bends_with_the_ground),
        cmocka_unit_test(the_table_stays_while_the_camera_turns),
        cmocka_unit_test(what_is_not_drawn_is_refused_by_name),
    };
    all = argc > 1;
    if (all) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
