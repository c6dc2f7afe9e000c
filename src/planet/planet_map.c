#include "planet_map.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/textured_planet.inc"

const char *nb_map_fault(const nebel_planet_map *map, int channels)
{
    if (map->texels == NULL) return map->width > 0 || map->height > 0 ? "has a size, but no texels" : NULL;
    if (map->width < 1 || map->width > NEBEL_MAX_PLANET_MAP_SIZE || map->height < 1 ||
        map->height > NEBEL_MAX_PLANET_MAP_SIZE)
        return "must have 1 to 16384 rows and columns";
    if (map->channels != channels) return channels == 1 ? "must have 1 channel" : "must have 3 channels";
    for (size_t i = 0; i < map->width * map->height * (size_t)channels; i++)
        if (!(map->texels[i] >= 0 && map->texels[i] <= 1)) return "must hold numbers within 0 and 1";
    return NULL;
}

/* ---- levels ---------------------------------------------------------------------------------- */

static size_t half_of(size_t size)
{
    return size > 1 ? size / 2 : 1;
}

/* Texels of the finer level that one of the coarser covers: of odd sizes some in part. */
typedef struct nb_map_span {
    size_t first, last;
    double head, tail; /* parts of the first and of the last */
} nb_map_span;

static nb_map_span span_of(size_t i, size_t coarse, size_t fine)
{
    const double low = (double)(i * fine) / (double)coarse, high = (double)((i + 1) * fine) / (double)coarse;
    const size_t first = (size_t)low, last = (size_t)ceil(high) - 1;
    return (nb_map_span){first, last, (double)(first + 1) - low, high - (double)last};
}

static double part_of(const nb_map_span *span, size_t i)
{
    if (span->first == span->last) return 1;
    if (i == span->first) return span->head;
    return i == span->last ? span->tail : 1;
}

static void halve_texel(const nb_planet_map *map, int level, size_t x, size_t y)
{
    const size_t width = map->width[level - 1], channels = (size_t)map->channels;
    const nb_map_span columns = span_of(x, map->width[level], width);
    const nb_map_span rows = span_of(y, map->height[level], map->height[level - 1]);
    for (size_t c = 0; c < channels; c++) {
        double sum = 0, all = 0;
        for (size_t i = rows.first; i <= rows.last; i++) {
            for (size_t k = columns.first; k <= columns.last; k++) {
                const double part = part_of(&rows, i) * part_of(&columns, k);
                sum += part * (double)map->levels[level - 1][(i * width + k) * channels + c];
                all += part;
            }
        }
        map->levels[level][(y * map->width[level] + x) * channels + c] = (float)(sum / all);
    }
}

static size_t count_texels(const nb_planet_map *map, int level)
{
    return map->width[level] * map->height[level] * (size_t)map->channels;
}

/* Sizes of all levels; their texels in all. */
static size_t set_sizes(const nebel_planet_map *desc, nb_planet_map *map)
{
    map->channels = desc->channels;
    map->width[0] = desc->width;
    map->height[0] = desc->height;
    size_t all = count_texels(map, 0);
    for (map->level_count = 1; map->level_count < NB_MAP_LEVELS; map->level_count++) {
        const int i = map->level_count;
        if (map->width[i - 1] == 1 && map->height[i - 1] == 1) break;
        map->width[i] = half_of(map->width[i - 1]);
        map->height[i] = half_of(map->height[i - 1]);
        all += count_texels(map, i);
    }
    return all;
}

nebel_result nb_planet_map_make(const nebel_allocator *allocator, const nebel_planet_map *desc, nb_planet_map *map)
{
    const size_t all = set_sizes(desc, map);
    float *texels = nb_allocate(allocator, all, sizeof *texels);
    if (texels == NULL) return NEBEL_ERROR_MEMORY;
    for (int i = 0; i < map->level_count; i++) {
        map->levels[i] = texels;
        texels += count_texels(map, i);
    }
    memcpy(map->levels[0], desc->texels, count_texels(map, 0) * sizeof *texels);
    for (int i = 1; i < map->level_count; i++)
        for (size_t y = 0; y < map->height[i]; y++)
            for (size_t x = 0; x < map->width[i]; x++) halve_texel(map, i, x, y);
    return NEBEL_OK;
}

void nb_planet_map_free(const nebel_allocator *allocator, nb_planet_map *map)
{
    nb_release(allocator, map->levels[0]);
    *map = (nb_planet_map){.channels = 0};
}

nebel_planet_map nb_planet_map_level(const nb_planet_map *map, int level)
{
    return (nebel_planet_map){map->width[level], map->height[level], map->channels, map->levels[level]};
}

/* ---- reading --------------------------------------------------------------------------------- */

/* The texels on both sides of a place, and the share of the second. */
typedef struct nb_pair {
    size_t a, b;
    double share;
} nb_pair;

static nb_pair pair_at(double place, size_t size, int repeats)
{
    const double x = repeats ? nb_map_around(place, (double)size) : nb_map_within(place, (double)size), low = floor(x);
    const size_t first = low < 0 ? size - 1 : (size_t)low, next = first + 1 < size ? first + 1 : repeats ? 0 : first;
    return (nb_pair){first, next, x - low};
}

static void read_level(const nb_planet_map *map, int level, double u, double v, int repeats, double *values)
{
    const nb_pair x = pair_at(u, map->width[level], 1), y = pair_at(v, map->height[level], repeats);
    const size_t width = map->width[level], channels = (size_t)map->channels;
    const float *texels = map->levels[level];
    for (size_t c = 0; c < channels; c++) {
        const double aa = (double)texels[(y.a * width + x.a) * channels + c];
        const double ab = (double)texels[(y.a * width + x.b) * channels + c];
        const double ba = (double)texels[(y.b * width + x.a) * channels + c];
        const double bb = (double)texels[(y.b * width + x.b) * channels + c];
        const double above = aa + x.share * (ab - aa), below = ba + x.share * (bb - ba);
        values[c] = above + y.share * (below - above);
    }
}

void nb_planet_map_read(const nb_planet_map *map, double u, double v, double level, int repeats, double *values)
{
    double coarse[3];
    const double most = (double)(map->level_count - 1), at = level > 0 ? fmin(level, most) : 0, low = floor(at);
    read_level(map, (int)low, u, v, repeats, values);
    if (!(at > low)) return;
    read_level(map, (int)low + 1, u, v, repeats, coarse);
    for (int c = 0; c < map->channels; c++) values[c] += (at - low) * (coarse[c] - values[c]);
}
