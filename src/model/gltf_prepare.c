#define _POSIX_C_SOURCE 200809L
#include "gltf_prepare.h"
#include "gltf.h"
#include "gltf_data.h"
#include "file/path.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

/* Names that no file has, beside the model. */
#define TEXT_NAME ".nebel-made.gltf"
#define CHUNK_NAME ".nebel-made-chunk.bin"
#define EXTRA_NAME ".nebel-made-extra.bin"

/* The longest text that stands for a view, an accessor or a buffer. */
enum { OBJECT_SIZE = 400 };

/* ---- compressed views ------------------------------------------------------------------------ */

/* What the extension asks of its numbers. */
static bool is_possible(const nb_meshopt_view *view)
{
    const uint64_t stride = view->stride, count = view->count;
    if (stride == 0 || stride > 256 || count == 0 || count > UINT32_MAX) return false;
    if (view->mode != NB_MESHOPT_ATTRIBUTES)
        return (stride == 2 || stride == 4) && view->filter == NB_MESHOPT_NONE &&
               (view->mode == NB_MESHOPT_INDICES || count % 3 == 0);
    if (view->filter == NB_MESHOPT_OCTAHEDRAL) return stride == 4 || stride == 8;
    return stride % 4 == 0 && (view->filter != NB_MESHOPT_QUATERNION || stride == 8);
}

/* Two bits of compressed vertices stand for 16 bytes at most, and a byte of indices for three numbers: whoever announces
 * much more does not mean it. */
static bool is_believable(const nb_meshopt_view *view)
{
    return view->count * view->stride / 256 <= view->range.size;
}

static nebel_result unpack(nb_gltf_data *data, size_t index)
{
    nb_gltf_view *view = &data->views[index];
    const nb_meshopt_view *packed = &view->packed;
    const unsigned char *bytes = NULL;
    if (!is_possible(packed) || !is_believable(packed))
        return nb_gltf_fail(data, "bufferViews", index, "has numbers that EXT_meshopt_compression does not allow");
    nebel_result result = nb_gltf_find_bytes(data, &packed->range, &bytes);
    if (result != NEBEL_OK) return result;
    unsigned char *made = nb_gltf_add_extra(data, packed->count * packed->stride, &view->unpacked);
    if (made == NULL) return nb_gltf_fail_memory(data);
    if (data->load->unpack(packed, bytes, made)) return NEBEL_OK;
    return nb_gltf_fail(data, "bufferViews", index, "does not decompress");
}

/* ---- numbers of vertices --------------------------------------------------------------------- */

static unsigned component_size(int type)
{
    switch (type) {
    case NB_GLTF_BYTE:
    case NB_GLTF_UNSIGNED_BYTE:
        return 1;
    case NB_GLTF_SHORT:
    case NB_GLTF_UNSIGNED_SHORT:
        return 2;
    case NB_GLTF_UNSIGNED_INT:
    case NB_GLTF_FLOAT:
        return 4;
    default:
        return 0;
    }
}

/* glTF 2.0, section 3.6.2.2: the lowest number of signed ones is cut off. */
static float normalize(int32_t value, int32_t most)
{
    const float fraction = (float)value / (float)most;
    return fraction < -1 ? -1 : fraction;
}

static float read_component(const unsigned char *bytes, int type, bool is_normalized)
{
    const uint16_t word =
        (uint16_t)(bytes[0] | (type == NB_GLTF_SHORT || type == NB_GLTF_UNSIGNED_SHORT ? (unsigned)bytes[1] << 8 : 0u));
    switch (type) {
    case NB_GLTF_BYTE:
        return is_normalized ? normalize((int8_t)bytes[0], INT8_MAX) : (float)(int8_t)bytes[0];
    case NB_GLTF_UNSIGNED_BYTE:
        return is_normalized ? normalize(bytes[0], UINT8_MAX) : (float)bytes[0];
    case NB_GLTF_SHORT:
        return is_normalized ? normalize((int16_t)word, INT16_MAX) : (float)(int16_t)word;
    case NB_GLTF_UNSIGNED_SHORT:
        return is_normalized ? normalize(word, UINT16_MAX) : (float)word;
    default:
        return (float)(word | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24);
    }
}

static bool takes_conversion(const nb_gltf_accessor *accessor)
{
    return accessor->is_attribute && accessor->type != NB_GLTF_FLOAT && accessor->width > 0 &&
           component_size(accessor->type) > 0 && accessor->count > 0;
}

/* The bytes of a view, compressed or not; their number in *size. */
static nebel_result find_view(nb_gltf_data *data, const nb_gltf_view *view, const unsigned char **bytes, uint64_t *size)
{
    *size = view->is_packed ? view->packed.count * view->packed.stride : view->range.size;
    if (!view->is_packed) return nb_gltf_find_bytes(data, &view->range, bytes);
    *bytes = data->extra.data + view->unpacked;
    return NEBEL_OK;
}

/* Numbers of an accessor one after the other. */
typedef struct number_range {
    int64_t view; /* or -1 */
    uint64_t offset, count;
    unsigned tight;  /* bytes of each */
    bool is_strided; /* where its view says so */
} number_range;

/* Where they begin and how far they are apart, within their view. */
static nebel_result find_numbers(nb_gltf_data *data, size_t index, const number_range *wanted,
                                 const unsigned char **bytes, uint64_t *stride)
{
    if (wanted->view < 0 || (uint64_t)wanted->view >= data->view_count)
        return nb_gltf_fail(data, "accessors", index, "has a view that does not exist");
    const nb_gltf_view *view = &data->views[wanted->view];
    uint64_t size = 0;
    const nebel_result result = find_view(data, view, bytes, &size);
    if (result != NEBEL_OK) return result;
    *stride = wanted->is_strided && view->stride > 0 ? view->stride : wanted->tight;
    if (*stride < wanted->tight || wanted->offset > size || size - wanted->offset < wanted->tight ||
        (wanted->count - 1) > (size - wanted->offset - wanted->tight) / *stride)
        return nb_gltf_fail(data, "accessors", index, "is longer than its view");
    *bytes += wanted->offset;
    return NEBEL_OK;
}

static void convert_one(const nb_gltf_accessor *accessor, const unsigned char *bytes, unsigned char *made)
{
    const unsigned size = component_size(accessor->type);
    for (unsigned k = 0; k < accessor->width; k++) {
        const float value = read_component(bytes + k * size, accessor->type, accessor->is_normalized);
        memcpy(made + k * sizeof value, &value, sizeof value);
    }
}

static number_range numbers_of(const nb_gltf_accessor *accessor)
{
    return (number_range){accessor->view, accessor->offset, accessor->count,
                          component_size(accessor->type) * accessor->width, true};
}

/* glTF 2.0, section 3.6.2.3: indices and values are tight. */
static number_range indices_of(const nb_gltf_accessor *accessor)
{
    const nb_gltf_sparse *sparse = &accessor->sparse;
    return (number_range){sparse->index_view, sparse->index_offset, sparse->count, component_size(sparse->index_type),
                          false};
}

static number_range values_of(const nb_gltf_accessor *accessor)
{
    const nb_gltf_sparse *sparse = &accessor->sparse;
    return (number_range){sparse->value_view, sparse->value_offset, sparse->count,
                          component_size(accessor->type) * accessor->width, false};
}

static nebel_result check_sparse(nb_gltf_data *data, size_t index)
{
    const nb_gltf_accessor *accessor = &data->accessors[index];
    const int type = accessor->sparse.index_type;
    const unsigned char *bytes;
    uint64_t stride;
    if (type != NB_GLTF_UNSIGNED_BYTE && type != NB_GLTF_UNSIGNED_SHORT && type != NB_GLTF_UNSIGNED_INT)
        return nb_gltf_fail(data, "accessors", index, "has sparse indices that are no whole numbers");
    if (accessor->sparse.count == 0 || accessor->sparse.count > accessor->count)
        return nb_gltf_fail(data, "accessors", index, "has more sparse numbers than numbers, or none");
    const number_range indices = indices_of(accessor), values = values_of(accessor);
    const nebel_result result = find_numbers(data, index, &indices, &bytes, &stride);
    return result == NEBEL_OK ? find_numbers(data, index, &values, &bytes, &stride) : result;
}

static uint32_t read_index(const unsigned char *bytes, unsigned size)
{
    uint32_t index = 0;
    for (unsigned i = 0; i < size; i++) index |= (uint32_t)bytes[i] << (8 * i);
    return index;
}

static nebel_result put_sparse(nb_gltf_data *data, size_t index, unsigned char *made)
{
    const nb_gltf_accessor *accessor = &data->accessors[index];
    const number_range indices = indices_of(accessor), values = values_of(accessor);
    const unsigned char *places = NULL, *bytes = NULL;
    uint64_t stride = 0;
    nebel_result result = find_numbers(data, index, &indices, &places, &stride);
    if (result == NEBEL_OK) result = find_numbers(data, index, &values, &bytes, &stride);
    for (uint64_t i = 0; i < accessor->sparse.count && result == NEBEL_OK; i++) {
        const uint32_t at = read_index(places + i * indices.tight, indices.tight);
        if (at >= accessor->count) return nb_gltf_fail(data, "accessors", index, "has a sparse index beyond its end");
        convert_one(accessor, bytes + i * values.tight, made + at * accessor->width * sizeof(float));
    }
    return result;
}

/* A model of zeros takes no bytes: what it announces is believed up to as many. */
static const uint64_t most_zeros = (uint64_t)1 << 26;

static nebel_result convert(nb_gltf_data *data, size_t index, uint64_t *offset)
{
    const nb_gltf_accessor *accessor = &data->accessors[index];
    const bool has_base = accessor->view >= 0 || !accessor->is_sparse;
    const number_range base = numbers_of(accessor);
    const uint64_t size = accessor->width * sizeof(float);
    const unsigned char *bytes = NULL;
    uint64_t stride = 0;
    nebel_result result = has_base ? find_numbers(data, index, &base, &bytes, &stride) : NEBEL_OK;
    if (result == NEBEL_OK && !has_base && accessor->count > most_zeros)
        result = nb_gltf_fail(data, "accessors", index, "has too many numbers");
    if (result == NEBEL_OK && accessor->is_sparse) result = check_sparse(data, index);
    if (result != NEBEL_OK) return result;
    unsigned char *made = nb_gltf_add_extra(data, accessor->count * size, offset);
    if (made == NULL) return nb_gltf_fail_memory(data);
    memset(made, 0, (size_t)(accessor->count * size));
    if (has_base) result = find_numbers(data, index, &base, &bytes, &stride); /* the extra file may have moved */
    for (uint64_t i = 0; i < accessor->count && has_base && result == NEBEL_OK; i++)
        convert_one(accessor, bytes + i * stride, made + i * size);
    return result == NEBEL_OK && accessor->is_sparse ? put_sparse(data, index, made) : result;
}

/* ---- the new text ---------------------------------------------------------------------------- */

typedef struct change {
    nb_gltf_span span; /* is replaced; an empty one is a place */
    char *text;
} change;

typedef struct text_changes {
    change *items;
    size_t count, capacity;
    nb_arena *arena;
    const nebel_allocator *allocator;
} text_changes;

static bool replace(text_changes *list, nb_gltf_span span, const char *text)
{
    void *items = list->items;
    char *copy = nb_arena_copy_text(list->arena, text, strlen(text));
    const bool room =
        nb_grow(list->allocator, &items, sizeof *list->items, list->count, &list->capacity, list->count + 1);
    list->items = items;
    if (copy == NULL || !room) return false;
    list->items[list->count++] = (change){span, copy};
    return true;
}

static int compare(const void *a, const void *b)
{
    const change *x = a, *y = b;
    return (x->span.begin > y->span.begin) - (x->span.begin < y->span.begin);
}

/* Everything between the changes stays. */
static nebel_result write_text(const nb_gltf_data *data, text_changes *list, nb_bytes *text)
{
    size_t size = data->text.size, at = 0;
    for (size_t i = 0; i < list->count; i++) size += strlen(list->items[i].text);
    *text = (nb_bytes){.data = nb_allocate(list->allocator, size, 1), .capacity = size};
    if (text->data == NULL) return nb_gltf_fail_memory(data);
    qsort(list->items, list->count, sizeof *list->items, compare);
    for (size_t i = 0; i < list->count; i++) {
        const change *next = &list->items[i];
        const size_t length = strlen(next->text);
        memcpy(text->data + text->size, data->text.data + at, next->span.begin - at);
        text->size += next->span.begin - at;
        memcpy(text->data + text->size, next->text, length);
        text->size += length;
        at = next->span.end;
    }
    memcpy(text->data + text->size, data->text.data + at, data->text.size - at);
    text->size += data->text.size - at;
    return NEBEL_OK;
}

/* Behind an object, or all of it. */
static nb_gltf_span behind(const nb_gltf_span *span)
{
    return (nb_gltf_span){span->end, span->end};
}

static bool change_views(const nb_gltf_data *data, text_changes *list)
{
    char text[OBJECT_SIZE], stride[64] = "";
    bool good = true;
    for (size_t i = 0; i < data->view_count && good; i++) {
        const nb_gltf_view *view = &data->views[i];
        if (!view->is_packed) continue;
        stride[0] = '\0';
        if (view->stride > 0) snprintf(stride, sizeof stride, ",\"byteStride\":%llu", (unsigned long long)view->stride);
        snprintf(text, sizeof text, "{\"buffer\":%zu,\"byteOffset\":%llu,\"byteLength\":%llu%s}", data->buffer_count,
                 (unsigned long long)view->unpacked, (unsigned long long)(view->packed.count * view->packed.stride),
                 stride);
        good = replace(list, view->span, text);
    }
    return good;
}

/* Buffers that are in no file: that of the chunk gets a name, and those that stand for compressed data alone are not
 * looked for. */
static bool change_buffers(const nb_gltf_data *data, text_changes *list)
{
    char text[OBJECT_SIZE];
    bool good = true;
    for (size_t i = 0; i < data->buffer_count && good; i++) {
        const nb_gltf_buffer *buffer = &data->buffers[i];
        const bool is_chunk = i == 0 && buffer->uri == NULL && data->has_chunk;
        if (buffer->uri != NULL && !buffer->is_fallback) continue;
        snprintf(text, sizeof text, "{\"byteLength\":%llu,\"uri\":\"%s\"}",
                 is_chunk ? (unsigned long long)data->chunk.size : 1ULL, is_chunk ? CHUNK_NAME : EXTRA_NAME);
        good = replace(list, buffer->span, text);
    }
    return good;
}

static nebel_result change_accessors(nb_gltf_data *data, text_changes *list)
{
    char text[OBJECT_SIZE];
    size_t made = 0;
    for (size_t i = 0; i < data->accessor_count; i++) {
        const nb_gltf_accessor *accessor = &data->accessors[i];
        uint64_t offset = 0;
        if (!takes_conversion(accessor)) continue;
        if (accessor->view < 0 && !accessor->is_sparse) {
            /* Zeros, or in the hands of Assimp's decoder of Draco, which makes floats where they are wanted. */
            snprintf(text, sizeof text, "{\"componentType\":%d,\"count\":%llu,\"type\":\"%s\"}", NB_GLTF_FLOAT,
                     (unsigned long long)accessor->count, accessor->type_name);
            if (!replace(list, accessor->span, text)) return nb_gltf_fail_memory(data);
            continue;
        }
        const nebel_result result = convert(data, i, &offset);
        if (result != NEBEL_OK) return result;
        snprintf(text, sizeof text, "{\"bufferView\":%zu,\"componentType\":%d,\"count\":%llu,\"type\":\"%s\"}",
                 data->view_count + made++, NB_GLTF_FLOAT, (unsigned long long)accessor->count, accessor->type_name);
        if (!replace(list, accessor->span, text)) return nb_gltf_fail_memory(data);
        snprintf(text, sizeof text, ",{\"buffer\":%zu,\"byteOffset\":%llu,\"byteLength\":%llu}", data->buffer_count,
                 (unsigned long long)offset, (unsigned long long)(accessor->count * accessor->width * sizeof(float)));
        if (!replace(list, behind(&data->views[data->view_count - 1].span), text)) return nb_gltf_fail_memory(data);
    }
    return NEBEL_OK;
}

static nebel_result make(nb_gltf_data *data, text_changes *list, nb_gltf_files *made)
{
    char text[OBJECT_SIZE];
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < data->view_count && result == NEBEL_OK; i++)
        if (data->views[i].is_packed) result = unpack(data, i);
    if (result == NEBEL_OK) result = change_accessors(data, list);
    if (result != NEBEL_OK) return result;
    snprintf(text, sizeof text, ",{\"byteLength\":%zu,\"uri\":\"" EXTRA_NAME "\"}", data->extra.size);
    if (!change_views(data, list) || !change_buffers(data, list) ||
        !replace(list, behind(&data->buffers[data->buffer_count - 1].span), text))
        return nb_gltf_fail_memory(data);
    made->files[NB_GLTF_TEXT].name = TEXT_NAME;
    made->files[NB_GLTF_CHUNK] = (nb_gltf_file){CHUNK_NAME, data->chunk};
    made->files[NB_GLTF_EXTRA] = (nb_gltf_file){EXTRA_NAME, data->extra};
    data->chunk = data->extra = (nb_bytes){0};
    return write_text(data, list, &made->files[NB_GLTF_TEXT].bytes);
}

/* ---- the file -------------------------------------------------------------------------------- */

/* The second chunk of a .glb file (glTF 2.0, section 4.4); nothing where there is none. */
static nebel_result read_binary_chunk(nb_gltf_data *data)
{
    unsigned char head[NB_GLB_CHUNK_HEADER];
    const size_t begin = NB_GLB_HEADER + NB_GLB_CHUNK_HEADER + data->text.size;
    const char *file = data->load->source->file;
    const int opened = nb_model_files_open(data->files, data->files->name);
    if (opened < 0) return nb_model_fail(data->load, NEBEL_ERROR_FILE, "cannot read the model \"%s\"", file);
    nebel_result result = NEBEL_OK;
    if (pread(opened, head, sizeof head, (off_t)begin) == NB_GLB_CHUNK_HEADER && memcmp(head + 4, "BIN", 4) == 0) {
        lseek(opened, (off_t)(begin + NB_GLB_CHUNK_HEADER), SEEK_SET);
        result = nb_file_read_open(&data->load->allocator, &data->load->log, NULL, "model", file, opened,
                                   SIZE_MAX >> 30, &data->chunk);
        data->has_chunk = result == NEBEL_OK;
        const size_t size = (size_t)head[0] | (size_t)head[1] << 8 | (size_t)head[2] << 16 | (size_t)head[3] << 24;
        if (data->chunk.size > size) data->chunk.size = size;
    }
    close(opened);
    return result;
}

static bool is_glb(const char *file)
{
    const char *dot = strrchr(nb_path_name(file), '.');
    return dot != NULL && strcasecmp(dot, ".glb") == 0;
}

static bool takes_making(const nb_gltf_data *data)
{
    bool found = false;
    for (size_t i = 0; i < data->view_count; i++) found = found || data->views[i].is_packed;
    for (size_t i = 0; i < data->accessor_count; i++) found = found || takes_conversion(&data->accessors[i]);
    return found && data->view_count > 0 && data->buffer_count > 0;
}

static nebel_result prepare_gltf(nb_gltf_data *data, nb_gltf_files *made)
{
    text_changes list = {.arena = &data->arena, .allocator = &data->load->allocator};
    nebel_result result = nb_gltf_read_data(data);
    memcpy(made->fault, data->fault, sizeof made->fault);
    if (result == NEBEL_ERROR_FORMAT && data->fault[0] != '\0') return NEBEL_OK;
    if (result != NEBEL_OK || !takes_making(data)) return result;
    if (is_glb(data->files->name)) result = read_binary_chunk(data);
    if (result == NEBEL_OK) result = make(data, &list, made);
    nb_release(list.allocator, list.items);
    return result;
}

/* What is no JSON at all is for Assimp to refuse. */
static bool begins_object(const nb_bytes *text)
{
    size_t at = 0;
    while (at < text->size && strchr(" \t\r\n", text->data[at]) != NULL && text->data[at] != '\0') at++;
    return at < text->size && text->data[at] == '{';
}

nebel_result nb_gltf_prepare_text(const nb_model_load *load, nb_model_files *files, nb_bytes *text, nb_gltf_files *made)
{
    nb_gltf_data data = {.load = load, .files = files, .arena = {.allocator = load->allocator}, .text = *text};
    const nebel_result result = begins_object(text) ? prepare_gltf(&data, made) : NEBEL_OK;
    *text = (nb_bytes){0};
    nb_gltf_release_data(&data);
    return result;
}

nebel_result nb_gltf_prepare(const nb_model_load *load, nb_model_files *files, nb_gltf_files *made)
{
    nb_bytes text;
    *made = (nb_gltf_files){0};
    if (nb_gltf_read_text(&load->allocator, load->source->file, &text) != NEBEL_OK)
        return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    return nb_gltf_prepare_text(load, files, &text, made);
}

void nb_gltf_release_files(const nebel_allocator *allocator, nb_gltf_files *made)
{
    for (int i = 0; i < NB_GLTF_FILE_COUNT; i++) nb_release(allocator, made->files[i].bytes.data);
    *made = (nb_gltf_files){.fault = ""};
}
