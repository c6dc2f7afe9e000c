/* Vectors of three doubles. */
#ifndef NB_MATH_VECTOR_H
#define NB_MATH_VECTOR_H

#include <math.h>
#include <string.h>

static inline double nb_vector_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* `out` must be another than a and b. */
static inline int nb_vector_is_zero(const double v[3])
{
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

static inline double nb_vector_largest(const double v[3])
{
    return fmax(v[0], fmax(v[1], v[2]));
}

static inline void nb_vector_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double nb_vector_length(const double v[3])
{
    return sqrt(nb_vector_dot(v, v));
}

/* Scales to unit length, first by the largest component so that no square overflows. 0 where there is no direction, or a number is none. */
static inline int nb_vector_make_unit(double v[3])
{
    const double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(largest > 0) || !isfinite(v[0]) || !isfinite(v[1]) || !isfinite(v[2])) return 0;
    for (int i = 0; i < 3; i++) v[i] /= largest;
    const double length = nb_vector_length(v);
    for (int i = 0; i < 3; i++) v[i] /= length;
    return 1;
}

/* Without the last digits of a direction of length 1, which two renderers have from other sums, so that what hangs on all digits,
 * such as where walks through clouds halve their pieces, is the same in both, but for one ray of ten thousand. Across 20,000 km they
 * are a third of a millimetre. */
static inline void nb_vector_round(double v[3])
{
    for (int c = 0; c < 3; c++) v[c] = round(v[c] * 0x1p36) * 0x1p-36;
}

/* A direction of length 1 at right angles to another. */
static inline void nb_vector_perpendicular(const double v[3], double aside[3])
{
    const int is_by_x = fabs(v[0]) < fabs(v[1]);
    const double axis[3] = {is_by_x, !is_by_x, 0};
    nb_vector_cross(v, axis, aside);
    (void)nb_vector_make_unit(aside);
}

/* The middle of a ball, of its highest place. */
static inline void nb_sphere_center_below(const double highest[3], double radius, double middle[3])
{
    for (int c = 0; c < 3; c++) middle[c] = highest[c] - (c == 1 ? radius : 0);
}

/* How far a place is above a ball, of which it is so far from the middle. Within 1e-12 of the radius, where rounding does not say on
 * which side of it, it is just above. */
static inline double nb_height_above_sphere(double far, double radius)
{
    const double on = 1e-12 * radius;
    return fabs(far - radius) <= on ? on : far - radius;
}

/* What a quaternion x y z w of any length, 0: none, makes of the axes x, y and z. */
static inline void nb_quaternion_axes(const double q[4], double axes[3][3])
{
    const double x = q[0], y = q[1], z = q[2], w = q[3], n = x * x + y * y + z * z + w * w, s = n > 0 ? 2 / n : 0;
    const double turned[3][3] = {{1 - s * (y * y + z * z), s * (x * y + z * w), s * (x * z - y * w)},
                                 {s * (x * y - z * w), 1 - s * (x * x + z * z), s * (y * z + x * w)},
                                 {s * (x * z + y * w), s * (y * z - x * w), 1 - s * (x * x + y * y)}};
    memcpy(axes, turned, sizeof turned);
}

#endif
