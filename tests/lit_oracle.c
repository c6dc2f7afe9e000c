#include "lit_oracle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_VOLUMES = 128, MOST_LEAVES = 1024, MOST_EVENTS = 2 * MOST_LEAVES + 8, MOST_CUTS = 16384 };

typedef struct line {
    double o[3], d[3];
} line;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void at(const line *l, double t, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = l->o[k] + t * l->d[k];
}

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

static line to_local(const nebel_transform *t, const line *l)
{
    line local = *l;
    const int is_scaled = t->scale[0] != 0 || t->scale[1] != 0 || t->scale[2] != 0;
    for (int k = 0; k < 3; k++) local.o[k] -= t->position[k];
    turn_back(t->rotation, local.o);
    turn_back(t->rotation, local.d);
    for (int k = 0; k < 3 && is_scaled; k++) {
        local.o[k] /= t->scale[k];
        local.d[k] /= t->scale[k];
    }
    return local;
}

/* ---- convex shapes --------------------------------------------------------------------------- */

typedef struct span {
    double enter, leave;
} span;

static span meet(span a, span b)
{
    return (span){fmax(a.enter, b.enter), fmin(a.leave, b.leave)};
}

static const span nowhere = {HUGE_VAL, -HUGE_VAL}, everywhere = {-HUGE_VAL, HUGE_VAL};

/* Where value + rate t <= 0. */
static span below(double value, double rate)
{
    if (rate == 0) return value <= 0 ? everywhere : nowhere;
    return rate > 0 ? (span){-HUGE_VAL, -value / rate} : (span){-value / rate, HUGE_VAL};
}

/* Where a t^2 + 2 b t + c <= 0, a > 0. */
static span within_roots(double a, double b, double c)
{
    const double square = b * b - a * c;
    if (!(square > 0)) return nowhere;
    const double root = sqrt(square);
    return (span){(-b - root) / a, (-b + root) / a};
}

static span in_ellipsoid(const line *l, const double center[3], const double radii[3])
{
    double p[3], d[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (l->o[k] - center[k]) / radii[k];
        d[k] = l->d[k] / radii[k];
    }
    const double square = dot(d, d), nearest = -dot(p, d) / square;
    for (int k = 0; k < 3; k++) p[k] += nearest * d[k];
    const span s = within_roots(square, 0, dot(p, p) - 1);
    return (span){s.enter + nearest, s.leave + nearest};
}

static span in_sphere(const line *l, const double center[3], double radius)
{
    return in_ellipsoid(l, center, (const double[]){radius, radius, radius});
}

/* A cone between both ends, a cylinder where both radii are the same. */
static span in_cone(const line *l, const double from[3], const double to[3], double r0, double r1)
{
    double axis[3], p[3], length = 0;
    for (int k = 0; k < 3; k++) axis[k] = to[k] - from[k];
    length = sqrt(dot(axis, axis));
    for (int k = 0; k < 3; k++) {
        axis[k] /= length;
        p[k] = l->o[k] - from[k];
    }
    const double z = dot(p, axis), dz = dot(l->d, axis), slope = (r1 - r0) / length;
    const span slab = meet(below(-z, -dz), below(z - length, dz));
    double q[3], e[3];
    for (int k = 0; k < 3; k++) {
        q[k] = p[k] - z * axis[k];
        e[k] = l->d[k] - dz * axis[k];
    }
    const double w = r0 + slope * z, dw = slope * dz;
    const double a = dot(e, e) - dw * dw, b = dot(q, e) - w * dw, c = dot(q, q) - w * w, square = b * b - a * c;
    double cuts[6] = {slab.enter, slab.leave};
    int n = 2;
    if (square > 0 && a != 0) {
        cuts[n++] = (-b - sqrt(square)) / a;
        cuts[n++] = (-b + sqrt(square)) / a;
    } else if (a == 0 && b != 0) {
        cuts[n++] = -c / (2 * b);
    }
    for (int i = 1; i < n; i++)
        for (int j = i; j > 0 && cuts[j] < cuts[j - 1]; j--) {
            const double swapped = cuts[j];
            cuts[j] = cuts[j - 1];
            cuts[j - 1] = swapped;
        }
    span found = nowhere;
    for (int i = 0; i + 1 < n; i++) {
        if (!(cuts[i] >= slab.enter && cuts[i + 1] <= slab.leave && cuts[i] < cuts[i + 1])) continue;
        if (!isfinite(cuts[i]) || !isfinite(cuts[i + 1])) {
            if (dz != 0) continue;
        }
        const double t = !isfinite(cuts[i])       ? cuts[i + 1] - 1
                         : !isfinite(cuts[i + 1]) ? cuts[i] + 1
                                                  : 0.5 * (cuts[i] + cuts[i + 1]);
        if (a * t * t + 2 * b * t + c > 0 || w + dw * t < 0) continue;
        found.enter = fmin(found.enter, cuts[i]);
        found.leave = fmax(found.leave, cuts[i + 1]);
    }
    return found;
}

static span join(span a, span b)
{
    if (a.enter >= a.leave) return b;
    if (b.enter >= b.leave) return a;
    return (span){fmin(a.enter, b.enter), fmax(a.leave, b.leave)};
}

static span in_leaf(const nebel_shape *s, const line *world)
{
    const line l = to_local(&s->transform, world);
    span found = everywhere;
    switch (s->type) {
    case NEBEL_SHAPE_WORLD:
        return everywhere;
    case NEBEL_SHAPE_BOX:
        for (int k = 0; k < 3; k++) {
            found = meet(found, below(s->min[k] - l.o[k], -l.d[k]));
            found = meet(found, below(l.o[k] - s->max[k], l.d[k]));
        }
        return found;
    case NEBEL_SHAPE_SPHERE:
        return in_sphere(&l, s->center, s->radius);
    case NEBEL_SHAPE_ELLIPSOID:
        return in_ellipsoid(&l, s->center, s->radii);
    case NEBEL_SHAPE_CYLINDER:
        return in_cone(&l, s->from, s->to, s->radius, s->radius);
    case NEBEL_SHAPE_CAPSULE:
        found = join(in_sphere(&l, s->from, s->radius), in_sphere(&l, s->to, s->radius));
        return join(found, in_cone(&l, s->from, s->to, s->radius, s->radius));
    case NEBEL_SHAPE_CONE:
        return in_cone(&l, s->from, s->to, s->radius_from, s->radius_to);
    case NEBEL_SHAPE_HALF_SPACE: {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = l.o[k] - s->point[k];
        return below(dot(p, s->normal), dot(l.d, s->normal));
    }
    case NEBEL_SHAPE_CONVEX:
        for (size_t i = 0; i < s->plane_count; i++)
            found = meet(found,
                         below(dot(s->planes[i].normal, l.o) - s->planes[i].distance, dot(s->planes[i].normal, l.d)));
        return found;
    default:
        return nowhere;
    }
}

/* ---- which fog is where ---------------------------------------------------------------------- */

/* Of a line: the spans of all leaves in the order of the shapes' trees, and the events of all. */
typedef struct map {
    span leaves[MOST_LEAVES];
    size_t leaf_count, event_count;
    double events[MOST_EVENTS];
} map;

/* A part's transform goes before its whole's. */
static void list_leaves(const nebel_shape *s, const line *world, map *m)
{
    if (s->type == NEBEL_SHAPE_UNION || s->type == NEBEL_SHAPE_INTERSECTION) {
        const line l = to_local(&s->transform, world);
        for (size_t i = 0; i < s->part_count; i++) list_leaves(&s->parts[i], &l, m);
        return;
    }
    m->leaves[m->leaf_count++] = in_leaf(s, world);
}

static int is_in_shape(const nebel_shape *s, const map *m, size_t *leaf, double t)
{
    if (s->type != NEBEL_SHAPE_UNION && s->type != NEBEL_SHAPE_INTERSECTION) {
        const span *at_leaf = &m->leaves[(*leaf)++];
        return at_leaf->enter <= t && t < at_leaf->leave;
    }
    int any = 0, all = 1;
    for (size_t i = 0; i < s->part_count; i++) {
        const int is_in = is_in_shape(&s->parts[i], m, leaf, t);
        any = any || is_in;
        all = all && is_in;
    }
    return s->type == NEBEL_SHAPE_UNION ? any : all;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void make_map(const lit_scene *scene, const line *l, double end, map *m)
{
    m->leaf_count = m->event_count = 0;
    for (size_t i = 0; i < scene->volume_count; i++) list_leaves(&scene->volumes[i].shape, l, m);
    m->events[m->event_count++] = 0;
    for (size_t i = 0; i < m->leaf_count; i++) {
        const span *s = &m->leaves[i];
        if (!(s->enter < s->leave)) continue;
        if (s->enter > 0 && s->enter < end) m->events[m->event_count++] = s->enter;
        if (s->leave > 0 && s->leave < end) m->events[m->event_count++] = s->leave;
    }
    m->events[m->event_count++] = end;
    qsort(m->events, m->event_count, sizeof m->events[0], compare_doubles);
}

/* Marks the volumes whose fog is there at t. Returns whether any is. */
static int mark_fog(const lit_scene *scene, const map *m, double t, unsigned char is_there[MOST_VOLUMES])
{
    unsigned char in[MOST_VOLUMES];
    size_t leaf = 0;
    int any = 0;
    for (size_t i = 0; i < scene->volume_count; i++)
        in[i] = (unsigned char)is_in_shape(&scene->volumes[i].shape, m, &leaf, t);
    for (size_t i = 0; i < scene->volume_count; i++) {
        const nebel_volume_desc *v = &scene->volumes[i];
        int there = in[i] && v->operation != NEBEL_OPERATION_EXCLUDE;
        for (size_t k = 0; k < scene->volume_count && there; k++) {
            const nebel_volume_desc *other = &scene->volumes[k];
            if (!in[k]) continue;
            if (other->operation == NEBEL_OPERATION_EXCLUDE && other->priority >= v->priority) there = 0;
            if (other->operation == NEBEL_OPERATION_REPLACE && other->priority > v->priority) there = 0;
        }
        is_there[i] = (unsigned char)there;
        any = any || there;
    }
    return any;
}

/* Of densities: beyond this they would be no numbers. */
#define MOST_EXPONENT 300.0

/* ---- densities ------------------------------------------------------------------------------- */

static const lit_scene *gridded; /* the scene whose voxels are read */

static double voxel_at(int x, int y, int z)
{
    const int *n = gridded->size;
    const int i = x < 0 ? 0 : x >= n[0] ? n[0] - 1 : x, j = y < 0 ? 0 : y >= n[1] ? n[1] - 1 : y;
    const int k = z < 0 ? 0 : z >= n[2] ? n[2] - 1 : z;
    return (double)gridded->voxels[i + n[0] * (j + n[1] * k)];
}

static double grid_density(const nebel_shape *box, const double p[3])
{
    double share[3], value = 0;
    int cell[3];
    for (int k = 0; k < 3; k++) {
        const double x = (p[k] - box->min[k]) / (box->max[k] - box->min[k]) * gridded->size[k];
        const double from = gridded->is_nearest ? x : x - 0.5;
        cell[k] = (int)floor(from);
        share[k] = from - cell[k];
    }
    if (gridded->is_nearest) return voxel_at(cell[0], cell[1], cell[2]);
    for (int i = 0; i < 8; i++) {
        double weight = 1;
        for (int k = 0; k < 3; k++) weight *= i >> k & 1 ? share[k] : 1 - share[k];
        value += weight * voxel_at(cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2));
    }
    return value;
}

static double density_at(const nebel_volume_desc *v, const line *l, double t)
{
    const nebel_density *d = &v->density;
    double p[3], q[3], value = 1;
    at(l, t, p);
    switch (d->type) {
    case NEBEL_DENSITY_HEIGHT: {
        const double u = (p[1] - d->base) / d->scale_height;
        return exp(fmin(-(d->below == NEBEL_BELOW_CONSTANT ? fmax(u, 0) : u), MOST_EXPONENT));
    }
    case NEBEL_DENSITY_LINEAR:
        for (int k = 0; k < 3; k++) {
            q[k] = d->to[k] - d->from[k];
            p[k] -= d->from[k];
        }
        return fmin(fmax(dot(p, q) / dot(q, q), 0), 1);
    case NEBEL_DENSITY_GAUSSIAN:
        for (int k = 0; k < 3; k++) p[k] = (p[k] - d->center[k]) / d->sigma;
        return exp(-0.5 * dot(p, p));
    case NEBEL_DENSITY_ALTITUDE: {
        for (int k = 0; k < 3; k++) p[k] -= d->center[k];
        const double u = (sqrt(dot(p, p)) - d->radius - d->base) / d->scale_height;
        return exp(fmin(-(d->below == NEBEL_BELOW_CONSTANT ? fmax(u, 0) : u), MOST_EXPONENT));
    }
    default:
        break;
    }
    const nebel_shape *s = &v->shape;
    const line local = to_local(&s->transform, l);
    at(&local, t, p);
    if (d->type == NEBEL_DENSITY_GRID) return grid_density(s, p);
    if (d->type == NEBEL_DENSITY_SOFT_EDGE && s->type == NEBEL_SHAPE_BOX) {
        for (int k = 0; k < 3; k++) value *= fmin(1, fmax(0, fmin(p[k] - s->min[k], s->max[k] - p[k])) / d->distance);
        return value;
    }
    for (int k = 0; k < 3; k++)
        p[k] = (p[k] - s->center[k]) / (s->type == NEBEL_SHAPE_SPHERE ? s->radius : s->radii[k]);
    const double inside = fmax(0, 1 - dot(p, p));
    if (d->type == NEBEL_DENSITY_RADIAL) return pow(inside, d->power);
    if (d->type == NEBEL_DENSITY_SOFT_EDGE) {
        const double rest = 1 - fmin(1, d->distance / s->radius);
        return fmin(1, inside / (1 - rest * rest));
    }
    return 1;
}

static void add_cut(double cuts[MOST_CUTS], size_t *count, double t)
{
    if (*count < MOST_CUTS && isfinite(t)) cuts[(*count)++] = t;
}

static void add_crossing(double cuts[MOST_CUTS], size_t *count, double value, double rate, double wanted)
{
    if (rate != 0) add_cut(cuts, count, (wanted - value) / rate);
}

/* Where a density is not smooth along a line, or changes on its own scale. */
static void cut_density(const nebel_volume_desc *v, const line *l, double cuts[MOST_CUTS], size_t *count)
{
    const nebel_density *d = &v->density;
    const nebel_shape *s = &v->shape;
    double p[3], q[3];
    if (d->type == NEBEL_DENSITY_HEIGHT && d->below == NEBEL_BELOW_CONSTANT)
        add_crossing(cuts, count, l->o[1], l->d[1], d->base);
    if (d->type == NEBEL_DENSITY_LINEAR) {
        for (int k = 0; k < 3; k++) {
            q[k] = d->to[k] - d->from[k];
            p[k] = l->o[k] - d->from[k];
        }
        const double square = dot(q, q);
        add_crossing(cuts, count, dot(p, q) / square, dot(l->d, q) / square, 0);
        add_crossing(cuts, count, dot(p, q) / square, dot(l->d, q) / square, 1);
    }
    if (d->type == NEBEL_DENSITY_GAUSSIAN) {
        for (int k = 0; k < 3; k++) p[k] = l->o[k] - d->center[k];
        const double nearest = -dot(p, l->d) / dot(l->d, l->d);
        for (int i = -12; i <= 12; i++) add_cut(cuts, count, nearest + i * 0.75 * d->sigma);
    }
    if (d->type == NEBEL_DENSITY_ALTITUDE) {
        for (int k = 0; k < 3; k++) p[k] = l->o[k] - d->center[k];
        const double nearest = -dot(p, l->d);
        add_cut(cuts, count, nearest);
        const span deep = in_sphere(l, d->center, d->radius + d->base);
        if (d->below == NEBEL_BELOW_CONSTANT && deep.enter < deep.leave) {
            add_cut(cuts, count, deep.enter);
            add_cut(cuts, count, deep.leave);
        }
    }
    if (d->type != NEBEL_DENSITY_SOFT_EDGE && d->type != NEBEL_DENSITY_GRID) return;
    const line local = to_local(&s->transform, l);
    if (d->type == NEBEL_DENSITY_GRID) {
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < gridded->size[k]; i++) {
                const double share = (i + (gridded->is_nearest ? 0 : 0.5)) / gridded->size[k];
                add_crossing(cuts, count, local.o[k], local.d[k], s->min[k] + share * (s->max[k] - s->min[k]));
            }
        return;
    }
    if (s->type == NEBEL_SHAPE_BOX) {
        for (int k = 0; k < 3; k++) {
            add_crossing(cuts, count, local.o[k], local.d[k], s->min[k] + d->distance);
            add_crossing(cuts, count, local.o[k], local.d[k], s->max[k] - d->distance);
            add_crossing(cuts, count, local.o[k], local.d[k], 0.5 * (s->min[k] + s->max[k]));
        }
        return;
    }
    const span core = in_sphere(&local, s->center, fmax(s->radius - d->distance, 1e-300));
    if (core.enter < core.leave) {
        add_cut(cuts, count, core.enter);
        add_cut(cuts, count, core.leave);
    }
}

/* ---- integrals of densities ------------------------------------------------------------------ */

/* Gauss's rule of eight nodes on [-1, 1]: Abramowitz and Stegun, table 25.4. */
static const double gauss_node[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
static const double gauss_weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

static double gauss(const nebel_volume_desc *v, const line *l, double a, double b)
{
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    double sum = 0;
    for (int i = 0; i < 4; i++)
        sum += gauss_weight[i] *
               (density_at(v, l, middle - half * gauss_node[i]) + density_at(v, l, middle + half * gauss_node[i]));
    return half * sum;
}

static double gauss_refined(const nebel_volume_desc *v, const line *l, double a, double b, double whole, int level)
{
    const double middle = 0.5 * (a + b), first = gauss(v, l, a, middle), last = gauss(v, l, middle, b);
    if (level == 0 || fabs(first + last - whole) <= 1e-13 * (first + last) + 1e-300) return first + last;
    return gauss_refined(v, l, a, middle, first, level - 1) + gauss_refined(v, l, middle, b, last, level - 1);
}

/* e^-u from u on, over h with the slope k. */
static double height_amount(double u, double k, double h)
{
    const double x = k * h;
    const double first = exp(fmin(-u, MOST_EXPONENT));
    if (fabs(x) < 1e-9) return first * h * (1 - 0.5 * x);
    return first * -expm1(fmin(-x, MOST_EXPONENT)) / k;
}

/* The integral of a volume's density from a to b along a line of any speed, in its length. */
static double amount_between(const nebel_volume_desc *v, const line *l, double a, double b)
{
    const nebel_density *d = &v->density;
    if (d->type == NEBEL_DENSITY_CONSTANT) return b - a;
    if (d->type == NEBEL_DENSITY_HEIGHT) {
        const double k = l->d[1] / d->scale_height, first = (l->o[1] + a * l->d[1] - d->base) / d->scale_height;
        if (d->below == NEBEL_BELOW_GROW) return height_amount(first, k, b - a);
        const double last = first + k * (b - a);
        if (first <= 0 && last <= 0) return b - a;
        if (first >= 0 && last >= 0) return height_amount(first, k, b - a);
        const double t = a - first / k;
        return first < 0 ? (t - a) + height_amount(0, k, b - t) : height_amount(first, k, t - a) + (b - t);
    }
    if (d->type == NEBEL_DENSITY_GAUSSIAN) {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = l->o[k] - d->center[k];
        const double nearest = -dot(p, l->d), scale = 1 / (sqrt(2.0) * d->sigma);
        for (int k = 0; k < 3; k++) p[k] += nearest * l->d[k];
        const double x = (a - nearest) * scale, y = (b - nearest) * scale;
        const double between = x > 0 ? erfc(x) - erfc(y) : y < 0 ? erfc(-y) - erfc(-x) : erf(y) - erf(x);
        return exp(-dot(p, p) * scale * scale) * 0.5 * sqrt(3.141592653589793) * between / scale;
    }
    double cuts[MOST_CUTS], sum = 0, from = a;
    size_t count = 0;
    cut_density(v, l, cuts, &count);
    add_cut(cuts, &count, b);
    qsort(cuts, count, sizeof cuts[0], compare_doubles);
    const int is_smooth = d->type == NEBEL_DENSITY_ALTITUDE;
    for (size_t i = 0; i < count && from < b; i++) {
        if (!(cuts[i] > from)) continue;
        const double to = fmin(cuts[i], b), part = gauss(v, l, from, to);
        sum += is_smooth ? gauss_refined(v, l, from, to, part, 40) : part;
        from = to;
    }
    return sum;
}

/* Optical depth between two places where the fog is marked. */
static void add_depth(const lit_scene *scene, const line *l, const unsigned char is_there[MOST_VOLUMES], double a,
                      double b, double depth[3])
{
    for (size_t i = 0; i < scene->volume_count; i++) {
        if (!is_there[i]) continue;
        const double amount = amount_between(&scene->volumes[i], l, a, b);
        for (int c = 0; c < 3; c++)
            if (scene->volumes[i].extinction[c] > 0) depth[c] += scene->volumes[i].extinction[c] * amount;
    }
}

/* ---- light ----------------------------------------------------------------------------------- */

static void depth_along(const lit_scene *scene, const line *l, double end, double depth[3])
{
    static map m;
    unsigned char is_there[MOST_VOLUMES];
    make_map(scene, l, end, &m);
    for (int c = 0; c < 3; c++) depth[c] = 0;
    for (size_t i = 0; i + 1 < m.event_count; i++) {
        const double a = m.events[i], b = m.events[i + 1];
        if (!(b > a)) continue;
        const double middle = isfinite(b) ? 0.5 * (a + b) : 2 * fabs(a) + 1;
        if (mark_fog(scene, &m, middle, is_there)) add_depth(scene, l, is_there, a, fmin(b, 1e18), depth);
    }
}

/* What arrives at t of a light, and from where; `light` -1: the sun. */
static void look_at_light(const lit_scene *scene, int light, const line *l, double t, double arriving[3],
                          double towards[3])
{
    line way;
    double depth[3], end = HUGE_VAL, fluence = 1;
    const nebel_lamp *lamp = light >= 0 ? &scene->lamps[light] : NULL;
    at(l, t, way.o);
    for (int k = 0; k < 3; k++) way.d[k] = lamp != NULL ? lamp->position[k] - way.o[k] : scene->sun.direction[k];
    const double length = sqrt(dot(way.d, way.d));
    for (int k = 0; k < 3; k++) towards[k] = way.d[k] = way.d[k] / length;
    if (lamp != NULL) {
        const double radius = lamp->radius > 0 ? lamp->radius : 1e-3, square = fmax(length * length, radius * radius);
        fluence = 2 / (square * (1 + sqrt(fmax(0, 1 - radius * radius / square))));
        end = fmax(length - lamp->radius, 0);
        if (lamp->type == NEBEL_LAMP_SPOT) {
            const double axis = sqrt(dot(lamp->direction, lamp->direction)), degree = 3.141592653589793 / 180;
            const double cosine = -dot(towards, lamp->direction) / axis;
            const double outer = cos(lamp->outer_angle * degree), inner = cos(lamp->inner_angle * degree);
            const double s = inner > outer ? fmin(fmax((cosine - outer) / (inner - outer), 0), 1) : cosine > outer;
            fluence *= s * s * (3 - 2 * s);
        }
    }
    depth_along(scene, &way, end, depth);
    for (int c = 0; c < 3; c++)
        arriving[c] = fluence * exp(-depth[c]) * (lamp != NULL ? lamp->intensity[c] : scene->sun.irradiance[c]);
}

/* ---- along the ray --------------------------------------------------------------------------- */

/* A piece of the ray with the same fog all along. */
typedef struct walk {
    const lit_scene *scene;
    const line *ray;
    int light, panels;
    unsigned char is_there[MOST_VOLUMES];
    double start, depth[3]; /* of the piece; up to there */
    double sum[3], off;
    long nodes;
} walk;

static void light_at(walk *w, double t, double value[3])
{
    double depth[3] = {w->depth[0], w->depth[1], w->depth[2]}, arriving[3], towards[3], glow[3] = {0, 0, 0};
    add_depth(w->scene, w->ray, w->is_there, w->start, t, depth);
    w->nodes++;
    for (int c = 0; c < 3; c++) value[c] = 0;
    if (fmin(fmin(depth[0], depth[1]), depth[2]) > 60) return;
    look_at_light(w->scene, w->light, w->ray, t, arriving, towards);
    const double cosine = fmin(fmax(dot(w->ray->d, towards), -1), 1);
    for (size_t i = 0; i < w->scene->volume_count; i++) {
        const nebel_volume_desc *v = &w->scene->volumes[i];
        if (!w->is_there[i] || !(v->albedo[0] + v->albedo[1] + v->albedo[2] > 0)) continue;
        const double scattered = nebel_phase_value(&v->phase, cosine) * density_at(v, w->ray, t);
        for (int c = 0; c < 3; c++) glow[c] += v->extinction[c] * v->albedo[c] * scattered;
    }
    for (int c = 0; c < 3; c++) value[c] = glow[c] * exp(-depth[c]) * arriving[c];
}

typedef struct part {
    double sum[3];
} part;

static part gauss_light(walk *w, double a, double b)
{
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    part p = {{0, 0, 0}};
    for (int i = 0; i < 4; i++)
        for (int side = -1; side <= 1; side += 2) {
            double value[3];
            light_at(w, middle + side * half * gauss_node[i], value);
            for (int c = 0; c < 3; c++) p.sum[c] += half * gauss_weight[i] * value[c];
        }
    return p;
}

/* Of what is accepted the difference of both rules is an upper estimate. */
static void refine(walk *w, double a, double b, const part *whole, double scale, int level)
{
    const double middle = 0.5 * (a + b);
    const part first = gauss_light(w, a, middle), last = gauss_light(w, middle, b);
    double off = 0;
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(first.sum[c] + last.sum[c] - whole->sum[c]));
    if (level > 0 && off > scale && middle > a && middle < b) {
        refine(w, a, middle, &first, scale, level - 1);
        refine(w, middle, b, &last, scale, level - 1);
        return;
    }
    for (int c = 0; c < 3; c++) w->sum[c] += first.sum[c] + last.sum[c];
    w->off += off;
}

/* Panels that become shorter by a factor towards both ends of every stretch, where light may be in a skin of any depth. */
static size_t cut_piece(const walk *w, double a, double b, double cuts[MOST_CUTS])
{
    double inner[MOST_CUTS];
    size_t n = 0, count = 0;
    for (size_t i = 0; i < w->scene->volume_count; i++)
        if (w->is_there[i]) cut_density(&w->scene->volumes[i], w->ray, inner, &n);
    if (w->light >= 0) {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = w->scene->lamps[w->light].position[k] - w->ray->o[k];
        const double nearest = dot(p, w->ray->d);
        double square = dot(p, p) - nearest * nearest;
        add_cut(inner, &n, nearest);
        const double radius = fmax(w->scene->lamps[w->light].radius, 1e-3);
        square = radius * radius - square;
        if (square > 0) add_cut(inner, &n, nearest - sqrt(square));
        if (square > 0) add_cut(inner, &n, nearest + sqrt(square));
    }
    for (int i = 1; i < w->panels; i++) add_cut(inner, &n, a + (b - a) * i / w->panels);
    add_cut(inner, &n, a);
    add_cut(inner, &n, b);
    qsort(inner, n, sizeof inner[0], compare_doubles);
    double last = a;
    add_cut(cuts, &count, a);
    for (size_t i = 0; i < n; i++) {
        const double to = inner[i];
        if (!(to > last && to <= b)) continue;
        const double h = to - last;
        double depth[3] = {0, 0, 0};
        add_depth(w->scene, w->ray, w->is_there, last, to, depth);
        if (last == a || to == b || depth[0] + depth[1] + depth[2] > 0.3) {
            for (double x = 1e-9; x < 0.4; x *= 6) add_cut(cuts, &count, last + x * h);
            for (double x = 1e-9; x < 0.4; x *= 6) add_cut(cuts, &count, to - x * h);
        }
        add_cut(cuts, &count, to);
        last = to;
    }
    qsort(cuts, count, sizeof cuts[0], compare_doubles);
    return count;
}

enum { MOST_NODES = 2000000 };

static int pass_piece(walk *w, double a, double b, double scale)
{
    double cuts[MOST_CUTS];
    part parts[MOST_CUTS];
    const size_t count = cut_piece(w, a, b, cuts);
    double most = scale;
    for (size_t i = 0; i + 1 < count; i++) {
        parts[i] = gauss_light(w, cuts[i], cuts[i + 1]);
        for (int c = 0; c < 3; c++) most = fmax(most, w->sum[c] + parts[i].sum[c]);
    }
    for (size_t i = 0; i + 1 < count; i++) {
        if (cuts[i + 1] > cuts[i]) refine(w, cuts[i], cuts[i + 1], &parts[i], 1e-8 * most, 40);
        if (w->nodes > MOST_NODES) return 0;
    }
    return 1;
}

static int trace_light(const lit_scene *scene, int light, const nebel_ray *ray, int panels, double S[3],
                       double *uncertainty)
{
    static map m;
    line l;
    const double length = sqrt(dot(ray->direction, ray->direction));
    for (int k = 0; k < 3; k++) {
        l.o[k] = ray->origin[k];
        l.d[k] = ray->direction[k] / length;
    }
    walk w = {.scene = scene, .ray = &l, .light = light, .panels = panels};
    make_map(scene, &l, ray->t_max, &m);
    for (size_t i = 0; i + 1 < m.event_count; i++) {
        const double a = m.events[i], b = m.events[i + 1];
        if (!(b > a) || !mark_fog(scene, &m, 0.5 * (a + b), w.is_there)) continue;
        w.start = a;
        if (!pass_piece(&w, a, b, 1e-12)) return 0;
        add_depth(scene, &l, w.is_there, a, b, w.depth);
        if (fmin(fmin(w.depth[0], w.depth[1]), w.depth[2]) > 60) break;
    }
    for (int c = 0; c < 3; c++) S[c] += w.sum[c];
    *uncertainty += w.off;
    return 1;
}

int lit_oracle_trace(const lit_scene *scene, const nebel_ray *ray, int panels, double S[3], double *uncertainty)
{
    const int is_sunlit = scene->sun.irradiance[0] + scene->sun.irradiance[1] + scene->sun.irradiance[2] > 0;
    for (int c = 0; c < 3; c++) S[c] = 0;
    *uncertainty = 0;
    gridded = scene;
    for (int i = is_sunlit ? -1 : 0; i < (int)scene->lamp_count; i++)
        if (!trace_light(scene, i, ray, panels, S, uncertainty)) return 0;
    return 1;
}
