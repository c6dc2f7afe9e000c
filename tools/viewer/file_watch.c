#define _POSIX_C_SOURCE 200809L

#include "file_watch.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void look(nb_watch_file *file)
{
    struct stat status;
    if (stat(file->path, &status) != 0) {
        *file = (nb_watch_file){.path = file->path};
        return;
    }
    *file = (nb_watch_file){file->path, status.st_mtim.tv_sec, status.st_mtim.tv_nsec, status.st_size,
                            (long long)status.st_ino};
}

static void add(nb_file_watch *watch, const char *path)
{
    nb_watch_file *const file = &watch->files[watch->count];
    file->path = strdup(path);
    watch->count += file->path != NULL;
}

void nb_watch_open(nb_file_watch *watch, const char *scene, const char *const *files, size_t count)
{
    nb_watch_close(watch);
    watch->files = calloc(count + 1, sizeof *watch->files);
    if (watch->files == NULL) return;
    add(watch, scene);
    for (size_t i = 0; i < count; i++) add(watch, files[i]);
    nb_watch_take(watch);
}

void nb_watch_close(nb_file_watch *watch)
{
    for (size_t i = 0; i < watch->count; i++) free(watch->files[i].path);
    free(watch->files);
    *watch = (nb_file_watch){.files = NULL};
}

void nb_watch_take(nb_file_watch *watch)
{
    for (size_t i = 0; i < watch->count; i++) look(&watch->files[i]);
}

const char *nb_watch_find_changed(const nb_file_watch *watch)
{
    for (size_t i = 0; i < watch->count; i++) {
        const nb_watch_file *const was = &watch->files[i];
        nb_watch_file now = *was;
        look(&now);
        if (now.number != 0 && (now.seconds != was->seconds || now.nanoseconds != was->nanoseconds ||
                                now.size != was->size || now.number != was->number))
            return was->path;
    }
    return NULL;
}
