/* The triangles of a geometry as the sun sees them: what shadow each one casts, in a tree of boxes.
 *
 * In a frame whose third axis points away from the sun the shadow of a triangle is a prism without end: within the
 * three edges as they look from the sun, and behind the triangle. It is cut out of a ray by four planes, so that the
 * ends of shadows on a ray are found as exactly as floats allow, whatever the size of what casts them: there is no map
 * whose texels could be too coarse. */
#ifndef NB_CPU_SUN_TREE_H
#define NB_CPU_SUN_TREE_H

#include "geometry.h"

enum {
    NB_SUN_FAN = 4,    /* children of a node, prisms of a leaf */
    NB_SUN_LEVELS = 16 /* at most */
};

/* A place p is in shadow where plane[0..2] . p + plane[3] >= 0 for each: those of the edges, and that of the triangle.
 */
typedef struct nb_prism {
    float planes[4][4];
} nb_prism;

/* Boxes around the shadows below each child: without an end away from the sun. Missing children begin at 1e30. */
typedef struct nb_sun_node {
    float low[2][NB_SUN_FAN], high[2][NB_SUN_FAN], first[NB_SUN_FAN];
} nb_sun_node;

typedef struct nb_sun_tree {
    double sun[3], origin[3]; /* of the geometry, when this was built */
    int is_built;
    float axes[3][3]; /* of the frame, in the world */
    size_t prism_count;
    nb_prism *prisms; /* leaf after leaf */
    void *nodes;
    int level_count;
    nb_sun_node *levels[NB_SUN_LEVELS]; /* parts of `nodes`, those above leaves first; the last has one node */
    size_t node_counts[NB_SUN_LEVELS];
} nb_sun_tree;

/* Builds for a sun in this direction, of length 1, or keeps what is built where that is for the same sun and place.
 * Errors: MEMORY; there is no tree then. */
nebel_result nb_sun_tree_set(nb_sun_tree *tree, const nb_geometry *geometry, const double sun[3], int threads);

void nb_sun_tree_free(nb_sun_tree *tree, const nebel_allocator *allocator);

#endif
