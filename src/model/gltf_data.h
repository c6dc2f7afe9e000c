/* The data of a glTF file: buffers, views of them, accessors; as the JSON describes them, and as bytes. */
#ifndef NB_MODEL_GLTF_DATA_H
#define NB_MODEL_GLTF_DATA_H

#include "gltf_prepare.h"
#include "json/json.h"

/* glTF 2.0, section 3.6.2.2. */
enum {
    NB_GLTF_BYTE = 5120,
    NB_GLTF_UNSIGNED_BYTE = 5121,
    NB_GLTF_SHORT = 5122,
    NB_GLTF_UNSIGNED_SHORT = 5123,
    NB_GLTF_UNSIGNED_INT = 5125,
    NB_GLTF_FLOAT = 5126
};

/* Where in the text an object stands. */
typedef struct nb_gltf_span {
    size_t begin, end;
} nb_gltf_span;

typedef struct nb_gltf_range {
    int64_t buffer; /* or -1 */
    uint64_t offset, size;
} nb_gltf_range;

/* EXT_meshopt_compression. */
typedef enum nb_meshopt_mode { NB_MESHOPT_ATTRIBUTES, NB_MESHOPT_TRIANGLES, NB_MESHOPT_INDICES } nb_meshopt_mode;
typedef enum nb_meshopt_filter {
    NB_MESHOPT_NONE,
    NB_MESHOPT_OCTAHEDRAL,
    NB_MESHOPT_QUATERNION,
    NB_MESHOPT_EXPONENTIAL
} nb_meshopt_filter;

typedef struct nb_meshopt_view {
    nb_gltf_range range;
    uint64_t stride, count;
    nb_meshopt_mode mode;
    nb_meshopt_filter filter;
} nb_meshopt_view;

typedef struct nb_gltf_view {
    nb_gltf_span span;
    nb_gltf_range range;
    uint64_t stride; /* 0: packed */
    bool is_packed;  /* compressed; read from its place in the extra file once that is known */
    nb_meshopt_view packed;
    uint64_t unpacked; /* its offset in the extra file */
} nb_gltf_view;

/* Numbers that stand in place of some. */
typedef struct nb_gltf_sparse {
    uint64_t count;
    int64_t index_view, value_view; /* or -1 */
    uint64_t index_offset, value_offset;
    int index_type;
} nb_gltf_sparse;

typedef struct nb_gltf_accessor {
    nb_gltf_span span;
    int64_t view; /* or -1 */
    uint64_t offset, count;
    int type; /* of a component */
    unsigned width;
    bool is_normalized, is_sparse, is_attribute;
    char type_name[8];
    nb_gltf_sparse sparse;
} nb_gltf_accessor;

typedef struct nb_gltf_buffer {
    nb_gltf_span span;
    const char *uri; /* NULL: the chunk of a .glb file */
    size_t uri_size;
    uint64_t size;
    bool is_fallback, is_loaded;
    nb_bytes bytes;
} nb_gltf_buffer;

typedef struct nb_gltf_data {
    const nb_model_load *load;
    nb_model_files *files;
    nb_arena arena;
    nb_bytes text, chunk;
    bool has_chunk;
    bool requires_meshopt, requires_draco, uses_draco;
    char fault[512]; /* of the text, where it is no good JSON */
    nb_gltf_view *views;
    nb_gltf_accessor *accessors;
    nb_gltf_buffer *buffers;
    size_t view_count, accessor_count, buffer_count, skin_count;
    size_t view_capacity, accessor_capacity, buffer_capacity;
    uint32_t *attributes; /* accessors that primitives name */
    size_t attribute_count, attribute_capacity;
    nb_bytes extra; /* what was made of the data */
} nb_gltf_data;

/* Reads what the text says. `data` has load, files, text and chunk. Errors: MEMORY, UNSUPPORTED; FORMAT, which is not
 * logged but in data->fault where the text is at fault. */
nebel_result nb_gltf_read_data(nb_gltf_data *data);
void nb_gltf_release_data(nb_gltf_data *data);

/* The bytes of a range of a buffer, which is loaded where it is not yet. Errors: FILE, FORMAT, LIMIT, MEMORY. */
nebel_result nb_gltf_find_bytes(nb_gltf_data *data, const nb_gltf_range *range, const unsigned char **bytes);

/* Room in the extra file, on a multiple of four, and where it is. NULL when memory is out. */
unsigned char *nb_gltf_add_extra(nb_gltf_data *data, uint64_t size, uint64_t *offset);

/* FORMAT, with the model's name. */
nebel_result nb_gltf_fail(const nb_gltf_data *data, const char *what, size_t index, const char *problem);

/* MEMORY. */
nebel_result nb_gltf_fail_memory(const nb_gltf_data *data);

#endif
