/* Fog factors as a state, response curves, the eye in an object's coordinates; and what the printed texts of the time
 * have wrong: each such test computes the printed form, too, and shows that it differs. */
#include <nebel/classic.h>

#include <math.h>
#include <string.h>

#include "near.h"

static const double not_a_number = (double)NAN;

static nebel_factor_desc resolved(nebel_factor_desc desc)
{
    nebel_factor_desc out;
    assert_int_equal(nebel_resolve_factor(&desc, &out), NEBEL_OK);
    return out;
}

static double factor(nebel_factor_desc desc, double c)
{
    const nebel_factor_desc d = resolved(desc);
    return nebel_compute_fog_factor(&d, c);
}

/* ---- factors --------------------------------------------------------------------------------- */

static void test_nothing_said_is_the_fog_of_a_new_context(void **unused)
{
    (void)unused;
    const nebel_factor_desc d = resolved((nebel_factor_desc){0});
    assert_int_equal(d.mode, NEBEL_FACTOR_EXP);
    assert_int_equal(d.coordinate, NEBEL_COORDINATE_PLANE);
    assert_true(d.start == 0 && d.end == 1 && d.density == 1);
    assert_true(d.color[0] == 0 && d.color[1] == 0 && d.color[2] == 0);
    const nebel_factor_desc again = resolved(d);
    assert_memory_equal(&again, &d, sizeof d);
    const nebel_factor_desc given = {NEBEL_FACTOR_LINEAR, NEBEL_COORDINATE_USER, NEBEL_STAGE_PIXEL, 5, 0, .25,
                                     {1, .5, 2}};
    const nebel_factor_desc kept = resolved(given);
    assert_memory_equal(&kept, &given, sizeof given);
}

static void test_descriptions_that_are_none_are_refused(void **unused)
{
    (void)unused;
    nebel_factor_desc out = {.density = 7};
    const nebel_factor_desc unknown[] = {{.mode = NEBEL_FACTOR_COUNT},
                                         {.mode = (nebel_factor_mode)-1},
                                         {.coordinate = NEBEL_COORDINATE_COUNT},
                                         {.stage = NEBEL_STAGE_COUNT}};
    const nebel_factor_desc numbers[] = {{.start = not_a_number},
                                         {.end = HUGE_VAL},
                                         {.density = -.1},
                                         {.density = not_a_number},
                                         {.color[2] = HUGE_VAL}};
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        assert_int_equal(nebel_resolve_factor(&unknown[i], &out), NEBEL_ERROR_ARGUMENT);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        assert_int_equal(nebel_resolve_factor(&numbers[i], &out), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_resolve_factor(NULL, &out), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_resolve_factor(&out, NULL), NEBEL_ERROR_ARGUMENT);
    assert_true(out.density == 7);
}

/* The table of oracles: OpenGL's formulas at these depths, as Mesa and wined3d drew them, to six digits. */
static void test_factors_are_those_that_drivers_drew(void **unused)
{
    (void)unused;
    static const double table[][4] = {
        {.5, 1, .904837, .994391},   {1, 1, .818731, .977751},       {2, 1, .670320, .913931},
        {3, .875, .548812, .816686}, {4, .75, .449329, .697676},     {5, .625, .367879, .569783},
        {6, .5, .301194, .444858},   {7.5, .3125, .223130, .282063}, {8, .25, .201897, .236928},
        {9, .125, .165299, .161621}, {10, 0, .135335, .105399},      {12, 0, .090718, .039164},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const double *const row = table[i];
        assert_near(factor((nebel_factor_desc){.mode = NEBEL_FACTOR_LINEAR, .start = 2, .end = 10}, row[0]), row[1],
                    1e-6);
        assert_near(factor((nebel_factor_desc){.mode = NEBEL_FACTOR_EXP, .density = .2}, row[0]), row[2], 1e-6);
        assert_near(factor((nebel_factor_desc){.mode = NEBEL_FACTOR_EXP2, .density = .15}, row[0]), row[3], 1e-6);
    }
}

static void test_coordinates(void **unused)
{
    (void)unused;
    const double place[3] = {2, -3, -6};
    nebel_factor_desc d = resolved((nebel_factor_desc){0});
    assert_true(nebel_compute_fog_coordinate(&d, place, 5) == 6);
    d.coordinate = NEBEL_COORDINATE_RADIAL;
    assert_near(nebel_compute_fog_coordinate(&d, place, 5), 7, 1e-15);
    assert_true(nebel_compute_fog_coordinate(&d, (const double[3]){1e200, 0, 0}, 5) == 1e200);
    assert_true(isnan(nebel_compute_fog_coordinate(&d, (const double[3]){HUGE_VAL, not_a_number, 0}, 5)));
    d.coordinate = NEBEL_COORDINATE_USER;
    assert_true(nebel_compute_fog_coordinate(&d, place, -5) == -5);
    /* a coordinate below 0 is legal, and the factor is clamped last */
    assert_true(factor((nebel_factor_desc){.mode = NEBEL_FACTOR_EXP}, -5) == 1);
    assert_near(factor((nebel_factor_desc){.mode = NEBEL_FACTOR_LINEAR, .start = -1, .end = 1}, -.5), .75, 1e-15);
}

static void test_start_at_the_end(void **unused)
{
    (void)unused;
    nebel_factor_desc d = {.mode = NEBEL_FACTOR_LINEAR, .start = 5, .end = 5};
    for (double c = 4; c <= 6; c++) assert_true(factor(d, c) == 0);
    d.stage = NEBEL_STAGE_PIXEL;
    assert_true(factor(d, 4.999) == 1 && factor(d, 5) == 0 && factor(d, 6) == 0);
    d = (nebel_factor_desc){.mode = NEBEL_FACTOR_LINEAR, .start = .8, .end = .2};
    assert_true(factor(d, .1) == 0 && factor(d, .9) == 1);
    assert_near(factor(d, .4), 1 / 3., 1e-15);
}

static void test_no_number_is_no_fog(void **unused)
{
    (void)unused;
    for (int mode = 0; mode < NEBEL_FACTOR_COUNT; mode++)
        for (int stage = 0; stage < NEBEL_STAGE_COUNT; stage++)
            for (int equal = 0; equal < 2; equal++) {
                const nebel_factor_desc d = {.mode = (nebel_factor_mode)mode,
                                             .stage = (nebel_factor_stage)stage,
                                             .start = 2,
                                             .end = equal ? 2 : 3};
                assert_true(factor(d, not_a_number) == 1);
                assert_true(factor(d, HUGE_VAL) == 0);
            }
    float out[4];
    nebel_blend_fog_factor(not_a_number, (const float[4]){.25f, .5f, 1, 0}, (const double[3]){1, 1, 1}, out);
    assert_memory_equal(out, ((const float[4]){.25f, .5f, 1, 0}), sizeof out);
}

static void test_blending_leaves_alpha(void **unused)
{
    (void)unused;
    float pixel[4] = {1, .5f, 0, .3f};
    nebel_blend_fog_factor(.25, pixel, (const double[3]){0, .5, 2}, pixel);
    assert_true(pixel[0] == .25f && pixel[1] == .5f && pixel[2] == 1.5f && pixel[3] == .3f);
    nebel_blend_fog_factor(1, pixel, (const double[3]){9, 9, 9}, pixel);
    assert_true(pixel[0] == .25f && pixel[1] == .5f && pixel[2] == 1.5f && pixel[3] == .3f);
}

/* Printed: exp((-density z)^2), which grows with distance, so that the clamp leaves no fog at all. */
static void test_exp2_has_its_minus_outside_the_square(void **unused)
{
    (void)unused;
    const double density = .15;
    for (double z = 1; z < 12; z += .5) {
        const double printed = fmin(exp(-density * z * -density * z), 1);
        const double right = factor((nebel_factor_desc){.mode = NEBEL_FACTOR_EXP2, .density = density}, z);
        assert_true(printed == 1);
        assert_near(right, exp(-(density * z) * (density * z)), 1e-15);
        assert_true(right < .98);
    }
}

/* ---- curves ---------------------------------------------------------------------------------- */

static nebel_curve resolved_curve(nebel_curve curve)
{
    nebel_curve out;
    assert_int_equal(nebel_resolve_curve(&curve, &out), NEBEL_OK);
    return out;
}

static double amount(nebel_curve curve, double s)
{
    const nebel_curve c = resolved_curve(curve);
    return nebel_compute_curve_amount(&c, s);
}

static double weight(nebel_curve curve, double s)
{
    const nebel_curve c = resolved_curve(curve);
    return nebel_compute_curve_weight(&c, s);
}

static void test_curves_are_their_formulas(void **unused)
{
    (void)unused;
    for (double s = 0; s < 60; s += .7) {
        assert_near(amount((nebel_curve){.type = NEBEL_CURVE_PHYSICAL, .scale = .1}, s), 1 - exp(-.1 * s), 1e-15);
        assert_near(amount((nebel_curve){.type = NEBEL_CURVE_LINEAR}, s), .05 * s, 1e-15);
        assert_near(amount((nebel_curve){.type = NEBEL_CURVE_EXP}, s), exp(.03 * s) - 1, 1e-14);
        const double x = .04 * s;
        assert_near(amount((nebel_curve){.type = NEBEL_CURVE_EXP2}, s), exp(x * x) - 1, 1e-12);
    }
}

static void test_curves_pass_1_and_their_weights_do_not(void **unused)
{
    (void)unused;
    for (int type = NEBEL_CURVE_LINEAR; type <= NEBEL_CURVE_EXP2; type++) {
        const nebel_curve curve = {.type = (nebel_curve_type)type};
        assert_true(amount(curve, 40) > 1 && weight(curve, 40) == 1);
        assert_true(amount(curve, 10) == weight(curve, 10) && weight(curve, 10) > 0 && weight(curve, 10) < 1);
        assert_true(weight(curve, HUGE_VAL) == 1);
    }
}

static void test_lengths_that_are_none_have_no_fog(void **unused)
{
    (void)unused;
    float table[NEBEL_CURVE_ENTRIES];
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) table[i] = (float)i / 255;
    for (int type = 0; type < NEBEL_CURVE_COUNT; type++) {
        const nebel_curve curve = {.type = (nebel_curve_type)type, .table = table};
        assert_true(weight(curve, not_a_number) == 0 && weight(curve, -3) == 0 && weight(curve, 0) == 0);
        assert_true(amount(curve, not_a_number) == 0);
    }
    table[0] = NAN;
    assert_true(weight((nebel_curve){.type = NEBEL_CURVE_TABLE, .table = table}, 0) == 0);
}

static void test_curves_that_are_none_are_refused(void **unused)
{
    (void)unused;
    nebel_curve out;
    const nebel_curve unknown[] = {{.type = NEBEL_CURVE_COUNT}, {.type = NEBEL_CURVE_TABLE}};
    const nebel_curve numbers[] = {{.scale = -1}, {.scale = not_a_number}, {.scale = HUGE_VAL}};
    for (size_t i = 0; i < 2; i++) assert_int_equal(nebel_resolve_curve(&unknown[i], &out), NEBEL_ERROR_ARGUMENT);
    for (size_t i = 0; i < 3; i++) assert_int_equal(nebel_resolve_curve(&numbers[i], &out), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_resolve_curve(NULL, &out), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_resolve_curve(&numbers[0], NULL), NEBEL_ERROR_ARGUMENT);
}

static void fill_squares(float table[NEBEL_CURVE_ENTRIES])
{
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) table[i] = (float)(i * i) / (255 * 255);
}

static void test_the_table_is_linear_between_its_entries(void **unused)
{
    (void)unused;
    float table[NEBEL_CURVE_ENTRIES];
    fill_squares(table);
    const nebel_curve curve = {.type = NEBEL_CURVE_TABLE, .scale = 1, .table = table};
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) assert_near(weight(curve, i / 255.), (double)table[i], 1e-15);
    for (int i = 0; i < 255; i++) {
        const double between = .25 * (double)table[i] + .75 * (double)table[i + 1];
        assert_near(weight(curve, (i + .75) / 255), between, 1e-14);
    }
}

/* Printed: the index 255 a is clamped to 254, its fraction goes lost, and entry 255 is never seen. */
static double look_up_as_printed(const float *table, double a)
{
    const double place = fmin(255 * a, 254);
    const int i = (int)place;
    return (double)table[i] + (place - i) * (double)(table[i + 1] - table[i]);
}

static void test_an_amount_of_1_is_the_last_entry_of_the_table(void **unused)
{
    (void)unused;
    float table[NEBEL_CURVE_ENTRIES] = {0};
    table[255] = 1;
    const nebel_curve curve = {.type = NEBEL_CURVE_TABLE, .scale = 1, .table = table};
    assert_true(look_up_as_printed(table, 1) == 0);
    assert_true(weight(curve, 1) == 1 && weight(curve, 7) == 1);
    assert_near(weight(curve, 254.5 / 255), .5, 1e-12);
    assert_true(look_up_as_printed(table, 254.5 / 255) == 0);
}

/* ---- the eye --------------------------------------------------------------------------------- */

static void apply(const double m[16], const double p[3], double out[3])
{
    for (int r = 0; r < 3; r++) out[r] = m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
}

static void test_the_eye_of_an_object_is_where_its_matrix_gives_zero(void **unused)
{
    (void)unused;
    const double matrices[][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -3, 4, 5, 1},
        {.6, 0, .8, 0, 0, 1, 0, 0, -.8, 0, .6, 0, 7, -2, 1, 1},
        {2, 0, 0, 0, .5, -3, 0, 0, 1, 1, .25, 0, 1e6, -2, 1, 1},
    };
    for (size_t i = 0; i < 3; i++) {
        double eye[3], zero[3];
        assert_int_equal(nebel_compute_object_eye(matrices[i], eye), NEBEL_OK);
        apply(matrices[i], eye, zero);
        for (int c = 0; c < 3; c++) assert_near(zero[c], 0, i == 2 ? 1e-8 : 1e-14);
    }
}

static void test_matrices_without_an_eye_are_refused(void **unused)
{
    (void)unused;
    const double matrices[][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 2, 3, 1},  /* flat */
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0}, /* a projection */
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, (double)NAN, 0, 0, 1},
    };
    double eye[3] = {1, 2, 3};
    for (size_t i = 0; i < 3; i++) assert_int_equal(nebel_compute_object_eye(matrices[i], eye), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_object_eye(NULL, eye), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_object_eye(matrices[0], NULL), NEBEL_ERROR_ARGUMENT);
    assert_true(eye[0] == 1 && eye[1] == 2 && eye[2] == 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_said_is_the_fog_of_a_new_context),
        cmocka_unit_test(test_descriptions_that_are_none_are_refused),
        cmocka_unit_test(test_factors_are_those_that_drivers_drew),
        cmocka_unit_test(test_coordinates),
        cmocka_unit_test(test_start_at_the_end),
        cmocka_unit_test(test_no_number_is_no_fog),
        cmocka_unit_test(test_blending_leaves_alpha),
        cmocka_unit_test(test_exp2_has_its_minus_outside_the_square),
        cmocka_unit_test(test_curves_are_their_formulas),
        cmocka_unit_test(test_curves_pass_1_and_their_weights_do_not),
        cmocka_unit_test(test_lengths_that_are_none_have_no_fog),
        cmocka_unit_test(test_curves_that_are_none_are_refused),
        cmocka_unit_test(test_the_table_is_linear_between_its_entries),
        cmocka_unit_test(test_an_amount_of_1_is_the_last_entry_of_the_table),
        cmocka_unit_test(test_the_eye_of_an_object_is_where_its_matrix_gives_zero),
        cmocka_unit_test(test_matrices_without_an_eye_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
