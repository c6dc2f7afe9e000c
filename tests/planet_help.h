/* What tests of planets share: a camera above the ground, the rays through its pixels, a sky, fog in the air. */
#ifndef PLANET_HELP_H
#define PLANET_HELP_H

#include "fog_help.h"

#include <nebel/light.h>
#include <nebel/nebel.h>
#include <nebel/render.h>

#include <math.h>
#include <string.h>

/* A camera above the origin that looks along -z, raised by a pitch (radians). */
static inline nebel_camera planet_camera(double height, double pitch)
{
    return (nebel_camera){.position = {0, height, 0},
                          .look_at = {0, height + sin(pitch), -cos(pitch)},
                          .up = {0, 1, 0},
                          .vertical_fov = 60};
}

/* The ray through the middle of a pixel of a picture of that camera; computed apart from the renderers' own. */
static inline nebel_ray planet_ray(const nebel_camera *camera, double pitch, uint32_t x, uint32_t y, uint32_t width,
                                   uint32_t height)
{
    const double half = tan(30 * acos(-1) / 180), across = (2 * (x + .5) / width - 1) * half * width / height,
                 up = (1 - 2 * (y + .5) / height) * half;
    nebel_ray ray = {.t_max = HUGE_VAL};
    memcpy(ray.origin, camera->position, sizeof ray.origin);
    ray.direction[0] = across;
    ray.direction[1] = sin(pitch) + up * cos(pitch);
    ray.direction[2] = -cos(pitch) + up * sin(pitch);
    return ray;
}

/* Gives a scene a sky that is everywhere as bright, of a planet's own kind; to be released. */
static inline nebel_environment_map *planet_even_sky(nebel_scene_data *scene)
{
    static float pixels[4 * 2 * 3];
    nebel_environment_map *map;
    for (int i = 0; i < 4 * 2 * 3; i++) pixels[i] = (float)(.1 + .05 * (i % 3));
    assert_int_equal(
        nebel_create_environment_map(&(nebel_environment_map_desc){.width = 4, .height = 2, .pixels = pixels}, &map),
        NEBEL_OK);
    scene->environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = 1};
    return map;
}

/* A ball that shines, far before the camera, in a lit height fog. */
static inline nebel_lighting *planet_fog(const double to_sun[3])
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 3000, -9000}, .radius = 2500},
         .extinction = {4e-4, 4e-4, 4e-4},
         .source = {.5, .4, .3}},
        {.shape = {.type = NEBEL_SHAPE_WORLD},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 200},
         .extinction = {1e-4, 2e-4, 3e-4},
         .albedo = {.9, .9, .9}}};
    const nebel_lighting_desc lights = {
        .sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {2, 1.5, 1}}};
    return fog_commit_lit(&(nebel_fog_desc){0}, volumes, 2, &lights);
}

/* Mist around a whole planet, which thins out upwards. */
static inline nebel_lighting *planet_mist(double radius, const double to_sun[3])
{
    const nebel_volume_desc mist = {
        .shape = {.type = NEBEL_SHAPE_WORLD},
        .density = {.type = NEBEL_DENSITY_ALTITUDE, .center = {0, -radius, 0}, .radius = radius, .scale_height = 400},
        .extinction = {.002, .002, .002},
        .albedo = {.95, .95, .95}};
    const nebel_lighting_desc lights = {
        .sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {5, 4, 3}}};
    return fog_commit_lit(&(nebel_fog_desc){0}, &mist, 1, &lights);
}

#endif
