#include "terrain.h"

#include <math.h>
#include <stdlib.h>

/* A number from 0 to 1 for each point of the lattice. Multiplications and shifts that let every bit of the input reach
 * every bit of the result. */
static float lattice(uint32_t x, uint32_t z, uint32_t octave)
{
    uint32_t bits = x * 0x9e3779b1u ^ z * 0x85ebca77u ^ octave * 0xc2b2ae3du;
    bits = (bits ^ bits >> 15) * 0x2c1b3c6du;
    bits = (bits ^ bits >> 12) * 0x297a2d39u;
    return (float)((bits ^ bits >> 15) >> 8) * 0x1p-24f;
}

static float blend(float a, float b, float t)
{
    return a + (b - a) * (t * t * (3 - 2 * t));
}

static float value_noise(float x, float z, uint32_t octave)
{
    const float x0 = floorf(x), z0 = floorf(z);
    const uint32_t i = (uint32_t)x0, k = (uint32_t)z0;
    const float near = blend(lattice(i, k, octave), lattice(i + 1, k, octave), x - x0);
    const float far = blend(lattice(i, k + 1, octave), lattice(i + 1, k + 1, octave), x - x0);
    return blend(near, far, z - z0);
}

/* x and z from 0 to 1. */
static float fractal(float x, float z)
{
    float sum = 0, amplitude = 1, frequency = 4;
    for (uint32_t octave = 0; octave < 7; octave++) {
        sum += amplitude * value_noise(x * frequency, z * frequency, octave);
        amplitude *= .5f;
        frequency *= 2;
    }
    return sum;
}

static void set_positions(uint32_t quads, nb_terrain *terrain)
{
    const float lowest = -2, highest = 12, width = 100;
    float low = INFINITY, high = -INFINITY;
    float *p = terrain->positions;
    for (uint32_t row = 0; row <= quads; row++) {
        for (uint32_t column = 0; column <= quads; column++, p += 3) {
            const float x = (float)column / (float)quads, z = (float)row / (float)quads;
            p[0] = (x - .5f) * width;
            p[1] = fractal(x, z);
            p[2] = (z - .5f) * width;
            low = fminf(low, p[1]);
            high = fmaxf(high, p[1]);
        }
    }
    const float scale = (highest - lowest) / (high - low);
    for (uint32_t v = 0; v < terrain->vertex_count; v++) {
        terrain->positions[3 * (size_t)v + 1] = lowest + (terrain->positions[3 * (size_t)v + 1] - low) * scale;
    }
}

static void set_indices(uint32_t quads, nb_terrain *terrain)
{
    uint32_t *index = terrain->indices;
    for (uint32_t row = 0; row < quads; row++) {
        for (uint32_t column = 0; column < quads; column++, index += 6) {
            const uint32_t a = row * (quads + 1) + column, b = a + 1, c = a + quads + 1, d = c + 1;
            index[0] = index[3] = a;
            index[1] = c;
            index[2] = index[4] = d;
            index[5] = b;
        }
    }
}

int nb_terrain_make(uint32_t quads, nb_terrain *terrain)
{
    *terrain = (nb_terrain){.vertex_count = (quads + 1) * (quads + 1), .triangle_count = 2 * quads * quads};
    terrain->positions = malloc(3 * sizeof(float) * terrain->vertex_count);
    terrain->indices = malloc(3 * sizeof(uint32_t) * terrain->triangle_count);
    if (terrain->positions == NULL || terrain->indices == NULL) {
        nb_terrain_free(terrain);
        return -1;
    }
    set_positions(quads, terrain);
    set_indices(quads, terrain);
    return 0;
}

void nb_terrain_free(nb_terrain *terrain)
{
    free(terrain->positions);
    free(terrain->indices);
    *terrain = (nb_terrain){0};
}
