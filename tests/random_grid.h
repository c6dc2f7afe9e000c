/* Random voxels in random fog. */
#ifndef RANDOM_GRID_H
#define RANDOM_GRID_H

#include "dice.h"
#include "random_fog.h"
#include "unit.h"

#include <string.h>

enum { RANDOM_GRIDS = 3 };

/* Sparse, so that some bricks are even. */
static inline nebel_grid *random_grid(uint64_t *state)
{
    enum { LONGEST = 36 };
    static const nebel_voxel_type types[] = {NEBEL_VOXEL_FLOAT, NEBEL_VOXEL_UINT8, NEBEL_VOXEL_UINT16};
    static float floats[LONGEST * LONGEST * LONGEST];
    static uint8_t bytes[LONGEST * LONGEST * LONGEST];
    static uint16_t words[LONGEST * LONGEST * LONGEST];
    const void *const voxels[] = {floats, bytes, words};
    const int kind = dice_below(state, 3);
    nebel_grid_desc desc = {.type = types[kind],
                            .voxels = voxels[kind],
                            .filter = dice_below(state, 3) == 0 ? NEBEL_GRID_FILTER_NEAREST : NEBEL_GRID_FILTER_LINEAR};
    nebel_grid *grid = NULL;
    for (int i = 0; i < 3; i++) desc.size[i] = (size_t)(1 + dice_below(state, LONGEST));
    const int falls = dice_below(state, 3) == 0;
    desc.scale = falls ? -1.5 : dice(state, .3, 3);
    desc.offset = falls ? 1.5 : dice_below(state, 3) * .2;
    for (size_t i = 0; i < desc.size[0] * desc.size[1] * desc.size[2]; i++) {
        const int is_there = i % desc.size[0] / 9 % 2 == 0 || i / (desc.size[0] * desc.size[1]) < 7;
        const double v = is_there ? dice(state, 0, 1) : 0;
        floats[i] = (float)v;
        bytes[i] = (uint8_t)(v * 255.9);
        words[i] = (uint16_t)(v * 65535.9);
    }
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

static inline nebel_grid *random_noise(uint64_t *state)
{
    nebel_grid *grid = NULL;
    const nebel_noise_desc desc = {.size = {24, 20, 32},
                                   .frequency = {dice(state, 1, 5), dice(state, 1, 5), dice(state, 1, 5)},
                                   .octaves = 3,
                                   .coverage = dice(state, .3, 1),
                                   .falloff = {.1, .1, .1},
                                   .time = dice(state, 0, 5),
                                   .seed = (uint32_t)dice_next(state)};
    assert_int_equal(nebel_create_noise_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

/* Fog of a kind, of which every second volume becomes a box of voxels, turned and scaled where it was; grids are shared
 * where there are more boxes. Release the grids. */
static inline void random_grids_make(random_fog *fog, random_fog_kind kind, uint64_t seed,
                                     nebel_grid *grids[RANDOM_GRIDS])
{
    uint64_t state = seed + 77;
    random_fog_make(fog, kind, seed);
    for (int i = 0; i < RANDOM_GRIDS; i++) grids[i] = i == 1 ? random_noise(&state) : random_grid(&state);
    for (size_t i = 0; i < fog->count; i += 2) {
        nebel_volume_desc *const v = &fog->volumes[i];
        nebel_shape *const s = &v->shape;
        s->type = NEBEL_SHAPE_BOX;
        for (int k = 0; k < 3; k++) {
            const double middle = fog->shift[k] + dice(&state, -4, 4), half = dice(&state, 1, 9);
            s->min[k] = middle - half;
            s->max[k] = middle + half;
            if (v->operation != NEBEL_OPERATION_EXCLUDE) v->extinction[k] = dice(&state, .02, .4);
        }
        if (v->operation == NEBEL_OPERATION_EXCLUDE) continue;
        v->density = (nebel_density){.type = NEBEL_DENSITY_GRID, .grid = grids[i / 2 % RANDOM_GRIDS]};
    }
}

static inline void random_grids_release(nebel_grid *grids[RANDOM_GRIDS])
{
    for (int i = 0; i < RANDOM_GRIDS; i++) nebel_release_grid(grids[i]);
}

#endif
