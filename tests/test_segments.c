/* Segments in, transmittances out: boxes by the short way, everything else through the march, in any layout of memory.
 */
#include "random_fog.h"

#include <math.h>

#include "fog_help.h"

enum { COUNT = 150 }; /* more than a batch, no multiple of any number of lanes */

typedef struct points {
    float at[COUNT][3];
} points;

static float near_float(uint64_t *state, double size)
{
    return dice_below(state, 6) == 0 ? (float)floor(dice(state, -size, size)) : (float)dice(state, -size, size);
}

static points random_points(uint64_t *state, double size)
{
    points p;
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 3; k++) p.at[i][k] = near_float(state, size);
    return p;
}

static nebel_transfer trace_segment(const nebel_snapshot *snapshot, const double origin[3], const float from[3],
                                    const float to[3])
{
    nebel_ray ray = {.t_max = 0};
    nebel_transfer transfer;
    double square = 0;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = origin[k] + (double)from[k];
        ray.direction[k] = (double)to[k] - (double)from[k];
        square += ray.direction[k] * ray.direction[k];
    }
    if (square == 0) ray.direction[0] = 1;
    ray.t_max = sqrt(square);
    const nebel_trace_desc desc = {.transmittance_only = 1};
    assert_int_equal(nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
    return transfer;
}

static void transmit(const nebel_snapshot *snapshot, nebel_isa isa, int channel, const nebel_segments *segments,
                     float out[COUNT])
{
    for (int i = 0; i < COUNT; i++) out[i] = -7;
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, isa, channel, COUNT, segments, out, 0), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) assert_true(out[i] >= 0 && out[i] <= 1);
}

/* ---- right, for all fog ---------------------------------------------------------------------- */

static void test_segments_through_any_fog_are_what_the_trace_says(void **unused)
{
    (void)unused;
    static random_fog fog;
    uint64_t state = 11;
    for (uint64_t seed = 0; seed < 150; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 500 + seed);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        const points from = random_points(&state, 15), to = random_points(&state, 15);
        nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
        memcpy(segments.origin, fog.shift, sizeof segments.origin);
        float out[COUNT];
        const int channel = (int)(seed % 3);
        transmit(snapshot, NEBEL_ISA_DEFAULT, channel, &segments, out);
        for (int i = 0; i < COUNT; i++) {
            const nebel_transfer transfer = trace_segment(snapshot, segments.origin, from.at[i], to.at[i]);
            const double apart = fabs(transfer.transmittance[channel] - (double)out[i]);
            if (apart > transfer.error + 3e-5) random_fog_print(stdout, &fog, &(nebel_ray){0});
            assert_true(apart <= transfer.error + 3e-5);
        }
        nebel_release_snapshot(snapshot);
    }
}

static nebel_volume_desc random_box(uint64_t *state, const double shift[3])
{
    nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX}};
    for (int k = 0; k < 3; k++) {
        box.shape.min[k] = shift[k] + floor(dice(state, -12, 8));
        box.shape.max[k] = box.shape.min[k] + floor(dice(state, 1, 9));
        box.extinction[k] = dice(state, 0, .2);
    }
    return box;
}

static void test_boxes_are_right_near_and_far_from_the_worlds_origin(void **unused)
{
    (void)unused;
    uint64_t state = 5;
    for (int trial = 0; trial < 100; trial++) {
        const double far = trial % 2 == 0 ? 0 : 1e7, shift[3] = {far, -far, far / 2};
        nebel_volume_desc boxes[64];
        const size_t n = (size_t)(trial % 5 == 0 ? 64 : 1 + dice_below(&state, 5));
        for (size_t i = 0; i < n; i++) boxes[i] = random_box(&state, shift);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, boxes, n);
        const points from = random_points(&state, 15), to = random_points(&state, 15);
        nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0], .to_stride = 12};
        memcpy(segments.origin, shift, sizeof shift);
        float out[COUNT];
        transmit(snapshot, NEBEL_ISA_DEFAULT, 1, &segments, out);
        for (int i = 0; i < COUNT; i++) {
            const nebel_transfer transfer = trace_segment(snapshot, shift, from.at[i], to.at[i]);
            assert_true(fabs(transfer.transmittance[1] - (double)out[i]) <= 2e-5);
        }
        nebel_release_snapshot(snapshot);
    }
}

/* One box more than the short way takes changes the way, not the answer. */
static void test_both_ways_agree(void **unused)
{
    (void)unused;
    uint64_t state = 6;
    const double here[3] = {0, 0, 0};
    const nebel_volume_desc box = random_box(&state, here);
    const nebel_volume_desc halves[] = {
        box, {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1e6, 0, 0}, .radius = 1}, .extinction = {1, 1, 1}}};
    nebel_snapshot *const by_boxes = fog_commit(&(nebel_fog_desc){0}, &box, 1);
    nebel_snapshot *const by_march = fog_commit(&(nebel_fog_desc){0}, halves, 2);
    const points from = random_points(&state, 15), to = random_points(&state, 15);
    const nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
    float a[COUNT], b[COUNT];
    transmit(by_boxes, NEBEL_ISA_DEFAULT, 0, &segments, a);
    transmit(by_march, NEBEL_ISA_DEFAULT, 0, &segments, b);
    for (int i = 0; i < COUNT; i++) assert_true(fabsf(a[i] - b[i]) < 1e-5f);
    nebel_release_snapshot(by_boxes);
    nebel_release_snapshot(by_march);
}

/* ---- any layout, any instruction set: the same bits ------------------------------------------ */

static void test_strides_and_instruction_sets_change_no_bit(void **unused)
{
    (void)unused;
    static random_fog fog;
    uint64_t state = 7;
    for (uint64_t seed = 0; seed < 40; seed++) {
        random_fog_make(&fog, seed % 2 ? RANDOM_FOG_PROFILES : RANDOM_FOG_OVERLAP, seed);
        const nebel_volume_desc box = random_box(&state, (const double[3]){0, 0, 0});
        nebel_snapshot *const snapshot = seed % 4 == 0 ? fog_commit(&(nebel_fog_desc){0}, &box, 1)
                                                       : fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        const points from = random_points(&state, 15), to = random_points(&state, 15);
        float wide_from[COUNT][5], wide_to[COUNT][7], expected[COUNT], out[COUNT], wide_out[COUNT][3];
        for (int i = 0; i < COUNT; i++) {
            memcpy(wide_from[i], from.at[i], sizeof from.at[i]);
            memcpy(wide_to[i], to.at[i], sizeof to.at[i]);
        }
        const nebel_segments packed = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
        const nebel_segments spread = {.from = wide_from[0], .from_stride = 20, .to = wide_to[0], .to_stride = 28};
        transmit(snapshot, NEBEL_ISA_SCALAR, 2, &packed, expected);
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            transmit(snapshot, (nebel_isa)isa, 2, &packed, out);
            assert_memory_equal(out, expected, sizeof out);
            memset(wide_out, 0x55, sizeof wide_out);
            assert_int_equal(
                nebel_compute_segment_transmittance(snapshot, (nebel_isa)isa, 2, COUNT, &spread, wide_out[0], 12),
                NEBEL_OK);
            for (int i = 0; i < COUNT; i++) {
                assert_memory_equal(&wide_out[i][0], &expected[i], sizeof expected[i]);
                for (int k = 1; k < 3; k++) assert_true(((unsigned char *)&wide_out[i][k])[0] == 0x55);
            }
        }
        nebel_release_snapshot(snapshot);
    }
}

static void test_segments_may_start_at_one_place(void **unused)
{
    (void)unused;
    uint64_t state = 8;
    const nebel_volume_desc kinds[] = {
        random_box(&state, (const double[3]){0, 0, 0}),
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 9}, .extinction = {.1, .1, .1}}};
    for (int kind = 0; kind < 2; kind++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &kinds[kind], 1);
        const points to = random_points(&state, 15);
        points from;
        for (int i = 0; i < COUNT; i++) memset(from.at[i], 0, sizeof from.at[i]);
        const nebel_segments each = {.origin = {-11, 3, 2.5}, .from = from.at[0], .to = to.at[0]};
        const nebel_segments once = {.origin = {-11, 3, 2.5}, .to = to.at[0]};
        float a[COUNT], b[COUNT];
        transmit(snapshot, NEBEL_ISA_DEFAULT, 0, &each, a);
        transmit(snapshot, NEBEL_ISA_DEFAULT, 0, &once, b);
        assert_memory_equal(a, b, sizeof a);
        nebel_release_snapshot(snapshot);
    }
}

/* ---- segments that are none ------------------------------------------------------------------ */

static void test_segments_with_a_nan_or_of_no_length_give_1(void **unused)
{
    (void)unused;
    uint64_t state = 9;
    const double here[3] = {0, 0, 0};
    const nebel_volume_desc kinds[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-50, -50, -50}, .max = {50, 50, 50}}, .extinction = {1, 1, 1}},
        {.extinction = {1, 1, 1}},
        random_box(&state, here)};
    for (int kind = 0; kind < 3; kind++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &kinds[kind], 1);
        points from = random_points(&state, 15), to = random_points(&state, 15);
        for (int i = 0; i < COUNT; i++) {
            if (i % 3 == 0) (i % 2 ? from.at[i] : to.at[i])[i / 3 % 3] = NAN;
            if (i % 3 == 1) memcpy(from.at[i], to.at[i], sizeof to.at[i]);
        }
        const nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            float out[COUNT];
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            transmit(snapshot, (nebel_isa)isa, 0, &segments, out);
            for (int i = 0; i < COUNT; i++)
                if (i % 3 < 2) assert_true(out[i] == 1);
        }
        nebel_release_snapshot(snapshot);
    }
}

static void test_nothing_is_written_beyond_the_last_segment(void **unused)
{
    (void)unused;
    nebel_snapshot *const snapshot = fog_commit(
        &(nebel_fog_desc){0},
        &(nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .max = {9, 9, 9}}, .extinction = {1, 1, 1}}, 1);
    uint64_t state = 10;
    const points from = random_points(&state, 15), to = random_points(&state, 15);
    const nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
    for (size_t n = 0; n < COUNT; n++) {
        float out[COUNT + 1];
        for (int i = 0; i <= COUNT; i++) out[i] = -7;
        assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, n, &segments, out, 0),
                         NEBEL_OK);
        for (size_t i = 0; i <= COUNT; i++) assert_true((out[i] == -7) == (i >= n));
    }
    nebel_release_snapshot(snapshot);
}

/* ---- very long ones -------------------------------------------------------------------------- */

static void test_long_segments_cross_all_fog(void **unused)
{
    (void)unused;
    const nebel_volume_desc kinds[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1}, .extinction = {.5, .5, .5}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 1, 1}}, .extinction = {.5, .5, .5}}};
    for (int kind = 0; kind < 2; kind++) {
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &kinds[kind], 1);
        const float to[4][3] = {{8, 0, 0}, {1e6f, 0, 0}, {1e16f, 0, 0}, {1e18f, 0, 0}};
        const nebel_segments segments = {.origin = {-4, 0, 0}, .to = to[0]};
        float out[4];
        assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 4, &segments, out, 0),
                         NEBEL_OK);
        for (int i = 0; i < 4; i++) assert_true(fabs((double)out[i] - exp(-1)) < 1e-6);
        nebel_release_snapshot(snapshot);
    }
}

static void test_segments_beyond_the_limits_are_refused_by_number(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    const nebel_fog_desc fog = {.host.log = fog_messages_log(&messages)};
    nebel_snapshot *const snapshot = fog_commit(&fog, &(nebel_volume_desc){.extinction = {1, 1, 1}}, 1);
    uint64_t state = 12;
    points from = random_points(&state, 15);
    const points to = random_points(&state, 15);
    nebel_segments segments = {.from = from.at[0], .from_stride = 12, .to = to.at[0]};
    float out[COUNT];
    from.at[101][1] = 1e20f;
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, COUNT, &segments, out, 0),
                     NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(messages.text, "segment 101"));
    const double origins[] = {(double)NAN, HUGE_VAL, -1.1e15};
    for (int i = 0; i < 3; i++) {
        segments.origin[i] = origins[i];
        assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 1, &segments, out, 0),
                         NEBEL_ERROR_ARGUMENT);
        assert_non_null(strstr(messages.text, "origin"));
        segments.origin[i] = 0;
    }
    segments.to_stride = 3;
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 1, &segments, out, 0),
                     NEBEL_ERROR_ARGUMENT);
    assert_int_equal(messages.count, 5);
    nebel_release_snapshot(snapshot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_segments_through_any_fog_are_what_the_trace_says),
        cmocka_unit_test(test_boxes_are_right_near_and_far_from_the_worlds_origin),
        cmocka_unit_test(test_both_ways_agree),
        cmocka_unit_test(test_strides_and_instruction_sets_change_no_bit),
        cmocka_unit_test(test_segments_may_start_at_one_place),
        cmocka_unit_test(test_segments_with_a_nan_or_of_no_length_give_1),
        cmocka_unit_test(test_nothing_is_written_beyond_the_last_segment),
        cmocka_unit_test(test_long_segments_cross_all_fog),
        cmocka_unit_test(test_segments_beyond_the_limits_are_refused_by_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
