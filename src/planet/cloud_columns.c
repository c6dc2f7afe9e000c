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

static void fill(const nebel_clouds *clouds, int layer, double spacing, float width, nb_cloud_point *point)
{
    double unit[3];
    const nb_cube_place place = {(int)(point->key & 7), {point->at[0] * spacing, point->at[1] * spacing}};
    unit_of(place, unit);
    point->column = nb_cloud_column_at(&clouds->noise, &clouds->layers[layer], unit, width);
}

/* A grid: level 0 is as it is; each next one twice as wide. */
typedef struct nb_grid {
    int layer, level;
    uint32_t key;
    double wide, spacing, per_spacing; /* m, and on the face */
} nb_grid;

static nb_grid grid_of(const nebel_clouds *clouds, int layer, int level, int face)
{
    const nb_cloud_layer *of = &clouds->layers[layer];
    nb_grid grid = {.layer = layer, .level = level};
    grid.key = UINT32_C(0x80000000) | (uint32_t)(level * NEBEL_MAX_CLOUD_LAYERS + layer) << 3 | (uint32_t)face;
    const double times = (double)(INT64_C(1) << level);
    grid.wide = (double)of->grid * times;
    grid.spacing = of->spacing * times;
    grid.per_spacing = of->per_spacing * (0x1p-40 * (double)(INT64_C(1) << (40 - level)));
    return grid;
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
        *point = (nb_cloud_point){.key = grid->key, .at = {x, y}};
        fill(workspace->view->clouds, grid->layer, grid->spacing, grid->level == 0 ? 0 : (float)grid->wide, point);
    }
    return &point->column;
}

static const nb_cloud_patch *patch_at(nebel_cloud_workspace *workspace, const nb_grid *grid, int x, int y)
{
    nb_cloud_patch *patch = &workspace->patches[hash_of(grid->key, x, y) & (NB_CLOUD_PATCHES - 1)];
    if (patch->key == grid->key && patch->at[0] == x && patch->at[1] == y) return patch;
    *patch = (nb_cloud_patch){.key = grid->key, .at = {x, y}};
    for (int k = 0; k < 4; k++) patch->columns[k] = *point_at(workspace, grid, x + (k & 1), y + (k >> 1));
    return patch;
}

static void read_grid(nebel_cloud_workspace *workspace, int layer, const nb_cube_place *place, int level, float weight,
                      nb_cloud_column *sum)
{
    const nb_grid grid = grid_of(workspace->view->clouds, layer, level, place->face);
    const double per = grid.per_spacing, x = place->at[0] * per, y = place->at[1] * per;
    const double left = whole_below(x), low = whole_below(y);
    const float u = (float)(x - left), v = (float)(y - low);
    const nb_cloud_patch *patch = patch_at(workspace, &grid, (int)left, (int)low);
    for (int k = 0; k < 4; k++) {
        const nb_cloud_column *column = &patch->columns[k];
        const float share = weight * (k & 1 ? u : 1 - u) * (k >> 1 ? v : 1 - v);
        sum->rank += share * column->rank;
        sum->scale += share * column->scale;
        sum->variance += share * column->variance;
    }
}

/* The first grid of two, and the part of the second, for a width: the finer one up to three quarters of the way. */
static int levels_of(const nb_cloud_layer *layer, float width, float *part)
{
    const float wide = width / layer->grid;
    int exponent = 0;
    *part = 0;
    if (!(wide > 0.75f)) return 0;
    const float mantissa = frexpf(nb_smaller(wide, 1e9f), &exponent); /* 0.5 to 1 */
    *part = nb_larger(0, 4 * (mantissa - 0.75f));
    return exponent;
}

nb_cloud_column nb_cloud_column_near(nebel_cloud_workspace *workspace, int layer, const double unit[3], float width)
{
    const nb_cube_place place = cube_of(unit);
    nb_cloud_column column = {0, 0, 0};
    float part;
    const int level = levels_of(&workspace->view->clouds->layers[layer], width, &part);
    if (part < 1) read_grid(workspace, layer, &place, level, 1 - part, &column);
    if (part > 0) read_grid(workspace, layer, &place, level + 1, part, &column);
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
        const double side = grid.spacing * sides[size], per_side = grid.per_spacing * (1 / sides[size]);
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
    const double radius = nb_vector_length(place), per = 1 / radius;
    if (!(radius > of->low && radius < of->high)) return 0;
    double own[3], unit[3];
    for (int i = 0; i < 3; i++) {
        own[i] = nb_vector_dot(workspace->view->poses[layer].turn[i], place);
        unit[i] = own[i] * per;
    }
    const nb_cloud_noise *noise = &workspace->view->clouds->noise;
    const nb_cloud_column column =
        is_alone ? nb_cloud_column_at(noise, of, unit, width) : nb_cloud_column_near(workspace, layer, unit, width);
    const float height = (float)(radius - of->low) * of->per_thickness;
    float missing[NB_CLOUD_BILLOWS + 1];
    nb_cloud_drops drops;
    if (!nb_cloud_in_column(noise, of, &column, own, height, width, missing, &drops)) return 0;
    const float hidden = nb_smaller(nb_smaller(of->hidden_height, of->hidden_width), width - HEAP_PART * of->size);
    return nb_cloud_through(&drops, hidden, 1).whole;
}
