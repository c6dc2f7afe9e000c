/* The planet of tutorials: its formulas against a rendition of their own, its maps, and bad input. */
#include <nebel/planet.h>

#include "math/vector.h"

#include "dice.h"
#include "scarce_memory.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { ROWS = 16, COLUMNS = 32 };

static float clouds[ROWS][COLUMNS], detail[ROWS][COLUMNS], ground[ROWS][COLUMNS][3];

static nebel_textured_planet *create(const nebel_textured_planet_desc *desc)
{
    nebel_textured_planet *layers = NULL;
    assert_int_equal(nebel_create_textured_planet(desc, &layers), NEBEL_OK);
    return layers;
}

static nebel_shell_hits look(const nebel_textured_planet *layers, const nebel_textured_planet_query *view,
                             const nebel_ray *ray)
{
    nebel_shell_hits hits;
    assert_int_equal(nebel_trace_textured_planet(layers, view, 1, ray, 0, &hits, 0), NEBEL_OK);
    return hits;
}

/* ---- the formulas ---------------------------------------------------------------------------- */

static void roll_maps(uint64_t *numbers)
{
    for (int y = 0; y < ROWS; y++) {
        for (int x = 0; x < COLUMNS; x++) {
            clouds[y][x] = (float)dice(numbers, 0, 1);
            detail[y][x] = (float)dice(numbers, 0, 1);
            for (int c = 0; c < 3; c++) ground[y][x][c] = (float)dice(numbers, 0, 1);
        }
    }
}

static double wrapped(double x, double n)
{
    return x - n * floor(x / n);
}

/* A texture's linear filter as a sum over all texels, each of which weighs 1 - distance along both axes. */
static double filter(const float *texels, int stride, double u, double v, int repeats)
{
    double sum = 0, all = 0;
    const double x = wrapped(u * COLUMNS - .5, COLUMNS);
    const double y = repeats ? wrapped(v * ROWS - .5, ROWS) : fmin(fmax(v * ROWS - .5, 0), ROWS - 1);
    for (int row = 0; row < ROWS; row++) {
        for (int column = 0; column < COLUMNS; column++) {
            const double dx = fabs(x - column), dy = fabs(y - row);
            const double across = fmin(dx, COLUMNS - dx), down = repeats ? fmin(dy, ROWS - dy) : dy;
            const double weight = fmax(0, 1 - across) * fmax(0, 1 - down);
            sum += weight * (double)texels[(row * COLUMNS + column) * stride];
            all += weight;
        }
    }
    return sum / all;
}

/* The planet of the test: at the origin, of radius 2, clouds at 2.5, air at 3. */
static const double wraps[3] = {2, 3, -5}, gain = .4, brightness = .7;
static const double ramp[4][3] = {{.1, 0, .3}, {.2, .9, .4}, {.5, .6, 1}, {0, .1, .2}};

static nebel_textured_planet *create_known(void)
{
    nebel_textured_planet_desc desc = {
        .radius = 2, .cloud_shell_count = 1, .color_map = {COLUMNS, ROWS, 3, ground[0][0]}};
    desc.cloud_shells[0] = (nebel_cloud_shell){.height = .5,
                                               .gain = gain,
                                               .color = {.9, .8, .7},
                                               .coverage_map = {COLUMNS, ROWS, 1, clouds[0]},
                                               .detail_map = {COLUMNS, ROWS, 1, detail[0]}};
    memcpy(desc.cloud_shells[0].uv_tiling, wraps, sizeof wraps);
    desc.atmosphere = (nebel_atmosphere_shell){.height = 1, .brightness = brightness, .ramp_count = 4};
    memcpy(desc.atmosphere.ramp, ramp, sizeof ramp);
    return create(&desc);
}

typedef struct place {
    double t, normal[3], u, v, sun, view;
} place;

/* Where a ray from outside first meets a ball around the origin: by halving, from the place closest to it. */
static int find_place(const nebel_ray *ray, const double sun[3], double radius, place *p)
{
    double low = 0, high = 0;
    for (int i = 0; i < 3; i++) high -= ray->origin[i] * ray->direction[i];
    for (int step = 0; step <= 200; step++) {
        const double t = step == 0 ? high : .5 * (low + high);
        double square = 0;
        for (int i = 0; i < 3; i++) square += pow(ray->origin[i] + t * ray->direction[i], 2);
        if (step == 0 && square > radius * radius) return 0;
        if (square > radius * radius)
            low = t;
        else
            high = t;
    }
    p->t = high;
    p->sun = p->view = 0;
    for (int i = 0; i < 3; i++) {
        p->normal[i] = (ray->origin[i] + high * ray->direction[i]) / radius;
        p->sun += p->normal[i] * sun[i];
        p->view -= p->normal[i] * ray->direction[i];
    }
    /* east of +x is -z; the middle column looks along +x */
    p->u = .5 + atan2(-p->normal[2], p->normal[0]) / (2 * PI);
    p->v = .5 - asin(fmin(fmax(p->normal[1], -1), 1)) / PI;
    return 1;
}

static void expect_hit(const nebel_shell_hit *hit, double t, const double radiance[3], double cover)
{
    assert_true(fabs(hit->t - t) < 1e-9);
    assert_true(fabs(hit->opacity - cover) < 1e-6);
    for (int c = 0; c < 3; c++) assert_true(fabs(hit->radiance[c] - radiance[c]) < 1e-6);
}

static void expect_clouds(const nebel_textured_planet_query *view, const place *p, const nebel_shell_hit *hit)
{
    static const double color[3] = {.9, .8, .7};
    double sum = 0, radiance[3];
    for (int i = 0; i < 3; i++) sum += filter(detail[0], 1, wraps[i] * p->u, wraps[i] * p->v, 1);
    const double all = gain * (filter(clouds[0], 1, p->u, p->v, 0) + (1 - fabs(p->normal[1])) * sum);
    const double cover = fmin(all, 1);
    for (int c = 0; c < 3; c++)
        radiance[c] = cover * color[c] * (view->sun.irradiance[c] * fmax(p->sun, 0) / PI + view->ambient[c]);
    expect_hit(hit, p->t, radiance, cover);
}

static void expect_ground(const nebel_textured_planet_query *view, const place *p, const nebel_shell_hit *hit)
{
    double radiance[3];
    for (int c = 0; c < 3; c++)
        radiance[c] = filter(&ground[0][0][c], 3, p->u, p->v, 0) *
                      (view->sun.irradiance[c] * fmax(p->sun, 0) / PI + view->ambient[c]);
    expect_hit(hit, p->t, radiance, 1);
}

static void expect_air(const place *p, const nebel_shell_hit *hit)
{
    const double s = 3 * p->sun + 3, v = fmin(.9, fabs(p->view)), u = 1 - .5 * v;
    double radiance[3];
    for (int c = 0; c < 3; c++) {
        const double between =
            u * 3 - 2; /* u is in the second half: between the third and the fourth colour, or before */
        const double color = between >= 0 ? ramp[2][c] + between * (ramp[3][c] - ramp[2][c])
                                          : ramp[2][c] + -between * (ramp[1][c] - ramp[2][c]);
        radiance[c] = brightness * s * v * (1 - v) * color;
    }
    expect_hit(hit, p->t, radiance, 0);
}

/* Towards a place on the ball of clouds, from somewhere. */
static nebel_ray ray_to(const double target[3], uint64_t *numbers)
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    double length = 0;
    for (int i = 0; i < 3; i++) ray.origin[i] = dice(numbers, 4, 9) * (dice_below(numbers, 2) ? 1 : -1);
    for (int i = 0; i < 3; i++) ray.direction[i] = target[i] - ray.origin[i];
    for (int i = 0; i < 3; i++) length += ray.direction[i] * ray.direction[i];
    for (int i = 0; i < 3; i++) ray.direction[i] /= sqrt(length);
    return ray;
}

/* Every third near a pole, every third near the line where the map's columns meet. */
static void choose_target(int number, uint64_t *numbers, double target[3])
{
    const double off = number % 2 ? 1e-6 : .1;
    for (int i = 0; i < 3; i++) target[i] = dice(numbers, -2.4, 2.4);
    if (number % 3 == 1) {
        target[0] = dice(numbers, -off, off);
        target[1] = dice_below(numbers, 2) ? 2.5 : -2.5;
        target[2] = dice(numbers, -off, off);
    }
    if (number % 3 == 2) {
        target[0] = -2.4;
        target[2] = dice(numbers, -off, off);
    }
}

static void layers_are_those_of_the_formulas(void **state)
{
    (void)state;
    uint64_t numbers = 5;
    int grounds = 0;
    nebel_textured_planet_query view = {.sun = {{.48, .6, .64}, {3, 2, 1}}, .ambient = {.1, .2, .3}};
    roll_maps(&numbers);
    nebel_textured_planet *layers = create_known();
    for (int i = 0; i < 3000; i++) {
        double target[3];
        place p;
        choose_target(i, &numbers, target);
        const nebel_ray ray = ray_to(target, &numbers);
        const nebel_shell_hits hits = look(layers, &view, &ray);
        uint32_t count = 0;
        if (find_place(&ray, view.sun.direction, 3, &p)) expect_air(&p, &hits.hits[count++]);
        if (find_place(&ray, view.sun.direction, 2.5, &p)) expect_clouds(&view, &p, &hits.hits[count++]);
        if (find_place(&ray, view.sun.direction, 2, &p)) {
            grounds++;
            expect_ground(&view, &p, &hits.hits[count++]);
        }
        assert_int_equal(hits.count, count);
    }
    assert_true(grounds > 500);
    nebel_destroy_textured_planet(layers);
}

/* From within the clouds their inner side is seen, and behind the end of the ray nothing. */
static void rays_end_and_begin_within(void **state)
{
    (void)state;
    nebel_textured_planet *layers = create_known();
    const nebel_textured_planet_query view = {.sun = {{0, 1, 0}, {1, 1, 1}}};
    nebel_ray ray = {{0, 2.25, 0}, {0, 1, 0}, HUGE_VAL};
    nebel_shell_hits hits = look(layers, &view, &ray);
    assert_int_equal(hits.count, 2);
    assert_true(fabs(hits.hits[0].t - .25) < 1e-12 && fabs(hits.hits[1].t - .75) < 1e-12);
    ray.t_max = .5;
    assert_int_equal(look(layers, &view, &ray).count, 1);
    ray = (nebel_ray){{0, 2.25, 0}, {0, -1, 0}, HUGE_VAL};
    hits = look(layers, &view, &ray);
    assert_int_equal(hits.count, 1);
    assert_true(hits.hits[0].opacity == 1);
    ray = (nebel_ray){{0, 9, 0}, {0, 1, 0}, HUGE_VAL};
    assert_int_equal(look(layers, &view, &ray).count, 0);
    nebel_destroy_textured_planet(layers);
}

/* From on the ground, to rounding, there is the ground below and no ground above. */
static void the_ground_is_below_who_stands_on_it(void **state)
{
    (void)state;
    uint64_t numbers = 11;
    nebel_textured_planet *layers = create_known();
    const nebel_textured_planet_query view = {.sun = {{0, 1, 0}, {1, 1, 1}}};
    for (int i = 0; i < 1000; i++) {
        double up[3] = {dice(&numbers, -1, 1), dice(&numbers, -1, 1), dice(&numbers, -1, 1)};
        nebel_ray ray = {.t_max = HUGE_VAL};
        if (!nb_vector_make_unit(up)) continue;
        for (int c = 0; c < 3; c++) {
            ray.origin[c] = 2 * (1 + dice(&numbers, -5e-16, 5e-16)) * up[c];
            ray.direction[c] = dice(&numbers, -1, 1);
        }
        const double rise = nb_vector_dot(up, ray.direction);
        if (fabs(rise) < 1e-6) continue;
        const nebel_shell_hits hits = look(layers, &view, &ray);
        assert_int_equal(hits.count, rise > 0 ? 2 : 1);
        assert_int_equal(hits.hits[0].is_ground, rise < 0);
        assert_true(rise > 0 || hits.hits[0].t < 1e-12);
    }
    nebel_destroy_textured_planet(layers);
}

/* After a quarter of a day what was to the west is here: an eastward turn. The clouds turn with the ground and on. */
static void balls_turn_to_the_east(void **state)
{
    (void)state;
    nebel_textured_planet_desc desc = {
        .radius = 2, .rotation_period = 400, .cloud_shell_count = 1, .color_map = {COLUMNS, ROWS, 3, ground[0][0]}};
    desc.cloud_shells[0] =
        (nebel_cloud_shell){.height = .5, .rotation_period = -400, .coverage_map = {COLUMNS, ROWS, 1, clouds[0]}};
    desc.atmosphere.is_disabled = 1;
    nebel_textured_planet *layers = create(&desc);
    nebel_textured_planet_query view = {.ambient = {1, 1, 1}};
    const nebel_ray here = {{9, 1, 0}, {-9, -.5, 0}, HUGE_VAL}, west = {{0, 1, 9}, {0, -.5, -9}, HUGE_VAL};
    const nebel_shell_hits before = look(layers, &view, &west), same = look(layers, &view, &here);
    view.time = 100;
    const nebel_shell_hits after = look(layers, &view, &here);
    for (int c = 0; c < 3; c++) {
        assert_true(fabs(after.hits[1].radiance[c] - before.hits[1].radiance[c]) < 1e-6);
        assert_true(fabs(after.hits[1].radiance[c] - same.hits[1].radiance[c]) > 1e-3);
        assert_true(fabs(after.hits[0].radiance[c] - same.hits[0].radiance[c]) < 1e-6);
    }
    nebel_destroy_textured_planet(layers);
}

/* From very far away a map is its mean. */
static void maps_are_averaged(void **state)
{
    (void)state;
    nebel_textured_planet *layers = create_known();
    double mean = 0;
    for (int i = 0; i < ROWS * COLUMNS; i++) mean += (double)ground[i / COLUMNS][i % COLUMNS][1] / (ROWS * COLUMNS);
    const nebel_textured_planet_query view = {.ambient = {1, 1, 1}, .pixel_spread = 10};
    const nebel_shell_hits hits = look(layers, &view, &(nebel_ray){{9, 1, 0}, {-1, 0, 0}, HUGE_VAL});
    assert_true(fabs(hits.hits[hits.count - 1].radiance[1] - mean) < 1e-5);
    nebel_destroy_textured_planet(layers);
}

/* ---- maps that are made ---------------------------------------------------------------------- */

enum { TALL = 128, WIDE = 256 };

/* The largest difference between neighbours of a row, from one column to another. */
static double steepest(const float *texels, int channels, size_t row, size_t from_column, size_t to_column)
{
    double most = 0;
    const size_t n = (size_t)channels;
    for (size_t x = from_column; x < to_column; x++)
        for (size_t c = 0; c < n; c++)
            most = fmax(most, fabs((double)texels[(row * WIDE + x) * n + c] -
                                   (double)texels[(row * WIDE + (x + 1) % WIDE) * n + c]));
    return most;
}

/* Columns meet at the seam, rows of a tile too; in the first and the last row of a ball texels lie close together. */
static void expect_smooth(const float *texels, int channels, int is_ball)
{
    double inside = 0, seam = 0;
    for (size_t y = 0; y < TALL; y++) {
        inside = fmax(inside, steepest(texels, channels, y, 0, WIDE - 1));
        seam = fmax(seam, steepest(texels, channels, y, WIDE - 1, WIDE));
    }
    for (size_t x = 0; x < WIDE && !is_ball; x++)
        seam = fmax(seam, fabs((double)texels[x] - (double)texels[(TALL - 1) * WIDE + x]));
    assert_true(inside > .01 && seam <= inside);
    for (size_t row = 0; row < TALL && is_ball; row += TALL - 1)
        assert_true(steepest(texels, channels, row, 0, WIDE) < .2 * inside);
}

static void maps_have_no_seam_and_no_star(void **state)
{
    (void)state;
    static float texels[TALL * WIDE * 3];
    for (int kind = 0; kind < NEBEL_PLANET_MAP_TYPE_COUNT; kind++) {
        for (uint32_t seed = 1; seed < 4; seed++) {
            const nebel_planet_map_desc desc = {
                .type = (nebel_planet_map_type)kind, .width = WIDE, .height = TALL, .seed = seed};
            const int channels = kind == NEBEL_PLANET_MAP_GROUND ? 3 : 1;
            assert_int_equal(nebel_generate_planet_map(&desc, texels), NEBEL_OK);
            expect_smooth(texels, channels, kind != NEBEL_PLANET_MAP_DETAIL);
        }
    }
}

static void coverage_is_about_what_is_asked(void **state)
{
    (void)state;
    static float texels[TALL * WIDE];
    double last = 0;
    for (int i = 1; i < 10; i += 2) {
        const nebel_planet_map_desc desc = {.width = WIDE, .height = TALL, .coverage = .1 * i};
        double covered = 0;
        assert_int_equal(nebel_generate_planet_map(&desc, texels), NEBEL_OK);
        for (size_t k = 0; k < TALL * WIDE; k++) covered += (texels[k] > 0) * 1. / (TALL * WIDE);
        assert_true(fabs(covered - .1 * i) < .15 && covered > last);
        last = covered;
    }
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void keep_text(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    (void)snprintf(user, 200, "%s", message);
}

static void faults_say_the_number(void **state)
{
    (void)state;
    char said[200] = "";
    nebel_textured_planet *layers;
    const nebel_log log = {keep_text, said};
    assert_int_equal(
        nebel_create_textured_planet(&(nebel_textured_planet_desc){.radius = .5, .host.log = log}, &layers),
        NEBEL_ERROR_VALUE);
    assert_string_equal(said, "planet: radius: is 0.5; must be within 1 and 1e+12");
    nebel_textured_planet_desc desc = {
        .cloud_shell_count = 2, .cloud_shells = {{.gain = 1}, {.height = -1}}, .host.log = log};
    assert_int_equal(nebel_create_textured_planet(&desc, &layers), NEBEL_ERROR_VALUE);
    assert_string_equal(said, "planet: clouds[1]: height: is -1; must be more than 0, at most 1e12");
    assert_null(layers);
}

static void bad_descriptions_are_refused(void **state)
{
    (void)state;
    nebel_textured_planet *layers = NULL;
    const nebel_textured_planet_desc bad[] = {
        {.radius = -1},
        {.radius = (double)NAN},
        {.radius = .5},
        {.center = {HUGE_VAL, 0, 0}},
        {.rotation = {0, (double)NAN, 0, 1}},
        {.rotation_period = (double)NAN},
        {.land_coverage = 2},
        {.cloud_shell_count = 9},
        {.atmosphere = {.height = -1}},
        {.atmosphere = {.brightness = (double)NAN}},
        {.atmosphere = {.ramp_count = 17}},
        {.cloud_shell_count = 1, .cloud_shells = {{.height = -1}}},
        {.cloud_shell_count = 1, .cloud_shells = {{.gain = (double)NAN}}},
        {.cloud_shell_count = 1, .cloud_shells = {{.uv_tiling = {1e9, 0, 0}}}},
        {.cloud_shell_count = 1, .cloud_shells = {{.coverage_map = {COLUMNS, ROWS, 3, ground[0][0]}}}},
        {.cloud_shell_count = 1, .cloud_shells = {{.coverage_map = {0, ROWS, 1, clouds[0]}}}},
        {.cloud_shell_count = 1, .cloud_shells = {{.coverage_map = {COLUMNS, ROWS, 1, NULL}}}},
        {.color_map = {SIZE_MAX, SIZE_MAX, 3, ground[0][0]}}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(nebel_create_textured_planet(&bad[i], &layers), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_create_textured_planet(NULL, &layers), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_textured_planet(&(nebel_textured_planet_desc){.radius = 1}, NULL),
                     NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_generate_planet_map(&(nebel_planet_map_desc){.coverage = (double)NAN}, clouds[0]),
                     NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_generate_planet_map(&(nebel_planet_map_desc){.width = 20000}, clouds[0]), NEBEL_ERROR_VALUE);
}

static void bad_rays_are_refused(void **state)
{
    (void)state;
    nebel_textured_planet *layers = create_known();
    nebel_shell_hits hits;
    const nebel_textured_planet_query good = {.time = 0};
    const nebel_ray ray = {{9, 0, 0}, {-1, 0, 0}, HUGE_VAL};
    const nebel_ray rays[] = {
        {{(double)NAN, 0, 0}, {-1, 0, 0}, 1}, {{0, 1.1e15, 0}, {-1, 0, 0}, 1}, {{9, 0, 0}, {0, 0, 0}, 1},
        {{9, 0, 0}, {(double)NAN, 0, 0}, 1},  {{9, 0, 0}, {-1, 0, 0}, -1},     {{HUGE_VAL, 0, 0}, {-1, 0, 0}, 1}};
    const nebel_textured_planet_query views[] = {{.time = (double)NAN},
                                                 {.time = HUGE_VAL},
                                                 {.pixel_spread = -1},
                                                 {.ambient = {(double)NAN, 0, 0}},
                                                 {.sun = {{(double)NAN, 0, 0}, {1, 1, 1}}},
                                                 {.sun = {{1, 0, 0}, {-1, 1, 1}}}};
    for (size_t i = 0; i < sizeof rays / sizeof *rays; i++)
        assert_int_equal(nebel_trace_textured_planet(layers, &good, 1, &rays[i], 0, &hits, 0), NEBEL_ERROR_ARGUMENT);
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        assert_int_equal(nebel_trace_textured_planet(layers, &views[i], 1, &ray, 0, &hits, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_textured_planet(NULL, &good, 1, &ray, 0, &hits, 0), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_textured_planet(layers);
}

static void memory_that_runs_out_is_told(void **state)
{
    (void)state;
    nebel_textured_planet *layers = NULL;
    for (int most = 0;; most++) {
        int left = most;
        nebel_textured_planet_desc desc = {.host.allocator = {scarce_allocate, scarce_release, &left},
                                           .color_map = {COLUMNS, ROWS, 3, ground[0][0]},
                                           .cloud_shell_count = 1};
        desc.cloud_shells[0].coverage_map = (nebel_planet_map){COLUMNS, ROWS, 1, clouds[0]};
        const nebel_result result = nebel_create_textured_planet(&desc, &layers);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_null(layers);
    }
    nebel_destroy_textured_planet(layers);
    nebel_destroy_textured_planet(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_those_of_the_formulas),
        cmocka_unit_test(rays_end_and_begin_within),
        cmocka_unit_test(the_ground_is_below_who_stands_on_it),
        cmocka_unit_test(balls_turn_to_the_east),
        cmocka_unit_test(maps_are_averaged),
        cmocka_unit_test(maps_have_no_seam_and_no_star),
        cmocka_unit_test(coverage_is_about_what_is_asked),
        cmocka_unit_test(faults_say_the_number),
        cmocka_unit_test(bad_descriptions_are_refused),
        cmocka_unit_test(bad_rays_are_refused),
        cmocka_unit_test(memory_that_runs_out_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
