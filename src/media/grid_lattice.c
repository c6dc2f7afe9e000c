#include "grid_lattice.h"

#include "base/base.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A lattice and what keeps it. */
typedef struct body {
    nb_grid_lattice lattice;
    nebel_allocator allocator;
    atomic_size_t owners;
    nebel_grid *grid;
    double to_sun[3];
} body;

/* Two columns per cell where they are no more nodes than this, else one; then half as many, until they fit. */
#define MOST_NODES ((size_t)1 << 25)

/* ---- placing --------------------------------------------------------------------------------- */

static void set_axes(nb_grid_lattice *l, const double to_sun[3])
{
    l->axis = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(to_sun[i]) > fabs(to_sun[l->axis])) l->axis = i;
    for (int s = 0; s < 2; s++) {
        l->side[s] = (l->axis + 1 + s) % 3;
        l->lean[s] = to_sun[l->side[s]] / to_sun[l->axis];
    }
}

/* Columns enough for all ways that meet the cells, and one more on either side. */
static void set_counts(nb_grid_lattice *l, const nebel_grid *grid)
{
    const double layers = nb_grid_cells(grid, l->axis);
    for (int s = 0; s < 2; s++) {
        const double shift = l->lean[s] * layers;
        const double low = floor(fmin(-shift, 0) * l->per_cell) - 1;
        const double high = ceil((nb_grid_cells(grid, l->side[s]) + fmax(-shift, 0)) * l->per_cell) + 1;
        l->first[s] = low;
        l->count[s] = (int)(high - low) + 1;
    }
    l->count[2] = (int)layers + 1;
    for (int i = 0; i < 3; i++) l->blocks[i] = (l->count[i] + NB_LATTICE_BLOCK - 1) / NB_LATTICE_BLOCK;
}

static size_t node_count(const nb_grid_lattice *l)
{
    return (size_t)l->count[0] * (size_t)l->count[1] * (size_t)l->count[2];
}

static size_t block_count(const nb_grid_lattice *l)
{
    return (size_t)l->blocks[0] * (size_t)l->blocks[1] * (size_t)l->blocks[2];
}

static void choose_counts(nb_grid_lattice *l, const nebel_grid *grid)
{
    l->per_cell = 2;
    set_counts(l, grid);
    while (node_count(l) > MOST_NODES && l->count[0] > 8 && l->count[1] > 8) {
        l->per_cell /= 2;
        set_counts(l, grid);
    }
}

/* ---- columns --------------------------------------------------------------------------------- */

/* Where a column is within the box, in layers, and across which axes the faces are that it ends at. */
typedef struct part {
    double low, high;
    int low_axis, high_axis;
} part;

/* Ways that lean less run along the faces. */
#define LEAST_LEAN 1e-12

/* Along a side, of a column at a layer. Level columns beside the box are taken to its faces. */
static double place_of(const nb_grid_lattice *l, const nebel_grid *grid, int s, int column, double layer)
{
    const double place = (l->first[s] + column) / l->per_cell;
    if (fabs(l->lean[s]) >= LEAST_LEAN) return place + l->lean[s] * layer;
    return fmin(fmax(place, nb_grid_margin(grid)), nb_grid_end(grid, l->side[s]));
}

static part within_box(const nb_grid_lattice *l, const nebel_grid *grid, const int column[2])
{
    const double margin = nb_grid_margin(grid);
    part p = {margin, nb_grid_end(grid, l->axis), l->axis, l->axis};
    for (int s = 0; s < 2; s++) {
        const double from = place_of(l, grid, s, column[s], 0), end = nb_grid_end(grid, l->side[s]);
        if (fabs(l->lean[s]) < LEAST_LEAN) continue;
        const double a = (margin - from) / l->lean[s], b = (end - from) / l->lean[s];
        const double low = fmin(a, b), high = fmax(a, b);
        if (low > p.low) p.low_axis = l->side[s];
        if (high < p.high) p.high_axis = l->side[s];
        p.low = fmax(p.low, low);
        p.high = fmin(p.high, high);
    }
    return p;
}

/* Room for the nodes of a column: places along the walk, and what the walk says. */
typedef struct column_space {
    double *place, *sum;
} column_space;

/* From the sun down, so that the integral from a node to the sun is that of the walk so far. Nodes in front of the box
 * have nothing before the sun; those behind it have all. */
static void walk_column(const nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3], const int column[2],
                        const part *p, const column_space *space)
{
    const int up = to_sun[l->axis] > 0, layers = l->count[2];
    const double top = up ? p->high : p->low, metres = 1 / fabs(to_sun[l->axis]);
    const double length = (p->high - p->low) * metres;
    nb_grid_line line;
    line.from[l->axis] = top;
    line.slope[l->axis] = -to_sun[l->axis];
    for (int s = 0; s < 2; s++) {
        line.from[l->side[s]] = place_of(l, grid, s, column[s], top);
        line.slope[l->side[s]] = -to_sun[l->side[s]];
    }
    for (int n = 0; n < layers; n++) {
        const double below = up ? top - (layers - 1 - n) : n - top;
        space->place[n] = fmin(fmax(below, 0) * metres, length);
    }
    nb_grid_sums(grid, &line, length, layers, space->place, space->sum);
}

static uint16_t number_of(double amount)
{
    return (uint16_t)fmin(fmax(amount + 0.5, 0), UINT16_MAX);
}

static void fill_column(nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3], const int column[2],
                        const column_space *space)
{
    uint16_t *node = l->amount + (size_t)column[1] * (size_t)l->count[0] + (size_t)column[0];
    const size_t layer = (size_t)l->count[0] * (size_t)l->count[1];
    const part p = within_box(l, grid, column);
    const int is_met = p.low<p.high, up = to_sun[l->axis]> 0;
    if (is_met) walk_column(l, grid, to_sun, column, &p, space);
    for (int n = 0; n < l->count[2]; n++) {
        const size_t k = (size_t)(up ? l->count[2] - 1 - n : n);
        node[k * layer] = is_met ? number_of(space->sum[n] / l->step) : 0;
    }
}

static int fill_columns(nb_grid_lattice *l, const nebel_grid *grid, const nebel_allocator *allocator,
                        const double to_sun[3])
{
    double *memory = nb_allocate(allocator, 2 * (size_t)l->count[2], sizeof *memory);
    if (memory == NULL) return 0;
    const column_space space = {memory, memory + l->count[2]};
    for (int v = 0; v < l->count[1]; v++)
        for (int u = 0; u < l->count[0]; u++) fill_column(l, grid, to_sun, (const int[2]){u, v}, &space);
    nb_release(allocator, memory);
    return 1;
}

/* No way through the box is longer than it is along any axis. */
static double longest_amount(const nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3])
{
    double length = 1 / fabs(to_sun[l->axis]) * nb_grid_cells(grid, l->axis);
    for (int s = 0; s < 2; s++) {
        const double speed = fabs(to_sun[l->side[s]]);
        if (speed > 0) length = fmin(length, nb_grid_cells(grid, l->side[s]) / speed);
    }
    return fmax(length * nb_grid_peak(grid), 1e-30);
}

/* ---- second differences ---------------------------------------------------------------------- */

/* Of a node along an axis, the nodes beside it so many numbers away; 0 at the rim. */
static int bend_of(int before, int here, int behind, int index, int count)
{
    return index > 0 && index < count - 1 ? before - 2 * here + behind : 0;
}

/* Blocks that have the node, or whose last cells it bounds. */
static void note_deviation(nb_grid_lattice *l, int i, int j, int k, uint16_t off)
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

static void add_deviation(nb_grid_lattice *l, int i, int j, int k, double off)
{
    const uint16_t number = number_of(off / l->step);
    if (number > 0) note_deviation(l, i, j, k, number);
}

/* The density at a place of a column. */
static double density_at_end(const nb_grid_lattice *l, const nebel_grid *grid, const int column[2], double layer)
{
    double place[3];
    place[l->axis] = layer;
    for (int s = 0; s < 2; s++) place[l->side[s]] = place_of(l, grid, s, column[s], layer);
    return nb_grid_density(grid, place);
}

/* Where a column meets a face of the box the depth bends, by the density there times the metres of the way from node to
 * node: linear interpolation is off by a quarter of that at most. */
static void note_face(nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3], const int column[2],
                      double layer, int axis)
{
    const double nodes = fabs(to_sun[axis]) * (axis == l->axis ? 1 : l->per_cell);
    const double bend = density_at_end(l, grid, column, layer) / nodes;
    const int k = (int)fmin(fmax(floor(layer), 0), l->count[2] - 2);
    for (int side = 0; side < 2 && bend > 0; side++) add_deviation(l, column[0], column[1], k + side, bend / 4);
}

/* Ways beside each other that leave the box by different faces: behind the edge between them the depth bends, all the
 * way down. Beside a side of the box the way changes by 1 / |to_sun| of its axis. */
static void note_edge(nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3], const int column[2],
                      const part *p)
{
    const int up = to_sun[l->axis] > 0, end = up ? p->high_axis : p->low_axis;
    double steepest = 0;
    int differs = 0;
    for (int s = 0; s < 2; s++) {
        const double speed = fabs(to_sun[l->side[s]]) * l->per_cell;
        if (fabs(l->lean[s]) >= LEAST_LEAN) steepest = fmax(steepest, 1 / speed);
        for (int way = -1; way <= 1; way += 2) {
            int next[2] = {column[0], column[1]};
            next[s] += way;
            const part beside = within_box(l, grid, next);
            differs = differs || (up ? beside.high_axis : beside.low_axis) != end || !(beside.low < beside.high);
        }
    }
    if (!differs || !(steepest > 0)) return;
    const double bend = density_at_end(l, grid, column, up ? p->high : p->low) * steepest;
    for (int k = 0; k < l->count[2] && bend > 0; k++) add_deviation(l, column[0], column[1], k, bend / 4);
}

static void note_ends(nb_grid_lattice *l, const nebel_grid *grid, const double to_sun[3])
{
    for (int v = 0; v < l->count[1]; v++)
        for (int u = 0; u < l->count[0]; u++) {
            const int column[2] = {u, v};
            const part p = within_box(l, grid, column);
            if (!(p.low < p.high)) continue;
            note_face(l, grid, to_sun, column, p.low, p.low_axis);
            note_face(l, grid, to_sun, column, p.high, p.high_axis);
            note_edge(l, grid, to_sun, column, &p);
        }
}

/* Half way between nodes linear interpolation is off by an eighth of the second difference, on the average by a twelfth.
 * `below` and `here` are copies of layers as they were filled. */
static void finish_layer(nb_grid_lattice *l, int k, const uint16_t *below, const uint16_t *here)
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

static int finish_layers(nb_grid_lattice *l, const nebel_allocator *allocator)
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

/* ---- life ------------------------------------------------------------------------------------ */

static void free_body(body *b)
{
    const nebel_allocator allocator = b->allocator;
    nebel_release_grid(b->grid);
    nb_release(&allocator, b->lattice.amount);
    nb_release(&allocator, b->lattice.deviation);
    nb_release(&allocator, b);
}

static int fill_lattice(nb_grid_lattice *l, const nebel_grid *grid, const nebel_allocator *allocator,
                        const double to_sun[3])
{
    set_axes(l, to_sun);
    choose_counts(l, grid);
    l->step = longest_amount(l, grid, to_sun) / UINT16_MAX;
    l->bytes = (node_count(l) + block_count(l)) * sizeof *l->amount;
    l->amount = nb_allocate(allocator, node_count(l) + 1, sizeof *l->amount); /* gathers read one more */
    l->deviation = nb_allocate(allocator, block_count(l) + 1, sizeof *l->deviation);
    if (l->amount == NULL || l->deviation == NULL || !fill_columns(l, grid, allocator, to_sun)) return 0;
    if (!finish_layers(l, allocator)) return 0;
    note_ends(l, grid, to_sun);
    return 1;
}

nb_grid_lattice *nb_grid_lattice_make(nebel_grid *grid, const nebel_allocator *allocator, const double to_sun[3])
{
    body *b = nb_allocate_zero(allocator, 1, sizeof *b);
    if (b == NULL) return NULL;
    b->allocator = *allocator;
    atomic_init(&b->owners, 1);
    b->grid = nebel_retain_grid(grid);
    memcpy(b->to_sun, to_sun, sizeof b->to_sun);
    if (fill_lattice(&b->lattice, grid, allocator, to_sun)) return &b->lattice;
    free_body(b);
    return NULL;
}

nb_grid_lattice *nb_grid_lattice_retain(nb_grid_lattice *lattice)
{
    if (lattice != NULL) atomic_fetch_add_explicit(&((body *)(void *)lattice)->owners, 1, memory_order_relaxed);
    return lattice;
}

void nb_grid_lattice_release(nb_grid_lattice *lattice)
{
    body *b = (body *)(void *)lattice;
    if (b != NULL && atomic_fetch_sub_explicit(&b->owners, 1, memory_order_acq_rel) == 1) free_body(b);
}

int nb_grid_lattice_is_of(const nb_grid_lattice *lattice, const nebel_grid *grid, const double to_sun[3])
{
    const body *b = (const body *)(const void *)lattice;
    return b->grid == grid && memcmp(b->to_sun, to_sun, sizeof b->to_sun) == 0;
}
