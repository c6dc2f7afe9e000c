/* The groups of benchmarks. Each returns NULL, or what failed. */
#ifndef NB_BENCH_GROUPS_H
#define NB_BENCH_GROUPS_H

#include "bench.h"

const char *nb_bench_cells(const nb_bench_desc *desc, nb_figures *figures); /* of the group vertices */
const char *nb_bench_frame(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_lighting(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_opengl_particles(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_opengl_pass(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_opengl_planet(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_overlap(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_particles(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_pass(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_photographs(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_planet(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_process(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_segments(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_sunlight(const nb_bench_desc *desc, nb_figures *figures);
const char *nb_bench_tessellation(const nb_bench_desc *desc, nb_figures *figures); /* of the group vertices */
const char *nb_bench_vertices(const nb_bench_desc *desc, nb_figures *figures);

/* Adds what others have published for the group planet. */
void nb_bench_published_planet(nb_figures *figures);

#endif
