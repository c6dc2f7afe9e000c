/* What Direct3D 9 does with fog. The colours were recorded on Windows by the fog tests of Wine 8.5 (dlls/d3d9), the
 * tolerances with them: facts, evaluated here by hand from the same inputs. */
#include <nebel/classic.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double not_a_number = (double)NAN;

enum { RED = 0xff0000, GREEN = 0x00ff00, BLUE = 0x0000ff, YELLOW = 0xffff00 };

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
    assert_int_equal(nebel_set_d3d9_fog(fog, state, value), NEBEL_OK);
    assert_int_equal(nebel_get_d3d9_fog(fog, state, &kept), NEBEL_OK);
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
        assert_int_equal(nebel_get_d3d9_fog(&fog, defaults[i][0], &value), NEBEL_OK);
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
    assert_int_equal(nebel_set_d3d9_fog(&fog, 29, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_d3d9_fog(&fog, NEBEL_D3DRS_FOGTABLEMODE, 4), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_set_d3d9_fog(&fog, NEBEL_D3DRS_FOGVERTEXMODE, UINT32_MAX), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_set_d3d9_fog(NULL, 28, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_fog(&fog, 29, &value), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_fog(&fog, 28, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_get_d3d9_fog(NULL, 28, &value), NEBEL_ERROR_ARGUMENT);
    assert_memory_equal(&fog, &before, sizeof fog);
    assert_int_equal(value, 5);
}

static void test_floats_arrive_as_bit_patterns(void **unused)
{
    (void)unused;
    const nebel_d3d9_fog fog = make(0, 0, 0, 12.5f, -3, .0625f);
    assert_true(fog.fog_start == 12.5f && fog.fog_end == -3 && fog.fog_density == .0625f);
}

/* ---- colours --------------------------------------------------------------------------------- */

/* The object's colour 0xRRGGBB under the fog at factor f. */
static int pixel_of(const nebel_d3d9_fog *fog, int object, double f)
{
    double rgb[3];
    float pixel[4] = {(float)(object >> 16 & 255) / 255, (float)(object >> 8 & 255) / 255, (float)(object & 255) / 255,
                      1};
    nebel_get_d3d9_color(fog, rgb);
    nebel_blend_fog_factor(f, pixel, rgb, pixel);
    int color = 0;
    for (int c = 0; c < 3; c++) color = color << 8 | (int)(pixel[c] * 255 + .5f);
    return color;
}

static void assert_color(int found, int wanted, int most)
{
    for (int shift = 0; shift <= 16; shift += 8)
        if (abs((found >> shift & 255) - (wanted >> shift & 255)) > most)
            fail_msg("%06x is not %06x within %d", (unsigned)found, (unsigned)wanted, most);
}

static double fixed(const nebel_d3d9_fog *fog, double x, double y, double z, double alpha)
{
    const nebel_d3d9_vertex vertex = {.place = {x, y, z}, .specular_alpha = alpha};
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

/* A quad at z of the fixed pipeline, specular alpha ff, projection affine: device depth is z, too. */
static void assert_quad(const nebel_d3d9_fog *fog, int object, double z, int wanted, int most)
{
    const double f = nebel_compute_d3d9_pixel_factor(fog, fixed(fog, 0, 0, z, 1), z);
    assert_color(pixel_of(fog, object, f), wanted, most);
}

static void assert_transformed_quad(const nebel_d3d9_fog *fog, int object, double z, int wanted, int most)
{
    const double f = nebel_compute_d3d9_pixel_factor(fog, transformed(fog, 1), z);
    assert_color(pixel_of(fog, object, f), wanted, most);
}

static void test_fog_test(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_NONE, 0, 1, 1);
    assert_quad(&fog, RED, .1, RED, 0);
    set(&fog, NEBEL_D3DRS_FOGVERTEXMODE, NEBEL_D3DFOG_LINEAR);
    assert_quad(&fog, RED, 1, GREEN, 1);
    assert_transformed_quad(&fog, YELLOW, 1, YELLOW, 0);
    set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_LINEAR);
    assert_transformed_quad(&fog, YELLOW, 1, GREEN, 1);
}

static void test_fog_test_start_at_the_end_and_beyond(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, 512, 512, 1);
    assert_quad(&fog, RED, .1, GREEN, 1);
    assert_quad(&fog, RED, 1, GREEN, 1);
    assert_transformed_quad(&fog, YELLOW, 1, YELLOW, 0);
    fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, .8f, .2f, 1);
    assert_quad(&fog, BLUE, .1, GREEN, 1);
    assert_quad(&fog, BLUE, .7, 0x002bd4, 2);
    assert_quad(&fog, BLUE, .4, 0x00aa55, 2);
    assert_quad(&fog, BLUE, .9, BLUE, 0);
}

/* The world moves z by -.5; then the world by +1 and the projection by -1. Table fog goes by the z that comes out. */
static void test_fog_test_table_fog_goes_by_device_depth(void **unused)
{
    (void)unused;
    const nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_NONE, 0, 1, 1);
    static const struct {
        double z, world, projection;
        int wanted, most;
    } quads[] = {{.5, -.5, 0, RED, 4}, {1.5, -.5, 0, GREEN, 1}, {.1, 1, -1, 0xe51900, 4}, {1, 1, -1, GREEN, 1}};
    for (size_t i = 0; i < 4; i++) {
        const double camera = quads[i].z + quads[i].world, device = camera + quads[i].projection;
        const double f = nebel_compute_d3d9_pixel_factor(&fog, fixed(&fog, 0, 0, camera, 1), device);
        assert_color(pixel_of(&fog, RED, f), quads[i].wanted, quads[i].most);
    }
}

static void test_fog_test_range_fog_is_for_vertices_alone(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_NONE, .75f, .75001f, 1);
    set(&fog, NEBEL_D3DRS_RANGEFOGENABLE, 1);
    for (int corner = 0; corner < 4; corner++) {
        const double x = corner & 1 ? 1 : -1, y = corner & 2 ? 1 : -1;
        set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_LINEAR);
        set(&fog, NEBEL_D3DRS_FOGVERTEXMODE, NEBEL_D3DFOG_NONE);
        const double table = nebel_compute_d3d9_pixel_factor(&fog, fixed(&fog, x, y, .5, 1), .5);
        assert_color(pixel_of(&fog, RED, table), RED, 0);
        set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_NONE);
        set(&fog, NEBEL_D3DRS_FOGVERTEXMODE, NEBEL_D3DFOG_LINEAR);
        const double vertex = nebel_compute_d3d9_pixel_factor(&fog, fixed(&fog, x, y, .5, 1), .5);
        assert_color(pixel_of(&fog, RED, vertex), GREEN, 1);
    }
}

/* ---- shaders --------------------------------------------------------------------------------- */

enum { STEPS = 11, SHADER_TOLERANCE = 13 };

static const int linear_steps[STEPS] = {0xff0000, 0xff0000, 0xdf2000, 0xbf4000, 0x9f6000, 0x7f8000,
                                        0x5fa000, 0x40bf00, 0x20df00, 0x00ff00, 0x00ff00};
static const int exp_steps[STEPS] = {0xff0000, 0xe71800, 0xd12e00, 0xbd4200, 0xab5400, 0x9b6400,
                                     0x8d7200, 0x7f8000, 0x738c00, 0x689700, 0x5ea100};
static const int exp2_steps[STEPS] = {0xfd0200, 0xf50200, 0xf50a00, 0xe91600, 0xd92600, 0xc73800,
                                      0xb24d00, 0x9c6300, 0x867900, 0x728d00, 0x5ea100};
static const int register_steps[STEPS] = {0xff0000, 0xfe0100, 0xde2100, 0xbf4000, 0x9f6000, 0x7f8000,
                                          0x5fa000, 0x3fc000, 0x1fe000, 0x00ff00, 0x00ff00};

static double z_of_step(int step)
{
    return .001 + step / 10.02;
}

static void assert_steps(const nebel_d3d9_fog *fog, int with_shader, const int *wanted)
{
    for (int i = 0; i < STEPS; i++) {
        const double z = z_of_step(i);
        const double f = with_shader ? shaded(fog, (.9 - z) * 1.25) : fixed(fog, 0, 0, z, 1);
        assert_color(pixel_of(fog, RED, nebel_compute_d3d9_pixel_factor(fog, f, z)), wanted[i], SHADER_TOLERANCE);
    }
}

static void test_fog_with_shader_test(void **unused)
{
    (void)unused;
    for (uint32_t vertex = NEBEL_D3DFOG_NONE; vertex <= NEBEL_D3DFOG_LINEAR; vertex++) {
        nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, vertex, .1f, .9f, 1);
        assert_steps(&fog, 0, linear_steps);
        assert_steps(&fog, 1, linear_steps);
        set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_EXP);
        assert_steps(&fog, 0, exp_steps);
        assert_steps(&fog, 1, exp_steps);
        set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_EXP2);
        assert_steps(&fog, 0, exp2_steps);
        assert_steps(&fog, 1, exp2_steps);
        set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_NONE);
        assert_steps(&fog, 1, register_steps);
        const double f = nebel_compute_d3d9_pixel_factor(&fog, shaded(&fog, 0), .5); /* a shader that writes no oFog */
        assert_color(pixel_of(&fog, RED, f), GREEN, 0);
    }
    const nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, .1f, .9f, 1);
    assert_steps(&fog, 0, linear_steps); /* a pixel shader alone */
}

static void test_the_fog_register_is_clamped(void **unused)
{
    (void)unused;
    const nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_EXP, 0, 1, 1);
    assert_true(shaded(&fog, 1.5) == 1 && shaded(&fog, -.5) == 0 && shaded(&fog, .25) == .25);
}

static void test_fog_special(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(RED, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, .5f, .5f, 1);
    const double left = .49, right = .51;
    assert_quad(&fog, GREEN, left, RED, 1);
    assert_quad(&fog, GREEN, right, RED, 1);
    set(&fog, NEBEL_D3DRS_FOGTABLEMODE, NEBEL_D3DFOG_LINEAR);
    assert_quad(&fog, GREEN, left, GREEN, 1);
    assert_quad(&fog, GREEN, right, RED, 1);
}

/* ---- over a triangle ------------------------------------------------------------------------- */

/* z from 0 at the left to 1 at the right, specular alpha from ff to 00. */
static int interpolated(const nebel_d3d9_fog *fog, double x)
{
    const double f = (1 - x) * fixed(fog, 0, 0, 0, 1) + x * fixed(fog, 0, 0, 1, 0);
    return pixel_of(fog, BLUE, nebel_compute_d3d9_pixel_factor(fog, f, x));
}

static void test_fog_interpolation(void **unused)
{
    (void)unused;
    static const struct {
        uint32_t table, vertex;
        int middle;
    } cases[] = {{NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_NONE, 0x007f80},
                 {NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_EXP, 0x007f80},
                 {NEBEL_D3DFOG_EXP, NEBEL_D3DFOG_NONE, 0x00ea15},
                 {NEBEL_D3DFOG_EXP, NEBEL_D3DFOG_EXP, 0x00ea15}};
    for (size_t i = 0; i < 4; i++) {
        const nebel_d3d9_fog fog = make(GREEN, cases[i].table, cases[i].vertex, 0, 1, 5);
        assert_color(interpolated(&fog, 0), BLUE, 2);
        assert_color(interpolated(&fog, .5), cases[i].middle, 2);
        assert_color(interpolated(&fog, 1), 0x00fd02, 2);
    }
}

/* ---- depth ----------------------------------------------------------------------------------- */

static void test_negative_fixed_function_fog(void **unused)
{
    (void)unused;
    nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_NONE, 0, 1, 1);
    assert_transformed_quad(&fog, RED, -.5, RED, 2);
    fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_NONE, -1, 0, 1);
    assert_transformed_quad(&fog, RED, -.5, 0x808000, 2);
    fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, 0, 1, 1);
    assert_quad(&fog, RED, -.5, 0x808000, 2);
    fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, -1, 0, 1);
    assert_quad(&fog, RED, -.5, GREEN, 2);
    fog = make(GREEN, NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_EXP, 0, 1, 1);
    assert_quad(&fog, RED, -.5, 0x9b6400, 2);
}

static void test_table_fog_zw(void **unused)
{
    (void)unused;
    const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const float perspective[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.01f, 1, 0, 0, -.1f, 0};
    static const struct {
        double z, rhw;
        int wanted;
    } quads[] = {{.7, 0, 0x4cb200}, {.7, .3, 0x4cb200}, {.7, 3, 0x4cb200}, {.3, 0, 0xb24c00}};
    const nebel_d3d9_fog fog = make(GREEN, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_NONE, 0, 1, 1);
    assert_false(nebel_d3d9_uses_w(identity));
    assert_true(nebel_d3d9_uses_w(perspective));
    for (size_t i = 0; i < 4; i++) {
        const double depth = nebel_d3d9_uses_w(identity) ? 1 / quads[i].rhw : quads[i].z;
        const double f = nebel_compute_d3d9_pixel_factor(&fog, transformed(&fog, 1), depth);
        assert_color(pixel_of(&fog, RED, f), quads[i].wanted, 2);
    }
}

/* ProcessVertices of DirectDraw 7: world z .75, view z .5, vertex (.5, 0, 1), material specular alpha .5; the alpha
 * byte of specular. Table fog never changes it. */
static void test_fog_process_vertices(void **unused)
{
    (void)unused;
    static const struct {
        uint32_t vertex, range;
        int byte;
    } cases[] = {{NEBEL_D3DFOG_NONE, 0, 0x80},   {NEBEL_D3DFOG_EXP, 0, 0xaf},   {NEBEL_D3DFOG_EXP2, 0, 0xde},
                 {NEBEL_D3DFOG_LINEAR, 0, 0x9f}, {NEBEL_D3DFOG_NONE, 1, 0x80},  {NEBEL_D3DFOG_EXP, 1, 0x88},
                 {NEBEL_D3DFOG_EXP2, 1, 0xad},   {NEBEL_D3DFOG_LINEAR, 1, 0x60}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (uint32_t table = 0; table <= NEBEL_D3DFOG_LINEAR; table++) {
            nebel_d3d9_fog fog = make(GREEN, table, cases[i].vertex, 0, 1, 1);
            set(&fog, NEBEL_D3DRS_RANGEFOGENABLE, cases[i].range);
            const double f = fixed(&fog, .5, 0, 1 * .75 * .5, .5);
            assert_in_range((int)(255 * f + .5), cases[i].byte - 1, cases[i].byte + 1);
        }
}

/* ---- what is left ---------------------------------------------------------------------------- */

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
        cmocka_unit_test(test_fog_test),
        cmocka_unit_test(test_fog_test_start_at_the_end_and_beyond),
        cmocka_unit_test(test_fog_test_table_fog_goes_by_device_depth),
        cmocka_unit_test(test_fog_test_range_fog_is_for_vertices_alone),
        cmocka_unit_test(test_fog_with_shader_test),
        cmocka_unit_test(test_the_fog_register_is_clamped),
        cmocka_unit_test(test_fog_special),
        cmocka_unit_test(test_fog_interpolation),
        cmocka_unit_test(test_negative_fixed_function_fog),
        cmocka_unit_test(test_table_fog_zw),
        cmocka_unit_test(test_fog_process_vertices),
        cmocka_unit_test(test_fog_switched_off_is_none),
        cmocka_unit_test(test_the_alpha_of_the_fog_color_is_ignored),
        cmocka_unit_test(test_any_bits_give_a_factor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
