/* Where the lattice of diffuse light is, how fine it is, and what fog its cells hold. */
#include "diffusion.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* Endless fog is left out above the height with this optical depth above it, and deep below the one with that. */
#define THIN 1e-3
#define DEEP 30

/* No fog that matters begins farther up or down [m]; no density of a Gaussian is farther from its middle, in sigma. */
#define FAR_HEIGHT 1e7
#define GAUSSIAN_END 5

/* Cells along an axis: so many for an optical depth of 1, within limits; of own light, which begins at places; of fog that varies with
 * height alone. */
#define CELLS_PER_DEPTH 3
enum {
    LEAST_CELLS = 20,
    LEAST_OWN_CELLS = 32,
    MOST_CELLS = 64,
    LEAST_LEVEL_CELLS = 64,
    MOST_LEVEL_CELLS = 256,
    PROBES = 8,
    SHARES = 3
};

typedef struct nb_diffusion_span {
    double low, high;
    int is_endless[2];
} nb_diffusion_span;

/* ---- where lit fog is ------------------------------------------------------------------------ */

static nb_diffusion_span span_of(const nb_medium *medium, int axis)
{
    const nebel_density *density = &medium->body.density;
    nb_diffusion_span s = {medium->body.low[axis], medium->body.high[axis], {0, 0}};
    if (density->type == NEBEL_DENSITY_GAUSSIAN) {
        s.low = fmax(s.low, density->center[axis] - GAUSSIAN_END * density->sigma);
        s.high = fmin(s.high, density->center[axis] + GAUSSIAN_END * density->sigma);
    }
    s.is_endless[0] = !isfinite(s.low);
    s.is_endless[1] = !isfinite(s.high);
    return s;
}

/* Whether the fog is the same all along the axis, x or z. */
static int is_level(const nb_medium *medium, int axis)
{
    const nb_volume *body = &medium->body;
    const nebel_density *density = &body->density;
    for (size_t i = 0; i < body->leaf_count; i++) {
        const nb_leaf *leaf = &body->leaves[i];
        if (leaf->type == NB_LEAF_WORLD) continue;
        if (leaf->type != NB_LEAF_PLANES || !leaf->aligned) return 0;
        for (size_t k = 0; k < leaf->face_count; k++)
            if (body->faces[leaf->first_face + k].normal[axis] != 0) return 0;
    }
    if (density->type == NEBEL_DENSITY_LINEAR) return density->from[axis] == density->to[axis];
    return density->type == NEBEL_DENSITY_CONSTANT || density->type == NEBEL_DENSITY_HEIGHT;
}

/* Fog without an end that scatters nothing has no place in it. */
static int takes_part_in_own(const nb_medium *medium, int goes_on)
{
    double glow = 0;
    for (int c = 0; c < 3; c++) glow += nb_volume_glow(&medium->body, c);
    return nb_medium_scatters(medium) || (glow > 0 && !goes_on);
}

/* The span of all fog that ends and is lit, or scatters or gives own light, and whether there is any that does not. NULL, or what goes on and changes. */
static const nb_medium *gather(const nebel_lighting *lighting, int is_own, int axis, nb_diffusion_span *all)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    *all = (nb_diffusion_span){HUGE_VAL, -HUGE_VAL, {0, 0}};
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_medium *medium = &snapshot->media[i];
        const nb_diffusion_span s = span_of(medium, axis);
        const int goes_on = s.is_endless[0] || s.is_endless[1];
        if (!(is_own ? takes_part_in_own(medium, goes_on) : nb_medium_is_lit(medium, &lighting->media[i]))) continue;
        if (goes_on && axis != 1 && !is_level(medium, axis)) return medium;
        for (int side = 0; side < 2; side++) all->is_endless[side] |= axis != 1 ? goes_on : s.is_endless[side];
        if (!s.is_endless[0]) all->low = fmin(all->low, s.low);
        if (!s.is_endless[1]) all->high = fmax(all->high, s.high);
    }
    return NULL;
}

static double vertical_depth(const nebel_snapshot *scaled, double x, double y, double z)
{
    const nebel_ray up = {{x, y, z}, {0, 1, 0}, HUGE_VAL};
    const nebel_trace_desc desc = {.transmittance_only = 1, .ignore_distances = 1};
    nebel_transfer transfer;
    if (nebel_trace(scaled, &desc, 1, &up, sizeof up, &transfer, sizeof transfer) != NEBEL_OK) return 0;
    const double most = fmax(transfer.transmittance[0], fmax(transfer.transmittance[1], transfer.transmittance[2]));
    return most > 0 ? -nb_log(most) : HUGE_VAL;
}

/* The height with so much above it, or the end of the world. */
static double find_height(const nebel_snapshot *scaled, double x, double z, double depth)
{
    double low = -FAR_HEIGHT, high = FAR_HEIGHT;
    for (int i = 0; i < 80; i++) {
        const double middle = low + (high - low) / 2;
        if (vertical_depth(scaled, x, middle, z) > depth)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* A part of the world's width for endless level fog; more than the fog that ends where there is both. */
static void set_level_axis(nb_diffusion_lattice *l, int axis, const nb_diffusion_span *s)
{
    const int has_bodies = s->low < s->high;
    const double margin = has_bodies ? (s->high - s->low) / 2 : 0;
    l->low[axis] = has_bodies ? s->low - margin : -.5;
    l->high[axis] = has_bodies ? s->high + margin : .5;
    l->ends[axis][0] = l->ends[axis][1] = NB_END_LEVEL;
}

static void set_height(const nebel_snapshot *scaled, const nb_diffusion_span *s, const nebel_diffusion_desc *desc,
                       nb_diffusion_lattice *l)
{
    const double x = (l->low[0] + l->high[0]) / 2, z = (l->low[2] + l->high[2]) / 2;
    l->low[1] = s->is_endless[0] ? find_height(scaled, x, z, DEEP) : s->low;
    l->high[1] = s->is_endless[1] ? find_height(scaled, x, z, THIN) : s->high;
    if (s->is_endless[0] && isfinite(s->low)) l->low[1] = fmin(l->low[1], s->low);
    if (s->is_endless[1] && isfinite(s->high)) l->high[1] = fmax(l->high[1], s->high);
    l->ends[1][0] = s->is_endless[0] ? NB_END_LEVEL : NB_END_OPEN;
    if (desc->has_ground && desc->ground_height >= l->low[1]) {
        l->low[1] = desc->ground_height;
        l->ends[1][0] = NB_END_GROUND;
    }
}

/* In fog without an end a lattice of own light holds point lights and bodies that emit, with what lies around them,
 * and ends there. */
static void hold_own_light(const nebel_lighting *lighting, const nebel_snapshot *scaled, nb_diffusion_lattice *l)
{
    double low[3], high[3];
    const int is_everywhere = !(l->low[1] < l->high[1]);
    if (!nb_find_reach(lighting, scaled, low, high)) return;
    for (int a = 0; a < 3; a += 2) {
        const int is_one = l->high[a] - l->low[a] == 1;
        if (l->ends[a][0] != NB_END_LEVEL) continue;
        l->low[a] = is_one ? low[a] : fmin(l->low[a], low[a]);
        l->high[a] = is_one ? high[a] : fmax(l->high[a], high[a]);
        l->ends[a][0] = l->ends[a][1] = NB_END_OPEN;
    }
    if (is_everywhere || l->low[1] < low[1]) {
        l->low[1] = low[1];
        l->ends[1][0] = NB_END_OPEN;
    }
    if (is_everywhere || l->high[1] > high[1]) {
        l->high[1] = high[1];
        l->ends[1][1] = NB_END_OPEN;
    }
}

/* ---- how fine it is -------------------------------------------------------------------------- */

/* The most of all channels that fog takes after scaling, in the mean. */
static double mean_extinction(const nb_diffusion_lattice *l, const nebel_snapshot *snapshot)
{
    nb_medium_transport sum = {.extinction = {0}};
    double most = 0;
    for (int k = 0; k < PROBES * PROBES * PROBES; k++) {
        const int at[3] = {k % PROBES, k / PROBES % PROBES, k / (PROBES * PROBES)};
        double place[3];
        for (int a = 0; a < 3; a++) place[a] = l->low[a] + (at[a] + .5) / PROBES * (l->high[a] - l->low[a]);
        nb_sample_medium_transport(snapshot, place, &sum);
    }
    for (int c = 0; c < 3; c++) most = fmax(most, sum.extinction[c] - sum.scattering[c] + sum.turned[c]);
    return most / (PROBES * PROBES * PROBES);
}

static void set_cells(const nebel_snapshot *snapshot, uint32_t limit, int is_own, nb_diffusion_lattice *l)
{
    const double extinction = mean_extinction(l, snapshot);
    const int is_flat = l->ends[0][0] == NB_END_LEVEL && l->high[0] - l->low[0] == 1 && l->ends[2][0] == NB_END_LEVEL &&
                        l->high[2] - l->low[2] == 1;
    double count[3], all = 1;
    for (int a = 0; a < 3; a++) {
        const double wanted = ceil(CELLS_PER_DEPTH * extinction * (l->high[a] - l->low[a]));
        const int least = is_flat  ? LEAST_LEVEL_CELLS
                          : is_own ? LEAST_OWN_CELLS
                                   : LEAST_CELLS,
                  most = is_flat ? MOST_LEVEL_CELLS : MOST_CELLS;
        const int is_one = l->ends[a][0] == NB_END_LEVEL && a != 1 && l->high[a] - l->low[a] == 1;
        count[a] = is_one ? 1 : fmin(fmax(wanted, least), most);
        all *= count[a];
    }
    for (; all > limit; all = count[0] * count[1] * count[2]) {
        int widest = 0;
        for (int a = 1; a < 3; a++) widest = count[a] > count[widest] ? a : widest;
        count[widest] -= 1;
    }
    for (int a = 0; a < 3; a++) {
        l->size[a] = (uint32_t)count[a];
        l->spacing[a] = (l->high[a] - l->low[a]) / l->size[a];
    }
}

int nb_diffusion_lattice_has_bodies(const nb_diffusion_lattice *l)
{
    return (l->ends[0][0] == NB_END_LEVEL && l->size[0] > 1) || (l->ends[2][0] == NB_END_LEVEL && l->size[2] > 1);
}

nebel_result nb_diffusion_lattice_place(const nebel_lighting *lighting, const nebel_snapshot *scaled, int is_own,
                                        nb_diffusion_lattice *lattice, int *lit)
{
    nb_diffusion_span spans[3];
    memset(lattice, 0, sizeof *lattice);
    *lit = 0;
    for (int a = 0; a < 3; a++) {
        const nb_medium *uneven = gather(lighting, is_own, a, &spans[a]);
        if (uneven != NULL)
            return nb_fail(&lighting->log, NEBEL_ERROR_UNSUPPORTED,
                           "fog[%zu]: is endless along %c, but not the same all along, which diffusion (multiple "
                           "scattering) needs; let it end, or leave out diffusion",
                           uneven->slot, "xyz"[a]);
    }
    for (int a = 0; a < 3; a += 2) {
        lattice->low[a] = spans[a].low;
        lattice->high[a] = spans[a].high;
        if (spans[a].is_endless[0]) set_level_axis(lattice, a, &spans[a]);
    }
    set_height(scaled, &spans[1], &lighting->diffusion_desc, lattice);
    if (is_own &&
        (spans[0].is_endless[0] || spans[2].is_endless[0] || spans[1].is_endless[0] || spans[1].is_endless[1]))
        hold_own_light(lighting, scaled, lattice);
    for (int a = 0; a < 3; a++)
        if (!(lattice->low[a] < lattice->high[a])) return NEBEL_OK;
    set_cells(lighting->snapshot, lighting->diffusion_desc.max_cells, is_own, lattice);
    *lit = 1;
    return NEBEL_OK;
}

/* ---- what its cells hold --------------------------------------------------------------------- */

static void mean_of_cell(const nb_diffusion_lattice *l, const nebel_snapshot *snapshot, const uint32_t at[3],
                         nb_medium_transport *mean)
{
    const double part = 1. / (SHARES * SHARES * SHARES);
    nb_medium_transport sum = {.extinction = {0}};
    for (int k = 0; k < SHARES * SHARES * SHARES; k++) {
        const int share[3] = {k % SHARES, k / SHARES % SHARES, k / (SHARES * SHARES)};
        double place[3];
        for (int a = 0; a < 3; a++) place[a] = l->low[a] + (at[a] + (share[a] + .5) / SHARES) * l->spacing[a];
        nb_sample_medium_transport(snapshot, place, &sum);
    }
    for (int c = 0; c < 3; c++) {
        mean->extinction[c] = sum.extinction[c] * part;
        mean->scattering[c] = sum.scattering[c] * part;
        mean->turned[c] = sum.turned[c] * part;
        mean->forward[c] = sum.forward[c] * part;
        mean->emission[c] = sum.emission[c] * part;
    }
}

void nb_diffusion_lattice_mean(const nb_diffusion_lattice *lattice, const nebel_snapshot *snapshot,
                               nb_medium_transport *cells)
{
    const size_t count = nb_diffusion_lattice_cells(lattice), nx = lattice->size[0], ny = lattice->size[1];
    for (size_t i = 0; i < count; i++) {
        const uint32_t at[3] = {(uint32_t)(i % nx), (uint32_t)(i / nx % ny), (uint32_t)(i / (nx * ny))};
        mean_of_cell(lattice, snapshot, at, &cells[i]);
    }
}

/* ---- its nodes ------------------------------------------------------------------------------- */

void nb_diffusion_lattice_node(const nb_diffusion_lattice *l, size_t node, double place[3])
{
    const size_t nx = l->size[0] + 1u, ny = l->size[1] + 1u;
    const size_t at[3] = {node % nx, node / nx % ny, node / (nx * ny)};
    for (int a = 0; a < 3; a++) place[a] = at[a] == l->size[a] ? l->high[a] : l->low[a] + (double)at[a] * l->spacing[a];
}

size_t nb_diffusion_lattice_cell_beside(const nb_diffusion_lattice *l, size_t node, int octant)
{
    const size_t nx = l->size[0] + 1u, ny = l->size[1] + 1u;
    const size_t at[3] = {node % nx, node / nx % ny, node / (nx * ny)};
    size_t cell[3];
    for (int a = 0; a < 3; a++) {
        const size_t up = at[a] + ((size_t)octant >> a & 1u);
        cell[a] = up == 0 ? 0 : up > l->size[a] ? l->size[a] - 1u : up - 1;
    }
    return cell[0] + l->size[0] * (cell[1] + l->size[1] * cell[2]);
}

nb_medium_transport nb_diffusion_lattice_around(const nb_diffusion_lattice *l, const nb_medium_transport *cells,
                                                size_t node)
{
    nb_medium_transport sum = {.extinction = {0}};
    for (int octant = 0; octant < 8; octant++) {
        const nb_medium_transport *t = &cells[nb_diffusion_lattice_cell_beside(l, node, octant)];
        for (int c = 0; c < 3; c++) {
            sum.extinction[c] += t->extinction[c];
            sum.scattering[c] += t->scattering[c];
            sum.turned[c] += t->turned[c];
            sum.forward[c] += t->forward[c];
        }
    }
    return sum;
}
