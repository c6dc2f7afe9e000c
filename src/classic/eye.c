#include <nebel/classic.h>

#include <math.h>

/* Column by column: m[4 c + r] is in row r. */
static int is_affine(const double m[16])
{
    for (int i = 0; i < 16; i++)
        if (!isfinite(m[i])) return 0;
    return m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Cramer's rule for matrix eye = -translation. */
nebel_result nebel_find_eye(const double eye_from_object[16], double eye[3])
{
    const double *const m = eye_from_object;
    if (m == NULL || eye == NULL || !is_affine(m)) return NEBEL_ERROR_ARGUMENT;
    const double *const columns[3] = {m, m + 4, m + 8};
    const double minus[3] = {-m[12], -m[13], -m[14]};
    double minors[3][3], found[3];
    for (int i = 0; i < 3; i++) cross(columns[(i + 1) % 3], columns[(i + 2) % 3], minors[i]);
    const double determinant = dot(m, minors[0]);
    for (int i = 0; i < 3; i++) {
        found[i] = dot(minus, minors[i]) / determinant;
        if (!isfinite(found[i])) return NEBEL_ERROR_ARGUMENT;
    }
    for (int i = 0; i < 3; i++) eye[i] = found[i];
    return NEBEL_OK;
}
