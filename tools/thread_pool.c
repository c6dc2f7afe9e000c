#define _GNU_SOURCE

#include "thread_pool.h"

#include <sched.h>
#include <threads.h>
#include <unistd.h>

typedef struct nb_thread_range {
    thrd_t thread;
    int started;
    int worker, count;
    nb_workers_fn work;
    void *user;
} nb_thread_range;

static int run_share(void *user)
{
    const nb_thread_range *const mine = user;
    mine->work(mine->worker, mine->count, mine->user);
    return 0;
}

int nb_workers_available(void)
{
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    cpu_set_t ours; /* fewer where a launcher bound the process to some */
    if (sched_getaffinity(0, sizeof ours, &ours) == 0) processors = CPU_COUNT(&ours);
    if (processors < 1) return 1;
    return processors > NB_MAX_WORKERS ? NB_MAX_WORKERS : (int)processors;
}

void nb_workers_run(int count, nb_workers_fn work, void *user)
{
    nb_thread_range shares[NB_MAX_WORKERS];
    for (int i = 1; i < count; i++) {
        shares[i] = (nb_thread_range){.worker = i, .count = count, .work = work, .user = user};
        shares[i].started = thrd_create(&shares[i].thread, run_share, &shares[i]) == thrd_success;
    }
    work(0, count, user);
    for (int i = 1; i < count; i++) {
        if (shares[i].started) {
            (void)thrd_join(shares[i].thread, NULL);
        } else {
            work(i, count, user);
        }
    }
}
