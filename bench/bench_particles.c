/* A nebula of very many particles, drawn by the CPU renderer. */
#include "groups.h"
#include "measure.h"
#include "nebula_scene.h"

#include <nebel/particles.h>
#include <nebel/render.h>

#include <stdlib.h>

static const char out_of_memory[] = "particles: out of memory";
static const char failed[] = "particles: the renderer failed";

typedef struct nb_drawing {
    nb_sky sky;
    nebel_scene_data scene;
    nebel_lighting *fog;
    nebel_renderer *renderer;
    float *color, *transmittance;
} nb_drawing;

static double run_frame(void *user)
{
    nb_drawing *const d = user;
    const nebel_frame_desc desc = {
        .camera = d->sky.camera, .width = d->sky.width, .height = d->sky.height, .samples = 1};
    const nebel_frame frame = {.color = d->color, .transmittance = d->transmittance};
    const double start = nb_clock_wall();
    if (nebel_render_frame(d->renderer, &desc, &frame) != NEBEL_OK) return -1;
    return nb_clock_wall() - start;
}

static nebel_lighting *commit(const nb_sky *sky)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < sky->count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&sky->particles[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) (void)nebel_create_lighting(snapshot, NULL, &lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return lighting;
}

static int set_up(const nb_bench_desc *desc, nb_drawing *d)
{
    if (nb_sky_make(desc->quick, &d->sky) != 0) return -1;
    const size_t floats = 3 * (size_t)d->sky.width * d->sky.height;
    d->scene.camera = d->sky.camera;
    d->color = malloc(floats * sizeof(float));
    d->transmittance = malloc(floats * sizeof(float));
    return d->color != NULL && d->transmittance != NULL ? 0 : -1;
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

static const char *measure(nb_drawing *d, int repetitions, nb_figures *figures)
{
    const nb_sky *const sky = &d->sky;
    const double start = nb_clock_wall();
    d->fog = commit(sky);
    const double committed = nb_clock_wall() - start;
    if (d->fog == NULL) return out_of_memory;
    if (nebel_create_cpu_renderer(&d->scene, d->fog, &(nebel_cpu_renderer_desc){0}, &d->renderer) != NEBEL_OK)
        return failed;
    nb_contest contest = {.run = run_frame, .user = d};
    if (nb_measure(&contest, 1, repetitions) != 0) return failed;
    const double covered = nb_sky_covered(sky, d->transmittance), overlap = nb_sky_pixels(sky) / covered;
    add_figure(figures, sky, "committing them", "s", committed, 0);
    add_figure(figures, sky, "particles on a covered pixel", "", overlap, 0);
    add_figure(figures, sky, "the frame", "s", contest.seconds, 3);
    add_figure(figures, sky, "a particle on a pixel", "ns", 1e9 * contest.seconds / (covered * overlap), 0);
    return NULL;
}

const char *nb_bench_particles(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_drawing d = {0};
    const char *fault = out_of_memory;
    if (set_up(desc, &d) == 0) fault = measure(&d, desc->quick ? 1 : 3, figures);
    nebel_destroy_renderer(d.renderer);
    nebel_release_lighting(d.fog);
    nb_sky_free(&d.sky);
    free(d.color);
    free(d.transmittance);
    return fault;
}
