#include "noise_cloud.h"

#include <math.h>
#include <stdlib.h>

/* A number from 0 to 1 for each point of the lattice: see terrain.c. */
static float lattice(uint32_t x, uint32_t y, uint32_t z, uint32_t octave)
{
    uint32_t bits = x * 0x9e3779b1u ^ y * 0x27d4eb2fu ^ z * 0x85ebca77u ^ octave * 0xc2b2ae3du;
    bits = (bits ^ bits >> 15) * 0x2c1b3c6du;
    bits = (bits ^ bits >> 12) * 0x297a2d39u;
    return (float)((bits ^ bits >> 15) >> 8) * 0x1p-24f;
}

static float blend(float a, float b, float t)
{
    return a + (b - a) * (t * t * (3 - 2 * t));
}

static float value_noise(float x, float y, float z, uint32_t octave)
{
    const float low[3] = {floorf(x), floorf(y), floorf(z)};
    const uint32_t i = (uint32_t)low[0], j = (uint32_t)low[1], k = (uint32_t)low[2];
    float edge[4];
    for (uint32_t n = 0; n < 4; n++) {
        const uint32_t b = j + (n & 1), c = k + (n >> 1);
        edge[n] = blend(lattice(i, b, c, octave), lattice(i + 1, b, c, octave), x - low[0]);
    }
    return blend(blend(edge[0], edge[1], y - low[1]), blend(edge[2], edge[3], y - low[1]), z - low[2]);
}

static float fractal(float x, float y, float z)
{
    float sum = 0, amplitude = 1, frequency = 4;
    for (uint32_t octave = 0; octave < 5; octave++) {
        sum += amplitude * value_noise(x * frequency, y * frequency, z * frequency, octave);
        amplitude *= .5f;
        frequency *= 2;
    }
    return sum;
}

/* Thinner towards the rim of the ball, where nothing is left. */
static float density_at(float x, float y, float z)
{
    const float dx = 2 * x - 1, dy = 2 * y - 1, dz = 2 * z - 1, square = dx * dx + dy * dy + dz * dz;
    const float density = 4 * (fractal(x, y, z) - 1.7f * square);
    return fminf(fmaxf(density, 0), 1);
}

nebel_grid *nb_cloud_make(void)
{
    const nebel_grid_desc desc = {
        .size = {NB_CLOUD_SIDE, NB_CLOUD_SIDE, NB_CLOUD_SIDE}, .type = NEBEL_VOXEL_UINT8, .name = "cloud"};
    uint8_t *const voxels = malloc((size_t)NB_CLOUD_SIDE * NB_CLOUD_SIDE * NB_CLOUD_SIDE), *voxel = voxels;
    nebel_grid *grid = NULL;
    const float step = 1 / (float)NB_CLOUD_SIDE;
    for (int z = 0; z < NB_CLOUD_SIDE && voxels != NULL; z++)
        for (int y = 0; y < NB_CLOUD_SIDE; y++)
            for (int x = 0; x < NB_CLOUD_SIDE; x++)
                *voxel++ = (uint8_t)lrintf(
                    255 * density_at(((float)x + .5f) * step, ((float)y + .5f) * step, ((float)z + .5f) * step));
    nebel_grid_desc made = desc;
    made.voxels = voxels;
    if (voxels != NULL) (void)nebel_create_grid(&made, &grid);
    free(voxels);
    return grid;
}
