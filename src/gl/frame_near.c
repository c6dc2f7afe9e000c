/* Parallel rays show the same picture from anywhere along them. The eye goes up to what is seen, because floats hold places relative to it. */
#include "gl_frame.h"

#include "frame/camera_axes.h"

/* Depth along the view of the nearest of some places. */
static double least_depth(const nb_camera_axes *axes, const double from[3], const double low[3], const double high[3])
{
    double depth = 0;
    for (int i = 0; i < 3; i++)
        depth += fmin(axes->forward[i] * (low[i] - from[i]), axes->forward[i] * (high[i] - from[i]));
    return depth;
}

static double depth_of_particles(const nb_particles *particles, const nb_camera_axes *axes, const double from[3])
{
    double least = HUGE_VAL;
    for (size_t i = 0; i < particles->count; i++) {
        const nebel_particle *const p = &particles->list[i];
        least = fmin(least, least_depth(axes, from, p->center, p->center) - p->radius);
    }
    return least;
}

static double depth_of_fog(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    const nebel_log silent = {0};
    nebel_view view;
    nebel_view_error error;
    if (r->fog == NULL) return HUGE_VAL;
    if (nb_camera_look(&desc->camera, desc->width, desc->height, &silent, &view) != NEBEL_OK) return 0;
    return nebel_find_view_error(nebel_get_lighting_snapshot(r->fog), &view, &error) == NEBEL_OK ? error.clear : 0;
}

/* Before surfaces there is room for the rounding of their places, lest they are behind the eye. */
static double depth_of_meshes(const nb_meshes *meshes, const nb_camera_axes *axes, const double from[3])
{
    double extent = 0;
    if (!(meshes->low[0] <= meshes->high[0])) return HUGE_VAL;
    for (int i = 0; i < 3; i++) extent = fmax(extent, meshes->high[i] - meshes->low[i]);
    return least_depth(axes, from, meshes->low, meshes->high) - 1e-3 * extent;
}

/* Other methods and planets count from where the camera stands. */
static int may_go(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    return desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC && desc->method == NEBEL_GL_METHOD_EXACT &&
           r->scene->planet_count == 0;
}

double nb_gl_frame_go_near(const nebel_gl_renderer *r, nebel_camera *camera, const nebel_gl_frame_desc *desc)
{
    const nebel_log silent = {0};
    nb_camera_axes axes;
    if (!may_go(r, desc) || nb_camera_find_axes(camera, &silent, &axes) != NEBEL_OK) return 0;
    double ahead = depth_of_meshes(&r->meshes, &axes, camera->position);
    ahead = fmin(ahead, depth_of_particles(&r->particles, &axes, camera->position));
    ahead = fmin(ahead, depth_of_fog(r, desc)) - camera->view_height;
    if (!(ahead > 0 && isfinite(ahead))) return 0;
    for (int i = 0; i < 3; i++) {
        camera->position[i] += ahead * axes.forward[i];
        camera->look_at[i] += ahead * axes.forward[i];
    }
    return ahead;
}
