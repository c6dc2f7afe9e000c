/* A volume as the core keeps it: checked, every default resolved, every shape a set of convex leaves in frames of their
 * own.
 *
 * A leaf gives one interval on a ray. Unions and intersections are a postfix program over the leaves' membership, so
 * that the partition of a ray needs no algebra of intervals: it evaluates the program between two neighbouring events.
 */
#ifndef NB_MEDIUM_VOLUME_H
#define NB_MEDIUM_VOLUME_H

#include "phase.h"

#include "base/base.h"
#include "formulas/quad.h"

#include <nebel/nebel.h>

#include <math.h>

typedef enum nb_leaf_type {
    NB_LEAF_WORLD,
    NB_LEAF_PLANES,   /* n.x <= d for each plane */
    NB_LEAF_BOX,      /* low <= x < high */
    NB_LEAF_SPHERE,   /* |x| <= radius */
    NB_LEAF_CYLINDER, /* x^2 + y^2 <= 1, 0 <= z <= 1 */
    NB_LEAF_CONE,     /* x^2 + y^2 <= (radius + slope z)^2, 0 <= z <= 1 */
    NB_LEAF_CAPSULE   /* within 1 of the z axis from 0 to length */
} nb_leaf_type;

/* normal.x <= distance, the largest component of the normal within 0.5 and 1. `tie` decides for rays that lie in the
 * face: the body with tie < 0 owns it, so that of two bodies that touch there exactly one does. The plane is sharp
 * where arithmetic in double finds the side of every point that is a double. */
typedef struct nb_face {
    double normal[3], distance, tie;
    double inverse_length; /* of the normal */
    int is_sharp;
} nb_face;

typedef struct nb_leaf {
    nb_leaf_type type;
    int aligned;                                                 /* the matrix is the identity, */
    int in_place;                                                /* and the origin 0 */
    double origin[3];                                            /* local = matrix (world - origin) */
    double origin_rest[3];                                       /* what rounding to double took from the origin */
    double origin_error;                                         /* what resolving and rounding may have lost of it */
    double matrix[9];                                            /* row by row */
    long double exact_origin[3], exact_rest[3], exact_matrix[9]; /* the same for the double reference */
    nb_quad quad_origin[3], quad_matrix[9];                      /* the same as resolved */
    double resolved_error;                                       /* what resolving may have lost of the origin */
    double scale;                                                /* largest row length of the matrix */
    double size;                                                 /* of the body in any coordinates of its frame */
    double low[3], high[3];                                      /* box */
    double radius, slope;                                        /* ball, cone */
    double length;                                               /* capsule */
    long double exact_radius, exact_slope, exact_length;
    nb_quad quad_radius, quad_slope, quad_length;
    size_t first_face, face_count; /* planes: into the volume's faces */
} nb_leaf;

/* A postfix program over leaf membership: LEAF pushes the next leaf, the others fold the two topmost results into one.
 */
typedef enum nb_shape_op { NB_OP_LEAF, NB_OP_UNION, NB_OP_INTERSECTION } nb_shape_op;

/* The deepest stack a program needs. */
#define NB_STEP_STACK (NEBEL_MAX_SHAPE_NESTING + 2)

/* The numbers of a soft edge, see nb_round_edge in formulas/profiles.inc. */
typedef struct nb_soft_edge {
    double gain, steepness, inner;
} nb_soft_edge;

/* How far under its base fog that thins out with the altitude is as thick as it gets, 1e18, in scale heights. */
#define NB_GROWTH_DEPTH 41.446531673892822

typedef struct nb_volume {
    nebel_operation operation;
    int64_t rank; /* one that covers takes away the fog of every lower rank: see nb_volume_covers */
    nebel_density density;
    nb_soft_edge edge; /* soft edges of round bodies */
    double extinction[3], source[3], albedo[3], emission[3];
    int lit; /* albedo rather than source */
    nb_phase phase;
    nebel_phase described_phase; /* the same as it was given */
    size_t leaf_count, face_count, step_count;
    nb_leaf *leaves;
    nb_face *faces;
    nb_shape_op *steps;
    double low[3], high[3]; /* world bounds, infinite where unbounded */
    double start, cutoff;   /* m along a ray; cutoff is infinite where there is none */
} nb_volume;

/* Checks `desc` and resolves it into *volume, whose arrays are one allocation owned by the caller (nb_volume_free).
 * On an error nothing is allocated. Errors: ARGUMENT, VALUE, LIMIT, MEMORY. */
nebel_result nb_volume_resolve(const nebel_allocator *allocator, const nebel_log *log, const nebel_volume_desc *desc,
                               nb_volume *volume);

static inline int nb_volume_has_fog(const nb_volume *volume)
{
    return volume->operation != NEBEL_OPERATION_EXCLUDE;
}

/* Radiance per metre where the density is 1. */
static inline double nb_volume_glow(const nb_volume *volume, int channel)
{
    return volume->emission[channel] + (volume->lit ? 0 : volume->source[channel] * volume->extinction[channel]);
}

static inline int nb_volume_is_endless(const nb_volume *volume)
{
    for (int i = 0; i < 3; i++)
        if (!isfinite(volume->low[i]) || !isfinite(volume->high[i])) return 1;
    return 0;
}

static inline int nb_volume_covers(const nb_volume *volume)
{
    return volume->operation != NEBEL_OPERATION_ADD;
}

static inline int nb_volume_has_distances(const nb_volume *volume)
{
    return volume->start > 0 || volume->cutoff <= NEBEL_MAX_LENGTH;
}

/* How the soft edge of a round body is made: the forms of formulas/profiles.inc. */
static inline int nb_leaf_edge_form(const nb_leaf *leaf)
{
    return leaf->type == NB_LEAF_SPHERE ? 0 : leaf->type == NB_LEAF_CAPSULE ? 2 : 1;
}

/* A copy with arrays of its own. 0 when memory is out. */
int nb_volume_copy(const nebel_allocator *allocator, const nb_volume *from, nb_volume *to);

void nb_volume_free(const nebel_allocator *allocator, nb_volume *volume);

/* A total order on what volumes are, whatever the order they were added in: the canonical order of summation. By rank
 * first, and what covers before what does not. */
int nb_volume_compare(const nb_volume *a, const nb_volume *b);

#endif
