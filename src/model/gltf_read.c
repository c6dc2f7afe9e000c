/* What the JSON of a glTF file says of its data, and what it requires of who reads it. */
#include "gltf.h"
#include "gltf_data.h"

#include <stdio.h>
#include <string.h>

#define MESHOPT "EXT_meshopt_compression"
#define DRACO "KHR_draco_mesh_compression"

/* Extensions that are decoded, or that change nothing of what is kept: triangles, base color and its texture. */
static const char *const known_extensions[] = {"KHR_mesh_quantization",
                                               DRACO,
                                               "KHR_texture_transform",
                                               "KHR_lights_punctual",
                                               "KHR_materials_anisotropy",
                                               "KHR_materials_clearcoat",
                                               "KHR_materials_diffuse_transmission",
                                               "KHR_materials_dispersion",
                                               "KHR_materials_emissive_strength",
                                               "KHR_materials_ior",
                                               "KHR_materials_iridescence",
                                               "KHR_materials_pbrSpecularGlossiness",
                                               "KHR_materials_sheen",
                                               "KHR_materials_specular",
                                               "KHR_materials_transmission",
                                               "KHR_materials_unlit",
                                               "KHR_materials_variants",
                                               "KHR_materials_volume",
                                               "KHR_xmp_json_ld"};

/* ---- members --------------------------------------------------------------------------------- */

static const nb_json_node *find(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = object != NULL && object->type == NB_JSON_OBJECT ? nb_json_first(json, object) : NULL;
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

static bool is_text(const nb_json_node *node, const char *text)
{
    const size_t size = strlen(text);
    return node != NULL && node->type == NB_JSON_STRING && node->string_size == size &&
           memcmp(node->string, text, size) == 0;
}

/* A whole number from 0 on; `fallback` where there is none, or no such one. */
static int64_t find_whole(const nb_json *json, const nb_json_node *object, const char *key, int64_t fallback)
{
    static const double most = 9007199254740992.0;
    const nb_json_node *node = find(json, object, key);
    if (node == NULL || node->type != NB_JSON_NUMBER || !(node->number >= 0 && node->number <= most)) return fallback;
    const int64_t whole = (int64_t)node->number;
    return (double)whole == node->number ? whole : fallback;
}

/* Whether it is a whole number from 0 on, or not there. */
static bool is_whole(const nb_json *json, const nb_json_node *object, const char *key)
{
    return find(json, object, key) == NULL || find_whole(json, object, key, -1) >= 0;
}

static int find_choice(const nb_json *json, const nb_json_node *object, const char *key, const char *const *names,
                       int count)
{
    const nb_json_node *node = find(json, object, key);
    for (int i = 0; i < count; i++)
        if (is_text(node, names[i])) return i;
    return node == NULL ? 0 : -1;
}

static bool is_true(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = find(json, object, key);
    return node != NULL && node->type == NB_JSON_BOOLEAN && node->number != 0;
}

static nb_gltf_span span_of(const nb_json_node *node)
{
    return (nb_gltf_span){node->offset, node->end};
}

static nb_gltf_range find_range(const nb_json *json, const nb_json_node *object)
{
    return (nb_gltf_range){.buffer = find_whole(json, object, "buffer", -1),
                           .offset = (uint64_t)find_whole(json, object, "byteOffset", 0),
                           .size = (uint64_t)find_whole(json, object, "byteLength", 0)};
}

/* One more of an array; NULL when memory is out. */
static void *add_element(nb_gltf_data *data, void **array, size_t size, size_t *count, size_t *capacity)
{
    if (!nb_grow(&data->load->allocator, array, size, *count, capacity, *count + 1)) return NULL;
    void *fresh = (char *)*array + size * *count;
    memset(fresh, 0, size);
    ++*count;
    return fresh;
}

/* ---- what the file requires ------------------------------------------------------------------ */

static bool is_known(const nb_gltf_data *data, const nb_json_node *name)
{
    for (size_t i = 0; i < sizeof known_extensions / sizeof *known_extensions; i++)
        if (is_text(name, known_extensions[i])) return true;
    return is_text(name, MESHOPT) && data->load->unpack != NULL;
}

static bool take_required(nb_json *json, const nb_json_node *list, nb_gltf_data *data)
{
    for (const nb_json_node *node = nb_json_first(json, list); node != NULL; node = nb_json_next(json, node)) {
        data->requires_meshopt = data->requires_meshopt || is_text(node, MESHOPT);
        data->requires_draco = data->requires_draco || is_text(node, DRACO);
        if (node->type != NB_JSON_STRING || is_known(data, node)) continue;
        const int size = node->string_size < 80 ? (int)node->string_size : 80;
        /* The library itself is linked with no decoder. */
        const bool is_here = is_text(node, MESHOPT) && data->load->sink == NULL;
        nb_model_fail(data->load, NEBEL_ERROR_UNSUPPORTED,
                      "the model \"%s\" requires the glTF extension \"%.*s\", which %s; export it without%s",
                      data->load->source->file, size, node->string,
                      is_here ? "is not decoded where models are read in process" : "is not supported",
                      is_here ? ", or have nebel-read-model read it" : "");
        return nb_json_stop(json, NEBEL_ERROR_UNSUPPORTED);
    }
    return true;
}

/* Assimp decodes Draco where the file says that it is used, and takes what is there else. */
static bool take_used(nb_json *json, const nb_json_node *list, nb_gltf_data *data)
{
    for (const nb_json_node *node = nb_json_first(json, list); node != NULL; node = nb_json_next(json, node))
        data->uses_draco = data->uses_draco || is_text(node, DRACO);
    return true;
}

/* ---- data ------------------------------------------------------------------------------------ */

static bool take_buffer(nb_json *json, const nb_json_node *node, nb_gltf_data *data)
{
    const char *text = (const char *)data->text.data;
    void *buffers = data->buffers;
    nb_gltf_buffer *buffer = add_element(data, &buffers, sizeof *buffer, &data->buffer_count, &data->buffer_capacity);
    data->buffers = buffers;
    if (buffer == NULL) return nb_json_fail_memory(json, node);
    buffer->span = span_of(node);
    buffer->size = (uint64_t)find_whole(json, node, "byteLength", 0);
    buffer->is_fallback = is_true(json, find(json, find(json, node, "extensions"), MESHOPT), "fallback");
    const nb_json_node *uri = find(json, node, "uri");
    if (uri == NULL || uri->type != NB_JSON_STRING) return true;
    buffer->uri = uri->string;
    buffer->uri_size = uri->string_size;
    if (uri->string >= text && uri->string < text + data->text.size) return true;
    buffer->uri = nb_arena_copy_text(&data->arena, uri->string, uri->string_size);
    return buffer->uri != NULL || nb_json_fail_memory(json, node);
}

static bool take_packed(nb_json *json, const nb_json_node *node, const nb_gltf_data *data, nb_gltf_view *view)
{
    static const char *const modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
    static const char *const filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
    const int mode = find_choice(json, node, "mode", modes, 3), filter = find_choice(json, node, "filter", filters, 4);
    if (mode < 0 || filter < 0)
        return nb_json_stop(json, nb_gltf_fail(data, "bufferViews", data->view_count - 1,
                                               "has a mode or a filter that " MESHOPT " does not know"));
    view->is_packed = true;
    view->packed = (nb_meshopt_view){.range = find_range(json, node),
                                     .stride = (uint64_t)find_whole(json, node, "byteStride", 0),
                                     .count = (uint64_t)find_whole(json, node, "count", 0),
                                     .mode = (nb_meshopt_mode)mode,
                                     .filter = (nb_meshopt_filter)filter};
    return true;
}

/* What glTF 2.0 allows; `byteStride` of what is packed may be less. */
static bool is_stride(uint64_t stride)
{
    return stride >= 4 && stride <= 252 && stride % 4 == 0;
}

static bool take_view(nb_json *json, const nb_json_node *node, nb_gltf_data *data)
{
    void *views = data->views;
    nb_gltf_view *view = add_element(data, &views, sizeof *view, &data->view_count, &data->view_capacity);
    data->views = views;
    if (view == NULL) return nb_json_fail_memory(json, node);
    view->span = span_of(node);
    view->range = find_range(json, node);
    view->stride = (uint64_t)find_whole(json, node, "byteStride", 0);
    if (!is_whole(json, node, "byteOffset") || !is_whole(json, node, "byteLength"))
        return nb_json_stop(json, nb_gltf_fail(data, "bufferViews", data->view_count - 1,
                                               "has an offset or a length that is no whole number from 0 on"));
    if (!is_whole(json, node, "byteStride") || (view->stride != 0 && !is_stride(view->stride)))
        return nb_json_stop(json, nb_gltf_fail(data, "bufferViews", data->view_count - 1,
                                               "has a byteStride that is no multiple of 4 from 4 to 252"));
    const nb_json_node *packed = find(json, find(json, node, "extensions"), MESHOPT);
    return packed == NULL || data->load->unpack == NULL || take_packed(json, packed, data, view);
}

static void take_sparse(const nb_json *json, const nb_json_node *node, nb_gltf_sparse *sparse)
{
    const nb_json_node *indices = find(json, node, "indices"), *values = find(json, node, "values");
    *sparse = (nb_gltf_sparse){.count = (uint64_t)find_whole(json, node, "count", 0),
                               .index_view = find_whole(json, indices, "bufferView", -1),
                               .index_offset = (uint64_t)find_whole(json, indices, "byteOffset", 0),
                               .index_type = (int)find_whole(json, indices, "componentType", 0),
                               .value_view = find_whole(json, values, "bufferView", -1),
                               .value_offset = (uint64_t)find_whole(json, values, "byteOffset", 0)};
}

static bool take_accessor(nb_json *json, const nb_json_node *node, nb_gltf_data *data)
{
    static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
    static const unsigned widths[] = {1, 2, 3, 4, 0, 0, 0}; /* matrices are no numbers of vertices */
    void *accessors = data->accessors;
    nb_gltf_accessor *accessor =
        add_element(data, &accessors, sizeof *accessor, &data->accessor_count, &data->accessor_capacity);
    data->accessors = accessors;
    if (accessor == NULL) return nb_json_fail_memory(json, node);
    accessor->span = span_of(node);
    if (!is_whole(json, node, "byteOffset") || !is_whole(json, node, "count"))
        return nb_json_stop(json, nb_gltf_fail(data, "accessors", data->accessor_count - 1,
                                               "has a byteOffset or a count that is no whole number from 0 on"));
    accessor->view = find_whole(json, node, "bufferView", -1);
    accessor->offset = (uint64_t)find_whole(json, node, "byteOffset", 0);
    accessor->count = (uint64_t)find_whole(json, node, "count", 0);
    accessor->type = (int)find_whole(json, node, "componentType", 0);
    accessor->is_normalized = is_true(json, node, "normalized");
    const nb_json_node *sparse = find(json, node, "sparse");
    accessor->is_sparse = sparse != NULL;
    if (sparse != NULL) take_sparse(json, sparse, &accessor->sparse);
    const int name = find_choice(json, node, "type", names, 7);
    if (name < 0) return true;
    accessor->width = widths[name];
    memcpy(accessor->type_name, names[name], strlen(names[name]) + 1);
    return true;
}

/* ---- meshes ---------------------------------------------------------------------------------- */

static bool takes_floats(const nb_json_node *attribute)
{
    static const char texture[] = "TEXCOORD_";
    return nb_json_has_key(attribute, "POSITION") || nb_json_has_key(attribute, "NORMAL") ||
           nb_json_has_key(attribute, "TANGENT") ||
           (attribute->key_size > sizeof texture - 1 && memcmp(attribute->key, texture, sizeof texture - 1) == 0);
}

static bool take_attributes(nb_json *json, const nb_json_node *attributes, nb_gltf_data *data)
{
    const nb_json_node *node =
        attributes != NULL && attributes->type == NB_JSON_OBJECT ? nb_json_first(json, attributes) : NULL;
    for (; node != NULL; node = nb_json_next(json, node)) {
        if (!takes_floats(node) || node->type != NB_JSON_NUMBER || !(node->number >= 0 && node->number < UINT32_MAX))
            continue;
        void *list = data->attributes;
        uint32_t *number = add_element(data, &list, sizeof *number, &data->attribute_count, &data->attribute_capacity);
        data->attributes = list;
        if (number == NULL) return nb_json_fail_memory(json, node);
        *number = (uint32_t)node->number;
    }
    return true;
}

static bool take_gltf_mesh(nb_json *json, const nb_json_node *mesh, nb_gltf_data *data)
{
    const nb_json_node *list = find(json, mesh, "primitives");
    const nb_json_node *node = list != NULL && list->type == NB_JSON_ARRAY ? nb_json_first(json, list) : NULL;
    for (; node != NULL; node = nb_json_next(json, node)) {
        const nb_json_node *targets = find(json, node, "targets");
        if (!take_attributes(json, find(json, node, "attributes"), data)) return false;
        const nb_json_node *target =
            targets != NULL && targets->type == NB_JSON_ARRAY ? nb_json_first(json, targets) : NULL;
        for (; target != NULL; target = nb_json_next(json, target))
            if (!take_attributes(json, target, data)) return false;
    }
    return true;
}

/* Matrices are optional in glTF 2.0, but Assimp takes them for granted. */
static bool take_skin(nb_json *json, const nb_json_node *skin, nb_gltf_data *data)
{
    data->skin_count++;
    if (find(json, skin, "inverseBindMatrices") != NULL) return true;
    return nb_json_stop(json,
                        nb_gltf_fail(data, "skins", data->skin_count - 1,
                                     "has no inverseBindMatrices, which glTF may leave out but its reader needs"));
}

/* ---- the text -------------------------------------------------------------------------------- */

static const char *const streamed_names[] = {"buffers", "bufferViews", "accessors", "meshes",
                                             "nodes",   "images",      "skins",     NULL};

static bool take_gltf_value(nb_json *json, const nb_json_node *value, void *user)
{
    nb_gltf_data *data = user;
    const nb_json_node *parent = nb_json_parent(json, value);
    if (parent == NULL) return true;
    if (nb_json_parent(json, parent) == NULL && value->type != NB_JSON_ARRAY) return true;
    if (nb_json_parent(json, parent) == NULL && nb_json_has_key(value, "extensionsUsed"))
        return take_used(json, value, data);
    if (nb_json_parent(json, parent) == NULL)
        return !nb_json_has_key(value, "extensionsRequired") || take_required(json, value, data);
    if (parent->type != NB_JSON_ARRAY) return true;
    if (nb_json_has_key(parent, "buffers")) return take_buffer(json, value, data);
    if (nb_json_has_key(parent, "bufferViews")) return take_view(json, value, data);
    if (nb_json_has_key(parent, "accessors")) return take_accessor(json, value, data);
    if (nb_json_has_key(parent, "skins")) return take_skin(json, value, data);
    return !nb_json_has_key(parent, "meshes") || take_gltf_mesh(json, value, data);
}

static void keep_fault(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    nb_gltf_data *data = user;
    (void)level;
    if (result == NEBEL_ERROR_FORMAT)
        snprintf(data->fault, sizeof data->fault, "%s", message);
    else
        nb_model_fail(data->load, result, "the model \"%s\" cannot be read: %s", data->load->source->file, message);
}

nebel_result nb_gltf_read_data(nb_gltf_data *data)
{
    nb_json json;
    const nb_json_desc desc = {.text = (const char *)data->text.data,
                               .size = data->text.size,
                               .name = data->load->source->file,
                               .allocator = data->load->allocator,
                               .log = {keep_fault, data},
                               .streamed = streamed_names,
                               .take = take_gltf_value,
                               .user = data};
    const nebel_result result = nb_json_read(&json, &desc);
    if (result != NEBEL_OK) return result;
    if (data->requires_draco && !data->uses_draco)
        return nb_model_fail(data->load, NEBEL_ERROR_FORMAT,
                             "the model \"%s\" requires \"" DRACO
                             "\", but does not name it in \"extensionsUsed\"; export "
                             "it again",
                             data->load->source->file);
    bool is_packed = false;
    for (size_t i = 0; i < data->view_count; i++) is_packed = is_packed || data->views[i].is_packed;
    if (data->requires_meshopt && !is_packed)
        nb_model_note(data->load, "\"%s\" requires \"" MESHOPT "\", but nothing in it is compressed",
                      data->load->source->file);
    for (size_t i = 0; i < data->attribute_count; i++)
        if (data->attributes[i] < data->accessor_count) data->accessors[data->attributes[i]].is_attribute = true;
    return NEBEL_OK;
}

void nb_gltf_release_data(nb_gltf_data *data)
{
    const nebel_allocator *allocator = &data->load->allocator;
    for (size_t i = 0; i < data->buffer_count; i++) nb_release(allocator, data->buffers[i].bytes.data);
    nb_release(allocator, data->buffers);
    nb_release(allocator, data->views);
    nb_release(allocator, data->accessors);
    nb_release(allocator, data->attributes);
    nb_release(allocator, data->text.data);
    nb_release(allocator, data->chunk.data);
    nb_release(allocator, data->extra.data);
    nb_arena_release(&data->arena);
}
