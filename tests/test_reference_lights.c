/* Point lights in the reference renderer: the collected physics (T17, T19, T20), light that has nowhere to go but out,
 * shadows. */
#include "test_render_scene.h"

#include "cpu/light_sampling.h"
#include "cpu/cpu_renderer.h"
#include "dice.h"

#include <string.h>

static const nebel_light point = {.position = {10, 5, 0}, .intensity = {100, 100, 100}};
static const nb_path_vertex nothing = {.t = HUGE_VAL};

/* ---- paths ----------------------------------------------------------------------------------- */

/* What one ray sees, by many paths. */
typedef struct tally {
    double sum, square;
    uint32_t count;
} tally;

typedef struct trial {
    nebel_scene_data scene;
    nb_geometry geometry;
    nb_path_scene world;
} trial;

static void start(trial *t, const nebel_light *lights, size_t count, const nebel_volume_desc *volume)
{
    *t = (trial){.scene = {.light_count = count, .lights = lights}};
    t->world = (nb_path_scene){.media.fog = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volume, 1),
                               .scene = &t->scene,
                               .geometry = &t->geometry,
                               .is_grey = 1,
                               .bounces = 1};
}

static void end(trial *t)
{
    nebel_release_snapshot((nebel_snapshot *)t->world.media.fog);
}

static nebel_volume_desc white_fog(double extinction)
{
    return (nebel_volume_desc){.extinction = {extinction, extinction, extinction}, .albedo = {1, 1, 1}};
}

static void follow(const trial *t, const nebel_ray *eye, const nb_path_vertex *at, double weight, tally *all)
{
    static nb_single_ray lone;
    nb_path_light light;
    const uint32_t number[4] = {all->count++};
    assert_int_equal(nb_path_trace(&t->world, &(nb_path_eye){.ray = *eye, .first = *at}, number, &lone, &light),
                     NEBEL_OK);
    all->sum += weight * light.color[0];
    all->square += pow(weight * light.color[0], 2);
}

/* Within four standard errors, which are less than `part` of what is expected. */
static void expect(const tally *all, double expected, double part)
{
    const double mean = all->sum / all->count;
    const double error = sqrt(fmax(all->square / all->count - mean * mean, 0) / all->count);
    assert_true(fabs(mean - expected) <= 4 * error + 1e-5 * expected);
    assert_true(error <= part * expected);
}

/* ---- airlight (T17, T19) --------------------------------------------------------------------- */

static tally see_airlight(double extinction, const nebel_light *light, double length)
{
    enum { PATHS = 40000 };
    const nebel_volume_desc fog = white_fog(extinction);
    const nebel_ray eye = {{0, 0, 0}, {1, 0, 0}, length};
    const nb_path_vertex black = {.t = length};
    tally all = {0, 0, 0};
    trial t;
    start(&t, light, 1, &fog);
    for (int i = 0; i < PATHS; i++) follow(&t, &eye, &black, 1, &all);
    end(&t);
    return all;
}

static void airlight_is_that_of_T17(void **state)
{
    (void)state;
    static const struct {
        double extinction, distance, angle, length, light, error;
    } cases[] = {
        {0.02, 20, 15, 60, 0.04807873504574867, .005}, {0.02, 20, 15, 1000, 0.04823971552254724, .005},
        {0.1, 10, 90, 50, 0.01538266635057253, .01},   {0.005, 50, 2, 200, 0.05355965729017184, .005},
        {0.1, 10, 150, 30, 0.00866229562076126, .01},  {1e-6, 20, 15, 60, 4.232468970711786e-06, 1e-4},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double angle = cases[i].angle * test_pi / 180;
        nebel_light point_light = point;
        point_light.position[0] = cases[i].distance * cos(angle);
        point_light.position[1] = cases[i].distance * sin(angle);
        const tally all = see_airlight(cases[i].extinction, &point_light, cases[i].length);
        expect(&all, cases[i].light, cases[i].error);
    }
}

static void spots_are_those_of_T19(void **state)
{
    (void)state;
    nebel_light spot = point;
    spot.type = NEBEL_LIGHT_SPOT;
    spot.direction[1] = -2;
    spot.inner_angle = spot.outer_angle = 30;
    const tally all = see_airlight(.02, &spot, HUGE_VAL), none = see_airlight(.02, &spot, 7.1132);
    expect(&all, 0.02458581030636606, .01);
    assert_true(none.sum == 0);
}

/* ---- places along a ray (T20) ---------------------------------------------------------------- */

static void places_are_those_of_T20(void **state)
{
    (void)state;
    static const double chances[] = {.1, .5, .9}, places[] = {10.62638608785674, 19.66907215105618, 31.49775892242482};
    const double angle = 15 * test_pi / 180;
    const nebel_light light = {.position = {20 * cos(angle), 20 * sin(angle), 0}, .intensity = {1, 1, 1}};
    const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, 60};
    const nb_light_pass passing = nb_passing_of(&light, &ray);
    for (int i = 0; i < 3; i++) {
        const double t = nb_passing_draw(&passing, chances[i]);
        const nb_sampled_light sight = nb_light_sight_from(&light, (const double[3]){t, 0, 0});
        assert_true(fabs(t - places[i]) < 1e-12 * places[i]);
        assert_true(fabs(sight.beam / nb_passing_density(&passing, t) - .5318835164163347) < 1e-12);
    }
}

/* The chance of a place is the integral of the density up to it: also far from the point light, where one angle is as
 * good as the next, beyond it, and through it. */
static void places_are_as_dense_as_they_say(void **state)
{
    (void)state;
    static const double lights[][2] = {{5, 1}, {-5, 1}, {1e7, 1}, {-1e7, 1}, {5, 0}, {20, 1e-2}, {5, 1e6}};
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        const nebel_light light = {.position = {lights[i][0], lights[i][1], 0}, .radius = .25, .intensity = {1, 1, 1}};
        const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, 10};
        const nb_light_pass passing = nb_passing_of(&light, &ray);
        const double middle = nb_passing_draw(&passing, .3);
        double sum = 0;
        enum { STEPS = 4000 };
        for (int k = 0; k < STEPS; k++) sum += nb_passing_density(&passing, middle * (k + .5) / STEPS) * middle / STEPS;
        assert_true(fabs(sum - .3) < 1e-5);
        assert_true(nb_passing_draw(&passing, 0) == 0 && fabs(nb_passing_draw(&passing, 1 - 1e-16) - 10) < 1e-6);
    }
}

/* ---- all orders ------------------------------------------------------------------------------ */

/* A ray towards a ball around the origin, away from its middle by as much as the chance says; else at random. */
static nebel_ray ray_past(double away, uint64_t *numbers)
{
    const double up = dice(numbers, -1, 1), turn = dice(numbers, 0, 2 * test_pi), level = sqrt(1 - up * up);
    const double across[3] = {-sin(turn), cos(turn), 0}, third[3] = {-up * cos(turn), -up * sin(turn), level};
    const double angle = dice(numbers, 0, 2 * test_pi);
    nebel_ray ray = {.direction = {level * cos(turn), level * sin(turn), up}, .t_max = HUGE_VAL};
    for (int c = 0; c < 3; c++)
        ray.origin[c] = away * (cos(angle) * across[c] + sin(angle) * third[c]) - 2 * ray.direction[c];
    return ray;
}

/* Per W/sr, what a ball of fog of radius 1 around a point light scatters once: within the point light, which fog
 * fills, and around. */
static double scattered_once(double extinction, double radius)
{
    enum { STEPS = 2000 };
    double sum = 4 * test_pi / 3 * pow(radius, 3) * extinction * 2 / (radius * radius);
    for (int i = 0; i < STEPS; i++) {
        const double step = (1 - radius) / STEPS, away = radius + (i + .5) * step;
        const double fluence = 2 / (radius * radius) * (1 - sqrt(1 - pow(radius / away, 2)));
        sum += 4 * test_pi * away * away * extinction * fluence * exp(-extinction * (away - radius)) * step;
    }
    return sum;
}

/* White fog around point lights keeps nothing: all that it scatters leaves it, so much to every side. What goes
 * through a disc of parallel rays as wide as the fog is 1 / (4 pi) of it. */
static void all_light_gets_out_of_white_fog(void **state)
{
    (void)state;
    enum { PATHS = 40000 };
    const nebel_light lights[] = {{.intensity = {2, 2, 2}, .radius = .25}, {.intensity = {1, 1, 1}, .radius = .125}};
    nebel_volume_desc ball = white_fog(2);
    ball.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 1};
    ball.phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .5};
    trial t;
    tally all = {0, 0, 0};
    uint64_t numbers = 5;
    start(&t, lights, 2, &ball);
    t.world.bounces = 10000;
    for (int i = 0; i < PATHS; i++) {
        const double away = dice(&numbers, 0, 1);
        const nebel_ray eye = ray_past(away, &numbers);
        follow(&t, &eye, &nothing, 2 * away, &all);
    }
    end(&t);
    const double scattered = 2 * scattered_once(2, .25) + scattered_once(2, .125);
    expect(&all, scattered / (4 * test_pi) / test_pi, .02);
}

/* ---- surfaces -------------------------------------------------------------------------------- */

/* A point light above a square that hides it from the camera's fog, and nothing else. */
static float look_below(float half)
{
    const float positions[] = {-half, 1, -half, -half, 1, half, half, 1, half, half, 1, -half};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    const nebel_mesh lid = {
        .positions = positions, .indices = indices, .vertex_count = 4, .triangle_count = 2, .texture = -1};
    const nebel_light light = {.position = {0, 3, 0}, .intensity = {10, 10, 10}, .radius = .1};
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &lid, .light_count = 1, .lights = &light};
    nebel_volume_desc box = white_fog(.5);
    box.shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 0, 1}};
    nebel_lighting *fog = test_fog(1, &box);
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_PATH, NULL), NEBEL_OK);
    float color[3] = {-1, -1, -1}, layer[3], through[3];
    nebel_frame_desc desc = {
        .camera = test_camera(0, -.5, 8, 0, -.5, 0), .width = 1, .height = 1, .samples = 256, .bounces = 1};
    desc.camera.vertical_fov = 2;
    const nebel_frame planes = {.color = color, .in_scattering = layer, .transmittance = through};
    assert_int_equal(nebel_render_frame(renderer, &desc, &planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
    assert_true(fabsf(layer[0] - color[0]) <= 1e-6f * color[0]); /* before black: all there is is fog's */
    return color[0];
}

static void surfaces_keep_lights_from_fog(void **state)
{
    (void)state;
    assert_true(look_below(2) == 0);
    assert_true(look_below(.01f) > 1e-2f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(airlight_is_that_of_T17),         cmocka_unit_test(spots_are_those_of_T19),
        cmocka_unit_test(places_are_those_of_T20),         cmocka_unit_test(places_are_as_dense_as_they_say),
        cmocka_unit_test(all_light_gets_out_of_white_fog), cmocka_unit_test(surfaces_keep_lights_from_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
