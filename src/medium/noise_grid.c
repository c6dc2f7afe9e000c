/* Noise as voxels: simplex noise of several octaves, whose gradients turn in time. Source: Perlin, Noise Hardware, 2001;
 * Gustavson, Simplex Noise Demystified, 2005. Blobs are round and lie on a lattice whose neighbours are equally far
 * apart, and each octave's is turned: no axis shows. */
#include "base/base.h"
#include "math/hash.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_OCTAVES = 16, CACHED_POINTS = 1 << 13 };

/* Lattice lengths to a cell: so the wave that an octave has most of is two cells long, as in a lattice of cells whose
 * values are interpolated. */
static const double fineness = 0.48;

/* ---- gradients ------------------------------------------------------------------------------- */

/* The sum of four bytes is nearly normal, and three such numbers make a vector that likes no direction. Never 0. */
static double pick_number(uint32_t *hash)
{
    *hash = nb_mix_bits(*hash + 1);
    const uint32_t sum = (*hash & 255) + (*hash >> 8 & 255) + (*hash >> 16 & 255) + (*hash >> 24);
    return (double)sum - 509.5;
}

/* Of unit length. */
static void pick_direction(uint32_t hash, double direction[3])
{
    double square = 0;
    for (int i = 0; i < 3; i++) {
        direction[i] = pick_number(&hash);
        square += direction[i] * direction[i];
    }
    for (int i = 0; i < 3; i++) direction[i] /= sqrt(square);
}

/* The gradient at a lattice point: it goes from one direction to the next in a unit of time, and turns at another moment
 * than its neighbours. At most 1 long. */
static void find_gradient(uint32_t hash, double time, double gradient[3])
{
    double from[3], to[3], square = 0;
    const double moment = time + (double)hash * 0x1p-32, low = floor(moment), u = moment - low;
    const double share = u * u * u * (u * (u * 6 - 15) + 10), kept = sqrt(1 - share), new = sqrt(share);
    const uint32_t turn = (uint32_t)(int64_t)low;
    pick_direction(nb_mix_bits(hash + turn), from);
    pick_direction(nb_mix_bits(hash + turn + 1), to);
    for (int i = 0; i < 3; i++) {
        gradient[i] = kept * from[i] + new *to[i];
        square += gradient[i] * gradient[i];
    }
    /* Opposite ones pass by 0, where no direction is. */
    const double length = fmax(sqrt(square), 0.5);
    for (int i = 0; i < 3; i++) gradient[i] /= length;
}

/* A lattice point that was asked before. */
typedef struct point {
    uint32_t seed; /* of the octave; 0: none */
    uint32_t cell[3];
    double gradient[3];
} point;

/* An octave's way from cells of the first one to its lattice. */
typedef struct octave {
    uint32_t seed; /* not 0 */
    double scale, weight, turn[3][3], shift[3];
} octave;

static const double *gradient_at(point *points, const octave *o, const uint32_t cell[3], double time)
{
    uint32_t hash = o->seed;
    for (int i = 0; i < 3; i++) hash = nb_mix_bits(hash + cell[i]);
    point *at = &points[hash % CACHED_POINTS];
    if (at->seed == o->seed && memcmp(at->cell, cell, sizeof at->cell) == 0) return at->gradient;
    at->seed = o->seed;
    memcpy(at->cell, cell, sizeof at->cell);
    find_gradient(hash, time * o->scale, at->gradient);
    return at->gradient;
}

/* ---- simplices ------------------------------------------------------------------------------- */

/* The corners of the simplex around a place are reached from the lowest by a step along each axis, the one first along
 * which the place lies farthest. */
static void sort_axes(const double v[3], int axes[3])
{
    axes[0] = v[0] >= v[1] ? (v[0] >= v[2] ? 0 : 2) : (v[1] >= v[2] ? 1 : 2);
    axes[2] = v[0] < v[1] ? (v[0] < v[2] ? 0 : 2) : (v[1] < v[2] ? 1 : 2);
    axes[1] = 3 - axes[0] - axes[2];
}

/* -1 to 1 at a place of the octave's lattice: 107.66 is one over the largest sum of all corners' parts. */
static double simplex_noise(point *points, const octave *o, const double place[3], double time)
{
    double from[3], sum = 0;
    uint32_t cell[3];
    int axes[3];
    const double skew = (place[0] + place[1] + place[2]) / 3;
    double low[3];
    for (int i = 0; i < 3; i++) low[i] = floor(place[i] + skew);
    const double back = (low[0] + low[1] + low[2]) / 6;
    for (int i = 0; i < 3; i++) {
        from[i] = place[i] - (low[i] - back);
        cell[i] = (uint32_t)(int64_t)low[i];
    }
    sort_axes(from, axes);
    for (int corner = 0; corner < 4; corner++) {
        if (corner > 0) {
            cell[axes[corner - 1]]++;
            from[axes[corner - 1]] -= 1;
            for (int i = 0; i < 3; i++) from[i] += 1. / 6;
        }
        const double near = 0.5 - (from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
        if (near <= 0) continue;
        const double *g = gradient_at(points, o, cell, time);
        sum += near * near * near * near * (g[0] * from[0] + g[1] * from[1] + g[2] * from[2]);
    }
    return 107.66 * sum;
}

/* ---- octaves --------------------------------------------------------------------------------- */

/* Octaves whose cells are at least two voxels wide. */
static int octaves_in(const nebel_noise_desc *desc)
{
    const int wanted = desc->octaves == 0 ? 1 : desc->octaves;
    int count = 1;
    for (double scale = 2; count < wanted; count++, scale *= 2)
        for (int i = 0; i < 3; i++)
            if (2 * desc->frequency[i] * scale > (double)desc->size[i]) return count;
    return count;
}

/* A turn by 86 degrees about (1, 2, 3): the quaternion (1, 2, 3, 4) in whole numbers. */
static void turn_further(const octave *last, octave *o)
{
    static const double turn[3][3] = {{4, -20, 22}, {28, 10, 4}, {-10, 20, 20}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += turn[i][k] * (last != NULL ? last->turn[k][j] : (double)(k == j));
            o->turn[i][j] = sum / 30;
        }
}

static int start_octaves(const nebel_noise_desc *desc, octave octaves[MOST_OCTAVES])
{
    const int count = octaves_in(desc);
    double scale = 1, weight = 1, all = 0;
    for (int i = 0; i < count; i++) {
        octave *o = &octaves[i];
        *o = (octave){.seed = nb_mix_bits(desc->seed + (uint32_t)i) | 1, .scale = scale, .weight = weight};
        turn_further(i > 0 ? o - 1 : NULL, o);
        for (uint32_t k = 0; k < 3; k++) o->shift[k] = (double)nb_mix_bits(o->seed + k) * 0x1p-32;
        all += weight;
        weight *= desc->gain == 0 ? 0.5 : desc->gain;
        scale *= 2;
    }
    for (int i = 0; i < count; i++) octaves[i].weight /= all;
    return count;
}

/* The place in parts of the box, 0 to 1. */
static double sum_octaves(const nebel_noise_desc *desc, point *points, const octave *octaves, int count,
                          const double place[3])
{
    double sum = 0, cells[3];
    for (int i = 0; i < 3; i++) cells[i] = place[i] * desc->frequency[i] - desc->offset[i];
    for (const octave *o = octaves; o < octaves + count; o++) {
        double at[3];
        for (int i = 0; i < 3; i++)
            at[i] =
                (o->turn[i][0] * cells[0] + o->turn[i][1] * cells[1] + o->turn[i][2] * cells[2]) * o->scale * fineness +
                o->shift[i];
        sum += o->weight * simplex_noise(points, o, at, desc->time);
    }
    return 0.5 + 0.5 * sum;
}

/* 0 on the faces of the box, 1 from `edge` within. */
static double fade(const nebel_noise_desc *desc, const double place[3])
{
    double all = 1;
    for (int i = 0; i < 3; i++) {
        const double depth = fmin(place[i], 1 - place[i]);
        const double u = depth < desc->falloff[i] ? depth / desc->falloff[i] : 1;
        all *= u * u * (3 - 2 * u);
    }
    return all;
}

static void fill(const nebel_noise_desc *desc, point *points, uint16_t *voxels)
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
                const double above = (sum_octaves(desc, points, octaves, count, place) - (1 - coverage)) / coverage;
                *voxels++ = (uint16_t)(fmin(fmax(above, 0), 1) * fade(desc, place) * UINT16_MAX + 0.5);
            }
}

static nebel_result bad_noise(const nebel_noise_desc *desc, const char *what, double value, const char *range)
{
    return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "noise: %s is %g; must be %s", what, value, range);
}

static nebel_result check_noise_axis(const nebel_noise_desc *desc, int i)
{
    if (desc->size[i] < 1 || desc->size[i] > NEBEL_MAX_GRID_SIZE)
        return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT,
                       "noise: %zu x %zu x %zu voxels; must be 1 to %d on each axis", desc->size[0], desc->size[1],
                       desc->size[2], NEBEL_MAX_GRID_SIZE);
    if (!(desc->frequency[i] > 0 && 2 * desc->frequency[i] <= (double)desc->size[i]))
        return bad_noise(desc, "cells", desc->frequency[i], "more than 0, and of two voxels each at least");
    if (!(fabs(desc->offset[i]) <= NEBEL_MAX_NOISE_OFFSET))
        return bad_noise(desc, "offset", desc->offset[i], "within -1e9 and 1e9");
    if (!(desc->falloff[i] >= 0 && desc->falloff[i] <= 0.5))
        return bad_noise(desc, "edge", desc->falloff[i], "0 to 0.5");
    return NEBEL_OK;
}

static nebel_result check(const nebel_noise_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "noise: the allocator needs both functions or neither");
    for (int i = 0; i < 3; i++) {
        const nebel_result result = check_noise_axis(desc, i);
        if (result != NEBEL_OK) return result;
    }
    if (desc->octaves < 0 || desc->octaves > MOST_OCTAVES) return bad_noise(desc, "octaves", desc->octaves, "0 to 16");
    if (!(desc->gain >= 0 && desc->gain <= 1)) return bad_noise(desc, "gain", desc->gain, "0 to 1");
    if (!(desc->coverage >= 0 && desc->coverage <= 1)) return bad_noise(desc, "coverage", desc->coverage, "0 to 1");
    if (!(fabs(desc->time) <= NEBEL_MAX_NOISE_OFFSET))
        return bad_noise(desc, "time", desc->time, "within -1e9 and 1e9");
    return NEBEL_OK;
}

nebel_result nebel_create_noise_grid(const nebel_noise_desc *desc, nebel_grid **grid)
{
    if (grid != NULL) *grid = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check(desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    const size_t *size = desc->size;
    if (size[0] * size[1] > NEBEL_MAX_NOISE_VOXELS / size[2])
        return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT, "noise: %zu x %zu x %zu voxels; at most %d in all", size[0],
                       size[1], size[2], NEBEL_MAX_NOISE_VOXELS);
    uint16_t *voxels = nb_allocate(&allocator, size[0] * size[1] * size[2], sizeof *voxels);
    point *points = nb_allocate_zero(&allocator, CACHED_POINTS, sizeof *points);
    if (voxels != NULL && points != NULL) fill(desc, points, voxels);
    const int is_filled = voxels != NULL && points != NULL;
    nb_release(&allocator, points);
    if (!is_filled) {
        nb_release(&allocator, voxels);
        return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "noise: out of memory");
    }
    result = nebel_create_grid(&(nebel_grid_desc){.host = desc->host,
                                                  .size = {size[0], size[1], size[2]},
                                                  .type = NEBEL_VOXEL_UINT16,
                                                  .voxels = voxels,
                                                  .name = desc->name},
                               grid);
    nb_release(&allocator, voxels);
    return result;
}
