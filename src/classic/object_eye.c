#include "math/vector.h"

#include <nebel/classic.h>

#include <math.h>

/* Column by column: m[4 c + r] is in row r. */
static int is_affine(const double m[16])
{
    for (int i = 0; i < 16; i++)
        if (!isfinite(m[i])) return 0;
    return m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1;
}

/* Cramer's rule for matrix eye = -translation. */
nebel_result nebel_compute_object_eye(const double eye_from_object[16], double eye[3])
{
    const double *const m = eye_from_object;
    if (m == NULL || eye == NULL || !is_affine(m)) return NEBEL_ERROR_ARGUMENT;
    const double *const columns[3] = {m, m + 4, m + 8};
    const double minus[3] = {-m[12], -m[13], -m[14]};
    double minors[3][3], found[3];
    for (int i = 0; i < 3; i++) nb_vector_cross(columns[(i + 1) % 3], columns[(i + 2) % 3], minors[i]);
    const double determinant = nb_vector_dot(m, minors[0]);
    for (int i = 0; i < 3; i++) {
        found[i] = nb_vector_dot(minus, minors[i]) / determinant;
        if (!isfinite(found[i])) return NEBEL_ERROR_ARGUMENT;
    }
    for (int i = 0; i < 3; i++) eye[i] = found[i];
    return NEBEL_OK;
}
