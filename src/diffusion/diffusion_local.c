/* Own light: that of point lights in the fog or beside it, and what fog emits. How far it goes, and what of it comes
 * to cells and to nodes on straight ways. */
#include "diffusion.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/point_light.inc"

#define PI 3.14159265358979323846
#define GOLDEN_ANGLE 2.39996322972865332 /* pi (3 - sqrt(5)) */

/* Straight ways from a point light, from all of them, from a cell that emits; what is left of power that no one
 * follows. */
enum { MOST_WAYS = 8192, LEAST_WAYS = 512, WAYS_OF_ALL = 65536, LEAST_WAYS_OF_CELL = 4, BATCH = 256 };
#define DARK 1e-6

/* Optical depth of scaled fog in which own light gets lost, as seen from where it begins; the least of those of all channels. How
 * far it goes at most [m], and aside, in terms of the way up or down on which it gets lost sooner. */
#define REACH 3
#define MOST_REACH (NEBEL_MAX_LENGTH / 4)
#define WIDEST 4

/* How far light gets aside in terms of how far it rises, which is to where this part of the fog above is below. */
#define ASIDE 2
#define LOW_PART 0.9

/* A ball as bright all over as a point light's light is in the mean over a cell around it has this radius, in cells:
 * of a cube the mean of 1 / distance^2 is 7.7, of that ball 2 / radius^2. */
#define SOFT 0.51

/* ---- what there is --------------------------------------------------------------------------- */

static int has_lights(const nebel_lighting *lighting)
{
    return lighting->scatters_lights && lighting->light_count > 0;
}

static double most_of(const double color[3])
{
    return fmax(color[0], fmax(color[1], color[2]));
}

static void add_color(nb_local_light *own, const double color[3])
{
    const double most = most_of(color);
    if (!(most > 0)) return;
    for (int c = 0; c < 3; c++) {
        const double share = color[c] / most;
        own->has_colour |= own->has && fabs(share - own->unit[c]) > 1e-9;
        if (!own->has) own->unit[c] = share;
    }
    own->has = 1;
}

nb_local_light nb_find_own_light(const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    nb_local_light own = {.has = 0};
    int scatters = 0;
    for (size_t i = 0; has_lights(lighting) && i < lighting->light_count; i++)
        add_color(&own, lighting->lights[i].intensity);
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        const double glow[3] = {nb_volume_glow(body, 0), nb_volume_glow(body, 1), nb_volume_glow(body, 2)};
        if (nb_volume_has_fog(body)) add_color(&own, glow);
        scatters |= nb_medium_scatters(&snapshot->media[i]);
    }
    own.has = own.has && scatters;
    for (int c = 0; c < 3 && own.has_colour; c++) own.unit[c] = 1;
    return own;
}

double nb_local_amount(const nb_local_light *own, const double color[3], int channel)
{
    return own->has_colour ? color[channel] : most_of(color);
}

/* ---- how far it goes ------------------------------------------------------------------------- */

/* The least of all channels. */
static double depth_along(const nebel_snapshot *scaled, const double from[3], const double direction[3], double length)
{
    const nebel_ray ray = {{from[0], from[1], from[2]}, {direction[0], direction[1], direction[2]}, length};
    const nebel_trace_desc desc = {.transmittance_only = 1, .ignore_distances = 1};
    nebel_transfer transfer;
    if (nebel_trace(scaled, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer) != NEBEL_OK) return 0;
    const double most = most_of(transfer.transmittance);
    return most > 0 ? -nb_log(most) : HUGE_VAL;
}

/* How far along an axis scaled fog has so much depth; MOST_REACH where it never has. */
static double reach_along(const nebel_snapshot *scaled, const double from[3], int axis, int side, double depth)
{
    double direction[3] = {0, 0, 0}, low = 0, high = MOST_REACH;
    direction[axis] = side ? 1 : -1;
    if (depth_along(scaled, from, direction, high) <= depth) return high;
    for (int i = 0; i < 80; i++) {
        const double middle = low > 0 ? sqrt(low * high) : high * 1e-3;
        if (depth_along(scaled, from, direction, middle) > depth)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* How far light rises that is scattered aside: to where little of the fog above is left. */
static double rise_from(const nebel_snapshot *scaled, const double from[3])
{
    static const double up[3] = {0, 1, 0};
    const double most = depth_along(scaled, from, up, MOST_REACH);
    return most > 0 ? reach_along(scaled, from, 1, 1, fmin(LOW_PART * most, REACH)) : 0;
}

/* From a box around light. Where fog is thinner above light rises, and gets farther aside there; where it is clear, fog below may not
 * be. */
static void widen(const nebel_snapshot *scaled, const double from_low[3], const double from_high[3], double low[3],
                  double high[3])
{
    double middle[3], reach[3][2];
    for (int a = 0; a < 3; a++) middle[a] = from_low[a] + (from_high[a] - from_low[a]) / 2;
    for (int i = 0; i < 6; i++) reach[i / 2][i % 2] = reach_along(scaled, middle, i / 2, i % 2, REACH);
    const double upright = fmin(reach[1][0], reach[1][1]), rise = rise_from(scaled, middle);
    for (int a = 0; a < 3; a++) {
        const double most = a == 1 ? MOST_REACH : WIDEST * upright, least = a == 1 ? 0 : ASIDE * rise;
        low[a] = fmin(low[a], from_low[a] - fmax(fmin(reach[a][0], most), least));
        high[a] = fmax(high[a], from_high[a] + fmax(fmin(reach[a][1], most), least));
    }
}

int nb_find_reach(const nebel_lighting *lighting, const nebel_snapshot *scaled, double low[3], double high[3])
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    for (int a = 0; a < 3; a++) {
        low[a] = HUGE_VAL;
        high[a] = -HUGE_VAL;
    }
    for (size_t i = 0; has_lights(lighting) && i < lighting->light_count; i++) {
        const nb_light *point_light = &lighting->lights[i];
        if (most_of(point_light->intensity) > 0) widen(scaled, point_light->place, point_light->place, low, high);
    }
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        int ends = nb_volume_glow(body, 0) + nb_volume_glow(body, 1) + nb_volume_glow(body, 2) > 0;
        for (int a = 0; a < 3; a++) ends = ends && isfinite(body->low[a]) && isfinite(body->high[a]);
        if (ends) widen(scaled, body->low, body->high, low, high);
    }
    for (int a = 0; a < 3; a++) {
        low[a] = fmax(low[a], -NEBEL_MAX_LENGTH / 2);
        high[a] = fmin(high[a], NEBEL_MAX_LENGTH / 2);
    }
    return low[0] < high[0];
}

/* ---- straight ways to cells ------------------------------------------------------------------ */

int nb_beams_open(const nebel_allocator *allocator, const nb_diffusion_lattice *lattice, nb_light_beams *beams)
{
    beams->taken = nb_allocate(allocator, nb_diffusion_lattice_cells(lattice), sizeof *beams->taken);
    beams->scaled = nb_allocate(allocator, nb_diffusion_lattice_cells(lattice), 4 * sizeof *beams->scaled);
    beams->whole = nb_allocate(allocator, nb_diffusion_lattice_cells(lattice), 4 * sizeof *beams->whole);
    int all = beams->taken != NULL && beams->scaled != NULL && beams->whole != NULL;
    for (int a = 0; a < 3; a++) {
        beams->through[a] = nb_allocate(allocator, nb_diffusion_lattice_faces(lattice, a), sizeof *beams->through[a]);
        all = all && beams->through[a] != NULL;
    }
    return all;
}

void nb_beams_close(const nebel_allocator *allocator, const nb_light_beams *beams)
{
    for (int a = 0; a < 3; a++) nb_release(allocator, beams->through[a]);
    nb_release(allocator, beams->taken);
    nb_release(allocator, beams->scaled);
    nb_release(allocator, beams->whole);
}

typedef struct caster {
    const nb_diffusion_lattice *lattice;
    const nb_medium_transport *cells;
    int channel, is_emitted; /* of point lights nodes know more than cells do */
    const nb_light_beams *beams;
} caster;

static double scaled_extinction(const nb_medium_transport *t, int channel)
{
    return fmax(t->extinction[channel] - t->scattering[channel] + t->turned[channel], 0);
}

/* A straight way on the lattice, at the place where it goes into a cell. */
typedef struct way {
    double t, next[3]; /* m; where it leaves the cell along each axis */
    double direction[3];
    size_t at[3];
    int entered; /* the axis along which it has come in; -1: it begins within */
} way;

/* From `t` on. 0: it misses the lattice. */
static int enter(const nb_diffusion_lattice *l, const double from[3], double t, way *w)
{
    double end = HUGE_VAL;
    w->entered = -1;
    for (int a = 0; a < 3; a++) {
        const double d = w->direction[a];
        if (d == 0 && !(l->low[a] <= from[a] && from[a] <= l->high[a])) return 0;
        if (d == 0) continue;
        const double first = ((d > 0 ? l->low[a] : l->high[a]) - from[a]) / d;
        end = fmin(end, ((d > 0 ? l->high[a] : l->low[a]) - from[a]) / d);
        if (first > t) w->entered = a;
        t = fmax(first, t);
    }
    for (int a = 0; a < 3; a++) {
        const double d = w->direction[a], at = floor((from[a] + t * d - l->low[a]) / l->spacing[a]);
        w->at[a] = (size_t)fmin(fmax(at, 0), l->size[a] - 1.);
        if (a == w->entered) w->at[a] = d > 0 ? 0 : l->size[a] - 1u;
        w->next[a] = HUGE_VAL;
        if (d != 0) w->next[a] = (l->low[a] + (double)(w->at[a] + (d > 0)) * l->spacing[a] - from[a]) / d;
    }
    w->t = t;
    return t < end;
}

static void pass_face(const caster *k, const way *w, int axis, int is_far, double power)
{
    const nb_diffusion_lattice *l = k->lattice;
    size_t at[3] = {w->at[0], w->at[1], w->at[2]};
    at[axis] += (size_t)((w->direction[axis] > 0) == is_far);
    const size_t nx = l->size[0] + (axis == 0 ? 1u : 0u), ny = l->size[1] + (axis == 1 ? 1u : 0u);
    k->beams->through[axis][at[0] + nx * (at[1] + ny * at[2])] += w->direction[axis] > 0 ? power : -power;
}

/* Fog that takes the part `depth` of an even way, and what it leaves of power; adds to fluence and flux. */
static double dim(const way *w, double power, double extinction, double length, double moments[4])
{
    const double depth = fmin(extinction * length, 700), left = power * nb_exp(-depth);
    const double seen = depth > 1e-6 ? (power - left) / extinction : power * length;
    moments[0] += seen;
    for (int a = 0; a < 3; a++) moments[1 + a] += seen * w->direction[a];
    return left;
}

static void cast(const caster *k, const double from[3], double start, const double direction[3], double power)
{
    const nb_diffusion_lattice *l = k->lattice;
    const double dark = DARK * power;
    double whole = power;
    way w = {.direction = {direction[0], direction[1], direction[2]}};
    if (!enter(l, from, start, &w)) return;
    if (w.entered >= 0) pass_face(k, &w, w.entered, 0, power);
    for (;;) {
        const int axis = w.next[0] <= w.next[1] ? (w.next[0] <= w.next[2] ? 0 : 2) : (w.next[1] <= w.next[2] ? 1 : 2);
        const size_t cell = w.at[0] + l->size[0] * (w.at[1] + l->size[1] * w.at[2]);
        const nb_medium_transport *t = &k->cells[cell];
        const double length = fmax(w.next[axis] - w.t, 0);
        double seen[4] = {0};
        const double left = dim(&w, power, scaled_extinction(t, k->channel), length,
                                k->is_emitted ? &k->beams->scaled[4 * cell] : seen);
        if (k->is_emitted) whole = dim(&w, whole, t->extinction[k->channel], length, &k->beams->whole[4 * cell]);
        k->beams->taken[cell] += left > dark ? power - left : power;
        if (!(left > dark)) return;
        power = left;
        pass_face(k, &w, axis, 1, power);
        if (w.at[axis] == (direction[axis] > 0 ? l->size[axis] - 1u : 0)) return;
        w.at[axis] += direction[axis] > 0 ? (size_t)1 : (size_t)-1;
        w.t = w.next[axis];
        w.next[axis] += l->spacing[axis] / fabs(direction[axis]);
    }
}

/* Directions around an axis: those whose cosine is at least 1 - width. */
typedef struct nb_diffusion_cone {
    double axis[3], width;
} nb_diffusion_cone;

/* That holds the lattice, as a point light sees it, or the point light's own one where that is narrower. */
static nb_diffusion_cone aim(const nb_diffusion_lattice *l, const nb_light *point_light)
{
    nb_diffusion_cone all = {{0, 1, 0}, 2};
    double square = 0, radius2 = 0, away[3];
    for (int a = 0; a < 3; a++) {
        away[a] = l->low[a] + (l->high[a] - l->low[a]) / 2 - point_light->place[a];
        square += away[a] * away[a];
        radius2 += (l->high[a] - l->low[a]) * (l->high[a] - l->low[a]) / 4;
    }
    if (square > radius2) {
        const double sine2 = radius2 / square;
        all.width = sine2 / (1 + sqrt(1 - sine2));
        for (int a = 0; a < 3; a++) all.axis[a] = away[a] / sqrt(square);
    }
    if (point_light->is_spot && 1 - point_light->edge < all.width) {
        all.width = 1 - point_light->edge;
        memcpy(all.axis, point_light->axis, sizeof all.axis);
    }
    return all;
}

static void find_across(const double axis[3], double right[3], double up[3])
{
    const int least = fabs(axis[0]) < .6 ? 0 : 1, next = (least + 1) % 3, last = (least + 2) % 3;
    const double size = sqrt(axis[next] * axis[next] + axis[last] * axis[last]);
    right[least] = 0;
    right[next] = -axis[last] / size;
    right[last] = axis[next] / size;
    for (int a = 0; a < 3; a++) up[a] = axis[(a + 1) % 3] * right[(a + 2) % 3] - axis[(a + 2) % 3] * right[(a + 1) % 3];
}

static double cone_of(const nb_light *point_light, const double direction[3])
{
    double cosine = 0;
    for (int a = 0; a < 3; a++) cosine += direction[a] * point_light->axis[a];
    return point_light->is_spot ? nb_light_cone(cosine, point_light->edge, point_light->rise) : 1;
}

/* Ways that are spread evenly, along a spiral of the golden angle. */
static void cast_light(const caster *k, const nb_light *point_light, double intensity, int count)
{
    const nb_diffusion_cone all = aim(k->lattice, point_light);
    double right[3], up[3];
    find_across(all.axis, right, up);
    for (int i = 0; i < count; i++) {
        const double below = all.width * (i + .5) / count, sine = sqrt(fmax(below * (2 - below), 0));
        const double x = sine * cos(i * GOLDEN_ANGLE), y = sine * sin(i * GOLDEN_ANGLE);
        double direction[3];
        for (int a = 0; a < 3; a++) direction[a] = (1 - below) * all.axis[a] + x * right[a] + y * up[a];
        const double power = intensity * cone_of(point_light, direction) * 2 * PI * all.width / count;
        if (power > 0) cast(k, point_light->place, point_light->clear, direction, power);
    }
}

/* The next number of a sequence that fills five dimensions evenly: powers of the root of x^6 = x + 1 (Roberts, The unreasonable
 * effectiveness of quasirandom sequences, 2018). */
static double spread(size_t i, int dimension)
{
    static const double steps[5] = {0.8812714616335696, 0.7766393890897682, 0.6844301295853426, 0.6031687406857282,
                                    0.5315553977157913};
    const double at = 0.5 + (double)i * steps[dimension];
    return at - floor(at);
}

/* The i-th of all ways, from a place in the cell. */
static void cast_from_cell(const caster *k, size_t cell, size_t i, double power)
{
    const nb_diffusion_lattice *l = k->lattice;
    const size_t at[3] = {cell % l->size[0], cell / l->size[0] % l->size[1], cell / ((size_t)l->size[0] * l->size[1])};
    const double height = 2 * spread(i, 3) - 1, angle = 2 * PI * spread(i, 4), sine = sqrt(1 - height * height);
    const double direction[3] = {sine * cos(angle), height, sine * sin(angle)};
    double place[3];
    for (int a = 0; a < 3; a++) place[a] = l->low[a] + ((double)at[a] + spread(i, a)) * l->spacing[a];
    cast(k, place, 0, direction, power);
}

static void cast_emission(const caster *k, const nb_local_light *own)
{
    const nb_diffusion_lattice *l = k->lattice;
    const size_t cells = nb_diffusion_lattice_cells(l);
    const double volume = l->spacing[0] * l->spacing[1] * l->spacing[2];
    size_t glowing = 0, used = 0;
    for (size_t i = 0; i < cells; i++) glowing += nb_local_amount(own, k->cells[i].emission, k->channel) > 0;
    const size_t count = glowing > 0 ? WAYS_OF_ALL / glowing + LEAST_WAYS_OF_CELL : 0;
    for (size_t i = 0; i < cells; i++) {
        const double power = 4 * PI * volume * nb_local_amount(own, k->cells[i].emission, k->channel);
        for (size_t n = 0; n < count && power > 0; n++) cast_from_cell(k, i, used++, power / (double)count);
    }
}

void nb_cast_beams(const nb_diffusion_lattice *lattice, const nebel_lighting *lighting,
                   const nb_medium_transport *cells, int channel, const nb_local_light *own,
                   const nb_light_beams *beams)
{
    caster k = {lattice, cells, channel, 0, beams};
    const size_t count = nb_diffusion_lattice_cells(lattice);
    memset(beams->taken, 0, count * sizeof *beams->taken);
    memset(beams->scaled, 0, 4 * count * sizeof *beams->scaled);
    memset(beams->whole, 0, 4 * count * sizeof *beams->whole);
    for (int a = 0; a < 3; a++)
        memset(beams->through[a], 0, nb_diffusion_lattice_faces(lattice, a) * sizeof *beams->through[a]);
    const double share = lighting->light_count > 0 ? WAYS_OF_ALL / (double)lighting->light_count : 0;
    const int ways = (int)fmin(fmax(share, LEAST_WAYS), MOST_WAYS);
    for (size_t i = 0; has_lights(lighting) && i < lighting->light_count; i++)
        cast_light(&k, &lighting->lights[i], nb_local_amount(own, lighting->lights[i].intensity, channel), ways);
    k.is_emitted = 1;
    cast_emission(&k, own);
}

/* ---- straight ways to nodes ------------------------------------------------------------------ */

/* Some nodes as a point light sees them. */
typedef struct nb_light_view {
    size_t count;
    double distance[BATCH], direction[3][BATCH]; /* m; from the nodes to the point light */
    float offset[3][BATCH], length[BATCH];
    float scaled[3][BATCH], whole[3][BATCH]; /* transmittance */
} nb_light_view;

static void look(const nb_diffusion_lattice *l, const nb_light *point_light, size_t first, nb_light_view *v)
{
    for (size_t i = 0; i < v->count; i++) {
        double place[3], square = 0;
        nb_diffusion_lattice_node(l, first + i, place);
        for (int a = 0; a < 3; a++) square += (point_light->place[a] - place[a]) * (point_light->place[a] - place[a]);
        v->distance[i] = sqrt(square);
        v->length[i] = (float)fmax(v->distance[i] - point_light->clear, 0);
        for (int a = 0; a < 3; a++) {
            const double upwards = a == 1;
            v->direction[a][i] = square > 0 ? (point_light->place[a] - place[a]) / v->distance[i] : upwards;
            v->offset[a][i] = (float)(place[a] - (l->low[a] + (l->high[a] - l->low[a]) / 2));
        }
    }
}

/* `lighting` of the fog, or NULL. */
static nebel_result ask(const nb_diffusion_lattice *l, const nebel_snapshot *fog, const nebel_lighting *lighting,
                        nb_light_view *v, float out[3][BATCH])
{
    nebel_ray_planes rays = {.t_max = v->length};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int a = 0; a < 3; a++) {
        rays.origin[a] = l->low[a] + (l->high[a] - l->low[a]) / 2;
        rays.offset[a] = v->offset[a];
        rays.direction_double[a] = v->direction[a];
        transfers.transmittance[a] = out[a];
    }
    const nebel_trace_desc desc = {.lighting = lighting, .ignore_distances = 1};
    return nebel_trace_planes(fog, &desc, v->count, &rays, &transfers);
}

static double turned_cosine(const nb_medium_transport *t, int channel)
{
    return t->turned[channel] > 0 ? t->forward[channel] / t->turned[channel] : 0;
}

static void add_light(double sum[4], double fluence, double flux, const double direction[3])
{
    sum[0] += fluence;
    for (int a = 0; a < 3; a++) sum[1 + a] += flux * direction[a];
}

static void add_point_light(const nb_light_view *v, size_t i, const nb_light *point_light, const nb_local_light *own,
                            double soft2, const nb_medium_transport *fog, nb_local_node *node)
{
    const double away[3] = {-v->direction[0][i], -v->direction[1][i], -v->direction[2][i]};
    const double square = v->distance[i] * v->distance[i];
    const double part = cone_of(point_light, away) *
                        (double)nb_light_fluence((nb_wide)square, (nb_wide)fmax(point_light->radius2, soft2));
    for (int c = 0; c < 3; c++) {
        const double full = part * nb_local_amount(own, point_light->intensity, c);
        const double scaled = (double)v->scaled[c][i], whole = (double)v->whole[c][i];
        const double straight = full * fmax(scaled - whole, 0);
        const double width = nb_glow_width(turned_cosine(fog, c), scaled, whole);
        add_light(node->scaled[c], full * scaled, full * scaled, away);
        add_light(node->whole[c], full * whole, full * whole, away);
        add_light(node->glow[c], straight, straight * width, away);
    }
}

nebel_result nb_light_nodes_by_point_lights(const nb_diffusion *diffusion, const nebel_lighting *lighting,
                                            const nb_medium_transport *cells, const nb_local_light *own,
                                            nb_local_node *nodes)
{
    const nb_diffusion_lattice *l = &diffusion->lattice;
    const size_t count = nb_diffusion_lattice_nodes(l);
    const double cell = nb_exp(nb_log(l->spacing[0] * l->spacing[1] * l->spacing[2]) / 3);
    for (size_t first = 0; first < count; first += BATCH) {
        nb_light_view v = {.count = count - first < BATCH ? count - first : BATCH};
        for (size_t k = 0; has_lights(lighting) && k < lighting->light_count; k++) {
            const nb_light *point_light = &lighting->lights[k];
            look(l, point_light, first, &v);
            nebel_result result = ask(l, diffusion->scaled, NULL, &v, v.scaled);
            if (result == NEBEL_OK) result = ask(l, lighting->snapshot, lighting, &v, v.whole);
            if (result != NEBEL_OK) return result;
            for (size_t i = 0; i < v.count; i++) {
                const nb_medium_transport around = nb_diffusion_lattice_around(l, cells, first + i);
                add_point_light(&v, i, point_light, own, SOFT * SOFT * cell * cell, &around, &nodes[first + i]);
            }
        }
    }
    return NEBEL_OK;
}

/* ---- from cells to nodes --------------------------------------------------------------------- */

/* How often light on its way has gone almost straight on, in the mean. */
static double times_ahead(double scaled, double whole)
{
    return whole > 0 ? fmin(nb_log(fmax(scaled / whole, 1)), 50) : 50;
}

/* The mean of the cells around it. Nothing of what is emitted and then scattered is in the exact light. */
static void add_cells(const nb_diffusion_lattice *l, const nb_medium_transport *cells, const nb_light_beams *beams,
                      size_t node, int c, nb_local_node *out)
{
    const double unit = 1 / (8 * l->spacing[0] * l->spacing[1] * l->spacing[2]);
    double scaled[4] = {0}, whole[4] = {0};
    for (int octant = 0; octant < 8; octant++) {
        const size_t cell = nb_diffusion_lattice_cell_beside(l, node, octant);
        for (size_t k = 0; k < 4; k++) {
            scaled[k] += beams->scaled[4 * cell + k] * unit;
            whole[k] += beams->whole[4 * cell + k] * unit;
        }
    }
    const nb_medium_transport fog = nb_diffusion_lattice_around(l, cells, node);
    const double width = nb_lobe_width(turned_cosine(&fog, c), 1 + times_ahead(scaled[0], whole[0]));
    for (int k = 0; k < 4; k++) {
        out->scaled[c][k] += scaled[k];
        out->glow[c][k] += (k == 0 ? 1 : width) * scaled[k];
    }
}

void nb_light_nodes_by_cells(const nb_diffusion_lattice *lattice, const nb_medium_transport *cells,
                             const nb_light_beams *beams, int channel, nb_local_node *nodes)
{
    const size_t count = nb_diffusion_lattice_nodes(lattice);
    for (size_t i = 0; i < count; i++) add_cells(lattice, cells, beams, i, channel, &nodes[i]);
}
