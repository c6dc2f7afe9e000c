/* Fog over pictures of every kind of sample: against formulas in double precision, every instruction set against every other,
 * and against fog that goes another way. */
#include <nebel/nebel.h>

#include <math.h>
#include <string.h>

#include "fog_help.h"

/* Wider than a piece of a row. */
enum { WIDTH = 301, HEIGHT = 5, PIXELS = WIDTH * HEIGHT, MOST = 16 * PIXELS };

static uint64_t state_of_dice = 4711;

static uint32_t roll(void)
{
    state_of_dice = state_of_dice * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state_of_dice >> 32);
}

static double roll_within(double low, double high)
{
    return low + (high - low) * roll() * 0x1p-32;
}

static float depth[PIXELS], kept[3 * PIXELS];
static unsigned char color[MOST], out[MOST], other[MOST];

typedef struct fog_case {
    double extinction[3], source[3];
} fog_case;

static const fog_case haze = {{.03, .03, .03}, {.8, .7, .9}}, tinted = {{.02, .03, .05}, {.8, .1, .9}};

static nebel_snapshot *make_fog(const fog_case *given)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_WORLD}};
    memcpy(volume.extinction, given->extinction, sizeof volume.extinction);
    memcpy(volume.source, given->source, sizeof volume.source);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

/* ---- samples as they are defined ------------------------------------------------------------- */

typedef enum sample { BYTE, SHORT, HALF, FLOAT } sample;

static const struct {
    sample sample;
    size_t channels, size;
} kinds[NEBEL_PIXEL_COUNT] = {
    [NEBEL_PIXEL_RGBA8] = {BYTE, 4, 1},       [NEBEL_PIXEL_RGB8] = {BYTE, 3, 1},
    [NEBEL_PIXEL_RGBA16] = {SHORT, 4, 2},     [NEBEL_PIXEL_RGB16] = {SHORT, 3, 2},
    [NEBEL_PIXEL_RGBA_HALF] = {HALF, 4, 2},   [NEBEL_PIXEL_RGB_HALF] = {HALF, 3, 2},
    [NEBEL_PIXEL_RGBA_FLOAT] = {FLOAT, 4, 4}, [NEBEL_PIXEL_RGB_FLOAT] = {FLOAT, 3, 4},
};

static double value_of_half(unsigned bits)
{
    const int exponent = (int)(bits >> 10 & 31);
    const double fraction = bits & 1023, sign = bits & 0x8000 ? -1 : 1;
    if (exponent == 31) return sign * (fraction > 0 ? (double)NAN : HUGE_VAL);
    return sign * (exponent > 0 ? ldexp(1024 + fraction, exponent - 25) : ldexp(fraction, -24));
}

static double read_sample(const unsigned char *from, sample kind)
{
    uint16_t number;
    float real;
    memcpy(&number, from, kind == BYTE ? 1 : 2);
    switch (kind) {
    case BYTE:
        return *from;
    case SHORT:
        return number;
    case HALF:
        return value_of_half(number);
    default:
        memcpy(&real, from, sizeof real);
        return (double)real;
    }
}

static void fill(nebel_pixel_type type)
{
    for (size_t i = 0; i < PIXELS * kinds[type].channels; i++) {
        const uint16_t number = (uint16_t)(kinds[type].sample == HALF ? roll_within(0, 0x5000) : roll_within(0, 65536));
        const float real = (float)exp(roll_within(-20, 5));
        if (kinds[type].sample == FLOAT)
            memcpy(color + 4 * i, &real, 4);
        else if (kinds[type].sample == BYTE)
            color[i] = (unsigned char)number;
        else
            memcpy(color + 2 * i, &number, 2);
    }
}

static nebel_pixels make_picture(nebel_pixel_type type, nebel_pixel_depth depth_type, int srgb)
{
    for (int i = 0; i < PIXELS; i++) depth[i] = i % 19 == 0 ? HUGE_VALF : (float)roll_within(0, 90);
    fill(type);
    return (nebel_pixels){.corner = {-.8f, .5f, -1},
                          .step_x = {.005f, .0001f, 0},
                          .step_y = {0, -.025f, .0003f},
                          .depth_type = depth_type,
                          .width = WIDTH,
                          .height = HEIGHT,
                          .depth = depth,
                          .color = color,
                          .output = out,
                          .type = type,
                          .srgb = srgb,
                          .transmittance = kept};
}

/* ---- the formula ----------------------------------------------------------------------------- */

static double decode(double c)
{
    return c <= .04045 ? c / 12.92 : pow((c + .055) / 1.055, 2.4);
}

static double encode(double x)
{
    return x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
}

static double length_of(const nebel_pixels *p, int i)
{
    double square = 0;
    if (p->depth_type == NEBEL_PIXEL_DEPTH_RADIAL) return (double)depth[i];
    for (int c = 0; c < 3; c++) {
        const double way = (double)p->corner[c] + i % WIDTH * (double)p->step_x[c] + i / WIDTH * (double)p->step_y[c];
        square += way * way;
    }
    return (double)depth[i] * sqrt(square);
}

/* In the sample's own numbers. */
static double expected(const nebel_pixels *p, const fog_case *fog, double transmittance, double sample_value, int c)
{
    const sample kind = kinds[p->type].sample;
    const double most = kind == BYTE ? 255 : kind == SHORT ? 65535 : 1, x = sample_value / most;
    const double sum = transmittance * (p->srgb ? decode(x) : x) + (1 - transmittance) * fog->source[c];
    return most * (p->srgb ? encode(sum) : sum);
}

/* Beside rounding: light in float is 3e-6 off, and sRGB amplifies that by at most 12.92; what the header says of sRGB. */
static double tolerance_of(const nebel_pixels *p, double wanted)
{
    switch (kinds[p->type].sample) {
    case BYTE:
        return .501;
    case SHORT:
        return .5 + 65535 * 3e-6 + (p->srgb ? .2 : 0);
    case HALF:
        return 3e-6 + wanted * 0x1p-11;
    default:
        return 3e-6 + wanted * 3e-6;
    }
}

static void assert_fogged(const nebel_pixels *p, const fog_case *fog)
{
    const size_t channels = kinds[p->type].channels, size = kinds[p->type].size;
    for (int i = 0; i < PIXELS; i++) {
        for (int c = 0; c < 3; c++) {
            const double transmittance = exp(-fog->extinction[c] * length_of(p, i));
            const size_t at = ((size_t)i * channels + (size_t)c) * size;
            const double wanted = expected(p, fog, transmittance, read_sample(color + at, kinds[p->type].sample), c);
            const double got = read_sample(out + at, kinds[p->type].sample);
            assert_true(fabs(got - wanted) < tolerance_of(p, wanted));
            assert_true(fabs((double)kept[3 * i + c] - transmittance) < 3e-6);
        }
        const size_t alpha = ((size_t)i * channels + 3) * size;
        if (channels == 4) assert_memory_equal(out + alpha, color + alpha, size);
    }
}

/* ---- tests ----------------------------------------------------------------------------------- */

static int has_srgb(nebel_pixel_type type)
{
    return kinds[type].sample == BYTE || kinds[type].sample == SHORT;
}

static void test_every_kind_follows_the_formula(void **state)
{
    (void)state;
    for (int round = 0; round < 2; round++) {
        const fog_case *const fog = round ? &tinted : &haze;
        nebel_snapshot *const now = make_fog(fog);
        for (nebel_pixel_type type = NEBEL_PIXEL_RGBA8; type < NEBEL_PIXEL_COUNT; type++)
            for (int srgb = 0; srgb <= has_srgb(type); srgb++) {
                const nebel_pixels p =
                    make_picture(type, round ? NEBEL_PIXEL_DEPTH_RADIAL : NEBEL_PIXEL_DEPTH_AXIAL, srgb);
                assert_int_equal(nebel_apply_fog_to_pixels(now, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
                assert_fogged(&p, fog);
            }
        nebel_release_snapshot(now);
    }
}

static void test_instruction_sets_and_rows_give_the_same_bytes(void **state)
{
    (void)state;
    nebel_snapshot *const now = make_fog(&haze);
    for (nebel_pixel_type type = NEBEL_PIXEL_RGBA8; type < NEBEL_PIXEL_COUNT; type++) {
        nebel_pixels p = make_picture(type, NEBEL_PIXEL_DEPTH_AXIAL, has_srgb(type));
        const size_t bytes = PIXELS * nebel_pixel_size(type);
        assert_int_equal(bytes, PIXELS * kinds[type].channels * kinds[type].size);
        assert_int_equal(nebel_apply_fog_to_pixels(now, NEBEL_ISA_SCALAR, &p), NEBEL_OK);
        for (nebel_isa isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available(isa)) continue;
            memcpy(other, color, bytes);
            p.color = p.output = other;
            for (p.first_row = 0; p.first_row < HEIGHT; p.first_row += p.row_count) {
                p.row_count = p.first_row + 2 <= HEIGHT ? 2 : HEIGHT - p.first_row;
                assert_int_equal(nebel_apply_fog_to_pixels(now, isa, &p), NEBEL_OK);
            }
            assert_memory_equal(other, out, bytes);
        }
    }
    nebel_release_snapshot(now);
}

/* All bytes, shorts and halves there are. */
static void test_depths_that_are_none_keep_every_number(void **state)
{
    (void)state;
    for (int round = 0; round < 2; round++) {
        nebel_snapshot *const now = make_fog(round ? &tinted : &haze);
        for (nebel_pixel_type type = NEBEL_PIXEL_RGBA8; type < NEBEL_PIXEL_COUNT; type++)
            for (int srgb = 0; srgb <= has_srgb(type); srgb++) {
                static uint16_t number;
                nebel_pixels p = make_picture(type, NEBEL_PIXEL_DEPTH_AXIAL, srgb);
                const size_t bytes = PIXELS * nebel_pixel_size(type);
                for (size_t i = 0; kinds[type].size == 2 && i < bytes / 2; i++, number++) {
                    if (kinds[type].sample == HALF && (number & 0x7fff) > 0x7c00) number = 0x8001;
                    memcpy(color + 2 * i, &number, 2);
                }
                for (int i = 0; i < PIXELS; i++) depth[i] = i % 3 == 0 ? nanf("") : i % 3 == 1 ? -5.f : 0.f;
                assert_int_equal(nebel_apply_fog_to_pixels(now, NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
                assert_memory_equal(out, color, bytes);
            }
        nebel_release_snapshot(now);
    }
}

/* What the boxes' kernel leaves out must not go there. */
static void test_lit_boxes_show_their_light(void **state)
{
    (void)state;
    nebel_pixels p = make_picture(NEBEL_PIXEL_RGBA8, NEBEL_PIXEL_DEPTH_RADIAL, 0);
    p.transmittance = NULL;
    const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-50, -50, -80}, .max = {50, 50, -2}},
                                      .extinction = {.05, .05, .05},
                                      .albedo = {.9, .9, .9}};
    const nebel_lighting_desc lights = {.sun = {.direction = {0, 1, 0}, .irradiance = {20, 20, 20}}};
    nebel_lighting *lighting = fog_light(&lights, &volume, 1);
    p.lighting = lighting;
    assert_int_equal(nebel_apply_fog_to_pixels(nebel_get_lighting_snapshot(lighting), NEBEL_ISA_DEFAULT, &p), NEBEL_OK);
    for (int i = 0; i < PIXELS; i++) {
        nebel_ray ray = {.t_max = (double)depth[i]};
        for (int c = 0; c < 3; c++)
            ray.direction[c] = (double)p.corner[c] + i % WIDTH * (double)p.step_x[c] + i / WIDTH * (double)p.step_y[c];
        const nebel_transfer transfer = fog_along(lighting, &ray);
        for (int c = 0; c < 3; c++) {
            const double wanted = transfer.transmittance[c] * color[4 * i + c] + 255 * transfer.in_scattering[c];
            assert_true(fabs(out[4 * i + c] - fmin(wanted, 255)) < .5 + 255 * NEBEL_DEFAULT_TOLERANCE);
        }
    }
    nebel_release_lighting(lighting);
}

static void test_wrong_kinds_are_refused(void **state)
{
    (void)state;
    nebel_snapshot *const now = make_fog(&haze);
    const nebel_pixels good = make_picture(NEBEL_PIXEL_RGB16, NEBEL_PIXEL_DEPTH_AXIAL, 0);
    nebel_pixels bad[] = {good, good, good, good, good};
    bad[0].type = NEBEL_PIXEL_COUNT;
    bad[1].type = NEBEL_PIXEL_RGB_HALF;
    bad[1].srgb = 1;
    bad[2].color_pitch = 6 * WIDTH - 2;
    bad[3].output_pitch = 6 * WIDTH + 1;
    bad[4].transmittance_pitch = 12 * WIDTH - 4;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(nebel_apply_fog_to_pixels(now, NEBEL_ISA_DEFAULT, &bad[i]), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pixel_size(NEBEL_PIXEL_COUNT), 0);
    nebel_release_snapshot(now);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_kind_follows_the_formula),
        cmocka_unit_test(test_instruction_sets_and_rows_give_the_same_bytes),
        cmocka_unit_test(test_depths_that_are_none_keep_every_number),
        cmocka_unit_test(test_lit_boxes_show_their_light),
        cmocka_unit_test(test_wrong_kinds_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
