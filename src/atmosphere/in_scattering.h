/* What comes to a ray at its nodes, one kernel per instruction set. */
#ifndef NB_ATMOSPHERE_IN_SCATTERING_H
#define NB_ATMOSPHERE_IN_SCATTERING_H

#include "ray_quadrature.h"
#include "multiple_scattering.h"

enum {
    NB_GATHER_NODES = 64, /* at a time */
};

/* For a sun of irradiance 1, what reaches the start of the ray from each node, whose weight is counted: sunlight, for a
 * scattering of 1/m and a phase function of 1; light scattered by all air after that of the table; and about what of this
 * is missing for want of moments, and in twilight for want of entries. */
typedef struct nb_node_light {
    double sun[3][NB_GATHER_NODES], often[3][NB_GATHER_NODES], missing[3][NB_GATHER_NODES];
    /* Where there is smooth air: sunlight with what peaks turn of it on its way, and how often in the mean those turn what is scattered. */
    double radiance[3][NB_GATHER_NODES]; /* of the table at the node itself, in the ray's direction */
    double ahead[3][NB_GATHER_NODES], turns[3][NB_GATHER_NODES];
    double lit[3][NB_GATHER_NODES];  /* sunlight that smooth air scatters: `ahead`, or without peaks behind the node */
    double mean[3][NB_GATHER_NODES]; /* the first moment of the table there, as it comes to the start */
} nb_node_light;

/* What nb_stray_add adds, so that it is not counted elsewhere: light that peaks turn on the way from a node to the start; and
 * sunlight that they turned before it comes to a node. */
typedef enum nb_strays { NB_STRAYS_NONE = 0, NB_STRAYS, NB_STRAYS_AND_BENDS } nb_strays;

typedef struct nb_gather_job {
    const nb_air_components *airs;
    const nb_air_components *smooth;    /* what light scattered often is scattered by, if it is not `airs`; else NULL */
    const nb_scattering_table *scatter; /* NULL: sunlight alone */
    int wants_sun;
    nb_strays strays;
    nb_atmosphere_ray track;
    nb_moment_basis aspect;            /* of the ray's direction, where it starts */
    double rest[NEBEL_MAX_COMPONENTS]; /* by nb_gather_aim, else 0: nothing is missing */
    const nb_ray_nodes *path;
    int first, count; /* nodes; first: a multiple of NB_PATH_LANES */
} nb_gather_job;

/* To be called once for each ray that scatters light of a table: finds what orders behind those that are kept give towards it. */
void nb_gather_aim(nb_gather_job *job);

typedef void nb_gather_fn(const nb_gather_job *job, nb_node_light *light);

nb_gather_fn nb_gather_scalar, nb_gather_sse2, nb_gather_avx2, nb_gather_avx512, nb_gather_neon;

/* The kernel of an instruction set, or for DEFAULT of the best one; NULL where this build or processor has not got it. */
nb_gather_fn *nb_gather_choose(nebel_isa isa);

#endif
