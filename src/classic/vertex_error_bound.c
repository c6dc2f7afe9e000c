/* The bound. Let g = f - L, which is 0 at the corners c, and let the derivative of f along the edge from i to j lie in
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
 *
 * Bodies of several leaves, and what takes fog away, become a sum over intersections of leaves, which are convex: a
 * function of what is inside which leaves, x_i in {0, 1}, is a sum of products of some x_i (Moebius inversion). What
 * density a body has is integrated along the stretch of the way in such an intersection in closed form.
 */
#include "vertex_error_bound.h"

#include "body_interval.h"

#include <math.h>

/* What rounding in double may do to places within NB_FARTHEST_BOUND of the eye, at silhouettes above all, where half of
 * the digits are lost. */
#define ROUNDING 1e-6

enum { MOST_LEAVES = 8, MOST_SOFT_PLANES = 32, MOST_FACTORS = 3 };

/* A leaf of a body, and the eye in its frame. */
typedef struct known_leaf {
    const nb_volume *body;
    const nb_leaf *leaf;
    double eye[3];
} known_leaf;

/* The fog of a body in an intersection of leaves, so many times. */
typedef struct nb_error_part {
    const nb_volume *body; /* whose fog it is */
    double extinction;     /* times the coefficient of the intersection */
    size_t leaf_count;
    known_leaf leaves[MOST_LEAVES];
} nb_error_part;

struct nb_fog_bound {
    nebel_allocator allocator;
    double eye[3], least_factor;
    nb_error_part *parts;
    size_t part_count, part_room;
};

/* ---- integrals along a stretch ----------------------------------------------------------------- */

/* A triangle, and the length of the way to it. */
typedef struct nb_bound_view {
    const nb_jet_ray *world;
    jet length;
} nb_bound_view;

/* offset + share times slope. */
typedef struct line {
    double offset;
    jet slope;
} line;

static jet extent(const nb_body_interval *inside)
{
    return greatest(difference(inside->to, inside->from), constant(0));
}

static int is_empty(const nb_body_interval *inside)
{
    return inside->to.value.high <= inside->from.value.low;
}

/* Where a stretch begins, but within the way where it is empty. */
static jet beginning(const nb_body_interval *inside)
{
    return least(inside->from, constant(1));
}

static jet at_share(const line *l, jet share)
{
    return sum(constant(l->offset), product(share, l->slope));
}

/* Of the product of at most three lines: two points of Gauss are exact. */
static jet integrate_lines(const line *lines, size_t count, const nb_body_interval *inside)
{
    const double places[2] = {0.21132486540518711775, 0.78867513459481288225};
    const jet from = beginning(inside), size = extent(inside);
    jet mean = constant(0);
    for (int i = 0; i < 2; i++) {
        const jet share = sum(from, times(places[i], size));
        jet density = constant(.5);
        for (size_t k = 0; k < count; k++) density = product(density, at_share(&lines[k], share));
        mean = sum(mean, density);
    }
    return product(size, mean);
}

/* n . (eye + share way - origin) */
static line line_along(const double normal[3], const double eye[3], const double origin[3], const nb_jet_ray *s)
{
    double at[3], from[3];
    for (int i = 0; i < 3; i++) {
        at[i] = nb_vector_dot(normal, s->way[i]);
        from[i] = eye[i] - origin[i];
    }
    return (line){nb_vector_dot(normal, from), linear(at)};
}

static line plus(double offset, double factor, const line *l)
{
    return (line){offset + factor * l->offset, times(factor, l->slope)};
}

/* The part where the line is not negative. */
static void part_at_zero(nb_body_interval *inside, const line *l)
{
    part_at(inside, l->offset, times(-1, l->slope));
}

/* ---- height -------------------------------------------------------------------------------------- */

/* (1 - e^-x) / x, which falls, and its derivative, which rises. */
static double ratio_of(double x)
{
    return fabs(x) < 1e-5 ? 1 - x * (.5 - x / 6) : -expm1(-x) / x;
}

static double slope_of_ratio(double x)
{
    if (fabs(x) < 1e-2) return -.5 + x * (1. / 3 - x * (.125 - x / 30));
    return (exp(-x) * (1 + x) - 1) / (x * x);
}

static jet ratio(jet x)
{
    return chain((interval){ratio_of(x.value.high), ratio_of(x.value.low)},
                 (interval){slope_of_ratio(x.value.low), slope_of_ratio(x.value.high)}, x);
}

/* Of e^-u, from the end where the fog is dense. Where the density comes near its limit, and where a triangle is so
 * large that the fog is dense at either end, nothing more is known than the largest density. */
static jet integrate_exponential(const line *u, const nb_body_interval *inside)
{
    const double lowest = u->offset + smaller(u->slope.value.low, 0);
    const int sinks = u->slope.value.low + u->slope.value.high < 0;
    const jet from = beginning(inside), size = extent(inside), to = sum(from, size);
    const jet change = product(sinks ? times(-1, u->slope) : u->slope, size);
    if (lowest < -25 || change.value.low < -100) return unknown(0, exp(-larger(lowest, -50)));
    return product(product(size, exponential_of_minus(at_share(u, sinks ? to : from))), ratio(change));
}

static jet integrate_height(const nebel_density *density, const line *u, const nb_body_interval *inside)
{
    if (density->below == NEBEL_BELOW_GROW) return integrate_exponential(u, inside);
    nb_body_interval above = *inside, below = *inside;
    const line depth = plus(0, -1, u);
    part_at_zero(&above, u);
    part_at_zero(&below, &depth);
    return sum(is_empty(&above) ? constant(0) : integrate_exponential(u, &above), extent(&below));
}

/* ---- linear and gaussian ------------------------------------------------------------------------- */

/* Of u clamped to 0..1. */
static jet integrate_ramp(const line *u, const nb_body_interval *inside)
{
    nb_body_interval ramp = *inside, full = *inside;
    const line rest = plus(1, -1, u), over = plus(-1, 1, u);
    part_at_zero(&ramp, u);
    part_at_zero(&ramp, &rest);
    part_at_zero(&full, &over);
    return sum(is_empty(&ramp) ? constant(0) : integrate_lines(u, 1, &ramp), extent(&full));
}

static jet error_function(jet x)
{
    const double steepest = 1.12837916709551257390, least_far = x.value.low > 0    ? x.value.low
                                                                : x.value.high < 0 ? x.value.high
                                                                                   : 0;
    const double farthest = larger(fabs(x.value.low), fabs(x.value.high));
    const interval slope = {steepest * exp(-farthest * farthest), steepest * exp(-least_far * least_far)};
    return chain((interval){erf(x.value.low), erf(x.value.high)}, slope, x);
}

/* In metres: e^-m (erf x_to - erf x_from) sigma sqrt(pi / 2), where x = (share |way| + e . way / |way|) / (sqrt(2)
 * sigma), e from the centre to the eye, and m = |e x way|^2 / (2 sigma^2 |way|^2). */
static jet integrate_gaussian(const nebel_density *density, const double eye[3], const nb_body_interval *inside,
                              const nb_bound_view *v)
{
    double from[3], at[3];
    for (int i = 0; i < 3; i++) from[i] = eye[i] - density->center[i];
    for (int i = 0; i < 3; i++) at[i] = nb_vector_dot(from, v->world->way[i]);
    if (v->length.value.low <= 1e-12 * v->length.value.high) return unknown(0, v->length.value.high);
    const double sigma = density->sigma, width = sigma * sqrt(2);
    const nb_jet_ray moment = moments(v->world, 3, from);
    const jet over = reciprocal(v->length), start = product(linear(at), over);
    const jet m = product(times(.5 / (sigma * sigma), square_of_way(&moment, 3)), product(over, over));
    const jet to = sum(product(inside->to, v->length), start), first = sum(product(inside->from, v->length), start);
    const jet parts = difference(error_function(times(1 / width, to)), error_function(times(1 / width, first)));
    const jet height = exponential_of_minus(m);
    return times(sigma * sqrt(acos(-1) / 2), product(height, greatest(parts, constant(0))));
}

/* ---- balls ---------------------------------------------------------------------------------------- */

/* From 0 to x of max(c - y^2, 0)^power. It rises with x, and away from 0 with c. */
static double chord_integral(int power, double c, double x)
{
    if (c <= 0) return 0;
    const double end = sqrt(c), y = smaller(larger(x, -end), end), s = y * y;
    switch (power) {
    case 0:
        return y;
    case 1:
        return y * (c - s / 3);
    case 2:
        return y * (c * c - s * (2 * c / 3 - s / 5));
    default:
        return y * (c * c * c - s * (c * c - s * (3 * c / 5 - s / 7)));
    }
}

static interval chord_integrals(int power, interval c, interval x)
{
    return (interval){chord_integral(power, x.low < 0 ? c.high : c.low, x.low),
                      chord_integral(power, x.high > 0 ? c.high : c.low, x.high)};
}

static double chord_density(int power, double c, double x)
{
    return pow(larger(c - x * x, 0), power);
}

static jet chord(int power, jet c, jet x)
{
    const interval by_c = scale(power, chord_integrals(power - 1, c.value, x.value));
    const double least_far = x.value.low > 0 ? x.value.low : x.value.high < 0 ? x.value.high : 0;
    const double farthest = larger(fabs(x.value.low), fabs(x.value.high));
    const interval by_x = {chord_density(power, c.value.low, farthest), chord_density(power, c.value.high, least_far)};
    jet made = {.value = chord_integrals(power, c.value, x.value)};
    for (int i = 0; i < 3; i++) made.along[i] = add(multiply(by_c, c.along[i]), multiply(by_x, x.along[i]));
    return made;
}

/* max(c - x^2, 0)^power between two x. */
static jet chord_between(int power, jet c, jet from, jet to)
{
    return greatest(difference(chord(power, c, to), chord(power, c, from)), constant(0));
}

/* Of the density of a ball: (1 - r^2)^power, or min(1, gain (1 - r^2)), which is a difference of two balls. In metres.
 * x = (share |w|^2 + e . w) / (radius |w|) in the ball's frame, c = 1 - |e x w|^2 / (radius |w|)^2; all that is there
 * vanishes at the silhouette. */
static jet integrate_ball(const nb_error_part *p, const nb_body_interval *inside, const nb_bound_view *v,
                          const nb_jet_ray *s)
{
    const known_leaf *const own = &p->leaves[0];
    const double radius = own->leaf->radius, inverse = 1 / radius;
    const jet speed = length_of_way(s);
    if (speed.value.low <= 1e-12 * speed.value.high) return unknown(0, v->length.value.high);
    double at[3];
    for (int i = 0; i < 3; i++) at[i] = nb_vector_dot(own->eye, s->way[i]);
    const nb_jet_ray moment = moments(s, 3, own->eye);
    const jet over = reciprocal(speed), start = product(linear(at), over);
    const jet m = product(times(inverse * inverse, square_of_way(&moment, 3)), product(over, over));
    const jet c = difference(constant(1), m);
    const jet from = times(inverse, sum(product(inside->from, speed), start));
    const jet to = times(inverse, sum(product(inside->to, speed), start));
    const nebel_density *const density = &p->body->density;
    const jet metres = times(radius, product(v->length, over));
    if (density->type == NEBEL_DENSITY_RADIAL) return product(metres, chord_between(density->power, c, from, to));
    const double gain = p->body->edge.gain;
    const jet inner = chord_between(1, difference(c, constant(1 / gain)), from, to);
    const jet edge = difference(chord_between(1, c, from, to), inner);
    return product(metres, times(gain, greatest(edge, constant(0))));
}

/* ---- soft edges of planes ------------------------------------------------------------------------- */

/* The least of min(1, depth behind a face / width): in the part of the body where one face is the nearest, or all are
 * far, it is one line. */
static jet integrate_soft_planes(const nb_error_part *p, const nb_body_interval *inside, const nb_jet_ray *s)
{
    static const double origin[3] = {0, 0, 0};
    const known_leaf *const own = &p->leaves[0];
    const size_t count = own->leaf->face_count;
    line depths[MOST_SOFT_PLANES];
    jet integral;
    nb_body_interval plateau = *inside;
    for (size_t i = 0; i < count; i++) {
        const nb_face *const face = &own->body->faces[own->leaf->first_face + i];
        const double scale = face->inverse_length / own->body->density.edge_width;
        const line along = line_along(face->normal, own->eye, origin, s);
        depths[i] = plus(face->distance * scale, -scale, &along);
        const line over = plus(-1, 1, &depths[i]);
        part_at_zero(&plateau, &over);
    }
    integral = extent(&plateau);
    for (size_t i = 0; i < count; i++) {
        nb_body_interval near = *inside;
        const line rest = plus(1, -1, &depths[i]);
        part_at_zero(&near, &depths[i]);
        part_at_zero(&near, &rest);
        for (size_t k = 0; k < count && !is_empty(&near); k++) {
            const line farther = {depths[k].offset - depths[i].offset, difference(depths[k].slope, depths[i].slope)};
            if (k != i) part_at_zero(&near, &farther);
        }
        if (!is_empty(&near)) integral = sum(integral, integrate_lines(&depths[i], 1, &near));
    }
    return integral;
}

static void part_at_axis(nb_body_interval *inside, jet rise, double low, double high, double eye)
{
    part_at(inside, high - eye, rise);
    part_at(inside, eye - low, times(-1, rise));
}

/* The product over the axes of min(1, depth behind the nearer face / width): each axis has an edge on both sides and a
 * plateau, and so the box at most 27 parts. */
static jet integrate_soft_box(const nb_error_part *p, const nb_body_interval *inside, const nb_jet_ray *s, int axis,
                              line *lines, size_t count)
{
    if (is_empty(inside)) return constant(0);
    if (axis == 3) return integrate_lines(lines, count, inside);
    const known_leaf *const own = &p->leaves[0];
    const double low = own->leaf->low[axis], high = own->leaf->high[axis];
    const double width = own->body->density.edge_width, edge = smaller(width, .5 * (high - low));
    nb_body_interval near = *inside, far = *inside, plateau = *inside;
    const double at[3] = {s->way[0][axis], s->way[1][axis], s->way[2][axis]};
    const jet rise = linear(at);
    part_at_axis(&near, rise, low, low + edge, own->eye[axis]);
    part_at_axis(&far, rise, high - edge, high, own->eye[axis]);
    lines[count] = (line){(own->eye[axis] - low) / width, times(1 / width, rise)};
    jet integral = integrate_soft_box(p, &near, s, axis + 1, lines, count + 1);
    lines[count] = (line){(high - own->eye[axis]) / width, times(-1 / width, rise)};
    integral = sum(integral, integrate_soft_box(p, &far, s, axis + 1, lines, count + 1));
    if (high - low <= 2 * edge) return integral;
    part_at_axis(&plateau, rise, low + edge, high - edge, own->eye[axis]);
    return sum(integral, integrate_soft_box(p, &plateau, s, axis + 1, lines, count));
}

/* ---- the fog of a part ----------------------------------------------------------------------------- */

static nb_jet_ray in_leaf(const nb_leaf *leaf, const nb_jet_ray *world)
{
    nb_jet_ray s;
    if (leaf->aligned) return *world;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s.way[i][k] = nb_vector_dot(leaf->matrix + 3 * k, world->way[i]);
    set_edges(&s);
    return s;
}

static int has_edge_of_its_own(const nb_volume *body)
{
    return body->density.type == NEBEL_DENSITY_RADIAL || body->density.type == NEBEL_DENSITY_SOFT_EDGE;
}

static jet integrate_own_edge(const nb_error_part *p, const nb_body_interval *inside, const nb_bound_view *v)
{
    const nb_leaf *const leaf = p->leaves[0].leaf;
    const nb_jet_ray s = in_leaf(leaf, v->world);
    line lines[MOST_FACTORS];
    if (leaf->type == NB_LEAF_SPHERE) return integrate_ball(p, inside, v, &s);
    const jet shares = leaf->type == NB_LEAF_BOX ? integrate_soft_box(p, inside, &s, 0, lines, 0)
                                                 : integrate_soft_planes(p, inside, &s);
    return product(v->length, shares);
}

static jet integrate_linear(const nebel_density *density, const double eye[3], const nb_body_interval *inside,
                            const nb_bound_view *v)
{
    double axis[3], square = 0;
    for (int i = 0; i < 3; i++) {
        axis[i] = density->to[i] - density->from[i];
        square += axis[i] * axis[i];
    }
    for (int i = 0; i < 3; i++) axis[i] /= square;
    const line u = line_along(axis, eye, density->from, v->world);
    return product(v->length, integrate_ramp(&u, inside));
}

/* The integral of the density along a stretch of the way [m]. */
static jet integrate(const nb_error_part *p, const double eye[3], const nb_body_interval *inside,
                     const nb_bound_view *v)
{
    const nebel_density *const density = &p->body->density;
    if (is_empty(inside)) return constant(0);
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT: {
        const double up[3] = {0, 1 / density->scale_height, 0}, base[3] = {0, density->base, 0};
        const line u = line_along(up, eye, base, v->world);
        return product(v->length, integrate_height(density, &u, inside));
    }
    case NEBEL_DENSITY_LINEAR:
        return integrate_linear(density, eye, inside, v);
    case NEBEL_DENSITY_GAUSSIAN:
        return integrate_gaussian(density, eye, inside, v);
    case NEBEL_DENSITY_RADIAL:
    case NEBEL_DENSITY_SOFT_EDGE:
        return integrate_own_edge(p, inside, v);
    default:
        return product(v->length, extent(inside));
    }
}

/* A capsule is its tube and, beyond the tube's ends, two balls; other leaves are one piece. */
static size_t piece_count(const nb_leaf *leaf)
{
    return leaf->type == NB_LEAF_CAPSULE ? 3 : 1;
}

static void cut_capsule(nb_body_interval *inside, const known_leaf *known, const nb_jet_ray *s, size_t piece)
{
    const double length = known->leaf->length, *const eye = known->eye;
    const double center[3] = {eye[0], eye[1], eye[2] - (piece == 2 ? length : 0)};
    const double along[3] = {s->way[0][2], s->way[1][2], s->way[2][2]};
    const jet rise = linear(along), fall = times(-1, rise);
    if (piece != 1) part_at(inside, piece == 0 ? eye[2] : eye[2] - length, fall);
    if (piece != 2) part_at(inside, piece == 0 ? length - eye[2] : -eye[2], rise);
    cut_round(inside, s, piece == 0 ? 2 : 3, 1, piece == 0 ? eye : center);
}

static void cut_leaf(nb_body_interval *inside, const known_leaf *known, size_t piece, const nb_bound_view *v)
{
    const nb_leaf *const leaf = known->leaf;
    const nb_jet_ray s = in_leaf(leaf, v->world);
    if (nb_volume_has_distances(known->body)) cut_distances(inside, known->body, v->length);
    switch (leaf->type) {
    case NB_LEAF_BOX:
        for (int k = 0; k < 3; k++) cut_axis(inside, &s, k, leaf->low[k], leaf->high[k], known->eye[k]);
        break;
    case NB_LEAF_PLANES:
        cut_faces(inside, &s, known->body->faces + leaf->first_face, leaf->face_count, known->eye);
        break;
    case NB_LEAF_SPHERE:
        cut_round(inside, &s, 3, leaf->radius, known->eye);
        break;
    case NB_LEAF_CYLINDER:
        cut_axis(inside, &s, 2, 0, 1, known->eye[2]);
        cut_round(inside, &s, 2, 1, known->eye);
        break;
    case NB_LEAF_CONE:
        cut_axis(inside, &s, 2, 0, 1, known->eye[2]);
        cut_cone(inside, &s, leaf->radius, leaf->slope, known->eye);
        break;
    case NB_LEAF_CAPSULE:
        cut_capsule(inside, known, &s, piece);
        break;
    case NB_LEAF_WORLD:
        break;
    }
}

/* Over all choices of one piece of each leaf that is not cut yet. */
static jet integrate_pieces(const nb_error_part *p, const double eye[3], size_t next, nb_body_interval inside,
                            const nb_bound_view *v)
{
    for (; next < p->leaf_count && piece_count(p->leaves[next].leaf) == 1; next++)
        cut_leaf(&inside, &p->leaves[next], 0, v);
    if (next == p->leaf_count) return integrate(p, eye, &inside, v);
    jet integral = constant(0);
    for (size_t i = 0; i < piece_count(p->leaves[next].leaf); i++) {
        nb_body_interval piece = inside;
        cut_leaf(&piece, &p->leaves[next], i, v);
        if (!is_empty(&piece)) integral = sum(integral, integrate_pieces(p, eye, next + 1, piece, v));
    }
    return integral;
}

static jet depth_of_part(const nb_error_part *p, const double eye[3], const nb_bound_view *v)
{
    nb_body_interval inside = {constant(0), constant(1)};
    size_t next = 0;
    if (has_edge_of_its_own(p->body)) {
        if (nb_volume_has_distances(p->body)) cut_distances(&inside, p->body, v->length);
        next = 1;
    }
    return times(p->extinction, integrate_pieces(p, eye, next, inside, v));
}

static jet optical_depth(const nb_fog_bound *bound, const nb_jet_ray *s)
{
    const nb_bound_view v = {s, length_of_way(s)};
    jet depth = constant(0);
    for (size_t i = 0; i < bound->part_count; i++) depth = sum(depth, depth_of_part(&bound->parts[i], bound->eye, &v));
    depth.value.low = larger(depth.value.low, 0);
    depth.value.high = larger(depth.value.high, 0);
    return depth;
}

/* The most of w0 w1 a + w1 w2 b + w2 w0 c, or more. */
static double bound_of_widths(double a, double b, double c)
{
    const double widest = larger(a, larger(b, c)), least_wide = smaller(a, smaller(b, c));
    return smaller(widest / 3, least_wide / 3 + (a + b + c - 3 * least_wide) / 4);
}

static jet factor(const nb_fog_bound *bound, const double ways[3][3])
{
    nb_jet_ray s;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s.way[i][k] = ways[i][k];
    set_edges(&s);
    return greatest(exponential_of_minus(optical_depth(bound, &s)), constant(bound->least_factor));
}

void nb_enclose_fog(const nb_fog_bound *bound, const double ways[3][3], double range[2], double slopes[3][2])
{
    const jet f = factor(bound, ways);
    range[0] = f.value.low;
    range[1] = f.value.high;
    for (int i = 0; i < 3; i++) {
        slopes[i][0] = f.along[i].low;
        slopes[i][1] = f.along[i].high;
    }
}

double nb_bound_fog(const nb_fog_bound *bound, const double ways[3][3])
{
    double width[3];
    const jet f = factor(bound, ways);
    for (int i = 0; i < 3; i++) width[i] = f.along[i].high - f.along[i].low;
    const double error = smaller(f.value.high - f.value.low, bound_of_widths(width[0], width[1], width[2])) + ROUNDING;
    return error < 1 ? error : 1;
}

/* ---- intersections of leaves ------------------------------------------------------------------------ */

/* A body's leaves, and those of all that take its fog away, which follow one another as `bodies` do. */
typedef struct nb_error_mixture {
    const nb_volume *bodies[MOST_LEAVES + 1];
    size_t body_count, leaf_count;
    known_leaf leaves[MOST_LEAVES];
} nb_error_mixture;

static int is_inside(const nb_volume *body, size_t leaves)
{
    unsigned stack[NB_STEP_STACK];
    size_t top = 0;
    for (size_t i = 0; i < body->step_count; i++) {
        if (body->steps[i] == NB_OP_LEAF) {
            stack[top++] = leaves & 1;
            leaves >>= 1;
            continue;
        }
        top--;
        stack[top - 1] = body->steps[i] == NB_OP_UNION ? stack[top - 1] | stack[top] : stack[top - 1] & stack[top];
    }
    return stack[0] != 0;
}

/* Whether the first body's fog is where these leaves are. */
static int has_fog(const nb_error_mixture *m, size_t leaves)
{
    for (size_t i = 0; i < m->body_count; i++) {
        if (is_inside(m->bodies[i], leaves) != (i == 0)) return 0;
        leaves >>= m->bodies[i]->leaf_count;
    }
    return 1;
}

static int parity(size_t bits)
{
    int odd = 0;
    for (; bits != 0; bits &= bits - 1) odd = !odd;
    return odd;
}

/* The sum over the subsets of (-1)^(leaves left out) times the fog there. */
static int coefficient(const nb_error_mixture *m, size_t leaves)
{
    int sum = 0;
    for (size_t subset = leaves;; subset = (subset - 1) & leaves) {
        if (has_fog(m, subset)) sum += parity(leaves ^ subset) ? -1 : 1;
        if (subset == 0) return sum;
    }
}

static int overlap(const nb_volume *a, const nb_volume *b)
{
    for (int i = 0; i < 3; i++)
        if (a->high[i] < b->low[i] || b->high[i] < a->low[i]) return 0;
    return 1;
}

static void bring_into_frame(known_leaf *known, const double eye[3])
{
    double from[3];
    for (int i = 0; i < 3; i++) from[i] = (eye[i] - known->leaf->origin[i]) - known->leaf->origin_rest[i];
    for (int k = 0; k < 3; k++) known->eye[k] = nb_vector_dot(known->leaf->matrix + 3 * k, from);
}

/* 0: too many leaves. */
static int mix(nb_error_mixture *m, const nb_volume *body, const double eye[3])
{
    if (m->leaf_count + body->leaf_count > MOST_LEAVES) return 0;
    m->bodies[m->body_count++] = body;
    for (size_t i = 0; i < body->leaf_count; i++) {
        known_leaf *const known = &m->leaves[m->leaf_count++];
        *known = (known_leaf){.body = body, .leaf = &body->leaves[i]};
        bring_into_frame(known, eye);
    }
    return 1;
}

static nebel_result add_part(nb_fog_bound *bound, const nb_error_mixture *m, size_t leaves, double extinction)
{
    if (!nb_grow(&bound->allocator, (void **)&bound->parts, sizeof *bound->parts, bound->part_count, &bound->part_room,
                 bound->part_count + 1))
        return NEBEL_ERROR_MEMORY;
    nb_error_part *const p = &bound->parts[bound->part_count++];
    *p = (nb_error_part){.body = m->bodies[0], .extinction = extinction};
    for (size_t i = 0; i < m->leaf_count; i++)
        if (leaves >> i & 1) p->leaves[p->leaf_count++] = m->leaves[i];
    return NEBEL_OK;
}

static int is_known_density(const nb_volume *body)
{
    const nb_leaf *const leaf = &body->leaves[0];
    if (body->density.type == NEBEL_DENSITY_GRID || body->density.type == NEBEL_DENSITY_ALTITUDE) return 0;
    if (body->density.type != NEBEL_DENSITY_SOFT_EDGE) return 1;
    return leaf->type == NB_LEAF_SPHERE || leaf->type == NB_LEAF_BOX ||
           (leaf->type == NB_LEAF_PLANES && leaf->face_count <= MOST_SOFT_PLANES);
}

static nebel_result refuse_density(const nebel_log *log, const nb_volume *body)
{
    if (body->density.type == NEBEL_DENSITY_GRID)
        return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                       "tessellation: nothing is proven of a grid; give the volume another density");
    if (body->density.type == NEBEL_DENSITY_ALTITUDE)
        return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                       "tessellation: nothing is proven of fog above a ball; give the volume another density");
    const nb_leaf_type type = body->leaves[0].type;
    const char *const name = type == NB_LEAF_CYLINDER  ? "cylinder"
                             : type == NB_LEAF_CONE    ? "cone"
                             : type == NB_LEAF_CAPSULE ? "capsule"
                                                       : "body of more than 32 planes";
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "tessellation: nothing is proven of the soft edge of a %s; give it another density", name);
}

static nebel_result refuse_parts(const nebel_log *log)
{
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "tessellation: nothing is proven of a volume that has, with those that exclude or replace its fog, "
                   "more than %d parts; make it of fewer",
                   MOST_LEAVES);
}

/* A body of one leaf of which nothing is taken away, as most are, is one part. */
static nebel_result add_body(nb_fog_bound *bound, const nebel_snapshot *snapshot, const nb_volume *body, int channel)
{
    nb_error_mixture m = {.body_count = 0};
    nebel_result result = NEBEL_OK;
    if (!is_known_density(body)) return refuse_density(&snapshot->log, body);
    if (!mix(&m, body, bound->eye)) return refuse_parts(&snapshot->log);
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *const other = &snapshot->media[i].body;
        if (!nb_volume_covers(other) || other->rank <= body->rank || !overlap(other, body)) continue;
        if (!mix(&m, other, bound->eye)) return refuse_parts(&snapshot->log);
    }
    for (size_t leaves = 1; leaves >> m.leaf_count == 0 && result == NEBEL_OK; leaves++) {
        const int times = coefficient(&m, leaves);
        if (times != 0) result = add_part(bound, &m, leaves, times * body->extinction[channel]);
    }
    return result;
}

nebel_result nb_make_fog_bound(const nebel_allocator *allocator, const nebel_snapshot *snapshot, const double eye[3],
                               int channel, nb_fog_bound **bound)
{
    nb_fog_bound *const made = nb_allocate_zero(allocator, 1, sizeof *made);
    *bound = made;
    if (made == NULL) return NEBEL_ERROR_MEMORY;
    made->allocator = *allocator;
    made->least_factor = 1 - snapshot->max_opacity;
    for (int i = 0; i < 3; i++) made->eye[i] = eye[i];
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *const body = &snapshot->media[i].body;
        if (!nb_volume_has_fog(body) || !(body->extinction[channel] > 0)) continue;
        const nebel_result result = add_body(made, snapshot, body, channel);
        if (result != NEBEL_OK) return result;
    }
    return NEBEL_OK;
}

void nb_free_fog_bound(nb_fog_bound *bound)
{
    if (bound == NULL) return;
    const nebel_allocator allocator = bound->allocator;
    nb_release(&allocator, bound->parts);
    nb_release(&allocator, bound);
}
