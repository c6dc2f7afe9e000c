/* Planes give the bits that structures give, whatever rays share, whatever is wanted, and however planes lie in memory.
 */
#include "random_fog.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"

enum { RAYS = 43 };  /* no multiple of any number of lanes */
enum { STRIDE = 5 }; /* of planes with gaps, in numbers */

/* What rays may share, and how they say the rest. */
typedef enum sharing { SHARE_NOTHING, SHARE_ORIGIN, SHARE_DIRECTION, SHARE_END, SHARE_COUNT } sharing;

typedef struct ray_numbers {
    double origin[3], direction[3];
    float offset[3 * STRIDE * RAYS], way[3 * STRIDE * RAYS], t_max[STRIDE * RAYS];
    double fine_way[3 * STRIDE * RAYS];
} ray_numbers;

typedef struct light_numbers {
    float transmittance[3 * STRIDE * RAYS], in_scattering[3 * STRIDE * RAYS], error[STRIDE * RAYS];
} light_numbers;

static const float untouched = -7;

static nebel_lighting *commit(const random_fog *fog)
{
    const nebel_fog_desc desc = random_fog_desc(fog);
    const nebel_lighting_desc lights = random_fog_lights(fog);
    return fog_commit_lit(&desc, fog->volumes, fog->count, &lights);
}

/* A direction that stays one as floats. */
static void set_way(const double direction[3], int fine, double way[3])
{
    const double size = fmax(fabs(direction[0]), fmax(fabs(direction[1]), fabs(direction[2])));
    const int in_range = size > 1e-30 && size < 1e30;
    for (int c = 0; c < 3; c++) {
        const double scaled = in_range ? direction[c] : direction[c] / size;
        way[c] = fine ? direction[c] : (double)(float)scaled;
    }
}

/* Random rays as floats in planes, and the same as structures. */
static void make_rays(const random_fog *fog, sharing shared, int fine, size_t stride, ray_numbers *numbers,
                      nebel_ray rays[RAYS])
{
    const nebel_ray first = random_fog_ray(fog, 1000 + fog->seed);
    memcpy(numbers->origin, first.origin, sizeof numbers->origin);
    memcpy(numbers->direction, first.direction, sizeof numbers->direction);
    for (size_t i = 0; i < RAYS; i++) {
        rays[i] = random_fog_ray(fog, i);
        double way[3];
        set_way(rays[i].direction, fine, way);
        for (size_t c = 0; c < 3; c++) {
            const size_t at = c * STRIDE * RAYS + stride * i;
            numbers->offset[at] = (float)(rays[i].origin[c] - first.origin[c]);
            numbers->way[at] = (float)way[c];
            numbers->fine_way[at] = way[c];
            rays[i].origin[c] = first.origin[c] + (shared == SHARE_ORIGIN ? 0 : (double)numbers->offset[at]);
            rays[i].direction[c] = shared == SHARE_DIRECTION ? first.direction[c] : way[c];
        }
        numbers->t_max[stride * i] = (float)rays[i].t_max;
        rays[i].t_max = shared == SHARE_END ? HUGE_VAL : (double)numbers->t_max[stride * i];
    }
}

static nebel_ray_planes planes_of(const ray_numbers *numbers, sharing shared, int fine, size_t stride)
{
    nebel_ray_planes planes = {.offset_stride = stride * sizeof(float),
                               .direction_stride = stride * (fine ? sizeof(double) : sizeof(float)),
                               .t_max_stride = stride * sizeof(float)};
    if (stride == 1) planes.offset_stride = planes.direction_stride = planes.t_max_stride = 0;
    memcpy(planes.origin, numbers->origin, sizeof planes.origin);
    memcpy(planes.direction, numbers->direction, sizeof planes.direction);
    for (int c = 0; c < 3; c++) {
        if (shared != SHARE_ORIGIN) planes.offset[c] = numbers->offset + c * STRIDE * RAYS;
        if (shared == SHARE_DIRECTION) continue;
        if (fine)
            planes.direction_double[c] = numbers->fine_way + c * STRIDE * RAYS;
        else
            planes.direction_float[c] = numbers->way + c * STRIDE * RAYS;
    }
    if (shared != SHARE_END) planes.t_max = numbers->t_max;
    return planes;
}

static nebel_transfer_planes lights_of(light_numbers *numbers, int wants_light, int wants_error, size_t stride)
{
    nebel_transfer_planes planes = {.transmittance_stride = stride * sizeof(float),
                                    .in_scattering_stride = stride == 1 ? 0 : stride * sizeof(float),
                                    .error_stride = stride * sizeof(float)};
    for (int c = 0; c < 3; c++) {
        planes.transmittance[c] = numbers->transmittance + c * STRIDE * RAYS;
        planes.in_scattering[c] = wants_light ? numbers->in_scattering + c * STRIDE * RAYS : NULL;
    }
    planes.error = wants_error ? numbers->error : NULL;
    for (size_t i = 0; i < sizeof *numbers / sizeof(float); i++) ((float *)numbers)[i] = untouched;
    return planes;
}

/* A NaN is equal to nothing. */
static int is(float found, double expected)
{
    return (double)found == expected;
}

static int is_same_light(const light_numbers *found, size_t at, int wants_light, int wants_error,
                         const nebel_transfer *expected)
{
    int same = is(found->error[at], wants_error ? expected->error : (double)untouched);
    for (size_t c = 0; c < 3; c++) {
        const size_t k = c * STRIDE * RAYS + at;
        same = same && is(found->transmittance[k], expected->transmittance[c]) &&
               is(found->in_scattering[k], wants_light ? expected->in_scattering[c] : (double)untouched);
    }
    return same;
}

/* What is no element of a ray is as it was. */
static void assert_gaps_are_untouched(const float *plane, size_t stride, size_t n)
{
    for (size_t i = 0; i < (size_t)STRIDE * RAYS; i++)
        if (i % stride != 0 || i / stride >= n) assert_true(is(plane[i], (double)untouched));
}

static void compare(const random_fog *fog, const nebel_lighting *lighting, sharing shared, uint64_t variant)
{
    static ray_numbers numbers;
    static light_numbers found;
    const int fine = (int)(variant & 1), wants_light = (variant & 2) != 0, wants_error = (variant & 4) != 0;
    const size_t stride = variant & 8 ? STRIDE : 1, n = RAYS - (size_t)((variant >> 4) % 11);
    nebel_ray rays[RAYS];
    nebel_transfer expected[RAYS];
    make_rays(fog, shared, fine, stride, &numbers, rays);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    nebel_trace_desc desc = {.lighting = lighting,
                             .precision = NEBEL_PRECISION_FLOAT,
                             .isa = NEBEL_ISA_SCALAR,
                             .tolerance = 1e-4,
                             .transmittance_only = !wants_light};
    const nebel_result wanted = nebel_trace(snapshot, &desc, n, rays, sizeof *rays, expected, sizeof *expected);
    const nebel_ray_planes from = planes_of(&numbers, shared, fine, stride);
    for (desc.isa = NEBEL_ISA_SCALAR; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
        if (!nebel_isa_available(desc.isa)) continue;
        const nebel_transfer_planes to = lights_of(&found, wants_light, wants_error, stride);
        assert_int_equal(nebel_trace_planes(snapshot, &desc, n, &from, &to), wanted);
        for (size_t i = 0; i < n && wanted == NEBEL_OK; i++) {
            if (is_same_light(&found, stride * i, wants_light, wants_error, &expected[i])) continue;
            const float *t = found.transmittance + stride * i, *s = found.in_scattering + stride * i;
            printf("\n%s, seed %zu, ray %zu, shares %d, variant %zu: T %.9g S %.9g error %.9g, not %.9g %.9g %.9g\n",
                   nebel_isa_name(desc.isa), (size_t)fog->seed, i, (int)shared, (size_t)variant, (double)t[0],
                   (double)s[0], (double)found.error[stride * i], expected[i].transmittance[0],
                   expected[i].in_scattering[0], expected[i].error);
            random_fog_print(stdout, fog, &rays[i]);
            fail();
        }
        assert_gaps_are_untouched(found.transmittance, stride, n);
    }
}

static void test_planes_give_the_bits_of_structures(void **state)
{
    (void)state;
    static random_fog fog;
    uint64_t variant = 0;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        /* single volumes have a way of their own */
        const uint64_t rounds = kind == RANDOM_FOG_SINGLE ? 4000 : 120;
        for (uint64_t seed = 0; seed < rounds; seed++) {
            random_fog_make(&fog, (random_fog_kind)kind, seed);
            nebel_lighting *lighting = commit(&fog);
            for (int shared = 0; shared < SHARE_COUNT; shared++) compare(&fog, lighting, (sharing)shared, variant += 5);
            nebel_release_lighting(lighting);
        }
    }
}

/* ---- what is wrong --------------------------------------------------------------------------- */

static nebel_snapshot *one_box(void)
{
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -9}, .max = {1, 1, -1}},
                                   .extinction = {1, 1, 1}};
    return fog_commit(&(nebel_fog_desc){0}, &box, 1);
}

static void test_odd_strides_and_unknown_precisions_are_refused(void **state)
{
    (void)state;
    nebel_snapshot *fog = one_box();
    const nebel_ray rays[2] = {{.direction = {0, 0, -1}}, {.direction = {0, 0, -1}}};
    nebel_transfer transfers[2];
    const nebel_trace_desc unknown = {.precision = (nebel_precision)7};
    const size_t odd = sizeof *rays + 1;
    double distances[2];
    assert_int_equal(nebel_trace(fog, NULL, 2, rays, odd, transfers, sizeof *transfers), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace(fog, NULL, 2, rays, sizeof *rays, transfers, 3), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_invert_transmittance(fog, 0.5, 0, 2, rays, odd, distances), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace(fog, &unknown, 2, rays, sizeof *rays, transfers, sizeof *transfers),
                     NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace(fog, NULL, 2, rays, sizeof *rays, transfers, sizeof *transfers), NEBEL_OK);
    nebel_release_snapshot(fog);
}

static void test_faults_are_named(void **state)
{
    (void)state;
    nebel_snapshot *fog = one_box();
    const float zero[RAYS] = {0}, one[RAYS] = {1};
    float out[RAYS];
    const nebel_transfer_planes to = {.transmittance = {out}};
    const nebel_ray_planes faults[] = {
        {.direction = {0, 0, 0}},
        {.direction = {0, (double)NAN, 0}},
        {.direction = {0, 0, HUGE_VAL}},
        {.direction = {0, 0, 1}, .origin = {0, 2e15, 0}},
        {.direction = {0, 0, 1}, .origin = {(double)NAN, 0, 0}},
        {.direction = {0, 0, 1}, .offset = {zero, NULL, zero}},
        {.direction_float = {one, one, NULL}},
        {.direction_float = {one, one, one},
         .direction_double = {(const double[RAYS]){1}, (const double[RAYS]){1}, (const double[RAYS]){1}}},
        {.direction = {0, 0, 1}, .t_max = one, .t_max_stride = 3},
        {.direction_double = {(const double[RAYS]){1}, (const double[RAYS]){1}, (const double[RAYS]){1}},
         .direction_stride = 4},
    };
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++)
        assert_int_equal(nebel_trace_planes(fog, NULL, 1, &faults[i], &to), NEBEL_ERROR_ARGUMENT);
    const nebel_ray_planes right = {.direction = {0, 0, -1}};
    assert_int_equal(nebel_trace_planes(NULL, NULL, 1, &right, &to), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_planes(fog, NULL, 1, NULL, &to), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_planes(fog, NULL, 1, &right, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_planes(fog, &(nebel_trace_desc){.tolerance = (double)NAN}, 1, &right, &to),
                     NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_planes(fog, NULL, 1, &right, &(nebel_transfer_planes){0}), NEBEL_OK);
    assert_int_equal(nebel_trace_planes(fog, NULL, 0, &right, &to), NEBEL_OK);
    assert_int_equal(nebel_trace_planes(fog, NULL, RAYS, &right, &to), NEBEL_OK);
    for (int i = 0; i < RAYS; i++) assert_true(fabs((double)out[i] - exp(-8)) < 1e-9);
    nebel_release_snapshot(fog);
}

static void test_a_ray_that_is_none_is_found(void **state)
{
    (void)state;
    nebel_snapshot *fog = one_box();
    const float wrong[] = {NAN, HUGE_VALF, 3e15f};
    for (size_t bad = 0; bad < RAYS; bad++) {
        for (int what = 0; what < 8; what++) {
            float offset[RAYS] = {0}, t_max[RAYS], way[3][RAYS], out[RAYS];
            for (size_t i = 0; i < RAYS; i++) {
                t_max[i] = 5;
                for (int c = 0; c < 3; c++)
                    way[c][i] = c == 2 ? -1 : 1e-20f; /* rays with long and short ways are right */
                if (i % 9 == 4) way[2][i] = -1e-42f;
            }
            if (what < 3) offset[bad] = wrong[what];
            if (what == 3) t_max[bad] = NAN;
            if (what == 4) t_max[bad] = -1;
            if (what == 5) way[0][bad] = way[1][bad] = way[2][bad] = 0;
            if (what >= 6) way[1][bad] = wrong[what - 6];
            const nebel_ray_planes from = {
                .offset = {offset, offset, offset}, .direction_float = {way[0], way[1], way[2]}, .t_max = t_max};
            size_t failed = RAYS;
            const nebel_trace_desc desc = {.failed_ray = &failed};
            assert_int_equal(
                nebel_trace_planes(fog, &desc, RAYS, &from, &(nebel_transfer_planes){.transmittance = {out}}),
                NEBEL_ERROR_ARGUMENT);
            assert_int_equal(failed, bad);
        }
    }
    nebel_release_snapshot(fog);
}

/* Whatever the march would do with it. */
static void compare_masked(const random_fog *fog, const nebel_lighting *lighting, sharing shared, int wants_error)
{
    static ray_numbers numbers;
    static light_numbers masked, plain;
    nebel_ray rays[RAYS];
    const size_t first = (size_t)(fog->seed % 5);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    const nebel_trace_desc desc = {.lighting = lighting};
    make_rays(fog, shared, 0, 1, &numbers, rays);
    for (size_t i = first; i < RAYS; i += 5) numbers.t_max[i] = 0;
    const nebel_ray_planes from = planes_of(&numbers, shared, 0, 1);
    const nebel_transfer_planes to = lights_of(&plain, 1, wants_error, 1);
    assert_int_equal(nebel_trace_planes(snapshot, &desc, RAYS, &from, &to), NEBEL_OK);
    for (size_t i = first; i < RAYS; i += 5) {
        numbers.offset[i] = NAN;
        numbers.way[i] = i % 2 ? HUGE_VALF : 0;
        for (size_t c = 1; c < 3; c++) numbers.way[c * STRIDE * RAYS + i] = 0;
        assert_true(is(plain.transmittance[i], 1) && is(plain.in_scattering[i], 0));
    }
    const nebel_transfer_planes to_masked = lights_of(&masked, 1, wants_error, 1);
    assert_int_equal(nebel_trace_planes(snapshot, &desc, RAYS, &from, &to_masked), NEBEL_OK);
    assert_memory_equal(&masked, &plain, sizeof plain);
}

static void test_a_ray_of_no_length_may_be_anything(void **state)
{
    (void)state;
    static random_fog fog;
    for (uint64_t seed = 0; seed < 300; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), seed);
        nebel_lighting *lighting = commit(&fog);
        for (int shared = 0; shared < SHARE_END; shared++)
            compare_masked(&fog, lighting, (sharing)shared, seed % 2 != 0);
        nebel_release_lighting(lighting);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_planes_give_the_bits_of_structures),
        cmocka_unit_test(test_faults_are_named),
        cmocka_unit_test(test_odd_strides_and_unknown_precisions_are_refused),
        cmocka_unit_test(test_a_ray_that_is_none_is_found),
        cmocka_unit_test(test_a_ray_of_no_length_may_be_anything),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
