/* The sun at a frame, and what is lit by it. */
#include "keys/keyframes.h"
#include "scene_data.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* Opposite keys leave no direction halfway: there the nearer key's holds. */
nebel_sun nebel_interpolate_sun(const nebel_sun_key *keys, size_t count, double frame)
{
    if (keys == NULL || count == 0) return (nebel_sun){.direction = {0, 1, 0}};
    nb_keyframes around;
    if (!nb_keyframes_find(&keys->frame, sizeof *keys, count, frame, &around)) return keys[around.keys[1]].sun;
    const nebel_sun *at[4];
    nebel_sun sun;
    for (int k = 0; k < 4; k++) at[k] = &keys[around.keys[k]].sun;
    for (int c = 0; c < 3; c++) {
        const double directions[4] = {at[0]->direction[c], at[1]->direction[c], at[2]->direction[c],
                                      at[3]->direction[c]};
        const double lights[4] = {at[0]->irradiance[c], at[1]->irradiance[c], at[2]->irradiance[c],
                                  at[3]->irradiance[c]};
        sun.direction[c] = nb_keyframes_between(&around, false, directions);
        sun.irradiance[c] = nb_keyframes_between(&around, true, lights);
    }
    if (nb_vector_dot(sun.direction, sun.direction) > 1e-6)
        nb_vector_normalize(sun.direction, 3);
    else
        memcpy(sun.direction, keys[nb_keyframes_nearer(&around)].sun.direction, sizeof sun.direction);
    return sun;
}

nebel_sun nebel_get_scene_sun(const nebel_scene *scene, double frame)
{
    if (scene == NULL) return (nebel_sun){.direction = {0, 1, 0}};
    const nebel_scene_data *data = &scene->data;
    if (data->sun_key_count > 0) return nebel_interpolate_sun(data->sun_keys, data->sun_key_count, frame);
    nebel_sun sun = {.direction = {0, 1, 0}};
    if (!data->has_sun) return sun;
    memcpy(sun.direction, data->sun_direction, sizeof sun.direction);
    memcpy(sun.irradiance, data->sun_irradiance, sizeof sun.irradiance);
    return sun;
}

static bool is_sun(const nebel_sun *sun)
{
    const double square = nb_vector_dot(sun->direction, sun->direction);
    bool good = square > 0 && isfinite(square);
    for (int c = 0; c < 3; c++) good = good && sun->irradiance[c] >= 0 && isfinite(sun->irradiance[c]);
    return good;
}

nebel_result nebel_set_scene_sun(nebel_scene *scene, const nebel_sun *sun)
{
    if (scene == NULL || (sun != NULL && !is_sun(sun))) return NEBEL_ERROR_ARGUMENT;
    scene->data.has_sun = sun != NULL;
    if (sun != NULL) {
        memcpy(scene->data.sun_direction, sun->direction, sizeof sun->direction);
        memcpy(scene->data.sun_irradiance, sun->irradiance, sizeof sun->irradiance);
        nb_vector_normalize(scene->data.sun_direction, 3);
    }
    return nb_planet_light(scene);
}

nebel_result nebel_set_scene_frame(nebel_scene *scene, double frame)
{
    if (scene == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!nb_scene_is_frame(scene, frame)) return NEBEL_ERROR_VALUE;
    if (scene->data.sun_key_count == 0) return NEBEL_OK;
    const nebel_sun sun = nebel_get_scene_sun(scene, frame);
    return nebel_set_scene_sun(scene, &sun);
}
