#include "light_lattice.h"

#include "medium/grid.h"

#include <math.h>

/* ---- placing --------------------------------------------------------------------------------- */

/* A lattice of one light has no more nodes, all together have no more. */
#define MOST_NODES ((size_t)1 << 16)
#define MOST_NODES_OF_ALL ((size_t)1 << 20)

/* Cells between nodes, at best and at worst. */
#define FINEST 2.0
#define COARSEST 8.0

/* Along an axis, where there are cells for so many. */
#define FEWEST_NODES 8

static size_t lattice_nodes(const nb_light_lattice *l)
{
    return (size_t)l->count[0] * (size_t)l->count[1] * (size_t)l->count[2];
}

static size_t lattice_cells(const nb_light_lattice *l)
{
    return (size_t)(l->count[0] - 1) * (size_t)(l->count[1] - 1) * (size_t)(l->count[2] - 1);
}

/* From face to face of the box. */
static void lay(nb_light_lattice *l, const nebel_grid *grid, double spacing)
{
    l->first = nb_grid_margin(grid);
    for (int i = 0; i < 3; i++) {
        const double cells = nb_grid_end(grid, i) - l->first;
        const int wanted = (int)ceil(cells / spacing) + 1, fewest = (int)fmin(cells + 1, FEWEST_NODES);
        l->count[i] = wanted > fewest ? wanted : fewest;
        l->per_cell[i] = (l->count[i] - 1) / cells;
    }
}

static int has_lattice(const nebel_snapshot *snapshot, size_t medium)
{
    const nebel_density *density = &snapshot->media[medium].body.density;
    return density->type == NEBEL_DENSITY_GRID && nb_grid_is_linear(density->grid);
}

/* ---- nodes ----------------------------------------------------------------------------------- */

/* The light in cells of the grid; cells per metre along each axis. */
typedef struct light_in_cells {
    double place[3], rate[3], clear;
} light_in_cells;

static light_in_cells in_cells(const nb_volume *body, const nb_light *light)
{
    const nb_leaf *leaf = &body->leaves[0];
    const nebel_grid *grid = body->density.grid;
    light_in_cells c = {.clear = light->clear};
    double from[3];
    nb_grid_rate(grid, leaf->low, leaf->high, c.rate);
    for (int i = 0; i < 3; i++) from[i] = light->place[i] - leaf->origin[i] - leaf->origin_rest[i];
    for (int i = 0; i < 3; i++) {
        const double *row = &leaf->matrix[3 * i];
        const double turned = row[0] * from[0] + row[1] * from[1] + row[2] * from[2];
        c.place[i] = nb_grid_margin(grid) + c.rate[i] * ((leaf->aligned ? from[i] : turned) - leaf->low[i]);
    }
    return c;
}

/* Up to where the way leaves the box. */
static double length_in_box(const nebel_grid *grid, const nb_grid_line *line, double length)
{
    for (int i = 0; i < 3; i++) {
        const double face = line->slope[i] > 0 ? nb_grid_end(grid, i) : nb_grid_margin(grid);
        const double crossing = (face - line->from[i]) / line->slope[i];
        if (line->slope[i] != 0) length = fmin(length, fmax(crossing, 0));
    }
    return length;
}

static double mean_to_light(const nebel_grid *grid, const light_in_cells *light, const double place[3])
{
    nb_grid_line line;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double metres = (light->place[i] - place[i]) / light->rate[i];
        square += metres * metres;
    }
    const double distance = sqrt(square), length = distance - light->clear;
    if (!(length > 0)) return nb_grid_density(grid, place);
    for (int i = 0; i < 3; i++) {
        line.from[i] = place[i];
        line.slope[i] = (light->place[i] - place[i]) / distance;
    }
    return nb_grid_integral(grid, &line, length_in_box(grid, &line, length), 0, HUGE_VAL).value / length;
}

static void fill_nodes(nb_light_lattice *l, const nebel_grid *grid, const light_in_cells *light)
{
    size_t n = 0;
    for (int z = 0; z < l->count[2]; z++)
        for (int y = 0; y < l->count[1]; y++)
            for (int x = 0; x < l->count[0]; x++) {
                const double place[3] = {l->first + x / l->per_cell[0], l->first + y / l->per_cell[1],
                                         l->first + z / l->per_cell[2]};
                l->mean[n++] = (float)mean_to_light(grid, light, place);
            }
}

/* Half way between nodes linear interpolation of a parabola is off by an eighth of the second difference. It is told twice:
 * means are no parabolas (tests/test_grid_sun.c counts places where more is true than is told). */
static double deviation_at(const nb_light_lattice *l, const int at[3], size_t n)
{
    const size_t stride[3] = {1, (size_t)l->count[0], (size_t)l->count[0] * (size_t)l->count[1]};
    double off = 0;
    for (int i = 0; i < 3; i++)
        if (at[i] > 0 && at[i] < l->count[i] - 1)
            off += fabs((double)l->mean[n - stride[i]] - 2 * (double)l->mean[n] + (double)l->mean[n + stride[i]]);
    return off / 4;
}

/* The most of each cell's nodes. */
static void fill_deviations(nb_light_lattice *l)
{
    const size_t row = (size_t)l->count[0] - 1, layer = row * ((size_t)l->count[1] - 1);
    size_t n = 0;
    for (size_t i = 0; i < lattice_cells(l); i++) l->deviation[i] = 0;
    for (int z = 0; z < l->count[2]; z++)
        for (int y = 0; y < l->count[1]; y++)
            for (int x = 0; x < l->count[0]; x++, n++) {
                const float off = (float)deviation_at(l, (const int[3]){x, y, z}, n);
                for (int c = 0; c < 8; c++) {
                    const int i = x - c % 2, j = y - c / 2 % 2, k = z - c / 4;
                    if (i < 0 || j < 0 || k < 0 || i > l->count[0] - 2 || j > l->count[1] - 2 || k > l->count[2] - 2)
                        continue;
                    float *most = &l->deviation[(size_t)k * layer + (size_t)j * row + (size_t)i];
                    if (off > *most) *most = off;
                }
            }
}

/* What second differences of nodes do not show is looked at in the middle of each cell, and told as this multiple. */
#define MIDDLE_CAUTION 2.0

static void check_middles(nb_light_lattice *l, const nebel_grid *grid, const light_in_cells *light)
{
    const size_t row = (size_t)l->count[0], layer = row * (size_t)l->count[1];
    size_t cell = 0;
    for (int z = 0; z < l->count[2] - 1; z++)
        for (int y = 0; y < l->count[1] - 1; y++)
            for (int x = 0; x < l->count[0] - 1; x++, cell++) {
                const size_t n = (size_t)z * layer + (size_t)y * row + (size_t)x;
                const double place[3] = {l->first + (x + 0.5) / l->per_cell[0], l->first + (y + 0.5) / l->per_cell[1],
                                         l->first + (z + 0.5) / l->per_cell[2]};
                double mean = 0;
                for (size_t c = 0; c < 8; c++)
                    mean += 0.125 * (double)l->mean[n + c % 2 + c / 2 % 2 * row + c / 4 * layer];
                const float off = (float)(MIDDLE_CAUTION * fabs(mean_to_light(grid, light, place) - mean));
                if (off > l->deviation[cell]) l->deviation[cell] = off;
            }
}

/* ---- all of them ----------------------------------------------------------------------------- */

/* So many cells between nodes that the lattices of all lights, of this grid's share, are not too many; 0: none. */
static double choose_spacing(const nebel_grid *grid, size_t light_count, size_t grid_count)
{
    const size_t share = MOST_NODES_OF_ALL / grid_count / light_count, most = share < MOST_NODES ? share : MOST_NODES;
    for (double spacing = FINEST; spacing <= COARSEST; spacing *= 2) {
        nb_light_lattice l;
        lay(&l, grid, spacing);
        if (lattice_nodes(&l) <= most) return spacing;
    }
    return 0;
}

/* 0 where memory is out. */
static int open_medium(nb_light_lattices *all, const nebel_grid *grid, nb_light_lattice **of_medium)
{
    const double spacing = choose_spacing(grid, all->light_count, all->grid_count);
    int has_room = 1;
    if (!(spacing > 0)) return 1;
    *of_medium = nb_allocate_zero(&all->allocator, all->light_count, sizeof **of_medium);
    if (*of_medium == NULL) return 0;
    for (size_t i = 0; i < all->light_count && has_room; i++) {
        nb_light_lattice *l = &(*of_medium)[i];
        lay(l, grid, spacing);
        l->mean = nb_allocate(&all->allocator, lattice_nodes(l), sizeof *l->mean);
        l->deviation = nb_allocate(&all->allocator, lattice_cells(l), sizeof *l->deviation);
        has_room = l->mean != NULL && l->deviation != NULL;
    }
    return has_room;
}

nb_light_lattices *nb_light_lattices_open(const nebel_allocator *allocator, const nebel_snapshot *snapshot,
                                          size_t light_count)
{
    nb_light_lattices *all = nb_allocate_zero(allocator, 1, sizeof *all);
    if (all == NULL) return NULL;
    all->allocator = *allocator;
    all->light_count = light_count;
    all->medium_count = snapshot->medium_count;
    all->of_medium = nb_allocate_zero(allocator, snapshot->medium_count, sizeof *all->of_medium);
    all->grids = nb_allocate(allocator, snapshot->medium_count, sizeof *all->grids);
    atomic_init(&all->begun, 0);
    atomic_init(&all->done, 0);
    int has_room = all->of_medium != NULL && all->grids != NULL;
    for (size_t i = 0; i < snapshot->medium_count && has_room; i++)
        if (has_lattice(snapshot, i)) all->grids[all->grid_count++] = i;
    for (size_t i = 0; i < all->grid_count && has_room; i++)
        has_room = open_medium(all, snapshot->media[all->grids[i]].body.density.grid, &all->of_medium[all->grids[i]]);
    if (has_room) return all;
    nb_light_lattices_free(all);
    return NULL;
}

static void fill_lattice_of(const nb_volume *body, const nb_light *light, nb_light_lattice *l)
{
    const light_in_cells place = in_cells(body, light);
    fill_nodes(l, body->density.grid, &place);
    fill_deviations(l);
    check_middles(l, body->density.grid, &place);
}

void nb_light_lattices_fill(nb_light_lattices *all, const nebel_snapshot *snapshot, const nb_light *lights)
{
    const size_t count = all->grid_count * all->light_count;
    while (atomic_load_explicit(&all->done, memory_order_acquire) < count) {
        if (atomic_load_explicit(&all->begun, memory_order_relaxed) >= count) continue; /* another one is at the last */
        const size_t i = atomic_fetch_add_explicit(&all->begun, 1, memory_order_relaxed);
        if (i >= count) continue;
        const size_t medium = all->grids[i / all->light_count], light = i % all->light_count;
        nb_light_lattice *of_medium = all->of_medium[medium];
        if (of_medium != NULL) fill_lattice_of(&snapshot->media[medium].body, &lights[light], &of_medium[light]);
        atomic_fetch_add_explicit(&all->done, 1, memory_order_release);
    }
}

void nb_light_lattices_free(nb_light_lattices *all)
{
    if (all == NULL) return;
    const nebel_allocator allocator = all->allocator;
    for (size_t i = 0; all->of_medium != NULL && i < all->medium_count; i++) {
        for (size_t k = 0; all->of_medium[i] != NULL && k < all->light_count; k++) {
            nb_release(&allocator, all->of_medium[i][k].mean);
            nb_release(&allocator, all->of_medium[i][k].deviation);
        }
        nb_release(&allocator, all->of_medium[i]);
    }
    nb_release(&allocator, all->of_medium);
    nb_release(&allocator, all->grids);
    nb_release(&allocator, all);
}
