/* The light of a scene, in float, as renderers want it. */
#ifndef NB_FRAME_SURFACE_LIGHTING_H
#define NB_FRAME_SURFACE_LIGHTING_H

#include "base/base.h"
#include "math/vector.h"

#include <nebel/scene.h>

typedef struct nb_surface_lighting {
    float background[3], ambient[3];
    nebel_environment environment; /* whatever its type: all ambient light */
    int shows_ambient;             /* where no surface is, in place of the background; which is the same light where
                                      the environment is constant */
    float sun[3], sunlight[3];     /* 0 where there is no sun; sunlight: its irradiance over pi */
    double sun_direction[3];
    int has_sun;
} nb_surface_lighting;

/* All the ambient light of a scene, whatever its type. */
static inline nebel_environment nb_surface_lighting_environment(const nebel_scene_data *scene)
{
    nebel_environment environment = scene->environment;
    for (int c = 0; c < 3 && environment.type == NEBEL_ENVIRONMENT_CONSTANT; c++)
        environment.radiance[c] = scene->ambient[c];
    return environment;
}

/* Whether ambient light is the planet's sky. */
static inline int nb_surface_lighting_owns_ambient(const nebel_scene_data *scene)
{
    return scene->environment.type == NEBEL_ENVIRONMENT_MAP && scene->environment_path == NULL;
}

/* Above all air; where there is none one of no light. */
static inline nebel_sun nb_surface_lighting_sun(const nebel_scene_data *scene)
{
    nebel_sun sun = {.direction = {0, 1, 0}};
    for (int c = 0; c < 3 && scene->has_sun; c++) {
        sun.direction[c] = scene->sun_direction[c];
        sun.irradiance[c] = scene->sun_irradiance[c];
    }
    return sun;
}

static inline int nb_surface_lighting_is_light(const double rgb[3])
{
    return rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0 && isfinite(rgb[0] + rgb[1] + rgb[2]);
}

/* Errors: VALUE. */
static inline nebel_result nb_surface_lighting_set(nb_surface_lighting *lighting, const nebel_scene_data *scene,
                                                   const nebel_log *log)
{
    double direction[3] = {scene->sun_direction[0], scene->sun_direction[1], scene->sun_direction[2]};
    if (!nb_surface_lighting_is_light(scene->background) || !nb_surface_lighting_is_light(scene->ambient) ||
        (scene->has_sun && !nb_surface_lighting_is_light(scene->sun_irradiance))) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "scene: background, ambient and sun must be finite and not negative");
    }
    for (size_t i = 0; i < scene->light_count; i++) {
        const nebel_light *light = &scene->lights[i];
        if (!nb_surface_lighting_is_light(light->intensity) ||
            !isfinite(light->position[0] + light->position[1] + light->position[2]))
            return nb_fail(log, NEBEL_ERROR_VALUE,
                           "scene: light %zu: place and intensity must be finite, intensity not negative", i);
    }
    lighting->environment = nb_surface_lighting_environment(scene);
    lighting->shows_ambient = scene->shows_ambient;
    lighting->has_sun = scene->has_sun != 0;
    if (lighting->has_sun && !nb_vector_make_unit(direction)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "scene: sun_direction has no direction");
    }
    for (int c = 0; c < 3; c++) {
        lighting->background[c] = (float)(scene->shows_ambient ? scene->ambient : scene->background)[c];
        lighting->ambient[c] = (float)scene->ambient[c];
        lighting->sunlight[c] = lighting->has_sun ? (float)(scene->sun_irradiance[c] * 0.31830988618379067) : 0;
        lighting->sun_direction[c] = lighting->has_sun ? direction[c] : 0;
        lighting->sun[c] = (float)lighting->sun_direction[c];
    }
    return NEBEL_OK;
}

#endif
