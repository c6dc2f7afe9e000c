#include "leaf.h"

#include "convex.h"

#include <float.h>
#include <math.h>
#include <string.h>

static void widen_point(const double v[3], nb_quad out[3])
{
    for (int i = 0; i < 3; i++) out[i] = (nb_quad)v[i];
}

/* `local` after the world's matrix, plus its offset. A turned point is rounded to a few units of its last digit, the
 * sum by what it leaves (Knuth's two-sum), an offset only where it is no double as the caller gave it. */
static void set_origin(nb_leaf *leaf, const nb_affine_quad *world, const nb_quad local[3])
{
    nb_quad turned[3] = {local[0], local[1], local[2]};
    const int unturned = nb_affine_is_shift(world);
    if (!unturned) nb_affine_direction(world, local, turned);
    leaf->resolved_error = 0;
    leaf->origin_error = 0;
    for (int i = 0; i < 3; i++) {
        const nb_quad offset = world->offset[i], sum = turned[i] + offset, part = sum - turned[i];
        const nb_quad lost = (turned[i] - (sum - part)) + (offset - part);
        const int exact = (nb_quad)(double)offset == offset;
        const double rounded = (unturned ? 0 : fabs((double)turned[i])) + (exact ? 0 : fabs((double)offset));
        leaf->resolved_error += 2 * rounded * (double)NB_QUAD_EPSILON + fabs((double)lost);
        leaf->quad_origin[i] = sum;
        leaf->exact_origin[i] = (long double)sum;
        leaf->exact_rest[i] = (long double)(sum - (nb_quad)leaf->exact_origin[i]);
        leaf->origin[i] = (double)sum;
        const nb_quad rest = sum - (nb_quad)leaf->origin[i];
        leaf->origin_rest[i] = (double)rest;
        leaf->origin_error += fabs((double)(rest - (nb_quad)leaf->origin_rest[i]));
    }
    leaf->origin_error += leaf->resolved_error;
}

/* shaping after the inverse of the world's matrix; 0 where there is none. */
static int invert_frame(const nb_affine_quad *world, const nb_quad shaping[9], nb_quad matrix[9])
{
    nb_affine_quad back = nb_affine_identity();
    const nb_affine_quad shape = {
        {shaping[0], shaping[1], shaping[2], shaping[3], shaping[4], shaping[5], shaping[6], shaping[7], shaping[8]},
        {0, 0, 0}};
    memcpy(matrix, shaping, sizeof shape.matrix);
    if (nb_affine_is_shift(world)) return 1;
    if (!nb_affine_invert_matrix(world, back.matrix)) return 0;
    const nb_affine_quad frame = nb_affine_compose(&shape, &back);
    memcpy(matrix, frame.matrix, sizeof frame.matrix);
    return 1;
}

/* The frame whose origin is `center` and whose axes are normalised by `shaping` (rows, in the shape's coordinates). */
static int set_frame(nb_leaf *leaf, const nb_affine_quad *world, const nb_quad center[3], const nb_quad shaping[9])
{
    if (!invert_frame(world, shaping, leaf->quad_matrix)) return 0;
    set_origin(leaf, world, center);
    leaf->aligned = 1;
    for (int i = 0; i < 9; i++) {
        leaf->exact_matrix[i] = (long double)leaf->quad_matrix[i];
        leaf->matrix[i] = (double)leaf->exact_matrix[i];
        leaf->aligned = leaf->aligned && leaf->quad_matrix[i] == (i % 4 == 0 ? 1 : 0);
    }
    leaf->in_place = leaf->aligned;
    for (int i = 0; i < 3; i++) leaf->in_place = leaf->in_place && leaf->quad_origin[i] == 0;
    leaf->scale = 0;
    for (int i = 0; i < 3; i++) {
        const long double *row = &leaf->exact_matrix[3 * i];
        leaf->scale = fmax(leaf->scale, (double)sqrtl(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]));
    }
    return isfinite(leaf->scale);
}

static const nb_quad no_shaping[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Bounds are wider than the body by far more than what long double rounds, and much cheaper in it. */
typedef struct rough_affine {
    long double matrix[9], offset[3];
} rough_affine;

static rough_affine round_affine(const nb_affine_quad *world)
{
    rough_affine rough;
    for (int i = 0; i < 9; i++) rough.matrix[i] = (long double)world->matrix[i];
    for (int i = 0; i < 3; i++) rough.offset[i] = (long double)world->offset[i];
    return rough;
}

static long double row_times(const rough_affine *world, int row, const long double v[3])
{
    const long double *m = &world->matrix[3 * row];
    return m[0] * v[0] + m[1] * v[1] + m[2] * v[2];
}

/* Encloses center +- the image of the unit ball under the given columns. */
static void enclose_ball(const rough_affine *world, const long double center[3], long double axes[3][3], int axis_count,
                         double low[3], double high[3])
{
    for (int i = 0; i < 3; i++) {
        long double square = 0;
        for (int k = 0; k < axis_count; k++) {
            const long double image = row_times(world, i, axes[k]);
            square += image * image;
        }
        const double half = (double)sqrtl(square), m = (double)(row_times(world, i, center) + world->offset[i]);
        const double margin = 1e-12 * (fabs(m) + half) + DBL_MIN;
        low[i] = fmin(low[i], m - half - margin);
        high[i] = fmax(high[i], m + half + margin);
    }
}

static int set_ball(nb_leaf *leaf, const nebel_shape *shape, const nb_affine_quad *world, double low[3], double high[3])
{
    const int sphere = shape->type == NEBEL_SHAPE_SPHERE;
    const rough_affine rough = round_affine(world);
    nb_quad center[3], shaping[9] = {0};
    long double rough_center[3], axes[3][3] = {{0}};
    for (int i = 0; i < 3; i++) {
        const double radius = sphere ? shape->radius : shape->radii[i];
        center[i] = (nb_quad)shape->center[i];
        shaping[4 * i] = sphere ? 1 : 1 / (nb_quad)radius;
        rough_center[i] = (long double)shape->center[i];
        axes[i][i] = (long double)radius;
    }
    leaf->type = NB_LEAF_SPHERE;
    leaf->radius = sphere ? shape->radius : 1;
    leaf->exact_radius = (long double)leaf->radius;
    leaf->quad_radius = (nb_quad)leaf->radius;
    enclose_ball(&rough, rough_center, axes, 3, low, high);
    return set_frame(leaf, world, center, shaping);
}

static void enclose_box(const nb_affine_quad *world, const nebel_shape *shape, double low[3], double high[3])
{
    const rough_affine rough = round_affine(world);
    for (int corner = 0; corner < 8; corner++) {
        long double p[3];
        for (int i = 0; i < 3; i++) p[i] = (long double)(corner >> i & 1 ? shape->max[i] : shape->min[i]);
        enclose_ball(&rough, p, NULL, 0, low, high);
    }
}

static int set_box(nb_leaf *leaf, const nebel_shape *shape, const nb_affine_quad *world, double low[3], double high[3])
{
    leaf->type = NB_LEAF_BOX;
    for (int i = 0; i < 3; i++) {
        leaf->low[i] = shape->min[i];
        leaf->high[i] = shape->max[i];
    }
    enclose_box(world, shape, low, high);
    return set_frame(leaf, world, (const nb_quad[3]){0, 0, 0}, no_shaping);
}

/* Two unit vectors across `axis` (unit length), without a branch cut near the poles that would lose digits. */
static void across(const nb_quad axis[3], nb_quad u[3], nb_quad v[3])
{
    int smallest = 0;
    for (int i = 1; i < 3; i++)
        if (nb_quad_abs(axis[i]) < nb_quad_abs(axis[smallest])) smallest = i;
    const int j = (smallest + 1) % 3, k = (smallest + 2) % 3;
    const nb_quad length = nb_quad_sqrt(axis[j] * axis[j] + axis[k] * axis[k]);
    u[smallest] = 0;
    u[j] = -axis[k] / length;
    u[k] = axis[j] / length;
    for (int i = 0; i < 3; i++) v[i] = axis[(i + 1) % 3] * u[(i + 2) % 3] - axis[(i + 2) % 3] * u[(i + 1) % 3];
}

/* Encloses the two end discs (or balls, for a capsule) of a body around an axis. */
static void enclose_ends(const nebel_shape *shape, const nb_affine_quad *world, nb_quad basis[3][3],
                         const nb_quad radii[2], double low[3], double high[3])
{
    const rough_affine rough = round_affine(world);
    for (int end = 0; end < 2; end++) {
        long double center[3], axes[3][3];
        for (int i = 0; i < 3; i++) {
            center[i] = (long double)(end ? shape->to[i] : shape->from[i]);
            for (int k = 0; k < 3; k++) axes[k][i] = (long double)basis[k][i] * (long double)radii[end];
        }
        enclose_ball(&rough, center, axes, shape->type == NEBEL_SHAPE_CAPSULE ? 3 : 2, low, high);
    }
}

static void set_profile_of_axis(nb_leaf *leaf, const nebel_shape *shape, nb_quad length, const nb_quad radii[2],
                                nb_quad across_unit)
{
    leaf->type = shape->type == NEBEL_SHAPE_CAPSULE ? NB_LEAF_CAPSULE
                 : radii[0] == radii[1]             ? NB_LEAF_CYLINDER
                                                    : NB_LEAF_CONE;
    leaf->quad_length = length / across_unit;
    leaf->quad_radius = radii[0] / across_unit;
    leaf->quad_slope = (radii[1] - radii[0]) / across_unit;
    leaf->exact_length = (long double)leaf->quad_length;
    leaf->exact_radius = (long double)leaf->quad_radius;
    leaf->exact_slope = (long double)leaf->quad_slope;
    leaf->length = (double)leaf->quad_length;
    leaf->radius = (double)leaf->quad_radius;
    leaf->slope = (double)leaf->quad_slope;
}

static int set_axis_body(nb_leaf *leaf, const nebel_shape *shape, const nb_affine_quad *world, double low[3],
                         double high[3])
{
    const int cone = shape->type == NEBEL_SHAPE_CONE;
    const nb_quad radii[2] = {(nb_quad)(cone ? shape->radius_from : shape->radius),
                              (nb_quad)(cone ? shape->radius_to : shape->radius)};
    nb_quad basis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, from[3], square = 0, axis[3];
    widen_point(shape->from, from);
    for (int i = 0; i < 3; i++) {
        axis[i] = (nb_quad)shape->to[i] - from[i];
        square += axis[i] * axis[i];
    }
    const nb_quad length = nb_quad_sqrt(square), widest = radii[0] > radii[1] ? radii[0] : radii[1];
    if (length > 0) {
        for (int i = 0; i < 3; i++) basis[2][i] = axis[i] / length;
        across(basis[2], basis[0], basis[1]);
    }
    const nb_quad along = shape->type == NEBEL_SHAPE_CAPSULE ? widest : length;
    nb_quad shaping[9];
    for (int i = 0; i < 9; i++) shaping[i] = basis[i / 3][i % 3] / (i < 6 ? widest : along);
    set_profile_of_axis(leaf, shape, length, radii, widest);
    enclose_ends(shape, world, basis, radii, low, high);
    return set_frame(leaf, world, from, shaping);
}

/* Which of two bodies that share a face owns a ray in it: the one whose outward normal points to the negative side. */
static double tie_of(const double normal[3])
{
    for (int i = 0; i < 3; i++)
        if (normal[i] != 0) return normal[i] < 0 ? -1 : 1;
    return 1;
}

/* Scaled by a power of two, so that the plane stays exactly the one that was given. */
static void set_face(nb_face *face, const double normal[3], double distance)
{
    int exponent;
    frexp(fmax(fabs(normal[0]), fmax(fabs(normal[1]), fabs(normal[2]))), &exponent);
    for (int i = 0; i < 3; i++) face->normal[i] = ldexp(normal[i], -exponent);
    face->distance = ldexp(distance, -exponent);
    face->tie = tie_of(normal);
    face->inverse_length = 1 / sqrt(face->normal[0] * face->normal[0] + face->normal[1] * face->normal[1] +
                                    face->normal[2] * face->normal[2]);
}

/* Across an axis the height of a point over a plane is the product of one component and a difference: of exact sign
 * where either is exact and the other rounded once. */
static int is_sharp(const nb_leaf *leaf, const nb_face *face)
{
    int axes = 0, halves = 0, exact = leaf->aligned && leaf->origin_error == 0;
    for (int i = 0; i < 3; i++) {
        axes += face->normal[i] != 0;
        halves += fabs(face->normal[i]) == 0.5;
        exact = exact && leaf->origin_rest[i] == 0;
    }
    return exact && axes == 1 && (face->distance == 0 || (leaf->in_place && halves == 1));
}

/* The faces in world coordinates relative to the leaf's origin, for the bounds; side -1: turned around. 0: the body is
 * empty. */
static int bound_faces(const nb_leaf *leaf, const nb_face *faces, int side, double low[3], double high[3])
{
    double planes[NEBEL_MAX_SHAPE_PLANES][4];
    for (size_t k = 0; k < leaf->face_count; k++) {
        const nb_face *face = &faces[k];
        long double n[3] = {0, 0, 0}, square = 0;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) n[i] += leaf->exact_matrix[3 * j + i] * (long double)face->normal[j];
            square += n[i] * n[i];
        }
        const long double length = side * sqrtl(square);
        for (int i = 0; i < 3; i++) planes[k][i] = (double)(n[i] / length);
        planes[k][3] = (double)((long double)face->distance / length);
    }
    double l[3], h[3];
    const double(*planes_view)[4] = (const double(*)[4])planes;
    if (!nb_convex_bounds(planes_view, leaf->face_count, l, h)) return 0;
    for (int i = 0; i < 3; i++) {
        const double margin = 1e-12 * fabs(leaf->origin[i]);
        low[i] = fmin(low[i], l[i] + leaf->origin[i] - margin);
        high[i] = fmax(high[i], h[i] + leaf->origin[i] + margin);
    }
    return 1;
}

static nebel_result set_planes(const nebel_log *log, nb_leaf *leaf, const nebel_shape *shape,
                               const nb_affine_quad *world, nb_face *faces, double low[3], double high[3])
{
    const int half_space = shape->type == NEBEL_SHAPE_HALF_SPACE;
    nb_quad center[3] = {0, 0, 0};
    leaf->type = NB_LEAF_PLANES;
    leaf->size = 1;
    leaf->face_count = half_space ? 1 : shape->plane_count;
    if (half_space) {
        widen_point(shape->point, center);
        set_face(&faces[0], shape->normal, 0);
    }
    for (size_t i = 0; i < leaf->face_count && !half_space; i++)
        set_face(&faces[i], shape->planes[i].normal, shape->planes[i].distance);
    if (!set_frame(leaf, world, center, no_shaping)) return nb_fail(log, NEBEL_ERROR_VALUE, "transform: is singular");
    for (size_t i = 0; i < leaf->face_count; i++) faces[i].is_sharp = is_sharp(leaf, &faces[i]);
    if (bound_faces(leaf, faces, 1, low, high)) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_VALUE, "convex: no point is inside all planes; the body is empty%s",
                   bound_faces(leaf, faces, -1, low, high) ? ": its normals point inwards, they must point out of it"
                                                           : "");
}

/* Of what has no end as much as its numbers say. */
static double size_of(const nb_leaf *leaf, const double low[3], const double high[3])
{
    double world = 0;
    for (int i = 0; i < 3; i++) world += high[i] - low[i];
    return 1 + leaf->radius + leaf->length + (isfinite(world) ? leaf->scale * world : 0);
}

nebel_result nb_leaf_resolve(const nebel_log *log, const nebel_shape *shape, const nb_affine_quad *world,
                             nb_face *faces, size_t first_face, nb_leaf *leaf, double low[3], double high[3])
{
    *leaf = (nb_leaf){.first_face = first_face};
    for (int i = 0; i < 3; i++) {
        low[i] = HUGE_VAL;
        high[i] = -HUGE_VAL;
    }
    int regular = 1;
    switch (shape->type) {
    case NEBEL_SHAPE_WORLD:
        leaf->type = NB_LEAF_WORLD;
        for (int i = 0; i < 3; i++) {
            low[i] = -HUGE_VAL;
            high[i] = HUGE_VAL;
        }
        break;
    case NEBEL_SHAPE_BOX:
        regular = set_box(leaf, shape, world, low, high);
        break;
    case NEBEL_SHAPE_SPHERE:
    case NEBEL_SHAPE_ELLIPSOID:
        regular = set_ball(leaf, shape, world, low, high);
        break;
    case NEBEL_SHAPE_HALF_SPACE:
    case NEBEL_SHAPE_CONVEX:
        return set_planes(log, leaf, shape, world, faces, low, high);
    default:
        regular = set_axis_body(leaf, shape, world, low, high);
        break;
    }
    if (!regular) return nb_fail(log, NEBEL_ERROR_VALUE, "transform: is singular");
    leaf->size = size_of(leaf, low, high);
    return NEBEL_OK;
}
