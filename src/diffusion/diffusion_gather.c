/* What light that was scattered more than once adds to rays, and what it takes from ambient light. */
#include "diffusion.h"

#include "base/stride.h"
#include "math/vector.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/phase.inc"

#define PI 3.14159265358979323846

/* Farther along an axis [m] no ray may begin, and none goes on. */
#define FAR (NEBEL_MAX_LENGTH * 0.999)

/* Steps that leave less than this are halved, so often at most: fog may begin anywhere in them. Where they leave more than
 * that they grow again. */
#define THICK 0.5
#define THIN 0.8
enum { MOST_HALVINGS = 5 };

/* What fog leaves less of does not matter. */
#define DARK 1e-4

/* g of no lobe of point lights' light that went almost straight on is more. */
#define MOST_GLOW 0.999

/* Rays that go on together, a step each. */
enum { BLOCK = NB_DIFFUSION_RAYS };

typedef struct walker {
    double origin[3], direction[3]; /* from the lattice's middle; of length 1 */
    double cosine;                  /* between it and the way to the sun */
    double t, enter, end;           /* m; the lattice begins at `enter`, if not at t; t >= end: done */
    double scaled[3], whole[3];     /* transmittance up to t, of scaled fog and of fog as it is */
    double source[3], once[3];      /* source radiance at t, of each of them */
    double diffuse[3];              /* of the former: what is diffuse */
    double lack[3], taken[3];       /* of ambient light at t: NB_NODE_DIMMED, NB_NODE_ABSORBED */
    double light[3], spread[3];     /* what was gathered, and what of it is diffuse */
    double dimmed[3];               /* of ambient light */
    int halvings;                   /* of steps, where fog is thick */
    const nb_diffusion *in;         /* whose nodes `source` and the others are of; NULL: not looked up */
} walker;

typedef struct nb_diffusion_block {
    const nebel_lighting *lighting;
    const nb_diffusion *diffusion;
    int is_rest; /* see nb_diffusion_gather */
    double middle[3];
    size_t count;
    walker walkers[BLOCK];
    double step[BLOCK];
    float offset[3][BLOCK], length[BLOCK], scaled[3][BLOCK], whole[3][BLOCK];
    double direction[3][BLOCK];
} nb_diffusion_block;

/* ---- source radiance ------------------------------------------------------------------------- */

static double lobe(double g, double cosine)
{
    const double rest = 1 - fabs(g);
    const nb_turn turn = {cosine, 1 - cosine, 1 + cosine};
    return nb_phase_lobe(rest * (1 + fabs(g)) / (4 * PI), 0, rest * rest, 2 * g, turn);
}

/* The eight nodes around a place, which is taken to the nearest one of the lattice, with their weights. */
static void find_nodes(const nb_diffusion_lattice *l, const double place[3], size_t nodes[8], double weights[8])
{
    size_t base[3];
    double part[3];
    for (int a = 0; a < 3; a++) {
        const double at = fmin(fmax((place[a] - l->low[a]) / l->spacing[a], 0), l->size[a]);
        base[a] = (size_t)fmin(floor(at), l->size[a] - 1.);
        part[a] = at - (double)base[a];
    }
    for (size_t k = 0; k < 8; k++) {
        const size_t x = base[0] + (k & 1u), y = base[1] + (k >> 1 & 1u), z = base[2] + (k >> 2);
        nodes[k] = x + (l->size[0] + 1u) * (y + (l->size[1] + 1u) * z);
        weights[k] = ((k & 1u) != 0 ? part[0] : 1 - part[0]) * ((k >> 1 & 1u) != 0 ? part[1] : 1 - part[1]) *
                     (k >> 2 != 0 ? part[2] : 1 - part[2]);
    }
}

static double mix(const nb_diffusion *d, const size_t nodes[8], const double weights[8], size_t number)
{
    double sum = 0;
    for (int k = 0; k < 8; k++) sum += weights[k] * (double)d->nodes[nodes[k] * d->node_numbers + number];
    return sum;
}

/* What is scattered of a field whose mean over directions and whose flux after scattering are the node's: a lobe with both
 * of these moments, whose mean cosine is `most` where all light goes one way; diffusion may say more. Linear in the cosine, as diffusion has it, it would be negative where the field goes one way. */
static double diffuse_source(const double numbers[4], double most, const double direction[3])
{
    const double *flux = &numbers[NB_NODE_FLUX], size = sqrt(nb_vector_dot(flux, flux));
    if (!(numbers[0] > 0) || !(size > 0)) return fmax(numbers[0], 0);
    const double cosine = fmin(fmax(-nb_vector_dot(flux, direction) / size, -1), 1);
    return 4 * PI * numbers[0] * lobe(fmin(size / numbers[0], most), cosine);
}

/* Where fog goes on beside a lattice, bodies in it are not seen any more. */
static const nb_diffusion *diffusion_at(const nb_diffusion *d, const double place[3])
{
    if (d->beside == NULL) return d;
    for (int a = 0; a < 3; a += 2) {
        const int is_outside = place[a] < d->lattice.low[a] || place[a] > d->lattice.high[a];
        if (d->lattice.ends[a][0] == NB_END_LEVEL && is_outside) return d->beside;
    }
    return d;
}

/* How much more of what is diffuse there is than a node says, in light of this direction. */
static double gain_of(const nb_diffusion *d, int c, const double direction[3])
{
    double gain = 0;
    for (int a = 0; a < 3; a++) gain += direction[a] * direction[a] * d->gain[c][a][direction[a] < 0];
    return gain;
}

/* What is linear in the direction of the light, which comes along the ray. */
static double along(const double numbers[4], const double direction[3])
{
    return numbers[0] - nb_vector_dot(&numbers[1], direction);
}

static void look_at_sky(const nb_diffusion *d, const size_t nodes[8], const double weights[8], int c, int own,
                        walker *w)
{
    double numbers[NB_NODE_SKY_NUMBERS];
    for (size_t k = 0; k < NB_NODE_SKY_NUMBERS; k++)
        numbers[k] = mix(d, nodes, weights, nb_diffusion_second_number(d, own) + k);
    w->lack[c] = along(&numbers[NB_NODE_DIMMED], w->direction);
    w->taken[c] = along(&numbers[NB_NODE_ABSORBED], w->direction);
}

static double look_at_moments(const nb_diffusion *d, const size_t nodes[8], const double weights[8], size_t first,
                              double most, const double direction[3])
{
    double numbers[4];
    for (size_t k = 0; k < 4; k++) numbers[k] = mix(d, nodes, weights, first + k);
    return diffuse_source(numbers, most, direction);
}

/* `g`: of what is turned. */
static void look_at_own(const nb_diffusion *d, const size_t nodes[8], const double weights[8], double g, int is_rest,
                        walker *w)
{
    const double most = fmax(g, 0);
    for (int c = 0; c < d->channel_count; c++) {
        const size_t first = (size_t)c * NB_NODE_NUMBERS + NB_NODE_DIFFUSE, second = nb_diffusion_second_number(d, c);
        w->diffuse[c] = gain_of(d, c, w->direction) * look_at_moments(d, nodes, weights, first, most, w->direction);
        w->source[c] =
            w->diffuse[c] + look_at_moments(d, nodes, weights, second + NB_NODE_OWN_TURNED, most, w->direction);
        w->lack[c] = w->taken[c] = w->once[c] = 0;
        if (!is_rest) continue;
        w->once[c] = look_at_moments(d, nodes, weights, second + NB_NODE_OWN_GLOW, MOST_GLOW, w->direction) -
                     look_at_moments(d, nodes, weights, second + NB_NODE_OWN_ONCE, most, w->direction);
    }
}

/* In the lattice that the piece is in. */
static void look(const nb_diffusion_block *b, walker *w)
{
    size_t nodes[8];
    double place[3], weights[8];
    for (int a = 0; a < 3; a++) place[a] = b->middle[a] + w->origin[a] + w->t * w->direction[a];
    const nb_diffusion *d = w->in;
    find_nodes(&d->lattice, place, nodes, weights);
    const double g = mix(d, nodes, weights, (size_t)d->channel_count * NB_NODE_NUMBERS), turned = lobe(g, w->cosine);
    if (d->is_own) {
        look_at_own(d, nodes, weights, g, b->is_rest, w);
        return;
    }
    for (int c = 0; c < b->diffusion->channel_count; c++) {
        const int own = d->channel_count == 1 ? 0 : c;
        w->lack[c] = w->taken[c] = 0;
        if (d->has_sky && b->is_rest) look_at_sky(d, nodes, weights, c, own, w);
        w->source[c] = w->once[c] = w->diffuse[c] = 0;
        if (!d->has_sun) continue;
        const size_t first = (size_t)own * NB_NODE_NUMBERS;
        w->diffuse[c] = gain_of(d, own, w->direction) *
                        look_at_moments(d, nodes, weights, first + NB_NODE_DIFFUSE, fmax(g, 0), w->direction);
        w->source[c] = w->diffuse[c] + turned * nb_exp(mix(d, nodes, weights, first + NB_NODE_TURNED));
        if (!b->is_rest) continue;
        w->once[c] = -turned * nb_exp(mix(d, nodes, weights, first + NB_NODE_ONCE));
        if (d->has_peaks)
            w->once[c] += mix(d, nodes, weights, first + NB_NODE_GLOW) *
                          lobe(mix(d, nodes, weights, first + NB_NODE_WIDTH), w->cosine);
    }
}

/* ---- along a ray ----------------------------------------------------------------------------- */

/* The part of a ray in the lattice, whose ends may go on for ever. */
static void clip(const nb_diffusion_lattice *l, const double middle[3], walker *w)
{
    for (int a = 0; a < 3; a++) {
        const double from = middle[a] + w->origin[a], d = w->direction[a];
        if (d != 0) w->end = fmin(w->end, (copysign(FAR, d) - from) / d);
        if (d != 0) w->t = fmax(w->t, (copysign(FAR, -d) - from) / d);
        if (d == 0 && fabs(from) > FAR) w->end = 0;
        for (int side = 0; side < 2; side++) {
            const double face = side ? l->high[a] : l->low[a], outwards = side ? d : -d;
            if (l->ends[a][side] == NB_END_LEVEL) continue;
            if (outwards > 0)
                w->end = fmin(w->end, (face - from) / d);
            else if (outwards < 0)
                w->enter = fmax(w->enter, (face - from) / d);
            else if (side ? from > face : from < face)
                w->end = 0;
        }
    }
    if (!(w->enter < w->end)) w->end = 0;
}

/* To the next cell, about: a cell's width along each axis where there are any. */
static double find_step(const nb_diffusion_lattice *l, const double middle[3], const walker *w)
{
    double step = w->end - w->t;
    if (w->t < w->enter) return w->enter - w->t;
    for (int a = 0; a < 3; a++) {
        const double at = middle[a] + w->origin[a] + w->t * w->direction[a], d = w->direction[a];
        if (l->size[a] == 1 || d == 0) continue;
        const double before = d > 0 ? l->low[a] - at : at - l->high[a],
                     behind = d > 0 ? at - l->high[a] : l->low[a] - at;
        const double width = 1e-6 * l->spacing[a];
        if (before > width)
            step = fmin(step, before / fabs(d));
        else if (behind < -width)
            step = fmin(step, l->spacing[a] / fabs(d));
    }
    return isfinite(step) ? ldexp(step, -w->halvings) : step;
}

static void start(nb_diffusion_block *b, size_t i, const nebel_ray *ray)
{
    const nb_diffusion *d = b->diffusion;
    walker *w = &b->walkers[i];
    *w = (walker){.end = ray->t_max};
    double size = 0, square = 0;
    for (int a = 0; a < 3; a++) size = fmax(size, fabs(ray->direction[a]));
    for (int a = 0; a < 3; a++) square += ray->direction[a] / size * (ray->direction[a] / size);
    if (!(size > 0) || !(w->end > 0)) w->end = 0;
    for (int a = 0; a < 3 && w->end > 0; a++) {
        w->origin[a] = ray->origin[a] - b->middle[a];
        w->direction[a] = ray->direction[a] / size / sqrt(square);
        w->cosine += w->direction[a] * d->to_sun[a];
    }
    for (int c = 0; c < 3; c++) w->scaled[c] = w->whole[c] = 1;
    w->cosine = fmin(fmax(w->cosine, -1), 1);
    if (w->end > 0) clip(&d->lattice, b->middle, w);
}

/* The weights of both ends of a step that leaves `transmittance`: the source is linear between them, the fog even. */
typedef struct nb_diffusion_ends {
    double first, last;
} nb_diffusion_ends;

static nb_diffusion_ends weigh(double transmittance)
{
    const double depth = transmittance > 1e-30 ? -nb_log(transmittance) : 70, taken = 1 - transmittance;
    const double last = depth > 1e-3 ? (taken - depth * transmittance) / depth : depth / 2 - depth * depth / 3;
    return (nb_diffusion_ends){taken - last, last};
}

/* 0: its step has to be smaller. */
static int is_fine(const nb_diffusion_block *b, size_t i)
{
    const walker *w = &b->walkers[i];
    int is_thick = 0;
    for (int c = 0; c < b->diffusion->channel_count; c++) is_thick |= (double)b->scaled[c][i] < THICK;
    return !is_thick || w->t < w->enter || w->halvings == MOST_HALVINGS || isinf(b->step[i]);
}

/* Which lattice a piece is in, and its nodes at where it begins. Bodies end at the faces of their lattice, as pieces do. */
static void enter(const nb_diffusion_block *b, walker *w, double step)
{
    double place[3];
    const double half = fmin(step, FAR) / 2;
    for (int a = 0; a < 3; a++) place[a] = b->middle[a] + w->origin[a] + (w->t + half) * w->direction[a];
    const nb_diffusion *in = diffusion_at(b->diffusion, place);
    if (in == w->in) return;
    w->in = in;
    look(b, w);
}

/* Without fog a piece has no light, whatever its ends have. */
static int is_empty(const nb_diffusion_block *b, size_t i)
{
    int is = 1;
    for (int c = 0; c < b->diffusion->channel_count; c++)
        is &= b->scaled[c][i] >= 1 && (!b->diffusion->has_peaks || b->whole[c][i] >= 1);
    return is;
}

/* To where the lattice begins, through fog that gives nothing of its light. */
static void go_to_lattice(nb_diffusion_block *b, size_t i)
{
    walker *w = &b->walkers[i];
    int is_dark = 1;
    for (int c = 0; c < b->diffusion->channel_count; c++) {
        w->scaled[c] = (double)b->scaled[c][i];
        w->whole[c] = b->diffusion->has_peaks ? (double)b->whole[c][i] : w->scaled[c];
        is_dark = is_dark && w->scaled[c] < DARK;
    }
    w->t = is_dark ? w->end : w->enter;
}

/* From t to the end of its step. */
static void advance(nb_diffusion_block *b, size_t i)
{
    walker *w = &b->walkers[i];
    const nb_diffusion *d = b->diffusion;
    int is_dark = 1, is_thin = 1;
    if (w->t < w->enter) {
        go_to_lattice(b, i);
        return;
    }
    if (is_empty(b, i)) {
        w->t += b->step[i];
        w->in = NULL;
        if (w->halvings > 0) w->halvings--;
        return;
    }
    enter(b, w, b->step[i]);
    const walker before = *w;
    w->t += b->step[i];
    if (isfinite(w->t)) look(b, w);
    for (int c = 0; c < d->channel_count; c++) {
        const double scaled = (double)b->scaled[c][i], whole = d->has_peaks ? (double)b->whole[c][i] : scaled;
        const nb_diffusion_ends of_scaled = weigh(scaled), of_whole = weigh(whole);
        w->light[c] += w->scaled[c] * (of_scaled.first * before.source[c] + of_scaled.last * w->source[c]) +
                       w->whole[c] * (of_whole.first * before.once[c] + of_whole.last * w->once[c]);
        w->spread[c] += w->scaled[c] * (of_scaled.first * before.diffuse[c] + of_scaled.last * w->diffuse[c]);
        w->dimmed[c] += w->scaled[c] * (of_scaled.first * before.lack[c] + of_scaled.last * w->lack[c]) -
                        w->whole[c] * (of_whole.first * before.taken[c] + of_whole.last * w->taken[c]);
        is_thin = is_thin && scaled > THIN;
        w->scaled[c] *= scaled;
        w->whole[c] *= whole;
        is_dark = is_dark && w->scaled[c] < DARK;
    }
    if (is_thin && w->halvings > 0) w->halvings--;
    if (is_dark) w->t = w->end;
}

/* ---- all rays of a block, step by step ------------------------------------------------------- */

/* 0: all are done. */
static int prepare(nb_diffusion_block *b)
{
    int goes_on = 0;
    for (size_t i = 0; i < b->count; i++) {
        const walker *w = &b->walkers[i];
        const int moves = w->t < w->end;
        b->step[i] = moves ? find_step(&b->diffusion->lattice, b->middle, w) : 0;
        b->length[i] = (float)b->step[i];
        goes_on |= moves;
        for (int a = 0; a < 3; a++) {
            b->offset[a][i] = moves ? (float)(w->origin[a] + w->t * w->direction[a]) : 0;
            b->direction[a][i] = w->direction[a];
        }
    }
    return goes_on;
}

/* `lighting` of the fog, or NULL. */
static nebel_result ask(const nb_diffusion_block *b, const nebel_snapshot *fog, const nebel_lighting *lighting,
                        float out[3][BLOCK])
{
    nebel_ray_planes rays = {.t_max = b->length};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int a = 0; a < 3; a++) {
        rays.origin[a] = b->middle[a];
        rays.offset[a] = b->offset[a];
        rays.direction_double[a] = b->direction[a];
        if (a < b->diffusion->channel_count) transfers.transmittance[a] = out[a];
    }
    const nebel_trace_desc desc = {.lighting = lighting, .ignore_distances = 1};
    return nebel_trace_planes(fog, &desc, b->count, &rays, &transfers);
}

static nebel_result go_through(nb_diffusion_block *b)
{
    while (prepare(b)) {
        nebel_result result = ask(b, b->diffusion->scaled, NULL, b->scaled);
        if (result == NEBEL_OK && b->diffusion->has_peaks)
            result = ask(b, b->lighting->snapshot, b->lighting, b->whole);
        if (result != NEBEL_OK) return result;
        for (size_t i = 0; i < b->count; i++) {
            if (!(b->walkers[i].t < b->walkers[i].end)) continue;
            if (is_fine(b, i))
                advance(b, i);
            else
                b->walkers[i].halvings++;
        }
    }
    return NEBEL_OK;
}

nebel_result nb_diffusion_gather(const nebel_lighting *lighting, const nb_diffusion *diffusion, int is_rest,
                                 size_t count, const nebel_ray *rays, nb_diffusion_gathered *gathered)
{
    const nb_diffusion *d = diffusion;
    nb_diffusion_block b = {.lighting = lighting, .diffusion = d, .is_rest = is_rest, .count = count};
    for (int a = 0; a < 3; a++) b.middle[a] = d->lattice.low[a] + (d->lattice.high[a] - d->lattice.low[a]) / 2;
    for (size_t i = 0; i < count; i++) start(&b, i, &rays[i]);
    const nebel_result result = go_through(&b);
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            const int own = d->channel_count == 1 ? 0 : c;
            gathered[i].light[c] = fmax(b.walkers[i].light[own], 0);
            gathered[i].diffuse[c] = b.walkers[i].spread[own];
            gathered[i].dimmed[c] = b.walkers[i].dimmed[own];
        }
    return result;
}

/* ---- jobs ------------------------------------------------------------------------------------ */

static nebel_ray ray_of(const nb_trace_job *job, size_t i)
{
    if (job->ray_planes != NULL) return nb_trace_ray_in_planes(job->ray_planes, i);
    return *(const nebel_ray *)nb_stride_from(job->rays, job->ray_stride, i);
}

static void add_to_plane(float *plane, size_t stride, size_t i, double light)
{
    if (plane == NULL) return;
    float *out = nb_stride_to(plane, stride, i);
    *out = fmaxf(*out + (float)light, 0);
}

/* `light` of the sun or of lights, less what the environment lacks. */
static void add(const nb_trace_job *job, const nb_diffusion *d, size_t i, int c, double light, double lack)
{
    if (job->light_planes == NULL) {
        nebel_transfer *out = nb_stride_to(job->transfers, job->transfer_stride, i);
        out->in_scattering[c] = fmax(out->in_scattering[c] + (light - lack), 0);
        return;
    }
    const nebel_transfer_planes *planes = job->light_planes;
    const int group = d->is_own ? NEBEL_LIGHT_GROUP_LOCAL : NEBEL_LIGHT_GROUP_SUN;
    const size_t stride = planes->in_scattering_stride;
    add_to_plane(planes->in_scattering[c], stride, i, light - lack);
    add_to_plane(planes->group[group].in_scattering[c], stride, i, light);
    add_to_plane(planes->group[NEBEL_LIGHT_GROUP_ENVIRONMENT].in_scattering[c], stride, i, -lack);
}

static nebel_result add_all(const nb_trace_job *job, const nb_diffusion *d)
{
    for (size_t first = 0; first < job->count; first += NB_DIFFUSION_RAYS) {
        const size_t n = job->count - first < NB_DIFFUSION_RAYS ? job->count - first : NB_DIFFUSION_RAYS;
        nebel_ray rays[NB_DIFFUSION_RAYS];
        nb_diffusion_gathered gathered[NB_DIFFUSION_RAYS];
        for (size_t i = 0; i < n; i++) rays[i] = ray_of(job, first + i);
        const nebel_result result = nb_diffusion_gather(job->lighting, d, 1, n, rays, gathered);
        if (result != NEBEL_OK) return result;
        for (size_t i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                add(job, d, first + i, c, gathered[i].light[c] * d->irradiance[c],
                    gathered[i].dimmed[c] * d->skylight[c]);
    }
    return NEBEL_OK;
}

nebel_result nb_diffusion_add(const nebel_lighting *lighting, const nb_trace_job *job)
{
    const nebel_result result = lighting->diffusion != NULL ? add_all(job, lighting->diffusion) : NEBEL_OK;
    return result == NEBEL_OK && lighting->local_diffusion != NULL ? add_all(job, lighting->local_diffusion) : result;
}
