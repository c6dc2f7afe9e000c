/* Interval arithmetic of first order over a triangle. A jet encloses a number that varies over the triangle, and its
 * derivatives along the three edges; every step of the formula that gives transmittance takes jets to jets.
 *
 * The bound. Let g = f - L, which is 0 at the corners c, and let the derivative of f along the edge from i to j lie in
 * an interval of width W_ij; that of g lies in one of the same width. From corner c to a place of weights w the way is
 * the sum over j of w_j times the edge from c to j, so that g <= sum_j w_j high_cj for every c, and by weighing these
 * with w_c, because high_cj + high_jc = W_cj,
 *
 *     g <= sum over the three edges of w_i w_j W_ij,
 *
 * and likewise -g. Weights of two corners have a product of at most 1/4, and all three products a sum of at most 1/3.
 * f needs a derivative almost everywhere only: maxima and minima, where a ray goes from one face to the next, take the
 * hull of both. As widths shrink with the square of the triangle, so does the bound where fog is smooth. Besides, f and
 * L both lie between the least and the largest f: where a sphere's silhouette or a discontinuity crosses the triangle,
 * and derivatives have no bound, that is what is left.
 */
#include "classic/fog_bound.h"

#include <math.h>

/* What rounding in double may do to places within NB_FARTHEST_BOUND of the eye, at silhouettes above all, where half of
 * the digits are lost. */
#define ROUNDING 1e-6

/* Stands for infinity, but without making NaNs of zeros. */
#define ENDLESS 1e60

typedef struct interval {
    double low, high;
} interval;

typedef struct jet {
    interval value, along[3]; /* along the edges from corner 0 to 1, 1 to 2, 2 to 0 */
} jet;

/* A triangle as seen from the eye, in the frame of a leaf or of the world. */
typedef struct sight {
    double way[3][3];  /* to the corners */
    double edge[3][3]; /* from corner i to the next */
} sight;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Of numbers, so that no call of fmin has to think of NaNs. */
static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/* ---- intervals ------------------------------------------------------------------------------- */

static inline interval hull(interval a, interval b)
{
    return (interval){smaller(a.low, b.low), larger(a.high, b.high)};
}

static inline interval hull_of(double a, double b, double c)
{
    return hull((interval){a < b ? a : b, a < b ? b : a}, (interval){c, c});
}

static inline interval scale(double s, interval a)
{
    return s >= 0 ? (interval){s * a.low, s * a.high} : (interval){s * a.high, s * a.low};
}

static inline interval multiply(interval a, interval b)
{
    return hull(scale(a.low, b), scale(a.high, b));
}

static inline interval add(interval a, interval b)
{
    return (interval){a.low + b.low, a.high + b.high};
}

static inline interval subtract(interval a, interval b)
{
    return (interval){a.low - b.high, a.high - b.low};
}

/* ---- jets ------------------------------------------------------------------------------------ */

static const interval endless = {-ENDLESS, ENDLESS};

static inline jet constant(double value)
{
    return (jet){{value, value}, {{0, 0}, {0, 0}, {0, 0}}};
}

static inline jet unknown(double low, double high)
{
    return (jet){{low, high}, {endless, endless, endless}};
}

/* A linear function of the place, from its values at the corners. */
static inline jet linear(const double at[3])
{
    jet a = {.value = hull_of(at[0], at[1], at[2])};
    for (int i = 0; i < 3; i++) a.along[i].low = a.along[i].high = at[(i + 1) % 3] - at[i];
    return a;
}

static inline jet sum(jet a, jet b)
{
    a.value = add(a.value, b.value);
    for (int i = 0; i < 3; i++) a.along[i] = add(a.along[i], b.along[i]);
    return a;
}

static inline jet difference(jet a, jet b)
{
    a.value = subtract(a.value, b.value);
    for (int i = 0; i < 3; i++) a.along[i] = subtract(a.along[i], b.along[i]);
    return a;
}

static inline jet times(double s, jet a)
{
    a.value = scale(s, a.value);
    for (int i = 0; i < 3; i++) a.along[i] = scale(s, a.along[i]);
    return a;
}

static inline jet product(jet a, jet b)
{
    jet p = {.value = multiply(a.value, b.value)};
    for (int i = 0; i < 3; i++) p.along[i] = add(multiply(a.along[i], b.value), multiply(a.value, b.along[i]));
    return p;
}

/* A function of a jet by its range and the range of its derivative. */
static inline jet chain(interval value, interval slope, jet a)
{
    jet f = {.value = value};
    for (int i = 0; i < 3; i++) f.along[i] = multiply(slope, a.along[i]);
    return f;
}

static inline jet least(jet a, jet b)
{
    if (a.value.high <= b.value.low) return a;
    if (b.value.high <= a.value.low) return b;
    jet m = {.value = {smaller(a.value.low, b.value.low), smaller(a.value.high, b.value.high)}};
    for (int i = 0; i < 3; i++) m.along[i] = hull(a.along[i], b.along[i]);
    return m;
}

static inline jet greatest(jet a, jet b)
{
    if (a.value.low >= b.value.high) return a;
    if (b.value.low >= a.value.high) return b;
    jet m = {.value = {larger(a.value.low, b.value.low), larger(a.value.high, b.value.high)}};
    for (int i = 0; i < 3; i++) m.along[i] = hull(a.along[i], b.along[i]);
    return m;
}

/* a.value.low > 0 */
static inline jet reciprocal(jet a)
{
    const double steep = 1 / a.value.low, flat = 1 / a.value.high;
    return chain((interval){flat, steep}, (interval){-steep * steep, -flat * flat}, a);
}

/* Where it may come near 0 its derivative has no bound. */
static inline jet root(jet a)
{
    const double low = sqrt(larger(a.value.low, 0)), high = sqrt(larger(a.value.high, 0));
    if (low <= 1e-8 * high) return unknown(low, high);
    return chain((interval){low, high}, (interval){.5 / high, .5 / low}, a);
}

static inline jet exponential_of_minus(jet a)
{
    const interval value = {exp(-a.value.high), exp(-a.value.low)};
    return chain(value, (interval){-value.high, -value.low}, a);
}

/* ---- the triangle ---------------------------------------------------------------------------- */

static inline void set_edges(sight *s)
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s->edge[i][k] = s->way[(i + 1) % 3][k] - s->way[i][k];
}

/* Least distance of the origin from a triangle in so many dimensions, or less: that of the middle, without the radius
 * about it. */
static inline double least_distance(const sight *s, int dimensions)
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
static inline jet square_of_way(const sight *s, int dimensions)
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
static inline jet length_of_way(const sight *s)
{
    const jet square = square_of_way(s, 3);
    jet a = root(square);
    for (int i = 0; i < 3; i++) {
        const double edge = sqrt(dot(s->edge[i], s->edge[i]));
        a.along[i].low = larger(a.along[i].low, -edge);
        a.along[i].high = smaller(a.along[i].high, edge);
    }
    return a;
}

/* ---- shares of the way in a leaf -------------------------------------------------------------- */

/* The stretch [from, to] of the way, as shares of it, that is in a body. */
typedef struct stretch {
    jet from, to;
} stretch;

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

/* A half-space: share times rise <= depth, where depth is that of the eye in it. */
static inline void cut(stretch *inside, double depth, jet rise)
{
    if (depth >= 0 && rise.value.high <= depth) return;
    if (depth > 0)
        inside->to = least(inside->to, crossing(depth, rise));
    else if (depth < 0)
        inside->from = greatest(inside->from, crossing(-depth, times(-1, rise)));
    else if (rise.value.low > 0)
        inside->to = constant(0);
    else
        inside->to = least(inside->to, unknown(0, 1));
}

static inline void cut_axis(stretch *inside, const sight *s, int axis, double low, double high, double eye)
{
    const double at[3] = {s->way[0][axis], s->way[1][axis], s->way[2][axis]};
    const jet rise = linear(at);
    cut(inside, high - eye, rise);
    cut(inside, eye - low, times(-1, rise));
}

static inline void cut_faces(stretch *inside, const sight *s, const nb_face *faces, size_t count, const double eye[3])
{
    for (size_t f = 0; f < count; f++) {
        double at[3];
        for (int i = 0; i < 3; i++) at[i] = dot(faces[f].normal, s->way[i]);
        cut(inside, faces[f].distance - dot(faces[f].normal, eye), linear(at));
    }
}

/* e x way, linear like the way. In two dimensions it has one component, and e and the ways no third. */
static inline sight moments(const sight *s, int dimensions, const double e[3])
{
    sight m;
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
static inline void cut_round(stretch *inside, const sight *s, int dimensions, double radius, const double eye[3])
{
    double at[3] = {0, 0, 0};
    for (int k = 0; k < dimensions; k++)
        for (int i = 0; i < 3; i++) at[i] += eye[k] * s->way[i][k];
    const sight moment = moments(s, dimensions, eye);
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

/* The share of the way that is in the volume's one leaf. */
static inline jet share_in_leaf(const nb_volume *body, const double eye[3], const sight *world)
{
    const nb_leaf *leaf = &body->leaves[0];
    stretch inside = {constant(0), constant(1)};
    double from[3], at[3];
    sight s;
    for (int i = 0; i < 3; i++) from[i] = (eye[i] - leaf->origin[i]) - leaf->origin_rest[i];
    for (int k = 0; k < 3; k++) {
        at[k] = dot(leaf->matrix + 3 * k, from);
        for (int i = 0; i < 3; i++) s.way[i][k] = dot(leaf->matrix + 3 * k, world->way[i]);
    }
    set_edges(&s);
    if (leaf->type == NB_LEAF_BOX)
        for (int k = 0; k < 3; k++) cut_axis(&inside, &s, k, leaf->low[k], leaf->high[k], at[k]);
    if (leaf->type == NB_LEAF_PLANES) cut_faces(&inside, &s, body->faces + leaf->first_face, leaf->face_count, at);
    if (leaf->type == NB_LEAF_BALL) cut_round(&inside, &s, 3, leaf->radius, at);
    if (leaf->type == NB_LEAF_TUBE) {
        cut_axis(&inside, &s, 2, 0, 1, at[2]);
        cut_round(&inside, &s, 2, 1, at);
    }
    return greatest(difference(inside.to, inside.from), constant(0));
}

/* ---- the fog --------------------------------------------------------------------------------- */

static int is_known_leaf(nb_leaf_type type)
{
    return type == NB_LEAF_WORLD || type == NB_LEAF_BOX || type == NB_LEAF_PLANES || type == NB_LEAF_BALL ||
           type == NB_LEAF_TUBE;
}

int nb_fog_can_be_bounded(const nebel_snapshot *snapshot)
{
    if (snapshot->max_opacity < 1) return 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        if (nb_volume_covers(body) || nb_volume_has_distances(body) || body->step_count != 1 ||
            body->density.type != NEBEL_DENSITY_CONSTANT || !is_known_leaf(body->leaves[0].type))
            return 0;
    }
    return 1;
}

static jet optical_depth(const nebel_snapshot *snapshot, const double eye[3], int channel, const sight *s)
{
    jet depth = constant(0);
    const jet length = length_of_way(s);
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        const jet share = share_in_leaf(body, eye, s);
        if (share.value.high > 0) depth = sum(depth, times(body->extinction[channel], product(length, share)));
    }
    return depth;
}

/* The most of w0 w1 a + w1 w2 b + w2 w0 c, or more. */
static double bound_of_widths(double a, double b, double c)
{
    const double widest = larger(a, larger(b, c)), least_wide = smaller(a, smaller(b, c));
    return smaller(widest / 3, least_wide / 3 + (a + b + c - 3 * least_wide) / 4);
}

double nb_bound_fog(const nebel_snapshot *snapshot, const double eye[3], int channel, const double ways[3][3])
{
    sight s;
    double width[3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s.way[i][k] = ways[i][k];
    set_edges(&s);
    const jet f = exponential_of_minus(optical_depth(snapshot, eye, channel, &s));
    for (int i = 0; i < 3; i++) width[i] = f.along[i].high - f.along[i].low;
    const double bound = smaller(f.value.high - f.value.low, bound_of_widths(width[0], width[1], width[2])) + ROUNDING;
    return bound < 1 ? bound : 1;
}
