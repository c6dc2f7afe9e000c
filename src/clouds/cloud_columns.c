/* Columns of clouds as they were found before: on the faces of a cube around the planet, linear between grid points. Of
 * the smallest octave of noise a grid point is an eighth of a cell, of far clouds no more than a pixel. */
#include "cloud_density.h"
#include "cloud_lighting.h"

#include "math/vector.h"

#include <math.h>

/* A face of the cube and the place on it, -1 to 1. */
typedef struct nb_cube_place {
    int face;
    double at[2];
} nb_cube_place;

static nb_cube_place cube_of(const double unit[3])
{
    const double x = fabs(unit[0]), y = fabs(unit[1]), z = fabs(unit[2]);
    const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2), a = axis == 0, b = axis == 2 ? 1 : 2;
    const double per = 1 / (axis == 0 ? x : axis == 1 ? y : z);
    return (nb_cube_place){2 * axis + (unit[axis] < 0), {unit[a] * per, unit[b] * per}};
}

static void unit_of(nb_cube_place place, double unit[3])
{
    const int axis = place.face / 2, a = axis == 0, b = axis == 2 ? 1 : 2;
    unit[axis] = place.face & 1 ? -1 : 1;
    unit[a] = place.at[0];
    unit[b] = place.at[1];
    nb_vector_make_unit(unit);
}

typedef struct nb_grid {
    const nb_cloud_layer *layer;
    const nb_cloud_grid *of;
    uint32_t key;
} nb_grid;

static inline nb_grid grid_of(const nebel_clouds *clouds, int layer, int level, int face)
{
    return (nb_grid){
        .layer = &clouds->layers[layer],
        .of = &clouds->layers[layer].grids[level],
        .key = nb_cloud_grid_key(layer, level, face),
    };
}

/* The whole numbers below, of which 32 bits are enough. */
static nb_two two_below(nb_two x)
{
    typedef int32_t nb_two_counts __attribute__((vector_size(8)));
    typedef int64_t nb_two_bits __attribute__((vector_size(16)));
    const nb_two toward_zero = __builtin_convertvector(__builtin_convertvector(x, nb_two_counts), nb_two);
    const nb_two one = {1, 1};
    return toward_zero - (nb_two)((nb_two_bits)(toward_zero > x) & (nb_two_bits)one);
}

static const nb_cloud_column *point_at(nebel_cloud_workspace *workspace, const nb_grid *grid, int x, int y)
{
    nb_cloud_point *point = &workspace->points[nb_cloud_grid_hash(grid->key, x, y) & (NB_CLOUD_POINTS - 1)];
    if (!(point->key == grid->key && point->at[0] == x && point->at[1] == y)) {
        const nb_cube_place place = {(int)(grid->key & 7), {x * grid->of->spacing, y * grid->of->spacing}};
        double unit[3];
        unit_of(place, unit);
        *point = (nb_cloud_point){
            .key = grid->key,
            .at = {x, y},
            .column = nb_cloud_column_at(&workspace->view->clouds->noise, grid->layer, unit, grid->of->width)};
    }
    return &point->column;
}

/* The four columns around a cell, which may have taken another's place. */
static void fill_patch(nebel_cloud_workspace *workspace, int layer, uint32_t key, int32_t x, int32_t y,
                       nb_cloud_patch *patch)
{
    const int level = (int)(key >> 3 & 0xffffff) / NEBEL_MAX_CLOUD_LAYERS;
    const nb_grid grid = grid_of(workspace->view->clouds, layer, level, (int)(key & 7));
    *patch = (nb_cloud_patch){.key = key, .at = {x, y}};
    for (int k = 0; k < 4; k++) {
        const nb_cloud_column *column = point_at(workspace, &grid, x + (k & 1), y + (k >> 1));
        patch->columns[k] = (nb_four){column->rank, column->scale, column->variance, 0};
    }
}

/* Linear between the columns around a cell, which are found once. */
static inline nb_four read_cell(nebel_cloud_workspace *workspace, int layer, const nb_cloud_cells *cells, int lane)
{
    const uint32_t key = cells->key[lane];
    const int32_t x = cells->x[lane], y = cells->y[lane];
    nb_cloud_patch *patch = &workspace->patches[cells->hash[lane] & (NB_CLOUD_PATCHES - 1)];
    if (!(patch->key == key && patch->at[0] == x && patch->at[1] == y)) fill_patch(workspace, layer, key, x, y, patch);
    const nb_four *columns = patch->columns;
    const nb_four near = columns[0] + cells->u[lane] * (columns[1] - columns[0]);
    const nb_four far = columns[2] + cells->u[lane] * (columns[3] - columns[2]);
    return near + cells->v[lane] * (far - near);
}

/* First all cells are sent for, which caches seldom have, so that one does not wait for the other. */
static void find_columns(nebel_cloud_workspace *workspace, int layer, nb_cloud_density_query *looks)
{
    for (int i = 0; i < looks->count; i++) {
        __builtin_prefetch(&workspace->patches[looks->cells[0].hash[i] & (NB_CLOUD_PATCHES - 1)]);
        if (looks->next[i] > 0)
            __builtin_prefetch(&workspace->patches[looks->cells[1].hash[i] & (NB_CLOUD_PATCHES - 1)]);
    }
    for (int i = 0; i < looks->count; i++) {
        const float next = looks->next[i];
        if (!nb_cloud_is_in_layer(looks, i)) continue;
        nb_four column = read_cell(workspace, layer, &looks->cells[0], i);
        if (next > 0) column += next * (read_cell(workspace, layer, &looks->cells[1], i) - column);
        looks->rank[i] = column[0];
        looks->scale[i] = column[1];
        looks->variance[i] = column[2];
    }
}

void nb_cloud_density(nebel_cloud_workspace *workspace, int layer, nb_cloud_density_query *looks)
{
    const nb_cloud_kernel *kernel = workspace->view->kernel;
    const nebel_clouds *clouds = workspace->view->clouds;
    const nb_cloud_layer *of = &clouds->layers[layer];
    nb_cloud_fill_lanes(looks);
    kernel->find_places(of, layer, looks);
    nb_cloud_set_no_columns(looks);
    find_columns(workspace, layer, looks);
    kernel->find_drops(&clouds->noise, of, looks);
}

/* ---- where no cloud can be ------------------------------------------------------------------- */

/* Points of the grid to a block of size 0, and blocks to one of the next size. */
enum { POINTS = 4, BLOCKS = 4 };

/* A rank of a column, with all that a width hides. */
static float most_of(const nb_cloud_column *column)
{
    return column->rank + sqrtf(3 * column->variance);
}

static int is_above(nebel_cloud_workspace *workspace, const nb_grid *grid, int size, int x, int y, float least,
                    nb_cloud_column_block *known);

/* Part i of a block: a rank above `least`, or in *most the largest one. */
static int is_part_above(nebel_cloud_workspace *workspace, const nb_grid *grid, int size, int x, int y, int i,
                         float least, float *most)
{
    nb_cloud_column_block part;
    int is;
    if (size == 0) {
        *most = most_of(point_at(workspace, grid, x * POINTS + i % (POINTS + 1), y * POINTS + i / (POINTS + 1)));
        return *most > least;
    }
    is = is_above(workspace, grid, size - 1, x * BLOCKS + i % BLOCKS, y * BLOCKS + i / BLOCKS, least, &part);
    *most = is ? part.above : part.highest;
    return is;
}

/* Whether a column of a block has a rank above `least`. The first one that has is enough: where clouds are, most of a block need not be
 * found. */
static int is_above(nebel_cloud_workspace *workspace, const nb_grid *grid, int size, int x, int y, float least,
                    nb_cloud_column_block *known)
{
    const uint32_t key = grid->key ^ (uint32_t)size << 29;
    const int parts = size == 0 ? (POINTS + 1) * (POINTS + 1) : BLOCKS * BLOCKS;
    nb_cloud_column_block *block = &workspace->blocks[nb_cloud_grid_hash(key, x, y) & (NB_CLOUD_BLOCKS - 1)];
    const int is_there = block->key == key && block->at[0] == x && block->at[1] == y;
    *known = is_there ? *block
                      : (nb_cloud_column_block){.key = key, .at = {x, y}, .above = -HUGE_VALF, .highest = HUGE_VALF};
    if (known->above > least) return 1;
    if (known->highest <= least) return 0;
    float highest = -HUGE_VALF;
    for (int i = 0; i < parts; i++) {
        float most;
        if (is_part_above(workspace, grid, size, x, y, i, least, &most)) {
            known->above = most;
            *block = *known;
            return 1;
        }
        highest = nb_larger(highest, most);
    }
    known->highest = highest;
    *block = *known;
    return 0;
}

/* Beyond a face's edge there are points, too: blocks that lie across need no more than others. */
nb_cloud_column_cursor nb_cloud_density_out(const nebel_cloud_workspace *workspace, int layer, const double place[3],
                                            const double direction[3], float width)
{
    const nb_cube_place at = cube_of(place);
    const int axis = at.face / 2, across[2] = {axis == 0, axis == 2 ? 1 : 2};
    const double sign = at.face & 1 ? -1 : 1;
    nb_cloud_column_cursor out = {
        .layer = layer, .face = at.face, .over = sign * place[axis], .rise = sign * direction[axis]};
    const float level = nb_cloud_grid_level(workspace->view->clouds->layers[layer].grid, width);
    out.level = (int)level;
    out.part = nb_cloud_next_part(level, out.level);
    for (int i = 0; i < 2; i++) {
        out.at[i] = at.at[i];
        out.place[i] = place[across[i]];
        out.direction[i] = direction[across[i]];
        /* A place on a face moves one way along all of a ray. */
        out.grows[i] = out.direction[i] * out.over > out.place[i] * out.rise;
    }
    return out;
}

/* Of the two grids between which columns are mixed: those that count. */
static int first_grid(const nb_cloud_column_cursor *out)
{
    return out->part < 1 ? 0 : 1;
}

static int last_grid(const nb_cloud_column_cursor *out)
{
    return out->part > 0 ? 1 : 0;
}

static const double sides[3] = {POINTS, POINTS *BLOCKS, POINTS *BLOCKS *BLOCKS};
static const double per_sides[3] = {1.0 / POINTS, 1.0 / (POINTS * BLOCKS), 1.0 / (POINTS * BLOCKS * BLOCKS)};

/* From the edge of a block rays go on into the next one. In sides of blocks, more than rounding and nothing to ranks. */
#define ONWARD 1e-9

double nb_cloud_way_in_block(const nebel_cloud_workspace *workspace, nb_cloud_column_cursor *out, int size)
{
    const nb_cloud_grid *grids = &workspace->view->clouds->layers[out->layer].grids[out->level];
    double way = HUGE_VAL;
    for (int k = first_grid(out); k <= last_grid(out); k++) {
        const double side = grids[k].spacing * sides[size], per_side = grids[k].per_spacing * per_sides[size];
        const nb_two low = two_below(out->at * per_side + ONWARD * (2 * out->grows - 1));
        const nb_two edge = (low + out->grows) * side;
        const nb_two ahead = (edge * out->over - out->place) / (out->direction - edge * out->rise);
        for (int i = 0; i < 2; i++) {
            if (ahead[i] > 0 && ahead[i] < way) way = ahead[i];
            out->block[k][i] = (int)low[i];
        }
    }
    return way;
}

int nb_cloud_is_block_above(nebel_cloud_workspace *workspace, const nb_cloud_column_cursor *out, int size, float least)
{
    nb_cloud_column_block known;
    for (int k = first_grid(out); k <= last_grid(out); k++) {
        const nb_grid grid = grid_of(workspace->view->clouds, out->layer, out->level + k, out->face);
        if (is_above(workspace, &grid, size, out->block[k][0], out->block[k][1], least, &known)) return 1;
    }
    return 0;
}
