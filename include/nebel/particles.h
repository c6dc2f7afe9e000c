/* Nebulae: clouds of very many small soft particles, each a volume of fog like any other.
 *
 *     const nebel_nebula_desc desc = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 10}, .count = 25000,
 *                                     .absorption = {.3, .3, .3}, .emission = {.5, .2, .6}};
 *     nebel_generate_nebula(&desc, particles);
 *     for (size_t i = 0; i < desc.count; i++) {
 *         const nebel_volume_desc volume = nebel_volume_from_particle(&particles[i]);
 *         nebel_add_volume(fog, &volume, NULL);
 *     }
 *
 * Particles overlap, absorb and shine exactly, in any order, among themselves and with all other fog. Link with
 * libnebel.
 */
#ifndef NEBEL_PARTICLES_H
#define NEBEL_PARTICLES_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How density falls from the centre of a particle to its surface, r = 1. */
typedef enum nebel_particle_profile {
    NEBEL_PARTICLE_SOFT = 0, /* (1 - r^2)^2 */
    NEBEL_PARTICLE_GAUSSIAN, /* exp(-(3 r)^2 / 2): three standard deviations, then nothing */
    NEBEL_PARTICLE_UNIFORM,  /* 1 */
    NEBEL_PARTICLE_PROFILE_COUNT
} nebel_particle_profile;

typedef struct nebel_particle {
    double center[3];     /* m */
    double radius;        /* m */
    double extinction[3]; /* 1/m at the centre */
    double emission[3];   /* radiance per metre at the centre */
    nebel_particle_profile profile;
} nebel_particle;

/* The particle as fog. Any thread. */
NEBEL_API nebel_volume_desc nebel_volume_from_particle(const nebel_particle *particle);

typedef struct nebel_nebula_desc {
    nebel_host host;
    nebel_shape shape;     /* particles start inside of it; bounded */
    nebel_density density; /* how many of them are there */
    /* 0: the density thins particles out; 1: it dims them, and they are equally many everywhere; between 0 and 1
     * density^(1 - dimming) thins them out and density^dimming dims them. Where few are left single ones show. Not of points. */
    double dimming;
    size_t count;
    const double (*points)[3]; /* m, `count` of them: where particles start, in place of shape and density, which are
                                  not read; NULL: those */
    uint64_t seed;             /* the same particles for the same description, on every machine */
    nebel_particle_profile profile;
    /* m, smallest and largest radius, 1e-15 to 1e15 (GAUSSIAN: 3e-15); as many of one octave as of the next. Both 0: 0.05,
     * 0.2. */
    double radius_range[2];
    double absorption[3]; /* 1/m at a particle's centre, 0 to 1e9 */
    double emission[3];   /* radiance per metre at a particle's centre, 0 to 1e9, with its color */
    /* Factors of emission, >= 0, which drift through the nebula from the first to the last; NULL: 1. */
    const double (*colors)[3];
    size_t color_count;
    double turbulence;       /* m, 0 to 1e15: how far eddies carry particles; 0: not at all */
    double turbulence_scale; /* m, 1e-15 to 1e15: the largest eddies, and how fast colours change. 0: a quarter of the
                               extent of the shape or the points */
} nebel_nebula_desc;

/* Distributes desc->count particles. O(count / share of the shape's bounding box that is taken). Any thread.
 * Errors: ARGUMENT; MEMORY; VALUE (as for nebel_add_volume, a shape without bounds, or one in which no place is found;
 * a point that is not finite). */
NEBEL_API nebel_result nebel_generate_nebula(const nebel_nebula_desc *desc, nebel_particle *particles);

#ifdef __cplusplus
}
#endif
#endif
