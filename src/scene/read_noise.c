/* A density of noise: its voxels are made at once, and anew at every frame where it moves. */
#include "scene/model.h"

#include <limits.h>
#include <string.h>

enum { TYPE, SIZE, CELLS, OCTAVES, GAIN, COVERAGE, EDGE, DRIFT, CHANGE, SEED, NOISE_KEY_COUNT };

static const char *const key_names[] = {"type",     "size", "cells", "octaves", "gain",
                                        "coverage", "edge", "drift", "change",  "seed"};

static const nb_keys noise_keys = {key_names, NOISE_KEY_COUNT, NB_BIT(NOISE_KEY_COUNT) - 1,
                                   NB_BIT(SIZE) | NB_BIT(CELLS), "noise"};

/* Further than this per frame nothing is left of the frame before. */
#define MOST_MOTION 1000

static bool read_numbers(nb_json *json, const nb_json_node *const *found, nb_noise *noise)
{
    static const nb_range part = {.low = 1e-6, .high = 1, .text = "a number from 1e-6 to 1"};
    static const nb_range half = {.low = 0, .high = 0.5, .text = "a number from 0 to 0.5"};
    static const nb_range motion = {.low = -MOST_MOTION, .high = MOST_MOTION, .text = "a number from -1000 to 1000"};
    static const nb_range cells = {.low = 1e-6, .high = NEBEL_MAX_GRID_SIZE / 2, .text = "a number from 1e-6 to 2048"};
    nebel_noise_desc *desc = &noise->desc;
    int seed = 0;
    if (!nb_read_grid_size(json, found[SIZE], desc->size) ||
        !nb_value_numbers(json, found[CELLS], &cells, 3, desc->cells) ||
        !nb_value_integer(json, found[OCTAVES], 1, 16, &desc->octaves) ||
        !nb_value_number(json, found[GAIN], &part, &desc->gain) ||
        !nb_value_number(json, found[COVERAGE], &part, &desc->coverage) ||
        !nb_value_numbers(json, found[EDGE], &half, 3, desc->edge) ||
        !nb_value_numbers(json, found[DRIFT], &motion, 3, noise->drift) ||
        !nb_value_number(json, found[CHANGE], &motion, &noise->change) ||
        !nb_value_integer(json, found[SEED], 0, INT_MAX, &seed))
        return false;
    desc->seed = (uint32_t)seed;
    return true;
}

/* The scene owns the grid already. */
static bool keep_noise(nb_scene_reader *in, const nb_json_node *node, const nb_noise *noise)
{
    nebel_scene *scene = in->scene;
    void *noises = scene->noises;
    const size_t count = scene->noise_count;
    const bool room = nb_grow(&scene->allocator, &noises, sizeof *noise, count, &scene->noise_capacity, count + 1);
    scene->noises = noises;
    if (!room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->noises[scene->noise_count++] = *noise;
    scene->data.moving_volume_count++;
    return true;
}

static bool moves(const nb_noise *noise)
{
    return noise->change != 0 || noise->drift[0] != 0 || noise->drift[1] != 0 || noise->drift[2] != 0;
}

bool nb_read_noise(nb_scene_reader *in, const nb_json_node *node, nebel_density *density)
{
    const nb_json_node *found[NOISE_KEY_COUNT];
    nb_json *json = in->json;
    nb_note note = {""};
    nb_noise noise = {.desc = {.allocator = in->scene->allocator, .log = nb_note_log(&note)}};
    if (!nb_value_members(json, node, &noise_keys, found) || !read_numbers(json, found, &noise)) return false;
    noise.desc.name = nb_arena_copy_text(&in->scene->arena, json->desc.text + node->offset, node->end - node->offset);
    if (noise.desc.name == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *density = (nebel_density){.type = NEBEL_DENSITY_GRID};
    const nebel_result result = nebel_create_noise(&noise.desc, &density->grid);
    if (result != NEBEL_OK)
        return nb_json_fail(json, result == NEBEL_ERROR_VALUE ? NEBEL_ERROR_FORMAT : result, node, "%s", note.text);
    noise.grid = density->grid;
    noise.desc.log = in->scene->log;
    return nb_scene_keep_grid(in, node, density->grid) && (!moves(&noise) || keep_noise(in, node, &noise));
}

nebel_result nb_scene_noise_at(const nebel_scene *scene, const nebel_grid *grid, double frame, nebel_grid **made)
{
    *made = NULL;
    for (size_t i = 0; i < scene->noise_count && grid != NULL && frame != 0; i++) {
        const nb_noise *noise = &scene->noises[i];
        if (noise->grid != grid) continue;
        nebel_noise_desc desc = noise->desc;
        for (int k = 0; k < 3; k++) desc.offset[k] = noise->drift[k] * frame;
        desc.time = noise->change * frame;
        return nebel_create_noise(&desc, made);
    }
    return NEBEL_OK;
}
