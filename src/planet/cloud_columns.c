/* Columns of clouds as they were found before: on the faces of a cube around the planet, linear between grid points. Of
 * the smallest octave of noise a grid point is an eighth of a cell, of far clouds no more than a pixel. */
#include "cloud_view.h"

#include "base/hash.h"
#include "base/vector.h"

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

/* A grid on a face: level 0 is as it is; each next one twice as wide. */
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
        .key = UINT32_C(0x80000000) | (uint32_t)(level * NEBEL_MAX_CLOUD_LAYERS + layer) << 3 | (uint32_t)face,
    };
}

/* Tables hold 4 x 4 neighbours one behind the other, which share lines of the processor's cache. */
static uint32_t hash_of(uint32_t key, int x, int y)
{
    const uint32_t tile_x = (uint32_t)x >> 2, tile_y = (uint32_t)y >> 2;
    const uint32_t tile = nb_mix_bits(key + tile_x * UINT32_C(0x9e3779b1) + tile_y * UINT32_C(0x85ebca77));
    return tile << 4 | ((uint32_t)y & 3) << 2 | ((uint32_t)x & 3);
}

static double whole_below(double x)
{
    const double toward_zero = (double)(int64_t)x;
    return toward_zero - (toward_zero > x);
}

static const nb_cloud_column *point_at(nebel_cloud_workspace *workspace, const nb_grid *grid, int x, int y)
{
    nb_cloud_point *point = &workspace->points[hash_of(grid->key, x, y) & (NB_CLOUD_POINTS - 1)];
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

static const nb_cloud_patch *patch_at(nebel_cloud_workspace *workspace, const nb_grid *grid, int x, int y)
{
    nb_cloud_patch *patch = &workspace->patches[hash_of(grid->key, x, y) & (NB_CLOUD_PATCHES - 1)];
    if (patch->key == grid->key && patch->at[0] == x && patch->at[1] == y) return patch;
    *patch = (nb_cloud_patch){.key = grid->key, .at = {x, y}};
    for (int k = 0; k < 4; k++) {
        const nb_cloud_column *column = point_at(workspace, grid, x + (k & 1), y + (k >> 1));
        patch->ranks[k] = column->rank;
        patch->scales[k] = column->scale;
        patch->variances[k] = column->variance;
    }
    return patch;
}

static inline float mix(const float weights[4], const float of[4])
{
    return weights[0] * of[0] + weights[1] * of[1] + weights[2] * of[2] + weights[3] * of[3];
}

static nb_cloud_column read_grid(nebel_cloud_workspace *workspace, int layer, const nb_cube_place *place, int level)
{
    const nb_grid grid = grid_of(workspace->view->clouds, layer, level, place->face);
    const double x = place->at[0] * grid.of->per_spacing, y = place->at[1] * grid.of->per_spacing;
    const double left = whole_below(x), low = whole_below(y);
    const float u = (float)(x - left), v = (float)(y - low);
    const float weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    const nb_cloud_patch *patch = patch_at(workspace, &grid, (int)left, (int)low);
    return (nb_cloud_column){mix(weights, patch->ranks), mix(weights, patch->scales), mix(weights, patch->variances)};
}

/* Numbers are held to the last grid but one. */
#define WIDEST ((float)(1U << (NB_CLOUD_GRIDS - 2)))

/* The first grid of two, and the part of the second, for a width: the finer one up to three quarters of the way. */
static int levels_of(const nb_cloud_layer *layer, float width, float *part)
{
    const float level = nb_level_of(nb_smaller(2 * width / layer->grid, WIDEST));
    const int low = (int)level;
    *part = nb_larger(0, 2 * (level - (float)low) - 1);
    return low;
}

nb_cloud_column nb_cloud_column_near(nebel_cloud_workspace *workspace, int layer, const double place[3], float width)
{
    const nb_cube_place at = cube_of(place);
    float part;
    const int level = levels_of(&workspace->view->clouds->layers[layer], width, &part);
    nb_cloud_column column = read_grid(workspace, layer, &at, level);
    if (!(part > 0)) return column;
    const nb_cloud_column next = read_grid(workspace, layer, &at, level + 1);
    column.rank += part * (next.rank - column.rank);
    column.scale += part * (next.scale - column.scale);
    column.variance += part * (next.variance - column.variance);
    return column;
}

/* ---- where no cloud can be ------------------------------------------------------------------- */

/* Points of the grid to a block of size 0, and blocks to one of the next size. */
enum { POINTS = 4, BLOCKS = 4 };

static float block_at(nebel_cloud_workspace *workspace, const nb_grid *grid, int size, int x, int y)
{
    const uint32_t key = grid->key ^ (uint32_t)size << 29;
    nb_cloud_block *block = &workspace->blocks[hash_of(key, x, y) & (NB_CLOUD_BLOCKS - 1)];
    if (block->key == key && block->at[0] == x && block->at[1] == y) return block->most;
    float most = -HUGE_VALF;
    if (size > 0) {
        for (int i = 0; i < BLOCKS * BLOCKS; i++)
            most =
                nb_larger(most, block_at(workspace, grid, size - 1, x * BLOCKS + i % BLOCKS, y * BLOCKS + i / BLOCKS));
    } else {
        for (int i = 0; i < (POINTS + 1) * (POINTS + 1); i++) {
            const nb_cloud_column *column =
                point_at(workspace, grid, x * POINTS + i % (POINTS + 1), y * POINTS + i / (POINTS + 1));
            most = nb_larger(most, column->rank + sqrtf(3 * column->variance));
        }
    }
    *block = (nb_cloud_block){.key = key, .at = {x, y}, .most = most};
    return most;
}

/* Beyond a face's edge there are points, too: blocks that lie across need no more than others. */
nb_cloud_outlook nb_cloud_look_out(const nebel_cloud_workspace *workspace, int layer, const double place[3],
                                   const double direction[3], float width)
{
    const nb_cube_place at = cube_of(place);
    const int axis = at.face / 2, across[2] = {axis == 0, axis == 2 ? 1 : 2};
    const double sign = at.face & 1 ? -1 : 1;
    nb_cloud_outlook out = {
        .layer = layer, .face = at.face, .over = sign * place[axis], .rise = sign * direction[axis]};
    out.level = levels_of(&workspace->view->clouds->layers[layer], width, &out.part);
    for (int i = 0; i < 2; i++) {
        out.at[i] = at.at[i];
        out.place[i] = place[across[i]];
        out.direction[i] = direction[across[i]];
        /* A place on a face moves one way along all of a ray. */
        out.grows[i] = out.direction[i] * out.over > out.place[i] * out.rise;
    }
    return out;
}

float nb_cloud_most_rank(nebel_cloud_workspace *workspace, const nb_cloud_outlook *out, int size, double *way)
{
    static const double sides[3] = {POINTS, POINTS * BLOCKS, POINTS * BLOCKS * BLOCKS};
    float most = -HUGE_VALF;
    *way = HUGE_VAL;
    for (int k = 0; k < 2; k++) {
        if (k == 0 ? out->part >= 1 : out->part <= 0) continue;
        const nb_grid grid = grid_of(workspace->view->clouds, out->layer, out->level + k, out->face);
        const double side = grid.of->spacing * sides[size], per_side = grid.of->per_spacing * (1 / sides[size]);
        int block[2];
        for (int i = 0; i < 2; i++) {
            const double low = whole_below(out->at[i] * per_side), edge = (low + out->grows[i]) * side;
            const double ahead = (edge * out->over - out->place[i]) / (out->direction[i] - edge * out->rise);
            if (ahead > 0 && ahead < *way) *way = ahead;
            block[i] = (int)low;
        }
        const float here = block_at(workspace, &grid, size, block[0], block[1]);
        if (here > most) most = here;
    }
    return most;
}

/* Who looks from within a heap sees no gaps of it. */
#define HEAP_PART 0.45f

float nb_cloud_seen_at(nebel_cloud_workspace *workspace, int layer, const double place[3], float width, int is_alone)
{
    const nb_cloud_layer *of = &workspace->view->clouds->layers[layer];
    const double radius = nb_vector_length(place);
    if (!(radius > of->low && radius < of->high)) return 0;
    const nb_cloud_noise *noise = &workspace->view->clouds->noise;
    nb_cloud_column column;
    if (is_alone) {
        const double unit[3] = {place[0] / radius, place[1] / radius, place[2] / radius};
        column = nb_cloud_column_at(noise, of, unit, width);
    } else {
        column = nb_cloud_column_near(workspace, layer, place, width);
    }
    const float height = (float)(radius - of->low) * of->per_thickness;
    float missing[NB_CLOUD_BILLOWS + 1];
    nb_cloud_drops drops;
    if (!nb_cloud_in_column(noise, of, &column, place, height, width, missing, &drops)) return 0;
    const float hidden = nb_smaller(nb_smaller(of->hidden_height, of->hidden_width), width - HEAP_PART * of->size);
    return nb_cloud_through(&drops, hidden, 1).whole;
}
