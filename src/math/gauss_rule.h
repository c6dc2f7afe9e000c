/* Gauss's rule of quadrature, with the integral up to each of its nodes. */
#ifndef NB_MATH_GAUSS_RULE_H
#define NB_MATH_GAUSS_RULE_H

enum { NB_MAX_RULE = 8 };

typedef struct nb_gauss_rule {
    int count;
    double nodes[NB_MAX_RULE]; /* -1..1, ascending */
    double weights[NB_MAX_RULE];
    double before[NB_MAX_RULE][NB_MAX_RULE]; /* [i][j]: weights of the nodes j for the integral from -1 to node i */
} nb_gauss_rule;

/* count: 2 to NB_MAX_RULE. */
nb_gauss_rule nb_gauss_rule_make(int count);

#endif
