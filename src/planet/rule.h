/* Gauss's rule of quadrature, with the integral up to each of its nodes. */
#ifndef NB_PLANET_RULE_H
#define NB_PLANET_RULE_H

enum { NB_RULE_MOST = 8 };

typedef struct nb_gauss_rule {
    int count;
    double nodes[NB_RULE_MOST]; /* -1..1, ascending */
    double weights[NB_RULE_MOST];
    double before[NB_RULE_MOST][NB_RULE_MOST]; /* [i][j]: weights of the nodes j for the integral from -1 to node i */
} nb_gauss_rule;

/* count: 2 to NB_RULE_MOST. */
nb_gauss_rule nb_rule_make(int count);

#endif
