/* Direct3D 9 fog: its states, what was recorded of it on Windows (d3d9_facts.h), and what no device was asked. */
#include "d3d9_facts.h"
#include "unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double not_a_number = (double)NAN;

enum { GREEN = 0x00ff00 };

/* ---- states ---------------------------------------------------------------------------------- */

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static void set(nebel_d3d9_fog *fog, uint32_t state, uint32_t value)
{
    uint32_t kept;
    assert_int_equal(nebel_set_d3d9_state(fog, state, value), NEBEL_OK);
    assert_int_equal(nebel_get_d3d9_state(fog, state, &kept), NEBEL_OK);
    assert_int_equal(kept, value);
}

static nebel_d3d9_fog make(uint32_t color, uint32_t table, uint32_t vertex, float start, float end, float density)
{
    nebel_d3d9_fog fog;
    nebel_reset_d3d9_fog(&fog);
    set(&fog, NEBEL_D3DRS_FOGENABLE, 1);
    set(&fog, NEBEL_D3DRS_FOGCOLOR, color);
    set(&fog, NEBEL_D3DRS_FOGTABLEMODE, table);
    set(&fog, NEBEL_D3DRS_FOGVERTEXMODE, vertex);
    set(&fog, NEBEL_D3DRS_FOGSTART, bits_of(start));
    set(&fog, NEBEL_D3DRS_FOGEND, bits_of(end));
    set(&fog, NEBEL_D3DRS_FOGDENSITY, bits_of(density));
    return fog;
}

static void test_a_new_device_has_the_documented_states(void **unused)
{
    (void)unused;
    static const uint32_t defaults[][2] = {{28, 0},          {34, 0},          {35, 0}, {36, 0},
                                           {37, 0x3f800000}, {38, 0x3f800000}, {48, 0}, {140, 0}};
    nebel_d3d9_fog fog;
    memset(&fog, 0x55, sizeof fog);
    nebel_reset_d3d9_fog(&fog);
    for (size_t i = 0; i < sizeof defaults / sizeof *defaults; i++) {
        uint32_t value = 77;
        assert_int_equal(nebel_get_d3d9_state(&fog, defaults[i][0], &value), NEBEL_OK);
        assert_int_equal(value, defaults[i][1]);
    }
}

static void test_states_that_are_none_change_nothing(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog;
    nebel_reset_d3d9_fog(&fog);
    const nebel_d3d9_fog before = fog;
    uint32_t value = 5;
    assert_int_equal(nebel_set_d3d9_state(&fog, 29, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_d3d9_state(&fog, NEBEL_D3DRS_FOGTABLEMODE, 4), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_set_d3d9_state(&fog, NEBEL_D3DRS_FOGVERTEXMODE, UINT32_MAX), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_set_d3d9_state(NULL, 28, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_state(&fog, 29, &value), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_state(&fog, 28, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_state(NULL, 28, &value), NEBEL_ERROR_ARGUMENT);
    assert_memory_equal(&fog, &before, sizeof fog);
    assert_int_equal(value, 5);
}

static void test_floats_arrive_as_bit_patterns(void **unused)
{
    (void)unused;
    const nebel_d3d9_fog fog = make(0, 0, 0, 12.5f, -3, .0625f);
    assert_true(fog.fog_start == 12.5f && fog.fog_end == -3 && fog.fog_density == .0625f);
}

/* ---- facts ----------------------------------------------------------------------------------- */

static void assert_color(const char *what, int found, int wanted, int most)
{
    for (int shift = 0; shift <= 16; shift += 8)
        if (abs((found >> shift & 255) - (wanted >> shift & 255)) > most)
            fail_msg("%s: %06x is not %06x within %d", what, (unsigned)found, (unsigned)wanted, most);
}

static double fixed(const nebel_d3d9_fog *fog, double x, double y, double z, double alpha)
{
    const nebel_d3d9_vertex vertex = {.position = {x, y, z}, .specular_alpha = alpha};
    return nebel_compute_d3d9_vertex_factor(fog, &vertex);
}

static double transformed(const nebel_d3d9_fog *fog, double alpha)
{
    const nebel_d3d9_vertex vertex = {NEBEL_D3D9_TRANSFORMED, .specular_alpha = alpha};
    return nebel_compute_d3d9_vertex_factor(fog, &vertex);
}

static double shaded(const nebel_d3d9_fog *fog, double fog_register)
{
    const nebel_d3d9_vertex vertex = {NEBEL_D3D9_SHADER, .fog_register = fog_register};
    return nebel_compute_d3d9_vertex_factor(fog, &vertex);
}

static void test_recorded_facts(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < d3d9_fact_count; i++) {
        const d3d9_fact *fact = &d3d9_facts[i];
        const double f = d3d9_factor_of(&fact->fog, &fact->quad, fact->probe);
        assert_color(fact->test, d3d9_color_of(&fact->fog, fact->object, f), fact->wanted, fact->most);
    }
}

static void test_recorded_ramps(void **unused)
{
    (void)unused;
    for (int i = 0; i < D3D9_RAMP_COUNT; i++) {
        const d3d9_ramp *ramp = &d3d9_ramps[i];
        for (uint32_t mode = ramp->first_mode; mode <= ramp->last_mode; mode++)
            for (int step = 0; step < D3D9_RAMP_STEPS; step++) {
                const nebel_d3d9_fog fog = d3d9_ramp_fog(ramp, mode);
                const d3d9_quad quad = d3d9_ramp_quad(ramp, step);
                assert_color("ramp", d3d9_color_of(&fog, D3D9_RAMP_OBJECT, d3d9_factor_of(&fog, &quad, 0)),
                             ramp->wanted[step], D3D9_RAMP_MOST);
            }
    }
}

static void test_recorded_vertices(void **unused)
{
    (void)unused;
    for (int i = 0; i < D3D9_VERTEX_FACT_COUNT; i++)
        for (uint32_t table = 0; table <= NEBEL_D3DFOG_LINEAR; table++) {
            nebel_d3d9_fog fog = make(GREEN, table, d3d9_vertex_facts[i].vertex_mode, 0, 1, 1);
            set(&fog, NEBEL_D3DRS_RANGEFOGENABLE, d3d9_vertex_facts[i].range);
            const int byte = (int)(255 * fixed(&fog, .5, 0, .375, .5) + .5);
            assert_in_range(byte, d3d9_vertex_facts[i].wanted - 1, d3d9_vertex_facts[i].wanted + 1);
        }
}

/* ---- what is left ---------------------------------------------------------------------------- */

static void test_table_fog_goes_by_w_in_perspective(void **unused)
{
    (void)unused;
    const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const float perspective[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.01f, 1, 0, 0, -.1f, 0};
    assert_false(nebel_d3d9_uses_w(identity));
    assert_true(nebel_d3d9_uses_w(perspective));
}

static void test_the_fog_register_is_clamped(void **unused)
{
    (void)unused;
    const nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_EXP, 0, 1, 1);
    assert_true(shaded(&fog, 1.5) == 1 && shaded(&fog, -.5) == 0 && shaded(&fog, .25) == .25);
}

static void test_fog_switched_off_is_none(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_LINEAR, 0, 1, 1);
    set(&fog, NEBEL_D3DRS_FOGENABLE, 0);
    assert_true(fixed(&fog, 0, 0, 1, 0) == 1 && transformed(&fog, 0) == 1 && shaded(&fog, 0) == 1);
    assert_true(nebel_compute_d3d9_pixel_factor(&fog, 0, 1) == 1);
    const nebel_d3d9_fog nothing = {0};
    assert_true(fixed(&nothing, 0, 0, 1, 0) == 1);
}

static void test_the_alpha_of_the_fog_color_is_ignored(void **unused)
{
    (void)unused;
    double with[3], without[3];
    const nebel_d3d9_fog a = make(0xff204060, 0, 0, 0, 1, 1), b = make(0x00204060, 0, 0, 0, 1, 1);
    nebel_get_d3d9_color(&a, with);
    nebel_get_d3d9_color(&b, without);
    assert_memory_equal(with, without, sizeof with);
    assert_true(with[0] == 0x20 / 255. && with[1] == 0x40 / 255. && with[2] == 0x60 / 255.);
}

static void test_any_bits_give_a_factor(void **unused)
{
    (void)unused;
    const float numbers[] = {NAN, HUGE_VALF, -HUGE_VALF, 0, -1, 3e38f, 1e-45f};
    const double places[] = {not_a_number, HUGE_VAL, -HUGE_VAL, 0, 1e300};
    for (uint32_t mode = 0; mode <= NEBEL_D3DFOG_LINEAR; mode++)
        for (int i = 0; i < 7 * 7 * 7; i++) {
            nebel_d3d9_fog fog = make(0, mode, mode, numbers[i % 7], numbers[i / 7 % 7], numbers[i / 49]);
            for (int k = 0; k < 5; k++) {
                const double vertex = fixed(&fog, places[k], 0, places[4 - k], places[k]);
                const double pixel = nebel_compute_d3d9_pixel_factor(&fog, places[k], places[k]);
                assert_true(vertex >= 0 && vertex <= 1 && pixel >= 0 && pixel <= 1);
            }
            assert_true(nebel_compute_d3d9_pixel_factor(&fog, 0.5, not_a_number) == (mode == 0 ? .5 : 1));
        }
    /* Density below 0 grows: f stays 1. */
    const nebel_d3d9_fog fog = make(0, NEBEL_D3DFOG_EXP, NEBEL_D3DFOG_EXP, 0, 1, -.1f);
    assert_true(fixed(&fog, 0, 0, 5, 0) == 1 && nebel_compute_d3d9_pixel_factor(&fog, 0, 5) == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_new_device_has_the_documented_states),
        cmocka_unit_test(test_states_that_are_none_change_nothing),
        cmocka_unit_test(test_floats_arrive_as_bit_patterns),
        cmocka_unit_test(test_recorded_facts),
        cmocka_unit_test(test_recorded_ramps),
        cmocka_unit_test(test_recorded_vertices),
        cmocka_unit_test(test_table_fog_goes_by_w_in_perspective),
        cmocka_unit_test(test_the_fog_register_is_clamped),
        cmocka_unit_test(test_fog_switched_off_is_none),
        cmocka_unit_test(test_the_alpha_of_the_fog_color_is_ignored),
        cmocka_unit_test(test_any_bits_give_a_factor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
