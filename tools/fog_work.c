#include "fog_work.h"

#include "signals.h"
#include "record.h"
#include "thread_pool.h"

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
    nebel_host host;
    nebel_photograph photograph;
    nebel_depth_map depth;
    nebel_intrinsics camera;
    int has_camera;
    uint32_t frame;                         /* of the scene, and */
    nebel_camera scene_camera;              /* its camera then */
    int needs_picture, needs_transmittance; /* which is not there */
    nb_fog_records records;
    float *transmittance; /* three a pixel; NULL: not needed */
    nebel_snapshot *own_fog;
    nebel_lighting *own_lighting;
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

/* The same of a call that does not know of the file, and cannot name it. */
static int judge_for(work *w, const char *path, nebel_result result)
{
    char said[sizeof w->listener->kept];
    if (result == NEBEL_OK || w->listener->kept[0] == '\0') return judge(w, path, result);
    memcpy(said, w->listener->kept, sizeof said);
    return fail(w, "%s: %s", path, said);
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
    const int is_exr = nebel_get_image_format(files->output) == NEBEL_IMAGE_EXR;
    if (is_exr != is_float(w))
        return fail(w, "%s: %s; name the result so: \"%s\"", files->image,
                    is_exr ? "a picture of whole numbers becomes a .png" : "an OpenEXR picture becomes an .exr",
                    files->output);
    if (is_float(w) && w->shared->wanted->blends_stored)
        return fail(w, "%s: floats are light, which --blend srgb does not mean; leave it out", files->image);
    return NB_DONE;
}

static int find_frame(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    if (w->shared->scene == NULL) return NB_DONE;
    w->frame = wanted->frame_of_name ? w->files->number : wanted->frame;
    if (w->frame > NB_FOG_LAST_FRAME)
        return fail(w, "%s: --frame name: there is no number up to %d where the last * is", w->files->image,
                    NB_FOG_LAST_FRAME);
    w->scene_camera = nebel_get_scene_camera(w->shared->scene, w->frame);
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
    else if (w->shared->scene != NULL) {
        w->camera = nebel_intrinsics_of_view(w->scene_camera.vertical_fov, height, width); /* from top to bottom */
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
    w->tale->pixels = (size_t)map->width * map->height;
    w->tale->unknown = map->unknown_count;
    w->tale->infinite = map->infinite_count;
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
    return judge_for(w, w->files->image, nebel_estimate_airlight(&w->host, &w->photograph, w->tale->airlight));
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
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){.host.log = w->host.log}, &fog);
    if (result == NEBEL_OK) result = nebel_add_volume(fog, &volume, NULL);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &w->own_fog);
    nebel_destroy_fog(fog);
    return judge_for(w, w->files->image, result);
}

static int choose_fog(work *w)
{
    const nb_fog_call *const wanted = w->shared->wanted;
    if (w->shared->scene == NULL) return make_fog(w);
    nebel_result result = NEBEL_OK;
    if (wanted->has_seed) {
        const uint32_t seed = nb_fog_record_seed(wanted, w->files->image);
        result = nebel_commit_scene_fog_anew(w->shared->scene, w->frame, seed, &w->own_fog);
    } else if (wanted->frame_of_name && nebel_get_scene_data(w->shared->scene)->animated_volume_count > 0)
        result = nebel_commit_scene_fog_at(w->shared->scene, w->frame, &w->own_fog);
    if (result == NEBEL_OK && w->own_fog != NULL)
        result = nebel_create_scene_lighting(w->shared->scene, w->own_fog, w->frame, w->shared->scene_lighting,
                                             &w->own_lighting);
    w->pixels.lighting = w->own_fog != NULL ? w->own_lighting : w->shared->scene_lighting;
    return judge(w, wanted->scene, result);
}

static int aim(work *w)
{
    if (w->has_camera) {
        const nebel_camera *const place = w->shared->scene != NULL ? &w->scene_camera : NULL;
        if (nebel_aim_pixels(&w->pixels, &w->camera, place) == NEBEL_OK) return NB_DONE;
        return fail(w, "%s: the camera of the scene looks nowhere", w->shared->wanted->scene);
    }
    if (w->depth.type == NEBEL_PIXEL_DEPTH_RADIAL) { /* the direction does not matter */
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
    const nb_fog_shared *const shared = all->work->shared;
    nebel_pixels part = all->work->pixels;
    for (uint32_t first = (uint32_t)worker * BAND; first < part.height; first += (uint32_t)count * BAND) {
        if (nb_interrupt_is_requested()) return;
        shared->answer(shared->user);
        part.first_row = first;
        part.row_count = part.height - first < BAND ? part.height - first : BAND;
        const nebel_result result = nebel_apply_fog_to_pixels(all->fog, NEBEL_ISA_DEFAULT, &part);
        if (result != NEBEL_OK) all->results[worker] = result;
    }
}

static int add_fog(work *w)
{
    nebel_result results[NB_MAX_WORKERS] = {NEBEL_OK};
    const nb_fog_shared *const shared = w->shared;
    const rows all = {w, w->own_fog != NULL ? w->own_fog : shared->scene_fog, results};
    nebel_pixels *const p = &w->pixels;
    p->depth_type = w->depth.type;
    p->width = w->depth.width;
    p->height = w->depth.height;
    p->depth = w->depth.depth;
    p->color = p->output = w->photograph.pixels;
    p->type = w->photograph.type;
    p->srgb = !is_float(w) && !shared->wanted->blends_stored;
    p->transmittance = w->transmittance;
    nb_workers_run(shared->row_threads, fog_rows, (void *)&all);
    for (int i = 0; i < shared->row_threads; i++)
        if (results[i] != NEBEL_OK) return judge_for(w, w->files->image, results[i]);
    return nb_interrupt_is_requested() ? fail(w, "%s: stopped", w->files->image) : NB_DONE;
}

/* ---- what is written ------------------------------------------------------------------------- */

static int allocate_transmittance(work *w)
{
    const size_t count = (size_t)w->photograph.width * w->photograph.height;
    if (!w->needs_transmittance) return NB_DONE;
    if (count <= SIZE_MAX / (3 * sizeof(float))) w->transmittance = malloc(count * 3 * sizeof(float));
    return w->transmittance != NULL ? NB_DONE : fail(w, "%s: out of memory", w->files->transmittance);
}

static nebel_result write_transmittance(const work *w)
{
    const char *const path = w->files->transmittance;
    const char *const record = w->shared->start != NULL ? w->records.transmittance : NULL;
    const uint32_t width = w->photograph.width, height = w->photograph.height;
    float *const t = w->transmittance;
    if (nebel_get_image_format(path) == NEBEL_IMAGE_EXR) {
        const nebel_photograph picture = {width, height, NEBEL_PIXEL_RGB_FLOAT, t};
        return nebel_write_photograph(path, &w->host, &picture, record);
    }
    for (size_t i = 0; i < (size_t)width * height; i++) /* luminance, ITU-R BT.709 */
        t[i] = 0.2126f * t[3 * i] + 0.7152f * t[3 * i + 1] + 0.0722f * t[3 * i + 2];
    return nebel_write_gray(path, &w->host, width, height, t, record);
}

static nebel_result write_picture(const work *w)
{
    const char *const record = w->shared->start != NULL ? w->records.picture : NULL;
    return nebel_write_photograph(w->files->output, &w->host, &w->photograph, record);
}

static nebel_result check_picture(const work *w)
{
    return nebel_check_image_path(w->files->output, &w->host);
}

static nebel_result check_transmittance(const work *w)
{
    return nebel_check_image_path(w->files->transmittance, &w->host);
}

typedef nebel_result result_fn(const work *w);

/* With those results that are needed. */
static int do_results(work *w, result_fn *with_picture, result_fn *with_transmittance)
{
    const char *path = w->files->output;
    nebel_result result = NEBEL_OK;
    w->shared->hold(1);
    if (w->needs_picture) result = with_picture(w);
    if (result == NEBEL_OK && w->needs_transmittance) {
        path = w->files->transmittance;
        result = with_transmittance(w);
    }
    w->shared->hold(0);
    w->tale->cannot_write = result == NEBEL_ERROR_FILE;
    return judge(w, path, result);
}

/* Which results are missing, or made from something else. What is read later than this leaves a record that is older, so that a file
 * that changes in between makes the result a stale one. */
static void find_needs(work *w)
{
    const nb_fog_shared *const shared = w->shared;
    const nb_fog_files *const files = w->files;
    w->needs_picture = 1;
    w->needs_transmittance = files->transmittance != NULL;
    if (shared->start == NULL) return;
    nb_fingerprint print = *shared->start;
    nb_fog_record_add(&print, shared->wanted, files);
    w->records = nb_fog_record_write(&print);
    if (!shared->wanted->resume) return;
    w->needs_picture = !nb_record_is_in(files->output, w->records.picture);
    if (w->needs_transmittance)
        w->needs_transmittance = !nb_record_is_in(files->transmittance, w->records.transmittance);
    w->tale->is_kept = !w->needs_picture && !w->needs_transmittance;
    w->tale->has_replaced = !w->tale->is_kept && nb_fog_names_are_made(files);
}

/* ---- all of it ------------------------------------------------------------------------------- */

static int run(work *w)
{
    if (w->files->refused != NULL) return fail(w, NB_FOG_REFUSAL, w->files->refused);
    find_needs(w);
    if (w->tale->is_kept) return NB_DONE;
    int status = do_results(w, check_picture, check_transmittance); /* before the work */
    if (status == NB_DONE) status = read_picture(w);
    if (status == NB_DONE) status = find_frame(w);
    if (status == NB_DONE) status = find_camera(w);
    if (status == NB_DONE) status = read_depth(w);
    if (status == NB_DONE) status = aim(w);
    if (status == NB_DONE) status = choose_fog(w);
    if (status == NB_DONE) status = allocate_transmittance(w);
    if (status == NB_DONE) status = add_fog(w);
    return status == NB_DONE ? do_results(w, write_picture, write_transmittance) : status;
}

int nb_fog_work(const nb_fog_shared *shared, const nb_fog_files *files, nb_report_listener *listener, nb_fog_tale *tale)
{
    work w = {
        .shared = shared, .files = files, .listener = listener, .host = {.log = nb_report_log(listener)}, .tale = tale};
    *tale = (nb_fog_tale){0};
    const int status = run(&w);
    nebel_free_photograph(&w.host, &w.photograph);
    nebel_free_depth(&w.host, &w.depth);
    nebel_release_lighting(w.own_lighting);
    nebel_release_snapshot(w.own_fog);
    free(w.transmittance);
    return status;
}
