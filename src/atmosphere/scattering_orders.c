#include "scattering_orders.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Reduced rank extrapolation (Mesina 1977; Eddy 1979): what rounds bring is of few kinds, each of which gets smaller by a part of its
 * own. Weights of sum 1 that make rounds' gains cancel each other also lead what rounds have come to towards their end, as Krylov's
 * methods do; light that is scattered a thousand times needs some tens of rounds. */

/* Of the brightest light: what is darker counts less. */
#define DARK 1e-4

/* Of a round's gain, what the next one brings. */
#define MOST_PART 0.9999

/* Of a colour, for two rounds' gains: the mean of their product over all entries, in parts of the light there. */
typedef double nb_products[NB_MAX_ROUNDS][NB_MAX_ROUNDS];

static double gain(const nb_scattering_table tables[], int round, size_t entry, int c)
{
    return tables[round + 1].fields[entry].moments[0][c] - tables[round].fields[entry].moments[0][c];
}

static void multiply(int count, const nb_scattering_table tables[], int c, nb_products products)
{
    double most = DBL_MIN;
    memset(products, 0, sizeof(nb_products));
    for (size_t e = 0; e < nb_scattering_table_entries(tables); e++)
        most = fmax(most, tables[count].fields[e].moments[0][c]);
    for (size_t e = 0; e < nb_scattering_table_entries(tables); e++) {
        const double all = tables[count].fields[e].moments[0][c] + DARK * most;
        double parts[NB_MAX_ROUNDS];
        for (int i = 0; i < count; i++) parts[i] = gain(tables, i, e, c) / all;
        for (int i = 0; i < count; i++)
            for (int j = 0; j <= i; j++)
                products[i][j] += parts[i] * parts[j] / (double)nb_scattering_table_entries(tables);
    }
    for (int i = 0; i < count; i++)
        for (int j = i + 1; j < count; j++) products[i][j] = products[j][i];
}

/* Solves for a right side of ones by Cholesky's method. Gains that are those of others, but for rounding, count no more. */
static void solve(int count, nb_products matrix, double x[])
{
    for (int i = 0; i < count; i++) {
        double sum = 1;
        for (int j = 0; j < i; j++) {
            for (int k = 0; k < j; k++) matrix[i][j] -= matrix[i][k] * matrix[j][k];
            matrix[i][j] = matrix[j][j] > 0 ? matrix[i][j] / matrix[j][j] : 0;
            sum -= matrix[i][j] * x[j];
        }
        const double whole = matrix[i][i];
        for (int k = 0; k < i; k++) matrix[i][i] -= matrix[i][k] * matrix[i][k];
        matrix[i][i] = matrix[i][i] > 1e-12 * whole ? sqrt(matrix[i][i]) : 0;
        x[i] = matrix[i][i] > 0 ? sum / matrix[i][i] : 0;
    }
    for (int i = count - 1; i >= 0; i--) {
        for (int j = i + 1; j < count; j++) x[i] -= matrix[j][i] * x[j];
        x[i] = matrix[i][i] > 0 ? x[i] / matrix[i][i] : 0;
    }
}

/* The weights of rounds. Returns which part of all the gains are that are left, in the root of the mean square. */
static double find_weights(int count, nb_products products, double weights[])
{
    nb_products matrix;
    double sum = 0, square = 0;
    memcpy(matrix, products, sizeof matrix);
    solve(count, matrix, weights);
    for (int i = 0; i < count; i++) sum += weights[i];
    for (int i = 0; i < count; i++) weights[i] = sum > 0 ? weights[i] / sum : i == count - 1;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) square += weights[i] * weights[j] * products[i][j];
    return sqrt(fmax(0, square));
}

static void mix(int count, const double numbers[], const double weights[], double *sum)
{
    *sum = 0;
    for (int i = 0; i < count; i++) *sum += weights[i] * numbers[i];
}

/* Where a mix has hardly any light the last round is better. */
static void mix_field(int count, const nb_scattering_table tables[], size_t entry, int c, const double weights[],
                      nb_radiance_moments *all)
{
    const nb_radiance_moments *last = &tables[count].fields[entry];
    double numbers[NB_MAX_ROUNDS];
    for (int m = 0; m < NB_FIELD; m++) {
        for (int i = 0; i < count; i++) numbers[i] = tables[i + 1].fields[entry].moments[m][c];
        mix(count, numbers, weights, &all->moments[m][c]);
    }
    if (!(all->moments[0][c] > 0.5 * last->moments[0][c]))
        for (int m = 0; m < NB_FIELD; m++) all->moments[m][c] = last->moments[m][c];
}

static void mix_ground(int count, const nb_scattering_table tables[], int sun, int c, const double weights[],
                       double *ground)
{
    double numbers[NB_MAX_ROUNDS];
    for (int i = 0; i < count; i++) numbers[i] = tables[i + 1].ground[sun][c];
    mix(count, numbers, weights, ground);
    if (!(*ground > 0.5 * numbers[count - 1])) *ground = numbers[count - 1];
}

double nb_orders_extrapolate(int count, const nb_scattering_table tables[], double slowest[3], nb_scattering_table *all)
{
    double missing = 0;
    for (int c = 0; c < 3; c++) {
        nb_products products;
        double weights[NB_MAX_ROUNDS];
        multiply(count, tables, c, products);
        const double left = find_weights(count, products, weights);
        const double last = products[count - 1][count - 1], before = products[count - 2][count - 2];
        if (before > 0) slowest[c] = fmin(MOST_PART, fmax(slowest[c], sqrt(last / before)));
        missing = fmax(missing, left * slowest[c] / (1 - slowest[c]));
        for (size_t e = 0; e < nb_scattering_table_entries(all); e++)
            mix_field(count, tables, e, c, weights, &all->fields[e]);
        for (int s = 0; s < all->suns; s++) mix_ground(count, tables, s, c, weights, &all->ground[s][c]);
    }
    return missing;
}
