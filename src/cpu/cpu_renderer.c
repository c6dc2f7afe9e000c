#include "cpu_renderer.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum { ALIGNMENT = 64, MOST_THREADS = 1024 };

const char *nebel_cpu_libraries(void)
{
    return "Embree " RTC_VERSION_STRING;
}

static nebel_result check(const nebel_scene_data *scene, const nebel_cpu_renderer_desc *desc)
{
    if (scene == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "renderer: scene is NULL");
    if (!nb_allocator_is_valid(&desc->host.allocator)) {
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "renderer: the allocator needs both functions or neither");
    }
    if (desc->thread_count < 0 || desc->thread_count > MOST_THREADS) {
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "renderer: %d threads; 0 (all) to %d are possible",
                       desc->thread_count, MOST_THREADS);
    }
    if (desc->isa != NEBEL_ISA_DEFAULT && !nebel_isa_available(desc->isa)) {
        return nb_fail(&desc->host.log, NEBEL_ERROR_UNSUPPORTED, "renderer: instruction set %s is not available here",
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

void nebel_parallel_for_openmp(size_t parts, void (*part)(void *data, size_t i), void *data, void *user)
{
    if (part == NULL) return;
    const int *wanted = user;
    const int threads = count_threads(wanted != NULL ? *wanted : 0);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
    for (size_t i = 0; i < parts; i++) part(data, i);
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
    for (int i = 0; i < renderer->threads; i++) {
        renderer->scratch[i].shafts = (nb_sun_shafts){.shadows = NULL};
        renderer->scratch[i].light_shafts = (nb_light_shafts){.numbers = NULL};
        renderer->scratch[i].clouds.workspace = NULL;
        renderer->scratch[i].air.is_kept = 0;
    }
    return NEBEL_OK;
}

static nebel_result set_up(nebel_renderer *renderer, nebel_isa isa)
{
    nebel_result result = allocate_scratch(renderer);
    if (result == NEBEL_OK) result = nb_geometry_make(&renderer->geometry, renderer->scene, isa, renderer->threads);
    if (result == NEBEL_OK) result = nb_geometry_place(&renderer->geometry, renderer->scene->camera.position);
    return result;
}

nebel_result nebel_create_cpu_renderer(const nebel_scene_data *scene, nebel_lighting *lighting,
                                       const nebel_cpu_renderer_desc *desc, nebel_renderer **renderer)
{
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    *renderer = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check(scene, desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_renderer *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "renderer: out of memory");
    made->allocator = made->geometry.allocator = allocator;
    made->log = made->geometry.log = desc->host.log;
    made->scene = scene;
    made->lighting = nebel_retain_lighting(lighting);
    made->fog = nebel_get_lighting_snapshot(lighting);
    made->fog_isa = desc->isa;
    made->threads = count_threads(desc->thread_count);
    nb_srgb_table_set(&made->table);
    result = set_up(made, desc->isa);
    if (result != NEBEL_OK) {
        if (result == NEBEL_ERROR_MEMORY)
            nb_fail(
                &desc->host.log, result,
                "renderer: out of memory; free some, raise its limit (ulimit -v), or use fewer triangles or threads");
        nebel_destroy_renderer(made);
        return result;
    }
    *renderer = made;
    return NEBEL_OK;
}

nebel_result nebel_set_renderer_lighting(nebel_renderer *renderer, nebel_lighting *lighting)
{
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    (void)nebel_retain_lighting(lighting);
    nebel_release_lighting(renderer->lighting);
    renderer->lighting = lighting;
    renderer->fog = nebel_get_lighting_snapshot(lighting);
    return NEBEL_OK;
}

/* ---- methods --------------------------------------------------------------------------------- */

const char *nebel_method_name(nebel_method method)
{
    static const char *const words[] = {
        [NEBEL_METHOD_EXACT] = "exact",
        [NEBEL_METHOD_CELLS] = "cells",
        [NEBEL_METHOD_CELLS_PIXEL] = "cells-pixel",
        [NEBEL_METHOD_VERTEX] = "vertex",
        [NEBEL_METHOD_ADDITIVE] = "additive",
        [NEBEL_METHOD_LINEAR] = "linear",
        [NEBEL_METHOD_EXP] = "exp",
        [NEBEL_METHOD_EXP2] = "exp2",
        [NEBEL_METHOD_FIVE_TAP] = "five-tap",
        [NEBEL_METHOD_FOG_COORD] = "fog-coord",
        [NEBEL_METHOD_TWO_PASS] = "two-pass",
        [NEBEL_METHOD_ALPHA] = "alpha",
        [NEBEL_METHOD_D3D9] = "d3d9",
        [NEBEL_METHOD_PATH] = "path",
    };
    _Static_assert(sizeof words / sizeof *words == NEBEL_METHOD_COUNT, "each method has its word");
    return (unsigned)method < NEBEL_METHOD_COUNT ? words[method] : NULL;
}

int nebel_method_blends_stored(nebel_method method)
{
    switch (method) {
    case NEBEL_METHOD_LINEAR:
    case NEBEL_METHOD_EXP:
    case NEBEL_METHOD_EXP2:
    case NEBEL_METHOD_FOG_COORD:
    case NEBEL_METHOD_TWO_PASS:
    case NEBEL_METHOD_ALPHA:
    case NEBEL_METHOD_D3D9:
        return 1;
    default:
        return 0;
    }
}

static nebel_result make_room_at_vertices(nebel_renderer *renderer)
{
    if (renderer->vertex_fog != NULL) return NEBEL_OK;
    renderer->vertex_fog =
        nb_allocate(&renderer->allocator, renderer->geometry.vertex_count, sizeof *renderer->vertex_fog);
    if (renderer->vertex_fog != NULL) return NEBEL_OK;
    return nb_fail(&renderer->log, NEBEL_ERROR_MEMORY, "renderer: out of memory for fog at vertices");
}

nebel_result nebel_set_renderer_cells(nebel_renderer *renderer, const nebel_cells *cells, nebel_cell_stage stage)
{
    if (renderer == NULL || stage < 0 || stage >= NEBEL_CELL_STAGE_COUNT) return NEBEL_ERROR_ARGUMENT;
    if (cells != NULL && stage == NEBEL_CELLS_PER_VERTEX) {
        const nebel_result result = make_room_at_vertices(renderer);
        if (result != NEBEL_OK) return result;
    }
    renderer->cells = cells;
    renderer->method = cells == NULL                     ? NEBEL_METHOD_EXACT
                       : stage == NEBEL_CELLS_PER_VERTEX ? NEBEL_METHOD_CELLS
                                                         : NEBEL_METHOD_CELLS_PIXEL;
    return NEBEL_OK;
}

static nebel_result set_factor(nebel_renderer *renderer, nebel_method method, const nebel_factor_desc *factor)
{
    if (factor == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_factor_desc desc = *factor;
    desc.mode = method == NEBEL_METHOD_LINEAR ? NEBEL_FACTOR_LINEAR
                : method == NEBEL_METHOD_EXP  ? NEBEL_FACTOR_EXP
                                              : NEBEL_FACTOR_EXP2;
    return nebel_resolve_factor(&desc, &renderer->factor);
}

static nebel_result set_look(nebel_renderer *renderer, nebel_method method, const nebel_vertex_desc *vertex)
{
    nebel_vertex_desc look = {.curve = NEBEL_CURVE_PHYSICAL};
    if (vertex != NULL)
        look = (nebel_vertex_desc){
            .curve = vertex->curve, .table = vertex->table, .color = vertex->color, .channel = vertex->channel};
    if (method != NEBEL_METHOD_TWO_PASS && look.color == NULL) return NEBEL_ERROR_ARGUMENT;
    if (look.curve != NEBEL_CURVE_PHYSICAL && look.color == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = nebel_resolve_vertex_desc(&look, &look);
    if (result != NEBEL_OK) return result;
    if (look.color != NULL) {
        memcpy(renderer->look_color, look.color, sizeof renderer->look_color);
        look.color = renderer->look_color;
    }
    if (look.curve == NEBEL_CURVE_TABLE) {
        memcpy(renderer->look_table, look.table, sizeof renderer->look_table);
        look.table = renderer->look_table;
    }
    renderer->look = look;
    return NEBEL_OK;
}

static nebel_result set_d3d9(nebel_renderer *renderer, const nebel_method_desc *desc)
{
    const nebel_d3d9_fog *const d3d9 = desc->d3d9;
    nb_device_planes planes;
    if (d3d9 == NULL || d3d9->fog_table_mode > NEBEL_D3DFOG_LINEAR || d3d9->fog_vertex_mode > NEBEL_D3DFOG_LINEAR)
        return NEBEL_ERROR_ARGUMENT;
    if (nb_device_planes_set(&planes, desc->z_near, desc->z_far) != NEBEL_OK) return NEBEL_ERROR_VALUE;
    renderer->device_planes = planes;
    renderer->d3d9 = *d3d9;
    renderer->d3d9.fog_enable = 1;
    return NEBEL_OK;
}

static nebel_result set_numbers(nebel_renderer *renderer, nebel_method method, const nebel_method_desc *desc)
{
    switch (method) {
    case NEBEL_METHOD_LINEAR:
    case NEBEL_METHOD_EXP:
    case NEBEL_METHOD_EXP2:
        return set_factor(renderer, method, desc->factor);
    case NEBEL_METHOD_FOG_COORD:
    case NEBEL_METHOD_TWO_PASS:
    case NEBEL_METHOD_ALPHA:
        return set_look(renderer, method, desc->vertex);
    case NEBEL_METHOD_D3D9:
        return set_d3d9(renderer, desc);
    case NEBEL_METHOD_EXACT:
    case NEBEL_METHOD_PATH:
    case NEBEL_METHOD_VERTEX:
    case NEBEL_METHOD_ADDITIVE:
        return NEBEL_OK;
    default:
        return NEBEL_ERROR_ARGUMENT;
    }
}

nebel_result nebel_set_renderer_method(nebel_renderer *renderer, nebel_method method, const nebel_method_desc *desc)
{
    static const nebel_method_desc nothing = {.factor = NULL};
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    if (method != NEBEL_METHOD_EXACT && method != NEBEL_METHOD_PATH) {
        const nebel_result result = make_room_at_vertices(renderer);
        if (result != NEBEL_OK) return result;
    }
    const nebel_result result = set_numbers(renderer, method, desc != NULL ? desc : &nothing);
    if (result != NEBEL_OK)
        return nb_fail(&renderer->log, result,
                       "renderer: there is no such method here, or what it needs is missing or not valid");
    renderer->method = method;
    return NEBEL_OK;
}

void nebel_destroy_renderer(nebel_renderer *renderer)
{
    if (renderer == NULL) return;
    const nebel_allocator allocator = renderer->allocator;
    nb_geometry_free(&renderer->geometry);
    nb_sun_cells_free(&renderer->sun_cells, &allocator);
    nb_shadow_tree_free(&renderer->light_tree, &allocator);
    for (int i = 0; i < renderer->threads && renderer->scratch != NULL; i++) {
        nb_sun_shafts_free(&renderer->scratch[i].shafts, &allocator);
        nb_light_shafts_free(&renderer->scratch[i].light_shafts, &allocator);
    }
    nebel_release_lighting(renderer->lighting);
    nb_release(&allocator, renderer->scratch_memory);
    nb_release(&allocator, renderer->vertex_fog);
    nb_release(&allocator, renderer);
}
