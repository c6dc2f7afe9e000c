#include "nebula_scene.h"

#include "scenes.h"

#include <math.h>
#include <stdlib.h>

enum { COUNT = 100000, QUICK_COUNT = 500 };

static int generate_particles(nb_sky *sky)
{
    static const double colors[3][3] = {{.2, .1, .8}, {.9, .3, .4}, {1, .8, .5}};
    const nebel_nebula_desc desc = {.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {8, 4.5, 4}},
                                    .count = sky->count,
                                    .radius_range = {.08, .16},
                                    .absorption = {.5, .7, .9},
                                    .emission = {.6, .6, .6},
                                    .colors = colors,
                                    .color_count = 3,
                                    .turbulence = 2};
    return nebel_generate_nebula(&desc, sky->particles) == NEBEL_OK ? 0 : -1;
}

int nb_sky_make(int quick, nb_sky *sky)
{
    *sky = (nb_sky){.count = quick ? QUICK_COUNT : COUNT,
                    .width = quick ? 160 : NB_BENCH_WIDTH,
                    .height = quick ? 90 : NB_BENCH_HEIGHT,
                    .camera = {.position = {0, 0, 18}, .up = {0, 1, 0}, .vertical_fov = 38}};
    sky->particles = malloc(sky->count * sizeof *sky->particles);
    return sky->particles != NULL ? generate_particles(sky) : -1;
}

void nb_sky_free(nb_sky *sky)
{
    free(sky->particles);
    sky->particles = NULL;
}

double nb_sky_covered(const nb_sky *sky, const float *transmittance)
{
    size_t covered = 0;
    for (size_t i = 0; i < (size_t)sky->width * sky->height; i++) covered += transmittance[3 * i] < 1;
    return (double)covered;
}

/* A ball covers the pixels within its outline; far enough that perspective does not stretch it. */
double nb_sky_pixels(const nb_sky *sky)
{
    const double pi = acos(-1), half = tan(sky->camera.vertical_fov * pi / 360);
    double sum = 0;
    for (size_t i = 0; i < sky->count; i++) {
        const double depth = sky->camera.position[2] - sky->particles[i].center[2];
        const double radius = sky->particles[i].radius / (depth * half) * sky->height / 2;
        sum += pi * radius * radius;
    }
    return sum;
}
