/* A first opinion of OpenGL in one process and one context: small pictures that take every pass of the scene renderer, each
 * against the CPU. What the passes promise in full is in the suites with the label `gl`. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pass_help.h"
#include "picture_help.h"

#include <nebel/scene.h>

enum { WIDTH = 48, HEIGHT = 32, BOXES = 3 };

/* ---- scenes: fog in JSON, and the same three boxes in all of them -------------------------------- */

#define CAMERA                                                                                                         \
    "\"camera\":{\"position\":[1,3,11],\"look_at\":[0,1,0],\"vertical_fov\":45},\"background\":[0.1,0.2,0.4],"
#define SUN "\"sun\":{\"direction\":[0.6,0.7,0.4],\"irradiance\":[3,2.8,2.5]},"
#define PLANET "\"planet\":{\"model\":\"physical\",\"preset\":\"earth\""
#define BALL "\"shape\":{\"type\":\"sphere\",\"center\":[-1,1.5,1],\"radius\":2},"
#define BOX "\"shape\":{\"type\":\"box\",\"min\":[-4,0,-3],\"max\":[4,3,3]},"

typedef struct smoke {
    const char *name, *text;
    nebel_projection projection;
    nebel_method method;
    nebel_gl_method gl_method;
    double tolerance; /* of the CPU; 0: 1e-4 */
    int alone;        /* without the boxes */
    int particles;    /* are drawn as such, not as fog */
    uint32_t samples; /* of a pixel; 0: 1 */
} smoke;

static const smoke smokes[] = {
    {.name = "shapes and profiles",
     .text =
         "{\"nebel\":1," CAMERA "\"fog\":["
         "{\"shape\":{\"type\":\"world\"},\"density\":{\"type\":\"height\",\"scale_height\":2},\"extinction\":0.03,"
         "\"source\":[0.4,0.5,0.6]},"
         "{" BALL
         "\"density\":{\"type\":\"radial\",\"power\":2},\"extinction\":[0.5,0.7,0.9],\"source\":[0.9,0.4,0.2]},"
         "{\"shape\":{\"type\":\"cone\",\"from\":[2,0,0],\"to\":[2,3,0],\"radius_from\":1.5,\"radius_to\":0.3},"
         "\"density\":{\"type\":\"soft_edge\",\"distance\":0.4},\"extinction\":1,\"source\":[0.2,0.8,0.3]},"
         "{\"shape\":{\"type\":\"box\",\"min\":[-2,0,0],\"max\":[0,1,3]},\"operation\":\"exclude\",\"priority\":1}]}",
     .samples = 4},
    {.name = "sun, surfaces and their shafts",
     .text = "{\"nebel\":1," CAMERA SUN "\"ambient\":[0.1,0.15,0.2],\"fog\":[{" BOX
             "\"extinction\":0.2,\"albedo\":[0.9,0.8,0.7],\"phase\":{\"type\":\"henyey_greenstein\",\"g\":0.5}},"
             "{" BALL "\"extinction\":0.6,\"albedo\":0.9},"
             "{\"shape\":{\"type\":\"box\",\"min\":[-2.5,1,0],\"max\":[1,3,2]},\"operation\":\"exclude\",\"priority\":"
             "1}]}"},
    {.name = "all around",
     .text = "{\"nebel\":1,"
             "\"camera\":{\"position\":[3,1,2],\"look_at\":[0,1,0]}," SUN "\"fog\":[{" BOX
             "\"extinction\":0.2,\"albedo\":0.9}]}",
     .projection = NEBEL_PROJECTION_PANORAMA},
    {.name = "point lights",
     .text =
         "{\"nebel\":1," CAMERA
         "\"lights\":[{\"type\":\"point\",\"position\":[-1.5,2.5,2],\"intensity\":[9,8,6],\"radius\":0.1},"
         "{\"type\":\"spot\",\"position\":[3,4,2],\"direction\":[-0.4,-1,-0.3],\"intensity\":20,\"outer_angle\":35}],"
         "\"fog\":[{" BOX "\"extinction\":0.15,\"albedo\":0.9}]}"},
    {.name = "voxels in sunlight, in haze",
     .text =
         "{\"nebel\":1," CAMERA SUN "\"fog\":[{" BOX
         "\"extinction\":1.5,\"albedo\":0.8,\"density\":{\"type\":\"noise\",\"size\":[16,8,12],"
         "\"cells\":[3,2,3],\"octaves\":2,\"coverage\":0.6,\"seed\":3}},"
         "{\"shape\":{\"type\":\"box\",\"min\":[-40,-1,-40],\"max\":[40,9,40]},\"extinction\":0.01,\"albedo\":0.9}]}"},
    {.name = "ambient light by direction",
     .text =
         "{\"nebel\":1," CAMERA "\"ambient\":{\"type\":\"gradient\",\"zenith\":[0.2,0.4,0.9],\"horizon\":[0.9,0.8,0.7],"
         "\"ground\":[0.1,0.1,0]},"
         "\"fog\":[{" BALL "\"extinction\":0.5,\"albedo\":0.9,\"phase\":{\"type\":\"henyey_greenstein\",\"g\":0.7}}]}"},
    {.name = "light scattered more than once",
     .text = "{\"nebel\":1," CAMERA SUN "\"fog\":[{" BALL
             "\"extinction\":2,\"albedo\":0.99}],\"multiple_scattering\":{\"model\":\"diffusion\"}}"},
    {.name = "particles",
     .text = "{\"nebel\":1," CAMERA SUN "\"fog\":[],\"nebula\":[{" BALL
             "\"density\":{\"type\":\"radial\",\"power\":2},\"count\":60,\"seed\":1,"
             "\"radius_range\":[0.3,0.6],\"absorption\":[0.3,0.4,0.5],\"emission\":0.3,\"colors\":[[0.9,0.3,0.2],[0.2,"
             "0.5,0.9]]}]}",
     .particles = 1},
    {.name = "the same as fog",
     .text = "{\"nebel\":1," CAMERA "\"fog\":[],\"nebula\":[{" BALL
             "\"density\":{\"type\":\"radial\",\"power\":2},\"count\":60,\"seed\":1,"
             "\"radius_range\":[0.3,0.6],\"absorption\":[0.3,0.4,0.5],\"emission\":0.3,\"colors\":[[0.9,0.3,0.2],[0.2,"
             "0.5,0.9]]"
             "}]}"},
    {.name = "fog at vertices",
     .text = "{\"nebel\":1," CAMERA SUN "\"fog\":[{" BOX "\"extinction\":0.2,\"source\":[0.5,0.6,0.7]}]}",
     .method = NEBEL_METHOD_VERTEX,
     .gl_method = NEBEL_GL_METHOD_VERTEX},
    {.name = "linear fog",
     .text = "{\"nebel\":1," CAMERA SUN "\"fog\":[]}",
     .method = NEBEL_METHOD_LINEAR,
     .gl_method = NEBEL_GL_METHOD_LINEAR},
    {.name = "air and fog",
     .text =
         "{\"nebel\":1,\"camera\":{\"position\":[0,20,60],\"look_at\":[0,22,0],\"vertical_fov\":50}," SUN PLANET "},"
         "\"fog\":[{\"shape\":{\"type\":\"sphere\",\"center\":[0,30,0],\"radius\":15},\"extinction\":0.1,\"albedo\":0."
         "9}]}",
     .alone = 1},
    {.name = "clouds",
     .text =
         "{\"nebel\":1,\"camera\":{\"position\":[0,400,0],\"look_at\":[900,600,-900],\"vertical_fov\":50}," SUN PLANET
         ",\"clouds\":[{}]},\"fog\":[]}",
     .tolerance = NEBEL_DEFAULT_TOLERANCE, /* that OpenGL takes for clouds */
     .alone = 1},
    {.name = "a textured planet",
     .text = "{\"nebel\":1,\"camera\":{\"position\":[9e6,3e6,16e6],\"look_at\":[0,0,0],\"vertical_fov\":46}," SUN
             "\"planet\":{\"model\":\"textured\",\"center\":[0,0,0],\"radius\":6.4e6,\"clouds\":[{\"height\":40e3}],"
             "\"atmosphere\":{\"height\":160e3,\"brightness\":0.3,\"ramp\":[\"#000000\",\"#5c98ff\",\"#1848c0\"]}},"
             "\"fog\":[]}",
     .alone = 1},
};

static void write_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level;
    (void)user;
    print_message("%d: %s\n", (int)result, message);
}

static nebel_scene *parse(const char *text)
{
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {write_message, NULL}};
    assert_int_equal(nebel_parse_scene(text, strlen(text), "smoke.json", &desc, &scene), NEBEL_OK);
    return scene;
}

/* A floor, a block on it and a beam over it. */
static void make_boxes(nebel_mesh meshes[BOXES], float positions[BOXES][8][3])
{
    static const uint32_t indices[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    static const float bounds[BOXES][2][3] = {
        {{-30, -1, -30}, {30, 0, 30}}, {{-1, 0, -2}, {1, 2, -1}}, {{-3, 2, .5f}, {3, 2.4f, 1}}};
    for (size_t m = 0; m < BOXES; m++) {
        for (size_t v = 0; v < 8; v++)
            for (size_t k = 0; k < 3; k++) positions[m][v][k] = bounds[m][v >> k & 1][k];
        meshes[m] = (nebel_mesh){.positions = positions[m][0],
                                 .indices = indices,
                                 .vertex_count = 8,
                                 .triangle_count = 12,
                                 .base_color = {.5f, .6f, .7f},
                                 .texture = -1};
    }
}

/* ---- both renderers ------------------------------------------------------------------------------ */

static const nebel_factor_desc factor = {
    .mode = NEBEL_FACTOR_LINEAR, .stage = NEBEL_STAGE_PIXEL, .start = 4, .end = 20, .color = {.5, .6, .7}};

static void render_cpu(const nebel_scene_data *data, nebel_lighting *fog, const smoke *s, const nebel_camera *camera,
                       picture_pair *pair)
{
    nebel_renderer *renderer = NULL;
    const nebel_frame_desc frame = {.camera = *camera,
                                    .width = WIDTH,
                                    .height = HEIGHT,
                                    .samples = s->samples > 0 ? s->samples : 1,
                                    .tolerance = pair->tolerance};
    assert_int_equal(nebel_create_cpu_renderer(data, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, s->method, &(nebel_method_desc){.factor = &factor}), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &pair->cpu), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

static void render_gl(const nebel_scene *scene, const nebel_scene_data *data, nebel_lighting *fog, const smoke *s,
                      const nebel_camera *camera, picture_pair *pair)
{
    nebel_gl_renderer *renderer = NULL;
    nebel_particle *particles = NULL;
    nebel_lighting *others = NULL;
    const nebel_gl_frame_desc frame = {.camera = *camera,
                                       .width = WIDTH,
                                       .height = HEIGHT,
                                       .samples = s->samples > 0 ? s->samples : 1,
                                       .method = s->gl_method,
                                       .factor = &factor,
                                       .clouds_by_processor = 1};
    const nebel_gl_planes planes = {pair->gl.color, pair->gl.transmittance, pair->gl.in_scattering, pair->gl.depth,
                                    pair->gl.normal};
    assert_int_equal(nebel_create_gl_renderer(data, fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    if (s->particles) {
        assert_int_equal(nebel_generate_scene_particles(scene, &particles), NEBEL_OK);
        others = picture_commit_scene(scene, 0);
        assert_int_equal(nebel_set_gl_renderer_particles(renderer, particles, data->particle_count), NEBEL_OK);
        assert_int_equal(nebel_set_gl_renderer_lighting(renderer, others), NEBEL_OK);
    }
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &planes), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
    nebel_release_lighting(others);
    nebel_free_scene_particles(scene, particles);
}

static float brightest(const picture_pair *pair)
{
    float most = 0;
    for (size_t i = 0; i < 3 * (size_t)WIDTH * HEIGHT; i++) most = fmaxf(most, pair->cpu.color[i]);
    return most;
}

/* Of 1,536 pixels two may be apart, and eight in 1,000 lie at borders where light differs. */
static void compare(const smoke *s)
{
    nebel_mesh meshes[BOXES];
    float positions[BOXES][8][3];
    nebel_scene *const scene = parse(s->text);
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    if (s->tolerance > 0) pair.tolerance = s->tolerance;
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    nebel_lighting *const fog = picture_commit_scene(scene, 1);
    nebel_scene_data data = *nebel_get_scene_data(scene);
    nebel_camera camera = data.camera;
    camera.projection = s->projection;
    make_boxes(meshes, positions);
    if (!s->alone) data.meshes = meshes, data.mesh_count = BOXES;
    render_cpu(&data, fog, s, &camera, &pair);
    render_gl(scene, &data, fog, s, &camera, &pair);
    const double shown = picture_shown_apart(&pair), largest = picture_largest_light(&pair);
    const picture_difference d = picture_compare(&pair, largest > 0 ? largest : 1);
    print_message("%s: of 1000 pixels %.1f are shown 2/255 apart; of %zu with fog %zu are 1/255 apart\n", s->name,
                  1e3 * shown, d.fogged, d.beyond_step);
    assert_true(brightest(&pair) > .1f);
    assert_true(d.beyond_step <= 2);
    assert_true(shown <= .008);
    picture_free(&pair);
    nebel_release_lighting(fog);
    nebel_destroy_scene(scene);
}

static void test_every_pass_draws_what_the_cpu_draws(void **state)
{
    (void)state;
    nb_gl context;
    pass_open(&context, NB_GL_330);
    for (size_t i = 0; i < sizeof smokes / sizeof *smokes; i++) {
        const int objects = pass_count_objects();
        compare(&smokes[i]);
        assert_int_equal(pass_count_objects(), objects);
        pass_expect_no_errors();
    }
    pass_close(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_pass_draws_what_the_cpu_draws)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
