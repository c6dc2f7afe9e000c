#define _POSIX_C_SOURCE 200809L
#include "parts.h"

#include "folder.h"
#include "signals.h"
#include "record.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* FILE.parts/TEXT; free it. */
static char *name_in_folder(const nb_parts *parts, const char *text)
{
    static const char folder[] = ".parts/";
    const size_t size = strlen(parts->file) + strlen(text) + sizeof folder;
    char *const name = malloc(size);
    if (name == NULL)
        nb_report_message("%s: out of memory", parts->file);
    else
        (void)snprintf(name, size, "%s%s%s", parts->file, folder, text);
    return name;
}

char *nb_parallel_name(const nb_parts *parts, uint32_t part)
{
    char text[32];
    const char *const ending = nebel_get_image_format(parts->file) == NEBEL_IMAGE_EXR ? "exr" : "png";
    (void)snprintf(text, sizeof text, "%06lu.%s", (unsigned long)part, ending);
    return name_in_folder(parts, text);
}

int nb_parallel_make_folder(const nb_parts *parts)
{
    char *const folder = name_in_folder(parts, "");
    if (folder == NULL) return NB_FAILED;
    folder[strlen(folder) - 1] = '\0';
    const int status = nb_folder_make(folder);
    free(folder);
    return status;
}

int nb_parallel_have(const nb_parts *parts, uint32_t part)
{
    char wanted[NEBEL_MAX_RECORD + 1];
    char *const name = nb_parallel_name(parts, part);
    if (name == NULL) return 0;
    parts->record(parts->user, part, wanted);
    const int has = nb_record_is_in(name, wanted);
    free(name);
    return has;
}

int nb_parallel_have_all(const nb_parts *parts)
{
    for (uint32_t i = 0; i < parts->count; i++)
        if (!nb_parallel_have(parts, i)) return 0;
    return 1;
}

/* ---- the lock -------------------------------------------------------------------------------- */

static const char lock_name[] = "lock";

int nb_parallel_lock(const nb_parts *parts, int *lock)
{
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    char *const name = name_in_folder(parts, lock_name);
    *lock = name != NULL ? open(name, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666) : -1;
    free(name);
    if (*lock < 0 || fcntl(*lock, F_SETLK, &whole) == 0) return 1;
    const int is_taken = errno == EACCES || errno == EAGAIN;
    if (is_taken) (void)close(*lock);
    return !is_taken;
}

void nb_parallel_unlock(int lock)
{
    if (lock >= 0) (void)close(lock);
}

/* ---- joining --------------------------------------------------------------------------------- */

static int read_part(const nb_parts *parts, uint32_t part, nebel_image *image)
{
    const nebel_host host = {.log = nb_report_log(parts->listener)};
    char *const name = nb_parallel_name(parts, part);
    if (name == NULL) return NB_FAILED;
    const nebel_result result = nebel_read_image(name, &host, image);
    const int status = result == NEBEL_OK ? NB_DONE : nb_report_result(parts->listener, name, result);
    free(name);
    return status;
}

static void free_part(nebel_image *image)
{
    nebel_free_image(&(nebel_host){0}, image);
}

/* A picture in the making. */
typedef struct joining {
    nebel_image_writer *writer; /* NULL until the first part says which channels there are */
    nebel_image_desc desc;
    nebel_image first; /* keeps their names */
    uint32_t row;
} joining;

static int add_band(const nb_parts *parts, joining *joint, const nebel_image *band)
{
    if (band->width != joint->desc.width || band->height > joint->desc.height - joint->row ||
        band->channel_count != joint->desc.channel_count)
        return nb_report_failure("%s: its parts do not fit together; remove the folder \"%s.parts\" and render again",
                                 parts->file, parts->file);
    const nebel_result result = nebel_add_image_rows(joint->writer, band->height, band->samples);
    joint->row += band->height;
    return result == NEBEL_OK ? NB_DONE : nb_report_result(parts->listener, parts->file, result);
}

static int begin_picture(const nb_parts *parts, joining *joint)
{
    const int status = read_part(parts, 0, &joint->first);
    if (status != NB_DONE) return status;
    joint->desc.channel_count = joint->first.channel_count;
    joint->desc.channel_names = joint->first.channel_names;
    const nebel_result result = nebel_create_image_writer(parts->file, &joint->desc, &joint->writer);
    return result == NEBEL_OK ? add_band(parts, joint, &joint->first)
                              : nb_report_result(parts->listener, parts->file, result);
}

static int add_part(const nb_parts *parts, uint32_t part, joining *joint)
{
    nebel_image band;
    int status = read_part(parts, part, &band);
    if (status == NB_DONE) status = add_band(parts, joint, &band);
    free_part(&band);
    return status;
}

int nb_parallel_join_picture(const nb_parts *parts, uint32_t width, uint32_t height, const char *record)
{
    joining joint = {
        .desc = {.host.log = nb_report_log(parts->listener), .width = width, .height = height, .record = record}};
    nb_interrupt_hold(); /* as long as the temporary file is there */
    int status = begin_picture(parts, &joint);
    for (uint32_t i = 1; i < parts->count && status == NB_DONE && !nb_interrupt_is_requested(); i++)
        status = add_part(parts, i, &joint);
    if (status == NB_DONE && !nb_interrupt_is_requested()) {
        const nebel_result result = nebel_finish_image(joint.writer);
        if (result != NEBEL_OK) status = nb_report_result(parts->listener, parts->file, result);
    }
    nebel_destroy_image_writer(joint.writer);
    free_part(&joint.first);
    nb_interrupt_release();
    return status;
}

static int add_frames(const nb_parts *parts, nebel_movie *film)
{
    for (uint32_t i = 0; i < parts->count; i++) {
        nebel_image picture;
        const int status = read_part(parts, i, &picture);
        if (status != NB_DONE) return status;
        nb_interrupt_hold(); /* whether there is room is tried with a file */
        const nebel_result result = nebel_add_movie_frame(film, &picture);
        nb_interrupt_release();
        free_part(&picture);
        if (result != NEBEL_OK) return nb_report_result(parts->listener, parts->file, result);
        if (nb_interrupt_is_requested()) return NB_DONE;
    }
    return NB_DONE;
}

int nb_parallel_join_film(const nb_parts *parts, const nebel_movie_desc *desc, const char *record)
{
    nebel_movie *film = NULL;
    nb_interrupt_hold();
    nebel_result result = nebel_create_movie(parts->file, desc, &film);
    nb_interrupt_release();
    if (result == NEBEL_OK) result = nebel_set_movie_record(film, record);
    int status = result == NEBEL_OK ? add_frames(parts, film) : nb_report_result(parts->listener, parts->file, result);
    if (status == NB_DONE && !nb_interrupt_is_requested()) {
        nb_interrupt_hold();
        result = nebel_finish_movie(film);
        nb_interrupt_release();
        if (result != NEBEL_OK) status = nb_report_result(parts->listener, parts->file, result);
    }
    nebel_destroy_movie(film);
    return status;
}

/* ---- removing -------------------------------------------------------------------------------- */

static int ends_in(const char *name, const char *end)
{
    const size_t size = strlen(name), length = strlen(end);
    return size > length && strcmp(name + size - length, end) == 0;
}

/* Digits and an ending, as parts are named, also those of other bands; and as src/scene names what is not finished. */
static int is_ours(const char *name)
{
    static const char unfinished[] = ".nebel-";
    const size_t digits = strspn(name, "0123456789");
    if (strcmp(name, lock_name) == 0) return 1;
    if (strncmp(name, unfinished, sizeof unfinished - 1) == 0) return ends_in(name, ".tmp");
    return digits >= 6 && (strcmp(name + digits, ".png") == 0 || strcmp(name + digits, ".exr") == 0);
}

static void remove_files(const nb_parts *parts, const char *folder)
{
    DIR *const open = opendir(folder);
    if (open == NULL) return;
    for (const struct dirent *entry = readdir(open); entry != NULL; entry = readdir(open)) {
        char *const name = is_ours(entry->d_name) ? name_in_folder(parts, entry->d_name) : NULL;
        if (name != NULL) (void)unlink(name);
        free(name);
    }
    (void)closedir(open);
}

void nb_parallel_remove(const nb_parts *parts)
{
    char *const folder = name_in_folder(parts, "");
    if (folder == NULL) return;
    remove_files(parts, folder);
    (void)rmdir(folder);
    free(folder);
}
