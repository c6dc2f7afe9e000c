#include "oracle_shape.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef oracle_real real;

#define REAL(x) ((real)(x))

/* What the description cannot decide in double: a line this close to lying in a surface. */
static const double hair = 1e-17;

void *oracle_grow(void *array, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity) return array;
    *capacity = *capacity > 0 ? 2 * *capacity : 16;
    void *const larger = realloc(array, *capacity * size);
    if (larger == NULL) {
        fprintf(stderr, "oracle: out of memory\n");
        exit(EXIT_FAILURE);
    }
    return larger;
}

int oracle_ascending(const void *a, const void *b)
{
    const real x = *(const real *)a, y = *(const real *)b;
    return (x > y) - (x < y);
}

/* One step of Newton doubles the 64 correct bits. */
real oracle_sqrt(real x)
{
    if (!(x > 0)) return 0;
    const real y = REAL(sqrtl((long double)x));
    return y > 0 ? (y + x / y) / 2 : y;
}

real oracle_dot(const real a[3], const real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static real size_of(real x)
{
    return x < 0 ? -x : x;
}

real oracle_between(real a, real b)
{
    return b < REAL(HUGE_VAL) ? a + (b - a) / 2 : a + 1 + size_of(a);
}

int oracle_contains(const oracle_spans *spans, real t)
{
    for (size_t i = 0; i < spans->count; i++)
        if (spans->at[i].from < t && t < spans->at[i].to) return 1;
    return 0;
}

/* ---- frames ---------------------------------------------------------------------------------- */

/* The transpose of the rotation matrix of the quaternion, of any length: p = R^T p. */
static void rotate_back(const double rotation[4], real p[3])
{
    const real x = REAL(rotation[0]), y = REAL(rotation[1]), z = REAL(rotation[2]), w = REAL(rotation[3]);
    const real n = x * x + y * y + z * z + w * w;
    if (!(n > 0)) return;
    const real rows[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)},
                             {2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)},
                             {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z}};
    real q[3];
    for (int k = 0; k < 3; k++) q[k] = oracle_dot(rows[k], p) / n;
    memcpy(p, q, sizeof q);
}

oracle_line oracle_to_local(const nebel_transform *transform, const oracle_line *line)
{
    oracle_line l = *line;
    for (int k = 0; k < 3; k++) l.o[k] -= REAL(transform->position[k]);
    rotate_back(transform->rotation, l.o);
    rotate_back(transform->rotation, l.d);
    const double *const s = transform->scale;
    if (!(s[0] == 0 && s[1] == 0 && s[2] == 0))
        for (int k = 0; k < 3; k++) {
            l.o[k] /= REAL(s[k]);
            l.d[k] /= REAL(s[k]);
        }
    return l;
}

/* ---- spans ----------------------------------------------------------------------------------- */

static void add_span(oracle_spans *spans, real from, real to)
{
    if (!(from < to)) return;
    if (spans->count > 0 && spans->at[spans->count - 1].to == from) {
        spans->at[spans->count - 1].to = to;
        return;
    }
    spans->at = oracle_grow(spans->at, spans->count, &spans->capacity, sizeof *spans->at);
    spans->at[spans->count++] = (oracle_span){from, to};
}

typedef struct cuts {
    size_t count, capacity;
    real *at;
} cuts;

static void add_cut(cuts *c, real t)
{
    c->at = oracle_grow(c->at, c->count, &c->capacity, sizeof *c->at);
    c->at[c->count++] = t;
}

/* Only cuts between 0 and end matter; both of them are cuts. */
static void order_cuts(cuts *c, real end)
{
    size_t kept = 0;
    for (size_t i = 0; i < c->count; i++)
        if (c->at[i] > 0 && c->at[i] < end) c->at[kept++] = c->at[i];
    c->count = kept;
    add_cut(c, 0);
    add_cut(c, end);
    qsort(c->at, c->count, sizeof *c->at, oracle_ascending);
}

/* ---- flat shapes: half spaces, one by one ---------------------------------------------------- */

/* Keeps what has normal . p <= distance. */
static void clip(const oracle_line *l, const real normal[3], real distance, oracle_span *s, int *tie)
{
    real rise = 0, slope = 0, rise_size = size_of(distance), slope_size = 0;
    for (int k = 0; k < 3; k++) {
        rise += normal[k] * l->o[k];
        slope += normal[k] * l->d[k];
        rise_size += size_of(normal[k] * l->o[k]);
        slope_size += size_of(normal[k] * l->d[k]);
    }
    const real room = distance - rise;
    if (size_of(slope) <= REAL(hair) * slope_size && size_of(room) <= REAL(hair) * rise_size) *tie = 1;
    if (slope > 0 && room / slope < s->to) s->to = room / slope;
    if (slope < 0 && room / slope > s->from) s->from = room / slope;
    if (slope == 0 && room < 0) s->to = s->from;
}

static void clip_axis(const oracle_line *l, int axis, int sign, real distance, oracle_span *s, int *tie)
{
    real normal[3] = {0, 0, 0};
    normal[axis] = sign;
    clip(l, normal, distance, s, tie);
}

static oracle_spans inside_flat(const nebel_shape *shape, const oracle_line *l, real end, int *undecided)
{
    oracle_spans spans = {0};
    oracle_span s = {0, end};
    int tie = 0;
    if (shape->type == NEBEL_SHAPE_HALF_SPACE) {
        real normal[3], point[3];
        for (int k = 0; k < 3; k++) {
            normal[k] = REAL(shape->normal[k]);
            point[k] = REAL(shape->point[k]);
        }
        clip(l, normal, oracle_dot(normal, point), &s, &tie);
    }
    for (int k = 0; k < 3 && shape->type == NEBEL_SHAPE_BOX; k++) {
        clip_axis(l, k, 1, REAL(shape->max[k]), &s, &tie);
        clip_axis(l, k, -1, -REAL(shape->min[k]), &s, &tie);
    }
    for (size_t i = 0; i < shape->plane_count && shape->type == NEBEL_SHAPE_CONVEX; i++) {
        real normal[3];
        for (int k = 0; k < 3; k++) normal[k] = REAL(shape->planes[i].normal[k]);
        clip(l, normal, REAL(shape->planes[i].distance), &s, &tie);
    }
    add_span(&spans, s.from, s.to);
    if (tie && spans.count > 0) *undecided = 1;
    return spans;
}

/* ---- curved shapes: candidates, then a question in the middle -------------------------------- */

/* A line with its origin moved to where it comes closest to the shape, so that far away no digits cancel. */
typedef struct near_line {
    oracle_line line; /* relative to the shape's middle */
    real start;       /* t of its origin on the ray */
} near_line;

static near_line approach(const oracle_line *l, const real middle[3])
{
    near_line n;
    real offset[3];
    for (int k = 0; k < 3; k++) offset[k] = l->o[k] - middle[k];
    n.start = -oracle_dot(offset, l->d) / oracle_dot(l->d, l->d);
    for (int k = 0; k < 3; k++) {
        n.line.o[k] = offset[k] + n.start * l->d[k];
        n.line.d[k] = l->d[k];
    }
    return n;
}

/* a t^2 + 2 b t + c = 0, near the line's origin; `size` is |c| for a line right through. */
static void add_roots(cuts *found, real start, real a, real b, real c, real size, real length, int *tie)
{
    if (size_of(a) * length * length + size_of(b) * length + size_of(c) <= REAL(hair) * size) *tie = 1;
    const real square = b * b - a * c;
    if (square < 0) return;
    const real q = b < 0 ? -b + oracle_sqrt(square) : -b - oracle_sqrt(square);
    if (a != 0) add_cut(found, start + q / a);
    if (q != 0) add_cut(found, start + c / q);
}

static void add_ball(cuts *found, const near_line *n, const real center[3], real radius, int *tie)
{
    real p[3];
    for (int k = 0; k < 3; k++) p[k] = n->line.o[k] - center[k];
    const real a = oracle_dot(n->line.d, n->line.d), c = oracle_dot(p, p) - radius * radius;
    add_roots(found, n->start, a, oracle_dot(p, n->line.d), c, radius * radius, radius / oracle_sqrt(a), tie);
}

/* A body of revolution about the z' axis from 0 to length, in coordinates relative to the axis's middle. */
typedef struct spindle {
    real axis[3], length; /* unit vector */
    real middle[3];
    real radius, slope; /* at the middle; per metre */
} spindle;

static spindle make_spindle(const nebel_shape *shape)
{
    spindle s;
    for (int k = 0; k < 3; k++) {
        s.axis[k] = REAL(shape->to[k]) - REAL(shape->from[k]);
        s.middle[k] = (REAL(shape->to[k]) + REAL(shape->from[k])) / 2;
    }
    s.length = oracle_sqrt(oracle_dot(s.axis, s.axis));
    for (int k = 0; k < 3; k++) s.axis[k] = s.length > 0 ? s.axis[k] / s.length : k == 2;
    s.radius = REAL(shape->radius);
    s.slope = 0;
    if (shape->type == NEBEL_SHAPE_CONE) {
        s.radius = (REAL(shape->radius_from) + REAL(shape->radius_to)) / 2;
        s.slope = (REAL(shape->radius_to) - REAL(shape->radius_from)) / s.length;
    }
    return s;
}

/* Height along the axis, and what is left across it. */
static real split(const spindle *s, const real p[3], real across[3])
{
    const real h = oracle_dot(p, s->axis);
    for (int k = 0; k < 3; k++) across[k] = p[k] - h * s->axis[k];
    return h;
}

static void add_side(cuts *found, const near_line *n, const spindle *s, int *tie)
{
    real p[3], v[3];
    const real h = split(s, n->line.o, p), rise = split(s, n->line.d, v);
    const real radius = s->radius + s->slope * h, growth = s->slope * rise;
    const real speed = oracle_sqrt(oracle_dot(n->line.d, n->line.d));
    add_roots(found, n->start, oracle_dot(v, v) - growth * growth, oracle_dot(p, v) - radius * growth,
              oracle_dot(p, p) - radius * radius, s->radius * s->radius, (s->radius + s->length) / speed, tie);
}

static void add_ends(cuts *found, const near_line *n, const spindle *s, int *tie)
{
    const real h = oracle_dot(n->line.o, s->axis), rise = oracle_dot(n->line.d, s->axis);
    const real speed = oracle_sqrt(oracle_dot(n->line.d, n->line.d));
    for (int side = -1; side <= 1; side += 2) {
        const real room = side * s->length / 2 - h;
        if (size_of(rise) <= REAL(hair) * speed && size_of(room) <= REAL(hair) * s->length) *tie = 1;
        if (rise != 0) add_cut(found, n->start + room / rise);
    }
}

/* p is relative to the middle. */
static int spindle_holds(const nebel_shape *shape, const spindle *s, const real p[3])
{
    real across[3];
    const real h = split(s, p, across), square = oracle_dot(across, across), end = s->length / 2;
    if (shape->type == NEBEL_SHAPE_CAPSULE) {
        const real beyond = h > end ? h - end : h < -end ? h + end : 0;
        return square + beyond * beyond <= s->radius * s->radius;
    }
    const real radius = s->radius + s->slope * h;
    return -end <= h && h <= end && radius >= 0 && square <= radius * radius;
}

/* Ellipsoids by squeezing them to the unit ball. */
static near_line approach_ball(const nebel_shape *shape, const oracle_line *l)
{
    oracle_line unit;
    for (int k = 0; k < 3; k++) {
        const real radius = REAL(shape->type == NEBEL_SHAPE_SPHERE ? shape->radius : shape->radii[k]);
        unit.o[k] = (l->o[k] - REAL(shape->center[k])) / radius;
        unit.d[k] = l->d[k] / radius;
    }
    return approach(&unit, (const real[3]){0, 0, 0});
}

static void point_at(const near_line *n, real t, real p[3])
{
    for (int k = 0; k < 3; k++) p[k] = n->line.o[k] + (t - n->start) * n->line.d[k];
}

static int curved_holds(const nebel_shape *shape, const spindle *s, const near_line *n, real t)
{
    real p[3];
    point_at(n, t, p);
    return shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID ? oracle_dot(p, p) <= 1
                                                                                     : spindle_holds(shape, s, p);
}

static oracle_spans inside_curved(const nebel_shape *shape, const oracle_line *l, real end, int *undecided)
{
    oracle_spans spans = {0};
    cuts found = {0};
    near_line n;
    spindle s = {0};
    int tie = 0;
    if (shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID) {
        n = approach_ball(shape, l);
        add_ball(&found, &n, (const real[3]){0, 0, 0}, 1, &tie);
    } else {
        s = make_spindle(shape);
        n = approach(l, s.middle);
        add_side(&found, &n, &s, &tie);
        add_ends(&found, &n, &s, &tie);
        for (int side = -1; side <= 1 && shape->type == NEBEL_SHAPE_CAPSULE; side += 2) {
            real center[3];
            for (int k = 0; k < 3; k++) center[k] = side * s.length / 2 * s.axis[k];
            add_ball(&found, &n, center, s.radius, &tie);
        }
    }
    if (tie) *undecided = 1;
    order_cuts(&found, end);
    for (size_t i = 0; i + 1 < found.count; i++)
        if (curved_holds(shape, &s, &n, oracle_between(found.at[i], found.at[i + 1])))
            add_span(&spans, found.at[i], found.at[i + 1]);
    free(found.at);
    return spans;
}

/* ---- bodies of parts ------------------------------------------------------------------------- */

static int parts_hold(const nebel_shape *shape, const oracle_spans *parts, real t)
{
    size_t holding = 0;
    for (size_t i = 0; i < shape->part_count; i++) holding += (size_t)oracle_contains(&parts[i], t);
    return shape->type == NEBEL_SHAPE_UNION ? holding > 0 : holding == shape->part_count;
}

static oracle_spans inside_parts(const nebel_shape *shape, const oracle_line *l, real end, int *undecided)
{
    oracle_spans spans = {0};
    cuts found = {0};
    oracle_spans *const parts = calloc(shape->part_count, sizeof *parts);
    for (size_t i = 0; i < shape->part_count; i++) {
        parts[i] = oracle_inside(&shape->parts[i], l, end, undecided);
        for (size_t k = 0; k < parts[i].count; k++) {
            add_cut(&found, parts[i].at[k].from);
            add_cut(&found, parts[i].at[k].to);
        }
    }
    order_cuts(&found, end);
    for (size_t i = 0; i + 1 < found.count; i++)
        if (parts_hold(shape, parts, oracle_between(found.at[i], found.at[i + 1])))
            add_span(&spans, found.at[i], found.at[i + 1]);
    for (size_t i = 0; i < shape->part_count; i++) free(parts[i].at);
    free(parts);
    free(found.at);
    return spans;
}

oracle_spans oracle_inside(const nebel_shape *shape, const oracle_line *line, real end, int *undecided)
{
    const oracle_line l = oracle_to_local(&shape->transform, line);
    switch (shape->type) {
    case NEBEL_SHAPE_WORLD:
    case NEBEL_SHAPE_HALF_SPACE:
    case NEBEL_SHAPE_BOX:
    case NEBEL_SHAPE_CONVEX:
        return inside_flat(shape, &l, end, undecided);
    case NEBEL_SHAPE_UNION:
    case NEBEL_SHAPE_INTERSECTION:
        return inside_parts(shape, &l, end, undecided);
    default:
        return inside_curved(shape, &l, end, undecided);
    }
}
