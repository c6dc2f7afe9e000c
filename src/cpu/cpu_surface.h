/* Surfaces where they are met: normals, reflectance, what the sun sees of them. */
#ifndef NB_CPU_CPU_SURFACE_H
#define NB_CPU_CPU_SURFACE_H

#include "hits.h"

/* sRGB to linear light, for each of the 256 values of a texture. */
typedef struct nb_srgb_table {
    float linear[256];
} nb_srgb_table;

typedef struct nb_surface_batch {
    float normal[3][NB_BATCH];      /* shading normal, unit length, on the side of the camera */
    float reflectance[3][NB_BATCH]; /* base color times texture */
    float start[3][NB_BATCH];       /* of shadow rays: lifted off the surface on the side of the camera */
    float cosine[NB_BATCH];         /* between shading normal and sun */
    float side[3][NB_BATCH];        /* the triangle's normal, unit length, on the side of the camera */
    float edge[NB_BATCH];           /* longest edge of the mesh */
    float rise[NB_BATCH];           /* m, of the start of a shadow ray along the shading normal */
    /* -1 or 0: where the sun is above the shading normal's surface; and where it is, but not above the triangle. */
    _Alignas(64) int lit[NB_BATCH], away[NB_BATCH];
} nb_surface_batch;

/* Where rays to lights begin, for fog and point lights: `origin` + `offset`. */
typedef struct nb_ray_starts {
    double origin[3];
    const float *offset[3];
} nb_ray_starts;

void nb_srgb_table_set(nb_srgb_table *table);

/* The points of all hits. `sun` is the unit direction towards the sun. Lanes without a hit are not lit. */
void nb_surface_points(const nb_geometry *geometry, const nebel_scene_data *scene, const nb_srgb_table *table,
                       const nb_ray_batch *rays, const nb_hits *hits, const float sun[3], nb_surface_batch *points);

#endif
