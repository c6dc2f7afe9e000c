/* A primitive shape and the transform above it, as a leaf in a frame of its own, with its bounds in the world. */
#ifndef NB_MEDIUM_LEAF_H
#define NB_MEDIUM_LEAF_H

#include "affine_quad.h"
#include "volume.h"

/* `faces` has room for what a convex body or half space needs, beginning at `first_face` of the volume. Bounds enclose
 * the body in spite of rounding. Errors: VALUE (a transform that is singular, an empty convex body). */
nebel_result nb_leaf_resolve(const nebel_log *log, const nebel_shape *shape, const nb_affine_quad *world,
                             nb_face *faces, size_t first_face, nb_leaf *leaf, double low[3], double high[3]);

#endif
