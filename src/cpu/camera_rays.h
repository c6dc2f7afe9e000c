/* Cameras: which ray belongs to a point of the picture. */
#ifndef NB_CPU_CAMERA_RAYS_H
#define NB_CPU_CAMERA_RAYS_H

#include "batch_layout.h"

#include "frame/camera_axes.h"

#include <nebel/scene.h>

/* A camera made ready for one size of picture. x and y are in pixels from the top left corner of the picture.
 * Perspective: direction = corner + x step_x + y step_y with depth 1 along the view, all rays from `position`.
 * Orthographic: direction = axes.forward, the ray starts at position + corner + x step_x + y step_y.
 * Panorama: corner holds (longitude, latitude) at (0, 0), the steps their change per pixel. */
typedef struct nb_view {
    nebel_projection projection;
    double position[3]; /* m, world */
    nb_camera_axes axes;
    double corner[3], step_x[3], step_y[3];
    double start[3]; /* position relative to the origin of the geometry */
    double advance;  /* rays skip this multiple of their direction before they meet the geometry */
} nb_view;

/* The rays of a batch. */
typedef struct nb_ray_batch {
    double direction[3][NB_BATCH]; /* of any length */
    double offset[3][NB_BATCH];    /* of the ray's start from the camera's position; orthographic only */
    float length[NB_BATCH];        /* of `direction` */
    float unit[3][NB_BATCH];
    float start[3][NB_BATCH]; /* relative to the origin of the geometry, advanced */
} nb_ray_batch;

/* Checks a camera and makes it ready. Errors: VALUE. */
nebel_result nb_view_set(nb_view *view, const nebel_camera *camera, uint32_t width, uint32_t height,
                         const nebel_log *log);

/* Places the view in a geometry around `origin` whose points lie within bounds (relative to origin). A camera far
 * outside lets its rays start near the bounds: their starts then have the small rounding errors of the geometry's
 * coordinates and not those of the long way. */
void nb_view_place(nb_view *view, const double origin[3], const float bounds_min[3], const float bounds_max[3]);

/* The width of a pixel in the middle of a picture of so many rows: radians of a panorama, else metres at depth 1. */
double nb_view_pixel(const nb_view *view, uint32_t height);

/* The rays through the points left + x, top + y. */
void nb_view_rays(const nb_view *view, uint32_t left, uint32_t top, const float *x, const float *y, nb_ray_batch *rays);

/* What follows of directions that were changed. */
void nb_view_finish_rays(const nb_view *view, nb_ray_batch *rays);

#endif
