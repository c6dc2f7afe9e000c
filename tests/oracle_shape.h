/* The oracle's geometry: where a line is inside a shape. */
#ifndef ORACLE_SHAPE_H
#define ORACLE_SHAPE_H

#include <nebel/nebel.h>

/* 113 bits of mantissa: two digits are left of a chord whose ray touches a sphere to 1e-30. */
#if defined(__SIZEOF_FLOAT128__) && !defined(__aarch64__)
__extension__ typedef __float128 oracle_real;
#else
typedef long double oracle_real;
#endif

typedef struct oracle_line {
    oracle_real o[3], d[3];
} oracle_line;

/* Ascending, apart; `to` of the last may be infinite. */
typedef struct oracle_span {
    oracle_real from, to;
} oracle_span;

typedef struct oracle_spans {
    size_t count, capacity;
    oracle_span *at;
} oracle_spans;

/* The pieces of o + t d, 0 <= t <= end, inside the shape. *undecided is set when the line lies in a surface. Free `at`.
 */
oracle_spans oracle_inside(const nebel_shape *shape, const oracle_line *line, oracle_real end, int *undecided);

/* The line in the coordinates that the shape's members are given in. */
oracle_line oracle_to_local(const nebel_transform *transform, const oracle_line *line);

/* A point between a and b, of which b may be infinite. */
oracle_real oracle_between(oracle_real a, oracle_real b);

int oracle_contains(const oracle_spans *spans, oracle_real t);

oracle_real oracle_sqrt(oracle_real x);
oracle_real oracle_dot(const oracle_real a[3], const oracle_real b[3]);

/* An array with room for one element more, or the end of the program. */
void *oracle_grow(void *array, size_t count, size_t *capacity, size_t size);

/* For qsort: oracle_real ascending. */
int oracle_ascending(const void *a, const void *b);

#endif
