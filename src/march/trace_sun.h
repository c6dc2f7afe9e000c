/* Sunlight that fog scatters towards the eye, once: along a piece of the ray the integral of
 *
 *     glow(t) e^-(depth(t) + depth to the sun(t)),
 *
 * where glow is what full sunlight would add. Depth up to t is exact; the depth to the sun is that of a march of its
 * own from there. As a function of t it is smooth but for *turns*: where the ray to the sun begins or ends to meet a
 * body, or passes one of its edges. At the silhouette of a round body it has the steepness of a root there. So steps go
 * from turn to turn, on a scale that flattens roots at their ends, and Kronrod's seven nodes are compared with the
 * three of Gauss's rule among them: a step is halved until they differ by less than the budget. The error that is told
 * is that of the three. Included by trace_kernel.c, which makes packets and workspaces. */

#define SUN_NODES 7
#define MOST_SUN_STEPS 4096

/* More media than this have their turns found by halving alone. */
#define MOST_TURNING_MEDIA 256

/* Kronrod's extension of Gauss's rule of three nodes, on [0, 1]. Source: Kronrod, Nodes and Weights of Quadrature
 * Formulas, 1965; derived again with 50 digits from the polynomial of Stieltjes. */
static const double sun_nodes[SUN_NODES] = {0.019754365645989861, 0.11270166537925831, 0.28287812532659871, 0.5,
                                            0.71712187467340129,  0.88729833462074169, 0.98024563435401014};
static const double sun_weights[SUN_NODES] = {0.052328113013233632, 0.13424404493416672, 0.20069870738798111,
                                              0.22545826932923707,  0.20069870738798111, 0.13424404493416672,
                                              0.052328113013233632};
static const double sun_weights_of_three[SUN_NODES] = {0, 5.0 / 18, 0, 8.0 / 18, 0, 5.0 / 18, 0};

/* More turns than these take memory once. */
#define STACK_TURNS 64

/* Where surfaces keep the sun away, lane by lane. A lane passes its toggles once, as its pieces come along the ray. */
typedef struct shade {
    const float *toggles; /* NULL: the sun reaches all */
    size_t next[NB_WIDTH], end[NB_WIDTH];
    nb_scalar dark[NB_WIDTH]; /* 1 where the sun is kept away before the next toggle */
    nb_wide toggle;           /* the next one of each lane */
    nb_wmask is_dark;
} shade;

/* What sunlight needs besides the march of the rays. */
typedef struct sunlight {
    const nebel_snapshot *snapshot;
    nb_wvec3 direction; /* of length 1, in all lanes */
    workspace *way;     /* from places on the rays to the sun */
    nb_wide *turns;     /* of all media in all lanes, in any order; NB_WFAR and more: none */
    size_t turn_count, turn_capacity;
    int has_turns; /* of the packet at hand */
    void *turn_memory;
    shade shade;
    double share; /* what steps may add to the error of radiance, all together */
    int out_of_memory;
} sunlight;

static void set_glow(contact *k, const packet *rays, const sunlight *sun)
{
    const nb_medium *medium = k->medium;
    const nb_turn turn = nb_turn_between(rays->direction, sun->direction);
    nb_real value = NB_F(0.0);
    for (int i = 0; i < medium->body.phase.lobe_count; i++) {
        const nb_lobe *lobe = &medium->body.phase.lobes[i];
        value = value + nb_phase_lobe(REAL(lobe->factor), REAL(lobe->alpha), REAL(lobe->peak), REAL(lobe->slope), turn);
    }
    for (int c = 0; c < 3; c++) k->glow[c] = REAL(medium->shine[c] * medium->body.extinction[c]) * value;
}

/* ---- turns ----------------------------------------------------------------------------------- */

static void note_turn(sunlight *sun, nb_wide t, nb_wmask real)
{
    if (!nb_wany(real)) return;
    if (sun->turn_count == sun->turn_capacity) {
        void *grown = grow_aligned(&sun->snapshot->allocator, sun->turns, sun->turn_count, sizeof *sun->turns,
                                   &sun->turn_capacity, sun->turn_count + 1, &sun->turn_memory);
        sun->out_of_memory = sun->out_of_memory || grown == NULL;
        if (grown == NULL) return;
        sun->turns = grown;
    }
    sun->turns[sun->turn_count++] = nb_wselect(real, t, NB_W(2.0) * NB_WFAR);
}

/* a t^2 + 2 b t + c = 0 */
static void note_roots(sunlight *sun, nb_wide a, nb_wide b, nb_wide c)
{
    const nb_wide square = b * b - a * c;
    const nb_wmask real = square >= NB_W(0.0);
    const nb_wide root = nb_wsqrt(nb_wmax(square, NB_W(0.0)));
    const nb_wide sum = -(b + nb_wselect(b < NB_W(0.0), -root, root));
    note_turn(sun, sum * nb_wrcp_bounded(a), real);
    note_turn(sun, c * nb_wrcp_bounded(sum), real);
}

/* A ray and the way to the sun in a leaf's frame: places p + t d + u l. */
typedef struct sun_plane {
    nb_wvec3 p, d, l;
} sun_plane;

/* Where the way to the sun touches the ball of a radius about `center`: |(p + t d - center) x l| = radius |l|. */
static void note_ball(sunlight *sun, const sun_plane *s, nb_wvec3 center, nb_wide radius)
{
    const nb_wvec3 p = nb_wcross3(nb_wsub3(s->p, center), s->l), d = nb_wcross3(s->d, s->l);
    const nb_wide across = radius * radius * nb_wdot3(s->l, s->l);
    note_roots(sun, nb_wdot3(d, d), nb_wdot3(p, d), nb_wdot3(p, p) - across);
}

/* The mantle x^2 + y^2 = (radius + slope z)^2 without end: where the quadratic in u has a double root. */
static void note_mantle(sunlight *sun, const sun_plane *s, nb_wide radius, nb_wide slope)
{
    const nb_wide w = radius + slope * s->p.z, wd = slope * s->d.z, wl = slope * s->l.z;
    const nb_wide ll = s->l.x * s->l.x + s->l.y * s->l.y - wl * wl;
    const nb_wide lp = s->l.x * s->p.x + s->l.y * s->p.y - wl * w, ld = s->l.x * s->d.x + s->l.y * s->d.y - wl * wd;
    const nb_wide pp = s->p.x * s->p.x + s->p.y * s->p.y - w * w, pd = s->p.x * s->d.x + s->p.y * s->d.y - w * wd;
    const nb_wide dd = s->d.x * s->d.x + s->d.y * s->d.y - wd * wd;
    note_roots(sun, ld * ld - ll * dd, lp * ld - ll * pd, lp * lp - ll * pp);
}

/* The rim where the mantle ends at this z: on the way to the sun u = (z - p.z - t d.z) / l.z. */
static void note_rim(sunlight *sun, const sun_plane *s, nb_wide z, nb_wide radius)
{
    const nb_wide up = (z - s->p.z) * nb_wrcp_bounded(s->l.z), slant = s->d.z * nb_wrcp_bounded(s->l.z);
    const nb_wide px = s->p.x + up * s->l.x, py = s->p.y + up * s->l.y;
    const nb_wide dx = s->d.x - slant * s->l.x, dy = s->d.y - slant * s->l.y;
    note_roots(sun, dx * dx + dy * dy, px * dx + py * dy, px * px + py * py - radius * radius);
}

/* n.x = distance: along + t slope + u rise = 0 */
typedef struct sun_line {
    nb_wide along, slope, rise;
} sun_line;

static sun_line line_of(const sun_plane *s, nb_wvec3 n, nb_wide distance)
{
    return (sun_line){nb_wdot3(n, s->p) - distance, nb_wdot3(n, s->d), nb_wdot3(n, s->l)};
}

/* An edge: where the way to the sun meets both faces at once. */
static void note_edge(sunlight *sun, const sun_line *a, const sun_line *b)
{
    const nb_wide across = a->slope * b->rise - b->slope * a->rise;
    const nb_wide t = (b->along * a->rise - a->along * b->rise) * nb_wrcp_bounded(across);
    note_turn(sun, t, nb_wabs(across) > NB_W(1e-30));
}

static void note_box(sunlight *sun, const nb_leaf *leaf, const sun_plane *s)
{
    sun_line faces[3][2];
    for (int i = 0; i < 3; i++) {
        const nb_wvec3 n = nb_wvec3(WIDE(i == 0), WIDE(i == 1), WIDE(i == 2));
        faces[i][0] = line_of(s, n, WIDE(leaf->low[i]));
        faces[i][1] = line_of(s, n, WIDE(leaf->high[i]));
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) note_edge(sun, &faces[i][k & 1], &faces[(i + 1) % 3][k >> 1]);
}

/* Bodies of very many faces have many edges, and nearly smooth shadows. */
enum { MOST_EDGED_FACES = 16 };

static void note_planes(sunlight *sun, const nb_volume *body, const nb_leaf *leaf, const sun_plane *s)
{
    sun_line lines[MOST_EDGED_FACES];
    if (leaf->face_count > MOST_EDGED_FACES) return;
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &body->faces[leaf->first_face + i];
        lines[i] = line_of(s, wide_vector(face->normal), WIDE(face->distance));
        for (size_t k = 0; k < i; k++) note_edge(sun, &lines[i], &lines[k]);
    }
}

static void note_round(sunlight *sun, const nb_leaf *leaf, const sun_plane *s)
{
    const nb_wvec3 zero = nb_wvec3(NB_W(0.0), NB_W(0.0), NB_W(0.0));
    const nb_wide one = NB_W(1.0);
    if (leaf->type == NB_LEAF_BALL) {
        note_ball(sun, s, zero, WIDE(FRAME(leaf, radius)));
    } else if (leaf->type == NB_LEAF_CAPSULE) {
        note_mantle(sun, s, one, NB_W(0.0));
        note_ball(sun, s, zero, one);
        note_ball(sun, s, nb_wvec3(NB_W(0.0), NB_W(0.0), WIDE(FRAME(leaf, length))), one);
    } else {
        const int cone = leaf->type == NB_LEAF_CONE;
        const nb_wide radius = cone ? WIDE(FRAME(leaf, radius)) : one;
        const nb_wide slope = cone ? WIDE(FRAME(leaf, slope)) : NB_W(0.0);
        note_mantle(sun, s, radius, slope);
        note_rim(sun, s, NB_W(0.0), radius);
        note_rim(sun, s, one, radius + slope);
    }
}

/* The shadow of a gaussian has no edge: its steep parts and its middle. */
static void note_gaussian(sunlight *sun, const packet *rays, const nebel_density *density)
{
    const sun_plane s = {rays->origin, rays->direction, sun->direction};
    const nb_wvec3 center = wide_vector(density->center);
    note_ball(sun, &s, center, WIDE(density->sigma));
    note_ball(sun, &s, center, WIDE(4 * density->sigma));
}

static void note_leaf(sunlight *sun, const packet *rays, const nb_volume *body, const nb_leaf *leaf)
{
    if (leaf->type == NB_LEAF_WORLD) return;
    const local_ray local = localize(rays, leaf);
    const sun_plane s = {local.p, local.d, in_frame(leaf, sun->direction)};
    if (leaf->type == NB_LEAF_BOX)
        note_box(sun, leaf, &s);
    else if (leaf->type == NB_LEAF_PLANES)
        note_planes(sun, body, leaf, &s);
    else
        note_round(sun, leaf, &s);
}

/* Of all media, whether the rays meet them or not: their shadows may. */
static void find_turns(sunlight *sun, const packet *rays)
{
    const nebel_snapshot *snapshot = sun->snapshot;
    sun->turn_count = 0;
    sun->has_turns = 1;
    if (snapshot->medium_count > MOST_TURNING_MEDIA) return;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        for (size_t k = 0; k < body->leaf_count; k++) note_leaf(sun, rays, body, &body->leaves[k]);
        if (body->density.type == NEBEL_DENSITY_GAUSSIAN) note_gaussian(sun, rays, &body->density);
    }
}

/* The first turn after t and before `end`, or `end`. */
static nb_wide next_turn(const sunlight *sun, nb_wide t, nb_wide end)
{
    for (size_t i = 0; i < sun->turn_count; i++) {
        const nb_wide turn = sun->turns[i];
        end = nb_wselect(nb_wand(turn > t, turn < end), turn, end);
    }
    return end;
}

/* ---- shade ----------------------------------------------------------------------------------- */

static void look_ahead(shade *s)
{
    lane_place lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; i++)
        lane[i] = s->next[i] < s->end[i] ? (lane_place)s->toggles[s->next[i]] : (lane_place)2e18;
    s->toggle = load_places(lane);
    s->is_dark = nb_widen_mask(nb_load_lanes(s->dark) > NB_F(0.0));
}

/* Of `count` rays, the first of them by the number `first`. */
static void begin_shade(shade *s, const nb_trace_job *job, size_t first, size_t count)
{
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const int counts = job->first_toggle != NULL && i < count;
        s->next[i] = counts ? job->first_toggle[first + i] : 0;
        s->end[i] = counts ? job->first_toggle[first + i + 1] : 0;
        s->dark[i] = 0;
    }
    s->toggles = job->toggles;
    look_ahead(s);
}

/* Turns are found where they are asked for. */
static void begin_sun(sunlight *sun, const nb_trace_job *job, size_t first, size_t count)
{
    sun->has_turns = 0;
    begin_shade(&sun->shade, job, first, count);
}

/* Passes the toggles up to t. */
static void pass_toggles(shade *s, nb_wide t, nb_wmask lanes)
{
    const nb_wmask passes = nb_wand(lanes, s->toggle <= t);
    if (!nb_wany(passes)) return;
    for (int i = 0; i < NB_WIDTH; i++) {
        if (!nb_lane(passes, i)) continue;
        const lane_place here = nb_lane(t, i);
        for (; s->next[i] < s->end[i] && (lane_place)s->toggles[s->next[i]] <= here; s->next[i]++)
            s->dark[i] = 1 - s->dark[i];
    }
    look_ahead(s);
}

/* ---- the way to the sun ---------------------------------------------------------------------- */

static int meet_fog(workspace *w, const nebel_snapshot *snapshot);
static gathered gather_light(march *m, const allowance *may, nb_mask *unbounded);

/* Optical depth from a place on each ray to the sun, and by how much it may be off. */
typedef struct sun_depth {
    nb_real depth[3], error[3];
} sun_depth;

static sun_depth depth_to_sun(sunlight *sun, const march *m, nb_wide t, nb_wmask lanes)
{
    const allowance may = {.transmittance_only = 1};
    march *way = &sun->way->m;
    nb_mask unbounded;
    way->rays.origin = nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t));
    way->rays.direction = sun->direction;
    way->rays.t_max = nb_wselect(lanes, NB_WFAR, NB_W(0.0));
    way->wants_error = m->wants_error;
    way->ignores_distances = 1;
    sun_depth to_sun = {{NB_F(0.0), NB_F(0.0), NB_F(0.0)}, {NB_F(0.0), NB_F(0.0), NB_F(0.0)}};
    if (!meet_fog(sun->way, sun->snapshot)) {
        sun->out_of_memory = 1;
        return to_sun;
    }
    const gathered g = gather_light(way, &may, &unbounded);
    const nb_mask watched = ends_matter(way);
    for (int c = 0; c < 3; c++) {
        to_sun.depth[c] = g.depth[c];
        to_sun.error[c] = g.depth_error[c] + nb_select(watched, way->grazing_ends.depth[c], way->all_ends.depth[c]);
    }
    return to_sun;
}

/* ---- steps ----------------------------------------------------------------------------------- */

typedef struct sun_step {
    nb_wide start;
    nb_real length;
    nb_real scale[3];  /* of the step: x = s (scale[0] + s (scale[1] + s scale[2])) */
    nb_real behind[3]; /* transmittance at its end */
    nb_real light[3];
    nb_real taken[3]; /* loss of transmittance by the rule, which is known without it */
    nb_real error;    /* of the rule, worst channel */
    nb_real rounding; /* of its terms */
    nb_real drop;     /* largest loss of transmittance over it */
} sun_step;

/* From where the ray meets the piece to `end`, of all media there: optical depth and its error. */
static void depth_until(const march *m, const piece *p, const gathered *g, nb_wide end, nb_real depth[3],
                        nb_real error[3])
{
    for (int c = 0; c < 3; c++) {
        depth[c] = g->depth[c];
        error[c] = g->depth_error[c];
    }
    const nb_real h = nb_narrow(end - p->start);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const contact *k = present(m, i);
        const nb_estimate along = contact_integral(k, p->start, end, h);
        for (int c = 0; c < 3; c++) {
            depth[c] = depth[c] + nb_select(k->inside, k->extinction[c] * along.value, NB_F(0.0));
            error[c] = error[c] + nb_select(k->inside, k->extinction[c] * along.error, NB_F(0.0));
        }
    }
}

static void transmittance_until(const march *m, const piece *p, const gathered *g, nb_wide end, nb_real behind[3])
{
    nb_real depth[3], error[3];
    depth_until(m, p, g, end, depth, error);
    for (int c = 0; c < 3; c++) behind[c] = nb_exp(-depth[c]);
}

/* Flat where the step begins or ends at a turn. */
static void set_scale(sun_step *s, nb_mask first, nb_mask last)
{
    const nb_real zero = NB_F(0.0), one = NB_F(1.0), two = NB_F(2.0);
    s->scale[0] = nb_select(first, zero, nb_select(last, two, one));
    s->scale[1] = nb_select(first, nb_select(last, NB_F(3.0), one), nb_select(last, -one, zero));
    s->scale[2] = nb_select(nb_and(first, last), -two, zero);
}

/* What a node stands for if its weight were 1: light, by how much of itself that may be off, and loss of
 * transmittance. */
typedef struct sun_node {
    nb_real light[3], doubt[3], taken[3];
} sun_node;

static sun_node light_node(sunlight *sun, const march *m, const piece *p, const gathered *g, const sun_step *s,
                           nb_wmask lanes, double place)
{
    const nb_real at = REAL(place), zero = NB_F(0.0);
    const nb_real share = at * (s->scale[0] + at * (s->scale[1] + at * s->scale[2]));
    const nb_real speed = s->scale[0] + at * (NB_F(2.0) * s->scale[1] + NB_F(3.0) * at * s->scale[2]);
    const nb_wide t = s->start + nb_widen(s->length * share);
    const sun_depth to_sun = depth_to_sun(sun, m, t, lanes);
    nb_real depth[3], error[3], glow[3] = {zero, zero, zero}, extinction[3] = {zero, zero, zero};
    depth_until(m, p, g, t, depth, error);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const contact *k = present(m, i);
        const nb_real density = nb_select(k->inside, contact_density(k, t), zero);
        for (int c = 0; c < 3; c++) {
            glow[c] = glow[c] + k->glow[c] * density;
            extinction[c] = extinction[c] + k->extinction[c] * density;
        }
    }
    sun_node sum;
    for (int c = 0; c < 3; c++) {
        const nb_real all = depth[c] + to_sun.depth[c], length = s->length * speed;
        sum.light[c] = glow[c] * length * nb_exp(-all);
        sum.doubt[c] = nb_min(error[c] + to_sun.error[c], NB_F(1.0)) + (all + NB_F(16.0)) * (NB_F(2.0) * NB_EPSILON);
        sum.taken[c] = extinction[c] * length * nb_exp(-depth[c]);
    }
    return sum;
}

static void sum_sun_nodes(sunlight *sun, const march *m, const piece *p, const gathered *g, nb_wmask lanes, sun_step *s)
{
    nb_real three[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)}, rounding[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (int c = 0; c < 3; c++) s->light[c] = s->taken[c] = NB_F(0.0);
    for (int n = 0; n < SUN_NODES; n++) {
        const sun_node at = light_node(sun, m, p, g, s, lanes, sun_nodes[n]);
        for (int c = 0; c < 3; c++) {
            const nb_real light = REAL(sun_weights[n]) * at.light[c];
            s->light[c] = s->light[c] + light;
            s->taken[c] = s->taken[c] + REAL(sun_weights[n]) * at.taken[c];
            three[c] = three[c] + REAL(sun_weights_of_three[n]) * at.light[c];
            rounding[c] = rounding[c] + light * at.doubt[c];
        }
    }
    s->error = s->rounding = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        s->error = nb_max(s->error, nb_abs(s->light[c] - three[c]));
        s->rounding = nb_max(s->rounding, rounding[c]);
    }
}

/* Sunlight is never more than full sunlight gives: the most radiant medium's times the loss of transmittance. A better
 * bound than the rule's for steps that hardly take light away. And where the rule does not see that loss it has passed
 * over what takes it. */
static void limit_step(const march *m, const nb_real before[3], sun_step *s)
{
    nb_real crude = NB_F(0.0), most[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const contact *k = present(m, i);
        for (int c = 0; c < 3; c++) {
            const nb_real radiance = k->glow[c] / nb_max(k->extinction[c], NB_TINY);
            most[c] = nb_select(k->inside, nb_max(most[c], radiance), most[c]);
        }
    }
    s->drop = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real drop = nb_max(before[c] - s->behind[c], NB_F(0.0));
        s->light[c] = nb_min(s->light[c], most[c] * drop);
        s->drop = nb_max(s->drop, drop);
        crude = nb_max(crude, most[c] * drop);
        const nb_real unseen = nb_abs(s->taken[c] - drop) - NB_F(8.0) * NB_EPSILON * before[c]; /* beyond rounding */
        s->error = nb_max(s->error, most[c] * unseen);
    }
    s->error = nb_min(s->error, crude);
}

/* Where a lane's steps have come to. */
typedef struct sun_walk {
    nb_wide t;
    nb_wmask lanes, at_turn;
    nb_real left;             /* steps that the lane may still try before its next toggle */
    nb_real guess, before[3]; /* length of the next step; transmittance up to here */
} sun_walk;

static sun_step try_step(sunlight *sun, const march *m, const piece *p, const gathered *g, const sun_walk *w,
                         nb_real length, nb_wide end, nb_wmask turns)
{
    sun_step s = {.start = w->t, .length = length};
    set_scale(&s, nb_narrow_mask(w->at_turn), nb_narrow_mask(turns));
    transmittance_until(m, p, g, end, s.behind);
    sum_sun_nodes(sun, m, p, g, w->lanes, &s);
    limit_step(m, w->before, &s);
    return s;
}

/* The lanes that are inside fog which the sun lights. */
static nb_mask sunlit_lanes(const march *m, const piece *p)
{
    nb_mask lit = nb_mask_false;
    for (size_t i = m->present_first; i < m->present_end; i++)
        if (present(m, i)->medium->is_sunlit) lit = nb_or(lit, present(m, i)->inside);
    return nb_and(lit, p->lanes);
}

/* A first step of a few optical depths: endless pieces would be halved for ever. */
static sun_walk begin_walk(const march *m, const piece *p, const gathered *g, nb_mask lanes)
{
    sun_walk w = {
        .t = p->start, .lanes = nb_widen_mask(lanes), .at_turn = nb_wmask_false, .left = NB_F(1.0) * MOST_SUN_STEPS};
    nb_real depth[3], error[3];
    depth_until(m, p, g, p->end, depth, error);
    const nb_real within = nb_max(largest(depth) - largest(g->depth), NB_F(4.0));
    w.guess = p->length * (NB_F(4.0) / within);
    for (int c = 0; c < 3; c++) w.before[c] = g->transmittance[c];
    return w;
}

static void take_sun_step(gathered *g, sun_walk *w, const sun_step *s, nb_wide end, nb_wmask turns, nb_mask taken)
{
    for (int c = 0; c < 3; c++) {
        g->radiance[c] = g->radiance[c] + nb_select(taken, s->light[c], NB_F(0.0));
        w->before[c] = nb_select(taken, s->behind[c], w->before[c]);
    }
    const nb_real sum = largest(g->radiance) * NB_EPSILON;
    g->radiance_error = g->radiance_error + nb_select(taken, s->error + s->rounding + sum, NB_F(0.0));
    const nb_wmask moved = nb_widen_mask(taken);
    w->t = nb_wselect(moved, end, w->t);
    w->at_turn = nb_wor(nb_wand(moved, turns), nb_wand(nb_wnot(moved), w->at_turn));
    w->guess = nb_select(taken, nb_max(w->guess, s->length + s->length), NB_F(0.5) * s->length);
}

/* What steps of a piece share. */
typedef struct sun_piece {
    const piece *p;
    gathered before;       /* what was gathered before it */
    nb_real whole, pieces; /* its length; how many there may be */
} sun_piece;

static void step_along(sunlight *sun, const march *m, const sun_piece *s, sun_walk *w, gathered *g)
{
    const nb_mask last = w->left <= NB_F(1.0); /* the rest is one step, whatever its error */
    const nb_wide bright = nb_wmin(sun->shade.toggle, s->p->end);
    const nb_wide next = nb_wmin(next_turn(sun, w->t, bright), nearest_kink(m, w->t, bright));
    const nb_wide stop = nb_wselect(nb_widen_mask(last), bright, next);
    const nb_real rest = nb_narrow(stop - w->t), length = nb_select(last, rest, nb_min(w->guess, rest));
    const nb_wmask to_stop = nb_widen_mask(length >= rest);
    const nb_wide end = nb_wselect(to_stop, stop, w->t + nb_widen(length));
    const nb_wmask turns = nb_wand(to_stop, stop < bright);
    const sun_step tried = try_step(sun, m, s->p, &s->before, w, length, end, turns);
    const nb_real least = NB_F(8.0) * NB_EPSILON * largest(tried.light); /* what no halving makes less */
    const nb_real allowed =
        least + REAL(sun->share) *
                    (NB_F(0.5) * tried.drop + NB_F(0.25) * (length / s->whole) / s->pieces + NB_F(0.001) / s->pieces);
    const nb_mask fits = nb_or(last, tried.error <= allowed);
    take_sun_step(g, w, &tried, end, turns, nb_and(fits, nb_narrow_mask(w->lanes)));
    w->left = w->left - NB_F(1.0);
}

/* To where the sun comes back. */
static void pass_shadow(const sunlight *sun, const march *m, const sun_piece *s, sun_walk *w, nb_wmask dark)
{
    const nb_wide end = nb_wmin(sun->shade.toggle, s->p->end);
    const nb_mask lanes = nb_narrow_mask(dark);
    nb_real before[3];
    transmittance_until(m, s->p, &s->before, end, before);
    for (int c = 0; c < 3; c++) w->before[c] = nb_select(lanes, before[c], w->before[c]);
    w->left = nb_select(lanes, NB_F(1.0) * MOST_SUN_STEPS, w->left);
    w->at_turn = nb_wand(w->at_turn, nb_wnot(dark));
    w->t = nb_wselect(dark, end, w->t);
}

/* Adds the sunlight of a piece; `g` is what was gathered before it. A lane's steps are its own. */
static void gather_sunlight(sunlight *sun, const march *m, const piece *p, gathered *g)
{
    const nb_mask lit = sunlit_lanes(m, p);
    if (!nb_any(lit)) return;
    if (!sun->has_turns) find_turns(sun, &m->rays);
    const sun_piece s = {p, *g, nb_max(p->length, NB_TINY), m->event_count + NB_F(1.0)};
    sun_walk w = begin_walk(m, p, g, lit);
    while (nb_wany(w.lanes)) {
        pass_toggles(&sun->shade, w.t, w.lanes);
        const nb_wmask dark = nb_wand(w.lanes, sun->shade.is_dark);
        if (nb_wany(dark))
            pass_shadow(sun, m, &s, &w, dark);
        else
            step_along(sun, m, &s, &w, g);
        w.lanes = nb_wand(w.lanes, w.t < p->end);
    }
}
