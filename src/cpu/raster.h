/* Which triangle a picture shows at each point of a region: the first hits of rays that form a plane, found triangle by
 * triangle instead of ray by ray. Faster than a ray tracer where triangles are not more than pixels.
 *
 * A triangle is prepared by the cross products of its corners in homogeneous coordinates of the picture (Olano and
 * Greer 1997): edge functions and depth are linear there, so that nothing needs clipping at the camera's plane. They
 * are made in double, because products of distant corners cancel. */
#ifndef NB_CPU_RASTER_H
#define NB_CPU_RASTER_H

#include "hits.h"
#include "sampling.h"

/* A view made ready for a picture, and where the clusters of the geometry lie in it. */
typedef struct nb_raster {
    const nb_geometry *geometry;
    int orthographic;
    double rows[3]
               [3]; /* from a point relative to the geometry's origin to homogeneous coordinates, after adding shift */
    double shift[3];
    uint32_t width, height;
} nb_raster;

/* What is seen at the points of a region. */
typedef struct nb_seen {
    float nearness[NB_REGION * NB_REGION];    /* grows towards the camera */
    uint32_t triangle[NB_REGION * NB_REGION]; /* cluster * NB_CLUSTER + place in it; NB_NONE: background */
} nb_seen;

/* 1 where rasterizing is possible and pays. */
int nb_raster_is_apt(const nb_geometry *geometry, nebel_projection projection, uint32_t width, uint32_t height);

/* Call before the threads of the frame start; writes the rectangles of the geometry's clusters. */
void nb_raster_set(nb_raster *raster, nb_geometry *geometry, const nb_view *view, uint32_t width, uint32_t height,
                   int threads);

/* What is seen at the points of the region whose first pixel is (left, top). */
void nb_raster_region(const nb_raster *raster, uint32_t left, uint32_t top, const nb_region_points *points,
                      nb_seen *seen);

/* The hits of a batch, whose first pixel is (x, y) of the region. */
void nb_raster_hits(const nb_geometry *geometry, const nb_seen *seen, uint32_t x, uint32_t y, const nb_rays *rays,
                    nb_hits *hits);

#endif
