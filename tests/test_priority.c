/* Fog that takes the place of other fog: nebel_operation and priorities, by hand and by equivalence, in every query. */
#include "random_fog.h"

#include <math.h>
#include <stdio.h>

#include "fog_help.h"

#include "depth_help.h"

#define ADD(...) slab(NEBEL_OPERATION_ADD, __VA_ARGS__)
#define REPLACE(...) slab(NEBEL_OPERATION_REPLACE, __VA_ARGS__)
#define EXCLUDE(priority, from, to) slab(NEBEL_OPERATION_EXCLUDE, priority, from, to, 0)

static void test_fog_that_replaces_stands_alone_above_lower_priorities(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog[] = {ADD(0, 0, 10, .1), ADD(0, 5, 10, .2), REPLACE(1, 4, 7, .05), ADD(1, 6, 8, .03)};
    assert_depth(fog, 1, .1 * 10);
    assert_depth(fog, 2, .1 * 10 + .2 * 5);
    assert_depth(fog, 3, .1 * 7 + .2 * 3 + .05 * 3);
    assert_depth(fog, 4, .1 * 7 + .2 * 3 + .05 * 3 + .03 * 2);
    assert_depth(fog + 2, 1, .05 * 3);
    assert_depth(fog + 2, 2, .05 * 3 + .03 * 2);
}

static void test_fog_of_one_priority_adds(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog[] = {ADD(3, 0, 10, .1), REPLACE(3, 2, 5, .2), REPLACE(3, 4, 8, .05)};
    assert_depth(fog, 3, .1 * 10 + .2 * 3 + .05 * 4);
}

static void test_exclusions_take_their_own_priority_and_leave_higher_ones(void **unused)
{
    (void)unused;
    const nebel_volume_desc fog[] = {ADD(-2, 0, 10, .1), ADD(0, 0, 10, .2), EXCLUDE(0, 3, 7), ADD(1, 5, 6, .3),
                                     REPLACE(0, 2, 4, .4)};
    assert_depth(fog, 3, .3 * 6);
    assert_depth(fog, 4, .3 * 6 + .3 * 1);
    assert_depth(fog, 5, .3 * 5 + .6 * 1 + .3 * 1);
}

static void test_what_is_replaced_takes_nothing_away_where_it_is_gone(void **unused)
{
    (void)unused;
    /* Both cover the whole of the lowest; the middle one is itself covered from 4 to 6, where nothing changes. */
    const nebel_volume_desc fog[] = {ADD(0, 0, 10, .1), REPLACE(1, 2, 8, .2), REPLACE(2, 4, 6, .05), EXCLUDE(1, 5, 9)};
    assert_depth(fog, 3, .1 * 4 + .2 * 4 + .05 * 2);
    assert_depth(fog, 4, .1 * 3 + .2 * 2 + .05 * 2);
}

/* ---- the same fog said in other ways --------------------------------------------------------- */

enum { RAYS = 64 };

static random_fog fog;

static void trace_all(const nebel_volume_desc *volumes, size_t n, nebel_precision precision,
                      nebel_transfer transfers[RAYS])
{
    nebel_ray rays[RAYS];
    for (uint64_t i = 0; i < RAYS; i++) rays[i] = random_fog_ray(&fog, i);
    const nebel_lighting_desc lights = random_fog_lights(&fog);
    nebel_lighting *const lighting = fog_light(&lights, volumes, n);
    const nebel_trace_desc how = {.precision = precision, .tolerance = 1e-5};
    fog_trace(lighting, how, RAYS, rays, transfers);
    nebel_release_lighting(lighting);
}

static void assert_same_light(const nebel_volume_desc *a, size_t a_count, const nebel_volume_desc *b, size_t b_count)
{
    for (int p = NEBEL_PRECISION_DOUBLE; p <= NEBEL_PRECISION_FLOAT; p++) {
        nebel_transfer first[RAYS], second[RAYS];
        trace_all(a, a_count, (nebel_precision)p, first);
        trace_all(b, b_count, (nebel_precision)p, second);
        for (int i = 0; i < RAYS; i++) {
            const double may = first[i].error + second[i].error;
            for (int c = 0; c < 3; c++) {
                assert_true(fabs(first[i].transmittance[c] - second[i].transmittance[c]) <= may);
                assert_true(fabs(first[i].in_scattering[c] - second[i].in_scattering[c]) <= may);
            }
        }
    }
}

/* A hole in everything below, and ordinary fog above it. */
static void test_to_replace_is_to_exclude_and_add_above(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 300; seed++) {
        nebel_volume_desc both[RANDOM_FOG_VOLUMES + 1];
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 7000 + seed);
        const size_t last = fog.count - 1;
        for (size_t i = 0; i < last; i++) fog.volumes[i].priority = (int)(i % 3);
        fog.volumes[last].operation = NEBEL_OPERATION_REPLACE;
        fog.volumes[last].priority = 2;
        memcpy(both, fog.volumes, fog.count * sizeof *both);
        both[last].operation = NEBEL_OPERATION_ADD;
        both[last + 1] = (nebel_volume_desc){.operation = NEBEL_OPERATION_EXCLUDE,
                                             .priority = 1,
                                             .shape = fog.volumes[last].shape,
                                             .start = fog.volumes[last].start,
                                             .cutoff = fog.volumes[last].cutoff};
        assert_same_light(fog.volumes, fog.count, both, fog.count + 1);
    }
}

/* Where nothing covers, priorities say nothing; where everything has one priority, its number says nothing. */
static void test_priorities_alone_change_nothing(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 200; seed++) {
        nebel_volume_desc plain[RANDOM_FOG_VOLUMES];
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 8000 + 2 * seed);
        memcpy(plain, fog.volumes, fog.count * sizeof *plain);
        for (size_t i = 0; i < fog.count; i++)
            fog.volumes[i].priority = fog.kind == RANDOM_FOG_EXCLUDE ? -7 : (int)(i * 5 % 7) - 3;
        if (fog.kind != RANDOM_FOG_FAR) assert_same_light(fog.volumes, fog.count, plain, fog.count);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fog_that_replaces_stands_alone_above_lower_priorities),
        cmocka_unit_test(test_fog_of_one_priority_adds),
        cmocka_unit_test(test_exclusions_take_their_own_priority_and_leave_higher_ones),
        cmocka_unit_test(test_what_is_replaced_takes_nothing_away_where_it_is_gone),
        cmocka_unit_test(test_to_replace_is_to_exclude_and_add_above),
        cmocka_unit_test(test_priorities_alone_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
