#include "groups.h"

#include <string.h>

typedef const char *group_fn(const nb_bench_desc *desc, nb_figures *figures);

#if defined(NEBEL_HAVE_GL)
#define IN_OPENGL(function) function
#else
#define IN_OPENGL(function) NULL
#endif

typedef struct nb_group {
    group_fn *on_cpu, *in_opengl; /* NULL: not measured there */
} nb_group;

/* The process first: see bench/bench_process.c. */
const char *const nb_bench_groups[] = {"process",   "segments", "vertices", "frame",       "sunlight", "pass",
                                       "particles", "overlap",  "lighting", "photographs", "planet",   NULL};

static const nb_group groups[] = {{nb_bench_process, NULL},
                                  {nb_bench_segments, NULL},
                                  {nb_bench_vertices, NULL},
                                  {nb_bench_frame, NULL},
                                  {nb_bench_sunlight, NULL},
                                  {nb_bench_pass, IN_OPENGL(nb_bench_opengl_pass)},
                                  {nb_bench_particles, IN_OPENGL(nb_bench_opengl_particles)},
                                  {nb_bench_overlap, NULL},
                                  {nb_bench_lighting, NULL},
                                  {nb_bench_photographs, NULL},
                                  {nb_bench_planet, IN_OPENGL(nb_bench_opengl_planet)}};

static group_fn *function_of(size_t group, int opengl)
{
    return opengl ? groups[group].in_opengl : groups[group].on_cpu;
}

int nb_bench_has(int group, int opengl)
{
    return function_of((size_t)group, opengl) != NULL;
}

int nb_bench_run(const nb_bench_desc *desc, nb_figures *figures, const char **fault)
{
    for (size_t i = 0; nb_bench_groups[i] != NULL; i++) {
        group_fn *const function = function_of(i, desc->opengl);
        if (function == NULL || (desc->group != NULL && strcmp(desc->group, nb_bench_groups[i]) != 0)) continue;
        *fault = function(desc, figures);
        if (*fault != NULL) return -1;
    }
    return 0;
}
