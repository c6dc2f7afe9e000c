/* The list of files of `nebel fog` among many processes. */
#ifndef NB_FOG_LIST_H
#define NB_FOG_LIST_H

#include "fog_names.h"
#include "jobs.h"

/* Leaves the pictures of a shard. Their names say which they are, not their places in the list: each has exactly one shard, also if files
 * come or go between the calls of two shards. A shard of 0 parts has all. */
void nb_fog_list_keep(nb_fog_list *list, const nb_shard *shard);

/* Makes the folders of the results, where they are missing. NB_FAILED after a message. */
int nb_fog_list_make_folders(const nb_fog_list *list);

/* The list of the first process for all that joined, whatever others would find by now; theirs are empty before. `status` says
 * whether it has one. Returns the worst status of all. */
int nb_fog_list_copy_first(const nb_jobs *jobs, int status, nb_fog_list *list);

#endif
