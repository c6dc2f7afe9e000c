#define _POSIX_C_SOURCE 200809L
/* The JSON of a glTF file, without the meshes beside it. */
#include "gltf.h"
#include "file/path.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* The most JSON that is looked at. */
#define JSON_LIMIT ((size_t)1 << 30)

static size_t read_json_size(FILE *stream)
{
    unsigned char head[NB_GLB_HEADER + NB_GLB_CHUNK_HEADER];
    if (fread(head, 1, sizeof head, stream) != sizeof head || memcmp(head, "glTF", 4) != 0) return 0;
    return memcmp(head + NB_GLB_HEADER + 4, "JSON", 4) == 0 ? nb_gltf_word(head + NB_GLB_HEADER) : 0;
}

static nebel_result read_json_chunk(const nebel_allocator *allocator, FILE *stream, nb_bytes *text)
{
    const size_t size = read_json_size(stream);
    if (size == 0 || size > JSON_LIMIT) return NEBEL_ERROR_FORMAT;
    text->data = nb_allocate(allocator, size, 1);
    if (text->data == NULL) return NEBEL_ERROR_MEMORY;
    text->size = fread(text->data, 1, size, stream);
    return NEBEL_OK;
}

static nebel_result read_binary(const nebel_allocator *allocator, const char *file, nb_bytes *text)
{
    const nebel_log silent = {0};
    FILE *stream = nb_file_open_stream(&silent, NULL, "model", file);
    if (stream == NULL) return NEBEL_ERROR_FILE;
    const nebel_result result = read_json_chunk(allocator, stream, text);
    fclose(stream);
    return result;
}

static bool ends_in(const char *file, const char *suffix)
{
    const char *dot = strrchr(nb_path_name(file), '.');
    return dot != NULL && strcasecmp(dot, suffix) == 0;
}

bool nb_gltf_is(const char *file)
{
    return ends_in(file, ".gltf") || ends_in(file, ".glb");
}

nebel_result nb_gltf_read_text(const nebel_allocator *allocator, const char *file, nb_bytes *text)
{
    const nebel_log silent = {0};
    nebel_result result = NEBEL_OK;
    *text = (nb_bytes){0};
    const bool text_file = ends_in(file, ".gltf");
    if (!text_file && !ends_in(file, ".glb")) return NEBEL_OK;
    if (nb_file_check(&silent, NULL, "model", file) != NEBEL_OK) return NEBEL_OK;
    if (text_file)
        result = nb_file_read(allocator, &silent, NULL, "model", file, JSON_LIMIT, text);
    else
        result = read_binary(allocator, file, text);
    return result == NEBEL_ERROR_MEMORY ? result : NEBEL_OK;
}
