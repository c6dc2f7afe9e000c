/* One level of formula_level.h; NB_LEVEL is its name, the macros of prelude.h say what it is. */
#include "formula_level.h"

#include "formulas/prelude.h"
#include "formulas/elementary.inc"
#include "formulas/shapes.inc"
#include "formulas/profiles.inc"
#include "formulas/medium.inc"
#include "formulas/phase.inc"
#include "formulas/point_light.inc"

#define JOIN_EXPANDED(a, b) a##b
#define JOIN(a, b) JOIN_EXPANDED(a, b)

typedef struct outputs {
    nb_wide v[NB_FORMULA_OUTPUTS];
} outputs;

static outputs of_interval(nb_interval i)
{
    return (outputs){{i.enter, i.leave, i.enter_slack, i.leave_slack}};
}

static outputs of_estimate(nb_estimate e)
{
    return (outputs){{nb_widen(e.value), nb_widen(e.error), 0, 0}};
}

static outputs of_wide(nb_wide x)
{
    return (outputs){{x, 0, 0, 0}};
}

static outputs of_real(nb_real x)
{
    return of_wide(nb_widen(x));
}

static nb_interval interval(nb_wide enter, nb_wide leave, nb_wide enter_slack, nb_wide leave_slack)
{
    return (nb_interval){enter, leave, enter_slack, leave_slack};
}

static outputs evaluate(nb_formula formula, const nb_wide a[NB_FORMULA_INPUTS])
{
    const nb_wide a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3], a4 = a[4], a5 = a[5], a6 = a[6], a7 = a[7];
    const nb_wide a9 = a[9], a10 = a[10], a11 = a[11], a12 = a[12], a13 = a[13];
    const nb_real r0 = nb_narrow(a0), r1 = nb_narrow(a1), r2 = nb_narrow(a2), r3 = nb_narrow(a3);
    const nb_wvec3 v0 = nb_wvec3(a0, a1, a2), v3 = nb_wvec3(a3, a4, a5), v6 = nb_wvec3(a6, a7, a[8]);
    const nb_wvec3 v9 = nb_wvec3(a9, a10, a11);
    switch (formula) {
#define CASE(name, expression)                                                                                         \
    case NB_FORMULA_##name:                                                                                            \
        return expression;
        NB_FORMULAS(CASE)
#undef CASE
    case NB_FORMULA_COUNT:
        break;
    }
    return of_wide(0);
}

void JOIN(nb_formula_, NB_LEVEL)(nb_formula formula, const long double in[NB_FORMULA_INPUTS],
                                 long double out[NB_FORMULA_OUTPUTS])
{
    nb_wide rounded[NB_FORMULA_INPUTS];
    for (int i = 0; i < NB_FORMULA_INPUTS; ++i) rounded[i] = (nb_wide)in[i];
    const outputs result = evaluate(formula, rounded);
    for (int i = 0; i < NB_FORMULA_OUTPUTS; ++i) out[i] = (long double)result.v[i];
}
