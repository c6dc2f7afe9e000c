/* Cameras as matrices. */
#ifndef NB_GL_GL_CAMERA_H
#define NB_GL_GL_CAMERA_H

#include "base/base.h"
#include "frame/pixel_samples.h"

#include <nebel/gl.h>

/* The view of a camera as nebel_view_from_camera makes it; of a panorama its size and eye_from_world alone, clip_from_eye
 * 0. */
nebel_result nb_camera_look(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
                            nebel_view *view);

/* How wide a pixel is in the middle of a view at distance 1; of an orthographic one at any. */
double nb_camera_pixel(const nebel_view *view, int panorama);

/* The view whose pixel centres see what `view` sees at `point`. */
nebel_view nb_camera_move(const nebel_view *view, nb_pixel_position point);

/* a - b in float, without losing digits of what both have in common. */
void nb_camera_subtract(const double a[3], const double b[3], float difference[3]);

#endif
