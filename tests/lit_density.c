#include "lit_density.h"

#include "lit_edge.h"

#include <math.h>

/* Of densities: beyond this they would be no numbers. */
#define MAX_EXPONENT 300.0

enum { MAX_SCALE_HEIGHTS = 40 };

static void at(const lit_line *l, double t, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = l->o[k] + t * l->d[k];
}

static double nearest_to(const lit_line *l, const double center[3])
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = center[k] - l->o[k];
    return lit_dot(p, l->d);
}

lit_medium lit_medium_on(const lit_fog *fog, size_t volume, const lit_line *l)
{
    lit_medium m = {.scene = fog->scene, .volume = &fog->scene->volumes[volume], .world = l};
    const nebel_density *d = &m.volume->density;
    if (d->type == NEBEL_DENSITY_RADIAL || d->type == NEBEL_DENSITY_SOFT_EDGE || d->type == NEBEL_DENSITY_GRID)
        m.local = lit_to_local(&fog->leaves[fog->first_leaf[volume]], l);
    if (d->type != NEBEL_DENSITY_ALTITUDE) return m;
    double p[3];
    m.nearest = nearest_to(l, d->center);
    for (int k = 0; k < 3; k++) p[k] = l->o[k] - d->center[k] + m.nearest * l->d[k];
    m.distance = sqrt(lit_dot(p, p));
    return m;
}

/* ---- at places ------------------------------------------------------------------------------- */

static double voxel_at(const lit_scene *scene, const int place[3])
{
    int i[3];
    for (int k = 0; k < 3; k++) i[k] = place[k] < 0 ? 0 : place[k] >= scene->size[k] ? scene->size[k] - 1 : place[k];
    return (double)scene->voxels[i[0] + scene->size[0] * (i[1] + scene->size[1] * i[2])];
}

static double grid_at(const lit_scene *scene, const nebel_shape *box, const double p[3])
{
    double share[3], value = 0;
    int cell[3];
    for (int k = 0; k < 3; k++) {
        const double x = (p[k] - box->min[k]) / (box->max[k] - box->min[k]) * scene->size[k];
        const double from = scene->is_nearest ? x : x - 0.5;
        cell[k] = (int)floor(from);
        share[k] = from - cell[k];
    }
    if (scene->is_nearest) return voxel_at(scene, cell);
    for (int i = 0; i < 8; i++) {
        double weight = 1;
        const int corner[3] = {cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2)};
        for (int k = 0; k < 3; k++) weight *= corner[k] > cell[k] ? share[k] : 1 - share[k];
        value += weight * voxel_at(scene, corner);
    }
    return value;
}

static double exponential(const nebel_density *d, double u)
{
    return exp(fmin(-(d->below == NEBEL_BELOW_CONSTANT ? fmax(u, 0) : u), MAX_EXPONENT));
}

/* Above the base of an altitude density, without the difference of two large numbers. */
static double scale_heights_up(const lit_medium *m, double t)
{
    const nebel_density *d = &m->volume->density;
    const double along = t - m->nearest, from_center = sqrt(m->distance * m->distance + along * along);
    return (m->distance - d->radius - d->base + along * along / (from_center + m->distance)) / d->scale_height;
}

static double linear_at(const nebel_density *d, const double p[3])
{
    double q[3], r[3];
    for (int k = 0; k < 3; k++) {
        q[k] = d->to[k] - d->from[k];
        r[k] = p[k] - d->from[k];
    }
    return fmin(fmax(lit_dot(r, q) / lit_dot(q, q), 0), 1);
}

static double radial_at(const nebel_shape *s, int power, const double p[3])
{
    double square = 0, value = 1;
    for (int k = 0; k < 3; k++) {
        const double x = (p[k] - s->center[k]) / (s->type == NEBEL_SHAPE_SPHERE ? s->radius : s->radii[k]);
        square += x * x;
    }
    for (int i = 0; i < power; i++) value *= fmax(0, 1 - square);
    return value;
}

double lit_density_at(const lit_medium *m, double t)
{
    const nebel_density *d = &m->volume->density;
    const nebel_shape *s = &m->volume->shape;
    double p[3];
    if (d->type == NEBEL_DENSITY_CONSTANT) return 1;
    if (d->type == NEBEL_DENSITY_SOFT_EDGE) return lit_edge_at(s, d->edge_width, &m->local, t);
    const int is_local = d->type == NEBEL_DENSITY_RADIAL || d->type == NEBEL_DENSITY_GRID;
    at(is_local ? &m->local : m->world, t, p);
    switch (d->type) {
    case NEBEL_DENSITY_HEIGHT:
        return exponential(d, (p[1] - d->base) / d->scale_height);
    case NEBEL_DENSITY_LINEAR:
        return linear_at(d, p);
    case NEBEL_DENSITY_GAUSSIAN:
        for (int k = 0; k < 3; k++) p[k] = (p[k] - d->center[k]) / d->sigma;
        return exp(-0.5 * lit_dot(p, p));
    case NEBEL_DENSITY_ALTITUDE:
        return exponential(d, scale_heights_up(m, t));
    case NEBEL_DENSITY_RADIAL:
        return radial_at(s, d->power, p);
    default:
        return grid_at(m->scene, s, p);
    }
}

/* ---- where they are not smooth --------------------------------------------------------------- */

static void cut_linear(const nebel_density *d, const lit_line *l, lit_cuts *cuts)
{
    double q[3], p[3];
    for (int k = 0; k < 3; k++) {
        q[k] = d->to[k] - d->from[k];
        p[k] = l->o[k] - d->from[k];
    }
    const double square = lit_dot(q, q), value = lit_dot(p, q) / square, rate = lit_dot(l->d, q) / square;
    lit_add_cut(cuts, -value / rate);
    lit_add_cut(cuts, (1 - value) / rate);
}

/* The center's side, and balls whose surfaces are a few scale heights apart, up to where there is nothing. */
static void cut_altitude(const lit_medium *m, double a, double b, lit_cuts *cuts)
{
    const nebel_density *d = &m->volume->density;
    const double level = d->radius + d->base;
    lit_add_cut(cuts, m->nearest);
    for (int i = d->below == NEBEL_BELOW_CONSTANT ? 0 : -24; i <= MAX_SCALE_HEIGHTS; i += 4) {
        const double r = level + i * d->scale_height, square = r * r - m->distance * m->distance;
        if (!(r > 0 && square > 0)) continue;
        const double half = sqrt(square), first = m->nearest - half, last = m->nearest + half;
        if (first > a && first < b) lit_add_cut(cuts, first);
        if (last > a && last < b) lit_add_cut(cuts, last);
    }
}

static void cut_grid(const lit_medium *m, double a, double b, lit_cuts *cuts)
{
    const nebel_shape *s = &m->volume->shape;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < m->scene->size[k]; i++) {
            const double share = (i + (m->scene->is_nearest ? 0 : 0.5)) / m->scene->size[k];
            const double t = (s->min[k] + share * (s->max[k] - s->min[k]) - m->local.o[k]) / m->local.d[k];
            if (t > a && t < b) lit_add_cut(cuts, t);
        }
}

void lit_density_cut(const lit_medium *m, double a, double b, lit_cuts *cuts)
{
    const nebel_density *d = &m->volume->density;
    const double nearest = d->type == NEBEL_DENSITY_GAUSSIAN ? nearest_to(m->world, d->center) : 0;
    switch (d->type) {
    case NEBEL_DENSITY_HEIGHT:
        if (d->below == NEBEL_BELOW_CONSTANT) lit_add_cut(cuts, (d->base - m->world->o[1]) / m->world->d[1]);
        return;
    case NEBEL_DENSITY_LINEAR:
        cut_linear(d, m->world, cuts);
        return;
    case NEBEL_DENSITY_GAUSSIAN:
        for (int i = -12; i <= 12; i++) lit_add_cut(cuts, nearest + i * 0.75 * d->sigma);
        return;
    case NEBEL_DENSITY_ALTITUDE:
        cut_altitude(m, a, b, cuts);
        return;
    case NEBEL_DENSITY_SOFT_EDGE:
        lit_edge_cut(&m->volume->shape, d->edge_width, &m->local, a, b, cuts);
        return;
    case NEBEL_DENSITY_GRID:
        cut_grid(m, a, b, cuts);
        return;
    default:
        return;
    }
}

/* ---- integrals ------------------------------------------------------------------------------- */

/* Gauss's rules of four and eight nodes on [-1, 1]: Abramowitz and Stegun, table 25.4. That of four is exact for
 * polynomials of degree seven, which all of ours are that are none of height, altitude and Gaussian. */
static const double node_of_4[2] = {0.3399810435848563, 0.8611363115940526};
static const double weight_of_4[2] = {0.6521451548625461, 0.3478548451374538};
static const double node_of_8[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
static const double weight_of_8[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

static double gauss(const lit_medium *m, double a, double b, int half_count)
{
    const double *node = half_count == 2 ? node_of_4 : node_of_8, *weight = half_count == 2 ? weight_of_4 : weight_of_8;
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    double sum = 0;
    for (int i = 0; i < half_count; i++)
        sum += weight[i] * (lit_density_at(m, middle - half * node[i]) + lit_density_at(m, middle + half * node[i]));
    return half * sum;
}

static double gauss_refined(const lit_medium *m, double a, double b, double whole, double allowed, int level)
{
    const double middle = 0.5 * (a + b), first = gauss(m, a, middle, 4), last = gauss(m, middle, b, 4);
    if (level == 0 || fabs(first + last - whole) <= allowed) return first + last;
    return gauss_refined(m, a, middle, first, allowed, level - 1) +
           gauss_refined(m, middle, b, last, allowed, level - 1);
}

/* Of an altitude density between its cuts: nearly an exponential, of which the rule of eight nodes is off by 1e-12, but for
 * where the line is next to the center. */
static double altitude_amount(const lit_medium *m, double a, double b, double so_far)
{
    if (fmin(scale_heights_up(m, a), scale_heights_up(m, b)) >= MAX_SCALE_HEIGHTS - 1) return 0;
    const double whole = gauss(m, a, b, 4);
    if (a > m->nearest || b < m->nearest) return whole;
    return gauss_refined(m, a, b, whole, 1e-10 * (so_far + whole), 20);
}

static double sum_of_pieces(const lit_medium *m, double a, double b)
{
    static lit_cuts cuts;
    double sum = 0, from = a;
    cuts.count = 0;
    if (m->volume->density.type != NEBEL_DENSITY_RADIAL) lit_density_cut(m, a, b, &cuts);
    lit_add_cut(&cuts, b);
    lit_sort(cuts.at, cuts.count);
    for (size_t i = 0; i < cuts.count && from < b; i++) {
        if (!(cuts.at[i] > from)) continue;
        const double to = fmin(cuts.at[i], b);
        sum += m->volume->density.type == NEBEL_DENSITY_ALTITUDE ? altitude_amount(m, from, to, sum)
                                                                 : gauss(m, from, to, 2);
        from = to;
    }
    return sum;
}

/* e^-u from u on, over h with the slope k. */
static double height_amount(double u, double k, double h)
{
    const double x = k * h;
    const double first = exp(fmin(-u, MAX_EXPONENT));
    if (fabs(x) < 1e-9) return first * h * (1 - 0.5 * x);
    return first * -expm1(fmin(-x, MAX_EXPONENT)) / k;
}

static double amount_of_height(const nebel_density *d, const lit_line *l, double a, double b)
{
    const double k = l->d[1] / d->scale_height, first = (l->o[1] + a * l->d[1] - d->base) / d->scale_height;
    if (d->below == NEBEL_BELOW_GROW) return height_amount(first, k, b - a);
    const double last = first + k * (b - a);
    if (first <= 0 && last <= 0) return b - a;
    if (first >= 0 && last >= 0) return height_amount(first, k, b - a);
    const double t = a - first / k;
    return first < 0 ? (t - a) + height_amount(0, k, b - t) : height_amount(first, k, t - a) + (b - t);
}

static double amount_of_gaussian(const nebel_density *d, const lit_line *l, double a, double b)
{
    double p[3];
    const double nearest = nearest_to(l, d->center), scale = 1 / (sqrt(2.0) * d->sigma);
    for (int k = 0; k < 3; k++) p[k] = l->o[k] - d->center[k] + nearest * l->d[k];
    const double x = (a - nearest) * scale, y = (b - nearest) * scale;
    const double between = x > 0 ? erfc(x) - erfc(y) : y < 0 ? erfc(-y) - erfc(-x) : erf(y) - erf(x);
    return exp(-lit_dot(p, p) * scale * scale) * 0.5 * sqrt(3.141592653589793) * between / scale;
}

double lit_density_amount(const lit_medium *m, double a, double b)
{
    const nebel_density *d = &m->volume->density;
    const nebel_shape *s = &m->volume->shape;
    if (d->type == NEBEL_DENSITY_CONSTANT) return b - a;
    if (d->type == NEBEL_DENSITY_HEIGHT) return amount_of_height(d, m->world, a, b);
    if (d->type == NEBEL_DENSITY_GAUSSIAN) return amount_of_gaussian(d, m->world, a, b);
    if (d->type == NEBEL_DENSITY_SOFT_EDGE && lit_edge_has_faces(s))
        return lit_edge_amount_of_faces(s, d->edge_width, &m->local, a, b);
    return sum_of_pieces(m, a, b);
}
