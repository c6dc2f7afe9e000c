/* Parts of a picture or a film, each a picture in a file of its own in the folder FILE.parts. */
#ifndef NB_PARTS_H
#define NB_PARTS_H

#include "messages.h"

#include <nebel/scene.h>

#include <stdint.h>

typedef struct nb_parts {
    const char *file; /* what they make */
    uint32_t count;
    nb_report_listener *listener;
    /* The record of a part. */
    void (*record)(void *user, uint32_t part, char record[NEBEL_MAX_RECORD + 1]);
    void *user;
} nb_parts;

/* The name of a part, an EXR of an EXR and else a PNG; free it. NULL after a message. */
char *nb_parallel_name(const nb_parts *parts, uint32_t part);

/* Makes the folder, where there is none. */
int nb_parallel_make_folder(const nb_parts *parts);

/* Whether a part is there, whole and with its record. */
int nb_parallel_have(const nb_parts *parts, uint32_t part);
int nb_parallel_have_all(const nb_parts *parts);

/* Whether nobody else joins these parts just now, so that this process may, until nb_parallel_unlock: 1 with the lock.
 * Ends with the process. Where the file system has no locks two may join at the same time, which write the same
 * bytes. */
int nb_parallel_lock(const nb_parts *parts, int *lock);
void nb_parallel_unlock(int lock);

/* Joins bands of rows, all `rows` high but the last, to a picture of this size, in memory for one of them. */
int nb_parallel_join_picture(const nb_parts *parts, uint32_t width, uint32_t height, const char *record);

/* Joins frames to a film, and finishes it. */
int nb_parallel_join_film(const nb_parts *parts, const nebel_movie_desc *desc, const char *record);

/* Removes the parts, those that calls with other bands left, what ended processes left half written, and the folder.
 * Other files stay, and the folder with them. */
void nb_parallel_remove(const nb_parts *parts);

#endif
