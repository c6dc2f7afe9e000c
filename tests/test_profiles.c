/* Densities and their integrals along a ray, what a piece of fog does to light, and the fog factors of OpenGL: against
 * closed forms of the literature, quadrature in long double, and at level, steep, thin and endless pieces. */
#include "formula_inputs.h"
#include "formula_truth.h"
#include "unit.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#if defined(__SANITIZE_ADDRESS__)
enum { PIECES = 4000 };
#else
enum { PIECES = 100000 };
#endif

typedef struct level {
    const char *name;
    nb_formula_evaluate *evaluate;
    nb_formula_digits digits;
    long double unit, smallest; /* rounding of the narrow type, its smallest normal number */
    long double tolerance;      /* for the numbers of the literature */
} level;

static const level levels[] = {
    {"float", nb_formula_float, NB_DIGITS_DOUBLE, (long double)FLT_EPSILON / 2, (long double)FLT_MIN, 3e-6L},
    {"double", nb_formula_double, NB_DIGITS_LONG, (long double)DBL_EPSILON / 2, (long double)DBL_MIN, 1e-12L},
    {"fast", nb_formula_fast, NB_DIGITS_FLOAT, (long double)FLT_EPSILON / 2, (long double)FLT_MIN, 3e-6L},
};
enum { LEVELS = sizeof levels / sizeof levels[0] };

static const char *const formula_names[] = {
#define NAME(name, expression) #name,
    NB_FORMULAS(NAME)
#undef NAME
};

static const long double pi = 3.14159265358979323846264338327950288L;

/* ---- asking ---------------------------------------------------------------------------------- */

typedef struct estimate {
    long double value, error;
} estimate;

static estimate ask(const level *l, nb_formula formula, const long double *in, size_t count)
{
    long double all[NB_FORMULA_INPUTS] = {0}, out[NB_FORMULA_OUTPUTS];
    memcpy(all, in, count * sizeof in[0]);
    l->evaluate(formula, all, out);
    return (estimate){out[0], out[1]};
}

static long double ask3(const level *l, nb_formula formula, long double a, long double b, long double c)
{
    return ask(l, formula, (long double[]){a, b, c}, 3).value;
}

static void expect(const level *l, const char *what, long double got, long double wanted, long double tolerance)
{
    if (!(fabsl(got - wanted) <= tolerance * fabsl(wanted)))
        fail_msg("%s in %s: %.20Lg instead of %.20Lg", what, l->name, got, wanted);
}

/* ---- the literature -------------------------------------------------------------------------- */

typedef struct slant {
    long double z, elevation, length, depth;
} slant;

/* T04: exponential fog, 0.02 per metre at 0, scale height 50 m: level, 1e-6 degrees, up, down, endless upwards, from
 * below the base. */
static void height_integrals_are_those_of_T04(void **state)
{
    (void)state;
    const slant cases[] = {
        {1.7L, 0, 300, 5.79942902782504L},     {1.7L, 1e-6L, 300, 5.799428724167657L},
        {1.7L, 5, 1000, 9.149667986993935L},   {120, -20, 500, 7.844670943951732L},
        {1.7L, 90, 1e18L, .9665715046375067L}, {1.7L, .5L, 1e18L, 110.7623414604356L},
        {-30, -5, 400, 21.07820157504828L},    {1000, -89, 999, .9773692687837537L},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i)
        for (int l = 0; l < LEVELS; ++l) {
            const long double slope = sinl(cases[i].elevation * pi / 180) / 50;
            const long double h = ask3(&levels[l], NB_FORMULA_height_integral, cases[i].z / 50, slope, cases[i].length);
            expect(&levels[l], "T04", .02L * h, cases[i].depth, levels[l].tolerance);
        }
}

/* T07: 0.05 per metre at 0, nothing from 40 m on: across one kink, across both, down from above, level. */
static void linear_integrals_are_those_of_T07(void **state)
{
    (void)state;
    const slant cases[] = {
        {2, 10, 200, 5.158795558326741L}, {-5, 10, 200, 6.818814769527622L}, {60, -30, 150, 3.5L}, {10, 0, 100, 3.75L}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i)
        for (int l = 0; l < LEVELS; ++l) {
            const long double slope = -sinl(cases[i].elevation * pi / 180) / 40;
            const long double h =
                ask3(&levels[l], NB_FORMULA_linear_integral, 1 - cases[i].z / 40, slope, cases[i].length);
            expect(&levels[l], "T07", .05L * h, cases[i].depth, levels[l].tolerance);
        }
}

/* T08: a ball of radius 3 with (1 - r^2)^k: through the middle, 1.2 m beside it, and there from -0.5 to 2 m. */
static void radial_integrals_are_those_of_T08(void **state)
{
    (void)state;
    const long double wanted[3][3] = {{4, 3.079490867010324L, 1.799074074074074L},
                                      {3.2L, 2.069417862630938L, 1.337533950617284L},
                                      {2.742857142857143L, 1.489980861094275L, 1.018980740250833L}};
    const long double c = 1 - .16L, end = sqrtl(1 - .16L);
    const long double pieces[3][4] = {
        {1, -1, 1.0L / 3, 6}, {c, -end, 1.0L / 3, 6 * end}, {c, -.5L / 3, 1.0L / 3, 2.5L}};
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i)
            for (int l = 0; l < LEVELS; ++l) {
                const nb_formula formula = (nb_formula)(NB_FORMULA_radial_1_integral + k);
                expect(&levels[l], "T08", ask(&levels[l], formula, pieces[i], 4).value, wanted[k][i],
                       levels[l].tolerance);
            }
}

/* T10: an isotropic Gaussian of sigma 0.7 passed at 0.5, the whole line; and the anisotropic one, whose exponent along
 * the ray is a quadratic whose coefficients the inverse covariance gives, from the camera on and from 2 to 5. */
static void gaussian_integrals_are_those_of_T10(void **state)
{
    (void)state;
    const long double covariance[3][3] = {{2, .3L, 0}, {.3L, 1, -.2L}, {0, -.2L, 1.5L}};
    const long double p[] = {-4, .5L, .3L}, d[] = {.9759000729485332L, .1951800145897066L, .09759000729485331L};
    long double a = 0, b = 0, c = 0, determinant = 0;
    for (int i = 0; i < 3; ++i) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            const long double cofactor =
                covariance[i1][j1] * covariance[i2][j2] - covariance[i1][j2] * covariance[i2][j1];
            a += d[i] * d[j] * cofactor, b += p[i] * d[j] * cofactor, c += p[i] * p[j] * cofactor;
            if (i == 0) determinant += covariance[0][j] * cofactor;
        }
    }
    a /= determinant, b /= determinant, c /= determinant;
    const long double k = sqrtl(a / 2), middle = -b / a, m = (c - b * b / a) / 2, iso = .7L * sqrtl(2);
    for (int l = 0; l < LEVELS; ++l) {
        const level *v = &levels[l];
        const nb_formula f = NB_FORMULA_gaussian_integral;
        const long double tolerance = fmaxl(v->tolerance, v->unit * 200); /* 1e-5 is the file's for floats */
        expect(v, "T10 isotropic", ask(v, f, (long double[]){.25L / (iso * iso), -1e4L, 1e4L, 1 / iso}, 4).value,
               1.359560585236798L, tolerance);
        expect(v, "T10 all", ask(v, f, (long double[]){m, -k * middle, 1e4L, k}, 4).value, 1.089622744092583L,
               tolerance);
        expect(v, "T10 part", ask(v, f, (long double[]){m, k * (2 - middle), k * (5 - middle), k}, 4).value,
               .7581572855323195L, tolerance);
    }
}

/* T15: light gathered in 4 to 256 slices is that of one piece, and single slices that vanish or are opaque lose
 * nothing. */
static void gathered_light_is_that_of_T15(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l) {
        const level *v = &levels[l];
        for (int slices = 4; slices <= 256; slices *= 4) {
            const long double width = 200.0L / slices;
            long double sum = 0, transmittance = 1;
            for (int i = 0; i < slices; ++i) {
                sum += transmittance * ask3(v, NB_FORMULA_gather, 2 * width, .03L * width, 0);
                transmittance *= expl(-.03L * width);
            }
            expect(v, "T15 slices", sum, 66.50141652155558L, v->digits == NB_DIGITS_LONG ? 1e-13L : 1e-6L);
        }
        expect(v, "T15 opaque", ask3(v, NB_FORMULA_gather, 2, 20, 0), .09999999979388464L, fmaxl(1e-13L, 8 * v->unit));
        expect(v, "T15 vanishing", ask3(v, NB_FORMULA_gather, 2, 1e-9L, 0), 1.999999999L, fmaxl(1e-13L, 8 * v->unit));
    }
}

/* ---- against quadrature ---------------------------------------------------------------------- */

typedef struct worst {
    long double ratio, in[NB_FORMULA_INPUTS], value, truth, error;
} worst;

/* The part of the true error that rounding explains: what underflows is allowed to. */
static void note(worst *w, const long double *in, const estimate *got, long double truth, long double underflow)
{
    const long double error = fmaxl(fabsl(got->value - truth) - underflow, 0);
    const long double ratio = error == 0 ? 0 : got->error > 0 ? error / got->error : (long double)INFINITY;
    if (ratio <= w->ratio) return;
    w->ratio = ratio, w->value = got->value, w->truth = truth, w->error = got->error;
    memcpy(w->in, in, sizeof w->in);
}

static void report(nb_formula formula, const level *l, const worst *w)
{
    print_message("%s in %s: off by at most %.2Lf of the error told\n", formula_names[formula], l->name, w->ratio);
    if (w->ratio <= 1) return;
    for (int i = 0; i < 10; ++i) print_message(" %.21Lg", w->in[i]);
    fail_msg("%.12Lg +- %.3Lg instead of %.12Lg", w->value, w->error, w->truth);
}

/* The longest that e^-u may be short of by underflow: as long as the piece. */
static long double underflow_of(const level *l, nb_formula formula, const long double *in)
{
    if (formula == NB_FORMULA_gaussian_integral) return 2 * l->smallest / in[3] * (1 + fabsl(in[2] - in[1]));
    return formula <= NB_FORMULA_height_capped_integral ? l->smallest * in[2] : l->smallest;
}

/* The errors that integrals tell bound the true ones, those of narrowing their arguments included. */
static void told_errors_bound_the_true_ones(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l)
        for (int f = NB_FORMULA_height_integral; f <= NB_FORMULA_soft_edge_integral; ++f) {
            nb_formula_dice dice = {(unsigned)(100 * l + f)};
            worst w = {0};
            for (size_t i = 0; i < nb_test_count(PIECES / 4); ++i) {
                long double in[NB_FORMULA_INPUTS];
                nb_formula_draw(&dice, (nb_formula)f, levels[l].digits, in);
                const long double truth = nb_truth_integral((nb_formula)f, in);
                if (truth > 1e17L || isnan(truth)) continue;
                const estimate got = ask(&levels[l], (nb_formula)f, in, NB_FORMULA_INPUTS);
                note(&w, in, &got, truth, underflow_of(&levels[l], (nb_formula)f, in));
            }
            report((nb_formula)f, &levels[l], &w);
        }
}

/* ---- the bad cases --------------------------------------------------------------------------- */

typedef struct wanted {
    long double in[4], value;
} wanted;

static void expect_all(const char *what, nb_formula formula, const wanted *cases, size_t count)
{
    for (size_t i = 0; i < count; ++i)
        for (int l = 0; l < LEVELS; ++l) {
            char name[96];
            snprintf(name, sizeof name, "%s, case %zu", what, i);
            expect(&levels[l], name, ask(&levels[l], formula, cases[i].in, 4).value, cases[i].value,
                   16 * levels[l].unit);
        }
}

#define EXPECT_ALL(what, formula, cases) expect_all(what, formula, cases, sizeof(cases) / sizeof(cases)[0])

/* Level rays of either zero, and slopes too small to matter, see h e^-u; upwards without end e^-u / k. */
static void height_fog_level_and_endless(void **state)
{
    (void)state;
    const long double e2 = expl(-2);
    const wanted cases[] = {
        {{2, 0, 300, 0}, 300 * e2},         {{2, -0.0L, 300, 0}, 300 * e2}, {{2, 1e-30L, 300, 0}, 300 * e2},
        {{2, -1e-30L, 300, 0}, 300 * e2},   {{2, .125L, 1e18L, 0}, 8 * e2}, {{-3, .5L, 1e18L, 0}, 2 * expl(3)},
        {{2, -.125L, 16, 0}, 8 * (1 - e2)}, {{2, 1e-9L, 0, 0}, 0},          {{-3, 1e-6L, 1e18L, 0}, 1e6L * expl(3)},
    };
    EXPECT_ALL("height", NB_FORMULA_height_integral, cases);
    for (int l = 0; l < LEVELS; ++l) {
        const estimate down = ask(&levels[l], NB_FORMULA_height_integral, (long double[]){2, -.1L, 1e18L}, 3);
        assert_true(down.value >= 1e17L && down.value <= 1.0001e18L && isfinite((double)down.error));
    }
}

/* Constant under the base: crossing it either way, along it, beginning or ending on it, without end. */
static void capped_height_fog_crosses_its_base(void **state)
{
    (void)state;
    const wanted cases[] = {
        {{-2, .125L, 1e18L, 0}, 16 + 8},
        {{-2, .125L, 24, 0}, 16 + 8 * (1 - expl(-1))},
        {{1, -.125L, 24, 0}, 16 + 8 * (1 - expl(-1))},
        {{2, -.125L, 1e18L, 0}, 1e18L},
        {{-1, -.125L, 1e18L, 0}, 1e18L},
        {{-1, 0, 300, 0}, 300},
        {{-1, -0.0L, 300, 0}, 300},
        {{0, 0, 300, 0}, 300},
        {{1, 0, 300, 0}, 300 * expl(-1)},
        {{1, -0.0L, 300, 0}, 300 * expl(-1)},
        {{0, .125L, 8, 0}, 8 * (1 - expl(-1))},
        {{0, -.125L, 8, 0}, 8},
        {{-1, .125L, 8, 0}, 8},
        {{1, -.125L, 8, 0}, 8 * (1 - expl(-1))},
    };
    EXPECT_ALL("capped height", NB_FORMULA_height_capped_integral, cases);
}

/* On the ends of the ramp exactly, level or leaving them either way; level within and beyond; across the whole ramp. */
static void linear_fog_on_its_kinks(void **state)
{
    (void)state;
    const wanted cases[] = {
        {{0, 0, 8, 0}, 0},        {{0, -0.0L, 8, 0}, 0},
        {{1, 0, 8, 0}, 8},        {{1, -0.0L, 8, 0}, 8},
        {{.25L, 0, 8, 0}, 2},     {{-1, 0, 8, 0}, 0},
        {{2, -0.0L, 8, 0}, 8},    {{0, .125L, 8, 0}, 4},
        {{0, -.125L, 8, 0}, 0},   {{1, .125L, 8, 0}, 8},
        {{1, -.125L, 8, 0}, 4},   {{-1, .125L, 24, 0}, 12},
        {{2, -.125L, 24, 0}, 12}, {{0, 1, 1e18L, 0}, 1e18L},
        {{1, -1, 1e18L, 0}, .5L}, {{.5L, 64, 8, 0}, 8 - 1 / 512.0L},
    };
    EXPECT_ALL("linear", NB_FORMULA_linear_integral, cases);
}

/* Far out in a Gaussian the value keeps its digits: x from 4 on within 50 roundings and those of x^2. */
static void gaussian_tails_keep_their_digits(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l)
        for (int i = 0; i < 200; ++i) {
            const long double x = nb_formula_round(NB_DIGITS_FLOAT, 4 + i / 50.0L),
                              far = x + (i % 3 ? i % 7 * .125L + .125L : 8);
            const long double in[] = {.5L, i % 2 ? x : -far, i % 2 ? far : -x, .25L};
            expect(&levels[l], "tail", ask(&levels[l], NB_FORMULA_gaussian_integral, in, 4).value,
                   nb_truth_integral(NB_FORMULA_gaussian_integral, in), 50 * levels[l].unit);
        }
    const wanted cases[] = {{{0, -1e6L, 1e6L, .5L}, 2 * sqrtl(pi)},
                            {{0, 0, 1e6L, .5L}, sqrtl(pi)},
                            {{0, -1e6L, 0, 1e-6L}, sqrtl(pi) * 5e5L},
                            {{0, 3, 3, .5L}, 0},
                            {{1e9L, -1, 1, .5L}, 0},
                            {{0, 40, 50, 1e-3L}, 0}};
    EXPECT_ALL("gaussian", NB_FORMULA_gaussian_integral, cases);
}

/* The antiderivative of (c - x^2)^k where it loses no digits: well inside. */
static long double radial_primitive(int k, long double c, long double x)
{
    const long double y = x * x;
    return k == 1   ? x * (c - y / 3)
           : k == 2 ? x * (c * c - 2 * c * y / 3 + y * y / 5)
                    : x * (c * c * c - c * c * y + 3 * c * y * y / 5 - y * y * y / 7);
}

/* Pieces that begin and end inside; the whole chord of a ray that grazes, (4/3) c^(3/2) and so on; a ray that misses.
 */
static void radial_fog_in_part_and_grazing(void **state)
{
    (void)state;
    const long double full[] = {4.0L / 3, 16.0L / 15, 32.0L / 35}, c = 0x1p-20L;
    for (int k = 1; k <= 3; ++k) {
        const nb_formula formula = (nb_formula)(NB_FORMULA_radial_1_integral + k - 1);
        const wanted cases[] = {
            {{.75L, -.5L, .25L, 3}, 4 * (radial_primitive(k, .75L, .25L) - radial_primitive(k, .75L, -.5L))},
            {{.75L, .25L, .25L, 1}, 4 * (radial_primitive(k, .75L, .5L) - radial_primitive(k, .75L, .25L))},
            {{c, -0x1p-10L, 4, 0x1p-11L}, full[k - 1] * powl(c, k + .5L) / 4},
            {{-c, 0, 1, 1}, 0},
            {{.5L, 0, 1, 0}, 0},
        };
        EXPECT_ALL("radial", formula, cases);
    }
}

static long double soft_edge(const level *l, const long double q[3], const long double k[3], const long double e[3],
                             long double h)
{
    const long double in[] = {q[0], q[1], q[2], k[0], k[1], k[2], e[0], e[1], e[2], h};
    return ask(l, NB_FORMULA_soft_edge_integral, in, 10).value;
}

/* Along x through a box, in widths of the edge: with a plateau 2 e - 1, thinner than that e^2; beside the middle that
 * times the other axes; along a diagonal of a cube the cube of one axis; through an edge and a corner next to nothing.
 */
static void soft_edges_of_thick_and_thin_boxes(void **state)
{
    (void)state;
    const long double x[] = {1, 0, -0.0L}, diagonal[] = {1, 1, 1}, turn[] = {.5L, -.5L, 0};
    for (int l = 0; l < LEVELS; ++l) {
        const level *v = &levels[l];
        const long double t = 32 * v->unit;
        const long double thick[] = {3, 2, 2}, thin[] = {.5L, 2, .25L}, cube[] = {2, 2, 2};
        expect(v, "plateau", soft_edge(v, (long double[]){-3, 0, 0}, x, thick, 6), 5, t);
        expect(v, "beside", soft_edge(v, (long double[]){-3, 1.5L, -1.75L}, x, thick, 6), 5 * .125L, t);
        expect(v, "thin", soft_edge(v, (long double[]){-.5L, 0, 0}, x, thin, 1), .25L * .25L, t);
        expect(v, "diagonal", soft_edge(v, (long double[]){-2, -2, -2}, diagonal, cube, 4), 2 + 2 / 4.0L, t);
        expect(v, "edge", soft_edge(v, (long double[]){-2, 1.875L, 0}, turn, cube, 0), 0, t);
        expect(v, "in a face", soft_edge(v, (long double[]){-2, 2, 0}, x, cube, 4), 0, t);
        /* cuts the corner off 1/8 from it: t (1/8 - t) over 1/8 */
        expect(v, "corner", soft_edge(v, (long double[]){1.875L, 2, 0}, (long double[]){1, -1, 0}, cube, .125L),
               powl(.125L, 3) / 6, t);
    }
}

/* Walking from kink to kink along x through a box with a plateau meets -2 and 2 (edges 3), through a thin one its
 * middle. */
static void soft_edge_kinks_come_in_turn(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l) {
        const level *v = &levels[l];
        long double in[10] = {-3, .25L, -.25L, 1, 0, -0.0L, 3, 3, 3, 0};
        expect(v, "first", ask(v, NB_FORMULA_soft_edge_kink, in, 10).value, 1, 0);
        in[9] = 1;
        expect(v, "second", ask(v, NB_FORMULA_soft_edge_kink, in, 10).value, 5, 0);
        in[6] = .5L, in[0] = -.5L, in[9] = 0;
        expect(v, "middle", ask(v, NB_FORMULA_soft_edge_kink, in, 10).value, .5L, 0);
        in[9] = .5L;
        assert_true(ask(v, NB_FORMULA_soft_edge_kink, in, 10).value >= 1e18L * .999L);
        in[3] = -1, in[0] = .5L, in[9] = 0;
        expect(v, "backwards", ask(v, NB_FORMULA_soft_edge_kink, in, 10).value, .5L, 0);
    }
}

/* Each density is the one whose integral was tested: the same profile after 0 metres. */
static void densities_are_those_of_the_integrals(void **state)
{
    (void)state;
    const struct {
        nb_formula density, integral;
    } pairs[] = {{NB_FORMULA_height_density, NB_FORMULA_height_integral},
                 {NB_FORMULA_height_capped_density, NB_FORMULA_height_capped_integral},
                 {NB_FORMULA_linear_density, NB_FORMULA_linear_integral},
                 {NB_FORMULA_gaussian_density, NB_FORMULA_gaussian_integral},
                 {NB_FORMULA_radial_1_density, NB_FORMULA_radial_1_integral},
                 {NB_FORMULA_radial_2_density, NB_FORMULA_radial_2_integral},
                 {NB_FORMULA_radial_3_density, NB_FORMULA_radial_3_integral},
                 {NB_FORMULA_soft_edge_density, NB_FORMULA_soft_edge_integral}};
    nb_formula_dice dice = {5};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; ++i)
        for (int l = 0; l < LEVELS; ++l)
            for (size_t n = 0; n < nb_test_count(2000); ++n) {
                long double in[NB_FORMULA_INPUTS];
                nb_formula_draw(&dice, pairs[i].integral, NB_DIGITS_FLOAT, in);
                const long double truth = nb_truth_density(pairs[i].integral, in, 0);
                const long double got = ask(&levels[l], pairs[i].density, in, NB_FORMULA_INPUTS).value;
                const long double exponent = fabsl(in[0]) + in[1] * in[1];
                const long double cancelled =
                    pairs[i].integral == NB_FORMULA_soft_edge_integral ? in[6] + in[7] + in[8] : 1;
                const long double error = (fminl(exponent, 1e4L) + 8) * 4 * levels[l].unit * truth;
                assert_true(fabsl(got - truth) <= error + 8 * levels[l].unit * cancelled + levels[l].smallest);
            }
}

/* ---- light and fog factors ------------------------------------------------------------------- */

/* No fog gives what shines in it, thin fog loses no digit, opaque fog gives light / depth, all without a NaN. */
static void gathering_from_nothing_to_opaque(void **state)
{
    (void)state;
    const wanted cases[] = {
        {{3, 0, 0, 0}, 3},
        {{3, 1e-30L, 0, 0}, 3},
        {{3, 1e-4L, 0, 0}, -3e4L * expm1l(-1e-4L)},
        {{3, 1, 0, 0}, -3 * expm1l(-1)},
        {{3, 100, 0, 0}, .03L},
        {{0, 0, 0, 0}, 0},
        {{1e20L, 1e20L, 0, 0}, 1},
    };
    EXPECT_ALL("gather", NB_FORMULA_gather, cases);
}

/* Clamped to [0, 1] last, whatever the signs; end == start is a step; an end before the start runs backwards. */
static void fog_factors_are_those_of_opengl(void **state)
{
    (void)state;
    const wanted linear[] = {
        {{10, 10, 20, 0}, 1},       {{15, 10, 20, 0}, .5L}, {{20, 10, 20, 0}, 0}, {{0, 10, 20, 0}, 1},
        {{1e9L, 10, 20, 0}, 0},     {{9, 10, 10, 0}, 1},    {{10, 10, 10, 0}, 0}, {{11, 10, 10, 0}, 0},
        {{17.5L, 20, 10, 0}, .75L}, {{25, 20, 10, 0}, 1},
    };
    const wanted exponential[] = {
        {{2, .5L, 0, 0}, expl(-1)}, {{0, 3, 0, 0}, 1}, {{-2, .5L, 0, 0}, 1}, {{2, -1, 0, 0}, 1}, {{1e6L, 1, 0, 0}, 0}};
    const wanted square[] = {{{2, .5L, 0, 0}, expl(-1)},
                             {{4, .5L, 0, 0}, expl(-4)},
                             {{-4, .5L, 0, 0}, expl(-4)},
                             {{0, 3, 0, 0}, 1},
                             {{1e6L, 1, 0, 0}, 0}};
    EXPECT_ALL("linear", NB_FORMULA_fog_linear, linear);
    EXPECT_ALL("exp", NB_FORMULA_fog_exp, exponential);
    EXPECT_ALL("exp2", NB_FORMULA_fog_exp2, square);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(height_integrals_are_those_of_T04), cmocka_unit_test(linear_integrals_are_those_of_T07),
        cmocka_unit_test(radial_integrals_are_those_of_T08), cmocka_unit_test(gaussian_integrals_are_those_of_T10),
        cmocka_unit_test(gathered_light_is_that_of_T15),     cmocka_unit_test(told_errors_bound_the_true_ones),
        cmocka_unit_test(height_fog_level_and_endless),      cmocka_unit_test(capped_height_fog_crosses_its_base),
        cmocka_unit_test(linear_fog_on_its_kinks),           cmocka_unit_test(gaussian_tails_keep_their_digits),
        cmocka_unit_test(radial_fog_in_part_and_grazing),    cmocka_unit_test(soft_edges_of_thick_and_thin_boxes),
        cmocka_unit_test(soft_edge_kinks_come_in_turn),      cmocka_unit_test(densities_are_those_of_the_integrals),
        cmocka_unit_test(gathering_from_nothing_to_opaque),  cmocka_unit_test(fog_factors_are_those_of_opengl),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
