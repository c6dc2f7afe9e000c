/* Fog over photographs: in memory beside copying, and from file to file beside libpng alone. */
#define _DEFAULT_SOURCE

#include "groups.h"
#include "measure.h"
#include "png_floor.h"

#include <nebel/photograph.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char failed[] = "photographs: a picture could not be made, read, fogged or written";
static const char memory_group[] = "Fog everywhere over 2048x1024: float depth and RGB8 in, RGB8 out, one thread";
static const char files_group[] =
    "A photograph of 2048x1024 in PNG, its depth in PNG of 16 bits, to a foggy PNG, one thread";

enum { PATHS = 4 };

typedef struct nb_darkroom {
    uint32_t width, height;
    nebel_host host;
    nebel_snapshot *fog;
    nebel_intrinsics camera;
    nebel_photograph photograph;
    float *depth;
    unsigned char *out;
    float *depth_copy;
    char folder[32];
    char paths[PATHS][64]; /* the picture, its depth, the foggy one, and libpng's copy of that */
    int srgb;
} nb_darkroom;

/* ---- a street -------------------------------------------------------------------------------- */

/* Grain of a sensor: 0 to 1. */
static double noise_at(uint32_t x, uint32_t y)
{
    uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca6bu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (double)(h ^ h >> 15) * 0x1p-32;
}

/* Waves with grain; depth as of a road below the horizon. */
static void paint(nb_darkroom *room)
{
    unsigned char *const bytes = room->photograph.pixels;
    for (uint32_t y = 0; y < room->height; y++)
        for (uint32_t x = 0; x < room->width; x++) {
            const size_t i = (size_t)y * room->width + x;
            const double wave = 110 + 50 * sin(x * .013 + 3 * sin(y * .011)) + 30 * cos(y * .031 - x * .007);
            for (uint32_t c = 0; c < 3; c++)
                bytes[3 * i + c] = (unsigned char)(wave + 5 * c + 3 * noise_at(x, 3 * y + c));
            room->depth[i] = (float)(2000 / (5 + (double)y * 1024 / room->height) + 3 * sin(x * .02));
        }
}

/* p = 256 B fx / z + 1, as Cityscapes has it, in steps of a sixteenth. */
static nebel_result write_files(const nb_darkroom *room)
{
    const size_t count = (size_t)room->width * room->height;
    float *const share = malloc(count * sizeof *share);
    if (share == NULL) return NEBEL_ERROR_MEMORY;
    for (size_t i = 0; i < count; i++) {
        const double disparity = room->camera.baseline * room->camera.fx / (double)room->depth[i];
        share[i] = (float)((round(disparity * 16) * 16 + 1) / 65535);
    }
    nebel_result result = nebel_write_photograph(room->paths[0], &room->host, &room->photograph, NULL);
    if (result == NEBEL_OK)
        result = nebel_write_gray(room->paths[1], &room->host, room->width, room->height, share, NULL);
    free(share);
    return result;
}

static int set_up(const nb_bench_desc *desc, nb_darkroom *room)
{
    static const char *const names[PATHS] = {"street.png", "disparity.png", "foggy.png", "copy.png"};
    room->width = desc->quick ? 256 : 2048;
    room->height = desc->quick ? 128 : 1024;
    const size_t count = (size_t)room->width * room->height;
    room->camera = (nebel_intrinsics){1.1 * room->width, 1.1 * room->width, room->width / 2., room->height / 2., .21};
    room->photograph = (nebel_photograph){room->width, room->height, NEBEL_PIXEL_RGB8, malloc(3 * count)};
    room->out = calloc(count, 3);
    room->depth = calloc(count, sizeof(float));
    room->depth_copy = calloc(count, sizeof(float));
    if (room->photograph.pixels == NULL || room->out == NULL || room->depth == NULL || room->depth_copy == NULL)
        return -1;
    (void)strcpy(room->folder, "/tmp/nebel-photographs-XXXXXX");
    if (mkdtemp(room->folder) == NULL) return -1;
    for (int i = 0; i < PATHS; i++)
        (void)snprintf(room->paths[i], sizeof room->paths[i], "%s/%s", room->folder, names[i]);
    paint(room);
    nebel_fog *fog = NULL;
    const nebel_volume_desc haze = {
        .shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {.02, .02, .02}, .source = {.6, .62, .65}};
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    if (result == NEBEL_OK) result = nebel_add_volume(fog, &haze, NULL);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &room->fog);
    nebel_destroy_fog(fog);
    return result == NEBEL_OK && write_files(room) == NEBEL_OK ? 0 : -1;
}

static void clean_up(nb_darkroom *room)
{
    for (int i = 0; i < PATHS && room->folder[0] != '\0'; i++) (void)unlink(room->paths[i]);
    if (room->folder[0] != '\0') (void)rmdir(room->folder);
    nebel_release_snapshot(room->fog);
    free(room->photograph.pixels);
    free(room->out);
    free(room->depth);
    free(room->depth_copy);
}

/* ---- contestants ----------------------------------------------------------------------------- */

static nebel_result add_fog(const nb_darkroom *room, const float *depth, int srgb, const void *color, void *out)
{
    nebel_pixels pixels = {.width = room->width,
                           .height = room->height,
                           .depth = depth,
                           .color = color,
                           .output = out,
                           .type = NEBEL_PIXEL_RGB8,
                           .srgb = srgb};
    const nebel_result result = nebel_aim_pixels(&pixels, &room->camera, NULL);
    return result == NEBEL_OK ? nebel_apply_fog_to_pixels(room->fog, NEBEL_ISA_DEFAULT, &pixels) : result;
}

static double run_fog(void *user)
{
    const nb_darkroom *const room = user;
    const double start = nb_clock_cpu();
    const nebel_result result = add_fog(room, room->depth, room->srgb, room->photograph.pixels, room->out);
    return result == NEBEL_OK ? nb_clock_cpu() - start : -1;
}

static double run_copy(void *user)
{
    const nb_darkroom *const room = user;
    const size_t count = (size_t)room->width * room->height;
    const double start = nb_clock_cpu();
    memcpy(room->depth_copy, room->depth, count * sizeof *room->depth);
    memcpy(room->out, room->photograph.pixels, 3 * count);
    return nb_clock_cpu() - start;
}

static nebel_result fog_files(const nb_darkroom *room)
{
    nebel_photograph photograph = {0};
    nebel_depth_map map = {0};
    double airlight[3];
    const nebel_depth_source source = {.format = "cityscapes", .camera = &room->camera};
    nebel_result result = nebel_read_photograph(room->paths[0], &room->host, &photograph);
    if (result == NEBEL_OK) result = nebel_read_depth(room->paths[1], &source, &room->host, &map);
    if (result == NEBEL_OK) result = nebel_estimate_airlight(&room->host, &photograph, airlight);
    if (result == NEBEL_OK) result = add_fog(room, map.depth, 1, photograph.pixels, photograph.pixels);
    if (result == NEBEL_OK) result = nebel_write_photograph(room->paths[2], &room->host, &photograph, NULL);
    nebel_free_photograph(&room->host, &photograph);
    nebel_free_depth(&room->host, &map);
    return result;
}

static double run_files(void *user)
{
    const double start = nb_clock_cpu();
    return fog_files(user) == NEBEL_OK ? nb_clock_cpu() - start : -1;
}

/* Both files in, and the foggy picture out, which is decoded before the clock starts. */
static double run_libpng(void *user)
{
    const nb_darkroom *const room = user;
    nb_png_picture foggy, picture, depth;
    if (nb_png_floor_decode(room->paths[2], &foggy) != 0) return -1;
    const double start = nb_clock_cpu();
    int status = nb_png_floor_decode(room->paths[0], &picture);
    if (status == 0) free(picture.rows);
    if (status == 0) status = nb_png_floor_decode(room->paths[1], &depth);
    if (status == 0) free(depth.rows);
    if (status == 0) status = nb_png_floor_encode(room->paths[3], &foggy);
    const double seconds = nb_clock_cpu() - start;
    free(foggy.rows);
    return status == 0 ? seconds : -1;
}

/* ---- figures --------------------------------------------------------------------------------- */

static void add_figure(nb_figures *figures, const char *group, const char *name, const char *floor_name,
                       const nb_contest *run, const nb_contest *floor, double at_most)
{
    nb_figure figure = {.group = group,
                        .unit = "ms a picture",
                        .value = 1e3 * run->seconds,
                        .floor_name = floor_name,
                        .floor = 1e3 * floor->seconds,
                        .at_most = at_most};
    (void)snprintf(figure.name, sizeof figure.name, "%s", name);
    nb_figures_add(figures, &figure);
}

static const char *measure(nb_darkroom *room, int repetitions, nb_figures *figures)
{
    nb_darkroom stored = *room;
    room->srgb = 1;
    nb_contest memory[] = {
        {.run = run_copy, .user = room}, {.run = run_fog, .user = &stored}, {.run = run_fog, .user = room}};
    nb_contest files[] = {{.run = run_files, .user = room}, {.run = run_libpng, .user = room}};
    if (nb_measure(memory, 3, repetitions) != 0) return failed;
    add_figure(figures, memory_group, "numbers as stored", "copying", &memory[1], &memory[0], 3);
    add_figure(figures, memory_group, "in linear light", "copying", &memory[2], &memory[0], 0);
    if (nb_measure(files, 2, repetitions) != 0) return failed;
    add_figure(figures, files_group, "read, airlight estimated, fog, written", "libpng alone", &files[0], &files[1],
               1 / .6);
    return NULL;
}

const char *nb_bench_photographs(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_darkroom room = {0};
    const char *const fault = set_up(desc, &room) == 0 ? measure(&room, desc->quick ? 1 : 9, figures) : failed;
    clean_up(&room);
    return fault;
}
