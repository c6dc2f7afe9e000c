/* Processes that a launcher of MPI started together, which share counters. One process alone needs none of this. */
#ifndef NB_RANKS_H
#define NB_RANKS_H

#include <stddef.h>
#include <stdint.h>

/* What shares the work of a job. Behind them stands one counter for each group of items. */
enum { NB_RANKS_NEXT, NB_RANKS_MADE, NB_RANKS_REPLACED, NB_RANKS_KEPT, NB_RANKS_FAILED, NB_RANKS_FIRST_GROUP };

/* The library of MPI, "Open MPI 4.1.4"; NULL: this build has none. */
const char *nb_ranks_library(void);

/* Whether a launcher of MPI started this program, by its environment. */
int nb_ranks_are_launched(void);

/* Joins the others; they all do. NB_FAILED after a message where this build cannot. */
int nb_ranks_begin(void);

/* Between nb_ranks_begin and nb_ranks_end. The first rank is 0. */
int nb_ranks_own(void);
int nb_ranks_count(void);

/* The worst of the statuses of all, for all. `same` must be the same text for all where none has failed: NB_FAILED
 * otherwise, which the first rank reports. All of them ask; who comes early sleeps. */
int nb_ranks_agree(int status, const char *same);

/* The bytes of the first rank for all, which know how many there are. All of them ask. */
void nb_ranks_copy_first(void *bytes, size_t size);

/* Adds up the numbers of all, for all. All of them ask. */
void nb_ranks_sum(uint64_t *numbers, int number_count);

/* Makes counters, 0 at first. All of them do. Returns whether there is memory. */
int nb_ranks_open_counters(uint64_t count);

/* Adds to a counter; what it was before. From one thread at a time. */
uint64_t nb_ranks_add(uint64_t counter, uint64_t number);

/* To be called now and then in long work, from one thread at a time: where the network does not reach the counters by
 * itself, others wait for this process to answer. */
void nb_ranks_answer(void);

/* Leaves the others; they all do. */
void nb_ranks_end(void);

#endif
