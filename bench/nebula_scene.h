/* A nebula that fills most of a picture, as the groups of the CPU and of OpenGL draw it. */
#ifndef NB_BENCH_NEBULA_SCENE_H
#define NB_BENCH_NEBULA_SCENE_H

#include <nebel/scene.h>

typedef struct nb_sky {
    size_t count;
    uint32_t width, height;
    nebel_camera camera;
    nebel_particle *particles;
} nb_sky;

/* About thirty of the particles are on a pixel that they cover; few in a small picture where `quick`. Returns 0, or -1
 * for want of memory. To be freed in both cases. */
int nb_sky_make(int quick, nb_sky *sky);
void nb_sky_free(nb_sky *sky);

/* Pixels that anything covers, by the first channel of a plane of transmittance with three. */
double nb_sky_covered(const nb_sky *sky, const float *transmittance);

/* Pixels that particles cover, each counted as often as it is covered. */
double nb_sky_pixels(const nb_sky *sky);

#endif
