/* Voxels as texels, the same for every eye. Grids lie in the order in which the snapshot's media first have them. */
#include "pack_voxels.h"

#include "pack_sun_lattices.h"
#include "texel_layout.h"

#include "fog/snapshot.h"
#include "medium/grid_voxels.h"

#include <math.h>
#include <string.h>

enum { BRICK_CELLS = BRICK * BRICK * BRICK, BRICK_CORNERS = BRICK + 1, MOST_STEPS = UINT16_MAX };

/* ---- the grids of a snapshot ----------------------------------------------------------------- */

nebel_grid *nb_grid_of_medium(const nebel_lighting *lighting, size_t medium)
{
    const nebel_density *density = &lighting->snapshot->media[medium].body.density;
    return density->type == NEBEL_DENSITY_GRID ? density->grid : NULL;
}

/* The first medium that has this one's grid. */
static size_t first_with_grid(const nebel_lighting *lighting, size_t medium)
{
    size_t first = 0;
    while (nb_grid_of_medium(lighting, first) != nb_grid_of_medium(lighting, medium)) first++;
    return first;
}

/* The next medium, from `medium` on, with a grid that none before it has; medium_count: there is none. */
static size_t next_grid(const nebel_lighting *lighting, size_t medium)
{
    while (medium < lighting->snapshot->medium_count &&
           (nb_grid_of_medium(lighting, medium) == NULL || first_with_grid(lighting, medium) != medium))
        medium++;
    return medium;
}

static size_t count_bricks(const nebel_grid *grid)
{
    return (size_t)grid->bricks[0] * (size_t)grid->bricks[1] * (size_t)grid->bricks[2];
}

static int is_even(const brick *b)
{
    return !(b->least < b->most);
}

static size_t count_grid_texels(const nebel_grid *grid)
{
    return 1 + count_bricks(grid) + grid->uneven_bricks * BRICK_CELLS;
}

static size_t count_grids(const nebel_lighting *lighting)
{
    size_t count = 0;
    for (size_t i = next_grid(lighting, 0); i < lighting->snapshot->medium_count; i = next_grid(lighting, i + 1))
        count += count_grid_texels(nb_grid_of_medium(lighting, i));
    return count;
}

/* What grids leave for lattices. */
static size_t room_beside(size_t grids)
{
    return grids < NB_MAX_TEXELS ? NB_MAX_TEXELS - grids : 0;
}

static size_t count_all(const nebel_lighting *lighting)
{
    const size_t grids = count_grids(lighting);
    return grids + nb_count_sun_lattice_texels(lighting, room_beside(grids));
}

nebel_result nb_check_voxels(const nebel_lighting *lighting)
{
    const size_t count = count_all(lighting);
    if (count <= NB_MAX_TEXELS) return NEBEL_OK;
    return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                   "pack: the grids are too large for shaders: where they are not even they take %zu texels, of which "
                   "%zu can be addressed; use fewer voxels, or nebel_trace or the CPU's renderer (--device cpu)",
                   count, NB_MAX_TEXELS);
}

void nb_place_voxels(const nebel_lighting *lighting, nebel_texel_f32 *words)
{
    size_t next = 0;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nebel_grid *grid = nb_grid_of_medium(lighting, i);
        if (grid == NULL) continue;
        nebel_texel_f32 *word = &words[NB_HEADER_TEXELS + i * NB_MEDIUM_TEXELS + 3];
        const size_t first = first_with_grid(lighting, i);
        word->v[3] = first < i ? words[NB_HEADER_TEXELS + first * NB_MEDIUM_TEXELS + 3].v[3] : (float)next;
        if (first == i) next += count_grid_texels(grid);
    }
    nb_place_sun_lattices(lighting, room_beside(next), next, words);
}

int nebel_is_same_voxels(const nebel_lighting *a, const nebel_lighting *b)
{
    if (a == NULL || b == NULL) return a == b;
    size_t i = next_grid(a, 0), k = next_grid(b, 0);
    while (i < a->snapshot->medium_count && k < b->snapshot->medium_count &&
           nb_grid_compare(nb_grid_of_medium(a, i), nb_grid_of_medium(b, k)) == 0) {
        i = next_grid(a, i + 1);
        k = next_grid(b, k + 1);
    }
    return i == a->snapshot->medium_count && k == b->snapshot->medium_count && nb_same_sun_lattices(a, b);
}

/* ---- texels ---------------------------------------------------------------------------------- */

uint32_t nb_texel_bits(double x)
{
    const float narrow = (float)x;
    uint32_t bits;
    memcpy(&bits, &narrow, sizeof bits);
    return bits;
}

/* The voxel that corner i of a brick is, along an axis. */
static size_t voxel_at(const nebel_grid *grid, int axis, int block, int i)
{
    const int wanted = block * BRICK + i - (grid->filter == NEBEL_GRID_FILTER_LINEAR), end = grid->size[axis] - 1;
    return (size_t)(wanted < 0 ? 0 : wanted < end ? wanted : end);
}

/* The corners of a brick's cells, in steps above its least voxel. */
static void measure_corners(const nebel_grid *grid, const brick *b, const int block[3],
                            uint16_t steps[BRICK_CORNERS][BRICK_CORNERS][BRICK_CORNERS])
{
    const double rate = MOST_STEPS / (b->most - b->least);
    for (int z = 0; z < BRICK_CORNERS; z++)
        for (int y = 0; y < BRICK_CORNERS; y++)
            for (int x = 0; x < BRICK_CORNERS; x++) {
                const size_t row =
                    row_of(grid, (int)voxel_at(grid, 1, block[1], y), (int)voxel_at(grid, 2, block[2], z));
                const double voxel = voxel_of(grid->type, grid->voxels, row + voxel_at(grid, 0, block[0], x));
                steps[z][y][x] = (uint16_t)fmin(fmax((voxel - b->least) * rate + 0.5, 0), MOST_STEPS);
            }
}

/* Cells of nearest voxels have one corner eight times. */
static void pack_cells(const nebel_grid *grid, const brick *b, const int block[3], nebel_texel_u32 *texel)
{
    uint16_t steps[BRICK_CORNERS][BRICK_CORNERS][BRICK_CORNERS];
    const int far = grid->filter == NEBEL_GRID_FILTER_LINEAR;
    measure_corners(grid, b, block, steps);
    for (int z = 0; z < BRICK; z++)
        for (int y = 0; y < BRICK; y++)
            for (int x = 0; x < BRICK; x++, texel++)
                for (int i = 0; i < 4; i++) {
                    const uint16_t *row = steps[z + far * (i / 2)][y + far * (i % 2)];
                    texel->v[i] = row[x] | (uint32_t)row[x + far] << 16;
                }
}

/* Returns the texel behind the last. `first`: how many texels come before the grid. */
static size_t pack_grid_voxels(const nebel_grid *grid, size_t first, nebel_texel_u32 *texels)
{
    const brick *b = grid->brick;
    nebel_texel_u32 *head = &texels[first];
    size_t cells = first + 1 + count_bricks(grid);
    *head++ = (nebel_texel_u32){{(uint32_t)grid->bricks[0], (uint32_t)grid->bricks[1], (uint32_t)grid->bricks[2],
                                 grid->filter == NEBEL_GRID_FILTER_LINEAR}};
    for (int z = 0; z < grid->bricks[2]; z++)
        for (int y = 0; y < grid->bricks[1]; y++)
            for (int x = 0; x < grid->bricks[0]; x++, b++) {
                const double step = grid->scale * ((b->most - b->least) / MOST_STEPS);
                *head++ = (nebel_texel_u32){{nb_texel_bits(density_of(grid, b->least)), nb_texel_bits(step),
                                             is_even(b) ? 0 : (uint32_t)cells, 0}};
                if (is_even(b)) continue;
                pack_cells(grid, b, (int[]){x, y, z}, &texels[cells]);
                cells += BRICK_CELLS;
            }
    return cells;
}

nebel_result nebel_pack_voxels(const nebel_lighting *lighting, nebel_texel_u32 *texels, size_t capacity, size_t *count)
{
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    if (count == NULL || (texels == NULL && capacity > 0))
        return nb_fail(&lighting->log, NEBEL_ERROR_ARGUMENT, "pack: texels and count must not be NULL");
    const nebel_result result = nb_check_voxels(lighting);
    if (result != NEBEL_OK) return result;
    *count = count_all(lighting);
    if (texels == NULL) return NEBEL_OK;
    if (capacity < *count)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                       "pack: %zu texels of voxels are needed, there is room for %zu", *count, capacity);
    size_t next = 0;
    for (size_t i = next_grid(lighting, 0); i < lighting->snapshot->medium_count; i = next_grid(lighting, i + 1))
        next = pack_grid_voxels(nb_grid_of_medium(lighting, i), next, texels);
    return nb_pack_sun_lattices(lighting, room_beside(next), &texels[next]);
}
