/* Panoramas: longitude to the right, latitude upwards, counted in quarter turns from the view's direction. No matrix
 * makes them, so that whatever is drawn brings a box of longitude and latitude around itself, and each pixel of the box
 * asks whether its ray hits. */
#ifndef NB_GL_GL_PANORAMA_H
#define NB_GL_GL_PANORAMA_H

#include "frame/pixel_samples.h"

#include <nebel/shader.h>

/* GLSL. What stands before RAY: RAY_WORD(i), a vec3 of the words below.
 *
 *     RAY:  vec3 ray_origin(vec2 pixel), vec3 ray_direction(vec2 pixel)
 *     BOX:  behind RAY, for vertices; of strips of ten: vec4 box_corner(vec4 box, int vertex), boxes of three
 * directions and of a cone around one TILE: for fragments; where the lists of a ray's tile begin, in the texture of
 * tiles */
extern const char nb_panorama_ray_text[], nb_panorama_box_text[], nb_panorama_tile_text[];

enum { NB_PANORAMA_STRIP = 10 };

/* The words of a panorama seen from `eye` through `point` of each pixel. Of `view` the size and the axes of
 * eye_from_world count.
 *
 *     0: longitude and latitude of the pixels' corner at (0, 0); 1: what they grow by from pixel to pixel
 *     3, 4, 5: forward, right, up */
void nb_panorama_rays(const nebel_view *view, const double eye[3], nb_pixel_position point, nebel_rays *rays);

/* The direction through a place of the picture, as the text has it. */
void nb_panorama_direction(const nebel_rays *rays, double x, double y, double direction[3]);

/* The same in double, from the lower left corner of a picture with the size and the axes of a view. */
void nb_panorama_look(const nebel_view *view, double x, double y, double direction[3]);

/* Six views from an eye, along the axes of the world, which see all around: for lists of volumes. Two for each axis,
 * first along it; pixels are at most about as wide as those of a panorama of this size. */
void nb_panorama_faces(const double eye[3], uint32_t width, uint32_t height, nebel_view faces[6]);

#endif
