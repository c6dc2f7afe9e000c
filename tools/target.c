#define _XOPEN_SOURCE 700

#include "target.h"

#include "report.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int ends_with(const char *path, const char *ending)
{
    const size_t size = strlen(path), ending_size = strlen(ending);
    if (size <= ending_size) return 0;
    for (size_t i = 0; i < ending_size; i++) {
        const char c = path[size - ending_size + i];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != ending[i]) return 0;
    }
    return 1;
}

nb_target_kind nb_target_find_kind(const char *path)
{
    if (ends_with(path, ".png")) return NB_TARGET_PNG;
    return ends_with(path, ".exr") ? NB_TARGET_EXR : NB_TARGET_NONE;
}

static char *folder_of(const char *path)
{
    const char *const slash = strrchr(path, '/');
    if (slash == NULL) return strdup(".");
    return slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

static int check_folder(const char *command, const char *path)
{
    char *const folder = folder_of(path);
    if (folder == NULL) return nb_report_failure("%s: %s: memory is out", command, path);
    struct stat state;
    int status = NB_DONE;
    if (stat(folder, &state) != 0) {
        const char *const mend = errno == ENOENT ? "; make the folder first" : "";
        status = nb_report_failure("%s: %s: the folder %s: %s%s", command, path, folder, strerror(errno), mend);
    } else if (!S_ISDIR(state.st_mode)) {
        status = nb_report_failure("%s: %s: %s is no folder", command, path, folder);
    } else if (access(folder, W_OK | X_OK) != 0) {
        status = nb_report_failure("%s: %s: the folder %s may not be written to: %s", command, path, folder,
                                   strerror(errno));
    }
    free(folder);
    return status;
}

/* The folder of what a symbolic link points to. */
static int check_place(const char *command, const char *path)
{
    char *const place = realpath(path, NULL);
    const int status = check_folder(command, place != NULL ? place : path);
    free(place);
    return status;
}

/* Regular files are replaced by renaming, which needs the folder; devices and pipes are written to as they are. */
int nb_target_check(const char *command, const char *path)
{
    struct stat state;
    if (stat(path, &state) != 0) return check_folder(command, path);
    if (S_ISDIR(state.st_mode)) return nb_report_failure("%s: %s: is a folder; name a file in it", command, path);
    if (S_ISREG(state.st_mode)) return check_place(command, path);
    if (access(path, W_OK) == 0) return NB_DONE;
    return nb_report_failure("%s: %s: %s", command, path, strerror(errno));
}
