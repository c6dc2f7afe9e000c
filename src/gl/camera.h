/* Cameras as matrices. */
#ifndef NB_GL_CAMERA_H
#define NB_GL_CAMERA_H

#include "base/base.h"
#include "base/pixel.h"

#include <nebel/gl_render.h>

/* The view whose pixel centres see what `view` sees at `point`. */
nebel_view nb_camera_move(const nebel_view *view, nb_pixel_point point);

/* a - b in float, without losing digits of what both have in common. */
void nb_camera_subtract(const double a[3], const double b[3], float difference[3]);

#endif
