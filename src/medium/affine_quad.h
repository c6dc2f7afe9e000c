/* Small algebra in quad for resolving transforms: what is rounded here is rounded for every ray. */
#ifndef NB_MEDIUM_AFFINE_QUAD_H
#define NB_MEDIUM_AFFINE_QUAD_H

#include "formulas/quad.h"

#include <nebel/nebel.h>

#include <math.h>

/* world = matrix local + offset; the matrix row by row */
typedef struct nb_affine_quad {
    nb_quad matrix[9], offset[3];
} nb_affine_quad;

static inline nb_affine_quad nb_affine_identity(void)
{
    return (nb_affine_quad){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
}

/* Neither turns nor scales. */
static inline int nb_affine_is_shift(const nb_affine_quad *a)
{
    for (int i = 0; i < 9; i++)
        if (a->matrix[i] != (i % 4 == 0 ? 1 : 0)) return 0;
    return 1;
}

static inline void nb_affine_direction(const nb_affine_quad *a, const nb_quad v[3], nb_quad out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a->matrix[3 * i] * v[0] + a->matrix[3 * i + 1] * v[1] + a->matrix[3 * i + 2] * v[2];
}

static inline void nb_affine_point(const nb_affine_quad *a, const nb_quad p[3], nb_quad out[3])
{
    nb_affine_direction(a, p, out);
    for (int i = 0; i < 3; i++) out[i] += a->offset[i];
}

/* scale first, then rotation, then position; zero rotation or scale mean none */
static inline nb_affine_quad nb_affine_from_transform(const nebel_transform *t)
{
    nb_affine_quad a = nb_affine_identity();
    const nb_quad x = (nb_quad)t->rotation[0], y = (nb_quad)t->rotation[1];
    const nb_quad z = (nb_quad)t->rotation[2], w = (nb_quad)t->rotation[3];
    const nb_quad n = x * x + y * y + z * z + w * w;
    if (n > 0) {
        const nb_quad s = 2 / n;
        const nb_quad m[9] = {1 - s * (y * y + z * z), s * (x * y - z * w),     s * (x * z + y * w),
                              s * (x * y + z * w),     1 - s * (x * x + z * z), s * (y * z - x * w),
                              s * (x * z - y * w),     s * (y * z + x * w),     1 - s * (x * x + y * y)};
        for (int i = 0; i < 9; i++) a.matrix[i] = m[i];
    }
    const int scaled = t->scale[0] != 0 || t->scale[1] != 0 || t->scale[2] != 0;
    for (int i = 0; i < 9 && scaled; i++) a.matrix[i] *= (nb_quad)t->scale[i % 3];
    for (int i = 0; i < 3; i++) a.offset[i] = (nb_quad)t->position[i];
    return a;
}

/* outer after inner */
static inline nb_affine_quad nb_affine_compose(const nb_affine_quad *outer, const nb_affine_quad *inner)
{
    nb_affine_quad out = *inner;
    for (int i = 0; i < 3; i++) out.offset[i] += outer->offset[i];
    if (nb_affine_is_shift(outer)) return out;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            nb_quad sum = 0;
            for (int k = 0; k < 3; k++) sum += outer->matrix[3 * i + k] * inner->matrix[3 * k + j];
            out.matrix[3 * i + j] = sum;
        }
    nb_affine_point(outer, inner->offset, out.offset);
    return out;
}

/* The inverse of the matrix by its cofactors; 0 where it is singular. */
static inline int nb_affine_invert_matrix(const nb_affine_quad *a, nb_quad out[9])
{
    const nb_quad *m = a->matrix;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
            out[3 * i + j] = m[3 * r0 + c0] * m[3 * r1 + c1] - m[3 * r0 + c1] * m[3 * r1 + c0];
        }
    const nb_quad determinant = m[0] * out[0] + m[1] * out[3] + m[2] * out[6];
    if (!(nb_quad_abs(determinant) > 0) || !isfinite((double)determinant)) return 0;
    for (int i = 0; i < 9; i++) out[i] /= determinant;
    return 1;
}

#endif
