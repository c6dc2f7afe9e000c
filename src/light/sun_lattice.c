#include "sun_lattice.h"

#include "base/base.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A lattice and what keeps it. */
typedef struct body {
    nb_sun_lattice lattice;
    nebel_allocator allocator;
    atomic_size_t owners;
    nebel_grid *grid;
    double to_sun[3];
} body;

/* ---- placing --------------------------------------------------------------------------------- */

static int steepest_axis(const double to_sun[3])
{
    int axis = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(to_sun[i]) > fabs(to_sun[axis])) axis = i;
    return axis;
}

static void set_axes(nb_sun_lattice *l, int axis, const double to_sun[3])
{
    l->axis = axis;
    for (int s = 0; s < 2; s++) {
        l->side[s] = (l->axis + 1 + s) % 3;
        l->lean[s] = to_sun[l->side[s]] / to_sun[l->axis];
    }
}

/* Columns enough for all ways that meet the cells, and one more on either side. */
static void set_counts(nb_sun_lattice *l, const nebel_grid *grid)
{
    const double layers = nb_grid_cells(grid, l->axis);
    for (int s = 0; s < 2; s++) {
        const double shift = l->lean[s] * layers;
        const double low = floor(fmin(-shift, 0) * l->per_cell) - 1;
        const double high = ceil((nb_grid_cells(grid, l->side[s]) + fmax(-shift, 0)) * l->per_cell) + 1;
        l->first[s] = low;
        l->count[s] = (int)(high - low) + 1;
    }
    l->count[2] = (int)(layers * l->per_layer) + 1;
    for (int i = 0; i < 3; i++) l->blocks[i] = (l->count[i] + NB_LATTICE_BLOCK - 1) / NB_LATTICE_BLOCK;
}

static size_t node_count(const nb_sun_lattice *l)
{
    return (size_t)l->count[0] * (size_t)l->count[1] * (size_t)l->count[2];
}

static size_t block_count(const nb_sun_lattice *l)
{
    return (size_t)l->blocks[0] * (size_t)l->blocks[1] * (size_t)l->blocks[2];
}

static void lay_along(nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3], int axis,
                      nb_sun_lattice_limit limit)
{
    set_axes(l, axis, to_sun);
    l->per_cell = limit.per_cell;
    l->per_layer = limit.per_layer;
    set_counts(l, grid);
}

void nb_sun_lattice_lay(nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3], nb_sun_lattice_limit limit)
{
    const int steepest = steepest_axis(to_sun);
    lay_along(l, grid, to_sun, steepest, limit);
    /* Too many nodes: flat grids have fewer layers across, in which columns lean more. */
    for (int axis = 0; axis < 3 && node_count(l) > limit.most_nodes; axis++) {
        nb_sun_lattice other = *l;
        if (2 * fabs(to_sun[axis]) < fabs(to_sun[steepest])) continue;
        lay_along(&other, grid, to_sun, axis, limit);
        if (node_count(&other) < node_count(l)) *l = other;
    }
    while (node_count(l) > limit.most_nodes && l->count[0] > 8 && l->count[1] > 8) {
        l->per_cell /= 2;
        set_counts(l, grid);
    }
}

/* ---- columns --------------------------------------------------------------------------------- */

/* From the sides outwards the density is as at the sides, as it is between them and the outermost middles of voxels;
 * half way between those the coordinates are held, where rounding cannot make them pass either. */
#define HELD 0.25

/* Layers, in cells. */
static double cells_along(const nb_sun_lattice *l)
{
    return (l->count[2] - 1) / l->per_layer;
}

/* Along a side, of a column so many cells along the axis. */
static double column_place(const nb_sun_lattice *l, int s, double column, double layer)
{
    return (l->first[s] + column) / l->per_cell + l->lean[s] * layer;
}

/* Where a column is beside the box, the density is that at its side: there it is a line along the side. */
enum { MOST_PARTS = 5 };

/* Places along the axis at which parts of a column begin and end, ascending; returns how many parts there are. */
static int part_column(const nb_sun_lattice *l, const nebel_grid *grid, const double column[2],
                       double layer[MOST_PARTS + 1])
{
    const double last = cells_along(l);
    int count = 0;
    layer[0] = 0;
    for (int s = 0; s < 2; s++)
        for (int far = 0; far < 2; far++) {
            const double held = far ? nb_grid_end(grid, l->side[s]) - HELD : nb_grid_margin(grid) + HELD;
            const double at = (held - column_place(l, s, column[s], 0)) / l->lean[s];
            if (!(at > 0 && at < last)) continue; /* nor where the column is level */
            int i = ++count;
            for (; layer[i - 1] > at; i--) layer[i] = layer[i - 1];
            layer[i] = at;
        }
    layer[++count] = last;
    return count;
}

/* What is asked along a column, and room for it: so many places, the first `offset` layers away from the sun's end and the
 * others a layer apart; places along a part, what its walk says, and the sums so far. */
typedef struct column_space {
    int count;
    double offset;
    double *place, *part, *sum;
} column_space;

/* The line from layer `start` towards `end`, away from the sun. Returns 0 where it is beside a box without fog at its
 * sides. */
static int set_line(const nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3], const double column[2],
                    double start, double end, nb_grid_line *line)
{
    int is_beside = 0;
    line->from[l->axis] = start;
    line->slope[l->axis] = -to_sun[l->axis];
    for (int s = 0; s < 2; s++) {
        const int side = l->side[s];
        const double least = nb_grid_margin(grid) + HELD, most = nb_grid_end(grid, side) - HELD;
        const double from = column_place(l, s, column[s], start),
                     middle = column_place(l, s, column[s], 0.5 * (start + end));
        const int is_held = middle < least || middle > most;
        line->from[side] = fmin(fmax(from, least), most);
        line->slope[side] = is_held ? 0 : -to_sun[side];
        is_beside = is_beside || is_held;
    }
    return !is_beside || l->ends_in_fog;
}

/* From the sun down, so that the integral from a place to the sun is that of the walk so far. */
static void walk_column(const nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3], const double column[2],
                        const column_space *space)
{
    double layer[MOST_PARTS + 1];
    const int parts = part_column(l, grid, column, layer);
    const double last = cells_along(l), metres = 1 / fabs(to_sun[l->axis]);
    memset(space->sum, 0, (size_t)space->count * sizeof *space->sum);
    for (int i = 0; i < parts; i++) {
        const double start = layer[l->up ? parts - i : i], end = layer[l->up ? parts - i - 1 : i + 1];
        const double length = fabs(end - start) * metres;
        nb_grid_line line;
        if (!(length > 0) || !set_line(l, grid, to_sun, column, start, end, &line)) continue;
        for (int n = 0; n < space->count; n++) {
            const double at = (n + space->offset) / l->per_layer, below = l->up ? start - (last - at) : at - start;
            space->place[n] = fmin(fmax(below, 0) * metres, length);
        }
        nb_grid_sums(grid, &line, length, space->count, space->place, space->part);
        for (int n = 0; n < space->count; n++) space->sum[n] += space->part[n];
    }
}

static uint16_t number_of(double amount)
{
    return (uint16_t)fmin(fmax(amount + 0.5, 0), UINT16_MAX);
}

static void fill_column(nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3], const int column[2],
                        const column_space *space)
{
    uint16_t *node = l->amount + (size_t)column[1] * (size_t)l->count[0] + (size_t)column[0];
    const size_t layer = (size_t)l->count[0] * (size_t)l->count[1];
    walk_column(l, grid, to_sun, (const double[2]){column[0], column[1]}, space);
    for (int n = 0; n < l->count[2]; n++) {
        const size_t k = (size_t)(l->up ? l->count[2] - 1 - n : n);
        node[k * layer] = number_of(space->sum[n] / l->step);
    }
}

static int fill_columns(nb_sun_lattice *l, const nebel_grid *grid, const nebel_allocator *allocator,
                        const double to_sun[3])
{
    const size_t nodes = (size_t)l->count[2];
    double *memory = nb_allocate(allocator, 3 * nodes, sizeof *memory);
    if (memory == NULL) return 0;
    const column_space space = {l->count[2], 0, memory, memory + nodes, memory + 2 * nodes};
    for (int v = 0; v < l->count[1]; v++)
        for (int u = 0; u < l->count[0]; u++) fill_column(l, grid, to_sun, (const int[2]){u, v}, &space);
    nb_release(allocator, memory);
    return 1;
}

static double longest_amount(const nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3])
{
    return fmax(cells_along(l) / fabs(to_sun[l->axis]) * nb_grid_peak(grid), 1e-30);
}

/* Whether there is fog at any face of linear voxels: level with the axis `across`, of which it asks the middles of voxels. */
static int has_fog_at(const nebel_grid *grid, int across)
{
    const int a = (across + 1) % 3, b = (across + 2) % 3;
    double place[3];
    for (int far = 0; far < 2; far++)
        for (int i = 1; i < nb_grid_cells(grid, a); i++)
            for (int j = 1; j < nb_grid_cells(grid, b); j++) {
                place[across] = far ? nb_grid_end(grid, across) : nb_grid_margin(grid);
                place[a] = i;
                place[b] = j;
                if (nb_grid_density(grid, place) > 0) return 1;
            }
    return 0;
}

static void set_ends(nb_sun_lattice *l, const nebel_grid *grid, const double to_sun[3])
{
    l->up = to_sun[l->axis] > 0;
    l->ends_in_fog = !nb_grid_is_linear(grid) || has_fog_at(grid, 0) || has_fog_at(grid, 1) || has_fog_at(grid, 2);
    for (int i = 0; i < 3; i++) {
        const int axis = i < 2 ? l->side[i] : l->axis;
        l->end[i] = to_sun[axis] > 0 ? nb_grid_end(grid, axis) : nb_grid_margin(grid);
    }
}

/* ---- second differences ---------------------------------------------------------------------- */

/* Of a node along an axis, the nodes beside it so many numbers away; 0 at the rim. */
static int bend_of(int before, int here, int behind, int index, int count)
{
    return index > 0 && index < count - 1 ? before - 2 * here + behind : 0;
}

/* Blocks that have the node, or whose last cells it bounds. */
static void note_deviation(nb_sun_lattice *l, int i, int j, int k, uint16_t off)
{
    const int at[3] = {i, j, k};
    int low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = at[a] > 0 ? (at[a] - 1) / NB_LATTICE_BLOCK : 0;
        high[a] = at[a] / NB_LATTICE_BLOCK;
    }
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++) {
                uint16_t *most =
                    &l->deviation[((size_t)z * (size_t)l->blocks[1] + (size_t)y) * (size_t)l->blocks[0] + (size_t)x];
                if (off > *most) *most = off;
            }
}

/* Half way between nodes linear interpolation is off by an eighth of the second difference, on the average by a twelfth.
 * `below` and `here` are copies of layers as they were filled. */
static void finish_layer(nb_sun_lattice *l, int k, const uint16_t *below, const uint16_t *here)
{
    const int across = l->count[0];
    const size_t layer = (size_t)across * (size_t)l->count[1];
    uint16_t *node = l->amount + (size_t)k * layer;
    for (int j = 0; j < l->count[1]; j++)
        for (int i = 0; i < across; i++) {
            const size_t n = (size_t)j * (size_t)across + (size_t)i;
            const size_t row = j > 0 ? (size_t)across : 0, next = j < l->count[1] - 1 ? (size_t)across : 0;
            const int value = here[n];
            const int bend[3] = {bend_of(here[i > 0 ? n - 1 : n], value, here[i < across - 1 ? n + 1 : n], i, across),
                                 bend_of(here[n - row], value, here[n + next], j, l->count[1]),
                                 bend_of(below[n], value, node[k < l->count[2] - 1 ? n + layer : n], k, l->count[2])};
            const int off = abs(bend[0]) + abs(bend[1]) + abs(bend[2]);
            node[n] = number_of(value - (bend[0] + bend[1] + bend[2]) / 12.0);
            note_deviation(l, i, j, k, (uint16_t)(off / 8 < UINT16_MAX ? off / 8 + 1 : UINT16_MAX));
        }
}

static int finish_layers(nb_sun_lattice *l, const nebel_allocator *allocator)
{
    const size_t layer = (size_t)l->count[0] * (size_t)l->count[1];
    uint16_t *memory = nb_allocate(allocator, 2 * layer, sizeof *memory);
    if (memory == NULL) return 0;
    uint16_t *below = memory, *here = memory + layer;
    memset(l->deviation, 0, block_count(l) * sizeof *l->deviation);
    memcpy(below, l->amount, layer * sizeof *below);
    for (int k = 0; k < l->count[2]; k++) {
        memcpy(here, l->amount + (size_t)k * layer, layer * sizeof *here);
        finish_layer(l, k, below, here);
        uint16_t *const passed = below;
        below = here;
        here = passed;
    }
    nb_release(allocator, memory);
    return 1;
}

/* ---- flaws ----------------------------------------------------------------------------------- */

/* The sum of a cell's eight nodes, and the least of them. */
static double sum_corners(const nb_sun_lattice *l, int i, int j, int k, double *least)
{
    const size_t row = (size_t)l->count[0], layer = row * (size_t)l->count[1];
    double sum = 0;
    *least = UINT16_MAX;
    for (int n = 0; n < 8; n++) {
        const uint16_t node =
            l->amount[(size_t)(k + n / 4) * layer + (size_t)(j + n / 2 % 2) * row + (size_t)(i + n % 2)];
        sum += node;
        *least = fmin(*least, node);
    }
    return sum;
}

/* Steps from where the way to the sun leaves the box to the last layer, at most, of the columns of a cell: they are no part of that
 * way, where columns go on beside the box. */
static double most_outside(const nb_sun_lattice *l, int i, int j)
{
    const size_t row = (size_t)l->count[0], layer = row * (size_t)l->count[1];
    double most = 0;
    for (int n = 0; n < 4 && l->ends_in_fog; n++) {
        const int column[2] = {i + n % 2, j + n / 2};
        double end = l->end[2];
        for (int s = 0; s < 2; s++) {
            const double at = (l->end[s] - column_place(l, s, column[s], 0)) / l->lean[s];
            if (isfinite(at)) end = l->up ? fmin(end, at) : fmax(end, at);
        }
        const double node = l->up ? floor(end * l->per_layer) : ceil(end * l->per_layer);
        const size_t k = (size_t)fmin(fmax(node, 0), l->count[2] - 1);
        most = fmax(most, l->amount[k * layer + (size_t)column[1] * row + (size_t)column[0]]);
    }
    return most;
}

/* Of one cell, `true_middle` steps in its middle. Second differences alone do not see what changes from cell to cell and back, nor
 * does the middle alone where bends along two axes cancel there. */
static int is_flawed(const nb_sun_lattice *l, const int cell[3], double true_middle, double outside,
                     const nb_lattice_demand *demand)
{
    double least;
    const size_t block[3] = {(size_t)cell[0] / NB_LATTICE_BLOCK, (size_t)cell[1] / NB_LATTICE_BLOCK,
                             (size_t)cell[2] / NB_LATTICE_BLOCK};
    const double bend = l->deviation[(block[2] * (size_t)l->blocks[1] + block[1]) * (size_t)l->blocks[0] + block[0]];
    const double middle = sum_corners(l, cell[0], cell[1], cell[2], &least) / 8;
    const double off = fmax(1.5 * fabs(middle - true_middle), bend), unit = l->step * demand->extinction;
    return -expm1(-off * unit) * exp(-fmax(least - outside - off, 0) * unit) > demand->tolerance;
}

int nb_sun_lattice_find_flaws(const nb_sun_lattice *l, const nb_lattice_demand *demand, uint8_t *flawed)
{
    const body *b = (const body *)(const void *)l;
    const size_t cells = (size_t)l->count[2] - 1;
    const size_t row = (size_t)l->count[0] - 1, layer = row * ((size_t)l->count[1] - 1);
    double *memory = nb_allocate(&b->allocator, 3 * cells, sizeof *memory);
    if (memory == NULL) return 0;
    const column_space space = {l->count[2] - 1, 0.5, memory, memory + cells, memory + 2 * cells};
    for (int j = 0; j < l->count[1] - 1; j++)
        for (int i = 0; i < l->count[0] - 1; i++) {
            const double outside = most_outside(l, i, j);
            walk_column(l, b->grid, b->to_sun, (const double[2]){i + 0.5, j + 0.5}, &space);
            for (int n = 0; n < space.count; n++) {
                const int cell[3] = {i, j, l->up ? space.count - 1 - n : n};
                flawed[(size_t)cell[2] * layer + (size_t)j * row + (size_t)i] =
                    (uint8_t)is_flawed(l, cell, space.sum[n] / l->step, outside, demand);
            }
        }
    nb_release(&b->allocator, memory);
    return 1;
}

/* ---- life ------------------------------------------------------------------------------------ */

static void free_body(body *b)
{
    const nebel_allocator allocator = b->allocator;
    nebel_release_grid(b->grid);
    nb_release(&allocator, b->lattice.amount);
    nb_release(&allocator, b->lattice.deviation);
    nb_release(&allocator, b);
}

static int fill_lattice(nb_sun_lattice *l, const nebel_grid *grid, const nebel_allocator *allocator,
                        const double to_sun[3])
{
    set_ends(l, grid, to_sun);
    l->step = longest_amount(l, grid, to_sun) / UINT16_MAX;
    l->bytes = (node_count(l) + block_count(l)) * sizeof *l->amount;
    l->amount = nb_allocate(allocator, node_count(l) + 1, sizeof *l->amount); /* gathers read one more */
    l->deviation = nb_allocate(allocator, block_count(l) + 1, sizeof *l->deviation);
    if (l->amount == NULL || l->deviation == NULL || !fill_columns(l, grid, allocator, to_sun)) return 0;
    return finish_layers(l, allocator);
}

nb_sun_lattice *nb_sun_lattice_make(nebel_grid *grid, const nebel_allocator *allocator, const double to_sun[3],
                                    nb_sun_lattice_limit limit)
{
    body *b = nb_allocate_zero(allocator, 1, sizeof *b);
    if (b == NULL) return NULL;
    b->allocator = *allocator;
    atomic_init(&b->owners, 1);
    b->grid = nebel_retain_grid(grid);
    memcpy(b->to_sun, to_sun, sizeof b->to_sun);
    nb_sun_lattice_lay(&b->lattice, grid, to_sun, limit);
    if (fill_lattice(&b->lattice, grid, allocator, to_sun)) return &b->lattice;
    free_body(b);
    return NULL;
}

nb_sun_lattice *nb_sun_lattice_retain(nb_sun_lattice *lattice)
{
    if (lattice != NULL) atomic_fetch_add_explicit(&((body *)(void *)lattice)->owners, 1, memory_order_relaxed);
    return lattice;
}

void nb_sun_lattice_release(nb_sun_lattice *lattice)
{
    body *b = (body *)(void *)lattice;
    if (b != NULL && atomic_fetch_sub_explicit(&b->owners, 1, memory_order_acq_rel) == 1) free_body(b);
}

int nb_sun_lattice_is_of(const nb_sun_lattice *lattice, const nebel_grid *grid, const double to_sun[3],
                         nb_sun_lattice_limit limit)
{
    const body *b = (const body *)(const void *)lattice;
    nb_sun_lattice wanted = {0};
    if (b->grid != grid || memcmp(b->to_sun, to_sun, sizeof b->to_sun) != 0) return 0;
    nb_sun_lattice_lay(&wanted, grid, to_sun, limit);
    return wanted.axis == lattice->axis && memcmp(wanted.count, lattice->count, sizeof wanted.count) == 0;
}
