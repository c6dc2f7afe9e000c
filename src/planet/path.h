/* Nodes along a ray through air, at which what scatters towards its start is summed. */
#ifndef NB_PLANET_PATH_H
#define NB_PLANET_PATH_H

#include "air.h"
#include "rule.h"

enum {
    NB_PATH_CUTS = 20,
    NB_PATH_MOST = (2 * NB_MOST_SHELLS + 2 + NB_PATH_CUTS) * NB_RULE_MOST,
};

typedef struct nb_path_node {
    double s;                /* m from the start */
    double radius;           /* m from the planet's centre */
    double weight;           /* m */
    double transmittance[3]; /* from the start to here */
    double density[NEBEL_MAX_AIRS];
} nb_path_node;

typedef struct nb_path {
    int count;
    nb_path_node nodes[NB_PATH_MOST];
    double transmittance[3]; /* of the whole ray */
} nb_path;

/* The ray must stay within the air for `length`. It is cut where it is lowest, where it passes shells of air, and at
 * `cuts`, at most NB_PATH_CUTS places in any order; those outside the ray do not count. */
void nb_path_lay(const nb_airs *airs, const nb_rule *rule, nb_track track, double length, int cut_count,
                 const double cuts[], nb_path *path);

#endif
