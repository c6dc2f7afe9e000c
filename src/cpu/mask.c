#include "mask.h"

#include <math.h>
#include <string.h>

/* ---- cells ----------------------------------------------------------------------------------- */

static uint32_t after(uint32_t x, uint32_t size)
{
    return x + 1 < size ? x + 1 : 0;
}

static uint32_t before(uint32_t x, uint32_t size)
{
    return x > 0 ? x - 1 : size - 1;
}

/* Alpha at the corners of a cell, less the threshold. */
typedef struct nb_cell {
    float at[2][2]; /* by y, x */
} nb_cell;

static inline nb_cell cell_at(const nb_mask *mask, uint32_t x, uint32_t y)
{
    const uint8_t *above = mask->alphas + (size_t)y * (mask->width + 1) + x, *below = above + mask->width + 1;
    const float threshold = mask->threshold;
    return (nb_cell){{{above[0] - threshold, above[1] - threshold}, {below[0] - threshold, below[1] - threshold}}};
}

static int has_edge(const nb_cell *cell)
{
    const int solid = (cell->at[0][0] >= 0) + (cell->at[0][1] >= 0) + (cell->at[1][0] >= 0) + (cell->at[1][1] >= 0);
    return solid % 4 != 0;
}

static uint8_t least(uint8_t a, uint8_t b)
{
    return a < b ? a : b;
}

static uint8_t next_to(uint8_t clearance)
{
    return clearance < 255 ? (uint8_t)(clearance + 1) : 255;
}

/* One sweep of those that find steps of a king in chess to the next cell with an edge (Rosenfeld and Pfaltz 1966), from
 * the first row or, back, from the last. Returns whether it changed anything. */
static int sweep(const nb_mask *mask, int back)
{
    const uint32_t width = mask->width, height = mask->height;
    int changed = 0;
    for (uint32_t i = 0; i < height; i++) {
        const uint32_t y = back ? height - 1 - i : i, other = back ? after(y, height) : before(y, height);
        uint8_t *row = mask->clearances + (size_t)y * width;
        const uint8_t *met = mask->clearances + (size_t)other * width;
        for (uint32_t k = 0; k < width; k++) {
            const uint32_t x = back ? width - 1 - k : k, left = before(x, width), right = after(x, width);
            const uint8_t beside = least(row[back ? right : left], met[x]);
            const uint8_t found = next_to(least(beside, least(met[left], met[right])));
            changed |= found < row[x];
            row[x] = least(row[x], found);
        }
    }
    return changed;
}

/* What a sweep leaves at one border of the texture another takes up at the opposite one. */
static void set_clearances(const nb_mask *mask)
{
    const uint32_t width = mask->width, height = mask->height;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const nb_cell cell = cell_at(mask, x, y);
            mask->clearances[(size_t)y * width + x] = has_edge(&cell) ? 0 : 255;
        }
    int changed = 1;
    while (changed) {
        changed = sweep(mask, 0);
        changed |= sweep(mask, 1);
    }
}

static void copy_alphas(const nb_mask *mask, const nebel_texture *texture)
{
    for (uint32_t y = 0; y <= mask->height; y++)
        for (uint32_t x = 0; x <= mask->width; x++) {
            const size_t texel = (size_t)(y % mask->height) * mask->width + x % mask->width;
            mask->alphas[(size_t)y * (mask->width + 1) + x] = texture->rgba[4 * texel + 3];
        }
}

nebel_result nb_mask_make(nb_mask *mask, const nebel_allocator *allocator, const nebel_scene_data *scene,
                          int32_t number, float cutoff)
{
    const nebel_texture *texture = &scene->textures[number];
    *mask = (nb_mask){.number = number, .cutoff = cutoff, .width = texture->width, .height = texture->height};
    mask->threshold = 255 * cutoff - 0.125f;
    mask->alphas = nb_allocate(allocator, (size_t)texture->width + 1, (size_t)texture->height + 1);
    mask->clearances = nb_allocate(allocator, texture->width, texture->height);
    if (mask->alphas == NULL || mask->clearances == NULL) return NEBEL_ERROR_MEMORY;
    copy_alphas(mask, texture);
    set_clearances(mask);
    return NEBEL_OK;
}

void nb_mask_free(nb_mask *mask, const nebel_allocator *allocator)
{
    nb_release(allocator, mask->alphas);
    nb_release(allocator, mask->clearances);
}

/* ---- places ---------------------------------------------------------------------------------- */

/* In which cell a place in texels is, along one axis, and how far within. */
static uint32_t find_cell(double place, uint32_t size, double *within)
{
    const double shifted = place - 0.5, whole = floor(shifted);
    const double round = whole - size * floor(whole / size);
    *within = shifted - whole;
    return round >= 0 && round < size ? (uint32_t)round : 0;
}

int nb_mask_is_hole(const nb_mask *mask, float u, float v)
{
    const double x = isfinite(u) ? (double)u * mask->width : 0, y = isfinite(v) ? (double)v * mask->height : 0;
    double f, g;
    const uint32_t column = find_cell(x, mask->width, &f), row = find_cell(y, mask->height, &g);
    const nb_cell cell = cell_at(mask, column, row);
    if (mask->clearances[(size_t)row * mask->width + column] > 0) return cell.at[0][0] < 0;
    const double above = (double)cell.at[0][0] + f * (double)(cell.at[0][1] - cell.at[0][0]);
    const double below = (double)cell.at[1][0] + f * (double)(cell.at[1][1] - cell.at[1][0]);
    return above + g * (below - above) < 0;
}

/* ---- lines ----------------------------------------------------------------------------------- */

/* Steps end so far beyond a cell: in another one, whatever rounding does. */
static const double margin = 1e-6;

static nb_mask_axis axis_of(double from, double to, uint32_t size)
{
    const double way = to - from, least = (way < 0 ? to : from) - 0.5 - margin;
    const double start = from - 0.5 - size * floor(least / size);
    return (nb_mask_axis){.start = start,
                          .way = way,
                          .inverse = 1 / (fabs(way) > 1e-200 ? way : 1e-200),
                          .size = size,
                          .lap = (uint32_t)start / size * size};
}

static int is_short(double from, double to)
{
    const double reach = NB_MASK_REACH;
    return fabs(to - from) <= reach && isfinite(from);
}

nb_mask_walk nb_mask_begin(const nb_mask *mask, const double from[2], const double to[2])
{
    if (!is_short(from[0], to[0]) || !is_short(from[1], to[1]))
        return (nb_mask_walk){.mask = mask, .at = 1, .ends = {1}, .solid = {1}, .count = 1};
    return (nb_mask_walk){
        .mask = mask, .x = axis_of(from[0], to[0], mask->width), .y = axis_of(from[1], to[1], mask->height)};
}

/* In which cell of the mask a line is, and how far within. */
static inline uint32_t enter_axis(nb_mask_axis *axis, double at, double *within)
{
    const double place = axis->start + at * axis->way;
    const uint32_t cell = (uint32_t)place;
    *within = place - cell;
    while (cell < axis->lap) axis->lap -= axis->size;
    while (cell - axis->lap >= axis->size) axis->lap += axis->size;
    return cell - axis->lap;
}

/* How long a line stays within so many cells. */
static inline double stay(const nb_mask_axis *axis, double within, double reach)
{
    const double end = axis->way < 0 ? 1 - reach - margin : reach + margin;
    return (end - within) * axis->inverse;
}

static inline void add_piece(nb_mask_walk *walk, double end, int solid)
{
    walk->ends[walk->count] = end;
    walk->solid[walk->count++] = solid;
}

/* Alpha over the threshold along a line in a cell is a + b s + c s^2. */
typedef struct nb_quadratic {
    double a, b, c;
} nb_quadratic;

static inline double value_at(const nb_quadratic *q, double s)
{
    return q->a + s * (q->b + s * q->c);
}

/* Of one sign from 0 to `length`: at both ends, without a turn between them that may lead beyond 0. */
static inline int is_of_one_sign(const nb_quadratic *q, double length)
{
    const int solid = q->a >= 0, falls = q->b<0, rises = q->b + 2 * length * q->c> 0;
    return (value_at(q, length) >= 0) == solid && (solid ? !(falls && rises) : falls || rises);
}

/* Parts the cell at the roots. */
static void cut_cell(nb_mask_walk *walk, const nb_quadratic *q, double length)
{
    const double discriminant = q->b * q->b - 4 * q->a * q->c;
    double start = 0;
    if (discriminant > 0) {
        const double root = sqrt(discriminant), sum = q->b < 0 ? root - q->b : -root - q->b;
        const double one = sum / (2 * (q->c != 0 ? q->c : 1e-300)), other = sum != 0 ? 2 * q->a / sum : HUGE_VAL;
        const double roots[2] = {one < other ? one : other, one < other ? other : one};
        for (int i = 0; i < 2; i++) {
            if (!(roots[i] > start && roots[i] < length)) continue;
            add_piece(walk, walk->at + roots[i], value_at(q, 0.5 * (start + roots[i])) >= 0);
            start = roots[i];
        }
    }
    add_piece(walk, walk->at + length, value_at(q, 0.5 * (start + length)) >= 0);
}

/* The pieces of the cell at walk->at, or of all cells around that are like it. */
static void enter_cell(nb_mask_walk *walk)
{
    const nb_mask *mask = walk->mask;
    const double left = 1 - walk->at;
    double f, g;
    const uint32_t column = enter_axis(&walk->x, walk->at, &f), row = enter_axis(&walk->y, walk->at, &g);
    const nb_cell cell = cell_at(mask, column, row);
    const uint8_t clearance = mask->clearances[(size_t)row * mask->width + column];
    const double reach = clearance > 0 ? clearance : 1;
    const double across = stay(&walk->x, f, reach), down = stay(&walk->y, g, reach);
    const double shorter = across < down ? across : down, length = shorter < left ? shorter : left;
    const double origin = (double)cell.at[0][0], right = (double)(cell.at[0][1] - cell.at[0][0]);
    const double below = (double)(cell.at[1][0] - cell.at[0][0]);
    const double twist = (double)(cell.at[1][1] - cell.at[1][0]) - right;
    const nb_quadratic q = {origin + right * f + below * g + twist * f * g,
                            right * walk->x.way + below * walk->y.way + twist * (f * walk->y.way + g * walk->x.way),
                            twist * walk->x.way * walk->y.way};
    walk->count = walk->next = 0;
    if (clearance > 0)
        add_piece(walk, walk->at + length, origin >= 0);
    else if (is_of_one_sign(&q, length))
        add_piece(walk, walk->at + length, q.a >= 0);
    else
        cut_cell(walk, &q, length);
    walk->at = length < left ? walk->ends[walk->count - 1] : 1;
}

int nb_mask_next(nb_mask_walk *walk, double *enter, double *leave)
{
    int found = 0;
    double start = walk->next > 0 ? walk->ends[walk->next - 1] : walk->count > 0 ? 0 : walk->at;
    while (walk->next < walk->count || walk->at < 1) {
        if (walk->next == walk->count) enter_cell(walk);
        const int solid = walk->solid[walk->next];
        if (!solid && found) return 1;
        const double end = walk->ends[walk->next++];
        if (solid && !found) *enter = start;
        if (solid) *leave = end;
        found |= solid;
        start = end;
    }
    return found;
}
