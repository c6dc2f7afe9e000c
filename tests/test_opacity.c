/* The most that all fog together hides. */
#include "random_fog.h"

#include <math.h>
#include <stdio.h>

#include "fog_help.h"

enum { RAYS = 40 };

static random_fog fog;

static nebel_lighting *commit(double max_opacity)
{
    const nebel_lighting_desc lights = random_fog_lights(&fog);
    return fog_commit_lit(&(nebel_fog_desc){.max_opacity = max_opacity}, fog.volumes, fog.count, &lights);
}

static void trace(const nebel_lighting *lighting, nebel_precision precision, nebel_transfer transfers[RAYS])
{
    nebel_ray rays[RAYS];
    for (uint64_t i = 0; i < RAYS; i++) rays[i] = random_fog_ray(&fog, i);
    const nebel_trace_desc desc = {.precision = precision, .tolerance = 1e-4};
    fog_trace(lighting, desc, RAYS, rays, transfers);
}

/* As nebel.h says it. */
static void limit(double most, nebel_transfer *transfer)
{
    for (int c = 0; c < 3; c++) {
        const double opacity = 1 - transfer->transmittance[c];
        if (!(opacity > most)) continue;
        transfer->transmittance[c] = 1 - most;
        transfer->in_scattering[c] *= most / opacity;
    }
}

static void test_light_is_limited_as_a_last_step(void **unused)
{
    (void)unused;
    static const double rounding[] = {1e-15, 1e-6};
    size_t limited_rays = 0;
    for (uint64_t seed = 0; seed < 200; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), seed);
        const double most = .02 + .98 * (double)(seed % 17) / 17;
        nebel_lighting *const plain = commit(0), *const limited = commit(most);
        for (int p = 0; p < 2; p++) {
            nebel_transfer transfers[2][RAYS];
            trace(plain, (nebel_precision)p, transfers[0]);
            trace(limited, (nebel_precision)p, transfers[1]);
            for (int i = 0; i < RAYS; i++) {
                nebel_transfer *const is = &transfers[0][i];
                limited_rays += 1 - is->transmittance[1] > most;
                limit(most, is);
                for (int c = 0; c < 3; c++) {
                    const double T = transfers[1][i].transmittance[c], S = transfers[1][i].in_scattering[c];
                    assert_true(fabs(T - is->transmittance[c]) <= rounding[p]);
                    assert_true(fabs(S - is->in_scattering[c]) <= rounding[p] * (1 + S / most));
                }
            }
        }
        nebel_release_lighting(plain);
        nebel_release_lighting(limited);
    }
    assert_true(limited_rays > 500);
}

/* Among them the straight way of a single box. */
static void test_planes_give_the_same_bits(void **unused)
{
    (void)unused;
    const float offset[3] = {0, 0, 0}, direction[3] = {1, .25f, -.5f};
    for (uint64_t seed = 0; seed < 60; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % 3), seed);
        nebel_lighting *const limited = commit(.01 + .015 * (double)seed);
        const nebel_ray ray = {{0, 0, 0}, {1, .25, -.5}, 60};
        const nebel_ray_planes rays = {.offset = {&offset[0], &offset[1], &offset[2]},
                                       .direction_float = {&direction[0], &direction[1], &direction[2]},
                                       .t_max = &(float){60}};
        float T[3], S[3];
        const nebel_transfer_planes transfers = {.transmittance = {&T[0], &T[1], &T[2]},
                                                 .in_scattering = {&S[0], &S[1], &S[2]}};
        nebel_transfer transfer;
        const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT};
        fog_trace(limited, desc, 1, &ray, &transfer);
        const nebel_trace_desc lit = {.lighting = limited};
        const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(limited);
        assert_int_equal(nebel_trace_planes(snapshot, &lit, 1, &rays, &transfers), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            assert_true((double)T[c] == transfer.transmittance[c]);
            assert_true((double)S[c] == transfer.in_scattering[c]);
        }
        nebel_release_lighting(limited);
    }
}

static const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {1, -5, -5}, .max = {5, 5, 5}},
                                      .extinction = {1, 1, 1},
                                      .source = {1, 1, 1}};

static void test_streams_of_segments_and_pixels_are_limited(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = .75}, &box, 1);
    const float to[2][3] = {{8, 0, 0}, {1.5f, 0, 0}}, depth[2] = {8, 1.5f};
    float through[2];
    const nebel_segments segments = {.to = to[0]};
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 2, &segments, through, 0),
                     NEBEL_OK);
    assert_true(fabs((double)through[0] - .25) < 1e-6);
    assert_true(fabs((double)through[1] - exp(-.5)) < 1e-6);
    const uint8_t black[8] = {0, 0, 0, 255, 0, 0, 0, 255};
    uint8_t out[8];
    const nebel_pixels pixels = {
        .corner = {1, 0, 0}, .width = 2, .height = 1, .depth = depth, .color = black, .output = out};
    assert_int_equal(nebel_apply_fog_to_pixels(snapshot, NEBEL_ISA_DEFAULT, &pixels), NEBEL_OK);
    assert_true(abs(out[0] - 191) <= 1);
    assert_true(abs(out[4] - 100) <= 1);
    nebel_release_snapshot(snapshot);
}

static double find(const nebel_snapshot *snapshot, double transmittance)
{
    const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, HUGE_VAL};
    double distance = -1;
    assert_int_equal(nebel_invert_transmittance(snapshot, transmittance, 2, 1, &ray, sizeof ray, &distance), NEBEL_OK);
    return distance;
}

static void test_one_sees_for_ever_through_fog_that_may_not_hide_enough(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = .75}, &box, 1);
    assert_true(fabs(find(snapshot, .5) - (1 + log(2))) < 1e-12);
    assert_true(fabs(find(snapshot, .25) - (1 + log(4))) < 1e-12);
    assert_true(find(snapshot, .249) == HUGE_VAL);
    nebel_release_snapshot(snapshot);
}

static void test_the_limit_can_be_changed(void **unused)
{
    (void)unused;
    nebel_fog *made = NULL;
    fog_messages messages = {0};
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &made), NEBEL_OK);
    assert_int_equal(nebel_add_volume(made, &box, NULL), NEBEL_OK);
    const double limits[] = {.5, .75, 1, 0};
    for (int i = 0; i < 4; i++) {
        nebel_snapshot *snapshot = NULL;
        nebel_transfer transfer;
        const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, 10};
        assert_int_equal(nebel_set_max_opacity(made, limits[i]), NEBEL_OK);
        assert_int_equal(nebel_commit_fog(made, &snapshot), NEBEL_OK);
        assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        const double opacity = i < 2 ? limits[i] : 1 - exp(-4);
        assert_true(fabs(transfer.transmittance[0] - (1 - opacity)) < 1e-14);
        assert_true(fabs(transfer.in_scattering[0] - opacity) < 1e-14);
        assert_true(nebel_get_max_opacity(snapshot) == (i < 2 ? limits[i] : 1));
        assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){.ignore_max_opacity = 1}, 1, &ray, 0, &transfer, 0),
                         NEBEL_OK);
        assert_true(fabs(transfer.transmittance[0] - exp(-4)) < 1e-14);
        assert_true(fabs(transfer.in_scattering[0] - (1 - exp(-4))) < 1e-14);
        nebel_release_snapshot(snapshot);
    }
    const double wrong[] = {-.1, 1.1, (double)NAN};
    for (int i = 0; i < 3; i++) {
        nebel_fog *none = NULL;
        assert_int_equal(nebel_set_max_opacity(made, wrong[i]), NEBEL_ERROR_VALUE);
        assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.max_opacity = wrong[i]}, &none), NEBEL_ERROR_VALUE);
        assert_non_null(strstr(messages.text, "max_opacity"));
    }
    assert_int_equal(nebel_set_max_opacity(NULL, .5), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_fog(made);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light_is_limited_as_a_last_step),
        cmocka_unit_test(test_planes_give_the_same_bits),
        cmocka_unit_test(test_streams_of_segments_and_pixels_are_limited),
        cmocka_unit_test(test_one_sees_for_ever_through_fog_that_may_not_hide_enough),
        cmocka_unit_test(test_the_limit_can_be_changed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
