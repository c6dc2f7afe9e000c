/* Clouds through pixels between others: who has rays, and what the others have. */
#include "aerial/cloud_pixels.h"

#include "unit.h"

#include <string.h>

enum { COLUMNS = NB_CLOUD_PIXELS_COLUMNS, ROWS = NB_CLOUD_PIXELS_ROWS, ALL = NB_CLOUD_SHARE };

static int at(int x, int y)
{
    return y * COLUMNS + x;
}

typedef struct picture {
    nb_cloud_pixel_block block;
    nebel_cloud_transfer nodes[ALL], truth[ALL];
    int is_asked[ALL];
} picture;

/* A wall of cloud from 1 km on, so deep, so bright, and its light red. */
static nebel_cloud_transfer wall(float left, float light)
{
    return (nebel_cloud_transfer){.count = 3,
                                  .t = {1000, 1200, 1400},
                                  .transmittance = {1, .5f * (1 + left), left},
                                  .in_scattering = {{0}, {.5f * light}, {light}},
                                  .error = 1e-3f,
                                  .density_queries = 20};
}

static void begin(picture *p)
{
    memset(p, 0, sizeof *p);
    for (int i = 0; i < ALL; i++) {
        p->block.is_wanted[i] = p->block.is_open[i] = 1;
        p->block.nodes[i] = &p->nodes[i];
        p->truth[i] = wall(.2f, 1);
    }
}

/* As renderers do. Returns how many rays there were. */
static int trace(picture *p)
{
    int count = 0;
    nb_cloud_pixels_block_begin(&p->block);
    for (int level = 0; level < NB_CLOUD_PIXELS_LEVELS; level++) {
        int is_asked[ALL];
        nb_cloud_pixels_block_ask(&p->block, level, is_asked);
        for (int i = 0; i < ALL; i++) {
            if (!is_asked[i]) continue;
            p->nodes[i] = p->truth[i];
            p->is_asked[i] = 1;
            count++;
        }
    }
    return count;
}

static void assert_same(const nebel_cloud_transfer *a, const nebel_cloud_transfer *b)
{
    assert_int_equal(a->count, b->count);
    for (uint32_t k = 0; k < a->count; k++) {
        assert_float_equal(a->t[k], b->t[k], 0);
        assert_float_equal(a->transmittance[k], b->transmittance[k], 1e-7);
        for (int c = 0; c < 3; c++) assert_float_equal(a->in_scattering[k][c], b->in_scattering[k][c], 1e-7);
    }
}

static void test_even_clouds_need_a_quarter_of_rays(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    /* A quarter, and at the left and the right border of each row at most two more. */
    assert_in_range(trace(&p), ALL / 4, ALL / 4 + 2 * ROWS);
    for (int i = 0; i < ALL; i++) {
        assert_same(&p.nodes[i], &p.truth[i]);
        assert_true(p.nodes[i].error >= p.truth[i].error);
    }
}

static void test_slopes_are_kept(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    for (int i = 0; i < ALL; i++) {
        const float x = (float)(i % COLUMNS), y = (float)(i / COLUMNS);
        p.truth[i] = wall(.2f + .002f * x + .001f * y, 1 + .01f * x - .005f * y);
    }
    assert_true(trace(&p) < ALL / 2);
    for (int i = 0; i < ALL; i++) {
        assert_float_equal(p.nodes[i].transmittance[2], p.truth[i].transmittance[2], 1e-6);
        assert_float_equal(p.nodes[i].in_scattering[2][0], p.truth[i].in_scattering[2][0], 1e-6);
    }
}

static void test_edges_have_rays(void **state)
{
    (void)state;
    static picture p;
    for (int x = 8; x < 16; x++) {
        begin(&p);
        for (int i = 0; i < ALL; i++)
            if (i % COLUMNS < x) p.truth[i] = wall(.6f, 1);
        trace(&p);
        for (int i = 0; i < ALL; i++) assert_same(&p.nodes[i], &p.truth[i]);
        begin(&p);
        for (int i = 0; i < ALL; i++)
            if (i % COLUMNS < x) p.truth[i] = wall(.2f, .8f);
        trace(&p);
        for (int i = 0; i < ALL; i++) assert_same(&p.nodes[i], &p.truth[i]);
    }
}

/* Wherever it is, a puff as wide as a pixel is seen, unless all rays around say that no cloud is near. */
static void test_puffs_beside_clear_rays_are_seen(void **state)
{
    (void)state;
    static picture p;
    for (int puff = 0; puff < ALL; puff++)
        for (uint32_t looks = 0; looks < 2; looks++) {
            begin(&p);
            for (int i = 0; i < ALL; i++) p.truth[i] = (nebel_cloud_transfer){.density_queries = looks};
            p.truth[puff] = wall(.2f, 1);
            const int count = trace(&p);
            assert_true(looks == 1 ? count == ALL : count < ALL / 2);
            assert_true(looks == 0 || p.nodes[puff].count == 3);
        }
}

static void test_surfaces_have_rays(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    p.block.is_open[at(20, 1)] = 0;
    p.block.is_wanted[at(40, 2)] = 0;
    trace(&p);
    for (int y = 0; y < 3; y++)
        for (int x = 19; x < 22; x++) assert_true(p.is_asked[at(x, y)]);
    assert_false(p.is_asked[at(40, 2)]);
    assert_true(p.is_asked[at(39, 2)] && p.is_asked[at(41, 2)]);
}

/* Two walls, of which one begins and ends before the other. */
static void test_mean_is_between(void **state)
{
    (void)state;
    nebel_cloud_transfer a = wall(.2f, 1), b = wall(.22f, 1.02f);
    for (int k = 0; k < 3; k++) b.t[k] += 100;
    const nebel_cloud_transfer mean = nb_cloud_pixels_mean(&a, &b), clear = {.density_queries = 3},
                               half = nb_cloud_pixels_mean(&clear, &a);
    assert_int_equal(mean.count, 3);
    assert_true(mean.t[0] == 1000 && mean.t[2] == 1500);
    assert_true(mean.transmittance[0] == 1 && mean.in_scattering[0][0] == 0);
    assert_float_equal(mean.transmittance[1], .5f * (.6f + .805f), 1e-6);
    assert_float_equal(mean.transmittance[2], .21, 1e-6);
    assert_float_equal(mean.in_scattering[2][0], 1.01, 1e-6);
    assert_float_equal(half.transmittance[2], .6, 1e-6);
    assert_float_equal(half.in_scattering[2][0], .5, 1e-6);
    assert_int_equal(nb_cloud_pixels_mean(&clear, &clear).count, 0);
}

/* Seen aslant from far above, the next row's sheet lies farther off than it is deep, as does the ground below it. Each pixel has its
 * own where it is, before its ground. */
static void test_sheets_lie_over_the_ground(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    for (int i = 0; i < ALL; i++) {
        const float ground = 1e6f / (1.2f + .04f * (float)(i / COLUMNS) + 1e-4f * (float)(i % COLUMNS));
        p.block.ground[i] = ground;
        for (int k = 0; k < 3; k++) p.truth[i].t[k] = ground * (.992f + .001f * (float)k);
    }
    assert_true(trace(&p) < ALL / 2);
    for (int i = 0; i < ALL; i++) {
        assert_int_equal(p.nodes[i].count, 3);
        for (int k = 0; k < 3; k++) assert_float_equal(p.nodes[i].t[k], p.truth[i].t[k], 1);
    }
}

/* What stands before it stays there, however far the ground is. */
static void test_heaps_stand_before_the_ground(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    for (int i = 0; i < ALL; i++) p.block.ground[i] = 1e5f / (1 + .2f * (float)(i / COLUMNS));
    assert_true(trace(&p) < ALL / 2);
    for (int i = 0; i < ALL; i++) assert_same(&p.nodes[i], &p.truth[i]);
}

/* Beside the planet's edge all have rays. */
static void test_the_edge_of_the_ground_has_rays(void **state)
{
    (void)state;
    static picture p;
    begin(&p);
    for (int i = 0; i < ALL; i++) p.block.ground[i] = i / COLUMNS < 2 ? 0 : 2e6f;
    trace(&p);
    for (int y = 1; y < 3; y++)
        for (int x = 0; x < COLUMNS; x++) assert_true(p.is_asked[at(x, y)]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_even_clouds_need_a_quarter_of_rays),
        cmocka_unit_test(test_slopes_are_kept),
        cmocka_unit_test(test_edges_have_rays),
        cmocka_unit_test(test_puffs_beside_clear_rays_are_seen),
        cmocka_unit_test(test_surfaces_have_rays),
        cmocka_unit_test(test_mean_is_between),
        cmocka_unit_test(test_sheets_lie_over_the_ground),
        cmocka_unit_test(test_heaps_stand_before_the_ground),
        cmocka_unit_test(test_the_edge_of_the_ground_has_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
