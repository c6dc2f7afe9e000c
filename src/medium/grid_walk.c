/* What rays and places meet in voxels. */
#include "grid_voxels.h"

#include <math.h>

/* ---- in a cell ------------------------------------------------------------------------------- */

/* The voxels that a cell interpolates between along an axis; two that are the same at the rim, and where nearest. */
typedef struct nb_cell_pair {
    int low, high;
} nb_cell_pair;

INLINE nb_cell_pair pair_of(const nebel_grid *grid, int axis, int cell)
{
    if (grid->filter == NEBEL_GRID_FILTER_NEAREST) return (nb_cell_pair){cell, cell};
    return (nb_cell_pair){cell > 0 ? cell - 1 : 0, cell < grid->size[axis] ? cell : cell - 1};
}

/* The eight voxels of a cell, x fastest. */
typedef struct corners {
    double v[8];
} corners;

/* Where the voxels of a cell are: for each axis the steps to the nearer and to the farther ones. */
typedef struct corner_steps {
    size_t low[3], high[3];
} corner_steps;

INLINE void find_steps(corner_steps *steps, const nebel_grid *grid, int axis, int cell)
{
    const nb_cell_pair p = pair_of(grid, axis, cell);
    steps->low[axis] = (size_t)p.low * grid->stride[axis];
    steps->high[axis] = (size_t)p.high * grid->stride[axis];
}

INLINE corner_steps steps_to(const nebel_grid *grid, const int cell[3])
{
    corner_steps steps;
    for (int i = 0; i < 3; i++) find_steps(&steps, grid, i, cell[i]);
    return steps;
}

INLINE corners corners_at(const nebel_grid *grid, nebel_voxel_type type, const corner_steps *steps)
{
    const size_t low = steps->low[0], high = steps->high[0];
    const size_t a = steps->low[1] + steps->low[2], b = steps->high[1] + steps->low[2];
    const size_t c = steps->low[1] + steps->high[2], d = steps->high[1] + steps->high[2];
    const void *v = grid->voxels;
    return (corners){{voxel_of(type, v, a + low), voxel_of(type, v, a + high), voxel_of(type, v, b + low),
                      voxel_of(type, v, b + high), voxel_of(type, v, c + low), voxel_of(type, v, c + high),
                      voxel_of(type, v, d + low), voxel_of(type, v, d + high)}};
}

INLINE corners corners_of(const nebel_grid *grid, nebel_voxel_type type, const int cell[3])
{
    const corner_steps steps = steps_to(grid, cell);
    return corners_at(grid, type, &steps);
}

INLINE double between(double a, double b, double share)
{
    return a + share * (b - a);
}

/* `at`: shares within 0 and 1. */
INLINE double interpolate(const corners *c, const double at[3])
{
    const double near = between(between(c->v[0], c->v[1], at[0]), between(c->v[2], c->v[3], at[0]), at[1]);
    const double far = between(between(c->v[4], c->v[5], at[0]), between(c->v[6], c->v[7], at[0]), at[1]);
    return between(near, far, at[2]);
}

/* Clamped, so that no rounding leaves what the corners are. */
INLINE double share_of(double place, int cell)
{
    return smaller(larger(place - cell, 0), 1);
}

/* ---- along a ray ----------------------------------------------------------------------------- */

#define ROUNDING 1.1102230246251565e-16

/* Slopes below this cross no face along any ray. */
#define LEAST_SLOPE 1e-250

/* A walk from one block of cells to the next, for bricks and for the cells in one: where the ray crosses the next face
 * of each axis. Faces are counted in cells; crossings are computed from their numbers, so that errors do not add up. */
typedef struct nb_grid_traversal {
    int block[3], first[3], last[3]; /* within first and last */
    int width;                       /* cells of a block along an axis */
    int way[3];                      /* -1, 0, 1: to the next block */
    double inverse[3];               /* of the slope */
    double next[3];                  /* t at which the ray leaves the block, HUGE_VAL where it does not */
} nb_grid_traversal;

INLINE double crossing(const nb_grid_line *line, const nb_grid_traversal *w, int axis)
{
    const int forward = w->way[axis] > 0;
    if (w->way[axis] == 0 || w->block[axis] == (forward ? w->last[axis] : w->first[axis])) return HUGE_VAL;
    return ((double)((w->block[axis] + forward) * w->width) - line->from[axis]) * w->inverse[axis];
}

/* At a face the ray is in the block that it enters. */
INLINE int block_at(const nb_grid_line *line, const nb_grid_traversal *w, int axis, double t)
{
    const double place = (line->from[axis] + line->slope[axis] * t) / w->width;
    const int block = (int)smaller(larger(place, 0), 1 << 24);
    const int at = block - (w->way[axis] < 0 && block >= place);
    return at < w->first[axis] ? w->first[axis] : at > w->last[axis] ? w->last[axis] : at;
}

INLINE void start_walk(nb_grid_traversal *w, const nb_grid_line *line, double t)
{
    for (int i = 0; i < 3; i++) {
        w->block[i] = block_at(line, w, i, t);
        w->next[i] = crossing(line, w, i);
    }
}

static inline int nearest_axis(const nb_grid_traversal *w)
{
    const int a = w->next[0] <= w->next[1] ? 0 : 1;
    return w->next[a] <= w->next[2] ? a : 2;
}

INLINE void step_walk(nb_grid_traversal *w, const nb_grid_line *line, int axis)
{
    w->block[axis] += w->way[axis];
    w->next[axis] = crossing(line, w, axis);
}

/* Half the distance between the points of Gauss's rule on [0, 1]: exact for the cubic that the density is in a cell. */
#define GAUSS_HALF 0.28867513459481288

/* Where a ray is in a cell. */
typedef struct nb_grid_position {
    double share[3];
} nb_grid_position;

INLINE nb_grid_position spot_at(const nb_grid_line *line, const int cell[3], double t)
{
    return (nb_grid_position){{share_of(line->from[0] + line->slope[0] * t, cell[0]),
                               share_of(line->from[1] + line->slope[1] * t, cell[1]),
                               share_of(line->from[2] + line->slope[2] * t, cell[2])}};
}

/* The mean along the line from one spot to another. */
INLINE double mean_between(const corners *c, const nb_grid_position *a, const nb_grid_position *b)
{
    const double near = 0.5 - GAUSS_HALF, far = 0.5 + GAUSS_HALF;
    const double x = b->share[0] - a->share[0], y = b->share[1] - a->share[1], z = b->share[2] - a->share[2];
    const double first[3] = {a->share[0] + near * x, a->share[1] + near * y, a->share[2] + near * z};
    const double second[3] = {a->share[0] + far * x, a->share[1] + far * y, a->share[2] + far * z};
    return 0.5 * (interpolate(c, first) + interpolate(c, second));
}

INLINE double voxel_within(const corners *c, const nb_grid_line *line, const int cell[3], double t)
{
    const nb_grid_position at = spot_at(line, cell, t);
    return interpolate(c, at.share);
}

INLINE double between_corners(const corners *c, const nb_grid_line *line, const int cell[3], double start, double end)
{
    const nb_grid_position from = spot_at(line, cell, start), to = spot_at(line, cell, end);
    return (end - start) * mean_between(c, &from, &to);
}

INLINE double nearest_voxel(const nebel_grid *grid, nebel_voxel_type type, const int cell[3])
{
    return voxel_of(type, grid->voxels, row_of(grid, cell[1], cell[2]) + (size_t)cell[0]);
}

/* The voxels of a brick along the ray, and how many cells were seen. */
typedef struct brick_sum {
    double value;
    int cells;
} brick_sum;

/* The cells of the brick where `bricks` is. */
INLINE nb_grid_traversal walk_cells(const nebel_grid *grid, const nb_grid_line *line, const nb_grid_traversal *bricks,
                                    double start)
{
    nb_grid_traversal w;
    w.width = 1;
    for (int i = 0; i < 3; i++) {
        w.way[i] = bricks->way[i];
        w.inverse[i] = bricks->inverse[i];
        w.first[i] = bricks->block[i] * BRICK;
        w.last[i] = (bricks->block[i] + 1) * BRICK - 1;
        if (w.last[i] >= grid->cells[i]) w.last[i] = grid->cells[i] - 1;
    }
    start_walk(&w, line, start);
    return w;
}

INLINE brick_sum walk_nearest(const nebel_grid *grid, nebel_voxel_type type, const nb_grid_line *line,
                              const nb_grid_traversal *bricks, double start, double end)
{
    brick_sum sum = {0, 0};
    nb_grid_traversal w = walk_cells(grid, line, bricks, start);
    for (double t = start;;) {
        const int axis = nearest_axis(&w);
        const double until = larger(smaller(w.next[axis], end), t);
        sum.value += (until - t) * nearest_voxel(grid, type, w.block);
        sum.cells++;
        if (w.next[axis] >= end) return sum;
        t = until;
        step_walk(&w, line, axis);
    }
}

/* A cell begins where the one before it ends. */
INLINE brick_sum walk_linear(const nebel_grid *grid, nebel_voxel_type type, const nb_grid_line *line,
                             const nb_grid_traversal *bricks, double start, double end)
{
    brick_sum sum = {0, 0};
    nb_grid_traversal w = walk_cells(grid, line, bricks, start);
    nb_grid_position from = spot_at(line, w.block, start);
    corner_steps steps = steps_to(grid, w.block);
    for (double t = start;;) {
        const int axis = nearest_axis(&w);
        const double until = larger(smaller(w.next[axis], end), t);
        const corners c = corners_at(grid, type, &steps);
        const nb_grid_position to = spot_at(line, w.block, until);
        sum.value += (until - t) * mean_between(&c, &from, &to);
        sum.cells++;
        if (w.next[axis] >= end) return sum;
        t = until;
        from = to;
        from.share[axis] = w.way[axis] > 0 ? 0 : 1;
        step_walk(&w, line, axis);
        find_steps(&steps, grid, axis, w.block[axis]);
    }
}

INLINE brick_sum walk_brick(const nebel_grid *grid, nebel_voxel_type type, const nb_grid_line *line,
                            const nb_grid_traversal *bricks, double start, double end)
{
    return grid->filter == NEBEL_GRID_FILTER_NEAREST ? walk_nearest(grid, type, line, bricks, start, end)
                                                     : walk_linear(grid, type, line, bricks, start, end);
}

/* One copy for each type, so that the innermost loop asks for none. */
static brick_sum sum_brick(const nebel_grid *grid, const nb_grid_line *line, const nb_grid_traversal *bricks,
                           double start, double end)
{
    switch (grid->type) {
    case NEBEL_VOXEL_UINT8:
        return walk_brick(grid, NEBEL_VOXEL_UINT8, line, bricks, start, end);
    case NEBEL_VOXEL_UINT16:
        return walk_brick(grid, NEBEL_VOXEL_UINT16, line, bricks, start, end);
    default:
        return walk_brick(grid, NEBEL_VOXEL_FLOAT, line, bricks, start, end);
    }
}

static const brick *brick_at(const nebel_grid *grid, const int block[3])
{
    const size_t bricks[2] = {(size_t)grid->bricks[0], (size_t)grid->bricks[1]};
    return &grid->brick[((size_t)block[2] * bricks[1] + (size_t)block[1]) * bricks[0] + (size_t)block[0]];
}

static nb_grid_traversal walk_bricks(const nebel_grid *grid, const nb_grid_line *line)
{
    nb_grid_traversal w;
    w.width = BRICK;
    for (int i = 0; i < 3; i++) {
        const double slope = line->slope[i];
        w.way[i] = (slope > LEAST_SLOPE) - (slope < -LEAST_SLOPE);
        w.inverse[i] = w.way[i] != 0 ? 1 / slope : 0;
        w.first[i] = 0;
        w.last[i] = grid->bricks[i] - 1;
    }
    start_walk(&w, line, 0);
    return w;
}

/* What the noise of the coordinates does to nearest voxels: each face is crossed up to noise / |slope| sooner or later.
 * A ray that is within the noise of a face all along may be on either side of it. */
static double error_of_faces(const nb_grid_line *line, int axis, double length, double noise)
{
    const double first = line->from[axis], last = first + line->slope[axis] * length;
    const double low = smaller(first, last) - noise, high = larger(first, last) + noise;
    const double faces = larger(floor(high) - ceil(low) + 1, 0);
    if (faces == 0) return 0;
    const double steepness = fabs(line->slope[axis]);
    return noise < steepness * length ? smaller(faces * noise / steepness, length) : length;
}

static double noise_along(const nb_grid_line *line, int axis, double length, double noise)
{
    return noise + (fabs(line->from[axis]) + fabs(line->slope[axis]) * length + 1) * (4 * ROUNDING);
}

/* Linear voxels are as steep as their range per cell, along each axis. */
static double error_of_noise(const nebel_grid *grid, const nb_grid_line *line, double length, double noise)
{
    double error = 0;
    for (int i = 0; i < 3; i++) {
        const double own = noise_along(line, i, length, noise);
        error += grid->filter == NEBEL_GRID_FILTER_LINEAR ? own * length : error_of_faces(line, i, length, own);
    }
    return error * (grid->most - grid->least);
}

static double amount_of(const nebel_grid *grid, double voxels, double length)
{
    return larger(grid->offset * length + grid->scale * voxels, 0);
}

nb_grid_sum nb_grid_integral(const nebel_grid *grid, const nb_grid_line *line, double length, double noise,
                             double enough)
{
    if (!(length > 0)) return (nb_grid_sum){0, 0};
    nb_grid_traversal w = walk_bricks(grid, line);
    double voxels = 0;
    double terms = 0;
    for (double t = 0;;) {
        const int axis = nearest_axis(&w);
        const double until = larger(smaller(w.next[axis], length), t);
        const brick *b = brick_at(grid, w.block);
        if (b->least < b->most) {
            const brick_sum sum = sum_brick(grid, line, &w, t, until);
            voxels += sum.value;
            terms += sum.cells;
        } else {
            voxels += (until - t) * b->most;
        }
        terms++;
        if (w.next[axis] >= length) break;
        const double least = amount_of(grid, voxels, until);
        if (least >= enough) return (nb_grid_sum){least, NB_GRID_ENDLESS};
        t = until;
        step_walk(&w, line, axis);
    }
    const double offset = grid->offset * length, scaled = grid->scale * voxels;
    const double value = larger(offset + scaled, 0);
    const double rounding = (fabs(offset) + fabs(scaled)) * ((terms + 32) * ROUNDING);
    return (nb_grid_sum){value, rounding + error_of_noise(grid, line, length, noise)};
}

/* ---- where parts of the integral are reached ------------------------------------------------- */

/* A stretch of the ray in one cell, or in a brick of one density. */
typedef struct nb_brick_interval {
    double start, end;
    double amount; /* the integral of the density over it */
    double level;  /* the density where it is the same all along, else a NaN */
    int cell[3];   /* otherwise */
} nb_brick_interval;

/* Stretch after stretch along a ray. */
typedef struct cursor {
    const nebel_grid *grid;
    const nb_grid_line *line;
    double length, t, brick_end;
    nb_grid_traversal bricks, cells;
    int within; /* a brick, of which cells are walked */
} cursor;

/* To the block behind w's, or to the end; returns whether that is reached. */
static int pass_block(nb_grid_traversal *w, const nb_grid_line *line, double end)
{
    const int axis = nearest_axis(w);
    if (w->next[axis] >= end) return 1;
    step_walk(w, line, axis);
    return 0;
}

static nb_brick_interval even_stretch(const cursor *c, double end, double voxel)
{
    const double level = larger(density_of(c->grid, voxel), 0);
    return (nb_brick_interval){.start = c->t, .end = end, .amount = level * (end - c->t), .level = level};
}

static nb_brick_interval cell_stretch(cursor *c)
{
    const nebel_grid *grid = c->grid;
    const int *cell = c->cells.block;
    const double end = larger(smaller(c->cells.next[nearest_axis(&c->cells)], c->brick_end), c->t);
    nb_brick_interval s;
    if (grid->filter == NEBEL_GRID_FILTER_NEAREST) {
        s = even_stretch(c, end, nearest_voxel(grid, grid->type, cell));
    } else {
        const corners corner = corners_of(grid, grid->type, cell);
        const double voxels = between_corners(&corner, c->line, cell, c->t, end);
        s = (nb_brick_interval){
            c->t, end, amount_of(grid, voxels, end - c->t), (double)NAN, {cell[0], cell[1], cell[2]}};
    }
    c->t = end;
    if (pass_block(&c->cells, c->line, c->brick_end)) c->within = 0;
    return s;
}

/* At the end of the ray it gives stretches of no length. */
static nb_brick_interval next_stretch(cursor *c)
{
    if (c->within) return cell_stretch(c);
    const brick *b = brick_at(c->grid, c->bricks.block);
    const double end = larger(smaller(c->bricks.next[nearest_axis(&c->bricks)], c->length), c->t);
    c->brick_end = end;
    c->within = b->least < b->most;
    if (c->within) c->cells = walk_cells(c->grid, c->line, &c->bricks, c->t);
    (void)pass_block(&c->bricks, c->line, c->length);
    if (c->within) return cell_stretch(c);
    const nb_brick_interval s = even_stretch(c, end, b->most);
    c->t = end;
    return s;
}

/* Where `amount` of a stretch is reached: Newton's steps, or halves where they would leave what is known. */
static double solve_stretch(const cursor *c, const nb_brick_interval *s, double amount)
{
    const nebel_grid *grid = c->grid;
    if (!(amount > 0)) return s->start;
    if (!(amount < s->amount)) return s->end;
    const double guess = s->start + (s->end - s->start) * (amount / s->amount);
    if (!isnan(s->level)) return guess;
    const corners corner = corners_of(grid, grid->type, s->cell);
    double low = s->start, high = s->end, t = guess;
    for (int i = 0; i < 40; i++) {
        const double voxels = between_corners(&corner, c->line, s->cell, s->start, t);
        const double off = amount_of(grid, voxels, t - s->start) - amount;
        if (fabs(off) <= 1e-12 * s->amount) break;
        if (off > 0)
            high = t;
        else
            low = t;
        const double density = density_of(grid, voxel_within(&corner, c->line, s->cell, t));
        const double next = t - off / density;
        t = next > low && next < high ? next : 0.5 * (low + high);
    }
    return t;
}

void nb_grid_places(const nebel_grid *grid, const nb_grid_line *line, double length, double amount, int count,
                    const double *share, double *place)
{
    cursor c = {.grid = grid, .line = line, .length = length, .bricks = walk_bricks(grid, line)};
    double before = 0;
    for (int i = 0; i < count;) {
        const nb_brick_interval s = next_stretch(&c);
        const int last = c.t >= length && !c.within;
        for (; i < count && (last || share[i] * amount <= before + s.amount); i++)
            place[i] = solve_stretch(&c, &s, share[i] * amount - before);
        before += s.amount;
    }
}

/* From the start of a stretch to a place on it. */
static double amount_up_to(const cursor *c, const nb_brick_interval *s, double place)
{
    if (!(place > s->start)) return 0;
    if (!(place < s->end)) return s->amount;
    if (!isnan(s->level)) return s->amount * ((place - s->start) / (s->end - s->start));
    const corners corner = corners_of(c->grid, c->grid->type, s->cell);
    return amount_of(c->grid, between_corners(&corner, c->line, s->cell, s->start, place), place - s->start);
}

void nb_grid_sums(const nebel_grid *grid, const nb_grid_line *line, double length, int count, const double *place,
                  double *sum)
{
    cursor c = {.grid = grid, .line = line, .length = length, .bricks = walk_bricks(grid, line)};
    double before = 0;
    for (int i = 0; i < count;) {
        const nb_brick_interval s = next_stretch(&c);
        const int last = c.t >= length && !c.within;
        for (; i < count && (last || place[i] <= s.end); i++) sum[i] = before + amount_up_to(&c, &s, place[i]);
        before += s.amount;
    }
}

/* ---- at a place ------------------------------------------------------------------------------ */

typedef struct located {
    int cell[3], block[3];
    const brick *brick;
} located;

static int clamp_index(double x, int count)
{
    return (int)smaller(larger(x, 0), count - 1);
}

static located locate(const nebel_grid *grid, const double place[3])
{
    located at;
    for (int i = 0; i < 3; i++) {
        at.cell[i] = clamp_index(floor(place[i]), grid->cells[i]);
        at.block[i] = at.cell[i] >> BRICK_SHIFT;
    }
    at.brick = brick_at(grid, at.block);
    return at;
}

double nb_grid_density(const nebel_grid *grid, const double place[3])
{
    const located at = locate(grid, place);
    double voxel = at.brick->most;
    if (at.brick->least < at.brick->most) {
        const corners c = corners_of(grid, grid->type, at.cell);
        const double share[3] = {share_of(place[0], at.cell[0]), share_of(place[1], at.cell[1]),
                                 share_of(place[2], at.cell[2])};
        voxel = interpolate(&c, share);
    }
    return larger(density_of(grid, voxel), 0);
}

double nb_grid_ceiling(const nebel_grid *grid, const double place[3], const double reach[3])
{
    const located at = locate(grid, place);
    if (!(at.brick->least < at.brick->most)) return larger(density_of(grid, at.brick->most), 0);
    const corners c = corners_of(grid, grid->type, at.cell);
    double most = 0;
    for (int i = 0; i < 8; i++) most = larger(most, density_of(grid, c.v[i]));
    if (grid->filter == NEBEL_GRID_FILTER_NEAREST) return most;
    /* |1 - x| + |x| <= 1 + 2 |x - its nearest point of the cell|, so the weights of the corners come to no more. */
    for (int i = 0; i < 3; i++) most *= 1 + 2 * reach[i];
    return most;
}

/* Within this of a face, in cells, a place has passed it. */
static double passed(double place)
{
    return (fabs(place) + 1) * (8 * ROUNDING);
}

/* The face of an axis, a multiple of `width` cells, that the ray crosses next. */
static double next_face(double place, double slope, int width)
{
    const double w = width;
    if (slope > 0) return (floor((place + passed(place)) / w) + 1) * w;
    return (ceil((place - passed(place)) / w) - 1) * w;
}

static double distance_to_face(const nb_grid_line *line, int axis, int width, double least)
{
    if (line->slope[axis] == 0) return HUGE_VAL;
    const double face = next_face(line->from[axis], line->slope[axis], width);
    const double distance = (face - line->from[axis]) / line->slope[axis];
    return distance > least ? distance : distance + width / fabs(line->slope[axis]);
}

static double distance_to_faces(const nb_grid_line *line, int width, double least)
{
    double nearest = HUGE_VAL;
    for (int i = 0; i < 3; i++) nearest = smaller(nearest, distance_to_face(line, i, width, least));
    return nearest;
}

double nb_grid_kink(const nebel_grid *grid, const nb_grid_line *line, double least)
{
    double inside[3];
    const double cell = distance_to_faces(line, 1, least);
    if (cell == HUGE_VAL) return cell;
    for (int i = 0; i < 3; i++) inside[i] = line->from[i] + 0.5 * cell * line->slope[i];
    const located at = locate(grid, inside);
    return at.brick->least < at.brick->most ? cell : distance_to_faces(line, BRICK, least);
}

double nb_grid_border(const nebel_grid *grid, const nb_grid_line *line, double least)
{
    if (grid->filter == NEBEL_GRID_FILTER_NEAREST) return nb_grid_kink(grid, line, least);
    return distance_to_faces(line, BRICK, least);
}
