/* The profile of a medium in coordinates along the ray: its density at a place, and that integrated over a piece.
 * Included by trace_kernel.c after trace_packet.h. */

/* ---- coordinates ----------------------------------------------------------------------------- */

static void height_contact(medium_hit *k, const packet *rays, const nebel_density *density)
{
    const nb_wide inverse = NB_W(1.0) / WIDE(density->scale_height);
    k->offset.x = (rays->origin.y - WIDE(density->base)) * inverse;
    k->slope.x = rays->direction.y * inverse;
    k->noise = nb_narrow(nb_wabs(k->offset.x) * (NB_W(8.0) * NB_WEPSILON));
}

/* How far under the base fog that thins out with the altitude is as thick as it gets, in scale heights. */
static double depth_of_most(const nebel_density *density)
{
    return density->below == NEBEL_BELOW_GROW ? NB_GROWTH_DEPTH : 0;
}

static nb_real most_of_altitude(const nebel_density *density)
{
    return density->below == NEBEL_BELOW_GROW ? NB_FAR : NB_F(1.0);
}

/* Rounding moves the ray and the surface by parts of their distances from the centre. */
static void altitude_contact(medium_hit *k, const packet *rays, const nebel_density *density)
{
    const nb_wvec3 p = nb_wsub3(rays->origin, wide_vector(density->center));
    const nb_wide inverse = NB_W(1.0) / WIDE(density->scale_height), ground = WIDE(density->radius);
    k->arc.radius = nb_wsqrt(nb_wdot3(p, p));
    k->arc.rise = nb_wdot3(p, rays->direction);
    k->arc.height = k->arc.radius - ground - WIDE(density->base);
    k->deep = nb_arc_chord(k->arc, -WIDE(density->scale_height * depth_of_most(density)));
    k->slope.x = inverse;
    k->noise = nb_narrow((k->arc.radius + ground) * inverse * (NB_W(32.0) * NB_WEPSILON));
}

static void linear_contact(medium_hit *k, const packet *rays, const nebel_density *density)
{
    const nb_wvec3 from = wide_vector(density->from);
    const nb_wvec3 axis = nb_wsub3(wide_vector(density->to), from);
    const nb_wide inverse = NB_W(1.0) / nb_wdot3(axis, axis);
    const nb_wvec3 p = nb_wsub3(rays->origin, from), d = rays->direction;
    k->offset.x = nb_wdot3(p, axis) * inverse;
    k->slope.x = nb_wdot3(d, axis) * inverse;
    const nb_wide rounding = inverse * (NB_W(8.0) * NB_WEPSILON);
    k->noise = nb_narrow(products(p, axis) * rounding);
    k->drift = nb_narrow(products(d, axis) * rounding);
}

/* x = (t - closest approach) / (sqrt(2) sigma) */
static void gaussian_contact(medium_hit *k, const packet *rays, const nebel_density *density)
{
    const nb_wvec3 p = nb_wsub3(rays->origin, wide_vector(density->center));
    const nb_wide inverse = NB_W(0.70710678118654752440084436210485) / WIDE(density->sigma);
    const nb_wide closest = -nb_wdot3(p, rays->direction);
    const nb_wvec3 q = nb_wscale3(nb_wadd3(p, nb_wscale3(rays->direction, closest)), inverse);
    k->offset.x = -closest * inverse;
    k->slope.x = inverse;
    k->level = nb_narrow(nb_wmin(nb_wdot3(q, q), NB_W(1e9)));
    k->noise = nb_narrow(nb_wabs(k->offset.x) * (NB_W(32.0) * NB_WEPSILON));
}

/* x = (t - closest approach) |d| / radius, c = 1 - (closest distance / radius)^2 */
static void radial_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf)
{
    const local_ray local = localize(rays, leaf);
    const nb_wide inverse = NB_W(1.0) / WIDE(FRAME(leaf, radius));
    const nb_wide speed = nb_wsqrt(nb_wdot3(local.d, local.d));
    const nb_wide closest = -nb_wdot3(local.p, local.d) / nb_wmax(speed * speed, NB_W(1e-30));
    const nb_wvec3 q = nb_wscale3(nb_wadd3(local.p, nb_wscale3(local.d, closest)), inverse);
    k->slope.x = speed * inverse;
    k->offset.x = -closest * k->slope.x;
    k->level = nb_narrow(NB_W(1.0) - nb_wmin(nb_wdot3(q, q), NB_W(1e9)));
    k->noise = nb_narrow(local.reach * inverse) * REAL(2 * k->medium->body.density.power);
}

/* Soft edges are made in one way for boxes, in one for round bodies, in one for planes. */
static const nb_leaf *edge_leaf(const medium_hit *k)
{
    return &k->medium->body.leaves[0];
}

static int is_round(const nb_leaf *leaf)
{
    return leaf->type != NB_LEAF_BOX && leaf->type != NB_LEAF_PLANES;
}

/* The components of a vector of length 1 come to at most sqrt(3). */
#define MOST_COMPONENTS 1.7320508075688773

/* The slopes of an edge along the axes of the leaf's frame come to at most `steepest`; what rounds in that frame is off
 * by `reach` along each. */
static void set_steepest(medium_hit *k, const nb_leaf *leaf, const local_ray *local, double steepest)
{
    k->steepest = steepest * leaf->scale;
    k->noise = nb_narrow(local->reach * WIDE(4 * steepest)) + NB_F(64.0) * nb_narrow(WIDE(1 + steepest) * NB_WEPSILON);
}

static void round_edge_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf)
{
    const local_ray local = localize(rays, leaf);
    const nb_soft_edge *made = &k->medium->body.edge;
    const int ball = leaf->type == NB_LEAF_SPHERE, capsule = leaf->type == NB_LEAF_CAPSULE;
    const nb_wide unit = ball ? NB_W(1.0) / WIDE(FRAME(leaf, radius)) : NB_W(1.0);
    const nb_wide one = NB_W(1.0);
    const nb_round_edge edge =
        nb_round_edge_of(nb_wscale3(local.p, unit), nb_wscale3(local.d, unit), ball ? one : WIDE(FRAME(leaf, radius)),
                         WIDE(FRAME(leaf, slope)), capsule ? WIDE(FRAME(leaf, length)) : one, WIDE(made->gain),
                         WIDE(made->steepness), WIDE(made->inner), nb_leaf_edge_form(leaf));
    k->side = edge.side;
    k->offset = edge.q;
    k->slope = edge.k;
    k->size = edge.ends;
    const double flanks = 2 * made->gain * (MOST_COMPONENTS + fabs(leaf->slope)) / (ball ? leaf->radius : 1);
    set_steepest(k, leaf, &local, flanks + (ball || capsule ? 0 : made->steepness));
}

/* The ray in the leaf's frame; size.x: 1 / distance. */
static void planes_edge_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf, double width)
{
    const local_ray local = localize(rays, leaf);
    k->offset = local.p;
    k->slope = local.d;
    k->size = nb_wvec3(NB_W(1.0) / WIDE(width), NB_W(0.0), NB_W(0.0));
    set_steepest(k, leaf, &local, MOST_COMPONENTS / width);
    double farthest = 0;
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &k->medium->body.faces[leaf->first_face + i];
        farthest = fmax(farthest, fabs(face->distance) * face->inverse_length);
    }
    k->noise = k->noise + nb_narrow(WIDE(8 * farthest / width) * NB_WEPSILON);
}

static void box_edge_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf, double width)
{
    const local_ray local = localize(rays, leaf);
    const nb_wide inverse = NB_W(1.0) / WIDE(width);
    const nb_wvec3 low = wide_vector(leaf->low), high = wide_vector(leaf->high);
    const nb_wvec3 middle = nb_wscale3(nb_wadd3(low, high), NB_W(0.5));
    k->offset = nb_wscale3(nb_wsub3(local.p, middle), inverse);
    k->slope = nb_wscale3(local.d, inverse);
    k->size = nb_wscale3(nb_wsub3(high, low), NB_W(0.5) * inverse);
    k->noise = nb_narrow(local.reach * inverse) * NB_F(6.0) +
               NB_F(64.0) * nb_narrow(NB_WEPSILON * (k->size.x + k->size.y + k->size.z));
}

static void soft_edge_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf, double width)
{
    if (leaf->type == NB_LEAF_BOX)
        box_edge_contact(k, rays, leaf, width);
    else if (leaf->type == NB_LEAF_PLANES)
        planes_edge_contact(k, rays, leaf, width);
    else
        round_edge_contact(k, rays, leaf);
}

/* The ray in cells of the grid. */
static void grid_contact(medium_hit *k, const packet *rays, const nb_leaf *leaf)
{
    double rate[3];
    const nebel_grid *grid = k->medium->body.density.grid;
    const local_ray local = localize(rays, leaf);
    const nb_wide margin = WIDE(nb_grid_margin(grid));
    nb_grid_rate(grid, leaf->low, leaf->high, rate);
    const nb_wvec3 p = nb_wsub3(local.p, wide_vector(leaf->low));
    k->offset = nb_wvec3(margin + p.x * WIDE(rate[0]), margin + p.y * WIDE(rate[1]), margin + p.z * WIDE(rate[2]));
    k->slope = nb_wvec3(local.d.x * WIDE(rate[0]), local.d.y * WIDE(rate[1]), local.d.z * WIDE(rate[2]));
    k->noise = nb_narrow(local.reach * WIDE(fmin(fmax(fmax(rate[0], rate[1]), rate[2]), 1e18)));
}

static void profile_contact(medium_hit *k, const packet *rays)
{
    const nb_volume *body = &k->medium->body;
    switch (body->density.type) {
    case NEBEL_DENSITY_HEIGHT:
        height_contact(k, rays, &body->density);
        break;
    case NEBEL_DENSITY_LINEAR:
        linear_contact(k, rays, &body->density);
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        gaussian_contact(k, rays, &body->density);
        break;
    case NEBEL_DENSITY_RADIAL:
        radial_contact(k, rays, &body->leaves[0]);
        break;
    case NEBEL_DENSITY_SOFT_EDGE:
        soft_edge_contact(k, rays, &body->leaves[0], body->density.edge_width);
        break;
    case NEBEL_DENSITY_GRID:
        grid_contact(k, rays, &body->leaves[0]);
        break;
    case NEBEL_DENSITY_ALTITUDE:
        altitude_contact(k, rays, &body->density);
        break;
    default:
        break;
    }
}

static nb_estimate blur(nb_estimate estimate, nb_real noise, nb_real h)
{
    estimate.error = estimate.error + noise * h;
    return estimate;
}

/* ---- soft edges of planes: the least of the faces' ------------------------------------------ */

/* How deep the ray is behind something, in units of the edge, and how that changes per metre. */
typedef struct edge_line {
    nb_wide depth, slope;
} edge_line;

static edge_line face_line(const medium_hit *k, size_t i, nb_wide t)
{
    const nb_volume *body = &k->medium->body;
    const nb_face *face = &body->faces[body->leaves[0].first_face + i];
    const nb_wvec3 normal = wide_vector(face->normal);
    const nb_wide scale = k->size.x * WIDE(face->inverse_length);
    const nb_wide along = nb_wdot3(normal, nb_wadd3(k->offset, nb_wscale3(k->slope, t)));
    return (edge_line){(WIDE(face->distance) - along) * scale, -(nb_wdot3(normal, k->slope) * scale)};
}

/* What rounding may do to a depth: the farther a ray has come, the more its direction counts. */
static nb_wide plane_noise(const medium_hit *k, nb_wide t)
{
    return nb_widen(k->noise) + nb_wabs(t) * (WIDE(8 * k->steepest) * NB_WEPSILON);
}

/* The lowest just behind t; where several are as low but for their noise, the one that falls fastest. The first is the
 * plateau. */
static edge_line lowest_line(const medium_hit *k, nb_wide t)
{
    const size_t count = edge_leaf(k)->face_count;
    nb_wide least = NB_W(1.0);
    for (size_t i = 0; i < count; i++) least = nb_wmin(face_line(k, i, t).depth, least);
    const nb_wide nearly = least + plane_noise(k, t);
    edge_line lowest = {NB_W(1.0), nb_wselect(nearly >= NB_W(1.0), NB_W(0.0), NB_WFAR)};
    for (size_t i = 0; i < count; i++) {
        const edge_line line = face_line(k, i, t);
        const nb_wmask lower = nb_wand(line.depth <= nearly, line.slope < lowest.slope);
        lowest.depth = nb_wselect(lower, line.depth, lowest.depth);
        lowest.slope = nb_wselect(lower, line.slope, lowest.slope);
    }
    lowest.depth = least;
    return lowest;
}

static nb_wide crossing_of(const edge_line *lowest, const edge_line *other, nb_wide t, nb_wide next)
{
    const nb_wide way =
        nb_wmax(other->depth - lowest->depth, NB_W(0.0)) * nb_wrcp_bounded(lowest->slope - other->slope);
    const nb_wide least = nb_wabs(t) * (NB_W(4.0) * NB_WEPSILON) + NB_WTINY; /* so that a walk gets on */
    const nb_wide crossing = t + nb_wmax(way, least);
    return nb_wselect(nb_wand(other->slope < lowest->slope, crossing < next), crossing, next);
}

static nb_wide planes_edge_kink(const medium_hit *k, nb_wide t)
{
    const edge_line lowest = lowest_line(k, t), plateau = {NB_W(1.0), NB_W(0.0)};
    nb_wide next = crossing_of(&lowest, &plateau, t, NB_WFAR);
    for (size_t i = 0; i < edge_leaf(k)->face_count; i++) {
        const edge_line line = face_line(k, i, t);
        next = crossing_of(&lowest, &line, t, next);
    }
    return next;
}

/* How deep a place is behind the nearest face. */
static nb_wide planes_depth(const medium_hit *k, nb_wide t)
{
    nb_wide least = NB_WFAR;
    for (size_t i = 0; i < edge_leaf(k)->face_count; i++) least = nb_wmin(face_line(k, i, t).depth, least);
    return least;
}

static nb_real density_of_depth(nb_wide depth)
{
    return nb_narrow(nb_wclamp(depth, NB_W(0.0), NB_W(1.0)));
}

/* What noise may do to the density: nothing on the plateau. */
static nb_real noise_of_depth(const medium_hit *k, nb_wide t, nb_wide depth)
{
    const nb_wide noise = plane_noise(k, t);
    return nb_narrow(nb_wselect(depth >= NB_W(1.0) + noise, NB_W(0.0), nb_wmin(noise, NB_W(1.0))));
}

/* Trapezoids from kink to kink: the least of linear functions is concave, so that there are no more kinks than faces
 * and one. Noise grows linearly along a trapezoid, and at its start kinks within the noise are passed over. */
static nb_estimate planes_edge_integral(const medium_hit *k, nb_wide start, nb_real h)
{
    const size_t most = 2 * edge_leaf(k)->face_count + 4;
    const nb_wide stop = start + nb_widen(h);
    nb_wide t = start, depth = planes_depth(k, start);
    nb_real value = NB_F(0.0), error = NB_F(0.0);
    for (size_t i = 0; i < most && nb_wany(t < stop); i++) {
        const nb_wide end = i + 1 < most ? nb_wmin(planes_edge_kink(k, t), stop) : stop;
        const nb_wide end_depth = planes_depth(k, end);
        const nb_real half = NB_F(0.5) * nb_narrow(nb_wmax(end - t, NB_W(0.0)));
        value = value + half * (density_of_depth(depth) + density_of_depth(end_depth));
        error = error + half * (NB_F(3.0) * noise_of_depth(k, t, depth) + noise_of_depth(k, end, end_depth));
        depth = end_depth;
        t = nb_wmax(end, t);
    }
    return nb_estimate_of(value, error + value * (NB_F(16.0) * NB_EPSILON));
}

/* ---- grids: one lane after the other, in double, so that lanes agree with rays alone --------- */

/* The ray from t on, in cells, of all lanes. */
typedef struct grid_lines {
    double from[3][NB_WIDTH], slope[3][NB_WIDTH];
} grid_lines;

static grid_lines lines_from(const medium_hit *k, nb_wide t)
{
    grid_lines lines;
    nb_wstore_lanes(lines.from[0], k->offset.x + k->slope.x * t);
    nb_wstore_lanes(lines.from[1], k->offset.y + k->slope.y * t);
    nb_wstore_lanes(lines.from[2], k->offset.z + k->slope.z * t);
    nb_wstore_lanes(lines.slope[0], k->slope.x);
    nb_wstore_lanes(lines.slope[1], k->slope.y);
    nb_wstore_lanes(lines.slope[2], k->slope.z);
    return lines;
}

static nb_grid_line line_of_lane(const grid_lines *lines, size_t i)
{
    return (nb_grid_line){{lines->from[0][i], lines->from[1][i], lines->from[2][i]},
                          {lines->slope[0][i], lines->slope[1][i], lines->slope[2][i]}};
}

/* Lane by lane, up to `enough` [m]: see nb_grid_integral. */
static nb_estimate lanes_integral(const medium_hit *k, nb_wide start, nb_wide end, nb_real enough)
{
    const grid_lines lines = lines_from(k, start);
    double length[NB_WIDTH];
    nb_scalar value[NB_WIDTH], error[NB_WIDTH], noise[NB_WIDTH], most[NB_WIDTH];
    nb_wstore_lanes(length, end - start);
    nb_store_lanes(noise, k->noise);
    nb_store_lanes(most, enough);
    for (size_t i = 0; i < NB_WIDTH; i++) {
        value[i] = error[i] = 0;
        if (!nb_lane(k->inside, i)) continue;
        const nb_grid_line line = line_of_lane(&lines, i);
        const nb_grid_sum sum =
            nb_grid_integral(k->medium->body.density.grid, &line, length[i], (double)noise[i], (double)most[i]);
        value[i] = (nb_scalar)sum.value;
        error[i] = (nb_scalar)sum.error;
    }
    const nb_real rounded = nb_load_lanes(value);
    return nb_estimate_of(rounded, nb_load_lanes(error) + rounded * (NB_F(4.0) * NB_EPSILON));
}

static nb_real grid_density(const medium_hit *k, nb_wide t)
{
    const grid_lines lines = lines_from(k, t);
    nb_scalar value[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const nb_grid_line line = line_of_lane(&lines, i);
        value[i] = (nb_scalar)nb_grid_density(k->medium->body.density.grid, line.from);
    }
    return nb_load_lanes(value);
}

typedef double grid_distance(const nebel_grid *grid, const nb_grid_line *line, double least);

/* The next place after t that a distance says. */
static nb_wide next_in_grid(const medium_hit *k, nb_wide t, grid_distance *next)
{
    const grid_lines lines = lines_from(k, t);
    double distance[NB_WIDTH], place[NB_WIDTH];
    nb_wstore_lanes(place, t);
    for (size_t i = 0; i < NB_WIDTH; i++) {
        distance[i] = 1e18;
        if (!nb_lane(k->inside, i)) continue;
        const nb_grid_line line = line_of_lane(&lines, i);
        const double least = fabs(place[i]) * (16 * DBL_EPSILON);
        distance[i] = fmin(next(k->medium->body.density.grid, &line, least), 1e18);
    }
    return t + nb_wload_lanes(distance);
}

/* The density's integral over a stretch of the rays, and that of the density times place and times its square, where places
 * are counted as the caller wants. */
typedef struct density_moments {
    nb_estimate amount;
    nb_real first, second;
} density_moments;

#if !defined(NB_DOUBLE)
#include "trace_voxels.h"
#endif

static nb_estimate grid_integral(const medium_hit *k, nb_wide start, nb_wide end, nb_real enough)
{
#if !defined(NB_DOUBLE)
    if (walks_voxels(k)) return voxels_integral(k, start, end, enough);
#endif
    return lanes_integral(k, start, end, enough);
}

/* ---- any profile ---------------------------------------------------------------------------- */

static nb_real soft_edge_density(const medium_hit *k, nb_wide t)
{
    const nb_leaf *leaf = edge_leaf(k);
    if (leaf->type == NB_LEAF_PLANES) return density_of_depth(planes_depth(k, t));
    const nb_wvec3 q = nb_wadd3(k->offset, nb_wscale3(k->slope, t));
    if (is_round(leaf)) return nb_round_edge_density(k->side, q, k->size.x, nb_leaf_edge_form(leaf));
    return nb_soft_edge_density(q, k->size);
}

static nb_estimate soft_edge_integral(const medium_hit *k, nb_wide start, nb_real h)
{
    const nb_leaf *leaf = edge_leaf(k);
    if (leaf->type == NB_LEAF_PLANES) return planes_edge_integral(k, start, h);
    const nb_wvec3 q = nb_wadd3(k->offset, nb_wscale3(k->slope, start));
    if (!is_round(leaf)) return blur(nb_soft_edge_integral(q, k->slope, k->size, nb_widen(h)), k->noise, h);
    return blur(nb_round_edge_integral(k->side, q, k->slope, k->size, nb_leaf_edge_form(leaf), nb_widen(h)), k->noise,
                h);
}

static nb_wide soft_edge_kink(const medium_hit *k, nb_wide t)
{
    const nb_leaf *leaf = edge_leaf(k);
    if (leaf->type == NB_LEAF_PLANES) return planes_edge_kink(k, t);
    if (is_round(leaf)) return nb_round_edge_kink(k->offset, k->slope, k->size, nb_leaf_edge_form(leaf), t);
    return nb_soft_edge_kink(k->offset, k->slope, k->size, t);
}

static nb_real soft_edge_noise(const medium_hit *k, nb_wide t)
{
    return edge_leaf(k)->type == NB_LEAF_PLANES ? nb_narrow(plane_noise(k, t)) : k->noise;
}

/* How much a soft edge may rise over h metres. */
static nb_real soft_edge_rise(const medium_hit *k, nb_real h)
{
    if (edge_leaf(k)->type != NB_LEAF_BOX) return REAL(k->steepest) * h;
    return nb_narrow(nb_wabs(k->slope.x) + nb_wabs(k->slope.y) + nb_wabs(k->slope.z)) * h;
}

/* Coordinates at t, narrowed only here, where they are small again for a shape that is far away. */
static nb_real coordinate(const medium_hit *k, nb_wide t)
{
    return nb_narrow(k->offset.x + k->slope.x * t);
}

static nb_real altitude_coordinate(const medium_hit *k, nb_wide t)
{
    return nb_narrow(nb_arc_height(k->arc, t) * k->slope.x);
}

/* Of height and altitude, u scale heights above the base. */
static nb_real density_of_height(const nebel_density *density, nb_real u)
{
    return density->below == NEBEL_BELOW_GROW ? nb_height_density(u) : nb_height_capped_density(u);
}

static nb_real contact_density(const medium_hit *k, nb_wide t)
{
    const nebel_density *density = &k->medium->body.density;
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        return density_of_height(density, coordinate(k, t));
    case NEBEL_DENSITY_ALTITUDE:
        return density_of_height(density, altitude_coordinate(k, t));
    case NEBEL_DENSITY_LINEAR:
        return nb_linear_density(coordinate(k, t));
    case NEBEL_DENSITY_GAUSSIAN:
        return nb_gaussian_density(k->level, coordinate(k, t));
    case NEBEL_DENSITY_RADIAL:
        return nb_radial_density(k->level, coordinate(k, t), density->power);
    case NEBEL_DENSITY_SOFT_EDGE:
        return soft_edge_density(k, t);
    case NEBEL_DENSITY_GRID:
        return grid_density(k, t);
    default:
        return NB_F(1.0);
    }
}

/* The density a part `share` of the way through a step: in float, which the coordinates of a step are small enough for.
 */
static nb_real contact_density_within(const medium_hit *k, nb_wide start, nb_real length, nb_real share)
{
    const nebel_density *density = &k->medium->body.density;
    if (density->type == NEBEL_DENSITY_CONSTANT) return NB_F(1.0);
    if (density->type != NEBEL_DENSITY_RADIAL) return contact_density(k, start + nb_widen(length * share));
    const nb_real u = coordinate(k, start) + nb_narrow(k->slope.x) * length * share;
    return nb_radial_density(k->level, u, density->power);
}

/* How far the density of a ray that is nearly level may be off, over how many metres: as long as it may be between its
 * limits. A ray that surely leaves them has done so where it meets the farther one, at its least steepness. */
static nb_estimate blur_linear(nb_estimate estimate, const medium_hit *k, nb_wide start, nb_real h)
{
    const nb_real end = nb_narrow(start) + h, offset = nb_narrow(k->offset.x);
    const nb_real flattest = nb_rcp_bounded(nb_max(nb_abs(nb_narrow(k->slope.x)) - k->drift, NB_F(0.0)));
    const nb_real farther = nb_max(nb_abs(offset), nb_abs(NB_F(1.0) - offset)) + k->noise;
    const nb_real noise = k->noise + k->drift * nb_min(end, NB_F(2.0) * farther * flattest);
    const nb_real first = coordinate(k, start), last = coordinate(k, start + nb_widen(h));
    const nb_mask varies = nb_and(nb_min(first, last) <= NB_F(1.0) + noise, nb_max(first, last) >= -noise);
    const nb_real length = nb_min(h, (NB_F(1.0) + NB_F(2.0) * noise) * flattest);
    return blur(estimate, nb_select(varies, nb_min(noise, NB_F(1.0)), NB_F(0.0)), length);
}

static nb_estimate altitude_integral(const medium_hit *k, nb_wide start, nb_wide end)
{
    const nebel_density *density = &k->medium->body.density;
    const nb_estimate along =
        nb_altitude_integral(k->arc, REAL(density->scale_height), k->deep, most_of_altitude(density), start, end);
    return blur(along, nb_min(k->noise, NB_F(4.0)), along.value);
}

/* Where fog of an altitude begins to count, 45 scale heights above its base: behind 1e19 times thinner fog. */
#define ALTITUDE_COUNTS 45.0

static nb_wide altitude_kink(const medium_hit *k, nb_wide t)
{
    const nebel_density *density = &k->medium->body.density;
    const nb_chord counts = nb_arc_chord(k->arc, WIDE(ALTITUDE_COUNTS * density->scale_height));
    const nb_wide kinks[] = {counts.enter, k->deep.enter, k->deep.leave, counts.leave};
    nb_wide next = NB_WFAR;
    for (int i = 0; i < 4; i++) next = nb_wselect(nb_wand(kinks[i] > t, kinks[i] < next), kinks[i], next);
    return next;
}

/* The density integrated from start to end, h metres, of profiles that no polynomial of a low degree describes. In
 * line, so that a caller who does not ask for the error does not pay for it. */
static inline __attribute__((always_inline)) nb_estimate curved_integral(const medium_hit *k, nb_wide start,
                                                                         nb_wide end, nb_real h)
{
    const nebel_density *density = &k->medium->body.density;
    if (density->type == NEBEL_DENSITY_ALTITUDE) return altitude_integral(k, start, end);
    const nb_real u = coordinate(k, start), slope = nb_narrow(k->slope.x);
    if (density->type == NEBEL_DENSITY_RADIAL)
        return blur(nb_radial_integral(k->level, u, slope, h, density->power), k->noise, h);
    const nb_real u_end = coordinate(k, end);
    if (density->type == NEBEL_DENSITY_GAUSSIAN)
        return blur(nb_gaussian_integral(k->level, u, u_end, slope), nb_min(k->noise, NB_F(1.0)),
                    nb_min(h, NB_F(16.0) * nb_rcp_bounded(slope)));
    /* from the dense end, where a ray comes down from so far that its start has lost the digits of the height */
    const nb_mask down = nb_and(slope < NB_F(0.0), nb_abs(u_end) < nb_abs(u));
    const nb_real from = nb_select(down, u_end, u), rise = nb_select(down, -slope, slope);
    const nb_estimate height = density->below == NEBEL_BELOW_GROW ? nb_height_integral(from, rise, h)
                                                                  : nb_height_capped_integral(from, rise, h);
    return blur(height, nb_min(k->noise, NB_F(4.0)), height.value);
}

/* From the end that is nearer to the limits: see nb_linear_integral. */
static nb_estimate linear_integral(const medium_hit *k, nb_wide start, nb_wide end, nb_real h)
{
    const nb_real u = coordinate(k, start), u_end = coordinate(k, end), slope = nb_narrow(k->slope.x);
    const nb_mask backwards = nb_abs(u_end) < nb_abs(u);
    const nb_real from = nb_select(backwards, u_end, u), rise = nb_select(backwards, -slope, slope);
    return blur_linear(nb_linear_integral(from, rise, h), k, start, h);
}

/* The same of any profile. The end counts by its place: h has lost digits of it where fog is far from where the piece
 * starts. */
static nb_estimate contact_integral(const medium_hit *k, nb_wide start, nb_wide end, nb_real h)
{
    switch (k->medium->body.density.type) {
    case NEBEL_DENSITY_HEIGHT:
    case NEBEL_DENSITY_GAUSSIAN:
    case NEBEL_DENSITY_RADIAL:
    case NEBEL_DENSITY_ALTITUDE:
        return curved_integral(k, start, end, h);
    case NEBEL_DENSITY_LINEAR:
        return linear_integral(k, start, end, h);
    case NEBEL_DENSITY_SOFT_EDGE:
        return soft_edge_integral(k, start, h);
    case NEBEL_DENSITY_GRID:
        return grid_integral(k, start, end, NB_HUGE);
    default:
        return blur(nb_estimate_of(h, h * (NB_F(2.0) * NB_EPSILON)), k->noise, h);
    }
}

/* The next place after t where the profile is not smooth; NB_WFAR where there is none. */
static nb_wide contact_kink(const medium_hit *k, nb_wide t)
{
    const nebel_density *density = &k->medium->body.density;
    if (density->type == NEBEL_DENSITY_SOFT_EDGE) return soft_edge_kink(k, t);
    if (density->type == NEBEL_DENSITY_GRID) return next_in_grid(k, t, nb_grid_kink);
    if (density->type == NEBEL_DENSITY_ALTITUDE) return altitude_kink(k, t);
    const int linear = density->type == NEBEL_DENSITY_LINEAR;
    if (!linear && !(density->type == NEBEL_DENSITY_HEIGHT && density->below == NEBEL_BELOW_CONSTANT)) return NB_WFAR;
    const nb_wide inverse = nb_wrcp_bounded(k->slope.x);
    const nb_wide zero = -k->offset.x * inverse;
    const nb_wide next = nb_wselect(zero > t, zero, NB_WFAR);
    if (!linear) return next;
    const nb_wide one = (NB_W(1.0) - k->offset.x) * inverse;
    return nb_wselect(nb_wand(one > t, one < next), one, next);
}

static int grows_without_bound(const nebel_density *density)
{
    return (density->type == NEBEL_DENSITY_HEIGHT || density->type == NEBEL_DENSITY_ALTITUDE) &&
           density->below == NEBEL_BELOW_GROW;
}

/* The least coordinate between two places, of fog that grows without bound. */
static nb_real lowest_coordinate(const medium_hit *k, nb_wide start, nb_wide end)
{
    if (k->medium->body.density.type == NEBEL_DENSITY_ALTITUDE)
        return altitude_coordinate(k, nb_wmin(nb_wmax(-k->arc.rise, start), end));
    return nb_min(coordinate(k, start), coordinate(k, end));
}
