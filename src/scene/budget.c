/* What a scene may take in all, counted before the work. */
#include "scene_data.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MEGABYTE 1048576.0

/* How much memory stands for a second of preparation: a scene that may be larger may take longer. */
#define MEMORY_OF_SECOND (64 * MEGABYTE)

enum { EXCESS_SIZE = 200 };

double nb_scene_most_memory(const nebel_scene *scene)
{
    return (double)(scene->budget.most != 0 ? scene->budget.most : NEBEL_DEFAULT_SCENE_MEMORY);
}

double nb_scene_most_seconds(const nebel_scene *scene)
{
    return nb_scene_most_memory(scene) / MEMORY_OF_SECOND;
}

uint64_t nb_scene_room(const nebel_scene *scene)
{
    const double left = nb_scene_most_memory(scene) - scene->budget.memory;
    return left > 1 ? (uint64_t)left : 1;
}

/* Of what is asked for, where it is too much: "brings the scene to ...". False where it is not. */
static bool find_excess(const nebel_scene *scene, double memory, double seconds, char text[EXCESS_SIZE])
{
    const double most = nb_scene_most_memory(scene), longest = nb_scene_most_seconds(scene);
    if (memory > most)
        snprintf(text, EXCESS_SIZE,
                 "brings the scene to %.0f MB of memory; %.0f MB is the most it may take (nebel: --memory)",
                 memory / MEGABYTE, most / MEGABYTE);
    else if (seconds > longest)
        snprintf(text, EXCESS_SIZE,
                 "brings the scene to about %.0f s of preparation; %.0f s is the most with %.0f MB of memory "
                 "(nebel: --memory)",
                 seconds, longest, most / MEGABYTE);
    return memory > most || seconds > longest;
}

bool nb_scene_charge(nb_scene_reader *in, const nb_json_node *node, double bytes, double seconds)
{
    nebel_scene *scene = in->scene;
    char excess[EXCESS_SIZE];
    const double memory = scene->budget.memory + bytes, time = scene->budget.seconds + seconds;
    if (find_excess(scene, memory, time, excess)) return nb_json_fail(in->json, NEBEL_ERROR_LIMIT, node, "%s", excess);
    scene->budget.memory = memory;
    scene->budget.seconds = time;
    return true;
}

/* ---- what the host asks for ------------------------------------------------------------------ */

/* Meshes are counted from what was there before them. */
static double count_memory(const nebel_scene *scene)
{
    return scene->models_loaded ? scene->loaded.bytes : scene->budget.memory;
}

static nebel_result charge_host(nebel_scene *scene, const char *what, double bytes, double seconds)
{
    char excess[EXCESS_SIZE];
    if (find_excess(scene, count_memory(scene) + bytes, scene->budget.seconds + seconds, excess))
        return nb_fail(&scene->log, NEBEL_ERROR_LIMIT, "%s %s", what, excess);
    scene->budget.memory += bytes;
    scene->budget.seconds += seconds;
    scene->loaded.bytes += bytes;
    return NEBEL_OK;
}

nebel_result nebel_charge_scene(nebel_scene *scene, const char *what, uint64_t bytes)
{
    if (scene == NULL || what == NULL) return NEBEL_ERROR_ARGUMENT;
    return charge_host(scene, what, (double)bytes, 0);
}

nebel_result nebel_set_scene_diffusion(nebel_scene *scene, const nebel_diffusion_desc *desc)
{
    if (scene == NULL) return NEBEL_ERROR_ARGUMENT;
    const double wanted = nb_diffusion_cells(desc), more = wanted - scene->budget.lattice;
    const nebel_result result = charge_host(scene, "multiple scattering", more * NB_CELL_BYTES, more * NB_CELL_SECONDS);
    if (result != NEBEL_OK) return result;
    scene->budget.lattice = wanted;
    if (desc != NULL) scene->diffusion = *desc;
    scene->data.diffusion = desc != NULL ? &scene->diffusion : NULL;
    return NEBEL_OK;
}

double nb_diffusion_cells(const nebel_diffusion_desc *desc)
{
    if (desc == NULL) return 0;
    return desc->max_cells != 0 ? fmin(desc->max_cells, NEBEL_MAX_DIFFUSION_CELLS) : NEBEL_DEFAULT_DIFFUSION_CELLS;
}

/* ---- noise ----------------------------------------------------------------------------------- */

static const nb_json_node *find(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = object->type == NB_JSON_OBJECT ? nb_json_first(json, object) : NULL;
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

static bool is_zero_member(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = find(json, object, key);
    if (node == NULL || node->type == NB_JSON_NUMBER) return node == NULL || node->number == 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at))
        if (at->type != NB_JSON_NUMBER || at->number != 0) return false;
    return true;
}

bool nb_scene_charge_noise(nb_scene_reader *in, const nb_json_node *density)
{
    const nb_json_node *size = find(in->json, density, "size"), *octaves = find(in->json, density, "octaves");
    const double grids =
        is_zero_member(in->json, density, "velocity") && is_zero_member(in->json, density, "evolution") ? 1 : 2;
    double voxels = grids;
    if (size == NULL) return true;
    for (const nb_json_node *at = nb_json_first(in->json, size); at != NULL; at = nb_json_next(in->json, at))
        voxels *= at->type == NB_JSON_NUMBER && at->number > 0 && at->number <= NEBEL_MAX_GRID_SIZE ? at->number : 0;
    /* The reader says what is wrong there. */
    if (voxels > grids * NEBEL_MAX_NOISE_VOXELS) return true;
    const bool has_octaves = octaves != NULL && octaves->type == NB_JSON_NUMBER && octaves->number >= 1;
    return nb_scene_charge(in, density, NB_NOISE_VOXEL_BYTES * voxels,
                           NB_NOISE_OCTAVE_SECONDS * voxels * (has_octaves ? fmin(octaves->number, 16) : 1));
}

bool nb_scene_count_noise(nb_scene_reader *in, const nb_json_node *volume)
{
    static const char noise[] = "noise";
    const nb_json_node *density = find(in->json, volume, "density");
    const nb_json_node *type = density != NULL ? find(in->json, density, "type") : NULL;
    if (type == NULL || type->type != NB_JSON_STRING || type->string_size != strlen(noise) ||
        memcmp(type->string, noise, strlen(noise)) != 0)
        return true;
    in->json->desc.log = in->scene->log;
    const bool fits = nb_scene_charge_noise(in, density);
    in->json->desc.log = (nebel_log){NULL, NULL};
    in->over_budget = !fits;
    return fits;
}
