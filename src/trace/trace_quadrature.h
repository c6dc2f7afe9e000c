/* Media of different light in a density that varies: the one case without a closed form.
 *
 * Over a step of the ray the radiance is the integral of e^-depth(t) * light(t), whose optical depth is still exact at
 * every point. Between kinks the integrand is an entire function of t, so n Gauss points on a step of length h err by
 * at most
 *
 *     (h / 2) 64 M / (15 (1 - r^-2) r^2n),      M >= |integrand| on the Bernstein ellipse of parameter r
 *
 * (Trefethen, Approximation Theory and Approximation Practice, theorem 19.3), and M has a bound in closed form for
 * every profile. So the step is chosen by a proof, not by comparing two guesses: it is shortened until the bound fits
 * the budget. Two cruder rules, whose bounds are better for steps that hardly attenuate or hardly differ, may take a
 * step before that. */

#define NODE_COUNT 6
#define MOST_STEPS 4096

/* Abscissas and weights on [0, 1]: Abramowitz and Stegun, table 25.4, n = 6. */
#define NODES                                                                                                          \
    {                                                                                                                  \
        NB_F(0.033765242898423986), NB_F(0.169395306766867743), NB_F(0.380690406958401546),                            \
            NB_F(0.619309593041598454), NB_F(0.830604693233132257), NB_F(0.966234757101576014)                         \
    }
#define WEIGHTS                                                                                                        \
    {                                                                                                                  \
        NB_F(0.085662246189585173), NB_F(0.180380786524069304), NB_F(0.233956967286345524),                            \
            NB_F(0.233956967286345524), NB_F(0.180380786524069304), NB_F(0.085662246189585173)                         \
    }

/* [n][i]: the integral up to node n of the polynomial that is 1 at node i and 0 at the other nodes. Derived with 40
 * digits. */
static const double up_to_node[NODE_COUNT][NODE_COUNT] = {
    {0.042831123094792586, -0.014763725997197412, 0.0093250507064777512, -0.0056688580494835119, 0.0028544333150993351,
     -0.00081278017126476211},
    {0.092673491430378863, 0.090190393262034652, -0.020300102293239586, 0.010363156240246424, -0.0048871929280376715,
     0.0013555610554850618},
    {0.082247922612843874, 0.19603216233324501, 0.11697848364317276, -0.020482527745656098, 0.0079899918996623357,
     -0.0020756257848663342},
    {0.087737871974451507, 0.17239079462440697, 0.25443949503200162, 0.11697848364317276, -0.015651375809175702,
     0.0034143235767412987},
    {0.084306685134100111, 0.18526797945210698, 0.22359381104609910, 0.25425706957958511, 0.090190393262034652,
     -0.0070112452407936907},
    {0.086475026360849935, 0.17752635320896997, 0.23962582533582904, 0.22463191657986777, 0.19514451252126672,
     0.042831123094792586}};

/* The parameter to begin with: so wide that a step over which the integrand hardly grows in the ellipse fits a budget
 * relative to the radiance. */
static nb_real choose_ellipse(double budget)
{
    const double wanted = budget < 1e-15 ? 1e-15 : budget > 0.1 ? 0.1 : budget;
    return nb_min(nb_exp(nb_log(REAL(120 / wanted)) * REAL(0.5 / NODE_COUNT)), REAL(64.0));
}

/* Where that is not good enough the ellipse belongs to the fog, not to the step: it reaches as far as the integrand
 * hardly grows, and its parameter is reach / length. The best one is where M grows by e^12 or so, which balances r^12.
 */
static nb_real ellipse_of(nb_real reach, nb_real length)
{
    return nb_min(nb_max(reach / nb_max(length, NB_TINY), NB_F(1.25)), NB_F(64.0));
}

/* 64 / (15 (1 - r^-2) r^12) */
static nb_real ellipse_factor(nb_real r)
{
    const nb_real square = r * r;
    const nb_real sixth = square * square * square;
    return NB_F(64.0) / (NB_F(15.0) * (NB_F(1.0) - NB_F(1.0) / square) * (sixth * sixth));
}

/* For one axis of a soft edge, which has the density q in the middle and changes by `rise` within the ellipse. */
static nb_wide soft_axis_ceiling(nb_wide q, nb_wide rise)
{
    const nb_wmask level = nb_wor(q <= NB_W(0.0), q >= NB_W(1.0));
    return nb_wselect(level, q, q + rise);
}

/* For a quadratic that is `value` in the middle, changes by `slope` there and bends by `bend`: it, clamped to at
 * most 1. */
static nb_wide quadratic_ceiling(nb_wide value, nb_wide slope, nb_wide bend, nb_wide along)
{
    const nb_wide most = nb_wmax(value, NB_W(0.0)) + along * (nb_wabs(slope) + along * nb_wabs(bend));
    return nb_wselect(value >= NB_W(1.0), NB_W(1.0), most);
}

static nb_wide round_edge_ceiling(const medium_hit *k, nb_wide middle, nb_wide along)
{
    const nb_wvec3 q = nb_wadd3(k->offset, nb_wscale3(k->slope, middle)), side = k->side;
    const nb_wide depth = side.x + q.x * (side.y + side.z * q.x), slope = side.y + NB_W(2.0) * side.z * q.x;
    if (nb_leaf_edge_form(edge_leaf(k)) == NB_EDGE_CAPPED)
        return quadratic_ceiling(depth, slope, side.z, along) *
               soft_axis_ceiling(nb_soft_axis(q.y, k->size.x), nb_wabs(k->slope.y) * along);
    const nb_wide past = nb_wmax(nb_wabs(q.y) - k->size.x, NB_W(0.0));
    const nb_wide falls = NB_W(2.0) * past * nb_wabs(k->slope.y), bends = k->slope.y * k->slope.y;
    return quadratic_ceiling(depth - past * past, nb_wabs(slope) + falls, nb_wabs(side.z) + bends, along);
}

static nb_wide planes_edge_ceiling(const medium_hit *k, nb_wide middle, nb_wide along)
{
    const edge_line lowest = lowest_line(k, middle);
    return nb_wmax(lowest.depth, NB_W(0.0)) + nb_wabs(lowest.slope) * along;
}

static nb_wide box_edge_ceiling(const medium_hit *k, nb_wide middle, nb_wide along)
{
    const nb_wvec3 q = nb_wadd3(k->offset, nb_wscale3(k->slope, middle));
    return soft_axis_ceiling(nb_soft_axis(q.x, k->size.x), nb_wabs(k->slope.x) * along) *
           soft_axis_ceiling(nb_soft_axis(q.y, k->size.y), nb_wabs(k->slope.y) * along) *
           soft_axis_ceiling(nb_soft_axis(q.z, k->size.z), nb_wabs(k->slope.z) * along);
}

static nb_wide soft_edge_ceiling(const medium_hit *k, nb_wide middle, nb_wide along)
{
    const nb_leaf *leaf = edge_leaf(k);
    if (leaf->type == NB_LEAF_PLANES) return planes_edge_ceiling(k, middle, along);
    return is_round(leaf) ? round_edge_ceiling(k, middle, along) : box_edge_ceiling(k, middle, along);
}

static nb_real grid_ceiling(const medium_hit *k, nb_wide middle, nb_real along)
{
    const grid_lines lines = lines_from(k, middle);
    nb_scalar value[NB_WIDTH], width[NB_WIDTH];
    nb_store_lanes(width, along);
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const nb_grid_line line = line_of_lane(&lines, i);
        double reach[3];
        for (int c = 0; c < 3; c++) reach[c] = fabs(line.slope[c]) * (double)width[i];
        value[i] = (nb_scalar)fmin(nb_grid_ceiling(k->medium->body.density.grid, line.from, reach), 1e30);
    }
    return nb_load_lanes(value);
}

/* The real part of the distance from the centre, sqrt(lowest^2 + z^2), is at least that with z its real part and `across`^2 taken
 * off. Where z may be imaginary and as far as the lowest place from the centre the root has no one branch. */
static nb_real altitude_ceiling(const medium_hit *k, nb_wide middle, nb_wide along, nb_wide across)
{
    const nebel_density *density = &k->medium->body.density;
    const nb_wide nearest = nb_wclamp(-k->arc.rise, middle - along, middle + along);
    const nb_wide climb = nb_arc_climb(k->arc, nearest), radius = k->arc.radius + climb, square = radius * radius;
    const nb_wide less = nb_wsqrt(nb_wmax(square - across * across, NB_W(0.0)));
    const nb_wide drop = nb_wselect(less > NB_W(0.0), across * across / nb_wmax(radius + less, NB_WTINY), radius);
    const nb_real u = nb_narrow((k->arc.height + climb - drop) * k->slope.x);
    const nb_wmask branches = nb_wand(nearest == -k->arc.rise, less <= NB_W(0.0));
    const nb_real growing = density->below == NEBEL_BELOW_GROW ? nb_height_density(u) : nb_exp(nb_min(-u, NB_F(80.0)));
    const nb_real most = nb_select(nb_narrow_mask(branches), NB_HUGE, growing);
    if (density->below == NEBEL_BELOW_GROW) return most;
    return nb_select(altitude_coordinate(k, middle) < NB_F(0.0), NB_F(1.0), most);
}

/* A bound of |density| on the ellipse around `middle`, `along` and `across` metres wide. Between kinks a profile that
 * stays level is the same number on all of it. */
static nb_real density_ceiling(const medium_hit *k, nb_wide middle, nb_real along, nb_real across)
{
    const nebel_density *density = &k->medium->body.density;
    const nb_real u = coordinate(k, middle);
    const nb_real slope = nb_abs(nb_narrow(k->slope.x));
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        if (density->below == NEBEL_BELOW_GROW) return nb_height_density(u - slope * along);
        return nb_select(u < NB_F(0.0), NB_F(1.0), nb_exp(nb_min(slope * along - u, NB_F(80.0))));
    case NEBEL_DENSITY_LINEAR: {
        const nb_mask level = nb_or(u <= NB_F(0.0), u >= NB_F(1.0));
        return nb_linear_density(u) + nb_select(level, NB_F(0.0), slope * along);
    }
    case NEBEL_DENSITY_GAUSSIAN: {
        const nb_real closest = nb_max(nb_abs(u) - slope * along, NB_F(0.0));
        const nb_real rise = slope * across;
        return nb_exp(nb_min(rise * rise - k->level - closest * closest, NB_F(80.0)));
    }
    case NEBEL_DENSITY_RADIAL: {
        const nb_real reach = slope * along;
        const nb_real base = nb_max(k->level - u * u, NB_F(0.0)) + reach * (NB_F(2.0) * nb_abs(u) + reach);
        nb_real power = base;
        for (int i = 1; i < density->power; i++) power = power * base;
        return power;
    }
    case NEBEL_DENSITY_SOFT_EDGE:
        return nb_narrow(soft_edge_ceiling(k, middle, nb_widen(along)));
    case NEBEL_DENSITY_GRID:
        return grid_ceiling(k, middle, along);
    case NEBEL_DENSITY_ALTITUDE:
        return altitude_ceiling(k, middle, nb_widen(along), nb_widen(across));
    default:
        return NB_F(1.0);
    }
}

/* Light per extinction of the media of a piece: the least and the most. */
typedef struct optical_range {
    nb_real least[3], most[3];
    nb_mask emits; /* some medium shines without that quotient meaning anything */
} optical_range;

static optical_range find_range(const packet_state *m)
{
    optical_range r = {.emits = nb_mask_false};
    for (int c = 0; c < 3; c++) {
        r.least[c] = NB_HUGE;
        r.most[c] = NB_F(0.0);
    }
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        if (k->medium->emits) r.emits = nb_or(r.emits, k->inside);
        for (int c = 0; c < 3; c++) {
            r.least[c] = nb_select(k->inside, nb_min(k->radiance[c], r.least[c]), r.least[c]);
            r.most[c] = nb_select(k->inside, nb_max(k->radiance[c], r.most[c]), r.most[c]);
        }
    }
    return r;
}

/* A step that is being considered, in all lanes at once. */
typedef struct step {
    nb_wide start;
    nb_real length;
    piece_sum sum;
    nb_real behind[3]; /* transmittance at its end */
    nb_real drop;      /* largest loss of transmittance over it */
    nb_real gauss_bound;
    nb_real crude_bound[2];
} step;

/* The bound of Gauss's rule: M of the integrand, from the ceilings of the densities. Or twice the largest value that
 * the integrand has on the step, which both the integral and the rule stay below: through fog so dense that M is beyond
 * all numbers. */
static nb_real bound_gauss(const packet_state *m, const step *s, const gathered_light *g, nb_real ellipse)
{
    const nb_real radius = NB_F(0.5) * s->length;
    const nb_wide middle = s->start + nb_widen(radius);
    const nb_real along = NB_F(0.5) * (ellipse + NB_F(1.0) / ellipse) * radius;
    const nb_real across = NB_F(0.5) * (ellipse - NB_F(1.0) / ellipse) * radius;
    nb_real depth[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)}, light[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_real ceiling = nb_select(k->inside, density_ceiling(k, middle, along, across), NB_F(0.0));
        for (int c = 0; c < 3; c++) {
            depth[c] = depth[c] + k->extinction[c] * ceiling;
            light[c] = light[c] + k->light[c] * ceiling;
        }
    }
    const nb_real factor = ellipse_factor(ellipse) * radius;
    nb_real bound = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real exponent = depth[c] * along;
        const nb_real height = nb_min(light[c] * nb_exp(exponent), NB_HUGE) * factor;
        const nb_real least = nb_select(exponent < NB_F(60.0), height, NB_HUGE);
        bound = nb_max(bound, nb_min(least, nb_min(light[c] * s->length, NB_HUGE) * NB_F(2.0)) * g->transmittance[c]);
    }
    return bound;
}

/* What is taken for the light between two transmittances if it is known by its range alone may be off by this. */
static nb_real spread_over(const optical_range *r, nb_real drop, int c)
{
    return nb_select(r->emits, NB_HUGE, NB_F(0.5) * (r->most[c] - r->least[c]) * drop);
}

/* A crude rule in one channel: the radiance is within `off` of `middle`. */
typedef struct coarse_rule {
    nb_real middle, off;
} coarse_rule;

/* All light attenuated by something between the transmittances at both ends. */
static coarse_rule attenuated_light(const step *s, const gathered_light *g, int c)
{
    const nb_real half = NB_F(0.5) * s->sum.light[c];
    const nb_real drop = (g->transmittance[c] - s->behind[c]) + g->transmittance[c] * (NB_F(4.0) * NB_EPSILON);
    return (coarse_rule){half * (g->transmittance[c] + s->behind[c]), half * drop};
}

/* Light per extinction between that of the least and of the most radiant medium, where nothing shines without
 * absorbing. */
static coarse_rule light_between(const optical_range *r, const step *s, const gathered_light *g, int c)
{
    const nb_real drop = g->transmittance[c] * nb_medium_gather(s->sum.depth[c], s->sum.depth[c]);
    return (coarse_rule){NB_F(0.5) * (r->least[c] + r->most[c]) * drop, spread_over(r, drop, c)};
}

static void bound_crude(const optical_range *r, step *s, const gathered_light *g)
{
    s->crude_bound[0] = s->crude_bound[1] = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        s->crude_bound[0] = nb_max(s->crude_bound[0], attenuated_light(s, g, c).off);
        s->crude_bound[1] = nb_max(s->crude_bound[1], light_between(r, s, g, c).off);
    }
}

static piece_sum sum_step(const packet_state *m, nb_wide start, nb_wide end, nb_real length)
{
    piece_sum sum = no_sum();
    for (size_t i = m->present_first; i < m->present_end; i++) add_contact(&sum, present(m, i), start, end, length);
    return sum;
}

static step consider(const optical_range *r, const gathered_light *g, nb_wide start, nb_real length,
                     const piece_sum *sum)
{
    step s = {.start = start, .length = length, .sum = *sum, .drop = NB_F(0.0), .gauss_bound = NB_HUGE};
    for (int c = 0; c < 3; c++) {
        s.behind[c] = nb_exp(-(g->depth[c] + s.sum.depth[c]));
        /* their difference rounds to 0 over a sliver between two kinks, which would be halved for ever */
        s.drop = nb_max(s.drop, g->transmittance[c] * nb_medium_gather(s.sum.depth[c], s.sum.depth[c]));
    }
    bound_crude(r, &s, g);
    return s;
}

/* Profiles that are polynomials between kinks, of a degree below the number of nodes: the polynomial through their
 * values there is they. */
static int is_polynomial(const nebel_density *density)
{
    switch (density->type) {
    case NEBEL_DENSITY_CONSTANT:
    case NEBEL_DENSITY_LINEAR:
    case NEBEL_DENSITY_SOFT_EDGE:
    case NEBEL_DENSITY_GRID:
        return 1;
    case NEBEL_DENSITY_RADIAL:
        return density->power <= 2;
    default:
        return 0;
    }
}

/* A node of a step: its place, light per metre, the optical depth up to it where it is known, and the extinction of the
 * media whose optical depth is still to be had from their extinction at all nodes. */
typedef struct node {
    nb_real h, share; /* m from the start of the step, and as a part of it */
    nb_real light[3], depth[3], extinction[3];
} node;

static void add_to_node(node *n, const medium_hit *k, const step *s)
{
    const nb_real density = nb_select(k->inside, contact_density_within(k, s->start, s->length, n->share), NB_F(0.0));
    for (int c = 0; c < 3; c++) n->light[c] = n->light[c] + k->light[c] * density;
    if (is_polynomial(&k->medium->body.density)) {
        for (int c = 0; c < 3; c++) n->extinction[c] = n->extinction[c] + k->extinction[c] * density;
        return;
    }
    const nb_real before =
        nb_select(k->inside, curved_integral(k, s->start, s->start + nb_widen(n->h), n->h).value, NB_F(0.0));
    for (int c = 0; c < 3; c++) n->depth[c] = n->depth[c] + k->extinction[c] * before;
}

/* The optical depth of polynomials, exact at every node. */
static nb_real depth_of_polynomials(const node nodes[NODE_COUNT], int n, int c, nb_real length)
{
    nb_real mean = NB_F(0.0);
    for (int i = 0; i < NODE_COUNT; i++) mean = mean + nodes[i].extinction[c] * REAL(up_to_node[n][i]);
    return nb_max(mean * length, NB_F(0.0));
}

/* Six nodes with exact optical depth at each. */
static void sum_nodes(const packet_state *m, const step *s, const gathered_light *g, nb_real radiance[3])
{
    const nb_real shares[NODE_COUNT] = NODES, weights[NODE_COUNT] = WEIGHTS;
    node nodes[NODE_COUNT];
    for (int n = 0; n < NODE_COUNT; n++) {
        node sum = {.h = s->length * shares[n], .share = shares[n]};
        for (int c = 0; c < 3; c++) sum.light[c] = sum.depth[c] = sum.extinction[c] = NB_F(0.0);
        for (size_t i = m->present_first; i < m->present_end; i++) add_to_node(&sum, present(m, i), s);
        nodes[n] = sum;
    }
    for (int c = 0; c < 3; c++) {
        radiance[c] = NB_F(0.0);
        for (int n = 0; n < NODE_COUNT; n++) {
            const nb_real before = nodes[n].depth[c] + depth_of_polynomials(nodes, n, c, s->length);
            radiance[c] = radiance[c] + weights[n] * nodes[n].light[c] * nb_exp(-(g->depth[c] + before));
        }
        radiance[c] = radiance[c] * s->length;
    }
}

/* Below this the middle of a crude rule is as good as Gauss's rule in float. */
#define FINE_ENOUGH NB_F(1e-7)

/* The radiance of a step; returns the bound of its error. Gauss's rule is by far better than the proof of it: where a
 * crude rule proves more, it says between which limits the result of the nodes is taken. */
static nb_real sum_step_light(const packet_state *m, const optical_range *r, const step *s, const gathered_light *g,
                              nb_mask lanes, nb_real radiance[3])
{
    const nb_mask between_media = s->crude_bound[1] < s->crude_bound[0];
    const nb_real crude = nb_min(s->crude_bound[0], s->crude_bound[1]);
    const nb_mask proven = s->gauss_bound < crude;
    const nb_mask fine = nb_and(s->gauss_bound < NB_HUGE, nb_or(proven, crude > FINE_ENOUGH));
    nb_real by_nodes[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)}, apart = NB_F(0.0);
    if (nb_any(nb_and(lanes, fine))) sum_nodes(m, s, g, by_nodes);
    for (int c = 0; c < 3; c++) {
        const coarse_rule attenuated = attenuated_light(s, g, c), between = light_between(r, s, g, c);
        const nb_real middle = nb_select(between_media, between.middle, attenuated.middle);
        const nb_real off = nb_select(between_media, between.off, attenuated.off);
        const nb_real limited = nb_max(nb_min(by_nodes[c], middle + off), middle - off);
        radiance[c] = nb_select(fine, limited, middle);
        apart = nb_max(apart, off + nb_abs(radiance[c] - middle));
    }
    return nb_select(proven, s->gauss_bound, apart);
}

/* Adds an accepted step in `lanes`. */
static void take_step(const packet_state *m, const optical_range *r, const step *s, gathered_light *g, nb_mask lanes)
{
    nb_real radiance[3], most = NB_F(0.0);
    const nb_real bound = sum_step_light(m, r, s, g, lanes, radiance);
    for (int c = 0; c < 3; c++) {
        const nb_real light = nb_select(lanes, radiance[c], NB_F(0.0));
        const nb_real rounding = s->sum.light_error[c] * g->transmittance[c] * nb_exp_ratio(s->sum.depth[c]);
        g->radiance[c] = g->radiance[c] + light;
        most = nb_max(most, rounding + light * attenuation_error(g, &s->sum, c) + g->radiance[c] * NB_EPSILON);
        g->depth[c] = g->depth[c] + nb_select(lanes, s->sum.depth[c], NB_F(0.0));
        g->transmittance[c] = nb_select(lanes, s->behind[c], g->transmittance[c]);
        const nb_real depth_rounding = s->sum.depth_error[c] + g->depth[c] * (NB_F(2.0) * NB_EPSILON);
        g->depth_error[c] = g->depth_error[c] + nb_select(lanes, depth_rounding, NB_F(0.0));
    }
    g->radiance_error = g->radiance_error + nb_select(lanes, most + bound, NB_F(0.0));
}

/* What the whole march may spend, and how it is shared out: by the loss of transmittance, by length, and a little for
 * each piece's last step, so that a vanishing tail is not halved for ever. */
typedef struct allowance {
    int transmittance_only; /* nothing to spend it on */
    nb_real drop_share, length_share, last_share;
    nb_real ellipse;
} allowance;

static nb_wide nearest_kink(const packet_state *m, nb_wide t, nb_wide end)
{
    nb_wide nearest = end;
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_wide kink = contact_kink(k, t);
        nearest = nb_wselect(nb_wand(nb_widen_mask(k->inside), kink < nearest), kink, nearest);
    }
    return nearest;
}

/* Where a step of `length` from t ends that may go as far as `stop`. */
static nb_wide end_of_step(nb_wide t, nb_real length, nb_wide stop)
{
    return nb_wselect(nb_widen_mask(length >= nb_narrow(stop - t)), stop, t + nb_widen(length));
}

/* What the walk through a piece keeps from step to step. It adapts from where a step has not fit that was as long as it
 * can be. */
typedef struct step_control {
    nb_mask adapts;
    nb_real length; /* of the next step, unless a kink or the end is nearer */
    nb_real reach;
} step_control;

/* How far the integrand hardly grows, to start the search for the best ellipse with. */
static nb_real first_reach(const packet_state *m, nb_wide t)
{
    nb_real growth = NB_F(0.0);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        nb_real here = largest(k->extinction) * contact_density(k, t);
        if (k->medium->body.density.type != NEBEL_DENSITY_CONSTANT) here = here + nb_abs(nb_narrow(k->slope.x));
        growth = growth + nb_select(k->inside, here, NB_F(0.0));
    }
    return nb_min(NB_F(48.0) / nb_max(growth, NB_TINY), NB_FAR);
}

/* The bound of a step; where the pace adapts with the better of two ellipses, towards which the reach moves. */
static nb_real try_ellipses(const packet_state *m, const step *s, const gathered_light *g, const allowance *may,
                            const step_control *now, nb_real *reach)
{
    const nb_real first = nb_select(now->adapts, ellipse_of(now->reach, s->length), may->ellipse);
    const nb_real wide = bound_gauss(m, s, g, first);
    *reach = now->reach;
    if (!nb_any(now->adapts)) return wide;
    const nb_real slim = bound_gauss(m, s, g, ellipse_of(NB_F(0.5) * now->reach, s->length));
    *reach = nb_select(wide < slim, nb_min(NB_F(1.5) * now->reach, NB_FAR), *reach);
    *reach = nb_select(slim < wide, NB_F(0.75) * now->reach, *reach);
    /* Neither is better: both ellipses are the least one, or beyond all numbers. */
    const nb_mask alike = nb_not(nb_or(wide < slim, slim < wide));
    const nb_real otherwise =
        nb_select(now->reach > NB_F(2.0) * s->length, NB_F(0.75) * now->reach, NB_F(4.0) * s->length);
    *reach = nb_select(alike, otherwise, *reach);
    return nb_select(now->adapts, nb_min(wide, slim), wide);
}

/* By what factor to change a step whose bound is `bound` where `allowed` was: with its ellipse kept, bounds go with the
 * 2 NODE_COUNT + 1st power of the length, and what is allowed with the length. */
static nb_real change_of_length(nb_real allowed, nb_real bound)
{
    const nb_real quotient = nb_min(nb_max(allowed / nb_max(bound, NB_TINY), NB_TINY), NB_HUGE);
    return NB_F(0.9) * nb_exp(nb_log(quotient) * NB_F(0.083333333333333333));
}

/* After a step of `length` that does not fit. */
static void slow_down(const packet_state *m, nb_wide t, nb_real length, nb_mask lanes, nb_real change, nb_real reach,
                      step_control *now)
{
    const nb_mask begins = nb_and(lanes, nb_not(now->adapts));
    const nb_real shorter = length * nb_min(change, NB_F(0.75));
    now->length = nb_select(lanes, shorter, now->length);
    now->reach = nb_select(lanes, reach, now->reach);
    if (!nb_any(begins)) return;
    const nb_real first = first_reach(m, t);
    now->length = nb_select(begins, nb_min(shorter, first), now->length);
    now->reach = nb_select(begins, first, now->reach);
    now->adapts = nb_or(now->adapts, lanes);
}

/* The bounds of the crude rules are nearly reached, that of Gauss's never is. */
#define CRUDE_WEIGHT NB_F(32.0)

/* Shortens the step in every lane until its bound fits. `whole` is the sum of the piece. */
static step fit_step(const packet_state *m, const gathered_light *g, const allowance *may, const ray_segment *p,
                     const optical_range *r, nb_wide start, nb_wide stop, nb_mask pending, step_control *now,
                     const piece_sum *whole)
{
    const nb_real longest = nb_narrow(stop - start);
    for (;;) {
        const nb_real length = nb_min(now->length, longest);
        const int is_whole = nb_wall(start == p->start) && nb_all(length == p->length);
        const piece_sum sum = is_whole ? *whole : sum_step(m, start, end_of_step(start, length, stop), length);
        step s = consider(r, g, start, length, &sum);
        nb_real reach;
        s.gauss_bound = try_ellipses(m, &s, g, may, now, &reach);
        const nb_mask last = length >= nb_narrow(p->end - start);
        const nb_real allowed = may->drop_share * s.drop + may->length_share * (length / p->length) +
                                nb_select(last, may->last_share, NB_F(0.0));
        const nb_real bound = nb_min(s.gauss_bound, CRUDE_WEIGHT * nb_min(s.crude_bound[0], s.crude_bound[1]));
        pending = nb_and(pending, bound > allowed);
        if (nb_any(pending)) {
            slow_down(m, start, length, pending, change_of_length(allowed, bound), reach, now);
            continue;
        }
        if (!nb_any(now->adapts)) return s;
        const nb_real longer = nb_max(length * change_of_length(allowed, bound), now->length);
        now->length = nb_select(now->adapts, longer, now->length);
        now->reach = nb_select(now->adapts, reach, now->reach);
        return s;
    }
}

/* Lanes in which the rest of the piece, up to the optical depth `depth`, may be one crude step. */
static nb_mask rest_fits(const optical_range *r, const gathered_light *g, const nb_real depth[3], const allowance *may)
{
    nb_real most = NB_F(0.0);
    for (int c = 0; c < 3; c++) most = nb_max(most, spread_over(r, g->transmittance[c] - nb_exp(-depth[c]), c));
    return CRUDE_WEIGHT * most <= may->last_share;
}

/* Integrates a piece in its mixed lanes; depth and transmittance of *g are used up on the way. As soon as the rest of
 * the piece matters little it is one crude step, across whatever kinks are left. So is what steps that never fit leave
 * (their number is bounded), whose honest bound the error then shows. */
static void gather_mixed(const packet_state *m, const ray_segment *p, const piece_sum *whole, nb_mask lanes,
                         const allowance *may, gathered_light *g)
{
    const optical_range r = find_range(m);
    nb_real depth[3];
    for (int c = 0; c < 3; c++) depth[c] = g->depth[c] + whole->depth[c];
    nb_wide t = p->start;
    step_control now = {nb_mask_false, p->length, p->length};
    for (int i = 0; i < MOST_STEPS; i++) {
        nb_mask going = lanes;
        if (nb_any(now.adapts)) going = nb_and(lanes, nb_not(nb_and(now.adapts, rest_fits(&r, g, depth, may))));
        if (!nb_any(going)) break;
        const nb_wide stop = nearest_kink(m, t, p->end);
        const step s = fit_step(m, g, may, p, &r, t, stop, going, &now, whole);
        take_step(m, &r, &s, g, going);
        t = nb_wselect(nb_widen_mask(going), end_of_step(t, s.length, stop), t);
        lanes = nb_and(lanes, nb_narrow_mask(t < p->end));
    }
    if (!nb_any(lanes)) return;
    const nb_real rest = nb_narrow(p->end - t);
    const piece_sum sum = sum_step(m, t, p->end, rest);
    const step s = consider(&r, g, t, rest, &sum);
    take_step(m, &r, &s, g, lanes);
}
