/* Sunlight in voxels of one box alone, in float: in one walk along the ray, cell by cell. The depth to the sun is
 * interpolated between the nodes of a lattice (media/grid_lattice.h) where the ray enters and leaves each cell, and
 * taken as linear in the ray's own depth between: then the light of a cell is
 *
 *     (glow / extinction) (depth's change) (e^-a - e^-b) / (b - a),
 *
 * a and b the whole depths at its ends. By how much that is off is estimated by what the lattice says of its
 * interpolation, and by how the slope of the depth to the sun changes from cell to cell. Rays for which this comes to
 * more than the tolerance leaves are lit by trace_sun_grid.h. Included by trace_sun.h. */

/* The rays in nodes of the lattice. */
typedef struct lattice_rays {
    const nb_grid_lattice *lattice;
    nb_wide from[3], slope[3];
} lattice_rays;

static lattice_rays lattice_rays_of(const nb_grid_lattice *l, const voxel_rays *r)
{
    lattice_rays rays = {.lattice = l};
    for (int s = 0; s < 2; s++) {
        const nb_wide lean = WIDE(l->lean[s]), per_cell = WIDE(l->per_cell);
        rays.from[s] = (r->from[l->side[s]] - lean * r->from[l->axis]) * per_cell - WIDE(l->first[s]);
        rays.slope[s] = (r->slope[l->side[s]] - lean * r->slope[l->axis]) * per_cell;
    }
    rays.from[2] = r->from[l->axis];
    rays.slope[2] = r->slope[l->axis];
    return rays;
}

/* The integral of the density from there to the sun, and by how much it may be off. */
typedef struct way_sum {
    nb_real amount, deviation;
} way_sum;

static inline way_sum way_of_lattice(const lattice_rays *r, nb_wide t)
{
    const nb_grid_lattice *l = r->lattice;
    const nb_wide across = WIDE(l->count[0]), layer = WIDE((double)l->count[0] * l->count[1]);
    nb_wide first[3], block[3];
    nb_real share[3], v[8];
    for (int i = 0; i < 3; i++) {
        const nb_wide place = clamp_wide(r->from[i] + r->slope[i] * t, NB_W(0.0), WIDE(l->count[i] - 1));
        first[i] = nb_wmin(whole_below(place), WIDE(l->count[i] - 2));
        share[i] = nb_narrow(place - first[i]);
        block[i] = whole_below(first[i] * NB_W(1.0 / NB_LATTICE_BLOCK));
    }
    const nb_wide corner = (first[2] * WIDE(l->count[1]) + first[1]) * across + first[0];
    for (int n = 0; n < 4; n++) {
        const nb_wide row = corner + (n & 1 ? across : NB_W(0.0)) + (n & 2 ? layer : NB_W(0.0));
        v[2 * n] = nb_gather_pairs(l->amount, row, &v[2 * n + 1]);
    }
    const nb_wide number = (block[2] * WIDE(l->blocks[1]) + block[1]) * WIDE(l->blocks[0]) + block[0];
    return (way_sum){REAL(l->step) * within_corners(v, share), REAL(l->step) * nb_gather_shorts(l->deviation, number)};
}

/* What a lane knows where a cell begins. */
typedef struct lattice_walk {
    nb_real along;             /* the density's integral up to here, of the piece */
    nb_real to_sun;            /* and to the sun, */
    nb_real slope, length;     /* which changed so along the cell before, of so many metres */
    nb_real depth[3], seen[3]; /* all together, as optical depth, and what is seen through it */
    nb_real cell; /* metres from one face of a cell to the opposite one, along the axis that is followed most */
} lattice_walk;

/* What has been gathered of the piece. The estimates of the error are off the light of cells, which are summed with
 * their squares. */
typedef struct lattice_light {
    nb_real light[3], doubt, square;
    nb_estimate along; /* the density's integral over the piece */
} lattice_light;

static inline void look_up(const sunlight *sun, const contact *k, const gathered *g, nb_real amount, nb_real depth[3],
                           nb_real seen[3])
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

/* Where a lane comes upon fog; what the depth to the sun did before is that of a cell's length. */
static void enter_voxels(const sunlight *sun, const contact *k, const gathered *g, const lattice_rays *to_sun,
                         nb_wide t, nb_mask lanes, lattice_walk *w)
{
    const nb_real here = way_of_lattice(to_sun, t).amount;
    const nb_real before = way_of_lattice(to_sun, t - nb_widen(w->cell)).amount;
    nb_real depth[3], seen[3];
    look_up(sun, k, g, w->along + here, depth, seen);
    for (int c = 0; c < 3; c++) {
        w->depth[c] = nb_select(lanes, depth[c], w->depth[c]);
        w->seen[c] = nb_select(lanes, seen[c], w->seen[c]);
    }
    w->to_sun = nb_select(lanes, here, w->to_sun);
    w->slope = nb_select(lanes, (here - before) / w->cell, w->slope);
    w->length = nb_select(lanes, w->cell, w->length);
}

/* A cell that was crossed. */
typedef struct lit_cell {
    nb_real along; /* the density's integral up to its end */
    nb_real rise;  /* of the density */
    nb_real length;
    way_sum to_sun; /* at its end */
    nb_mask lanes, bright;
} lit_cell;

/* Along the cell the depth to the sun is taken as a parabola, by how its slope has changed since the cell before, and the
 * density as linear: to the first order in what both deviate from constants the light changes by their covariance and
 * by the parabola's mean. What the next order may be is a doubt. */
static inline void light_cell(const sunlight *sun, const contact *k, const gathered *g, const lit_cell *s,
                              lattice_walk *w, lattice_light *sum)
{
    nb_real depth[3], seen[3], doubt = NB_F(0.0);
    look_up(sun, k, g, s->along + s->to_sun.amount, depth, seen);
    const nb_real amount = s->along - w->along, change = s->to_sun.amount - w->to_sun, length = s->length;
    const nb_mask brief = length < NB_F(0.05) * w->cell; /* too short to tell a slope */
    const nb_real slope = nb_select(brief, w->slope, change / nb_select(brief, NB_F(1.0), length));
    const nb_real sag = (slope - w->slope) * length * length / (NB_F(6.0) * (length + w->length));
    const nb_real lean = s->rise * change * length * NB_F(0.083333333333333333) / nb_max(amount, NB_TINY);
    const nb_real off = s->to_sun.deviation + nb_abs(sag), bent = nb_abs(lean) + nb_abs(sag);
    for (int c = 0; c < 3; c++) {
        const nb_real extinction = k->extinction[c], shift = extinction * (sag - lean);
        const nb_real through = depth[c] - w->depth[c];
        const nb_real flat = k->glow[c] * amount * mean_seen(w->seen[c], seen[c], through);
        const nb_real light = flat * (NB_F(1.0) + nb_min(nb_max(shift, NB_F(-0.5)), NB_F(0.5)));
        sum->light[c] = sum->light[c] + nb_select(s->bright, light, NB_F(0.0));
        const nb_real next = shift * shift + extinction * bent * nb_min(nb_abs(through), NB_F(1.0));
        doubt = nb_max(doubt, flat * (extinction * off + next));
        w->depth[c] = nb_select(s->lanes, depth[c], w->depth[c]);
        w->seen[c] = nb_select(s->lanes, seen[c], w->seen[c]);
    }
    doubt = nb_select(s->bright, doubt, NB_F(0.0));
    sum->doubt = sum->doubt + doubt;
    sum->square = sum->square + doubt * doubt;
    w->along = nb_select(s->lanes, s->along, w->along);
    w->slope = nb_select(s->lanes, slope, w->slope);
    w->length = nb_select(s->lanes, length, w->length);
    w->to_sun = nb_select(s->lanes, s->to_sun.amount, w->to_sun);
}

static lattice_walk begin_lattice_walk(const voxel_rays *r)
{
    const nb_real zero = NB_F(0.0);
    const nb_wide fastest = nb_wmax(nb_wmax(nb_wabs(r->slope[0]), nb_wabs(r->slope[1])), nb_wabs(r->slope[2]));
    const nb_real cell = nb_narrow(NB_W(1.0) / nb_wmax(fastest, NB_W(1e-30)));
    return (lattice_walk){zero, zero, zero, zero, {zero, zero, zero}, {zero, zero, zero}, cell};
}

static lattice_light light_of_lattice(sunlight *sun, const march *m, const piece *p, const gathered *g, nb_mask lit)
{
    const contact *k = present(m, m->present_first);
    const voxel_rays rays = voxel_rays_of(k);
    const lattice_rays to_sun = lattice_rays_of(k->medium->lattice, &rays);
    const nb_real scale = REAL(scale_of_voxels(rays.grid)), zero = NB_F(0.0);
    const nb_wmask lanes = nb_widen_mask(lit);
    lattice_light light = {{zero, zero, zero}, zero, zero, {zero, zero}};
    lattice_walk at = begin_lattice_walk(&rays);
    voxel_walk w = begin_voxels(&rays, p->start);
    voxel_sum sum = {NB_W(0.0), NB_W(0.0)};
    nb_wmask enters = lanes;
    for (;;) {
        enters = nb_wor(enters, find_voxels(&rays, &w, p->end, lanes));
        const nb_wmask going = nb_wand(lanes, w.t < p->end);
        if (!nb_wany(going)) break;
        if (nb_wany(enters)) enter_voxels(sun, k, g, &to_sun, w.t, nb_narrow_mask(enters), &at);
        enters = nb_wmask_false;
        pass_toggles(&sun->shade, w.t, going);
        cell_voxels voxels;
        const nb_wide length = step_voxel(&rays, &w, nb_wmin(p->end, sun->shade.toggle), going, &voxels);
        add_voxel(&sum, length, voxels.mean);
        const lit_cell cell = {.along = nb_narrow(amount_of_voxels(rays.grid, &sum)),
                               .rise = scale * voxels.rise,
                               .length = nb_narrow(length),
                               .to_sun = way_of_lattice(&to_sun, w.t),
                               .lanes = nb_narrow_mask(going),
                               .bright = nb_narrow_mask(nb_wand(going, nb_wnot(sun->shade.is_dark)))};
        light_cell(sun, k, g, &cell, &at, &light);
    }
    light.along = estimate_of_voxels(k, &sum);
    return light;
}

static int has_lattice(const march *m)
{
    return m->present_end - m->present_first == 1 && present(m, m->present_first)->medium->lattice != NULL;
}

/* What cells are off by has any sign, so that most of it cancels along a ray: the error that is told has a part of
 * the sum, and for the few cells that matter most the root of the sum of squares. The factors are from comparisons with
 * light in double. */
static nb_real doubt_of(const lattice_light *found)
{
    return NB_F(0.125) * found->doubt + NB_F(1.25) * nb_sqrt(found->square);
}

/* Nothing but lights spends the budget in fog of one medium, and nothing here but this. */
#define LATTICE_SHARE 3.1

/* Adds the light of the lanes that it is good enough for; the others are left. `along` becomes the integral of the
 * density over the piece. */
static nb_mask gather_by_lattice(sunlight *sun, const march *m, const piece *p, gathered *g, nb_estimate *along)
{
    const shade before = sun->shade;
    const nb_mask lit = sunlit_lanes(m, p);
    const lattice_light found = light_of_lattice(sun, m, p, g, lit);
    const nb_real doubt = doubt_of(&found);
    const nb_mask fits = nb_and(lit, doubt <= REAL(LATTICE_SHARE * sun->share));
    const nb_real rounding = largest(found.light) * (NB_F(64.0) * NB_EPSILON);
    for (int c = 0; c < 3; c++) g->radiance[c] = g->radiance[c] + nb_select(fits, found.light[c], NB_F(0.0));
    g->radiance_error = g->radiance_error + nb_select(fits, doubt + rounding, NB_F(0.0));
    const nb_mask others = nb_and(lit, nb_not(fits));
    if (nb_any(others)) sun->shade = before;
    *along = found.along;
    return others;
}
