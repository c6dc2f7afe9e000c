#include "mask.h"

#include <math.h>
#include <string.h>

/* ---- cells ----------------------------------------------------------------------------------- */

static float alpha_at(const nebel_texture *texture, uint32_t x, uint32_t y)
{
    return texture->rgba[4 * ((size_t)y * texture->width + x) + 3];
}

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

static nb_cell cell_at(const nb_mask *mask, uint32_t x, uint32_t y)
{
    const nebel_texture *t = mask->texture;
    const uint32_t right = after(x, t->width), below = after(y, t->height);
    return (nb_cell){{{alpha_at(t, x, y) - mask->threshold, alpha_at(t, right, y) - mask->threshold},
                      {alpha_at(t, x, below) - mask->threshold, alpha_at(t, right, below) - mask->threshold}}};
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
    const uint32_t width = mask->texture->width, height = mask->texture->height;
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
    const uint32_t width = mask->texture->width, height = mask->texture->height;
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

nebel_result nb_mask_make(nb_mask *mask, const nebel_allocator *allocator, const nebel_scene_data *scene,
                          int32_t number, float cutoff)
{
    const nebel_texture *texture = &scene->textures[number];
    *mask = (nb_mask){.texture = texture, .number = number, .cutoff = cutoff};
    mask->threshold = 255 * cutoff - 0.125f;
    mask->clearances = nb_allocate(allocator, (size_t)texture->width * texture->height, 1);
    if (mask->clearances == NULL) return NEBEL_ERROR_MEMORY;
    set_clearances(mask);
    return NEBEL_OK;
}

void nb_mask_free(nb_mask *mask, const nebel_allocator *allocator)
{
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
    const nebel_texture *texture = mask->texture;
    const double x = isfinite(u) ? (double)u * texture->width : 0, y = isfinite(v) ? (double)v * texture->height : 0;
    double f, g;
    const uint32_t column = find_cell(x, texture->width, &f), row = find_cell(y, texture->height, &g);
    const nb_cell cell = cell_at(mask, column, row);
    if (mask->clearances[(size_t)row * texture->width + column] > 0) return cell.at[0][0] < 0;
    const double above = (double)cell.at[0][0] + f * (double)(cell.at[0][1] - cell.at[0][0]);
    const double below = (double)cell.at[1][0] + f * (double)(cell.at[1][1] - cell.at[1][0]);
    return above + g * (below - above) < 0;
}

/* ---- lines ----------------------------------------------------------------------------------- */

nb_mask_walk nb_mask_begin(const nb_mask *mask, const double from[2], const double to[2])
{
    const nebel_texture *t = mask->texture;
    /* Near the origin, where doubles are finest. */
    const double left = t->width * floor(from[0] / t->width), top = t->height * floor(from[1] / t->height);
    return (nb_mask_walk){
        .mask = mask, .x = from[0] - left, .y = from[1] - top, .dx = to[0] - from[0], .dy = to[1] - from[1]};
}

/* How long a line stays below `high` and above `low` along one axis. */
static double stay(double place, double way, double low, double high)
{
    return way > 0 ? (high - place) / way : way < 0 ? (low - place) / way : HUGE_VAL;
}

static void add_piece(nb_mask_walk *walk, double end, int solid)
{
    walk->ends[walk->count] = end;
    walk->solid[walk->count++] = solid;
}

/* a + b s + c s^2 is alpha over the threshold, for s from 0 to `length`; its roots part pieces. */
static void cut_cell(nb_mask_walk *walk, double a, double b, double c, double length)
{
    const double discriminant = b * b - 4 * a * c;
    double start = 0;
    if (discriminant > 0) {
        const double sum = b < 0 ? sqrt(discriminant) - b : -sqrt(discriminant) - b;
        const double one = sum / (2 * (c != 0 ? c : 1e-300)), other = sum != 0 ? 2 * a / sum : HUGE_VAL;
        const double roots[2] = {fmin(one, other), fmax(one, other)};
        for (int i = 0; i < 2; i++) {
            if (!(roots[i] > start && roots[i] < length)) continue;
            const double middle = 0.5 * (start + roots[i]);
            add_piece(walk, walk->at + roots[i], a + middle * (b + middle * c) >= 0);
            start = roots[i];
        }
    }
    const double middle = 0.5 * (start + length);
    add_piece(walk, walk->at + length, a + middle * (b + middle * c) >= 0);
}

/* The pieces of the cell at walk->at, or of all cells around that are like it, and a little of the next one: a millionth
 * of a texel, so that each step ends in another cell. */
static void enter_cell(nb_mask_walk *walk)
{
    const nebel_texture *t = walk->mask->texture;
    const double x = walk->x + walk->at * walk->dx, y = walk->y + walk->at * walk->dy;
    double f, g;
    const uint32_t column = find_cell(x, t->width, &f), row = find_cell(y, t->height, &g);
    const nb_cell cell = cell_at(walk->mask, column, row);
    const uint8_t clearance = walk->mask->clearances[(size_t)row * t->width + column];
    const double margin = 1e-6, reach = clearance > 0 ? clearance : 1;
    const double across = stay(f, walk->dx, 1 - reach - margin, reach + margin);
    const double down = stay(g, walk->dy, 1 - reach - margin, reach + margin);
    const double length = fmin(fmin(across, down), 1 - walk->at);
    walk->count = walk->next = 0;
    if (clearance > 0) {
        add_piece(walk, walk->at + length, cell.at[0][0] >= 0);
    } else {
        const double origin = (double)cell.at[0][0], right = (double)(cell.at[0][1] - cell.at[0][0]);
        const double below = (double)(cell.at[1][0] - cell.at[0][0]);
        const double twist = (double)(cell.at[1][1] - cell.at[1][0]) - right;
        cut_cell(walk, origin + right * f + below * g + twist * f * g,
                 right * walk->dx + below * walk->dy + twist * (f * walk->dy + g * walk->dx),
                 twist * walk->dx * walk->dy, length);
    }
    walk->at = walk->ends[walk->count - 1];
}

static int is_too_long(const nb_mask_walk *walk)
{
    const double reach = NB_MASK_REACH;
    return !(fabs(walk->dx) <= reach && fabs(walk->dy) <= reach && isfinite(walk->x) && isfinite(walk->y));
}

int nb_mask_next(nb_mask_walk *walk, double *enter, double *leave)
{
    int found = 0;
    double start = walk->next > 0 ? walk->ends[walk->next - 1] : walk->at;
    if (walk->at == 0 && is_too_long(walk)) add_piece(walk, walk->at = 1, 1);
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
