/* The benchmarks of nebel: figures beside the floor they stand on. */
#ifndef NB_BENCH_BENCH_H
#define NB_BENCH_BENCH_H

#include "bench/figures.h"

typedef struct nb_bench_desc {
    int quick;           /* small and short: shows that everything runs, the figures mean little */
    const char *group;   /* one of the groups; NULL: all */
    int opengl;          /* measures fog in OpenGL, in the context that is current, and nothing else */
    const char *program; /* path of the nebel program, for the figures of a whole process */
} nb_bench_desc;

/* The names of the groups, ending with NULL; OpenGL is none of them. */
extern const char *const nb_bench_groups[];

/* Measures. Returns 0, or -1 after a group failed, with what failed in *fault (static storage). */
int nb_bench_run(const nb_bench_desc *desc, nb_figures *figures, const char **fault);

#endif
