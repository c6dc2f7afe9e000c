#include "lit_edge.h"

#include <assert.h>
#include <math.h>

enum { MAX_FACES = 64 };

/* ---- quadratics along a line ----------------------------------------------------------------- */

typedef struct quadratic {
    double a, b, c; /* a t^2 + 2 b t + c */
} quadratic;

static double value_at(const quadratic *q, double t)
{
    return (q->a * t + 2 * q->b) * t + q->c;
}

/* Where it has a value. */
static void add_roots(const quadratic *q, double value, lit_cuts *cuts)
{
    const double c = q->c - value, square = q->b * q->b - q->a * c;
    if (q->a == 0) {
        if (q->b != 0) lit_add_cut(cuts, -c / (2 * q->b));
        return;
    }
    if (!(square > 0)) return;
    const double sum = -(q->b + copysign(sqrt(square), q->b));
    lit_add_cut(cuts, sum / q->a);
    if (sum != 0) lit_add_cut(cuts, c / sum);
}

/* The squared distance from a place, or from an axis of unit length through it. */
static quadratic distance_from(const double place[3], const double *axis, const lit_line *l)
{
    double p[3], d[3];
    for (int k = 0; k < 3; k++) {
        p[k] = l->o[k] - place[k];
        d[k] = l->d[k];
    }
    const double along = axis != NULL ? lit_dot(p, axis) : 0, rate = axis != NULL ? lit_dot(d, axis) : 0;
    for (int k = 0; k < 3 && axis != NULL; k++) {
        p[k] -= along * axis[k];
        d[k] -= rate * axis[k];
    }
    return (quadratic){lit_dot(d, d), lit_dot(p, d), lit_dot(p, p)};
}

/* ---- round bodies ---------------------------------------------------------------------------- */

/* What must be reached of 1 - r^2: the density is 1 from there on. */
static double depth_of_edge(double distance, double radius)
{
    const double rest = 1 - fmin(1, distance / radius);
    return 1 - rest * rest;
}

static quadratic ball_on(const nebel_shape *s, const lit_line *l, double *radius)
{
    lit_line unit = *l;
    double center[3] = {s->center[0], s->center[1], s->center[2]};
    *radius = s->radius;
    if (s->type == NEBEL_SHAPE_ELLIPSOID) *radius = fmin(fmin(s->radii[0], s->radii[1]), s->radii[2]);
    for (int k = 0; k < 3; k++) {
        const double size = s->type == NEBEL_SHAPE_ELLIPSOID ? s->radii[k] : s->radius;
        unit.o[k] /= size;
        unit.d[k] /= size;
        center[k] /= size;
    }
    const quadratic q = distance_from(center, NULL, &unit);
    return (quadratic){-q.a, -q.b, 1 - q.c};
}

/* Cylinders, cones and capsules: along the axis, and (w^2 - r^2) / radius^2. */
typedef struct spindle {
    double axis[3], length, radius;
    double z, rate;
    quadratic sides;
} spindle;

static spindle spindle_on(const nebel_shape *s, const lit_line *l)
{
    spindle b = {.radius = s->type == NEBEL_SHAPE_CONE ? fmax(s->radius_from, s->radius_to) : s->radius};
    double p[3];
    for (int k = 0; k < 3; k++) {
        b.axis[k] = s->to[k] - s->from[k];
        p[k] = l->o[k] - s->from[k];
    }
    b.length = sqrt(lit_dot(b.axis, b.axis));
    for (int k = 0; k < 3 && b.length > 0; k++) b.axis[k] /= b.length;
    b.z = lit_dot(p, b.axis);
    b.rate = lit_dot(l->d, b.axis);
    const int is_cone = s->type == NEBEL_SHAPE_CONE;
    const double slope = is_cone ? (s->radius_to - s->radius_from) / b.length : 0;
    const double w = (is_cone ? s->radius_from : s->radius) + slope * b.z, widening = slope * b.rate;
    const quadratic r = distance_from(s->from, b.axis, l);
    const double unit = b.radius * b.radius;
    b.sides = (quadratic){(widening * widening - r.a) / unit, (w * widening - r.b) / unit, (w * w - r.c) / unit};
    return b;
}

static quadratic cap_on(const nebel_shape *s, const double end[3], const lit_line *l)
{
    const quadratic r = distance_from(end, NULL, l);
    const double unit = s->radius * s->radius;
    return (quadratic){-r.a / unit, -r.b / unit, 1 - r.c / unit};
}

static double spindle_at(const nebel_shape *s, double distance, const lit_line *l, double t)
{
    const spindle b = spindle_on(s, l);
    const double z = b.z + b.rate * t, deep = depth_of_edge(distance, b.radius);
    quadratic sides = b.sides;
    if (s->type == NEBEL_SHAPE_CAPSULE) {
        if (z < 0) sides = cap_on(s, s->from, l);
        if (z > b.length) sides = cap_on(s, s->to, l);
        return fmin(1, fmax(0, value_at(&sides, t)) / deep);
    }
    const double end = fmax(0, fmin(z, b.length - z)) / distance;
    return fmin(1, fmax(0, value_at(&sides, t)) / deep) * fmin(1, end);
}

static void cut_spindle(const nebel_shape *s, double distance, const lit_line *l, lit_cuts *cuts)
{
    const spindle b = spindle_on(s, l);
    const double deep = depth_of_edge(distance, b.radius);
    add_roots(&b.sides, deep, cuts);
    const int is_capsule = s->type == NEBEL_SHAPE_CAPSULE;
    const quadratic caps[2] = {cap_on(s, s->from, l), cap_on(s, s->to, l)};
    for (int i = 0; i < 2 && is_capsule; i++) add_roots(&caps[i], deep, cuts);
    const double places[] = {is_capsule ? 0 : distance, is_capsule ? b.length : b.length - distance, b.length / 2};
    for (int i = 0; i < 3; i++) lit_add_cut(cuts, (places[i] - b.z) / b.rate);
}

/* ---- boxes ----------------------------------------------------------------------------------- */

static double box_at(const nebel_shape *s, double distance, const lit_line *l, double t)
{
    double value = 1;
    for (int k = 0; k < 3; k++) {
        const double p = l->o[k] + t * l->d[k];
        value *= fmin(1, fmax(0, fmin(p - s->min[k], s->max[k] - p)) / distance);
    }
    return value;
}

static void cut_box(const nebel_shape *s, double distance, const lit_line *l, lit_cuts *cuts)
{
    for (int k = 0; k < 3; k++) {
        const double places[] = {s->min[k] + distance, s->max[k] - distance, 0.5 * (s->min[k] + s->max[k])};
        for (int i = 0; i < 3; i++) lit_add_cut(cuts, (places[i] - l->o[k]) / l->d[k]);
    }
}

/* ---- flat faces ------------------------------------------------------------------------------ */

/* Densities of faces along a line, and the 1 that is the most; the density is the least of them. */
typedef struct faces {
    size_t count;
    double value[MAX_FACES], rate[MAX_FACES];
} faces;

static void add_face(faces *f, const double normal[3], double level, double distance, const lit_line *l)
{
    const double length = sqrt(lit_dot(normal, normal)) * distance;
    assert(f->count < MAX_FACES);
    f->value[f->count] = (level - lit_dot(normal, l->o)) / length;
    f->rate[f->count++] = -lit_dot(normal, l->d) / length;
}

static void set_faces(const nebel_shape *s, double distance, const lit_line *l, faces *f)
{
    f->count = 1;
    f->value[0] = 1;
    f->rate[0] = 0;
    if (s->type == NEBEL_SHAPE_HALF_SPACE) add_face(f, s->normal, lit_dot(s->normal, s->point), distance, l);
    for (size_t i = 0; s->type == NEBEL_SHAPE_CONVEX && i < s->plane_count; i++)
        add_face(f, s->planes[i].normal, s->planes[i].distance, distance, l);
}

static double face_at(const faces *f, size_t i, double t)
{
    return f->value[i] + f->rate[i] * t;
}

static size_t least_face(const faces *f, double t)
{
    size_t least = 0;
    for (size_t i = 1; i < f->count; i++) {
        const double apart = face_at(f, i, t) - face_at(f, least, t);
        if (apart < 0 || (apart == 0 && f->rate[i] < f->rate[least])) least = i;
    }
    return least;
}

/* Where another face becomes the least, and which; `to` where none does before. */
static double next_face(const faces *f, double from, double to, size_t *least)
{
    const size_t now = *least;
    for (size_t i = 0; i < f->count; i++) {
        if (!(f->rate[i] < f->rate[now])) continue;
        const double t = fmax(from, (f->value[i] - f->value[now]) / (f->rate[now] - f->rate[i]));
        if (t < to || (t == to && f->rate[i] < f->rate[*least])) {
            to = t;
            *least = i;
        }
    }
    return to;
}

int lit_edge_has_faces(const nebel_shape *s)
{
    return s->type == NEBEL_SHAPE_HALF_SPACE || s->type == NEBEL_SHAPE_CONVEX;
}

double lit_edge_amount_of_faces(const nebel_shape *s, double distance, const lit_line *local, double a, double b)
{
    faces f;
    set_faces(s, distance, local, &f);
    size_t least = least_face(&f, a);
    double sum = 0;
    for (double from = a; from < b;) {
        const size_t now = least;
        const double to = next_face(&f, from, b, &least);
        sum += 0.5 * (to - from) * (fmax(0, face_at(&f, now, from)) + fmax(0, face_at(&f, now, to)));
        if (now == least) break;
        from = to;
    }
    return sum;
}

static void cut_faces(const nebel_shape *s, double distance, const lit_line *l, double a, double b, lit_cuts *cuts)
{
    faces f;
    set_faces(s, distance, l, &f);
    size_t least = least_face(&f, a);
    for (double from = a; from < b;) {
        const size_t now = least;
        from = next_face(&f, from, b, &least);
        if (now == least) break;
        lit_add_cut(cuts, from);
    }
}

/* ---- all of them ----------------------------------------------------------------------------- */

double lit_edge_at(const nebel_shape *s, double distance, const lit_line *local, double t)
{
    if (s->type == NEBEL_SHAPE_BOX) return box_at(s, distance, local, t);
    if (lit_edge_has_faces(s)) {
        faces f;
        set_faces(s, distance, local, &f);
        return fmax(0, face_at(&f, least_face(&f, t), t));
    }
    if (s->type != NEBEL_SHAPE_SPHERE && s->type != NEBEL_SHAPE_ELLIPSOID) return spindle_at(s, distance, local, t);
    double radius;
    const quadratic q = ball_on(s, local, &radius);
    return fmin(1, fmax(0, value_at(&q, t)) / depth_of_edge(distance, radius));
}

void lit_edge_cut(const nebel_shape *s, double distance, const lit_line *local, double a, double b, lit_cuts *cuts)
{
    if (s->type == NEBEL_SHAPE_BOX) {
        cut_box(s, distance, local, cuts);
    } else if (lit_edge_has_faces(s)) {
        cut_faces(s, distance, local, a, b, cuts);
    } else if (s->type == NEBEL_SHAPE_SPHERE || s->type == NEBEL_SHAPE_ELLIPSOID) {
        double radius;
        const quadratic q = ball_on(s, local, &radius);
        add_roots(&q, depth_of_edge(distance, radius), cuts);
    } else {
        cut_spindle(s, distance, local, cuts);
    }
}
