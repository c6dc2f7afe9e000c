/* Rays of pixels and lengths of depths, for every projective matrix alike.
 *
 * With the rows r0, r1, r2, r3 of clip_from_eye, a pixel at (x, y) in normalized device coordinates is seen along the
 * line where the planes (r0 - x r3) p = 0 and (r1 - y r3) p = 0 meet. Its direction
 *
 *     d = (r0 - x r3) x (r1 - y r3) = r0 x r1 - x r3 x r1 - y r0 x r3
 *
 * (of the first three columns) is linear in the pixel, because r3 x r3 is 0. Clip w grows by r3 d = det(r0, r1, r3) a
 * step, the same everywhere. Where that is not 0 the lines meet in the point that all three rows send to 0: the centre,
 * the origin of every ray, and w is 0 there. Where it is 0 and w is constant the rays are parallel, and their origin on
 * the plane through the eye and across them is linear in the pixel.
 *
 * Along o + t d clip z and w are z0 + t z1 and w0 + t w1, so the point whose normalized depth is n lies at
 *
 *     t = (z0 - n w0) / (n w1 - z1)
 *
 * with each of the four linear in the pixel. n is linear in the stored depth; it is taken as the difference from the
 * depth of the far end, which floats subtract without an error there, so that nothing cancels below the line. */
#include "view_rays.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* A number that is linear in the pixel: at the middle of the picture, and its growth to the right and to the upper
 * edge. */
typedef struct linear {
    double middle, x, y;
} linear;

typedef struct linear_vector {
    double middle[3], x[3], y[3];
} linear_vector;

/* What a projection is along the rays. In eye space; o, z0 and w0 belong to t = 0. */
typedef struct bundle {
    int parallel;
    linear_vector o, d;
    linear z0, z1;
    double w0, w1;
} bundle;

/* ---- vectors --------------------------------------------------------------------------------- */

/* a x + b y + c z */
static void combine(double a, const double x[3], double b, const double y[3], double c, const double z[3],
                    double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a * x[i] + b * y[i] + c * z[i];
}

static void scale_vector(linear_vector *v, double by)
{
    for (int i = 0; i < 3; i++) v->middle[i] *= by, v->x[i] *= by, v->y[i] *= by;
}

static linear along(const double row[3], const linear_vector *v)
{
    return (linear){nb_vector_dot(row, v->middle), nb_vector_dot(row, v->x), nb_vector_dot(row, v->y)};
}

static linear scaled(linear a, double by)
{
    return (linear){by * a.middle, by * a.x, by * a.y};
}

static linear shifted(linear a, double by)
{
    return (linear){a.middle + by, a.x, a.y};
}

static int all_finite(const double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(numbers[i])) return 0;
    }
    return 1;
}

/* ---- the bundle of rays ---------------------------------------------------------------------- */

static void meet_in_a_point(double r[4][4], double determinant, bundle *rays)
{
    const double by = -1 / determinant;
    combine(by * r[3][3], rays->d.middle, by * r[0][3], rays->d.x, by * r[1][3], rays->d.y, rays->o.middle);
    scale_vector(&rays->d, determinant < 0 ? -1 : 1);
    rays->w1 = fabs(determinant);
}

/* `across` is |r0 x r1|^2: r0 and r1 at the origin are x w - r0w and y w - r1w. */
static void go_parallel(double r[4][4], double across, bundle *rays)
{
    const double *const d = rays->d.middle;
    double right[3], up[3];
    rays->parallel = 1;
    rays->w0 = r[3][3];
    nb_vector_cross(r[1], d, right);
    nb_vector_cross(d, r[0], up);
    for (int i = 0; i < 3; i++) {
        rays->o.x[i] = rays->w0 * right[i] / across;
        rays->o.y[i] = rays->w0 * up[i] / across;
        rays->o.middle[i] = -(r[0][3] * right[i] + r[1][3] * up[i]) / across;
    }
    if (d[2] > 0) scale_vector(&rays->d, -1);
}

/* 0 where the matrix is no projection. */
static int set_bundle(const double clip_from_eye[16], bundle *rays)
{
    double r[4][4];
    *rays = (bundle){0};
    for (int i = 0; i < 16; i++) r[i % 4][i / 4] = clip_from_eye[i];
    nb_vector_cross(r[0], r[1], rays->d.middle);
    nb_vector_cross(r[1], r[3], rays->d.x);
    nb_vector_cross(r[3], r[0], rays->d.y);
    const double size = nb_vector_length(r[0]) * nb_vector_length(r[1]),
                 across = nb_vector_dot(rays->d.middle, rays->d.middle);
    const double determinant = nb_vector_dot(r[3], rays->d.middle);
    if (fabs(determinant) > 1e-12 * size * nb_vector_length(r[3])) {
        meet_in_a_point(r, determinant, rays);
    } else if (nb_vector_length(r[3]) == 0 && r[3][3] > 0 && sqrt(across) > 1e-12 * size) {
        go_parallel(r, across, rays);
    } else {
        return 0;
    }
    rays->z0 = shifted(along(r[2], &rays->o), r[2][3]);
    rays->z1 = along(r[2], &rays->d);
    /* Where clip z does not tell a place from the center, or goes with w, it is 0 but for rounding. */
    const double depth = nb_vector_length(r[2]) * nb_vector_length(rays->parallel ? rays->d.middle : rays->o.middle);
    return rays->parallel ? fabs(rays->z1.middle) > 1e-13 * depth
                          : fabs(rays->z0.middle) > 1e-13 * fmax(depth, fabs(r[2][3]));
}

/* Makes a step one metre in the middle of the picture. */
static void scale_bundle(bundle *rays, double by)
{
    scale_vector(&rays->d, by);
    rays->z1 = scaled(rays->z1, by);
    rays->w1 *= by;
}

/* ---- from eye space to the world ------------------------------------------------------------- */

/* The inverse of the first three columns, by columns; 0 where there is none. */
static int invert(const double eye_from_world[16], double columns[3][3])
{
    const double *const a = eye_from_world, *const b = eye_from_world + 4, *const c = eye_from_world + 8;
    double rows[3][3];
    nb_vector_cross(b, c, rows[0]);
    nb_vector_cross(c, a, rows[1]);
    nb_vector_cross(a, b, rows[2]);
    const double determinant = nb_vector_dot(a, rows[0]);
    if (!(fabs(determinant) > 1e-12 * nb_vector_length(a) * nb_vector_length(b) * nb_vector_length(c))) return 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) columns[k][i] = rows[i][k] / determinant;
    }
    return a[3] == 0 && b[3] == 0 && c[3] == 0 && eye_from_world[15] == 1;
}

static void turn(double columns[3][3], double v[3])
{
    double turned[3];
    combine(v[0], columns[0], v[1], columns[1], v[2], columns[2], turned);
    memcpy(v, turned, sizeof turned);
}

static void turn_vector(double columns[3][3], linear_vector *v)
{
    turn(columns, v->middle);
    turn(columns, v->x);
    turn(columns, v->y);
}

/* ---- words ----------------------------------------------------------------------------------- */

/* In pixels from the lower left corner instead of halves of the picture from its middle. */
static void put_number(const nebel_view *view, linear a, nebel_texel_f32 *word)
{
    word->v[0] = (float)(a.middle - a.x - a.y);
    word->v[1] = (float)(2 * a.x / view->width);
    word->v[2] = (float)(2 * a.y / view->height);
}

static void put_vector(const nebel_view *view, const linear_vector *v, nebel_texel_f32 words[3])
{
    for (int i = 0; i < 3; i++) {
        words[0].v[i] = (float)(v->middle[i] - v->x[i] - v->y[i]);
        words[1].v[i] = (float)(2 * v->x[i] / view->width);
        words[2].v[i] = (float)(2 * v->y[i] / view->height);
    }
}

/* t = (above + above_growth value) / (below + below_growth value), with a positive denominator where the ray meets it
 * in front. Scaled, so that floats hold it. */
typedef struct fraction {
    linear above, below;
    double above_growth, below_growth;
} fraction;

static void put_fraction(const nebel_view *view, const fraction *f, nebel_texel_f32 above[1], nebel_texel_f32 below[1])
{
    const double largest =
        fmax(fmax(fabs(f->above.middle), fabs(f->below.middle)), fmax(fabs(f->above_growth), fabs(f->below_growth)));
    const double by = largest > 0 ? 1 / largest : 1;
    put_number(view, scaled(f->above, by), above);
    put_number(view, scaled(f->below, by), below);
    above->v[3] = (float)(by * f->above_growth);
    below->v[3] = (float)(by * f->below_growth);
}

/* Where normalized depth is `end` plus growth times a value. The denominator has the sign of z0, or of -z1. */
static fraction plane_fraction(const bundle *rays, int rising, double end, double growth)
{
    const double sign = rising ? -1 : 1;
    return (fraction){.above = scaled(shifted(rays->z0, -end * rays->w0), sign),
                      .below = scaled(shifted(scaled(rays->z1, -1), end * rays->w1), sign),
                      .above_growth = -sign * growth * rays->w0,
                      .below_growth = sign * growth * rays->w1};
}

/* ---- depth ----------------------------------------------------------------------------------- */

/* Normalized and stored depth at the ends of the range. */
typedef struct nb_depth_ends {
    int rising; /* normalized depth grows along the rays; otherwise depth is reversed */
    double near, far, stored_near, stored_far;
} nb_depth_ends;

/* Normalized depth comes from infinity at the centre, where w is 0 and z is z0. */
static nb_depth_ends find_ends(const bundle *rays, const nebel_depth_desc *depth)
{
    const int rising = rays->parallel ? rays->z1.middle > 0 : rays->z0.middle < 0;
    const double low = depth->zero_to_one ? 0 : -1;
    const int given = depth->range[0] != 0 || depth->range[1] != 0;
    const double first = given ? depth->range[0] : 0, last = given ? depth->range[1] : 1;
    if (rising) return (nb_depth_ends){1, low, 1, first, last};
    return (nb_depth_ends){0, 1, low, last, first};
}

static fraction axis_fraction(const bundle *rays)
{
    const double axis[3] = {0, 0, rays->d.middle[2] < 0 ? -1 : 1};
    return (fraction){.above = scaled(along(axis, &rays->o), -1), .below = along(axis, &rays->d), .above_growth = 1};
}

static fraction surface_fraction(const bundle *rays, const nebel_depth_desc *depth, const nb_depth_ends *e)
{
    switch (depth->encoding) {
    case NEBEL_DEPTH_ENCODING_LOGARITHMIC:
        return (fraction){.below = {rays->w1, 0, 0}, .above_growth = 1};
    case NEBEL_DEPTH_ENCODING_AXIAL:
        return axis_fraction(rays);
    default:
        return plane_fraction(rays, e->rising, e->far, (e->near - e->far) / (e->stored_far - e->stored_near));
    }
}

static fraction start_fraction(const bundle *rays, const nebel_depth_desc *depth, const nb_depth_ends *e)
{
    if (depth->ray_start == NEBEL_RAY_START_NEAR) return plane_fraction(rays, e->rising, e->near, 0);
    return (fraction){.below = {1, 0, 0}};
}

/* The last components of the words: what the kind of depth needs, and how sky is told. */
static void put_kind(const nebel_depth_desc *depth, const nb_depth_ends *e, nebel_texel_f32 *words)
{
    const int window = depth->encoding == NEBEL_DEPTH_ENCODING_WINDOW,
              logarithm = depth->encoding == NEBEL_DEPTH_ENCODING_LOGARITHMIC;
    const double by = depth->log_scale != 0 ? depth->log_scale : 1;
    words[0].v[3] = (float)depth->encoding;
    words[1].v[3] = (float)(window ? e->stored_far : logarithm ? log1p(by * depth->log_far) : 0);
    words[2].v[3] = (float)(logarithm ? 1 / by : 0);
    words[3].v[3] = words[4].v[3] = words[5].v[3] = 0;
    const int by_value = depth->background == NEBEL_BACKGROUND_DEPTH_VALUE ||
                         (depth->background == NEBEL_BACKGROUND_DEPTH_FAR && (window || logarithm));
    words[8].v[3] = (float)(depth->background == NEBEL_BACKGROUND_DEPTH_VALUE ? depth->background_depth
                            : window                                          ? e->stored_far
                                                                              : 1);
    words[9].v[3] = depth->background == NEBEL_BACKGROUND_DEPTH_NONE ? 2 : (float)by_value;
}

static int is_convention(const nebel_depth_desc *depth, const bundle *rays)
{
    const double numbers[] = {depth->range[0], depth->range[1]};
    if (!all_finite(numbers, 2) || (numbers[0] == numbers[1] && numbers[0] != 0)) return 0;
    if ((unsigned)depth->encoding >= NEBEL_DEPTH_ENCODING_COUNT ||
        (unsigned)depth->background > NEBEL_BACKGROUND_DEPTH_NONE)
        return 0;
    if ((unsigned)depth->ray_start > NEBEL_RAY_START_NEAR) return 0;
    if (depth->encoding == NEBEL_DEPTH_ENCODING_AXIAL) return rays->d.middle[2] != 0;
    if (depth->encoding != NEBEL_DEPTH_ENCODING_LOGARITHMIC) return 1;
    return !rays->parallel && depth->log_scale >= 0 && isfinite(depth->log_scale) && depth->log_far > 0 &&
           isfinite(depth->log_far);
}

static int is_view(const nebel_view *view)
{
    return all_finite(view->eye_from_world, 16) && all_finite(view->clip_from_eye, 16) && view->width >= 1 &&
           view->width <= 65536 && view->height >= 1 && view->height <= 65536;
}

int nb_view_is_valid(const nebel_view *view)
{
    bundle rays;
    double world[3][3];
    return is_view(view) && set_bundle(view->clip_from_eye, &rays) && invert(view->eye_from_world, world);
}

nebel_result nebel_compute_view_rays(const nebel_view *view, const nebel_depth_desc *depth, nebel_rays *rays)
{
    const nebel_depth_desc standard = {0};
    bundle b;
    double world[3][3];
    if (view == NULL || rays == NULL) return NEBEL_ERROR_ARGUMENT;
    if (depth == NULL) depth = &standard;
    if (!is_view(view) || !set_bundle(view->clip_from_eye, &b) || !invert(view->eye_from_world, world)) {
        return NEBEL_ERROR_ARGUMENT;
    }
    if (!is_convention(depth, &b)) return NEBEL_ERROR_ARGUMENT;
    scale_bundle(&b, 1 / nb_vector_length(b.d.middle));
    const nb_depth_ends e = find_ends(&b, depth);
    const fraction surface = surface_fraction(&b, depth, &e), start = start_fraction(&b, depth, &e);
    put_fraction(view, &surface, &rays->texels[6], &rays->texels[7]);
    put_fraction(view, &start, &rays->texels[8], &rays->texels[9]);
    put_kind(depth, &e, rays->texels);

    for (int i = 0; i < 3; i++) {
        rays->eye[i] = (b.parallel ? 0 : b.o.middle[i]) - view->eye_from_world[12 + i];
        if (!b.parallel) b.o.middle[i] = 0;
    }
    rays->from_eye = !b.parallel && depth->ray_start == NEBEL_RAY_START_EYE;
    turn(world, rays->eye);
    turn_vector(world, &b.o);
    turn_vector(world, &b.d);
    put_vector(view, &b.o, &rays->texels[0]);
    put_vector(view, &b.d, &rays->texels[3]);
    return NEBEL_OK;
}
