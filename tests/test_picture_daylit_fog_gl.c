/* In OpenGL fog on planets has the light of its own place, as on the CPU: mist around the planet, balls of fog behind the
 * terminator, before it, in the shadow of a moon, and with light of their own. With an argument in pictures so many times wider. */
#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"
#include "planet_help.h"
#include "worlds_help.h"

#include <nebel/light.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale = 1;

/* Of pixels the share of which in-scattering is apart by more than 1/255 of the brightest, or by what the table of skies is off the
 * CPU's answer for a single place: 3.5e-3 of the brightest sky at the origin, .2. */
static double fog_apart(const picture_pair *pair)
{
    const double most = fmax(picture_largest_light(pair) / 255, 3.5e-3 * .2);
    return picture_in_scattering_apart(pair, most);
}

static void compare(const char *name, const picture_pair *pair)
{
    const double shown = picture_shown_apart(pair), fog = fog_apart(pair);
    double left = 0;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++)
        left = fmax(left, fabs((double)pair->cpu.transmittance[i] - (double)pair->gl.transmittance[i]));
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have other fog or air; T is off by %.1e\n", name,
                  1e3 * shown, 1e3 * fog, left);
    assert_true(shown <= 1e-3 && fog <= 1e-3 && left <= 1. / 255);
}

static picture_pair check(const char *name, const nebel_scene_data *scene, nebel_lighting *fog,
                          const nebel_camera *camera)
{
    picture_pair pair = picture_make(64 * scale, 36 * scale);
    const int objects = pass_count_objects();
    picture_render(scene, fog, camera, 1, &pair);
    assert_int_equal(pass_count_objects(), objects);
    compare(name, &pair);
    return pair;
}

/* ---- mist ------------------------------------------------------------------------------------ */

/* The scene, and with suns so low that the terminator is in the picture or near it. */
static void mist_seas_are_the_same(void **state)
{
    (void)state;
    static const double suns[3][3] = {{.55, .32, -.7}, {.3, .03, -.95}, {.995, .1, 0}};
    nb_gl context;
    pass_open(&context, NB_GL_330);
    for (int k = 0; k < 9; k++) {
        char name[64];
        nebel_scene *scene = NULL;
        nebel_sun sun = {.irradiance = {20, 20, 20}};
        memcpy(sun.direction, suns[k / 3], sizeof sun.direction);
        assert_true(nb_vector_make_unit(sun.direction));
        assert_int_equal(
            nebel_load_scene(NEBEL_SOURCE "/examples/scenes/mist-sea.json", &(nebel_scene_desc){0}, &scene), NEBEL_OK);
        assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
        assert_int_equal(nebel_set_scene_sun(scene, &sun), NEBEL_OK);
        nebel_lighting *const fog = picture_commit_scene(scene, 1);
        nebel_scene_data data = *nebel_get_scene_data(scene);
        memcpy(data.sun_direction, sun.direction, sizeof sun.direction);
        data.mesh_count = 0;
        const nebel_camera camera = nebel_get_scene_camera(scene, k % 3);
        snprintf(name, sizeof name, "frame %d of a sea of mist, sun %d", k % 3, k / 3);
        picture_pair pair = check(name, &data, fog, &camera);
        assert_true(picture_largest_light(&pair) > .01);
        picture_free(&pair);
        nebel_release_lighting(fog);
        nebel_destroy_scene(scene);
    }
    pass_close(&context);
}

/* ---- balls ----------------------------------------------------------------------------------- */

/* About the planet's middle, along the meridian of x = 0. */
static void turn(double radius, double angle, double place[3])
{
    const double up = place[1] + radius, ahead = -place[2];
    place[1] = up * cos(angle) - ahead * sin(angle) - radius;
    place[2] = -(up * sin(angle) + ahead * cos(angle));
}

/* Before the sky: shadows of fog on the ground are another matter. */
static nebel_camera turned_camera(const worlds *s, double angle)
{
    nebel_camera camera = planet_camera(25, .75);
    turn(s->planets[0].atmosphere_desc.radius, angle, camera.position);
    turn(s->planets[0].atmosphere_desc.radius, angle, camera.look_at);
    turn(0, angle, camera.up);
    return camera;
}

/* Light of their own that balls may have. */
enum { GLOW = 1, LIGHT = 2, DIFFUSE = 4 };

/* Lit as the scene's origin is, as programs do it. */
static nebel_lighting *make_ball(const worlds *s, double angle, const nebel_environment *sky, int own)
{
    static const double origin[1][3] = {{0, 0, 0}};
    static const nebel_diffusion_desc diffusion = {.max_cells = 4096};
    nebel_irradiance light;
    nebel_lighting_desc lights = {.sun = s->sun, .environment = *sky};
    nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 80, -70}, .radius = 20},
                              .extinction = {.02, .03, .04},
                              .albedo = {.9, .8, .7},
                              .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .3}};
    nebel_light point_light = {.position = {0, 80, -70}, .intensity = {300, 200, 100}, .radius = 1};
    turn(s->planets[0].atmosphere_desc.radius, angle, ball.shape.center);
    memcpy(point_light.position, ball.shape.center, sizeof point_light.position);
    for (int c = 0; c < 3 && (own & GLOW) != 0; c++) ball.emission[c] = .002 * (c + 1);
    assert_int_equal(nebel_compute_atmosphere_irradiance(s->atmospheres[0], &s->sun, 1, origin, 0, &light, 0),
                     NEBEL_OK);
    memcpy(lights.sun.irradiance, light.sun, sizeof light.sun);
    if ((own & LIGHT) != 0) lights.lights = &point_light, lights.light_count = 1;
    if ((own & DIFFUSE) != 0) lights.diffusion = &diffusion;
    return fog_light(&lights, &ball, 1);
}

/* On the CPU, in the middle of the picture, where the ball is. */
static double ball_light(const picture_pair *pair, int channel)
{
    const size_t middle = (size_t)pair->height / 2 * pair->width + pair->width / 2;
    return (double)pair->cpu.in_scattering[3 * middle + (size_t)channel];
}

typedef struct ball_case {
    const char *name;
    double degrees, sun[3], least, most; /* from the origin; red light of fog and air before it */
    int own, is_panorama;
} ball_case;

static void check_ball(const ball_case *b, const worlds *s, const nebel_environment *sky)
{
    const double angle = b->degrees * acos(-1) / 180;
    nebel_camera camera = turned_camera(s, angle);
    if (b->is_panorama) camera.projection = NEBEL_PROJECTION_PANORAMA;
    nebel_lighting *const fog = make_ball(s, angle, sky, b->own);
    picture_pair pair = check(b->name, &s->scene, fog, &camera);
    const double light = ball_light(&pair, 0);
    print_message("  the ball: %g %g %g\n", light, ball_light(&pair, 1), ball_light(&pair, 2));
    assert_true(b->is_panorama || (light >= b->least && light <= b->most));
    picture_free(&pair);
    nebel_release_lighting(fog);
}

/* At noon the ball has a radiance of .05; the origin's sun would make it as bright wherever it is. */
static void balls_have_the_light_of_their_place(void **state)
{
    (void)state;
    static const ball_case balls[] = {
        {"by day, from a dark origin", 120, {0, -.5, -.866}, .01, 1, 0, 0},
        {"behind the terminator", 110, {0, 1, 0}, 0, .002, 0, 0},
        {"red before the terminator", 88, {0, 1, 0}, .005, .5, 0, 0},
        {"all around, before the terminator", 88, {0, 1, 0}, 0, 0, 0, 1},
        {"by night, with light of its own", 110, {0, 1, 0}, .005, 1, GLOW | LIGHT, 0},
        {"at dusk, with light of its own", 91, {0, 1, 0}, .005, 1, GLOW | LIGHT, 0},
    };
    nb_gl context;
    pass_open(&context, NB_GL_330);
    for (size_t i = 0; i < sizeof balls / sizeof *balls; i++) {
        worlds s;
        worlds_make(1, worlds_near, balls[i].sun, .53, &s);
        const int is_dark = balls[i].sun[1] < 0; /* no sky is as bright as that of planet_even_sky then */
        nebel_environment_map *const map = is_dark ? NULL : planet_even_sky(&s.scene);
        check_ball(&balls[i], &s, &s.scene.environment);
        nebel_release_environment_map(map);
        worlds_free(&s);
    }
    pass_close(&context);
}

/* The moon is between the sun and a ball, and hides all of it, half of it, or nothing. */
static void moons_shade_balls(void **state)
{
    (void)state;
    static const double to_sun[3] = {0, 1, 0}, off[] = {0, 3e6, 8e6};
    static const ball_case ball = {"in the shadow of a moon", 30, {0, 1, 0}, .001, 2, 0, 0};
    const nebel_environment none = {.type = NEBEL_ENVIRONMENT_CONSTANT};
    double lit[3];
    nb_gl context;
    pass_open(&context, NB_GL_300ES);
    for (int k = 0; k < 3; k++) {
        const double angle = ball.degrees * acos(-1) / 180;
        worlds_body bodies[2] = {{.name = "earth"}, {.name = "moon", .radius = 3e6}};
        worlds s;
        double place[3] = {0, 80, -70};
        turn(6360000, angle, place);
        memcpy(bodies[1].center, place, sizeof place);
        bodies[1].center[0] += off[k];
        bodies[1].center[1] += 4e8;
        worlds_make(2, bodies, to_sun, .53, &s);
        nebel_camera camera = turned_camera(&s, angle);
        nebel_lighting *const fog = make_ball(&s, angle, &none, 0);
        picture_pair pair = check(ball.name, &s.scene, fog, &camera);
        lit[k] = ball_light(&pair, 0);
        picture_free(&pair);
        nebel_release_lighting(fog);
        worlds_free(&s);
    }
    pass_close(&context);
    print_message("  the ball: %g, %g, %g\n", lit[0], lit[1], lit[2]);
    assert_true(lit[1] - lit[0] > .005 && lit[2] - lit[1] > .005);
}

/* ---- many shadows on a ray ------------------------------------------------------------------- */

/* A fence beside the view, whose posts are half as wide as apart. */
enum { POSTS = 220 };

static nebel_mesh make_fence(float (*corners)[3], uint32_t *indices)
{
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    for (uint32_t i = 0; i < POSTS; i++) {
        for (uint32_t k = 0; k < 4; k++) {
            corners[4 * i + k][0] = 60;
            corners[4 * i + k][1] = k < 2 ? -1 : 60;
            corners[4 * i + k][2] = -40 - (float)i - (k == 0 || k == 3 ? 0 : .5f);
        }
        for (uint32_t k = 0; k < 6; k++) indices[6 * i + k] = 4 * i + order[k];
    }
    return (nebel_mesh){.positions = corners[0],
                        .indices = indices,
                        .vertex_count = 4 * POSTS,
                        .triangle_count = 2 * POSTS,
                        .base_color = {.5f, .5f, .5f},
                        .texture = -1};
}

/* Before the sky. Llvmpipe ends loops after so many turns, those of the search for shadows, too: then fog was missing. */
static void fences_shade_mist(void **state)
{
    (void)state;
    static float corners[4 * POSTS][3];
    static uint32_t indices[6 * POSTS];
    static const double to_sun[3] = {1, .3, 0};
    const nebel_volume_desc mist = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-100, -5, -700}, .max = {50, 30, 0}},
                                    .extinction = {.002, .002, .002},
                                    .albedo = {.9, .8, .7},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .base = 2, .scale_height = 22}};
    const nebel_mesh fence = make_fence(corners, indices);
    nebel_camera camera = planet_camera(4, .054);
    nb_gl context;
    worlds s;
    pass_open(&context, NB_GL_330);
    worlds_make(1, worlds_near, to_sun, .53, &s);
    s.scene.mesh_count = 1;
    s.scene.meshes = &fence;
    camera.vertical_fov = 6;
    const nebel_lighting_desc lights = {.sun = s.sun};
    nebel_lighting *const fog = fog_light(&lights, &mist, 1);
    picture_pair pair = check("beside a fence", &s.scene, fog, &camera);
    picture_free(&pair);
    nebel_release_lighting(fog);
    worlds_free(&s);
    pass_close(&context);
}

/* ---- what is not lit so ---------------------------------------------------------------------- */

static void count_warnings(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    *(int *)user += strstr(message, "the scene's origin, however far") != NULL;
}

static void diffusion_is_warned_of_once(void **state)
{
    (void)state;
    static const double to_sun[3] = {0, 1, 0};
    const nebel_environment none = {.type = NEBEL_ENVIRONMENT_CONSTANT};
    nb_gl context;
    worlds s;
    pass_open(&context, NB_GL_330);
    worlds_make(1, worlds_near, to_sun, .53, &s);
    for (int is_diffuse = 0; is_diffuse < 2; is_diffuse++) {
        int warnings = 0;
        nebel_gl_renderer *renderer = NULL;
        const nebel_gl_renderer_desc desc = {.host.log = {count_warnings, &warnings}};
        const nebel_gl_frame_desc frame = {.camera = turned_camera(&s, .5), .width = 8, .height = 8, .samples = 1};
        nebel_lighting *const fog = make_ball(&s, .5, &none, is_diffuse ? DIFFUSE : 0);
        assert_int_equal(nebel_create_gl_renderer(&s.scene, fog, &desc, &renderer), NEBEL_OK);
        for (int i = 0; i < 2; i++) assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
        assert_int_equal(warnings, is_diffuse);
        nebel_destroy_gl_renderer(renderer);
        nebel_release_lighting(fog);
    }
    worlds_free(&s);
    pass_close(&context);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mist_seas_are_the_same),      cmocka_unit_test(balls_have_the_light_of_their_place),
        cmocka_unit_test(moons_shade_balls),           cmocka_unit_test(fences_shade_mist),
        cmocka_unit_test(diffusion_is_warned_of_once),
    };
    if (argc > 1) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
