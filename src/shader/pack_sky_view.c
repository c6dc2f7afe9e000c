/* A table of the air of a planet as words, for the rays of one place. */
#include <nebel/shader.h>

#include "texel_layout.h"

#include "atmosphere/sky_view.h"

#include <string.h>

#define MOST_WORDS ((size_t)1 << 24) /* indices are exact floats */

_Static_assert((int)NB_AIR_FALLING == NB_VIEW_FALLING && (int)NB_AIR_RISING == NB_VIEW_RISING &&
                   (int)NB_AIR_SUNS == NB_VIEW_SUNS && NB_MAX_LOBES == 2 && NEBEL_MAX_COMPONENTS == 4,
               "what layout.h says");

/* Where the parts begin, and how many words there are. */
typedef struct nb_air_parts {
    size_t entries, extinction, suns, skies, count;
} nb_air_parts;

static nb_air_parts find_parts(const nebel_sky_view *view)
{
    const size_t levels = (size_t)NB_VIEW_ROWS * ((size_t)view->levels + 1);
    nb_air_parts parts = {.entries = NB_AIR_TEXELS};
    parts.extinction = parts.entries + levels * (size_t)view->columns * ((size_t)view->scatterer_count + 1);
    parts.suns = parts.extinction + levels;
    parts.skies = parts.suns + NB_VIEW_SUNS;
    parts.count = parts.skies + (size_t)view->atmosphere->scatter.suns;
    return parts;
}

static nebel_texel_f32 word_of(const double v[3])
{
    return (nebel_texel_f32){{(float)v[0], (float)v[1], (float)v[2], 0}};
}

static nebel_texel_f32 word_of_four(double a, double b, double c, double d)
{
    return (nebel_texel_f32){{(float)a, (float)b, (float)c, (float)d}};
}

static void pack_lobes(const nebel_sky_view *view, nebel_texel_f32 *words)
{
    for (int i = 0; i < view->scatterer_count; i++) {
        const nb_phase *phase = &view->atmosphere->airs.airs[view->scatterers[i]].phase;
        for (int k = 0; k < phase->lobe_count; k++) {
            const nb_lobe *lobe = &phase->lobes[k];
            words[2 * i + k] = word_of_four(lobe->factor, lobe->alpha, lobe->peak, lobe->slope);
        }
    }
}

static void pack_sky_view_head(const nebel_sky_view *view, const nb_air_parts *parts, nebel_texel_f32 *words)
{
    const nb_elevation_map *o = &view->outlook;
    const nb_scattering_table *scatter = &view->atmosphere->scatter;
    const double steps = (scatter->suns - 1) / (scatter->last_sun - scatter->first_sun);
    memset(words, 0, NB_AIR_TEXELS * sizeof *words);
    words[NB_AIR_ELEVATION_MAP] = word_of_four(o->radius, o->ground, o->thickness, o->height);
    words[NB_AIR_ELEVATION_MAP + 1] = word_of_four(o->dip, o->ratio, o->horizon, o->half_arc);
    words[NB_AIR_AXES] = word_of(view->up);
    words[NB_AIR_AXES + 1] = word_of(view->ahead);
    words[NB_AIR_AXES + 2] = word_of(view->aside);
    words[NB_AIR_SUN] = word_of(view->sun.direction);
    words[NB_AIR_IRRADIANCE] = word_of(view->sun.irradiance);
    words[NB_AIR_SIZES] = word_of_four(view->columns, view->levels, view->scatterer_count, 0);
    words[NB_AIR_PARTS] =
        word_of_four((double)parts->entries, (double)parts->extinction, (double)parts->suns, (double)parts->skies);
    words[NB_AIR_SKIES] = word_of_four(1 / scatter->sun_scale, scatter->first_sun, steps, scatter->suns);
    /* A phase function of no lobes is 0 where its peak is not. */
    for (int i = NB_AIR_LOBES; i < NB_AIR_TEXELS; i++) words[i].v[2] = 1;
    pack_lobes(view, words + NB_AIR_LOBES);
}

static void pack_entries(const nebel_sky_view *view, nebel_texel_f32 *word)
{
    const size_t count = (size_t)NB_VIEW_ROWS * (size_t)view->columns * ((size_t)view->levels + 1);
    for (size_t i = 0; i < count; i++) {
        const float *entry = view->entries + i * (size_t)view->size;
        for (int k = 0; k <= view->scatterer_count; k++, entry += 3)
            *word++ = (nebel_texel_f32){{entry[0], entry[1], entry[2], 0}};
    }
}

static void pack_words(const nebel_sky_view *view, const nb_air_parts *parts, nebel_texel_f32 *words)
{
    const nb_scattering_table *scatter = &view->atmosphere->scatter;
    pack_sky_view_head(view, parts, words);
    pack_entries(view, words + parts->entries);
    for (size_t i = 0; i < parts->suns - parts->extinction; i++)
        words[parts->extinction + i] = word_of(view->extinction[i]);
    for (int i = 0; i < NB_VIEW_SUNS; i++) words[parts->suns + (size_t)i] = word_of(view->sunlight[i]);
    for (int i = 0; i < scatter->suns; i++) words[parts->skies + (size_t)i] = word_of(scatter->ground[i]);
}

nebel_result nebel_pack_sky_view(const nebel_sky_view *view, nebel_texel_f32 *words, size_t capacity, size_t *count)
{
    if (view == NULL || count == NULL || (words == NULL && capacity > 0)) return NEBEL_ERROR_ARGUMENT;
    const nb_air_parts parts = find_parts(view);
    *count = parts.count;
    if (parts.count > MOST_WORDS || (words != NULL && capacity < parts.count)) return NEBEL_ERROR_LIMIT;
    if (words != NULL) pack_words(view, &parts, words);
    return NEBEL_OK;
}
