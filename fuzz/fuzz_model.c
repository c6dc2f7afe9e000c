/* Any bytes as a model, which nebel-read-model reads: whatever becomes of it there, here it is meshes or an error. The first
 * byte chooses the format. */
#define _GNU_SOURCE
#include <nebel/scene.h>

#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const formats[] = {"gltf", "glb",   "obj", "ply",  "stl", "fbx", "dae", "3ds", "off",  "x",
                                      "ac",   "blend", "lwo", "ms3d", "md2", "smd", "bvh", "x3d", "ogex", "ifc"};

static void count_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    size_t *errors = user;
    (void)level;
    if (message[0] == '\0') abort();
    *errors += result != NEBEL_OK;
}

static void write_model(const char *name, const uint8_t *data, size_t size)
{
    const int file = open(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0 || write(file, data, size) != (ssize_t)size) abort();
    close(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char folder[] = "/tmp/nebel-fuzz-model.XXXXXX";
    static bool has_folder;
    char name[100], text[200];
    size_t errors = 0;
    nebel_scene *scene = NULL;
    if (size == 0) return 0;
    if (!has_folder && mkdtemp(folder) == NULL) abort();
    has_folder = true;
    snprintf(name, sizeof name, "%s/model.%s", folder, formats[data[0] % (sizeof formats / sizeof *formats)]);
    write_model(name, data + 1, size - 1);
    snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"%s\"}]}", name);
    const nebel_scene_desc desc = {.host.log = {count_message, &errors}};
    nebel_result result = nebel_parse_scene(text, strlen(text), "fuzz.json", &desc, &scene);
    if (result == NEBEL_OK) result = nebel_load_scene_models(scene);
    if (result == NEBEL_ERROR_FILE && size > 1) abort(); /* the reader is there, and so is the file */
    if ((result == NEBEL_OK) != (errors == 0)) abort();
    nebel_destroy_scene(scene);
    unlink(name);
    return 0;
}
