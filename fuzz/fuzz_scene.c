/* Any bytes as a scene file: a scene or an error with a message, and every byte of memory back. */
#include "witness.h"

#include <nebel/scene.h>

#include <stdint.h>
#include <stdlib.h>

/* More particles take longer than a fuzzer should spend on one scene. */
enum { MOST_PARTICLES = 2000 };

/* Only particles may find no place; fog that was read can be had at every frame. */
static void commit(const nebel_scene *scene, double frame)
{
    nebel_snapshot *fog = NULL;
    nebel_lighting *lighting = NULL;
    const nebel_result result = nebel_commit_scene_fog_at(scene, frame, &fog);
    const size_t particles = nebel_get_scene_data(scene)->particle_count;
    if (result != NEBEL_OK && !(result == NEBEL_ERROR_VALUE && particles > 0)) abort();
    if ((result == NEBEL_OK) != (fog != NULL)) abort();
    if (fog == NULL) return;
    const nebel_result lit = nebel_create_scene_lighting(scene, fog, frame, NULL, &lighting);
    nebel_release_snapshot(fog);
    nebel_release_lighting(lighting);
    /* Not all fog can be lit many times. */
    const int may_refuse = nebel_get_scene_data(scene)->diffusion != NULL;
    if (lit != NEBEL_OK && !(lit == NEBEL_ERROR_UNSUPPORTED && may_refuse)) abort();
    if ((lit == NEBEL_OK) != (lighting != NULL)) abort();
}

/* What a scene promises to its users. That a shape leaves no place for particles is found when they are distributed. */
static void check_scene(nebel_scene *scene)
{
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    if (data->diffusion != NULL) {
        nebel_diffusion_desc quick = *data->diffusion;
        quick.max_cells = NEBEL_MIN_DIFFUSION_CELLS;
        if (nebel_set_scene_diffusion(scene, &quick) != NEBEL_OK) abort();
    }
    for (size_t i = 0; i < data->volume_count; i++)
        if (data->volume_names[i] == NULL) abort();
    const nebel_camera camera = nebel_get_scene_camera(scene, 12.5);
    if (!(camera.vertical_fov > 0 && camera.vertical_fov < 180 && camera.view_height > 0)) abort();
    if (data->particle_count > MOST_PARTICLES) return;
    commit(scene, 0);
    if (data->animated_volume_count > 0) commit(scene, 12.5);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    witness seen = {.max_bytes = (size_t)1 << 30};
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {
        .host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}}};
    const nebel_result result = nebel_parse_scene((const char *)data, size, "fuzz.json", &desc, &scene);
    if ((result == NEBEL_OK) != (scene != NULL)) abort();
    if ((result == NEBEL_OK) != (seen.messages == 0)) abort();
    if (scene != NULL) check_scene(scene);
    nebel_destroy_scene(scene);
    if (seen.allocations != 0) abort();
    return 0;
}
