#define _POSIX_C_SOURCE 200809L
#include "output_check.h"

#include "signals.h"
#include "fd_output.h"
#include "messages.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int nb_target_check(const char *path)
{
    nb_report_listener listener = {0};
    const nebel_host host = {.log = nb_report_log(&listener)};
    nb_interrupt_hold();
    const nebel_result result = nebel_check_image_path(path, &host);
    nb_interrupt_release();
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&listener, path, result);
}

int nb_target_is_same(const char *path, const char *other)
{
    struct stat a, b;
    return stat(path, &a) == 0 && stat(other, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

int nb_target_spare(const char *path, const char *scene, const nebel_scene_data *contents)
{
    if (nb_target_is_same(path, scene))
        return nb_report_failure("cannot write \"%s\": it is the scene; name another file", path);
    for (size_t i = 0; i < contents->path_count; i++)
        if (nb_target_is_same(path, contents->paths[i]))
            return nb_report_failure("cannot write \"%s\": the scene reads \"%s\" from there; name another file", path,
                                     contents->paths[i]);
    return NB_DONE;
}

/* ---- files that are no pictures -------------------------------------------------------------- */

static int is_open_already(const char *path)
{
    static const char *const places[] = {"/dev/fd/", "/dev/std", "/proc/self/fd/"};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        if (strncmp(path, places[i], strlen(places[i])) == 0) return 1;
    return 0;
}

static int is_null(const struct stat *status)
{
    struct stat null;
    return S_ISCHR(status->st_mode) && stat("/dev/null", &null) == 0 && status->st_rdev == null.st_rdev;
}

static int may_be_written(const char *path, const struct stat *status)
{
    return S_ISREG(status->st_mode) || is_open_already(path) || is_null(status);
}

int nb_target_is_special(const char *path)
{
    struct stat status;
    return is_open_already(path) || (stat(path, &status) == 0 && is_null(&status));
}

static int refuse(const char *path)
{
    return nb_report_failure("cannot write \"%s\": it is a device, a pipe or a socket; name a file", path);
}

int nb_target_open(const char *path, int *file)
{
    struct stat status;
    *file = -1;
    if (stat(path, &status) == 0 && !S_ISDIR(status.st_mode) && !may_be_written(path, &status)) return refuse(path);
    const int opened = open(path, O_WRONLY | O_CREAT | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666);
    if (opened < 0) return nb_report_failure("cannot write \"%s\": %s", path, strerror(errno));
    if (fstat(opened, &status) != 0 || !may_be_written(path, &status)) {
        (void)close(opened);
        return refuse(path);
    }
    (void)fcntl(opened, F_SETFL, is_open_already(path) ? O_APPEND : 0); /* what is slow to read is waited for */
    *file = opened;
    return NB_DONE;
}

int nb_target_replace(int file, const char *path, const char *text, size_t size)
{
    struct stat status;
    const int is_whole = fstat(file, &status) == 0 && S_ISREG(status.st_mode) && !is_open_already(path);
    int error = is_whole && (lseek(file, 0, SEEK_SET) != 0 || ftruncate(file, 0) != 0) ? errno : 0;
    if (error == 0) error = nb_output_write(file, text, size);
    if (close(file) != 0 && error == 0) error = errno;
    if (error != 0 && is_whole) (void)unlink(path); /* no half of it */
    return error == 0 ? NB_DONE : nb_report_failure("cannot write \"%s\": %s", path, strerror(error));
}

/* One that is replaced again and again. */
static int check_list(const char *path)
{
    struct stat status;
    int file;
    const int result = nb_target_open(path, &file);
    if (result != NB_DONE) return result;
    const int is_regular = fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    (void)close(file);
    return is_regular ? NB_DONE : refuse(path);
}

FILE *nb_target_open_list(const char *path)
{
    struct stat status;
    const int file = open(path, O_WRONLY | O_CREAT | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666);
    if (file < 0) return NULL;
    const int good = fstat(file, &status) == 0 && S_ISREG(status.st_mode) && ftruncate(file, 0) == 0;
    FILE *const stream = good ? fdopen(file, "w") : NULL;
    if (stream == NULL) (void)close(file);
    return stream;
}

static const char *name_in_folder(const char *path)
{
    const char *const slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static int stat_folder(const char *path, struct stat *status)
{
    char folder[4096];
    const int size = (int)(name_in_folder(path) - path);
    if (size >= (int)sizeof folder) return -1;
    snprintf(folder, sizeof folder, "%.*s", size > 0 ? size : 1, size > 0 ? path : ".");
    return stat(folder, status);
}

/* Whether both are one file, or will be once they are there. */
static int will_be_same(const char *path, const char *other)
{
    struct stat a, b;
    if (nb_target_is_same(path, other)) return 1;
    return strcmp(name_in_folder(path), name_in_folder(other)) == 0 && stat_folder(path, &a) == 0 &&
           stat_folder(other, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

int nb_target_check_window(const char *picture, const char *list, const char *scene, const nebel_scene_data *contents)
{
    int status = picture != NULL ? nb_target_spare(picture, scene, contents) : NB_DONE;
    if (status == NB_DONE && list != NULL) status = nb_target_spare(list, scene, contents);
    if (status == NB_DONE && list != NULL && picture != NULL && will_be_same(picture, list))
        return nb_report_failure("cannot write \"%s\": picture and list of controls need a file each", list);
    return status == NB_DONE && list != NULL ? check_list(list) : status;
}
