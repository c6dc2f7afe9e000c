/* Volumes that act between two distances from where a ray starts. */
#include "random_fog.h"

#include <math.h>
#include <stdio.h>

#include "fog_help.h"

#include "depth_help.h"

static nebel_volume_desc between(nebel_operation operation, int priority, double extinction, double start,
                                 double cutoff)
{
    nebel_volume_desc v = slab(operation, priority, 1, 9, extinction);
    v.start = start;
    v.cutoff = cutoff;
    return v;
}

#define ADD(...) between(NEBEL_OPERATION_ADD, 0, __VA_ARGS__)

static void test_a_volume_acts_between_its_distances_alone(void **unused)
{
    (void)unused;
    const struct {
        double start, cutoff, length;
    } cases[] = {{0, 0, 8}, {.5, 0, 8}, {4, 0, 5},   {0, 4, 3}, {0, .5, 0},
                 {3, 5, 2}, {0, 20, 8}, {9.5, 0, 0}, {2, 20, 7}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const nebel_volume_desc fog[] = {ADD(.1, cases[i].start, cases[i].cutoff), ADD(.05, 0, 0)};
        assert_depth(fog, 1, .1 * cases[i].length);
        assert_depth(fog, 2, .1 * cases[i].length + .05 * 8);
    }
}

static void test_so_do_exclusions_and_fog_that_replaces(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog[] = {ADD(.1, 0, 0), between(NEBEL_OPERATION_EXCLUDE, 0, 0, 2, 4),
                                     between(NEBEL_OPERATION_REPLACE, 1, .5, 6, 7)};
    assert_depth(fog, 2, .1 * 6);
    assert_depth(fog, 3, .1 * 5 + .5);
}

static void test_rays_that_do_not_begin_at_the_eye_ignore_distances(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog[] = {ADD(.1, 3, 5), between(NEBEL_OPERATION_EXCLUDE, 0, 0, 20, 0)};
    for (size_t n = 1; n <= 2; n++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, fog, n);
        assert_depth_of(snapshot, 0, .1 * 2);
        assert_depth_of(snapshot, 1, n == 1 ? .1 * 8 : 0);
        nebel_release_snapshot(snapshot);
    }
}

/* A height profile's integral begins where the volume does. */
static void test_profiles_are_cut_where_the_distances_are(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog = {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 2},
                                   .extinction = {.3, .3, .3},
                                   .start = 2,
                                   .cutoff = 7};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &fog, 1);
    const nebel_ray up = {{5, 1, 0}, {3, 4, 0}, HUGE_VAL};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &up, sizeof up, &transfer, sizeof transfer),
                     NEBEL_OK);
    const double depth = .3 * 2 / .8 * (exp(-(1 + .8 * 2) / 2) - exp(-(1 + .8 * 7) / 2));
    assert_true(fabs(transfer.transmittance[0] - exp(-depth)) < 1e-14);
    nebel_release_snapshot(snapshot);
}

static void test_endless_light_may_be_cut_off(void **unused)
{
    (void)unused;
    nebel_volume_desc glow = {.emission = {1, 2, 3}, .cutoff = 50};
    const nebel_ray ray = {{0, 0, 0}, {0, 0, -1}, HUGE_VAL};
    nebel_transfer transfer;
    for (int endless = 0; endless < 2; endless++) {
        if (endless) glow.cutoff = 0;
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &glow, 1);
        const nebel_result result =
            nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer);
        assert_int_equal(result, endless ? NEBEL_ERROR_UNBOUNDED : NEBEL_OK);
        if (!endless) assert_true(fabs(transfer.in_scattering[2] - 150) < 1e-9);
        nebel_release_snapshot(snapshot);
    }
}

/* The same as a ray that is cut there itself. */
static void test_random_fog_is_that_of_the_ray_between(void **unused)
{
    (void)unused;
    static random_fog fog;
    for (uint64_t seed = 0; seed < 300; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 9000 + 2 * seed);
        const nebel_lighting_desc lights = random_fog_lights(&fog);
        nebel_lighting *const plain = fog_light(&lights, fog.volumes, fog.count);
        for (size_t i = 0; i < fog.count; i++) fog.volumes[i].cutoff = 12;
        nebel_lighting *const cut = fog_light(&lights, fog.volumes, fog.count);
        for (uint64_t r = 0; r < 20; r++) {
            nebel_transfer transfer[2];
            nebel_ray ray = random_fog_ray(&fog, r);
            const nebel_trace_desc how = {.precision = (nebel_precision)(r % 2), .tolerance = 1e-5};
            fog_trace(cut, how, 1, &ray, &transfer[0]);
            ray.t_max = fmin(ray.t_max, 12);
            fog_trace(plain, how, 1, &ray, &transfer[1]);
            for (int c = 0; c < 3; c++) {
                assert_true(transfer[0].transmittance[c] == transfer[1].transmittance[c]);
                assert_true(transfer[0].in_scattering[c] == transfer[1].in_scattering[c]);
            }
        }
        nebel_release_lighting(plain);
        nebel_release_lighting(cut);
    }
}

static void test_wrong_distances_are_refused(void **unused)
{
    (void)unused;
    const double wrong[][2] = {{-1, 0},          {0, -1},          {3, 3},    {3, 2},
                               {(double)NAN, 0}, {0, (double)NAN}, {1e16, 0}, {0, 1e16}};
    fog_messages messages = {0};
    nebel_fog *fog = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &fog), NEBEL_OK);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const nebel_volume_desc desc = ADD(1, wrong[i][0], wrong[i][1]);
        assert_int_equal(nebel_add_volume(fog, &desc, NULL), NEBEL_ERROR_VALUE);
        assert_non_null(strstr(messages.text, wrong[i][1] == 0 ? "start" : "cutoff"));
    }
    nebel_destroy_fog(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_volume_acts_between_its_distances_alone),
        cmocka_unit_test(test_so_do_exclusions_and_fog_that_replaces),
        cmocka_unit_test(test_rays_that_do_not_begin_at_the_eye_ignore_distances),
        cmocka_unit_test(test_profiles_are_cut_where_the_distances_are),
        cmocka_unit_test(test_endless_light_may_be_cut_off),
        cmocka_unit_test(test_random_fog_is_that_of_the_ray_between),
        cmocka_unit_test(test_wrong_distances_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
