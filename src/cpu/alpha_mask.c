#include "alpha_mask.h"

#include <math.h>

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
typedef struct nb_mask_cell {
    float at[2][2]; /* by y, x */
} nb_mask_cell;

NB_ALWAYS_INLINE nb_mask_cell cell_of(uint32_t corners, float threshold)
{
    return (nb_mask_cell){{{(float)(corners & 255) - threshold, (float)(corners >> 8 & 255) - threshold},
                           {(float)(corners >> 16 & 255) - threshold, (float)(corners >> 24) - threshold}}};
}

static int cell_has_edge(const nb_mask_cell *cell)
{
    const int solid = (cell->at[0][0] >= 0) + (cell->at[0][1] >= 0) + (cell->at[1][0] >= 0) + (cell->at[1][1] >= 0);
    return solid % 4 != 0;
}

/* Ways of lines: towards higher x and y, or lower x, or lower y, or both. */
NB_ALWAYS_INLINE uint32_t shift_of(int falls_x, int falls_y)
{
    return 8 * ((uint32_t)falls_x + 2 * (uint32_t)falls_y);
}

/* The square that begins at a cell is larger by one than the least of those that begin at its three neighbours ahead
 * (the largest square of ones in a matrix of bits, by dynamic programming). A sweep from the far side of the texture; as
 * squares go on at the opposite border it is repeated until nothing changes, which is returned. */
static int sweep(const nb_alpha_mask *mask, int falls_x, int falls_y)
{
    const uint32_t width = mask->width, height = mask->height, shift = shift_of(falls_x, falls_y);
    int changed = 0;
    for (uint32_t i = 0; i < height; i++) {
        const uint32_t y = falls_y ? i : height - 1 - i, other = falls_y ? before(y, height) : after(y, height);
        uint32_t *row = mask->clearances + (size_t)y * width;
        const uint32_t *ahead = mask->clearances + (size_t)other * width;
        for (uint32_t k = 0; k < width; k++) {
            const uint32_t x = falls_x ? k : width - 1 - k, beside = falls_x ? before(x, width) : after(x, width);
            const uint32_t across = ahead[beside] >> shift & 255;
            const uint32_t found =
                1 + nb_lesser(across, nb_lesser(row[beside] >> shift & 255, ahead[x] >> shift & 255));
            const uint32_t known = row[x] >> shift & 255;
            if (found >= known) continue;
            row[x] -= (known - found) << shift;
            changed = 1;
        }
    }
    return changed;
}

static void set_clearances(const nb_alpha_mask *mask)
{
    const size_t count = (size_t)mask->width * mask->height;
    for (size_t i = 0; i < count; i++) {
        const nb_mask_cell cell = cell_of(mask->corners[i], mask->threshold);
        mask->clearances[i] = cell_has_edge(&cell) ? 0 : UINT32_MAX;
    }
    for (int way = 0; way < 4; way++)
        while (sweep(mask, way & 1, way >> 1)) {
        }
}

static void set_mask_corners(const nb_alpha_mask *mask, const nebel_texture *texture)
{
    const uint32_t width = mask->width, height = mask->height;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const size_t here = (size_t)y * width, below = (size_t)after(y, height) * width, right = after(x, width);
            const size_t texels[4] = {here + x, here + right, below + x, below + right};
            uint32_t corners = 0;
            for (int k = 0; k < 4; k++) corners |= (uint32_t)texture->rgba[4 * texels[k] + 3] << 8 * k;
            mask->corners[here + x] = corners;
        }
}

nebel_result nb_alpha_mask_make(nb_alpha_mask *mask, const nebel_allocator *allocator, const nebel_scene_data *scene,
                                int32_t number, float cutoff)
{
    const nebel_texture *texture = &scene->textures[number];
    const size_t count = (size_t)texture->width * texture->height;
    *mask = (nb_alpha_mask){.number = number, .cutoff = cutoff, .width = texture->width, .height = texture->height};
    mask->threshold = 255 * cutoff - 0.125f;
    mask->corners = nb_allocate(allocator, count, sizeof *mask->corners);
    mask->clearances = nb_allocate(allocator, count, sizeof *mask->clearances);
    if (mask->corners == NULL || mask->clearances == NULL) return NEBEL_ERROR_MEMORY;
    set_mask_corners(mask, texture);
    set_clearances(mask);
    return NEBEL_OK;
}

void nb_alpha_mask_free(nb_alpha_mask *mask, const nebel_allocator *allocator)
{
    nb_release(allocator, mask->corners);
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

int nb_alpha_mask_is_hole(const nb_alpha_mask *mask, float u, float v)
{
    const double x = isfinite(u) ? (double)u * mask->width : 0, y = isfinite(v) ? (double)v * mask->height : 0;
    double f, g;
    const uint32_t column = find_cell(x, mask->width, &f), row = find_cell(y, mask->height, &g);
    const size_t number = (size_t)row * mask->width + column;
    const nb_mask_cell cell = cell_of(mask->corners[number], mask->threshold);
    if (mask->clearances[number] > 0) return cell.at[0][0] < 0;
    const double above = (double)cell.at[0][0] + f * (double)(cell.at[0][1] - cell.at[0][0]);
    const double below = (double)cell.at[1][0] + f * (double)(cell.at[1][1] - cell.at[1][0]);
    return above + g * (below - above) < 0;
}

/* ---- lines ----------------------------------------------------------------------------------- */

/* Steps end so far beyond a cell: in another one, whatever rounding does. */
static const double mask_margin = 1e-6;

/* Of lines that are not walked the place is of no meaning, but within the mask. */
NB_ALWAYS_INLINE void begin_axis(nb_alpha_mask_walk *walk, const nb_alpha_mask_lines *lines, int axis, double size,
                                 int *is_walked)
{
    const double reach = NB_MASK_REACH, cells = (double)walk->mask->width * walk->mask->height;
    const int is_small = cells <= NB_MASK_LARGEST;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double from = lines->from[axis][i], way = lines->to[axis][i] - from;
        const int is_short = (fabs(way) <= reach) & (fabs(from) < HUGE_VAL) & is_small;
        const double start = is_short ? from : 1, goes = is_short ? way : 0;
        const double least_place = (goes < 0 ? start + goes : start) - 0.5 - mask_margin;
        walk->start[axis][i] = start - 0.5 - size * floor(least_place / size);
        walk->way[axis][i] = goes;
        walk->inverse[axis][i] = 1 / (fabs(goes) > 1e-200 ? goes : 1e-200);
        is_walked[i] &= is_short;
    }
}

NB_CLONES static void begin_lines(nb_alpha_mask_walk *walk, const nb_alpha_mask_lines *lines)
{
    int is_walked[NB_PACKET];
    for (int i = 0; i < NB_PACKET; i++) is_walked[i] = lines->is_asked[i];
    begin_axis(walk, lines, 0, walk->mask->width, is_walked);
    begin_axis(walk, lines, 1, walk->mask->height, is_walked);
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        walk->shift[i] = shift_of(walk->way[0][i] < 0, walk->way[1][i] < 0);
        walk->at[i] = is_walked[i] ? 0 : 1;
        walk->since[i] = -1;
        if (lines->is_asked[i] && !is_walked[i]) walk->found[walk->count++] = (nb_solid){i, 0, 1};
    }
}

void nb_alpha_mask_begin(nb_alpha_mask_walk *walk, const nb_alpha_mask *mask, const nb_alpha_mask_lines *lines)
{
    walk->mask = mask;
    walk->is_over = 0;
    walk->count = 0;
    begin_lines(walk, lines);
}

/* A step of each line: through its cell, or through all ahead that are like it. Alpha over the threshold on the way is
 * a + b s + c s^2, whose sign changes at two places at most: so there are three pieces, of which some may have no
 * length. */
typedef struct nb_mask_step {
    double a[NB_PACKET], b[NB_PACKET], c[NB_PACKET], length[NB_PACKET];
    double change[2][NB_PACKET]; /* s where the second piece begins and the third; 0 for those that are missing */
    double value[3][NB_PACKET];  /* of each piece, of its sign; a missing one is like the next */
    int is_cut[NB_PACKET];       /* there may be changes */
} nb_mask_step;

/* In which cell a line is along one axis, among those around the mask, and how far within; and in which of the mask that
 * is. Halves keep the quotient from whole numbers. */
#define ENTER(place, cell, within, size, inverse, column)                                                              \
    const int32_t cell = (int32_t)(place);                                                                             \
    const double within = (place)-cell;                                                                                \
    const int32_t column = cell - (size) * (int32_t)((cell + 0.5) * (inverse))

/* Returns whether any line may have changes on its way. */
NB_ALWAYS_INLINE int enter_cells(const nb_alpha_mask_walk *walk, nb_mask_step *step)
{
    const nb_alpha_mask *mask = walk->mask;
    const uint32_t *restrict corners = mask->corners, *restrict clearances = mask->clearances;
    const int32_t width = (int32_t)mask->width, height = (int32_t)mask->height;
    const double inverse_width = 1.0 / width, inverse_height = 1.0 / height;
    const float threshold = mask->threshold;
    int any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double at = walk->at[i], left = 1 - at, way_x = walk->way[0][i], way_y = walk->way[1][i];
        const double x = walk->start[0][i] + at * way_x, y = walk->start[1][i] + at * way_y;
        ENTER(x, cell_x, f, width, inverse_width, column);
        ENTER(y, cell_y, g, height, inverse_height, row);
        const int32_t cell = row * width + column;
        const nb_mask_cell v = cell_of(corners[cell], threshold);
        const int32_t clearance = (int32_t)(clearances[cell] >> walk->shift[i] & 255);
        const double reach = clearance > 0 ? clearance : 1;
        const double across = ((way_x < 0 ? 1 - reach - mask_margin : reach + mask_margin) - f) * walk->inverse[0][i];
        const double down = ((way_y < 0 ? 1 - reach - mask_margin : reach + mask_margin) - g) * walk->inverse[1][i];
        const double shorter = across < down ? across : down, length = shorter < left ? shorter : left;
        const double origin = (double)v.at[0][0], right = (double)(v.at[0][1] - v.at[0][0]);
        const double below = (double)(v.at[1][0] - v.at[0][0]), twist = (double)(v.at[1][1] - v.at[1][0]) - right;
        const double a = origin + right * f + below * g + twist * f * g;
        const double b = right * way_x + below * way_y + twist * (f * way_y + g * way_x), c = twist * way_x * way_y;
        const int begins = a >= 0, ends = a + length * (b + length * c) >= 0, falls = b < 0;
        const int rises = b + 2 * length * c > 0; /* at the end */
        const int is_even = (begins == ends) & (begins ? !(falls & rises) : falls | rises);
        const int is_clear = clearance > 0, is_cut = !is_clear & !is_even;
        const double value = is_clear ? origin : a, seen = at < 1 ? value : -1; /* what is walked is as a hole */
        step->a[i] = a;
        step->b[i] = b;
        step->c[i] = c;
        step->length[i] = length;
        step->change[0][i] = step->change[1][i] = 0;
        step->value[0][i] = step->value[1][i] = step->value[2][i] = seen;
        step->is_cut[i] = is_cut;
        any |= is_cut;
    }
    return any;
}

/* Parts steps at the roots. */
NB_ALWAYS_INLINE void cut_cells(nb_mask_step *step)
{
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double a = step->a[i], b = step->b[i], c = step->c[i], length = step->length[i];
        const double discriminant = b * b - 4 * a * c, root = sqrt(discriminant > 0 ? discriminant : 0);
        const double sum = b < 0 ? root - b : -root - b;
        const double one = sum / (2 * (c != 0 ? c : 1e-300)), other = 2 * a / (sum != 0 ? sum : 1e-300);
        const double low = one < other ? one : other, high = one < other ? other : one;
        const int is_cut = step->is_cut[i], has_roots = is_cut & (discriminant > 0);
        const double first = (has_roots & (low > 0) & (low < length)) ? low : 0;
        const double second = (has_roots & (high > first) & (high < length)) ? high : first;
        const double before = 0.5 * first, between = 0.5 * (first + second), behind = 0.5 * (second + length);
        const double last = a + behind * (b + behind * c);
        const double middle = second > first ? a + between * (b + between * c) : last;
        step->change[0][i] = first;
        step->change[1][i] = second;
        step->value[0][i] = is_cut ? first > 0 ? a + before * (b + before * c) : middle : step->value[0][i];
        step->value[1][i] = is_cut ? middle : step->value[1][i];
        step->value[2][i] = is_cut ? last : step->value[2][i];
    }
}

/* Where stretches end: with one of the three pieces, or with the line. */
typedef struct nb_mask_ends {
    double since[4][NB_PACKET], at[4][NB_PACKET]; /* at -1: there is no such end */
} nb_mask_ends;

/* Goes on to a piece. Macro, as loops in loops become no vectors. */
#define TAKE_PIECE(k, begin, value)                                                                                    \
    do {                                                                                                               \
        const double start = (begin), opened = since >= 0 ? since : start, closed = since >= 0 ? start : -1;           \
        ends->since[k][i] = since;                                                                                     \
        ends->at[k][i] = (value) >= 0 ? -1 : closed;                                                                   \
        since = (value) >= 0 ? opened : -1;                                                                            \
    } while (0)

/* Returns whether there is any end. */
NB_ALWAYS_INLINE int take_step(nb_alpha_mask_walk *walk, const nb_mask_step *step, nb_mask_ends *ends)
{
    int any = 0, goes_on = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double at = walk->at[i];
        double since = walk->since[i];
        TAKE_PIECE(0, at, step->value[0][i]);
        TAKE_PIECE(1, at + step->change[0][i], step->value[1][i]);
        TAKE_PIECE(2, at + step->change[1][i], step->value[2][i]);
        walk->since[i] = since;
    }
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double at = walk->at[i], length = step->length[i], since = walk->since[i], end = at + length;
        const int stays = length < 1 - at;
        ends->since[3][i] = since;
        ends->at[3][i] = (stays | (since < 0)) ? -1 : 1;
        walk->since[i] = stays ? since : -1;
        walk->at[i] = stays ? end : 1;
        goes_on |= stays;
    }
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++)
        any |= (ends->at[0][i] >= 0) | (ends->at[1][i] >= 0) | (ends->at[2][i] >= 0) | (ends->at[3][i] >= 0);
    walk->is_over = !goes_on;
    return any;
}

/* Without a branch, as it would be guessed wrong every other time. */
NB_ALWAYS_INLINE void list_stretches(nb_alpha_mask_walk *walk, const nb_mask_ends *ends)
{
    for (uint32_t i = 0; i < NB_PACKET; i++)
        for (int k = 0; k < 4; k++) {
            walk->found[walk->count] = (nb_solid){i, ends->since[k][i], ends->at[k][i]};
            walk->count += ends->at[k][i] >= 0;
        }
}

NB_CLONES static void walk_lines(nb_alpha_mask_walk *walk)
{
    nb_mask_step step;
    nb_mask_ends ends;
    while (!walk->is_over && walk->count == 0) {
        if (enter_cells(walk, &step)) cut_cells(&step);
        if (take_step(walk, &step, &ends)) list_stretches(walk, &ends);
    }
}

int nb_alpha_mask_next(nb_alpha_mask_walk *walk)
{
    walk->count = 0;
    walk_lines(walk);
    return walk->count > 0;
}
