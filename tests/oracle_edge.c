#include "oracle_edge.h"

#include <assert.h>
#include <math.h>
#include <string.h>

typedef oracle_real real;

#define REAL(x) ((real)(x))

static real least(real a, real b)
{
    return a < b ? a : b;
}

/* The radius in terms of which an edge is as deep as it says. */
static real radius_of(const nebel_shape *s)
{
    if (s->type == NEBEL_SHAPE_ELLIPSOID) return least(least(REAL(s->radii[0]), REAL(s->radii[1])), REAL(s->radii[2]));
    if (s->type == NEBEL_SHAPE_CONE) return REAL(fmax(s->radius_from, s->radius_to));
    return REAL(s->radius);
}

static void add_face(oracle_edge *e, const oracle_line *l, const double normal[3], real distance)
{
    real n[3];
    for (int k = 0; k < 3; k++) n[k] = REAL(normal[k]);
    const real length = oracle_sqrt(oracle_dot(n, n));
    assert(e->face_count < ORACLE_EDGE_FACES);
    e->depth[e->face_count] = (distance - oracle_dot(n, l->o)) / length;
    e->growth[e->face_count++] = -oracle_dot(n, l->d) / length;
}

static void add_faces(oracle_edge *e, const oracle_line *l)
{
    const nebel_shape *const s = e->shape;
    if (s->type == NEBEL_SHAPE_HALF_SPACE) {
        real at = 0;
        for (int k = 0; k < 3; k++) at += REAL(s->normal[k]) * REAL(s->point[k]);
        add_face(e, l, s->normal, at);
    }
    for (size_t i = 0; s->type == NEBEL_SHAPE_CONVEX && i < s->plane_count; i++)
        add_face(e, l, s->planes[i].normal, REAL(s->planes[i].distance));
}

oracle_edge oracle_edge_of(const nebel_shape *shape, double distance, const oracle_line *ray)
{
    const oracle_line l = oracle_to_local(&shape->transform, ray);
    oracle_edge e = {.shape = shape, .distance = distance};
    const int ball = shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID;
    const int spindle =
        shape->type == NEBEL_SHAPE_CYLINDER || shape->type == NEBEL_SHAPE_CONE || shape->type == NEBEL_SHAPE_CAPSULE;
    for (int k = 0; k < 3; k++) {
        const real unit = shape->type == NEBEL_SHAPE_ELLIPSOID ? REAL(shape->radii[k]) / radius_of(shape) : 1;
        e.o[k] = (l.o[k] - REAL(ball ? shape->center[k] : shape->from[k])) / unit;
        e.d[k] = l.d[k] / unit;
        if (spindle) e.axis[k] = REAL(shape->to[k]) - REAL(shape->from[k]);
    }
    e.length = oracle_sqrt(oracle_dot(e.axis, e.axis));
    for (int k = 0; k < 3 && e.length > 0; k++) e.axis[k] /= e.length;
    add_faces(&e, &l);
    return e;
}

/* ---- cuts ---- */

typedef struct quadratic {
    real c, b, a; /* c + b t + a t^2 */
} quadratic;

static quadratic square_of(real value, real slope)
{
    return (quadratic){value * value, 2 * value * slope, slope * slope};
}

static quadratic minus(quadratic p, quadratic q)
{
    return (quadratic){p.c - q.c, p.b - q.b, p.a - q.a};
}

/* The square of the distance from a place on the axis. */
static quadratic from_place(const oracle_edge *e, real along)
{
    quadratic sum = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        const quadratic one = square_of(e->o[k] - along * e->axis[k], e->d[k]);
        sum = (quadratic){sum.c + one.c, sum.b + one.b, sum.a + one.a};
    }
    return sum;
}

static quadratic from_axis(const oracle_edge *e)
{
    return minus(from_place(e, 0), square_of(oracle_dot(e->o, e->axis), oracle_dot(e->d, e->axis)));
}

/* Where p = value, whichever way it bends. */
static size_t add_roots(quadratic p, real value, real *cuts)
{
    const real c = p.c - value, square = p.b * p.b - 4 * p.a * c;
    if (!(square > 0)) return 0;
    const real root = oracle_sqrt(square), sum = p.b < 0 ? p.b - root : p.b + root;
    size_t n = 0;
    if (p.a != 0) cuts[n++] = -sum / (2 * p.a);
    if (sum != 0) cuts[n++] = -2 * c / sum;
    return n;
}

static size_t add_crossing(real value, real slope, real wanted, real *cuts)
{
    if (slope == 0) return 0;
    cuts[0] = (wanted - value) / slope;
    return 1;
}

static size_t cuts_of_faces(const oracle_edge *e, real *cuts)
{
    size_t n = 0;
    for (size_t i = 0; i < e->face_count; i++) {
        n += add_crossing(e->depth[i], e->growth[i], REAL(e->distance), &cuts[n]);
        for (size_t j = 0; j < i; j++)
            n += add_crossing(e->depth[i] - e->depth[j], e->growth[i] - e->growth[j], 0, &cuts[n]);
    }
    return n;
}

size_t oracle_edge_cuts(const oracle_edge *e, real cuts[ORACLE_EDGE_CUTS])
{
    const nebel_shape *const s = e->shape;
    if (e->face_count > 0) return cuts_of_faces(e, cuts);
    const real radius = radius_of(s), w = least(REAL(e->distance), radius), inner = (radius - w) * (radius - w);
    const real z = oracle_dot(e->o, e->axis), growth = oracle_dot(e->d, e->axis);
    size_t n = 0;
    if (s->type == NEBEL_SHAPE_SPHERE || s->type == NEBEL_SHAPE_ELLIPSOID)
        return add_roots(from_place(e, 0), inner, cuts);
    if (s->type == NEBEL_SHAPE_CAPSULE) {
        n += add_crossing(z, growth, 0, &cuts[n]);
        n += add_crossing(z, growth, e->length, &cuts[n]);
        n += add_roots(from_place(e, 0), inner, &cuts[n]);
        n += add_roots(from_place(e, e->length), inner, &cuts[n]);
        return n + add_roots(from_axis(e), inner, &cuts[n]);
    }
    const int cone = s->type == NEBEL_SHAPE_CONE;
    const real from = REAL(cone ? s->radius_from : s->radius), to = REAL(cone ? s->radius_to : s->radius);
    const real slope = (to - from) / e->length, edge = REAL(e->distance);
    n += add_roots(minus(from_axis(e), square_of(from + slope * z, slope * growth)), inner - radius * radius, &cuts[n]);
    n += add_crossing(z, growth, edge, &cuts[n]);
    n += add_crossing(z, growth, e->length - edge, &cuts[n]);
    return n + add_crossing(z, growth, e->length / 2, &cuts[n]);
}

/* ---- density ---- */

double oracle_edge_density(const oracle_edge *e, long double t)
{
    const nebel_shape *const s = e->shape;
    long double p[3], square = 0, z = 0, value = 1;
    for (size_t i = 0; i < e->face_count; i++)
        value = fminl(value, (long double)(e->depth[i] + e->growth[i] * REAL(t)) / (long double)e->distance);
    if (e->face_count > 0) return (double)fmaxl(0, value);
    for (int k = 0; k < 3; k++) {
        p[k] = (long double)(e->o[k] + e->d[k] * REAL(t));
        z += p[k] * (long double)e->axis[k];
    }
    for (int k = 0; k < 3; k++) square += (p[k] - z * (long double)e->axis[k]) * (p[k] - z * (long double)e->axis[k]);
    const long double radius = (long double)radius_of(s), length = (long double)e->length;
    long double width = radius, ends = 1;
    if (s->type == NEBEL_SHAPE_CAPSULE) {
        const long double past = z - fminl(fmaxl(z, 0), length);
        square += past * past;
    }
    if (s->type == NEBEL_SHAPE_CONE)
        width = (long double)s->radius_from + ((long double)s->radius_to - (long double)s->radius_from) * z / length;
    if (s->type == NEBEL_SHAPE_CONE || s->type == NEBEL_SHAPE_CYLINDER)
        ends = fminl(1, fmaxl(0, fminl(z, length - z)) / (long double)e->distance);
    const long double rest = 1 - fminl(1, (long double)e->distance / radius);
    value = (width * width - square) / (radius * radius) / (1 - rest * rest);
    return (double)(fminl(1, fmaxl(0, value)) * ends);
}

double oracle_edge_final(const oracle_edge *e)
{
    double value = e->face_count > 0 ? 1 : 0;
    for (size_t i = 0; i < e->face_count; i++) {
        const double level = (double)(e->depth[i] / REAL(e->distance));
        value = fmin(value, e->growth[i] > 0 ? 1 : e->growth[i] < 0 ? 0 : fmax(level, 0));
    }
    return value;
}
