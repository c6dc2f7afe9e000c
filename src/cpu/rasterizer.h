/* Which triangle a picture shows at each point of a region: the first hits of rays that form a plane, found triangle by
 * triangle instead of ray by ray. Faster than a ray tracer where triangles are not more than pixels.
 *
 * A triangle is prepared by the cross products of its corners in homogeneous coordinates of the picture (Olano and
 * Greer 1997): edge functions and depth are linear there, so that nothing needs clipping at the camera's plane. They
 * are made in double, because products of distant corners cancel. */
#ifndef NB_CPU_RASTERIZER_H
#define NB_CPU_RASTERIZER_H

#include "hits.h"
#include "screen_bounds.h"

/* A view of a geometry made ready for a picture. */
typedef struct nb_raster {
    const nb_geometry *geometry;
    nb_projection projection;
} nb_raster;

/* What is seen at the points of a region. */
typedef struct nb_region_hits {
    float nearness[NB_PIXELS];    /* grows towards the camera */
    uint32_t triangle[NB_PIXELS]; /* its ID; NB_NONE: background */
} nb_region_hits;

/* 1 where rasterizing is possible and pays. */
int nb_raster_is_apt(const nb_geometry *geometry, nebel_projection projection, uint32_t width, uint32_t height);

/* Call before the threads of the frame start; writes the geometry's rectangles. */
void nb_raster_set(nb_raster *raster, nb_geometry *geometry, const nb_view *view, const nb_raster_target *picture,
                   int threads);

/* What is seen at `count` points of each pixel of the region whose first pixel is (left, top). */
void nb_raster_region(const nb_raster *raster, uint32_t left, uint32_t top, uint32_t count,
                      const nb_region_points *points, nb_region_hits *seen);

/* The hits of a batch, where the triangles with these IDs are seen. */
void nb_raster_hits(const nb_geometry *geometry, const uint32_t *ids, const nb_ray_batch *rays, nb_hits *hits);

#endif
