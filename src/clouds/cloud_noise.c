/* Two kinds of noise, both on periodic lattices: Perlin's gradient noise (Improving Noise, 2002), and Worley noise,
 * three octaves of one minus the distance to the nearest of random points (Worley, A Cellular Texture Basis Function,
 * 1996), tabulated, since finding the nearest takes long. */
#include "cloud_noise.h"

#include "math/hash.h"

#include <math.h>
#include <string.h>

/* ---- gradient noise -------------------------------------------------------------------------- */

static float pick(uint32_t hash)
{
    return (float)nb_mix_bits(hash) * 0x1p-31f - 1;
}

/* Points within a ball, made unit vectors: no side is liked. */
static void fill_directions(float (*directions)[4])
{
    uint32_t hash = 1;
    for (int i = 0; i < NB_CLOUD_DIRECTIONS; hash += 3) {
        const float x = pick(hash), y = pick(hash + 1), z = pick(hash + 2), square = x * x + y * y + z * z;
        if (!(square > 0.01f && square < 1)) continue;
        const float scale = 1 / sqrtf(square);
        directions[i][0] = x * scale;
        directions[i][1] = y * scale;
        directions[i][2] = z * scale;
        directions[i++][3] = 0;
    }
}

typedef struct nb_noise_spot {
    int at[3];
    float part[3];
} nb_noise_spot;

/* The lattice repeats at powers of two. */
static inline nb_noise_spot spot_of(const double place[3], int size)
{
    nb_noise_spot spot;
    for (int i = 0; i < 3; i++) {
        const int64_t toward_zero = (int64_t)place[i], low = toward_zero - (place[i] < (double)toward_zero);
        spot.at[i] = (int)(low & (size - 1));
        spot.part[i] = (float)(place[i] - (double)low);
    }
    return spot;
}

static inline float mix(float a, float b, float part)
{
    return a + part * (b - a);
}

static inline float smooth(float u)
{
    return u * u * u * (u * (u * 6 - 15) + 10);
}

static inline float slope_at(const nb_cloud_noise *noise, int place, float x, float y, float z)
{
    const float *g = noise->directions[noise->turns[place]];
    return g[0] * x + g[1] * y + g[2] * z;
}

float nb_gradient_noise(const nb_cloud_noise *noise, const double place[3])
{
    enum { N = NB_CLOUD_LATTICE };
    const nb_noise_spot spot = spot_of(place, N);
    const int x0 = spot.at[0], x1 = (x0 + 1) & (N - 1);
    const int y0 = spot.at[1] * N, y1 = ((spot.at[1] + 1) & (N - 1)) * N;
    const int z0 = spot.at[2] * N * N, z1 = ((spot.at[2] + 1) & (N - 1)) * N * N;
    const float x = spot.part[0], y = spot.part[1], z = spot.part[2], u = smooth(x), v = smooth(y);
    const float a = mix(slope_at(noise, z0 + y0 + x0, x, y, z), slope_at(noise, z0 + y0 + x1, x - 1, y, z), u);
    const float b = mix(slope_at(noise, z0 + y1 + x0, x, y - 1, z), slope_at(noise, z0 + y1 + x1, x - 1, y - 1, z), u);
    const float c = mix(slope_at(noise, z1 + y0 + x0, x, y, z - 1), slope_at(noise, z1 + y0 + x1, x - 1, y, z - 1), u);
    const float d =
        mix(slope_at(noise, z1 + y1 + x0, x, y - 1, z - 1), slope_at(noise, z1 + y1 + x1, x - 1, y - 1, z - 1), u);
    return mix(mix(a, b, v), mix(c, d, v), smooth(z));
}

/* ---- Worley noise --------------------------------------------------------------------------------- */

enum { MOST_CELLS = 4 * NB_WORLEY_CELLS };

/* One per cell, as parts of it. */
static void set_points(int cells, float (*points)[3])
{
    for (int k = 0; k < cells * cells * cells; k++) {
        const int at[3] = {k % cells, k / cells % cells, k / cells / cells};
        uint32_t hash = (uint32_t)cells;
        for (int i = 0; i < 3; i++) hash = nb_mix_bits(hash + (uint32_t)at[i]);
        for (int i = 0; i < 3; i++) points[k][i] = (float)(hash >> (10 * i) & 1023) / 1024;
    }
}

static float distance_to_point(int cells, const float (*points)[3], const float place[3])
{
    const int low[3] = {(int)place[0], (int)place[1], (int)place[2]};
    float nearest = 4;
    for (int k = 0; k < 27; k++) {
        const int at[3] = {low[0] + k % 3 - 1, low[1] + k / 3 % 3 - 1, low[2] + k / 9 - 1};
        const int last = cells - 1;
        const float *point =
            points[(((at[2] + cells) & last) * cells + ((at[1] + cells) & last)) * cells + ((at[0] + cells) & last)];
        float square = 0;
        for (int i = 0; i < 3; i++) {
            const float aside = (float)at[i] + point[i] - place[i];
            square += aside * aside;
        }
        nearest = square < nearest ? square : nearest;
    }
    return sqrtf(nearest);
}

static void add_worley(int cells, float weight, float *table)
{
    float points[MOST_CELLS * MOST_CELLS * MOST_CELLS][3];
    set_points(cells, points);
    for (int i = 0; i < NB_WORLEY_SIZE * NB_WORLEY_SIZE * NB_WORLEY_SIZE; i++) {
        const int at[3] = {i % NB_WORLEY_SIZE, i / NB_WORLEY_SIZE % NB_WORLEY_SIZE,
                           i / NB_WORLEY_SIZE / NB_WORLEY_SIZE};
        float place[3];
        for (int c = 0; c < 3; c++) place[c] = ((float)at[c] + 0.5f) * (float)cells / NB_WORLEY_SIZE;
        table[i] += weight * (1 - distance_to_point(cells, (const float(*)[3])points, place));
    }
}

static void set_worley(float *table)
{
    enum { COUNT = NB_WORLEY_SIZE * NB_WORLEY_SIZE * NB_WORLEY_SIZE };
    memset(table, 0, COUNT * sizeof *table);
    add_worley(NB_WORLEY_CELLS, 1, table);
    add_worley(2 * NB_WORLEY_CELLS, 0.5f, table);
    add_worley(4 * NB_WORLEY_CELLS, 0.25f, table);
    for (int i = 0; i < COUNT; i++) table[i] = nb_smaller(1, nb_larger(0, table[i] / 1.75f));
}

/* In place. */
static void halve(float *table, int size)
{
    const int half = size / 2;
    for (int z = 0; z < half; z++)
        for (int y = 0; y < half; y++)
            for (int x = 0; x < half; x++) {
                float sum = 0;
                for (int k = 0; k < 8; k++)
                    sum += table[((2 * z + (k >> 2)) * size + 2 * y + (k >> 1 & 1)) * size + 2 * x + (k & 1)];
                table[(z * half + y) * half + x] = sum / 8;
            }
}

static float variance_of(const float *values, int count, double *mean)
{
    double sum = 0, square = 0;
    for (int i = 0; i < count; i++) {
        sum += (double)values[i];
        square += (double)values[i] * (double)values[i];
    }
    *mean = sum / count;
    return (float)(square / count - *mean * *mean);
}

/* Numbers on the far side follow on each side. */
static void surround(const float *table, int size, uint16_t *wider)
{
    const int row = size + 2;
    for (int z = 0; z < row; z++)
        for (int y = 0; y < row; y++)
            for (int x = 0; x < row; x++) {
                const int at[3] = {(x + size - 1) % size, (y + size - 1) % size, (z + size - 1) % size};
                const float value = table[(at[2] * size + at[1]) * size + at[0]];
                wider[(z * row + y) * row + x] = (uint16_t)(NB_MAX_WORLEY * value + 0.5f);
            }
}

static void fill_worley(nb_cloud_noise *noise, float *table)
{
    float all = 0;
    set_worley(table);
    for (int level = 0; level < NB_WORLEY_LEVELS; level++) {
        const int size = NB_WORLEY_SIZE >> level;
        double mean;
        if (level > 0) halve(table, 2 * size);
        surround(table, size, noise->worley + (size_t)noise->worley_starts[level]);
        const float left = variance_of(table, size * size * size, &mean);
        if (level == 0) all = left;
        noise->worley_mean = (float)mean;
        noise->worley_variance[level] = all - left;
    }
}

/* ---- making ---------------------------------------------------------------------------------- */

nebel_result nb_cloud_noise_make(const nebel_allocator *allocator, nb_cloud_noise *noise)
{
    enum { LATTICE_POINTS = NB_CLOUD_LATTICE * NB_CLOUD_LATTICE * NB_CLOUD_LATTICE };
    size_t all = 0;
    for (int level = 0; level < NB_WORLEY_LEVELS; level++) {
        const size_t row = ((size_t)NB_WORLEY_SIZE >> level) + 2;
        noise->worley_starts[level] = (float)all;
        all += row * row * row;
    }
    noise->turns = nb_allocate(allocator, LATTICE_POINTS, 1);
    noise->directions = nb_allocate(allocator, NB_CLOUD_DIRECTIONS, sizeof *noise->directions);
    uint16_t *tables = nb_allocate(allocator, all, sizeof *tables);
    float *table = nb_allocate(allocator, NB_WORLEY_SIZE * NB_WORLEY_SIZE * NB_WORLEY_SIZE, sizeof *table);
    const int is_whole = noise->turns != NULL && noise->directions != NULL && tables != NULL && table != NULL;
    noise->worley = tables;
    if (is_whole) {
        for (uint32_t i = 0; i < LATTICE_POINTS; i++) noise->turns[i] = (uint8_t)(nb_mix_bits(i + 77) >> 13);
        fill_directions(noise->directions);
        fill_worley(noise, table);
    }
    nb_release(allocator, table);
    return is_whole ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

void nb_cloud_noise_free(const nebel_allocator *allocator, nb_cloud_noise *noise)
{
    nb_release(allocator, noise->turns);
    nb_release(allocator, noise->directions);
    nb_release(allocator, noise->worley);
}
