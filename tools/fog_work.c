#include "fog_work.h"

#include "interrupt.h"
#include "workers.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A picture on its way. */
typedef struct work {
    const nb_fog_shared *shared;
    const nb_fog_files *files;
    nb_report_listener *listener;
    nebel_scene_desc host;
    nebel_photograph photograph;
    nebel_depth_map depth;
    nebel_intrinsics camera;
    int has_camera;
    float *transmittance; /* three a pixel; NULL: not wanted */
    nebel_snapshot *own_fog;
    nebel_pixels pixels;
    nb_fog_tale *tale;
} work;

static int fail(work *w, const char *format, ...) NB_REPORT_PRINTF(2, 3);

static int fail(work *w, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(w->listener->kept, sizeof w->listener->kept, format, arguments);
    va_end(arguments);
    return NB_FAILED;
}

/* The library has said why, or it is said here. */
static int judge(work *w, const char *path, nebel_result result)
{
    if (result == NEBEL_OK) return NB_DONE;
    return w->listener->kept[0] != '\0' ? NB_FAILED : fail(w, "%s: %s", path, nebel_result_text(result));
}

/* ---- what is read ---------------------------------------------------------------------------- */

static int is_float(const work *w)
{
    return w->photograph.type == NEBEL_PIXEL_RGB_FLOAT || w->photograph.type == NEBEL_PIXEL_RGBA_FLOAT;
}

static int read_picture(work *w)
{
    const nb_fog_files *const files = w->files;
    const int status = judge(w, files->image, nebel_read_photograph(files->image, &w->host, &w->photograph));
    if (status != NB_DONE) return status;
    const int is_exr = nebel_find_image_format(files->output) == NEBEL_IMAGE_EXR;
    if (is_exr != is_float(w))
        return fail(w, "%s: %s; name the result so: \"%s\"", files->image,
                    is_exr ? "a picture of whole numbers becomes a .png" : "an OpenEXR picture becomes an .exr",
                    files->output);
    if (is_float(w) && w->shared->wanted->blends_stored)
        return fail(w, "%s: floats are light, which --blend srgb does not mean; leave it out", files->image);
    w->tale->width = w->photograph.width;
    w->tale->height = w->photograph.height;
    return NB_DONE;
}

/* From what was given; has_camera stays 0 where nothing was. */
static int find_camera(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    const uint32_t width = w->photograph.width, height = w->photograph.height;
    w->has_camera = 1;
    if (w->files->camera != NULL)
        return judge(w, w->files->camera, nebel_read_intrinsics(w->files->camera, &w->host, &w->camera));
    if (wanted->has_intrinsics)
        w->camera = wanted->intrinsics;
    else if (wanted->hfov > 0)
        w->camera = nebel_intrinsics_of_view(wanted->hfov, width, height);
    else if (w->shared->scene_camera != NULL) {
        w->camera = nebel_intrinsics_of_view(w->shared->scene_fov, height, width);
        w->camera.cx = (width - 1.0) / 2;
        w->camera.cy = (height - 1.0) / 2;
    } else
        w->has_camera = 0;
    return NB_DONE;
}

static void follow_policies(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    float *const depth = w->depth.depth;
    const size_t count = (size_t)w->depth.width * w->depth.height;
    if (wanted->unknown == NB_FOG_FILL) nebel_fill_depth(&w->depth);
    for (size_t i = 0; i < count && wanted->unknown == NB_FOG_FAR && w->depth.unknown_count > 0; i++)
        if (isnan(depth[i])) depth[i] = INFINITY;
    if (isinf(wanted->sky)) return;
    for (size_t i = 0; i < count; i++)
        if (isinf(depth[i])) depth[i] = (float)wanted->sky;
}

static int read_depth(work *w)
{
    nebel_depth_source source = w->shared->wanted->depth;
    if (w->has_camera) source.camera = &w->camera;
    const int status = judge(w, w->files->depth, nebel_read_depth(w->files->depth, &source, &w->host, &w->depth));
    if (status != NB_DONE) return status;
    const nebel_depth_map *const map = &w->depth;
    if (map->width != w->photograph.width || map->height != w->photograph.height)
        return fail(w, "%s: the picture is %u x %u pixels, its depth \"%s\" %u x %u; both must have one size",
                    w->files->image, (unsigned)w->photograph.width, (unsigned)w->photograph.height, w->files->depth,
                    (unsigned)map->width, (unsigned)map->height);
    const double count = (double)map->width * map->height;
    w->tale->unknown = (double)map->unknown_count / count;
    w->tale->infinite = (double)map->infinite_count / count;
    follow_policies(w);
    return NB_DONE;
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* IEC 61966-2-1. */
static double decode(double c)
{
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static int find_airlight(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    memcpy(w->tale->airlight, wanted->airlight, sizeof w->tale->airlight);
    for (int c = 0; c < 3 && wanted->has_airlight && !is_float(w); c++)
        if (wanted->airlight[c] > 1)
            return fail(w, "%s: --airlight is at most 1 for pictures of whole numbers", w->files->image);
    if (wanted->has_airlight) return NB_DONE;
    return judge(w, w->files->image, nebel_estimate_airlight(&w->host, &w->photograph, w->tale->airlight));
}

/* Fog of one density everywhere. */
static int make_fog(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    const int is_light = is_float(w) || wanted->blends_stored;
    nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_WORLD}};
    nebel_fog *fog = NULL;
    const int status = find_airlight(w);
    if (status != NB_DONE) return status;
    for (int c = 0; c < 3; c++) {
        volume.extinction[c] = wanted->extinction;
        volume.source[c] = is_light ? w->tale->airlight[c] : decode(w->tale->airlight[c]);
    }
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){.log = w->host.log}, &fog);
    if (result == NEBEL_OK) result = nebel_add_volume(fog, &volume, NULL);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &w->own_fog);
    nebel_destroy_fog(fog);
    return judge(w, w->files->image, result);
}

/* Of the name without its folder, so that it does not matter where pictures lie. FNV-1a: Fowler, Noll and Vo. */
static uint32_t hash_name(const char *path)
{
    const char *const slash = strrchr(path, '/');
    uint32_t hash = 2166136261u;
    for (const char *at = slash != NULL ? slash + 1 : path; *at != '\0'; at++)
        hash = (hash ^ (unsigned char)*at) * 16777619u;
    return hash;
}

static int choose_fog(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    if (w->shared->scene == NULL) return make_fog(w);
    if (!wanted->has_seed) return NB_DONE;
    const uint32_t seed = wanted->seed ^ hash_name(w->files->image);
    return judge(w, wanted->scene, nebel_commit_scene_fog_anew(w->shared->scene, 0, seed, &w->own_fog));
}

static int aim(work *w)
{
    if (w->has_camera) {
        if (nebel_aim_pixels(&w->pixels, &w->camera, w->shared->scene_camera) == NEBEL_OK) return NB_DONE;
        return fail(w, "%s: the camera of the scene looks nowhere", w->shared->wanted->scene);
    }
    if (w->depth.type == NEBEL_DEPTH_RAY) { /* the direction does not matter */
        w->pixels.corner[2] = -1;
        return NB_DONE;
    }
    return fail(w,
                "%s: its depth is planar: how long the rays are depends on the camera; give --camera, --intrinsics or "
                "--hfov",
                w->files->depth);
}

typedef struct rows {
    const work *work;
    const nebel_snapshot *fog;
    nebel_result *results; /* one for each worker */
} rows;

/* In turns, because of the sky, which takes less time than the ground. */
static void fog_rows(int worker, int count, void *user)
{
    enum { BAND = 16 };
    const rows *const all = user;
    nebel_pixels part = all->work->pixels;
    for (uint32_t first = (uint32_t)worker * BAND; first < part.height; first += (uint32_t)count * BAND) {
        if (nb_interrupt_is_requested()) return;
        part.first_row = first;
        part.row_count = part.height - first < BAND ? part.height - first : BAND;
        const nebel_result result = nebel_fog_pixels(all->fog, NEBEL_ISA_DEFAULT, &part);
        if (result != NEBEL_OK) all->results[worker] = result;
    }
}

static int add_fog(work *w)
{
    nebel_result results[NB_WORKERS_MOST] = {NEBEL_OK};
    const nb_fog_shared *const shared = w->shared;
    const rows all = {w, w->own_fog != NULL ? w->own_fog : shared->scene_fog, results};
    nebel_pixels *const p = &w->pixels;
    p->depth_type = w->depth.type;
    p->width = w->depth.width;
    p->height = w->depth.height;
    p->depth = w->depth.depth;
    p->color = p->out = w->photograph.pixels;
    p->type = w->photograph.type;
    p->srgb = !is_float(w) && !shared->wanted->blends_stored;
    p->transmittance = w->transmittance;
    nb_workers_run(shared->row_threads, fog_rows, (void *)&all);
    for (int i = 0; i < shared->row_threads; i++)
        if (results[i] != NEBEL_OK) return judge(w, w->files->image, results[i]);
    return nb_interrupt_is_requested() ? fail(w, "%s: stopped", w->files->image) : NB_DONE;
}

/* ---- what is written ------------------------------------------------------------------------- */

static int allocate_transmittance(work *w)
{
    const size_t count = (size_t)w->photograph.width * w->photograph.height;
    if (w->files->transmittance == NULL) return NB_DONE;
    if (count <= SIZE_MAX / (3 * sizeof(float))) w->transmittance = malloc(count * 3 * sizeof(float));
    return w->transmittance != NULL ? NB_DONE : fail(w, "%s: out of memory", w->files->transmittance);
}

static nebel_result write_transmittance(const work *w)
{
    const char *const path = w->files->transmittance;
    const uint32_t width = w->photograph.width, height = w->photograph.height;
    float *const t = w->transmittance;
    if (nebel_find_image_format(path) == NEBEL_IMAGE_EXR) {
        const nebel_photograph picture = {width, height, NEBEL_PIXEL_RGB_FLOAT, t};
        return nebel_write_photograph(path, &w->host, &picture);
    }
    for (size_t i = 0; i < (size_t)width * height; i++) /* luminance, ITU-R BT.709 */
        t[i] = 0.2126f * t[3 * i] + 0.7152f * t[3 * i + 1] + 0.0722f * t[3 * i + 2];
    return nebel_write_gray(path, &w->host, width, height, t);
}

static int write_results(work *w)
{
    const nb_fog_files *const files = w->files;
    w->shared->hold(1);
    nebel_result result = nebel_write_photograph(files->output, &w->host, &w->photograph);
    const char *path = files->output;
    if (result == NEBEL_OK && files->transmittance != NULL) {
        path = files->transmittance;
        result = write_transmittance(w);
    }
    w->shared->hold(0);
    return judge(w, path, result);
}

/* Before the work. */
static int check_results(work *w)
{
    const char *path = w->files->output;
    w->shared->hold(1);
    nebel_result result = nebel_check_image_path(path, &w->host);
    if (result == NEBEL_OK && w->files->transmittance != NULL) {
        path = w->files->transmittance;
        result = nebel_check_image_path(path, &w->host);
    }
    w->shared->hold(0);
    return judge(w, path, result);
}

/* ---- all of it ------------------------------------------------------------------------------- */

static int run(work *w)
{
    int status = check_results(w);
    if (status == NB_DONE) status = read_picture(w);
    if (status == NB_DONE) status = find_camera(w);
    if (status == NB_DONE) status = read_depth(w);
    if (status == NB_DONE) status = aim(w);
    if (status == NB_DONE) status = choose_fog(w);
    if (status == NB_DONE) status = allocate_transmittance(w);
    if (status == NB_DONE) status = add_fog(w);
    return status == NB_DONE ? write_results(w) : status;
}

int nb_fog_work(const nb_fog_shared *shared, const nb_fog_files *files, nb_report_listener *listener, nb_fog_tale *tale)
{
    work w = {
        .shared = shared, .files = files, .listener = listener, .host = {.log = nb_report_log(listener)}, .tale = tale};
    *tale = (nb_fog_tale){0};
    const int status = run(&w);
    nebel_free_photograph(&w.host, &w.photograph);
    nebel_free_depth(&w.host, &w.depth);
    nebel_release_snapshot(w.own_fog);
    free(w.transmittance);
    return status;
}
