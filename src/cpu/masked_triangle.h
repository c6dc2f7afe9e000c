/* Triangles with holes, as they cast shadows. */
#ifndef NB_CPU_MASKED_TRIANGLE_H
#define NB_CPU_MASKED_TRIANGLE_H

#include "shaft_rays.h"

/* A point light that sees a sheet. */
typedef struct nb_masked_triangle_light {
    const double *place;  /* relative to the origin of the geometry */
    const double *normal; /* of the sheet, unit length, away from the point light */
    double distance;      /* m, of the point light from the sheet's plane */
} nb_masked_triangle_light;

/* Adds to the shadows of a packet what the sheet's mask leaves of the stretches that are behind its triangle.
 * `point_light` NULL: of the sun, else rays start relative to the point light. Returns 0 when memory is out. */
int nb_masked_triangle_cast(const nb_masked_occluder *sheet, const nb_masked_triangle_light *light,
                            nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shaft_interval *found,
                            nb_shaft_rays *rays);

#endif
