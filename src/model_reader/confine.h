/* What nebel-read-model may not do, whatever the code in it tries. */
#ifndef NB_MODEL_READER_CONFINE_H
#define NB_MODEL_READER_CONFINE_H

#include "model/model_budget.h"

#include <stdbool.h>

/* Ends with its parent; keeps none of the files it was given but the standard ones. False where the parent is gone. */
bool nb_confine_to_parent(long parent);

/* Limits of stack, open files, processes, written files and core dumps. */
void nb_confine_resources(void);

/* Limits of memory and processor time, as far as the system's own allow them. May be called again with more. */
void nb_confine_budget(const nb_budget *budget);

/* From now on only a file, and files in a folder, may be opened, for reading; where the system can see to that. */
void nb_confine_files(const char *file, const char *folder);

/* From now on no sockets, other programs or processes; where the system can see to that. */
void nb_confine_calls(void);

#endif
