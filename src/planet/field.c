#include "field.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Spherical harmonics of a direction x, y, z that are even in y, as polynomials: those of one order follow each other. The
 * squares of those of one order integrate to 4 pi / (2 order + 1), and the sum of their products for two directions is
 * Legendre's polynomial of the angle between. */
static void basis(int orders, double x, double level2, double z, double values[NB_FIELD])
{
    double side = 1, last_side = 0, first = 1, norm = 2; /* (x + i y)^m, real part; (2 m - 1)!!; 2 / (2 m)! */
    for (int m = 0; m < orders; m++) {
        double p = first, before = 0, scale = norm;
        for (int l = m; l < orders; l++) {
            values[l * (l + 1) / 2 + m] = p * side * (m > 0 ? sqrt(scale) : 1);
            const double next = ((2 * l + 1) * z * p - (l + m) * before) / (l + 1 - m);
            before = p;
            p = next;
            scale *= (l + 1.0 - m) / (l + 1.0 + m);
        }
        const double next_side = m == 0 ? x : 2 * x * side - level2 * last_side;
        last_side = side;
        side = next_side;
        first *= 2 * m + 1;
        norm /= (2 * m + 1) * (2 * m + 2);
    }
}

/* Where the sun is in the zenith all sides are alike: what tells them apart is 0. */
static void basis_of(int orders, nb_aspect aspect, double values[NB_FIELD])
{
    const double side2 = 1 - aspect.height_of_sun * aspect.height_of_sun;
    if (!(side2 > 1e-12)) {
        basis(orders, 0, 0, aspect.zenith, values);
        return;
    }
    const double level2 = fmax(0, 1 - aspect.zenith * aspect.zenith), level = sqrt(level2);
    const double x = (aspect.sun - aspect.height_of_sun * aspect.zenith) / sqrt(side2);
    basis(orders, fmax(-level, fmin(level, x)), level2, aspect.zenith, values);
}

void nb_field_add(nb_field *field, int orders, nb_aspect from, const double light[3])
{
    double values[NB_FIELD];
    basis_of(orders, from, values);
    for (int i = 0; i < orders * (orders + 1) / 2; i++)
        for (int c = 0; c < 3; c++) field->moments[i][c] += values[i] * light[c];
}

/* What air gives of the moments of one order, 1/m. */
static double weigh(const nb_airs *airs, const double density[], int order, int c)
{
    double sum = 0;
    for (int k = 0; k < airs->count; k++)
        sum += airs->airs[k].scattering[c] * density[k] * airs->airs[k].moments[order];
    return (2 * order + 1) / (4 * PI) * sum;
}

void nb_field_scatter(const nb_field *field, int orders, const nb_airs *airs, const double density[], nb_aspect toward,
                      double radiance[3])
{
    double values[NB_FIELD];
    basis_of(orders, toward, values);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int order = 0, i = 0; order < orders; order++) {
            double part = 0;
            for (int m = 0; m <= order; m++, i++) part += values[i] * field->moments[i][c];
            sum += weigh(airs, density, order, c) * part;
        }
        radiance[c] = fmax(0, sum);
    }
}

/* As if the next order's moments were as large as those of the last one. */
void nb_field_missing(const nb_field *field, int orders, const nb_airs *airs, const double density[],
                      double radiance[3])
{
    const int first = (orders - 1) * orders / 2;
    for (int c = 0; c < 3; c++) {
        double square = 0;
        for (int i = first; i < first + orders; i++) square += field->moments[i][c] * field->moments[i][c];
        radiance[c] = fabs(weigh(airs, density, orders, c)) * sqrt(square);
    }
}
