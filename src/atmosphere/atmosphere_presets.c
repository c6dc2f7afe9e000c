/* Airs by name. */
#include <nebel/planet.h>

#include <string.h>

#define ALIKE(number)                                                                                                  \
    {                                                                                                                  \
        number, number, number                                                                                         \
    }
#define OF_MILLION(red, green, blue)                                                                                   \
    {                                                                                                                  \
        (red) * 1e-6, (green)*1e-6, (blue)*1e-6                                                                        \
    }
#define RAYLEIGH                                                                                                       \
    {                                                                                                                  \
        .type = NEBEL_PHASE_RAYLEIGH                                                                                   \
    }

/* How many times denser air must be for a ball of 1 km whose scale heights are as many times smaller. */
#define TOY 800.0

static const struct {
    const char *name;
    nebel_atmosphere_desc desc;
} known[] = {
    /* Rayleigh's air, dust and ozone: Hillaire, A Scalable and Production Ready Sky and Atmosphere Rendering Technique,
     * 2020, and its published demonstration. */
    {"earth",
     {.radius = 6.36e6,
      .thickness = 1e5,
      .components = {{.scattering = OF_MILLION(5.802, 13.558, 33.1), .phase = RAYLEIGH, .scale_height = 8000},
                     {.scattering = OF_MILLION(3.996, 3.996, 3.996),
                      .absorption = OF_MILLION(0.444, 0.444, 0.444),
                      .phase = {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.8},
                      .scale_height = 1200},
                     {.absorption = OF_MILLION(0.65, 1.881, 0.085),
                      .profile = NEBEL_COMPONENT_TENT,
                      .center_height = 25000,
                      .half_width = 15000}},
      .component_count = 3,
      .ground_albedo = ALIKE(0.3)}},
    /* Carbon dioxide of 610 Pa at 210 K, with the cross section of Sneep and Ubachs 2005 at 532 nm and the fourth power
     * of the wavelength; dust of optical depth 0.5, whose albedo follows Tomasko et al. 1999 at 0.67, 0.55 and 0.44 um;
     * their forward peak as one g. */
    {"mars",
     {.radius = 3.3895e6,
      .thickness = 1.2e5,
      .components = {{.scattering = OF_MILLION(0.104, 0.229, 0.559), .phase = RAYLEIGH, .scale_height = 11100},
                     {.scattering = OF_MILLION(42.3, 39.2, 34.2),
                      .absorption = OF_MILLION(2.7, 5.8, 10.8),
                      .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.65},
                      .scale_height = 11100}},
      .component_count = 2,
      .ground_albedo = {0.3, 0.17, 0.08}}},
    /* Not a planet that could be: the Earth's colours around a ball of one kilometre. */
    {"toy",
     {.radius = 1000,
      .thickness = 125,
      .components = {{.scattering = OF_MILLION(5.802 * TOY, 13.558 * TOY, 33.1 * TOY),
                      .phase = RAYLEIGH,
                      .scale_height = 8000 / TOY},
                     {.scattering = OF_MILLION(3.996 * TOY, 3.996 * TOY, 3.996 * TOY),
                      .absorption = OF_MILLION(0.444 * TOY, 0.444 * TOY, 0.444 * TOY),
                      .phase = {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.8},
                      .scale_height = 1200 / TOY}},
      .component_count = 2,
      .ground_albedo = ALIKE(0.3)}},
    /* The Moon: no air; its geometric mean radius and Bond albedo (NASA's fact sheet of the Moon). */
    {"moon",
     {.radius = 1.7374e6,
      .thickness = 1000,
      .components = {{.scale_height = 1000}},
      .component_count = 1,
      .ground_albedo = ALIKE(0.11)}},
};

const nebel_atmosphere_desc *nebel_lookup_atmosphere(const char *name)
{
    for (size_t i = 0; name != NULL && i < sizeof known / sizeof *known; i++)
        if (strcmp(name, known[i].name) == 0) return &known[i].desc;
    return NULL;
}
