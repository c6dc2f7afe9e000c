/* Textured planets in OpenGL are those of the CPU: the scenes of them, eyes at all heights and of all kinds, fog and models
 * between the shells. With an argument in pictures so many times wider. */
#include "odd_state.h"
#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"

#include <nebel/planet.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale = 1;

static double largest_color(const picture_pair *pair)
{
    double most = 0;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++) most = fmax(most, (double)pair->cpu.color[i]);
    return most;
}

static void compare(const char *name, const picture_pair *pair)
{
    const double shown = picture_shown_apart(pair), depth = picture_depth_apart(pair, 0);
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have another depth\n", name, 1e3 * shown,
                  1e3 * depth);
    assert_true(largest_color(pair) > .1);
    assert_true(shown <= 1e-3 && depth <= 5e-3);
}

static void render(const nebel_scene_data *data, nebel_lighting *fog, const nebel_camera *camera, picture_pair *pair)
{
    const int objects = pass_count_objects();
    picture_render(data, fog, camera, 1, pair);
    assert_int_equal(pass_count_objects(), objects);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

static void check_scene(const char *name, double time)
{
    char path[512];
    nebel_scene *scene = NULL;
    picture_particles particles = {.count = 0};
    nebel_particle *list = NULL;
    snprintf(path, sizeof path, NEBEL_SOURCE "/examples/scenes/%s", name);
    assert_int_equal(nebel_load_scene(path, &(nebel_scene_desc){0}, &scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    const nebel_scene_data *const data = nebel_get_scene_data(scene);
    nebel_lighting *const fog = picture_commit_scene(scene, 1);
    particles.others = picture_commit_scene(scene, 0);
    particles.count = data->particle_count;
    assert_int_equal(nebel_generate_scene_particles(scene, &list), NEBEL_OK);
    particles.list = list;
    picture_pair pair = picture_make(96 * scale, 54 * scale);
    pair.time = time;
    picture_render_particles(data, fog, &particles, &data->camera, 1, &pair);
    compare(name, &pair);
    picture_free(&pair);
    nebel_free_scene_particles(scene, list);
    nebel_release_lighting(particles.others);
    nebel_release_lighting(fog);
    nebel_destroy_scene(scene);
}

static void scenes_are_the_same(void **state)
{
    (void)state;
    nb_gl context;
    pass_open(&context, NB_GL_330);
    check_scene("planet-day.json", 100);
    check_scene("planet-night.json", 0);
    pass_close(&context);
}

/* ---- worlds ---------------------------------------------------------------------------------- */

typedef struct world {
    nebel_textured_planet *layers;
    nebel_planet planet;
    nebel_mesh mesh;
    nebel_scene_data scene;
} world;

/* Sizes that are no powers of two: their levels are means of parts of texels. */
static nebel_planet_map make_map(nebel_planet_map_type kind)
{
    static float texels[NEBEL_PLANET_MAP_TYPE_COUNT][90 * 45 * 3];
    const nebel_planet_map_desc desc = {.type = kind, .width = 90, .height = 45, .coverage = .4, .seed = 3};
    nebel_planet_map map = {.texels = texels[kind]};
    assert_int_equal(nebel_get_planet_map_size(&desc, &map), NEBEL_OK);
    assert_int_equal(nebel_generate_planet_map(&desc, texels[kind]), NEBEL_OK);
    return map;
}

static const float wall[4][3] = {{-.6f, -.5f, 0}, {.6f, -.5f, 0}, {.6f, .5f, 0}, {-.6f, .5f, 0}};
static const uint32_t wall_indices[6] = {0, 1, 2, 0, 2, 3};

/* A ball of `radius`, shells a fifth and two fifths of that above it, and air between them. */
static void make_world(double radius, world *w)
{
    const nebel_planet_map clouds = make_map(NEBEL_PLANET_MAP_CLOUDS), detail = make_map(NEBEL_PLANET_MAP_DETAIL);
    *w = (world){.mesh = {.origin = {0, 0, 1.3 * radius},
                          .positions = wall[0],
                          .indices = wall_indices,
                          .vertex_count = 4,
                          .triangle_count = 2,
                          .base_color = {.8f, .4f, .2f},
                          .texture = -1}};
    w->planet.textured_desc = (nebel_textured_planet_desc){
        .radius = radius,
        .rotation = {.2, .3, -.1, 1},
        .rotation_period = 100,
        .color_map = make_map(NEBEL_PLANET_MAP_GROUND),
        .cloud_shells =
            {{.height = .2 * radius,
              .rotation_period = 50,
              .coverage_map = clouds,
              .detail_map = detail,
              .uv_tiling = {2, -3, 4.5}},
             {.height = .4 * radius, .rotation_period = -70, .gain = .5, .coverage_map = clouds, .color = {1, .8, .6}}},
        .cloud_shell_count = 2,
        .atmosphere = {.height = .3 * radius, .brightness = .4}};
    assert_int_equal(nebel_create_textured_planet(&w->planet.textured_desc, &w->layers), NEBEL_OK);
    w->planet.model = NEBEL_PLANET_TEXTURED;
    w->planet.textured = w->layers;
    w->scene = (nebel_scene_data){.has_sun = 1,
                                  .sun_direction = {.6, .48, .64},
                                  .sun_irradiance = {3, 2.5, 2},
                                  .ambient = {.1, .12, .15},
                                  .background = {.2, .1, .3},
                                  .planet_count = 1,
                                  .planets = &w->planet,
                                  .meshes = &w->mesh};
}

static nebel_lighting *make_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 1, 2.2}, .radius = 1},
         .extinction = {.5, .7, 1},
         .source = {1, .5, .2}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 5}, .extinction = {.05, .04, .03}, .source = {.2, .3, .4}}};
    return fog_light(NULL, volumes, 2);
}

static nebel_camera camera_from(double x, double y, double z, nebel_projection projection, double size)
{
    return (nebel_camera){.position = {x, y, z},
                          .look_at = {.1 * x, .2 * y, 0},
                          .up = {0, 1, 0},
                          .projection = projection,
                          .vertical_fov = size,
                          .view_height = size};
}

/* Outside, between the shells, below them all, below the ground; parallel rays from a plane that cuts the shells. */
static void eyes_everywhere_see_the_same(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        nb_gl_language language;
    } contexts[] = {{"OpenGL", NB_GL_330}, {"OpenGL ES", NB_GL_300ES}};
    const struct {
        const char *name;
        nebel_camera camera;
        int models, clear;
    } views[] = {{"outside", camera_from(1, 3, 8, NEBEL_PROJECTION_PERSPECTIVE, 45), 1, 0},
                 {"between shells", camera_from(.5, 1, 2.4, NEBEL_PROJECTION_PERSPECTIVE, 80), 0, 0},
                 {"below all", camera_from(0, 2.01, .3, NEBEL_PROJECTION_PERSPECTIVE, 100), 0, 1},
                 {"in the planet", camera_from(.3, .4, 1.2, NEBEL_PROJECTION_PERSPECTIVE, 80), 0, 1},
                 {"all around", camera_from(.5, 1, 2.4, NEBEL_PROJECTION_PANORAMA, 0), 1, 0},
                 {"in parallel", camera_from(1, 3, 8, NEBEL_PROJECTION_ORTHOGRAPHIC, 7), 1, 0},
                 {"in parallel from within", camera_from(.2, .9, 1.5, NEBEL_PROJECTION_ORTHOGRAPHIC, 7), 0, 0}};
    world w;
    make_world(2, &w);
    nebel_lighting *const fog = make_fog();
    for (int i = 0; i < 2; i++) {
        nb_gl context;
        pass_open(&context, contexts[i].language);
        for (size_t k = i == 0 ? 0 : 1; k < sizeof views / sizeof *views; k += i == 0 ? 1 : 3) {
            picture_pair pair = picture_make(64 * scale, 32 * scale);
            pair.time = 17;
            w.scene.mesh_count = (size_t)views[k].models;
            render(&w.scene, views[k].clear ? NULL : fog, &views[k].camera, &pair);
            compare(views[k].name, &pair);
            picture_free(&pair);
        }
        pass_close(&context);
    }
    nebel_release_lighting(fog);
    nebel_destroy_textured_planet(w.layers);
}

/* Where squares of distances cancel: two metres above the ground of a planet as large as the Earth, and a hundred radii away. */
static void large_distances_keep_their_digits(void **state)
{
    (void)state;
    const double radius = 6.36e6, away = 100 * radius;
    const nebel_camera cameras[] = {
        {.position = {0, radius + 2, 0}, .look_at = {100, radius + 12, -60}, .up = {0, 1, 0}, .vertical_fov = 60},
        {.position = {0, 0, away}, .up = {0, 1, 0}, .vertical_fov = 1.3}};
    nb_gl context;
    world w;
    make_world(radius, &w);
    pass_open(&context, NB_GL_330);
    for (int i = 0; i < 2; i++) {
        picture_pair pair = picture_make(96 * scale, 48 * scale);
        render(&w.scene, NULL, &cameras[i], &pair);
        compare(i == 0 ? "from 2 m" : "from 600,000 km", &pair);
        picture_free(&pair);
    }
    pass_close(&context);
    nebel_destroy_textured_planet(w.layers);
}

/* ---- particles ------------------------------------------------------------------------------- */

/* Apart from each other, before the shells, cut by them, and behind the planet's edge. */
static void particles_lie_between_shells(void **state)
{
    (void)state;
    static const double centers[3][3] = {{-1.2, .2, 4}, {.4, 2.35, .9}, {2.5, .3, -3}};
    nebel_particle list[3];
    nebel_volume_desc volumes[3];
    nb_gl context;
    world w;
    make_world(2, &w);
    for (int i = 0; i < 3; i++) {
        list[i] = (nebel_particle){.radius = .5, .extinction = {1, 2, 3}, .emission = {.9, .6, .3}};
        memcpy(list[i].center, centers[i], sizeof centers[i]);
        volumes[i] = nebel_volume_from_particle(&list[i]);
    }
    nebel_lighting *const all = fog_light(NULL, volumes, 3);
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = camera_from(1, 3, 8, NEBEL_PROJECTION_PERSPECTIVE, 45);
    picture_pair pair = picture_make(96 * scale, 64 * scale);
    picture_render_particles(&w.scene, all, &(picture_particles){.list = list, .count = 3}, &camera, 1, &pair);
    compare("particles", &pair);
    picture_free(&pair);
    pass_close(&context);
    nebel_release_lighting(all);
    nebel_destroy_textured_planet(w.layers);
}

/* ---- time, state, refusals ------------------------------------------------------------------- */

typedef struct stage {
    nb_gl context;
    world w;
    nebel_gl_renderer *renderer;
    nebel_gl_frame_desc frame;
    char said[256];
} stage;

static void keep(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    snprintf(user, 256, "%s", message);
}

static void open_stage(stage *s)
{
    *s = (stage){
        .frame = {
            .camera = camera_from(1, 3, 8, NEBEL_PROJECTION_PERSPECTIVE, 45), .width = 24, .height = 16, .samples = 1}};
    make_world(2, &s->w);
    pass_open(&s->context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&s->w.scene, NULL, &(nebel_gl_renderer_desc){.host.log = {keep, s->said}},
                                              &s->renderer),
                     NEBEL_OK);
}

static void close_stage(stage *s)
{
    nebel_destroy_gl_renderer(s->renderer);
    pass_close(&s->context);
    nebel_destroy_textured_planet(s->w.layers);
}

static void shells_turn_and_return(void **state)
{
    (void)state;
    static float colors[3][3 * 24 * 16];
    static const double times[3] = {0, 35, 700 * 1e6}; /* the last is whole turns of all, far from 0 */
    double moved = 0, back = 0;
    stage s;
    open_stage(&s);
    for (int i = 0; i < 3; i++) {
        s.frame.time = times[i];
        assert_int_equal(nebel_gl_render_frame(s.renderer, &s.frame), NEBEL_OK);
        assert_int_equal(nebel_gl_read_planes(s.renderer, &(nebel_gl_planes){.color = colors[i]}), NEBEL_OK);
    }
    for (size_t i = 0; i < sizeof colors[0] / sizeof **colors; i++) {
        moved = fmax(moved, fabs((double)colors[1][i] - (double)colors[0][i]));
        back = fmax(back, fabs((double)colors[2][i] - (double)colors[0][i]));
    }
    assert_true(moved > .1);
    assert_true(back == 0);
    close_stage(&s);
}

static void the_state_stays(void **state)
{
    (void)state;
    static odd_snapshot before, after;
    stage s;
    odd o;
    open_stage(&s);
    odd_set(&o, 1, 1);
    odd_take(&before, 1);
    assert_int_equal(nebel_gl_render_frame(s.renderer, &s.frame), NEBEL_OK);
    odd_take(&after, 1);
    odd_expect_same(&before, &after);
    odd_delete(&o);
    close_stage(&s);
}

static void expect(stage *s, nebel_result result, const char *words)
{
    assert_int_equal(nebel_gl_render_frame(s->renderer, &s->frame), result);
    if (strstr(s->said, words) == NULL) fail_msg("'%s' does not say '%s'", s->said, words);
}

static void what_cannot_be_drawn_is_refused(void **state)
{
    (void)state;
    static float tall[16384];
    const double good = 5, bad[] = {(double)NAN, HUGE_VAL, 2e12};
    stage s;
    open_stage(&s);
    for (int i = 0; i < 3; i++) {
        s.frame.time = bad[i];
        expect(&s, NEBEL_ERROR_VALUE, "time");
    }
    s.frame.time = good;
    s.frame.method = NEBEL_GL_METHOD_VERTEX;
    expect(&s, NEBEL_ERROR_UNSUPPORTED, "method");
    s.frame.method = NEBEL_GL_METHOD_EXACT;
    nebel_textured_planet_desc desc = s.w.planet.textured_desc;
    desc.cloud_shells[0].coverage_map = (nebel_planet_map){.width = 1, .height = 16384, .channels = 1, .texels = tall};
    nebel_textured_planet *large;
    assert_int_equal(nebel_create_textured_planet(&desc, &large), NEBEL_OK);
    s.w.planet.textured = large;
    expect(&s, NEBEL_ERROR_LIMIT, "GL_MAX_TEXTURE_SIZE");
    expect(&s, NEBEL_ERROR_LIMIT, "GL_MAX_TEXTURE_SIZE");
    s.w.planet.textured = s.w.layers;
    assert_int_equal(nebel_gl_render_frame(s.renderer, &s.frame), NEBEL_OK);
    nebel_destroy_textured_planet(large);
    close_stage(&s);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_are_the_same),
        cmocka_unit_test(eyes_everywhere_see_the_same),
        cmocka_unit_test(large_distances_keep_their_digits),
        cmocka_unit_test(particles_lie_between_shells),
        cmocka_unit_test(shells_turn_and_return),
        cmocka_unit_test(the_state_stays),
        cmocka_unit_test(what_cannot_be_drawn_is_refused),
    };
    if (argc > 1) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
