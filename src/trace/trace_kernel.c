/* The march, compiled once per instruction set, once as the double reference, and once for the rays that this cannot
 * decide: packets of rays in, light out.
 *
 * NB_SUFFIX names the one symbol; everything else is static. Every lane's arithmetic is independent of the others, so a
 * ray gives the same bits alone, in any company and in any width. */
#if defined(NB_ISA_DOUBLE) || defined(NB_ISA_QUAD)
#define NB_DOUBLE
#endif
#if defined(NB_ISA_QUAD)
#define NB_QUAD
#endif

#include "trace_kernel.h"

#include "base/isa_list.h"
#include "base/stride.h"

#include "medium/grid_voxels.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/shapes.inc"
#include "formulas/profiles.inc"
#include "formulas/medium.inc"
#include "formulas/phase.inc"
#include "formulas/point_light.inc"
#include "formulas/atmosphere.inc"
#include "formulas/altitude.inc"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Where long double is not enough for the double reference. */
#if defined(NB_DOUBLE) && !defined(NB_QUAD) && defined(NB_HAVE_QUAD)
#define ASKS_QUAD
#endif

/* Beyond this optical depth exp gives 0 in this precision, and nothing behind adds a bit. What it gives before that is
 * at least the smallest normal number. */
#if defined(NB_DOUBLE)
#define OPAQUE_DEPTH NB_F(800.0)
#define SMALLEST NB_F(2.2250738585072014e-308)
#else
#define OPAQUE_DEPTH NB_F(120.0)
#define SMALLEST NB_F(1.17549435e-38)
#endif

#include "trace_packet.h"
#include "trace_density.h"
#include "trace_intersect.h"
#include "trace_bounds.h"
#include "trace_overlap_set.h"
#include "trace_active_set.h"
#include "trace_partition.h"
#include "trace_quadrature.h"
#include "trace_workspace.h"

/* ---- rays in --------------------------------------------------------------------------------- */

/* Unit length; adding +0 makes every zero positive, on which the ownership of faces rests. */
static nb_wvec3 divided(nb_wvec3 d, nb_wide length)
{
    const nb_wide inverse = NB_W(1.0) / length;
    return nb_wvec3(d.x * inverse + NB_W(0.0), d.y * inverse + NB_W(0.0), d.z * inverse + NB_W(0.0));
}

static nb_wvec3 normalized(nb_wvec3 d)
{
    return divided(d, nb_wlength3(d));
}

/* Directions so long or short that their squares overflow or vanish, taken near 1 by a power of two: which is exact, so
 * that ordinary lanes keep their bits. */
static nb_wvec3 tamed(nb_wvec3 d)
{
    double lane[3][NB_WIDTH];
    nb_wstore_lanes(lane[0], d.x);
    nb_wstore_lanes(lane[1], d.y);
    nb_wstore_lanes(lane[2], d.z);
    for (int i = 0; i < NB_WIDTH; i++) {
        int exponent;
        frexp(fmax(fmax(fabs(lane[0][i]), fabs(lane[1][i])), fabs(lane[2][i])), &exponent);
        for (int c = 0; c < 3; c++) lane[c][i] = ldexp(lane[c][i], -exponent);
    }
    return nb_wvec3(nb_wload_lanes(lane[0]), nb_wload_lanes(lane[1]), nb_wload_lanes(lane[2]));
}

static nb_wvec3 unit_vector(nb_wvec3 d)
{
    const nb_wide square = nb_wdot3(d, d);
    if (nb_wall(nb_wand(square > NB_W(1e-200), square < NB_W(1e200)))) return normalized(d);
    return normalized(tamed(d));
}

/* Lanes beyond `count` get a ray of no length. */
static packet load_packet(const nebel_ray *rays, size_t stride, size_t count)
{
    double origin[3][NB_WIDTH], direction[3][NB_WIDTH], t_max[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const nebel_ray *ray = nb_stride_from(rays, stride, i < count ? i : 0);
        for (int c = 0; c < 3; c++) {
            origin[c][i] = ray->origin[c];
            direction[c][i] = ray->direction[c];
        }
        t_max[i] = i >= count ? 0 : ray->t_max > 1e18 ? 1e18 : ray->t_max;
    }
    const nb_wvec3 way =
        nb_wvec3(nb_wload_lanes(direction[0]), nb_wload_lanes(direction[1]), nb_wload_lanes(direction[2]));
    return (packet){nb_wvec3(nb_wload_lanes(origin[0]), nb_wload_lanes(origin[1]), nb_wload_lanes(origin[2])),
                    unit_vector(way), nb_wload_lanes(t_max)};
}

/* Below this it is quicker to ask every medium than to walk the tree. */
#define FEW_MEDIA 8

static void begin_query(nb_bvh_cursor *cursor, const nebel_snapshot *snapshot, const packet *rays)
{
    double origin[3][NB_BVH_LANES], inverse[3][NB_BVH_LANES], t_max[NB_BVH_LANES];
    const nb_wide from[3] = {rays->origin.x, rays->origin.y, rays->origin.z};
    const nb_wide along[3] = {rays->direction.x, rays->direction.y, rays->direction.z};
    for (int c = 0; c < 3; c++) {
        nb_wstore_lanes(origin[c], from[c]);
        nb_wstore_lanes(inverse[c], nb_wrcp_bounded(along[c]));
    }
    nb_wstore_lanes(t_max, rays->t_max);
    unsigned active = 0;
    for (unsigned i = 0; i < NB_WIDTH; i++) active |= t_max[i] > 0 ? 1u << i : 0;
    nb_bvh_begin(cursor, &snapshot->bvh, NB_WIDTH, active, (const double(*)[NB_BVH_LANES])origin,
                 (const double(*)[NB_BVH_LANES])inverse, t_max);
}

static int note_found(workspace *w, const nebel_allocator *allocator, uint32_t index)
{
    void *found = w->found;
    if (!nb_grow(allocator, &found, sizeof *w->found, w->found_count, &w->found_capacity, w->found_count + 1)) return 0;
    w->found = found;
    w->found[w->found_count++] = index;
    return 1;
}

static int compare_indices(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* The media that the packet may touch, ascending, which is the canonical order. 0 when memory is out. */
static int find_media(workspace *w, const nebel_snapshot *snapshot)
{
    w->found_count = 0;
    for (size_t i = 0; i < snapshot->endless_count; i++)
        if (!note_found(w, &snapshot->allocator, snapshot->endless[i])) return 0;
    nb_bvh_cursor cursor;
    begin_query(&cursor, snapshot, &w->m.rays);
    uint32_t box;
    while (nb_bvh_next(&cursor, &box))
        if (!note_found(w, &snapshot->allocator, snapshot->bounded[box])) return 0;
    if (w->found_count > 1) qsort(w->found, w->found_count, sizeof *w->found, compare_indices);
    return 1;
}

static int meet_one(workspace *w, const nebel_lighting *lighting, size_t index)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    const nb_medium *medium = &snapshot->media[index];
    if (!w->m.wants_error && all_miss(&w->m.rays, medium)) return 1;
    if (!reserve(w, &snapshot->allocator, medium->body.leaf_count)) return 0;
    meet_medium(&w->m, medium, &lighting->media[index]);
    return 1;
}

/* Meets all media the packet can touch. 0 when memory is out. */
static int meet_fog(workspace *w, const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    packet_state *m = &w->m;
    m->contact_count = 0;
    m->span_count = 0;
    m->all_ends = no_ends();
    m->grazing_ends = m->all_ends;
    for (int c = 0; c < 3; c++) m->revealed[c] = m->doubtful_radiance[c] = NB_F(0.0);
    m->doubt_from = NB_W(2.0) * NB_WFAR;
    m->drift = NB_F(0.0);
    m->event_count = NB_F(0.0);
    m->sky = NULL;
    if (snapshot->bounded_count <= FEW_MEDIA) {
        for (size_t i = 0; i < snapshot->medium_count; i++)
            if (!meet_one(w, lighting, i)) return 0;
    } else {
        if (!find_media(w, snapshot)) return 0;
        for (size_t i = 0; i < w->found_count; i++)
            if (!meet_one(w, lighting, w->found[i])) return 0;
    }
    return open_overlap_set(m, lighting);
}

/* ---- light out ------------------------------------------------------------------------------- */

static gathered_light nothing_gathered(void)
{
    const nb_real zero = NB_F(0.0), one = NB_F(1.0);
    return (gathered_light){{zero, zero, zero}, {one, one, one},    {zero, zero, zero}, {zero, zero, zero},
                            {zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, zero};
}

static void select_reals(nb_mask mask, nb_real to[3], const nb_real from[3])
{
    for (int c = 0; c < 3; c++) to[c] = nb_select(mask, from[c], to[c]);
}

/* The fog before the first large doubt, as far as it is in the piece. A lane without fog in it would not come here alone. */
static void note_clear(const packet_state *m, const ray_segment *p, gathered_light *g)
{
    nb_mask foggy = nb_mask_false;
    for (size_t i = m->present_first; i < m->present_end; i++) foggy = nb_or(foggy, present(m, i)->inside);
    const nb_mask doubtful = nb_narrow_mask(nb_wand(m->doubt_from > p->start, m->doubt_from <= NB_WFAR));
    const nb_mask clear = nb_and(nb_and(p->lanes, foggy), doubtful);
    if (!nb_any(clear)) return;
    const nb_wide end = nb_wmax(nb_wmin(m->doubt_from, p->end), p->start);
    const nb_real length = nb_narrow(end - p->start) * (NB_F(1.0) - NB_F(2.0) * NB_EPSILON);
    const piece_sum sum = sum_step(m, p->start, p->start + nb_widen(length), length);
    for (int c = 0; c < 3; c++) {
        const nb_real least = (g->depth[c] + sum.depth[c]) - (g->depth_error[c] + sum.depth_error[c]);
        g->clear_depth[c] = nb_select(clear, nb_max(least, NB_F(0.0)), g->clear_depth[c]);
    }
}

#include "trace_sun.h"

#include "trace_point_light.h"

#include "trace_common_steps.h"

static int takes_common_steps(const nebel_lighting *lighting)
{
#if defined(NB_DOUBLE)
    return lighting->common_steps == NB_COMMON_STEPS_ALWAYS;
#else
    return lighting->common_steps != NB_COMMON_STEPS_NEVER;
#endif
}

/* Sunlight that is found while voxels are crossed anyway. Returns the lanes that it is still to be added in. */
static nb_mask cross_sunlit_voxels(packet_state *m, const ray_segment *p, gathered_light *g, nb_estimate *along)
{
    if (m->sun == NULL || takes_common_steps(m->sun->lighting)) return nb_mask_false;
#if !defined(NB_DOUBLE)
    if (has_lattice(m)) {
        m->whole = along;
        const nb_real before[3] = {g->radiance[0], g->radiance[1], g->radiance[2]};
        const nb_mask rest = gather_by_lattice(m->sun, m, p, g, along);
        note_group(m->sun->by_sun, before, g);
        return rest;
    }
#else
    (void)g, (void)along;
#endif
    return sunlit_lanes(m, p);
}

static void gather_piece(packet_state *m, const ray_segment *p, const allowance *may, gathered_light *g,
                         nb_mask *unbounded)
{
    nb_estimate along;
    const nb_mask sunlit = cross_sunlit_voxels(m, p, g, &along);
    const piece_sum sum = sum_piece(m, p);
    m->whole = NULL;
    note_overflow(m, p, g);
    if (may->transmittance_only) {
        pass_piece(g, &sum);
        return;
    }
    *unbounded = nb_or(*unbounded, is_unbounded(m, p, &sum));
    if (m->sun != NULL && !takes_common_steps(m->sun->lighting)) gather_lights(m->sun, m, p, sunlit, g);
    const nb_mask closed = nb_and(p->lanes, nb_not(sum.mixed));
    const nb_mask mixed = nb_and(p->lanes, sum.mixed);
    if (nb_any(closed)) gather_closed(g, &sum, closed);
    if (nb_any(mixed)) {
        gathered_light within = *g;
        gather_mixed(m, p, &sum, mixed, may, &within);
        for (int c = 0; c < 3; c++) g->radiance[c] = within.radiance[c];
        g->radiance_error = within.radiance_error;
    }
    pass_piece(g, &sum);
}

/* One leaf of fog is one piece: the walk below would find the same. */
static void gather_single(packet_state *m, const allowance *may, gathered_light *g, nb_mask *unbounded)
{
    const leaf_span *span = &m->spans[0];
    const nb_mask lanes = nb_narrow_mask(span->enter < span->leave);
    const ray_segment p = {span->enter, span->leave, nb_narrow(span->leave - span->enter), lanes};
    m->contacts[0].inside = lanes;
    m->window_count = 1;
    m->window[0] = 0;
    m->present[0] = 0;
    m->present_first = 0;
    m->present_end = 1;
    if (m->wants_signature) sign_piece(m, p.start, lanes);
    gather_piece(m, &p, may, g, unbounded);
}

static int is_single(const packet_state *m)
{
    return m->contact_count == 1 && m->span_count == 1 && nb_volume_has_fog(&m->contacts[0].medium->body) &&
           !nb_any(ends_matter(m));
}

/* From event to event along the rays of some lanes at once. */
static gathered_light walk_lanes(packet_state *m, const allowance *may, nb_mask which, nb_mask *unbounded)
{
    gathered_light g = nothing_gathered();
    nb_wide t = NB_W(0.0);
    nb_wmask lanes = nb_wand(m->rays.t_max > NB_W(0.0), nb_widen_mask(which));
    const nb_mask watched = nb_and(ends_matter(m), which);
    *unbounded = nb_mask_false;
    if (m->contact_count == 0) return g;
    if (is_single(m)) {
        gather_single(m, may, &g, unbounded);
        return g;
    }
    open_window(m, nb_any(watched));
    if (nb_any(watched)) pass_ends(m, &g, t, watched);                  /* of fog that the ray may start in */
    const nb_wmask to_the_end = nb_wand(lanes, nb_widen_mask(watched)); /* also where an end may lie much nearer */
    ray_segment p;
    while (next_piece(m, t, nb_wor(lanes, to_the_end), &p)) {
        const nb_mask here = p.lanes;
        p.lanes = nb_and(here, nb_narrow_mask(lanes));
        const int foggy = mark_inside(m, &p);
        if (m->wants_signature) sign_piece(m, p.start, p.lanes);
        if (foggy) note_clear(m, &p, &g);
        if (foggy) gather_piece(m, &p, may, &g, unbounded);
        if (nb_any(watched)) pass_ends(m, &g, p.end, nb_and(watched, here));
        if (foggy) {
            const nb_real thinnest = nb_min(nb_min(g.depth[0], g.depth[1]), g.depth[2]);
            lanes = nb_wand(lanes, nb_widen_mask(thinnest < OPAQUE_DEPTH));
        }
        t = nb_wselect(nb_wand(nb_wor(lanes, to_the_end), nb_widen_mask(here)), p.end, t);
    }
    return g;
}

/* *to = *from in the lanes of the mask. */
static void select_gathered(nb_mask mask, gathered_light *to, const gathered_light *from)
{
    select_reals(mask, to->depth, from->depth);
    select_reals(mask, to->transmittance, from->transmittance);
    select_reals(mask, to->radiance, from->radiance);
    select_reals(mask, to->depth_error, from->depth_error);
    select_reals(mask, to->ends_depth, from->ends_depth);
    select_reals(mask, to->least_depth, from->least_depth);
    select_reals(mask, to->clear_depth, from->clear_depth);
    to->radiance_error = nb_select(mask, from->radiance_error, to->radiance_error);
}

/* Lanes with an overlap set and those without, each kind by itself. */
static gathered_light gather_light(packet_state *m, const allowance *may, nb_mask *unbounded)
{
    const nb_mask overlapping = m->overlap_set.lanes;
    if (!nb_any(overlapping)) return walk_lanes(m, may, nb_mask_true, unbounded);
    m->overlap_set.is_walking = 1;
    gathered_light g = walk_lanes(m, may, overlapping, unbounded);
    m->overlap_set.is_walking = 0;
    if (nb_all(overlapping)) return g;
    nb_mask others_unbounded;
    const gathered_light others = walk_lanes(m, may, nb_not(overlapping), &others_unbounded);
    select_gathered(nb_not(overlapping), &g, &others);
    *unbounded = nb_or(*unbounded, others_unbounded);
    return g;
}

/* The radiance of the brightest fog on the ray: what any answer is below, unless something shines by itself. */
static nb_real most_radiance(const packet_state *m, int c)
{
    nb_real most = NB_F(0.0);
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        const nb_mask met = nb_narrow_mask(k->hull_enter < k->hull_leave);
        const nb_real radiance = k->radiance[c] + k->glow[c] / nb_max(k->extinction[c], NB_TINY);
        const int has_limit = !k->medium->emits && !k->lit->scatters_lights;
        most = nb_max(most, nb_select(met, has_limit ? radiance : NB_HUGE, NB_F(0.0)));
    }
    return most;
}

/* Rounding may lift opaque fog above its own source; the truth never is, so this only mends. */
static void limit_radiance(const packet_state *m, gathered_light *g)
{
    for (int c = 0; c < 3; c++) g->radiance[c] = nb_min(g->radiance[c], most_radiance(m, c));
}

/* The fog's opacity limited to what the job says: no bit of other light changes. */
static inline void limit_opacity(const nb_trace_job *job, nb_real transmittance[3], nb_real radiance[3])
{
    if (!(job->max_opacity < 1)) return;
    const nb_real most = REAL(job->max_opacity), least = REAL(1 - job->max_opacity);
    for (int c = 0; c < 3; c++) {
        const nb_mask beyond = transmittance[c] < least;
        const nb_real limited = nb_min(radiance[c] * (most / nb_max(NB_F(1.0) - transmittance[c], most)), radiance[c]);
        radiance[c] = nb_select(beyond, limited, radiance[c]);
        transmittance[c] = nb_select(beyond, least, transmittance[c]);
    }
}

/* Bounds of the absolute error: of transmittance, of radiance. */
typedef struct packet_bounds {
    nb_real transmittance, radiance;
} packet_bounds;

/* Where fog may be or not over a length that matters, light is what any fog there gives where it is opaque, at most. */
static nb_real doubtful_light(const packet_state *m, const gathered_light *g, int c)
{
    const nb_mask in_doubt = nb_narrow_mask(m->doubt_from <= NB_WFAR);
    if (m->total != NULL || !nb_any(in_doubt)) return NB_F(0.0);
    nb_real most = m->doubtful_radiance[c];
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        if (!nb_volume_has_fog(&k->medium->body)) continue;
        const nb_mask met = nb_narrow_mask(k->hull_enter < k->hull_leave);
        most = nb_max(most, nb_select(met, opaque_radiance(k, c), NB_F(0.0)));
    }
    const nb_real seen = nb_exp(-g->clear_depth[c]) * (NB_F(1.0) + NB_F(8.0) * LARGEST_DOUBT);
    return nb_select(in_doubt, nb_min(most, NB_HUGE) * seen, NB_F(0.0));
}

/* Transmittance below the smallest normal number is 0: this is what fog behind that may still shine. */
static nb_real flushed_light(const packet_state *m, const gathered_light *g, int c)
{
    const nb_mask flushed = g->transmittance[c] < SMALLEST;
    nb_real light = NB_F(0.0);
    for (size_t i = 0; i < m->contact_count && nb_any(flushed); i++) {
        const medium_hit *k = &m->contacts[i];
        const nebel_density *density = &k->medium->body.density;
        const nb_real length = nb_narrow(nb_wmax(k->hull_leave - k->hull_enter, NB_W(0.0)));
        const nb_real reach = grows_without_bound(density) ? nb_min(length * NB_HUGE, NB_HUGE) : length;
        light = light + nb_min(k->light[c] * reach, nb_min(opaque_radiance(k, c), NB_HUGE));
    }
    return nb_select(flushed, light * SMALLEST, NB_F(0.0));
}

/* exp(-depth) is steepest on the thin side, so the transmittance errs most where the optical depth is less by its
 * error. Ends that are watched have been counted on the way. */
static packet_bounds bound_errors(const packet_state *m, const gathered_light *g)
{
    const nb_mask watched = ends_matter(m);
    const nb_real pieces = m->event_count + NB_F(4.0);
    nb_real transmittance = NB_F(0.0), radiance = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real end_depth = nb_select(watched, m->grazing_ends.depth[c], m->all_ends.depth[c]);
        const nb_real end_light = nb_select(watched, m->grazing_ends.light[c], m->all_ends.light[c]);
        const nb_real error = (end_depth + g->depth_error[c]) * (NB_F(1.0) + NB_F(8.0) * NB_EPSILON);
        const nb_real rise = nb_exp(-nb_max(g->depth[c] - error, g->least_depth[c])) - g->transmittance[c];
        const nb_real rounding = g->transmittance[c] * (error + NB_F(4.0) * NB_EPSILON);
        const nb_real other = (NB_F(4.0) * NB_EPSILON + m->event_count * LEAST_DOUBT) * g->transmittance[c] + SMALLEST;
        transmittance = nb_max(transmittance, nb_max(rise, nb_min(rounding, g->transmittance[c])) + other);
        const nb_real hidden = doubtful_light(m, g, c) + flushed_light(m, g, c);
        radiance = nb_max(radiance, end_light + hidden + m->event_count * LEAST_DOUBT +
                                        g->radiance[c] * (nb_min(end_depth, NB_F(1.0)) + pieces * NB_EPSILON));
    }
    /* fog that the ray may only graze is not among what it met */
    const nb_mask grazes = largest(m->grazing_ends.light) > NB_F(0.0);
    const nb_real met = nb_max(nb_max(most_radiance(m, 0), most_radiance(m, 1)), most_radiance(m, 2));
    const nb_real most = nb_select(grazes, NB_HUGE, met);
    return (packet_bounds){transmittance,
                           nb_min(radiance + g->radiance_error, most * (NB_F(1.0) + NB_F(8.0) * NB_EPSILON))};
}

/* Another bound, which holds whatever the ends and the integration do: all light comes from media that give between the
 * least and the most light per extinction, so that the radiance is between these two times 1 - T. */
static nb_real bound_by_range(const packet_state *m, const gathered_light *g, nb_real transmittance_error)
{
    const nb_mask grazes = largest(m->grazing_ends.light) + largest(m->grazing_ends.depth) > NB_F(0.0);
    nb_real bound = transmittance_error;
    for (int c = 0; c < 3; c++) {
        nb_real least = NB_HUGE, most = NB_F(0.0);
        for (size_t i = 0; i < m->contact_count; i++) {
            const medium_hit *k = &m->contacts[i];
            if (!nb_volume_has_fog(&k->medium->body)) continue;
            const nb_mask counts =
                nb_and(nb_narrow_mask(k->hull_enter < k->hull_leave), k->extinction[c] + k->light[c] > NB_F(0.0));
            least = nb_select(counts, nb_min(shaded_radiance(k, c), least), least);
            most = nb_select(counts, nb_max(opaque_radiance(k, c), most), most);
        }
        const nb_real absorbed = NB_F(1.0) - g->transmittance[c];
        const nb_real high = most * nb_min(absorbed + transmittance_error, NB_F(1.0));
        const nb_real low = nb_min(least, most) * nb_max(absorbed - transmittance_error, NB_F(0.0));
        const nb_real apart = nb_max(high - g->radiance[c], g->radiance[c] - low);
        bound = nb_max(bound, apart + most * (NB_F(16.0) * NB_EPSILON));
    }
    return nb_select(grazes, NB_HUGE, bound);
}

/* What limited opacity adds to the error of radiance S: most / (1 - T) is off by most / (1 - T)^2 times the error of T,
 * where it is below 1; but what it leaves is never more than S. That of T grows by the rounding of the limit alone. */
static packet_bounds limit_errors(const nb_trace_job *job, const gathered_light *g, packet_bounds b)
{
    if (!(job->max_opacity < 1)) return b;
    const nb_real most = REAL(job->max_opacity);
    nb_real radiance = b.radiance;
    for (int c = 0; c < 3; c++) {
        const nb_real opacity = NB_F(1.0) - g->transmittance[c];
        const nb_real least = nb_max(opacity - b.transmittance, most);
        const nb_real steepness = nb_min(most / (least * least) * b.transmittance + NB_F(8.0) * NB_EPSILON, NB_F(1.0));
        const nb_mask never = opacity + b.transmittance < most * (NB_F(1.0) - NB_F(4.0) * NB_EPSILON);
        radiance = nb_max(radiance, b.radiance + nb_select(never, NB_F(0.0), g->radiance[c] * steepness));
    }
    return (packet_bounds){b.transmittance + NB_F(2.0) * NB_EPSILON, radiance};
}

/* The bound of the absolute error of all six numbers, with room for the rounding of its own arithmetic. */
static nb_real reported_error(const nb_trace_job *job, const packet_state *m, const gathered_light *g)
{
    const nb_real own_rounding = NB_F(1.0) + NB_F(16.0) * NB_EPSILON;
    packet_bounds b = bound_errors(m, g);
    if (job->transmittance_only) return limit_errors(job, g, b).transmittance * own_rounding;
    const nb_mask doubtful = nb_not(b.radiance <= REAL(job->promised));
    if (nb_any(doubtful))
        b.radiance = nb_select(doubtful, nb_min(b.radiance, bound_by_range(m, g, b.transmittance)), b.radiance);
    b = limit_errors(job, g, b);
    return nb_max(b.transmittance, b.radiance) * own_rounding;
}

static void store_light(const nb_trace_job *job, const gathered_light *g, nb_real error, size_t first, size_t count)
{
    nb_scalar lane[7][NB_WIDTH];
    for (int c = 0; c < 3; c++) {
        nb_store_lanes(lane[c], g->transmittance[c]);
        nb_store_lanes(lane[3 + c], g->radiance[c]);
    }
    nb_store_lanes(lane[6], error);
    for (size_t i = 0; i < count; i++) {
        nebel_transfer *transfer = nb_stride_to(job->transfers, job->transfer_stride, first + i);
        for (int c = 0; c < 3; c++) {
            transfer->transmittance[c] = (double)lane[c][i];
            transfer->in_scattering[c] = (double)lane[3 + c][i];
        }
        transfer->error = (double)lane[6][i];
    }
}

static size_t packet_size(const nb_trace_job *job, size_t first)
{
    return job->count - first < NB_WIDTH ? job->count - first : NB_WIDTH;
}

/* Of the largest radiance. Gauss's rule errs by some thousandth of what is proved. Within this budget steps that fall
 * differently, because a volume is cut or a ray begins elsewhere, change no more than rounding in float does. */
#define LARGEST_BUDGET 3e-4

/* Where the budget goes: most by loss of transmittance and by length, a tenth to the last steps of the pieces, of which
 * there are at most two per leaf. */
static allowance share_budget(const nb_trace_job *job)
{
    const double most = job->lighting->largest_radiance;
    const double radiance = most > 1 ? most : 1;
    const double budget = fmin(job->budget, LARGEST_BUDGET * radiance);
    return (allowance){job->transmittance_only, REAL(0.14 * budget), REAL(0.4 * budget), REAL(0.1 * budget),
                       choose_ellipse(budget / radiance)};
}

/* The light along the rays of w->m before its opacity is limited, of which `count` count, the first of them by the
 * number `first`. */
static nebel_result answer_packet(nb_trace_job *job, workspace *w, const allowance *may, size_t first, size_t count,
                                  gathered_light *g)
{
    job->failed = first;
    w->m.wants_error = job->wants_error;
    w->m.ignores_distances = job->ignore_distances;
    if (w->m.sun != NULL && job->lighting->scatters_lights) w->m.point_lights = max_of_lights(&w->m);
    if (!meet_fog(w, job->lighting)) return NEBEL_ERROR_MEMORY;
    allowance share = *may;
    const nb_real pieces = w->m.event_count + NB_F(1.0);
    share.last_share = share.last_share / pieces;
    share.length_share = share.length_share / pieces;
    nb_mask unbounded;
    if (w->m.sun != NULL) begin_lights(w->m.sun, job, first, count);
    *g = gather_light(&w->m, &share, &unbounded);
    if (w->m.sun != NULL && takes_common_steps(job->lighting)) gather_overlap_lights(w->m.sun, &w->m, g);
    if (w->m.sun != NULL && w->m.sun->out_of_memory) return NEBEL_ERROR_MEMORY;
    limit_radiance(&w->m, g);
    for (size_t i = 0; i < count && nb_any(unbounded); i++)
        if (nb_lane(unbounded, i)) {
            job->failed = first + i;
            return NEBEL_ERROR_UNBOUNDED;
        }
    return NEBEL_OK;
}

#include "trace_escalate.h"

static nebel_result trace_packet(nb_trace_job *job, workspace *w, const allowance *may, size_t first)
{
    const size_t count = packet_size(job, first);
    const nebel_ray *rays = nb_stride_from(job->rays, job->ray_stride, first);
    gathered_light g;
    w->m.rays = load_packet(rays, job->ray_stride, count);
    const nebel_result result = answer_packet(job, w, may, first, count, &g);
#if defined(ASKS_QUAD)
    if (result != NEBEL_ERROR_MEMORY && !is_clear(&w->m, largest(g.radiance))) return ask_again(job, first);
#endif
    if (result != NEBEL_OK) return result;
    nb_real error = reported_error(job, &w->m, &g);
#if !defined(NB_DOUBLE)
    limit_opacity(job, g.transmittance, g.radiance);
    error = settle_doubts(job, &g, error, rays, job->ray_stride, count);
#else
#if !defined(ASKS_QUAD)
    error = weigh_ends(job, w, may, &g, error);
#endif
    limit_opacity(job, g.transmittance, g.radiance);
#endif
    store_light(job, &g, error, first, count);
    return NEBEL_OK;
}

static nebel_result trace_structures(nb_trace_job *job, workspace *w, const allowance *may)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < job->count && result == NEBEL_OK; i += NB_WIDTH) result = trace_packet(job, w, may, i);
    return result;
}

#if !defined(NB_DOUBLE)
#include "trace_planes.h"
#endif

static nebel_result trace_job(nb_trace_job *job, workspace *w)
{
    const allowance may = share_budget(job);
#if defined(NB_DOUBLE)
    return trace_structures(job, w, &may);
#else
    return job->ray_planes == NULL ? trace_structures(job, w, &may) : trace_planes(job, w, &may);
#endif
}

/* What part of the budget the sun may spend, or all point lights: nothing but lights spends any in fog of one medium.
 * */
static double share_of_light(const nebel_lighting *lighting)
{
    const double all = lighting->snapshot->medium_count == 1 ? 0.9 : 0.3;
    return all / (double)(lighting->scatters_sun + lighting->scatters_lights);
}

/* With a second march, to the lights. */
static nebel_result trace_lit(nb_trace_job *job, workspace *w)
{
    const nebel_lighting *lighting = job->lighting;
    const nebel_snapshot *snapshot = lighting->snapshot;
    workspace way;
    nb_wide turns[STACK_TURNS];
    lit_shadow shadows[STACK_SHADOWS];
    sunlight sun = {.lighting = lighting,
                    .snapshot = snapshot,
                    .direction = unit_vector(wide_vector(lighting->to_sun)),
                    .way = &way,
                    .turns = turns,
                    .turn_capacity = STACK_TURNS,
                    .shadows = shadows,
                    .shadow_capacity = STACK_SHADOWS,
                    .light_lattices = job->light_lattices,
                    .share = share_of_light(lighting) * job->budget};
    if (!open_light_shades(&sun, job)) return NEBEL_ERROR_MEMORY;
    open_workspace(&way);
    w->m.sun = &sun;
    const nebel_result result = trace_job(job, w);
    nb_release(&snapshot->allocator, sun.turn_memory);
    nb_release(&snapshot->allocator, sun.shadow_memory);
    nb_release(&snapshot->allocator, sun.shade_memory);
    close_workspace(&way, &snapshot->allocator);
    return result;
}

nebel_result NB_SUFFIXED(nb_trace_)(nb_trace_job *job)
{
#if !defined(NB_DOUBLE)
    if (job->ray_planes != NULL && is_straight(job)) return trace_all_straight(job);
#endif
    workspace w;
    open_workspace(&w);
    const int is_lit = (job->lighting->scatters_sun || job->lighting->scatters_lights) && !job->transmittance_only;
#if defined(NB_DOUBLE)
    w.m.wants_sky = 1; /* more digits are asked by what light may be off, also where transmittance alone is wanted */
#else
    w.m.wants_sky = !job->transmittance_only;
#endif
    const nebel_result result = is_lit ? trace_lit(job, &w) : trace_job(job, &w);
    close_workspace(&w, &job->snapshot->allocator);
    return result;
}

#if defined(NB_DOUBLE)
#include "trace_invert.h"
#endif
