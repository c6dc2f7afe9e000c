#include "lit_shape.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* ---- transforms ------------------------------------------------------------------------------ */

/* By the conjugate of a quaternion of any length: back from where it turns to. */
static void turn_back(const double q[4], double p[3])
{
    const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(square > 0)) return;
    const double length = sqrt(square), x = -q[0] / length, y = -q[1] / length, z = -q[2] / length, w = q[3] / length;
    const double a[3] = {p[0], p[1], p[2]};
    const double t[3] = {2 * (y * a[2] - z * a[1]), 2 * (z * a[0] - x * a[2]), 2 * (x * a[1] - y * a[0])};
    p[0] = a[0] + w * t[0] + y * t[2] - z * t[1];
    p[1] = a[1] + w * t[1] + z * t[0] - x * t[2];
    p[2] = a[2] + w * t[2] + x * t[1] - y * t[0];
}

static void undo(const nebel_transform *t, double p[3], int is_point)
{
    const int is_scaled = t->scale[0] != 0 || t->scale[1] != 0 || t->scale[2] != 0;
    for (int k = 0; k < 3 && is_point; k++) p[k] -= t->position[k];
    turn_back(t->rotation, p);
    for (int k = 0; k < 3 && is_scaled; k++) p[k] /= t->scale[k];
}

/* A part's transform goes before its whole's: `chain` are those of the wholes, the outermost first. */
enum { MAX_CHAIN = NEBEL_MAX_SHAPE_NESTING + 1 };

static void set_rows(const nebel_transform *const *chain, int depth, lit_leaf *leaf)
{
    static const nebel_transform none;
    for (int i = 0; i < depth; i++) leaf->is_moved = leaf->is_moved || memcmp(chain[i], &none, sizeof none) != 0;
    for (int column = 0; column < 4; column++) {
        double p[3] = {column == 0, column == 1, column == 2};
        for (int i = 0; i < depth; i++) undo(chain[i], p, column == 3);
        for (int k = 0; k < 3; k++) leaf->rows[k][column] = p[k];
    }
}

static void list_leaves(const nebel_shape *s, const nebel_transform **chain, int depth, lit_leaf *leaves,
                        size_t max_count, size_t *count)
{
    chain[depth++] = &s->transform;
    if (s->type == NEBEL_SHAPE_UNION || s->type == NEBEL_SHAPE_INTERSECTION) {
        for (size_t i = 0; i < s->part_count; i++) list_leaves(&s->parts[i], chain, depth, leaves, max_count, count);
        return;
    }
    assert(*count < max_count);
    lit_leaf *leaf = &leaves[(*count)++];
    *leaf = (lit_leaf){.shape = s};
    set_rows(chain, depth, leaf);
}

void lit_list_leaves(const nebel_shape *shape, lit_leaf *leaves, size_t max_count, size_t *count)
{
    const nebel_transform *chain[MAX_CHAIN];
    list_leaves(shape, chain, 0, leaves, max_count, count);
}

lit_line lit_to_local(const lit_leaf *leaf, const lit_line *world)
{
    lit_line local = *world;
    for (int k = 0; k < 3 && leaf->is_moved; k++) {
        local.o[k] = lit_dot(leaf->rows[k], world->o) + leaf->rows[k][3];
        local.d[k] = lit_dot(leaf->rows[k], world->d);
    }
    return local;
}

/* ---- convex shapes --------------------------------------------------------------------------- */

lit_span lit_meet(lit_span a, lit_span b)
{
    return (lit_span){fmax(a.enter, b.enter), fmin(a.leave, b.leave)};
}

static const lit_span nowhere = {HUGE_VAL, -HUGE_VAL}, everywhere = {-HUGE_VAL, HUGE_VAL};

/* Where value + rate t <= 0. */
lit_span lit_below(double value, double rate)
{
    if (rate == 0) return value <= 0 ? everywhere : nowhere;
    return rate > 0 ? (lit_span){-HUGE_VAL, -value / rate} : (lit_span){-value / rate, HUGE_VAL};
}

/* Where a t^2 + 2 b t + c <= 0, a > 0. */
static lit_span within_roots(double a, double b, double c)
{
    const double square = b * b - a * c;
    if (!(square > 0)) return nowhere;
    const double root = sqrt(square);
    return (lit_span){(-b - root) / a, (-b + root) / a};
}

static lit_span in_ellipsoid(const lit_line *l, const double center[3], const double radii[3])
{
    double p[3], d[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (l->o[k] - center[k]) / radii[k];
        d[k] = l->d[k] / radii[k];
    }
    const double square = lit_dot(d, d), nearest = -lit_dot(p, d) / square;
    for (int k = 0; k < 3; k++) p[k] += nearest * d[k];
    const lit_span s = within_roots(square, 0, lit_dot(p, p) - 1);
    return (lit_span){s.enter + nearest, s.leave + nearest};
}

/* Whether a line clearly passes a ball: most balls of a crowd are passed. */
static int passes_by(const lit_line *l, const double center[3], double radius)
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = center[k] - l->o[k];
    const double square = lit_dot(p, p), along = lit_dot(p, l->d);
    return square * (1 - 1e-12) - along * along / lit_dot(l->d, l->d) > radius * radius * (1 + 1e-12);
}

lit_span lit_in_sphere(const lit_line *l, const double center[3], double radius)
{
    if (passes_by(l, center, radius)) return nowhere;
    return in_ellipsoid(l, center, (const double[]){radius, radius, radius});
}

/* A cone between both ends, a cylinder where both radii are the same. */
static lit_span in_cone(const lit_line *l, const double from[3], const double to[3], double r0, double r1)
{
    double axis[3], p[3], length = 0;
    for (int k = 0; k < 3; k++) axis[k] = to[k] - from[k];
    length = sqrt(lit_dot(axis, axis));
    for (int k = 0; k < 3; k++) {
        axis[k] /= length;
        p[k] = l->o[k] - from[k];
    }
    const double z = lit_dot(p, axis), dz = lit_dot(l->d, axis), slope = (r1 - r0) / length;
    const lit_span slab = lit_meet(lit_below(-z, -dz), lit_below(z - length, dz));
    double q[3], e[3];
    for (int k = 0; k < 3; k++) {
        q[k] = p[k] - z * axis[k];
        e[k] = l->d[k] - dz * axis[k];
    }
    const double w = r0 + slope * z, dw = slope * dz;
    const double a = lit_dot(e, e) - dw * dw, b = lit_dot(q, e) - w * dw, c = lit_dot(q, q) - w * w,
                 square = b * b - a * c;
    double cuts[6] = {slab.enter, slab.leave};
    int n = 2;
    /* Without a difference of like numbers: `a` is all but 0 where the line runs along the side. */
    const double sum = -b - copysign(sqrt(fmax(square, 0)), b);
    if (square > 0 && sum != 0) cuts[n++] = c / sum;
    if (square > 0 && a != 0) cuts[n++] = sum / a;
    for (int i = 1; i < n; i++)
        for (int j = i; j > 0 && cuts[j] < cuts[j - 1]; j--) {
            const double swapped = cuts[j];
            cuts[j] = cuts[j - 1];
            cuts[j - 1] = swapped;
        }
    lit_span found = nowhere;
    for (int i = 0; i + 1 < n; i++) {
        if (!(cuts[i] >= slab.enter && cuts[i + 1] <= slab.leave && cuts[i] < cuts[i + 1])) continue;
        if (!isfinite(cuts[i]) || !isfinite(cuts[i + 1])) {
            if (dz != 0) continue;
        }
        const int begins = isfinite(cuts[i]), ends = isfinite(cuts[i + 1]);
        const double t = !begins && !ends ? 0
                         : !begins        ? cuts[i + 1] - 1
                         : !ends          ? cuts[i] + 1
                                          : 0.5 * (cuts[i] + cuts[i + 1]);
        if (a * t * t + 2 * b * t + c > 0 || w + dw * t < 0) continue;
        found.enter = fmin(found.enter, cuts[i]);
        found.leave = fmax(found.leave, cuts[i + 1]);
    }
    return found;
}

static lit_span join(lit_span a, lit_span b)
{
    if (a.enter >= a.leave) return b;
    if (b.enter >= b.leave) return a;
    return (lit_span){fmin(a.enter, b.enter), fmax(a.leave, b.leave)};
}

lit_span lit_in_leaf(const lit_leaf *leaf, const lit_line *world)
{
    const nebel_shape *s = leaf->shape;
    const lit_line l = lit_to_local(leaf, world);
    lit_span found = everywhere;
    switch (s->type) {
    case NEBEL_SHAPE_WORLD:
        return everywhere;
    case NEBEL_SHAPE_BOX:
        for (int k = 0; k < 3; k++) {
            found = lit_meet(found, lit_below(s->min[k] - l.o[k], -l.d[k]));
            found = lit_meet(found, lit_below(l.o[k] - s->max[k], l.d[k]));
        }
        return found;
    case NEBEL_SHAPE_SPHERE:
        return lit_in_sphere(&l, s->center, s->radius);
    case NEBEL_SHAPE_ELLIPSOID:
        return in_ellipsoid(&l, s->center, s->radii);
    case NEBEL_SHAPE_CYLINDER:
        return in_cone(&l, s->from, s->to, s->radius, s->radius);
    case NEBEL_SHAPE_CAPSULE:
        found = join(lit_in_sphere(&l, s->from, s->radius), lit_in_sphere(&l, s->to, s->radius));
        return join(found, in_cone(&l, s->from, s->to, s->radius, s->radius));
    case NEBEL_SHAPE_CONE:
        return in_cone(&l, s->from, s->to, s->radius_from, s->radius_to);
    case NEBEL_SHAPE_HALF_SPACE: {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = l.o[k] - s->point[k];
        return lit_below(lit_dot(p, s->normal), lit_dot(l.d, s->normal));
    }
    case NEBEL_SHAPE_CONVEX:
        for (size_t i = 0; i < s->plane_count; i++)
            found = lit_meet(found, lit_below(lit_dot(s->planes[i].normal, l.o) - s->planes[i].distance,
                                              lit_dot(s->planes[i].normal, l.d)));
        return found;
    default:
        return nowhere;
    }
}
