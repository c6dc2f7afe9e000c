/* Nodes along a ray through air, at which what scatters towards its start is summed. */
#ifndef NB_ATMOSPHERE_RAY_QUADRATURE_H
#define NB_ATMOSPHERE_RAY_QUADRATURE_H

#include "optical_depth.h"
#include "math/gauss_rule.h"

enum {
    NB_PATH_CUTS = 22,
    NB_PATH_HALVINGS = 24,
    NB_PATH_LANES = 8,
    NB_PATH_PIECES = 2 * NB_MAX_SHELLS + 2 + NB_PATH_CUTS + NB_PATH_HALVINGS,
    NB_MAX_PATH = NB_PATH_PIECES * NB_MAX_RULE + NB_PATH_LANES,
};

/* Nodes in arrays, for kernels that take several at once. Behind the last one is another at the start of the ray, of weight
 * 1, and copies of that up to a multiple of NB_PATH_LANES. */
typedef struct nb_ray_nodes {
    int count;
    double s[NB_MAX_PATH];                /* m from the start */
    double radius[NB_MAX_PATH];           /* m from the planet's centre */
    double weight[NB_MAX_PATH];           /* m */
    double transmittance[3][NB_MAX_PATH]; /* from the start to here */
    double smooth[3][NB_MAX_PATH];        /* the same of smooth air; not set where the path was laid without */
    double density[NEBEL_MAX_COMPONENTS][NB_MAX_PATH];
    double left[3]; /* transmittance of the whole ray */
    /* Where there is smooth air: the ends of pieces, cuts among them, and transmittance up to there, of all air and of smooth air. */
    int ends;
    double end[NB_PATH_PIECES], end_left[3][NB_PATH_PIECES], end_smooth[3][NB_PATH_PIECES];
} nb_ray_nodes;

/* The ray must stay within the air for `length`. It is cut where it is lowest, where it passes shells of air, and at
 * `cuts`, at most NB_PATH_CUTS places in any order; those outside the ray do not count. smooth: nb_air_components_smooth of the airs, or NULL. */
void nb_ray_nodes_lay(const nb_air_components *airs, const nb_air_components *smooth, const nb_gauss_rule *rule,
                      nb_atmosphere_ray track, double length, int cut_count, const double cuts[], nb_ray_nodes *path);

#endif
