/* Sunlight that fog scatters towards the eye, once: along a piece of the ray the integral of
 *
 *     glow(t) e^-(depth(t) + depth to the sun(t)),
 *
 * where glow is what full sunlight would add. Depth up to t is exact; the depth to the sun is that of a march of its
 * own from there. As a function of t it is smooth but for *turns*: where the ray to the sun begins or ends to meet a
 * body, or passes one of its edges. At the silhouette of a round body it has the steepness of a root there. So steps go
 * from turn to turn, on a scale that flattens roots at their ends, and are shortened until what the rule may miss
 * (trace_lit_quadrature.h) is less than the budget. Where the whole depth is linear in that along the ray from turn to turn, a
 * step has a closed form instead. Included by trace_kernel.c, which makes packets and workspaces. */

#define MOST_SUN_STEPS 4096

/* More media than this have their turns found by halving alone. */
#define MOST_TURNING_MEDIA 256

/* More turns than these take memory once. */
#define STACK_TURNS 64

/* Where surfaces keep the sun away, lane by lane. A lane passes its boundaries once, as its pieces come along the ray. */
typedef struct sun_attenuation {
    const float *boundaries; /* NULL: the sun reaches all */
    size_t next[NB_WIDTH], end[NB_WIDTH];
    nb_scalar dark[NB_WIDTH]; /* 1 where the sun is kept away before the next boundary */
    nb_wide boundary;         /* the next one of each lane */
    nb_wmask is_dark;
} sun_attenuation;

/* What sunlight needs besides the march of the rays. */
typedef struct sunlight {
    const nebel_lighting *lighting;
    const nebel_snapshot *snapshot; /* of the lighting */
    nb_wvec3 direction;             /* of length 1, in all lanes */
    workspace *way;                 /* from places on the rays to the sun */
    nb_wide *turns;                 /* of all media in all lanes, in any order; NB_WFAR and more: none */
    size_t turn_count, turn_capacity;
    int has_turns;           /* of the packet at hand */
    const nb_light *turning; /* they are this point light's; NULL: the sun's */
    void *turn_memory;
    struct lit_shadow *shadows; /* see trace_lit_shadow.h */
    size_t shadow_count, shadow_capacity, first_shadow;
    void *shadow_memory;
    sun_attenuation shade;
    sun_attenuation *light_shades; /* of each point light; NULL: surfaces keep none away */
    void *shade_memory;
    double share;       /* what steps may add to the error of radiance, all together: of the sun, of all point lights */
    nb_real brightest;  /* radiance of the fog of the piece at hand in full sunlight, at most */
    nb_real most_light; /* and how much of that is seen from the step at hand */
    int has_common_steps;                    /* where these are gone, */
    nb_mask takes_columns;                   /* these lanes have depths from columns and lattices, */
    nb_real doubted;                         /* by which light of the sun, or of point lights so far, may be off */
    const nb_light_lattices *light_lattices; /* NULL: none */
    int out_of_memory;
    nb_real by_sun[3], by_lights[3]; /* of the packet's radiance, before opacity is limited */
} sunlight;

/* Adds what radiance has gained to a group's part of it. */
static void note_group(nb_real part[3], const nb_real before[3], const gathered_light *g)
{
    for (int c = 0; c < 3; c++) part[c] = part[c] + (g->radiance[c] - before[c]);
}

/* What a phase function makes of light that turns so, per steradian. */
static nb_real scattered(const nb_phase *phase, nb_turn turn)
{
    nb_real value = NB_F(0.0);
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        value = value + nb_phase_lobe(REAL(lobe->factor), REAL(lobe->alpha), REAL(lobe->peak), REAL(lobe->slope), turn);
    }
    return value;
}

static void set_glow(medium_hit *k, const packet *rays, const sunlight *sun)
{
    const nb_medium *medium = k->medium;
    const nb_real value = scattered(&medium->body.phase, nb_turn_between(rays->direction, sun->direction));
    for (int c = 0; c < 3; c++) k->glow[c] = REAL(k->lit->shine[c] * medium->body.extinction[c]) * value;
}

#include "trace_breakpoints.h"

#include "trace_lit_quadrature.h"

/* ---- turns ----------------------------------------------------------------------------------- */

static int is_ball_alone(const sunlight *sun)
{
    const nb_medium *medium = &sun->snapshot->media[0];
    return sun->lighting->sun_depth_method == NB_SUN_DEPTH_ADDED && sun->snapshot->medium_count == 1 &&
           medium->body.leaves[0].type == NB_LEAF_SPHERE;
}

/* Those of the point light, or of the sun where it is NULL. Returns whether they were not there yet. */
static int find_turns(sunlight *sun, const packet *rays, const nb_light *point_light)
{
    if (sun->has_turns && sun->turning == point_light) return 0;
    sun->turn_count = 0;
    sun->has_turns = 1;
    sun->turning = point_light;
    if (point_light != NULL || !is_ball_alone(sun))
        note_media(sun, rays, point_light); /* inside a ball there are none */
    return 1;
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

static void look_ahead(sun_attenuation *s)
{
    lane_place lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; i++)
        lane[i] = s->next[i] < s->end[i] ? (lane_place)s->boundaries[s->next[i]] : (lane_place)2e18;
    s->boundary = load_places(lane);
    s->is_dark = nb_widen_mask(nb_load_lanes(s->dark) > NB_F(0.0));
}

/* Of `count` rays, of which `first` are the boundaries' first; NULL: light reaches all. */
static void begin_shade(sun_attenuation *s, const uint32_t *first, const float *boundaries, size_t count)
{
    *s = (sun_attenuation){.boundaries = boundaries};
    for (size_t i = 0; first != NULL && i < count; i++) {
        s->next[i] = first[i];
        s->end[i] = first[i + 1];
    }
    look_ahead(s);
}

/* Passes the boundaries up to t. */
static void pass_boundaries(sun_attenuation *s, nb_wide t, nb_wmask lanes)
{
    const nb_wmask passes = nb_wand(lanes, s->boundary <= t);
    if (!nb_wany(passes)) return;
    for (int i = 0; i < NB_WIDTH; i++) {
        if (!nb_lane(passes, i)) continue;
        const lane_place here = nb_lane(t, i);
        for (; s->next[i] < s->end[i] && (lane_place)s->boundaries[s->next[i]] <= here; s->next[i]++)
            s->dark[i] = 1 - s->dark[i];
    }
    look_ahead(s);
}

#if !defined(NB_DOUBLE)
#include "trace_sun_columns.h"
#include "trace_light_lattice.h"
#endif
#include "trace_shadow_ray.h"

/* ---- steps ----------------------------------------------------------------------------------- */

struct light_pass;

typedef struct sun_step {
    const struct light_pass *point_light; /* NULL: of the sun */
    nb_wide start;
    nb_swing swing;                                      /* of a point light alone */
    nb_real length;                                      /* m; of a point light in the counting of its swing */
    nb_real scale[3];                                    /* of the step: x = s (scale[0] + s (scale[1] + s scale[2])) */
    nb_real before[3], depth_before[3], error_before[3]; /* transmittance and depth up to its start */
    nb_real depth[3], depth_error[3];                    /* from the ray's origin to its end */
    nb_real behind[3];                                   /* transmittance at its end */
    nb_real light[3];
    nb_real error;                /* of the rule, worst channel */
    nb_real rounding;             /* of its terms */
    nb_real noise;                /* of that, what no shorter step makes less */
    nb_real steepness;            /* see unseen_light */
    nb_real drop;                 /* largest loss of transmittance over it */
    nb_real most;                 /* no more light is in it */
    nb_mask is_rough;             /* it is in voxels */
    nb_wmask knows_start;         /* the way to the light from its start is known */
    nb_wmask to_stop;             /* it ends where the light may have a kink or a jump */
    light_depth at_start, at_end; /* the ways to the light from both ends */
    nb_wide amount;               /* of a grid alone: the density's integral over it, which may be off by so much */
    nb_real amount_error;
} sun_step;

/* From where the ray meets the piece to `end`, of all media there: optical depth and its error. */
static void depth_until(const packet_state *m, const ray_segment *p, const gathered_light *g, nb_wide end,
                        nb_real depth[3], nb_real error[3])
{
    for (int c = 0; c < 3; c++) {
        depth[c] = g->depth[c];
        error[c] = g->depth_error[c];
    }
    const nb_real h = nb_narrow(end - p->start);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_estimate along = contact_integral(k, p->start, end, h);
        for (int c = 0; c < 3; c++) {
            depth[c] = depth[c] + nb_select(k->inside, k->extinction[c] * along.value, NB_F(0.0));
            error[c] = error[c] + nb_select(k->inside, k->extinction[c] * along.error, NB_F(0.0));
        }
    }
}

typedef nb_real real_fn(nb_real x);

static inline nb_real transmitted(nb_real depth)
{
    return nb_exp(-depth);
}

/* Of each channel; once where all have the same depth to the bit. */
static inline __attribute__((always_inline)) void map_channels(const nebel_snapshot *snapshot, real_fn *f,
                                                               const nb_real x[3], nb_real out[3])
{
    out[0] = out[1] = out[2] = f(x[0]);
    for (int c = 1; c < 3 && !snapshot->is_gray; c++) out[c] = f(x[c]);
}

static void transmittance_until(const packet_state *m, const ray_segment *p, const gathered_light *g, nb_wide end,
                                nb_real behind[3])
{
    nb_real depth[3], error[3];
    depth_until(m, p, g, end, depth, error);
    map_channels(m->sun->snapshot, transmitted, depth, behind);
}

/* Flat where the step begins or ends at a turn. */
static void set_scale(sun_step *s, nb_mask first, nb_mask last)
{
    const nb_real zero = NB_F(0.0), one = NB_F(1.0), two = NB_F(2.0);
    s->scale[0] = nb_select(first, zero, nb_select(last, two, one));
    s->scale[1] = nb_select(first, nb_select(last, NB_F(3.0), one), nb_select(last, -one, zero));
    s->scale[2] = nb_select(nb_and(first, last), -two, zero);
}

/* How far from an end, as a part of the step, the light there is looked at: at a body's face itself the way to the light
 * may run along it. */
#define STEP_MARGIN 1e-9
#define MOST_MARGIN 1e-3

static nb_real scaled_place(const sun_step *s, nb_real at)
{
    return at * (s->scale[0] + at * (s->scale[1] + at * s->scale[2]));
}

static nb_real scaled_speed(const sun_step *s, nb_real at)
{
    return s->scale[0] + at * (NB_F(2.0) * s->scale[1] + NB_F(3.0) * at * s->scale[2]);
}

/* Where the light is looked at that node n stands for: not on an end where it may have a kink or a jump, but beside it. */
static nb_wide place_of_node(const sun_step *s, nb_wide end, int n)
{
    const nb_wide margin = nb_wmin((end - s->start) * WIDE(STEP_MARGIN), WIDE(MOST_MARGIN));
    if (n == 0) return nb_wselect(s->knows_start, s->start, s->start + margin);
    if (n == SUN_NODES - 1) return nb_wselect(s->to_stop, end - margin, end);
    const nb_wide x = nb_widen(s->length * scaled_place(s, REAL(sun_nodes[n])));
    return s->point_light != NULL ? nb_swing_place(s->swing, x) : s->start + x;
}

/* What fog is at a place of a step, of all media: extinction, and what it makes of light. `most` is of the brightest. */
typedef struct lit_fog {
    nb_real extinction[3], glow[3], most;
} lit_fog;

static lit_fog sunlit_fog(const packet_state *m, nb_wide t)
{
    const nb_real zero = NB_F(0.0);
    lit_fog fog = {{zero, zero, zero}, {zero, zero, zero}, zero};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_real density = nb_select(k->inside, contact_density(k, t), zero);
        for (int c = 0; c < 3; c++) {
            fog.glow[c] = fog.glow[c] + k->glow[c] * density;
            fog.extinction[c] = fog.extinction[c] + k->extinction[c] * density;
            const nb_real radiance = k->glow[c] / nb_max(k->extinction[c], NB_TINY);
            fog.most = nb_select(k->inside, nb_max(fog.most, radiance), fog.most);
        }
    }
    return fog;
}

/* The depths up to both ends are known. */
static void depth_of_node(const sunlight *sun, const packet_state *m, const ray_segment *p, const gathered_light *g,
                          const sun_step *s, nb_wide t, int n, sun_node *at, nb_real error[3])
{
    if (n > 0 && n < SUN_NODES - 1) {
        depth_until(m, p, g, t, at->depth, error);
        map_channels(sun->snapshot, transmitted, at->depth, at->behind);
        return;
    }
    for (int c = 0; c < 3; c++) {
        at->depth[c] = n == 0 ? s->depth_before[c] : s->depth[c];
        at->behind[c] = n == 0 ? s->before[c] : s->behind[c];
        error[c] = n == 0 ? s->error_before[c] : s->depth_error[c];
    }
}

/* The rest of a node that stands for `length` of fog, m; of a point light the same times what it brings there. */
static void fill_node(const sunlight *sun, sun_node *at, const lit_fog *fog, nb_real length, const nb_real error[3],
                      const light_depth *to_light)
{
    map_channels(sun->snapshot, transmitted, to_light->depth, at->through);
    for (int c = 0; c < 3; c++) {
        at->way[c] = to_light->depth[c];
        at->noise[c] = (at->depth[c] + at->way[c] + NB_F(32.0)) * (NB_F(2.0) * NB_EPSILON);
        at->doubt[c] = nb_min(error[c] + to_light->error[c], NB_F(1.0)) + at->noise[c];
        at->light[c] = fog->glow[c] * length * (at->behind[c] * at->through[c]);
        at->amount[c] = fog->extinction[c] * length;
    }
    at->most = fog->most;
}

static light_depth way_to_light(sunlight *sun, const packet_state *m, const struct light_pass *pass, nb_wide t,
                                nb_wmask lanes);
static lit_fog point_lit_fog(const packet_state *m, const struct light_pass *pass, nb_wide t);
static nb_real max_of_light(const struct light_pass *pass, nb_wide start, nb_wide end);
static nb_real length_past_light(const sun_step *s, nb_wide t, int n);

/* What node n of a step stands for; `way` is known at a start that the step knows. */
static sun_node find_node(sunlight *sun, const packet_state *m, const ray_segment *p, const gathered_light *g,
                          const sun_step *s, nb_wide end, int n, const light_depth *way)
{
    const nb_wide t = place_of_node(s, end, n);
    const int by_light = s->point_light != NULL;
    const lit_fog fog = by_light ? point_lit_fog(m, s->point_light, t) : sunlit_fog(m, t);
    const nb_real length = by_light ? length_past_light(s, t, n) : s->length * scaled_speed(s, REAL(sun_nodes[n]));
    sun_node at;
    nb_real error[3];
    depth_of_node(sun, m, p, g, s, t, n, &at, error);
    fill_node(sun, &at, &fog, length, error, way);
    return at;
}

static void select_way(nb_mask mask, light_depth *to, const light_depth *from)
{
    select_reals(mask, to->depth, from->depth);
    select_reals(mask, to->error, from->error);
    to->signature = nb_select(mask, from->signature, to->signature);
}

static void take_sum(sun_step *s, const lit_sum *sum)
{
    for (int c = 0; c < 3; c++) s->light[c] = sum->light[c];
    s->error = sum->error;
    s->rounding = sum->rounding;
    s->noise = sum->noise;
    s->steepness = sum->steepness;
}

static nb_real count_media(const packet_state *m)
{
    nb_real count = NB_F(0.0);
    for (size_t i = m->present_first; i < m->present_end; i++)
        count = count + nb_select(present(m, i)->inside, NB_F(1.0), NB_F(0.0));
    return count;
}

/* Lane by lane: what a ray becomes must not depend on its company. */
static nb_mask lanes_in_voxels(const packet_state *m)
{
    nb_mask lanes = nb_mask_false;
    for (size_t i = m->present_first; i < m->present_end; i++)
        if (present(m, i)->medium->body.density.type == NEBEL_DENSITY_GRID) lanes = nb_or(lanes, present(m, i)->inside);
    return lanes;
}

static light_depth way_from(sunlight *sun, const packet_state *m, const sun_step *s, nb_wide end, int n, nb_wmask lanes)
{
    const nb_wide t = place_of_node(s, end, n);
    return s->point_light != NULL ? way_to_light(sun, m, s->point_light, t, lanes) : depth_to_sun(sun, m, t, lanes);
}

static void sum_light_nodes(sunlight *sun, const packet_state *m, const ray_segment *p, const gathered_light *g,
                            nb_wmask lanes, nb_wide end, sun_step *s)
{
    sun_node at[SUN_NODES];
    nb_mask kinked = nb_mask_false;
    if (!nb_wall(nb_wor(s->knows_start, nb_wnot(lanes)))) {
        const light_depth way = way_from(sun, m, s, end, 0, lanes);
        select_way(nb_narrow_mask(nb_wnot(s->knows_start)), &s->at_start, &way);
    }
    s->at_end = s->at_start;
    for (int n = 0; n < SUN_NODES; n++) {
        if (n > 0) s->at_end = way_from(sun, m, s, end, n, lanes);
        kinked = nb_or(kinked, nb_not(s->at_end.signature == s->at_start.signature));
        at[n] = find_node(sun, m, p, g, s, end, n, &s->at_end);
    }
    const nb_real most = s->point_light != NULL ? max_of_light(s->point_light, s->start, end) : at[0].most;
    const lit_sum sum = sum_nodes_of_step(at, most, count_media(m), sun->snapshot->is_gray);
    take_sum(s, &sum);
    const nb_mask rough = lanes_in_voxels(m);
    s->is_rough = rough;
    if (nb_any(rough))
        s->error = nb_select(rough, nb_max(s->error * VOXEL_CAUTION, VOXEL_CAUTION * off_cubics(at)), s->error);
    if (nb_any(kinked)) s->error = nb_select(kinked, nb_max(s->error, KINK_CAUTION * off_cubics(at)), s->error);
    /* ends are not looked at themselves */
    s->rounding =
        s->rounding + largest(s->light) * REAL(STEP_MARGIN) * nb_min(s->steepness, NB_F(1.0) / REAL(STEP_MARGIN));
}

/* Light is never more than what full light gives: `most` times the loss of transmittance. A better bound than the rule's
 * for steps that hardly take light away. */
static void limit_light(const nb_real before[3], const nb_real most[3], sun_step *s)
{
    nb_real crude = NB_F(0.0);
    s->drop = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real drop = nb_max(before[c] - s->behind[c], NB_F(0.0));
        const nb_real limit =
            most[c] * (drop + before[c] * (NB_F(8.0) * NB_EPSILON)); /* what rounds to 0 may be light */
        s->light[c] = nb_min(s->light[c], limit);
        s->drop = nb_max(s->drop, drop);
        crude = nb_max(crude, limit);
    }
    s->error = nb_min(s->error, crude);
    s->most = crude;
}

static void limit_step(const packet_state *m, const nb_real before[3], sun_step *s)
{
    nb_real most[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        for (int c = 0; c < 3; c++) {
            const nb_real radiance = k->glow[c] / nb_max(k->extinction[c], NB_TINY);
            most[c] = nb_select(k->inside, nb_max(most[c], radiance), most[c]);
        }
    }
    limit_light(before, most, s);
}

/* Where a lane's steps have come to. */
typedef struct sun_walk {
    nb_wide t;
    nb_wmask lanes, at_turn;
    nb_real left;             /* steps that the lane may still try before its next boundary */
    nb_wmask knows_way;       /* the way to the light from here, */
    light_depth way;          /* which is this */
    nb_real guess, before[3]; /* length of the next step; transmittance up to here */
    nb_real depth[3], depth_error[3];
    nb_wide along, along_error; /* of a grid: the integral of its density from the start of the piece up to here */
} sun_walk;

/* What steps of a piece share. */
typedef struct sun_piece {
    const ray_segment *p;
    gathered_light before; /* what was gathered before it */
    nb_real whole, pieces; /* its length; how many there may be */
    nb_mask rough; /* lanes in voxels, which are integrated from step to step: a walk to every node would be long */
} sun_piece;

static sun_piece sun_piece_of(const packet_state *m, const ray_segment *p, const gathered_light *g, nb_mask rough)
{
    return (sun_piece){p, *g, nb_max(p->length, NB_TINY), m->event_count + NB_F(1.0), rough};
}

/* From where depth is integrated, and what there is before that. */
typedef struct sun_origin {
    ray_segment p;
    gathered_light before;
} sun_origin;

static sun_origin origin_of(const sun_piece *s, const sun_walk *w)
{
    sun_origin from = {*s->p, s->before};
    if (!nb_any(s->rough)) return from;
    from.p.start = nb_wselect(nb_widen_mask(s->rough), w->t, from.p.start);
    for (int c = 0; c < 3; c++) {
        from.before.depth[c] = nb_select(s->rough, w->depth[c], from.before.depth[c]);
        from.before.depth_error[c] = nb_select(s->rough, w->depth_error[c], from.before.depth_error[c]);
    }
    return from;
}

/* `stops`: whether it ends where the light may have a kink or a jump. */
static sun_step begin_step(const sun_walk *w, nb_real length, nb_wmask stops)
{
    sun_step s = {.start = w->t,
                  .length = length,
                  .knows_start = w->knows_way,
                  .to_stop = stops,
                  .at_start = w->way,
                  .at_end = w->way,
                  .is_rough = nb_mask_false,
                  .amount = NB_W(0.0),
                  .amount_error = NB_F(0.0)};
    for (int c = 0; c < 3; c++) {
        s.before[c] = w->before[c];
        s.depth_before[c] = w->depth[c];
        s.error_before[c] = w->depth_error[c];
    }
    return s;
}

static void end_step(const packet_state *m, const ray_segment *p, const gathered_light *g, nb_wide end, sun_step *s)
{
    depth_until(m, p, g, end, s->depth, s->depth_error);
    map_channels(m->sun->snapshot, transmitted, s->depth, s->behind);
}

#include "trace_sun_sphere.h"
#include "trace_sun_closed.h"
#include "trace_sun_grid.h"

static sun_step try_step(sunlight *sun, const packet_state *m, const ray_segment *p, const gathered_light *g,
                         const sun_walk *w, nb_real length, nb_wide end, nb_wmask turns, nb_wmask stops)
{
    if (is_grid_alone(sun)) return try_grid_step(sun, m, g, w, length, end);
    if (is_ball_alone(sun)) {
        sun_step s = try_ball_step(sun, m, p, g, w, length, end);
        limit_step(m, w->before, &s);
        return s;
    }
    sun_step s = begin_step(w, length, stops);
    set_scale(&s, nb_narrow_mask(w->at_turn), nb_narrow_mask(turns));
    end_step(m, p, g, end, &s);
    sum_light_nodes(sun, m, p, g, w->lanes, end, &s);
    limit_step(m, w->before, &s);
    return s;
}

/* The lanes that are inside fog which the sun lights. */
static nb_mask sunlit_lanes(const packet_state *m, const ray_segment *p)
{
    nb_mask lit = nb_mask_false;
    for (size_t i = m->present_first; i < m->present_end; i++)
        if (present(m, i)->lit->scatters_sun) lit = nb_or(lit, present(m, i)->inside);
    return nb_and(lit, p->lanes);
}

#if !defined(NB_DOUBLE)
#include "trace_sun_lattice.h"
#endif

/* A first step of a few optical depths: endless pieces would be halved for ever. By their mean, and by the density where
 * they begin: light in dense fog comes from there. */
static nb_real first_guess(const packet_state *m, const ray_segment *p, const gathered_light *g)
{
    const nb_real few = NB_F(2.0);
    nb_real depth[3], error[3];
    depth_until(m, p, g, p->end, depth, error);
    const nb_real mean = p->length * (few / nb_max(largest(depth) - largest(g->depth), few));
    return nb_min(mean, few * nb_rcp_bounded(largest(sunlit_fog(m, p->start).extinction)));
}

static sun_walk begin_walk(const packet_state *m, const ray_segment *p, const gathered_light *g, nb_mask lanes)
{
    sun_walk w = {.t = p->start,
                  .lanes = nb_widen_mask(lanes),
                  .at_turn = nb_wmask_false,
                  .left = NB_F(1.0) * MOST_SUN_STEPS,
                  .knows_way = nb_wmask_false,
                  .way = no_depth(),
                  .along = NB_W(0.0),
                  .along_error = NB_W(0.0),
                  .guess = first_guess(m, p, g)};
    for (int c = 0; c < 3; c++) {
        w.before[c] = g->transmittance[c];
        w.depth[c] = g->depth[c];
        w.depth_error[c] = g->depth_error[c];
    }
    return w;
}

/* What a step is shortened to that does not fit: to half of it, or to where the light has changed by as much as the rule
 * likes, by how steep it is where the step begins; not by more than that at once. */
#define BEST_CHANGE 0.55
#define LEAST_PART 1e-4

/* Steps whose error is so much less than it may be are followed by longer ones. */
#define EASY NB_F(32.0)

/* The length of the next step after one of which `error` is known and `allowed`. */
static nb_real length_of_next(const sun_step *s, nb_real guess, nb_mask taken, nb_real allowed)
{
    const nb_real share = REAL(BEST_CHANGE) / nb_max(s->steepness, REAL(BEST_CHANGE));
    const nb_real shorter = s->length * nb_clamp(share, REAL(LEAST_PART), NB_F(0.5));
    const nb_mask easy = s->error * EASY <= allowed;
    const nb_real longer = nb_max(guess, nb_select(easy, s->length + s->length, s->length));
    return nb_select(taken, longer, shorter);
}

/* Light may come to voxels through gaps that no node sees, where all nodes are in the dark. What is told is at least this
 * part of what a step may add. */
#define GAP_SHARE REAL(1.0 / 3)

static void take_sun_step(gathered_light *g, sun_walk *w, const sun_step *s, nb_wide end, nb_wmask turns, nb_mask taken,
                          nb_real allowed)
{
    for (int c = 0; c < 3; c++) {
        g->radiance[c] = g->radiance[c] + nb_select(taken, s->light[c], NB_F(0.0));
        w->before[c] = nb_select(taken, s->behind[c], w->before[c]);
        w->depth[c] = nb_select(taken, s->depth[c], w->depth[c]);
        w->depth_error[c] = nb_select(taken, s->depth_error[c], w->depth_error[c]);
    }
    const nb_real gaps = nb_select(s->is_rough, nb_min(s->most, allowed) * GAP_SHARE, NB_F(0.0));
    const nb_real told = nb_max(s->error * REAL(ESTIMATE_MARGIN), gaps);
    const nb_real error = told + s->rounding + largest(g->radiance) * NB_EPSILON;
    g->radiance_error = g->radiance_error + nb_select(taken, error, NB_F(0.0));
    const nb_wmask moved = nb_widen_mask(taken);
    const nb_wide along = w->along + s->amount;
    w->along = nb_wselect(moved, along, w->along);
    w->along_error = nb_wselect(moved, w->along_error + nb_widen(s->amount_error), w->along_error);
    w->t = nb_wselect(moved, end, w->t);
    w->at_turn = nb_wor(nb_wand(moved, turns), nb_wand(nb_wnot(moved), w->at_turn));
    select_way(taken, &w->way, &s->at_end);
    select_way(nb_not(taken), &w->way, &s->at_start);
    w->knows_way = nb_wor(nb_wnot(moved), nb_wnot(s->to_stop));
    w->guess = length_of_next(s, w->guess, taken, allowed);
}

static void step_along(sunlight *sun, const packet_state *m, const sun_piece *s, sun_walk *w, gathered_light *g)
{
    const nb_mask last = w->left <= NB_F(1.0); /* the rest is one step, whatever its error */
    const nb_wide bright = nb_wmin(sun->shade.boundary, s->p->end);
    const nb_wide kink = is_grid_alone(sun) ? nearest_border(m, w->t, bright) : nearest_kink(m, w->t, bright);
    const nb_wide next = nb_wmin(next_turn(sun, w->t, bright), kink);
    const nb_wide stop = nb_wselect(nb_widen_mask(last), bright, next);
    const nb_real rest = nb_narrow(stop - w->t), length = nb_select(last, rest, nb_min(w->guess, rest));
    const nb_wmask to_stop = nb_widen_mask(length >= rest);
    const nb_wide end = nb_wselect(to_stop, stop, w->t + nb_widen(length));
    const nb_wmask turns = nb_wand(to_stop, stop < bright);
    const sun_origin from = origin_of(s, w);
    sun->most_light = largest(w->before) * sun->brightest;
    const sun_step tried = try_step(sun, m, &from.p, &from.before, w, length, end, turns, to_stop);
    const nb_real least = tried.noise + tried.noise; /* what no shorter step makes less */
    const nb_real share = REAL(sun->share);
    const nb_real allowed = least + share * (NB_F(0.5) * tried.drop + NB_F(0.25) * (length / s->whole) / s->pieces +
                                             NB_F(0.001) / s->pieces);
    const nb_mask fits = nb_or(last, tried.error <= allowed);
    take_sun_step(g, w, &tried, end, turns, nb_and(fits, nb_narrow_mask(w->lanes)), allowed);
    w->left = w->left - NB_F(1.0);
}

/* Doubt at faces of less than this share of the tolerance is not looked into. */
#define FACE_SHARE 0.01

/* To where the sun comes back. */
static void pass_shadow(const sun_attenuation *shadow, const packet_state *m, const sun_piece *s, sun_walk *w,
                        nb_wmask dark)
{
    const nb_wide end = nb_wmin(shadow->boundary, s->p->end);
    const nb_mask lanes = nb_narrow_mask(dark);
    const sun_origin from = origin_of(s, w);
    sun_step passed;
    end_step(m, &from.p, &from.before, end, &passed);
    for (int c = 0; c < 3; c++) {
        w->before[c] = nb_select(lanes, passed.behind[c], w->before[c]);
        w->depth[c] = nb_select(lanes, passed.depth[c], w->depth[c]);
        w->depth_error[c] = nb_select(lanes, passed.depth_error[c], w->depth_error[c]);
    }
    w->left = nb_select(lanes, NB_F(1.0) * MOST_SUN_STEPS, w->left);
    w->at_turn = nb_wand(w->at_turn, nb_wnot(dark));
    w->knows_way = nb_wand(w->knows_way, nb_wnot(dark));
    w->t = nb_wselect(dark, end, w->t);
}

/* Light may run along the face in which a piece begins or ends: within the rounding of places there a way is inside or beside
 * it. What that does to light of `most` at t, in the lanes where fog is so dense that it matters. `pass` NULL: of the sun. */
static nb_real doubt_at_face(sunlight *sun, const packet_state *m, const struct light_pass *pass, nb_wide t,
                             nb_real most, nb_mask lanes)
{
    const nb_wide off = (sum_of_sizes(m->rays.origin) + nb_wabs(t)) * (NB_W(8.0) * NB_WEPSILON);
    const nb_real skin = largest(sunlit_fog(m, t).extinction) * nb_narrow(off);
    const nb_real doubt = nb_select(lanes, most * nb_min(skin, NB_F(1.0)), NB_F(0.0));
    const nb_mask matters = doubt > REAL(FACE_SHARE * sun->share);
    if (!nb_any(matters)) return doubt;
    nb_real beside[2][3], change = NB_F(0.0);
    for (int i = 0; i < 2; i++) {
        const nb_wide place = i == 0 ? t - off : t + off;
        const nb_wmask asked = nb_widen_mask(matters);
        const light_depth way =
            pass != NULL ? way_to_light(sun, m, pass, place, asked) : depth_to_sun(sun, m, place, asked);
        map_channels(sun->snapshot, transmitted, way.depth, beside[i]);
    }
    for (int c = 0; c < 3; c++) change = nb_max(change, nb_abs(beside[1][c] - beside[0][c]));
    return nb_select(matters, doubt * change, doubt);
}

/* At both ends of a piece. */
static nb_real doubt_at_faces(sunlight *sun, const packet_state *m, const struct light_pass *pass, const ray_segment *p,
                              nb_real most, nb_mask lanes)
{
    const nb_mask bounded = nb_and(lanes, nb_narrow_mask(p->end < NB_W(0.5) * NB_WFAR));
    return doubt_at_face(sun, m, pass, p->start, most, lanes) + doubt_at_face(sun, m, pass, p->end, most, bounded);
}

/* Adds the sunlight of a piece in the lanes that are lit; `g` is what was gathered before it. A lane's steps are its own.
 */
static void gather_sunlight(sunlight *sun, const packet_state *m, const ray_segment *p, nb_mask lit, gathered_light *g)
{
    if (!nb_any(lit)) return;
    (void)find_turns(sun, &m->rays, NULL);
    if (has_closed_steps(sun)) {
        gather_in_closed_form(sun, m, p, lit, g);
        return;
    }
    const sun_piece s = sun_piece_of(m, p, g, is_grid_alone(sun) ? nb_mask_false : lanes_in_voxels(m));
    sun->brightest = sunlit_fog(m, p->start).most;
    sun->most_light = largest(g->transmittance) * sun->brightest;
    g->radiance_error = g->radiance_error + doubt_at_faces(sun, m, NULL, p, sun->most_light, lit);
    sun_walk w = begin_walk(m, p, g, lit);
    while (nb_wany(w.lanes)) {
        pass_boundaries(&sun->shade, w.t, w.lanes);
        const nb_wmask dark = nb_wand(w.lanes, sun->shade.is_dark);
        if (nb_wany(dark) && is_grid_alone(sun)) pass_voxels(&sun->shade, m, p, &w, dark);
        if (nb_wany(dark))
            pass_shadow(&sun->shade, m, &s, &w, dark);
        else
            step_along(sun, m, &s, &w, g);
        w.lanes = nb_wand(w.lanes, w.t < p->end);
    }
}
