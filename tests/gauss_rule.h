/* The 10-point Gauss-Legendre rule. */
#ifndef GAUSS_RULE_H
#define GAUSS_RULE_H

#include <math.h>

/* Nodes and weights on -1..1, by Newton's method on the recurrence: after make_rule. */
enum { RULE_POINTS = 10 };
static long double rule_nodes[RULE_POINTS], rule_weights[RULE_POINTS];

static inline void make_rule(void)
{
    for (int i = 0; i < RULE_POINTS; ++i) {
        long double x = cosl(3.14159265358979323846264338327950288L * (i + 0.75L) / (RULE_POINTS + 0.5L)), slope = 1;
        for (int round = 0; round < 20; ++round) {
            long double before = 1, here = x;
            for (int n = 1; n < RULE_POINTS; ++n) {
                const long double next = ((2 * n + 1) * x * here - n * before) / (n + 1);
                before = here;
                here = next;
            }
            slope = RULE_POINTS * (x * here - before) / (x * x - 1);
            x -= here / slope;
        }
        rule_nodes[i] = x;
        rule_weights[i] = 2 / ((1 - x * x) * slope * slope);
    }
}

#endif
