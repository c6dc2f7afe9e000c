/* Bounds of convex bodies against corners found by trying all triples of planes in long double. */
#include "medium/convex.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "unit.h"

enum { MOST = 1024 };

static uint64_t state = 20260101;

static double uniform(double from, double to)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * (double)(state >> 11) * 0x1p-53;
}

static void random_unit(double v[3])
{
    double length;
    do {
        for (int k = 0; k < 3; k++) v[k] = uniform(-1, 1);
        length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    } while (length > 1 || length < .01);
    for (int k = 0; k < 3; k++) v[k] /= length;
}

static void set_plane(double plane[4], double x, double y, double z, double d)
{
    const double length = sqrt(x * x + y * y + z * z);
    plane[0] = x / length;
    plane[1] = y / length;
    plane[2] = z / length;
    plane[3] = d / length;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Six planes of a box, every one written `copies` times. */
static size_t make_box(double (*planes)[4], const double low[3], const double high[3], int copies)
{
    size_t n = 0;
    for (int c = 0; c < copies; c++)
        for (int k = 0; k < 3; k++) {
            double normal[3] = {0};
            normal[k] = 1;
            set_plane(planes[n++], normal[0], normal[1], normal[2], high[k]);
            set_plane(planes[n++], -normal[0], -normal[1], -normal[2], -low[k]);
        }
    return n;
}

typedef long double wide3[3];

static void widen(const double plane[4], wide3 normal)
{
    for (int k = 0; k < 3; k++) normal[k] = (long double)plane[k];
}

static void cross(const wide3 a, const wide3 b, wide3 c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static long double plane_value(const double plane[4], const wide3 x)
{
    wide3 n;
    widen(plane, n);
    return n[0] * x[0] + n[1] * x[1] + n[2] * x[2] - (long double)plane[3];
}

static int corner_of(const double a[4], const double b[4], const double c[4], wide3 x)
{
    wide3 na, nb, nc, bc, ca, ab;
    widen(a, na);
    widen(b, nb);
    widen(c, nc);
    cross(nb, nc, bc);
    cross(nc, na, ca);
    cross(na, nb, ab);
    const long double det = na[0] * bc[0] + na[1] * bc[1] + na[2] * bc[2];
    if (fabsl(det) < 1e-6L) return 0;
    for (int k = 0; k < 3; k++)
        x[k] = ((long double)a[3] * bc[k] + (long double)b[3] * ca[k] + (long double)c[3] * ab[k]) / det;
    return 1;
}

/* 1 when at least one corner was found. `inside` tells how far a corner must be inside to count. */
static int brute_bounds(const double (*planes)[4], size_t n, long double inside, double low[3], double high[3])
{
    int found = 0;
    for (int k = 0; k < 3; k++) {
        low[k] = HUGE_VAL;
        high[k] = -HUGE_VAL;
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n; j++)
            for (size_t l = j + 1; l < n; l++) {
                wide3 x;
                if (!corner_of(planes[i], planes[j], planes[l], x)) continue;
                int ok = 1;
                for (size_t m = 0; m < n && ok; m++)
                    ok = m == i || m == j || m == l || plane_value(planes[m], x) <= -inside;
                if (!ok) continue;
                found = 1;
                for (int k = 0; k < 3; k++) {
                    low[k] = fmin(low[k], (double)x[k]);
                    high[k] = fmax(high[k], (double)x[k]);
                }
            }
    return found;
}

static void assert_bounds(const double (*planes)[4], size_t n, const double low[3], const double high[3], double slack)
{
    double l[3], h[3];
    assert_int_equal(nb_convex_bounds(planes, n, l, h), 1);
    for (int k = 0; k < 3; k++) {
        assert_true(l[k] <= low[k]);
        assert_true(h[k] >= high[k]);
        if (isfinite(low[k]))
            assert_true(l[k] >= low[k] - slack);
        else
            assert_true(l[k] == low[k]);
        if (isfinite(high[k]))
            assert_true(h[k] <= high[k] + slack);
        else
            assert_true(h[k] == high[k]);
    }
}

static void assert_empty(const double (*planes)[4], size_t n)
{
    double low[3], high[3];
    assert_int_equal(nb_convex_bounds(planes, n, low, high), 0);
}

static const double sizes[] = {1e-3, 1, 1e4, 1e8};

static void test_cube_of_any_size_and_place_has_its_own_bounds(void **unused)
{
    (void)unused;
    static double planes[MOST][4];
    const double places[] = {0, 1, -1e7};
    for (size_t s = 0; s < 4; s++)
        for (size_t p = 0; p < 3; p++)
            for (int copies = 1; copies <= 3; copies++) {
                const double low[3] = {places[p], places[p] - sizes[s], 2 * places[p]};
                const double high[3] = {low[0] + sizes[s], places[p], low[2] + 2 * sizes[s]};
                const size_t n = make_box(planes, low, high, copies);
                assert_bounds((const double(*)[4])planes, n, low, high,
                              1e-14 * (fabs(low[0]) + fabs(low[2]) + sizes[s]));
            }
}

static void test_no_planes_are_all_of_space(void **unused)
{
    (void)unused;
    const double infinity = HUGE_VAL;
    const double low[3] = {-infinity, -infinity, -infinity}, high[3] = {infinity, infinity, infinity};
    const double planes[1][4] = {{1, 0, 0, 0}};
    assert_bounds(planes, 0, low, high, 0);
}

static void test_endless_bodies_have_endless_bounds(void **unused)
{
    (void)unused;
    const double inf = HUGE_VAL;
    double planes[4][4];
    const double(*const p)[4] = (const double(*)[4])planes;
    set_plane(planes[0], 0, 1, 0, 5);
    assert_bounds(p, 1, (double[3]){-inf, -inf, -inf}, (double[3]){inf, 5, inf}, 1e-13);
    set_plane(planes[1], 0, -1, 0, 1e7);
    assert_bounds(p, 2, (double[3]){-inf, -1e7, -inf}, (double[3]){inf, 5, inf}, 1e-7);
    /* A roof along z, and a wedge that opens downwards from its ridge. */
    set_plane(planes[0], .6, .8, 0, 4);
    set_plane(planes[1], -.28, .96, 0, 2);
    const double ridge = (4 / .6 + 2 / .28) / (.8 / .6 + .96 / .28);
    assert_bounds(p, 2, (double[3]){-inf, -inf, -inf}, (double[3]){inf, ridge, inf}, 1e-3);
    /* One plane, leaning against every axis. */
    set_plane(planes[0], 1, 2, 3, 4);
    assert_bounds(p, 1, (double[3]){-inf, -inf, -inf}, (double[3]){inf, inf, inf}, 0);
    /* A corner of space. */
    set_plane(planes[0], 1, 0, 0, 1);
    set_plane(planes[1], 0, -1, 0, -2);
    set_plane(planes[2], 0, 0, 1, -3);
    assert_bounds(p, 3, (double[3]){-inf, 2, -inf}, (double[3]){1, inf, -3}, 1e-14);
}

static void test_endless_prism_is_tight_across_its_axis(void **unused)
{
    (void)unused;
    double planes[7][4];
    const double inf = HUGE_VAL;
    for (int i = 0; i < 7; i++) {
        const double angle = 2 * 3.14159265358979 * i / 7;
        planes[i][0] = cos(angle);
        planes[i][1] = 0;
        planes[i][2] = sin(angle);
        planes[i][3] = 1e7 * planes[i][0] + 3;
    }
    double low[3], high[3];
    assert_int_equal(nb_convex_bounds((const double(*)[4])planes, 7, low, high), 1);
    assert_true(low[1] == -inf && high[1] == inf);
    /* A flat face on one side, an edge on the other. */
    assert_true(high[0] >= 1e7 + 3 && high[0] < 1e7 + 3 + 1e-6);
    const double edge = 3 / cos(3.14159265358979 / 7);
    assert_true(low[0] <= 1e7 - edge + 1e-8 && low[0] > 1e7 - edge - 1e-6);
}

static void test_tetrahedra_match_their_corners(void **unused)
{
    (void)unused;
    for (int trial = 0; trial < 2000; trial++) {
        double planes[4][4], low[3], high[3], center[3];
        const double place = trial % 2 ? 1e7 : 10;
        const double size = pow(10, uniform(-3, 4));
        for (int k = 0; k < 3; k++) center[k] = uniform(-place, place);
        for (int i = 0; i < 4; i++) {
            random_unit(planes[i]);
            planes[i][3] = dot(planes[i], center) + size * uniform(.1, 1);
        }
        double l[3], h[3];
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, 4, l, h), 1);
        if (!brute_bounds((const double(*)[4])planes, 4, 0, low, high)) continue;
        int finite = 1;
        for (int k = 0; k < 3; k++) finite = finite && isfinite(l[k]) && isfinite(h[k]);
        if (!finite) continue; /* four planes seldom close; the corners then say nothing of the bounds */
        for (int k = 0; k < 3; k++) {
            assert_true(l[k] <= low[k] && h[k] >= high[k]);
            const double reach = fmax(fabs(l[k]), fabs(h[k])) + place;
            assert_true(l[k] >= low[k] - 1e-9 * reach && h[k] <= high[k] + 1e-9 * reach);
        }
    }
}

static void test_random_bodies_match_their_corners(void **unused)
{
    (void)unused;
    static double planes[MOST][4];
    for (int trial = 0; trial < 300; trial++) {
        const size_t n = 8 + (size_t)uniform(0, 32);
        const double place = trial % 3 == 0 ? 0 : trial % 3 == 1 ? 100 : 1e7;
        const double size = trial % 3 == 2 ? pow(10, uniform(-1, 4)) : pow(10, uniform(-3, 8));
        const double center[3] = {uniform(-place, place), uniform(-place, place), uniform(-place, place)};
        for (size_t i = 0; i < n; i++) {
            if (i > 8 && uniform(0, 1) < .2) {
                memcpy(planes[i], planes[i - 1], sizeof planes[i]); /* duplicates and nearly parallel planes */
                planes[i][(size_t)uniform(0, 3)] += uniform(0, 1) < .5 ? 0 : 1e-16;
                continue;
            }
            random_unit(planes[i]);
            planes[i][3] = dot(planes[i], center) + size * uniform(.3, 1);
        }
        double low[3], high[3], l[3], h[3];
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, n, l, h), 1);
        const long double inside = -1e-16L * (long double)(place + size);
        if (!isfinite(l[0] + l[1] + l[2] + h[0] + h[1] + h[2])) continue;
        assert_true(brute_bounds((const double(*)[4])planes, n, 0, low, high));
        for (int k = 0; k < 3; k++) assert_true(l[k] <= low[k] && h[k] >= high[k]);
        assert_true(brute_bounds((const double(*)[4])planes, n, inside, low, high));
        for (int k = 0; k < 3; k++) {
            const double slack = 1e-8 * (place * 1e-3 + size);
            assert_true(l[k] >= low[k] - slack && h[k] <= high[k] + slack);
        }
    }
}

/* Small integers make many planes meet in one corner, and bodies that just touch; where a simplex method would cycle.
 */
static void test_degenerate_bodies_of_small_integers_match_their_corners(void **unused)
{
    (void)unused;
    static double planes[32][4], smaller[32][4];
    int bodies = 0, nothing = 0;
    for (int trial = 0; trial < 3000; trial++) {
        size_t n = make_box(planes, (const double[3]){-2, -2, -2}, (const double[3]){2, 2, 2}, 1);
        for (const size_t all = n + 1 + (size_t)uniform(0, 14); n < all;) {
            const double x = floor(uniform(-1, 2)), y = floor(uniform(-1, 2)), z = floor(uniform(-1, 2));
            if (fabs(x) + fabs(y) + fabs(z) > 0) set_plane(planes[n++], x, y, z, floor(uniform(-1, 4)));
        }
        memcpy(smaller, planes, sizeof planes);
        for (size_t i = 0; i < n; i++) smaller[i][3] -= 1e-3;
        double low[3], high[3], l[3], h[3];
        const int expected = brute_bounds((const double(*)[4])smaller, n, -1e-15L, low, high);
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, n, l, h), expected);
        bodies += expected;
        nothing += !expected;
        if (!expected) continue;
        for (int k = 0; k < 3; k++) assert_true(fabs(l[k] - low[k]) < 1e-2 && fabs(h[k] - high[k]) < 1e-2);
        assert_true(brute_bounds((const double(*)[4])planes, n, -1e-15L, low, high));
        for (int k = 0; k < 3; k++) assert_true(fabs(l[k] - low[k]) < 1e-13 && fabs(h[k] - high[k]) < 1e-13);
    }
    assert_true(bodies > 500 && nothing > 100);
}

/* Planes that touch a ball: the body lies between it and a slightly larger one. */
static void test_a_thousand_planes_around_a_ball(void **unused)
{
    (void)unused;
    static double planes[MOST][4];
    for (int trial = 0; trial < 60; trial++) {
        const double place = trial % 2 ? 1e7 : 0, radius = pow(10, uniform(trial % 2 ? -1 : -3, 6));
        const double center[3] = {place, -place, place / 2};
        for (size_t i = 0; i < MOST; i++) {
            random_unit(planes[i]);
            planes[i][3] = dot(planes[i], center) + radius;
        }
        double low[3], high[3];
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, MOST, low, high), 1);
        for (int k = 0; k < 3; k++) {
            assert_true(low[k] <= center[k] - radius + 4e-16 * place && low[k] > center[k] - 1.05 * radius - 1e-7);
            assert_true(high[k] >= center[k] + radius - 4e-16 * place && high[k] < center[k] + 1.05 * radius + 1e-7);
        }
    }
}

static void test_thin_slabs_are_bodies_and_flat_ones_are_not(void **unused)
{
    (void)unused;
    double planes[2][4];
    for (int trial = 0; trial < 500; trial++) {
        const double place = pow(10, uniform(-3, 8)), ulp = 0x1p-52 * place;
        random_unit(planes[0]);
        for (int k = 0; k < 3; k++) planes[1][k] = -planes[0][k];
        planes[0][3] = place;
        planes[1][3] = -place;
        assert_empty((const double(*)[4])planes, 2);
        planes[1][3] = -place + 100 * ulp;
        double low[3], high[3];
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, 2, low, high), 1);
        planes[1][3] = -place - 100 * ulp;
        assert_empty((const double(*)[4])planes, 2);
    }
}

static void test_a_thin_slab_stays_a_body_beside_far_redundant_planes(void **unused)
{
    (void)unused;
    double planes[3][4];
    set_plane(planes[0], 0, 1, 0, 1e-3);
    set_plane(planes[1], 0, -1, 0, -.999e-3);
    set_plane(planes[2], 1, .5, 0, 1e8);
    double low[3], high[3];
    assert_int_equal(nb_convex_bounds((const double(*)[4])planes, 3, low, high), 1);
    assert_true(low[1] <= .999e-3 && low[1] > .998e-3 && high[1] >= 1e-3 && high[1] < 1.001e-3);
    set_plane(planes[1], 0, -1, 0, -1e-3);
    assert_empty((const double(*)[4])planes, 3);
}

static void test_contradictions_are_empty(void **unused)
{
    (void)unused;
    static double planes[MOST][4];
    const double(*const p)[4] = (const double(*)[4])planes;
    for (int trial = 0; trial < 300; trial++) {
        const double place = trial % 2 ? 1e7 : 1, gap = place * pow(10, uniform(-12, 0));
        const double center[3] = {uniform(-place, place), uniform(-place, place), uniform(-place, place)};
        /* Planes that all keep off the center by `gap`, in directions that surround it. */
        const size_t n = 30 + (size_t)uniform(0, 200);
        for (size_t i = 0; i < n; i++) {
            random_unit(planes[i]);
            planes[i][3] = dot(planes[i], center) - gap;
        }
        assert_empty(p, n);
    }
    for (double shift = 1e-3; shift < 1e9; shift *= 10) {
        set_plane(planes[0], 1, 0, 0, 0);
        set_plane(planes[1], -1, 0, 0, -shift);
        assert_empty(p, 2);
    }
}

static void test_bodies_shrunk_to_a_line_or_a_point_are_empty(void **unused)
{
    (void)unused;
    double planes[6][4];
    for (int trial = 0; trial < 300; trial++) {
        const double place = trial % 3 == 0 ? 0 : trial % 3 == 1 ? 5 : 1e7;
        const double center[3] = {place, uniform(-place, place), -place};
        /* Three sides of a prism through one line: the third normal is minus the sum of the others. */
        random_unit(planes[0]);
        random_unit(planes[1]);
        set_plane(planes[2], -planes[0][0] - planes[1][0], -planes[0][1] - planes[1][1], -planes[0][2] - planes[1][2],
                  0);
        double mean = 0;
        for (int i = 0; i < 3; i++) {
            planes[i][3] = dot(planes[i], center);
            mean += fabs(planes[i][3]) / 3;
        }
        /* What counts is rounding relative to the distances, so they must not be small by chance. */
        if (mean >= .3 * place) assert_empty((const double(*)[4])planes, 3);
        /* A tetrahedron of no size. */
        const double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
        for (int i = 0; i < 4; i++) {
            set_plane(planes[i], corners[i][0], corners[i][1], corners[i][2], 0);
            planes[i][3] = dot(planes[i], center);
        }
        assert_empty((const double(*)[4])planes, 4);
    }
}

/* Two faces that meet at a small angle far away: the bounds reach there. */
static void test_acute_wedges_reach_their_edge(void **unused)
{
    (void)unused;
    double planes[6][4];
    for (double angle = 1e-1; angle > 1e-7; angle /= 10) {
        set_plane(planes[0], sin(angle), cos(angle), 0, 1);
        set_plane(planes[1], sin(angle), -cos(angle), 0, 1);
        set_plane(planes[2], -1, 0, 0, 0);
        set_plane(planes[3], 0, 0, 1, 1);
        set_plane(planes[4], 0, 0, -1, 1);
        double low[3], high[3];
        assert_int_equal(nb_convex_bounds((const double(*)[4])planes, 5, low, high), 1);
        const long double edge = 1 / (long double)planes[0][0];
        assert_true(high[0] >= (double)(edge * (1 - 1e-16L)) && high[0] <= (double)edge * (1 + 1e-6));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cube_of_any_size_and_place_has_its_own_bounds),
        cmocka_unit_test(test_no_planes_are_all_of_space),
        cmocka_unit_test(test_endless_bodies_have_endless_bounds),
        cmocka_unit_test(test_endless_prism_is_tight_across_its_axis),
        cmocka_unit_test(test_tetrahedra_match_their_corners),
        cmocka_unit_test(test_random_bodies_match_their_corners),
        cmocka_unit_test(test_degenerate_bodies_of_small_integers_match_their_corners),
        cmocka_unit_test(test_a_thousand_planes_around_a_ball),
        cmocka_unit_test(test_thin_slabs_are_bodies_and_flat_ones_are_not),
        cmocka_unit_test(test_a_thin_slab_stays_a_body_beside_far_redundant_planes),
        cmocka_unit_test(test_contradictions_are_empty),
        cmocka_unit_test(test_bodies_shrunk_to_a_line_or_a_point_are_empty),
        cmocka_unit_test(test_acute_wedges_reach_their_edge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
