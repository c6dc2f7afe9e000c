#include "grid_voxels.h"

#include "base/base.h"

#include <math.h>
#include <string.h>

static size_t size_of_voxel(nebel_voxel_type type)
{
    return type == NEBEL_VOXEL_UINT8 ? sizeof(uint8_t) : type == NEBEL_VOXEL_UINT16 ? sizeof(uint16_t) : sizeof(float);
}

/* ---- what a grid is made of ------------------------------------------------------------------ */

static nebel_result check_size(const nebel_grid_desc *desc, size_t *count)
{
    *count = 1;
    for (int i = 0; i < 3; i++) {
        if (desc->size[i] < 1 || desc->size[i] > NEBEL_MAX_GRID_SIZE)
            return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT,
                           "grid: %zu x %zu x %zu voxels; must be 1 to %d on each axis", desc->size[0], desc->size[1],
                           desc->size[2], NEBEL_MAX_GRID_SIZE);
        if (*count > NEBEL_MAX_GRID_VOXELS / desc->size[i])
            return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT, "grid: %zu x %zu x %zu voxels; at most %d in all",
                           desc->size[0], desc->size[1], desc->size[2], NEBEL_MAX_GRID_VOXELS);
        *count *= desc->size[i];
    }
    return NEBEL_OK;
}

static nebel_result check_desc(const nebel_grid_desc *desc, size_t *count)
{
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "grid: the allocator needs both functions or neither");
    if (desc->voxels == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "grid: voxels must not be NULL");
    if (desc->type != NEBEL_VOXEL_FLOAT && desc->type != NEBEL_VOXEL_UINT8 && desc->type != NEBEL_VOXEL_UINT16)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "grid: voxel type %d is unknown", (int)desc->type);
    if (desc->filter != NEBEL_GRID_FILTER_LINEAR && desc->filter != NEBEL_GRID_FILTER_NEAREST)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "grid: filter %d is unknown", (int)desc->filter);
    if (!isfinite(desc->scale) || !isfinite(desc->offset))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "grid: scale and offset must be finite");
    return check_size(desc, count);
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

/* Voxels along an axis. */
typedef struct nb_voxel_pair {
    int low, high;
} nb_voxel_pair;

/* The voxels from `low` to `high` of an axis that cells of a brick need, whichever the filter. */
static nb_voxel_pair voxels_of_brick(const nebel_grid *grid, int axis, int index)
{
    const int first = index * BRICK - 1, last = index * BRICK + BRICK - 1, end = grid->size[axis] - 1;
    return (nb_voxel_pair){first < 0 ? 0 : first < end ? first : end, last < end ? last : end};
}

static brick measure_brick(const nebel_grid *grid, int x, int y, int z)
{
    const nb_voxel_pair i = voxels_of_brick(grid, 0, x), j = voxels_of_brick(grid, 1, y),
                        k = voxels_of_brick(grid, 2, z);
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
            for (int x = 0; x < grid->bricks[0]; x++, b++) {
                *b = measure_brick(grid, x, y, z);
                grid->uneven_bricks += b->least < b->most;
            }
}

/* ---- how far fog is -------------------------------------------------------------------------- */

static size_t brick_number(const nebel_grid *grid, int x, int y, int z)
{
    return ((size_t)z * (size_t)grid->bricks[1] + (size_t)y) * (size_t)grid->bricks[0] + (size_t)x;
}

/* One more than the least of the 13 neighbours that a pass has seen before, `way` 1 or -1. */
static void approach(const nebel_grid *grid, int x, int y, int z, int way)
{
    uint8_t *clear = &grid->clear[brick_number(grid, x, y, z)];
    for (int i = 0; i < 13; i++) {
        const int at[3] = {x + way * (i % 3 - 1), y + way * (i / 3 % 3 - 1), z + way * (i / 9 - 1)};
        int inside = 1;
        for (int a = 0; a < 3; a++) inside = inside && at[a] >= 0 && at[a] < grid->bricks[a];
        if (!inside) continue;
        const int next = grid->clear[brick_number(grid, at[0], at[1], at[2])] + 1;
        if (next < *clear) *clear = (uint8_t)next;
    }
}

/* Two passes find the distance along the axis that is farthest. Source: Rosenfeld and Pfaltz, Sequential operations in
 * digital picture processing, 1966. */
static void measure_clearance(nebel_grid *grid)
{
    const int x = grid->bricks[0], y = grid->bricks[1], z = grid->bricks[2], count = x * y * z;
    for (int i = 0; i < count; i++) {
        const brick *b = &grid->brick[i];
        const int empty = b->least == b->most && !(density_of(grid, b->most) > 0);
        grid->clear[i] = empty ? UINT8_MAX : 0;
    }
    for (int i = 0; i < count; i++) approach(grid, i % x, i / x % y, i / x / y, 1);
    for (int i = count; i-- > 0;) approach(grid, i % x, i / x % y, i / x / y, -1);
}

static int allocate_grid(nebel_grid *grid, size_t count)
{
    size_t bricks = 1;
    for (int i = 0; i < 3; i++) {
        grid->cells[i] = grid->size[i] + (grid->filter == NEBEL_GRID_FILTER_LINEAR);
        grid->bricks[i] = (grid->cells[i] + BRICK - 1) / BRICK;
        bricks *= (size_t)grid->bricks[i];
    }
    grid->bytes = count * size_of_voxel(grid->type);
    grid->voxels = nb_allocate(&grid->allocator, grid->bytes + sizeof(uint32_t), 1);
    grid->brick = nb_allocate(&grid->allocator, bricks, sizeof *grid->brick);
    grid->clear = nb_allocate(&grid->allocator, bricks + sizeof(uint32_t), 1);
    return grid->voxels != NULL && grid->brick != NULL && grid->clear != NULL;
}

static void free_grid(nebel_grid *grid)
{
    const nebel_allocator allocator = grid->allocator;
    nb_release(&allocator, grid->voxels);
    nb_release(&allocator, grid->brick);
    nb_release(&allocator, grid->clear);
    nb_release(&allocator, grid->name);
    nb_release(&allocator, grid);
}

static nebel_result fill_grid(const nebel_grid_desc *desc, nebel_grid *grid, size_t count)
{
    const char *name = desc->name != NULL ? desc->name : "";
    grid->name = nb_allocate(&grid->allocator, strlen(name) + 1, 1);
    if (grid->name == NULL || !allocate_grid(grid, count))
        return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "grid: out of memory");
    memcpy(grid->name, name, strlen(name) + 1);
    memcpy(grid->voxels, desc->voxels, grid->bytes);
    const nebel_result result = check_voxels(&desc->host.log, grid, count);
    if (result != NEBEL_OK) return result;
    grid->hash = hash_bytes(grid->voxels, grid->bytes);
    measure_bricks(grid);
    measure_clearance(grid);
    return NEBEL_OK;
}

nebel_result nebel_create_grid(const nebel_grid_desc *desc, nebel_grid **grid)
{
    size_t count = 0;
    if (grid != NULL) *grid = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (grid == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "grid: the place for it must not be NULL");
    nebel_result result = check_desc(desc, &count);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_grid *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "grid: out of memory");
    made->allocator = allocator;
    atomic_init(&made->owners, 1);
    made->type = desc->type;
    made->filter = desc->filter;
    made->scale = desc->scale == 0 ? 1 : desc->scale;
    made->offset = desc->offset;
    size_t stride = 1;
    for (int i = 0; i < 3; i++) {
        made->size[i] = (int)desc->size[i];
        made->stride[i] = stride;
        stride *= desc->size[i];
    }
    result = fill_grid(desc, made, count);
    if (result != NEBEL_OK)
        free_grid(made);
    else
        *grid = made;
    return result;
}

const char *nebel_get_grid_name(const nebel_grid *grid)
{
    if (grid == NULL) return "";
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
    return grid->filter == NEBEL_GRID_FILTER_LINEAR ? 0.5 : 0;
}

int nb_grid_is_linear(const nebel_grid *grid)
{
    return grid->filter == NEBEL_GRID_FILTER_LINEAR;
}

int nb_grid_cells(const nebel_grid *grid, int axis)
{
    return grid->cells[axis];
}

double nb_grid_end(const nebel_grid *grid, int axis)
{
    return grid->size[axis] + nb_grid_margin(grid);
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
