/* Which items of a job this process does: pictures, photographs, parts of a picture. All of them; those of a shard; or,
 * among processes that MPI started together, the next ones that nobody has taken.
 *
 *     nb_jobs jobs = nb_jobs_of(&shard);
 *     int status = nb_jobs_join(&jobs);                            // of all processes; before the work
 *     ...                                                          // what all of them read
 *     status = nb_jobs_begin(&jobs, items, group, status, same);
 *     while (status == NB_DONE && nb_jobs_take(&jobs, &item)) {
 *         ...
 *         if (nb_jobs_finish(&jobs, item, is_kept)) ...;           // the group may be complete
 *     }
 *     status = nb_jobs_end(&jobs, status);
 *
 * Items are numbered from 0 in the order in which they are best done. A group is `group` items that follow each other;
 * the last one may have fewer. */
#ifndef NB_JOBS_H
#define NB_JOBS_H

#include "options.h"

#include <stdint.h>

/* Part `number`, from 0, of `count`: items whose number is that modulo count. A count of 0: no shard was asked for. */
typedef struct nb_shard {
    uint32_t number, count;
} nb_shard;

#define NB_SHARD_OPTION                                                                                                \
    {                                                                                                                  \
        "shard", 0, "K/N", "Does part K, from 0, of N parts of the work; for\nmany machines."                          \
    }
nb_shard nb_jobs_read_shard(nb_arguments *arguments, int option);

typedef struct nb_jobs {
    nb_shard shard;
    int is_joined; /* with others, by MPI */
    int is_chief;  /* speaks for all that joined */
    uint64_t count, group;
    uint64_t next;       /* of its own, where it has not joined */
    uint64_t made, kept; /* by it; the latter were there already */
    uint64_t all_made, all_kept;
} nb_jobs;

nb_jobs nb_jobs_of(const nb_shard *shard);

/* Joins the other processes where MPI started this one and no shard is asked for. NB_FAILED after a message. */
int nb_jobs_join(nb_jobs *jobs);

/* Whether others do a part of the work. */
int nb_jobs_are_shared(const nb_jobs *jobs);

/* Tells how many items there are, and whether all is well so far. `same` is a text that says what the job is, the
 * same for all processes that joined. Returns the worst status of them all, NB_FAILED after a message where they do
 * not have the same. */
int nb_jobs_begin(nb_jobs *jobs, uint64_t count, uint64_t group, int status, const char *same);

/* A note where srun started several of these processes and none knows of the others: each does the whole work. */
void nb_jobs_note_copies(const nb_jobs *jobs);

/* 1 with the next item; 0: there is none. Not after nb_jobs_begin has failed. */
int nb_jobs_take(nb_jobs *jobs, uint64_t *item);

/* An item is done, or was already. 1 where its group may now be complete: of processes that joined exactly one is
 * told so, when all items are done; a shard, when its own are. */
int nb_jobs_finish(nb_jobs *jobs, uint64_t item, int is_kept);

/* In long work, from one thread at a time. */
void nb_jobs_answer(const nb_jobs *jobs);

/* The share, 0 to 1, that is done of what there was to do, with that of the item in work; how many items are done,
 * and of how many. Those that were there already do not count. Of all processes that joined. */
double nb_jobs_share(nb_jobs *jobs, double of_item, uint64_t *done, uint64_t *all);

/* The worst status of all processes that joined. What each made and kept is added up in all_made and all_kept. After
 * an interrupt the process ends instead: its launcher ends the others. */
int nb_jobs_end(nb_jobs *jobs, int status);

#endif
