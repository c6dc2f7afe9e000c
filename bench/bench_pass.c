/* Fog over finished pictures, against copying their bytes. */
#include "groups.h"
#include "measure.h"
#include "scenes.h"
#include "memory_floor.h"

#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char out_of_memory[] = "pass: out of memory";
static const char failed[] = "pass: the renderer or the pass failed";

/* So many pictures take turns that none is in a cache when its turn comes. */
enum { FRAMES = 8, THREADS_MOST = 2 };

typedef struct nb_gallery {
    nb_bench_scene scene;
    nebel_lighting *fog;
    uint32_t width, height;
    nebel_pixels frames[FRAMES];
    uint32_t *memory; /* depth, colour and result of all frames */
} nb_gallery;

typedef struct nb_pass {
    const nb_gallery *gallery;
    nebel_isa isa;
    int threads;
} nb_pass;

/* ---- pictures -------------------------------------------------------------------------------- */

static void set_rays(const nebel_camera *camera, nebel_pixels *pixels)
{
    double forward[3], right[3], up[3];
    double length = 0, across = 0;
    for (int i = 0; i < 3; i++) {
        forward[i] = camera->look_at[i] - camera->position[i];
        length += forward[i] * forward[i];
    }
    for (int i = 0; i < 3; i++) forward[i] /= sqrt(length);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        right[i] = forward[j] * camera->up[k] - forward[k] * camera->up[j];
        across += right[i] * right[i];
    }
    for (int i = 0; i < 3; i++) right[i] /= sqrt(across);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        up[i] = right[j] * forward[k] - right[k] * forward[j];
    }
    const double step = 2 * tan(camera->vertical_fov / 2 * 3.14159265358979323846 / 180) / pixels->height;
    for (int i = 0; i < 3; i++) {
        pixels->eye[i] = camera->position[i];
        pixels->step_x[i] = (float)(right[i] * step);
        pixels->step_y[i] = (float)(-up[i] * step);
        pixels->corner[i] = (float)(forward[i] - right[i] * step * .5 * (pixels->width - 1.) +
                                    up[i] * step * .5 * (pixels->height - 1.));
    }
}

/* From distances to depths along the axis, which is what a depth buffer gives. */
static void project(const nebel_pixels *pixels, float *depth)
{
    for (uint32_t y = 0; y < pixels->height; y++) {
        for (uint32_t x = 0; x < pixels->width; x++) {
            float square = 0;
            for (int i = 0; i < 3; i++) {
                const float way = pixels->corner[i] + (float)x * pixels->step_x[i] + (float)y * pixels->step_y[i];
                square += way * way;
            }
            depth[(size_t)y * pixels->width + x] /= sqrtf(square);
        }
    }
}

static int render(const nb_gallery *gallery, float *color, float *depth)
{
    nebel_renderer *renderer = NULL;
    const nebel_frame_desc desc = {
        .camera = gallery->scene.data.camera, .width = gallery->width, .height = gallery->height, .samples = 1};
    nebel_result result =
        nebel_create_cpu_renderer(&gallery->scene.data, NULL, &(nebel_cpu_renderer_desc){0}, &renderer);
    if (result == NEBEL_OK) {
        result = nebel_render_frame(renderer, &desc, &(nebel_frame){.color = color, .depth = depth});
    }
    nebel_destroy_renderer(renderer);
    if (result == NEBEL_OK) nebel_tone_map((size_t)gallery->width * gallery->height, color, 0, color);
    return result == NEBEL_OK ? 0 : -1;
}

/* The first frame is rendered, the others are copies. */
static int fill_frames(nb_gallery *gallery)
{
    const size_t count = (size_t)gallery->width * gallery->height;
    float *const color = malloc(3 * sizeof(float) * count);
    float *const depth = (float *)gallery->memory;
    uint8_t *const bytes = (uint8_t *)(gallery->memory + count);
    const int status = color != NULL ? render(gallery, color, depth) : -1;
    for (size_t i = 0; i < count && status == 0; i++) {
        for (size_t c = 0; c < 3; c++) bytes[4 * i + c] = (uint8_t)(color[3 * i + c] * 255 + .5f);
        bytes[4 * i + 3] = 255;
    }
    free(color);
    for (size_t f = 0; f < FRAMES && status == 0; f++) {
        uint32_t *const own = gallery->memory + 3 * count * f;
        nebel_pixels *const frame = &gallery->frames[f];
        *frame = (nebel_pixels){.width = gallery->width, .height = gallery->height};
        set_rays(&gallery->scene.data.camera, frame);
        if (f == 0) project(frame, depth);
        if (f > 0) memcpy(own, gallery->memory, 2 * sizeof *own * count);
        frame->depth = (const float *)own;
        frame->color = (const uint8_t *)(own + count);
        frame->output = (uint8_t *)(own + 2 * count);
    }
    return status;
}

/* ---- contestants ----------------------------------------------------------------------------- */

static void copy_rows(const nebel_pixels *frame, uint32_t first_row, uint32_t row_count)
{
    const size_t first = (size_t)first_row * frame->width, count = (size_t)row_count * frame->width;
    nb_stream_two_to_one((const uint32_t *)(const void *)frame->depth + first,
                         (const uint32_t *)(const void *)frame->color + first,
                         (uint32_t *)(void *)frame->output + first, count);
}

/* `isa` below 0: copies. */
static int pass_rows(const nb_gallery *gallery, int isa, int share, int shares)
{
    int faults = 0;
    const uint32_t first = gallery->height * (uint32_t)share / (uint32_t)shares;
    const uint32_t last = gallery->height * (uint32_t)(share + 1) / (uint32_t)shares;
    for (int f = 0; f < FRAMES; f++) {
        nebel_pixels frame = gallery->frames[f];
        frame.first_row = first;
        frame.row_count = last - first;
        if (isa < 0) {
            copy_rows(&frame, first, last - first);
        } else {
            faults += nebel_apply_fog_to_pixels(nebel_get_lighting_snapshot(gallery->fog), (nebel_isa)isa, &frame) !=
                      NEBEL_OK;
        }
    }
    return faults;
}

static double run_shares(const nb_pass *pass, int isa)
{
    int faults = 0;
    const double start = nb_clock_wall();
#pragma omp parallel for num_threads(pass->threads) reduction(+ : faults)
    for (int share = 0; share < pass->threads; share++) faults += pass_rows(pass->gallery, isa, share, pass->threads);
    return faults == 0 ? nb_clock_wall() - start : -1;
}

static double run_copy(void *user)
{
    return run_shares(user, -1);
}

static double run_fog(void *user)
{
    const nb_pass *const pass = user;
    return run_shares(pass, (int)pass->isa);
}

/* ---- figures --------------------------------------------------------------------------------- */

static void add_figure(nb_figures *figures, const nb_pass *pass, double seconds, double floor)
{
    nb_figure figure = {.group = "Fog box over 1920x1080: float depth and RGBA8 in, RGBA8 out, eight frames in turn",
                        .unit = "ms a frame",
                        .value = 1e3 * seconds / FRAMES,
                        .floor_name = pass->threads == 1 ? "copying, one thread" : "copying, two threads",
                        .floor = 1e3 * floor / FRAMES};
    if (pass->isa == NEBEL_ISA_AVX2) figure.at_most = pass->threads == 1 ? 2.5 : 1.8;
    (void)snprintf(figure.name, sizeof figure.name, "%s, %s", nebel_isa_name(pass->isa),
                   pass->threads == 1 ? "one thread" : "two threads");
    nb_figures_add(figures, &figure);
}

static const char *measure(const nb_gallery *gallery, int threads, int repetitions, nb_figures *figures)
{
    nb_pass passes[NEBEL_ISA_COUNT];
    nb_contest contests[NEBEL_ISA_COUNT];
    size_t count = 1;
    passes[0] = (nb_pass){.gallery = gallery, .threads = threads};
    contests[0] = (nb_contest){.run = run_copy, .user = &passes[0]};
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        passes[count] = (nb_pass){gallery, (nebel_isa)isa, threads};
        contests[count] = (nb_contest){.run = run_fog, .user = &passes[count]};
        count++;
    }
    if (nb_measure(contests, count, repetitions) != 0) return failed;
    for (size_t i = 1; i < count; i++) add_figure(figures, &passes[i], contests[i].seconds, contests[0].seconds);
    return NULL;
}

static int set_up(const nb_bench_desc *desc, nb_gallery *gallery)
{
    gallery->width = desc->quick ? 320 : 1920;
    gallery->height = desc->quick ? 180 : 1080;
    const double aspect = (double)gallery->width / gallery->height;
    if (nb_bench_scene_make(desc->quick ? 64 : 512, aspect, &gallery->scene) != 0) return -1;
    gallery->fog = nb_bench_fog_commit(NB_FOG_BOX, &(nebel_scene_data){.has_sun = 0});
    gallery->memory = malloc(3 * sizeof *gallery->memory * FRAMES * gallery->width * gallery->height);
    return gallery->fog != NULL && gallery->memory != NULL ? 0 : -1;
}

const char *nb_bench_pass(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_gallery gallery = {0};
    const char *fault = out_of_memory;
    if (set_up(desc, &gallery) == 0) {
        fault = fill_frames(&gallery) == 0 ? NULL : failed;
        for (int threads = 1; threads <= THREADS_MOST && fault == NULL; threads++) {
            fault = measure(&gallery, threads, desc->quick ? 1 : 9, figures);
        }
    }
    nebel_release_lighting(gallery.fog);
    nb_bench_scene_free(&gallery.scene);
    free(gallery.memory);
    return fault;
}
