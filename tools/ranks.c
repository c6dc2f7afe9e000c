#define _POSIX_C_SOURCE 200809L
#include "ranks.h"

#include "signals.h"
#include "messages.h"

#include <stdlib.h>

int nb_ranks_are_launched(void)
{
    /* Open MPI, PMIx (Slurm's srun --mpi=pmix, too) and PMI-1 or PMI-2 (MPICH, srun --mpi=pmi2). */
    static const char *const signs[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"};
    for (size_t i = 0; i < sizeof signs / sizeof *signs; i++)
        if (getenv(signs[i]) != NULL) return 1;
    return 0;
}

#if defined(NEBEL_HAVE_MPI)

#include <mpi.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

/* How long who waits for others sleeps between two looks, in nanoseconds: without, it would keep a processor busy. */
enum { SHORTEST_SLEEP = 50000, LONGEST_SLEEP = 10000000 };

enum { SAME_SIZE = 128 };

static int own, count, has_counters;
static MPI_Win counters;

const char *nb_ranks_library(void)
{
    static char name[64];
#if defined(OMPI_MAJOR_VERSION)
    (void)snprintf(name, sizeof name, "Open MPI %d.%d.%d", OMPI_MAJOR_VERSION, OMPI_MINOR_VERSION,
                   OMPI_RELEASE_VERSION);
#else
    (void)snprintf(name, sizeof name, "MPI %d.%d", MPI_VERSION, MPI_SUBVERSION);
#endif
    return name;
}

int nb_ranks_begin(void)
{
    int provided;
    /* Threads of OpenMP ask for the share that is done, one at a time. Errors of MPI end the job, which is its
     * default. */
    (void)MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &provided);
    (void)MPI_Comm_rank(MPI_COMM_WORLD, &own);
    (void)MPI_Comm_size(MPI_COMM_WORLD, &count);
    if (provided >= MPI_THREAD_SERIALIZED) return NB_DONE;
    (void)MPI_Finalize();
    return nb_report_failure("this MPI is not for programs with threads; build nebel with another one, or use --shard");
}

int nb_ranks_own(void)
{
    return own;
}

int nb_ranks_count(void)
{
    return count;
}

static void wait_for(MPI_Request *request)
{
    long sleep = SHORTEST_SLEEP;
    for (;;) {
        int is_done;
        (void)MPI_Test(request, &is_done, MPI_STATUS_IGNORE);
        if (is_done) return;
        nb_interrupt_obey(); /* the launcher ends the others */
        (void)nanosleep(&(struct timespec){.tv_nsec = sleep}, NULL);
        sleep = 2 * sleep < LONGEST_SLEEP ? 2 * sleep : LONGEST_SLEEP;
    }
}

static int find_worst(int status)
{
    int worst;
    MPI_Request request;
    (void)MPI_Iallreduce(&status, &worst, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD, &request);
    wait_for(&request);
    return worst;
}

void nb_ranks_copy_first(void *bytes, size_t size)
{
    enum { MOST_AT_ONCE = 1 << 28 }; /* MPI counts with int */
    char *at = bytes;
    while (size > 0) {
        const size_t part = size < MOST_AT_ONCE ? size : MOST_AT_ONCE;
        MPI_Request request;
        (void)MPI_Ibcast(at, (int)part, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
        wait_for(&request);
        at += part;
        size -= part;
    }
}

void nb_ranks_sum(uint64_t *numbers, int number_count)
{
    MPI_Request request;
    (void)MPI_Iallreduce(MPI_IN_PLACE, numbers, number_count, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD, &request);
    wait_for(&request);
}

int nb_ranks_agree(int status, const char *same)
{
    const int worst = find_worst(status);
    if (worst != NB_DONE) return worst;
    char of_first[SAME_SIZE] = "";
    if (own == 0) (void)snprintf(of_first, sizeof of_first, "%s", same);
    nb_ranks_copy_first(of_first, sizeof of_first);
    const int differ = find_worst(strcmp(of_first, same) != 0);
    if (!differ) return NB_DONE;
    if (own == 0)
        nb_report_message("the processes of this job were called differently, or read different files; give all of "
                          "them the same call, or "
                          "each a --shard of its own");
    return NB_FAILED;
}

int nb_ranks_open_counters(uint64_t number)
{
    uint64_t *memory = NULL;
    const MPI_Aint bytes = own == 0 ? (MPI_Aint)(number * sizeof *memory) : 0;
    (void)MPI_Win_allocate(bytes, sizeof *memory, MPI_INFO_NULL, MPI_COMM_WORLD, &memory, &counters);
    has_counters = 1;
    if (own == 0) memset(memory, 0, (size_t)bytes);
    (void)MPI_Barrier(MPI_COMM_WORLD);
    (void)MPI_Win_lock_all(0, counters);
    return 1;
}

uint64_t nb_ranks_add(uint64_t counter, uint64_t number)
{
    uint64_t before = 0;
    (void)MPI_Fetch_and_op(&number, &before, MPI_UINT64_T, 0, (MPI_Aint)counter, MPI_SUM, counters);
    (void)MPI_Win_flush(0, counters);
    return before;
}

void nb_ranks_answer(void)
{
    int found;
    if (own == 0 && has_counters)
        (void)MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &found, MPI_STATUS_IGNORE);
}

void nb_ranks_end(void)
{
    if (has_counters) {
        (void)MPI_Win_unlock_all(counters);
        (void)MPI_Win_free(&counters);
    }
    has_counters = 0;
    (void)MPI_Finalize();
}

#else

const char *nb_ranks_library(void)
{
    return NULL;
}

int nb_ranks_begin(void)
{
    return nb_report_failure("this program was started by MPI but built without it; build it where MPI is found "
                             "(Debian: libopenmpi-dev), or "
                             "give each process a --shard");
}

int nb_ranks_own(void)
{
    return 0;
}

int nb_ranks_count(void)
{
    return 1;
}

int nb_ranks_agree(int status, const char *same)
{
    (void)same;
    return status;
}

void nb_ranks_copy_first(void *bytes, size_t size)
{
    (void)bytes, (void)size;
}

void nb_ranks_sum(uint64_t *numbers, int number_count)
{
    (void)numbers, (void)number_count;
}

int nb_ranks_open_counters(uint64_t number)
{
    (void)number;
    return 0;
}

uint64_t nb_ranks_add(uint64_t counter, uint64_t number)
{
    (void)counter, (void)number;
    return 0;
}

void nb_ranks_answer(void) {}

void nb_ranks_end(void) {}

#endif
