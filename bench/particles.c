/* A nebula of very many particles, drawn by the CPU renderer. */
#include "groups.h"
#include "measure.h"
#include "scenes.h"

#include <nebel/nebula.h>
#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>

static const char out_of_memory[] = "particles: out of memory";
static const char failed[] = "particles: the renderer failed";

enum { COUNT = 100000, QUICK_COUNT = 500 };

/* A cloud that fills most of the picture, with about thirty particles on a pixel that it covers. */
typedef struct nb_sky {
    size_t count;
    uint32_t width, height;
    nebel_particle *particles;
    nebel_scene_data scene;
    nebel_snapshot *fog;
    nebel_renderer *renderer;
    float *color, *transmittance;
} nb_sky;

static double run_frame(void *user)
{
    nb_sky *const sky = user;
    const nebel_frame_desc desc = {
        .camera = sky->scene.camera, .width = sky->width, .height = sky->height, .samples = 1};
    const nebel_frame frame = {.color = sky->color, .transmittance = sky->transmittance};
    const double start = nb_clock_wall();
    if (nebel_render_frame(sky->renderer, &desc, &frame) != NEBEL_OK) return -1;
    return nb_clock_wall() - start;
}

static int strew(nb_sky *sky)
{
    static const double colors[3][3] = {{.2, .1, .8}, {.9, .3, .4}, {1, .8, .5}};
    const nebel_nebula_desc desc = {.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {8, 4.5, 4}},
                                    .count = sky->count,
                                    .size = {.08, .16},
                                    .absorption = {.5, .7, .9},
                                    .emission = {.6, .6, .6},
                                    .colors = colors,
                                    .color_count = 3,
                                    .turbulence = 2};
    return nebel_scatter_nebula(&desc, sky->particles) == NEBEL_OK ? 0 : -1;
}

static nebel_snapshot *commit(const nb_sky *sky)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < sky->count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_particle_volume(&sky->particles[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) (void)nebel_commit_fog(fog, &snapshot);
    nebel_destroy_fog(fog);
    return snapshot;
}

static int set_up(const nb_bench_desc *desc, nb_sky *sky)
{
    sky->count = desc->quick ? QUICK_COUNT : COUNT;
    sky->width = desc->quick ? 160 : NB_BENCH_WIDTH;
    sky->height = desc->quick ? 90 : NB_BENCH_HEIGHT;
    sky->scene.camera = (nebel_camera){.position = {0, 0, 18}, .up = {0, 1, 0}, .vertical_fov = 38};
    sky->particles = malloc(sky->count * sizeof *sky->particles);
    sky->color = malloc(3 * sizeof(float) * sky->width * sky->height);
    sky->transmittance = malloc(3 * sizeof(float) * sky->width * sky->height);
    return sky->particles != NULL && sky->color != NULL && sky->transmittance != NULL ? strew(sky) : -1;
}

static double covered_pixels(const nb_sky *sky)
{
    size_t covered = 0;
    for (size_t i = 0; i < (size_t)sky->width * sky->height; i++) covered += sky->transmittance[3 * i] < 1;
    return (double)covered;
}

/* A ball covers the pixels within its outline; far enough that perspective does not stretch it. */
static double pixels_of_particles(const nb_sky *sky)
{
    const double pi = acos(-1), half = tan(sky->scene.camera.vertical_fov * pi / 360);
    double sum = 0;
    for (size_t i = 0; i < sky->count; i++) {
        const double depth = sky->scene.camera.position[2] - sky->particles[i].center[2];
        const double radius = sky->particles[i].radius / (depth * half) * sky->height / 2;
        sum += pi * radius * radius;
    }
    return sum;
}

static void add_figure(nb_figures *figures, const nb_sky *sky, const char *name, const char *unit, double value,
                       double at_most)
{
    nb_figure figure = {.group = "A nebula of particles, 1280x720, one sample, all threads",
                        .unit = unit,
                        .value = value,
                        .value_at_most = at_most};
    (void)snprintf(figure.name, sizeof figure.name, "%zu particles: %s", sky->count, name);
    nb_figures_add(figures, &figure);
}

static const char *measure(nb_sky *sky, int repetitions, nb_figures *figures)
{
    const double start = nb_clock_wall();
    sky->fog = commit(sky);
    const double committed = nb_clock_wall() - start;
    if (sky->fog == NULL) return out_of_memory;
    if (nebel_create_renderer(&sky->scene, sky->fog, &(nebel_renderer_desc){0}, &sky->renderer) != NEBEL_OK)
        return failed;
    nb_contest contest = {.run = run_frame, .user = sky};
    if (nb_measure(&contest, 1, repetitions) != 0) return failed;
    const double covered = covered_pixels(sky), overlap = pixels_of_particles(sky) / covered;
    add_figure(figures, sky, "committing them", "s", committed, 0);
    add_figure(figures, sky, "particles on a covered pixel", "", overlap, 0);
    add_figure(figures, sky, "the frame", "s", contest.seconds, 3);
    add_figure(figures, sky, "a particle on a pixel", "ns", 1e9 * contest.seconds / (covered * overlap), 0);
    return NULL;
}

const char *nb_bench_particles(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_sky sky = {0};
    const char *fault = out_of_memory;
    if (set_up(desc, &sky) == 0) fault = measure(&sky, desc->quick ? 1 : 3, figures);
    nebel_destroy_renderer(sky.renderer);
    nebel_release_snapshot(sky.fog);
    free(sky.particles);
    free(sky.color);
    free(sky.transmittance);
    return fault;
}
