/* Standard fog factors as a state: checked, completed, evaluated. */
#include "classic/factors.h"

#include <math.h>
#include <stddef.h>

static int is_known(const nebel_factor_desc *d)
{
    return (unsigned)d->mode < NEBEL_FACTOR_COUNT && (unsigned)d->coordinate < NEBEL_COORDINATE_COUNT &&
           (unsigned)d->stage < NEBEL_STAGE_COUNT;
}

nebel_result nebel_resolve_factor(const nebel_factor_desc *desc, nebel_factor_desc *resolved)
{
    if (desc == NULL || resolved == NULL || !is_known(desc)) return NEBEL_ERROR_ARGUMENT;
    nebel_factor_desc d = *desc;
    if (!isfinite(d.start) || !isfinite(d.end) || !isfinite(d.density) || d.density < 0) return NEBEL_ERROR_VALUE;
    for (int c = 0; c < 3; c++)
        if (!isfinite(d.color[c])) return NEBEL_ERROR_VALUE;
    if (d.start == 0 && d.end == 0) d.end = 1;
    if (d.density == 0) d.density = 1;
    *resolved = d;
    return NEBEL_OK;
}

/* hypot of a NaN and an infinity would be infinite. */
static double length_of(const double v[3])
{
    for (int c = 0; c < 3; c++)
        if (isnan(v[c])) return v[c];
    return hypot(hypot(v[0], v[1]), v[2]);
}

double nebel_compute_fog_coordinate(const nebel_factor_desc *resolved, const double place[3], double user)
{
    if (resolved == NULL || (place == NULL && resolved->coordinate != NEBEL_COORDINATE_USER)) return 0;
    switch (resolved->coordinate) {
    case NEBEL_COORDINATE_RADIAL:
        return length_of(place);
    case NEBEL_COORDINATE_USER:
        return user;
    default:
        return fabs(place[2]);
    }
}

static double evaluate_mode(const nebel_factor_desc *d, double c)
{
    if (d->mode == NEBEL_FACTOR_EXP) return nebel_fog_factor_exp(c, d->density);
    if (d->mode == NEBEL_FACTOR_EXP2) return nebel_fog_factor_exp2(c, d->density);
    if (d->stage == NEBEL_STAGE_VERTEX && d->start == d->end) return 0;
    return nebel_fog_factor_linear(c, d->start, d->end);
}

double nb_factor_evaluate(const nebel_factor_desc *d, double c)
{
    const double f = isnan(c) ? 1 : evaluate_mode(d, c);
    return isnan(f) ? 1 : f;
}

double nebel_compute_fog_factor(const nebel_factor_desc *resolved, double c)
{
    if (resolved == NULL) return 1;
    return nb_factor_evaluate(resolved, c);
}

void nebel_blend_fog_factor(double f, const float surface[4], const double fog[3], float out[4])
{
    if (surface == NULL || fog == NULL || out == NULL) return;
    const double factor = isnan(f) ? 1 : f;
    for (int c = 0; c < 3; c++) out[c] = (float)(factor * (double)surface[c] + (1 - factor) * fog[c]);
    out[3] = surface[3];
}
