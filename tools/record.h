/* Records: what a picture or a film was made from, as a text in its file. */
#ifndef NB_RECORD_H
#define NB_RECORD_H

#include "fingerprint.h"

#include <nebel/scene.h>

/* nebel's version, which stands at the beginning of what everything is made from. */
nb_fingerprint nb_record_start(void);

/* What is in a file. That it cannot be read is a fact as well. */
void nb_record_add_file(nb_fingerprint *print, const char *path);

/* The same of a scene and of all files that it has read. */
void nb_record_add_scene(nb_fingerprint *print, const char *path, const nebel_scene_data *contents);

/* Whether a scene that was read from there can be read a second time: a pipe cannot. */
int nb_record_can_add_scene(const char *path);

/* `maker` is a word. */
void nb_record_write(const nb_fingerprint *print, const char *maker, char record[NEBEL_MAX_RECORD + 1]);

/* Whether a file is there, whole, and made from the same. */
int nb_record_is_in(const char *path, const char *record);

#endif
