/* Whether files are still the ones that were read. */
#ifndef NB_TOOLS_VIEWER_FILE_WATCH_H
#define NB_TOOLS_VIEWER_FILE_WATCH_H

#include <stddef.h>

typedef struct nb_watch_file {
    char *path;
    long long seconds, nanoseconds, size, number; /* of the last change; of the file itself; 0: there is none */
} nb_watch_file;

typedef struct nb_file_watch {
    nb_watch_file *files;
    size_t count;
} nb_file_watch;

/* Watches a scene and the files that it names, from now on, in place of others. Where memory is out, fewer of them. */
void nb_watch_open(nb_file_watch *watch, const char *scene, const char *const *files, size_t count);

/* Fine with zeros. */
void nb_watch_close(nb_file_watch *watch);

/* Takes the files as they are. */
void nb_watch_take(nb_file_watch *watch);

/* One that is there and another one, or changed, since nb_watch_take; NULL: none. */
const char *nb_watch_find_changed(const nb_file_watch *watch);

#endif
