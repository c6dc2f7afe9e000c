/* Where lines are inside shapes, by brute force in double: the geometry of the oracle of lit fog. */
#ifndef LIT_SHAPE_H
#define LIT_SHAPE_H

#include <nebel/nebel.h>

typedef struct lit_line {
    double o[3], d[3];
} lit_line;

/* Empty unless enter < leave. */
typedef struct lit_span {
    double enter, leave;
} lit_span;

/* A shape without parts, and the way from the world into its coordinates. */
typedef struct lit_leaf {
    const nebel_shape *shape;
    int is_moved;
    double rows[3][4];
} lit_leaf;

/* Adds the leaves of a shape in the order of its tree. */
void lit_list_leaves(const nebel_shape *shape, lit_leaf *leaves, size_t max_count, size_t *count);

lit_line lit_to_local(const lit_leaf *leaf, const lit_line *world);

lit_span lit_meet(lit_span a, lit_span b);

/* Where value + rate t <= 0. */
lit_span lit_below(double value, double rate);

lit_span lit_in_sphere(const lit_line *l, const double center[3], double radius);

/* The line is the world's. */
lit_span lit_in_leaf(const lit_leaf *leaf, const lit_line *world);

static inline double lit_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#endif
