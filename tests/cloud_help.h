/* What tests of clouds share: air around a ball, layers in it, their density at places, and a view of them. */
#ifndef CLOUD_HELP_H
#define CLOUD_HELP_H

#include "unit.h"

#include <nebel/planet.h>

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define RADIUS 6.36e6

static nebel_atmosphere *air;

static inline int make_air(void **state)
{
    (void)state;
    return nebel_create_atmosphere(&(nebel_atmosphere_desc){.ground_albedo = {.1, .1, .1}}, &air) == NEBEL_OK ? 0 : -1;
}

static inline int free_air(void **state)
{
    (void)state;
    nebel_destroy_atmosphere(air);
    return 0;
}

static inline nebel_clouds *make(uint32_t count, const nebel_cloud_layer *layers)
{
    nebel_clouds *clouds;
    nebel_clouds_desc desc = {.atmosphere = air, .layer_count = count};
    memcpy(desc.layers, layers, count * sizeof *layers);
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
    return clouds;
}

static inline float extinction_at(const nebel_clouds *clouds, double time, double width, double x, double y, double z)
{
    const double place[1][3] = {{x, y, z}};
    float extinction;
    assert_int_equal(nebel_compute_cloud_extinction(clouds, time, width, 1, place, 0, &extinction), NEBEL_OK);
    return extinction;
}

/* A place so far above the ground, in a direction from the planet's centre. */
static inline float above(const nebel_clouds *clouds, double height, double x, double y, double z, double width)
{
    const double scale = (RADIUS + height) / sqrt(x * x + y * y + z * z);
    return extinction_at(clouds, 0, width, x * scale, y * scale - RADIUS, z * scale);
}

static inline nebel_cloud_lighting *view_of(const nebel_clouds *clouds, double tolerance,
                                            nebel_cloud_workspace **workspace)
{
    nebel_cloud_lighting *view;
    const nebel_cloud_lighting_desc desc = {
        .clouds = clouds, .sun = {.direction = {.6, .7, .1}, .irradiance = {5, 4, 3}}, .tolerance = tolerance};
    assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, workspace), NEBEL_OK);
    return view;
}

/* Even steps, in m, through the density as it is stated. */
static inline double brute_force(const nebel_clouds *clouds, const nebel_ray *ray, double begin, double end,
                                 double step)
{
    double depth = 0, place[1][3];
    float extinction;
    for (double t = begin + .5 * step; t < end && depth < 12; t += step) {
        for (int c = 0; c < 3; c++) place[0][c] = ray->origin[c] + t * ray->direction[c];
        assert_int_equal(nebel_compute_cloud_extinction(clouds, 0, 0, 1, (const double(*)[3])place, 0, &extinction),
                         NEBEL_OK);
        depth += step * (double)extinction;
    }
    return exp(-depth);
}

#endif
