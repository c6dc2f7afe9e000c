/* Optical depth on the way from places on the rays to a light: by a march of its own, or in closed form where one is
 * known. Included by trace_sun.h. */

static int meet_fog(workspace *w, const nebel_lighting *lighting);
static gathered_light gather_light(packet_state *m, const allowance *may, nb_mask *unbounded);

/* Optical depth from a place on each ray to a light, and by how much it may be off. */
typedef struct light_depth {
    nb_real depth[3], error[3];
    nb_real signature; /* of a way that is marched through leaves that may cross; else 0 */
} light_depth;

static light_depth no_depth(void)
{
    const nb_real zero = NB_F(0.0);
    return (light_depth){{zero, zero, zero}, {zero, zero, zero}, zero};
}

/* As far as `reach` into the direction. A march that has run out of memory is not to be used again; the walk of the rays
 * ends in its own time. */
static light_depth depth_by_march(sunlight *sun, const packet_state *m, nb_wide t, nb_wvec3 direction, nb_wide reach)
{
    const allowance may = {.transmittance_only = 1};
    packet_state *way = &sun->way->m;
    nb_mask unbounded;
    way->rays.origin = nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t));
    way->rays.direction = direction;
    way->rays.t_max = reach;
    way->wants_error = m->wants_error;
    way->ignores_distances = 1;
    way->wants_signature = sun->snapshot->has_parts;
    way->signature = NB_F(0.0);
    light_depth to_light = no_depth();
    sun->out_of_memory = sun->out_of_memory || !meet_fog(sun->way, sun->lighting);
    if (sun->out_of_memory) return to_light;
    const gathered_light g = gather_light(way, &may, &unbounded);
    const nb_mask watched = ends_matter(way);
    for (int c = 0; c < 3; c++) {
        to_light.depth[c] = g.depth[c];
        to_light.error[c] = g.depth_error[c] + nb_select(watched, way->grazing_ends.depth[c], way->all_ends.depth[c]);
    }
    to_light.signature = way->signature;
    return to_light;
}

/* The integral of the density from y up is that at y times the scale height. */
static light_depth depth_of_height(const sunlight *sun, const packet_state *m, nb_wide t)
{
    const medium_hit *k = present(m, m->present_first);
    const nb_real rise = nb_narrow(WIDE(k->medium->body.density.scale_height) / sun->direction.y);
    const nb_real length = contact_density(k, t) * rise;
    light_depth to_sun = no_depth();
    for (int c = 0; c < 3; c++) {
        to_sun.depth[c] = k->extinction[c] * length;
        to_sun.error[c] = to_sun.depth[c] * (nb_min(k->noise, NB_F(4.0)) + NB_F(8.0) * NB_EPSILON);
    }
    return to_sun;
}

static light_depth depth_of_altitude(const sunlight *sun, const packet_state *m, nb_wide t)
{
    const nb_medium *medium = &sun->snapshot->media[0];
    const packet way = {nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t)), sun->direction, NB_WFAR};
    medium_hit k = {.medium = medium};
    altitude_contact(&k, &way, &medium->body.density);
    const nb_estimate along = altitude_integral(&k, NB_W(0.0), NB_WFAR);
    light_depth to_sun = no_depth();
    for (int c = 0; c < 3; c++) {
        to_sun.depth[c] = REAL(medium->body.extinction[c]) * along.value;
        to_sun.error[c] = REAL(medium->body.extinction[c]) * along.error;
    }
    return to_sun;
}

/* No body of finite bounds is longer than they are. */
static nb_real longest_way(const nb_volume *body)
{
    double most = 0;
    for (int c = 0; c < 3; c++) most += body->high[c] - body->low[c];
    return REAL(fmin(most, 1e18));
}

/* What of a leaf's interval is ahead, and by how much that may be longer or shorter. */
typedef struct next_interval {
    nb_wide enter, leave;
    nb_real error;
} next_interval;

/* An end that may lie on the way counts with its slack. Where a tree is asked, bodies count within their bounds alone:
 * bits would depend on whether a lane's company brought them here. */
static next_interval ahead_in(const packet *way, const nb_volume *body, int by_tree)
{
    const nb_interval raw = leaf_interval(way, body, &body->leaves[0]);
    nb_wmask near = nb_wand(raw.leave + raw.leave_slack >= NB_W(0.0), raw.enter - raw.enter_slack <= way->t_max);
    if (by_tree) {
        const packet_part whole = {NB_W(0.0), way->t_max}, bounds = part_in_bounds(way, body, &whole);
        near = nb_wand(near, bounds.enter <= bounds.leave);
    }
    const nb_real slack = nb_min(nb_narrow(raw.enter_slack + raw.leave_slack), longest_way(body));
    return (next_interval){nb_wmax(raw.enter, NB_W(0.0)), nb_wmin(raw.leave, way->t_max),
                           nb_select(nb_narrow_mask(near), slack, NB_F(0.0))};
}

/* What a body cuts out of the way. Slack is left to the compiler to drop where nobody asks for the error. */
static inline __attribute__((always_inline)) nb_real length_in_body(const packet *way, const nb_volume *body)
{
    const nb_leaf *leaf = &body->leaves[0];
    nb_interval raw;
    if (leaf->type == NB_LEAF_SPHERE) {
        const local_ray local = localize(way, leaf);
        raw = nb_interval_sphere(local.p, local.d, WIDE(FRAME(leaf, radius)), local.reach);
    } else {
        raw = leaf_interval(way, body, leaf);
    }
    const nb_wide enter = nb_wmax(raw.enter, NB_W(0.0)), leave = nb_wmin(raw.leave, way->t_max);
    return nb_narrow(nb_wmax(leave - enter, NB_W(0.0)));
}

/* By how much that may be off; `noise` is what sums may be off by, relative to each of their terms. */
static inline __attribute__((always_inline)) nb_real length_error(const packet *way, const nb_volume *body, int by_tree,
                                                                  nb_real noise)
{
    const next_interval s = ahead_in(way, body, by_tree);
    return s.error + nb_narrow(nb_wmax(s.leave - s.enter, NB_W(0.0))) * noise;
}

static void add_body(light_depth *sum, const packet *way, const nb_volume *body)
{
    const nb_real length = length_in_body(way, body);
    for (int c = 0; c < 3; c++) sum->depth[c] = sum->depth[c] + REAL(body->extinction[c]) * length;
}

static void add_body_error(light_depth *sum, const packet *way, const nb_volume *body, int by_tree, nb_real noise)
{
    const nb_real error = length_error(way, body, by_tree, noise);
    for (int c = 0; c < 3; c++) sum->error[c] = sum->error[c] + REAL(body->extinction[c]) * error;
}

/* Bodies up to so many are asked one by one: sooner done than asking the tree. */
#define MOST_ASKED 64

/* Convex bodies that add: each cuts one stretch out of the way, and the order of its ends does not count. */
static light_depth depth_of_bodies(sunlight *sun, const packet_state *m, nb_wide t, nb_wvec3 direction, nb_wide reach)
{
    const nebel_snapshot *snapshot = sun->snapshot;
    const int by_tree = snapshot->medium_count > MOST_ASKED;
    const nb_real noise = REAL(4 + 0.5 * (double)snapshot->medium_count) * NB_EPSILON;
    const packet way = {nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t)), direction, reach};
    light_depth to_light = no_depth();
    sun->way->m.rays = way;
    if (sun->out_of_memory) return to_light;
    sun->out_of_memory = by_tree && !find_media(sun->way, snapshot);
    const size_t count = by_tree ? sun->way->found_count : snapshot->medium_count;
    for (size_t i = 0; i < count && !sun->out_of_memory; i++) {
        const nb_volume *body = &snapshot->media[by_tree ? sun->way->found[i] : i].body;
        add_body(&to_light, &way, body);
        if (m->wants_error) add_body_error(&to_light, &way, body, by_tree, noise);
    }
    return to_light;
}

/* Voxels of one box alone, up to where the integral of their density is `enough`. */
static light_depth depth_of_grid(const sunlight *sun, const packet_state *m, nb_wide t, nb_mask lanes, nb_real enough)
{
    const nb_medium *medium = &sun->snapshot->media[0];
    const nb_volume *body = &medium->body;
    const packet way = {nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t)), sun->direction, NB_WFAR};
    const next_interval s = ahead_in(&way, body, 0);
    medium_hit k = {.medium = medium, .inside = nb_and(lanes, nb_narrow_mask(s.enter < s.leave))};
    grid_contact(&k, &way, &body->leaves[0]);
    const nb_estimate along = grid_integral(&k, s.enter, s.leave, enough);
    const nb_real error = along.error + s.error * REAL(nb_grid_peak(body->density.grid));
    light_depth to_sun = no_depth();
    for (int c = 0; c < 3; c++) {
        to_sun.depth[c] = REAL(body->extinction[c]) * along.value;
        to_sun.error[c] = REAL(body->extinction[c]) * error;
    }
    return to_sun;
}

static light_depth depth_to_sun(sunlight *sun, const packet_state *m, nb_wide t, nb_wmask lanes)
{
    const nb_wide reach = nb_wselect(lanes, NB_WFAR, NB_W(0.0));
    switch (sun->lighting->sun_depth_method) {
    case NB_SUN_DEPTH_HEIGHT:
        return depth_of_height(sun, m, t);
    case NB_SUN_DEPTH_ALTITUDE:
        return depth_of_altitude(sun, m, t);
    case NB_SUN_DEPTH_ADDED:
    case NB_SUN_DEPTH_FLAT:
        return depth_of_bodies(sun, m, t, sun->direction, reach);
    case NB_SUN_DEPTH_GRID:
        return depth_of_grid(sun, m, t, nb_narrow_mask(lanes), NB_HUGE);
    default:
        return depth_by_march(sun, m, t, sun->direction, reach);
    }
}
