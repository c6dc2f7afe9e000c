/* The camera at a frame: standing, turning, or on its way between keys. */
#include "keys/keyframes.h"
#include "scene_data.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

nebel_camera nb_camera_default(void)
{
    return (nebel_camera){
        .position = {0, 1.7, 0}, .look_at = {0, 1.7, -1}, .up = {0, 1, 0}, .vertical_fov = 50, .view_height = 10};
}

/* ---- directions ------------------------------------------------------------------------------ */

/* The unit view direction; zero where there is none. Halved first: the difference of two doubles may overflow. */
static void find_view(const nebel_camera *camera, double view[3])
{
    for (int i = 0; i < 3; i++) view[i] = camera->look_at[i] / 2 - camera->position[i] / 2;
    nb_vector_normalize(view, 3);
}

bool nb_camera_is_apart(const nebel_camera *camera)
{
    double view[3];
    find_view(camera, view);
    return nb_vector_dot(view, view) > .5;
}

/* Less than a millionth of a radian between up and view leaves the picture's roll to rounding. */
bool nb_camera_is_upright(const nebel_camera *camera)
{
    double view[3], up[3], side[3];
    find_view(camera, view);
    memcpy(up, camera->up, sizeof up);
    nb_vector_normalize(up, 3);
    nb_vector_cross(view, up, side);
    return nb_vector_dot(side, side) > 1e-12;
}

/* ---- keys ------------------------------------------------------------------------------------ */

/* A camera as numbers: position, look_at, up, and from FIRST_LIMITED on those that have a range to keep. */
enum { FIRST_LIMITED = 9, NUMBER_COUNT = 11 };

static void to_numbers(const nebel_camera *camera, double numbers[NUMBER_COUNT])
{
    memcpy(numbers, camera->position, sizeof camera->position);
    memcpy(numbers + 3, camera->look_at, sizeof camera->look_at);
    memcpy(numbers + 6, camera->up, sizeof camera->up);
    numbers[9] = camera->vertical_fov;
    numbers[10] = camera->view_height;
}

static nebel_camera from_numbers(const double numbers[NUMBER_COUNT], nebel_projection projection)
{
    nebel_camera camera = {.vertical_fov = numbers[9], .view_height = numbers[10], .projection = projection};
    memcpy(camera.position, numbers, sizeof camera.position);
    memcpy(camera.look_at, numbers + 3, sizeof camera.look_at);
    memcpy(camera.up, numbers + 6, sizeof camera.up);
    return camera;
}

static bool is_usable(const double numbers[NUMBER_COUNT], const nebel_camera *camera)
{
    for (int i = 0; i < NUMBER_COUNT; i++)
        if (!isfinite(numbers[i])) return false;
    return nb_camera_is_apart(camera) && nb_camera_is_upright(camera);
}

/* Between keys that look in opposite directions the cubic may pass through a place where there is no view or no up:
 * there the camera keeps the direction of the nearer key. */
static nebel_camera mend_camera(const nebel_camera *between, const nebel_camera *nearer)
{
    nebel_camera camera = *nearer;
    for (int i = 0; i < 3; i++) {
        if (!isfinite(between->position[i])) return *nearer;
        camera.position[i] = between->position[i];
        camera.look_at[i] = between->position[i] + (nearer->look_at[i] - nearer->position[i]);
    }
    return nb_camera_is_apart(&camera) && nb_camera_is_upright(&camera) ? camera : *nearer;
}

nebel_camera nebel_interpolate_camera(const nebel_camera_key *keys, size_t count, double frame)
{
    if (keys == NULL || count == 0) return nb_camera_default();
    nb_keyframes around;
    if (!nb_keyframes_find(&keys->frame, sizeof *keys, count, frame, &around)) return keys[around.keys[1]].camera;
    double at[4][NUMBER_COUNT], numbers[NUMBER_COUNT];
    for (int k = 0; k < 4; k++) to_numbers(&keys[around.keys[k]].camera, at[k]);
    for (int i = 0; i < NUMBER_COUNT; i++) {
        const double values[4] = {at[0][i], at[1][i], at[2][i], at[3][i]};
        numbers[i] = nb_keyframes_between(&around, i >= FIRST_LIMITED, values);
    }
    const nebel_camera camera = from_numbers(numbers, keys->camera.projection);
    return is_usable(numbers, &camera) ? camera : mend_camera(&camera, &keys[nb_keyframes_nearer(&around)].camera);
}

/* ---- turntable ------------------------------------------------------------------------------- */

/* Rotation by Rodrigues' formula, right-handed about up: the camera walks to its right. */
static nebel_camera turn(const nebel_camera *start, double frame, uint32_t frames)
{
    const double angle = 2 * PI * fmod(frame, frames) / frames;
    double axis[3], arm[3], side[3];
    memcpy(axis, start->up, sizeof axis);
    nb_vector_normalize(axis, 3);
    for (int i = 0; i < 3; i++) arm[i] = start->position[i] - start->look_at[i];
    nb_vector_cross(axis, arm, side);
    const double c = cos(angle), s = sin(angle), along = nb_vector_dot(axis, arm) * (1 - c);
    nebel_camera camera = *start;
    for (int i = 0; i < 3; i++) camera.position[i] = start->look_at[i] + arm[i] * c + side[i] * s + axis[i] * along;
    return camera;
}

nebel_camera nebel_get_scene_camera(const nebel_scene *scene, double frame)
{
    if (scene == NULL) return nb_camera_default();
    const nebel_scene_data *data = &scene->data;
    if (data->camera_key_count > 0) return nebel_interpolate_camera(data->camera_keys, data->camera_key_count, frame);
    const bool turns = data->turntable_frames > 0 && isfinite(frame) && fmod(frame, data->turntable_frames) != 0;
    return turns ? turn(&data->camera, frame, data->turntable_frames) : data->camera;
}
