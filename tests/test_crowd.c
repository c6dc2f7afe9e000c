/* Very many media over each other: those of constant density are summed in a tree from NB_MIN_OVERLAP_SET on. Their light
 * is that of the closed form between all ends, and neither company nor order changes a bit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "fog_help.h"
#include "fog/snapshot.h"

enum { BALLS = 500, RAYS = 40 };

/* ---- the closed form between all ends -------------------------------------------------------- */

typedef struct shell {
    double radius, extinction, source;
} shell;

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The light of balls around one centre, seen through it from far away. */
static nebel_transfer light_of_shells(const shell *shells, size_t n)
{
    static double ends[2 * BALLS];
    for (size_t i = 0; i < n; i++) {
        ends[2 * i] = -shells[i].radius;
        ends[2 * i + 1] = shells[i].radius;
    }
    qsort(ends, 2 * n, sizeof ends[0], compare_doubles);
    nebel_transfer transfer = {{1, 1, 1}, {0, 0, 0}, 0};
    for (size_t j = 0; j + 1 < 2 * n; j++) {
        const double middle = .5 * (ends[j] + ends[j + 1]);
        double extinction = 0, gain = 0;
        for (size_t i = 0; i < n; i++) {
            if (fabs(middle) > shells[i].radius) continue;
            extinction += shells[i].extinction;
            gain += shells[i].extinction * shells[i].source;
        }
        const double opacity = -expm1(-extinction * (ends[j + 1] - ends[j]));
        transfer.in_scattering[0] += transfer.transmittance[0] * gain / extinction * opacity;
        transfer.transmittance[0] *= 1 - opacity;
    }
    return transfer;
}

static nebel_volume_desc volume_of(const shell *s)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = s->radius},
                               .extinction = {s->extinction},
                               .source = {s->source}};
}

/* Also one less than a crowd, and so many that the tree is full or has one leaf more. */
static void test_media_over_each_other_give_the_closed_form(void **unused)
{
    (void)unused;
    static shell shells[BALLS];
    static nebel_volume_desc volumes[BALLS];
    uint64_t state = 1;
    const size_t counts[] = {NB_MIN_OVERLAP_SET - 1, NB_MIN_OVERLAP_SET, NB_MIN_OVERLAP_SET + 1, 2 * NB_MIN_OVERLAP_SET,
                             BALLS};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        for (size_t i = 0; i < counts[k]; i++) {
            shells[i] = (shell){dice(&state, 1, 10), dice(&state, 0, .4 / (double)counts[k]), dice(&state, 0, 3)};
            volumes[i] = volume_of(&shells[i]);
        }
        const nebel_transfer truth = light_of_shells(shells, counts[k]);
        nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, counts[k]);
        const nebel_ray ray = {{-50, 0, 0}, {1, 0, 0}, 100};
        for (int precision = 0; precision < 2; precision++) {
            nebel_transfer transfer;
            const nebel_trace_desc desc = {.precision = (nebel_precision)precision};
            assert_int_equal(nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
            const double off = fmax(fabs(transfer.transmittance[0] - truth.transmittance[0]),
                                    fabs(transfer.in_scattering[0] - truth.in_scattering[0]));
            assert_true(off <= transfer.error + 1e-14);
            assert_true(off < (precision == 0 ? 1e-13 : 1e-5));
            assert_true(transfer.error < (precision == 0 ? 1e-11 : 1e-2));
        }
        nebel_release_snapshot(snapshot);
    }
}

/* ---- a crowd among other fog ----------------------------------------------------------------- */

enum { PLACES = 8, TWINS = 40, OTHERS = 6 };

/* Fog that no crowd can hold, and what takes fog away. */
static void make_others(nebel_volume_desc others[OTHERS])
{
    others[0] = (nebel_volume_desc){.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 4},
                                    .extinction = {.02, .03, .04},
                                    .source = {.3, .6, .9}};
    others[1] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {-2, 0, 1}, .radius = 4},
                                    .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 2},
                                    .extinction = {.2, .1, .1},
                                    .source = {2, 1, 0}};
    others[2] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, -9, -9}, .max = {-1, 9, 9}},
                                    .operation = NEBEL_OPERATION_EXCLUDE};
    others[3] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {4, 0, 0}, .radius = 1},
                                    .operation = NEBEL_OPERATION_REPLACE,
                                    .priority = 1,
                                    .extinction = {.5, .5, .1},
                                    .source = {0, 2, 0}};
    others[4] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, -2, -2}, .max = {3, 2, 2}},
                                    .priority = -1,
                                    .extinction = {.1, .1, .1},
                                    .source = {1, 1, 1},
                                    .start = 12};
    others[5] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 1, 1}, .radius = 3},
                                    .extinction = {.1, .1, .1},
                                    .emission = {.1, .2, .3}};
}

static nebel_volume_desc ball_at(int where, int count)
{
    const double amount = .01 * (where + 1) * count;
    return (nebel_volume_desc){
        .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {where - 4, .3 * where, -.2 * where}, .radius = 5 - .3 * where},
        .extinction = {amount, .5 * amount, where % 2 * amount},
        .source = {.25 * where, 1, 2 - .25 * where}};
}

/* At each of some places so many balls as one, or one that is as dense as they are together. */
static nebel_snapshot *commit_balls(int twins)
{
    nebel_volume_desc volumes[OTHERS + PLACES * TWINS];
    make_others(volumes);
    for (int i = 0; i < PLACES * twins; i++) volumes[OTHERS + i] = ball_at(i / twins, TWINS / twins);
    return fog_commit(&(nebel_fog_desc){0}, volumes, (size_t)(OTHERS + PLACES * twins));
}

/* Through all balls, through few, through none. */
static void make_rays(nebel_ray rays[RAYS])
{
    uint64_t state = 3;
    for (int i = 0; i < RAYS; i++) {
        rays[i] = (nebel_ray){{-15, dice(&state, -1, 1), dice(&state, -6, 6)},
                              {1, dice(&state, -.5, .5), dice(&state, -.5, .5)},
                              i % 3 == 0 ? HUGE_VAL : dice(&state, 5, 40)};
    }
}

static void test_a_crowd_is_as_one_among_other_fog(void **unused)
{
    (void)unused;
    nebel_snapshot *const crowd = commit_balls(TWINS), *const single = commit_balls(1);
    nebel_ray rays[RAYS];
    nebel_transfer transfers[RAYS], truth[RAYS];
    make_rays(rays);
    const nebel_trace_desc fine = {.tolerance = 1e-9};
    assert_int_equal(nebel_trace(single, &fine, RAYS, rays, sizeof rays[0], truth, sizeof truth[0]), NEBEL_OK);
    for (int precision = 0; precision < 2; precision++) {
        const nebel_trace_desc desc = {.precision = (nebel_precision)precision, .tolerance = 1e-4};
        assert_int_equal(nebel_trace(crowd, &desc, RAYS, rays, sizeof rays[0], transfers, sizeof transfers[0]),
                         NEBEL_OK);
        for (int i = 0; i < RAYS; i++) {
            assert_true(fog_difference(&transfers[i], &truth[i]) <= transfers[i].error + truth[i].error);
            assert_true(transfers[i].error <= 2e-4 + (precision == 0 ? 1e-8 : 1e-4));
        }
    }
    double there[RAYS], wanted[RAYS];
    assert_int_equal(nebel_invert_transmittance(crowd, .8, 1, RAYS, rays, sizeof rays[0], there), NEBEL_OK);
    assert_int_equal(nebel_invert_transmittance(single, .8, 1, RAYS, rays, sizeof rays[0], wanted), NEBEL_OK);
    for (int i = 0; i < RAYS; i++) assert_true(there[i] == wanted[i] || fabs(there[i] - wanted[i]) < 1e-9);
    nebel_release_snapshot(crowd);
    nebel_release_snapshot(single);
}

/* ---- bits ------------------------------------------------------------------------------------ */

/* Balls of different sizes around one centre: rays that pass it farther off meet fewer, down to none. */
static nebel_snapshot *commit_onion(size_t step)
{
    static nebel_volume_desc volumes[BALLS];
    for (size_t i = 0; i < BALLS; i++) {
        const size_t which = i * step % BALLS;
        const shell s = {.01 * (double)(which + 1), .01, (double)which / BALLS};
        volumes[i] = volume_of(&s);
        volumes[i].extinction[1] = .001 * (double)(which % 7);
        volumes[i].source[1] = 1;
    }
    return fog_commit(&(nebel_fog_desc){0}, volumes, BALLS);
}

static void test_neither_company_nor_order_changes_a_bit(void **unused)
{
    (void)unused;
    nebel_snapshot *const onion = commit_onion(1), *const shuffled = commit_onion(7);
    nebel_ray rays[RAYS];
    nebel_transfer alone[RAYS], together[RAYS];
    for (int i = 0; i < RAYS; i++) {
        const double off = 5.2 * (i * 17 % RAYS) / RAYS; /* of 500 balls 0 to 500 */
        rays[i] = (nebel_ray){{-20, off, .001 * i}, {1, 0, 0}, i % 5 ? HUGE_VAL : 21};
    }
    for (int isa = NEBEL_ISA_DEFAULT; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = (nebel_isa)isa};
        nebel_transfer *const now = isa == NEBEL_ISA_DEFAULT ? alone : together;
        for (int i = 0; i < RAYS && isa == NEBEL_ISA_DEFAULT; i++)
            assert_int_equal(nebel_trace(onion, &desc, 1, &rays[i], sizeof rays[0], &alone[i], sizeof alone[0]),
                             NEBEL_OK);
        if (now == alone) continue;
        assert_int_equal(nebel_trace(onion, &desc, RAYS, rays, sizeof rays[0], now, sizeof now[0]), NEBEL_OK);
        assert_memory_equal(alone, together, sizeof alone);
        assert_int_equal(nebel_trace(shuffled, &desc, RAYS, rays, sizeof rays[0], now, sizeof now[0]), NEBEL_OK);
        assert_memory_equal(alone, together, sizeof alone);
    }
    nebel_release_snapshot(onion);
    nebel_release_snapshot(shuffled);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_media_over_each_other_give_the_closed_form),
        cmocka_unit_test(test_a_crowd_is_as_one_among_other_fog),
        cmocka_unit_test(test_neither_company_nor_order_changes_a_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
