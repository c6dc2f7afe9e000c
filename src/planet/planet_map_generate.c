/* Maps that are made: clouds and ground as noise on the ball in space, detail as noise that repeats. Perlin's noise
 * (Improving Noise, 2002), with directions by hash. */
#include "base/base.h"
#include "math/hash.h"
#include "planet_map.h"

#include <math.h>

#define PI 3.14159265358979323846

enum { OCTAVES = 7 };

/* ---- noise ----------------------------------------------------------------------------------- */

/* What the corner's direction makes of the way from there. Its middles of the twelve edges of a cube. */
static double slope(uint32_t hash, const double way[3])
{
    static const double directions[12][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                             {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1}};
    const double *d = directions[hash % 12];
    return d[0] * way[0] + d[1] * way[1] + d[2] * way[2];
}

static uint32_t cell_of(double low, uint32_t period)
{
    const int64_t cell = (int64_t)low;
    if (period == 0) return (uint32_t)cell;
    const int64_t rest = cell % (int64_t)period;
    return (uint32_t)(rest < 0 ? rest + (int64_t)period : rest);
}

/* About -1 to 1, 0 in the mean. It repeats after `period` cells along x and half as many along y and z; 0: nowhere. */
static double gradient_noise(uint32_t seed, const double place[3], uint32_t period)
{
    double share[3], way[3][2], values[8];
    uint32_t hashes[8] = {seed}; /* of a corner: axis by axis, so that those that differ in later ones share the work */
    for (int i = 0; i < 3; i++) {
        const double low = floor(place[i]), u = place[i] - low;
        const uint32_t repeat = i == 0 ? period : period / 2,
                       cells[2] = {cell_of(low, repeat), cell_of(low + 1, repeat)};
        way[i][0] = u;
        way[i][1] = u - 1;
        share[i] = u * u * u * (u * (u * 6 - 15) + 10);
        for (int corner = 0; corner < 1 << i; corner++) {
            hashes[corner + (1 << i)] = nb_mix_bits(hashes[corner] + cells[1]);
            hashes[corner] = nb_mix_bits(hashes[corner] + cells[0]);
        }
    }
    for (int corner = 0; corner < 8; corner++) {
        const double from[3] = {way[0][corner & 1], way[1][corner >> 1 & 1], way[2][corner >> 2]};
        values[corner] = slope(hashes[corner], from);
    }
    for (int i = 0, count = 4; i < 3; i++, count /= 2)
        for (int k = 0; k < count; k++) values[k] = values[2 * k] + share[i] * (values[2 * k + 1] - values[2 * k]);
    return values[0];
}

/* Octaves, each twice as fine and `gain` times as strong, turned against the one before where nothing repeats, so that no
 * two lattices lie alike. */
static double sum_octaves(uint32_t seed, const double place[3], uint32_t period, int octaves, double gain)
{
    double p[3] = {place[0], place[1], place[2]}, sum = 0, weight = 1;
    for (int i = 0; i < octaves; i++) {
        sum += weight * gradient_noise(nb_mix_bits(seed + (uint32_t)i), p, period << i);
        weight *= gain;
        const double x = p[0], y = p[1], z = p[2];
        /* a turn by the angles of (3, 4, 5) about z, and then about x */
        const double turned[3] = {0.6 * x - 0.8 * y, 0.48 * x + 0.36 * y - 0.8 * z, 0.64 * x + 0.48 * y + 0.6 * z};
        for (int k = 0; k < 3; k++) p[k] = 2 * (period > 0 ? p[k] : turned[k]);
    }
    return sum;
}

/* ---- painting -------------------------------------------------------------------------------- */

static double smooth(double low, double high, double x)
{
    const double u = fmin(fmax((x - low) / (high - low), 0), 1);
    return u * u * (3 - 2 * u);
}

/* Where `part` of a bell of the deviation that sum_octaves has lies above; by the logistic curve, which is close. */
static double level_of(double part)
{
    const double p = fmin(fmax(part, 1e-3), 1 - 1e-3);
    return 0.28 * 0.588 * log((1 - p) / p);
}

/* Weather turns: places are read where others noise has moved them from. */
static void drift(uint32_t seed, double by, const double place[3], double out[3])
{
    for (uint32_t i = 0; i < 3; i++)
        out[i] = place[i] + by * sum_octaves(nb_mix_bits(seed ^ 0x51ed270bu) + 16 * (i + 1), place, 0, 4, 0.55);
}

static double paint_cloud(const nebel_planet_map_desc *desc, const double unit[3])
{
    double place[3], moved[3];
    /* flat whirls: bands along the latitudes are wider than high */
    for (int i = 0; i < 3; i++) place[i] = unit[i] * (i == 1 ? 3.2 : 2.2);
    drift(desc->seed, 0.7, place, moved);
    const double n = sum_octaves(desc->seed, moved, 0, OCTAVES, 0.58), edge = level_of(desc->coverage);
    return smooth(edge - 0.02, edge + 0.5, n);
}

static double paint_detail(const nebel_planet_map_desc *desc, double u, double v)
{
    enum { PERIOD = 12 }; /* twice as many cells across as down: around a ball it is twice as far */
    const double place[3] = {u * PERIOD, v * PERIOD / 2, 0.5};
    const double n = sum_octaves(desc->seed, place, PERIOD, 6, 0.6), edge = level_of(desc->coverage);
    return smooth(edge - 0.05, edge + 0.7, n);
}

static void mix(const double a[3], const double b[3], double share, double out[3])
{
    for (int c = 0; c < 3; c++) out[c] = a[c] + share * (b[c] - a[c]);
}

/* Seas by depth, land from forest over steppe to rock, ice about the poles and on heights. */
static void paint_ground(const nebel_planet_map_desc *desc, const double unit[3], double color[3])
{
    static const double deep[3] = {0.010, 0.035, 0.11}, shelf[3] = {0.03, 0.13, 0.21}, forest[3] = {0.045, 0.09, 0.03},
                        steppe[3] = {0.33, 0.25, 0.13}, rock[3] = {0.23, 0.18, 0.14}, ice[3] = {0.85, 0.88, 0.92};
    double place[3], moved[3], land[3], sea[3];
    for (int i = 0; i < 3; i++) place[i] = unit[i] * 1.4;
    drift(desc->seed, 0.35, place, moved);
    const double height = sum_octaves(desc->seed, moved, 0, OCTAVES, 0.52) - level_of(desc->coverage);
    const double dry = sum_octaves(nb_mix_bits(desc->seed + 77), moved, 0, 5, 0.5), north = fabs(unit[1]);
    mix(shelf, deep, smooth(0, 0.18, -height), sea);
    mix(forest, steppe, smooth(-0.15, 0.25, dry + 0.35 * smooth(0.75, 0.35, north) - 0.2), land);
    mix(land, rock, smooth(0.12, 0.4, height), land);
    mix(sea, land, smooth(-0.004, 0.004, height), color);
    mix(color, ice, smooth(0.90, 0.95, north + 0.1 * dry + 0.1 * fmax(height, 0)), color);
}

/* The direction of a texel's middle on the ball. */
static void unit_at(double u, double v, double unit[3])
{
    const double longitude = 2 * PI * u, latitude = PI * (0.5 - v);
    unit[0] = -cos(latitude) * cos(longitude);
    unit[1] = sin(latitude);
    unit[2] = cos(latitude) * sin(longitude);
}

static void paint(const nebel_planet_map_desc *desc, double u, double v, double *color)
{
    double unit[3];
    unit_at(u, v, unit);
    switch (desc->type) {
    case NEBEL_PLANET_MAP_DETAIL:
        color[0] = paint_detail(desc, u, v);
        break;
    case NEBEL_PLANET_MAP_GROUND:
        paint_ground(desc, unit, color);
        break;
    default:
        color[0] = paint_cloud(desc, unit);
        break;
    }
}

/* ---- the face -------------------------------------------------------------------------------- */

static nebel_planet_map_desc resolve(const nebel_planet_map_desc *desc)
{
    nebel_planet_map_desc whole = *desc;
    if (whole.height == 0) whole.height = 512;
    if (whole.width == 0) whole.width = 1024;
    if (whole.coverage == 0) whole.coverage = 0.5;
    return whole;
}

static const char *find_fault(const nebel_planet_map_desc *desc)
{
    if (!((int)desc->type >= 0 && desc->type < NEBEL_PLANET_MAP_TYPE_COUNT)) return "kind is unknown";
    if (desc->width > NEBEL_MAX_PLANET_MAP_SIZE || desc->height > NEBEL_MAX_PLANET_MAP_SIZE)
        return "width and height: must be at most 16384";
    if (!(desc->coverage >= 0 && desc->coverage <= 1)) return "coverage: must be within 0 and 1";
    return NULL;
}

nebel_result nebel_get_planet_map_size(const nebel_planet_map_desc *desc, nebel_planet_map *map)
{
    if (desc == NULL || map == NULL) return NEBEL_ERROR_ARGUMENT;
    const char *fault = find_fault(desc);
    if (fault != NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "map: %s", fault);
    const nebel_planet_map_desc whole = resolve(desc);
    map->width = whole.width;
    map->height = whole.height;
    map->channels = whole.type == NEBEL_PLANET_MAP_GROUND ? 3 : 1;
    return NEBEL_OK;
}

nebel_result nebel_generate_planet_map(const nebel_planet_map_desc *desc, float *texels)
{
    nebel_planet_map map;
    if (texels == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = nebel_get_planet_map_size(desc, &map);
    if (result != NEBEL_OK) return result;
    const nebel_planet_map_desc whole = resolve(desc);
    for (size_t y = 0; y < map.height; y++) {
        for (size_t x = 0; x < map.width; x++) {
            double color[3];
            paint(&whole, ((double)x + 0.5) / (double)map.width, ((double)y + 0.5) / (double)map.height, color);
            for (int c = 0; c < map.channels; c++) *texels++ = (float)fmin(fmax(color[c], 0), 1);
        }
    }
    return NEBEL_OK;
}
