#define _POSIX_C_SOURCE 200809L

#include "measure.h"

#include <stdlib.h>
#include <time.h>

enum { CONTESTS_MOST = 16 };

static double read_clock(clockid_t id)
{
    struct timespec now = {0};
    (void)clock_gettime(id, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double nb_clock_wall(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

double nb_clock_cpu(void)
{
    return read_clock(CLOCK_PROCESS_CPUTIME_ID);
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *seconds, int count)
{
    qsort(seconds, (size_t)count, sizeof *seconds, compare);
    return .5 * (seconds[(count - 1) / 2] + seconds[count / 2]);
}

int nb_measure(nb_contest *contests, size_t count, int repetitions)
{
    double seconds[CONTESTS_MOST][NB_MAX_REPETITIONS];
    if (count > CONTESTS_MOST || repetitions < 1 || repetitions > NB_MAX_REPETITIONS) return -1;
    for (int r = -1; r < repetitions; r++) {
        for (size_t i = 0; i < count; i++) {
            const double taken = contests[i].run(contests[i].user);
            if (!(taken >= 0)) return -1;
            if (r >= 0) seconds[i][r] = taken;
        }
    }
    for (size_t i = 0; i < count; i++) contests[i].seconds = median(seconds[i], repetitions);
    return 0;
}
