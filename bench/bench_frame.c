/* One frame of a scene in memory, against what Embree needs for its rays. */
#include "embree_floor.h"
#include "groups.h"
#include "measure.h"
#include "scenes.h"

#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>

static const char out_of_memory[] = "frame: out of memory";
static const char failed[] = "frame: the renderer failed";
static const char other_picture[] = "frame: the renderer and Embree see different pictures";

typedef struct nb_studio {
    nb_bench_scene scene;
    uint32_t width, height;
    nb_embree_floor *floor;
    nb_embree_rays rays; /* of the last run */
    float *color, *depth;
} nb_studio;

typedef struct nb_setup {
    nb_studio *studio;
    nebel_lighting *fog;
    nebel_renderer *renderer;
    double density; /* > 0: exp2 distance fog over the finished frame */
} nb_setup;

static double run_embree(void *user)
{
    nb_studio *const studio = user;
    studio->rays = nb_embree_floor_trace(studio->floor);
    return studio->rays.primary_seconds + studio->rays.shadow_seconds;
}

static void fog_by_distance(const nb_studio *studio, double density)
{
    const float source = .7f;
    for (size_t i = 0; i < (size_t)studio->width * studio->height; i++) {
        const float f = (float)nebel_fog_factor_exp2((double)studio->depth[i], density);
        for (size_t c = 0; c < 3; c++) studio->color[3 * i + c] = f * studio->color[3 * i + c] + (1 - f) * source;
    }
}

static double run_nebel(void *user)
{
    const nb_setup *const setup = user;
    const nb_studio *const studio = setup->studio;
    const nebel_frame_desc desc = {
        .camera = studio->scene.data.camera, .width = studio->width, .height = studio->height, .samples = 1};
    const nebel_frame frame = {.color = studio->color, .depth = setup->density > 0 ? studio->depth : NULL};
    const double start = nb_clock_cpu();
    if (nebel_render_frame(setup->renderer, &desc, &frame) != NEBEL_OK) return -1;
    if (setup->density > 0) fog_by_distance(studio, setup->density);
    return nb_clock_cpu() - start;
}

/* Both hit the same pixels, but for a few on silhouettes. */
static int see_the_same(const nb_setup *setup)
{
    const nb_studio *const studio = setup->studio;
    const nebel_frame_desc desc = {
        .camera = studio->scene.data.camera, .width = studio->width, .height = studio->height, .samples = 1};
    if (nebel_render_frame(setup->renderer, &desc, &(nebel_frame){.depth = studio->depth}) != NEBEL_OK) return 0;
    const size_t pixels = (size_t)studio->width * studio->height;
    size_t hits = 0;
    for (size_t i = 0; i < pixels; i++) hits += isfinite(studio->depth[i]) != 0;
    return fabs((double)hits - (double)studio->rays.hits) < .002 * (double)pixels;
}

static void add_figure(nb_figures *figures, const char *name, double seconds, double floor, double at_most)
{
    nb_figure figure = {.group = "A frame in memory, one sample, sun with shadows, one thread",
                        .unit = "CPU ms",
                        .value = 1e3 * seconds,
                        .floor_name = "Embree's rays alone",
                        .floor = 1e3 * floor,
                        .at_most = at_most};
    (void)snprintf(figure.name, sizeof figure.name, "%s", name);
    nb_figures_add(figures, &figure);
}

static void add_rays(nb_figures *figures, const nb_studio *studio)
{
    const double pixels = (double)studio->width * studio->height;
    nb_figures_add(figures, &(nb_figure){.group = "Embree's rays, coherent packets of 16, one thread",
                                         .name = "primary",
                                         .unit = "M rays/CPU s",
                                         .value = 1e-6 * pixels / studio->rays.primary_seconds});
    nb_figures_add(figures,
                   &(nb_figure){.group = "Embree's rays, coherent packets of 16, one thread",
                                .name = "shadow",
                                .unit = "M rays/CPU s",
                                .value = 1e-6 * (double)studio->rays.shadow_rays / studio->rays.shadow_seconds});
}

/* ---- the scenes in turn ---------------------------------------------------------------------- */

enum { SETUPS = 4 };

static int prepare(nb_studio *studio, nb_bench_fog fog, double density, nb_setup *setup)
{
    *setup = (nb_setup){.studio = studio, .fog = nb_bench_fog_commit(fog, &studio->scene.data), .density = density};
    if (fog != NB_FOG_NONE && setup->fog == NULL) return -1;
    const nebel_cpu_renderer_desc desc = {.thread_count = 1};
    return nebel_create_cpu_renderer(&studio->scene.data, setup->fog, &desc, &setup->renderer) == NEBEL_OK ? 0 : -1;
}

static const char *measure(nb_studio *studio, nb_setup *setups, int repetitions, nb_figures *figures)
{
    static const struct {
        nb_bench_fog fog;
        double density, at_most;
        const char *name;
    } scenes[SETUPS] = {{NB_FOG_NONE, 0, 0, "no fog"},
                        {NB_FOG_BOX, 0, 1.3, "A1: fog box"},
                        {NB_FOG_SPHERE, 0, 0, "B1: fog sphere"},
                        {NB_FOG_NONE, .01, 0, "E: exp2 distance fog"}};
    nb_contest contests[SETUPS + 1] = {{.run = run_embree, .user = studio}};
    for (int i = 0; i < SETUPS; i++) {
        if (prepare(studio, scenes[i].fog, scenes[i].density, &setups[i]) != 0) return out_of_memory;
        contests[i + 1] = (nb_contest){.run = run_nebel, .user = &setups[i]};
    }
    if (nb_measure(contests, SETUPS + 1, repetitions) != 0) return failed;
    if (!see_the_same(&setups[0])) return other_picture;
    add_rays(figures, studio);
    for (int i = 0; i < SETUPS; i++) {
        add_figure(figures, scenes[i].name, contests[i + 1].seconds, contests[0].seconds, scenes[i].at_most);
    }
    return NULL;
}

static int set_up(const nb_bench_desc *desc, nb_studio *studio)
{
    studio->width = desc->quick ? 160 : NB_BENCH_WIDTH;
    studio->height = desc->quick ? 88 : NB_BENCH_HEIGHT;
    const double aspect = (double)studio->width / studio->height;
    if (nb_bench_scene_make(desc->quick ? 64 : 512, aspect, &studio->scene) != 0) return -1;
    studio->floor = nb_embree_floor_make(&studio->scene, studio->width, studio->height);
    studio->color = malloc(3 * sizeof(float) * studio->width * studio->height);
    studio->depth = malloc(sizeof(float) * studio->width * studio->height);
    return studio->floor != NULL && studio->color != NULL && studio->depth != NULL ? 0 : -1;
}

const char *nb_bench_frame(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_studio studio = {0};
    nb_setup setups[SETUPS] = {{0}};
    const char *fault = out_of_memory;
    if (set_up(desc, &studio) == 0) fault = measure(&studio, setups, desc->quick ? 1 : 9, figures);
    for (int i = 0; i < SETUPS; i++) {
        nebel_destroy_renderer(setups[i].renderer);
        nebel_release_lighting(setups[i].fog);
    }
    nb_embree_floor_free(studio.floor);
    nb_bench_scene_free(&studio.scene);
    free(studio.color);
    free(studio.depth);
    return fault;
}
