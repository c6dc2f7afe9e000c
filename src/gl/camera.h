/* Cameras as matrices. */
#ifndef NB_GL_CAMERA_H
#define NB_GL_CAMERA_H

#include "base/base.h"

#include <nebel/gl_render.h>

/* Where in a pixel a sample lies, from its lower left corner. */
typedef struct nb_place {
    double x, y;
} nb_place;

/* Place `index` of `count`: the (0,2)-sequence of the CPU renderer without its shift by pixel, moved so that the
 * places' mean is the pixel's centre. */
nb_place nb_camera_place(uint32_t index, uint32_t count);

/* The view whose pixel centres see what `view` sees at `place`. */
nebel_view nb_camera_move(const nebel_view *view, nb_place place);

/* a - b in float, without losing digits of what both have in common. */
void nb_camera_subtract(const double a[3], const double b[3], float difference[3]);

/* a x b */
void nb_camera_cross(const double a[3], const double b[3], double out[3]);

/* Unit length; 0 where there is no direction. */
int nb_camera_normalize(double v[3]);

#endif
