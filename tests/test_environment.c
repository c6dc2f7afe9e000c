/* Ambient light that is not the same from everywhere: what fog and surfaces make of it against brute force, its
 * directions, the contracts of every query, and what is no environment. */
#include "unit.h"

#include "fog_help.h"

#include <nebel/classic.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static const nebel_phase phases[] = {{.type = NEBEL_PHASE_ISOTROPIC},
                                     {.type = NEBEL_PHASE_RAYLEIGH},
                                     {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.76},
                                     {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = -0.4},
                                     {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.6},
                                     {.type = NEBEL_PHASE_DRAINE, .g = 0.3, .alpha = 20},
                                     {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.95},
                                     {.type = NEBEL_PHASE_DROPLETS, .diameter = 20},
                                     {.type = NEBEL_PHASE_DROPLETS, .diameter = 1},
                                     {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.999},
                                     {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = -0.9999}};
enum { PHASES = sizeof phases / sizeof *phases, BLUNT = 7 };

static const nebel_environment dusk = {
    .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {0.1, 0.3, 1}, .horizon = {2, 1, 0.5}, .ground = {0.05, 0.04, 0}};

/* Fog that nothing is seen through, of albedo 1. */
static nebel_lighting *commit(const nebel_environment *environment, const nebel_phase *phase)
{
    const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-99, -99, -99}, .max = {99, 99, 99}},
                                      .extinction = {9, 9, 9},
                                      .albedo = {1, 1, 1},
                                      .phase = *phase};
    return fog_light(&(nebel_lighting_desc){.environment = *environment}, &volume, 1);
}

static void ask(const nebel_lighting *lighting, const double direction[3], double scattered[3])
{
    const nebel_ray ray = {.direction = {direction[0], direction[1], direction[2]}, .t_max = 100};
    const nebel_transfer transfer = fog_along(lighting, &ray);
    memcpy(scattered, transfer.in_scattering, sizeof transfer.in_scattering);
}

static nebel_environment_map *make_map(size_t height, float (*radiance)(size_t x, size_t y, int c, size_t height))
{
    nebel_environment_map *map = NULL;
    float *pixels = malloc(2 * height * height * 3 * sizeof *pixels);
    assert_non_null(pixels);
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < 2 * height; x++)
            for (int c = 0; c < 3; c++) pixels[3 * (y * 2 * height + x) + (size_t)c] = radiance(x, y, c, height);
    const nebel_environment_map_desc desc = {.width = 2 * height, .height = height, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_OK);
    free(pixels);
    return map;
}

/* ---- brute force ----------------------------------------------------------------------------- */

static void frame_about(const double axis[3], double across[3], double third[3])
{
    const double helper[3] = {fabs(axis[0]) < 0.5, fabs(axis[0]) >= 0.5, 0};
    const double d[3] = {axis[1] * helper[2] - axis[2] * helper[1], axis[2] * helper[0] - axis[0] * helper[2],
                         axis[0] * helper[1] - axis[1] * helper[0]};
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int i = 0; i < 3; i++) across[i] = d[i] / length;
    third[0] = axis[1] * across[2] - axis[2] * across[1];
    third[1] = axis[2] * across[0] - axis[0] * across[2];
    third[2] = axis[0] * across[1] - axis[1] * across[0];
}

/* Cosines of equal parts of what is scattered, or reflected by Lambert's law. */
typedef struct cosines {
    int count;
    double *values;
} cosines;

static cosines make_cosines(const nebel_phase *phase, int count)
{
    const cosines made = {count, malloc((size_t)count * sizeof *made.values)};
    assert_non_null(made.values);
    for (int i = 0; i < count; i++) {
        const double part = (i + 0.5) / count;
        made.values[i] = phase != NULL ? nebel_sample_phase(phase, part) : sqrt(1 - part);
    }
    return made;
}

/* The mean radiance over directions at these cosines to an axis. */
static void mean_about(const nebel_environment *environment, const double axis[3], const cosines *at, int turns,
                       double mean[3])
{
    double across[3], third[3];
    frame_about(axis, across, third);
    memset(mean, 0, 3 * sizeof *mean);
    for (int i = 0; i < at->count; i++) {
        const double c = at->values[i], s = sqrt(fmax(1 - c * c, 0));
        for (int j = 0; j < turns; j++) {
            const double x = 2 * PI * (j + i * 0.618034) / turns;
            double direction[3], radiance[3];
            for (int k = 0; k < 3; k++) direction[k] = c * axis[k] + s * (cos(x) * across[k] + sin(x) * third[k]);
            nebel_evaluate_environment(environment, direction, radiance);
            for (int k = 0; k < 3; k++) mean[k] += radiance[k] / ((double)at->count * turns);
        }
    }
}

static const double directions[][3] = {{0, 1, 0},         {0, -1, 0},         {1, 0, 0},          {0, 0, -1},
                                       {0.6, 0.01, -0.8}, {-0.48, 0.6, 0.64}, {0.36, -0.48, 0.8}, {0.8, -0.002, 0.6}};
enum { DIRECTIONS = sizeof directions / sizeof *directions };

/* Fog of a phase function, along all directions, against brute force. */
static void expect_scattered(const nebel_environment *environment, const nebel_phase *phase, int parts, int turns,
                             double tolerance)
{
    nebel_lighting *lighting = commit(environment, phase);
    const cosines at = make_cosines(phase, parts);
    for (int i = 0; i < DIRECTIONS; i++) {
        double wanted[3], scattered[3], unit[3];
        const double *d = directions[i], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int k = 0; k < 3; k++) unit[k] = d[k] / length;
        mean_about(environment, unit, &at, turns, wanted);
        ask(lighting, d, scattered);
        for (int c = 0; c < 3; c++) {
            if (!(fabs(scattered[c] - wanted[c]) <= tolerance))
                fail_msg("phase %d %g, direction %d, channel %d: is %.9g, must be %.9g", (int)phase->type, phase->g, i,
                         c, scattered[c], wanted[c]);
        }
    }
    free(at.values);
    nebel_release_lighting(lighting);
}

static void expect_reflected(const nebel_environment *environment, double tolerance)
{
    const cosines at = make_cosines(NULL, 1000);
    for (int i = 0; i < DIRECTIONS; i++) {
        double wanted[3], reflected[3], unit[3];
        const double *d = directions[i], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int k = 0; k < 3; k++) unit[k] = d[k] / length;
        mean_about(environment, unit, &at, 100, wanted);
        nebel_evaluate_environment_diffuse(environment, d, reflected);
        for (int c = 0; c < 3; c++) assert_true(fabs(reflected[c] - wanted[c]) <= tolerance);
    }
    free(at.values);
}

static void fog_scatters_a_gradient(void **state)
{
    (void)state;
    for (int i = 0; i < PHASES; i++) expect_scattered(&dusk, &phases[i], 40000, 2, 4e-5);
}

static void surfaces_reflect_a_gradient(void **state)
{
    (void)state;
    expect_reflected(&dusk, 2e-5);
}

/* Blocks of light and dark, some bright. */
static float blocks(size_t x, size_t y, int c, size_t height)
{
    const size_t block = height / 8, i = (x / block) * 7 + (y / block) * 13 + (size_t)c * 3;
    return i % 5 == 0 ? 3 : i % 3 == 0 ? 0.2F : (float)(i % 7) * 0.1F;
}

static void fog_scatters_a_map(void **state)
{
    nebel_environment environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(64, blocks), .rotation = 33};
    (void)state;
    for (int i = 0; i < BLUNT; i++) expect_scattered(&environment, &phases[i], 4000, 12, 1e-3);
    expect_reflected(&environment, 1e-3);
    environment.intensity = 0.5;
    expect_scattered(&environment, &phases[2], 4000, 12, 5e-4);
    nebel_release_environment_map(environment.map);
}

/* ---- phase functions that see less than the map's degrees show ------------------------------- */

static float dark_but_one(size_t x, size_t y, int c, size_t height)
{
    return x == height / 2 && y == height / 3 ? 1000.0F * (float)(c + 1) : 0;
}

static float bright(size_t x, size_t y, int c, size_t height)
{
    (void)x, (void)y, (void)height;
    return 0.25F * (float)(c + 1);
}

static float bands(size_t x, size_t y, int c, size_t height)
{
    (void)x;
    return (float)(2 + cos(PI * ((double)y + 0.5) / (double)height) * (c + 1) / 3);
}

/* One bright pixel: nowhere less than dark, and all its light goes somewhere. */
static void sharp_fog_neither_rings_nor_loses_light(void **state)
{
    nebel_environment environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(48, dark_but_one)};
    double mean[3];
    const cosines sphere = make_cosines(&(nebel_phase){0}, 20000);
    (void)state;
    mean_about(&environment, (const double[3]){0, 1, 0}, &sphere, 64, mean);
    for (int i = BLUNT - 1; i < PHASES; i++) {
        nebel_lighting *lighting = commit(&environment, &phases[i]);
        double sum = 0, least = HUGE_VAL, most = 0;
        enum { COUNT = 120 };
        for (int y = 0; y < COUNT; y++)
            for (int x = 0; x < 2 * COUNT; x++) {
                const double down = PI * (y + 0.5) / COUNT, across = PI * (x + 0.5) / COUNT, level = sin(down);
                const double direction[3] = {level * sin(across), cos(down), -level * cos(across)};
                double scattered[3];
                ask(lighting, direction, scattered);
                sum += scattered[0] * level * (PI / COUNT) * (PI / COUNT) / (4 * PI);
                least = fmin(least, scattered[0]);
                most = fmax(most, scattered[0]);
            }
        assert_true(fabs(sum - mean[0]) <= 2e-3 * mean[0]);
        assert_true(least >= 0);
        assert_true(most > 10 * mean[0]);
        nebel_release_lighting(lighting);
    }
    free(sphere.values);
    nebel_release_environment_map(environment.map);
}

/* What is blurred by at most 1.1 degrees is hardly another where it changes slowly. */
static void sharp_fog_sees_what_changes_slowly(void **state)
{
    const nebel_environment environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(256, bands)};
    (void)state;
    for (int i = BLUNT; i < PHASES; i++) expect_scattered(&environment, &phases[i], 20000, 2, 1e-3);
    nebel_release_environment_map(environment.map);
}

/* ---- white stays white ----------------------------------------------------------------------- */

static void an_even_environment_is_constant_light(void **state)
{
    const nebel_environment gradient = {.type = NEBEL_ENVIRONMENT_GRADIENT,
                                        .zenith = {0.25, 0.5, 0.75},
                                        .horizon = {0.25, 0.5, 0.75},
                                        .ground = {0.25, 0.5, 0.75}};
    const nebel_environment map = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(16, bright), .rotation = -70};
    (void)state;
    for (int i = 0; i < PHASES; i++) {
        expect_scattered(&gradient, &phases[i], 1, 1, 1e-9);
        if (i % 3 == 1) expect_scattered(&map, &phases[i], 1, 1, 1e-6);
    }
    expect_reflected(&gradient, 1e-9);
    expect_reflected(&map, 1e-6);
    nebel_release_environment_map(map.map);
}

/* Bits and all: a constant environment is the ambient radiance. */
static void a_constant_one_is_the_ambient_radiance(void **state)
{
    const nebel_environment constant = {.radiance = {0.3, 0.4, 0.7}};
    (void)state;
    for (int i = 0; i < PHASES; i++) {
        nebel_lighting *lighting = commit(&constant, &phases[i]);
        double scattered[3], reflected[3];
        ask(lighting, directions[i % DIRECTIONS], scattered);
        nebel_evaluate_environment_diffuse(&constant, directions[i % DIRECTIONS], reflected);
        assert_memory_equal(scattered, constant.radiance, sizeof scattered);
        assert_memory_equal(reflected, constant.radiance, sizeof reflected);
        nebel_release_lighting(lighting);
    }
}

/* ---- directions ------------------------------------------------------------------------------ */

static float quarters(size_t x, size_t y, int c, size_t height)
{
    (void)y, (void)c;
    return (float)(2 * x / height);
}

/* Where the middle of the picture is, what is right of it, and which way it turns. */
static void maps_lie_as_panoramas_do(void **state)
{
    nebel_environment environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(64, quarters)};
    double radiance[3];
    (void)state;
    nebel_evaluate_environment(&environment, (const double[3]){0.1, 0, -1}, radiance);
    assert_true(radiance[0] > 1.99 && radiance[0] < 2.01); /* just right of the middle of columns 0 to 3 */
    nebel_evaluate_environment(&environment, (const double[3]){-0.1, 0, -1}, radiance);
    assert_true(radiance[0] > 0.99 && radiance[0] < 1.01);
    nebel_evaluate_environment(&environment, (const double[3]){0.1, 0, 1}, radiance);
    assert_true(radiance[0] > 2.99);
    environment.rotation = 90; /* what was at -z is at -x now */
    nebel_evaluate_environment(&environment, (const double[3]){-1, 0, -0.1}, radiance);
    assert_true(radiance[0] > 1.99 && radiance[0] < 2.01);
    nebel_evaluate_environment(&environment, (const double[3]){-1, 0, 0.1}, radiance);
    assert_true(radiance[0] > 0.99 && radiance[0] < 1.01);
    nebel_evaluate_environment(&environment, (const double[3]){0, 0, 0}, radiance);
    assert_true(radiance[0] == 0);
    nebel_evaluate_environment_diffuse(&environment, (const double[3]){0, (double)NAN, 1}, radiance);
    assert_true(radiance[0] == 0);
    nebel_release_environment_map(environment.map);
}

/* ---- the contracts of queries ---------------------------------------------------------------- */

static nebel_lighting *commit_many(const nebel_environment *environment)
{
    nebel_volume_desc volumes[PHASES];
    for (int i = 0; i < PHASES; i++)
        volumes[i] =
            (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {i - 5.0, 0.3 * i, -6}, .radius = 2},
                                .density = {.type = i % 2 ? NEBEL_DENSITY_CONSTANT : NEBEL_DENSITY_RADIAL, .power = 1},
                                .extinction = {0.2, 0.3, 0.1},
                                .albedo = {0.9, 0.8, 1},
                                .phase = phases[i]};
    return fog_light(&(nebel_lighting_desc){.environment = *environment}, volumes, PHASES);
}

enum { RAYS = 500 };

static void throw_rays(nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){.origin = {0.001 * i, 0, 0},
                              .direction = {sin(i * 0.7), 0.5 * sin(i * 1.3), -1},
                              .t_max = i % 7 == 0 ? 6 : HUGE_VAL};
}

/* The same bits for every instruction set and alone; float is near double; light leaves transmittance as it is. */
static void expect_contracts(const nebel_environment *environment)
{
    nebel_lighting *lighting = commit_many(environment);
    static nebel_ray rays[RAYS];
    static nebel_transfer exact[RAYS], first[RAYS], transfers[RAYS];
    throw_rays(rays);
    nebel_trace_desc desc = {.precision = NEBEL_PRECISION_DOUBLE};
    fog_trace(lighting, desc, RAYS, rays, exact);
    desc = (nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR};
    fog_trace(lighting, desc, RAYS, rays, first);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++)
            assert_true(fabs(first[i].in_scattering[c] - exact[i].in_scattering[c]) <= first[i].error + 1e-7);
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        desc.isa = (nebel_isa)isa;
        fog_trace(lighting, desc, RAYS, rays, transfers);
        assert_memory_equal(transfers, first, sizeof first);
        for (size_t i = 0; i < nb_test_count(RAYS); i++) fog_trace(lighting, desc, 1, &rays[i], &transfers[i]);
        assert_memory_equal(transfers, first, sizeof first);
        desc.transmittance_only = 1;
        fog_trace(lighting, desc, RAYS, rays, transfers);
        for (int i = 0; i < RAYS; i++)
            assert_memory_equal(transfers[i].transmittance, first[i].transmittance, sizeof first[i].transmittance);
        desc.transmittance_only = 0;
    }
    nebel_release_lighting(lighting);
}

static void contracts_hold(void **state)
{
    const nebel_environment map = {.type = NEBEL_ENVIRONMENT_MAP, .map = make_map(32, blocks), .rotation = 12};
    (void)state;
    expect_contracts(&dusk);
    expect_contracts(&map);
    nebel_release_environment_map(map.map);
}

/* Boxes of one light have a short cut; this is not one light. */
static void a_box_at_vertices_is_lit_by_direction(void **state)
{
    nebel_lighting *lighting = commit(&dusk, &phases[2]);
    (void)state;
    float positions[2][3] = {{0, 50, -10}, {0, -50, -10}}, colors[2][4];
    const nebel_vertices vertices = {.positions = positions[0], .position_stride = sizeof *positions};
    const nebel_vertex_output output = {.format = NEBEL_VERTEX_RGBA_FLOAT, .data = colors, .stride = sizeof *colors};
    const nebel_vertex_desc desc = {.lighting = lighting};
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    assert_int_equal(nebel_compute_vertex_fog(snapshot, &desc, 2, &vertices, &output, 1), NEBEL_OK);
    assert_true(colors[0][2] > 1.2F * colors[1][2]);
    nebel_release_lighting(lighting);
}

/* ---- what is none ---------------------------------------------------------------------------- */

static void expect_refused(nebel_snapshot *snapshot, const nebel_environment *environment, nebel_result result)
{
    nebel_lighting *lighting = NULL;
    const nebel_lighting_desc lights = {.environment = *environment};
    assert_int_equal(nebel_create_lighting(snapshot, &lights, &lighting), result);
    assert_null(lighting);
}

static void what_is_no_environment_is_refused(void **state)
{
    nebel_snapshot *empty = fog_commit(&(nebel_fog_desc){0}, NULL, 0);
    (void)state;
    nebel_environment_map *map = make_map(8, bright);
    const nebel_environment wrong[] = {
        {.radiance = {-1, 0, 0}},
        {.radiance = {0, (double)NAN, 0}},
        {.type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {0, 0, 2e9}},
        {.type = NEBEL_ENVIRONMENT_GRADIENT, .ground = {HUGE_VAL, 0, 0}},
        {.type = NEBEL_ENVIRONMENT_GRADIENT, .horizon = {0, -1e-9, 0}},
        {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = 2e6},
        {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = (double)NAN},
        {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = -1},
        {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = 1e9 * 2},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) expect_refused(empty, &wrong[i], NEBEL_ERROR_VALUE);
    expect_refused(empty, &(nebel_environment){.type = NEBEL_ENVIRONMENT_MAP}, NEBEL_ERROR_ARGUMENT);
    expect_refused(empty, &(nebel_environment){.type = NEBEL_ENVIRONMENT_COUNT}, NEBEL_ERROR_ARGUMENT);
    double radiance[3] = {1, 1, 1}; /* where there is none there is no light */
    nebel_evaluate_environment(&(nebel_environment){.type = NEBEL_ENVIRONMENT_MAP}, (const double[3]){0, 1, 0},
                               radiance);
    for (int c = 0; c < 3; c++) assert_true(radiance[c] == 0);
    nebel_release_environment_map(map);
    nebel_release_snapshot(empty);
}

static void what_is_no_map_is_refused(void **state)
{
    float pixels[8 * 4 * 3] = {0};
    nebel_environment_map *map;
    nebel_environment_map_desc desc = {.width = 8, .height = 4, .pixels = pixels};
    static const float wrong[] = {-1, NAN, INFINITY, 2e9F};
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        pixels[41] = wrong[i];
        assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_VALUE);
        assert_null(map);
    }
    pixels[41] = 1;
    desc.height = 5;
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_VALUE);
    desc = (nebel_environment_map_desc){
        .width = 2 * NEBEL_MAX_ENVIRONMENT_WIDTH, .height = NEBEL_MAX_ENVIRONMENT_WIDTH, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_LIMIT);
    desc.width = desc.height = 0;
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_LIMIT);
    desc.pixels = NULL;
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_environment_map(NULL, &map), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_environment_map(&desc, NULL), NEBEL_ERROR_ARGUMENT);
    desc = (nebel_environment_map_desc){
        .host.allocator = {.allocate = fog_memory_allocate}, .width = 8, .height = 4, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_ERROR_ARGUMENT);
    assert_null(map);
}

/* As many phase functions as there may be, and one more. */
static void phase_functions_have_a_limit(void **state)
{
    const nebel_lighting_desc lights = {.environment = dusk}, even = {.environment = {.radiance = {1, 1, 1}}};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    (void)state;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (int i = 0; i <= NEBEL_MAX_ENVIRONMENT_PHASES; i++) {
        const nebel_phase phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.01 * i};
        const nebel_volume_desc volume = {.extinction = {1, 1, 1}, .albedo = {1, 1, 1}, .phase = phase};
        assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
        assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
        if (i + 1 < NEBEL_MAX_ENVIRONMENT_PHASES) continue;
        const nebel_result wanted = i < NEBEL_MAX_ENVIRONMENT_PHASES ? NEBEL_OK : NEBEL_ERROR_LIMIT;
        nebel_release_snapshot(snapshot);
        assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
        assert_int_equal(nebel_create_lighting(snapshot, &lights, &lighting), wanted);
        assert_true((lighting == NULL) == (wanted != NEBEL_OK));
        nebel_release_lighting(lighting);
    }
    nebel_release_lighting(light_fog(snapshot, &even));
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
}

/* Every allocation that may fail does, and nothing is lost. */
static void memory_may_be_out(void **state)
{
    float pixels[8 * 4 * 3] = {0};
    (void)state;
    const size_t step = 4 - nb_test_count(3); /* one in three at least */
    for (size_t fail = 1;; fail += step) {
        fog_memory memory = {.fail_first = fail, .fail_count = 1};
        const nebel_allocator allocator = {fog_memory_allocate, fog_memory_release, &memory};
        const nebel_environment_map_desc desc = {
            .host.allocator = allocator, .width = 8, .height = 4, .pixels = pixels};
        nebel_lighting_desc lights = {.environment = {.type = NEBEL_ENVIRONMENT_MAP}};
        nebel_fog *fog = NULL;
        nebel_snapshot *snapshot = NULL;
        nebel_lighting *lighting = NULL;
        const nebel_volume_desc volume = {.extinction = {1, 1, 1}, .albedo = {1, 1, 1}, .phase = phases[2]};
        nebel_result result = nebel_create_environment_map(&desc, &lights.environment.map);
        if (result == NEBEL_OK) result = nebel_create_fog(&(nebel_fog_desc){.host.allocator = allocator}, &fog);
        if (result == NEBEL_OK) result = nebel_add_volume(fog, &volume, NULL);
        if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
        if (result == NEBEL_OK) result = nebel_create_lighting(snapshot, &lights, &lighting);
        nebel_release_snapshot(snapshot);
        nebel_release_lighting(lighting);
        nebel_destroy_fog(fog);
        nebel_release_environment_map(lights.environment.map);
        assert_int_equal(memory.live, 0);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fog_scatters_a_gradient),
        cmocka_unit_test(surfaces_reflect_a_gradient),
        cmocka_unit_test(fog_scatters_a_map),
        cmocka_unit_test(sharp_fog_neither_rings_nor_loses_light),
        cmocka_unit_test(sharp_fog_sees_what_changes_slowly),
        cmocka_unit_test(an_even_environment_is_constant_light),
        cmocka_unit_test(a_constant_one_is_the_ambient_radiance),
        cmocka_unit_test(maps_lie_as_panoramas_do),
        cmocka_unit_test(contracts_hold),
        cmocka_unit_test(a_box_at_vertices_is_lit_by_direction),
        cmocka_unit_test(what_is_no_environment_is_refused),
        cmocka_unit_test(what_is_no_map_is_refused),
        cmocka_unit_test(phase_functions_have_a_limit),
        cmocka_unit_test(memory_may_be_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
