/* The lighting of a snapshot, from outside: made, shared, asked. */
#include "diffusion.h"

#include "light/lighting.h"

#include <math.h>

/* ---- light that is scattered more than once -------------------------------------------------- */

/* Fog that is no physics: no light has its shape. */
static nebel_result refuse_unphysical(const nebel_lighting *lighting)
{
    const nebel_snapshot *s = lighting->snapshot;
    if (s->max_opacity < 1)
        return nb_fail(&lighting->log, NEBEL_ERROR_UNSUPPORTED,
                       "max_opacity is no physical fog, and diffusion (multiple scattering) cannot compute its light; "
                       "leave out max_opacity %g, or diffusion",
                       s->max_opacity);
    for (size_t i = 0; i < s->medium_count; i++)
        if (nb_volume_has_distances(&s->media[i].body))
            return nb_fail(&lighting->log, NEBEL_ERROR_UNSUPPORTED,
                           "fog[%zu].start, cutoff: are no physical fog, and diffusion (multiple scattering) cannot "
                           "compute its light; leave out both, or diffusion",
                           s->media[i].slot);
    return NEBEL_OK;
}

static nebel_result solve_diffusion(const nebel_lighting *lighting, int is_own, nb_diffusion **made)
{
    nebel_snapshot *scaled = NULL;
    nebel_result result = nb_snapshot_select(lighting->snapshot, (nb_medium_selection){.is_scaled = 1}, &scaled);
    if (result == NEBEL_OK) result = nb_diffusion_make(lighting, scaled, is_own, made);
    nebel_release_snapshot(scaled);
    return result;
}

/* Of the endless fog alone, by the same sun and sky. */
static nebel_result solve_level_diffusion(const nebel_lighting *lighting, nb_diffusion **made)
{
    nebel_snapshot *level = NULL;
    nebel_lighting *lit = NULL;
    const nebel_lighting_desc desc = {.host = {.allocator = lighting->allocator, .log = lighting->log},
                                      .sun = nebel_get_lighting_sun(lighting),
                                      .environment = lighting->environment,
                                      .diffusion = &lighting->diffusion_desc,
                                      .previous = lighting};
    nebel_result result = nb_snapshot_select(lighting->snapshot, (nb_medium_selection){.is_level = 1}, &level);
    if (result == NEBEL_OK) result = nb_prepare_lighting(level, &desc, &lit);
    if (result == NEBEL_OK) result = solve_diffusion(lit, 0, made);
    if (lit != NULL) nb_free_lighting(lit);
    nebel_release_snapshot(level);
    return result;
}

static nebel_result diffuse(nebel_lighting *lighting)
{
    const int has_sun = lighting->scatters_sun || nb_environment_is_dimmed(lighting);
    const int has_own = nb_find_own_light(lighting).has;
    nebel_result result = has_sun || has_own ? refuse_unphysical(lighting) : NEBEL_OK;
    if (result == NEBEL_OK && has_own) result = solve_diffusion(lighting, 1, &lighting->local_diffusion);
    if (result == NEBEL_OK && has_sun) result = solve_diffusion(lighting, 0, &lighting->diffusion);
    if (result != NEBEL_OK) return result;
    lighting->add_diffusion = nb_diffusion_add;
    if (lighting->diffusion == NULL || !nb_diffusion_lattice_has_bodies(&lighting->diffusion->lattice)) return NEBEL_OK;
    return solve_level_diffusion(lighting, &lighting->diffusion->beside);
}

/* ---- made and shared ------------------------------------------------------------------------- */

nebel_result nebel_create_lighting(nebel_snapshot *snapshot, const nebel_lighting_desc *desc, nebel_lighting **made)
{
    static const nebel_lighting_desc dark = {.light_count = 0};
    if (made != NULL) *made = NULL;
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (desc == NULL) desc = &dark;
    const nebel_log *log = desc->host.log.write != NULL ? &desc->host.log : &snapshot->log;
    if (made == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "lighting: the place for it must not be NULL");
    nebel_result result = nb_check_lighting(log, desc);
    if (result != NEBEL_OK) return result;
    nebel_lighting *lighting;
    result = nb_prepare_lighting(snapshot, desc, &lighting);
    if (result == NEBEL_OK && desc->diffusion != NULL) result = diffuse(lighting);
    if (result == NEBEL_OK) {
        *made = lighting;
        return NEBEL_OK;
    }
    nebel_release_lighting(lighting);
    if (result == NEBEL_ERROR_UNSUPPORTED || result == NEBEL_ERROR_LIMIT) return result; /* which has said why */
    return nb_fail(log, result, "lighting: out of memory for %zu volumes", nebel_get_volume_count(snapshot));
}

nebel_lighting *nebel_retain_lighting(nebel_lighting *lighting)
{
    if (lighting != NULL) atomic_fetch_add_explicit(&lighting->owners, 1, memory_order_relaxed);
    return lighting;
}

void nebel_release_lighting(nebel_lighting *lighting)
{
    if (lighting == NULL || atomic_fetch_sub_explicit(&lighting->owners, 1, memory_order_acq_rel) != 1) return;
    nb_diffusion_free(&lighting->allocator, lighting->diffusion);
    nb_diffusion_free(&lighting->allocator, lighting->local_diffusion);
    nb_free_lighting(lighting);
}

/* ---- asked ----------------------------------------------------------------------------------- */

nebel_snapshot *nebel_get_lighting_snapshot(const nebel_lighting *lighting)
{
    return lighting != NULL ? lighting->snapshot : NULL;
}

nebel_sun nebel_get_lighting_sun(const nebel_lighting *lighting)
{
    nebel_sun sun = {.irradiance = {0, 0, 0}};
    for (int c = 0; lighting != NULL && c < 3; c++) {
        sun.direction[c] = lighting->to_sun[c];
        sun.irradiance[c] = lighting->irradiance[c];
    }
    return sun;
}

nebel_environment nebel_get_lighting_environment(const nebel_lighting *lighting)
{
    return lighting != NULL ? lighting->environment : (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT};
}

size_t nebel_get_lighting_lights(const nebel_lighting *lighting, const nebel_light **lights)
{
    if (lights != NULL) *lights = lighting != NULL ? lighting->described_lights : NULL;
    return lighting != NULL ? lighting->light_count : 0;
}

const nebel_diffusion_desc *nebel_get_lighting_diffusion(const nebel_lighting *lighting)
{
    return lighting != NULL && lighting->diffusion_desc.max_cells > 0 ? &lighting->diffusion_desc : NULL;
}

static int is_lit(const nebel_lighting *lighting, size_t medium, nebel_light_group group)
{
    const nb_volume *body = &lighting->snapshot->media[medium].body;
    const nb_medium_light *lit = &lighting->media[medium];
    int by_environment = 0;
    for (int c = 0; c < 3; c++) by_environment |= body->lit && lit->radiance[c] * body->extinction[c] > 0;
    switch (group) {
    case NEBEL_LIGHT_GROUP_SUN:
        return lit->scatters_sun;
    case NEBEL_LIGHT_GROUP_ENVIRONMENT:
        return by_environment;
    case NEBEL_LIGHT_GROUP_LOCAL:
        return lit->scatters_lights;
    default:
        return 0;
    }
}

int nebel_get_lit_bounds(const nebel_lighting *lighting, nebel_light_group group, nebel_bounds *bounds)
{
    nebel_bounds all = nb_no_bounds();
    if (lighting == NULL || bounds == NULL) return 0;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++)
        if (is_lit(lighting, i, group)) nb_bounds_add(&all, &lighting->snapshot->media[i].body);
    if (all.min[0] > all.max[0]) return 0;
    *bounds = all;
    return 1;
}
