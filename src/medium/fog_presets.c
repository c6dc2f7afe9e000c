/* Fog by name, and what its droplets, its water and its visibility have to do with each other. */
#include <nebel/nebel.h>

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define WATER 1e6 /* g/m^3 */

/* -ln(0.05): 1/m of the meteorological optical range in metres */
#define OF_VISIBILITY(metres) (2.995732273553991 / (metres))
#define ALIKE(number)                                                                                                  \
    {                                                                                                                  \
        number, number, number                                                                                         \
    }
#define COLORED(green, red_ratio, blue_ratio)                                                                          \
    {                                                                                                                  \
        (green) * (red_ratio), green, (green) * (blue_ratio)                                                           \
    }
#define DROPLETS(micrometres)                                                                                          \
    {                                                                                                                  \
        .type = NEBEL_PHASE_DROPLETS, .diameter = micrometres                                                          \
    }

/* Extinction and albedo of the fogs are Mie's of their droplets at 0.55 um, and at 0.65, 0.55 and 0.45 um; the
 * extinction differs by less than 2.5 % between these, so that it is grey. The diameter is twice the effective radius.
 * The extinction of the others goes with wavelength^-exponent. */
static const nebel_fog_preset presets[] = {
    {.name = "heavy_advection",
     .citation = "droplets: Shettle and Fenn 1979; optics: Mie",
     .droplets = {.scale = 0.027, .power = 3, .rate = 0.3, .exponent = 1},
     .extinction = ALIKE(0.0287482),
     .albedo = {0.9999942, 0.9999992, 0.9999995},
     .phase = DROPLETS(40)},
    {.name = "moderate_advection",
     .citation = "droplets: Shettle and Fenn 1979; optics: Mie",
     .droplets = {.scale = 0.06592, .power = 3, .rate = 0.375, .exponent = 1},
     .extinction = ALIKE(0.0184843),
     .albedo = {0.9999946, 0.9999993, 0.9999996},
     .phase = DROPLETS(32)},
    {.name = "heavy_radiation",
     .citation = "droplets: Shettle and Fenn 1979; optics: Mie",
     .droplets = {.scale = 2.37305, .power = 6, .rate = 1.5, .exponent = 1},
     .extinction = ALIKE(0.0166385),
     .albedo = {0.9999981, 0.9999997, 0.9999998},
     .phase = DROPLETS(12)},
    {.name = "moderate_radiation",
     .citation = "droplets: Shettle and Fenn 1979; optics: Mie",
     .droplets = {.scale = 607.5, .power = 6, .rate = 3, .exponent = 1},
     .extinction = ALIKE(0.00863362),
     .albedo = {0.999999, 0.9999999, 0.9999999},
     .phase = DROPLETS(6)},
    {.name = "mist",
     .citation = "visibility 2 km, hydrated particles of 0.4 to 2.5 um: Elias et al. 2015; absorption as in OPAC's "
                 "continental polluted air (Hess et al. 1998), because water adds none",
     .extinction = ALIKE(OF_VISIBILITY(2000)),
     .albedo = ALIKE(0.9875),
     .phase = DROPLETS(1)},
    {.name = "haze",
     .citation = "visibility 5 km; albedo and g: OPAC's continental polluted air, Hess et al. 1998; exponent 1.3: "
                 "Angstrom 1964",
     .extinction = COLORED(OF_VISIBILITY(5000), 0.80479, 1.29806),
     .albedo = ALIKE(0.8925),
     .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.6977}},
    {.name = "smoke",
     .citation =
         "burning grass and wood, visibility 1 km; albedo: Leahy et al. 2007; exponent 1.8 and g: Dubovik et al. "
         "2002, African savanna",
     .extinction = COLORED(OF_VISIBILITY(1000), 0.7403, 1.43506),
     .albedo = ALIKE(0.85),
     .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.58}},
    {.name = "black_smoke",
     .citation = "flames, visibility 10 m, some 0.03 g/m^3 by Mulholland and Croarkin 2000; albedo 0.2 to 0.3 and "
                 "exponent 1: Bond and Bergstrom 2006; g is a guess",
     .extinction = COLORED(OF_VISIBILITY(10), 0.84615, 1.22222),
     .albedo = ALIKE(0.25),
     .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.6}},
};

const nebel_fog_preset *nebel_list_fog_presets(size_t *count)
{
    if (count != NULL) *count = sizeof presets / sizeof *presets;
    return presets;
}

const nebel_fog_preset *nebel_lookup_fog_preset(const char *name)
{
    for (size_t i = 0; name != NULL && i < sizeof presets / sizeof *presets; i++)
        if (strcmp(name, presets[i].name) == 0) return &presets[i];
    return NULL;
}

/* ---- visibility and water -------------------------------------------------------------------- */

double nebel_extinction_from_visibility(double visibility, double contrast)
{
    const double seen = contrast == 0 ? 0.05 : contrast;
    if (!(visibility > 0 && seen > 0 && seen < 1)) return (double)NAN;
    return -log(seen) / visibility;
}

double nebel_visibility_from_extinction(double extinction, double contrast)
{
    return nebel_extinction_from_visibility(extinction, contrast);
}

/* beta [1/km] = 144.7 W^0.88 */
double nebel_extinction_from_water(double water)
{
    return water >= 0 ? 0.1447 * pow(water, 0.88) : (double)NAN;
}

double nebel_water_from_extinction(double extinction)
{
    return extinction >= 0 ? pow(extinction / 0.1447, 1 / 0.88) : (double)NAN;
}

/* 3 W / (2 rho r) */
double nebel_extinction_from_droplets(double water, double radius)
{
    return water >= 0 && radius > 0 ? 1.5 * water / (WATER * 1e-6 * radius) : (double)NAN;
}

double nebel_droplet_radius(double water, double number)
{
    const double volume = water / (WATER * 1e6 * number); /* m^3; a cubic metre holds 1e6 cubic centimetres */
    return water > 0 && number > 0 ? 1e6 * cbrt(3 * volume / (4 * PI)) : (double)NAN;
}

/* ---- droplets of many sizes ------------------------------------------------------------------ */

/* The integral of r^k over all droplets: micrometres^k per cm^3. */
static double moment(const nebel_droplet_distribution *sizes, int k)
{
    const double order = (sizes->power + k + 1) / sizes->exponent;
    return sizes->scale / sizes->exponent * tgamma(order) * pow(sizes->rate, -order);
}

nebel_result nebel_compute_droplet_properties(const nebel_droplet_distribution *sizes, nebel_droplet_properties *sums)
{
    if (sizes == NULL || sums == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!(sizes->scale > 0 && sizes->power > -1 && sizes->rate > 0 && sizes->exponent > 0)) return NEBEL_ERROR_VALUE;
    const double second = moment(sizes, 2), third = moment(sizes, 3);
    const nebel_droplet_properties sum = {
        .number_density = moment(sizes, 0),
        .effective_radius = third / second,
        .water = 4 * PI / 3 * WATER * 1e-12 * third, /* um^3/cm^3 are 1e-12 */
        .extinction = 2 * PI * 1e-6 * second,        /* um^2/cm^3 are 1e-6/m */
    };
    if (!isfinite(sum.number_density) || !isfinite(sum.effective_radius) || !isfinite(third)) return NEBEL_ERROR_VALUE;
    *sums = sum;
    return NEBEL_OK;
}
