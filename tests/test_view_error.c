/* The bound of what places in floats do to fog: where the numbers of src/shader/digits.c come from, and what does not count. */
#include "unit.h"

#include "fog_help.h"

#include <nebel/shader.h>

#include <math.h>
#include <string.h>

static const double e = 2.718281828459045, rounding = 0x1p-23;

/* From the origin along -z, 100 pixels high. */
static nebel_view view_of(double size, int parallel)
{
    nebel_view view = {.width = 100, .height = 100};
    for (int i = 0; i < 4; i++) view.eye_from_world[5 * i] = 1;
    view.clip_from_eye[0] = view.clip_from_eye[5] = 2 / size;
    view.clip_from_eye[10] = parallel ? -1e-9 : -1;
    view.clip_from_eye[11] = parallel ? 0 : -1;
    view.clip_from_eye[14] = -1;
    view.clip_from_eye[15] = parallel;
    return view;
}

static nebel_view_error find(const nebel_volume_desc *volume, const nebel_view *view)
{
    nebel_view_error error = {.error = -1};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, volume, volume != NULL);
    assert_int_equal(nebel_find_view_error(snapshot, view, &error), NEBEL_OK);
    nebel_release_snapshot(snapshot);
    return error;
}

static nebel_volume_desc box(double thickness, double z)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX,
                                         .min = {-thickness * 1e4, -thickness * 1e4, z},
                                         .max = {thickness * 1e4, thickness * 1e4, z + thickness}},
                               .extinction = {1e3, 1e3, 1e3}};
}

static void expect_near(double is, double wanted)
{
    if (!(fabs(is - wanted) <= .01 * wanted)) fail_msg("%g is not %g", is, wanted);
}

static void test_narrow_fog(void **state)
{
    (void)state;
    const nebel_volume_desc sheet = box(2, -1e6);
    const nebel_view wide = view_of(1, 0);
    const nebel_view_error error = find(&sheet, &wide);
    expect_near(error.by_width, rounding * 1e6 / (2 * e));
    expect_near(error.width, 2);
    expect_near(error.distance, 1e6);
    assert_true(error.clear == 0);
}

static void test_narrow_pixels(void **state)
{
    (void)state;
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 0, -1e4}, .radius = 1},
                                    .extinction = {9, 9, 9}};
    const nebel_view far = view_of(1e-3, 0), parallel = view_of(.1, 1);
    expect_near(find(&ball, &far).by_pixel, rounding / (e * 1e-5));
    expect_near(find(&ball, &far).pixel, .1);
    expect_near(find(&ball, &parallel).by_pixel, rounding * 1e4 / (e * 1e-3));
    expect_near(find(&ball, &parallel).clear, 1e4 - 1);
}

static void test_profiles_and_thin_fog(void **state)
{
    (void)state;
    const nebel_view view = view_of(1, 0);
    nebel_volume_desc volume = {.extinction = {1, 1, 1},
                                .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -5e4, .scale_height = 10}};
    expect_near(find(&volume, &view).by_width, rounding * 5e3 / e);
    volume.density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .center = {0, 0, -5e4}, .sigma = 10};
    expect_near(find(&volume, &view).by_width, rounding * 5e3 / e);
    volume = box(2, -1e6);
    for (int c = 0; c < 3; c++) volume.extinction[c] = 1e-8;
    assert_true(find(&volume, &view).error < rounding * 1e6 / (2 * e) * .01);
}

/* 2^-22 of the distance at which it begins, times the extinction. */
static void test_surfaces_in_fog(void **state)
{
    (void)state;
    const nebel_view view = view_of(1, 0);
    const double wanted = 2 * rounding * 1e3 * 5e4;
    nebel_volume_desc volume = box(2, -5e4 - 2);
    expect_near(find(&volume, &view).by_surface, wanted);
    volume.shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .point = {9, 8, -5e4}, .normal = {0, 0, 3}};
    expect_near(find(&volume, &view).by_surface, wanted);
    volume.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    assert_true(find(&volume, &view).by_surface == 0); /* the eye is in it */
    volume.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .base = -5e4, .scale_height = 10};
    volume.density.below = NEBEL_BELOW_CONSTANT;
    expect_near(find(&volume, &view).by_surface, wanted);
    volume = box(2, 5e4); /* behind the eye */
    assert_true(find(&volume, &view).by_surface == 0);
}

/* Whatever has no end gives numbers. */
static void test_endless_fog(void **state)
{
    (void)state;
    const nebel_view views[2] = {view_of(1, 0), view_of(1, 1)};
    const nebel_shape parts[2] = {{.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, -5, 0}, .normal = {0, 1, 0}},
                                  {.type = NEBEL_SHAPE_CAPSULE, .from = {0, 0, -40}, .to = {1, 0, -50}, .radius = 3}};
    nebel_volume_desc volumes[3] = {{.shape = {.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 2}},
                                    {.shape = parts[0]},
                                    {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 10}}};
    for (int i = 0; i < 6; i++) {
        nebel_volume_desc *const volume = &volumes[i / 2];
        for (int c = 0; c < 3; c++) volume->extinction[c] = .1;
        const nebel_view_error error = find(volume, &views[i % 2]);
        assert_true(error.error >= 0 && error.error < 1e-3 && isfinite(error.distance));
    }
}

static void test_what_does_not_count(void **state)
{
    (void)state;
    const nebel_view view = view_of(1, 0), parallel = view_of(1, 1);
    nebel_volume_desc volume = {.extinction = {1, 1, 1}};
    assert_true(find(&volume, &view).error == 0); /* even and everywhere */
    assert_true(find(&volume, &parallel).clear == 0);
    assert_true(find(NULL, &parallel).clear == HUGE_VAL && find(NULL, &view).error == 0);
    volume = box(2, 1e6);
    assert_true(find(&volume, &view).error == 0); /* behind the eye */
    volume = box(2, -1e6);
    volume.shape.min[0] += 2e6, volume.shape.max[0] += 2e6;
    assert_true(find(&volume, &view).error == 0); /* beside the picture */
    volume = box(1e-6, -1e6);
    assert_true(find(&volume, &view).error == 0); /* less than a pixel */
    volume = box(2, -1e6);
    volume.start = 5;
    assert_true(find(&volume, &parallel).clear == 0);
}

static void test_errors(void **state)
{
    (void)state;
    const nebel_view view = view_of(1, 0);
    nebel_view_error error;
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, NULL, 0);
    assert_int_equal(nebel_find_view_error(NULL, &view, &error), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_find_view_error(snapshot, NULL, &error), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_find_view_error(snapshot, &view, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_find_view_error(snapshot, &(nebel_view){.width = 1, .height = 1}, &error),
                     NEBEL_ERROR_ARGUMENT);
    nebel_release_snapshot(snapshot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_narrow_fog),
                                       cmocka_unit_test(test_narrow_pixels),
                                       cmocka_unit_test(test_profiles_and_thin_fog),
                                       cmocka_unit_test(test_surfaces_in_fog),
                                       cmocka_unit_test(test_endless_fog),
                                       cmocka_unit_test(test_what_does_not_count),
                                       cmocka_unit_test(test_errors)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
