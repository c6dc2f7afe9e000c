/* Every instruction set gives the same bits, for every ray, in any company. test_kernels [SEGMENTS] */
#include <nebel/nebel.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

/* The sanitizers make every segment twenty times as dear. */
#if defined(__SANITIZE_ADDRESS__)
enum { SEGMENTS = 50000 };
#else
enum { SEGMENTS = 1000000 };
#endif
static size_t segment_count;

/* ---- random fog and rays that hurt ----------------------------------------------------------- */

static uint64_t state_of_dice = 20240607;

static double dice(double low, double high)
{
    state_of_dice = state_of_dice * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state_of_dice >> 11) * 0x1p-53;
}

static int pick(int n)
{
    return (int)dice(0, n);
}

static void point(double p[3], double size)
{
    for (int i = 0; i < 3; i++) p[i] = dice(-size, size);
}

static void random_transform(nebel_transform *t)
{
    point(t->position, 3);
    for (int i = 0; i < 4; i++) t->rotation[i] = dice(-1, 1);
    for (int i = 0; i < 3; i++) t->scale[i] = dice(.6, 1.6);
}

static nebel_plane planes_of_case[8];
static nebel_shape parts_of_case[3];

static nebel_shape random_shape(int kind)
{
    nebel_shape s = {.type = (nebel_shape_type)kind};
    point(s.center, 8);
    point(s.from, 8);
    point(s.to, 8);
    point(s.point, 4);
    point(s.normal, 1);
    s.radius = s.radius_from = dice(1, 6);
    s.radius_to = dice(0, 6);
    for (int i = 0; i < 3; i++) {
        const double half = dice(1, 8);
        s.radii[i] = dice(1, 8);
        s.min[i] = floor(s.center[i] - half);
        s.max[i] = ceil(s.center[i] + half);
    }
    for (int i = 0; i < 8; i++) {
        point(planes_of_case[i].normal, 1);
        planes_of_case[i].distance = dice(2, 6);
    }
    s.planes = planes_of_case;
    s.plane_count = 8;
    if (pick(3) == 0) random_transform(&s.transform);
    return s;
}

static nebel_density random_density(const nebel_shape *shape)
{
    nebel_density d = {.type = (nebel_density_type)pick(4), .below = (nebel_below)pick(2), .base = dice(-5, 5)};
    const int round = shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID;
    if (d.type == NEBEL_DENSITY_RADIAL) d.type = NEBEL_DENSITY_GAUSSIAN;
    if (round && pick(2)) d.type = NEBEL_DENSITY_RADIAL;
    if (shape->type == NEBEL_SHAPE_BOX && pick(2)) d.type = NEBEL_DENSITY_SOFT_EDGE;
    if (pick(6) == 0) d.type = NEBEL_DENSITY_ALTITUDE;
    d.radius = pick(2) ? dice(6, 20) : 6.36e6;
    d.scale_height = dice(1, 12);
    point(d.from, 8);
    point(d.to, 8);
    d.power = 1 + pick(3);
    point(d.center, 8);
    if (d.type == NEBEL_DENSITY_ALTITUDE) d.center[1] -= d.radius;
    d.sigma = dice(1, 6);
    d.edge_width = dice(.3, 4);
    return d;
}

static nebel_volume_desc random_volume(int kind)
{
    nebel_volume_desc v = {.shape = random_shape(kind)};
    if (kind == NEBEL_SHAPE_UNION || kind == NEBEL_SHAPE_INTERSECTION) {
        for (int i = 0; i < 3; i++) parts_of_case[i] = random_shape(1 + pick(NEBEL_SHAPE_UNION - 1));
        v.shape.parts = parts_of_case;
        v.shape.part_count = 3;
    }
    v.density = random_density(&v.shape);
    if (pick(10) == 0) v.operation = (nebel_operation)pick(NEBEL_OPERATION_COUNT);
    if (pick(4) == 0) v.priority = pick(3) - 1;
    if (pick(10) == 0) v.start = dice(0, 10);
    if (pick(10) == 0) v.cutoff = v.start + dice(1, 20);
    for (int i = 0; i < 3; i++) {
        v.extinction[i] = pick(40) == 0 ? dice(0, 1000) : dice(0, .2);
        v.source[i] = dice(0, 2);
        v.emission[i] = pick(8) == 0 ? dice(0, .05) : 0;
    }
    return v;
}

static nebel_snapshot *random_fog(void)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    const int many = pick(12) == 0;
    const int count = many ? 40 : 1 + pick(6);
    for (int i = 0; i < count; i++) {
        const nebel_volume_desc v = random_volume(i == 0 && !many ? pick(2) : 1 + pick(NEBEL_SHAPE_COUNT - 1));
        const nebel_result added = nebel_add_volume(fog, &v, NULL);
        assert_true(added == NEBEL_OK || added == NEBEL_ERROR_VALUE); /* planes that leave nothing */
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

static nebel_ray random_ray(int i)
{
    nebel_ray ray = {.t_max = dice(1, 80)};
    double target[3];
    point(ray.origin, i % 8 == 0 ? 6 : 25);
    point(target, 10);
    for (int c = 0; c < 3; c++) ray.direction[c] = target[c] - ray.origin[c];
    if (i % 11 == 0) {
        memset(ray.direction, 0, sizeof ray.direction);
        ray.direction[pick(3)] = pick(2) ? 1 : -1;
        for (int c = 0; c < 3; c++) ray.origin[c] = floor(ray.origin[c]);
    }
    if (i % 13 == 0) ray.direction[pick(3)] *= 1e-9;
    if (i % 17 == 0) ray.t_max = i % 34 == 0 ? HUGE_VAL : 0;
    return ray;
}

/* ---- the tests ------------------------------------------------------------------------------- */

enum { RAYS = 2000 };
static nebel_ray rays[RAYS];
static nebel_transfer expected[RAYS], found[RAYS];

static nebel_result trace(const nebel_snapshot *fog, nebel_isa isa, size_t first, size_t n, nebel_transfer *transfers)
{
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = isa};
    return nebel_trace(fog, &desc, n, rays + first, sizeof *rays, transfers + first, sizeof *transfers);
}

static void print_difference(size_t i, nebel_isa isa)
{
    const nebel_ray *r = &rays[i];
    printf("ray %zu of this fog, %s: %.17g %.17g %.17g  %.17g %.17g %.17g  %.17g\n", i, nebel_isa_name(isa),
           r->origin[0], r->origin[1], r->origin[2], r->direction[0], r->direction[1], r->direction[2], r->t_max);
    for (int c = 0; c < 3; c++)
        printf("  transmittance %.9g, not %.9g; in-scattering %.9g, not %.9g; error %.9g, not %.9g\n",
               found[i].transmittance[c], expected[i].transmittance[c], found[i].in_scattering[c],
               expected[i].in_scattering[c], found[i].error, expected[i].error);
}

static void assert_same_lights(nebel_isa isa)
{
    for (size_t i = 0; i < RAYS; i++)
        if (memcmp(&found[i], &expected[i], sizeof found[i]) != 0) {
            print_difference(i, isa);
            fail();
        }
}

static void test_instruction_sets_are_bit_equal(void **state)
{
    (void)state;
    size_t done = 0;
    for (; done < segment_count; done += RAYS) {
        nebel_snapshot *fog = random_fog();
        for (int i = 0; i < RAYS; i++) rays[i] = random_ray(i);
        const nebel_result scalar = trace(fog, NEBEL_ISA_SCALAR, 0, RAYS, expected);
        for (nebel_isa isa = NEBEL_ISA_SSE2; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available(isa)) continue;
            assert_int_equal(trace(fog, isa, 0, RAYS, found), scalar);
            if (scalar == NEBEL_OK) assert_same_lights(isa);
        }
        nebel_release_snapshot(fog);
    }
    printf("%zu segments compared\n", done);
}

static void test_a_ray_gives_the_same_bits_in_any_company(void **state)
{
    (void)state;
    for (size_t round = 0; round < nb_test_count(20); round++) {
        nebel_snapshot *fog = random_fog();
        for (int i = 0; i < RAYS; i++)
            rays[i] = random_ray(i + 1 - (i % 17 == 16)); /* none without end: no ray is an error */
        if (trace(fog, NEBEL_ISA_DEFAULT, 0, RAYS, expected) == NEBEL_OK) {
            for (size_t i = 0; i < RAYS;) {
                const size_t n = 1 + (size_t)pick(7);
                const size_t part = n < RAYS - i ? n : RAYS - i;
                assert_int_equal(trace(fog, NEBEL_ISA_DEFAULT, i, part, found), NEBEL_OK);
                i += part;
            }
            assert_same_lights(NEBEL_ISA_DEFAULT);
        }
        nebel_release_snapshot(fog);
    }
}

static nebel_snapshot *boxes_of_fog(int count)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (int i = 0; i < count; i++) {
        nebel_volume_desc v = {.shape = random_shape(NEBEL_SHAPE_BOX), .extinction = {.05, .1, .2}};
        v.shape.transform = (nebel_transform){0};
        assert_int_equal(nebel_add_volume(fog, &v, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

enum { POINTS = 1003 };

static void fill_points(float *xyz, int n)
{
    for (int i = 0; i < 3 * n; i++) xyz[i] = i % 7 == 0 ? floorf((float)dice(-12, 12)) : (float)dice(-12, 12);
    xyz[31] = nanf("");
    xyz[64] = HUGE_VALF;
}

static void test_segment_kernels_are_bit_equal_for_every_stride(void **state)
{
    (void)state;
    static float from[3 * POINTS], to[5 * POINTS], reference[POINTS], out[2 * POINTS];
    for (int round = 0; round < 50; round++) {
        nebel_snapshot *fog = boxes_of_fog(1 + round % 16);
        fill_points(from, POINTS);
        fill_points(to, 5 * POINTS / 3);
        const nebel_segments segments = {.from = round % 2 ? from : NULL, .to = to, .to_stride = round % 3 ? 12 : 20};
        assert_int_equal(
            nebel_compute_segment_transmittance(fog, NEBEL_ISA_SCALAR, round % 3, POINTS, &segments, reference, 4),
            NEBEL_OK);
        for (int i = 0; i < POINTS; i++) assert_true(reference[i] >= 0 && reference[i] <= 1);
        for (nebel_isa isa = NEBEL_ISA_SSE2; isa < NEBEL_ISA_COUNT; isa++)
            for (size_t stride = 4; stride <= 8 && nebel_isa_available(isa); stride += 4) {
                assert_int_equal(
                    nebel_compute_segment_transmittance(fog, isa, round % 3, POINTS, &segments, out, stride), NEBEL_OK);
                for (size_t i = 0; i < POINTS; i++)
                    assert_memory_equal(&out[i * stride / 4], &reference[i], sizeof(float));
            }
        nebel_release_snapshot(fog);
    }
}

/* Points that lie one after the other have a way of their own, in whole packets, with memory asked ahead where there
 * are many. */
static void test_a_segment_gives_the_same_bits_in_any_layout(void **state)
{
    (void)state;
    enum { MANY = 5003 };
    static const size_t counts[] = {1, 15, 17, 33, 150, POINTS, MANY};
    static float packed[3 * MANY], spread[5 * MANY], expected_light[2 * MANY], out[MANY];
    fill_points(packed, MANY);
    for (int i = 0; i < MANY; i++) memcpy(spread + 5 * i, packed + 3 * i, 3 * sizeof(float));
    for (int boxes = 1; boxes <= 6; boxes++) {
        nebel_snapshot *fog = boxes_of_fog(boxes);
        const nebel_segments slow = {.origin = {1.5, -14.25, 9}, .to = spread, .to_stride = 20},
                             fast = {.origin = {1.5, -14.25, 9}, .to = packed};
        assert_int_equal(nebel_compute_segment_transmittance(fog, NEBEL_ISA_SCALAR, 1, MANY, &slow, expected_light, 8),
                         NEBEL_OK);
        for (nebel_isa isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++)
            for (size_t k = 0; k < sizeof counts / sizeof *counts && nebel_isa_available(isa); k++) {
                for (size_t i = 0; i < MANY; i++) out[i] = -7;
                assert_int_equal(nebel_compute_segment_transmittance(fog, isa, 1, counts[k], &fast, out, 0), NEBEL_OK);
                for (size_t i = 0; i < MANY; i++)
                    assert_true(out[i] == (i < counts[k] ? expected_light[2 * i] : -7)); /* never a NaN */
            }
        nebel_release_snapshot(fog);
    }
}

/* The float stream against the march in double: the slab quotients are good to a few roundings of the coordinates. */
static void test_segment_kernel_agrees_with_the_reference(void **state)
{
    (void)state;
    static float to[3 * POINTS], out[POINTS];
    nebel_snapshot *fog = boxes_of_fog(5);
    for (int i = 0; i < 3 * POINTS; i++) to[i] = (float)dice(-15, 15);
    const nebel_segments segments = {.origin = {1.5, -2.25, 20}, .to = to};
    assert_int_equal(nebel_compute_segment_transmittance(fog, NEBEL_ISA_DEFAULT, 1, POINTS, &segments, out, 0),
                     NEBEL_OK);
    for (int i = 0; i < POINTS; i++) {
        nebel_ray ray = {.origin = {1.5, -2.25, 20}};
        double square = 0;
        for (int c = 0; c < 3; c++) {
            ray.direction[c] = (double)to[3 * i + c];
            square += ray.direction[c] * ray.direction[c];
        }
        ray.t_max = sqrt(square);
        nebel_transfer transfer;
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        assert_true(fabs((double)out[i] - transfer.transmittance[1]) < 3e-6);
    }
    nebel_release_snapshot(fog);
}

static void test_dispatch_refuses_what_the_processor_lacks(void **state)
{
    (void)state;
    nebel_snapshot *fog = boxes_of_fog(1);
    int available = 0;
    for (nebel_isa isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        rays[0] = random_ray(1);
        const nebel_result wanted = nebel_isa_available(isa) ? NEBEL_OK : NEBEL_ERROR_UNSUPPORTED;
        available += wanted == NEBEL_OK;
        assert_int_equal(trace(fog, isa, 0, 1, found), wanted);
        printf("%s: %s\n", nebel_isa_name(isa), wanted == NEBEL_OK ? "runs" : "not here");
    }
    assert_true(available >= 1);
    nebel_release_snapshot(fog);
}

int main(int argc, char **argv)
{
    segment_count = argc > 1 ? (size_t)strtoul(argv[1], NULL, 10) : nb_test_count(SEGMENTS);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dispatch_refuses_what_the_processor_lacks),
        cmocka_unit_test(test_instruction_sets_are_bit_equal),
        cmocka_unit_test(test_a_ray_gives_the_same_bits_in_any_company),
        cmocka_unit_test(test_segment_kernels_are_bit_equal_for_every_stride),
        cmocka_unit_test(test_a_segment_gives_the_same_bits_in_any_layout),
        cmocka_unit_test(test_segment_kernel_agrees_with_the_reference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
