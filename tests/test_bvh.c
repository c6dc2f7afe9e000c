/* The hierarchy against every box tried in long double. */
#include "fog/bvh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

static uint64_t state;

static double uniform(double from, double to)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * (double)(state >> 11) * 0x1p-53;
}

static int below(int n)
{
    return (int)uniform(0, n);
}

typedef struct segment {
    double origin[3], direction[3], t_max;
} segment;

/* Whether a segment touches a box widened by `margin`, from the definition. */
static int touches(const segment *s, const nb_aabb *box, double margin)
{
    long double enter = 0, leave = (long double)s->t_max;
    for (int k = 0; k < 3; k++) {
        const long double o = (long double)s->origin[k], d = (long double)s->direction[k];
        const long double low = (long double)box->low[k] - o - (long double)margin;
        const long double high = (long double)box->high[k] - o + (long double)margin;
        if (s->direction[k] == 0) {
            if (low > 0 || high < 0) return 0;
            continue;
        }
        enter = fmaxl(enter, fminl(low / d, high / d));
        leave = fminl(leave, fmaxl(low / d, high / d));
    }
    return enter <= leave;
}

static void invert(const segment *s, double inverse[3])
{
    for (int k = 0; k < 3; k++) inverse[k] = s->direction[k] == 0 ? 1e30 : 1 / s->direction[k];
}

/* ---- scenes ---------------------------------------------------------------------------------- */

typedef enum scene_kind { CLOUD, FLAT, SAME, NESTED, GRID, LINE, POINT, STICKS, KIND_COUNT } scene_kind;

static nb_aabb random_box(scene_kind kind, int i, double size)
{
    nb_aabb b;
    for (int k = 0; k < 3; k++) {
        const double place = uniform(-size, size), half = uniform(0, .05) * size;
        b.low[k] = place - half;
        b.high[k] = place + half;
        if (kind == FLAT && k == i % 3) b.low[k] = b.high[k];
        if (kind == SAME) b.low[k] = -size / 3, b.high[k] = size / 7;
        if (kind == NESTED) b.low[k] = -size * exp2(-i), b.high[k] = size * exp2(-i);
        if (kind == GRID) b.low[k] = floor(10 * place / size) * size / 8, b.high[k] = b.low[k] + size / 8;
        if (kind == LINE) b.low[k] = b.high[k] = k == 1 ? size * exp2(-i / 4.) : 0;
        if (kind == POINT) b.low[k] = b.high[k] = size / 2;
        if (kind == STICKS && k == i % 3) b.low[k] = -size, b.high[k] = size;
    }
    return b;
}

static void fill_scene(scene_kind kind, int n, double size, double shift, nb_aabb *to)
{
    for (int i = 0; i < n; i++) {
        to[i] = random_box(kind, i, size);
        for (int k = 0; k < 3; k++) {
            to[i].low[k] += shift;
            to[i].high[k] += shift;
        }
    }
}

/* Through the scene, along axes, in faces, from corner to corner, past everything. */
static segment random_segment(const nb_aabb *all, int n, double size, double shift)
{
    segment s;
    const nb_aabb *const a = &all[below(n)], *const b = &all[below(n)];
    const int style = below(6);
    for (int k = 0; k < 3; k++) {
        s.origin[k] = shift + uniform(-2, 2) * size;
        s.direction[k] = uniform(-1, 1);
        const double from = below(2) ? a->low[k] : a->high[k], to = below(2) ? b->low[k] : b->high[k];
        if (style == 1 || style == 2) s.direction[k] = k == (int)(state >> 60) % 3 ? 1 - 2 * below(2) : 0;
        if (style == 2 || style == 3) s.origin[k] = from;  /* in two faces, or starting in a corner */
        if (style == 4) s.direction[k] = to - s.origin[k]; /* through a corner */
        if (style == 5) s.direction[k] = k == below(3) ? 1e-18 : s.direction[k];
    }
    if (fabs(s.direction[0]) + fabs(s.direction[1]) + fabs(s.direction[2]) < 1e-9) s.direction[1] = -1;
    if (style == 2) s.origin[below(3)] -= size; /* behind, in the face */
    const double length =
        sqrt(s.direction[0] * s.direction[0] + s.direction[1] * s.direction[1] + s.direction[2] * s.direction[2]);
    for (int k = 0; k < 3; k++) s.direction[k] /= length;
    const int end = below(8);
    s.t_max = end < 4 ? HUGE_VAL : end == 4 ? 0 : uniform(0, 3) * size;
    return s;
}

/* ---- checks ---------------------------------------------------------------------------------- */

static nebel_allocator heap(void)
{
    return nb_resolve_allocator(&(nebel_allocator){0});
}

enum { MOST = 3000 };
static nb_aabb boxes[MOST];
static int seen[MOST];

/* How far a box may be widened by what the tree knows of it: floats, and the padding at large distances. */
static double hair(const nb_bvh *bvh, const segment *s)
{
    double reach = 0;
    for (int k = 0; k < 3; k++) reach = fmax(reach, fabs(s->origin[k] - bvh->origin[k]));
    return 0x1p-22 * bvh->extent + 1e-14 * (reach + bvh->extent);
}

static void assert_walk_is_right(const nb_bvh *bvh, int n, const segment *segments, int lanes, unsigned active)
{
    for (int i = 0; i < n; i++) {
        int exact = 0, near = 0;
        for (int l = 0; l < lanes; l++) {
            if (!(active >> l & 1)) continue;
            exact = exact || touches(&segments[l], &boxes[i], 0);
            near = near || touches(&segments[l], &boxes[i], hair(bvh, &segments[l]));
        }
        assert_true(seen[i] <= 1);
        if (exact) assert_int_equal(seen[i], 1);
        if (seen[i]) assert_true(near);
    }
}

static void walk_one(const nb_bvh *bvh, int n, const segment *s)
{
    memset(seen, 0, sizeof seen);
    nb_bvh_cursor cursor;
    double inverse[3];
    uint32_t index;
    invert(s, inverse);
    nb_bvh_begin_ray(&cursor, bvh, s->origin, inverse, s->t_max);
    while (nb_bvh_next(&cursor, &index)) {
        assert_true(index < (uint32_t)n);
        seen[index]++;
    }
    assert_walk_is_right(bvh, n, s, 1, 1);
}

static void walk_packet(const nb_bvh *bvh, int n, const segment *segments, int lanes, unsigned active)
{
    double origin[3][NB_BVH_LANES], inverse[3][NB_BVH_LANES], t_max[NB_BVH_LANES];
    memset(seen, 0, sizeof seen);
    for (int l = 0; l < lanes; l++) {
        double i[3];
        invert(&segments[l], i);
        for (int k = 0; k < 3; k++) {
            origin[k][l] = active >> l & 1 ? segments[l].origin[k] : (double)NAN;
            inverse[k][l] = active >> l & 1 ? i[k] : (double)NAN;
        }
        t_max[l] = segments[l].t_max;
    }
    nb_bvh_cursor cursor;
    uint32_t index;
    nb_bvh_begin(&cursor, bvh, lanes, active, (const double(*)[NB_BVH_LANES])origin,
                 (const double(*)[NB_BVH_LANES])inverse, t_max);
    while (nb_bvh_next(&cursor, &index)) {
        assert_true(index < (uint32_t)n);
        seen[index]++;
    }
    assert_walk_is_right(bvh, n, segments, lanes, active);
}

static const double scales[] = {1, 1e-3, 1e5};
static const double shifts[] = {0, 1e7, -3};

static void test_single_rays_find_every_box_they_touch(void **unused)
{
    (void)unused;
    state = 1;
    const nebel_allocator allocator = heap();
    for (int trial = 0; trial < KIND_COUNT * 27; trial++) {
        const int n = trial % 4 == 0 ? 1 + trial % 7 : 400;
        const double size = scales[trial / KIND_COUNT % 3], shift = shifts[trial / KIND_COUNT / 3 % 3];
        nb_bvh bvh;
        fill_scene((scene_kind)(trial % KIND_COUNT), n, size, shift, boxes);
        assert_int_equal(nb_bvh_build(&allocator, boxes, (size_t)n, &bvh), NEBEL_OK);
        for (size_t r = 0; r < nb_test_count(150); r++) {
            const segment s = random_segment(boxes, n, size, shift);
            walk_one(&bvh, n, &s);
        }
        nb_bvh_free(&allocator, &bvh);
    }
}

static void test_rays_from_far_away_find_every_box_they_touch(void **unused)
{
    (void)unused;
    state = 2;
    const nebel_allocator allocator = heap();
    for (int trial = 0; trial < KIND_COUNT * 4; trial++) {
        nb_bvh bvh;
        const int n = 300;
        fill_scene((scene_kind)(trial % KIND_COUNT), n, 1, 0, boxes);
        assert_int_equal(nb_bvh_build(&allocator, boxes, (size_t)n, &bvh), NEBEL_OK);
        for (size_t r = 0; r < nb_test_count(150); r++) {
            segment s = random_segment(boxes, n, 1, 0);
            const double back = pow(10, uniform(1, 8));
            /* The rounded origin shall still see the box's corner exactly along some direction: aim again. */
            for (int k = 0; k < 3; k++) {
                const double target = below(2) ? boxes[r].low[k] : boxes[r].high[k];
                s.origin[k] -= back * s.direction[k];
                if (s.direction[k] != 0) s.direction[k] = (target - s.origin[k]) / back;
            }
            s.t_max = r % 2 ? HUGE_VAL : back;
            walk_one(&bvh, n, &s);
        }
        nb_bvh_free(&allocator, &bvh);
    }
}

static void test_packets_find_every_box_that_an_active_lane_touches(void **unused)
{
    (void)unused;
    state = 3;
    const nebel_allocator allocator = heap();
    for (int trial = 0; trial < KIND_COUNT * 9; trial++) {
        const int n = 300;
        const double size = scales[trial / KIND_COUNT % 3], shift = shifts[trial / KIND_COUNT / 3 % 3];
        nb_bvh bvh;
        fill_scene((scene_kind)(trial % KIND_COUNT), n, size, shift, boxes);
        assert_int_equal(nb_bvh_build(&allocator, boxes, (size_t)n, &bvh), NEBEL_OK);
        for (size_t r = 0; r < nb_test_count(60); r++) {
            segment s[NB_BVH_LANES];
            const int lanes = 1 + below(NB_BVH_LANES), coherent = below(2);
            for (int l = 0; l < lanes; l++) {
                s[l] = random_segment(boxes, n, size, shift);
                if (!coherent || l == 0) continue;
                s[l] = s[0];
                for (int k = 0; k < 3; k++) s[l].direction[k] += k == below(3) ? uniform(-.01, .01) : 0;
            }
            walk_packet(&bvh, n, s, lanes, (unsigned)below(1 << lanes));
        }
        nb_bvh_free(&allocator, &bvh);
    }
}

static void test_a_packet_without_active_lanes_finds_nothing(void **unused)
{
    (void)unused;
    state = 4;
    const nebel_allocator allocator = heap();
    nb_bvh bvh;
    fill_scene(SAME, 10, 1, 0, boxes);
    assert_int_equal(nb_bvh_build(&allocator, boxes, 10, &bvh), NEBEL_OK);
    const segment s = {{0, 0, 0}, {1, 0, 0}, HUGE_VAL};
    walk_packet(&bvh, 10, &s, 1, 0);
    for (int i = 0; i < 10; i++) assert_int_equal(seen[i], 0);
    nb_bvh_free(&allocator, &bvh);
}

static int depth_of(const nb_bvh *bvh, uint32_t node)
{
    const uint32_t index = bvh->nodes[node].index;
    if (index & NB_BVH_LEAF) {
        seen[index & ~NB_BVH_LEAF]++;
        return 0;
    }
    assert_true(index > node && index + 1 < bvh->node_count);
    const int left = depth_of(bvh, index), right = depth_of(bvh, index + 1);
    return 1 + (left > right ? left : right);
}

/* Powers of two down to the smallest float, in six directions in turn: every cut splits off as few as possible. */
static void make_deep_scene(int n)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const double place = exp2(120 - i / 12.5);
            boxes[i].low[k] = k != i % 3 ? 0 : i / 3 % 2 ? place : -place;
            boxes[i].high[k] = boxes[i].low[k];
        }
}

static void test_no_path_is_longer_than_promised_and_every_box_has_one_leaf(void **unused)
{
    (void)unused;
    state = 5;
    const nebel_allocator allocator = heap();
    int deepest = 0;
    for (int trial = 0; trial <= KIND_COUNT; trial++) {
        nb_bvh bvh;
        if (trial < KIND_COUNT)
            fill_scene((scene_kind)trial, MOST, 1, 0, boxes);
        else
            make_deep_scene(MOST);
        memset(seen, 0, sizeof seen);
        assert_int_equal(nb_bvh_build(&allocator, boxes, MOST, &bvh), NEBEL_OK);
        const int depth = depth_of(&bvh, 0);
        deepest = depth > deepest ? depth : deepest;
        assert_true(depth <= NB_BVH_SPLIT_DEPTH + (int)ceil(log2(MOST)));
        for (int i = 0; i < MOST; i++) assert_int_equal(seen[i], 1);
        nb_bvh_free(&allocator, &bvh);
    }
    assert_true(deepest > NB_BVH_SPLIT_DEPTH); /* or the scenes are too tame to test the promise */
}

static void test_boxes_out_of_the_range_of_float_are_found(void **unused)
{
    (void)unused;
    state = 6;
    const nebel_allocator allocator = heap();
    const double sizes[] = {1e45, 1e150, 1e-45, 1e-200};
    for (int i = 0; i < 4; i++) {
        nb_bvh bvh;
        fill_scene(CLOUD, 200, sizes[i], 0, boxes);
        assert_int_equal(nb_bvh_build(&allocator, boxes, 200, &bvh), NEBEL_OK);
        for (int r = 0; r < 200; r++) {
            const segment s = random_segment(boxes, 200, sizes[i], 0);
            nb_bvh_cursor cursor;
            double inverse[3];
            uint32_t index;
            memset(seen, 0, sizeof seen);
            invert(&s, inverse);
            nb_bvh_begin_ray(&cursor, &bvh, s.origin, inverse, s.t_max);
            while (nb_bvh_next(&cursor, &index)) seen[index]++;
            for (int b = 0; b < 200; b++)
                if (touches(&s, &boxes[b], 0)) assert_int_equal(seen[b], 1);
        }
        nb_bvh_free(&allocator, &bvh);
    }
}

static void test_the_same_boxes_give_the_same_tree(void **unused)
{
    (void)unused;
    state = 7;
    const nebel_allocator allocator = heap();
    nb_bvh a, b;
    fill_scene(CLOUD, MOST, 1, 0, boxes);
    assert_int_equal(nb_bvh_build(&allocator, boxes, MOST, &a), NEBEL_OK);
    assert_int_equal(nb_bvh_build(&allocator, boxes, MOST, &b), NEBEL_OK);
    assert_int_equal(a.node_count, b.node_count);
    assert_memory_equal(a.nodes, b.nodes, a.node_count * sizeof *a.nodes);
    nb_bvh_free(&allocator, &a);
    nb_bvh_free(&allocator, &b);
}

static void test_no_boxes_are_an_empty_tree(void **unused)
{
    (void)unused;
    const nebel_allocator allocator = heap();
    nb_bvh bvh;
    nb_bvh_cursor cursor;
    uint32_t index;
    assert_int_equal(nb_bvh_build(&allocator, NULL, 0, &bvh), NEBEL_OK);
    nb_bvh_begin_ray(&cursor, &bvh, (const double[3]){0}, (const double[3]){1, 1e30, 1e30}, HUGE_VAL);
    assert_int_equal(nb_bvh_next(&cursor, &index), 0);
    nb_bvh_free(&allocator, &bvh);
}

static void test_boxes_that_are_none_are_errors(void **unused)
{
    (void)unused;
    const nebel_allocator allocator = heap();
    const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 2};
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++) {
            nb_aabb two[2] = {{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, 1}}};
            two[1].low[k] = bad[i];
            nb_bvh bvh;
            assert_int_equal(nb_bvh_build(&allocator, two, 2, &bvh), NEBEL_ERROR_VALUE);
            assert_null(bvh.nodes);
            assert_int_equal(bvh.node_count, 0);
        }
}

typedef struct meter {
    int until_failure, live;
} meter;

static void *metered_allocate(size_t size, void *user)
{
    meter *const m = user;
    if (m->until_failure-- == 0) return NULL;
    m->live++;
    return malloc(size);
}

static void metered_release(void *memory, void *user)
{
    meter *const m = user;
    m->live--;
    free(memory);
}

static void test_every_failing_allocation_is_an_error_without_a_leak(void **unused)
{
    (void)unused;
    state = 8;
    fill_scene(CLOUD, 100, 1, 0, boxes);
    nebel_result result = NEBEL_ERROR_MEMORY;
    int k = 0;
    for (; result != NEBEL_OK; k++) {
        meter m = {k, 0};
        const nebel_allocator allocator = {metered_allocate, metered_release, &m};
        nb_bvh bvh;
        result = nb_bvh_build(&allocator, boxes, 100, &bvh);
        if (result == NEBEL_OK)
            nb_bvh_free(&allocator, &bvh);
        else
            assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_null(bvh.nodes);
        assert_int_equal(m.live, 0);
    }
    assert_true(k > 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_single_rays_find_every_box_they_touch),
        cmocka_unit_test(test_rays_from_far_away_find_every_box_they_touch),
        cmocka_unit_test(test_packets_find_every_box_that_an_active_lane_touches),
        cmocka_unit_test(test_a_packet_without_active_lanes_finds_nothing),
        cmocka_unit_test(test_no_path_is_longer_than_promised_and_every_box_has_one_leaf),
        cmocka_unit_test(test_boxes_out_of_the_range_of_float_are_found),
        cmocka_unit_test(test_the_same_boxes_give_the_same_tree),
        cmocka_unit_test(test_no_boxes_are_an_empty_tree),
        cmocka_unit_test(test_boxes_that_are_none_are_errors),
        cmocka_unit_test(test_every_failing_allocation_is_an_error_without_a_leak),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
