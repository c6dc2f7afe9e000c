/* The triangles of a geometry in a tree of boxes, for the shadows that they cast in the light of point lights. Such a
 * shadow is a pyramid without end, cut out of a ray by four planes, which are made where they are wanted: one tree
 * serves all point lights. That of the sun's light is in sun_cells.h. */
#ifndef NB_CPU_SHADOW_BVH_H
#define NB_CPU_SHADOW_BVH_H

#include "occluders.h"

enum {
    NB_SHADOW_FAN = 4,    /* children of a node, triangles of a leaf */
    NB_SHADOW_LEVELS = 16 /* at most */
};

/* Boxes around the triangles below each child. Missing children begin at 1e30 of the third axis. */
typedef struct nb_shadow_node {
    float low[3][NB_SHADOW_FAN], high[3][NB_SHADOW_FAN];
} nb_shadow_node;

typedef struct nb_shadow_tree {
    double origin[3]; /* of the geometry, when this was built */
    int is_built;
    size_t count; /* of triangles, leaf after leaf */
    nb_occluder *casters;
    uint32_t *numbers; /* as in nb_occluders */
    nb_masked_occluder *sheets;
    void *nodes;
    int level_count;
    nb_shadow_node *levels[NB_SHADOW_LEVELS]; /* parts of `nodes`, those above leaves first; the last has one node */
    size_t node_counts[NB_SHADOW_LEVELS];
} nb_shadow_tree;

/* Builds, or keeps what is built where that is for the same place. Errors: MEMORY; there is no tree then. */
nebel_result nb_shadow_tree_set_lights(nb_shadow_tree *tree, const nb_geometry *geometry, int threads);

/* NULL: the triangle has no holes. */
static inline const nb_masked_occluder *nb_shadow_tree_sheet(const nb_shadow_tree *tree, size_t triangle)
{
    return tree->numbers == NULL || tree->numbers[triangle] == NB_NONE ? NULL : &tree->sheets[tree->numbers[triangle]];
}

void nb_shadow_tree_free(nb_shadow_tree *tree, const nebel_allocator *allocator);

#endif
