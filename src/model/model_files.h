/* The files of a model: the one that is named, and those that it names in turn, which lie in one folder. */
#ifndef NB_MODEL_MODEL_FILES_H
#define NB_MODEL_MODEL_FILES_H

#include "file/file.h"

#include <stdbool.h>
#include <sys/stat.h>

typedef enum nb_refusal { NB_REFUSAL_NONE, NB_REFUSAL_OUTSIDE, NB_REFUSAL_SPECIAL } nb_refusal;

typedef struct nb_model_files {
    const char *file;   /* the model, as it is opened */
    const char *name;   /* the same, seen from the folder */
    const char *folder; /* which references may not leave; ends in a slash, or "": the current one */
    bool has_uris;      /* names in it are percent-encoded */

    /* Told of each file before it is read: its path, and what it is. NULL: nobody. */
    void (*opened)(void *user, const char *path, const struct stat *status);
    void *user;

    int root;        /* descriptor of the folder */
    char *real_root; /* its path without links; NULL: unknown */

    nb_refusal refusal; /* of the first reference that was refused */
    char refused[200];
} nb_model_files;

/* Opens the folder; `file`, `name`, `folder`, `opened` and `user` are set. Errors: FILE, logged. Close it also then. */
nebel_result nb_model_files_begin(nb_model_files *files, const nebel_log *log);
void nb_model_files_end(nb_model_files *files);

/* Opens a regular file of the model for reading: the model itself by its name, others as seen from the folder, percent
 * encoded or not. Returns -1 with errno set where there is none, and where it is refused. */
int nb_model_files_open(nb_model_files *files, const char *path);

/* "is outside ...; ...": why a reference was refused, and what to do. */
const char *nb_model_files_refusal_text(nb_refusal refusal);

/* Decodes %20 and its like in place of `decoded`, which has the size of `text`. False where nothing is encoded. */
bool nb_model_files_decode(const char *text, char *decoded);

#endif
