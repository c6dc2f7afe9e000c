/* Voxels as they are stored, for those who make and those who walk through them. */
#ifndef NB_MEDIUM_GRID_VOXELS_H
#define NB_MEDIUM_GRID_VOXELS_H

#include "grid.h"

#include <stdatomic.h>
#include <stddef.h>

/* Cells of a brick along an axis. Bricks whose voxels are all equal are passed in one step. */
enum { BRICK_SHIFT = 3, BRICK = 1 << BRICK_SHIFT };

/* The least and the largest voxel that any cell of a brick needs, as stored. */
typedef struct brick {
    double least, most;
} brick;

struct nebel_grid {
    nebel_allocator allocator;
    atomic_size_t owners;
    int size[3]; /* voxels */
    size_t stride[3];
    int cells[3]; /* for the filter */
    int bricks[3];
    size_t uneven_bricks; /* whose voxels are not all equal */
    nebel_voxel_type type;
    nebel_grid_filter filter;
    double scale, offset; /* density = offset + scale * voxel, voxels of integers counted from 0 to 1 */
    double least, most;   /* density */
    uint64_t hash;        /* of what is stored */
    size_t bytes;
    void *voxels; /* and room behind for a word that begins in the last one */
    brick *brick;
    uint8_t *clear; /* of each brick: 0 where there is fog, else how many bricks away the nearest fog is, at most 255 */
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

INLINE size_t row_of(const nebel_grid *grid, int y, int z)
{
    return (size_t)z * grid->stride[2] + (size_t)y * grid->stride[1];
}

INLINE double density_of(const nebel_grid *grid, double voxel)
{
    return grid->offset + grid->scale * voxel;
}

#endif
