/* Any bytes as the text of a glTF model whose nodes have fog: a scene with that fog, which can be had, or one message and no scene; every
 * byte of memory comes back. The model's meshes are not read. */
#define _GNU_SOURCE
#include "witness.h"

#include <nebel/scene.h>

#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char name[64];

static void count_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    witness *seen = user;
    (void)level;
    demand(message[0] != '\0');
    seen->messages += result != NEBEL_OK;
}

/* Over what was there: to make a file anew takes a disk a hundred times as long. */
static void write_model(const uint8_t *data, size_t size)
{
    static int file = -1;
    static size_t before;
    if (file < 0) {
        snprintf(name, sizeof name, "/tmp/nebel-fuzz-fog.%ld.gltf", (long)getpid());
        file = open(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    }
    demand(file >= 0 && pwrite(file, data, size, 0) == (ssize_t)size);
    if (size < before) demand(ftruncate(file, (off_t)size) == 0);
    before = size;
}

static void remove_model(void)
{
    unlink(name);
}

/* Fog that was read can be had, and is where nodes are: all its numbers are some. */
static void check_fog(const nebel_scene *scene)
{
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    nebel_snapshot *fog = NULL;
    nebel_lighting *lighting = NULL;
    for (size_t i = 0; i < data->volume_count; i++) {
        const nebel_transform *place = &data->volumes[i].shape.transform;
        demand(data->volume_names[i] != NULL && nebel_get_volume_origin(scene, i) == NEBEL_VOLUME_FROM_NODE);
        for (int k = 0; k < 3; k++) demand(isfinite(place->position[k]) && isfinite(place->scale[k]));
        for (int k = 0; k < 3; k++) demand(data->volumes[i].extinction[k] >= 0);
    }
    demand(nebel_commit_scene_fog(scene, &fog) == NEBEL_OK);
    demand(nebel_create_scene_lighting(scene, fog, 0, NULL, &lighting) == NEBEL_OK);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(fog);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char text[300];
    witness seen = {0};
    nebel_scene *scene = NULL;
    if (name[0] == '\0') demand(atexit(remove_model) == 0);
    write_model(data, size);
    /* A second of preparation: noise that takes longer is refused. */
    const nebel_scene_desc desc = {
        .host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {count_message, &seen}},
        .memory = (uint64_t)16 << 20};
    snprintf(text, sizeof text,
             "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"%s\", \"position\": [1, 2, 3], \"scale\": 0.5, "
             "\"rotation\": [0, 1, 0, 1]}]}",
             name);
    const nebel_result result = nebel_parse_scene(text, strlen(text), "fuzz.json", &desc, &scene);
    demand((result == NEBEL_OK) == (scene != NULL));
    demand((result == NEBEL_OK) == (seen.messages == 0));
    if (scene != NULL) check_fog(scene);
    nebel_destroy_scene(scene);
    demand(seen.allocations == 0);
    return 0;
}
