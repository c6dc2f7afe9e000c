#define _POSIX_C_SOURCE 200809L
#include "target.h"

#include "interrupt.h"
#include "report.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int nb_target_check(const char *path)
{
    nb_report_listener listener = {0};
    const nebel_scene_desc desc = {.log = nb_report_log(&listener)};
    nb_interrupt_hold();
    const nebel_result result = nebel_check_image_path(path, &desc);
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
    for (size_t i = 0; i < contents->file_count; i++)
        if (nb_target_is_same(path, contents->files[i]))
            return nb_report_failure("cannot write \"%s\": the scene reads \"%s\" from there; name another file", path,
                                     contents->files[i]);
    return NB_DONE;
}

static int check_list(const char *path)
{
    struct stat status;
    const int file = open(path, O_WRONLY | O_CREAT | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666);
    if (file < 0 && errno != ENXIO) return nb_report_failure("cannot write \"%s\": %s", path, strerror(errno));
    const int is_regular = file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    if (file >= 0) close(file);
    if (is_regular) return NB_DONE;
    return nb_report_failure("cannot write \"%s\": it is a device, a pipe or a socket; name a file", path);
}

int nb_target_check_window(const char *picture, const char *list, const char *scene, const nebel_scene_data *contents)
{
    int status = picture != NULL ? nb_target_spare(picture, scene, contents) : NB_DONE;
    if (status == NB_DONE && list != NULL) status = nb_target_spare(list, scene, contents);
    return status == NB_DONE && list != NULL ? check_list(list) : status;
}
