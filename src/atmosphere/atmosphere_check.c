#include "atmosphere_check.h"

#include "medium/phase.h"

#include <stdio.h>
#include <string.h>

nebel_atmosphere_desc nb_atmosphere_resolve(const nebel_atmosphere_desc *desc)
{
    const nebel_atmosphere_desc *earth = nebel_lookup_atmosphere("earth");
    nebel_atmosphere_desc whole = *desc;
    if (whole.radius == 0) whole.radius = earth->radius;
    if (whole.thickness == 0) whole.thickness = earth->thickness;
    if (whole.component_count == 0) {
        memcpy(whole.components, earth->components, sizeof whole.components);
        whole.component_count = earth->component_count;
    }
    return whole;
}

/* What is said of: "components[2]." or "" where it is no kind of air. */
typedef struct nb_atmosphere_subject {
    const nebel_log *log;
    char name[24];
} nb_atmosphere_subject;

static nebel_result refuse(const nb_atmosphere_subject *of, const char *what, const char *fault)
{
    return nb_fail(of->log, NEBEL_ERROR_VALUE, "atmosphere: %s%s: %s", of->name, what, fault);
}

/* What a number is in, and what its limits are, where they come from other numbers: " (the thickness)", or "". */
typedef struct meaning {
    const char *unit, *least, *most;
} meaning;

static const meaning pure = {"", "", ""}, per_metre = {" per m", "", ""}, length_meaning = {" m", "", ""};

static nebel_result check(const nb_atmosphere_subject *of, const char *what, double number, double least, double most,
                          const meaning *is)
{
    if (number >= least && number <= most) return NEBEL_OK;
    return nb_fail(of->log, NEBEL_ERROR_VALUE, "atmosphere: %s%s: is %g%s; must be within %g%s%s and %g%s%s", of->name,
                   what, number, is->unit, least, is->unit, is->least, most, is->unit, is->most);
}

static nebel_result check_all(const nb_atmosphere_subject *of, const char *what, const double numbers[3], double least,
                              double most, const meaning *is)
{
    nebel_result result = NEBEL_OK;
    for (int c = 0; c < 3 && result == NEBEL_OK; c++) result = check(of, what, numbers[c], least, most, is);
    return result;
}

static nebel_result check_profile(const nb_atmosphere_subject *of, const nebel_atmosphere_component *air,
                                  double thickness)
{
    static const meaning at_least = {" m", " (a thousandth of the thickness)", ""},
                         within = {" m", "", " (the thickness)"};
    const double least = thickness / NEBEL_MAX_COMPONENT_RATIO;
    nebel_result result;
    switch (air->profile) {
    case NEBEL_COMPONENT_EXPONENTIAL:
        return check(of, "scale_height", air->scale_height, least, NEBEL_MAX_LENGTH, &at_least);
    case NEBEL_COMPONENT_TENT:
        result = check(of, "center_height", air->center_height, 0, thickness, &within);
        return result == NEBEL_OK ? check(of, "half_width", air->half_width, least, NEBEL_MAX_LENGTH, &at_least)
                                  : result;
    default:
        return refuse(of, "profile", "is unknown");
    }
}

static nebel_result check_air(const nb_atmosphere_subject *of, const nebel_atmosphere_component *air, double thickness)
{
    const double most = NEBEL_MAX_COMPONENT_EXTINCTION;
    nebel_result result = check_all(of, "scattering", air->scattering, 0, most, &per_metre);
    if (result == NEBEL_OK) result = check_all(of, "absorption", air->absorption, 0, most, &per_metre);
    if (result == NEBEL_OK) result = check_profile(of, air, thickness);
    if (result != NEBEL_OK) return result;
    const char *fault = nb_phase_fault(&air->phase);
    return fault == NULL ? NEBEL_OK : nb_fail(of->log, NEBEL_ERROR_VALUE, "atmosphere: %s%s", of->name, fault);
}

nebel_result nb_atmosphere_check(const nebel_atmosphere_desc *desc)
{
    static const meaning at_least = {" m", " (a millionth of the radius)", ""};
    nb_atmosphere_subject of = {&desc->host.log, ""};
    nebel_result result =
        check_all(&of, "ground_point", desc->ground_point, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH, &length_meaning);
    if (result == NEBEL_OK) result = check(&of, "radius", desc->radius, 1, 1e12, &length_meaning);
    if (result == NEBEL_OK) result = check(&of, "thickness", desc->thickness, desc->radius / 1e6, 1e12, &at_least);
    if (result == NEBEL_OK) result = check_all(&of, "ground_albedo", desc->ground_albedo, 0, 1, &pure);
    if (result != NEBEL_OK) return result;
    if (desc->component_count > NEBEL_MAX_COMPONENTS) return refuse(&of, "component_count", "must be at most 4");
    if ((int)desc->quality < 0 || desc->quality >= NEBEL_ATMOSPHERE_QUALITY_COUNT)
        return refuse(&of, "quality", "is unknown");
    for (uint32_t i = 0; i < desc->component_count && result == NEBEL_OK; i++) {
        (void)snprintf(of.name, sizeof of.name, "components[%u].", (unsigned)i);
        result = check_air(&of, &desc->components[i], desc->thickness);
    }
    return result;
}
