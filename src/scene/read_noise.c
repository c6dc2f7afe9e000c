/* A density of noise: its voxels are made at once. */
#include "scene_data.h"

#include <limits.h>
#include <string.h>

enum {
    NOISE_TYPE,
    NOISE_SIZE,
    NOISE_CELLS,
    NOISE_OCTAVES,
    NOISE_GAIN,
    NOISE_COVERAGE,
    NOISE_EDGE,
    NOISE_VELOCITY,
    NOISE_EVOLUTION,
    NOISE_SEED,
    NOISE_KEY_COUNT
};

static const char *const noise_key_names[] = {"type",     "size", "cells",    "octaves",   "gain",
                                              "coverage", "edge", "velocity", "evolution", "seed"};

static const nb_key_set noise_keys = {noise_key_names, NOISE_KEY_COUNT, NB_BIT(NOISE_KEY_COUNT) - 1,
                                      NB_BIT(NOISE_SIZE) | NB_BIT(NOISE_CELLS), "noise"};

/* Further than this per frame nothing is left of the frame before. */
#define MOST_MOTION 1000

static bool read_noise_members(nb_json *json, const nb_json_node *const *found, nebel_scene_noise *noise)
{
    static const nb_range part = {.low = 1e-6, .high = 1, .text = "a number from 1e-6 to 1"};
    static const nb_range half = {.low = 0, .high = 0.5, .text = "a number from 0 to 0.5"};
    static const nb_range motion = {.low = -MOST_MOTION, .high = MOST_MOTION, .text = "a number from -1000 to 1000"};
    static const nb_range cells = {.low = 1e-6, .high = NEBEL_MAX_GRID_SIZE / 2, .text = "a number from 1e-6 to 2048"};
    nebel_noise_desc *desc = &noise->desc;
    int seed = 0;
    if (!nb_keys_read_grid_size(json, found[NOISE_SIZE], desc->size) ||
        !nb_key_value_numbers(json, found[NOISE_CELLS], &cells, 3, desc->frequency) ||
        !nb_key_value_integer(json, found[NOISE_OCTAVES], 1, 16, &desc->octaves) ||
        !nb_key_value_number(json, found[NOISE_GAIN], &part, &desc->gain) ||
        !nb_key_value_number(json, found[NOISE_COVERAGE], &part, &desc->coverage) ||
        !nb_key_value_numbers(json, found[NOISE_EDGE], &half, 3, desc->falloff) ||
        !nb_key_value_numbers(json, found[NOISE_VELOCITY], &motion, 3, noise->velocity) ||
        !nb_key_value_number(json, found[NOISE_EVOLUTION], &motion, &noise->evolution) ||
        !nb_key_value_integer(json, found[NOISE_SEED], 0, INT_MAX, &seed))
        return false;
    desc->seed = (uint32_t)seed;
    return true;
}

bool nb_keys_read_noise_numbers(nb_json *json, const nb_json_node *node, nebel_scene_noise *noise)
{
    const nb_json_node *found[NOISE_KEY_COUNT];
    noise->desc.octaves = 1;
    noise->desc.gain = 0.5;
    noise->desc.coverage = 1;
    return nb_key_value_members(json, node, &noise_keys, found) && read_noise_members(json, found, noise);
}

bool nb_noise_moves(const nebel_scene_noise *noise)
{
    return noise->evolution != 0 || noise->velocity[0] != 0 || noise->velocity[1] != 0 || noise->velocity[2] != 0;
}

/* The words are the scene file's, whatever file they come from: those of a model's node are y up. NULL: out of memory. */
static const char *name_noise(nb_scene_reader *in, const nb_json_node *node, const nebel_scene_noise *noise)
{
    nebel_scene *scene = in->scene;
    const char *words = nb_arena_copy_text(&scene->arena, in->json->desc.text + node->offset, node->end - node->offset);
    nebel_scene_noise own = *noise;
    nb_bytes changed = {0};
    if (words == NULL || in->space.z_up == scene->space.z_up) return words;
    nb_file_units_restore_noise(&scene->space, &own);
    const nebel_result result = nb_noise_words(scene, words, &own, &changed);
    words = result == NEBEL_OK ? nb_arena_copy_text(&scene->arena, (const char *)changed.data, changed.size) : NULL;
    nb_release(&scene->allocator, changed.data);
    return words;
}

bool nb_keys_read_noise(nb_scene_reader *in, const nb_json_node *node, nebel_density *density)
{
    nb_json *json = in->json;
    nb_note note = {""};
    nebel_scene_noise noise = {.desc = {.host = {.allocator = in->scene->allocator, .log = nb_note_log(&note)}}};
    if (!nb_keys_read_noise_numbers(json, node, &noise)) return false;
    /* That of the scene's own file has been counted. */
    if (in->node != NULL && !nb_scene_charge_noise(in, node)) return false;
    noise.desc.name = name_noise(in, node, &noise);
    if (noise.desc.name == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    nb_file_units_convert_noise(&in->space, &noise);
    *density = (nebel_density){.type = NEBEL_DENSITY_GRID};
    const nebel_result result = nebel_create_noise_grid(&noise.desc, &density->grid);
    if (result != NEBEL_OK)
        return nb_json_fail(json, result == NEBEL_ERROR_VALUE ? NEBEL_ERROR_FORMAT : result, node, "%s", note.text);
    if (nb_noise_moves(&noise)) {
        in->scene->data.animated_volume_count++;
        in->scene->data.has_endless_motion = 1;
    }
    return nb_scene_keep_grid(in, node, density->grid);
}
