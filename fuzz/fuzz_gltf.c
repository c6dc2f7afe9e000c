/* Any bytes as the JSON of a glTF file: what is made of it for Assimp is JSON again, or there is a message; every byte of
 * memory comes back. */
#include "witness.h"

#include "model/gltf_data.h"
#include "model_reader/gltf_unpack.h"

#include <stdlib.h>
#include <string.h>

static void count_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    witness *seen = user;
    (void)level;
    if (message[0] == '\0') abort();
    seen->messages += result != NEBEL_OK;
}

static bool take_any(nb_json *json, const nb_json_node *value, void *user)
{
    (void)json, (void)value, (void)user;
    return true;
}

/* Text that is made is read again. */
static void check_text(const nebel_allocator *allocator, const nb_bytes *text)
{
    static const char *const streamed[] = {"buffers", "bufferViews", "accessors", "meshes", "nodes", NULL};
    nb_json json;
    const nb_json_desc desc = {.text = (const char *)text->data,
                               .size = text->size,
                               .name = "made",
                               .allocator = *allocator,
                               .streamed = streamed,
                               .take = take_any};
    const nebel_result result = nb_json_read(&json, &desc);
    if (result != NEBEL_OK && result != NEBEL_ERROR_MEMORY) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    witness seen = {.max_bytes = (size_t)1 << 24};
    const nb_model_source source = {.file = "fuzz.gltf"};
    const nb_model_load load = {.allocator = {witness_allocate, witness_release, &seen},
                                .log = {count_message, &seen},
                                .source = &source,
                                .unpack = nb_unpack_meshopt()};
    nb_model_files files = {.file = "fuzz.gltf", .name = "fuzz.gltf", .folder = "/nowhere/", .root = -1};
    nb_gltf_files made = {0};
    nb_bytes text = {.data = nb_allocate(&load.allocator, size, 1), .size = size};
    if (text.data == NULL) return 0;
    if (size > 0) memcpy(text.data, data, size);
    const nebel_result result = nb_gltf_prepare_text(&load, &files, &text, &made);
    if ((result == NEBEL_OK) != (seen.messages == 0)) abort();
    if (result == NEBEL_OK && made.files[NB_GLTF_TEXT].bytes.size > 0)
        check_text(&load.allocator, &made.files[NB_GLTF_TEXT].bytes);
    nb_gltf_release_files(&load.allocator, &made);
    if (seen.allocations != 0) abort();
    return 0;
}
