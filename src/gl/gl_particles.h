/* Particles of nebulae: balls before the eye, drawn from the farthest to the nearest into the fog of a sample. */
#ifndef NB_GL_GL_PARTICLES_H
#define NB_GL_GL_PARTICLES_H

#include "gl_caps.h"

#include <nebel/gl.h>

/* As the eye sees one. */
typedef struct nb_particle_sphere {
    float center[3], radius; /* relative to the eye */
    float extinction[3], profile;
    float emission[3], rest;
} nb_particle_sphere;

/* How far one is, as bits that count down with the distance. */
typedef struct nb_sorted_particle {
    uint32_t nearness, index;
} nb_sorted_particle;

typedef struct nb_particles {
    nebel_particle *list;         /* in the world */
    nb_particle_sphere *balls;    /* as they are drawn */
    nb_sorted_particle *order[2]; /* with one to sort into */
    size_t count;
    int is_grey;  /* every one takes all colours alike */
    int profiles; /* 2 to the number of each that occurs */
    unsigned vertex_array, buffer;
} nb_particles;

/* Copies. What was there before goes. MEMORY. */
nebel_result nb_particles_set(nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                              const nebel_particle *list, size_t count);

/* All of them as fog. MEMORY. */
nebel_result nb_particles_commit(const nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                                 nebel_lighting **cloud);

/* Sorts and hands them over as an eye sees them; `forward` where rays are parallel, else NULL. MEMORY. */
nebel_result nb_particles_sort(nb_particles *particles, const nebel_log *log, const double eye[3],
                               const double *forward);

/* Whether one that takes light is between places of the box and a light that is infinitely far into this direction. */
int nb_particles_shade(const nb_particles *particles, const double to_light[3], const double low[3],
                       const double high[3]);

/* Each a strip of so many vertices. */
void nb_particles_draw(const nb_particles *particles, int vertices);

/* What was allocated. */
void nb_particles_release(const nebel_allocator *allocator, const nb_particles *particles);

/* In OpenGL. */
void nb_particles_delete(const nb_particles *particles);

#endif
