/* What clouds have left of light along a ray, and sent along it, and the few places between which both change evenly. */
#ifndef NB_CLOUDS_CLOUD_NODES_H
#define NB_CLOUDS_CLOUD_NODES_H

#include <nebel/planet.h>

/* Up to a place: e to the minus optical depth, of all scattering and of what leads away; and the light of so many stretches, of it
 * apart what comes through all clouds on the ray, as if none of it were lost. */
typedef struct nb_cloud_node {
    double t, left, left_apart, light[3], ahead[3];
    int stretches;
} nb_cloud_node;

/* So far. Begins with nothing but left and left_apart, which are 1. */
typedef struct nb_cloud_node_builder {
    double depth, apart, left, left_apart;
    double light[3], ahead[3];
    int asked, lit;        /* stretches whose light was asked for, and has come */
    double end;            /* of the last cloud */
    nb_cloud_node gap_end; /* the end of the last long gap between clouds */
    uint32_t count;
    nb_cloud_node nodes[NEBEL_MAX_CLOUD_NODES];
} nb_cloud_node_builder;

/* Cloud begins at t, behind a gap or none. */
void nb_cloud_nodes_enter(nb_cloud_node_builder *tally, double t);
/* Cloud of such optical depths, up to t. */
void nb_cloud_nodes_pass(nb_cloud_node_builder *tally, double t, double depth, double apart);
/* A stretch ends at t. */
void nb_cloud_nodes_leave(nb_cloud_node_builder *tally, double t);
/* Light of the first stretch that has none yet, for all that lies behind it. */
void nb_cloud_nodes_light(nb_cloud_node_builder *tally, const double light[3], const double ahead[3]);
/* Nothing follows, and all light has come; so much comes through all clouds. Sets all but the error. */
void nb_cloud_nodes_end(nb_cloud_node_builder *tally, double through, nebel_cloud_transfer *nodes);

#endif
