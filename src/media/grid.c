#include "grid.h"

#include "base/base.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

/* Cells of a brick along an axis. Bricks whose voxels are all equal are passed in one step. */
enum { BRICK_SHIFT = 3, BRICK = 1 << BRICK_SHIFT };

/* The least and the largest voxel that any cell of a brick needs, as stored. */
typedef struct brick {
    double least, most;
} brick;

struct nebel_grid {
    nebel_allocator allocator;
    atomic_size_t owners;
    int size[3];  /* voxels */
    int cells[3]; /* for the filter */
    int bricks[3];
    nebel_voxel_type type;
    nebel_filter filter;
    double scale, offset; /* density = offset + scale * voxel, voxels of integers counted from 0 to 1 */
    double least, most;   /* density */
    uint64_t hash;        /* of what is stored */
    size_t bytes;
    void *voxels;
    brick *brick;
    char *name;
};

/* In line into one loop for each type of voxels. */
#define INLINE static inline __attribute__((always_inline))

/* fmin and fmax are calls of the C library. Where `a` is a NaN `b` comes out. */
static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/* ---- voxels ---------------------------------------------------------------------------------- */

INLINE double voxel_of(nebel_voxel_type type, const void *voxels, size_t i)
{
    switch (type) {
    case NEBEL_VOXEL_UINT8:
        return (double)((const uint8_t *)voxels)[i] * (1.0 / 255);
    case NEBEL_VOXEL_UINT16:
        return (double)((const uint16_t *)voxels)[i] * (1.0 / 65535);
    default:
        return (double)((const float *)voxels)[i];
    }
}

static size_t size_of_voxel(nebel_voxel_type type)
{
    return type == NEBEL_VOXEL_UINT8 ? sizeof(uint8_t) : type == NEBEL_VOXEL_UINT16 ? sizeof(uint16_t) : sizeof(float);
}

static int clamp_index(double x, int count)
{
    return (int)smaller(larger(x, 0), count - 1);
}

/* The voxels that a cell interpolates between along an axis; two that are the same at the rim, and where nearest. */
typedef struct pair {
    int low, high;
} pair;

INLINE pair pair_of(const nebel_grid *grid, int axis, int cell)
{
    if (grid->filter == NEBEL_FILTER_NEAREST) return (pair){cell, cell};
    return (pair){cell > 0 ? cell - 1 : 0, cell < grid->size[axis] ? cell : cell - 1};
}

INLINE size_t row_of(const nebel_grid *grid, int y, int z)
{
    return ((size_t)z * (size_t)grid->size[1] + (size_t)y) * (size_t)grid->size[0];
}

/* The eight voxels of a cell, x fastest. */
typedef struct corners {
    double v[8];
} corners;

INLINE corners corners_of(const nebel_grid *grid, nebel_voxel_type type, const int cell[3])
{
    const pair x = pair_of(grid, 0, cell[0]), y = pair_of(grid, 1, cell[1]), z = pair_of(grid, 2, cell[2]);
    const size_t rows[4] = {row_of(grid, y.low, z.low), row_of(grid, y.high, z.low), row_of(grid, y.low, z.high),
                            row_of(grid, y.high, z.high)};
    corners c;
    for (int i = 0; i < 4; i++) {
        c.v[2 * i] = voxel_of(type, grid->voxels, rows[i] + (size_t)x.low);
        c.v[2 * i + 1] = voxel_of(type, grid->voxels, rows[i] + (size_t)x.high);
    }
    return c;
}

INLINE double between(double a, double b, double share)
{
    return a + share * (b - a);
}

/* Shares are clamped, so that no rounding leaves what the corners are. */
INLINE double interpolate(const corners *c, double x, double y, double z)
{
    const double u = smaller(larger(x, 0), 1), v = smaller(larger(y, 0), 1), w = smaller(larger(z, 0), 1);
    const double near = between(between(c->v[0], c->v[1], u), between(c->v[2], c->v[3], u), v);
    const double far = between(between(c->v[4], c->v[5], u), between(c->v[6], c->v[7], u), v);
    return between(near, far, w);
}

/* ---- what a grid is made of ------------------------------------------------------------------ */

static nebel_result check_size(const nebel_grid_desc *desc, size_t *count)
{
    *count = 1;
    for (int i = 0; i < 3; i++) {
        if (desc->size[i] < 1 || desc->size[i] > NEBEL_MAX_GRID_SIZE)
            return nb_fail(&desc->log, NEBEL_ERROR_LIMIT, "grid: %zu x %zu x %zu voxels; must be 1 to %d on each axis",
                           desc->size[0], desc->size[1], desc->size[2], NEBEL_MAX_GRID_SIZE);
        if (*count > NEBEL_MAX_GRID_VOXELS / desc->size[i])
            return nb_fail(&desc->log, NEBEL_ERROR_LIMIT, "grid: %zu x %zu x %zu voxels; at most %d in all",
                           desc->size[0], desc->size[1], desc->size[2], NEBEL_MAX_GRID_VOXELS);
        *count *= desc->size[i];
    }
    return NEBEL_OK;
}

static nebel_result check_desc(const nebel_grid_desc *desc, size_t *count)
{
    if (!nb_allocator_is_valid(&desc->allocator))
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "grid: the allocator needs both functions or neither");
    if (desc->voxels == NULL) return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "grid: voxels must not be NULL");
    if (desc->type != NEBEL_VOXEL_FLOAT && desc->type != NEBEL_VOXEL_UINT8 && desc->type != NEBEL_VOXEL_UINT16)
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "grid: voxel type %d is unknown", (int)desc->type);
    if (desc->filter != NEBEL_FILTER_LINEAR && desc->filter != NEBEL_FILTER_NEAREST)
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "grid: filter %d is unknown", (int)desc->filter);
    if (!isfinite(desc->scale) || !isfinite(desc->offset))
        return nb_fail(&desc->log, NEBEL_ERROR_VALUE, "grid: scale and offset must be finite");
    return check_size(desc, count);
}

static double density_of(const nebel_grid *grid, double voxel)
{
    return grid->offset + grid->scale * voxel;
}

/* Every voxel must be a density. */
static nebel_result check_voxels(const nebel_log *log, nebel_grid *grid, size_t count)
{
    grid->least = HUGE_VAL;
    grid->most = 0;
    for (size_t i = 0; i < count; i++) {
        const double density = density_of(grid, voxel_of(grid->type, grid->voxels, i));
        if (!(density >= 0 && density <= NEBEL_MAX_AMOUNT)) {
            const size_t x = i % (size_t)grid->size[0], rows = i / (size_t)grid->size[0];
            return nb_fail(log, NEBEL_ERROR_VALUE,
                           "grid: voxel %zu, %zu, %zu has the density %g; must be within 0 and %g", x,
                           rows % (size_t)grid->size[1], rows / (size_t)grid->size[1], density, NEBEL_MAX_AMOUNT);
        }
        grid->least = smaller(grid->least, density);
        grid->most = larger(grid->most, density);
    }
    return NEBEL_OK;
}

/* FNV-1a (Fowler, Noll, Vo), eight bytes at a time. Bits only move up in its products, hence the shift. */
static uint64_t hash_bytes(const char *bytes, size_t count)
{
    uint64_t hash = UINT64_C(14695981039346656037);
    for (size_t i = 0; i < count; i += sizeof hash) {
        uint64_t word = 0;
        memcpy(&word, bytes + i, count - i < sizeof word ? count - i : sizeof word);
        hash = (hash ^ word) * UINT64_C(1099511628211);
        hash ^= hash >> 32;
    }
    return hash;
}

/* The voxels from `low` to `high` of an axis that cells of a brick need, whichever the filter. */
static pair voxels_of_brick(const nebel_grid *grid, int axis, int index)
{
    const int first = index * BRICK - 1, last = index * BRICK + BRICK - 1, end = grid->size[axis] - 1;
    return (pair){first < 0 ? 0 : first < end ? first : end, last < end ? last : end};
}

static brick measure_brick(const nebel_grid *grid, int x, int y, int z)
{
    const pair i = voxels_of_brick(grid, 0, x), j = voxels_of_brick(grid, 1, y), k = voxels_of_brick(grid, 2, z);
    brick b = {HUGE_VAL, -HUGE_VAL};
    for (int c = k.low; c <= k.high; c++)
        for (int r = j.low; r <= j.high; r++)
            for (int a = i.low; a <= i.high; a++) {
                const double v = voxel_of(grid->type, grid->voxels, row_of(grid, r, c) + (size_t)a);
                b.least = smaller(b.least, v);
                b.most = larger(b.most, v);
            }
    return b;
}

static void measure_bricks(nebel_grid *grid)
{
    brick *b = grid->brick;
    for (int z = 0; z < grid->bricks[2]; z++)
        for (int y = 0; y < grid->bricks[1]; y++)
            for (int x = 0; x < grid->bricks[0]; x++) *b++ = measure_brick(grid, x, y, z);
}

static int allocate_grid(nebel_grid *grid, size_t count)
{
    size_t bricks = 1;
    for (int i = 0; i < 3; i++) {
        grid->cells[i] = grid->size[i] + (grid->filter == NEBEL_FILTER_LINEAR);
        grid->bricks[i] = (grid->cells[i] + BRICK - 1) / BRICK;
        bricks *= (size_t)grid->bricks[i];
    }
    grid->bytes = count * size_of_voxel(grid->type);
    grid->voxels = nb_allocate(&grid->allocator, count, size_of_voxel(grid->type));
    grid->brick = nb_allocate(&grid->allocator, bricks, sizeof *grid->brick);
    return grid->voxels != NULL && grid->brick != NULL;
}

static void free_grid(nebel_grid *grid)
{
    const nebel_allocator allocator = grid->allocator;
    nb_release(&allocator, grid->voxels);
    nb_release(&allocator, grid->brick);
    nb_release(&allocator, grid->name);
    nb_release(&allocator, grid);
}

static nebel_result fill_grid(const nebel_grid_desc *desc, nebel_grid *grid, size_t count)
{
    const char *name = desc->name != NULL ? desc->name : "";
    grid->name = nb_allocate(&grid->allocator, strlen(name) + 1, 1);
    if (grid->name == NULL || !allocate_grid(grid, count))
        return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "grid: out of memory");
    memcpy(grid->name, name, strlen(name) + 1);
    memcpy(grid->voxels, desc->voxels, grid->bytes);
    const nebel_result result = check_voxels(&desc->log, grid, count);
    if (result != NEBEL_OK) return result;
    grid->hash = hash_bytes(grid->voxels, grid->bytes);
    measure_bricks(grid);
    return NEBEL_OK;
}

nebel_result nebel_create_grid(const nebel_grid_desc *desc, nebel_grid **grid)
{
    size_t count = 0;
    if (grid != NULL) *grid = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (grid == NULL) return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "grid: the place for it must not be NULL");
    nebel_result result = check_desc(desc, &count);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    nebel_grid *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "grid: out of memory");
    made->allocator = allocator;
    atomic_init(&made->owners, 1);
    made->type = desc->type;
    made->filter = desc->filter;
    made->scale = desc->scale == 0 ? 1 : desc->scale;
    made->offset = desc->offset;
    for (int i = 0; i < 3; i++) made->size[i] = (int)desc->size[i];
    result = fill_grid(desc, made, count);
    if (result != NEBEL_OK)
        free_grid(made);
    else
        *grid = made;
    return result;
}

const char *nebel_grid_name(const nebel_grid *grid)
{
    return grid->name;
}

nebel_grid *nebel_retain_grid(nebel_grid *grid)
{
    if (grid != NULL) atomic_fetch_add_explicit(&grid->owners, 1, memory_order_relaxed);
    return grid;
}

void nebel_release_grid(nebel_grid *grid)
{
    if (grid == NULL) return;
    if (atomic_fetch_sub_explicit(&grid->owners, 1, memory_order_acq_rel) == 1) free_grid(grid);
}

double nb_grid_margin(const nebel_grid *grid)
{
    return grid->filter == NEBEL_FILTER_LINEAR ? 0.5 : 0;
}

void nb_grid_rate(const nebel_grid *grid, const double low[3], const double high[3], double rate[3])
{
    for (int i = 0; i < 3; i++) rate[i] = smaller(grid->size[i] / (high[i] - low[i]), 1e150);
}

double nb_grid_peak(const nebel_grid *grid)
{
    return grid->most;
}

static int order_of(double a, double b)
{
    return (a > b) - (a < b);
}

int nb_grid_compare(const nebel_grid *a, const nebel_grid *b)
{
    if (a == b) return 0;
    if (a == NULL || b == NULL) return a == NULL ? -1 : 1;
    int order = (a->hash > b->hash) - (a->hash < b->hash);
    for (int i = 0; i < 3 && order == 0; i++) order = (a->size[i] > b->size[i]) - (a->size[i] < b->size[i]);
    if (order == 0) order = (a->type > b->type) - (a->type < b->type);
    if (order == 0) order = (a->filter > b->filter) - (a->filter < b->filter);
    if (order == 0) order = order_of(a->scale, b->scale);
    if (order == 0) order = order_of(a->offset, b->offset);
    return order == 0 ? memcmp(a->voxels, b->voxels, a->bytes) : order;
}

/* ---- along a ray ----------------------------------------------------------------------------- */

#define ROUNDING 1.1102230246251565e-16

/* A walk from one block of cells to the next, for bricks and for the cells in one: where the ray crosses the next face
 * of each axis. Faces are counted in cells; crossings are computed from their numbers, so that errors do not add up. */
typedef struct walk {
    int block[3], first[3], last[3]; /* within first and last */
    int width;                       /* cells of a block along an axis */
    double next[3];                  /* t at which the ray leaves the block, HUGE_VAL where it does not */
} walk;

static double crossing(const nb_grid_line *line, const walk *w, int axis)
{
    const int forward = line->slope[axis] > 0;
    if (line->slope[axis] == 0 || w->block[axis] == (forward ? w->last[axis] : w->first[axis])) return HUGE_VAL;
    return ((double)((w->block[axis] + forward) * w->width) - line->from[axis]) / line->slope[axis];
}

/* At a face the ray is in the block that it enters. */
static int block_at(const nb_grid_line *line, int axis, double t, int width)
{
    const double place = (line->from[axis] + line->slope[axis] * t) / width;
    const double block = line->slope[axis] < 0 ? ceil(place) - 1 : floor(place);
    return (int)smaller(larger(block, -1), 1 << 24);
}

static void start_walk(walk *w, const nb_grid_line *line, double t, int width)
{
    w->width = width;
    for (int i = 0; i < 3; i++) {
        const int block = block_at(line, i, t, width);
        w->block[i] = block < w->first[i] ? w->first[i] : block > w->last[i] ? w->last[i] : block;
        w->next[i] = crossing(line, w, i);
    }
}

static inline int nearest_axis(const walk *w)
{
    const int a = w->next[0] <= w->next[1] ? 0 : 1;
    return w->next[a] <= w->next[2] ? a : 2;
}

static inline void step_walk(walk *w, const nb_grid_line *line, int axis)
{
    w->block[axis] += line->slope[axis] > 0 ? 1 : -1;
    w->next[axis] = crossing(line, w, axis);
}

/* Half the distance between the points of Gauss's rule on [0, 1]: exact for the cubic that the density is in a cell. */
#define GAUSS_HALF 0.28867513459481288

INLINE double along_cell(const nebel_grid *grid, nebel_voxel_type type, const nb_grid_line *line, const int cell[3],
                         double start, double end)
{
    const corners c = corners_of(grid, type, cell);
    const double middle = 0.5 * (start + end), half = GAUSS_HALF * (end - start);
    double sum = 0;
    for (int i = 0; i < 2; i++) {
        const double t = i == 0 ? middle - half : middle + half;
        sum +=
            interpolate(&c, (line->from[0] + line->slope[0] * t) - cell[0],
                        (line->from[1] + line->slope[1] * t) - cell[1], (line->from[2] + line->slope[2] * t) - cell[2]);
    }
    return 0.5 * (end - start) * sum;
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

INLINE brick_sum walk_brick(const nebel_grid *grid, nebel_voxel_type type, const nb_grid_line *line, const int block[3],
                            double start, double end)
{
    walk w;
    brick_sum sum = {0, 0};
    for (int i = 0; i < 3; i++) {
        w.first[i] = block[i] * BRICK;
        w.last[i] = (block[i] + 1) * BRICK - 1;
        if (w.last[i] >= grid->cells[i]) w.last[i] = grid->cells[i] - 1;
    }
    start_walk(&w, line, start, 1);
    for (double t = start;;) {
        const int axis = nearest_axis(&w);
        const double until = larger(smaller(w.next[axis], end), t);
        sum.value += grid->filter == NEBEL_FILTER_NEAREST ? (until - t) * nearest_voxel(grid, type, w.block)
                                                          : along_cell(grid, type, line, w.block, t, until);
        sum.cells++;
        if (w.next[axis] >= end) return sum;
        t = until;
        step_walk(&w, line, axis);
    }
}

/* One copy for each type, so that the innermost loop asks for none. */
static brick_sum sum_brick(const nebel_grid *grid, const nb_grid_line *line, const int block[3], double start,
                           double end)
{
    switch (grid->type) {
    case NEBEL_VOXEL_UINT8:
        return walk_brick(grid, NEBEL_VOXEL_UINT8, line, block, start, end);
    case NEBEL_VOXEL_UINT16:
        return walk_brick(grid, NEBEL_VOXEL_UINT16, line, block, start, end);
    default:
        return walk_brick(grid, NEBEL_VOXEL_FLOAT, line, block, start, end);
    }
}

static const brick *brick_at(const nebel_grid *grid, const int block[3])
{
    const size_t bricks[2] = {(size_t)grid->bricks[0], (size_t)grid->bricks[1]};
    return &grid->brick[((size_t)block[2] * bricks[1] + (size_t)block[1]) * bricks[0] + (size_t)block[0]];
}

static walk walk_bricks(const nebel_grid *grid, const nb_grid_line *line)
{
    walk w;
    for (int i = 0; i < 3; i++) {
        w.first[i] = 0;
        w.last[i] = grid->bricks[i] - 1;
    }
    start_walk(&w, line, 0, BRICK);
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
        error += grid->filter == NEBEL_FILTER_LINEAR ? own * length : error_of_faces(line, i, length, own);
    }
    return error * (grid->most - grid->least);
}

nb_grid_sum nb_grid_integral(const nebel_grid *grid, const nb_grid_line *line, double length, double noise)
{
    if (!(length > 0)) return (nb_grid_sum){0, 0};
    walk w = walk_bricks(grid, line);
    double voxels = 0;
    double terms = 0;
    for (double t = 0;;) {
        const int axis = nearest_axis(&w);
        const double until = larger(smaller(w.next[axis], length), t);
        const brick *b = brick_at(grid, w.block);
        if (b->least < b->most) {
            const brick_sum sum = sum_brick(grid, line, w.block, t, until);
            voxels += sum.value;
            terms += sum.cells;
        } else {
            voxels += (until - t) * b->most;
        }
        terms++;
        if (w.next[axis] >= length) break;
        t = until;
        step_walk(&w, line, axis);
    }
    const double offset = grid->offset * length, scaled = grid->scale * voxels;
    const double value = larger(offset + scaled, 0);
    const double rounding = (fabs(offset) + fabs(scaled)) * ((terms + 32) * ROUNDING);
    return (nb_grid_sum){value, rounding + error_of_noise(grid, line, length, noise)};
}

/* ---- at a place ------------------------------------------------------------------------------ */

typedef struct located {
    int cell[3], block[3];
    const brick *brick;
} located;

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
        voxel = interpolate(&c, place[0] - at.cell[0], place[1] - at.cell[1], place[2] - at.cell[2]);
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
    if (grid->filter == NEBEL_FILTER_NEAREST) return most;
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
