/* A bounding volume hierarchy: which of very many boxes may a few rays touch? */
#ifndef NB_FOG_BVH_H
#define NB_FOG_BVH_H

#include "base/base.h"

typedef struct nb_aabb {
    double low[3], high[3]; /* finite, low <= high; may be flat */
} nb_aabb;

/* 32 bytes, two siblings to a cache line. The box is relative to the tree's origin and rounded outwards. */
typedef struct nb_bvh_node {
    float low[3];
    uint32_t index; /* inner: the first of two neighbouring children; leaf: NB_BVH_LEAF | the number of the box */
    float high[3];
    uint32_t unused;
} nb_bvh_node;

#define NB_BVH_LEAF 0x80000000u

/* The first NB_BVH_SPLIT_DEPTH levels split where the surface area heuristic says (four million scattered boxes need
 * 26), all deeper ones in equal halves, and there are at most 2^30 boxes: no path is longer than NB_BVH_SPLIT_DEPTH +
 * ceil(log2 n) and thus NB_BVH_DEPTH - 2. A traversal, which holds at most one waiting sibling for each level and one
 * child more, fits a stack of NB_BVH_DEPTH. */
#define NB_MAX_BVH_BOXES 0x40000000u
#define NB_BVH_SPLIT_DEPTH 32
#define NB_BVH_DEPTH (NB_BVH_SPLIT_DEPTH + 32)

typedef struct nb_bvh {
    double origin[3];
    double extent; /* no coordinate of a box is further than this from the origin, along any axis */
    nb_bvh_node *nodes;
    size_t node_count; /* 0: no boxes */
} nb_bvh;

/* Builds the tree over boxes[0..n-1]; the same boxes give the same tree. *out owns memory of `allocator` (resolved);
 * free it with nb_bvh_free. On an error *out is empty. Cost O(n log n). Errors: VALUE (a box that is not finite or
 * inside out), LIMIT (more than NB_MAX_BVH_BOXES), MEMORY. */
nebel_result nb_bvh_build(const nebel_allocator *allocator, const nb_aabb *boxes, size_t n, nb_bvh *out);

void nb_bvh_free(const nebel_allocator *allocator, nb_bvh *bvh);

#define NB_BVH_LANES 16

/* What all lanes of a walk have in common along one axis: a box that these ranges miss is missed by every lane. */
typedef struct nb_bvh_beam {
    double entry_origin[2], leave_origin[2]; /* least and largest */
    double inverse[2];
    int sign; /* of every lane's direction; 0: they differ, and the axis tells nothing */
} nb_bvh_beam;

/* A walk through the tree. Less than 2 KiB; lives on the stack of the caller; nothing to free. */
typedef struct nb_bvh_cursor {
    const nb_bvh_node *nodes;
    int lane_count;
    int last_hit; /* the lane that hit last most likely hits again */
    int depth;
    nb_bvh_beam beam[3];
    double beam_t_max;
    /* Per axis and active lane: the origin as the lower and as the upper faces see it, moved by the padding of bvh.c.
     */
    double below[3][NB_BVH_LANES], above[3][NB_BVH_LANES], inverse[3][NB_BVH_LANES], t_max[NB_BVH_LANES];
    uint32_t stack[NB_BVH_DEPTH];
} nb_bvh_cursor;

/* Starts a walk for up to NB_BVH_LANES ray segments origin + t direction, 0 <= t <= t_max, of which those with a bit
 * set in `active` count. origin[axis][lane] in metres, inverse[axis][lane] = 1 / direction, where a direction of 0
 * gives any number of 1e30 to 1e200; t_max[lane] >= 0, may be infinite. Direction and inverse may be off by four
 * roundings. Values of inactive lanes are not read. */
void nb_bvh_begin(nb_bvh_cursor *cursor, const nb_bvh *bvh, int lane_count, unsigned active,
                  const double (*origin)[NB_BVH_LANES], const double (*inverse)[NB_BVH_LANES], const double *t_max);

/* The same for one ray. */
void nb_bvh_begin_ray(nb_bvh_cursor *cursor, const nb_bvh *bvh, const double origin[3], const double inverse[3],
                      double t_max);

/* The next box that some active segment may touch, in *index: 1; or 0 when there is none left. Every box that a segment
 * touches comes exactly once, whatever rounding does; boxes that it misses by a hair may come too. The order is that of
 * the tree, the same for every ray. */
int nb_bvh_next(nb_bvh_cursor *cursor, uint32_t *index);

#endif
