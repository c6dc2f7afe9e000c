/* The benchmarks of nebel: figures beside the floor they stand on. */
#ifndef NB_BENCH_BENCH_H
#define NB_BENCH_BENCH_H

#include "bench/figures.h"

typedef struct nb_bench_desc {
    int quick;           /* small and short: shows that everything runs, the figures mean little */
    const char *group;   /* one of the groups; NULL: all */
    int opengl;          /* in the context of OpenGL that is current; 0: on the processor */
    const char *program; /* path of the nebel program, for the figures of a whole process */
} nb_bench_desc;

/* The names of the groups, ending with NULL. */
extern const char *const nb_bench_groups[];

/* Whether there is a group in OpenGL, or on the processor. */
int nb_bench_has(int group, int opengl);

/* Measures. Returns 0, or -1 after a group failed, with what failed in *fault (static storage). */
int nb_bench_run(const nb_bench_desc *desc, nb_figures *figures, const char **fault);

#endif
