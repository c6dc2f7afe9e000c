#include "formula_truth.h"
#include "gauss_rule.h"

#include <math.h>

/* ---- intervals ------------------------------------------------------------------------------- */

enum { MOST_EVENTS = 8 };

/* The places where a ray meets the surfaces that bound a shape, or their continuations. */
typedef struct events {
    int count;
    nb_quad t[MOST_EVENTS];
} events;

static void add_event(events *e, nb_quad t)
{
    int i = e->count++;
    for (; i > 0 && e->t[i - 1] > t; --i) e->t[i] = e->t[i - 1];
    e->t[i] = t;
}

/* Newton's iteration doubles the digits of sqrtl each time. */
static nb_quad square_root(nb_quad x)
{
    if (!(x > 0)) return 0;
    nb_quad root = (nb_quad)sqrtl((long double)x);
    for (int i = 0; i < 2; ++i) root = (root + x / root) / 2;
    return root;
}

/* a t^2 + 2 b t + c = 0, counted from t = middle */
static void add_roots(events *e, nb_quad middle, nb_quad a, nb_quad b, nb_quad c)
{
    const nb_quad discriminant = b * b - a * c;
    if (discriminant < 0) return;
    const nb_quad root = square_root(discriminant);
    const nb_quad sum = b < 0 ? b - root : b + root;
    if (a != 0) add_event(e, middle - sum / a);
    if (sum != 0) add_event(e, middle - c / sum);
}

static void add_plane(events *e, nb_quad p, nb_quad d, nb_quad at)
{
    if (d != 0) add_event(e, (at - p) / d);
}

static nb_quad dot(const nb_quad *a, const nb_quad *b, int n)
{
    nb_quad sum = 0;
    for (int i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

static void add_ball(events *e, const nb_quad p[3], const nb_quad d[3], nb_quad z, nb_quad radius)
{
    const nb_quad from[3] = {p[0], p[1], p[2] - z};
    const nb_quad a = dot(d, d, 3), middle = -dot(from, d, 3) / a;
    nb_quad q[3];
    for (int i = 0; i < 3; ++i) q[i] = from[i] + d[i] * middle;
    add_roots(e, middle, a, dot(q, d, 3), dot(q, q, 3) - radius * radius);
}

/* x^2 + y^2 = (radius + slope z)^2, counted from the middle of the axis so that a distant start costs no digits. */
static void add_side(events *e, const nb_quad p[3], const nb_quad d[3], nb_quad radius, nb_quad slope)
{
    const nb_quad from[3] = {p[0], p[1], p[2] - (nb_quad)0.5};
    const nb_quad middle = -dot(from, d, 3) / dot(d, d, 3);
    nb_quad q[3];
    for (int i = 0; i < 3; ++i) q[i] = p[i] + d[i] * middle;
    const nb_quad w = radius + slope * q[2], growth = slope * d[2];
    add_roots(e, middle, dot(d, d, 2) - growth * growth, dot(q, d, 2) - w * growth, dot(q, q, 2) - w * w);
}

/* What describes the shape: inputs 6 to 11. */
typedef struct body {
    nb_quad v[6];
} body;

static body body_of(const long double *in)
{
    body b;
    for (int i = 0; i < 6; ++i) b.v[i] = (nb_quad)in[6 + i];
    return b;
}

static events events_of(nb_formula shape, const body *b, const nb_quad p[3], const nb_quad d[3])
{
    events e = {0};
    const nb_quad *v = b->v;
    for (int i = 0; i < 3 && shape == NB_FORMULA_box; ++i) {
        add_plane(&e, p[i], d[i], v[i]);
        add_plane(&e, p[i], d[i], v[3 + i]);
    }
    if (shape == NB_FORMULA_half_space) add_plane(&e, dot(v, p, 3), dot(v, d, 3), v[3]);
    if (shape == NB_FORMULA_ball) add_ball(&e, p, d, 0, v[0]);
    if (shape == NB_FORMULA_tube || shape == NB_FORMULA_capsule) add_side(&e, p, d, 1, 0);
    if (shape == NB_FORMULA_cone) add_side(&e, p, d, v[0], v[1]);
    if (shape == NB_FORMULA_tube || shape == NB_FORMULA_cone) {
        add_plane(&e, p[2], d[2], 0);
        add_plane(&e, p[2], d[2], 1);
    }
    if (shape == NB_FORMULA_capsule) {
        add_ball(&e, p, d, 0, 1);
        add_ball(&e, p, d, v[0], 1);
    }
    return e;
}

int nb_truth_inside(nb_formula shape, const long double *in, const nb_quad x[3])
{
    const body b = body_of(in);
    const nb_quad across = dot(x, x, 2), z = x[2], w = b.v[0] + b.v[1] * z;
    const nb_quad above = z < 0 ? z : z > b.v[0] ? z - b.v[0] : 0;
    switch (shape) {
    case NB_FORMULA_box:
        for (int i = 0; i < 3; ++i)
            if (x[i] < b.v[i] || x[i] >= b.v[3 + i]) return 0;
        return 1;
    case NB_FORMULA_half_space:
        return dot(b.v, x, 3) <= b.v[3];
    case NB_FORMULA_ball:
        return dot(x, x, 3) <= b.v[0] * b.v[0];
    case NB_FORMULA_tube:
        return across <= 1 && z >= 0 && z <= 1;
    case NB_FORMULA_cone:
        return across <= w * w && w >= 0 && z >= 0 && z <= 1;
    default:
        return across + above * above <= 1;
    }
}

/* A place outside all events, as far from the last as that is from 0: one metre would drown in its digits. */
static nb_quad beyond(nb_quad last, nb_quad sign)
{
    return last + sign * (1 + (last < 0 ? -last : last));
}

nb_quad_interval nb_truth_interval(nb_formula shape, const long double *in, const nb_quad p[3], const nb_quad d[3])
{
    const body b = body_of(in);
    const events e = events_of(shape, &b, p, d);
    nb_quad_interval span = {0, 0, 0};
    for (int i = 0; i <= e.count; ++i) {
        const nb_quad from = i > 0 ? e.t[i - 1] : (nb_quad)-1e18L, to = i < e.count ? e.t[i] : (nb_quad)1e18L;
        const nb_quad middle = i > 0 && i < e.count ? (from + to) / 2
                               : i > 0              ? beyond(from, 1)
                               : e.count > 0        ? beyond(to, -1)
                                                    : 0;
        nb_quad x[3];
        for (int k = 0; k < 3; ++k) x[k] = p[k] + d[k] * middle;
        if (!(from < to) || !nb_truth_inside(shape, in, x)) continue;
        if (!span.hit) span.enter = from;
        span.leave = to;
        span.hit = 1;
    }
    return span;
}

/* ---- profiles -------------------------------------------------------------------------------- */

static long double soft_axis(long double q, long double e)
{
    return fmaxl(fminl(e - fabsl(q), 1), 0);
}

static int power_of(nb_formula radial)
{
    return radial == NB_FORMULA_radial_1_integral ? 1 : radial == NB_FORMULA_radial_2_integral ? 2 : 3;
}

long double nb_truth_density(nb_formula integral, const long double *in, long double s)
{
    const long double u = in[0] + in[1] * s;
    long double product = 1;
    switch (integral) {
    case NB_FORMULA_height_integral:
        return expl(-u);
    case NB_FORMULA_height_capped_integral:
        return u < 0 ? 1 : expl(-u);
    case NB_FORMULA_linear_integral:
        return u < 0 ? 0 : u > 1 ? 1 : u;
    case NB_FORMULA_gaussian_integral:
        return expl(-(in[0] + (in[1] + in[3] * s) * (in[1] + in[3] * s)));
    case NB_FORMULA_soft_edge_integral:
        for (int i = 0; i < 3; ++i) product *= soft_axis(in[i] + in[3 + i] * s, in[6 + i]);
        return product;
    default:
        return powl(fmaxl(in[0] - (in[1] + in[2] * s) * (in[1] + in[2] * s), 0), power_of(integral));
    }
}

enum { PANELS = 32, MOST_KINKS = 20 };

static long double quadrature(nb_formula integral, const long double *in, long double from, long double to, int panels)
{
    if (rule_nodes[0] == 0) make_rule();
    const long double half = (to - from) / (2 * panels);
    long double sum = 0;
    for (int i = 0; i < panels; ++i)
        for (int k = 0; k < RULE_POINTS; ++k)
            sum += rule_weights[k] * nb_truth_density(integral, in, from + half * (2 * i + 1 + rule_nodes[k]));
    return sum * half;
}

typedef struct kinks {
    int count;
    long double at[MOST_KINKS];
} kinks;

/* Where q + k s = level, if that is within the piece. */
static void add_kink(kinks *list, long double q, long double k, long double level, long double h)
{
    const long double s = k == 0 ? -1 : (level - q) / k;
    if (!(s > 0 && s < h)) return;
    int i = list->count++;
    for (; i > 0 && list->at[i - 1] > s; --i) list->at[i] = list->at[i - 1];
    list->at[i] = s;
}

static kinks kinks_of(nb_formula integral, const long double *in, long double h)
{
    kinks list = {0};
    if (integral == NB_FORMULA_linear_integral || integral == NB_FORMULA_height_capped_integral)
        add_kink(&list, in[0], in[1], 0, h);
    if (integral == NB_FORMULA_linear_integral) add_kink(&list, in[0], in[1], 1, h);
    for (int i = 0; i < 3 && integral == NB_FORMULA_soft_edge_integral; ++i) {
        add_kink(&list, in[i], in[3 + i], 0, h);
        for (int side = -1; side <= 1; side += 2) {
            add_kink(&list, in[i], in[3 + i], side * in[6 + i], h);
            if (in[6 + i] > 1) add_kink(&list, in[i], in[3 + i], side * (in[6 + i] - 1), h);
        }
    }
    return list;
}

/* The part of the piece that is not e^-50 times smaller than the densest part; the rest adds less than any digit here.
 */
static void clip_exponential(long double k, long double *from, long double *to)
{
    const long double reach = 50 / fabsl(k);
    if (k > 0) *to = fminl(*to, *from + reach);
    if (k < 0) *from = fmaxl(*from, *to - reach);
}

/* e^(-m - x^2) from where it counts: a start far away would cost digits of x. */
static long double gaussian_piece(const long double *in)
{
    const long double nearest = fminl(fmaxl(0, in[1]), in[2]);
    const long double reach = 50 / (fabsl(nearest) + sqrtl(nearest * nearest + 50));
    const long double from = fmaxl(in[1], nearest - reach), to = fminl(in[2], nearest + reach);
    const long double clipped[] = {in[0], from, to, in[3]};
    return quadrature(NB_FORMULA_gaussian_integral, clipped, 0, (to - from) / in[3], PANELS);
}

static long double piece(nb_formula integral, const long double *in, long double from, long double to)
{
    const int height = integral == NB_FORMULA_height_integral || integral == NB_FORMULA_height_capped_integral;
    const int flat = integral == NB_FORMULA_height_capped_integral && in[0] + in[1] * (from + (to - from) / 2) < 0;
    if (height && !flat && in[1] != 0) clip_exponential(in[1], &from, &to);
    return quadrature(integral, in, from, to, height ? PANELS : 1);
}

static long double length_of(nb_formula integral, const long double *in)
{
    if (integral == NB_FORMULA_soft_edge_integral) return in[9];
    return integral >= NB_FORMULA_radial_1_integral && integral <= NB_FORMULA_radial_3_integral ? in[3] : in[2];
}

long double nb_truth_integral(nb_formula integral, const long double *in)
{
    if (integral == NB_FORMULA_gaussian_integral) return gaussian_piece(in);
    const long double h = length_of(integral, in);
    const kinks list = kinks_of(integral, in, h);
    long double sum = 0, from = 0;
    for (int i = 0; i <= list.count; ++i) {
        const long double to = i < list.count ? list.at[i] : h;
        sum += piece(integral, in, from, to);
        from = to;
    }
    return sum;
}
