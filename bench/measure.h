/* Times, so that ratios hold on a noisy machine: contestants take turns, and the median of each counts. */
#ifndef NB_BENCH_MEASURE_H
#define NB_BENCH_MEASURE_H

#include <stddef.h>

/* Seconds since some moment: of the world, and of all threads of this process. */
double nb_clock_wall(void);
double nb_clock_cpu(void);

/* One run of something, in seconds; below 0: it failed. */
typedef double (*nb_contest_fn)(void *user);

typedef struct nb_contest {
    nb_contest_fn run;
    void *user;
    double seconds; /* out: median */
} nb_contest;

enum { NB_MAX_REPETITIONS = 64 };

/* Runs every contestant once to warm up, then all of them in turn `repetitions` times (1 to NB_MAX_REPETITIONS).
 * Returns 0, or -1 when a run failed. */
int nb_measure(nb_contest *contests, size_t count, int repetitions);

#endif
