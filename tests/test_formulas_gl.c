/* Shapes, profiles and media in GLSL 3.30 and GLSL ES 3.00 against the C build that has floats alone as GLSL does:
 * within 1e-5, or within what the function itself says that it may be off (slack, error) where rays graze and digits
 * cancel. */
#include "formula_inputs.h"
#include "gl_harness.h"
#include "unit.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COUNT = 1 << 13, INPUT_VECTORS = NB_FORMULA_INPUTS / 4 };

enum { ENTER, LEAVE, ENTER_SLACK, LEAVE_SLACK };
enum { VALUE, ERROR };

static const struct {
    const char *name, *expression;
} formulas[] = {
#define ROW(name, expression) {#name, #expression},
    NB_FORMULAS(ROW)
#undef ROW
};

static const char functions[] =
    "vec4 of_interval(nb_interval i) { return vec4(i.enter, i.leave, i.enter_slack, i.leave_slack); }\n"
    "vec4 of_estimate(nb_estimate e) { return vec4(e.value, e.error, 0.0, 0.0); }\n"
    "vec4 of_wide(float x) { return vec4(x, 0.0, 0.0, 0.0); }\n"
    "vec4 of_real(float x) { return vec4(x, 0.0, 0.0, 0.0); }\n"
    "nb_interval interval(float enter, float leave, float enter_slack, float leave_slack)\n"
    "{\n"
    "    nb_interval i;\n"
    "    i.enter = enter; i.leave = leave; i.enter_slack = enter_slack; i.leave_slack = leave_slack;\n"
    "    return i;\n"
    "}\n";

static const char arguments[] =
    "float a0 = in0.x, a1 = in0.y, a2 = in0.z, a3 = in0.w, a4 = in1.x, a5 = in1.y, a6 = in1.z, a7 = in1.w;\n"
    "float a8 = in2.x, a9 = in2.y, a10 = in2.z, a11 = in2.w, a12 = in3.x, a13 = in3.y;\n"
    "float r0 = a0, r1 = a1, r2 = a2, r3 = a3;\n"
    "vec3 v0 = vec3(a0, a1, a2), v3 = vec3(a3, a4, a5), v6 = vec3(a6, a7, a8), v9 = vec3(a9, a10, a11);\n";

static float items[COUNT][NB_FORMULA_INPUTS], got[COUNT][NB_FORMULA_OUTPUTS], wanted[COUNT][NB_FORMULA_OUTPUTS];

static void fill(nb_formula formula)
{
    nb_formula_dice dice = {(unsigned)formula};
    for (int i = 0; i < COUNT; ++i) {
        long double in[NB_FORMULA_INPUTS], out[NB_FORMULA_OUTPUTS];
        nb_formula_draw(&dice, formula, NB_DIGITS_FLOAT, in);
        nb_formula_fast(formula, in, out);
        for (int k = 0; k < NB_FORMULA_INPUTS; ++k) items[i][k] = (float)in[k];
        for (int k = 0; k < NB_FORMULA_OUTPUTS; ++k) wanted[i][k] = (float)out[k];
    }
}

/* ---- what may differ ------------------------------------------------------------------------- */

typedef struct worst {
    double relative; /* where the tolerance is 1e-5 */
    double share;    /* of what the function says that it may be off, elsewhere */
    double ratio;    /* of the tolerance, whichever it was */
    int at, component;
} worst;

static void note(worst *w, int at, int component, double difference, double size, double may)
{
    const double tolerance = fmax(1e-5 * size + (double)FLT_MIN, may);
    const double ratio = isnan(difference) ? HUGE_VAL : difference / tolerance;
    if (tolerance > may && ratio * 1e-5 > w->relative) w->relative = ratio * 1e-5;
    if (tolerance <= may && ratio > w->share) w->share = ratio;
    if (ratio <= w->ratio) return;
    w->ratio = ratio, w->at = at, w->component = component;
}

static int is_miss(const float *interval)
{
    return interval[ENTER] >= 1e17f || interval[LEAVE] <= -1e17f;
}

/* A body that one has and the other misses is no longer than its slack. The slacks themselves agree within a factor
 * of 2. */
static void compare_intervals(worst *w, int i)
{
    const float *c = wanted[i], *g = got[i];
    if (is_miss(c) != is_miss(g)) {
        const float *hit = is_miss(c) ? g : c;
        note(w, i, ENTER, fmax((double)(hit[LEAVE] - hit[ENTER]), 0), 0, (double)(hit[ENTER_SLACK] + hit[LEAVE_SLACK]));
        return;
    }
    for (int k = ENTER; k <= LEAVE; ++k) {
        const float *slack = &c[k + ENTER_SLACK], *other = &g[k + ENTER_SLACK];
        note(w, i, k, fabs((double)(g[k] - c[k])), fabs((double)c[k]), (double)fmaxf(*slack, *other));
        note(w, i, k + ENTER_SLACK, fabs((double)(*other - *slack)), 0, (double)*slack);
    }
}

static void compare_estimates(worst *w, int i)
{
    const double c = (double)wanted[i][VALUE], g = (double)got[i][VALUE];
    const double error = (double)wanted[i][ERROR];
    note(w, i, VALUE, fabs(g - c), fabs(c), error);
    note(w, i, ERROR, fabs((double)got[i][ERROR] - error), error * 100, 0);
}

/* Where a difference of squares or of distances is left, the tolerance counts from what was subtracted. */
static double size_of(nb_formula formula, int i)
{
    const float *in = items[i];
    const double value = fabs((double)wanted[i][VALUE]);
    switch (formula) {
    case NB_FORMULA_radial_1_density:
    case NB_FORMULA_radial_2_density:
    case NB_FORMULA_radial_3_density:
        return fmax((double)in[0], (double)in[1] * (double)in[1]);
    case NB_FORMULA_soft_axis:
    case NB_FORMULA_soft_edge_density:
        return fmax(value, (double)fmaxf(in[6], fmaxf(in[7], in[8])));
    case NB_FORMULA_turn_cosine:
        return 1;
    default:
        return value;
    }
}

static worst compare(nb_formula formula)
{
    worst w = {0, 0, 0, 0, 0};
    for (int i = 0; i < COUNT; ++i) {
        if (formula <= NB_FORMULA_capsule)
            compare_intervals(&w, i);
        else if (formula <= NB_FORMULA_soft_edge_integral)
            compare_estimates(&w, i);
        else
            note(&w, i, VALUE, fabs((double)(got[i][VALUE] - wanted[i][VALUE])), size_of(formula, i), 0);
    }
    return w;
}

static void report(nb_formula formula, const char *language, const worst *w)
{
    print_message("%s %s: %.1e relative, %.2f of what it says\n", language, formulas[formula].name, w->relative,
                  w->share);
    if (w->ratio <= 1) return;
    for (int k = 0; k < 13; ++k) print_message(" %.9g", (double)items[w->at][k]);
    for (int k = 0; k < 4; ++k) print_message("\n C %.9g GLSL %.9g", (double)wanted[w->at][k], (double)got[w->at][k]);
    fail_msg("component %d differs by %.2f of what is allowed", w->component, w->ratio);
}

/* Or nothing would have been compared. */
static void expect_hits(nb_formula formula)
{
    int hits = 0;
    for (int i = 0; i < COUNT; ++i) hits += wanted[i][ENTER] < wanted[i][LEAVE];
    if (formula <= NB_FORMULA_capsule) assert_true(hits > COUNT / 6);
}

static void check_language(nb_gl_language language, const char *name)
{
    nb_gl gl;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    for (int f = 0; f < NB_FORMULA_COUNT; ++f) {
        char body[2048];
        snprintf(body, sizeof body, "%sout0 = %s;\n", arguments, formulas[f].expression);
        fill((nb_formula)f);
        const unsigned program = nb_gl_compile(&gl, functions, body, INPUT_VECTORS, 1);
        if (!program || !nb_gl_evaluate(&gl, program, COUNT, &items[0][0], &got[0][0])) fail_msg("%s", gl.fault);
        expect_hits((nb_formula)f);
        const worst w = compare((nb_formula)f);
        report((nb_formula)f, name, &w);
    }
    nb_gl_close(&gl);
}

static void glsl_330_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_330, "330");
}

static void glsl_es_300_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_300ES, "300 es");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glsl_330_agrees_with_c),
        cmocka_unit_test(glsl_es_300_agrees_with_c),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
