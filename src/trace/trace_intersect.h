/* Meeting the fog: which media any ray of a packet meets, the intervals of all their leaves, and what the ends that may
 * be off can do. Included by trace_kernel.c after trace_packet.h. */

static nb_real end_altitude_density(const medium_hit *k, nb_wide t, nb_real slack)
{
    const nb_real u = altitude_coordinate(k, t);
    const nb_real reach = nb_narrow(k->slope.x) * slack + k->noise + nb_abs(u) * (NB_F(4.0) * NB_EPSILON);
    return density_of_height(&k->medium->body.density, u - reach);
}

/* How dense a medium may be within slack of t, for what an uncertain end there may do. */
static nb_real end_density(const medium_hit *k, nb_wide t, nb_real slack)
{
    const nebel_density *density = &k->medium->body.density;
    if (density->type == NEBEL_DENSITY_ALTITUDE) return end_altitude_density(k, t, slack);
    const nb_wide rounding = (nb_wabs(k->offset.x) + nb_wabs(k->slope.x * t)) * (NB_W(4.0) * NB_WEPSILON);
    const nb_real u = coordinate(k, t);
    const nb_real reach =
        nb_abs(nb_narrow(k->slope.x)) * slack + nb_narrow(rounding) + nb_abs(u) * (NB_F(4.0) * NB_EPSILON);
    const nb_real nearest = nb_max(nb_abs(u) - reach, NB_F(0.0));
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        return density_of_height(density, u - reach);
    case NEBEL_DENSITY_LINEAR:
        return nb_linear_density(u + reach + k->noise + k->drift * nb_narrow(t));
    case NEBEL_DENSITY_GAUSSIAN:
        return nb_gaussian_density(k->level * (NB_F(1.0) - NB_F(4.0) * NB_EPSILON), nearest);
    case NEBEL_DENSITY_RADIAL:
        return nb_min(nb_radial_density(k->level, nearest, density->power) + k->noise, NB_F(1.0));
    case NEBEL_DENSITY_SOFT_EDGE:
        return nb_min(soft_edge_density(k, t) + soft_edge_rise(k, slack) + soft_edge_noise(k, t), NB_F(1.0));
    case NEBEL_DENSITY_GRID:
        return REAL(nb_grid_peak(density->grid));
    default:
        return NB_F(1.0);
    }
}

static interval_ends no_ends(void)
{
    const nb_real zero = NB_F(0.0);
    return (interval_ends){{zero, zero, zero}, {zero, zero, zero}};
}

static void add_end_of(interval_ends *sum, const medium_hit *k, nb_wide t, nb_real slack)
{
    const nb_real weight = slack * end_density(k, t, slack);
    for (int c = 0; c < 3; c++) {
        sum->depth[c] = sum->depth[c] + weight * k->extinction[c];
        const nb_real seen =
            nb_min(weight, nb_rcp_bounded(k->extinction[c])); /* no more than what it lets through itself */
        sum->light[c] = sum->light[c] + seen * (k->light[c] + k->glow[c] + k->extinction[c] * k->point_lights);
    }
}

/* Whether the ray is in a medium's hull within slack of t. */
static nb_mask is_hull_near(const medium_hit *k, nb_wide t, nb_wide slack)
{
    const nb_wmask near = nb_wand(t + slack >= k->hull_enter, t - slack <= k->hull_leave);
    return nb_narrow_mask(nb_wand(near, k->hull_enter < k->hull_leave));
}

/* An end of a leaf may be off by slack. The end of a medium that covers moves the fog of every medium of a lower rank
 * that is there, too; those were met before, as ranks ascend. */
static void add_end(const packet_state *m, interval_ends *sum, const medium_hit *k, nb_wide t, nb_real slack)
{
    if (nb_volume_has_fog(&k->medium->body)) add_end_of(sum, k, t, slack);
    if (!nb_volume_covers(&k->medium->body)) return;
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *other = &m->contacts[i];
        if (other->medium->body.rank >= k->medium->body.rank) break;
        if (!nb_volume_has_fog(&other->medium->body)) continue;
        add_end_of(sum, other, t, nb_select(is_hull_near(other, t, nb_widen(slack)), slack, NB_F(0.0)));
    }
}

/* The part of the rays on which a medium acts. */
typedef struct packet_part {
    nb_wide enter, leave;
} packet_part;

static packet_part part_of_rays(const packet_state *m, const nb_volume *body)
{
    if (m->ignores_distances) return (packet_part){NB_W(0.0), m->rays.t_max};
    return (packet_part){WIDE(body->start), nb_wmin(m->rays.t_max, WIDE(body->cutoff))};
}

/* The bounds from the rays' origins; NB_WFAR stands for endless, as arithmetic with infinity is slow. */
static nb_wvec3 bound_from(const packet *rays, const double bound[3])
{
    const nb_wvec3 finite = nb_wvec3(WIDE(fmin(fmax(bound[0], -1e18), 1e18)), WIDE(fmin(fmax(bound[1], -1e18), 1e18)),
                                     WIDE(fmin(fmax(bound[2], -1e18), 1e18)));
    return nb_wsub3(finite, rays->origin);
}

/* How far a bound is along any axis, where it is an end. */
static nb_wide reach_of_bound(nb_wvec3 bound)
{
    const nb_wide endless = NB_W(0.5) * NB_WFAR;
    const nb_wide x = nb_wabs(bound.x), y = nb_wabs(bound.y), z = nb_wabs(bound.z);
    const nb_wide across = nb_wmax(nb_wselect(x < endless, x, NB_W(0.0)), nb_wselect(y < endless, y, NB_W(0.0)));
    return nb_wmax(across, nb_wselect(z < endless, z, NB_W(0.0)));
}

/* Where lanes can meet a body, by its bounds, with a margin for rounding within that of the tree. What a leaf does
 * outside them must not count: bits would depend on whether a lane's company brought the body here. */
static packet_part part_in_bounds(const packet *rays, const nb_volume *body, const packet_part *acts)
{
    const nb_wvec3 low = bound_from(rays, body->low), high = bound_from(rays, body->high);
    const nb_wide margin = nb_wmax(reach_of_bound(low), reach_of_bound(high)) * (NB_W(8.0) * NB_WEPSILON);
    const nb_wvec3 widened = nb_wvec3(margin, margin, margin), here = nb_wvec3(NB_W(0.0), NB_W(0.0), NB_W(0.0));
    const nb_interval span =
        nb_interval_box(here, rays->direction, nb_wsub3(low, widened), nb_wadd3(high, widened), NB_W(0.0));
    return (packet_part){nb_wmax(span.enter, acts->enter), nb_wmin(span.leave, acts->leave)};
}

/* Where an end counts: on the ray. */
static nb_wide place_on_ray(const packet_state *m, nb_wide end)
{
    return nb_wclamp(end, NB_W(0.0), m->rays.t_max);
}

/* How far an end with slack may be from its place, where it is within the bounds: at least that. */
static nb_real slack_within(nb_wide place, nb_wide end, nb_wide slack, const packet_part *bounds, nb_wmask counts)
{
    const nb_wide first = end - slack, last = end + slack;
    const nb_wmask reaches = nb_wand(nb_wand(first <= bounds->leave, last >= bounds->enter), slack > NB_W(0.0));
    const nb_wide before = place - nb_wclamp(first, bounds->enter, bounds->leave);
    const nb_wide behind = nb_wclamp(last, bounds->enter, bounds->leave) - place;
    const nb_wide most = nb_wmax(nb_wmax(before, behind), NB_W(0.0));
    const nb_real rounded_up = nb_narrow(most) * (NB_F(1.0) + NB_F(4.0) * NB_EPSILON);
    return nb_select(nb_narrow_mask(nb_wand(counts, reaches)), rounded_up, NB_F(0.0));
}

/* Slack that changes the light by less than this is left out, and counted once for all in bound_error. */
#define LEAST_DOUBT (NB_F(0.015625) * NB_EPSILON)

/* The slack of an end where it may matter: nearly never in float, whose ends are doubles. */
static nb_wide slack_that_matters(const medium_hit *k, nb_wide slack)
{
    if (grows_without_bound(&k->medium->body.density)) return slack;
    const nb_wide least = nb_widen(LEAST_DOUBT) * WIDE(nb_volume_covers(&k->medium->body) ? 0 : k->least_slack);
    return nb_wselect(slack < least, NB_W(0.0), slack);
}

/* Clips a leaf's interval to where the medium acts. Ends have slack as far as they may move where the ray and the body
 * are. A leaf of several does not split the ray outside the body's bounds. */
static leaf_span clip_interval(const packet_state *m, const medium_hit *k, const nb_interval *raw,
                               const packet_part *acts, const packet_part *bounds)
{
    const nb_wide first = slack_that_matters(k, raw->enter_slack), last = slack_that_matters(k, raw->leave_slack);
    const nb_wmask some = raw->enter - first <= raw->leave + last;
    const nb_wmask counts = nb_wand(some, bounds->enter < bounds->leave);
    leaf_span span = {nb_wmax(raw->enter, acts->enter), nb_wselect(counts, nb_wmin(raw->leave, acts->leave), NB_W(0.0)),
                      NB_F(0.0), NB_F(0.0)};
    if (!nb_wany(first + last > NB_W(0.0))) return span;
    packet_part within = *bounds;
#if !defined(NB_DOUBLE) /* double has no company */
    if (k->medium->body.leaf_count == 1) within = part_in_bounds(&m->rays, &k->medium->body, acts);
#endif
    const nb_wmask met = span.enter < span.leave; /* what is met has ends, whatever the bounds say */
    within.enter = nb_wselect(met, nb_wmin(within.enter, span.enter), within.enter);
    within.leave = nb_wselect(met, nb_wmax(within.leave, span.leave), within.leave);
    const nb_wmask near = nb_wand(some, within.enter < within.leave);
    span.enter_slack = slack_within(place_on_ray(m, span.enter), raw->enter, first, &within, near);
    span.leave_slack = slack_within(place_on_ray(m, span.leave), raw->leave, last, &within, near);
    return span;
}

static nb_real per_extinction(const medium_hit *k, int c, nb_real light)
{
    return nb_select(k->extinction[c] > NB_F(0.0), light / nb_max(k->extinction[c], NB_TINY), light * NB_HUGE);
}

/* Light per extinction of a medium: the radiance it has where it is opaque, in full sunlight and without any; that of
 * point lights at most. */
static nb_real opaque_radiance(const medium_hit *k, int c)
{
    return per_extinction(k, c, k->light[c] + k->glow[c]) + k->point_lights;
}

static nb_real shaded_radiance(const medium_hit *k, int c)
{
    return per_extinction(k, c, k->light[c]);
}

/* Up to this optical depth what an end may do is as good as proportional to its slack. */
#define LARGEST_DOUBT NB_F(0.0009765625)

static void count_end(packet_state *m, const medium_hit *k, nb_wide end, nb_real slack, nb_mask grazes)
{
    if (!nb_any(slack > NB_F(0.0))) return;
    const nb_wide place = place_on_ray(m, end);
    const int has_fog = nb_volume_has_fog(&k->medium->body), covers = nb_volume_covers(&k->medium->body);
    interval_ends may = no_ends();
    add_end(m, &may, k, place, slack);
    nb_mask large = nb_mask_false;
    for (int c = 0; c < 3; c++) {
        const nb_real depth = nb_select(grazes, may.depth[c], NB_F(0.0));
        m->all_ends.depth[c] = m->all_ends.depth[c] + may.depth[c];
        m->all_ends.light[c] = m->all_ends.light[c] + may.light[c];
        m->grazing_ends.depth[c] = m->grazing_ends.depth[c] + depth;
        m->grazing_ends.light[c] = m->grazing_ends.light[c] + nb_select(grazes, may.light[c], NB_F(0.0));
        if (covers) m->revealed[c] = m->revealed[c] + depth;
        const nb_real radiance = nb_select(slack > NB_F(0.0), has_fog ? opaque_radiance(k, c) : NB_F(0.0), NB_F(0.0));
        m->doubtful_radiance[c] = nb_max(m->doubtful_radiance[c], radiance);
        large = nb_or(large, may.depth[c] > LARGEST_DOUBT);
    }
    const nb_wide from = nb_wmin(place - nb_widen(slack), m->doubt_from);
    m->doubt_from = nb_wselect(nb_widen_mask(large), from, m->doubt_from);
}

static void count_ends(packet_state *m, const medium_hit *k, const leaf_span *span)
{
    if (!nb_any(span->enter_slack + span->leave_slack > NB_F(0.0))) return;
    const nb_mask grazes = nb_narrow_mask(span->enter >= span->leave);
    count_end(m, k, span->enter, span->enter_slack, grazes);
    count_end(m, k, span->leave, span->leave_slack, grazes);
}

/* Intervals of all leaves of one medium. Returns whether any lane is inside any of them. */
static int meet_leaves(packet_state *m, medium_hit *k)
{
    const nb_volume *body = &k->medium->body;
    const packet_part acts = part_of_rays(m, body);
    const packet_part bounds = body->leaf_count == 1 ? acts : part_in_bounds(&m->rays, body, &acts);
    int hit = 0;
    k->hull_enter = NB_WFAR;
    k->hull_leave = NB_W(0.0);
    for (size_t i = 0; i < body->leaf_count; i++) {
        const nb_interval raw = leaf_interval(&m->rays, body, &body->leaves[i]);
        const leaf_span span = clip_interval(m, k, &raw, &acts, &bounds);
        const nb_wmask met = span.enter < span.leave;
        count_ends(m, k, &span);
        m->spans[k->first_span + i] = span;
        m->event_count = m->event_count + nb_select(nb_narrow_mask(met), NB_F(2.0), NB_F(0.0));
        k->hull_enter = nb_wselect(met, nb_wmin(span.enter, k->hull_enter), k->hull_enter);
        k->hull_leave = nb_wselect(met, nb_wmax(span.leave, k->hull_leave), k->hull_leave);
        hit = hit || nb_wany(met);
    }
    return hit;
}

#if defined(ASKS_QUAD)
/* What the noise of a ray's lean does to the integral of a density that follows planes, over h metres from start. */
static nb_real drift_within(const medium_hit *k, nb_wide start, nb_real h)
{
    const nb_volume *body = &k->medium->body;
    if (body->density.type == NEBEL_DENSITY_LINEAR) return blur_linear(nb_estimate_of(h, NB_F(0.0)), k, start, h).error;
    if (body->density.type != NEBEL_DENSITY_SOFT_EDGE || body->leaves[0].type != NB_LEAF_PLANES) return NB_F(0.0);
    const nb_estimate edge = planes_edge_integral(k, start, h);
    return nb_max(edge.error - edge.value * (NB_F(17.0) * NB_EPSILON), NB_F(0.0));
}

static void count_drift(packet_state *m, const medium_hit *k)
{
    const nb_real length = nb_narrow(nb_wmax(k->hull_leave - k->hull_enter, NB_W(0.0)));
    const nb_real blurred = drift_within(k, k->hull_enter, length);
    for (int c = 0; c < 3; c++) m->drift = m->drift + blurred * (k->extinction[c] + k->light[c]);
}
#endif

/* Skies are looked up one lane after the other, in double, so that lanes agree with rays alone. */
static void look_at_sky(packet_state *m, const nb_environment_light *sky)
{
    double direction[3][NB_WIDTH];
    nb_scalar light[3][NB_WIDTH];
    nb_wstore_lanes(direction[0], m->rays.direction.x);
    nb_wstore_lanes(direction[1], m->rays.direction.y);
    nb_wstore_lanes(direction[2], m->rays.direction.z);
    for (size_t i = 0; i < NB_WIDTH; i++) {
        double radiance[3];
        nb_environment_scattered(sky, (const double[3]){direction[0][i], direction[1][i], direction[2][i]}, radiance);
        for (int c = 0; c < 3; c++) light[c][i] = (nb_scalar)radiance[c];
    }
    for (int c = 0; c < 3; c++) m->sky_light[c] = nb_load_lanes(light[c]);
    m->sky = sky;
}

static void set_skylight(packet_state *m, medium_hit *k)
{
    const nb_volume *body = &k->medium->body;
    if (m->sky != k->lit->environment) look_at_sky(m, k->lit->environment);
    for (int c = 0; c < 3; c++) {
        k->radiance[c] = REAL(body->albedo[c]) * m->sky_light[c];
        k->light[c] = k->radiance[c] * k->extinction[c] + REAL(body->emission[c]);
    }
}

struct sunlight;
static void set_glow(medium_hit *k, const packet *rays, const struct sunlight *sun);
static double most_scattered(const nb_volume *body);

/* Adds a medium to the march when any ray meets it. */
static void meet_medium(packet_state *m, const nb_medium *medium, const nb_medium_light *lit)
{
    medium_hit *k = &m->contacts[m->contact_count];
    k->medium = medium;
    k->lit = lit;
    k->first_span = m->span_count;
    k->noise = NB_F(0.0);
    k->steepest = 0;
    for (int c = 0; c < 3; c++) {
        k->extinction[c] = REAL(medium->body.extinction[c]);
        k->light[c] = REAL(lit->light[c]);
        k->radiance[c] = REAL(lit->radiance[c]);
        k->glow[c] = NB_F(0.0);
    }
    if (lit->environment != NULL && m->wants_sky) set_skylight(m, k);
    k->point_lights = NB_F(0.0);
    if (m->sun != NULL && lit->scatters_sun) set_glow(k, &m->rays, m->sun);
    if (m->sun != NULL && lit->scatters_lights) k->point_lights = m->point_lights * REAL(most_scattered(&medium->body));
    k->least_slack = 1 / fmax(medium->densest + lit->brightest, 1e-9);
    if (nb_volume_has_fog(&medium->body)) profile_contact(k, &m->rays);
    if (!meet_leaves(m, k)) return;
#if defined(ASKS_QUAD)
    if (nb_volume_has_fog(&medium->body)) count_drift(m, k);
#endif
    m->contact_count++;
    m->span_count += medium->body.leaf_count;
}
