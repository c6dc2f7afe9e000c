/* Diffusion in bodies, clouds and height fog, beside pictures of the reference. The argument "table" prints rows of
 * docs/multiple-scattering.md, of 16 times as many samples. */
#include "test_render_scene.h"

enum { SIDE = 16, PIXELS = SIDE * SIDE, BLOCK = 4 };

enum { SAMPLES = 64, LEAST_SAMPLES = 16 };

static uint32_t samples = SAMPLES;

/* Fog, white unless it is said otherwise, seen from the front and a little from above. */
typedef struct trial {
    const char *name;
    nebel_shape shape;
    nebel_density density;
    double extinction, g;
    double sun[3];             /* all 0: none */
    double most_off, most_rms; /* of the picture's mean, and of its blocks: in terms of that mean */
    double coverage;           /* of a grid */
    double darkness;           /* 1 - albedo */
    int sky;                   /* of `skies` */
    const nebel_light *lights;
    size_t light_count;
    double emission; /* of a ball amid the fog that scatters nothing */
} trial;

enum { DARK, EVEN, OVERCAST };

static const nebel_environment skies[] = {
    [DARK] = {.type = NEBEL_ENVIRONMENT_CONSTANT},
    [EVEN] = {.type = NEBEL_ENVIRONMENT_CONSTANT, .radiance = {1, 1, 1}},
    [OVERCAST] = {.type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {1, 1, 1}, .horizon = {.5, .5, .5}},
};

#define BALL                                                                                                           \
    {                                                                                                                  \
        .type = NEBEL_SHAPE_SPHERE, .radius = 1                                                                        \
    }
#define BOX                                                                                                            \
    {                                                                                                                  \
        .type = NEBEL_SHAPE_BOX, .min = {-1, -.5, -.6}, .max = { 1, .4, .6 }                                           \
    }
#define SIDEWAYS                                                                                                       \
    {                                                                                                                  \
        1, .6, .5                                                                                                      \
    }
#define AHEAD                                                                                                          \
    {                                                                                                                  \
        .2, .3, -1                                                                                                     \
    }
#define BEHIND                                                                                                         \
    {                                                                                                                  \
        .2, .3, 1                                                                                                      \
    }

/* What is measured, and some room for chance. */
static const trial trials[] = {
    {"ball, depth 2", BALL, {0}, 1, 0, SIDEWAYS, .06, .1, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 10, sun behind the eye", BALL, {0}, 5, 0, BEHIND, .08, .1, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 10, sun ahead", BALL, {0}, 5, 0, AHEAD, .15, .25, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 20, g .85", BALL, {0}, 10, .85, SIDEWAYS, .15, .25, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 20, g .85, sun ahead", BALL, {0}, 10, .85, AHEAD, .15, .3, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 20, g .85, sun behind the eye", BALL, {0}, 10, .85, BEHIND, .35, .45, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 30", BALL, {0}, 15, 0, SIDEWAYS, .1, .12, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 30, sun ahead", BALL, {0}, 15, 0, AHEAD, .22, .42, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 100, sun ahead", BALL, {0}, 50, 0, AHEAD, .7, 1.1, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 100", BALL, {0}, 50, 0, SIDEWAYS, .15, .2, 0, 0, DARK, NULL, 0, 0},
    {"ball, depth 100, g .85", BALL, {0}, 50, .85, SIDEWAYS, .15, .25, 0, 0, DARK, NULL, 0, 0},
    {"ball that thins out, depth 10",
     BALL,
     {.type = NEBEL_DENSITY_RADIAL, .power = 2},
     10,
     0,
     SIDEWAYS,
     .1,
     .22,
     0,
     0,
     DARK,
     NULL,
     0,
     0},
    {"box, depth 6", BOX, {0}, 5, 0, SIDEWAYS, .08, .12, 0, 0, DARK, NULL, 0, 0},
    {"box, depth 100", BOX, {0}, 83, 0, SIDEWAYS, .1, .15, 0, 0, DARK, NULL, 0, 0},
    {"box, depth 20, g .85", BOX, {0}, 16, .85, SIDEWAYS, .25, .4, 0, 0, DARK, NULL, 0, 0},
    {"cloud of voxels, depth 20 in a puff, g .85",
     BOX,
     {.type = NEBEL_DENSITY_GRID},
     40,
     .85,
     SIDEWAYS,
     .2,
     .3,
     .65,
     0,
     DARK,
     NULL,
     0,
     0},
    {"thin clouds with holes, g .85, sun ahead",
     BOX,
     {.type = NEBEL_DENSITY_GRID},
     40,
     .85,
     AHEAD,
     .3,
     .45,
     .55,
     0,
     DARK,
     NULL,
     0,
     0},
    {"height fog above black ground, depth 8, g .85",
     {.type = NEBEL_SHAPE_WORLD},
     {.type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4},
     20,
     .85,
     SIDEWAYS,
     .2,
     .25,
     0,
     0,
     DARK,
     NULL,
     0,
     0},
    {"height fog above black ground, depth 8, g .85, sun ahead",
     {.type = NEBEL_SHAPE_WORLD},
     {.type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4},
     20,
     .85,
     AHEAD,
     .15,
     .15,
     0,
     0,
     DARK,
     NULL,
     0,
     0},
    {"height fog above black ground, depth 8",
     {.type = NEBEL_SHAPE_WORLD},
     {.type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4},
     20,
     0,
     SIDEWAYS,
     .04,
     .04,
     0,
     0,
     DARK,
     NULL,
     0,
     0},
    {"height fog above black ground, depth 2, g .85",
     {.type = NEBEL_SHAPE_WORLD},
     {.type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4},
     5,
     .85,
     SIDEWAYS,
     .18,
     .2,
     0,
     0,
     DARK,
     NULL,
     0,
     0}};

enum { TRIALS = sizeof trials / sizeof *trials };

#define NO_SUN                                                                                                         \
    {                                                                                                                  \
        0                                                                                                              \
    }

/* The same in ambient light alone. */
static const trial skylit[] = {
    {"ball, depth 10, albedo .8, even sky", BALL, {0}, 5, 0, NO_SUN, .06, .09, 0, .2, EVEN, NULL, 0, 0},
    {"ball, depth 10, white, overcast", BALL, {0}, 5, 0, NO_SUN, .04, .05, 0, 0, OVERCAST, NULL, 0, 0},
    {"ball, depth 10, albedo .8, overcast", BALL, {0}, 5, 0, NO_SUN, .07, .1, 0, .2, OVERCAST, NULL, 0, 0},
    {"ball, depth 2, albedo .5, even sky", BALL, {0}, 1, 0, NO_SUN, .06, .1, 0, .5, EVEN, NULL, 0, 0},
    {"ball, depth 100, albedo .5, overcast", BALL, {0}, 50, 0, NO_SUN, .05, .18, 0, .5, OVERCAST, NULL, 0, 0},
    {"ball, depth 100, albedo .99, even sky", BALL, {0}, 50, 0, NO_SUN, .08, .1, 0, .01, EVEN, NULL, 0, 0},
    {"ball, depth 20, g .85, albedo .9, even sky", BALL, {0}, 10, .85, NO_SUN, .06, .11, 0, .1, EVEN, NULL, 0, 0},
    {"ball, depth 20, g .85, white, overcast", BALL, {0}, 10, .85, NO_SUN, .05, .08, 0, 0, OVERCAST, NULL, 0, 0},
    {"ball that thins out, depth 10, albedo .8, overcast",
     BALL,
     {.type = NEBEL_DENSITY_RADIAL, .power = 2},
     10,
     0,
     NO_SUN,
     .08,
     .12,
     0,
     .2,
     OVERCAST,
     NULL,
     0,
     0},
    {"box, depth 6, albedo .8, overcast", BOX, {0}, 5, 0, NO_SUN, .1, .15, 0, .2, OVERCAST, NULL, 0, 0},
    {"smoke of voxels, depth 20 in a puff, g .5, albedo .6, overcast",
     BOX,
     {.type = NEBEL_DENSITY_GRID},
     40,
     .5,
     NO_SUN,
     .13,
     .19,
     .65,
     .4,
     OVERCAST,
     NULL,
     0,
     0},
    {"height fog above black ground, depth 8, g .85, even sky",
     {.type = NEBEL_SHAPE_WORLD},
     {.type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4},
     20,
     .85,
     NO_SUN,
     .09,
     .1,
     0,
     0,
     EVEN,
     NULL,
     0,
     0}};

enum { SKYLIT = sizeof skylit / sizeof *skylit };

static const nebel_light bulb[] = {{.position = {.3, .2, .1}, .intensity = {1, 1, 1}, .radius = .01}};
static const nebel_light outside[] = {{.position = {1.5, 1, .8}, .intensity = {3, 3, 3}, .radius = .01}};
static const nebel_light beam[] = {{.type = NEBEL_LIGHT_SPOT,
                                    .position = {-.9, .8, 0},
                                    .intensity = {5, 5, 5},
                                    .radius = .01,
                                    .direction = {1, -.6, 0},
                                    .inner_angle = 15,
                                    .outer_angle = 25}};
static const nebel_light street[] = {{.position = {-.8, -.6, -.5}, .intensity = {1, 1, 1}, .radius = .01},
                                     {.position = {0, -.6, 0}, .intensity = {1, 1, 1}, .radius = .01},
                                     {.position = {.8, -.6, .5}, .intensity = {1, 1, 1}, .radius = .01}};

#define HAZE                                                                                                           \
    {                                                                                                                  \
        .type = NEBEL_DENSITY_HEIGHT, .base = -1.2, .scale_height = .4                                                 \
    }

/* The same in own light. */
static const trial glowing[] = {
    {.name = "point light in a ball, depth 10",
     .shape = BALL,
     .extinction = 5,
     .most_off = .2,
     .most_rms = .55,
     .lights = bulb,
     .light_count = 1},
    {.name = "point light in a ball, depth 4, g .85",
     .shape = BALL,
     .extinction = 2,
     .g = .85,
     .most_off = .25,
     .most_rms = .9,
     .lights = bulb,
     .light_count = 1},
    {.name = "point light in a ball, depth 2",
     .shape = BALL,
     .extinction = 1,
     .most_off = .12,
     .most_rms = .4,
     .lights = bulb,
     .light_count = 1},
    {.name = "point light beside a ball, depth 10",
     .shape = BALL,
     .extinction = 5,
     .most_off = .1,
     .most_rms = .2,
     .lights = outside,
     .light_count = 1},
    {.name = "point light beside a box, depth 6, g .85",
     .shape = BOX,
     .extinction = 5,
     .g = .85,
     .most_off = .15,
     .most_rms = .45,
     .lights = outside,
     .light_count = 1},
    {.name = "spot into a box, depth 6, g .85",
     .shape = BOX,
     .extinction = 5,
     .g = .85,
     .most_off = .2,
     .most_rms = .6,
     .lights = beam,
     .light_count = 1},
    {.name = "three point lights in height fog, depth 2, g .85",
     .shape = {.type = NEBEL_SHAPE_WORLD},
     .density = HAZE,
     .extinction = 5,
     .g = .85,
     .most_off = .15,
     .most_rms = .5,
     .lights = street,
     .light_count = 3},
    {.name = "three point lights in height fog, depth 8",
     .shape = {.type = NEBEL_SHAPE_WORLD},
     .density = HAZE,
     .extinction = 20,
     .most_off = .3,
     .most_rms = .5,
     .lights = street,
     .light_count = 3},
    {.name = "fire in a ball, depth 10",
     .shape = BALL,
     .extinction = 5,
     .most_off = .1,
     .most_rms = .15,
     .emission = 1},
    {.name = "fire in a ball, depth 2, g .85",
     .shape = BALL,
     .extinction = 1,
     .g = .85,
     .most_off = .08,
     .most_rms = .28,
     .emission = 1},
    {.name = "fire in smoke, depth 20 in a puff, g .5, albedo .6",
     .shape = BOX,
     .density = {.type = NEBEL_DENSITY_GRID},
     .extinction = 40,
     .g = .5,
     .most_off = .12,
     .most_rms = .2,
     .coverage = .65,
     .darkness = .4,
     .emission = 1},
    {.name = "fire in height fog, depth 8, g .85",
     .shape = {.type = NEBEL_SHAPE_WORLD},
     .density = HAZE,
     .extinction = 20,
     .g = .85,
     .most_off = .2,
     .most_rms = .62,
     .emission = 1},
};

enum { GLOWING = sizeof glowing / sizeof *glowing };

/* ---- pictures -------------------------------------------------------------------------------- */

typedef struct shot {
    float color[3 * PIXELS], error[3 * PIXELS];
} shot;

static nebel_grid *make_cloud(double coverage)
{
    nebel_grid *grid = NULL;
    const nebel_noise_desc desc = {
        .size = {48, 48, 48}, .frequency = {4, 3, 3}, .octaves = 3, .coverage = coverage, .falloff = {.3, .3, .3}};
    assert_int_equal(nebel_create_noise_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

static int has_sun(const trial *t)
{
    return t->sun[0] != 0;
}

static int is_own(const trial *t)
{
    return t->light_count > 0 || t->emission > 0;
}

static nebel_lighting *commit(const trial *t, int is_diffuse)
{
    const double sunlight = has_sun(t), albedo = 1 - t->darkness;
    nebel_volume_desc volume = {.shape = t->shape,
                                .density = t->density,
                                .extinction = {t->extinction, t->extinction, t->extinction},
                                .albedo = {albedo, albedo, albedo},
                                .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = t->g}};
    const nebel_diffusion_desc diffusion = {.has_ground = t->shape.type == NEBEL_SHAPE_WORLD,
                                            .ground_height = t->density.base};
    if (t->density.type == NEBEL_DENSITY_GRID) volume.density.grid = make_cloud(t->coverage);
    const nebel_volume_desc fire = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {.2, -.2, .1}, .radius = .3},
                                    .emission = {t->emission, t->emission, t->emission}};
    const nebel_lighting_desc lights = {
        .sun = {.direction = {t->sun[0], t->sun[1], t->sun[2]}, .irradiance = {sunlight, sunlight, sunlight}},
        .environment = skies[t->sky],
        .lights = t->lights,
        .light_count = t->light_count,
        .diffusion = is_diffuse ? &diffusion : NULL};
    nebel_lighting *lighting = fog_light(&lights, (nebel_volume_desc[]){volume, fire}, t->emission > 0 ? 2 : 1);
    nebel_release_grid(volume.density.grid);
    return lighting;
}

/* Black ground, as far as anybody sees. */
static nebel_mesh make_ground(double height)
{
    static const float positions[] = {-1e4f, 0, -1e4f, 1e4f, 0, -1e4f, 0, 0, 2e4f};
    static const uint32_t indices[] = {0, 2, 1};
    return (nebel_mesh){.origin = {0, height, 0},
                        .positions = positions,
                        .indices = indices,
                        .vertex_count = 3,
                        .triangle_count = 1,
                        .texture = -1};
}

static void take(const trial *t, nebel_method method, int is_diffuse, shot *out)
{
    nebel_renderer *renderer = NULL;
    const int is_endless = t->shape.type == NEBEL_SHAPE_WORLD;
    const nebel_mesh ground = make_ground(t->density.base);
    nebel_scene_data scene = {.has_sun = has_sun(t),
                              .sun_irradiance = {1, 1, 1},
                              .environment = skies[t->sky],
                              .meshes = &ground,
                              .mesh_count = is_endless ? 1 : 0,
                              .lights = t->lights,
                              .light_count = t->light_count};
    const double length = sqrt(t->sun[0] * t->sun[0] + t->sun[1] * t->sun[1] + t->sun[2] * t->sun[2]);
    for (int c = 0; c < 3 && has_sun(t); c++) scene.sun_direction[c] = t->sun[c] / length;
    memcpy(scene.ambient, skies[t->sky].radiance, sizeof scene.ambient);
    scene.camera = test_camera(0, 10, 50, 0, 0, 0);
    scene.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    scene.camera.view_height = 2.4;
    nebel_lighting *fog = commit(t, is_diffuse);
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){.thread_count = 2}, &renderer),
                     NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, method, NULL), NEBEL_OK);
    const nebel_frame_desc frame = {
        .camera = scene.camera, .width = SIDE, .height = SIDE, .samples = method == NEBEL_METHOD_PATH ? samples : 4};
    const nebel_frame planes = {.color = out->color, .standard_error = out->error};
    assert_int_equal(nebel_render_frame(renderer, &frame, &planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* ---- judgement ------------------------------------------------------------------------------- */

static double mean_of(const float *plane, int x, int y, int side)
{
    double sum = 0;
    for (int j = y; j < y + side; j++)
        for (int i = x; i < x + side; i++) sum += (double)plane[3 * (j * SIDE + i)];
    return sum / (side * side);
}

/* In terms of the reference's mean. */
typedef struct verdict {
    double off, rms, chance;
} verdict;

static verdict judge(const shot *is, const shot *reference)
{
    const double mean = mean_of(reference->color, 0, 0, SIDE);
    double square = 0, chance = 0;
    for (int y = 0; y < SIDE; y += BLOCK)
        for (int x = 0; x < SIDE; x += BLOCK) {
            const double off = mean_of(is->color, x, y, BLOCK) - mean_of(reference->color, x, y, BLOCK);
            square += off * off * BLOCK * BLOCK / PIXELS;
        }
    for (int i = 0; i < PIXELS; i++) chance += (double)reference->error[3 * i] * (double)reference->error[3 * i];
    return (verdict){mean_of(is->color, 0, 0, SIDE) / mean - 1, sqrt(square) / mean, sqrt(chance) / PIXELS / mean};
}

static shot once, all, reference;

static void take_all(const trial *t)
{
    take(t, NEBEL_METHOD_EXACT, 0, &once);
    take(t, NEBEL_METHOD_EXACT, 1, &all);
    take(t, NEBEL_METHOD_PATH, 0, &reference);
}

static void print_trials(const char *title, const char *exact, const trial *all_trials, int count)
{
    printf("| %s | %s | diffusion | its RMS over blocks | chance |\n|---|---|---|---|---|\n", title, exact);
    for (int i = 0; i < count; i++) {
        take_all(&all_trials[i]);
        const verdict single = judge(&once, &reference), many = judge(&all, &reference);
        printf("| %s | %+.0f %% | %+.0f %% | %.0f %% | %.1f %% |\n", all_trials[i].name, 100 * single.off,
               100 * many.off, 100 * many.rms, 100 * many.chance);
    }
}

static void judge_trial(const trial *t)
{
    take_all(t);
    const verdict single = judge(&once, &reference), many = judge(&all, &reference);
    if (fabs(many.off) >= t->most_off + 3 * many.chance || many.rms >= t->most_rms + 3 * many.chance)
        fail_msg("%s: off by %.3f, %.3f rms, chance %.3f", t->name, many.off, many.rms, many.chance);
    assert_true(has_sun(t) || is_own(t) ? single.off < -.4 : single.rms > 2 * many.rms);
}

/* The first in its table of a body and a profile in sunlight, or of a sky and of point lights or fire. */
static int is_first_of_kind(const trial *table, int i)
{
    const trial *const t = &table[i];
    for (const trial *other = table; other < t; other++) {
        const int same_fog = other->shape.type == t->shape.type && other->density.type == t->density.type;
        const int same_light = other->sky == t->sky && (other->light_count > 0) == (t->light_count > 0);
        if (has_sun(t) ? same_fog : same_light) return 0;
    }
    return 1;
}

static void judge_trials(const trial *table, int count)
{
    for (int i = 0; i < count; i++)
        if (nb_test_tries((size_t)i, (size_t)count) || is_first_of_kind(table, i)) judge_trial(&table[i]);
}

static void test_bodies_are_as_bright_as_the_reference(void **unused)
{
    (void)unused;
    judge_trials(trials, TRIALS);
}

static void test_ambient_light_is_dimmed_as_in_the_reference(void **unused)
{
    (void)unused;
    judge_trials(skylit, SKYLIT);
}

/* Paths find point lights in fog less often than the sun or the sky. */
static void test_own_light_is_as_bright_as_the_reference(void **unused)
{
    (void)unused;
    samples *= 4;
    judge_trials(glowing, GLOWING);
    samples /= 4;
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "table") == 0) {
        samples *= 16;
        print_trials("white fog", "light of one scattering", trials, TRIALS);
        print_trials("ambient light alone", "undimmed", skylit, SKYLIT);
        print_trials("point lights and what is emitted, alone", "without it", glowing, GLOWING);
        return 0;
    }
    samples = (uint32_t)nb_test_count(SAMPLES);
    if (samples < LEAST_SAMPLES) samples = LEAST_SAMPLES;
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bodies_are_as_bright_as_the_reference),
                                       cmocka_unit_test(test_ambient_light_is_dimmed_as_in_the_reference),
                                       cmocka_unit_test(test_own_light_is_as_bright_as_the_reference)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
