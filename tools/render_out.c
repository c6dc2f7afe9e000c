#define _POSIX_C_SOURCE 200809L
#include "render_out.h"

#include "folder.h"
#include "signals.h"
#include "parts.h"
#include "frame_pattern.h"
#include "record.h"
#include "output_check.h"

#include <nebel/nebel.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Pixels of a band where nobody says how many rows it has: a few megabytes, and seconds of work. */
enum { BAND_PIXELS = 1 << 18 };

static uint32_t choose_band_rows(const nb_render_arguments *wanted, int is_spread)
{
    const uint32_t steps = BAND_PIXELS / (NEBEL_WINDOW_STEP * wanted->width);
    if (wanted->band_rows > 0) return wanted->band_rows;
    if (!is_spread || wanted->many_frames || wanted->gl || nb_target_is_special(wanted->output)) return 0;
    return (steps > 0 ? steps : 1) * NEBEL_WINDOW_STEP;
}

static uint32_t count_frames(const nb_render_arguments *wanted)
{
    return wanted->last_frame - wanted->first_frame + 1;
}

static uint32_t count_bands(const nb_render_out *out)
{
    return out->band_rows > 0 ? (out->wanted->height + out->band_rows - 1) / out->band_rows : 1;
}

nb_render_out nb_render_out_of(const nb_render_arguments *wanted, const nb_jobs *jobs, nb_report_listener *listener)
{
    const int is_spread = nb_jobs_are_shared(jobs) || wanted->resume;
    nb_render_out out = {.wanted = wanted, .listener = listener, .asked = UINT64_MAX};
    if (wanted->is_film) {
        out.part_count = is_spread ? count_frames(wanted) : 0;
        return out;
    }
    out.band_rows = choose_band_rows(wanted, is_spread);
    if (count_bands(&out) == 1) out.band_rows = 0;
    out.part_count = out.band_rows > 0 ? count_bands(&out) : 0;
    return out;
}

/* ---- items ----------------------------------------------------------------------------------- */

uint64_t nb_render_out_count_items(const nb_render_out *out)
{
    return (uint64_t)count_frames(out->wanted) * count_bands(out);
}

uint64_t nb_render_out_group(const nb_render_out *out)
{
    return out->part_count > 0 ? out->part_count : 1;
}

nb_render_item nb_render_out_item(const nb_render_out *out, uint64_t number)
{
    const nb_render_arguments *const wanted = out->wanted;
    const uint32_t bands = count_bands(out), band = (uint32_t)(number % bands);
    nb_render_item item = {.number = number,
                           .frame = wanted->first_frame + (uint32_t)(number / bands),
                           .window = {0, 0, wanted->width, wanted->height}};
    if (bands == 1) return item;
    item.window.top = band * out->band_rows;
    const uint32_t left = wanted->height - item.window.top;
    item.window.height = left < out->band_rows ? left : out->band_rows;
    return item;
}

/* The file name of a frame; free it. NULL after a message. */
static char *name_picture(const nb_render_arguments *wanted, uint32_t frame)
{
    char *const name =
        wanted->many_frames && !wanted->is_film ? nb_pattern_expand(wanted->output, frame) : strdup(wanted->output);
    if (name == NULL) (void)nb_report_failure("render: %s: out of memory", wanted->output);
    return name;
}

/* ---- before the work ------------------------------------------------------------------------- */

static int check_picture(const nb_render_arguments *wanted, uint32_t frame)
{
    char *const name = name_picture(wanted, frame);
    int status = name != NULL ? nb_folder_make_for(name) : NB_FAILED;
    if (status == NB_DONE) status = nb_target_check(name);
    free(name);
    return status;
}

/* Each process looks at its own; of those that joined the first one does it for all. */
int nb_render_out_check(const nb_render_out *out, const nb_jobs *jobs)
{
    const nb_render_arguments *const wanted = out->wanted;
    const uint32_t step = jobs->shard.count > 0 && count_bands(out) == 1 ? jobs->shard.count : 1;
    const uint32_t first = step > 1 ? jobs->shard.number : 0;
    if (wanted->is_film)
        return nb_folder_make_for(wanted->output); /* nebel_create_movie does the rest, in each process */
    if (!jobs->is_chief) return NB_DONE;
    for (uint64_t i = first; i < count_frames(wanted); i += step) {
        if (nb_interrupt_is_requested()) break;
        const int status = check_picture(wanted, wanted->first_frame + (uint32_t)i);
        if (status != NB_DONE) return status;
    }
    return NB_DONE;
}

int nb_render_out_spare(const nb_render_out *out, const nebel_scene_data *contents)
{
    const nb_render_arguments *const wanted = out->wanted;
    const uint32_t last = wanted->is_film ? wanted->first_frame : wanted->last_frame;
    for (uint32_t frame = wanted->first_frame; frame <= last; frame++) {
        char *const name = name_picture(wanted, frame);
        const int status = name != NULL ? nb_target_spare(name, wanted->scene, contents) : NB_FAILED;
        free(name);
        if (status != NB_DONE) return status;
    }
    return NB_DONE;
}

static nebel_movie_desc film_desc(const nb_render_out *out)
{
    return (nebel_movie_desc){.host.log = nb_report_log(out->listener),
                              .frames_per_second = out->wanted->fps,
                              .quality = out->wanted->quality};
}

int nb_render_out_open(nb_render_out *out)
{
    const nb_render_arguments *const wanted = out->wanted;
    if (!wanted->is_film) return NB_DONE;
    const nebel_movie_desc desc = film_desc(out);
    nb_interrupt_hold();
    const nebel_result result = nebel_create_movie(wanted->output, &desc, &out->film);
    nb_interrupt_release();
    if (result != NEBEL_OK) return nb_report_result(out->listener, wanted->output, result);
    if (out->part_count == 0) return NB_DONE;
    nebel_destroy_movie(out->film); /* it could be made; who joins the parts makes it again */
    out->film = NULL;
    return NB_DONE;
}

/* ---- records --------------------------------------------------------------------------------- */

/* Whatever changes a pixel; threads and instruction sets do not. */
static void add_options(const nb_render_arguments *wanted, const nebel_scene_data *contents, nb_fingerprint *print)
{
    const uint64_t whole[] = {wanted->width,
                              wanted->height,
                              wanted->samples,
                              (uint64_t)wanted->format,
                              (uint64_t)wanted->aov,
                              (uint64_t)wanted->gl,
                              (uint64_t)wanted->method,
                              (uint64_t)(contents->diffusion != NULL),
                              wanted->bounces,
                              wanted->seed,
                              wanted->tessellation.max_triangles,
                              wanted->tessellation.max_depth};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) nb_fingerprint_add_whole(print, whole[i]);
    const double numbers[] = {wanted->exposure, wanted->tolerance, wanted->shutter, wanted->tessellation.max_error};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) nb_fingerprint_add_number(print, numbers[i]);
}

int nb_render_out_sign(nb_render_out *out, const nebel_scene_data *contents)
{
    const nb_render_arguments *const wanted = out->wanted;
    const int needs_it = out->part_count > 0 || wanted->resume;
    if (!nb_record_can_add_scene(wanted->scene))
        return needs_it ? nb_report_failure("render: %s: --shard, --resume, --bands and MPI need a scene in a file",
                                            wanted->scene)
                        : NB_DONE;
    out->base = nb_record_start();
    out->has_base = 1;
    add_options(wanted, contents, &out->base);
    nb_record_add_scene(&out->base, wanted->scene, contents);
    return NB_DONE;
}

static nb_fingerprint print_picture(const nb_render_out *out, uint32_t frame)
{
    nb_fingerprint print = out->base;
    nb_fingerprint_add_text(&print, "picture");
    nb_fingerprint_add_whole(&print, frame);
    return print;
}

/* Of a picture in a file of its own, or a film. */
static void record_file(const nb_render_out *out, uint32_t frame, char record[NEBEL_MAX_RECORD + 1])
{
    const nb_render_arguments *const wanted = out->wanted;
    nb_fingerprint print = print_picture(out, frame);
    if (wanted->is_film) {
        print = out->base;
        nb_fingerprint_add_text(&print, "film");
        nb_fingerprint_add_whole(&print, wanted->first_frame);
        nb_fingerprint_add_whole(&print, wanted->last_frame);
        nb_fingerprint_add_number(&print, wanted->fps);
        nb_fingerprint_add_whole(&print, (uint64_t)wanted->quality);
    }
    nb_record_write(&print, "render", record);
}

/* Of a picture as a whole, or of its band. */
static void record_item(const nb_render_out *out, const nb_render_item *item, char record[NEBEL_MAX_RECORD + 1])
{
    nb_fingerprint print = print_picture(out, item->frame);
    if (out->band_rows > 0) {
        nb_fingerprint_add_text(&print, "band");
        nb_fingerprint_add_whole(&print, item->window.top);
        nb_fingerprint_add_whole(&print, item->window.height);
    }
    nb_record_write(&print, "render", record);
}

void nb_render_out_name_job(const nb_render_out *out, char name[NEBEL_MAX_RECORD + 1])
{
    nb_fingerprint print = out->base;
    name[0] = '\0';
    if (!out->has_base) return;
    nb_fingerprint_add_text(&print, out->wanted->output);
    nb_fingerprint_add_whole(&print, out->wanted->first_frame);
    nb_fingerprint_add_whole(&print, out->wanted->last_frame);
    nb_fingerprint_add_whole(&print, out->band_rows);
    nb_fingerprint_add_whole(&print, (uint64_t)out->wanted->resume);
    nb_record_write(&print, "render", name);
}

/* ---- parts ----------------------------------------------------------------------------------- */

/* The parts of one file. */
typedef struct group {
    const nb_render_out *out;
    uint64_t first; /* item */
} group;

static uint64_t first_of(const nb_render_out *out, uint64_t number)
{
    return number / nb_render_out_group(out) * nb_render_out_group(out);
}

static void record_part(void *user, uint32_t part, char record[NEBEL_MAX_RECORD + 1])
{
    const group *const of = user;
    const nb_render_item item = nb_render_out_item(of->out, of->first + part);
    record_item(of->out, &item, record);
}

static nb_parts parts_of(group *of, const char *file)
{
    return (nb_parts){
        .file = file, .count = of->out->part_count, .listener = of->out->listener, .record = record_part, .user = of};
}

static int has_file(const nb_render_out *out, const char *name, uint32_t frame)
{
    char wanted[NEBEL_MAX_RECORD + 1];
    record_file(out, frame, wanted);
    return nb_record_is_in(name, wanted);
}

int nb_render_out_has(nb_render_out *out, const nb_render_item *item)
{
    if (!out->wanted->resume) return 0;
    char *const name = name_picture(out->wanted, item->frame);
    if (name == NULL) return 0;
    const uint64_t number = item->number / nb_render_out_group(out);
    if (out->asked != number) out->is_current = has_file(out, name, item->frame);
    out->asked = number;
    int has = out->is_current;
    if (!has && out->part_count > 0) {
        group of = {out, first_of(out, item->number)};
        const nb_parts parts = parts_of(&of, name);
        has = nb_parallel_have(&parts, (uint32_t)(item->number - of.first));
    }
    free(name);
    return has;
}

int nb_render_out_is_made(const nb_render_out *out, uint64_t item)
{
    group of = {out, first_of(out, item)};
    const uint32_t frame = nb_render_out_item(out, item).frame;
    char *const name = name_picture(out->wanted, frame);
    int is_made = name != NULL && access(name, F_OK) == 0;
    if (name != NULL && !is_made && out->part_count > 0) {
        const nb_parts parts = parts_of(&of, name);
        char *const part = nb_parallel_name(&parts, (uint32_t)(item - of.first));
        is_made = part != NULL && access(part, F_OK) == 0;
        free(part);
    }
    free(name);
    return is_made;
}

/* ---- writing --------------------------------------------------------------------------------- */

static nebel_result write_image(const char *name, const nebel_image_desc *desc, const nebel_image *image)
{
    nebel_image_writer *writer = NULL;
    nebel_result result = nebel_create_image_writer(name, desc, &writer);
    if (result == NEBEL_OK) result = nebel_add_image_rows(writer, image->height, image->samples);
    if (result == NEBEL_OK) result = nebel_finish_image(writer);
    nebel_destroy_image_writer(writer);
    return result;
}

static int write_file(const nb_render_out *out, const nb_render_item *item, const char *name, const nebel_image *image)
{
    char record[NEBEL_MAX_RECORD + 1];
    record_item(out, item, record);
    const nebel_image_desc desc = {.host.log = nb_report_log(out->listener),
                                   .width = image->width,
                                   .height = image->height,
                                   .channel_count = image->channel_count,
                                   .channel_names = image->channel_names,
                                   .record = out->has_base ? record : NULL};
    nb_interrupt_hold();
    const nebel_result result = write_image(name, &desc, image);
    nb_interrupt_release();
    return result == NEBEL_OK ? NB_DONE : nb_report_result(out->listener, name, result);
}

static int write_part(const nb_render_out *out, const nb_render_item *item, const char *file, const nebel_image *image)
{
    group of = {out, first_of(out, item->number)};
    const nb_parts parts = parts_of(&of, file);
    int status = nb_parallel_make_folder(&parts);
    if (status != NB_DONE) return status;
    char *const name = nb_parallel_name(&parts, (uint32_t)(item->number - of.first));
    if (name == NULL) return NB_FAILED;
    status = write_file(out, item, name, image);
    free(name);
    return status;
}

int nb_render_out_write(nb_render_out *out, const nb_render_item *item, const nebel_image *image)
{
    if (out->film != NULL) {
        const nebel_result result = nebel_add_movie_frame(out->film, image);
        return result == NEBEL_OK ? NB_DONE : nb_report_result(out->listener, out->wanted->output, result);
    }
    char *const name = name_picture(out->wanted, item->frame);
    if (name == NULL) return NB_FAILED;
    const int status = out->part_count > 0 ? write_part(out, item, name, image) : write_file(out, item, name, image);
    free(name);
    return status;
}

/* ---- joining --------------------------------------------------------------------------------- */

static int join_parts(const nb_render_out *out, const nb_parts *parts, uint32_t frame)
{
    char record[NEBEL_MAX_RECORD + 1];
    const nebel_movie_desc desc = film_desc(out);
    record_file(out, frame, record);
    return out->wanted->is_film ? nb_parallel_join_film(parts, &desc, record)
                                : nb_parallel_join_picture(parts, out->wanted->width, out->wanted->height, record);
}

/* With the lock: another process may have joined the parts meanwhile. If it was removing their folder when the lock was made there, it left
 * the folder. */
static int join_and_remove(const nb_render_out *out, const nb_parts *parts, uint32_t frame)
{
    int is_joined = 0, status = NB_DONE;
    if (nb_parallel_have_all(parts)) {
        status = join_parts(out, parts, frame);
        is_joined = status == NB_DONE && !nb_interrupt_is_requested();
    } else {
        is_joined = has_file(out, parts->file, frame);
    }
    if (is_joined) nb_parallel_remove(parts);
    return status;
}

/* Of shards that end at the same time one joins. */
static int join(const nb_render_out *out, const nb_parts *parts, uint32_t frame)
{
    int lock;
    if (out->wanted->resume && has_file(out, parts->file, frame)) {
        nb_parallel_remove(parts); /* what was left when the process that joined them was ended */
        return NB_DONE;
    }
    if (!nb_parallel_have_all(parts) || !nb_parallel_lock(parts, &lock)) return NB_DONE;
    const int status = join_and_remove(out, parts, frame);
    nb_parallel_unlock(lock);
    return status;
}

int nb_render_out_join(nb_render_out *out, const nb_render_item *item)
{
    if (out->part_count == 0) return NB_DONE;
    char *const name = name_picture(out->wanted, item->frame);
    if (name == NULL) return NB_FAILED;
    group of = {out, first_of(out, item->number)};
    const nb_parts parts = parts_of(&of, name);
    const int status = join(out, &parts, item->frame);
    free(name);
    return status;
}

int nb_render_out_finish(nb_render_out *out)
{
    if (out->film == NULL) return NB_DONE;
    char record[NEBEL_MAX_RECORD + 1];
    record_file(out, out->wanted->first_frame, record);
    nebel_result result = out->has_base ? nebel_set_movie_record(out->film, record) : NEBEL_OK;
    nb_interrupt_hold();
    if (result == NEBEL_OK) result = nebel_finish_movie(out->film);
    nb_interrupt_release();
    return result == NEBEL_OK ? NB_DONE : nb_report_result(out->listener, out->wanted->output, result);
}

void nb_render_out_free(nb_render_out *out)
{
    nebel_destroy_movie(out->film);
    out->film = NULL;
}
