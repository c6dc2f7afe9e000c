/* Visibility: how far one sees until the transmittance has fallen to the one wanted. */
#include "random_fog.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "fog_help.h"

static double find(const nebel_snapshot *snapshot, double transmittance, int channel, const nebel_ray *ray)
{
    double distance = -1;
    assert_int_equal(nebel_find_transmittance(snapshot, transmittance, channel, 1, ray, sizeof *ray, &distance),
                     NEBEL_OK);
    return distance;
}

/* ---- against known distances ---- */

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
    assert_int_equal(nebel_find_transmittance(snapshot, .4, 1, COUNT, &rays[0].ray, sizeof rays[0], distances),
                     NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_true(find(snapshot, .4, 1, &rays[i].ray) == distances[i]);
    assert_true(distances[0] < 100 && distances[COUNT - 1] == HUGE_VAL);
    nebel_release_snapshot(snapshot);
}

/* ---- in any fog ---- */

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
        cmocka_unit_test(test_what_lies_behind_the_end_of_the_ray_is_not_found),
        cmocka_unit_test(test_clear_air_is_seen_through_for_ever),
        cmocka_unit_test(test_strides_and_many_rays_change_nothing),
        cmocka_unit_test(test_distances_grow_as_less_light_is_wanted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
