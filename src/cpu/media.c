#include "media.h"

#include <math.h>
#include <string.h>

/* Places on the ground are so much above it, in radii. */
#define ABOVE_GROUND 1e-11

int nb_media_are_empty(const nb_media *media)
{
    return media->fog == NULL && media->planet_count == 0;
}

static int is_grey(const double rgb[3])
{
    return rgb[0] == rgb[1] && rgb[0] == rgb[2];
}

int nb_media_are_grey(const nb_media *media)
{
    for (int i = 0; i < media->planet_count; i++) {
        const nebel_atmosphere_desc *desc = &media->planets[i].world.planet->atmosphere_desc;
        for (uint32_t k = 0; k < desc->component_count; k++) {
            double extinction[3];
            for (int c = 0; c < 3; c++)
                extinction[c] = desc->components[k].scattering[c] + desc->components[k].absorption[c];
            if (!is_grey(extinction)) return 0;
        }
        if (!nb_planet_medium_is_grey(&media->planets[i])) return 0;
    }
    return media->fog == NULL || nebel_is_extinction_gray(media->fog);
}

/* ---- places ---------------------------------------------------------------------------------- */

static void add_planet(const nb_planet_matter *planet, nebel_medium_properties *all)
{
    const nebel_atmosphere_desc *desc = &planet->medium->world.planet->atmosphere_desc;
    for (int c = 0; c < 3; c++) {
        for (uint32_t k = 0; k < desc->component_count; k++) {
            const double scattering = planet->density[k] * desc->components[k].scattering[c];
            all->scattering[c] += scattering;
            all->extinction[c] += scattering + planet->density[k] * desc->components[k].absorption[c];
        }
        all->scattering[c] += planet->clouds;
        all->extinction[c] += planet->clouds;
    }
}

nebel_result nb_media_look(const nb_media *media, const nebel_sample_point *place, nb_media_part part,
                           nb_matter *matter)
{
    nebel_result result = NEBEL_OK;
    memset(matter, 0, sizeof *matter);
    if (media->fog != NULL)
        result = nebel_sample_medium(media->fog, 1, place, sizeof *place, &matter->all, sizeof matter->all);
    memcpy(matter->fog, matter->all.scattering, sizeof matter->fog);
    for (int i = 0; i < media->planet_count && matter->planet.medium == NULL; i++)
        matter->planet = nb_planet_matter_at(&media->planets[i], place->position, part == NB_MEDIA_ALL);
    if (matter->planet.medium != NULL) add_planet(&matter->planet, &matter->all);
    return result;
}

/* ---- rays ------------------------------------------------------------------------------------ */

void nb_media_walk_start(const nb_media *media, const nebel_ray *ray, int ignore_distances, nb_media_part part,
                         nb_media_walk *walk)
{
    walk->media = media;
    walk->ray = ray;
    walk->ignore_distances = ignore_distances;
    walk->fog = (nebel_majorant_segment){.end = media->fog != NULL ? 0 : HUGE_VAL};
    for (int i = 0; i < media->planet_count; i++)
        nb_planet_walk_start(&media->planets[i], ray, part == NB_MEDIA_ALL, &walk->planets[i]);
}

/* All media of the piece together. */
static void sum_bounds(nb_media_walk *walk)
{
    double others = 0, air = 0;
    walk->end = walk->fog.end;
    for (int c = 0; c < 3; c++) {
        walk->extinction[c] = walk->fog.extinction[c];
        walk->emission[c] = walk->fog.emission[c];
        others += walk->fog.extinction[c] + walk->fog.emission[c];
    }
    for (int i = 0; i < walk->media->planet_count; i++) {
        const nb_planet_walk *planet = &walk->planets[i];
        walk->end = fmin(walk->end, planet->end);
        others += planet->clouds;
        for (int c = 0; c < 3; c++) {
            walk->extinction[c] += planet->clouds + planet->air[c];
            air += planet->air[c];
        }
    }
    walk->is_air = air > 0 && !(others > 0);
}

nebel_result nb_media_walk_to(nb_media_walk *walk, double t)
{
    nebel_result result = NEBEL_OK;
    if (walk->fog.end <= t)
        result = nebel_next_majorant(walk->media->fog, walk->ray, walk->ignore_distances, t, &walk->fog);
    for (int i = 0; i < walk->media->planet_count; i++) nb_planet_walk_to(&walk->planets[i], t);
    sum_bounds(walk);
    return result;
}

double nb_media_air_transmittance(const nb_media *media, const nebel_ray *ray, int channel)
{
    double left = 1;
    for (int i = 0; i < media->planet_count; i++) {
        nebel_transfer transfer;
        memset(&transfer, 0, sizeof transfer);
        /* Rays are in order, so that it cannot fail. */
        (void)nebel_trace_atmosphere(media->planets[i].world.planet->atmosphere, NULL, 1, ray, 0, &transfer, 0);
        left *= (double)transfer.transmittance[channel];
    }
    return left;
}

/* ---- scattering ------------------------------------------------------------------------------ */

static double scattering_part(const double scattering[3], int channel)
{
    return channel >= 0 ? scattering[channel] : scattering[0] + scattering[1] + scattering[2];
}

/* Takes a medium if the chance falls on it, else goes past it. */
static int falls_on(double part, double *chance)
{
    const int is_it = *chance < part;
    if (!is_it) *chance -= part;
    return is_it;
}

static void choose_of_planet(const nb_planet_matter *planet, double all, int channel, double chance,
                             nb_scatterer *scatterer)
{
    const nb_planet_medium *medium = planet->medium;
    const nebel_atmosphere_desc *desc = &medium->world.planet->atmosphere_desc;
    for (uint32_t k = 0; k < desc->component_count; k++) {
        double scattering[3];
        for (int c = 0; c < 3; c++) scattering[c] = planet->density[k] * desc->components[k].scattering[c];
        const double part = scattering_part(scattering, channel);
        if (!(part > 0)) continue;
        /* The last one is kept where rounding leaves some of the chance. */
        *scatterer =
            (nb_scatterer){.phase = desc->components[k].phase, .turns = &medium->airs[k], .probability = part / all};
        memcpy(scatterer->scattering, scattering, sizeof scattering);
        if (falls_on(part, &chance)) return;
    }
    if (!(planet->clouds > 0)) return;
    const double clouds[3] = {planet->clouds, planet->clouds, planet->clouds};
    *scatterer = (nb_scatterer){.turns = &medium->drops[planet->layer][channel >= 0 ? channel : 0],
                                .probability = scattering_part(clouds, channel) / all};
    memcpy(scatterer->scattering, clouds, sizeof clouds);
}

nebel_result nb_media_choose(const nb_media *media, const nebel_sample_point *place, const nb_matter *matter,
                             int channel, double chance, nb_scatterer *scatterer)
{
    const double all = scattering_part(matter->all.scattering, channel), fog = scattering_part(matter->fog, channel);
    memset(scatterer, 0, sizeof *scatterer);
    if (!(all > 0)) return NEBEL_OK;
    double left = chance * all;
    if (matter->planet.medium != NULL && (media->fog == NULL || !falls_on(fog, &left))) {
        choose_of_planet(&matter->planet, all, channel, left, scatterer);
        return NEBEL_OK;
    }
    nebel_scatterer chosen;
    const double within = fog < all ? fmin(left / fog, 1 - 0x1p-53) : chance;
    const nebel_result result = nebel_sample_scatterer(media->fog, place, channel, within, &chosen);
    if (result != NEBEL_OK) return result;
    scatterer->phase = chosen.phase;
    scatterer->probability = chosen.probability * (fog / all);
    memcpy(scatterer->scattering, chosen.scattering, sizeof chosen.scattering);
    return NEBEL_OK;
}

double nb_scatterer_value(const nb_scatterer *scatterer, double cosine)
{
    return scatterer->turns != NULL ? nb_turns_value(scatterer->turns, cosine)
                                    : nebel_evaluate_phase(&scatterer->phase, cosine);
}

/* ---- grounds --------------------------------------------------------------------------------- */

static double up_at(const nb_planet *world, const double place[3], double up[3])
{
    for (int c = 0; c < 3; c++) up[c] = place[c] - world->center[c];
    const double far = nb_vector_length(up);
    for (int c = 0; c < 3; c++) up[c] = far > 0 ? up[c] / far : c == 1;
    return far;
}

/* How far the ground is; HUGE_VAL: it is not met. */
static double ground_at(const nb_planet *world, const nebel_ray *ray)
{
    double up[3];
    const double far = up_at(world, ray->origin, up);
    if (!(far > world->radius)) return nb_vector_dot(up, ray->direction) < 0 ? 0 : HUGE_VAL;
    const double t = nb_planet_ground(world, ray->origin, ray->direction);
    return t > 0 ? t : HUGE_VAL;
}

nb_ground_hit nb_media_find_ground(const nb_media *media, const nebel_ray *ray)
{
    nb_ground_hit hit = {.world = NULL, .t = HUGE_VAL};
    for (int i = 0; i < media->planet_count; i++) {
        const nb_planet *world = &media->planets[i].world;
        const double t = ground_at(world, ray);
        if (!(t < hit.t && t <= ray->t_max)) continue;
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = ray->origin[c] + t * ray->direction[c];
        hit.world = world;
        hit.t = t;
        (void)up_at(world, place, hit.normal);
        for (int c = 0; c < 3; c++)
            hit.place[c] = world->center[c] + (1 + ABOVE_GROUND) * world->radius * hit.normal[c];
    }
    return hit;
}

/* Air counts the sun as a point, and so does the edge of its planet's shadow; the disc is hidden by others. */
double nb_media_sun_left(const nb_media *media, const double place[3], const double to_sun[3], double disc)
{
    const nebel_ray ray = {{place[0], place[1], place[2]}, {to_sun[0], to_sun[1], to_sun[2]}, HUGE_VAL};
    int nearest = 0;
    double left = 1;
    for (int i = 1; i < media->planet_count; i++)
        if (nb_planet_power(&media->planets[i].world, place) < nb_planet_power(&media->planets[nearest].world, place))
            nearest = i;
    for (int i = 0; i < media->planet_count; i++) {
        const nb_planet *world = &media->planets[i].world;
        if (i == nearest)
            left *= ground_at(world, &ray) < HUGE_VAL ? 0 : 1;
        else
            left *= nb_eclipse_left(place, world->center, world->radius, to_sun, disc);
    }
    return left;
}
