/* Planets with air as a camera sees them, in the order in which rays pass them. */
#ifndef NB_AERIAL_PLANETS_H
#define NB_AERIAL_PLANETS_H

#include "irradiance_table.h"
#include "eclipse.h"
#include "math/vector.h"

#include <nebel/scene.h>

typedef struct nb_planet {
    const nebel_planet *planet;
    double center[3], radius, top; /* m; top: of its air, from the centre */
    nebel_sky_view *view;
    nb_irradiance_table *daylight; /* NULL: there are no models in sunlight */
} nb_planet;

/* The power of a place with regard to the ball of a planet's air: the square of a tangent's length. Where two balls that do
 * not overlap have the same is a plane between them, so that seen from a place a ball is never behind one of larger power
 * (Edelsbrunner, An acyclicity theorem for cell complexes in d dimension, 1990). */
static inline double nb_planet_power(const nb_planet *world, const double place[3])
{
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = place[c] - world->center[c];
    const double far = nb_vector_length(from);
    return (far - world->top) * (far + world->top);
}

static inline nb_planet nb_planet_of(const nebel_planet *planet)
{
    nb_planet world = {.planet = planet,
                       .radius = planet->atmosphere_desc.radius,
                       .top = planet->atmosphere_desc.radius + planet->atmosphere_desc.thickness};
    nb_sphere_center_below(planet->atmosphere_desc.ground_point, planet->atmosphere_desc.radius, world.center);
    return world;
}

/* Planets that are loaded: whatever ray leaves the position, it passes none after a later one. Without view and daylight.
 * Returns how many. */
static inline int nb_planets_set(nb_planet worlds[NEBEL_MAX_PLANETS], const nebel_scene_data *scene,
                                 const double position[3])
{
    int count = 0;
    for (size_t i = 0; i < scene->planet_count && i < NEBEL_MAX_PLANETS; i++) {
        if (scene->planets[i].atmosphere == NULL) continue;
        const nb_planet world = nb_planet_of(&scene->planets[i]);
        int place = count++;
        for (; place > 0 && nb_planet_power(&worlds[place - 1], position) > nb_planet_power(&world, position); place--)
            worlds[place] = worlds[place - 1];
        worlds[place] = world;
    }
    return count;
}

/* No air of any planet is farther from a position. */
static inline double nb_planets_reach(const nb_planet *worlds, int count, const double position[3])
{
    double reach = 0;
    for (int k = 0; k < count; k++) {
        const double square = nb_planet_power(&worlds[k], position) + worlds[k].top * worlds[k].top;
        reach = fmax(reach, sqrt(square) + worlds[k].top);
    }
    return reach;
}

/* The angular radius of the sun's disc; 0: there is none. The scene has a planet. */
static inline double nb_planets_disc(const nebel_scene_data *scene)
{
    return scene->has_sun ? 0.5 * scene->planets[0].sun_angular_diameter * (3.14159265358979323846 / 180) : 0;
}

/* Its mean radiance above all air. */
static inline void nb_planets_disc_light(const nebel_scene_data *scene, double radius, double light[3])
{
    for (int c = 0; c < 3; c++)
        light[c] = radius > 0 ? scene->sun_irradiance[c] / (3.14159265358979323846 * pow(sin(radius), 2)) : 0;
}

/* How far the ground is from an eye above it; 0: the ray does not meet it. */
static inline double nb_planet_ground(const nb_planet *world, const double eye[3], const double unit[3])
{
    double to[3];
    for (int c = 0; c < 3; c++) to[c] = world->center[c] - eye[c];
    const double height = nb_vector_length(to) - world->radius, along = nb_vector_dot(to, unit);
    const double tangent = height * (height + 2 * world->radius), rest = along * along - tangent; /* squares */
    return height > 0 && along > 0 && rest > 0 ? tangent / (along + sqrt(rest)) : 0;
}

/* The planet with clouds; NULL: there is none. */
static inline const nb_planet *nb_planets_cloudy(const nb_planet *worlds, int count)
{
    for (int k = 0; k < count; k++)
        if (worlds[k].planet->clouds != NULL) return &worlds[k];
    return NULL;
}

/* How far its ground is; 0 where there is none. */
static inline double nb_planets_cloudy_ground(const nb_planet *worlds, int count, const double eye[3],
                                              const double unit[3])
{
    const nb_planet *world = nb_planets_cloudy(worlds, count);
    return world != NULL ? nb_planet_ground(world, eye, unit) : 0;
}

/* In widths of a pixel: no sample is farther from its middle; how far above the horizon rays are lifted. */
#define NB_WORLD_CORNER 0.75
#define NB_WORLD_LIFT_OVER 1e-3

/* A pixel whose middle meets the ground may have samples that see the sky: the ray through its middle (of any length, `pixel` radians
 * wide), where it is no more than a pixel's corner below the horizon, lifted to just above it. Returns whether it was. */
static inline int nb_planet_lift(const nb_planet *world, const double eye[3], double pixel, double direction[3])
{
    const double length = nb_vector_length(direction);
    double down[3], unit[3];
    for (int c = 0; c < 3; c++) {
        down[c] = world->center[c] - eye[c];
        unit[c] = direction[c] / length;
    }
    if (!(nb_planet_ground(world, eye, unit) > 0)) return 0;
    const double far = nb_vector_length(down), height = far - world->radius;
    const double cosine = nb_vector_dot(down, unit) / far, sine = sqrt(fmax(0, (1 - cosine) * (1 + cosine)));
    const double below = atan2(world->radius, sqrt(height * (far + world->radius))) - atan2(sine, cosine);
    if (!(below < NB_WORLD_CORNER * pixel && sine > 0)) return 0;
    const double lift = below + NB_WORLD_LIFT_OVER * pixel, aside = sin(lift) / sine;
    for (int c = 0; c < 3; c++)
        direction[c] = length * (cos(lift) * unit[c] + aside * (cosine * unit[c] - down[c] / far));
    return 1;
}

/* By the ground of the planet with clouds. */
static inline int nb_planets_lift(const nb_planet *worlds, int count, const double eye[3], double pixel,
                                  double direction[3])
{
    const nb_planet *world = nb_planets_cloudy(worlds, count);
    return world != NULL && nb_planet_lift(world, eye, pixel, direction);
}

/* Whose shadow, and whose sky, a place is in. */
static inline int nb_planets_nearest(const nb_planet *worlds, int count, const double place[3])
{
    int nearest = 0;
    for (int k = 1; k < count; k++)
        if (nb_planet_power(&worlds[k], place) < nb_planet_power(&worlds[nearest], place)) nearest = k;
    return nearest;
}

/* What other planets than `world` leave of the sun's disc; `to_sun` and `sun` as of nb_eclipse_left. */
static inline double nb_planets_uneclipsed(const nb_planet *worlds, int count, int world, const double place[3],
                                           const double to_sun[3], double sun)
{
    double left = 1;
    for (int k = 0; k < count; k++)
        if (k != world) left *= nb_eclipse_left(place, worlds[k].center, worlds[k].radius, to_sun, sun);
    return left;
}

/* The light at a place, of a sun of irradiance 1. */
static inline nebel_irradiance nb_planets_light(const nb_planet *worlds, int count, const double place[3],
                                                const double to_sun[3], double disc)
{
    const int nearest = nb_planets_nearest(worlds, count, place);
    const nebel_sun sun = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
    nebel_irradiance light;
    /* Places and suns are in order, so that it cannot fail. */
    memset(&light, 0, sizeof light);
    (void)nebel_compute_atmosphere_irradiance(worlds[nearest].planet->atmosphere, &sun, 1, (const double(*)[3])place, 0,
                                              &light, 0);
    const double left = nb_planets_uneclipsed(worlds, count, nearest, place, to_sun, disc);
    for (int c = 0; c < 3; c++) light.sun[c] *= left;
    return light;
}

/* ---- their air ------------------------------------------------------------------------------- */

enum { NB_PLANETS_RAYS = 256 };

/* Light of one planet's air. */
typedef struct nb_planet_transfer {
    float left[3][NB_PLANETS_RAYS], light[3][NB_PLANETS_RAYS], error[NB_PLANETS_RAYS];
} nb_planet_transfer;

static inline void nb_planets_lay_behind(const nb_planet_transfer *part, size_t n,
                                         const nebel_transfer_planes *transfers)
{
    for (size_t i = 0; i < n; i++) {
        float most = 0;
        for (int c = 0; c < 3; c++) {
            most = fmaxf(most, transfers->transmittance[c][i]);
            transfers->in_scattering[c][i] += transfers->transmittance[c][i] * part->light[c][i];
            transfers->transmittance[c][i] *= part->left[c][i];
        }
        if (transfers->error != NULL) transfers->error[i] += most * part->error[i];
    }
}

/* nebel_trace_sky_view, through the air of all; at most NB_PLANETS_RAYS rays. */
static inline nebel_result nb_planets_trace(const nb_planet *worlds, int count, size_t n,
                                            const double *const direction[3], const float *t_max,
                                            const nebel_transfer_planes *transfers)
{
    nb_planet_transfer part;
    nebel_transfer_planes planes = {.error = part.error};
    for (int c = 0; c < 3; c++) {
        planes.transmittance[c] = part.left[c];
        planes.in_scattering[c] = part.light[c];
    }
    nebel_result result = nebel_trace_sky_view(worlds[0].view, n, direction, t_max, transfers);
    for (int k = 1; k < count && result == NEBEL_OK; k++) {
        result = nebel_trace_sky_view(worlds[k].view, n, direction, t_max, &planes);
        if (result == NEBEL_OK) nb_planets_lay_behind(&part, n, transfers);
    }
    return result;
}

#endif
