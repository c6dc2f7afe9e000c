/* Even layers of clouds, as good as plane-parallel slabs. */
#ifndef EVEN_LAYER_H
#define EVEN_LAYER_H

#include "clouds/cloud_lighting.h"

#include "cloud_help.h"

/* As even as the parameters allow: clouds are far wider than all that is seen, on a ball that is as good as flat. */
#define FLAT_RADIUS 6.36e9
#define BASE 1000.0
#define TOP 2000.0
#define DIAMETER 14

typedef struct even {
    nebel_atmosphere *air;
    nebel_clouds *clouds;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
} even;

static inline void even_free(even *e)
{
    nebel_destroy_cloud_workspace(e->workspace);
    nebel_destroy_cloud_lighting(e->view);
    nebel_destroy_clouds(e->clouds);
    nebel_destroy_atmosphere(e->air);
}

static inline void even_make(double extinction, double sun_cosine, even *e)
{
    /* Air that does nothing over a black ground. */
    const nebel_atmosphere_desc bare = {.radius = FLAT_RADIUS,
                                        .thickness = 1e5,
                                        .component_count = 1,
                                        .components = {{.absorption = {1e-20, 1e-20, 1e-20}, .scale_height = 1e5}}};
    assert_int_equal(nebel_create_atmosphere(&bare, &e->air), NEBEL_OK);
    const nebel_clouds_desc desc = {.atmosphere = e->air,
                                    .layer_count = 1,
                                    .layers = {{.type = NEBEL_CLOUD_STRATUS,
                                                .base = BASE,
                                                .top = TOP,
                                                .coverage = 1,
                                                .extinction = extinction,
                                                .cell_size = 1e5,
                                                .erosion = NEBEL_ZERO,
                                                .patchiness = NEBEL_ZERO,
                                                .droplet_diameter = DIAMETER,
                                                .seed = 1}}};
    assert_int_equal(nebel_create_clouds(&desc, &e->clouds), NEBEL_OK);
    const nebel_cloud_lighting_desc view = {
        .clouds = e->clouds,
        .sun = {.direction = {sqrt(1 - sun_cosine * sun_cosine), sun_cosine, 0}, .irradiance = {1, 1, 1}},
        .tolerance = 1e-4};
    assert_int_equal(nebel_create_cloud_lighting(&view, &e->view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(e->view, &e->workspace), NEBEL_OK);
}

/* m of full extinction that a level layer would have up, by what the way from the origin to a sun has. */
static inline double column(double sun_cosine)
{
    enum { STEPS = 400 };
    even e;
    const double aside = sqrt(1 - sun_cosine * sun_cosine) / sun_cosine;
    double sum = 0;
    even_make(.01, 1, &e);
    for (int i = 0; i < STEPS; i++) {
        const double step = (TOP - BASE) / STEPS, height = BASE + (i + .5) * step;
        sum += step * (double)extinction_at(e.clouds, 0, 0, aside * height, height, 0) / .01;
    }
    even_free(&e);
    return sum;
}

static inline double share_of_sun(const even *e)
{
    float part;
    assert_int_equal(nebel_compute_cloud_sun_transmittance(
                         e->workspace, 100, 1, (const double(*)[3])(const double[1][3]){{0, 10, 0}}, 0, &part),
                     NEBEL_OK);
    return (double)part;
}

/* Through the middle of the layer over the origin; down: cosine of the ray to straight down; around: of its way along the ground
 * to that of the sun. */
static inline double radiance(const even *e, double down, double around)
{
    const double level = sqrt(1 - down * down), side = sqrt(1 - around * around), middle = .5 * (BASE + TOP);
    const double height = down > 0 ? TOP + 500 : BASE - 500, way = (height - middle) / down, spread = 1e-4;
    const nebel_ray ray = {
        {-way * level * around, height, -way * level * side}, {level * around, -down, level * side}, HUGE_VAL};
    nebel_cloud_transfer nodes;
    assert_int_equal(nebel_trace_clouds(e->workspace, 1, &ray, 0, spread, NULL, &nodes, 0), NEBEL_OK);
    assert_true(nodes.count > 0);
    return (double)nodes.in_scattering[nodes.count - 1][1];
}

#endif
