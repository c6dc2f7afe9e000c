#include "gauss_rule.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Legendre's polynomials of the orders 0 to count at x. */
static void legendre(int count, double x, double values[])
{
    values[0] = 1;
    values[1] = x;
    for (int k = 2; k <= count; k++) values[k] = ((2 * k - 1) * x * values[k - 1] - (k - 1) * values[k - 2]) / k;
}

static double slope(int count, double x, const double values[])
{
    return count * (values[count - 1] - x * values[count]) / (1 - x * x);
}

/* Newton's steps to the root, from Tricomi's first guess. */
static double find_node(int count, int index, double values[])
{
    double x = -cos(PI * (index + 0.75) / (count + 0.5));
    for (int step = 0; step < 8; step++) {
        legendre(count, x, values);
        x -= values[count] / slope(count, x, values);
    }
    legendre(count, x, values);
    return x;
}

/* The integral up to a node: of the polynomial through the nodes, which is a sum of Legendre's, whose integrals are
 * (P_k+1 - P_k-1) / (2 k + 1). */
nb_gauss_rule nb_gauss_rule_make(int count)
{
    nb_gauss_rule rule = {.count = count};
    double values[NB_MAX_RULE][NB_MAX_RULE + 1];
    for (int i = 0; i < count; i++) {
        const double x = rule.nodes[i] = find_node(count, i, values[i]), s = slope(count, x, values[i]);
        rule.weights[i] = 2 / ((1 - x * x) * s * s);
    }
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            double sum = 1 + rule.nodes[i];
            for (int k = 1; k < count; k++) sum += values[j][k] * (values[i][k + 1] - values[i][k - 1]);
            rule.before[i][j] = 0.5 * rule.weights[j] * sum;
        }
    return rule;
}
