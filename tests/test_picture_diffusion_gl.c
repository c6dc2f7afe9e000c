/* Light that fog scatters more than once is in OpenGL what it is on the CPU: bodies, layers, colours, random fog. */
#include <math.h>
#include <string.h>

#include "pass_help.h"
#include "picture_help.h"
#include "random_fog.h"
#include "test_render_scene.h"

enum { WIDTH = 32, HEIGHT = 22, MOST_VOLUMES = 2 };

static const nebel_scene_data black = {.background = {0, 0, 0}};

/* Both renderers' pictures of the fog, in parts of the brightest light of the CPU's. */
static picture_difference compare(nebel_lighting *fog, const nebel_camera *camera, nb_gl_language language,
                                  const char *name)
{
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    pass_open(&context, language);
    const int objects = pass_count_objects();
    picture_render(&black, fog, camera, 1, &pair);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    double most = 1;
    for (size_t i = 0; i < 3 * (size_t)WIDTH * HEIGHT; i++) most = fmax(most, (double)pair.cpu.in_scattering[i]);
    const picture_difference d = picture_compare(&pair, most);
    print_message("%s: %zu pixels with fog, %zu beyond 1/255, worst %.2g/255 at %u, %u; brightest %.2g\n", name,
                  d.fogged, d.beyond_step, 255 * d.largest, (unsigned)d.x, (unsigned)d.y, most);
    picture_free(&pair);
    return d;
}

static void expect_same(const picture_difference *d)
{
    assert_true(d->fogged > 0);
    assert_true((double)d->beyond_step <= 1e-3 * (double)d->fogged);
    assert_true(d->largest <= 3. / 255);
}

/* ---- fog on purpose -------------------------------------------------------------------------- */

#define BALL                                                                                                           \
    {                                                                                                                  \
        .type = NEBEL_SHAPE_SPHERE, .radius = 2                                                                        \
    }

typedef struct trial {
    const char *name;
    size_t count;
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_diffusion_desc diffusion;
    nebel_projection projection;
    double far;      /* where all is, along x [m] */
    int is_overcast; /* a coloured gradient in place of sun and even light */
    int is_night;    /* two point lights in place of both */
} trial;

static const trial trials[] = {
    {.name = "ball",
     .count = 1,
     .volumes = {{.shape = BALL, .extinction = {5, 5, 5}, .albedo = {1, 1, 1}}},
     .diffusion = {.max_cells = 2048}},
    {.name = "droplets, far out",
     .count = 1,
     .volumes = {{.shape = BALL,
                  .extinction = {4, 4, 4},
                  .albedo = {1, 1, 1},
                  .phase = {.type = NEBEL_PHASE_DROPLETS, .diameter = 16}}},
     .diffusion = {.max_cells = 2048},
     .far = 1e7},
    {.name = "colours beside soot",
     .count = 2,
     .volumes = {{.shape = BALL,
                  .extinction = {2, 3, 5},
                  .albedo = {.99, .95, .8},
                  .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .7}},
                 {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, -.4, -3}, .max = {3, .4, 3}},
                  .extinction = {.6, .5, .3}}},
     .diffusion = {.max_cells = 2048},
     .projection = NEBEL_PROJECTION_PANORAMA},
    {.name = "height fog over a bright ground",
     .count = 1,
     .volumes = {{.extinction = {1, 1, 1},
                  .albedo = {.98, .98, .98},
                  .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8},
                  .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -2, .scale_height = .7}}},
     .diffusion = {.has_ground = 1, .ground_height = -2, .ground_albedo = {.6, .5, .4}}},
    {.name = "ball in height fog",
     .count = 2,
     .volumes = {{.shape = BALL, .extinction = {3, 3, 3}, .albedo = {1, 1, 1}},
                 {.extinction = {.3, .4, .5},
                  .albedo = {1, 1, 1},
                  .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -2, .scale_height = 1}}},
     .diffusion = {.max_cells = 2048, .has_ground = 1, .ground_height = -2}},
    {.name = "what is left of a box",
     .count = 2,
     .volumes = {{.shape = {.type = NEBEL_SHAPE_BOX, .min = {-2, -1, -2}, .max = {2, 1, 1}},
                  .extinction = {6, 6, 6},
                  .albedo = {1, 1, 1}},
                 {.operation = NEBEL_OPERATION_EXCLUDE,
                  .priority = 1,
                  .shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1.2}}},
     .diffusion = {.max_cells = 2048}},
    {.name = "smoke in height fog, overcast",
     .count = 2,
     .volumes = {{.shape = BALL,
                  .extinction = {3, 3, 3},
                  .albedo = {.6, .6, .6},
                  .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .7}},
                 {.extinction = {.3, .4, .5},
                  .albedo = {1, .98, .9},
                  .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -2, .scale_height = 1}}},
     .diffusion = {.max_cells = 2048, .has_ground = 1, .ground_height = -2, .ground_albedo = {.1, .3, .1}},
     .is_overcast = 1},
    {.name = "point lights in coloured droplets",
     .count = 1,
     .volumes = {{.shape = BALL,
                  .extinction = {1, 1.2, 1.5},
                  .albedo = {1, 1, .9},
                  .phase = {.type = NEBEL_PHASE_DROPLETS, .diameter = 16}}},
     .diffusion = {.max_cells = 2048},
     .is_night = 1},
    {.name = "point lights and fire in height fog",
     .count = 2,
     .volumes = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {-.5, -1, 0}, .radius = .5}, .emission = {3, 1, .2}},
                 {.extinction = {.8, .8, .8},
                  .albedo = {1, 1, 1},
                  .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -2, .scale_height = 1}}},
     .diffusion = {.max_cells = 2048, .has_ground = 1, .ground_height = -2, .ground_albedo = {.5, .5, .5}},
     .is_night = 1},
};

static const nebel_light point_lights[] = {{.position = {.5, .3, .4}, .intensity = {4, 3, 1}, .radius = .1},
                                           {.type = NEBEL_LIGHT_SPOT,
                                            .position = {-1.5, 1.6, .5},
                                            .intensity = {2, 3, 4},
                                            .radius = .1,
                                            .direction = {1, -1, 0},
                                            .inner_angle = 20,
                                            .outer_angle = 40}};

static const nebel_environment overcast = {
    .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {.9, 1, 1.2}, .horizon = {.5, .4, .3}, .ground = {.1, .1, 0}};

static nebel_lighting *commit(const trial *t)
{
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_lighting_desc lights = {.diffusion = &t->diffusion};
    if (t->is_overcast) lights.environment = overcast;
    if (t->is_night) lights.lights = point_lights, lights.light_count = sizeof point_lights / sizeof *point_lights;
    if (!t->is_overcast && !t->is_night) {
        lights.environment = (nebel_environment){.radiance = {.1, .1, .12}};
        lights.sun = (nebel_sun){.direction = {1, .6, .5}, .irradiance = {3, 2.8, 2.5}};
    }
    for (size_t i = 0; i < t->count; i++) {
        volumes[i] = t->volumes[i];
        volumes[i].shape.center[0] += t->far;
    }
    return fog_light(&lights, volumes, t->count);
}

static void test_fog_is_white_as_on_the_cpu(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof trials / sizeof *trials; i++) {
        const trial *t = &trials[i];
        nebel_camera camera = test_camera(t->far + 2, 1.5, 5, t->far, 0, 0);
        camera.projection = t->projection;
        nebel_lighting *const fog = commit(t);
        const picture_difference d = compare(fog, &camera, i % 2 == 0 ? NB_GL_330 : NB_GL_300ES, t->name);
        expect_same(&d);
        nebel_release_lighting(fog);
    }
}

/* ---- random fog ------------------------------------------------------------------------------ */

static nebel_lighting *commit_random(const random_fog *random)
{
    static const nebel_diffusion_desc diffusion = {.max_cells = 512};
    nebel_lighting_desc lights = random_fog_lights(random);
    lights.sun = (nebel_sun){.direction = {.3, .8, -.4}, .irradiance = {3, 2, 1}};
    lights.diffusion = &diffusion;
    return fog_light(&lights, random->volumes, random->count);
}

static void test_random_fog(void **state)
{
    (void)state;
    static random_fog random;
    picture_difference all = {.fogged = 0};
    /* of those that are level or end; not RANDOM_FOG_MANY, too much for Mesa's software in sunlight */
    static const uint64_t seeds[] = {1, 2, 6, 7, 12, 16, 17};
    for (size_t i = 0; i < sizeof seeds / sizeof *seeds; i++) {
        const uint64_t seed = seeds[i];
        const random_fog_kind kind = (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT);
        uint64_t numbers = seed;
        char name[32];
        random_fog_make(&random, kind, seed);
        random_fog_light(&random, &numbers);
        nebel_lighting *const fog = commit_random(&random);
        nebel_camera camera =
            test_camera(dice(&numbers, -20, 20), dice(&numbers, -4, 8), dice(&numbers, -20, 20), 0, 0, 0);
        for (int k = 0; k < 3; k++) {
            camera.position[k] += random.shift[k];
            camera.look_at[k] += random.shift[k];
        }
        (void)snprintf(name, sizeof name, "kind %d, seed %d", (int)kind, (int)seed);
        const picture_difference d = compare(fog, &camera, seed % 2 == 0 ? NB_GL_330 : NB_GL_300ES, name);
        all.fogged += d.fogged;
        all.beyond_step += d.beyond_step;
        all.largest = fmax(all.largest, d.largest);
        nebel_release_lighting(fog);
    }
    assert_true(all.fogged > 3 * (size_t)WIDTH * HEIGHT);
    expect_same(&all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fog_is_white_as_on_the_cpu),
        cmocka_unit_test(test_random_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
