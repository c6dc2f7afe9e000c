#include "affine.h"

#include "vector.h"

#include <math.h>
#include <string.h>

nb_affine nb_affine_compose(const nb_affine *outer, const nb_affine *inner)
{
    nb_affine result;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            const double *row = outer->m[i];
            result.m[i][j] = row[0] * inner->m[0][j] + row[1] * inner->m[1][j] + row[2] * inner->m[2][j];
            if (j == 3) result.m[i][j] += row[3];
        }
    return result;
}

nb_affine nb_affine_from_transform(const nebel_transform *transform)
{
    double q[4];
    memcpy(q, transform->rotation, sizeof q);
    nb_vector_normalize(q, 4);
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double rotation[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                                   {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                                   {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    nb_affine map;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) map.m[i][j] = rotation[i][j] * transform->scale[j];
        map.m[i][3] = transform->position[i];
    }
    return map;
}

void nb_affine_apply(const nb_affine *map, const double place[3], double result[3])
{
    for (int i = 0; i < 3; i++) {
        const double *row = map->m[i];
        result[i] = row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3];
    }
}

/* ---- taken apart ----------------------------------------------------------------------------- */

/* Right angles are off by no more than this where float quaternions were multiplied a few times. */
static const double most_shear = 1e-4;

/* Unit columns, and their lengths. */
static bool split(const nb_affine *map, double axes[3][3], double scale[3])
{
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 3; i++) axes[j][i] = map->m[i][j];
        scale[j] = hypot(hypot(axes[j][0], axes[j][1]), axes[j][2]);
        if (!(scale[j] > 0 && isfinite(scale[j]))) return false;
        for (int i = 0; i < 3; i++) axes[j][i] /= scale[j];
    }
    return fabs(nb_vector_dot(axes[0], axes[1])) <= most_shear && fabs(nb_vector_dot(axes[1], axes[2])) <= most_shear &&
           fabs(nb_vector_dot(axes[2], axes[0])) <= most_shear;
}

/* Gram and Schmidt: the second axis is turned to be level with the first, the third follows from both. A mirror becomes
 * a negative scale along the third. */
static void straighten(double axes[3][3], double scale[3])
{
    const double along = nb_vector_dot(axes[0], axes[1]);
    for (int i = 0; i < 3; i++) axes[1][i] -= along * axes[0][i];
    const double length = nb_vector_length(axes[1]);
    for (int i = 0; i < 3; i++) axes[1][i] /= length;
    double third[3];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        third[i] = axes[0][j] * axes[1][k] - axes[0][k] * axes[1][j];
    }
    if (nb_vector_dot(third, axes[2]) < 0) scale[2] = -scale[2];
    for (int i = 0; i < 3; i++) axes[2][i] = third[i];
}

/* The quaternion of the matrix whose columns are the axes. S. Shepperd, Quaternion from rotation matrix (1978): the
 * component found first is the largest, so that nothing is divided by a small number. */
static void find_rotation(double axes[3][3], double rotation[4])
{
    const double trace = axes[0][0] + axes[1][1] + axes[2][2];
    const double candidates[4] = {axes[0][0], axes[1][1], axes[2][2], trace};
    int largest = 3;
    for (int i = 0; i < 3; i++)
        if (candidates[i] > candidates[largest]) largest = i;
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    if (largest == 3) {
        for (int n = 0; n < 3; n++) {
            const int a = (n + 1) % 3, b = (n + 2) % 3;
            rotation[n] = axes[a][b] - axes[b][a];
        }
        rotation[3] = 1 + trace;
    } else {
        rotation[i] = 1 + axes[i][i] - axes[j][j] - axes[k][k];
        rotation[j] = axes[j][i] + axes[i][j];
        rotation[k] = axes[k][i] + axes[i][k];
        rotation[3] = axes[j][k] - axes[k][j];
    }
    const double length = hypot(hypot(rotation[0], rotation[1]), hypot(rotation[2], rotation[3]));
    for (int n = 0; n < 4; n++) rotation[n] /= length;
}

bool nb_affine_to_transform(const nb_affine *map, nebel_transform *transform)
{
    double axes[3][3];
    if (!split(map, axes, transform->scale)) return false;
    straighten(axes, transform->scale);
    find_rotation(axes, transform->rotation);
    for (int i = 0; i < 3; i++) transform->position[i] = map->m[i][3];
    return true;
}

void nb_vector_normalize(double *vector, size_t count)
{
    double largest = 0, square = 0;
    for (size_t i = 0; i < count; i++) largest = fmax(largest, fabs(vector[i]));
    if (!(largest > 0)) return;
    for (size_t i = 0; i < count; i++) {
        vector[i] /= largest;
        square += vector[i] * vector[i];
    }
    for (size_t i = 0; i < count; i++) vector[i] /= sqrt(square);
}
