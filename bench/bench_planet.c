/* The air of the Earth: its tables, and a frame of its sky. */
#include "groups.h"

#include "measure.h"
#include "scenes.h"

#include <nebel/planet.h>
#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct nb_planet_bench {
    nebel_atmosphere *air;
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_renderer *sky, *nothing; /* the same picture without a planet */
    nebel_frame_desc frame;
    float *color;
} nb_planet_bench;

static const nebel_sun sun = {.direction = {0.5, 0.75, -0.43}, .irradiance = {12, 12, 12}};

static double run_atmosphere(void *user)
{
    nebel_atmosphere *made;
    (void)user;
    const double start = nb_clock_cpu();
    if (nebel_create_atmosphere(nebel_lookup_atmosphere("earth"), &made) != NEBEL_OK) return -1;
    const double seconds = nb_clock_cpu() - start;
    nebel_destroy_atmosphere(made);
    return seconds;
}

static double time_view(const nb_planet_bench *bench, double height, int distances)
{
    const nebel_sky_view_desc desc = {
        .atmosphere = bench->air, .sun = sun, .position = {0, height, 0}, .has_ray_ends = distances};
    nebel_sky_view *view;
    const double start = nb_clock_cpu();
    if (nebel_create_sky_view(&desc, &view) != NEBEL_OK) return -1;
    const double seconds = nb_clock_cpu() - start;
    nebel_destroy_sky_view(view);
    return seconds;
}

static double run_view(void *user)
{
    return time_view(user, 1.7, 0);
}

static double run_levels(void *user)
{
    return time_view(user, 1.7, 1);
}

/* What a picture from the ground needs, by two threads: the time of both, in which one that waits for the other counts. */
static double run_tables(void *user)
{
    int threads = 2;
    nebel_atmosphere_desc air = *nebel_lookup_atmosphere("earth");
    nebel_sky_view_desc desc = {
        .sun = sun, .position = {0, 1.7, 0}, .host.parallel = {nebel_parallel_for_openmp, &threads}};
    nebel_atmosphere *made;
    nebel_sky_view *view;
    (void)user;
    air.host.parallel.run = nebel_parallel_for_openmp;
    air.host.parallel.user = &threads;
    const double start = nb_clock_cpu();
    if (nebel_create_atmosphere(&air, &made) != NEBEL_OK) return -1;
    desc.atmosphere = made;
    const nebel_result result = nebel_create_sky_view(&desc, &view);
    const double seconds = nb_clock_cpu() - start;
    nebel_destroy_sky_view(view);
    nebel_destroy_atmosphere(made);
    return result == NEBEL_OK ? seconds : -1;
}

static double run_space(void *user)
{
    return time_view(user, 4e5, 0);
}

static double time_frame(const nb_planet_bench *bench, nebel_renderer *renderer)
{
    const double start = nb_clock_cpu();
    if (nebel_render_frame(renderer, &bench->frame, &(nebel_frame){.color = bench->color}) != NEBEL_OK) return -1;
    return nb_clock_cpu() - start;
}

static double run_sky(void *user)
{
    const nb_planet_bench *const bench = user;
    return time_frame(bench, bench->sky);
}

static double run_nothing(void *user)
{
    const nb_planet_bench *const bench = user;
    return time_frame(bench, bench->nothing);
}

static int set_up(const nb_bench_desc *desc, nb_planet_bench *bench)
{
    static const nebel_scene_data nothing = {.planet_count = 0};
    const nebel_cpu_renderer_desc alone = {.thread_count = 1};
    bench->frame = (nebel_frame_desc){
        .camera = {.position = {0, 1.7, 0}, .look_at = {0, 5, -20}, .up = {0, 1, 0}, .vertical_fov = 60},
        .width = desc->quick ? 160 : NB_BENCH_WIDTH,
        .height = desc->quick ? 88 : NB_BENCH_HEIGHT,
        .samples = 1};
    bench->color = malloc((size_t)bench->frame.width * bench->frame.height * 3 * sizeof *bench->color);
    if (bench->color == NULL || nebel_create_atmosphere(nebel_lookup_atmosphere("earth"), &bench->air) != NEBEL_OK)
        return -1;
    bench->planet = (nebel_planet){.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                                   .sun_angular_diameter = 0.5334,
                                   .atmosphere = bench->air,
                                   .sun_left = {1, 1, 1}};
    bench->scene = (nebel_scene_data){.has_sun = 1, .planet_count = 1, .planets = &bench->planet};
    memcpy(bench->scene.sun_direction, sun.direction, sizeof sun.direction);
    memcpy(bench->scene.sun_irradiance, sun.irradiance, sizeof sun.irradiance);
    return nebel_create_cpu_renderer(&bench->scene, NULL, &alone, &bench->sky) == NEBEL_OK &&
                   nebel_create_cpu_renderer(&nothing, NULL, &alone, &bench->nothing) == NEBEL_OK
               ? 0
               : -1;
}

static const char *measure(const nb_bench_desc *desc, nb_planet_bench *bench, nb_figures *figures)
{
    enum { FLOOR, ATMOSPHERE, VIEW, LEVELS, SPACE, TABLES, SKY, MANY, CONTESTS };
    static const struct {
        const char *name;
        double at_most;
    } names[CONTESTS] = {[ATMOSPHERE] = {"table of light scattered often, fast", 0},
                         [VIEW] = {"table of a view from the ground", 0},
                         [LEVELS] = {"the same, rays may end in the air", 0},
                         [SPACE] = {"table of a view from space", 0},
                         [TABLES] = {"the first two by two threads together", 300},
                         [SKY] = {"sky and ground, one sample", 300},
                         [MANY] = {"sky and ground, four samples", 300}};
    nb_planet_bench many = *bench;
    many.frame.samples = 4;
    nb_contest contests[CONTESTS] = {
        [FLOOR] = {.run = run_nothing, .user = bench}, [ATMOSPHERE] = {.run = run_atmosphere},
        [VIEW] = {.run = run_view, .user = bench},     [LEVELS] = {.run = run_levels, .user = bench},
        [SPACE] = {.run = run_space, .user = bench},   [TABLES] = {.run = run_tables},
        [SKY] = {.run = run_sky, .user = bench},       [MANY] = {.run = run_sky, .user = &many}};
    if (nb_measure(contests, CONTESTS, desc->quick ? 1 : 7) != 0) return "the air of a planet cannot be had";
    for (int i = 1; i < CONTESTS; i++) {
        nb_figure figure = {.group = "The air of the Earth, one thread",
                            .unit = "CPU ms",
                            .value = 1e3 * contests[i].seconds,
                            .value_at_most = names[i].at_most};
        (void)snprintf(figure.name, sizeof figure.name, "%s", names[i].name);
        if (i == SKY) {
            figure.floor_name = "an empty picture";
            figure.floor = 1e3 * contests[FLOOR].seconds;
        }
        nb_figures_add(figures, &figure);
    }
    return NULL;
}

/* Once: it takes long. */
static const char *measure_clouds(const nb_bench_desc *desc, nb_planet_bench *bench, nb_figures *figures)
{
    nebel_clouds *clouds;
    nebel_renderer *renderer = NULL;
    nb_planet_bench cloudy = *bench;
    cloudy.frame.samples = 4;
    cloudy.frame.camera.position[1] = 120;
    cloudy.frame.camera.look_at[1] = 125;
    if (nebel_create_clouds(&(nebel_clouds_desc){.atmosphere = bench->air, .layer_count = 1}, &clouds) != NEBEL_OK)
        return "clouds cannot be had";
    cloudy.planet.clouds = clouds;
    cloudy.scene.planets = &cloudy.planet;
    double seconds = -1;
    if (nebel_create_cpu_renderer(&cloudy.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer) ==
        NEBEL_OK)
        seconds = time_frame(&cloudy, renderer);
    nebel_destroy_renderer(renderer);
    nebel_destroy_clouds(clouds);
    if (seconds < 0) return "clouds cannot be drawn";
    nb_figure figure = {.group = "The air of the Earth, one thread",
                        .unit = "CPU ms",
                        .value = 1e3 * seconds,
                        .value_at_most = desc->quick ? 0 : 8000};
    (void)snprintf(figure.name, sizeof figure.name, "cumulus, sky and ground, four samples");
    nb_figures_add(figures, &figure);
    return NULL;
}

const char *nb_bench_planet(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_planet_bench bench = {.air = NULL};
    const char *fault = "out of memory";
    if (set_up(desc, &bench) == 0) fault = measure(desc, &bench, figures);
    if (fault == NULL) fault = measure_clouds(desc, &bench, figures);
    if (fault == NULL) nb_bench_published_planet(figures);
    nebel_destroy_renderer(bench.sky);
    nebel_destroy_renderer(bench.nothing);
    nebel_destroy_atmosphere(bench.air);
    free(bench.color);
    return fault;
}
