#include "gl_camera.h"

#include "frame/camera_axes.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Where the frustum of a perspective view begins [m], and where the box of an orthographic one ends. Surfaces bring
 * their own depth, so that neither costs any digits. */
static const double near_distance = 1e-6, far_distance = 1e9;

/* ---- vectors --------------------------------------------------------------------------------- */

void nb_camera_subtract(const double a[3], const double b[3], float difference[3])
{
    for (int i = 0; i < 3; i++) difference[i] = (float)(a[i] - b[i]);
}

/* ---- cameras --------------------------------------------------------------------------------- */

static void set_perspective(const nebel_camera *camera, nebel_view *view)
{
    const double scale = 1 / tan(camera->vertical_fov * (PI / 360));
    view->clip_from_eye[0] = scale * view->height / view->width;
    view->clip_from_eye[5] = scale;
    view->clip_from_eye[10] = view->clip_from_eye[11] = -1;
    view->clip_from_eye[14] = -2 * near_distance;
}

static void set_orthographic(const nebel_camera *camera, nebel_view *view)
{
    view->clip_from_eye[0] = 2 / camera->view_height * view->height / view->width;
    view->clip_from_eye[5] = 2 / camera->view_height;
    view->clip_from_eye[10] = -2 / far_distance;
    view->clip_from_eye[14] = -1;
    view->clip_from_eye[15] = 1;
}

nebel_result nb_camera_look(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
                            nebel_view *view)
{
    *view = (nebel_view){.width = width, .height = height};
    nb_camera_axes axes;
    nebel_result result = nb_camera_find_axes(camera, log, &axes);
    if (result == NEBEL_OK) result = nb_camera_check_projection(camera, log);
    if (result != NEBEL_OK) return result;
    double *const eye_from_world = view->eye_from_world;
    for (int i = 0; i < 3; i++) {
        eye_from_world[4 * i] = axes.right[i];
        eye_from_world[4 * i + 1] = axes.up[i];
        eye_from_world[4 * i + 2] = -axes.forward[i];
    }
    eye_from_world[12] = -nb_vector_dot(axes.right, camera->position);
    eye_from_world[13] = -nb_vector_dot(axes.up, camera->position);
    eye_from_world[14] = nb_vector_dot(axes.forward, camera->position);
    eye_from_world[15] = 1;
    if (camera->projection == NEBEL_PROJECTION_PERSPECTIVE) set_perspective(camera, view);
    if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) set_orthographic(camera, view);
    return NEBEL_OK;
}

nebel_result nebel_view_from_camera(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
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

double nb_camera_pixel(const nebel_view *view, int panorama)
{
    return panorama ? PI / view->height : 2 / (view->clip_from_eye[5] * view->height);
}

/* ---- samples --------------------------------------------------------------------------------- */

nebel_view nb_camera_move(const nebel_view *view, nb_pixel_position point)
{
    nebel_view moved = *view;
    for (int column = 0; column < 4; column++) {
        const double w = view->clip_from_eye[4 * column + 3];
        moved.clip_from_eye[4 * column] += (1 - 2 * point.x) / view->width * w;
        moved.clip_from_eye[4 * column + 1] += (2 * point.y - 1) / view->height * w;
    }
    return moved;
}
