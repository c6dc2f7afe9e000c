#include "renderer.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum { ALIGNMENT = 64, MOST_THREADS = 1024 };

const char *nebel_renderer_libraries(void)
{
    return "Embree " RTC_VERSION_STRING;
}

static nebel_result check(const nebel_scene_data *scene, const nebel_renderer_desc *desc)
{
    if (scene == NULL) return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "renderer: scene is NULL");
    if (!nb_allocator_is_valid(&desc->allocator)) {
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "renderer: the allocator needs both functions or neither");
    }
    if (desc->threads < 0 || desc->threads > MOST_THREADS) {
        return nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT, "renderer: %d threads; 0 (all) to %d are possible",
                       desc->threads, MOST_THREADS);
    }
    if (desc->isa != NEBEL_ISA_DEFAULT && !nebel_isa_available(desc->isa)) {
        return nb_fail(&desc->log, NEBEL_ERROR_UNSUPPORTED, "renderer: instruction set %s is not available here",
                       nebel_isa_name(desc->isa));
    }
    return NEBEL_OK;
}

static int count_threads(int wanted)
{
    if (wanted > 0) return wanted;
    const int all = omp_get_num_procs();
    return all < MOST_THREADS ? all : MOST_THREADS;
}

/* The allocator aligns for C's own types only; Embree's packets want more. */
static nebel_result allocate_scratch(nebel_renderer *renderer)
{
    const size_t bytes = (size_t)renderer->threads * sizeof(nb_scratch) + ALIGNMENT;
    renderer->scratch_memory = nb_allocate(&renderer->allocator, 1, bytes);
    if (renderer->scratch_memory == NULL) return NEBEL_ERROR_MEMORY;
    const uintptr_t address = (uintptr_t)renderer->scratch_memory;
    const uintptr_t skip = (ALIGNMENT - address % ALIGNMENT) % ALIGNMENT;
    renderer->scratch = (nb_scratch *)((char *)renderer->scratch_memory + skip);
    return NEBEL_OK;
}

static nebel_result set_up(nebel_renderer *renderer, nebel_isa isa)
{
    nebel_result result = allocate_scratch(renderer);
    if (result == NEBEL_OK) result = nb_geometry_make(&renderer->geometry, renderer->scene, isa, renderer->threads);
    if (result == NEBEL_OK) result = nb_geometry_place(&renderer->geometry, renderer->scene->camera.position);
    return result;
}

nebel_result nebel_create_renderer(const nebel_scene_data *scene, nebel_snapshot *fog, const nebel_renderer_desc *desc,
                                   nebel_renderer **renderer)
{
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    *renderer = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check(scene, desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    nebel_renderer *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "renderer: out of memory");
    made->allocator = made->geometry.allocator = allocator;
    made->log = made->geometry.log = desc->log;
    made->scene = scene;
    made->fog = fog != NULL ? nebel_retain_snapshot(fog) : NULL;
    made->fog_isa = desc->isa;
    made->threads = count_threads(desc->threads);
    nb_srgb_table_set(&made->table);
    result = set_up(made, desc->isa);
    if (result != NEBEL_OK) {
        if (result == NEBEL_ERROR_MEMORY)
            nb_fail(
                &desc->log, result,
                "renderer: out of memory; free some, raise its limit (ulimit -v), or use fewer triangles or threads");
        nebel_destroy_renderer(made);
        return result;
    }
    *renderer = made;
    return NEBEL_OK;
}

nebel_result nebel_set_renderer_fog(nebel_renderer *renderer, nebel_snapshot *fog)
{
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    if (fog != NULL) nebel_retain_snapshot(fog);
    nebel_release_snapshot(renderer->fog);
    renderer->fog = fog;
    return NEBEL_OK;
}

nebel_result nebel_set_renderer_cells(nebel_renderer *renderer, const nebel_cells *cells, nebel_cell_stage stage)
{
    if (renderer == NULL || stage < 0 || stage >= NEBEL_CELL_STAGE_COUNT) return NEBEL_ERROR_ARGUMENT;
    if (cells != NULL && stage == NEBEL_CELLS_PER_VERTEX && renderer->vertex_fog == NULL) {
        renderer->vertex_fog =
            nb_allocate(&renderer->allocator, renderer->geometry.vertex_count, sizeof *renderer->vertex_fog);
        if (renderer->vertex_fog == NULL)
            return nb_fail(&renderer->log, NEBEL_ERROR_MEMORY, "renderer: out of memory for fog at vertices");
    }
    renderer->cells = cells;
    renderer->cell_stage = stage;
    return NEBEL_OK;
}

void nebel_destroy_renderer(nebel_renderer *renderer)
{
    if (renderer == NULL) return;
    const nebel_allocator allocator = renderer->allocator;
    nb_geometry_free(&renderer->geometry);
    if (renderer->fog != NULL) nebel_release_snapshot(renderer->fog);
    nb_release(&allocator, renderer->scratch_memory);
    nb_release(&allocator, renderer->vertex_fog);
    nb_release(&allocator, renderer);
}
