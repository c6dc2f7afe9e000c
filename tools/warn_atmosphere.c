#include "warn_atmosphere.h"

#include "messages.h"

#include <nebel/planet.h>

#include <math.h>

/* From here on light that is scattered often is not found to its end: see "How far off" in docs/planet.md. */
#define DEEP 12.

int nb_has_air(const nebel_planet *planet)
{
    double sum = 0;
    for (uint32_t i = 0; i < planet->atmosphere_desc.component_count; i++)
        for (int c = 0; c < 3; c++)
            sum += planet->atmosphere_desc.components[i].scattering[c] +
                   planet->atmosphere_desc.components[i].absorption[c];
    return sum > 0;
}

void nb_find_air_depth(const nebel_planet *planet, double depth[3])
{
    const double *const ground = planet->atmosphere_desc.ground_point;
    const nebel_ray up = {{ground[0], ground[1], ground[2]}, {0, 1, 0}, (double)INFINITY};
    nebel_transfer transfer;
    for (int c = 0; c < 3; c++) depth[c] = 0;
    if (planet->atmosphere == NULL ||
        nebel_trace_atmosphere(planet->atmosphere, NULL, 1, &up, 0, &transfer, 0) != NEBEL_OK)
        return;
    for (int c = 0; c < 3; c++) depth[c] = 0 - log(transfer.transmittance[c]);
}

const char *nb_find_deep_air(const double depth[3])
{
    const double most = fmax(depth[0], fmax(depth[1], depth[2]));
    return most > DEEP ? "air deeper than 12 is drawn too dark or too bright where light is scattered often" : NULL;
}

void nb_warn_of_deep_air(const nebel_scene_data *scene, const char *path)
{
    for (size_t i = 0; i < scene->planet_count; i++) {
        double depth[3];
        nb_find_air_depth(&scene->planets[i], depth);
        const char *const deep = nb_find_deep_air(depth);
        if (deep == NULL) continue;
        if (scene->planet_count > 1)
            nb_report_message("warning: %s: planet[%zu]: %s", path, i, deep);
        else
            nb_report_message("warning: %s: planet: %s", path, deep);
    }
}
