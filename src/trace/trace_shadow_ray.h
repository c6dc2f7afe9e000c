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

/* Where depths of voxels may be known before: on the way to the sun, or to a point light. */
typedef struct known_depths {
    const sunlight *sun;
    const nb_light *light; /* NULL: to the sun */
} known_depths;

/* What columns and lattices may do to light, of what steps may add to the error. Ways of which they say more are walked; in common steps
 * all ways of a ray or none. */
#define COLUMN_SHARE 1.0

#if !defined(NB_DOUBLE)
/* A block says how far columns are off at its worst place, in its worst direction, a cell the same of lattices of point
 * lights. Along a ray this part of it is enough:
 * tests/test_grid_sun.c prints how much of it was found. */
#define COLUMN_ERROR 0.5

/* From t of each way on, of lanes inside; `inside` becomes the lanes that are still to be walked. */
static nb_estimate along_columns(const sunlight *sun, medium_hit *k, const nb_sun_lattice *lattice, nb_wide t)
{
    const double *extinction = k->medium->body.extinction;
    const nb_real densest = REAL(fmax(fmax(extinction[0], extinction[1]), extinction[2]));
    const nb_real thinnest = REAL(fmin(fmin(extinction[0], extinction[1]), extinction[2]));
    nb_estimate along = amount_by_columns(k, lattice, t);
    const nb_real through = nb_exp(-thinnest * nb_max(along.value - along.error, NB_F(0.0)));
    along.error = along.error * REAL(COLUMN_ERROR);
    const nb_real off = densest * along.error * through * sun->most_light;
    const nb_mask good = sun->has_common_steps ? sun->takes_columns : off <= REAL(COLUMN_SHARE * sun->share);
    const nb_mask fits = nb_and(k->inside, good);
    along.value = nb_select(fits, along.value, NB_F(0.0));
    along.error = nb_select(fits, along.error, NB_F(0.0));
    k->inside = nb_and(k->inside, nb_not(fits));
    return along;
}
#endif

#if !defined(NB_DOUBLE)
/* The same to the point light of this number, from where its ways enter the voxels on. */
static nb_estimate along_lattice(const sunlight *sun, medium_hit *k, size_t light, const packet *way, nb_wide t)
{
    const size_t medium = (size_t)(k->medium - sun->snapshot->media);
    const nb_light_lattice *of_medium = sun->light_lattices->of_medium[medium];
    if (of_medium == NULL || !sun->has_common_steps) return nb_estimate_of(NB_F(0.0), NB_F(0.0));
    const nb_mask fits = nb_and(k->inside, sun->takes_columns);
    const nb_estimate along = amount_by_lattice(k, &of_medium[light], t, nb_narrow(way->t_max - t));
    k->inside = nb_and(k->inside, nb_not(fits));
    const nb_real error = along.error * REAL(COLUMN_ERROR);
    return (nb_estimate){nb_select(fits, along.value, NB_F(0.0)), nb_select(fits, error, NB_F(0.0))};
}

/* From where its ways enter the voxels on, as far as that is known before. `inside` becomes the lanes that are still to be
 * walked. */
static nb_estimate known_along(const known_depths *known, medium_hit *k, const packet *way, nb_wide t)
{
    const sunlight *sun = known->sun;
    const nb_sun_lattice *lattice = sun->lighting->media[k->medium - sun->snapshot->media].sun_lattice;
    if (known->light == NULL && lattice != NULL) return along_columns(sun, k, lattice, t);
    if (known->light != NULL && sun->light_lattices != NULL)
        return along_lattice(sun, k, (size_t)(known->light - sun->lighting->lights), way, t);
    return nb_estimate_of(NB_F(0.0), NB_F(0.0));
}
#endif

/* The integral of a body's density along the way, of any profile, and by how much it may be off. `known`: to which light
 * the way goes, else NULL. */
static nb_estimate profile_along(const packet *way, const nb_medium *medium, int by_tree, const known_depths *known)
{
    const next_interval s = ahead_in(way, &medium->body, by_tree);
    const nb_wide leave = nb_wmax(s.leave, s.enter);
    medium_hit k = {.medium = medium, .inside = nb_narrow_mask(s.enter < leave)};
    nb_estimate along = {NB_F(0.0), s.error * REAL(medium->peak)};
    if (!nb_any(k.inside)) return along;
    profile_contact(&k, way);
#if !defined(NB_DOUBLE)
    if (known != NULL && medium->body.density.type == NEBEL_DENSITY_GRID) {
        const nb_estimate found = known_along(known, &k, way, s.enter);
        along.value = found.value;
        along.error = along.error + found.error;
        if (!nb_any(k.inside)) return along;
    }
#else
    (void)known;
#endif
    const nb_estimate inside = contact_integral(&k, s.enter, leave, nb_narrow(leave - s.enter));
    along.value = nb_select(k.inside, inside.value, along.value);
    along.error = along.error + nb_select(k.inside, inside.error, NB_F(0.0));
    return along;
}

static void add_profile(light_depth *sum, const packet *way, const nb_medium *medium, int by_tree, nb_real noise,
                        const known_depths *known)
{
    const nb_estimate along = profile_along(way, medium, by_tree, known);
    for (int c = 0; c < 3; c++) {
        const nb_real extinction = REAL(medium->body.extinction[c]);
        sum->depth[c] = sum->depth[c] + extinction * along.value;
        sum->error[c] = sum->error[c] + extinction * (along.error + along.value * noise);
    }
}

/* Bodies up to so many are asked one by one: sooner done than asking the tree. */
#define MOST_ASKED 64

/* Bodies that add: each cuts one interval out of the way, and the order of its ends does not count. */
static light_depth depth_of_bodies(sunlight *sun, const packet_state *m, nb_wide t, nb_wvec3 direction, nb_wide reach,
                                   int is_to_sun)
{
    const nebel_snapshot *snapshot = sun->snapshot;
    const int by_tree = snapshot->medium_count > MOST_ASKED;
    const nb_real noise = REAL(4 + 0.5 * (double)snapshot->medium_count) * NB_EPSILON;
    const packet way = {nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t)), direction, reach};
    const known_depths known = {sun, NULL};
    light_depth to_light = no_depth();
    sun->way->m.rays = way;
    if (sun->out_of_memory) return to_light;
    sun->out_of_memory = by_tree && !find_media(sun->way, snapshot);
    const size_t count = by_tree ? sun->way->found_count : snapshot->medium_count;
    for (size_t i = 0; i < count && !sun->out_of_memory; i++) {
        const nb_medium *medium = &snapshot->media[by_tree ? sun->way->found[i] : i];
        if (medium->body.density.type != NEBEL_DENSITY_CONSTANT) {
            add_profile(&to_light, &way, medium, by_tree, noise, is_to_sun ? &known : NULL);
            continue;
        }
        add_body(&to_light, &way, &medium->body);
        if (m->wants_error) add_body_error(&to_light, &way, &medium->body, by_tree, noise);
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
    case NB_SUN_DEPTH_SUMMED:
    case NB_SUN_DEPTH_FLAT:
        return depth_of_bodies(sun, m, t, sun->direction, reach, 1);
    case NB_SUN_DEPTH_GRID:
        return depth_of_grid(sun, m, t, nb_narrow_mask(lanes), NB_HUGE);
    default:
        return depth_by_march(sun, m, t, sun->direction, reach);
    }
}
