/* Fog over a finished picture: the kernel against nebel_trace, and every instruction set against every other. */
#include <nebel/nebel.h>

#include <math.h>
#include <string.h>

#include "unit.h"

enum { WIDTH = 67, HEIGHT = 41, PIXELS = WIDTH * HEIGHT };

static uint64_t state_of_dice = 977;

static double dice(double low, double high)
{
    state_of_dice = state_of_dice * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state_of_dice >> 11) * 0x1p-53;
}

static float depth[PIXELS];
static uint8_t color[4 * PIXELS], out[4 * PIXELS], other[4 * PIXELS];

static nebel_pixels make_picture(nebel_pixel_depth depth_type)
{
    for (int i = 0; i < PIXELS; i++) depth[i] = i % 19 == 0 ? HUGE_VALF : (float)dice(0, 60);
    for (int i = 0; i < 4 * PIXELS; i++) color[i] = (uint8_t)dice(0, 256);
    return (nebel_pixels){.eye = {1000, 20, -3},
                          .corner = {-.8f, .5f, -1},
                          .step_x = {.025f, .001f, 0},
                          .step_y = {0, -.025f, .0003f},
                          .depth_type = depth_type,
                          .width = WIDTH,
                          .height = HEIGHT,
                          .depth = depth,
                          .color = color,
                          .output = out};
}

/* `tinted`: what the kernel does not take. */
static nebel_snapshot *make_fog(int boxes, int tinted)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (int i = 0; i < boxes; i++) {
        nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_BOX}, .source = {.9, .2, .55}};
        const double center[3] = {1000 + dice(-15, 15), 20 + dice(-8, 8), -3 - dice(0, 40)};
        for (int c = 0; c < 3; c++) {
            const double half = dice(2, 9);
            volume.shape.min[c] = center[c] - half;
            volume.shape.max[c] = center[c] + half;
            volume.extinction[c] = tinted ? .05 + .03 * c : .08;
        }
        assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

static double expected_byte(const nebel_transfer *transfer, int c, int pixel)
{
    return transfer->transmittance[c] * color[4 * pixel + c] + 255 * fmin(transfer->in_scattering[c], 1);
}

/* Half a step; 255 times the rounding of the weight, 2^-16, and of transmittance in float, 3e-6; and of the radiance,
 * 2^-9. */
static const double largest_error = .5 + 255 * (0x1p-16 + 3e-6) + 0x1p-9;

static void assert_fogged(const nebel_snapshot *fog, const nebel_pixels *p)
{
    for (int i = 0; i < PIXELS; i++) {
        nebel_ray ray = {.origin = {p->eye[0], p->eye[1], p->eye[2]}};
        double square = 0;
        for (int c = 0; c < 3; c++) {
            ray.direction[c] =
                (double)p->corner[c] + i % WIDTH * (double)p->step_x[c] + i / WIDTH * (double)p->step_y[c];
            square += ray.direction[c] * ray.direction[c];
        }
        ray.t_max = (double)depth[i] * (p->depth_type == NEBEL_PIXEL_DEPTH_RADIAL ? 1 : sqrt(square));
        nebel_transfer transfer;
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        for (int c = 0; c < 3; c++) assert_true(fabs(out[4 * i + c] - expected_byte(&transfer, c, i)) < largest_error);
        assert_int_equal(out[4 * i + 3], color[4 * i + 3]);
    }
}

static void test_every_pixel_is_the_nearest_byte(void **state)
{
    (void)state;
    for (int round = 0; round < 24; round++) {
        const nebel_pixels p = make_picture(round % 2 ? NEBEL_PIXEL_DEPTH_RADIAL : NEBEL_PIXEL_DEPTH_AXIAL);
        nebel_snapshot *fog = make_fog(round % 5, round % 3 == 2);
        assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
        assert_fogged(fog, &p);
        nebel_release_snapshot(fog);
    }
}

/* Straight ahead, along faces and in them: components of ways are 0, and 0 times the distance of the sky is a NaN. */
static void test_the_sky_is_right_where_ways_are_level(void **state)
{
    (void)state;
    static const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {1000, 15, -20}, .max = {1010, 20, -5}}, .extinction = {.1, .1, .1}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {990, 10, -60}, .max = {1005, 30, -30}},
         .extinction = {.1, .1, .1}}};
    for (int boxes = 1; boxes <= 2; boxes++) {
        nebel_pixels p = make_picture(boxes == 1 ? NEBEL_PIXEL_DEPTH_AXIAL : NEBEL_PIXEL_DEPTH_RADIAL);
        memcpy(p.corner, (const float[3]){-1, .5f, -1}, sizeof p.corner);
        memcpy(p.step_x, (const float[3]){.03125f, 0, 0}, sizeof p.step_x);
        memcpy(p.step_y, (const float[3]){0, -.03125f, 0}, sizeof p.step_y);
        for (int i = 0; i < PIXELS; i++) depth[i] = HUGE_VALF;
        nebel_fog *fog = NULL;
        nebel_snapshot *snapshot = NULL;
        assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
        for (int i = 0; i < boxes; i++) assert_int_equal(nebel_add_volume(fog, &volumes[i], NULL), NEBEL_OK);
        assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
        for (nebel_isa isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available(isa)) continue;
            assert_int_equal(nebel_apply_fog_to_pixels(snapshot, isa, &p), NEBEL_OK);
            assert_fogged(snapshot, &p);
        }
        nebel_release_snapshot(snapshot);
        nebel_destroy_fog(fog);
    }
}

static void test_instruction_sets_and_splits_give_the_same_bytes(void **state)
{
    (void)state;
    for (int round = 0; round < 12; round++) {
        nebel_pixels p = make_picture(round % 2 ? NEBEL_PIXEL_DEPTH_RADIAL : NEBEL_PIXEL_DEPTH_AXIAL);
        nebel_snapshot *fog = make_fog(1 + round % 4, 0);
        assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_SCALAR, &p), NEBEL_OK);
        p.output = other;
        for (nebel_isa isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available(isa)) continue;
            memset(other, 0, sizeof other);
            for (p.first_row = 0; p.first_row < HEIGHT; p.first_row += p.row_count) {
                p.row_count = p.first_row + 7 <= HEIGHT ? 7 : HEIGHT - p.first_row;
                assert_int_equal(nebel_apply_fog_to_pixels(fog, isa, &p), NEBEL_OK);
            }
            assert_memory_equal(other, out, sizeof out);
        }
        nebel_release_snapshot(fog);
    }
}

static void test_a_picture_may_be_fogged_in_place_between_other_rows(void **state)
{
    (void)state;
    enum { PITCH = 4 * (WIDTH + 5) };
    static uint8_t wide[PITCH * HEIGHT];
    nebel_pixels p = make_picture(NEBEL_PIXEL_DEPTH_AXIAL);
    nebel_snapshot *fog = make_fog(3, 0);
    assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
    memset(wide, 0x5a, sizeof wide);
    for (size_t y = 0; y < HEIGHT; y++) memcpy(wide + y * PITCH, color + y * 4 * WIDTH, 4 * WIDTH);
    p.color = p.output = wide;
    p.color_pitch = p.output_pitch = PITCH;
    assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
    for (size_t y = 0; y < HEIGHT; y++) {
        assert_memory_equal(wide + y * PITCH, out + y * 4 * WIDTH, 4 * WIDTH);
        for (size_t i = 4 * WIDTH; i < PITCH; i++) assert_int_equal(wide[y * PITCH + i], 0x5a);
    }
    nebel_release_snapshot(fog);
}

static void test_depths_that_are_none_leave_the_picture_alone(void **state)
{
    (void)state;
    for (int tinted = 0; tinted < 2; tinted++) {
        const nebel_pixels p = make_picture(NEBEL_PIXEL_DEPTH_AXIAL);
        nebel_snapshot *fog = make_fog(4, tinted);
        for (int i = 0; i < PIXELS; i++) depth[i] = i % 3 == 0 ? nanf("") : i % 3 == 1 ? -5.f : 0.f;
        assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
        assert_memory_equal(out, color, sizeof out);
        nebel_release_snapshot(fog);
    }
}

static void test_opaque_fog_shows_its_own_colour(void **state)
{
    (void)state;
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    const nebel_pixels p = make_picture(NEBEL_PIXEL_DEPTH_RADIAL);
    for (int i = 0; i < PIXELS; i++) depth[i] = 50;
    const nebel_volume_desc volume = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {900, -80, -99}, .max = {1100, 120, 99}},
        .extinction = {1e4, 1e4, 1e4},
        .source = {0, 1, 3}};
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    assert_int_equal(nebel_apply_fog_to_pixels(snapshot, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
    for (int i = 0; i < PIXELS; i++) {
        const uint8_t wanted[4] = {0, 255, 255, color[4 * i + 3]};
        assert_memory_equal(out + 4 * i, wanted, 4);
    }
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
}

static void test_wrong_arguments_are_refused(void **state)
{
    (void)state;
    nebel_snapshot *fog = make_fog(1, 0);
    const nebel_pixels good = make_picture(NEBEL_PIXEL_DEPTH_AXIAL);
    nebel_pixels bad[] = {good, good, good, good, good, good, good, good};
    bad[0].depth = NULL;
    bad[1].output = NULL;
    bad[2].width = 0;
    bad[3].height = 70000;
    bad[4].color_pitch = 4 * WIDTH - 1;
    bad[5].row_count = HEIGHT + 1;
    bad[6].eye[1] = HUGE_VAL;
    bad[7].step_y[2] = HUGE_VALF;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &bad[i]), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_apply_fog_to_pixels(NULL, NEBEL_ISA_DEFAULT, &good), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_COUNT, &good), NEBEL_ERROR_UNSUPPORTED);
    nebel_release_snapshot(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_pixel_is_the_nearest_byte),
        cmocka_unit_test(test_the_sky_is_right_where_ways_are_level),
        cmocka_unit_test(test_instruction_sets_and_splits_give_the_same_bytes),
        cmocka_unit_test(test_a_picture_may_be_fogged_in_place_between_other_rows),
        cmocka_unit_test(test_depths_that_are_none_leave_the_picture_alone),
        cmocka_unit_test(test_opaque_fog_shows_its_own_colour),
        cmocka_unit_test(test_wrong_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
