/* Noise as voxels: that it drifts by what it is told and becomes another in time, is what voxels can show, and a density. */
#include "fog_help.h"
#include "near.h"

#include <nebel/nebel.h>

enum { NOISE_SIDE = 24 };

static nebel_snapshot *noise_fog(const nebel_noise_desc *desc)
{
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {NOISE_SIDE, NOISE_SIDE, NOISE_SIDE}},
                           .density = {.type = NEBEL_DENSITY_GRID},
                           .extinction = {1, 1, 1}};
    assert_int_equal(nebel_create_noise_grid(desc, &v.density.grid), NEBEL_OK);
    nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &v, 1);
    nebel_release_grid(v.density.grid);
    return fog;
}

/* Of the voxel with these indices. */
static double noise_at(const nebel_snapshot *fog, int x, int y, int z)
{
    nebel_medium_properties matter;
    const nebel_sample_point place = {{x + .5, y + .5, z + .5}, -1};
    assert_int_equal(nebel_sample_medium(fog, 1, &place, sizeof place, &matter, sizeof matter), NEBEL_OK);
    return matter.extinction[0];
}

/* The largest and the mean difference of all voxels, the second fog's moved by some of them along x. */
static void compare_noise(const nebel_noise_desc *a, const nebel_noise_desc *b, int moved, double *most, double *mean)
{
    nebel_snapshot *first = noise_fog(a), *second = noise_fog(b);
    *most = *mean = 0;
    for (int x = 0; x + moved < NOISE_SIDE; x++)
        for (int y = 0; y < NOISE_SIDE; y++)
            for (int z = 0; z < NOISE_SIDE; z++) {
                const double off = fabs(noise_at(first, x, y, z) - noise_at(second, x + moved, y, z));
                *most = fmax(*most, off);
                *mean += off / ((NOISE_SIDE - moved) * NOISE_SIDE * NOISE_SIDE);
            }
    nebel_release_snapshot(first);
    nebel_release_snapshot(second);
}

static const nebel_noise_desc plain_noise = {
    .size = {NOISE_SIDE, NOISE_SIDE, NOISE_SIDE}, .frequency = {3, 2, 4}, .octaves = 2, .seed = 5};

static void it_drifts_and_changes(void **test)
{
    double most, mean;
    nebel_noise_desc other = plain_noise;
    (void)test;
    other.offset[0] = 5 * 3. / NOISE_SIDE; /* five voxels, in cells */
    compare_noise(&plain_noise, &other, 5, &most, &mean);
    assert_true(most <= 2. / 65535);
    compare_noise(&plain_noise, &other, 0, &most, &mean);
    assert_true(mean > .03);
    other = plain_noise;
    other.time = 1e-3;
    compare_noise(&plain_noise, &other, 0, &most, &mean);
    assert_true(most < 1e-2);
    other.time = 1;
    compare_noise(&plain_noise, &other, 0, &most, &mean);
    assert_true(mean > .05);
    other = plain_noise;
    other.seed = 6;
    compare_noise(&plain_noise, &other, 0, &most, &mean);
    assert_true(mean > .05);
}

/* Octaves that voxels do not show are not there: neighbours differ by no more than the finest cells allow. */
static void it_is_limited_to_what_voxels_show(void **test)
{
    double most, mean;
    nebel_noise_desc other = plain_noise;
    (void)test;
    other.octaves = 16;
    compare_noise(&plain_noise, &other, 0, &most, &mean);
    assert_true(most == 0); /* a third octave would have 16 cells along 24 voxels */
    other.octaves = 1;
    nebel_snapshot *fog = noise_fog(&other);
    for (int x = 0; x + 1 < NOISE_SIDE; x++) /* the smooth step is 15 / 8 steep at most */
        assert_true(fabs(noise_at(fog, x, 7, 9) - noise_at(fog, x + 1, 7, 9)) <= 15. / 8 * 3 / NOISE_SIDE + 1e-4);
    nebel_release_snapshot(fog);
}

/* Slopes have no favourite among directions: of those that point anywhere the fourth powers of the parts along the axes
 * make 3/5 of the fourth power of all, of those along axes 1. A lattice of cells with values at their corners has 0.79
 * here. Waves of twelve voxels, so that differences are slopes. */
static void no_axis_shows(void **test)
{
    (void)test;
    for (int octaves = 1; octaves <= 2; octaves++) {
        double parts = 0, all = 0;
        const double cells = octaves == 1 ? 4 : 2;
        for (uint32_t seed = 0; seed < 20; seed++) {
            const nebel_noise_desc desc = {.size = {NOISE_SIDE, NOISE_SIDE, NOISE_SIDE},
                                           .frequency = {cells, cells, cells},
                                           .octaves = octaves,
                                           .gain = 1,
                                           .seed = seed};
            nebel_snapshot *fog = noise_fog(&desc);
            for (int x = 1; x + 1 < NOISE_SIDE; x++)
                for (int y = 1; y + 1 < NOISE_SIDE; y++)
                    for (int z = 1; z + 1 < NOISE_SIDE; z++) {
                        const double slope[3] = {noise_at(fog, x + 1, y, z) - noise_at(fog, x - 1, y, z),
                                                 noise_at(fog, x, y + 1, z) - noise_at(fog, x, y - 1, z),
                                                 noise_at(fog, x, y, z + 1) - noise_at(fog, x, y, z - 1)};
                        double square = 0;
                        for (int i = 0; i < 3; i++) {
                            square += slope[i] * slope[i];
                            parts += slope[i] * slope[i] * slope[i] * slope[i];
                        }
                        all += square * square;
                    }
            nebel_release_snapshot(fog);
        }
        assert_near(parts / all, .6, .03);
    }
}

static void it_is_a_density(void **test)
{
    (void)test;
    double sum = 0, covered = 0, least = 1, most = 0;
    nebel_noise_desc desc = plain_noise;
    nebel_snapshot *fog = noise_fog(&desc);
    desc.coverage = .5;
    desc.falloff[1] = .25;
    nebel_snapshot *wisps = noise_fog(&desc);
    for (int x = 0; x < NOISE_SIDE; x++)
        for (int y = 0; y < NOISE_SIDE; y++)
            for (int z = 0; z < NOISE_SIDE; z++) {
                const double all = noise_at(fog, x, y, z), some = noise_at(wisps, x, y, z);
                sum += all;
                covered += some > 0;
                least = fmin(least, all);
                most = fmax(most, all);
                assert_true(some <= all);
                if (y > NOISE_SIDE / 4 && y < NOISE_SIDE * 3 / 4 - 1)
                    assert_near(some, fmax(2 * all - 1, 0), 3. / 65535);
            }
    const double count = NOISE_SIDE * NOISE_SIDE * NOISE_SIDE;
    assert_true(least >= 0 && least < .2 && most <= 1 && most > .8);
    assert_near(sum / count, .5, .1);
    assert_true(covered / count > .2 && covered / count < .8);
    assert_true(noise_at(wisps, 3, 0, 3) < .02);
    nebel_release_snapshot(fog);
    nebel_release_snapshot(wisps);
}

static void bad_numbers_are_refused(void **test)
{
    (void)test;
    struct {
        nebel_noise_desc desc;
        nebel_result result;
        const char *word;
    } cases[] = {
        {{.size = {0, 8, 8}, .frequency = {1, 1, 1}}, NEBEL_ERROR_LIMIT, "0 x 8 x 8 voxels"},
        {{.size = {4096, 4096, 4}, .frequency = {1, 1, 1}}, NEBEL_ERROR_LIMIT, "at most 8388608 in all"},
        {{.size = {8, 8, 8}, .frequency = {1, 0, 1}}, NEBEL_ERROR_VALUE, "cells is 0"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 4.5}}, NEBEL_ERROR_VALUE, "of two voxels each at least"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .octaves = 17}, NEBEL_ERROR_VALUE, "octaves is 17"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .gain = 1.5}, NEBEL_ERROR_VALUE, "gain is 1.5"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .coverage = -1}, NEBEL_ERROR_VALUE, "coverage is -1"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .falloff = {0, 0, .6}}, NEBEL_ERROR_VALUE, "edge is 0.6"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .offset = {2e9}}, NEBEL_ERROR_VALUE, "offset is 2e+09"},
        {{.size = {8, 8, 8}, .frequency = {1, 1, 1}, .time = (double)NAN}, NEBEL_ERROR_VALUE, "time is nan"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fog_messages messages = {0};
        nebel_grid *grid = (nebel_grid *)&messages;
        cases[i].desc.host.log = fog_messages_log(&messages);
        assert_int_equal(nebel_create_noise_grid(&cases[i].desc, &grid), cases[i].result);
        assert_null(grid);
        if (strstr(messages.text, cases[i].word) == NULL) fail_msg("case %zu says: %s", i, messages.text);
    }
    nebel_grid *grid = NULL;
    const nebel_noise_desc half = {
        .size = {8, 8, 8}, .frequency = {1, 1, 1}, .host.allocator = {.release = fog_memory_release}};
    assert_int_equal(nebel_create_noise_grid(&half, &grid), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_noise_grid(NULL, NULL), NEBEL_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_drifts_and_changes),   cmocka_unit_test(it_is_limited_to_what_voxels_show),
        cmocka_unit_test(no_axis_shows),           cmocka_unit_test(it_is_a_density),
        cmocka_unit_test(bad_numbers_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
