/* Paths of files named in other files. */
#ifndef NB_FILE_PATH_H
#define NB_FILE_PATH_H

#include "base/arena.h"

/* The folder of a path with its slash, "" where it has none. */
const char *nb_path_folder(nb_arena *arena, const char *path);

/* `path` seen from `folder` (as nb_path_folder gives it); absolute paths stay. */
const char *nb_path_join(nb_arena *arena, const char *folder, const char *path);

/* What follows the last slash. */
const char *nb_path_name(const char *path);

#endif
