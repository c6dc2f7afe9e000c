/* The oracle against the other oracle (files of tests/truth, made by sampling in Python), against textbook values, and
 * against itself with its closed forms turned off. */
#include "oracle.h"
#include "truth_file.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const files[] = {"single0.json",  "single1.json",  "single2.json",   "single3.json",
                                    "overlap0.json", "overlap1.json", "profiles0.json", "profiles1.json",
                                    "exclude0.json", "exclude1.json", "many0.json",     "many1.json"};
enum { FILE_COUNT = sizeof files / sizeof files[0] };

static double largest_difference(const double T[3], const double S[3], const double T2[3], const double S2[3])
{
    double most = 0;
    for (int c = 0; c < 3; c++) most = fmax(most, fmax(fabs(T[c] - T2[c]), fabs(S[c] - S2[c])));
    return most;
}

static void test_agrees_with_the_truth_files_within_their_uncertainty(void **unused)
{
    (void)unused;
    size_t rays = 0;
    for (int f = 0; f < FILE_COUNT; f++) {
        truth_file file = truth_read(NEBEL_SOURCE "/tests/truth", files[f]);
        for (size_t i = 0; i < file.ray_count; i++) {
            const truth_ray *const r = &file.rays[i];
            double T[3], S[3], uncertainty;
            oracle_trace(file.volumes, file.volume_count, file.ambient, &r->ray, T, S, &uncertainty);
            assert_true(uncertainty < 1e-11);
            /* Theirs is the difference of two samplings, which says little where both step over kinks of profiles. */
            const double kinks = strncmp(files[f], "profiles", 8) == 0 ? 1e-9 : 1e-11;
            const double wrong = largest_difference(T, S, r->T, r->S);
            if (wrong > r->uncertainty + kinks) print_message("%s ray %zu: %g\n", files[f], i, wrong);
            assert_true(wrong <= r->uncertainty + kinks);
            rays++;
        }
        truth_free(&file);
    }
    assert_true(rays > 100);
}

static void test_numerical_and_closed_results_agree(void **unused)
{
    (void)unused;
    for (int f = 0; f < FILE_COUNT; f++) {
        truth_file file = truth_read(NEBEL_SOURCE "/tests/truth", files[f]);
        for (size_t i = 0; i < file.ray_count; i++) {
            double T[3], S[3], T2[3], S2[3], uncertainty, uncertainty2;
            for (int endless = 0; endless < 2; endless++) {
                nebel_ray ray = file.rays[i].ray;
                if (endless) ray.t_max = HUGE_VAL;
                oracle_trace(file.volumes, file.volume_count, file.ambient, &ray, T, S, &uncertainty);
                oracle_trace_numerically(file.volumes, file.volume_count, file.ambient, &ray, T2, S2, &uncertainty2);
                assert_true(uncertainty < 1e-11 && uncertainty2 < 1e-11);
                assert_true(largest_difference(T, S, T2, S2) <= uncertainty + uncertainty2);
            }
        }
        truth_free(&file);
    }
}

/* ---- textbook values, computed with 30 digits ------------------------------------------------ */

static double depth_of(const nebel_shape *shape, const nebel_density *density, double extinction, nebel_ray ray)
{
    nebel_volume_desc volume = {.shape = *shape, .density = *density};
    for (int c = 0; c < 3; c++) volume.extinction[c] = extinction;
    double T[3], S[3], uncertainty;
    oracle_trace(&volume, 1, (const double[3]){0}, &ray, T, S, &uncertainty);
    assert_true(uncertainty < 1e-14);
    return -log(T[0]);
}

static void assert_depth(double found, double expected, double slack)
{
    if (fabs(found - expected) > slack) print_message("%.16g instead of %.16g\n", found, expected);
    assert_true(fabs(found - expected) <= slack);
}

static void test_chords_of_shapes(void **unused)
{
    (void)unused;
    const nebel_density even = {0};
    const double inf = HUGE_VAL;
    const nebel_ray ray = {{-4, .3, .2}, {0.9897594780811197, 0.1187711373697344, -0.07918075824648958}, inf};
    const nebel_shape sphere = {.type = NEBEL_SHAPE_SPHERE, .radius = 2};
    assert_depth(depth_of(&sphere, &even, .5, (nebel_ray){{-5, .7, .4}, {1, .1, -.05}, inf}), 1.596871942267131, 2e-15);
    assert_depth(depth_of(&sphere, &even, .5, (nebel_ray){{-1e6, .5, 0}, {1, 0, 0}, inf}), 1.936491673103708, 2e-15);
    assert_depth(depth_of(&sphere, &even, .5, (nebel_ray){{-5, 1.999, 0}, {1, 0, 0}, inf}), .06323764701504951, 1e-14);
    assert_depth(depth_of(&sphere, &even, .5, (nebel_ray){{-5, 3, 0}, {1, 0, 0}, inf}), 0, 0);
    const nebel_shape box = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, 0}, .max = {2, 1, 3}};
    assert_depth(depth_of(&box, &even, .3, (nebel_ray){{-4, .2, 1.1}, {1, .15, .2}, inf}), .7215434844830906, 1e-15);
    const nebel_shape ellipsoid = {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {3, 1, .5}};
    assert_depth(depth_of(&ellipsoid, &even, 1, ray), 3.484361280971332, 2e-14);
    const nebel_shape cylinder = {.type = NEBEL_SHAPE_CYLINDER, .from = {0, -.8, 0}, .to = {0, .8, 0}, .radius = 1};
    assert_depth(depth_of(&cylinder, &even, 1, ray), 1.177926353668642, 2e-15);
    const nebel_shape cone = {.type = NEBEL_SHAPE_CONE, .to = {0, 2, 0}, .radius_from = 1};
    assert_depth(depth_of(&cone, &even, 1, ray), 1.210433489592363, 2e-15);
    const nebel_shape capsule = {.type = NEBEL_SHAPE_CAPSULE, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius = .5};
    assert_depth(depth_of(&capsule, &even, 1, ray), .9778833251231166, 2e-15);
    nebel_plane planes[8];
    for (int i = 0; i < 8; i++) planes[i] = (nebel_plane){{i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1}, 1};
    const nebel_shape octahedron = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 8};
    assert_depth(depth_of(&octahedron, &even, 1, ray), .2104888490052515, 2e-15);
}

static nebel_ray rising(double height, double degrees, double length)
{
    const double angle = degrees * 3.14159265358979323846 / 180;
    return (nebel_ray){{0, height, 0}, {cos(angle), sin(angle), 0}, length};
}

static void test_depths_of_profiles(void **unused)
{
    (void)unused;
    const nebel_shape world = {0};
    const nebel_density height = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 50};
    assert_depth(depth_of(&world, &height, .02, rising(1.7, 0, 300)), 5.79942902782504, 1e-13);
    assert_depth(depth_of(&world, &height, .02, rising(1.7, 1e-6, 300)), 5.799428724167657, 1e-13);
    assert_depth(depth_of(&world, &height, .02, rising(1.7, 5, 1000)), 9.149667986993935, 1e-11);
    assert_depth(depth_of(&world, &height, .02, rising(1.7, 90, HUGE_VAL)), .9665715046375067, 1e-15);
    assert_depth(depth_of(&world, &height, .02, rising(1000, -89, 999)), .9773692687837537, 1e-15);
    const nebel_density ramp = {.type = NEBEL_DENSITY_LINEAR, .from = {0, 40, 0}, .to = {0, 0, 0}};
    assert_depth(depth_of(&world, &ramp, .05, rising(2, 10, 200)), 5.158795558326741, 1e-13);
    assert_depth(depth_of(&world, &ramp, .05, rising(60, -30, 150)), 3.5, 1e-14);
    const nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = 3};
    const double expected[] = {3.079490867010324, 2.069417862630938, 1.489980861094275};
    for (int k = 1; k <= 3; k++) {
        const nebel_density radial = {.type = NEBEL_DENSITY_RADIAL, .power = k};
        assert_depth(depth_of(&ball, &radial, 1, (nebel_ray){{-9, 1.2, 0}, {1, 0, 0}, 99}), expected[k - 1], 1e-14);
    }
    const nebel_density gaussian = {.type = NEBEL_DENSITY_GAUSSIAN, .sigma = .7};
    assert_depth(depth_of(&world, &gaussian, 1, (nebel_ray){{-1e4, .5, 0}, {1, 0, 0}, HUGE_VAL}), 1.359560585236798,
                 1e-14);
}

/* A chord that is short by cancellation: the ray passes 1e-14 inside the surface of a sphere of radius 1. */
static void test_grazing_chords_keep_their_digits(void **unused)
{
    (void)unused;
    const nebel_density even = {0};
    const nebel_shape sphere = {.type = NEBEL_SHAPE_SPHERE, .radius = 1};
    const double inside = 1 - 0x1p-46;
    const double half = sqrt((1 - inside) * (1 + inside));
    assert_depth(depth_of(&sphere, &even, 1e6, (nebel_ray){{-1e7, inside, 0}, {1, 0, 0}, HUGE_VAL}), 2e6 * half, 1e-15);
}

static void test_a_ray_in_a_face_is_undecided(void **unused)
{
    (void)unused;
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .extinction = {1, 1, 1}};
    double T[3], S[3], uncertainty;
    oracle_trace(&box, 1, (const double[3]){0}, &(nebel_ray){{-1, .5, 1}, {1, 0, 0}, 5}, T, S, &uncertainty);
    assert_true(uncertainty == HUGE_VAL);
    oracle_trace(&box, 1, (const double[3]){0}, &(nebel_ray){{-1, 2, 1}, {1, 0, 0}, 5}, T, S, &uncertainty);
    assert_true(uncertainty < 1e-14 && T[0] == 1);
}

/* Halved steps must find fog that fills a millionth of the ray, and light that comes from the first millimetre. */
static void test_thin_and_opaque_fog_is_found(void **unused)
{
    (void)unused;
    const nebel_shape world = {0};
    const nebel_density thin = {.type = NEBEL_DENSITY_GAUSSIAN, .center = {123456.7, .1, 0}, .sigma = .05};
    const double closed = sqrt(2 * 3.14159265358979323846) * .05 * exp(-2);
    assert_depth(depth_of(&world, &thin, 1, (nebel_ray){{0, 0, 0}, {1, 0, 0}, 1e6}), closed, 1e-12);
    nebel_volume_desc v = {.density = {.type = NEBEL_DENSITY_LINEAR, .from = {0, 0, 0}, .to = {10, 0, 0}},
                           .extinction = {1e4, 1e4, 1e4},
                           .source = {1, 2, 3}};
    double T[3], S[3], uncertainty;
    oracle_trace(&v, 1, (const double[3]){0}, &(nebel_ray){{0, 0, 0}, {1, 0, 0}, HUGE_VAL}, T, S, &uncertainty);
    assert_true(T[0] < 1e-30 && fabs(S[0] - 1) < 1e-12 && fabs(S[2] - 3) < 3e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agrees_with_the_truth_files_within_their_uncertainty),
        cmocka_unit_test(test_numerical_and_closed_results_agree),
        cmocka_unit_test(test_chords_of_shapes),
        cmocka_unit_test(test_depths_of_profiles),
        cmocka_unit_test(test_grazing_chords_keep_their_digits),
        cmocka_unit_test(test_a_ray_in_a_face_is_undecided),
        cmocka_unit_test(test_thin_and_opaque_fog_is_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
