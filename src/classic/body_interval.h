/* What part of the way from the eye to a place of a triangle is in a convex body: a stretch between two shares of the
 * way, which are jets over the triangle. Bodies cut it in turn. */
#ifndef NB_CLASSIC_BODY_INTERVAL_H
#define NB_CLASSIC_BODY_INTERVAL_H

#include "math/vector.h"
#include "interval_jets.h"
#include "medium/volume.h"

/* A triangle as seen from the eye, in the frame of a leaf or of the world. */
typedef struct nb_jet_ray {
    double way[3][3];  /* to the corners */
    double edge[3][3]; /* from corner i to the next */
} nb_jet_ray;

/* ---- the triangle ---------------------------------------------------------------------------- */

static inline void set_edges(nb_jet_ray *s)
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s->edge[i][k] = s->way[(i + 1) % 3][k] - s->way[i][k];
}

/* Least distance of the origin from a triangle in so many dimensions, or less: that of the middle, without the radius
 * about it. */
static inline double least_distance(const nb_jet_ray *s, int dimensions)
{
    double middle[3], square = 0, radius = 0;
    for (int k = 0; k < dimensions; k++) {
        middle[k] = (s->way[0][k] + s->way[1][k] + s->way[2][k]) / 3;
        square += middle[k] * middle[k];
    }
    for (int i = 0; i < 3; i++) {
        double off = 0;
        for (int k = 0; k < dimensions; k++) off += (s->way[i][k] - middle[k]) * (s->way[i][k] - middle[k]);
        radius = larger(radius, off);
    }
    return larger(sqrt(square) - sqrt(radius), 0);
}

/* |way|^2 in so many dimensions; its derivative along an edge is linear. */
static inline jet square_of_way(const nb_jet_ray *s, int dimensions)
{
    const double near = least_distance(s, dimensions);
    double products[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            for (int k = 0; k < dimensions; k++) products[i][j] += s->way[i][k] * s->way[j][k];
            products[j][i] = products[i][j];
        }
    jet a = {.value = {near * near, larger(products[0][0], larger(products[1][1], products[2][2]))}};
    for (int i = 0; i < 3; i++) {
        const double *const here = products[i], *const next = products[(i + 1) % 3];
        a.along[i] = scale(2, hull_of(next[0] - here[0], next[1] - here[1], next[2] - here[2]));
    }
    return a;
}

/* |way|, which changes no faster than the place does. */
static inline jet length_of_way(const nb_jet_ray *s)
{
    const jet square = square_of_way(s, 3);
    jet a = root(square);
    for (int i = 0; i < 3; i++) {
        const double edge = sqrt(nb_vector_dot(s->edge[i], s->edge[i]));
        a.along[i].low = larger(a.along[i].low, -edge);
        a.along[i].high = smaller(a.along[i].high, edge);
    }
    return a;
}

/* ---- shares of the way in a leaf -------------------------------------------------------------- */

/* The stretch [from, to] of the way, as shares of it, that is in a body. */
typedef struct nb_body_interval {
    jet from, to;
} nb_body_interval;

/* E / n where n > E, else 1; E > 0. */
static inline jet crossing(double e, jet n)
{
    const interval range = n.value;
    if (range.high <= e) return constant(1);
    const double last = range.low > e ? e / range.low : 1, first = e / range.high;
    const double steep = range.low > e ? -e / (range.low * range.low) : -1 / e;
    const double flat = range.low > e ? -e / (range.high * range.high) : 0;
    return chain((interval){first, last}, (interval){steep, flat}, n);
}

/* A half-space: share times rise <= depth, where depth is that of the eye in it. From an eye in the plane a way is in
 * or out, whole; which of both where it is level with the plane is not known here. */
static inline void cut(nb_body_interval *inside, double depth, jet rise)
{
    if (depth > 0 && rise.value.high <= depth) return;
    if (depth > 0)
        inside->to = least(inside->to, crossing(depth, rise));
    else if (depth < 0)
        inside->from = greatest(inside->from, crossing(-depth, times(-1, rise)));
    else if (rise.value.low > 0)
        inside->to = constant(0);
    else if (rise.value.high >= 0)
        inside->to = least(inside->to, unknown(0, 1));
}

/* Takes away that the ends change. */
static inline nb_body_interval hold(nb_body_interval s)
{
    for (int i = 0; i < 3; i++) s.from.along[i] = s.to.along[i] = (interval){0, 0};
    return s;
}

/* Keeps the part of a body in a half-space, the rest of which, with the same density at the plane, is another part.
 * What either gains by a move of the end the other loses: neither counts it. */
static inline void part_at(nb_body_interval *inside, double depth, jet rise)
{
    nb_body_interval end = {constant(0), constant(1)};
    cut(&end, depth, rise);
    end = hold(end);
    inside->from = greatest(inside->from, end.from);
    inside->to = least(inside->to, end.to);
}

static inline void cut_axis(nb_body_interval *inside, const nb_jet_ray *s, int axis, double low, double high,
                            double eye)
{
    const double at[3] = {s->way[0][axis], s->way[1][axis], s->way[2][axis]};
    const jet rise = linear(at);
    cut(inside, high - eye, rise);
    cut(inside, eye - low, times(-1, rise));
}

static inline void cut_faces(nb_body_interval *inside, const nb_jet_ray *s, const nb_face *faces, size_t count,
                             const double eye[3])
{
    for (size_t f = 0; f < count; f++) {
        double at[3];
        for (int i = 0; i < 3; i++) at[i] = nb_vector_dot(faces[f].normal, s->way[i]);
        cut(inside, faces[f].distance - nb_vector_dot(faces[f].normal, eye), linear(at));
    }
}

/* e x way, linear like the way. In two dimensions it has one component, and e and the ways no third. */
static inline nb_jet_ray moments(const nb_jet_ray *s, int dimensions, const double e[3])
{
    nb_jet_ray m;
    for (int i = 0; i < 3; i++) {
        const double *const w = s->way[i];
        m.way[i][0] = dimensions == 3 ? e[1] * w[2] - e[2] * w[1] : 0;
        m.way[i][1] = dimensions == 3 ? e[2] * w[0] - e[0] * w[2] : 0;
        m.way[i][2] = e[0] * w[1] - e[1] * w[0];
    }
    set_edges(&m);
    return m;
}

/* A ball, or an endless tube in two dimensions: A share^2 + 2 B share + C <= 0, whose discriminant B^2 - A C is
 * A radius^2 - |e x way|^2 by Lagrange's identity, of terms that know less of each other. Where a part of the triangle
 * is beyond the silhouette both ends meet, and their difference, 0 there, is in what is found. */
static inline void cut_round(nb_body_interval *inside, const nb_jet_ray *s, int dimensions, double radius,
                             const double eye[3])
{
    double at[3] = {0, 0, 0};
    for (int k = 0; k < dimensions; k++)
        for (int i = 0; i < 3; i++) at[i] += eye[k] * s->way[i][k];
    const nb_jet_ray moment = moments(s, dimensions, eye);
    const jet a = square_of_way(s, dimensions), b = linear(at);
    const jet discriminant = difference(times(radius * radius, a), square_of_way(&moment, 3));
    if (discriminant.value.high <= 0) {
        inside->to = constant(0);
        return;
    }
    if (a.value.low <= 1e-12 * a.value.high) {
        inside->from = greatest(inside->from, unknown(0, 1));
        inside->to = least(inside->to, unknown(0, 1));
        return;
    }
    const jet half = root(discriminant), over = reciprocal(a);
    inside->from = greatest(inside->from, product(times(-1, sum(b, half)), over));
    inside->to = least(inside->to, product(difference(half, b), over));
}

/* A cone x^2 + y^2 <= q^2, q = radius + slope z: A share^2 + 2 B share + C <= 0 in the form (+, +, -) of x, y, q, which
 * holds in the mirrored cone, q < 0, too; the planes at both ends leave that out. The reciprocals of both ends,
 * (+-sqrt(B^2 - A C) - B) / C, are those of no ends where they are not positive, and stay finite where A passes 0. */
static inline void cut_cone(nb_body_interval *inside, const nb_jet_ray *s, double radius, double slope,
                            const double eye[3])
{
    const double q = radius + slope * eye[2], square = eye[0] * eye[0] + eye[1] * eye[1];
    const double c = square - q * q;
    if (fabs(c) <= 1e-6 * (square + q * q)) {
        inside->from = greatest(inside->from, unknown(0, 1));
        inside->to = least(inside->to, unknown(0, 1));
        return;
    }
    nb_jet_ray across; /* eye x way: of x and q, y and q, x and y */
    double at[3];
    for (int i = 0; i < 3; i++) {
        const double *const w = s->way[i];
        at[i] = eye[0] * w[0] + eye[1] * w[1] - q * slope * w[2];
        across.way[i][0] = eye[0] * slope * w[2] - q * w[0];
        across.way[i][1] = eye[1] * slope * w[2] - q * w[1];
        across.way[i][2] = eye[0] * w[1] - eye[1] * w[0];
    }
    set_edges(&across);
    const double turn[3] = {across.way[0][2], across.way[1][2], across.way[2][2]};
    const jet b = linear(at), around = linear(turn);
    const jet discriminant = difference(square_of_way(&across, 2), product(around, around));
    if (c > 0 && discriminant.value.high <= 0) {
        inside->to = constant(0);
        return;
    }
    const jet half = root(discriminant);
    if (c > 0 || q < 0) inside->from = greatest(inside->from, crossing(1, times(1 / c, difference(half, b))));
    if (c > 0 || q > 0) inside->to = least(inside->to, crossing(1, times(-1 / c, sum(half, b))));
}

/* From `start` to `cutoff` metres of a way of such a length. */
static inline void cut_distances(nb_body_interval *inside, const nb_volume *body, jet length)
{
    if (body->start > 0) inside->from = greatest(inside->from, crossing(body->start, length));
    if (body->cutoff <= NEBEL_MAX_LENGTH) inside->to = least(inside->to, crossing(body->cutoff, length));
}

#endif
