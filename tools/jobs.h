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

#include "progress_bar.h"
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

#define NB_RESUME_OPTION                                                                                               \
    {                                                                                                                  \
        "resume", 0, NULL, "Leaves what is there already, whole and made from\nthe same files and options."            \
    }

/* Refuses options that are about files where `output` (NULL: none) is written to as it is. */
void nb_jobs_refuse_special(nb_arguments *arguments, const int *options, size_t option_count, const char *output);

/* What a command adds up beside the items: it says what. */
enum { NB_JOBS_SUMS = 3 };

typedef struct nb_jobs {
    nb_shard shard;
    int is_joined; /* with others, by MPI */
    int is_chief;  /* speaks for all that joined */
    int has_begun; /* and all that joined have */
    uint64_t count, group;
    uint64_t next;               /* of its own, where it has not joined */
    uint64_t made, kept, failed; /* by it; kept are those that were there already */
    uint64_t replaced;           /* of those made, where something was there that could not be kept */
    uint64_t all_made, all_replaced, all_kept, all_failed;
    uint64_t found;              /* before the work: items of which something was there, good or not */
    uint64_t sums[NB_JOBS_SUMS]; /* its own, until nb_jobs_end makes them those of all */
} nb_jobs;

nb_jobs nb_jobs_of(const nb_shard *shard);

/* Joins the other processes where MPI started this one and no shard is asked for. NB_FAILED after a message. */
int nb_jobs_join(nb_jobs *jobs);

/* Of processes that joined the first one has a list: all get it in *bytes, which free() takes, or NULL where `status` is that of a
 * failure for any of them. Of a process alone *bytes stays. Returns the worst status of all. */
int nb_jobs_copy_first(const nb_jobs *jobs, int status, char **bytes, size_t *size);

/* Whether others do a part of the work. */
int nb_jobs_are_shared(const nb_jobs *jobs);

/* Tells how many items there are, and whether all is well so far. `same` is a text that says what the job is, the
 * same for all processes that joined. Returns the worst status of them all, NB_FAILED after a message where they do
 * not have the same. */
int nb_jobs_begin(nb_jobs *jobs, uint64_t count, uint64_t group, int status, const char *same);

/* With --resume, before nb_jobs_begin, by the process that shows how far the work is: looks which of the `count` items it counts have
 * something there. So the time left counts what need not be done before it is reached. */
typedef int nb_jobs_is_there_fn(void *user, uint64_t item);
void nb_jobs_survey(nb_jobs *jobs, uint64_t count, nb_jobs_is_there_fn *is_there, void *user);

/* A note where srun started several of these processes and none knows of the others: each does the whole work. */
void nb_jobs_note_copies(const nb_jobs *jobs);

/* How many items each process does where all do as many. */
uint64_t nb_jobs_even_share(const nb_jobs *jobs);

/* 1 with the next item; 0: there is none. Not after nb_jobs_begin has failed. */
int nb_jobs_take(nb_jobs *jobs, uint64_t *item);

/* An item is done, or was already. 1 where its group may now be complete: of processes that joined exactly one is
 * told so, when all items are done; a shard, when its own are. */
int nb_jobs_finish(nb_jobs *jobs, uint64_t item, int is_kept);

/* An item that was made has replaced something. */
void nb_jobs_note_replaced(nb_jobs *jobs);

/* An item could not be done, and the process goes on with others. */
void nb_jobs_fail(nb_jobs *jobs);

/* In long work, from one thread at a time. */
void nb_jobs_answer(const nb_jobs *jobs);

/* The share, 0 to 1, that is done of what there was to do, with that of the item in work; how many items are done,
 * and of how many. Those that failed are done, those that were there already do not count; as many of those that are not reached yet
 * as the survey found, in the ratio of those that were good so far. Of all processes that joined. */
double nb_jobs_share(nb_jobs *jobs, double of_item, uint64_t *done, uint64_t *all);

/* Shows it: "frame 3 of 96", where there are several. */
void nb_jobs_show(nb_jobs *jobs, nb_progress_bar *meter, const char *what, double of_item);

/* The worst status of all processes that joined. What each made, kept and failed is added up in all_made, all_kept and
 * all_failed. After an interrupt the process ends instead: its launcher ends the others. */
int nb_jobs_end(nb_jobs *jobs, int status);

/* After that, for the summary: "96 frames, 12 of them there already, 1 failed". */
void nb_jobs_describe(const nb_jobs *jobs, const char *what, char *text, size_t size);

#endif
