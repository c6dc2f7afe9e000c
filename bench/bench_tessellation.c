/* The ground in triangles so small that fog at their vertices is within 1/255 everywhere. */
#include "box_fog_scene.h"
#include "groups.h"
#include "measure.h"
#include "terrain.h"

#include <nebel/classic.h>

static const char out_of_memory[] = "tessellation: out of memory";
static const char failed[] = "tessellation: it failed, or its bound was not met";

typedef struct nb_cut {
    const nb_terrain *terrain;
    nebel_snapshot *fog;
    size_t triangle_count; /* out */
} nb_cut;

static double run_tessellation(void *user)
{
    nb_cut *const cut = user;
    const nebel_tessellation_desc desc = {.eye = {0, 16, 62}};
    const nebel_triangles ground = {.positions = cut->terrain->positions,
                                    .vertex_count = cut->terrain->vertex_count,
                                    .indices = cut->terrain->indices,
                                    .triangle_count = cut->terrain->triangle_count};
    nebel_tessellation *made = NULL;
    const double start = nb_clock_cpu();
    const nebel_result result = nebel_tessellate(cut->fog, &desc, &ground, &made);
    const double seconds = nb_clock_cpu() - start;
    const int met = result == NEBEL_OK && made->unresolved_count == 0;
    if (met) cut->triangle_count = made->triangle_count;
    nebel_destroy_tessellation(made);
    return met ? seconds : -1;
}

static const char *measure_setting(const nb_terrain *terrain, nb_setting setting, const nb_bench_desc *desc,
                                   nb_figures *figures)
{
    nb_boxes boxes;
    nb_boxes_set(setting, &boxes);
    nb_cut cut = {terrain, nb_boxes_commit(&boxes), 0};
    nb_contest contest = {.run = run_tessellation, .user = &cut};
    if (cut.fog == NULL) return out_of_memory;
    const int status = nb_measure(&contest, 1, desc->quick ? 1 : 15);
    nebel_release_snapshot(cut.fog);
    if (status != 0) return failed;
    nb_figure figure = {.group = "The ground in triangles for fog per vertex within 1/255, one thread",
                        .unit = "ms",
                        .value = 1e3 * contest.seconds,
                        .value_at_most = 50};
    (void)snprintf(figure.name, sizeof figure.name, "%s, %u triangles to %zu", nb_setting_names[setting],
                   (unsigned)terrain->triangle_count, cut.triangle_count);
    nb_figures_add(figures, &figure);
    return NULL;
}

const char *nb_bench_tessellation(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_terrain terrain;
    if (nb_terrain_make(desc->quick ? 16 : 64, &terrain) != 0) return out_of_memory;
    const char *fault = measure_setting(&terrain, NB_FOG_BANK, desc, figures);
    if (fault == NULL) fault = measure_setting(&terrain, NB_FOG_OVER_ALL, desc, figures);
    nb_terrain_free(&terrain);
    return fault;
}
