#include "check.h"

#include "media/phase.h"

#include <math.h>
#include <string.h>

nebel_atmosphere_desc nb_atmosphere_resolve(const nebel_atmosphere_desc *desc)
{
    const nebel_atmosphere_desc *earth = nebel_find_atmosphere("earth");
    nebel_atmosphere_desc whole = *desc;
    if (whole.radius == 0) whole.radius = earth->radius;
    if (whole.thickness == 0) whole.thickness = earth->thickness;
    if (whole.air_count == 0) {
        memcpy(whole.airs, earth->airs, sizeof whole.airs);
        whole.air_count = earth->air_count;
    }
    return whole;
}

static int all_within(const double numbers[3], double least, double most)
{
    for (int c = 0; c < 3; c++)
        if (!(numbers[c] >= least && numbers[c] <= most)) return 0;
    return 1;
}

static const char *find_air_fault(const nebel_air *air, double thickness)
{
    if (!all_within(air->scattering, 0, NEBEL_MAX_AIR_EXTINCTION)) return "scattering: must be within 0 and 1e3";
    if (!all_within(air->absorption, 0, NEBEL_MAX_AIR_EXTINCTION)) return "absorption: must be within 0 and 1e3";
    switch (air->profile) {
    case NEBEL_AIR_EXPONENTIAL:
        if (!(air->scale_height >= thickness / NEBEL_MAX_AIR_RATIO && air->scale_height <= NEBEL_MAX_LENGTH))
            return "scale_height: must be within a thousandth of the thickness and 1e15";
        break;
    case NEBEL_AIR_LAYER:
        if (!(air->center >= 0 && air->center <= thickness)) return "center: must be within 0 and the thickness";
        if (!(air->width >= thickness / NEBEL_MAX_AIR_RATIO && air->width <= NEBEL_MAX_LENGTH))
            return "width: must be within a thousandth of the thickness and 1e15";
        break;
    default:
        return "profile: is unknown";
    }
    return nb_phase_fault(&air->phase);
}

static const char *find_fault(const nebel_atmosphere_desc *desc)
{
    if (!all_within(desc->ground, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH)) return "ground: must be within -1e15 and 1e15";
    if (!(desc->radius >= 1 && desc->radius <= 1e12)) return "radius: must be within 1 and 1e12";
    if (!(desc->thickness >= desc->radius / 1e6 && desc->thickness <= 1e12))
        return "thickness: must be within a millionth of the radius and 1e12";
    if (desc->air_count > NEBEL_MAX_AIRS) return "air_count: must be at most 4";
    if (!all_within(desc->ground_albedo, 0, 1)) return "ground_albedo: must be within 0 and 1";
    if (!((int)desc->quality >= 0 && desc->quality < NEBEL_AIR_QUALITY_COUNT)) return "quality: is unknown";
    return NULL;
}

nebel_result nb_atmosphere_check(const nebel_atmosphere_desc *desc)
{
    const char *fault = find_fault(desc);
    if (fault != NULL) return nb_fail(&desc->log, NEBEL_ERROR_VALUE, "atmosphere: %s", fault);
    for (uint32_t i = 0; i < desc->air_count; i++) {
        fault = find_air_fault(&desc->airs[i], desc->thickness);
        if (fault != NULL) return nb_fail(&desc->log, NEBEL_ERROR_VALUE, "atmosphere: airs[%u] %s", (unsigned)i, fault);
    }
    return NEBEL_OK;
}
