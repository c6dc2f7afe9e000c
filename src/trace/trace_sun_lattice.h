/* Sunlight in voxels of one box alone, in float: in one walk along the ray, cell by cell. The depth to the sun is
 * interpolated between the nodes of a lattice (light/sun_lattice.h) where the ray enters and leaves each cell, and
 * taken as linear in the ray's own depth between: then the light of a cell is
 *
 *     (glow / extinction) (depth's change) (e^-a - e^-b) / (b - a),
 *
 * a and b the whole depths at its ends. By how much that is off is estimated by what the lattice says of its
 * interpolation, and by how the slope of the depth to the sun changes from cell to cell. Rays for which this comes to
 * more than the tolerance leaves are lit by trace_sun_grid.h. Included by trace_sun.h. */

/* What a lane knows where a cell begins. */
typedef struct lattice_walk {
    nb_real along;             /* the density's integral up to here, of the piece */
    way_sum to_sun;            /* and to the sun, */
    nb_real slope, length;     /* which changed so along the cell before, of so many metres */
    nb_real depth[3], seen[3]; /* all together, as optical depth, and what is seen through it */
    nb_real cell; /* metres from one face of a cell to the opposite one, along the axis that is followed most */
} lattice_walk;

/* What has been gathered of the piece. The estimates of the error are off the light of cells, which are summed with
 * their squares. */
typedef struct lattice_light {
    nb_real light[3], doubt, square;
    nb_real aside[3];  /* those of interpolation, by the side on which they are */
    nb_real left_out;  /* at most */
    nb_estimate along; /* the density's integral over the piece */
} lattice_light;

static inline void look_up(const sunlight *sun, const medium_hit *k, const gathered_light *g, nb_real amount,
                           nb_real depth[3], nb_real seen[3])
{
    for (int c = 0; c < 3; c++) depth[c] = g->depth[c] + k->extinction[c] * amount;
    map_channels(sun->snapshot, transmitted, depth, seen);
}

/* Logarithmic mean of e^-a and e^-b, x = b - a. */
static inline nb_real mean_seen(nb_real first, nb_real last, nb_real x)
{
    const nb_mask steep = nb_abs(x) > NB_F(0.05);
    const nb_real ratio = (first - last) / nb_select(steep, x, NB_F(1.0));
    const nb_real flat = (first + last) * (NB_F(0.5) - x * x * NB_F(0.041666666666666664));
    return nb_select(steep, ratio, flat);
}

static inline void set_way(way_sum *to, const way_sum *from, nb_mask lanes)
{
    to->amount = nb_select(lanes, from->amount, to->amount);
    to->deviation = nb_select(lanes, from->deviation, to->deviation);
}

/* Where a lane comes upon fog; what the depth to the sun did before is that of a cell's length. */
static void enter_voxels(const sunlight *sun, const medium_hit *k, const gathered_light *g, const lattice_rays *to_sun,
                         nb_wide t, nb_mask lanes, lattice_walk *w)
{
    const way_sum here = way_of_lattice(to_sun, t);
    const nb_real before = way_of_lattice(to_sun, t - nb_widen(w->cell)).amount;
    nb_real depth[3], seen[3];
    look_up(sun, k, g, w->along + here.amount, depth, seen);
    for (int c = 0; c < 3; c++) {
        w->depth[c] = nb_select(lanes, depth[c], w->depth[c]);
        w->seen[c] = nb_select(lanes, seen[c], w->seen[c]);
    }
    set_way(&w->to_sun, &here, lanes);
    w->slope = nb_select(lanes, (here.amount - before) / w->cell, w->slope);
    w->length = nb_select(lanes, w->cell, w->length);
}

/* A cell that was crossed. */
typedef struct lit_cell {
    nb_real along; /* the density's integral up to its end */
    nb_real rise;  /* of the density */
    nb_real length;
    way_sum to_sun; /* at its end */
    nb_mask lanes, bright;
    nb_mask is_first; /* behind an edge: what the slope was before says nothing */
} lit_cell;

/* A bound of how much brighter or darker a cell may be whose light is `flat`, where its depth is off by x. Depth may be
 * less by `most`, as no more was found on the way to the sun, and is no less than `nearest` as it was found. `full`:
 * light without any depth. */
static inline nb_real change_of_light(nb_real flat, nb_real full, nb_real x, nb_real most, nb_real nearest)
{
    const nb_real less = nb_min(x, most);
    const nb_mask much = less > NB_F(1.0);
    const nb_real darker = flat * nb_min(x, NB_F(1.0));
    const nb_real brighter = nb_max(darker, flat * (less + NB_F(0.72) * (less * less)));
    return nb_any(much) ? nb_select(much, full * nb_exp(nb_min(less - nearest, NB_F(0.0))), brighter) : brighter;
}

/* Along the cell the depth to the sun is taken as a parabola, by how its slope has changed since the cell before, and the
 * density as linear: to the first order in what both deviate from constants the light changes by their covariance and
 * by the parabola's mean. What the next order may be is a doubt. */
typedef struct cell_shape {
    nb_real amount;          /* the density's integral over the cell */
    nb_real slope;           /* of the depth to the sun */
    nb_real shift, bent;     /* of depth: what light changes by, and a measure of what it deviates from constants */
    nb_real off, most_ahead; /* by how much it may be off, and the most there is to the sun */
} cell_shape;

static inline cell_shape shape_of_cell(const lit_cell *s, const lattice_walk *w)
{
    cell_shape h = {.amount = s->along - w->along};
    const nb_real change = s->to_sun.amount - w->to_sun.amount, length = s->length;
    const nb_mask brief = length < NB_F(0.05) * w->cell; /* too short to tell a slope */
    h.slope = nb_select(brief, w->slope, change / nb_select(brief, NB_F(1.0), length));
    const nb_real turn = nb_select(s->is_first, NB_F(0.0), h.slope - w->slope);
    const nb_real sag = turn * length * length / (NB_F(6.0) * (length + w->length));
    const nb_real lean = s->rise * change * length * NB_F(0.083333333333333333) / nb_max(h.amount, NB_TINY);
    h.shift = sag - lean;
    h.bent = nb_abs(lean) + nb_abs(sag);
    h.off = nb_max(s->to_sun.deviation, w->to_sun.deviation) + nb_abs(sag);
    h.most_ahead = nb_max(s->to_sun.amount, w->to_sun.amount);
    return h;
}

/* Of a cell that glows with 1 in a channel. */
typedef struct channel_light {
    nb_real light, doubt;
} channel_light;

static inline channel_light light_of_channel(const cell_shape *h, nb_real extinction, const nb_real depth[2],
                                             const nb_real seen[2])
{
    const nb_real shift = extinction * h->shift, through = depth[1] - depth[0];
    const nb_real flat = h->amount * mean_seen(seen[0], seen[1], through);
    const nb_real next = shift * shift + extinction * h->bent * nb_min(nb_abs(through), NB_F(1.0));
    const nb_real change =
        change_of_light(flat, h->amount, extinction * h->off, extinction * h->most_ahead, nb_min(depth[0], depth[1]));
    return (channel_light){flat * (NB_F(1.0) + nb_min(nb_max(shift, NB_F(-0.5)), NB_F(0.5))), change + flat * next};
}

static inline void light_cell(const sunlight *sun, const medium_hit *k, const gathered_light *g, const lit_cell *s,
                              lattice_walk *w, lattice_light *sum)
{
    const cell_shape h = shape_of_cell(s, w);
    nb_real depth[3], seen[3], doubt = NB_F(0.0);
    channel_light channel = {doubt, doubt};
    look_up(sun, k, g, s->along + s->to_sun.amount, depth, seen);
    for (int c = 0; c < 3; c++) {
        if (c == 0 || !sun->snapshot->is_gray)
            channel = light_of_channel(&h, k->extinction[c], (nb_real[2]){w->depth[c], depth[c]},
                                       (nb_real[2]){w->seen[c], seen[c]});
        sum->light[c] = sum->light[c] + nb_select(s->bright, k->glow[c] * channel.light, NB_F(0.0));
        doubt = nb_max(doubt, k->glow[c] * channel.doubt);
        w->depth[c] = nb_select(s->lanes, depth[c], w->depth[c]);
        w->seen[c] = nb_select(s->lanes, seen[c], w->seen[c]);
    }
    doubt = nb_select(s->bright, doubt, NB_F(0.0));
    sum->doubt = sum->doubt + doubt;
    sum->square = sum->square + doubt * doubt;
    for (int i = 0; i < 3; i++) sum->aside[i] = sum->aside[i] + doubt * s->to_sun.side[i];
    w->along = nb_select(s->lanes, s->along, w->along);
    w->slope = nb_select(s->lanes, h.slope, w->slope);
    w->length = nb_select(s->lanes, s->length, w->length);
    set_way(&w->to_sun, &s->to_sun, s->lanes);
}

static lattice_walk begin_lattice_walk(const voxel_rays *r)
{
    const nb_real zero = NB_F(0.0);
    const nb_wide fastest = nb_wmax(nb_wmax(nb_wabs(r->slope[0]), nb_wabs(r->slope[1])), nb_wabs(r->slope[2]));
    const nb_real cell = nb_narrow(NB_W(1.0) / nb_wmax(fastest, NB_W(1e-30)));
    return (lattice_walk){.along = zero,
                          .to_sun = {.amount = zero, .deviation = zero},
                          .slope = zero,
                          .length = zero,
                          .depth = {zero, zero, zero},
                          .seen = {zero, zero, zero},
                          .cell = cell};
}

/* Light of so small a part of what steps may add to the error is left out: an eighth of the tolerance at most. */
#define LEFT_OUT 0.13

/* Where lanes have come to, in a walk that finds light. */
typedef struct lit_walk {
    voxel_walk voxels;
    voxel_sum sum;
    lattice_walk at;
    nb_wmask enters; /* lanes that have met no fog since their last brick or cell without any */
    nb_wmask at_edge;
    nb_wmask is_cut; /* whether a step ended within a cell, so that sums are not those of a walk without light */
} lit_walk;

/* The next cell, or part of a cell, in the lanes that are `going`; of those the sun counts in the `bright` ones. Light is
 * asked for where there is fog. */
static void cross_lit_cell(sunlight *sun, const medium_hit *k, const gathered_light *g, const voxel_rays *rays,
                           const lattice_rays *to_sun, nb_wide last, nb_wmask going, nb_wmask bright, lit_walk *w,
                           lattice_light *light)
{
    pass_boundaries(&sun->shade, w->voxels.t, going);
    const nb_wide boundary = nb_wselect(bright, nb_wmin(last, sun->shade.boundary), last);
    nb_wide edge = boundary, end = boundary;
    if (to_sun->lattice->ends_in_fog) {
        edge = nb_wselect(bright, next_edge(to_sun, w->voxels.t, boundary), boundary);
        end = nb_wselect(bright, next_end(to_sun, w->voxels.t, edge), edge);
    }
    cell_voxels voxels;
    const nb_wide start = w->voxels.t, length = step_voxel(rays, &w->voxels, end, going, &voxels);
    add_voxel(&w->sum, length, voxels.mean);
    const nb_wmask first = w->at_edge;
    w->at_edge = nb_wand(w->voxels.t >= edge, edge < boundary);
    w->is_cut = nb_wor(w->is_cut, nb_wand(going, nb_wand(w->voxels.t >= end, end < last)));
    const nb_real along = nb_narrow(amount_of_voxels(rays->grid, &w->sum));
    const nb_wmask filled = nb_wand(bright, nb_widen_mask(along > w->at.along)), enters = nb_wand(w->enters, filled);
    w->enters = nb_wand(nb_wor(w->enters, going), nb_wnot(filled));
    if (!nb_wany(filled)) return;
    if (nb_wany(enters)) enter_voxels(sun, k, g, to_sun, start, nb_narrow_mask(enters), &w->at);
    const lit_cell cell = {.along = along,
                           .rise = REAL(scale_of_voxels(rays->grid)) * voxels.rise,
                           .length = nb_narrow(length),
                           .to_sun = way_of_lattice(to_sun, w->voxels.t),
                           .lanes = nb_narrow_mask(filled),
                           .bright = nb_narrow_mask(nb_wand(filled, nb_wnot(sun->shade.is_dark))),
                           .is_first = nb_narrow_mask(first)};
    light_cell(sun, k, g, &cell, &w->at, light);
}

/* The density's integral over the rest of the piece, too. */
static nb_estimate finish_voxels(const medium_hit *k, const ray_segment *p, const voxel_rays *rays, nb_wmask lanes,
                                 lit_walk *w)
{
    if (nb_wany(w->is_cut)) return voxels_integral(k, p->start, p->end, NB_HUGE);
    for (;;) {
        (void)find_voxels(rays, &w->voxels, p->end, lanes);
        const nb_wmask going = nb_wand(lanes, w->voxels.t < p->end);
        if (!nb_wany(going)) return estimate_of_voxels(k, &w->sum);
        cell_voxels voxels;
        const nb_wide length = step_voxel(rays, &w->voxels, p->end, going, &voxels);
        add_voxel(&w->sum, length, voxels.mean);
    }
}

static lattice_light light_of_lattice(sunlight *sun, const packet_state *m, const ray_segment *p,
                                      const gathered_light *g, nb_mask lit)
{
    const medium_hit *k = present(m, m->present_first);
    const voxel_rays rays = voxel_rays_of(k);
    const lattice_rays to_sun = lattice_rays_of(k->lit->sun_lattice, &rays);
    const nb_real zero = NB_F(0.0), hidden = amount_that_hides(sun, k, g->depth, LEFT_OUT);
    const nb_wmask lanes = nb_widen_mask(lit);
    lattice_light light = {.light = {zero, zero, zero}, .doubt = zero, .square = zero, .left_out = zero};
    for (int i = 0; i < 3; i++) light.aside[i] = zero;
    lit_walk w = {begin_voxels(&rays, p->start),
                  {NB_W(0.0), NB_W(0.0)},
                  begin_lattice_walk(&rays),
                  lanes,
                  nb_wmask_false,
                  nb_wmask_false};
    for (;;) {
        w.enters = nb_wor(w.enters, find_voxels(&rays, &w.voxels, p->end, lanes));
        const nb_wmask going = nb_wand(lanes, w.voxels.t < p->end);
        const nb_wmask bright = nb_wand(going, nb_widen_mask(w.at.along < hidden));
        if (!nb_wany(bright)) break;
        cross_lit_cell(sun, k, g, &rays, &to_sun, p->end, going, bright, &w, &light);
    }
    for (int c = 0; c < 3; c++) {
        const nb_real most = k->glow[c] / nb_max(k->extinction[c], NB_TINY) * REAL(LEFT_OUT * sun->share);
        light.left_out = nb_max(light.left_out, nb_select(w.at.along < hidden, zero, most));
    }
    light.along = finish_voxels(k, p, &rays, lanes, &w);
    return light;
}

static int has_lattice(const packet_state *m)
{
    return is_grid_alone(m->sun) && m->present_end > m->present_first &&
           present(m, m->present_first)->lit->sun_lattice != NULL;
}

/* What cells are off by has any sign, so that most of it cancels along a ray, but for rays that keep to one side of the
 * nodes along an axis: of those it adds up, to two thirds of the bound, as nodes are less a twelfth of second differences
 * where the bound has an eighth. The other factors are from comparisons with light in double. */
static nb_real doubt_of(const lattice_light *found)
{
    const nb_real most = nb_max(nb_max(nb_abs(found->aside[0]), nb_abs(found->aside[1])), nb_abs(found->aside[2]));
    return NB_F(0.66666667) * most + NB_F(0.25) * found->doubt + NB_F(2.0) * nb_sqrt(found->square);
}

/* What light is hardly ever off by: no axis has more than its share of what bends. */
static nb_real usual_doubt_of(const lattice_light *found)
{
    const nb_real all = nb_abs(found->aside[0]) + nb_abs(found->aside[1]) + nb_abs(found->aside[2]);
    return NB_F(0.13333333) * all + NB_F(0.3) * nb_sqrt(found->square);
}

/* Nothing but this spends the budget here. */
#define LATTICE_SHARE 1.03

/* Adds the light of the lanes that it is good enough for; the others are left. `along` becomes the integral of the
 * density over the piece. */
static nb_mask gather_by_lattice(sunlight *sun, const packet_state *m, const ray_segment *p, gathered_light *g,
                                 nb_estimate *along)
{
    const sun_attenuation before = sun->shade;
    const nb_mask lit = sunlit_lanes(m, p);
    const lattice_light found = light_of_lattice(sun, m, p, g, lit);
    const nb_real doubt = doubt_of(&found) + found.left_out;
    const nb_mask fits = nb_and(lit, usual_doubt_of(&found) <= REAL(LATTICE_SHARE * sun->share));
    const nb_real rounding = largest(found.light) * (NB_F(64.0) * NB_EPSILON);
    for (int c = 0; c < 3; c++) g->radiance[c] = g->radiance[c] + nb_select(fits, found.light[c], NB_F(0.0));
    g->radiance_error = g->radiance_error + nb_select(fits, doubt + rounding, NB_F(0.0));
    const nb_mask others = nb_and(lit, nb_not(fits));
    if (nb_any(others)) sun->shade = before;
    *along = found.along;
    return others;
}
