/* What others have published for tables of air and for clouds, beside what is measured here. */
#include "groups.h"

#include <stddef.h>
#include <stdio.h>

/* Tables: of transmittance, scattering, sky and aerial perspective, as Hillaire (2020) has them. Sources: a thesis on those
 * and on clouds (matejelias.cz), of each table by itself, added up here; a port to Godot (voithos), without aerial
 * perspective; AirGuanZ's port to OpenGL, sky and aerial perspective alone; Guerrilla Games on Nubis (2015). */
void nb_bench_published_planet(nb_figures *figures)
{
    static const struct {
        const char *name;
        double milliseconds;
    } published[] = {{"four tables of air, RTX 4080 (M. Elias)", 0.034 + 0.259 + 0.010 + 0.080},
                     {"four tables of air, RTX 3060 (M. Elias)", 0.127 + 0.371 + 0.024 + 0.097},
                     {"four tables of air, RTX 2060 (M. Elias)", 0.141 + 0.414 + 0.026 + 0.095},
                     {"three tables of air, RTX 4090 (Godot port)", 0.0074 + 0.174 + 0.0083},
                     {"sky and aerial perspective, GTX 1060 (AirGuanZ)", 0.036 + 0.03},
                     {"clouds, RTX 4080 (M. Elias)", 0.755},
                     {"clouds, RTX 3060 (M. Elias)", 3.01},
                     {"clouds, RTX 2060 (M. Elias)", 3.42},
                     {"clouds, PlayStation 4 (Nubis 2015), less than", 2}};
    for (size_t i = 0; i < sizeof published / sizeof *published; i++) {
        nb_figure figure = {.group = "Published by others, on graphics processors: not measured here",
                            .unit = "ms",
                            .value = published[i].milliseconds};
        (void)snprintf(figure.name, sizeof figure.name, "%s", published[i].name);
        nb_figures_add(figures, &figure);
    }
}
