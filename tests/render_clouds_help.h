/* A planet with clouds, and pictures of it by the CPU. */
#ifndef RENDER_CLOUDS_HELP_H
#define RENDER_CLOUDS_HELP_H

#include "planet_help.h"
#include "test_render_scene.h"

enum { WIDTH = 48, HEIGHT = 27 };

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
    nebel_planet planet;
    nebel_scene_data scene;
} world;

/* Air of the Earth, and air that hardly counts: made once for all tests. */
static struct {
    double thin;
    nebel_atmosphere *atmosphere;
} kept[2];

static inline nebel_atmosphere *keep_air(double thin, const nebel_atmosphere_desc *air)
{
    const int k = thin < 1;
    if (kept[k].atmosphere == NULL) {
        kept[k].thin = thin;
        assert_int_equal(nebel_create_atmosphere(air, &kept[k].atmosphere), NEBEL_OK);
    }
    assert_true(kept[k].thin == thin);
    return kept[k].atmosphere;
}

static inline int free_air(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) nebel_destroy_atmosphere(kept[k].atmosphere);
    return 0;
}

/* thin: air has this part of the Earth's. */
static inline void make_world_in(double thin, const nebel_cloud_layer *layer, world *w)
{
    static const double sun[3] = {.6, .64, .48};
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                            .sun_left = {1, 1, 1},
                            .cloud_layer_count = 1}};
    for (uint32_t k = 0; k < w->planet.atmosphere_desc.component_count; k++)
        for (int c = 0; c < 3; c++) {
            w->planet.atmosphere_desc.components[k].scattering[c] *= thin;
            w->planet.atmosphere_desc.components[k].absorption[c] *= thin;
        }
    w->atmosphere = keep_air(thin, &w->planet.atmosphere_desc);
    nebel_clouds_desc desc = {.atmosphere = w->atmosphere, .layer_count = 1};
    desc.layers[0] = *layer;
    assert_int_equal(nebel_create_clouds(&desc, &w->clouds), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->planet.clouds = w->clouds;
    w->scene = (nebel_scene_data){.has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, sun, sizeof sun);
}

static inline void make_world(const nebel_cloud_layer *layer, world *w)
{
    make_world_in(1, layer, w);
}

static inline void free_world(world *w)
{
    nebel_destroy_clouds(w->clouds);
}

static inline nebel_renderer *create_renderer(const world *w, nebel_lighting *fog, int threads)
{
    nebel_renderer *renderer;
    assert_int_equal(
        nebel_create_cpu_renderer(&w->scene, fog, &(nebel_cpu_renderer_desc){.thread_count = threads}, &renderer),
        NEBEL_OK);
    return renderer;
}

static inline test_picture render_frame(nebel_renderer *renderer, const nebel_camera *camera, uint32_t samples,
                                        double time)
{
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    const nebel_frame_desc desc = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = samples, .time = time};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    return picture;
}

static inline test_picture render_in(const world *w, nebel_lighting *fog, const nebel_camera *camera, int threads,
                                     uint32_t samples, double time)
{
    nebel_renderer *const renderer = create_renderer(w, fog, threads);
    const test_picture picture = render_frame(renderer, camera, samples, time);
    nebel_destroy_renderer(renderer);
    return picture;
}

static inline test_picture render(const world *w, const nebel_camera *camera, int threads, uint32_t samples,
                                  double time)
{
    return render_in(w, NULL, camera, threads, samples, time);
}

#endif
