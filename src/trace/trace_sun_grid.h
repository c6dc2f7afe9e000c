/* Sunlight in voxels of one box alone. Along a ray the light is
 *
 *     (glow / density) times the integral of e^-(depth + depth to the sun) over the integral of the density,
 *
 * where depth is a multiple of that integral. So the rule's nodes lie at shares of the density's integral over a step:
 * what is rough along the ray, at the faces of cells, is in no node, and what is left for the rule to see is the depth
 * to the sun, which is an integral itself. Only faces of bricks, and of nearest voxels, end steps. Included by
 * trace_sun.h. */

static int is_grid_alone(const sunlight *sun)
{
    return sun->lighting->sun_depth_method == NB_SUN_DEPTH_GRID;
}

/* The nodes of the rule as shares of the density's integral. Nearly nothing is not nothing: before the first voxel with
 * fog there may be many without. */
static const double grid_shares[SUN_NODES] = {
    1e-6, 0.091751709536136983, 0.27639320225002103, 0.5, 0.72360679774997897, 0.90824829046386302, 1 - 1e-6};

/* Where in a step the nodes are, as parts of the whole density. */
typedef struct grid_nodes {
    nb_wide place[SUN_NODES];
    nb_real amount, error; /* the density's integral over the step */
} grid_nodes;

static grid_nodes place_nodes(const medium_hit *k, nb_wide start, nb_wide end, nb_mask lanes)
{
    const nebel_grid *grid = k->medium->body.density.grid;
    const grid_lines lines = lines_from(k, start);
    double length[NB_WIDTH], place[SUN_NODES][NB_WIDTH] = {{0}};
    nb_scalar amount[NB_WIDTH] = {0}, error[NB_WIDTH] = {0}, noise[NB_WIDTH];
    nb_wstore_lanes(length, end - start);
    nb_store_lanes(noise, k->noise);
    for (size_t i = 0; i < NB_WIDTH; i++) {
        if (!nb_lane(lanes, i)) continue;
        const nb_grid_line line = line_of_lane(&lines, i);
        const nb_grid_sum sum = nb_grid_integral(grid, &line, length[i], (double)noise[i], HUGE_VAL);
        amount[i] = (nb_scalar)sum.value;
        error[i] = (nb_scalar)sum.error;
        double at[SUN_NODES] = {0};
        if (sum.value > 0) nb_grid_places(grid, &line, length[i], sum.value, SUN_NODES, grid_shares, at);
        for (int n = 0; n < SUN_NODES; n++) place[n][i] = at[n];
    }
    const nb_real value = nb_load_lanes(amount);
    grid_nodes nodes = {.amount = value, .error = nb_load_lanes(error) + value * (NB_F(4.0) * NB_EPSILON)};
    for (int n = 0; n < SUN_NODES; n++) nodes.place[n] = start + nb_wload_lanes(place[n]);
    return nodes;
}

/* Optical depth of the ray up to a place, where the density's integral over the piece has come to `along`. */
static void depth_after(const medium_hit *k, const gathered_light *g, nb_wide along, nb_real depth[3])
{
    for (int c = 0; c < 3; c++) depth[c] = g->depth[c] + k->extinction[c] * nb_narrow(along);
}

/* The integral of the density behind which no sunlight matters, in any channel: less than `least` of what steps may add
 * to the error. */
static nb_real amount_that_hides(const sunlight *sun, const medium_hit *k, const nb_real depth[3], double least)
{
    const nb_real dark = -nb_log(nb_max(REAL(least * sun->share), NB_TINY));
    nb_real most = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real amount = (dark - depth[c]) / nb_max(k->extinction[c], NB_TINY);
        most = nb_select(k->extinction[c] > NB_F(0.0), nb_max(most, amount), most);
    }
    return nb_min(most, NB_HUGE);
}

/* What a node leaves out, which it tells. */
#define HIDDEN_PART 0.0033

static sun_node grid_node(sunlight *sun, const packet_state *m, const gathered_light *g, const sun_walk *w,
                          const grid_nodes *nodes, nb_mask lanes, int n)
{
    const medium_hit *k = present(m, m->present_first);
    const nb_real own = nb_narrow(w->along_error) + nodes->error;
    sun_node at;
    lit_fog fog = {.most = NB_F(0.0)};
    nb_real error[3];
    depth_after(k, g, w->along + nb_widen(nodes->amount * REAL(grid_shares[n])), at.depth);
    const light_depth to_sun =
        depth_of_grid(sun, m, nodes->place[n], lanes, amount_that_hides(sun, k, at.depth, HIDDEN_PART));
    map_channels(sun->snapshot, transmitted, at.depth, at.behind);
    for (int c = 0; c < 3; c++) {
        error[c] = g->depth_error[c] + k->extinction[c] * own;
        fog.extinction[c] = k->extinction[c];
        fog.glow[c] = k->glow[c];
        fog.most = nb_max(fog.most, k->glow[c] / nb_max(k->extinction[c], NB_TINY));
    }
    fill_node(sun, &at, &fog, nodes->amount, error, &to_sun);
    return at;
}

/* Empty steps have no nodes. */
static sun_step try_grid_step(sunlight *sun, const packet_state *m, const gathered_light *g, const sun_walk *w,
                              nb_real length, nb_wide end)
{
    const medium_hit *k = present(m, m->present_first);
    const nb_mask lanes = nb_and(nb_narrow_mask(w->lanes), k->inside);
    const grid_nodes nodes = place_nodes(k, w->t, end, lanes);
    const nb_mask filled = nb_and(lanes, nodes.amount > NB_F(0.0));
    const nb_real zero = NB_F(0.0);
    sun_step s = begin_step(w, length, nb_wmask_true);
    s.is_rough = nb_mask_true;
    s.amount = nb_widen(nodes.amount);
    s.amount_error = nodes.error;
    depth_after(k, g, w->along + s.amount, s.depth);
    map_channels(sun->snapshot, transmitted, s.depth, s.behind);
    lit_sum sum = {{zero, zero, zero}, zero, zero, zero, zero};
    if (nb_any(filled)) {
        sun_node at[SUN_NODES];
        for (int n = 0; n < SUN_NODES; n++) at[n] = grid_node(sun, m, g, w, &nodes, filled, n);
        sum = sum_nodes_of_step(at, at[0].most, NB_F(1.0), sun->snapshot->is_gray);
        sum.error = nb_max(sum.error, VOXEL_CAUTION * off_cubics(at));
    }
    take_sum(&s, &sum);
    limit_step(m, w->before, &s);
    const nb_real off = nb_min(nodes.error, NB_HUGE);
    for (int c = 0; c < 3; c++) s.rounding = nb_max(s.rounding, sum.rounding + w->before[c] * off * k->glow[c]);
    return s;
}

/* The voxels in the shadow of a surface. */
static void pass_voxels(const sun_attenuation *shadow, const packet_state *m, const ray_segment *p, sun_walk *w,
                        nb_wmask dark)
{
    const nb_estimate along =
        grid_integral(present(m, m->present_first), p->start, nb_wmin(shadow->boundary, p->end), NB_HUGE);
    w->along = nb_wselect(dark, nb_widen(along.value), w->along);
    w->along_error = nb_wselect(dark, nb_widen(along.error), w->along_error);
}

/* The end of the longest step from t on. */
static nb_wide nearest_border(const packet_state *m, nb_wide t, nb_wide end)
{
    const medium_hit *k = present(m, m->present_first);
    return nb_wselect(nb_widen_mask(k->inside), nb_wmin(next_in_grid(k, t, nb_grid_border), end), end);
}
