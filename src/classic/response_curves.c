/* Response curves in double, from the one formula text. */
#include <nebel/classic.h>

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

nebel_result nebel_resolve_curve(const nebel_curve *curve, nebel_curve *resolved)
{
    if (curve == NULL || resolved == NULL || (unsigned)curve->type >= NEBEL_CURVE_COUNT) return NEBEL_ERROR_ARGUMENT;
    if (curve->type == NEBEL_CURVE_TABLE && curve->table == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!isfinite(curve->scale) || curve->scale < 0) return NEBEL_ERROR_VALUE;
    *resolved = *curve;
    if (curve->scale == 0)
        resolved->scale = curve->type == NEBEL_CURVE_EXP ? .03 : curve->type == NEBEL_CURVE_EXP2 ? .04 : .05;
    return NEBEL_OK;
}

/* The last entry belongs to 1: the last interval is closed at both ends. The weights of both entries are exact there,
 * so that the ends of the table are, too. */
static double look_up(const float *table, double x)
{
    const int last = NEBEL_CURVE_ENTRIES - 1;
    const double place = nb_clamp(x, 0, 1) * last;
    const int i = place < last ? (int)place : last - 1;
    const double w = place - i;
    return (1 - w) * (double)table[i] + w * (double)table[i + 1];
}

double nebel_compute_curve_amount(const nebel_curve *resolved, double s)
{
    if (resolved == NULL || (resolved->type == NEBEL_CURVE_TABLE && resolved->table == NULL)) return 0;
    const double x = s > 0 ? resolved->scale * s : 0;
    switch (resolved->type) {
    case NEBEL_CURVE_LINEAR:
        return x;
    case NEBEL_CURVE_EXP:
        return nb_expm1(x);
    case NEBEL_CURVE_EXP2:
        return nb_expm1(x * x);
    case NEBEL_CURVE_TABLE:
        return look_up(resolved->table, x);
    default:
        return nb_one_minus_exp(x);
    }
}

double nebel_compute_curve_weight(const nebel_curve *resolved, double s)
{
    return nb_min(nb_max(nebel_compute_curve_amount(resolved, s), 0), 1); /* in an order that loses a NaN */
}
