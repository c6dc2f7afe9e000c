/* Whether a file is still the one that was read. */
#ifndef NB_WATCH_H
#define NB_WATCH_H

typedef struct nb_watch {
    long long seconds, nanoseconds, size, number; /* of the last change; of the file itself */
} nb_watch;

/* Takes the file as it is. */
void nb_watch_take(nb_watch *watch, const char *path);

/* Whether it is there and another one, or changed, since nb_watch_take. */
int nb_watch_is_changed(const nb_watch *watch, const char *path);

#endif
