/* How much of voxels lies between places and the sun, from the columns of a sun lattice (light/sun_lattice.h), in float.
 * Included by trace_sun.h. */

/* The rays in nodes of the lattice; in which layer the ways from them to the sun leave the box by both sides; and where
 * along the rays these are two faces at once. */
typedef struct lattice_rays {
    const nb_sun_lattice *lattice;
    nb_wide from[3], slope[3];
    nb_wide end_from[2], end_slope[2];
    nb_wide edge[3];
} lattice_rays;

/* Ways that lean less leave by no side. */
#define LEAST_LEAN 1e-9

static void set_side(lattice_rays *rays, const voxel_rays *r, int s)
{
    const nb_sun_lattice *l = rays->lattice;
    const double never = l->up ? 1e30 : -1e30;
    const int leans = fabs(l->lean[s]) >= LEAST_LEAN;
    const nb_wide lean = WIDE(l->lean[s]), per_cell = WIDE(l->per_cell);
    const nb_wide from = r->from[l->side[s]] - lean * r->from[l->axis];
    const nb_wide slope = r->slope[l->side[s]] - lean * r->slope[l->axis];
    const nb_wide layers = WIDE(leans ? 1 / l->lean[s] : 0);
    rays->from[s] = from * per_cell - WIDE(l->first[s]);
    rays->slope[s] = slope * per_cell;
    rays->end_from[s] = leans ? (WIDE(l->end[s]) - from) * layers : WIDE(never);
    rays->end_slope[s] = -(slope * layers);
}

static lattice_rays lattice_rays_of(const nb_sun_lattice *l, const voxel_rays *r)
{
    lattice_rays rays = {.lattice = l};
    for (int s = 0; s < 2; s++) set_side(&rays, r, s);
    rays.from[2] = r->from[l->axis];
    rays.slope[2] = r->slope[l->axis];
    for (int s = 0; s < 2; s++) rays.edge[s] = (WIDE(l->end[2]) - rays.end_from[s]) / rays.end_slope[s];
    rays.edge[2] = (rays.end_from[1] - rays.end_from[0]) / (rays.end_slope[0] - rays.end_slope[1]);
    return rays;
}

/* The first edge after t and before `end`, or `end`: the depth to the sun has a bend there. */
static inline nb_wide next_edge(const lattice_rays *r, nb_wide t, nb_wide end)
{
    for (int i = 0; i < 3; i++) end = nb_wselect(nb_wand(r->edge[i] > t, r->edge[i] < end), r->edge[i], end);
    return end;
}

/* Along the ray no more than a layer at the end of the way to the sun passes in a step, so that nothing there stays
 * unseen. From t to `end` the face is the same. */
static inline nb_wide next_end(const lattice_rays *r, nb_wide t, nb_wide end)
{
    const nb_wide t_half = NB_W(0.5) * (t + end), forward = r->lattice->up ? NB_W(1.0) : NB_W(-1.0);
    const nb_wide first = forward * (r->end_from[0] + r->end_slope[0] * t_half);
    const nb_wide second = forward * (r->end_from[1] + r->end_slope[1] * t_half);
    const nb_wide speed = nb_wabs(nb_wselect(first < second, r->end_slope[0], r->end_slope[1]));
    const nb_wmask by_side = nb_wand(nb_wmin(first, second) < forward * WIDE(r->lattice->end[2]), speed > NB_W(0.0));
    return nb_wselect(by_side, nb_wmin(t + NB_W(1.0) / speed, end), end);
}

/* The integral of the density from there to the sun, and by how much it may be off. Along each axis interpolation is too
 * large between nodes and too small at them; `side` says which, of 1 at nodes, 0 on average. */
typedef struct way_sum {
    nb_real amount, deviation, side[3];
} way_sum;

/* A place between columns. */
typedef struct lattice_column {
    nb_wide corner, block; /* numbers of the first of four nodes, and of the block, in layer 0 */
    nb_real share[2];
} lattice_column;

/* Between nodes along an axis. */
static inline nb_wide first_node(const nb_sun_lattice *l, int axis, nb_wide at, nb_real *share)
{
    const nb_wide place = clamp_wide(at, NB_W(0.0), WIDE(l->count[axis] - 1));
    const nb_wide first = nb_wmin(whole_below(place), WIDE(l->count[axis] - 2));
    *share = nb_narrow(place - first);
    return first;
}

static inline nb_wide block_of(nb_wide at)
{
    return whole_below(at * NB_W(1.0 / NB_LATTICE_BLOCK));
}

static inline lattice_column column_at(const lattice_rays *r, nb_wide t)
{
    const nb_sun_lattice *l = r->lattice;
    lattice_column c;
    const nb_wide u = first_node(l, 0, r->from[0] + r->slope[0] * t, &c.share[0]);
    const nb_wide v = first_node(l, 1, r->from[1] + r->slope[1] * t, &c.share[1]);
    c.corner = v * WIDE(l->count[0]) + u;
    c.block = block_of(v) * WIDE(l->blocks[0]) + block_of(u);
    return c;
}

/* To the last layer. */
static inline way_sum way_in_column(const nb_sun_lattice *l, const lattice_column *c, nb_wide layer)
{
    const nb_wide across = WIDE(l->count[0]), whole = WIDE((double)l->count[0] * l->count[1]);
    nb_real v[8], share[3] = {c->share[0], c->share[1]};
    const nb_wide first = first_node(l, 2, layer, &share[2]);
    const nb_wide corner = first * whole + c->corner;
    for (int n = 0; n < 4; n++) {
        const nb_wide row = corner + (n & 1 ? across : NB_W(0.0)) + (n & 2 ? whole : NB_W(0.0));
        v[2 * n] = nb_gather_pairs(l->amount, row, &v[2 * n + 1]);
    }
    const nb_wide number = block_of(first) * WIDE((double)l->blocks[0] * l->blocks[1]) + c->block;
    way_sum way = {.amount = REAL(l->step) * within_corners(v, share),
                   .deviation = REAL(l->step) * nb_gather_shorts(l->deviation, number)};
    for (int i = 0; i < 3; i++) way.side[i] = NB_F(1.0) - NB_F(6.0) * (share[i] - share[i] * share[i]);
    return way;
}

/* The layer in which the way to the sun leaves the box. */
static inline nb_wide end_layer(const lattice_rays *r, nb_wide t)
{
    const nb_wide first = r->end_from[0] + r->end_slope[0] * t, second = r->end_from[1] + r->end_slope[1] * t;
    const nb_wide end = WIDE(r->lattice->end[2]);
    return r->lattice->up ? nb_wmin(nb_wmin(first, second), end) : nb_wmax(nb_wmax(first, second), end);
}

static inline __attribute__((always_inline)) way_sum way_of_lattice(const lattice_rays *r, nb_wide t)
{
    const lattice_column c = column_at(r, t);
    way_sum way = way_in_column(r->lattice, &c, r->from[2] + r->slope[2] * t);
    if (!r->lattice->ends_in_fog) return way;
    const way_sum outside = way_in_column(r->lattice, &c, end_layer(r, t));
    way.amount = nb_max(way.amount - outside.amount, NB_F(0.0));
    const nb_real both = way.deviation + outside.deviation, share = outside.deviation / nb_max(both, NB_TINY);
    way.side[2] = mix(way.side[2], outside.side[2], share); /* the columns are the same */
    way.deviation = both;
    return way;
}

/* The same from a place on each of the lines of `k`, which need not be the rays. */
static nb_estimate amount_by_columns(const medium_hit *k, const nb_sun_lattice *l, nb_wide t)
{
    const nb_wvec3 at = nb_wadd3(k->offset, nb_wscale3(k->slope, t));
    voxel_rays place = {.grid = k->medium->body.density.grid, .from = {at.x, at.y, at.z}};
    for (int i = 0; i < 3; i++) place.slope[i] = NB_W(0.0);
    lattice_rays rays = {.lattice = l};
    for (int s = 0; s < 2; s++) set_side(&rays, &place, s);
    rays.from[2] = place.from[l->axis];
    rays.slope[2] = NB_W(0.0);
    const way_sum way = way_of_lattice(&rays, NB_W(0.0));
    return (nb_estimate){way.amount, way.deviation};
}
