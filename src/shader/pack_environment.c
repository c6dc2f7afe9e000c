/* Ambient light by direction as words, the same for every eye. Filters come first, in the order of the snapshot's
 * skylights, so that they are where fog expects them whether or not surfaces are asked for. */
#include "pack_environment.h"

#include "texel_layout.h"

#include "light/lighting.h"
#include "light/environment_map.h"

#include <math.h>
#include <string.h>

#define MOST_WORDS ((size_t)1 << 24) /* indices are exact floats */

_Static_assert(NB_FILTER_PIECES == NB_SKY_NODES - 3, "a piece has four nodes");
_Static_assert(NB_ENVIRONMENT_CONSTANT == (int)NEBEL_ENVIRONMENT_CONSTANT &&
                   NB_ENVIRONMENT_GRADIENT == (int)NEBEL_ENVIRONMENT_GRADIENT &&
                   NB_ENVIRONMENT_MAP == (int)NEBEL_ENVIRONMENT_MAP,
               "types are those of the public header");

/* ---- sizes ----------------------------------------------------------------------------------- */

static size_t table_words(const nb_environment_table *table)
{
    return 1 + table->rows * table->columns;
}

static size_t filter_words(const nebel_lighting *lighting, size_t number)
{
    return lighting->environment.type == NEBEL_ENVIRONMENT_MAP
               ? table_words(&lighting->environment_lights[number].filter->table)
               : 1 + NB_FILTER_PIECES;
}

/* The first word of a filter, or behind the last one. */
static size_t filter_place(const nebel_lighting *lighting, size_t number)
{
    size_t place = NB_ENVIRONMENT_TEXELS;
    for (size_t i = 0; i < number; i++) place += filter_words(lighting, i);
    return place;
}

static size_t surface_words(const nebel_environment *sky)
{
    size_t width, height;
    if (sky->type != NEBEL_ENVIRONMENT_MAP) return 0;
    (void)nb_environment_map_pixels(sky->map, &width, &height);
    return table_words(nb_environment_map_reflection(sky->map)) + 1 + width * height;
}

static size_t count_environment_words(const nebel_lighting *lighting, int surfaces)
{
    if (!surfaces && lighting->environment_light_count == 0) return 0;
    return filter_place(lighting, lighting->environment_light_count) +
           (surfaces ? surface_words(&lighting->environment) : 0);
}

static nebel_result check_count(const nebel_lighting *lighting, size_t count)
{
    if (count <= MOST_WORDS) return NEBEL_OK;
    return nb_fail(
        &lighting->log, NEBEL_ERROR_LIMIT,
        "pack: the environment takes %zu words, of which shaders can address %zu; use fewer phase functions, "
        "or nebel_trace or the CPU's renderer (--device cpu)",
        count, MOST_WORDS);
}

nebel_result nb_check_environment(const nebel_lighting *lighting)
{
    return check_count(lighting, count_environment_words(lighting, 0));
}

void nb_place_filters(const nebel_lighting *lighting, nebel_texel_f32 *words)
{
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_environment_light *sky = lighting->media[i].environment;
        if (sky == NULL) continue;
        words[NB_HEADER_TEXELS + i * NB_MEDIUM_TEXELS + NB_MEDIUM_FILTER].v[3] =
            (float)filter_place(lighting, (size_t)(sky - lighting->environment_lights));
    }
}

/* ---- words ----------------------------------------------------------------------------------- */

static nebel_texel_f32 color_word(const double color[3])
{
    return (nebel_texel_f32){{(float)color[0], (float)color[1], (float)color[2], 0}};
}

static void pack_environment_head(const nebel_environment *sky, size_t surfaces, nebel_texel_f32 *words)
{
    const nb_environment_light light = nb_environment_light_of(sky, NULL);
    memset(words, 0, NB_ENVIRONMENT_TEXELS * sizeof *words);
    words[0].v[0] = (float)sky->type;
    switch (sky->type) {
    case NEBEL_ENVIRONMENT_GRADIENT:
        words[1] = color_word(sky->zenith);
        words[2] = color_word(sky->horizon);
        words[3] = color_word(sky->ground);
        break;
    case NEBEL_ENVIRONMENT_MAP:
        words[0].v[1] = (float)light.turn.cosine;
        words[0].v[2] = (float)light.turn.sine;
        words[0].v[3] = sky->intensity > 0 ? (float)sky->intensity : 1;
        if (surfaces == 0) break;
        words[1].v[0] = (float)surfaces;
        words[1].v[1] = (float)(surfaces + table_words(nb_environment_map_reflection(sky->map)));
        break;
    default:
        words[1] = color_word(sky->radiance);
    }
}

/* Returns the word behind it. */
static nebel_texel_f32 *pack_rgb(const float *rgb, size_t columns, size_t rows, nebel_texel_f32 *word)
{
    *word++ = (nebel_texel_f32){{(float)columns, (float)rows, 0, 0}};
    for (size_t i = 0; i < columns * rows; i++, rgb += 3) *word++ = (nebel_texel_f32){{rgb[0], rgb[1], rgb[2], 0}};
    return word;
}

static void pack_gradient_filter(const nb_environment_filter *filter, nebel_texel_f32 *word)
{
    const double steps = (NB_SKY_NODES - 1) / log1p(1 / filter->width);
    *word++ = (nebel_texel_f32){{(float)filter->mean_cosine, (float)(1 / filter->width), (float)steps, 0}};
    for (int i = 0; i < NB_FILTER_PIECES; i++)
        for (int k = 0; k < 4; k++) word[i].v[k] = (float)filter->rectified[i + k];
}

static void pack_filter(const nebel_lighting *lighting, size_t number, nebel_texel_f32 *words)
{
    const nb_environment_filter *filter = lighting->environment_lights[number].filter;
    nebel_texel_f32 *word = &words[filter_place(lighting, number)];
    if (lighting->environment.type == NEBEL_ENVIRONMENT_MAP)
        (void)pack_rgb(filter->table.coefficients, filter->table.columns, filter->table.rows, word);
    else
        pack_gradient_filter(filter, word);
}

static void pack_surfaces(const nebel_environment_map *map, nebel_texel_f32 *word)
{
    size_t width, height;
    const nb_environment_table *table = nb_environment_map_reflection(map);
    const float *pixels = nb_environment_map_pixels(map, &width, &height);
    (void)pack_rgb(pixels, width, height, pack_rgb(table->coefficients, table->columns, table->rows, word));
}

nebel_result nebel_pack_environment(const nebel_lighting *lighting, int surfaces, nebel_texel_f32 *words,
                                    size_t capacity, size_t *count)
{
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    if (count == NULL || (words == NULL && capacity > 0))
        return nb_fail(&lighting->log, NEBEL_ERROR_ARGUMENT, "pack: words and count must not be NULL");
    const nebel_result result = check_count(lighting, count_environment_words(lighting, surfaces));
    if (result != NEBEL_OK) return result;
    *count = count_environment_words(lighting, surfaces);
    if (words == NULL || *count == 0) return NEBEL_OK;
    if (capacity < *count)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                       "pack: %zu words of the environment are needed, there is room for %zu", *count, capacity);
    const size_t behind = filter_place(lighting, lighting->environment_light_count);
    const int is_map = lighting->environment.type == NEBEL_ENVIRONMENT_MAP;
    pack_environment_head(&lighting->environment, surfaces && is_map ? behind : 0, words);
    for (size_t i = 0; i < lighting->environment_light_count; i++) pack_filter(lighting, i, words);
    if (surfaces && is_map) pack_surfaces(lighting->environment.map, &words[behind]);
    return NEBEL_OK;
}

/* ---- changes --------------------------------------------------------------------------------- */

static int is_same_color(const double a[3], const double b[3])
{
    return memcmp(a, b, 3 * sizeof *a) == 0;
}

static int is_same_sky(const nebel_environment *a, const nebel_environment *b)
{
    if (a->type != b->type) return 0;
    switch (a->type) {
    case NEBEL_ENVIRONMENT_GRADIENT:
        return is_same_color(a->zenith, b->zenith) && is_same_color(a->horizon, b->horizon) &&
               is_same_color(a->ground, b->ground);
    case NEBEL_ENVIRONMENT_MAP:
        return a->map == b->map && memcmp(&a->rotation, &b->rotation, sizeof a->rotation) == 0 &&
               memcmp(&a->intensity, &b->intensity, sizeof a->intensity) == 0;
    default:
        return is_same_color(a->radiance, b->radiance);
    }
}

int nebel_is_same_environment(const nebel_lighting *a, const nebel_lighting *b)
{
    if (a == NULL || b == NULL) return a == b;
    int same =
        a->environment_light_count == b->environment_light_count && is_same_sky(&a->environment, &b->environment);
    for (size_t i = 0; i < a->environment_light_count && same; i++)
        same = nb_phase_compare(nb_environment_filter_phase(a->environment_lights[i].filter),
                                nb_environment_filter_phase(b->environment_lights[i].filter)) == 0;
    return same;
}
