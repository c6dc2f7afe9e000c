#include "view.h"

#include "base/base.h"
#include "base/vector.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

static int is_finite(const double v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

/* A horizontal direction where `up` is along the view: the axis that is farthest from it. */
static void choose_right(nb_view *view)
{
    int least = 0;
    for (int i = 1; i < 3; i++) {
        if (fabs(view->forward[i]) < fabs(view->forward[least])) least = i;
    }
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    nb_vector_cross(view->forward, axis, view->right);
    nb_vector_make_unit(view->right);
}

static nebel_result set_axes(nb_view *view, const nebel_camera *camera, const nebel_log *log)
{
    if (!is_finite(camera->position) || !is_finite(camera->look_at) || !is_finite(camera->up)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: position, look_at and up must be finite numbers");
    }
    double up[3];
    for (int i = 0; i < 3; i++) {
        view->position[i] = camera->position[i];
        view->forward[i] = camera->look_at[i] - camera->position[i];
        up[i] = camera->up[i];
    }
    if (!nb_vector_make_unit(view->forward)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "camera: look_at is where the camera stands; move one of the two");
    }
    if (!nb_vector_make_unit(up)) return nb_fail(log, NEBEL_ERROR_VALUE, "camera: up has no direction");
    nb_vector_cross(view->forward, up, view->right);
    if (!(nb_vector_dot(view->right, view->right) > 1e-20) || !nb_vector_make_unit(view->right)) choose_right(view);
    nb_vector_cross(view->right, view->forward, view->up);
    return NEBEL_OK;
}

/* Steps of a plane of the given height, one unit before the camera or through it. */
static void set_plane(nb_view *view, double plane_height, int through_camera, uint32_t width, uint32_t height)
{
    const double pixel = plane_height / height;
    for (int i = 0; i < 3; i++) {
        view->step_x[i] = pixel * view->right[i];
        view->step_y[i] = -pixel * view->up[i];
        view->corner[i] =
            (through_camera ? 0 : view->forward[i]) - .5 * width * view->step_x[i] - .5 * height * view->step_y[i];
    }
}

static void set_panorama(nb_view *view, uint32_t width, uint32_t height)
{
    const double corner[3] = {-pi, .5 * pi, 0}, step_x[3] = {2 * pi / width, 0, 0}, step_y[3] = {0, -pi / height, 0};
    for (int i = 0; i < 3; i++) {
        view->corner[i] = corner[i];
        view->step_x[i] = step_x[i];
        view->step_y[i] = step_y[i];
    }
}

nebel_result nb_view_set(nb_view *view, const nebel_camera *camera, uint32_t width, uint32_t height,
                         const nebel_log *log)
{
    const nebel_result result = set_axes(view, camera, log);
    if (result != NEBEL_OK) return result;
    view->projection = camera->projection;
    switch (camera->projection) {
    case NEBEL_PROJECTION_PERSPECTIVE:
        if (!(camera->vertical_fov > 0 && camera->vertical_fov < 180)) {
            return nb_fail(log, NEBEL_ERROR_VALUE,
                           "camera: vertical_fov is %g, it must be above 0 and below 180 degrees",
                           camera->vertical_fov);
        }
        set_plane(view, 2 * tan(camera->vertical_fov * (pi / 360)), 0, width, height);
        return NEBEL_OK;
    case NEBEL_PROJECTION_ORTHOGRAPHIC:
        if (!(camera->view_height > 0) || isinf(camera->view_height)) {
            return nb_fail(log, NEBEL_ERROR_VALUE, "camera: view_height is %g, it must be above 0 metres",
                           camera->view_height);
        }
        set_plane(view, camera->view_height, 1, width, height);
        return NEBEL_OK;
    case NEBEL_PROJECTION_PANORAMA:
        set_panorama(view, width, height);
        return NEBEL_OK;
    }
    return nb_fail(log, NEBEL_ERROR_VALUE, "camera: there is no projection %d", (int)camera->projection);
}

/* The least distance from the view's start to a box, along the view or, for a panorama, in any direction. */
static double distance_to(const nb_view *view, const float bounds_min[3], const float bounds_max[3])
{
    double depth = 0, gap2 = 0;
    for (int i = 0; i < 3; i++) {
        const double low = (double)bounds_min[i] - view->start[i], high = (double)bounds_max[i] - view->start[i];
        const double gap = fmax(0, fmax(low, -high));
        gap2 += gap * gap;
        depth += fmin(low * view->forward[i], high * view->forward[i]);
    }
    return view->projection == NEBEL_PROJECTION_PANORAMA ? sqrt(gap2) : depth;
}

void nb_view_place(nb_view *view, const double origin[3], const float bounds_min[3], const float bounds_max[3])
{
    double size2 = 0;
    for (int i = 0; i < 3; i++) {
        const double side = (double)bounds_max[i] - (double)bounds_min[i];
        view->start[i] = view->position[i] - origin[i];
        size2 += side * side;
    }
    const double size = sqrt(size2), distance = distance_to(view, bounds_min, bounds_max);
    view->advance = distance > size ? distance - .01 * size : 0;
}

/* v = base + x step_x + y step_y */
NB_CLONES static void plane_points(const nb_view *view, const double *restrict base, const float *restrict x,
                                   const float *restrict y, double (*restrict v)[NB_BATCH])
{
    for (int c = 0; c < 3; c++) {
        const double first = base[c], step_x = view->step_x[c], step_y = view->step_y[c];
        double *restrict out = v[c];
        NB_SIMD
        for (int i = 0; i < NB_BATCH; i++) out[i] = first + (double)x[i] * step_x + (double)y[i] * step_y;
    }
}

static void orthographic_directions(const nb_view *view, nb_rays *rays)
{
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < NB_BATCH; i++) rays->direction[c][i] = view->forward[c];
    }
}

static void panorama_directions(const nb_view *view, const double base[3], const float *x, const float *y,
                                nb_rays *rays)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const double longitude = base[0] + (double)x[i] * view->step_x[0];
        const double latitude = base[1] + (double)y[i] * view->step_y[1];
        const double level = cos(latitude);
        const double along = level * cos(longitude), across = level * sin(longitude), above = sin(latitude);
        for (int c = 0; c < 3; c++) {
            rays->direction[c][i] = along * view->forward[c] + across * view->right[c] + above * view->up[c];
        }
    }
}

NB_CLONES static void set_units(nb_rays *rays)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float x = (float)rays->direction[0][i], y = (float)rays->direction[1][i],
                    z = (float)rays->direction[2][i];
        const float length = sqrtf(x * x + y * y + z * z);
        const float scale = 1 / length;
        rays->length[i] = length;
        rays->unit[0][i] = x * scale;
        rays->unit[1][i] = y * scale;
        rays->unit[2][i] = z * scale;
    }
}

NB_CLONES static void set_starts(const nb_view *view, nb_rays *rays)
{
    const int orthographic = view->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    for (int c = 0; c < 3; c++) {
        const double start = view->start[c], advance = view->advance;
        float *restrict out = rays->start[c];
        const double *restrict direction = rays->direction[c], *restrict offset = rays->offset[c];
        if (orthographic) {
            NB_SIMD
            for (int i = 0; i < NB_BATCH; i++) {
                out[i] = nb_clamp_coordinate((float)(start + offset[i] + advance * direction[i]));
            }
        } else {
            NB_SIMD
            for (int i = 0; i < NB_BATCH; i++) {
                out[i] = nb_clamp_coordinate((float)(start + advance * direction[i]));
            }
        }
    }
}

void nb_view_rays(const nb_view *view, uint32_t left, uint32_t top, const float *x, const float *y, nb_rays *rays)
{
    double base[3];
    for (int c = 0; c < 3; c++) base[c] = view->corner[c] + left * view->step_x[c] + top * view->step_y[c];
    switch (view->projection) {
    case NEBEL_PROJECTION_PERSPECTIVE:
        plane_points(view, base, x, y, rays->direction);
        break;
    case NEBEL_PROJECTION_ORTHOGRAPHIC:
        plane_points(view, base, x, y, rays->offset);
        orthographic_directions(view, rays);
        break;
    case NEBEL_PROJECTION_PANORAMA:
        panorama_directions(view, base, x, y, rays);
        break;
    }
    set_units(rays);
    set_starts(view, rays);
}
