#include "radiance_moments.h"

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "radiance_moments_lanes.h"

void nb_radiance_moments_add(nb_radiance_moments *field, int orders, nb_moment_basis from, const double light[3])
{
    double values[NB_FIELD];
    nb_basis_of(orders, (nb_moment_basis_lanes){from.zenith, from.sun, from.height_of_sun}, values);
    for (int i = 0; i < orders * (orders + 1) / 2; i++)
        for (int c = 0; c < 3; c++) field->moments[i][c] += values[i] * light[c];
}
