/* What every renderer makes of a camera. */
#ifndef NB_FRAME_CAMERA_AXES_H
#define NB_FRAME_CAMERA_AXES_H

#include "base/base.h"
#include "math/vector.h"

#include <nebel/scene.h>

/* Unit vectors in the world. */
typedef struct nb_camera_axes {
    double right[3], up[3], forward[3];
} nb_camera_axes;

static inline int nb_camera_is_finite(const double v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

/* Across the view where `up` is along it: the axis that is farthest from it tells. */
static inline void nb_camera_choose_right(nb_camera_axes *axes)
{
    int least = 0;
    for (int i = 1; i < 3; i++) {
        if (fabs(axes->forward[i]) < fabs(axes->forward[least])) least = i;
    }
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    nb_vector_cross(axes->forward, axis, axes->right);
    (void)nb_vector_make_unit(axes->right);
}

/* Errors: VALUE. */
static inline nebel_result nb_camera_find_axes(const nebel_camera *camera, const nebel_log *log, nb_camera_axes *axes)
{
    double up[3];
    if (!nb_camera_is_finite(camera->position) || !nb_camera_is_finite(camera->look_at) ||
        !nb_camera_is_finite(camera->up)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: position, look_at and up must be finite numbers");
    }
    for (int i = 0; i < 3; i++) {
        axes->forward[i] = camera->look_at[i] - camera->position[i];
        up[i] = camera->up[i];
    }
    if (!nb_vector_make_unit(axes->forward)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: look_at is where the camera stands; move one of the two");
    }
    if (!nb_vector_make_unit(up)) return nb_fail(log, NEBEL_ERROR_VALUE, "camera: up has no direction");
    nb_vector_cross(axes->forward, up, axes->right);
    if (!(nb_vector_dot(axes->right, axes->right) > 1e-20) || !nb_vector_make_unit(axes->right))
        nb_camera_choose_right(axes);
    nb_vector_cross(axes->right, axes->forward, axes->up);
    return NEBEL_OK;
}

/* Whether there is such a projection, of such a size. Errors: VALUE. */
static inline nebel_result nb_camera_check_projection(const nebel_camera *camera, const nebel_log *log)
{
    switch (camera->projection) {
    case NEBEL_PROJECTION_PERSPECTIVE:
        if (camera->vertical_fov > 0 && camera->vertical_fov < 180) return NEBEL_OK;
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: vertical_fov is %g, it must be above 0 and below 180 degrees",
                       camera->vertical_fov);
    case NEBEL_PROJECTION_ORTHOGRAPHIC:
        if (camera->view_height > 0 && isfinite(camera->view_height)) return NEBEL_OK;
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: view_height is %g, it must be above 0 metres",
                       camera->view_height);
    case NEBEL_PROJECTION_PANORAMA:
        return NEBEL_OK;
    }
    return nb_fail(log, NEBEL_ERROR_VALUE, "camera: there is no projection %d", (int)camera->projection);
}

#endif
