/* Air in which light is scattered many times: against single rays of light by chance, and against what may not be lost. */
#include "unit.h"

#include <nebel/planet.h>

#include <math.h>

#define PI 3.14159265358979323846
#define SCALE 8000.0 /* m: of the air's height */

static nebel_atmosphere *make(double radius, double depth, double albedo, nebel_air_quality quality)
{
    nebel_atmosphere_desc desc = {.radius = radius, .thickness = 1e5, .air_count = 1, .quality = quality};
    nebel_atmosphere *made;
    desc.airs[0].scale_height = SCALE;
    for (int c = 0; c < 3; c++) {
        desc.airs[0].scattering[c] = depth / SCALE;
        desc.ground_albedo[c] = albedo;
    }
    assert_int_equal(nebel_create_atmosphere(&desc, &made), NEBEL_OK);
    return made;
}

static nebel_sun sun_of(double cosine)
{
    return (nebel_sun){.direction = {sqrt(1 - cosine * cosine), cosine, 0}, .irradiance = {1, 1, 1}};
}

static nebel_light trace(const nebel_atmosphere *air, double cosine, double height, const double direction[3])
{
    const nebel_sun sun = sun_of(cosine);
    const nebel_ray ray = {
        .origin = {0, height, 0}, .direction = {direction[0], direction[1], direction[2]}, .t_max = HUGE_VAL};
    nebel_light light;
    assert_int_equal(nebel_trace_air(air, &sun, 1, &ray, 0, &light, 0), NEBEL_OK);
    return light;
}

/* ---- energy ---------------------------------------------------------------------------------- */

/* Part of sunlight that leaves a flat planet again, whose air and ground take nothing. */
static double part_returned(double depth, nebel_air_quality quality)
{
    enum { SLOPES = 16, TURNS = 8 };
    const double cosine = 0.7, place[1][3] = {{0, 0, 0}};
    nebel_atmosphere *air = make(1e9, depth, 1, quality);
    const nebel_sun sun = sun_of(cosine);
    nebel_air_light ground;
    double flux = 0;
    assert_int_equal(nebel_light_air(air, &sun, 1, place, 0, &ground, 0), NEBEL_OK);
    for (int i = 0; i < SLOPES; i++)
        for (int k = 0; k < TURNS; k++) {
            const double down = (i + 0.5) / SLOPES, side = sqrt(1 - down * down), turn = PI * (k + 0.5) / TURNS;
            const nebel_light light =
                trace(air, cosine, 1e5, (const double[3]){side * cos(turn), -down, side * sin(turn)});
            const double below =
                (double)light.transmittance[0] / PI * ((double)ground.sun[0] * cosine + (double)ground.sky[0]);
            flux += ((double)light.in_scattering[0] + below) * down * 2 * PI / (SLOPES * TURNS);
        }
    nebel_destroy_atmosphere(air);
    return flux / cosine;
}

static void nothing_is_lost(void **state)
{
    static const struct {
        double depth, off;
        nebel_air_quality quality;
    } cases[] = {{0.25, 1e-3, NEBEL_AIR_FAST},
                 {1, 8e-3, NEBEL_AIR_FAST},
                 {4, 2e-2, NEBEL_AIR_FAST},
                 {0.25, 1e-3, NEBEL_AIR_PRECISE},
                 {1, 3e-3, NEBEL_AIR_PRECISE}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double part = part_returned(cases[i].depth, cases[i].quality);
        print_message("depth %g, quality %d: %.4f\n", cases[i].depth, (int)cases[i].quality, part);
        assert_true(fabs(part - 1) <= cases[i].off);
    }
}

/* ---- chance ---------------------------------------------------------------------------------- */

static uint64_t chance_state;

static double chance(void)
{
    chance_state ^= chance_state << 13;
    chance_state ^= chance_state >> 7;
    chance_state ^= chance_state << 17;
    return (double)(chance_state >> 11) * 0x1p-53;
}

/* Light that one walk back from who looks straight up from the ground, or down from above, brings: on each place that it comes to
 * sunlight falls. Air is flat, scatters evenly and takes nothing; the ground is black. */
static double walk(double depth, double cosine, int is_up)
{
    double below = is_up ? 0 : depth, slope = is_up ? 1 : -1, light = 0;
    for (;;) {
        below -= slope * log(1 - chance());
        if (!(below > 0 && below < depth)) return light;
        light += exp(-(depth - below) / cosine) / (4 * PI);
        slope = 2 * chance() - 1;
    }
}

/* Mean and standard error. */
static void walk_often(double depth, double cosine, int is_up, double mean[2])
{
    enum { WALKS = 100000 };
    double sum = 0, square = 0;
    for (int i = 0; i < WALKS; i++) {
        const double light = walk(depth, cosine, is_up);
        sum += light;
        square += light * light;
    }
    mean[0] = sum / WALKS;
    mean[1] = sqrt((square / WALKS - mean[0] * mean[0]) / WALKS);
}

static void error_covers_what_chance_finds(void **state)
{
    static const struct {
        double depth;
        nebel_air_quality quality;
    } cases[] = {{0.5, NEBEL_AIR_FAST},
                 {0.5, NEBEL_AIR_PRECISE},
                 {2, NEBEL_AIR_FAST},
                 {2, NEBEL_AIR_PRECISE},
                 {8, NEBEL_AIR_FAST}};
    const double cosine = 0.5;
    (void)state;
    chance_state = UINT64_C(88172645463325252);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double depth = cases[i].depth;
        nebel_atmosphere *air = make(1e9, depth, 0, cases[i].quality);
        for (int is_up = 0; is_up < 2; is_up++) {
            double mean[2];
            walk_often(depth, cosine, is_up, mean);
            const nebel_light light = trace(air, cosine, is_up ? 0 : 1e5, (const double[3]){0, is_up ? 1 : -1, 0});
            const double off = (double)light.in_scattering[0] - mean[0];
            print_message("depth %g, up %d, quality %d: %.5f, off %.5f, told %.5f, by chance %.5f\n", depth, is_up,
                          (int)cases[i].quality, mean[0], off, (double)light.error, mean[1]);
            assert_true(fabs(off) <= (double)light.error + 3 * mean[1]);
        }
        nebel_destroy_atmosphere(air);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_lost),
        cmocka_unit_test(error_covers_what_chance_finds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
