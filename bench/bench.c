#include "groups.h"

#include <string.h>

/* The process first: see bench/process.c. */
typedef const char *group_fn(const nb_bench_desc *desc, nb_figures *figures);

const char *const nb_bench_groups[] = {"process", "segments", "vertices", "frame", "pass", "particles", NULL};

static group_fn *const functions[] = {nb_bench_process, nb_bench_segments, nb_bench_vertices,
                                      nb_bench_frame,   nb_bench_pass,     nb_bench_particles};

int nb_bench_run(const nb_bench_desc *desc, nb_figures *figures, const char **fault)
{
#if defined(NEBEL_HAVE_GL)
    if (desc->opengl) {
        *fault = nb_bench_opengl(desc, figures);
        return *fault == NULL ? 0 : -1;
    }
#endif
    for (size_t i = 0; nb_bench_groups[i] != NULL; i++) {
        if (desc->group != NULL && strcmp(desc->group, nb_bench_groups[i]) != 0) continue;
        *fault = functions[i](desc, figures);
        if (*fault != NULL) return -1;
    }
    return 0;
}
