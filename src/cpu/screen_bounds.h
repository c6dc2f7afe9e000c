/* Where the geometry lies in a picture: rectangles of pixels around the triangles. */
#ifndef NB_CPU_SCREEN_BOUNDS_H
#define NB_CPU_SCREEN_BOUNDS_H

#include "embree_scene.h"
#include "region_samples.h"
#include "camera_rays.h"

/* From a point relative to the geometry's origin to homogeneous coordinates of the picture: rows * (point + shift), the
 * third of them w or, where `orthographic`, depth. */
typedef struct nb_projection {
    int orthographic;
    double rows[3][3];
    double shift[3];
} nb_projection;

/* The pixels of a picture and the samples they take. */
typedef struct nb_raster_target {
    uint32_t width, height;
    nb_sample_range range;
} nb_raster_target;

void nb_projection_set(nb_projection *projection, const nb_view *view);

/* Writes the ends of all vertices and the tree of rectangles. A rectangle holds all pixels of whose points its
 * triangle may hold one, and maybe some more. */
void nb_project_geometry(const nb_projection *projection, const nb_raster_target *picture, nb_geometry *geometry,
                         int threads);

#endif
