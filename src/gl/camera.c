#include "camera.h"

#include "base/vector.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* Where the frustum of a perspective view begins [m], and where the box of an orthographic one ends. Surfaces bring
 * their own depth, so that neither costs any digits. */
static const double near_distance = 1e-6, far_distance = 1e9;

/* ---- vectors --------------------------------------------------------------------------------- */

void nb_camera_subtract(const double a[3], const double b[3], float difference[3])
{
    for (int i = 0; i < 3; i++) difference[i] = (float)(a[i] - b[i]);
}

static int is_finite(const double v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

/* ---- cameras --------------------------------------------------------------------------------- */

/* Across the view where `up` is along it: the axis that is farthest from it tells. */
static void choose_right(const double forward[3], double right[3])
{
    int least = 0;
    for (int i = 1; i < 3; i++) {
        if (fabs(forward[i]) < fabs(forward[least])) least = i;
    }
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    nb_vector_cross(forward, axis, right);
    (void)nb_vector_make_unit(right);
}

static nebel_result set_axes(const nebel_camera *camera, const nebel_log *log, double eye_from_world[16])
{
    double forward[3], up[3], right[3];
    if (!is_finite(camera->position) || !is_finite(camera->look_at) || !is_finite(camera->up)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: position, look_at and up must be finite numbers");
    }
    for (int i = 0; i < 3; i++) {
        forward[i] = camera->look_at[i] - camera->position[i];
        up[i] = camera->up[i];
    }
    if (!nb_vector_make_unit(forward)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: look_at is where the camera stands; move one of the two");
    }
    if (!nb_vector_make_unit(up)) return nb_fail(log, NEBEL_ERROR_VALUE, "camera: up has no direction");
    nb_vector_cross(forward, up, right);
    if (!(nb_vector_dot(right, right) > 1e-20) || !nb_vector_make_unit(right)) choose_right(forward, right);
    nb_vector_cross(right, forward, up);
    for (int i = 0; i < 3; i++) {
        eye_from_world[4 * i] = right[i];
        eye_from_world[4 * i + 1] = up[i];
        eye_from_world[4 * i + 2] = -forward[i];
        eye_from_world[4 * i + 3] = 0;
    }
    eye_from_world[12] = -nb_vector_dot(right, camera->position);
    eye_from_world[13] = -nb_vector_dot(up, camera->position);
    eye_from_world[14] = nb_vector_dot(forward, camera->position);
    eye_from_world[15] = 1;
    return NEBEL_OK;
}

static nebel_result set_perspective(const nebel_camera *camera, const nebel_log *log, nebel_view *view)
{
    if (!(camera->vertical_fov > 0 && camera->vertical_fov < 180)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: vertical_fov is %g, it must be above 0 and below 180 degrees",
                       camera->vertical_fov);
    }
    const double scale = 1 / tan(camera->vertical_fov * (pi / 360));
    view->clip_from_eye[0] = scale * view->height / view->width;
    view->clip_from_eye[5] = scale;
    view->clip_from_eye[10] = view->clip_from_eye[11] = -1;
    view->clip_from_eye[14] = -2 * near_distance;
    return NEBEL_OK;
}

static nebel_result set_orthographic(const nebel_camera *camera, const nebel_log *log, nebel_view *view)
{
    if (!(camera->view_height > 0) || isinf(camera->view_height)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: view_height is %g, it must be above 0 metres",
                       camera->view_height);
    }
    view->clip_from_eye[0] = 2 / camera->view_height * view->height / view->width;
    view->clip_from_eye[5] = 2 / camera->view_height;
    view->clip_from_eye[10] = -2 / far_distance;
    view->clip_from_eye[14] = -1;
    view->clip_from_eye[15] = 1;
    return NEBEL_OK;
}

nebel_result nb_camera_look(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
                            nebel_view *view)
{
    *view = (nebel_view){.width = width, .height = height};
    const nebel_result result = set_axes(camera, log, view->eye_from_world);
    if (result != NEBEL_OK) return result;
    switch (camera->projection) {
    case NEBEL_PROJECTION_PERSPECTIVE:
        return set_perspective(camera, log, view);
    case NEBEL_PROJECTION_ORTHOGRAPHIC:
        return set_orthographic(camera, log, view);
    case NEBEL_PROJECTION_PANORAMA:
        return NEBEL_OK;
    }
    return nb_fail(log, NEBEL_ERROR_VALUE, "camera: there is no projection %d", (int)camera->projection);
}

nebel_result nebel_gl_camera_view(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
                                  nebel_view *view)
{
    const nebel_log silent = {0};
    if (log == NULL) log = &silent;
    if (camera == NULL || view == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "camera: it or the view is NULL");
    if (width < 1 || height < 1) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "camera: a picture of no size");
    if (camera->projection == NEBEL_PROJECTION_PANORAMA) {
        return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                       "camera: no matrix makes a panorama; take six perspective views, or nebel_gl_render_frame");
    }
    return nb_camera_look(camera, width, height, log, view);
}

/* ---- samples --------------------------------------------------------------------------------- */

nebel_view nb_camera_move(const nebel_view *view, nb_pixel_point point)
{
    nebel_view moved = *view;
    for (int column = 0; column < 4; column++) {
        const double w = view->clip_from_eye[4 * column + 3];
        moved.clip_from_eye[4 * column] += (1 - 2 * point.x) / view->width * w;
        moved.clip_from_eye[4 * column + 1] += (2 * point.y - 1) / view->height * w;
    }
    return moved;
}
