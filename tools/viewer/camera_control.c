#include "camera_control.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* Nearer to `up` the view would roll over; further in, what is looked at would be reached. */
static const double steepest = 1.55, nearest = 1e-3, farthest = 1e9;

typedef struct axes {
    double right[3], up[3], forward[3]; /* unit; up is the camera's own, across the view */
    double pole[3];                     /* unit, along camera.up */
    double distance;
} axes;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double normalize(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int i = 0; i < 3 && length > 0; i++) v[i] /= length;
    return length;
}

static axes find_axes(const nebel_camera *camera)
{
    axes found;
    for (int i = 0; i < 3; i++) {
        found.forward[i] = camera->look_at[i] - camera->position[i];
        found.pole[i] = camera->up[i];
    }
    found.distance = normalize(found.forward);
    (void)normalize(found.pole);
    cross(found.forward, found.pole, found.right);
    (void)normalize(found.right);
    cross(found.right, found.forward, found.up);
    return found;
}

/* The direction of view turned by `right` about the pole and lifted by `up`, both in radians. */
static void turn(const axes *from, double right, double up, double out[3])
{
    const double height = asin(fmax(-1, fmin(1, dot(from->forward, from->pole))));
    const double lifted = fmax(-steepest, fmin(steepest, height + up));
    double ahead[3];
    cross(from->pole, from->right, ahead);
    for (int i = 0; i < 3; i++) {
        const double level = ahead[i] * cos(right) + from->right[i] * sin(right);
        out[i] = level * cos(lifted) + from->pole[i] * sin(lifted);
    }
}

void nb_navigate_orbit(nebel_camera *camera, double right, double up)
{
    const axes from = find_axes(camera);
    double view[3];
    turn(&from, right, up, view);
    for (int i = 0; i < 3; i++) camera->position[i] = camera->look_at[i] - view[i] * from.distance;
}

void nb_navigate_look(nebel_camera *camera, double right, double up)
{
    const axes from = find_axes(camera);
    double view[3];
    turn(&from, right, up, view);
    for (int i = 0; i < 3; i++) camera->look_at[i] = camera->position[i] + view[i] * from.distance;
}

static void move(nebel_camera *camera, const axes *from, const double way[3])
{
    for (int i = 0; i < 3; i++) {
        const double step = from->right[i] * way[0] + from->up[i] * way[1] + from->forward[i] * way[2];
        camera->position[i] += step;
        camera->look_at[i] += step;
    }
}

void nb_navigate_pan(nebel_camera *camera, double right, double up)
{
    const axes from = find_axes(camera);
    const double seen = camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC
                            ? camera->view_height
                            : 2 * from.distance * tan(camera->vertical_fov * pi / 360);
    move(camera, &from, (const double[3]){right * seen, up * seen, 0});
}

void nb_navigate_dolly(nebel_camera *camera, double factor)
{
    if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) {
        camera->view_height = fmax(nearest, fmin(farthest, camera->view_height * factor));
        return;
    }
    const axes from = find_axes(camera);
    const double distance = fmax(nearest, fmin(farthest, from.distance * factor));
    for (int i = 0; i < 3; i++) camera->position[i] = camera->look_at[i] - from.forward[i] * distance;
}

void nb_navigate_fly(nebel_camera *camera, const double way[3])
{
    const axes from = find_axes(camera);
    move(camera, &from, way);
}

double nb_navigate_distance(const nebel_camera *camera)
{
    return find_axes(camera).distance;
}

nebel_camera nb_navigate_round(nebel_camera camera)
{
    const double step = pow(10, floor(log10(nb_navigate_distance(&camera))) - 5);
    for (int i = 0; i < 3; i++) {
        camera.position[i] = rint(camera.position[i] / step) * step;
        camera.look_at[i] = rint(camera.look_at[i] / step) * step;
    }
    camera.view_height = rint(camera.view_height / step) * step;
    return camera;
}
