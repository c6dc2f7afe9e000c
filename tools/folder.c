#define _POSIX_C_SOURCE 200809L
#include "folder.h"

#include "messages.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* 0 or an error number. */
static int find(const char *folder)
{
    struct stat status;
    if (stat(folder, &status) != 0) return errno;
    return S_ISDIR(status.st_mode) ? 0 : ENOTDIR;
}

/* From the top down; what another process makes at the same time is there. The first error counts, as the others may follow from it. */
static int make_all(char *folder)
{
    int first = 0;
    for (char *end = strchr(folder + 1, '/');; end = strchr(end + 1, '/')) {
        if (end != NULL) *end = '\0';
        if (mkdir(folder, 0777) != 0 && errno != EEXIST && first == 0) first = errno;
        if (end == NULL) break;
        *end = '/';
    }
    const int error = find(folder);
    return error != 0 && first != 0 ? first : error;
}

int nb_folder_make(const char *folder)
{
    int error = find(folder);
    if (error == ENOENT && folder[0] != '\0') {
        char *const copy = strdup(folder);
        error = copy != NULL ? make_all(copy) : ENOMEM;
        free(copy);
    }
    return error == 0 ? NB_DONE : nb_report_failure("cannot make the folder \"%s\": %s", folder, strerror(error));
}

int nb_folder_make_for(const char *file)
{
    const char *const slash = strrchr(file, '/');
    if (slash == NULL || slash == file) return NB_DONE;
    char *const folder = strndup(file, (size_t)(slash - file));
    if (folder == NULL) return nb_report_failure("%s: out of memory", file);
    const int status = nb_folder_make(folder);
    free(folder);
    return status;
}
