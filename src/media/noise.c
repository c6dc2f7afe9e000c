/* Noise as voxels: value noise of several octaves, in space and time. The values at its lattice are hashes of whole
 * numbers, between them a smooth step of Perlin's (Improving Noise, 2002) along each axis. */
#include "base/base.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_OCTAVES = 16 };

/* Whole numbers to whole numbers, all bits of which hang on all bits. Source: Wellons, Prospecting for Hash Functions,
 * 2018. */
static uint32_t mix_bits(uint32_t x)
{
    x = (x ^ x >> 16) * UINT32_C(0x7feb352d);
    x = (x ^ x >> 15) * UINT32_C(0x846ca68b);
    return x ^ x >> 16;
}

/* A place between lattice points along one axis. */
typedef struct between {
    uint32_t low; /* the lattice point before it */
    double share; /* of the one behind it */
} between;

static between locate(double x)
{
    const double low = floor(x), u = x - low;
    return (between){(uint32_t)(int64_t)low, u * u * u * (u * (u * 6 - 15) + 10)};
}

/* An octave, and the values at the corners of the cell that was asked last. */
typedef struct octave {
    uint32_t seed, cell[4];
    int is_known;
    double corners[16], scale, weight;
} octave;

/* The axes are x, y, z and time. */
static void find_corners(octave *o, const between axes[4])
{
    int is_same = o->is_known;
    for (int i = 0; i < 4; i++) is_same = is_same && o->cell[i] == axes[i].low;
    if (is_same) return;
    o->is_known = 1;
    for (int i = 0; i < 4; i++) o->cell[i] = axes[i].low;
    for (unsigned corner = 0; corner < 16; corner++) {
        uint32_t hash = o->seed;
        for (int i = 0; i < 4; i++) hash = mix_bits(hash + o->cell[i] + (corner >> i & 1));
        o->corners[corner] = (double)hash * 0x1p-32;
    }
}

/* 0 to 1. */
static double value_noise(octave *o, const between axes[4])
{
    double values[16];
    find_corners(o, axes);
    memcpy(values, o->corners, sizeof values);
    for (int i = 0, count = 8; i < 4; i++, count /= 2)
        for (int k = 0; k < count; k++) values[k] = values[2 * k] + axes[i].share * (values[2 * k + 1] - values[2 * k]);
    return values[0];
}

/* Octaves whose cells are at least two voxels wide. */
static int octaves_in(const nebel_noise_desc *desc)
{
    const int wanted = desc->octaves == 0 ? 1 : desc->octaves;
    int count = 1;
    for (double scale = 2; count < wanted; count++, scale *= 2)
        for (int i = 0; i < 3; i++)
            if (2 * desc->cells[i] * scale > (double)desc->size[i]) return count;
    return count;
}

static int start_octaves(const nebel_noise_desc *desc, octave octaves[MOST_OCTAVES])
{
    const int count = octaves_in(desc);
    double scale = 1, weight = 1, all = 0;
    for (int i = 0; i < count; i++) {
        octaves[i] = (octave){.seed = mix_bits(desc->seed + (uint32_t)i), .scale = scale, .weight = weight};
        all += weight;
        weight *= desc->gain == 0 ? 0.5 : desc->gain;
        scale *= 2;
    }
    for (int i = 0; i < count; i++) octaves[i].weight /= all;
    return count;
}

/* The place in parts of the box, 0 to 1. */
static double sum_octaves(const nebel_noise_desc *desc, octave *octaves, int count, const double place[3])
{
    double sum = 0;
    for (int o = 0; o < count; o++) {
        between axes[4];
        for (int i = 0; i < 3; i++) axes[i] = locate((place[i] * desc->cells[i] - desc->offset[i]) * octaves[o].scale);
        axes[3] = locate(desc->time * octaves[o].scale);
        sum += octaves[o].weight * value_noise(&octaves[o], axes);
    }
    return sum;
}

/* 0 on the faces of the box, 1 from `edge` within. */
static double fade(const nebel_noise_desc *desc, const double place[3])
{
    double all = 1;
    for (int i = 0; i < 3; i++) {
        const double depth = fmin(place[i], 1 - place[i]);
        const double u = depth < desc->edge[i] ? depth / desc->edge[i] : 1;
        all *= u * u * (3 - 2 * u);
    }
    return all;
}

static void fill(const nebel_noise_desc *desc, uint16_t *voxels)
{
    octave octaves[MOST_OCTAVES];
    const int count = start_octaves(desc, octaves);
    const double coverage = desc->coverage == 0 ? 1 : desc->coverage;
    for (size_t z = 0; z < desc->size[2]; z++)
        for (size_t y = 0; y < desc->size[1]; y++)
            for (size_t x = 0; x < desc->size[0]; x++) {
                const double place[3] = {((double)x + 0.5) / (double)desc->size[0],
                                         ((double)y + 0.5) / (double)desc->size[1],
                                         ((double)z + 0.5) / (double)desc->size[2]};
                const double above = (sum_octaves(desc, octaves, count, place) - (1 - coverage)) / coverage;
                *voxels++ = (uint16_t)(fmax(above, 0) * fade(desc, place) * UINT16_MAX + 0.5);
            }
}

static nebel_result bad(const nebel_noise_desc *desc, const char *what, double value, const char *range)
{
    return nb_fail(&desc->log, NEBEL_ERROR_VALUE, "noise: %s is %g; must be %s", what, value, range);
}

static nebel_result check_axis(const nebel_noise_desc *desc, int i)
{
    if (desc->size[i] < 1 || desc->size[i] > NEBEL_MAX_GRID_SIZE)
        return nb_fail(&desc->log, NEBEL_ERROR_LIMIT, "noise: %zu x %zu x %zu voxels; must be 1 to %d on each axis",
                       desc->size[0], desc->size[1], desc->size[2], NEBEL_MAX_GRID_SIZE);
    if (!(desc->cells[i] > 0 && 2 * desc->cells[i] <= (double)desc->size[i]))
        return bad(desc, "cells", desc->cells[i], "more than 0, and of two voxels each at least");
    if (!(fabs(desc->offset[i]) <= NEBEL_MAX_NOISE_OFFSET))
        return bad(desc, "offset", desc->offset[i], "within -1e9 and 1e9");
    if (!(desc->edge[i] >= 0 && desc->edge[i] <= 0.5)) return bad(desc, "edge", desc->edge[i], "0 to 0.5");
    return NEBEL_OK;
}

static nebel_result check(const nebel_noise_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->allocator))
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "noise: the allocator needs both functions or neither");
    for (int i = 0; i < 3; i++) {
        const nebel_result result = check_axis(desc, i);
        if (result != NEBEL_OK) return result;
    }
    if (desc->octaves < 0 || desc->octaves > MOST_OCTAVES) return bad(desc, "octaves", desc->octaves, "0 to 16");
    if (!(desc->gain >= 0 && desc->gain <= 1)) return bad(desc, "gain", desc->gain, "0 to 1");
    if (!(desc->coverage >= 0 && desc->coverage <= 1)) return bad(desc, "coverage", desc->coverage, "0 to 1");
    if (!(fabs(desc->time) <= NEBEL_MAX_NOISE_OFFSET)) return bad(desc, "time", desc->time, "within -1e9 and 1e9");
    return NEBEL_OK;
}

nebel_result nebel_create_noise(const nebel_noise_desc *desc, nebel_grid **grid)
{
    if (grid != NULL) *grid = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check(desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    const size_t *size = desc->size;
    if (size[0] * size[1] > NEBEL_MAX_NOISE_VOXELS / size[2])
        return nb_fail(&desc->log, NEBEL_ERROR_LIMIT, "noise: %zu x %zu x %zu voxels; at most %d in all", size[0],
                       size[1], size[2], NEBEL_MAX_NOISE_VOXELS);
    uint16_t *voxels = nb_allocate(&allocator, size[0] * size[1] * size[2], sizeof *voxels);
    if (voxels == NULL) return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "noise: out of memory");
    fill(desc, voxels);
    result = nebel_create_grid(&(nebel_grid_desc){.allocator = desc->allocator,
                                                  .log = desc->log,
                                                  .size = {size[0], size[1], size[2]},
                                                  .type = NEBEL_VOXEL_UINT16,
                                                  .voxels = voxels,
                                                  .name = desc->name},
                               grid);
    nb_release(&allocator, voxels);
    return result;
}
