/* Point lights on surfaces: which points they reach, and how much of their light. */
#ifndef NB_CPU_SURFACE_LIGHTS_H
#define NB_CPU_SURFACE_LIGHTS_H

#include "cpu_surface.h"

/* From the points of a batch to a point light; what lanes that are not lit hold means nothing but reach 0. */
typedef struct nb_shadow_rays {
    float direction[3][NB_BATCH]; /* unit length */
    float reach[NB_BATCH];        /* m, to the surface of the point light */
    float shadowed[NB_BATCH];     /* m, to where nothing casts a shadow any more */
    float strength[NB_BATCH];     /* irradiance over pi, of a point light of 1 W/sr, before any fog */
    _Alignas(64) int lit[NB_BATCH];
} nb_shadow_rays;

/* Lanes are lit where they are hits, the point light is above shading normal and triangle, and within the point
 * light's cone. */
void nb_shadow_rays_set(const nebel_light *light, const nb_ray_starts *starts, const nb_hits *hits,
                        const nb_surface_batch *points, nb_shadow_rays *ways);

/* Lanes behind a surface are no longer lit. */
void nb_shadow_rays_shadow(RTCScene scene, nb_surface_batch *points, nb_shadow_rays *ways, nb_packets *packets);

#endif
