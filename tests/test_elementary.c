/* The elementary functions: how exact they are, what they do with hostile numbers, and that every instruction set gives
 * the same bits. */
#include "elementary_level.h"
#include "gauss_rule.h"
#include "unit.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 1 << 16, SLOW_SAMPLES = 1 << 13 };

static const char *const function_names[] = {
#define NAME(name, expression) #name,
    NB_ELEMENTARY_FUNCTIONS(NAME)
#undef NAME
};

/* ---- numbers to try -------------------------------------------------------------------------- */

static uint64_t random_state;

static void seed_random(uint64_t seed)
{
    random_state = seed * UINT64_C(0x9e3779b97f4a7c15) + 1;
}

static uint64_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state * UINT64_C(0x2545f4914f6cdd1d);
}

static double random_unit(void)
{
    return (double)(random_bits() >> 11) * 0x1p-53;
}

/* ---- the truth ------------------------------------------------------------------------------- */

typedef long double truth(long double a, long double b);

static long double true_exp(long double a, long double b)
{
    return (void)b, expl(a);
}
static long double true_expm1(long double a, long double b)
{
    return (void)b, expm1l(a);
}
static long double true_one_minus_exp(long double a, long double b)
{
    return (void)b, -expm1l(-a);
}
static long double true_exp_ratio(long double a, long double b)
{
    return (void)b, a == 0 ? 1 : -expm1l(-a) / a;
}
static long double true_log(long double a, long double b)
{
    return (void)b, logl(a);
}
static long double true_log1p(long double a, long double b)
{
    return (void)b, log1pl(a);
}
static long double true_erf(long double a, long double b)
{
    return (void)b, erfl(a);
}
static long double true_erfc(long double a, long double b)
{
    return (void)b, erfcl(a);
}
static long double true_exp_minus_square(long double a, long double b)
{
    return (void)b, expl(-a * a);
}

/* Past 20 by the asymptotic series sum (-1)^n (2 n - 1)!! / (2 x^2)^n / (x sqrt(pi)), whose terms fall below 1e-30
 * there. */
static long double true_erfcx(long double a, long double b)
{
    (void)b;
    a = fabsl(a);
    if (a < 20) return expl(a * a) * erfcl(a);
    long double term = 1, sum = 0;
    for (int n = 1; n < 20; ++n) {
        sum += term;
        term *= -(2 * n - 1) / (2 * a * a);
    }
    return sum / a * 0.564189583547756286948079451560772586L;
}

/* e^(a^2) times the integral of e^(-t^2) from a >= 0 to b, in panels short enough for the rule to be exact; what lies
 * beyond e^-50 of the start does not count. */
static long double one_sided_integral(long double a, long double b)
{
    const long double end = fminl(b, sqrtl(a * a + 50));
    const long double most = 1 / (1 + a);
    const int panels = (int)ceill((end - a) / most);
    if (!(end > a)) return 0;
    const long double half = (end - a) / panels / 2;
    long double sum = 0;
    for (int p = 0; p < panels; ++p)
        for (int i = 0; i < RULE_POINTS; ++i) {
            const long double past = half * (2 * p + 1 + rule_nodes[i]);
            sum += rule_weights[i] * expl(-past * (2 * a + past));
        }
    return sum * half;
}

static long double true_gauss_integral(long double a, long double b)
{
    const long double low = fminl(a, b), high = fmaxl(a, b);
    if (low < 0 && high > 0) return one_sided_integral(0, -low) + one_sided_integral(0, high);
    const long double from = fminl(fabsl(low), fabsl(high)), to = fmaxl(fabsl(low), fabsl(high));
    return expl(-from * from) * one_sided_integral(from, to);
}

/* ---- exactness ------------------------------------------------------------------------------- */

/* One precision: both take and give doubles that it can hold. */
typedef struct precision {
    const char *name;
    int digits, least_exponent;
    nb_elementary_double *evaluate;
    int is_float;
} precision;

static void evaluate_float(nb_elementary function, size_t count, const double *a, const double *b, double *result)
{
    float block[3][NB_ELEMENTARY_BLOCK];
    for (size_t i = 0; i < count; i += NB_ELEMENTARY_BLOCK) {
        for (int j = 0; j < NB_ELEMENTARY_BLOCK; ++j) {
            block[0][j] = (float)a[i + (size_t)j];
            block[1][j] = (float)b[i + (size_t)j];
        }
        nb_elementary_scalar(function, NB_ELEMENTARY_BLOCK, block[0], block[1], block[2]);
        for (int j = 0; j < NB_ELEMENTARY_BLOCK; ++j) result[i + (size_t)j] = (double)block[2][j];
    }
}

static const precision float_precision = {"float", FLT_MANT_DIG, FLT_MIN_EXP, evaluate_float, 1};
static const precision double_precision = {"double", DBL_MANT_DIG, DBL_MIN_EXP, nb_elementary_reference, 0};

/* Where a function is tried: evenly over [low, high], or evenly in the logarithm over e^low to e^high. */
typedef enum spacing { EVENLY, LOGARITHMICALLY, BOTH_SIGNS } spacing;

typedef struct trial {
    nb_elementary function;
    truth *wanted;
    spacing spacing;
    double low, high;
    double most;   /* units in the last place */
    int underflow; /* an error below the smallest normal number does not count */
} trial;

static double draw(const trial *t)
{
    const double x = t->low + (t->high - t->low) * random_unit();
    if (t->spacing == EVENLY) return x;
    return t->spacing == BOTH_SIGNS && random_bits() & 1 ? -exp(x) : exp(x);
}

/* The distance in units in the last place of the truth; -1 where the truth is below the normal numbers. */
static double distance(const precision *p, const trial *t, double got, long double wanted)
{
    const long double error = fabsl((long double)got - wanted);
    int exponent;
    (void)frexpl(wanted, &exponent);
    if (wanted == 0 || exponent < p->least_exponent) return -1;
    if (t->underflow && error < ldexpl(1, p->least_exponent - 1)) return 0;
    return (double)(error / ldexpl(1, exponent - p->digits));
}

static void run_trial(const precision *p, const trial *t)
{
    static double a[SAMPLES], b[SAMPLES], result[SAMPLES];
    const size_t count = t->wanted == true_gauss_integral ? SLOW_SAMPLES : SAMPLES;
    for (size_t i = 0; i < count; ++i) {
        a[i] = p->is_float ? (double)(float)draw(t) : draw(t);
        b[i] = a[i] + (random_bits() & 1 ? draw(t) : a[i] * exp(-8 * random_unit()));
        if (p->is_float) b[i] = (double)(float)b[i];
    }
    p->evaluate(t->function, count, a, b, result);
    double worst = -1;
    size_t at = 0;
    for (size_t i = 0; i < count; ++i) {
        const double d = distance(p, t, result[i], t->wanted((long double)a[i], (long double)b[i]));
        if (d > worst || d != d) {
            worst = d;
            at = i;
        }
        if (d != d) break;
    }
    print_message("%-6s %-16s %8.3g to %8.3g: %.2f units at (%.17g, %.17g)\n", p->name, function_names[t->function],
                  t->low, t->high, worst, a[at], b[at]);
    assert_true(worst >= 0 && worst <= t->most);
}

static void run_trials(const precision *p, double least, double most)
{
    const double depth = -least, range = most;
    const double tail = sqrt(depth);
    const trial trials[] = {
        {NB_ELEMENTARY_exp, true_exp, EVENLY, least, most, 1.5, 0},
        {NB_ELEMENTARY_exp, true_exp, EVENLY, -1, 1, 1.5, 0},
        {NB_ELEMENTARY_exp, true_exp, BOTH_SIGNS, -range, 0, 1.5, 0},
        {NB_ELEMENTARY_expm1, true_expm1, EVENLY, -60, most, 2, 0},
        {NB_ELEMENTARY_expm1, true_expm1, EVENLY, -2, 2, 2, 0},
        {NB_ELEMENTARY_expm1, true_expm1, BOTH_SIGNS, -range, 2, 2, 0},
        {NB_ELEMENTARY_one_minus_exp, true_one_minus_exp, EVENLY, 0, 3, 2, 0},
        {NB_ELEMENTARY_one_minus_exp, true_one_minus_exp, LOGARITHMICALLY, -range, range, 2, 0},
        {NB_ELEMENTARY_exp_ratio, true_exp_ratio, EVENLY, -3, 3, 2, 0},
        {NB_ELEMENTARY_exp_ratio, true_exp_ratio, EVENLY, -most, 0, 2, 0},
        {NB_ELEMENTARY_exp_ratio, true_exp_ratio, LOGARITHMICALLY, -range, range, 2, 0},
        {NB_ELEMENTARY_log, true_log, LOGARITHMICALLY, -range, range, 2, 0},
        {NB_ELEMENTARY_log, true_log, EVENLY, 0.5, 2, 2, 0},
        {NB_ELEMENTARY_log, true_log, LOGARITHMICALLY, -0.01, 0.01, 2, 0},
        {NB_ELEMENTARY_log1p, true_log1p, EVENLY, -1, 3, 2, 0},
        {NB_ELEMENTARY_log1p, true_log1p, LOGARITHMICALLY, -range, range, 2, 0},
        {NB_ELEMENTARY_log1p, true_log1p, BOTH_SIGNS, -range, -1e-6, 2, 0},
        {NB_ELEMENTARY_exp_minus_square, true_exp_minus_square, EVENLY, -tail, tail, 2, 0},
        {NB_ELEMENTARY_erfcx, true_erfcx, EVENLY, 0, 10, 4, 0},
        {NB_ELEMENTARY_erfcx, true_erfcx, LOGARITHMICALLY, -range, 69, 4, 0},
        {NB_ELEMENTARY_erfc, true_erfc, EVENLY, -5, tail, 5, 0},
        {NB_ELEMENTARY_erfc, true_erfc, EVENLY, 0, 3, 5, 0},
        {NB_ELEMENTARY_erf, true_erf, EVENLY, -5, 5, 2, 0},
        {NB_ELEMENTARY_erf, true_erf, BOTH_SIGNS, -range, 2, 2, 0},
        {NB_ELEMENTARY_gauss_integral, true_gauss_integral, EVENLY, 0, 3, 8, 1},
        {NB_ELEMENTARY_gauss_integral, true_gauss_integral, EVENLY, -tail, tail, 8, 1},
        {NB_ELEMENTARY_gauss_integral, true_gauss_integral, BOTH_SIGNS, -20, 4, 8, 1},
        {NB_ELEMENTARY_gauss_integral, true_gauss_integral, BOTH_SIGNS, -range / 4, range / 4, 8, 1},
    };
    seed_random(1);
    for (size_t i = 0; i < sizeof trials / sizeof *trials; ++i) run_trial(p, &trials[i]);
}

static void float_functions_are_exact_to_a_few_units(void **state)
{
    (void)state;
    run_trials(&float_precision, -87.336, 88.029);
}

static void double_functions_are_exact_to_a_few_units(void **state)
{
    (void)state;
    run_trials(&double_precision, -708.39, 709.08);
}

/* ---- hostile numbers ------------------------------------------------------------------------- */

static double once(const precision *p, nb_elementary function, double a, double b)
{
    double as[NB_ELEMENTARY_BLOCK], bs[NB_ELEMENTARY_BLOCK], results[NB_ELEMENTARY_BLOCK];
    for (int i = 0; i < NB_ELEMENTARY_BLOCK; ++i) {
        as[i] = a;
        bs[i] = b;
    }
    p->evaluate(function, NB_ELEMENTARY_BLOCK, as, bs, results);
    return results[0];
}

static void assert_value(const precision *p, nb_elementary function, double a, double b, double wanted)
{
    const double got = once(p, function, a, b);
    const int same = got == wanted && signbit(got) == signbit(wanted);
    if (!same && !(isnan(got) && isnan(wanted)))
        fail_msg("%s %s(%.9g, %.9g) is %.17g, wanted %.17g", p->name, function_names[function], a, b, got, wanted);
}

static void check_limits(const precision *p)
{
    const double top = p->is_float ? 0x1p127 : 0x1p1023, huge = p->is_float ? (double)1e30f : 1e30;
    const double tiny = p->is_float ? 0x1p-149 : 0x1p-1074;
    const double last = p->is_float ? (double)FLT_MAX : DBL_MAX;
    assert_value(p, NB_ELEMENTARY_exp, 0, 0, 1);
    assert_value(p, NB_ELEMENTARY_exp, -HUGE_VAL, 0, 0);
    assert_value(p, NB_ELEMENTARY_exp, -last, 0, 0);
    assert_true(fabs(once(p, NB_ELEMENTARY_exp, HUGE_VAL, 0) / top - 1) < 1e-4);
    assert_value(p, NB_ELEMENTARY_expm1, -HUGE_VAL, 0, -1);
    assert_value(p, NB_ELEMENTARY_expm1, tiny, 0, tiny);
    assert_value(p, NB_ELEMENTARY_one_minus_exp, 0, 0, 0);
    assert_value(p, NB_ELEMENTARY_one_minus_exp, HUGE_VAL, 0, 1);
    assert_value(p, NB_ELEMENTARY_exp_ratio, 0, 0, 1);
    assert_value(p, NB_ELEMENTARY_exp_ratio, -0.0, 0, 1);
    assert_value(p, NB_ELEMENTARY_exp_ratio, tiny, 0, 1);
    assert_value(p, NB_ELEMENTARY_exp_ratio, 0x1p100, 0, 0x1p-100);
    assert_value(p, NB_ELEMENTARY_exp_ratio, HUGE_VAL, 0, 0);
    assert_value(p, NB_ELEMENTARY_log, 1, 0, 0);
    assert_value(p, NB_ELEMENTARY_log, 0, 0, -huge);
    assert_value(p, NB_ELEMENTARY_log, -1, 0, -huge);
    assert_value(p, NB_ELEMENTARY_log, -HUGE_VAL, 0, -huge);
    assert_value(p, NB_ELEMENTARY_log1p, 0, 0, 0);
    assert_value(p, NB_ELEMENTARY_log1p, -1, 0, -huge);
    assert_value(p, NB_ELEMENTARY_log1p, tiny, 0, tiny);
    assert_value(p, NB_ELEMENTARY_erf, HUGE_VAL, 0, 1);
    assert_value(p, NB_ELEMENTARY_erf, -1e18, 0, -1);
    assert_value(p, NB_ELEMENTARY_erf, -0.0, 0, -0.0);
    assert_value(p, NB_ELEMENTARY_erfc, HUGE_VAL, 0, 0);
    assert_value(p, NB_ELEMENTARY_erfc, -HUGE_VAL, 0, 2);
    assert_value(p, NB_ELEMENTARY_erfcx, 0, 0, 1);
    assert_value(p, NB_ELEMENTARY_gauss_integral, 3, 3, 0);
    assert_value(p, NB_ELEMENTARY_gauss_integral, 1e18, 1e18, 0);
    assert_value(p, NB_ELEMENTARY_gauss_integral, -1e18, -1e17, 0);
    assert_true(fabs(once(p, NB_ELEMENTARY_gauss_integral, -1e18, 1e18) - 1.7724538509055160273) < 3e-7);
    assert_true(fabs(once(p, NB_ELEMENTARY_gauss_integral, -1e18, 0) - 0.88622692545275801365) < 2e-7);
    assert_value(p, NB_ELEMENTARY_min, 1, nan(""), nan(""));
    assert_value(p, NB_ELEMENTARY_min, nan(""), 1, 1);
    assert_value(p, NB_ELEMENTARY_min, -0.0, 0, 0);
    assert_value(p, NB_ELEMENTARY_max, 0, -0.0, -0.0);
    assert_value(p, NB_ELEMENTARY_floor, -0.25, 0, -1);
    assert_value(p, NB_ELEMENTARY_floor, 0.75, 0, 0);
    assert_value(p, NB_ELEMENTARY_floor, -0.0, 0, -0.0);
    assert_value(p, NB_ELEMENTARY_floor, -1e18, 0, p->is_float ? (double)-1e18f : -1e18);
    assert_value(p, NB_ELEMENTARY_sign_one, -0.0, 0, -1);
    assert_value(p, NB_ELEMENTARY_sign_one, 0, 0, 1);
    assert_value(p, NB_ELEMENTARY_rcp_bounded, -2, 0, -0.5);
    assert_true(once(p, NB_ELEMENTARY_rcp_bounded, 0, 0) <= huge &&
                once(p, NB_ELEMENTARY_rcp_bounded, 0, 0) > 0.999 * huge);
    assert_true(once(p, NB_ELEMENTARY_rcp_bounded, -0.0, 0) == -once(p, NB_ELEMENTARY_rcp_bounded, 0, 0));
}

static void limits_are_what_the_comments_say(void **state)
{
    (void)state;
    check_limits(&float_precision);
    check_limits(&double_precision);
}

static void a_nan_passes_through(void **state)
{
    (void)state;
    for (int function = NB_ELEMENTARY_exp; function <= NB_ELEMENTARY_gauss_integral; ++function) {
        assert_value(&float_precision, (nb_elementary)function, nan(""), nan(""), nan(""));
        assert_value(&double_precision, (nb_elementary)function, nan(""), nan(""), nan(""));
    }
    assert_value(&float_precision, NB_ELEMENTARY_clamp, nan(""), 1, nan(""));
    assert_value(&float_precision, NB_ELEMENTARY_rcp_bounded, nan(""), 0, nan(""));
    assert_value(&float_precision, NB_ELEMENTARY_wide_rcp, nan(""), 0, nan(""));
    assert_value(&float_precision, NB_ELEMENTARY_floor, nan(""), 0, nan(""));
}

/* No result of exp lies between 0 and the smallest normal number, so flushing processors agree with others. */
static void exp_is_never_subnormal(void **state)
{
    (void)state;
    static double a[SAMPLES], result[SAMPLES];
    for (int i = 0; i < SAMPLES; ++i) a[i] = (double)(float)(-87.2 - 0.3 * i / SAMPLES);
    evaluate_float(NB_ELEMENTARY_exp, SAMPLES, a, a, result);
    for (int i = 0; i < SAMPLES; ++i) {
        assert_true(result[i] == 0 || result[i] >= (double)FLT_MIN);
        if (result[i] == 0) assert_true(exp(a[i]) < (double)FLT_MIN);
    }
}

/* ---- instruction sets ------------------------------------------------------------------------ */

typedef struct level {
    const char *name;
    nb_elementary_float *evaluate, *evaluate_fast;
    nb_elementary_lanes *lanes, *lanes_fast;
    int present;
} level;

#define LEVEL(name, present)                                                                                           \
    {                                                                                                                  \
#name, nb_elementary_##name, nb_elementary_##name##_fast, nb_elementary_lanes_##name,                          \
            nb_elementary_lanes_##name##_fast, (present)                                                               \
    }

/* The levels of this build, scalar first; returns how many. */
static size_t list_levels(level levels[4])
{
    const level all[] = {
        LEVEL(scalar, 1),
#ifdef NB_HAVE_SSE2
        LEVEL(sse2, 1),
#endif
#ifdef NB_HAVE_AVX2
        LEVEL(avx2, __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")),
#endif
#ifdef NB_HAVE_AVX512
        LEVEL(avx512, __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")),
#endif
#ifdef NB_HAVE_NEON
        LEVEL(neon, 1),
#endif
    };
    size_t count = 0;
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i) {
        if (all[i].present)
            levels[count++] = all[i];
        else
            print_message("this processor has no %s: not compared\n", all[i].name);
    }
    return count;
}

static const float special_numbers[] = {
    0.0f,        1.0f,       0.5f,       2.0f,        3.0f,        1e-45f,      1e-40f,     FLT_MIN,    FLT_MAX,
    1e18f,       1e30f,      1e-30f,     FLT_EPSILON, 0.34657359f, 0.34657362f, 1.0397208f, 0.9999999f, 1.0000001f,
    0.70710677f, 1.4142135f, 0.4f,       0.6f,        32.0f,       60.0f,       87.33654f,  87.33655f,  88.02968f,
    88.0297f,    9.3f,       8388607.5f, 8388608.0f,  4194303.5f,  16777216.0f, 1e6f,       INFINITY,   NAN,
};
enum { SPECIAL_COUNT = sizeof special_numbers / sizeof *special_numbers };

static float special_number(size_t i)
{
    const float x = special_numbers[i / 2 % SPECIAL_COUNT];
    return i & 1 ? -x : x;
}

/* All pairs of special numbers, then a third each of any bits, of moderate numbers, of nearly equal ones. */
static void fill_pairs(float a[SAMPLES], float b[SAMPLES])
{
    const size_t specials = 2 * SPECIAL_COUNT;
    for (size_t i = 0; i < SAMPLES; ++i) {
        const uint32_t bits[2] = {(uint32_t)random_bits(), (uint32_t)random_bits()};
        const double x = exp(-20 + 26 * random_unit()), y = exp(-20 + 26 * random_unit());
        memcpy(&a[i], &bits[0], sizeof a[i]);
        memcpy(&b[i], &bits[1], sizeof b[i]);
        if (i < specials * specials) {
            a[i] = special_number(i % specials);
            b[i] = special_number(i / specials);
        } else if (i % 3 == 1) {
            a[i] = (float)(bits[0] & 1 ? x : -x);
            b[i] = (float)(bits[1] & 1 ? y : -y);
        } else if (i % 3 == 2) {
            a[i] = (float)(bits[0] & 1 ? x : -x);
            b[i] = a[i] * (float)(1 + y * 1e-3);
        }
    }
}

static int same_bits(float a, float b)
{
    return (isnan(a) && isnan(b)) || memcmp(&a, &b, sizeof a) == 0;
}

static void compare(nb_elementary function, const char *name, nb_elementary_float *scalar, nb_elementary_float *other)
{
    static float a[SAMPLES], b[SAMPLES], wanted[SAMPLES], got[SAMPLES];
    seed_random((uint64_t)function + 100);
    fill_pairs(a, b);
    scalar(function, SAMPLES, a, b, wanted);
    other(function, SAMPLES, a, b, got);
    for (size_t i = 0; i < SAMPLES; ++i)
        if (!same_bits(wanted[i], got[i]))
            fail_msg("%s %s(%.9g, %.9g): %.9g, scalar %.9g", name, function_names[function], (double)a[i], (double)b[i],
                     (double)got[i], (double)wanted[i]);
}

static void every_instruction_set_gives_the_same_bits(void **state)
{
    (void)state;
    level levels[4];
    const size_t count = list_levels(levels);
    for (size_t i = 1; i < count; ++i)
        for (int f = 0; f < NB_ELEMENTARY_COUNT; ++f) {
            compare((nb_elementary)f, levels[i].name, levels[0].evaluate, levels[i].evaluate);
            compare((nb_elementary)f, levels[i].name, levels[0].evaluate_fast, levels[i].evaluate_fast);
        }
}

/* Where nothing is wide, the fast and the exact build are the same arithmetic. */
static void fast_differs_only_in_wide_arithmetic(void **state)
{
    (void)state;
    for (int f = 0; f < NB_ELEMENTARY_wide_sqrt; ++f)
        compare((nb_elementary)f, "fast", nb_elementary_scalar, nb_elementary_scalar_fast);
}

static void lanes_and_masks_hold_together(void **state)
{
    (void)state;
    level levels[4];
    const size_t count = list_levels(levels);
    assert_null(nb_elementary_lanes_reference());
    for (size_t i = 0; i < count; ++i) {
        const char *fault = levels[i].lanes();
        if (!fault) fault = levels[i].lanes_fast();
        if (fault) fail_msg("%s: %s", levels[i].name, fault);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(float_functions_are_exact_to_a_few_units),
        cmocka_unit_test(double_functions_are_exact_to_a_few_units),
        cmocka_unit_test(limits_are_what_the_comments_say),
        cmocka_unit_test(a_nan_passes_through),
        cmocka_unit_test(exp_is_never_subnormal),
        cmocka_unit_test(every_instruction_set_gives_the_same_bits),
        cmocka_unit_test(fast_differs_only_in_wide_arithmetic),
        cmocka_unit_test(lanes_and_masks_hold_together),
    };
    make_rule();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
