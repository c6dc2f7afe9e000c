#include "atmosphere.h"

#include "atmosphere_check.h"

#include "math/vector.h"

#include <math.h>

/* Those of the form of Henyey and Greenstein are g^order; those of its product with 1 + alpha c^2 follow from the
 * recurrence of c times Legendre's polynomials. */
static double lobe_moment(const nb_lobe *lobe, int order)
{
    const double l = order, g = lobe->g;
    const double ahead = (l + 1) * (l + 2) / ((2 * l + 1) * (2 * l + 3));
    const double same = (l + 1) * (l + 1) / ((2 * l + 1) * (2 * l + 3)) + l * l / ((2 * l + 1) * (2 * l - 1));
    double square = ahead * pow(g, l + 2) + same * pow(g, l);
    if (order >= 2) square += l * (l - 1) / ((2 * l + 1) * (2 * l - 1)) * pow(g, l - 2);
    return (pow(g, l) + lobe->alpha * square) / (1 + lobe->alpha * (1 + 2 * g * g) / 3);
}

static void resolve_air(const nebel_atmosphere_component *desc, nb_air_component *air)
{
    air->phase = nb_phase_resolve(&desc->phase);
    air->scale = desc->profile == NEBEL_COMPONENT_EXPONENTIAL ? desc->scale_height : 0;
    air->center = desc->center_height;
    air->width = desc->half_width;
    for (int c = 0; c < 3; c++) {
        air->scattering[c] = desc->scattering[c];
        air->extinction[c] = desc->scattering[c] + desc->absorption[c];
    }
    for (int order = 0; order <= NB_MOMENTS; order++)
        for (int i = 0; i < air->phase.lobe_count; i++)
            air->moments[order] += air->phase.lobes[i].weight * lobe_moment(&air->phase.lobes[i], order);
}

nebel_result nebel_resolve_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere_desc *resolved)
{
    if (desc == NULL || resolved == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_atmosphere_desc whole = nb_atmosphere_resolve(desc);
    const nebel_result result = nb_atmosphere_check(&whole);
    if (result == NEBEL_OK) *resolved = whole;
    return result;
}

nebel_result nebel_create_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere **atmosphere)
{
    if (atmosphere == NULL) return NEBEL_ERROR_ARGUMENT;
    *atmosphere = NULL;
    if (desc == NULL || !nb_allocator_is_valid(&desc->host.allocator)) return NEBEL_ERROR_ARGUMENT;
    const nebel_atmosphere_desc whole = nb_atmosphere_resolve(desc);
    nebel_result result = nb_atmosphere_check(&whole);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&whole.host.allocator);
    nebel_atmosphere *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&whole.host.log, NEBEL_ERROR_MEMORY, "atmosphere: out of memory");
    made->allocator = allocator;
    made->airs.radius = whole.radius;
    made->airs.top = whole.radius + whole.thickness;
    made->airs.count = (int)whole.component_count;
    for (int c = 0; c < 3; c++) made->ground_albedo[c] = whole.ground_albedo[c];
    for (int i = 0; i < made->airs.count; i++) resolve_air(&whole.components[i], &made->airs.airs[i]);
    nb_air_components_cut(&made->airs);
    nb_sphere_center_below(whole.ground_point, whole.radius, made->center);
    made->rule = nb_gauss_rule_make(NB_MAX_RULE);
    made->gather = nb_gather_choose(NEBEL_ISA_DEFAULT);
    nb_air_components_smooth(&made->airs, nb_scatter_orders(&made->airs, whole.quality), &made->smooth);
    result = nb_scattering_table_make(&allocator, &whole.host.parallel, &made->airs, &made->smooth, whole.quality,
                                      whole.ground_albedo, &made->scatter, &made->stray);
    made->share_off = (made->scatter.orders == NB_MOMENTS ? 0.02 : 0.1) + made->scatter.missing;
    if (result == NEBEL_OK) {
        *atmosphere = made;
        return NEBEL_OK;
    }
    nebel_destroy_atmosphere(made);
    return nb_fail(&whole.host.log, result, "atmosphere: out of memory");
}

void nebel_destroy_atmosphere(nebel_atmosphere *atmosphere)
{
    if (atmosphere == NULL) return;
    const nebel_allocator allocator = atmosphere->allocator;
    nb_scattering_table_free(&allocator, &atmosphere->scatter);
    nb_stray_free(&allocator, &atmosphere->stray);
    nb_release(&allocator, atmosphere);
}
