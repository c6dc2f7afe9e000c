#include "medium_light.h"

#include "medium/density.h"
#include "snapshot.h"

#include <math.h>

static void light_medium(const nb_medium *medium, const double ambient[3], const double irradiance[3], int has_lights,
                         nb_medium_light *lit)
{
    const nb_volume *v = &medium->body;
    for (int c = 0; c < 3; c++) {
        lit->radiance[c] = v->lit ? v->albedo[c] * ambient[c] : v->source[c];
        lit->light[c] = lit->radiance[c] * v->extinction[c] + v->emission[c];
        lit->brightest = fmax(lit->brightest, lit->light[c]);
        lit->shine[c] = v->albedo[c] * irradiance[c];
        lit->scatters_sun = lit->scatters_sun || lit->shine[c] * v->extinction[c] > 0;
        lit->scatters_lights = lit->scatters_lights || (has_lights && v->albedo[c] * v->extinction[c] > 0);
    }
    lit->brightest *= nb_density_peak(&v->density);
}

static int may_join(const nb_medium *medium, const nb_medium_light *lit)
{
    const nb_volume *v = &medium->body;
    return v->operation == NEBEL_OPERATION_ADD && v->density.type == NEBEL_DENSITY_CONSTANT && v->leaf_count == 1 &&
           !medium->emits && !lit->scatters_sun && !lit->scatters_lights && lit->environment == NULL;
}

void nb_join_media(nebel_lighting *lighting)
{
    const nebel_snapshot *s = lighting->snapshot;
    size_t counted = 0;
    for (size_t i = 0; i < s->medium_count; i++) {
        const nb_medium *medium = &s->media[i];
        if (i > 0 && medium->body.rank != s->media[i - 1].body.rank) counted = 0;
        if (!may_join(medium, &lighting->media[i]) || ++counted <= lighting->joining_count) continue;
        lighting->joining_count = counted;
        lighting->joining = medium;
    }
    for (size_t i = 0; i < s->medium_count; i++) {
        nb_medium_light *lit = &lighting->media[i];
        lit->joins = may_join(&s->media[i], lit) && s->media[i].body.rank == lighting->joining->body.rank;
    }
}

void nb_light_media(nebel_lighting *lighting, const double ambient[3], const double irradiance[3])
{
    const nebel_snapshot *s = lighting->snapshot;
    for (size_t i = 0; i < s->medium_count; i++) {
        nb_medium_light *lit = &lighting->media[i];
        light_medium(&s->media[i], ambient, irradiance, lighting->light_count > 0, lit);
        lighting->scatters_sun = lighting->scatters_sun || lit->scatters_sun;
        lighting->scatters_lights = lighting->scatters_lights || lit->scatters_lights;
        for (int c = 0; c < 3; c++) lighting->largest_radiance = fmax(lighting->largest_radiance, lit->radiance[c]);
    }
}

const nebel_lighting *nb_lighting_of(const nebel_snapshot *snapshot, const nebel_lighting *lighting)
{
    if (lighting == NULL) return &snapshot->unlit;
    if (lighting->snapshot == snapshot) return lighting;
    (void)nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "lighting: must be of the snapshot that is asked");
    return NULL;
}
