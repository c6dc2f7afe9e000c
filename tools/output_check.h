/* Pictures to be written: what can be known before the work begins. */
#ifndef NB_TOOLS_OUTPUT_CHECK_H
#define NB_TOOLS_OUTPUT_CHECK_H

#include <nebel/scene.h>

#include <stddef.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* NB_DONE when a picture can likely be written there: a file can be made in the folder, which is tried, and the path is
 * no folder. Otherwise NB_FAILED after a message. */
int nb_target_check(const char *path);

/* Whether there is something that is written to as it is, not replaced: /dev/null, or what is open already. */
int nb_target_is_special(const char *path);

/* Whether two paths lead to one file that exists. */
int nb_target_is_same(const char *path, const char *other);

/* NB_DONE where the scene, read from `scene`, does not read what is to be written; otherwise NB_FAILED after a message. */
int nb_target_spare(const char *path, const char *scene, const nebel_scene_data *contents);

/* The same of what a window writes: a picture, and a list that is replaced again and again, which must be a regular file, or one
 * that can be made. Either may be NULL. */
int nb_target_check_window(const char *picture, const char *list, const char *scene, const nebel_scene_data *contents);

/* Opens a file that is no picture for writing, as it is: a regular one, or one that can be made, /dev/null or what is open already,
 * /dev/stdout. Pipes and devices are refused. NB_FAILED after a message. */
int nb_target_open(const char *path, int *file);

/* Opens the list, to be written anew; NULL, without a message, where it is no regular file any more. */
FILE *nb_target_open_list(const char *path);

/* Makes a text all that such a file holds, and closes it: NB_DONE, or NB_FAILED after a message. */
int nb_target_replace(int file, const char *path, const char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
