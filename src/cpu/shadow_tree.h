/* The triangles of a geometry as lights see them: what shadow each one casts, in a tree of boxes.
 *
 * In a frame whose third axis points away from the sun the shadow of a triangle is a prism without end: within the
 * three edges as they look from the sun, and behind the triangle. It is cut out of a ray by four planes, so that the
 * ends of shadows on a ray are found as exactly as floats allow, whatever the size of what casts them: there is no map
 * whose texels could be too coarse. That of a lamp is a pyramid without end, and is cut out by four planes, too; they
 * are made where they are wanted, so that one tree, in the frame of the geometry, serves all lamps. */
#ifndef NB_CPU_SHADOW_TREE_H
#define NB_CPU_SHADOW_TREE_H

#include "geometry.h"

enum {
    NB_SHADOW_FAN = 4,    /* children of a node, triangles of a leaf */
    NB_SHADOW_LEVELS = 16 /* at most */
};

/* A place p is in shadow where plane[0..2] . p + plane[3] >= 0 for each: those of the edges, and that of the triangle.
 */
typedef struct nb_prism {
    float planes[4][4];
} nb_prism;

/* A triangle that casts a shadow, in the frame of the tree. */
typedef struct nb_caster {
    float corner[3][3];
} nb_caster;

/* One with holes: its mask over places in its plane, or, in a tree for the sun, before and behind it as well. */
typedef struct nb_sheet {
    const nb_mask *mask;
    double place[3], at[2]; /* a corner, in the frame of the tree, and there in texels */
    double slope[2][3];     /* texels per metre */
} nb_sheet;

/* Boxes around the triangles below each child; the sun's shadows have no end at the third side. Missing children
 * begin at 1e30 of the third axis. */
typedef struct nb_shadow_node {
    float low[3][NB_SHADOW_FAN], high[3][NB_SHADOW_FAN];
} nb_shadow_node;

typedef struct nb_shadow_tree {
    double sun[3], origin[3]; /* of the geometry, when this was built; sun 0: for lamps */
    int is_built;
    float axes[3][3];   /* of the frame, in the world */
    size_t count;       /* of triangles, leaf after leaf */
    nb_prism *prisms;   /* for the sun, else NULL */
    nb_caster *casters; /* for lamps, else NULL */
    uint32_t *numbers;  /* of each triangle's sheet, or NB_NONE; NULL: no triangle has holes */
    nb_sheet *sheets;
    void *nodes;
    int level_count;
    nb_shadow_node *levels[NB_SHADOW_LEVELS]; /* parts of `nodes`, those above leaves first; the last has one node */
    size_t node_counts[NB_SHADOW_LEVELS];
} nb_shadow_tree;

/* Builds for a sun in this direction, of length 1, or keeps what is built where that is for the same sun and place.
 * Errors: MEMORY; there is no tree then. */
nebel_result nb_shadow_tree_set_sun(nb_shadow_tree *tree, const nb_geometry *geometry, const double sun[3],
                                    int threads);

/* The same for all lamps. */
nebel_result nb_shadow_tree_set_lamps(nb_shadow_tree *tree, const nb_geometry *geometry, int threads);

/* NULL: the triangle has no holes. */
static inline const nb_sheet *nb_shadow_tree_sheet(const nb_shadow_tree *tree, size_t triangle)
{
    return tree->numbers == NULL || tree->numbers[triangle] == NB_NONE ? NULL : &tree->sheets[tree->numbers[triangle]];
}

/* A plane of this normal through the point; scaled so that products with coordinates stay numbers. */
void nb_shadow_plane(const double normal[3], const double point[3], float plane[4]);

void nb_shadow_tree_free(nb_shadow_tree *tree, const nebel_allocator *allocator);

#endif
