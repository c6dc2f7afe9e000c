/* Visibility: the distance found is where nebel_trace says that the transmittance is the one wanted. */
#include "random_fog.h"

#include <math.h>

#include "fog_help.h"

static double find(const nebel_snapshot *snapshot, double transmittance, int channel, const nebel_ray *ray)
{
    double distance = -1;
    assert_int_equal(nebel_invert_transmittance(snapshot, transmittance, channel, 1, ray, sizeof *ray, &distance),
                     NEBEL_OK);
    return distance;
}

static nebel_transfer trace_to(const nebel_snapshot *snapshot, const nebel_ray *ray, double end)
{
    nebel_ray shorter = *ray;
    nebel_transfer transfer;
    shorter.t_max = end;
    const nebel_trace_desc desc = {.transmittance_only = 1};
    assert_int_equal(nebel_trace(snapshot, &desc, 1, &shorter, sizeof shorter, &transfer, sizeof transfer), NEBEL_OK);
    return transfer;
}

/* ---- against known distances ----------------------------------------------------------------- */

/* Fog of scale height 50 m, 0.02 / m at the ground: check T05 of truth/physics.json. There z is up. */
static void test_free_flight_in_height_fog_is_that_of_the_reference(void **unused)
{
    (void)unused;
    static const struct {
        double height, elevation, xi, distance;
    } cases[] = {{1.7, 5, .3, 18.75373635064526}, {120, -20, .9, 331.8772704732469}, {1.7, 0, .5, 35.85597016021574}};
    const nebel_volume_desc fog = {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 50},
                                   .extinction = {.02, .02, .02}};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &fog, 1);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double angle = cases[i].elevation * (acos(-1) / 180);
        const nebel_ray ray = {{3, cases[i].height, -2}, {cos(angle), sin(angle), 0}, HUGE_VAL};
        for (int channel = 0; channel < 3; channel++) {
            const double found = find(snapshot, 1 - cases[i].xi, channel, &ray);
            assert_true(fabs(found / cases[i].distance - 1) < 1e-12);
        }
    }
    nebel_release_snapshot(snapshot);
}

static void test_even_fog_is_seen_through_by_its_logarithm(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {10, -1, -1}, .max = {60, 1, 1}},
                                   .extinction = {.1, .02, 1e-9}};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &fog, 1);
    const nebel_ray ray = {{0, 0, 0}, {7, 0, 0}, HUGE_VAL};
    const double wanted[] = {.999999, .9, .5, .05, .02, .0068};
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        const double expected = 10 - log(wanted[i]) / .1;
        assert_true(fabs(find(snapshot, wanted[i], 0, &ray) / expected - 1) < 1e-12);
    }
    assert_true(fabs(find(snapshot, .5, 1, &ray) - (10 + log(2) / .02)) < 1e-10);
    assert_true(find(snapshot, .36, 1, &ray) == HUGE_VAL); /* e^-1 = .3679 is left behind the box */
    assert_true(find(snapshot, .9999, 2, &ray) == HUGE_VAL);
    nebel_release_snapshot(snapshot);
}

/* From high above, where the fog is vanishing, into where it grows without bound: the search starts far off the mark.
 */
static void test_fog_is_found_from_high_above_it(void **unused)
{
    (void)unused;
    for (double scale = .5; scale < 100; scale *= 2)
        for (double height = 0; height < 600 * scale; height = 3 * height + scale)
            for (double slope = 1; slope > 1e-6; slope *= .1) {
                const nebel_volume_desc fog = {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = scale},
                                               .extinction = {.1, .1, .1}};
                nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &fog, 1);
                const double down = slope / sqrt(1 + slope * slope);
                const nebel_ray ray = {{0, height, 0}, {1, -slope, 0}, HUGE_VAL};
                /* .1 scale / down (e^((down t - height) / scale) - e^(-height / scale)) = ln 2 */
                const double rise = log(2) * 10 * down / scale;
                const double lowest = height / scale + log(rise + exp(-height / scale));
                const double expected = height / scale < 30 ? log1p(rise * exp(height / scale)) : lowest;
                assert_true(fabs(find(snapshot, .5, 0, &ray) * down / scale / expected - 1) < 1e-12);
                nebel_release_snapshot(snapshot);
            }
}

static void test_what_lies_behind_the_end_of_the_ray_is_not_found(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &(nebel_volume_desc){.extinction = {1, 1, 1}}, 1);
    const double there = log(2);
    const double ends[] = {0, .1, there * (1 - 1e-9), there * (1 + 1e-9), 1, HUGE_VAL};
    for (int i = 0; i < 6; i++) {
        const nebel_ray ray = {{0, 0, 0}, {0, 0, -1}, ends[i]};
        const double found = find(snapshot, .5, 0, &ray);
        if (i < 3)
            assert_true(found == HUGE_VAL);
        else
            assert_true(fabs(found - there) < 1e-14);
    }
    nebel_release_snapshot(snapshot);
}

static void test_clear_air_is_seen_through_for_ever(void **unused)
{
    (void)unused;
    const nebel_volume_desc volumes[] = {{.extinction = {0, 0, 0}, .emission = {1, 1, 1}},
                                         {.operation = NEBEL_OPERATION_EXCLUDE},
                                         {.extinction = {5, 5, 5}}};
    const nebel_ray ray = {{0, 0, 0}, {0, 0, -1}, HUGE_VAL};
    for (size_t n = 0; n <= 3; n++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, n);
        assert_true(find(snapshot, .999999999, 0, &ray) == HUGE_VAL);
        nebel_release_snapshot(snapshot);
    }
}

static void test_strides_and_many_rays_change_nothing(void **unused)
{
    (void)unused;
    enum { COUNT = 50 };
    struct {
        double before;
        nebel_ray ray;
        char after[24];
    } rays[COUNT];
    double distances[COUNT];
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 4}, .extinction = {.3, .4, .5}};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &ball, 1);
    for (int i = 0; i < COUNT; i++) rays[i].ray = (nebel_ray){{-6, .1 * i, 0}, {1, 0, .01 * i}, 100};
    assert_int_equal(nebel_invert_transmittance(snapshot, .4, 1, COUNT, &rays[0].ray, sizeof rays[0], distances),
                     NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_true(find(snapshot, .4, 1, &rays[i].ray) == distances[i]);
    assert_true(distances[0] < 100 && distances[COUNT - 1] == HUGE_VAL);
    nebel_release_snapshot(snapshot);
}

/* ---- against nebel_trace --------------------------------------------------------------------- */

typedef struct tally {
    size_t found, beyond, wrong, infinite_rays;
} tally;

static void report(const random_fog *fog, const nebel_ray *ray, double wanted, double distance, double before,
                   double behind)
{
    print_message("wanted %.17g, around %.17g there is %.17g to %.17g\n", wanted, distance, before, behind);
    random_fog_print(stdout, fog, ray);
}

/* The promise is the distance to 1e-12 relative: a bit before it there is more light than wanted, a bit behind it less,
 * or nothing is found and there is more all along the ray. What the trace says it may be wrong by is allowed. */
static void check(const random_fog *fog, const nebel_snapshot *snapshot, const nebel_ray *ray, double wanted,
                  int channel, tally *sum)
{
    const double distance = find(snapshot, wanted, channel, ray);
    const int found = distance < HUGE_VAL;
    const nebel_transfer before = trace_to(snapshot, ray, found ? distance * (1 - 1e-12) : ray->t_max);
    const nebel_transfer behind = trace_to(snapshot, ray, found ? distance * (1 + 1e-12) : ray->t_max);
    int good = before.transmittance[channel] >= wanted * (1 - 1e-15) - before.error;
    if (found) good = good && distance >= 0 && distance <= ray->t_max;
    if (found) good = good && behind.transmittance[channel] <= wanted * (1 + 1e-15) + behind.error;
    if (!good) report(fog, ray, wanted, distance, before.transmittance[channel], behind.transmittance[channel]);
    sum->wrong += !good;
    sum->found += found ? 1 : 0;
    sum->beyond += found ? 0 : 1;
    sum->infinite_rays += ray->t_max == HUGE_VAL ? 1 : 0;
}

static void test_distances_found_are_where_the_trace_agrees(void **unused)
{
    (void)unused;
    enum { FOGS = 400, RAYS = 40 };
    static random_fog fog;
    static const double wanted[] = {.5, .05, .999, .9, 1e-6, 1e-40, .02};
    tally sum = {0};
    for (uint64_t seed = 0; seed < FOGS; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 7000 + seed);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        for (uint64_t r = 0; r < RAYS; r++) {
            const nebel_ray ray = random_fog_ray(&fog, r);
            check(&fog, snapshot, &ray, wanted[(seed + r) % 7], (int)(r % 3), &sum);
        }
        nebel_release_snapshot(snapshot);
    }
    print_message("%zu found, %zu not reached, %zu endless rays\n", sum.found, sum.beyond, sum.infinite_rays);
    assert_int_equal(sum.wrong, 0);
    assert_true(sum.found > FOGS * RAYS / 5 && sum.beyond > FOGS * RAYS / 5 && sum.infinite_rays > FOGS * RAYS / 20);
}

/* Thinner and thinner fog is seen through further and further. */
static void test_distances_grow_as_less_light_is_wanted(void **unused)
{
    (void)unused;
    static random_fog fog;
    for (uint64_t seed = 0; seed < 100; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 9000 + seed);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        for (uint64_t r = 0; r < 10; r++) {
            const nebel_ray ray = random_fog_ray(&fog, r);
            double last = 0;
            for (double wanted = .99; wanted > 1e-9; wanted *= .7) {
                const double distance = find(snapshot, wanted, (int)(r % 3), &ray);
                assert_true(distance >= last);
                last = distance;
            }
        }
        nebel_release_snapshot(snapshot);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_flight_in_height_fog_is_that_of_the_reference),
        cmocka_unit_test(test_even_fog_is_seen_through_by_its_logarithm),
        cmocka_unit_test(test_fog_is_found_from_high_above_it),
        cmocka_unit_test(test_what_lies_behind_the_end_of_the_ray_is_not_found),
        cmocka_unit_test(test_clear_air_is_seen_through_for_ever),
        cmocka_unit_test(test_strides_and_many_rays_change_nothing),
        cmocka_unit_test(test_distances_found_are_where_the_trace_agrees),
        cmocka_unit_test(test_distances_grow_as_less_light_is_wanted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
