#define _POSIX_C_SOURCE 200809L
/* The bytes of glTF buffers: in a file, in the text itself, or in the chunk of a .glb file. */
#include "gltf_data.h"
#include "file/path.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* The largest file of a buffer. */
#define BUFFER_LIMIT (SIZE_MAX >> 30)

nebel_result nb_gltf_fail(const nb_gltf_data *data, const char *what, size_t index, const char *problem)
{
    return nb_model_fail(data->load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: %s[%zu] %s; is it complete?",
                         data->load->source->file, what, index, problem);
}

nebel_result nb_gltf_fail_memory(const nb_gltf_data *data)
{
    return nb_model_fail(data->load, NEBEL_ERROR_MEMORY, "out of memory");
}

/* ---- base64 ---------------------------------------------------------------------------------- */

/* RFC 4648, section 4. */
static int base64_digit(char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* The bytes of four digits each; returns how many there are, SIZE_MAX where a digit is none. */
static size_t decode_base64(const char *text, size_t size, unsigned char *bytes)
{
    uint32_t bits = 0;
    size_t count = 0, digits = 0;
    while (size > 0 && text[size - 1] == '=') size--;
    for (size_t i = 0; i < size; i++) {
        const int value = base64_digit(text[i]);
        if (value < 0) return SIZE_MAX;
        bits = bits << 6 | (uint32_t)value;
        if (++digits % 4 == 1) continue;
        bytes[count++] = (unsigned char)(bits >> (digits % 4 == 2 ? 4 : digits % 4 == 3 ? 2 : 0));
    }
    return count;
}

static nebel_result load_embedded(nb_gltf_data *data, nb_gltf_buffer *buffer, size_t index)
{
    static const char mark[] = ";base64,";
    const char *comma = memchr(buffer->uri, ',', buffer->uri_size);
    const size_t lead = comma != NULL ? (size_t)(comma - buffer->uri) + 1 : 0;
    if (lead < sizeof mark - 1 || memcmp(comma - (sizeof mark - 2), mark, sizeof mark - 1) != 0)
        return nb_gltf_fail(data, "buffers", index, "holds data that are not base64");
    const size_t size = buffer->uri_size - lead;
    buffer->bytes.data = nb_allocate(&data->load->allocator, size / 4 * 3 + 3, 1);
    if (buffer->bytes.data == NULL) return nb_gltf_fail_memory(data);
    buffer->bytes.size = decode_base64(comma + 1, size, buffer->bytes.data);
    return buffer->bytes.size != SIZE_MAX ? NEBEL_OK
                                          : nb_gltf_fail(data, "buffers", index, "holds data that are not base64");
}

/* ---- files ----------------------------------------------------------------------------------- */

static nebel_result fail_file(const nb_gltf_data *data, const char *uri, int error)
{
    const nb_refusal refusal = data->files->refusal;
    const char *reason = refusal != NB_REFUSAL_NONE ? nb_model_files_refusal_text(refusal) : strerror(error);
    return nb_model_fail(data->load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: it names \"%s\": %s%s",
                         data->load->source->file, uri, refusal != NB_REFUSAL_NONE ? "it " : "", reason);
}

static nebel_result load_buffer_file(nb_gltf_data *data, nb_gltf_buffer *buffer)
{
    const nb_model_load *load = data->load;
    const char *folder = nb_path_folder(&data->arena, data->files->name);
    const char *uri = nb_arena_copy_text(&data->arena, buffer->uri, buffer->uri_size);
    const char *path = folder != NULL && uri != NULL ? nb_path_join(&data->arena, folder, uri) : NULL;
    if (path == NULL) return nb_gltf_fail_memory(data);
    const int file = nb_model_files_open(data->files, path);
    if (file < 0) return fail_file(data, uri, errno);
    const nebel_result result =
        nb_file_read_open(&load->allocator, &load->log, NULL, "buffer", uri, file, BUFFER_LIMIT, &buffer->bytes);
    close(file);
    return result;
}

static nebel_result load(nb_gltf_data *data, size_t index)
{
    nb_gltf_buffer *buffer = &data->buffers[index];
    if (buffer->is_loaded) return NEBEL_OK;
    buffer->is_loaded = true;
    if (buffer->uri == NULL) return NEBEL_OK; /* the chunk, or nothing */
    if (buffer->uri_size > 5 && memcmp(buffer->uri, "data:", 5) == 0) return load_embedded(data, buffer, index);
    return load_buffer_file(data, buffer);
}

nebel_result nb_gltf_find_bytes(nb_gltf_data *data, const nb_gltf_range *range, const unsigned char **bytes)
{
    const size_t index = (size_t)range->buffer;
    if (range->buffer < 0 || index >= data->buffer_count)
        return nb_gltf_fail(data, "buffers", index, "does not exist, but is named");
    const nebel_result result = load(data, index);
    if (result != NEBEL_OK) return result;
    const bool is_chunk = index == 0 && data->buffers[0].uri == NULL && data->has_chunk;
    const nb_bytes *whole = is_chunk ? &data->chunk : &data->buffers[index].bytes;
    if (whole->data == NULL || range->offset > whole->size || range->size > whole->size - range->offset)
        return nb_gltf_fail(data, "buffers", index, "is shorter than what is read of it");
    *bytes = whole->data + range->offset;
    return NEBEL_OK;
}

/* ---- what is made ---------------------------------------------------------------------------- */

unsigned char *nb_gltf_add_extra(nb_gltf_data *data, uint64_t size, uint64_t *offset)
{
    void *bytes = data->extra.data;
    const size_t begin = (data->extra.size + 3) / 4 * 4;
    if (size > SIZE_MAX / 4 ||
        !nb_grow(&data->load->allocator, &bytes, 1, data->extra.size, &data->extra.capacity, begin + (size_t)size))
        return NULL;
    data->extra.data = bytes;
    memset(data->extra.data + data->extra.size, 0, begin - data->extra.size);
    data->extra.size = begin + (size_t)size;
    *offset = begin;
    return data->extra.data + begin;
}
