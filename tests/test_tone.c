#include <nebel/render.h>

#include "unit.h"

#include <math.h>
#include <string.h>

/* An 8-bit step is 1 / 255; the curve is to be a thousand times finer. */
static const double fine = 1 / 255e3;

static double map_grey(double linear, double exposure)
{
    const float pixel[3] = {(float)linear, (float)linear, (float)linear};
    float mapped[3];
    nebel_tone_map(1, pixel, exposure, mapped);
    assert_memory_equal(&mapped[0], &mapped[1], sizeof(float));
    assert_memory_equal(&mapped[0], &mapped[2], sizeof(float));
    return (double)mapped[0];
}

static double encode_srgb(double x)
{
    return x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
}

/* The curve from its three wishes: 0.18 stays, contrast 1.15 there, slope 0.6 in black. */
static double curve(double x)
{
    const double grey = .18, contrast = 1.15, slope = .6;
    const double a = (grey * grey + (contrast - 1) * grey) / (1 / slope - contrast);
    const double c = a / slope, b = (grey + a - grey * grey - c) / grey;
    return x * (x + a) / (x * x + b * x + c);
}

static void test_curve_and_transfer_are_exact(void **state)
{
    (void)state;
    for (double stops = -20; stops < 16; stops += 1 / 512.0) {
        const double x = (double)(float)exp2(stops);
        assert_true(fabs(map_grey(x, 0) - encode_srgb(curve(x))) < fine);
    }
}

static void test_fixed_points(void **state)
{
    (void)state;
    assert_true(map_grey(0, 0) == 0);
    assert_true(fabs(map_grey(.18, 0) - encode_srgb(.18)) < fine);
    assert_true(map_grey(65504, 0) > 1 - 1e-5);
    assert_true(map_grey(1e30, 0) <= 1 && map_grey(1e30, 0) > 1 - 1e-5);
    assert_true(map_grey(HUGE_VAL, 0) <= 1 && map_grey(HUGE_VAL, 0) > 1 - 1e-5);
}

static void test_curve_has_toe_and_shoulder(void **state)
{
    (void)state;
    assert_true(curve(.01) < .01 && curve(.05) < .05);
    assert_true(curve(1) > .6 && curve(1) < .8 && curve(4) < 1);
    assert_true(curve(.19) - curve(.17) > .02);
}

static void test_brighter_is_never_darker(void **state)
{
    (void)state;
    double before = 0;
    for (double stops = -20; stops < 16; stops += 1e-4) {
        const double now = map_grey(exp2(stops), 0);
        assert_true(now > before - 4e-7); /* a few units of the last place of a float near 1 */
        before = fmax(before, now);
    }
}

static void test_exposure_doubles_the_light(void **state)
{
    (void)state;
    for (double x = .001; x < 100; x *= 1.7) {
        assert_true(fabs(map_grey(x, 2) - map_grey(4 * x, 0)) < 1e-6);
        assert_true(fabs(map_grey(x, -3) - map_grey(x / 8, 0)) < 1e-6);
    }
}

static void test_what_is_no_light_is_black(void **state)
{
    (void)state;
    assert_true(map_grey((double)NAN, 0) == 0);
    assert_true(map_grey(-1, 0) == 0);
    assert_true(map_grey(-HUGE_VAL, 0) == 0);
    assert_true(map_grey(.5, (double)NAN) == 0);
}

static void test_in_place_and_any_count(void **state)
{
    (void)state;
    float linear[3 * 37], apart[3 * 37];
    for (int i = 0; i < 3 * 37; i++) linear[i] = .013f * (float)i;
    for (size_t n = 0; n <= 37; n++) {
        float in_place[3 * 37];
        memcpy(in_place, linear, sizeof linear);
        memcpy(apart, linear, sizeof linear);
        nebel_tone_map(n, linear, .5, apart);
        nebel_tone_map(n, in_place, .5, in_place);
        assert_memory_equal(apart, in_place, sizeof apart);
        for (size_t i = 3 * n; i < 3 * 37; i++) assert_true(apart[i] >= linear[i] && apart[i] <= linear[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_curve_and_transfer_are_exact), cmocka_unit_test(test_fixed_points),
        cmocka_unit_test(test_curve_has_toe_and_shoulder),   cmocka_unit_test(test_brighter_is_never_darker),
        cmocka_unit_test(test_exposure_doubles_the_light),   cmocka_unit_test(test_what_is_no_light_is_black),
        cmocka_unit_test(test_in_place_and_any_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
