#include "camera_rays.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* Steps of a plane of the given height, one unit before the camera or through it. */
static void set_plane(nb_view *view, double plane_height, int through_camera, uint32_t width, uint32_t height)
{
    const double pixel = plane_height / height;
    for (int i = 0; i < 3; i++) {
        view->step_x[i] = pixel * view->axes.right[i];
        view->step_y[i] = -pixel * view->axes.up[i];
        view->corner[i] =
            (through_camera ? 0 : view->axes.forward[i]) - .5 * width * view->step_x[i] - .5 * height * view->step_y[i];
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
    nebel_result result = nb_camera_find_axes(camera, log, &view->axes);
    if (result == NEBEL_OK) result = nb_camera_check_projection(camera, log);
    if (result != NEBEL_OK) return result;
    memcpy(view->position, camera->position, sizeof view->position);
    view->projection = camera->projection;
    if (camera->projection == NEBEL_PROJECTION_PERSPECTIVE)
        set_plane(view, 2 * tan(camera->vertical_fov * (pi / 360)), 0, width, height);
    else if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC)
        set_plane(view, camera->view_height, 1, width, height);
    else
        set_panorama(view, width, height);
    return NEBEL_OK;
}

/* The least distance from the view's start to a box, along the view or, for a panorama, in any direction. */
static double distance_to(const nb_view *view, const float bounds_min[3], const float bounds_max[3])
{
    double depth = 0, gap2 = 0;
    for (int i = 0; i < 3; i++) {
        const double low = (double)bounds_min[i] - view->start[i], high = (double)bounds_max[i] - view->start[i];
        const double gap = fmax(0, fmax(low, -high));
        gap2 += gap * gap;
        depth += fmin(low * view->axes.forward[i], high * view->axes.forward[i]);
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

static void orthographic_directions(const nb_view *view, nb_ray_batch *rays)
{
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < NB_BATCH; i++) rays->direction[c][i] = view->axes.forward[c];
    }
}

static void panorama_directions(const nb_view *view, const double base[3], const float *x, const float *y,
                                nb_ray_batch *rays)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const double longitude = base[0] + (double)x[i] * view->step_x[0];
        const double latitude = base[1] + (double)y[i] * view->step_y[1];
        const double level = cos(latitude);
        const double along = level * cos(longitude), across = level * sin(longitude), above = sin(latitude);
        for (int c = 0; c < 3; c++) {
            rays->direction[c][i] =
                along * view->axes.forward[c] + across * view->axes.right[c] + above * view->axes.up[c];
        }
    }
}

NB_CLONES static void set_units(nb_ray_batch *rays)
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

NB_CLONES static void set_camera_starts(const nb_view *view, nb_ray_batch *rays)
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

double nb_view_pixel(const nb_view *view, uint32_t height)
{
    return view->projection == NEBEL_PROJECTION_PANORAMA ? pi / height : nb_vector_length(view->step_y);
}

void nb_view_finish_rays(const nb_view *view, nb_ray_batch *rays)
{
    set_units(rays);
    set_camera_starts(view, rays);
}

void nb_view_rays(const nb_view *view, uint32_t left, uint32_t top, const float *x, const float *y, nb_ray_batch *rays)
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
    nb_view_finish_rays(view, rays);
}
