/* Frames of fog that the sun lights and surfaces shadow, against what Embree needs for the rays to the surfaces and
 * from them to the sun. */
#include "noise_cloud.h"
#include "embree_floor.h"
#include "groups.h"
#include "measure.h"
#include "scenes.h"

#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char out_of_memory[] = "sunlight: out of memory";
static const char failed[] = "sunlight: the renderer failed";

enum { SETUPS = 4 };

/* Wanted on two cores of the machine on which others were measured: design.md has no unit for its speed but seconds. */
static const struct {
    nb_bench_fog fog;
    const char *name;
    double most;   /* CPU ms */
    uint32_t part; /* the error is that of a picture so many times smaller, because the converged one takes so long */
} scenes[SETUPS] = {{NB_FOG_LIT_BOX, "A2: box", 120, 1},
                    {NB_FOG_LIT_SPHERE, "B2: sphere", 120, 1},
                    {NB_FOG_HEIGHT, "C: height fog, pillars", 200, 1},
                    {NB_FOG_CLOUD, "D: cloud", 300, 8}};

typedef struct nb_sunlight_setup {
    nb_bench_scene scene;
    nb_embree_floor *floor;
    nebel_lighting *fog;
    nebel_renderer *renderer;
    uint32_t width, height;
    double tolerance; /* 0: the default */
    float *color;
    double commit_seconds;
    size_t fog_bytes;
    unsigned char *memory; /* as large as the fog, and a picture behind it */
} nb_sunlight_setup;

static double run_embree(void *user)
{
    const nb_embree_rays rays = nb_embree_floor_trace(((const nb_sunlight_setup *)user)->floor);
    return rays.primary_seconds + rays.shadow_seconds;
}

static double run_nebel(void *user)
{
    const nb_sunlight_setup *const setup = user;
    const nebel_frame_desc desc = {.camera = setup->scene.data.camera,
                                   .width = setup->width,
                                   .height = setup->height,
                                   .samples = 1,
                                   .tolerance = setup->tolerance};
    const double start = nb_clock_cpu();
    if (nebel_render_frame(setup->renderer, &desc, &(nebel_frame){.color = setup->color}) != NEBEL_OK) return -1;
    return nb_clock_cpu() - start;
}

/* Reads as much as the fog has, voxels and all, and writes a picture. */
static double run_memory(void *user)
{
    nb_sunlight_setup *const setup = user;
    const size_t picture = 3 * sizeof(float) * setup->width * setup->height;
    const double start = nb_clock_cpu();
    uint64_t sum = 0, word;
    for (size_t i = 0; i + sizeof word <= setup->fog_bytes; i += sizeof word) {
        memcpy(&word, setup->memory + i, sizeof word);
        sum += word;
    }
    memset(setup->memory + setup->fog_bytes, (int)(sum & 1), picture);
    return nb_clock_cpu() - start;
}

static int prepare(const nb_bench_desc *desc, nb_bench_fog fog, nb_sunlight_setup *setup)
{
    setup->width = desc->quick ? 160 : NB_BENCH_WIDTH;
    setup->height = desc->quick ? 88 : NB_BENCH_HEIGHT;
    const double aspect = (double)setup->width / setup->height;
    if (nb_bench_scene_make(desc->quick ? 64 : 512, aspect, &setup->scene) != 0) return -1;
    if (fog == NB_FOG_HEIGHT && nb_bench_scene_add_pillars(&setup->scene) != 0) return -1;
    setup->floor = nb_embree_floor_make(&setup->scene, setup->width, setup->height);
    setup->fog = nb_bench_fog_measure(fog, &setup->scene.data, &setup->commit_seconds, &setup->fog_bytes);
    if (fog == NB_FOG_CLOUD) setup->fog_bytes += (size_t)NB_CLOUD_SIDE * NB_CLOUD_SIDE * NB_CLOUD_SIDE;
    setup->memory = calloc(setup->fog_bytes + 3 * sizeof(float) * setup->width * setup->height, 1);
    setup->color = malloc(3 * sizeof(float) * setup->width * setup->height);
    if (setup->floor == NULL || setup->fog == NULL || setup->color == NULL || setup->memory == NULL) return -1;
    memset(setup->memory, 1, setup->fog_bytes);
    const nebel_cpu_renderer_desc renderer = {.thread_count = 1};
    return nebel_create_cpu_renderer(&setup->scene.data, setup->fog, &renderer, &setup->renderer) == NEBEL_OK ? 0 : -1;
}

static void tear_down(nb_sunlight_setup *setup)
{
    nebel_destroy_renderer(setup->renderer);
    nebel_release_lighting(setup->fog);
    nb_embree_floor_free(setup->floor);
    nb_bench_scene_free(&setup->scene);
    free(setup->color);
    free(setup->memory);
}

static double encode_srgb(float linear)
{
    const double x = fmin(fmax((double)linear, 0), 1);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

/* Of all channels of the picture, against the same at a five-hundredth of the tolerance, in 255ths of sRGB. Below 0:
 * it failed. */
static double root_mean_square(nb_sunlight_setup *setup, uint32_t part)
{
    setup->width /= part;
    setup->height /= part;
    if (part > 1 && run_nebel(setup) < 0) return -1;
    const size_t count = 3 * (size_t)setup->width * setup->height;
    float *const picture = setup->color;
    double sum = 0;
    setup->tolerance = 0.002 * NEBEL_DEFAULT_TOLERANCE;
    setup->color = malloc(count * sizeof(float));
    const int fault = setup->color == NULL || run_nebel(setup) < 0;
    for (size_t i = 0; i < count && !fault; i++) {
        const double off = 255 * (encode_srgb(picture[i]) - encode_srgb(setup->color[i]));
        sum += off * off;
    }
    free(picture);
    return fault ? -1 : sqrt(sum / (double)count);
}

static const char group[] = "A frame of fog in sunlight, one sample, shadows everywhere, one thread";

/* Of fog that is kept for light, what is there before the first frame. */
static void add_costs(nb_figures *figures, int number, const nb_sunlight_setup *setup)
{
    const struct {
        const char *what, *unit;
        double value;
    } costs[] = {{"fog kept, with its voxels", "MiB", (double)setup->fog_bytes / 1048576},
                 {"commit, before the first frame", "CPU ms", 1e3 * setup->commit_seconds}};
    if (scenes[number].fog != NB_FOG_CLOUD) return;
    for (size_t i = 0; i < sizeof costs / sizeof costs[0]; i++) {
        nb_figure cost = {.group = group, .unit = costs[i].unit, .value = costs[i].value};
        (void)snprintf(cost.name, sizeof cost.name, "%s: %s", scenes[number].name, costs[i].what);
        nb_figures_add(figures, &cost);
    }
}

/* The same frame beside both floors. */
static int add_figures(nb_figures *figures, int number, nb_sunlight_setup *setup, double seconds, double rays,
                       double memory)
{
    nb_figure time = {.group = group,
                      .unit = "CPU ms",
                      .value = 1e3 * seconds,
                      .floor_name = "Embree's rays alone",
                      .floor = 1e3 * rays,
                      .value_at_most = scenes[number].most};
    (void)snprintf(time.name, sizeof time.name, "%s", scenes[number].name);
    nb_figures_add(figures, &time);
    nb_figure moved = {.group = group,
                       .unit = "CPU ms",
                       .value = 1e3 * seconds,
                       .floor_name = "reading the fog, writing the picture",
                       .floor = 1e3 * memory};
    (void)snprintf(moved.name, sizeof moved.name, "%s: against memory", scenes[number].name);
    nb_figures_add(figures, &moved);
    const double error = root_mean_square(setup, scenes[number].part);
    if (error < 0) return -1;
    nb_figure off = {.group = group, .unit = "255ths of sRGB", .value = error, .value_at_most = 1};
    (void)snprintf(off.name, sizeof off.name, "%s: root mean square error", scenes[number].name);
    nb_figures_add(figures, &off);
    return 0;
}

static const char *measure(const nb_bench_desc *desc, nb_sunlight_setup *setups, nb_figures *figures)
{
    nb_contest contests[3 * SETUPS];
    for (int i = 0; i < SETUPS; i++) {
        if (prepare(desc, scenes[i].fog, &setups[i]) != 0) return out_of_memory;
        contests[3 * i] = (nb_contest){.run = run_embree, .user = &setups[i]};
        contests[3 * i + 2] = (nb_contest){.run = run_memory, .user = &setups[i]};
        contests[3 * i + 1] = (nb_contest){.run = run_nebel, .user = &setups[i]};
    }
    if (nb_measure(contests, 3 * SETUPS, desc->quick ? 1 : 5) != 0) return failed;
    for (int i = 0; i < SETUPS; i++) {
        const nb_contest *const c = &contests[3 * i];
        add_costs(figures, i, &setups[i]);
        if (add_figures(figures, i, &setups[i], c[1].seconds, c[0].seconds, c[2].seconds) != 0) return failed;
    }
    return NULL;
}

const char *nb_bench_sunlight(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_sunlight_setup setups[SETUPS] = {{.fog = NULL}};
    const char *const fault = measure(desc, setups, figures);
    for (int i = 0; i < SETUPS; i++) tear_down(&setups[i]);
    return fault;
}
