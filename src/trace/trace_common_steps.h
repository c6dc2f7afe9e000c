/* Sunlight and light of point lights in media that lie over each other and shade each other: those of which depths add,
 * many bodies, or in float voxels and any others.
 *
 * From piece to piece, as trace_sun.h and trace_point_light.h go, the cost is quadratic in the bodies: each has two ends and two turns on the ray, and
 * after each of them places are asked for the depth to the light, of all bodies. Here steps know nothing of ends. In
 *
 *     sum over bodies of the integral of glow density(t) seen(t),    seen = fluence e^-(depth(t) + depth to the light(t)),
 *
 * `seen` is continuous, as all its depths are, and a density that begins or ends has an integral in closed form. So a step
 * takes `seen` at five places, and between three of them the parabola through it, of which a body needs the integral of its
 * density and its first two moments: nothing but sums over bodies. The error that is told is by how much the parabola through
 * the first, third and fifth place misses the others, and what bodies may do that are too small to be seen from place to place.
 *
 * Voxels have their moments by one walk, exactly (trace_voxels.h). Their depth to the light is as rough as they are, so that
 * places may show less than there is: what they tell counts several times (STEP_CAUTION), more where no longer step was tried,
 * and no less than a sixteenth of what was told of the step that was halved.
 *
 * Included by trace_kernel.c after trace_point_light.h. */

/* What part of the error all steps together may be off by is left to what lies beyond the last. */
#define TAIL_SHARE 0.01

/* And to steps in which shadows begin or end: light may jump there, and what a step misses is no less for each metre
 * however short it is. Each shadow does so twice. */
#define EDGE_SHARE 0.02

/* More steps of bodies over each other than of one: around each edge of a shadow they are halved. */
#define MAX_OVERLAP_STEPS (16 * MOST_SUN_STEPS)

/* What a root that begins within a step is off by, more or less. */
#define EDGE_ERROR NB_F(0.02)

/* By what part of a body's stretch its mean place may be off where its density is taken for linear, and its integral by all
 * of itself. */
#define MOMENT_ERROR 0.25

#include "trace_lit_shadow.h"

/* ---- places ---------------------------------------------------------------------------------- */

/* A place on each ray: optical depth up to it, and what light comes from it to the eye where it is scattered alike from everywhere. */
typedef struct lit_point {
    nb_wide t;
    nb_real depth[3], depth_error[3];
    nb_real behind[3];          /* e^-depth */
    nb_real way[3];             /* optical depth from there to the light, */
    nb_real comes[3];           /* through which this comes */
    nb_real before[3], here[3]; /* see shadowed_way; no way between the place before and this is less deep than both */
    nb_real arrives;            /* what comes through no fog, of intensity 1 */
    nb_real cut, cut_depth;     /* see lit_between: of those between the place before and this */
    nb_real seen[3];
    nb_real doubt;    /* by what factor that may be off, where it is less */
    nb_real more[3];  /* what more may be seen, of intensity 1, where depths may be less by much; else 0 */
    nb_mask has_edge; /* a shadow begins or ends between the place before and this */
} lit_point;

/* Where a ray starts, with no light. */
static lit_point no_place(void)
{
    const nb_real zero = NB_F(0.0);
    lit_point place = {
        .t = NB_W(0.0), .arrives = zero, .cut = zero, .cut_depth = zero, .doubt = zero, .has_edge = nb_mask_false};
    for (int c = 0; c < 3; c++) {
        place.depth[c] = place.depth_error[c] = place.behind[c] = zero;
        place.way[c] = place.comes[c] = place.seen[c] = place.before[c] = place.here[c] = place.more[c] = zero;
    }
    return place;
}

static nb_wvec3 apart_from_light(const packet_state *m, const light_pass *pass, nb_wide t)
{
    return nb_wadd3(pass->foot, nb_wscale3(m->rays.direction, t - pass->closest));
}

/* What a point light brings to t, and from where; how far it is. Light jumps at the edge of a hard cone, where steps
 * begin and end: whether t is in the cone is asked at `beside`, within the step. */
static nb_real light_arrives(const packet_state *m, const light_pass *pass, const nb_phase *phase, nb_wide t,
                             nb_wide beside, nb_wvec3 *towards, nb_wide *reach)
{
    const nb_light *point_light = pass->point_light;
    const nb_wvec3 apart = apart_from_light(m, pass, t);
    const nb_wide square = nb_wdot3(apart, apart), distance = nb_wsqrt(square);
    *towards = nb_wscale3(apart, -nb_wrcp_bounded(distance));
    *reach = nb_wmax(distance - WIDE(point_light->clear), NB_W(0.0));
    const nb_real fluence = nb_narrow(nb_light_fluence(square, WIDE(point_light->radius2)));
    const nb_real light = fluence * scattered(phase, nb_turn_between(m->rays.direction, *towards));
    if (!point_light->is_spot) return light;
    const nb_wvec3 from = apart_from_light(m, pass, beside);
    return light * part_in_cone(point_light, nb_wscale3(from, -nb_wrcp_bounded(nb_wsqrt(nb_wdot3(from, from)))));
}

/* The light that is scattered: of the sun where `pass` is NULL. */
typedef struct overlap_light {
    const light_pass *pass;
    const nb_phase *phase; /* of a point light: only media with this one scatter it */
    size_t phase_number;
    nb_real most; /* radiance of fog that is opaque, at most */
    double share; /* what its steps may add to the error */
} overlap_light;

/* What is seen of a place that has its depths and what arrives there. */
static void set_seen(const sunlight *sun, const overlap_light *light, lit_point *at)
{
    nb_real through[3];
    map_channels(sun->snapshot, transmitted, at->way, through);
    for (int c = 0; c < 3; c++) {
        const double intensity = light->pass != NULL ? light->pass->point_light->intensity[c] : 1;
        at->comes[c] = through[c] * at->arrives * REAL(intensity);
        at->seen[c] = at->behind[c] * at->comes[c];
    }
}

/* What more comes through a depth that may be so much less, where that is no small part of the light, which may round to 0. */
static nb_real more_without(nb_real depth, nb_real less, nb_real arriving)
{
    const nb_mask much = less > NB_F(0.01);
    if (!nb_any(much)) return NB_F(0.0);
    return nb_select(much, arriving * (nb_exp(less - depth) - nb_exp(-depth)), NB_F(0.0));
}

/* `beside`: see light_arrives. */
static void look_from(const sunlight *sun, const packet_state *m, const overlap_light *light, const lit_point *before,
                      nb_wide beside, lit_point *at)
{
    nb_wvec3 towards = sun->direction;
    nb_wide reach = NB_WFAR;
    nb_real arriving = NB_F(1.0);
    if (light->pass != NULL) arriving = light_arrives(m, light->pass, light->phase, at->t, beside, &towards, &reach);
    const known_depths known = {sun, light->pass != NULL ? light->pass->point_light : NULL};
    const shadowed_way all = way_through_shadows(&known, m, before->t, at->t, towards, reach);
    const light_depth way = all.depth;
    at->doubt = NB_F(0.0);
    at->arrives = arriving;
    at->has_edge = nb_mask_false;
    for (int c = 0; c < 3; c++) {
        const nb_real edges = before->way[c] + way.depth[c] - (all.before[c] + all.here[c]);
        at->has_edge = nb_or(at->has_edge, edges > (before->way[c] + way.depth[c]) * (NB_F(1024.0) * NB_EPSILON));
        at->way[c] = way.depth[c];
        at->before[c] = all.before[c];
        at->here[c] = all.here[c];
        const nb_real rounding = (at->depth[c] + way.depth[c] + NB_F(32.0)) * (NB_F(2.0) * NB_EPSILON);
        const nb_real less = nb_min(at->depth_error[c], at->depth[c]) + nb_min(way.error[c], way.depth[c]);
        at->doubt = nb_max(at->doubt, nb_min(at->depth_error[c] + way.error[c], NB_F(1.0)) + rounding);
        at->more[c] = more_without(at->depth[c] + way.depth[c], less, arriving);
    }
    map_channels(sun->snapshot, transmitted, at->depth, at->behind);
    set_seen(sun, light, at);
}

/* ---- what bodies scatter between places ------------------------------------------------------ */

/* Half a step: glow times the density's integral, and its moments over places from 0 to 2. */
typedef struct lit_half {
    nb_real sum[3], first[3], second[3];
    nb_real doubt
        [3]; /* by how much the first moment may be off through densities that are not linear, or half the second */
} lit_half;

static int is_lit_by(const medium_hit *k, const overlap_light *light)
{
    if (light->pass == NULL) return k->lit->scatters_sun;
    return k->lit->scatters_lights && k->lit->phase == light->phase_number;
}

/* Of the sun its radiance per metre; of a point light what scatters. */
static nb_real glow_in(const medium_hit *k, const overlap_light *light, int c)
{
    if (light->pass == NULL) return k->glow[c];
    return is_lit_by(k, light) ? k->extinction[c] * REAL(k->medium->body.albedo[c]) : NB_F(0.0);
}

/* Of a body between two places: its density's integral and moments, and by how much the first of these may be off, or half
 * the second. */
typedef struct part_moments {
    density_moments of;
    nb_real doubt;
} part_moments;

/* Of a part that has the places from s on, h metres of them at `rate` a metre. Densities are taken as linear from end to
 * end of it: what that misses is in the moments alone. Voxels have theirs. */
static part_moments moments_of_part(const medium_hit *k, nb_wide enter, nb_wide leave, nb_mask some, nb_real s,
                                    nb_real h, nb_real rate)
{
    const nebel_density_type type = k->medium->body.density.type;
#if !defined(NB_DOUBLE)
    if (type == NEBEL_DENSITY_GRID) return (part_moments){voxels_moments(k, enter, leave, some, s, rate), NB_F(0.0)};
#else
    (void)some;
#endif
    const nb_estimate along = contact_integral(k, enter, leave, h);
    const nb_real l = h * rate;
    nb_real last = NB_F(0.5), doubt = NB_F(0.0);
    if (type != NEBEL_DENSITY_CONSTANT) {
        const nb_real a = contact_density(k, enter), b = contact_density(k, leave);
        const nb_real bent = nb_abs(along.value - NB_F(0.5) * h * (a + b)) / nb_max(along.value, NB_TINY);
        last = nb_select(a + b > NB_TINY, b / nb_max(a + b, NB_TINY), last);
        doubt = along.value * (nb_min(bent, NB_F(1.0)) * l * REAL(MOMENT_ERROR));
    }
    const nb_real mean = (NB_F(1.0) + last) * REAL(1.0 / 3), square = (NB_F(1.0) + last + last) * REAL(1.0 / 6);
    const nb_real first = s + l * mean, second = s * (s + NB_F(2.0) * l * mean) + l * l * square;
    return (part_moments){{along, along.value * first, along.value * second}, doubt};
}

/* What bodies add between two places: optical depth and its error, how many depths are summed, light that is not seen from
 * places, and by how much light is off, per optical depth, of bodies that end there together with shadows. What is
 * not seen is as much as it would be if all were. */
typedef struct lit_between {
    nb_real depth[3], error[3], terms, unresolved, cut, cut_depth;
} lit_between;

static lit_between nothing_between(void)
{
    const nb_real zero = NB_F(0.0);
    lit_between none = {.terms = NB_F(2.0), .unresolved = zero, .cut = zero, .cut_depth = zero};
    for (int c = 0; c < 3; c++) none.depth[c] = none.error[c] = zero;
    return none;
}

/* Adds what a body gives from `from` to `to`, which has the places from `place` to place + 1 of its half. */
static void add_part(const medium_hit *k, const leaf_span *span, const overlap_light *light, nb_wide from, nb_wide to,
                     int place, nb_real quarter, lit_half *half, lit_between *sum)
{
    const nb_real zero = NB_F(0.0);
    const nb_wide enter = nb_wmin(nb_wmax(span->enter, from), to);
    const nb_wide leave = nb_wmax(nb_wmin(span->leave, to), enter);
    const nb_mask some = nb_narrow_mask(enter < leave);
    if (!nb_any(some)) return;
    const nb_real h = nb_narrow(leave - enter), scale = nb_rcp_bounded(quarter);
    const nb_real from_start = nb_narrow(enter - from) * scale + REAL(place);
    const part_moments part = moments_of_part(k, enter, leave, some, from_start, h, scale);
    const nb_real value = nb_select(some, part.of.amount.value, zero);
    const nb_real error = nb_select(some, part.of.amount.error, zero);
    const nb_real first = nb_select(some, part.of.first, zero), second = nb_select(some, part.of.second, zero);
    const nb_real doubt = nb_select(some, part.doubt, zero), most = nb_min(most_depth(k->medium), NB_F(1.0));
    const nb_mask narrow = nb_narrow_mask(span->leave - span->enter < nb_widen(quarter + quarter));
    nb_real hidden = zero, most_light = zero, deepest = zero;
    for (int c = 0; c < 3; c++) {
        const nb_real lit = glow_in(k, light, c), glow = lit * value;
        sum->depth[c] = sum->depth[c] + k->extinction[c] * value;
        sum->error[c] = sum->error[c] + k->extinction[c] * error;
        half->sum[c] = half->sum[c] + glow;
        half->first[c] = half->first[c] + lit * first;
        half->second[c] = half->second[c] + lit * second;
        half->doubt[c] = half->doubt[c] + lit * doubt;
        hidden = nb_max(hidden, glow * most);
        most_light = nb_max(most_light, glow);
        deepest = nb_max(deepest, k->extinction[c] * value);
    }
    sum->terms = sum->terms + nb_select(some, NB_F(1.0), zero);
    sum->unresolved = sum->unresolved + nb_select(narrow, hidden, zero);
    /* depth and a body's own shadow have a kink where it ends, and its light is all on one side of that */
    const nb_real open = nb_max(NB_F(1.0) - h * scale, zero);
    sum->cut = sum->cut + nb_select(some, most_light * open * NB_F(0.5), zero);
    sum->cut_depth = sum->cut_depth + nb_select(nb_and(some, open > NB_F(1e-3)), deepest, zero);
}

/* Of all bodies from place to place of a step, or of one part of it. */
static void add_parts(const packet_state *m, const overlap_light *light, const nb_wide *t, int count, nb_real quarter,
                      lit_half half[2], lit_between *sum)
{
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        for (int n = 0; n < count; n++)
            add_part(k, &m->spans[k->first_span], light, t[n], t[n + 1], n % 2, quarter, &half[n / 2], &sum[n]);
    }
}

static void add_depths(const lit_point *from, const lit_between *between, lit_point *to)
{
    for (int c = 0; c < 3; c++) {
        to->depth[c] = from->depth[c] + between->depth[c];
        const nb_real rounding = (between->depth[c] * between->terms + to->depth[c]) * NB_EPSILON;
        to->depth_error[c] = from->depth_error[c] + between->error[c] + rounding;
    }
    to->cut = between->cut;
    to->cut_depth = between->cut_depth;
}

static lit_half nothing_scattered(void)
{
    const nb_real zero = NB_F(0.0);
    return (lit_half){{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};
}

/* What the parabola through what is seen at three places makes of a half. */
static nb_real light_of_half(const lit_half *half, int c, nb_real a, nb_real b, nb_real e)
{
    const nb_real slope = NB_F(2.0) * b - NB_F(0.5) * (NB_F(3.0) * a + e), bend = NB_F(0.5) * (a + e) - b;
    return a * half->sum[c] + slope * half->first[c] + bend * half->second[c];
}

/* By how much that may be off through moments. */
static nb_real doubt_of_half(const lit_half *half, int c, nb_real a, nb_real b, nb_real e)
{
    const nb_real slope = NB_F(2.0) * b - NB_F(0.5) * (NB_F(3.0) * a + e), bend = NB_F(0.5) * (a + e) - b;
    return half->doubt[c] * (nb_abs(slope) + NB_F(2.0) * nb_abs(bend));
}

/* ---- steps ----------------------------------------------------------------------------------- */

/* What light in voxels may be off by, as a multiple of what places tell. */
#define STEP_CAUTION NB_F(4.0)

typedef struct overlap_step {
    lit_point end;
    nb_real light[3], error, rounding, drop;
    nb_real most;     /* no more light is in it */
    nb_mask has_edge; /* a shadow begins or ends in it */
} overlap_step;

/* What shadows may do that the places of a step do not show, as a part of its light: all of them that are too narrow, and where
 * they begin or end, which is as steep as a root. The root of x - a, x and a from 0 to 1, is integrated here to 0.042, in the mean over a to 0.015;
 * as a shadow begins its depth is amount 2 sqrt(x / width). Some are too large and others too small: the root of their squares. */
static nb_real hidden_in_shadows(const sunlight *sun, nb_wide start, nb_wide end, nb_real length)
{
    const nb_real zero = NB_F(0.0), one = NB_F(1.0);
    nb_real hidden = zero, edges = zero;
    for (size_t i = sun->first_shadow; i < sun->shadow_count; i = sun->shadows[i].next) {
        const lit_shadow *s = &sun->shadows[i];
        const nb_mask begins = nb_narrow_mask(nb_wand(s->first > start, s->first < end));
        const nb_mask stops = nb_narrow_mask(nb_wand(s->last > start, s->last < end));
        const nb_mask some = nb_and(nb_or(begins, stops), nb_narrow_mask(s->first < s->last));
        if (!nb_any(some)) continue;
        const nb_real width = nb_narrow(nb_wmax(s->last - s->first, NB_W(0.0))), most = nb_min(s->amount, one);
        const nb_real longer = nb_min(length * nb_rcp_bounded(width), one / NB_TINY);
        const nb_mask narrow = nb_and(some, longer > NB_F(2.0));
        const nb_real count = nb_select(begins, one, zero) + nb_select(stops, one, zero);
        const nb_mask steep = nb_and(some, nb_not(narrow));
        hidden = hidden + nb_select(narrow, most * width * nb_rcp_bounded(length), zero);
        edges = edges + nb_select(steep, count * (most * most) * (NB_F(4.0) * EDGE_ERROR * EDGE_ERROR) * longer, zero);
    }
    return nb_min(hidden + nb_sqrt(edges), one);
}

/* What places do not show between two of them: see unseen_light of trace_lit_quadrature.h. */
static nb_real unseen_between_places(const lit_point at[5], int c, const overlap_light *light)
{
    const nb_real most = light->pass != NULL ? NB_F(1.0) : light->most;
    const double intensity = light->pass != NULL ? light->pass->point_light->intensity[c] : 1;
    nb_real unseen = NB_F(0.0);
    for (int i = 0; i < 4; i++) {
        const lit_point *from = &at[i], *to = &at[i + 1];
        const nb_real cover = nb_min(to->before[c], to->here[c]);
        const nb_real dip = nb_max(nb_min(from->way[c], to->way[c]) - cover, NB_F(0.0));
        const nb_real change = nb_abs((to->depth[c] - from->depth[c]) + (to->way[c] - from->way[c])) + dip;
        const nb_real lost = nb_max(from->behind[c] - to->behind[c], NB_F(0.0));
        nb_real comes = nb_max(from->comes[c], to->comes[c]);
        if (light->pass != NULL && light->pass->point_light->is_spot) {
            /* At the edge of its cone there is no light yet, and behind it all at once. */
            const nb_real arrives = nb_max(from->arrives, to->arrives) * REAL(intensity);
            comes = nb_max(comes, arrives * nb_exp(-nb_min(from->way[c], to->way[c])));
        }
        if (nb_any(dip > NB_F(0.0))) {
            const nb_real arrives = nb_max(from->arrives, to->arrives) * REAL(intensity);
            comes = nb_select(dip > NB_F(0.0), arrives * nb_exp(-cover), comes);
        }
        unseen = unseen + most * lost * comes * unseen_share(change);
    }
    return unseen;
}

/* What depths and shadows that begin or end between two places do to the light of bodies that do so, too. */
static nb_real light_of_cut_bodies(const lit_point at[5], int c)
{
    nb_real light = NB_F(0.0);
    for (int i = 0; i < 4; i++) {
        const lit_point *from = &at[i], *to = &at[i + 1];
        const nb_real shadows =
            to->cut_depth + nb_max(from->way[c] + to->way[c] - (to->before[c] + to->here[c]), NB_F(0.0));
        light = light + to->cut * nb_max(from->seen[c], to->seen[c]) * nb_min(shadows, NB_F(1.0));
    }
    return light;
}

/* How far beside the ends of a step cones are looked at, as a part of it. */
#define CONE_MARGIN 1e-6

/* A step that starts at a cone's edge has the other side's light than the step that ended there. */
static lit_point look_ahead_from(const sunlight *sun, const packet_state *m, const overlap_light *light,
                                 const lit_point *start, nb_wide margin)
{
    lit_point at = *start;
    nb_wvec3 towards;
    nb_wide reach;
    if (light->pass == NULL || !light->pass->point_light->is_spot) return at;
    at.arrives = light_arrives(m, light->pass, light->phase, at.t, at.t + margin, &towards, &reach);
    set_seen(sun, light, &at);
    return at;
}

/* What comes to any of the places if nothing is before the light. */
static void most_arriving(const overlap_light *light, const lit_point at[5], nb_real arriving[3])
{
    nb_real most = at[0].arrives;
    for (int i = 1; i < 5; i++) most = nb_max(most, at[i].arrives);
    for (int c = 0; c < 3; c++)
        arriving[c] = light->pass != NULL ? most * REAL(light->pass->point_light->intensity[c]) : most;
}

static overlap_step try_overlap_step(const sunlight *sun, const packet_state *m, const overlap_light *light,
                                     const lit_point *start, nb_real length, nb_wide end)
{
    const nb_real quarter = NB_F(0.25) * length;
    const nb_wide margin = (end - start->t) * WIDE(CONE_MARGIN);
    lit_point at[5] = {look_ahead_from(sun, m, light, start, margin)};
    lit_half half[2] = {nothing_scattered(), nothing_scattered()};
    lit_between between[4];
    nb_wide t[5] = {start->t};
    for (int i = 1; i < 5; i++) {
        t[i] = at[i].t = i == 4 ? end : nb_wmin(start->t + nb_widen(quarter * REAL(i)), end);
        between[i - 1] = nothing_between();
    }
    add_parts(m, light, t, 4, quarter, half, between);
    for (int i = 1; i < 5; i++) {
        add_depths(&at[i - 1], &between[i - 1], &at[i]);
        look_from(sun, m, light, &at[i - 1], i == 4 ? end - margin : at[i].t, &at[i]);
    }
    overlap_step s = {.end = at[4],
                      .error = NB_F(0.0),
                      .rounding = NB_F(0.0),
                      .drop = NB_F(0.0),
                      .most = NB_F(0.0),
                      .has_edge = nb_or(nb_or(at[1].has_edge, at[2].has_edge), nb_or(at[3].has_edge, at[4].has_edge))};
    nb_real doubt = NB_F(0.0), full = NB_F(0.0), unseen = NB_F(0.0), arriving[3], unresolved = NB_F(0.0);
    for (int i = 0; i < 5; i++) doubt = nb_max(doubt, at[i].doubt);
    most_arriving(light, at, arriving);
    for (int c = 0; c < 3; c++) {
        const nb_real a = at[0].seen[c], b = at[2].seen[c], e = at[4].seen[c], eighth = NB_F(0.125);
        const nb_real first = nb_abs(at[1].seen[c] - eighth * (NB_F(3.0) * a + NB_F(6.0) * b - e));
        const nb_real last = nb_abs(at[3].seen[c] - eighth * (NB_F(3.0) * e + NB_F(6.0) * b - a));
        const nb_real most = nb_max(nb_max(nb_max(a, at[1].seen[c]), b), nb_max(at[3].seen[c], e));
        const nb_real light_of_all =
            light_of_half(&half[0], c, a, at[1].seen[c], b) + light_of_half(&half[1], c, b, at[3].seen[c], e);
        nb_real hidden = NB_F(0.0);
        for (int i = 0; i < 4; i++) hidden = hidden + between[i].unresolved * at[i].seen[c];
        unresolved = nb_max(unresolved, hidden);
        s.light[c] = nb_max(light_of_all, NB_F(0.0));
        s.error = nb_max(s.error, first * half[0].sum[c] + last * half[1].sum[c]);
        const nb_real moments =
            doubt_of_half(&half[0], c, a, at[1].seen[c], b) + doubt_of_half(&half[1], c, b, at[3].seen[c], e);
        const double intensity = light->pass != NULL ? light->pass->point_light->intensity[c] : 1;
        nb_real more = at[0].more[c];
        for (int i = 1; i < 5; i++) more = nb_max(more, at[i].more[c]);
        const nb_real off = nb_max(most * doubt, more * REAL(intensity));
        s.rounding = nb_max(s.rounding, (half[0].sum[c] + half[1].sum[c]) * off + moments);
        full = nb_max(full, (half[0].sum[c] + half[1].sum[c]) * most);
        s.most = nb_max(s.most, (half[0].sum[c] + half[1].sum[c]) * (at[0].behind[c] * arriving[c]));
        s.drop = nb_max(s.drop, at[0].behind[c] - at[4].behind[c]);
        unseen = nb_max(unseen, unseen_between_places(at, c, light) + light_of_cut_bodies(at, c));
    }
    s.rounding = nb_min(s.rounding, s.most);
    s.error = s.error + unseen + unresolved + full * hidden_in_shadows(sun, start->t, end, length);
    return s;
}

/* Where a lane has come to. */
typedef struct overlap_walk {
    lit_point at;
    nb_wide last;
    nb_wmask lanes;
    nb_real guess, left, whole; /* length of the next step; steps that may still be tried; of all */
    nb_real least;              /* what the next step is taken to be off by at least */
    nb_real doubt;              /* see walk_through_overlap */
} overlap_walk;

static void select_place(nb_mask mask, lit_point *to, const lit_point *from)
{
    to->t = nb_wselect(nb_widen_mask(mask), from->t, to->t);
    select_reals(mask, to->depth, from->depth);
    select_reals(mask, to->depth_error, from->depth_error);
    select_reals(mask, to->behind, from->behind);
    select_reals(mask, to->way, from->way);
    select_reals(mask, to->comes, from->comes);
    select_reals(mask, to->seen, from->seen);
    select_reals(mask, to->more, from->more);
    to->arrives = nb_select(mask, from->arrives, to->arrives);
    to->doubt = nb_select(mask, from->doubt, to->doubt);
}

/* The place at t behind one that is known. */
static lit_point place_behind(sunlight *sun, const packet_state *m, const overlap_light *light, const lit_point *from,
                              nb_wide t, nb_wmask lanes)
{
    const nb_wide part[2] = {from->t, t};
    lit_half none[2] = {nothing_scattered(), nothing_scattered()};
    lit_between between = nothing_between();
    lit_point at = {.t = t};
    list_shadows_of_step(sun, from->t, t, lanes);
    add_parts(m, light, part, 1, NB_F(1.0), none, &between);
    add_depths(from, &between, &at);
    look_from(sun, m, light, from, t, &at);
    return at;
}

/* After a step: twice as long where its error was far below what was allowed, half as long where it was beyond; no shorter
 * than what was meant where the step was cut short and good. The error goes with the third power of the length, and where bodies
 * begin and end with less. */
static nb_real next_length(nb_real guess, nb_real length, nb_real error, nb_real allowed)
{
    const nb_real longer = length * nb_select(error * NB_F(8.0) <= allowed, NB_F(2.0), NB_F(1.0));
    return nb_select(error <= allowed, nb_max(guess, longer), NB_F(0.5) * length);
}

static void step_through_overlap(sunlight *sun, const packet_state *m, const overlap_light *light, nb_wide bright,
                                 overlap_walk *w, gathered_light *g)
{
    const nb_mask final = w->left <= NB_F(1.0); /* the rest is one step, whatever its error */
    const nb_real rest = nb_narrow(bright - w->at.t);
    const nb_real length = nb_select(final, rest, nb_min(w->guess, rest));
    const nb_wide end = nb_wselect(nb_widen_mask(length >= rest), bright, w->at.t + nb_widen(length));
    list_shadows_of_step(sun, w->at.t, end, w->lanes);
    const int has_voxels = sun->lighting->common_steps == NB_COMMON_STEPS_IN_FLOAT;
    const nb_real caution = has_voxels ? STEP_CAUTION : NB_F(1.0);
    overlap_step s = try_overlap_step(sun, m, light, &w->at, length, end);
    /* two places may look alike by chance: more likely where no longer step has said what is there */
    const nb_real unknown = nb_select(w->least > NB_F(0.0), NB_F(1.0), NB_F(2.0));
    if (has_voxels) s.error = nb_max(s.error * (caution * unknown), w->least);
    const nb_real least = caution * NB_F(8.0) * NB_EPSILON * largest(s.light); /* what no halving makes less */
    const nb_real steady = REAL(0.5 * (1 - EDGE_SHARE)) * (s.drop + length * nb_rcp_bounded(w->whole));
    const nb_real at_edge =
        nb_select(s.has_edge, REAL(EDGE_SHARE / (double)(2 * sun->snapshot->medium_count)), NB_F(0.0));
    const nb_real allowed = least + REAL(light->share * (1 - TAIL_SHARE) / ESTIMATE_MARGIN) * (steady + at_edge);
    const nb_mask taken = nb_and(nb_or(final, s.error <= allowed), nb_narrow_mask(w->lanes));
    nb_real most = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        g->radiance[c] = g->radiance[c] + nb_select(taken, s.light[c], NB_F(0.0));
        most = nb_max(most, g->radiance[c]);
    }
    const nb_real gaps = has_voxels ? nb_min(s.most, allowed) * GAP_SHARE : NB_F(0.0);
    const nb_real error = nb_max(s.error * REAL(ESTIMATE_MARGIN), gaps) + s.rounding + most * NB_EPSILON;
    g->radiance_error = g->radiance_error + nb_select(taken, error, NB_F(0.0));
    w->doubt = w->doubt + nb_select(taken, s.rounding, NB_F(0.0));
    select_place(taken, &w->at, &s.end);
    start_from_last(sun, taken);
    w->guess = nb_select(nb_narrow_mask(w->lanes), next_length(w->guess, length, s.error, allowed), w->guess);
    w->least = nb_select(taken, NB_F(0.25) * w->least, s.error * NB_F(0.0625));
    w->left = w->left - NB_F(1.0);
}

/* ---- the walk -------------------------------------------------------------------------------- */

/* From the first lit body of each ray to the last. */
static nb_mask find_lit_stretch(const packet_state *m, const overlap_light *light, nb_wide *first, nb_wide *last)
{
    *first = NB_WFAR;
    *last = NB_W(0.0);
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        if (!is_lit_by(k, light)) continue;
        const nb_wmask met = k->hull_enter < k->hull_leave;
        *first = nb_wselect(met, nb_wmin(*first, k->hull_enter), *first);
        *last = nb_wselect(met, nb_wmax(*last, k->hull_leave), *last);
    }
    return nb_narrow_mask(*first < *last);
}

/* Transmittance up to t, at most and at least. Voxels are not walked for it: there may be none up to `full`, and as many as
 * there can be from there on. */
static void transmittance_at(const packet_state *m, nb_wide full, nb_wide t, nb_real behind[3])
{
    nb_real depth[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        const leaf_span *span = &m->spans[k->first_span];
        const int is_grid = k->medium->body.density.type == NEBEL_DENSITY_GRID;
        const nb_wide enter = is_grid ? nb_wmax(span->enter, full) : span->enter;
        const nb_wide leave = nb_wmax(nb_wmin(span->leave, t), enter);
        const nb_mask some = nb_narrow_mask(enter < leave);
        if (!nb_any(some)) continue;
        const nb_real length = nb_narrow(leave - enter);
        const nb_real value =
            is_grid ? length * REAL(k->medium->peak) : contact_integral(k, enter, leave, length).value;
        for (int c = 0; c < 3; c++) depth[c] = depth[c] + nb_select(some, k->extinction[c] * value, NB_F(0.0));
    }
    map_channels(m->sun->snapshot, transmitted, depth, behind);
}

/* What fog between two places may give at most. */
static nb_real most_between(const packet_state *m, const overlap_light *light, nb_wide start, nb_wide end)
{
    nb_real before[3], behind[3], drop = NB_F(0.0);
    transmittance_at(m, start, start, before);
    transmittance_at(m, start, end, behind);
    for (int c = 0; c < 3; c++) drop = nb_max(drop, before[c] - behind[c]);
    const nb_real arriving = light->pass != NULL ? most_fluence(light->pass, start, end) : NB_F(1.0);
    return drop * arriving * light->most;
}

/* The least `last` behind which nothing matters, but for a factor of 2: rays without an end would have steps that are halved for ever. */
static nb_wide trim_stretch(const packet_state *m, const overlap_light *light, nb_wide first, nb_wide last,
                            nb_real allowed)
{
    nb_wmask lanes = first < last;
    for (int i = 0; i < 64 && nb_wany(lanes); i++) {
        const nb_wide middle = first + NB_W(0.5) * (last - first);
        lanes = nb_wand(lanes, nb_widen_mask(most_between(m, light, middle, last) <= allowed));
        last = nb_wselect(lanes, middle, last);
    }
    return last;
}

/* Steps end where a surface's shadow begins or ends, and pass over it. Returns what light may be off by through depths. */
static nb_real walk_through_overlap(sunlight *sun, const packet_state *m, const overlap_light *light,
                                    sun_attenuation *shadows, nb_mask lanes, nb_wide first, nb_wide last,
                                    gathered_light *g)
{
    const lit_point origin = no_place();
    overlap_walk w = {.last = last,
                      .lanes = nb_wand(nb_widen_mask(lanes), first < last),
                      .left = REAL(MAX_OVERLAP_STEPS),
                      .least = NB_F(0.0),
                      .doubt = NB_F(0.0)};
    w.at = place_behind(sun, m, light, &origin, nb_wselect(w.lanes, first, NB_W(0.0)), w.lanes);
    start_from_last(sun, nb_mask_true);
    w.whole = nb_max(nb_narrow(last - first), NB_TINY);
    w.guess = NB_F(0.5) * w.whole;
    while (nb_wany(w.lanes)) {
        if (shadows != NULL) pass_boundaries(shadows, w.at.t, w.lanes);
        const nb_wide bright = shadows != NULL ? nb_wmin(shadows->boundary, last) : last;
        const nb_wmask dark = shadows != NULL ? nb_wand(w.lanes, shadows->is_dark) : nb_wmask_false;
        if (nb_wany(dark)) {
            const lit_point behind = place_behind(sun, m, light, &w.at, nb_wselect(dark, bright, w.at.t), w.lanes);
            select_place(nb_narrow_mask(dark), &w.at, &behind);
            start_from_last(sun, nb_narrow_mask(dark));
            w.left = nb_select(nb_narrow_mask(dark), REAL(MAX_OVERLAP_STEPS), w.left);
        } else {
            step_through_overlap(sun, m, light, next_turn(sun, w.at.t, bright), &w, g);
        }
        w.lanes = nb_wand(w.lanes, w.at.t < last);
    }
    return w.doubt;
}

/* Depths to the sun come from columns, or for rays where these say that they may be too far off, from walks. A ray has one kind
 * of them: between both its light would jump. */
static void walk_by_columns(sunlight *sun, const packet_state *m, const overlap_light *light,
                            const sun_attenuation *shadows, nb_mask lanes, nb_wide first, nb_wide last,
                            gathered_light *g)
{
    const gathered_light before = *g;
    sun_attenuation passed;
    if (shadows != NULL) passed = *shadows;
    sun->has_common_steps = 1;
    sun->takes_columns = lanes;
    const nb_real doubt = walk_through_overlap(sun, m, light, shadows != NULL ? &passed : NULL, lanes, first, last, g);
    const nb_mask fits = sun->doubted + doubt <= REAL(COLUMN_SHARE * sun->share);
    const nb_mask others = nb_and(lanes, nb_not(fits));
    sun->doubted = sun->doubted + nb_select(nb_and(lanes, fits), doubt, NB_F(0.0));
    const int has_columns =
        sun->lighting->common_steps == NB_COMMON_STEPS_IN_FLOAT && (light->pass == NULL || sun->light_lattices != NULL);
    if (!has_columns || !nb_any(others)) return;
    gathered_light by_walks = before;
    if (shadows != NULL) passed = *shadows;
    sun->takes_columns = nb_mask_false;
    list_shadows(sun, &m->rays, light->pass != NULL ? light->pass->point_light : NULL);
    (void)walk_through_overlap(sun, m, light, shadows != NULL ? &passed : NULL, others, first, last, &by_walks);
    for (int c = 0; c < 3; c++) g->radiance[c] = nb_select(others, by_walks.radiance[c], g->radiance[c]);
    g->radiance_error = nb_select(others, by_walks.radiance_error, g->radiance_error);
}

static void gather_overlap_light(sunlight *sun, const packet_state *m, const overlap_light *light,
                                 const sun_attenuation *shadows, gathered_light *g)
{
    nb_wide first, last;
    const nb_mask lit = find_lit_stretch(m, light, &first, &last);
    if (!nb_any(lit)) return;
    const nb_wide end = trim_stretch(m, light, first, last, REAL(0.5 * TAIL_SHARE * light->share));
    const nb_real arriving = light->pass != NULL ? most_fluence(light->pass, end, last) : NB_F(1.0);
    const nb_real rounding =
        arriving * light->most * (NB_F(8.0) * NB_EPSILON); /* of the difference of transmittances */
    const nb_real beyond =
        most_between(m, light, end, last) + nb_select(nb_narrow_mask(end < last), rounding, NB_F(0.0));
    g->radiance_error = g->radiance_error + nb_select(lit, beyond, NB_F(0.0));
    sun->turn_count = 0;
    if (light->pass != NULL) {
        note_light(sun, m, light->pass);
        note_turn(sun, light->pass->closest, nb_wmask_true); /* on either side what arrives rises or falls */
    }
    list_shadows(sun, &m->rays, light->pass != NULL ? light->pass->point_light : NULL);
    if (sun->out_of_memory) return;
    walk_by_columns(sun, m, light, shadows, lit, first, end, g);
}

/* ---- all lights ------------------------------------------------------------------------------ */

static nb_real most_sunlight(const packet_state *m)
{
    nb_real most = NB_F(0.0);
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        const nb_mask met = is_met(k);
        for (int c = 0; c < 3; c++) {
            const nb_real radiance = k->glow[c] / nb_max(k->extinction[c], NB_TINY);
            most = nb_max(most, nb_select(met, radiance, NB_F(0.0)));
        }
    }
    return most;
}

/* What all point lights give to the media that scatter by one phase function. */
static void gather_point_lights_of_phase(sunlight *sun, const packet_state *m, size_t number, gathered_light *g)
{
    const nebel_lighting *lighting = sun->lighting;
    const double share = sun->share / ((double)lighting->light_count * (double)lighting->phase_count);
    nb_real most = NB_F(0.0);
    const nb_phase *phase = NULL;
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        if (!k->lit->scatters_lights || k->lit->phase != number) continue;
        phase = &k->medium->body.phase;
        most = nb_max(most, nb_select(is_met(k), REAL(most_scattered(&k->medium->body)), NB_F(0.0)));
    }
    for (size_t i = 0; i < lighting->light_count && phase != NULL; i++) {
        light_pass pass = pass_light(m, &lighting->lights[i]);
        const overlap_light light = {&pass, phase, number, most, share};
        gather_overlap_light(sun, m, &light, sun->light_shades != NULL ? &sun->light_shades[i] : NULL, g);
    }
}

/* Adds what all lights give along the rays. */
static void gather_overlap_lights(sunlight *sun, const packet_state *m, gathered_light *g)
{
    const nebel_lighting *lighting = sun->lighting;
    nb_real before[3] = {g->radiance[0], g->radiance[1], g->radiance[2]};
    sun->doubted = NB_F(0.0);
    if (lighting->scatters_sun) {
        const overlap_light light = {.most = most_sunlight(m), .share = sun->share};
        gather_overlap_light(sun, m, &light, sun->shade.boundaries != NULL ? &sun->shade : NULL, g);
    }
    note_group(sun->by_sun, before, g);
    for (int c = 0; c < 3; c++) before[c] = g->radiance[c];
    sun->doubted = NB_F(0.0);
    for (size_t i = 0; i < lighting->phase_count; i++) gather_point_lights_of_phase(sun, m, i, g);
    note_group(sun->by_lights, before, g);
}
