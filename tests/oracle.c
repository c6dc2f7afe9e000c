#include "oracle.h"
#include "oracle_edge.h"
#include "oracle_shape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef oracle_real real;

#define REAL(x) ((real)(x))
#define LONG(x) ((long double)(x))

/* ---- Gauss-Legendre: nodes, weights, and integrals from 0 to each node, on [0, 1] ------------ */

enum { NODES = 16 };

static double node[NODES], weight[NODES], until[NODES][NODES];
static int tables_are_ready;

/* Legendre polynomials 0 to n at x, by their recurrence. */
static void legendre(long double x, int n, long double *p)
{
    p[0] = 1;
    p[1] = x;
    for (int k = 2; k <= n; k++) p[k] = ((2 * k - 1) * x * p[k - 1] - (k - 1) * p[k - 2]) / k;
}

/* until[i][j]: what the value at node j contributes to the integral up to node i. The interpolating polynomial is
 * sum_k (2 k + 1) / 2 (sum_j w_j f_j P_k(x_j)) P_k, and the integral of P_k from -1 is (P_k+1 - P_k-1) / (2 k + 1). */
static void fill_until(const long double x[NODES], const long double w[NODES])
{
    long double at[NODES][NODES + 1];
    for (int i = 0; i < NODES; i++) legendre(x[i], NODES, at[i]);
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++) {
            long double sum = w[j] / 2 * (x[i] + 1);
            for (int k = 1; k < NODES; k++) sum += w[j] / 2 * at[j][k] * (at[i][k + 1] - at[i][k - 1]);
            until[i][j] = (double)(sum / 2);
        }
}

static void prepare_tables(void)
{
    long double x[NODES], w[NODES], p[NODES + 1];
    for (int i = 0; i < NODES; i++) {
        x[i] = -cosl(3.14159265358979323846L * (i + .75L) / (NODES + .5L));
        long double slope = 0;
        for (int step = 0; step < 20; step++) {
            legendre(x[i], NODES, p);
            slope = NODES * (p[NODES - 1] - x[i] * p[NODES]) / (1 - x[i] * x[i]);
            x[i] -= p[NODES] / slope;
        }
        w[i] = 2 / ((1 - x[i] * x[i]) * slope * slope);
        node[i] = (double)((1 + x[i]) / 2);
        weight[i] = (double)(w[i] / 2);
    }
    fill_until(x, w);
    tables_are_ready = 1;
}

/* ---- volumes on a ray ------------------------------------------------------------------------ */

/* A profile along the ray. Everything that varies is kept as a value at t = 0 and a slope, or as a closest approach, so
 * that a short stretch can be evaluated in double from a starting value in long double. */
typedef struct volume {
    const nebel_volume_desc *desc;
    oracle_spans spans;
    long double start[3], slope[3]; /* height, linear: [0]; soft edge: position per axis */
    long double nearest, square;    /* gaussian, radial: t of the closest approach, squared radius there */
    long double speed;              /* radii per metre */
    double light[3];                /* per metre at density 1 */
    oracle_edge edge;               /* soft edge of what is no box */
} volume;

typedef struct trace {
    volume *volumes;
    size_t count;
    real *cuts;
    size_t cut_count, cut_capacity;
    const volume **active;
    size_t active_count;
    int numeric;
    double scale; /* of in-scattering */
    long double depth[3], radiance[3];
    long double uncertainty;
} trace;

static void add_cut(trace *tr, real t)
{
    tr->cuts = oracle_grow(tr->cuts, tr->cut_count, &tr->cut_capacity, sizeof *tr->cuts);
    tr->cuts[tr->cut_count++] = t;
}

/* Where start + slope t passes a value at which the profile has a kink. */
static void add_kink(trace *tr, real start, real slope, real value)
{
    if (slope != 0) add_cut(tr, (value - start) / slope);
}

static void set_line(volume *v, int axis, real start, real slope)
{
    v->start[axis] = LONG(start);
    v->slope[axis] = LONG(slope);
}

static void set_approach(volume *v, const real p[3], const real d[3])
{
    const real square = oracle_dot(d, d), nearest = -oracle_dot(p, d) / square;
    real q[3];
    for (int k = 0; k < 3; k++) q[k] = p[k] + nearest * d[k];
    v->nearest = LONG(nearest);
    v->square = LONG(oracle_dot(q, q));
    v->speed = LONG(oracle_sqrt(square));
}

static void place_height(trace *tr, volume *v, const oracle_line *ray)
{
    const nebel_density *const d = &v->desc->density;
    const real start = (ray->o[1] - REAL(d->base)) / REAL(d->scale_height), slope = ray->d[1] / REAL(d->scale_height);
    set_line(v, 0, start, slope);
    if (d->below == NEBEL_BELOW_CONSTANT) add_kink(tr, start, slope, 0);
}

static void place_linear(trace *tr, volume *v, const oracle_line *ray)
{
    const nebel_density *const d = &v->desc->density;
    real along[3], offset[3];
    for (int k = 0; k < 3; k++) {
        along[k] = REAL(d->to[k]) - REAL(d->from[k]);
        offset[k] = ray->o[k] - REAL(d->from[k]);
    }
    const real square = oracle_dot(along, along);
    const real start = oracle_dot(offset, along) / square, slope = oracle_dot(ray->d, along) / square;
    set_line(v, 0, start, slope);
    add_kink(tr, start, slope, 0);
    add_kink(tr, start, slope, 1);
}

static void place_gaussian(volume *v, const oracle_line *ray)
{
    const nebel_density *const d = &v->desc->density;
    real p[3], e[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (ray->o[k] - REAL(d->center[k])) / REAL(d->sigma);
        e[k] = ray->d[k] / REAL(d->sigma);
    }
    set_approach(v, p, e);
}

static void place_radial(volume *v, const oracle_line *ray)
{
    const nebel_shape *const shape = &v->desc->shape;
    oracle_line l = oracle_to_local(&shape->transform, ray);
    for (int k = 0; k < 3; k++) {
        const real radius = REAL(shape->type == NEBEL_SHAPE_SPHERE ? shape->radius : shape->radii[k]);
        l.o[k] = (l.o[k] - REAL(shape->center[k])) / radius;
        l.d[k] /= radius;
    }
    set_approach(v, l.o, l.d);
}

static void place_edge(trace *tr, volume *v, const oracle_line *ray)
{
    real cuts[ORACLE_EDGE_CUTS];
    v->edge = oracle_edge_of(&v->desc->shape, v->desc->density.edge_width, ray);
    const size_t n = oracle_edge_cuts(&v->edge, cuts);
    for (size_t i = 0; i < n; i++) add_cut(tr, cuts[i]);
}

/* Per axis: the distance from the middle; kinks where the edges begin and where the nearer face changes. */
static void place_soft_edge(trace *tr, volume *v, const oracle_line *ray)
{
    const nebel_shape *const shape = &v->desc->shape;
    const oracle_line l = oracle_to_local(&shape->transform, ray);
    for (int k = 0; k < 3; k++) {
        const real low = REAL(shape->min[k]), high = REAL(shape->max[k]), w = REAL(v->desc->density.edge_width);
        const real start = l.o[k] - (low + high) / 2, flat = (high - low) / 2 - w;
        set_line(v, k, start, l.d[k]);
        add_kink(tr, start, l.d[k], 0);
        add_kink(tr, start, l.d[k], flat);
        add_kink(tr, start, l.d[k], -flat);
    }
}

static void place_volume(trace *tr, volume *v, const oracle_line *ray)
{
    switch (v->desc->density.type) {
    case NEBEL_DENSITY_HEIGHT:
        place_height(tr, v, ray);
        break;
    case NEBEL_DENSITY_LINEAR:
        place_linear(tr, v, ray);
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        place_gaussian(v, ray);
        break;
    case NEBEL_DENSITY_RADIAL:
        place_radial(v, ray);
        break;
    case NEBEL_DENSITY_SOFT_EDGE:
        if (v->desc->shape.type == NEBEL_SHAPE_BOX)
            place_soft_edge(tr, v, ray);
        else
            place_edge(tr, v, ray);
        break;
    default:
        break;
    }
}

/* ---- densities at the nodes of a stretch ----------------------------------------------------- */

/* Where a density is what is left of two large numbers (the depth below a surface, an exponent), long double keeps what
 * is left; only that is rounded. */
static void soft_edge_at(const volume *v, long double a, double h, double density[NODES])
{
    const nebel_shape *const shape = &v->desc->shape;
    if (shape->type != NEBEL_SHAPE_BOX) {
        for (int i = 0; i < NODES; i++) density[i] = oracle_edge_density(&v->edge, a + LONG(h * node[i]));
        return;
    }
    for (int i = 0; i < NODES; i++) density[i] = 1;
    for (int k = 0; k < 3; k++) {
        const long double start = v->start[k] + v->slope[k] * a, slope = v->slope[k];
        const long double half = (LONG(shape->max[k]) - LONG(shape->min[k])) / 2;
        for (int i = 0; i < NODES; i++) {
            const double depth = (double)(half - fabsl(start + slope * LONG(h * node[i])));
            density[i] *= fmin(1, fmax(0, depth) / v->desc->density.edge_width);
        }
    }
}

static double exp_of(long double x)
{
    const double nearest = (double)x;
    return isfinite(nearest) ? exp(nearest) * (1 + (double)(x - LONG(nearest))) : exp(nearest);
}

static double density_of_height(long double u, nebel_below below)
{
    return exp_of(-(below == NEBEL_BELOW_CONSTANT ? fmaxl(u, 0) : u));
}

static void fill_density(const volume *v, long double a, double h, double density[NODES])
{
    const nebel_density *const d = &v->desc->density;
    const long double start = v->start[0] + v->slope[0] * a, offset = (a - v->nearest) * v->speed;
    for (int i = 0; i < NODES; i++) {
        const long double t = LONG(h * node[i]), u = start + v->slope[0] * t, r = offset + v->speed * t;
        switch (d->type) {
        case NEBEL_DENSITY_HEIGHT:
            density[i] = density_of_height(u, d->below);
            break;
        case NEBEL_DENSITY_LINEAR:
            density[i] = fmin(1, fmax(0, (double)u));
            break;
        case NEBEL_DENSITY_GAUSSIAN:
            density[i] = exp_of(-(v->square + r * r) / 2);
            break;
        case NEBEL_DENSITY_RADIAL:
            density[i] = pow(fmax(0, (double)(1 - v->square - r * r)), d->power);
            break;
        default:
            density[i] = 1;
        }
    }
    if (d->type == NEBEL_DENSITY_SOFT_EDGE) soft_edge_at(v, a, h, density);
}

/* ---- integration ----------------------------------------------------------------------------- */

/* Optical depth of a stretch and the radiance it sends to its near end. */
typedef struct stretch {
    double depth[3], radiance[3];
} stretch;

static stretch integrate(const trace *tr, long double a, double h)
{
    stretch result;
    double extinction[3][NODES] = {{0}}, light[3][NODES] = {{0}};
    for (size_t k = 0; k < tr->active_count; k++) {
        const volume *const v = tr->active[k];
        double density[NODES];
        fill_density(v, a, h, density);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < NODES; i++) {
                if (v->desc->extinction[c] > 0) extinction[c][i] += v->desc->extinction[c] * density[i];
                if (v->light[c] > 0) light[c][i] += v->light[c] * density[i];
            }
    }
    for (int c = 0; c < 3; c++) {
        double depth = 0, radiance = 0;
        for (int i = 0; i < NODES; i++) {
            double before = 0;
            for (int j = 0; j < NODES; j++) before += until[i][j] * extinction[c][j];
            depth += weight[i] * extinction[c][i];
            if (light[c][i] > 0) radiance += weight[i] * light[c][i] * exp(-h * before);
        }
        result.depth[c] = h * depth;
        result.radiance[c] = h * radiance;
    }
    return result;
}

static stretch join(const stretch *near, const stretch *far)
{
    stretch s;
    for (int c = 0; c < 3; c++) {
        s.depth[c] = near->depth[c] + far->depth[c];
        s.radiance[c] = near->radiance[c] + exp(-near->depth[c]) * far->radiance[c];
    }
    return s;
}

static double transmittance(const trace *tr, int channel)
{
    return (double)expl(-tr->depth[channel]);
}

/* Whether fog in this channel could still be seen. */
static int is_visible(const trace *tr, int channel)
{
    for (size_t i = 0; i < tr->active_count; i++)
        if (tr->active[i]->desc->extinction[channel] > 0 || tr->active[i]->light[channel] > 0)
            return transmittance(tr, channel) > 1e-30;
    return 0;
}

static int is_opaque(const trace *tr)
{
    return !is_visible(tr, 0) && !is_visible(tr, 1) && !is_visible(tr, 2);
}

/* How far two results differ as seen from the camera, and what of that may be rounding. */
typedef struct comparison {
    double change, rounding;
} comparison;

/* The change is HUGE_VAL when the stretch is too deep to be resolved. */
static comparison compare(const trace *tr, const stretch *a, const stretch *b)
{
    comparison most = {0, 0};
    for (int c = 0; c < 3; c++) {
        const double seen = transmittance(tr, c);
        if (!is_visible(tr, c)) continue;
        if (!(a->depth[c] < 8) || !(b->depth[c] < 8)) return (comparison){HUGE_VAL, 0};
        const double depth = seen * fabs(a->depth[c] - b->depth[c]) * tr->scale;
        const double radiance = seen * fabs(a->radiance[c] - b->radiance[c]);
        most.change = fmax(most.change, fmax(depth, radiance));
        most.rounding = fmax(most.rounding, 1e-15 * seen * (b->depth[c] * tr->scale + b->radiance[c]));
    }
    return most;
}

static void accept(trace *tr, const stretch *s, double change)
{
    for (int c = 0; c < 3; c++) {
        tr->radiance[c] += expl(-tr->depth[c]) * LONG(s->radiance[c]);
        tr->depth[c] += LONG(s->depth[c]);
    }
    tr->uncertainty += LONG(change);
}

/* Two halves with 16 nodes each against the whole with 16; between kinks the halves are far better than the difference.
 */
static void refine(trace *tr, long double a, double h, const stretch *whole, int level)
{
    if (is_opaque(tr)) return;
    const stretch near = integrate(tr, a, h / 2), far = integrate(tr, a + LONG(h) / 2, h / 2);
    const stretch both = join(&near, &far);
    const comparison c = compare(tr, whole, &both);
    if (c.change <= 1e-12 * tr->scale + c.rounding) {
        accept(tr, &both, c.change / 64 + c.rounding);
    } else if (level > 100) {
        accept(tr, &both, c.change);
    } else {
        refine(tr, a, h / 2, &near, level + 1);
        refine(tr, a + LONG(h) / 2, h / 2, &far, level + 1);
    }
}

/* A short piece of very dense fog needs its length to more digits than long double has of its ends. */
static void integrate_between(trace *tr, real a, real b)
{
    if (!(a < b)) return;
    const double h = (double)(b - a);
    const stretch whole = integrate(tr, LONG(a), h);
    refine(tr, LONG(a), h, &whole, 0);
}

typedef struct marks {
    size_t count, capacity;
    real *at;
} marks;

static void add_mark(marks *m, real t, real from, real to)
{
    if (!(from < t && t < to)) return;
    m->at = oracle_grow(m->at, m->count, &m->capacity, sizeof *m->at);
    m->at[m->count++] = t;
}

/* Sixteen nodes on a long piece can all miss where the fog is: so there are cuts at fixed numbers of scale heights from
 * the dense end, and of sigmas from the middle. */
static void add_guides(marks *m, const volume *v, real from, real to)
{
    static const long double heights[] = {2, 8, 30, 100, 400}, sigmas[] = {1, 3, 7, 15};
    if (v->desc->density.type == NEBEL_DENSITY_HEIGHT && v->slope[0] != 0)
        for (int i = 0; i < 5; i++)
            add_mark(m, (v->slope[0] > 0 ? from : to) + REAL(heights[i] / v->slope[0]), from, to);
    if (v->desc->density.type == NEBEL_DENSITY_GAUSSIAN)
        for (int i = 0; i < 8; i++)
            add_mark(m, REAL(v->nearest + (i % 2 ? 1 : -1) * sigmas[i / 2] / v->speed), from, to);
}

static void integrate_piece(trace *tr, real from, real to)
{
    marks m = {0};
    for (size_t i = 0; i < tr->active_count; i++) add_guides(&m, tr->active[i], from, to);
    if (m.count > 0) qsort(m.at, m.count, sizeof *m.at, oracle_ascending);
    real start = from;
    for (size_t i = 0; i < m.count; i++) {
        integrate_between(tr, start, m.at[i]);
        start = m.at[i];
    }
    integrate_between(tr, start, to);
    free(m.at);
}

static int is_even(const trace *tr)
{
    for (size_t i = 0; i < tr->active_count; i++)
        if (tr->active[i]->desc->density.type != NEBEL_DENSITY_CONSTANT) return 0;
    return !tr->numeric;
}

/* Extinction s and light j that do not change over h metres, perhaps without end: j h (1 - e^-sh) / (s h). */
static void pass_even(trace *tr, long double h)
{
    for (int c = 0; c < 3; c++) {
        long double extinction = 0, light = 0;
        for (size_t i = 0; i < tr->active_count; i++) {
            extinction += LONG(tr->active[i]->desc->extinction[c]);
            light += LONG(tr->active[i]->light[c]);
        }
        const long double depth = extinction > 0 ? extinction * h : 0;
        const long double reach = depth > 0 ? -expm1l(-depth) / extinction : h;
        if (light > 0) tr->radiance[c] += expl(-tr->depth[c]) * light * reach;
        tr->depth[c] += depth;
    }
}

/* The density far behind the last cut. */
static double final_density(const volume *v)
{
    const nebel_density *const d = &v->desc->density;
    const double start = (double)v->start[0], slope = (double)v->slope[0];
    switch (d->type) {
    case NEBEL_DENSITY_CONSTANT:
        return 1;
    case NEBEL_DENSITY_HEIGHT:
        return density_of_height(LONG(slope > 0 ? HUGE_VAL : slope < 0 ? -HUGE_VAL : start), d->below);
    case NEBEL_DENSITY_LINEAR:
        return slope > 0 ? 1 : slope < 0 ? 0 : fmin(1, fmax(0, start));
    case NEBEL_DENSITY_SOFT_EDGE:
        return oracle_edge_final(&v->edge);
    default:
        return 0;
    }
}

/* How far one has to go behind `from` until nothing happens any more. */
static long double horizon(const volume *v, long double from)
{
    const nebel_density *const d = &v->desc->density;
    const double final = final_density(v);
    const long double u = v->start[0] + v->slope[0] * from;
    if (final > 1e300) return (fmaxl(0, u + 700) + 1) / -v->slope[0];
    if (d->type == NEBEL_DENSITY_GAUSSIAN) return fmaxl(0, v->nearest - from) + 40 / v->speed;
    if (d->type == NEBEL_DENSITY_HEIGHT && !(final > 0) && v->slope[0] > 0) return (80 + fmaxl(0, -u)) / v->slope[0];
    long double furthest = 0;
    for (int c = 0; c < 3; c++) {
        const double extinction = v->desc->extinction[c] * final;
        if (extinction > 0) furthest = fmaxl(furthest, 120 / LONG(extinction));
    }
    return furthest;
}

/* Light that nothing absorbs, without end. */
static int is_endless_light(const trace *tr)
{
    for (int c = 0; c < 3; c++) {
        double extinction = 0, light = 0;
        for (size_t i = 0; i < tr->active_count; i++) {
            const double final = final_density(tr->active[i]);
            if (!(final > 0)) continue;
            extinction += tr->active[i]->desc->extinction[c];
            light += tr->active[i]->light[c];
        }
        if (light > 0 && !(extinction > 0)) return 1;
    }
    return 0;
}

/* The rule as it is written: nothing of a higher priority replaces it there, and nothing of its own or a higher one
 * excludes it. */
static int is_fog_at(const trace *tr, size_t which, real t)
{
    const nebel_volume_desc *const own = tr->volumes[which].desc;
    if (own->operation == NEBEL_OPERATION_EXCLUDE || !oracle_contains(&tr->volumes[which].spans, t)) return 0;
    for (size_t i = 0; i < tr->count; i++) {
        const nebel_volume_desc *const other = tr->volumes[i].desc;
        const int replaces = other->operation == NEBEL_OPERATION_REPLACE && other->priority > own->priority;
        const int excludes = other->operation == NEBEL_OPERATION_EXCLUDE && other->priority >= own->priority;
        if ((replaces || excludes) && oracle_contains(&tr->volumes[i].spans, t)) return 0;
    }
    return 1;
}

static void pass_piece(trace *tr, real from, real to)
{
    tr->active_count = 0;
    if (!(from < to)) return;
    const real middle = oracle_between(from, to);
    for (size_t i = 0; i < tr->count; i++)
        if (is_fog_at(tr, i, middle)) tr->active[tr->active_count++] = &tr->volumes[i];
    if (tr->active_count == 0) return;
    const int endless = !(to < REAL(HUGE_VAL));
    if (endless && is_endless_light(tr)) {
        tr->uncertainty = LONG(HUGE_VAL);
        return;
    }
    if (is_even(tr)) {
        pass_even(tr, endless ? LONG(HUGE_VAL) : LONG(to - from));
        return;
    }
    real last = to;
    if (endless) {
        long double length = 0;
        for (size_t i = 0; i < tr->active_count; i++) length = fmaxl(length, horizon(tr->active[i], LONG(from)));
        last = from + REAL(length);
    }
    integrate_piece(tr, from, last);
}

/* ---- the whole ray --------------------------------------------------------------------------- */

static oracle_line line_of(const nebel_ray *ray)
{
    oracle_line l;
    for (int k = 0; k < 3; k++) {
        l.o[k] = REAL(ray->origin[k]);
        l.d[k] = REAL(ray->direction[k]);
    }
    const real length = oracle_sqrt(oracle_dot(l.d, l.d));
    for (int k = 0; k < 3; k++) l.d[k] /= length;
    return l;
}

/* The spans between the distances at which a volume begins and ceases to act. */
static void clip_spans(oracle_spans *spans, const nebel_volume_desc *desc)
{
    const real start = REAL(desc->start), cutoff = REAL(desc->cutoff > 0 ? desc->cutoff : HUGE_VAL);
    size_t kept = 0;
    for (size_t i = 0; i < spans->count; i++) {
        oracle_span s = spans->at[i];
        if (s.from < start) s.from = start;
        if (s.to > cutoff) s.to = cutoff;
        if (s.from < s.to) spans->at[kept++] = s;
    }
    spans->count = kept;
}

static void add_volume(trace *tr, const nebel_volume_desc *desc, const double ambient[3], const oracle_line *line,
                       real end)
{
    volume *const v = &tr->volumes[tr->count];
    int undecided = 0;
    *v = (volume){.desc = desc, .spans = oracle_inside(&desc->shape, line, end, &undecided)};
    if (undecided) tr->uncertainty = LONG(HUGE_VAL);
    clip_spans(&v->spans, desc);
    for (size_t i = 0; i < v->spans.count; i++) {
        add_cut(tr, v->spans.at[i].from);
        add_cut(tr, v->spans.at[i].to);
    }
    tr->count++;
    if (desc->operation == NEBEL_OPERATION_EXCLUDE) return;
    for (int c = 0; c < 3; c++) {
        const double radiance = desc->source[c] + desc->albedo[c] * ambient[c];
        v->light[c] = radiance * desc->extinction[c] + desc->emission[c];
        tr->scale = fmax(tr->scale, radiance);
    }
    if (v->spans.count > 0) place_volume(tr, v, line);
}

static void pass_all(trace *tr, real end)
{
    add_cut(tr, 0);
    add_cut(tr, end);
    qsort(tr->cuts, tr->cut_count, sizeof *tr->cuts, oracle_ascending);
    for (size_t i = 0; i + 1 < tr->cut_count; i++)
        if (tr->cuts[i] >= 0 && tr->cuts[i + 1] <= end) pass_piece(tr, tr->cuts[i], tr->cuts[i + 1]);
}

static void run(const nebel_volume_desc *volumes, size_t n, const double ambient[3], const nebel_ray *ray, int numeric,
                double T[3], double S[3], double *uncertainty)
{
    if (!tables_are_ready) prepare_tables();
    trace tr = {.numeric = numeric, .scale = 1};
    const oracle_line line = line_of(ray);
    size_t capacity = 0;
    while (capacity <= n) tr.volumes = oracle_grow(tr.volumes, capacity, &capacity, sizeof *tr.volumes);
    size_t active_capacity = 0;
    while (active_capacity <= n)
        tr.active = oracle_grow(tr.active, active_capacity, &active_capacity, sizeof *tr.active);
    for (size_t i = 0; i < n; i++) add_volume(&tr, &volumes[i], ambient, &line, REAL(ray->t_max));
    pass_all(&tr, REAL(ray->t_max));
    *uncertainty = (double)tr.uncertainty;
    for (int c = 0; c < 3; c++) {
        T[c] = (double)expl(-tr.depth[c]);
        S[c] = (double)tr.radiance[c];
        *uncertainty += 4e-16 * (T[c] + fabs(S[c]) + tr.scale);
    }
    for (size_t i = 0; i < tr.count; i++) free(tr.volumes[i].spans.at);
    free(tr.volumes);
    free(tr.active);
    free(tr.cuts);
}

void oracle_trace(const nebel_volume_desc *volumes, size_t n, const double ambient[3], const nebel_ray *ray,
                  double T[3], double S[3], double *uncertainty)
{
    run(volumes, n, ambient, ray, 0, T, S, uncertainty);
}

void oracle_trace_numerically(const nebel_volume_desc *volumes, size_t n, const double ambient[3], const nebel_ray *ray,
                              double T[3], double S[3], double *uncertainty)
{
    run(volumes, n, ambient, ray, 1, T, S, uncertainty);
}

void oracle_limit(double max_opacity, double T[3], double S[3], double *uncertainty)
{
    if (!(max_opacity > 0)) return;
    for (int c = 0; c < 3; c++) {
        if (!(1 - T[c] > max_opacity)) continue;
        S[c] *= max_opacity / (1 - T[c]);
        T[c] = 1 - max_opacity;
    }
    *uncertainty *= 1 + 1 / max_opacity;
}
