/* Fog that a model brings: nodes of a glTF file whose extras describe a volume. The file is read twice, first for where
 * its nodes are, then for their fog, so that messages know the line. */
#include "model/gltf.h"

#include "scene_data.h"
#include "model/model.h"

#include <stdio.h>
#include <string.h>

/* Names of nodes are cut here. */
enum { NAME_SHOWN = 60 };

typedef struct nodes_reader {
    nb_scene_reader *in;
    nb_model_source *model;
    nb_affine place; /* of the model */
    nb_gltf_tree tree;
    char name[NAME_SHOWN + 1]; /* of the node in work, "" outside of all */
} nodes_reader;

/* ---- messages -------------------------------------------------------------------------------- */

static void pass_on(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    const nodes_reader *nodes = user;
    const nebel_log *log = &nodes->in->scene->log;
    if (nodes->name[0] != '\0')
        nb_log_message(log, level, result, "%s: node \"%s\": %s", nodes->model->where, nodes->name, message);
    else
        nb_log_message(log, level, result, "%s: %s", nodes->model->where, message);
}

static const nb_json_node *find_member(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = object->type == NB_JSON_OBJECT ? nb_json_first(json, object) : NULL;
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

/* The node's name, or its number. Of a long name the beginning, in whole characters. */
static void set_name(nodes_reader *nodes, const nb_json *json, const nb_json_node *node)
{
    const nb_json_node *name = find_member(json, node, "name");
    if (name == NULL || name->type != NB_JSON_STRING || name->string_size == 0) {
        snprintf(nodes->name, sizeof nodes->name, "%lu", (unsigned long)node->index);
        return;
    }
    size_t size = name->string_size < NAME_SHOWN ? name->string_size : NAME_SHOWN;
    while (size > 0 && size < name->string_size && (name->string[size] & 0xC0) == 0x80) size--;
    memcpy(nodes->name, name->string, size);
    nodes->name[size] = '\0';
    for (char *at = nodes->name; at < nodes->name + size; at++)
        if ((unsigned char)*at < 0x20 || *at == 0x7F) *at = '?';
}

/* ---- one node -------------------------------------------------------------------------------- */

static bool begins_with(const nb_json_node *node, const char *prefix)
{
    const size_t size = strlen(prefix);
    return node->key_size >= size && memcmp(node->key, prefix, size) == 0;
}

/* The first of the extras that begins with nebel_; NULL: none. */
static const nb_json_node *find_flat(const nb_json *json, const nb_json_node *extras)
{
    const nb_json_node *node = extras->type == NB_JSON_OBJECT ? nb_json_first(json, extras) : NULL;
    while (node != NULL && !begins_with(node, NB_NODE_PREFIX)) node = nb_json_next(json, node);
    return node;
}

/* What the JSON in a text says: the reader of the scene reads it in place of the file it is in. */
static bool take_text(nb_json *json, const nb_json_node *value, void *user)
{
    nb_scene_reader *in = user;
    nb_json *outer = in->json;
    if (nb_json_parent(json, value) == NULL) return true;
    in->json = json;
    const bool good = nb_keys_read_volume(in, value);
    in->json = outer;
    return good;
}

/* The text of a custom property, as the member of an object, which is what nb_json reads. */
static bool read_text(nodes_reader *nodes, nb_json *json, const nb_json_node *text)
{
    static const char before[] = "{\"nebel\":", after[] = "}";
    static const char *const streamed[] = {NULL};
    const size_t lead = sizeof before - 1, size = lead + text->string_size + 1;
    char *whole = nb_allocate(&json->desc.allocator, size + 1, 1);
    if (whole == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, text, "out of memory");
    snprintf(whole, size + 1, "%s%.*s%s", before, (int)text->string_size, text->string, after);
    nb_json inner;
    const nb_json_desc desc = {.text = whole,
                               .size = size,
                               .lead = lead,
                               .name = "extras",
                               .allocator = json->desc.allocator,
                               .log = {pass_on, nodes},
                               .streamed = streamed,
                               .take = take_text,
                               .user = nodes->in};
    const nebel_result result = nb_json_read(&inner, &desc);
    nb_release(&json->desc.allocator, whole);
    return result == NEBEL_OK || nb_json_stop(json, result);
}

static bool read_fog_node(nodes_reader *nodes, nb_json *json, const nb_json_node *extras, size_t number)
{
    const nb_json_node *whole = find_member(json, extras, "nebel"), *flat = find_flat(json, extras);
    nb_fog_node node = {.name = nodes->name, .prefix = whole == NULL ? NB_NODE_PREFIX : ""};
    if (whole != NULL && flat != NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, flat, "does not go with \"nebel\", which says it all");
    if (!nb_gltf_find_place(&nodes->tree, number, &node.place)) return true;
    node.place = nb_affine_compose(&nodes->place, &node.place);
    nodes->model->has_fog = true;
    nodes->in->node = &node;
    nodes->in->json = json;
    const bool is_text = whole != NULL && whole->type == NB_JSON_STRING;
    const bool good =
        is_text ? read_text(nodes, json, whole) : nb_keys_read_volume(nodes->in, whole != NULL ? whole : extras);
    nodes->in->node = NULL;
    return good;
}

static bool take_node(nodes_reader *nodes, nb_json *json, const nb_json_node *node)
{
    const nb_json_node *extras = find_member(json, node, "extras"), *mesh = find_member(json, node, "mesh");
    if (extras == NULL || (find_flat(json, extras) == NULL && find_member(json, extras, "nebel") == NULL)) return true;
    set_name(nodes, json, node);
    const bool good = mesh == NULL ? read_fog_node(nodes, json, extras, node->index)
                                   : nb_json_fail(json, NEBEL_ERROR_FORMAT, extras,
                                                  "has fog and a mesh; fog belongs to a node without, an empty");
    nodes->name[0] = '\0';
    return good;
}

static bool take_model_value(nb_json *json, const nb_json_node *value, void *user)
{
    nodes_reader *nodes = user;
    const nb_json_node *parent = nb_json_parent(json, value);
    if (parent == NULL || nb_json_parent(json, parent) == NULL) return true;
    return take_node(nodes, json, value);
}

/* ---- the file -------------------------------------------------------------------------------- */

/* Most files know nothing of fog. */
static bool speaks_of_fog(const nb_bytes *text)
{
    static const char word[] = "\"nebel";
    if (text->size == 0) return false;
    const char *at = (const char *)text->data, *end = at + text->size;
    while ((size_t)(end - at) >= sizeof word - 1) {
        if (memcmp(at, word, sizeof word - 1) == 0) return true;
        at = memchr(at + 1, '"', (size_t)(end - at - 1));
        if (at == NULL) return false;
    }
    return false;
}

static nebel_result read_nodes(nodes_reader *nodes, const nb_bytes *text)
{
    static const char *const streamed[] = {"nodes", NULL};
    nb_json json;
    const nb_json_desc desc = {.text = (const char *)text->data,
                               .size = text->size,
                               .name = nodes->model->file,
                               .allocator = nodes->in->scene->allocator,
                               .log = {pass_on, nodes},
                               .streamed = streamed,
                               .take = take_model_value,
                               .user = nodes};
    nebel_result result = nb_gltf_read_tree(&desc, &nodes->tree);
    if (result == NEBEL_OK) result = nb_json_read(&json, &desc);
    nb_gltf_release_tree(&nodes->tree);
    return result;
}

/* What the reader knows of the scene's own file gives way to what it knows of the model's, and comes back. */
static nebel_result read_inside(nb_scene_reader *in, nb_model_source *model, const nb_bytes *text)
{
    nb_json *const outer = in->json;
    const nb_file_units space = in->space;
    nodes_reader nodes = {.in = in, .model = model, .place = nb_model_place(model)};
    in->space = NB_SPACE_OURS;
    const nebel_result result = read_nodes(&nodes, text);
    in->json = outer;
    in->space = space;
    return result;
}

bool nb_keys_read_nodes(nb_scene_reader *in, const nb_json_node *node, nb_model_source *model)
{
    nb_bytes text;
    nebel_result result = nb_gltf_read_text(&in->scene->allocator, model->file, &text);
    if (result != NEBEL_OK) return nb_json_fail(in->json, result, node, "out of memory");
    if (speaks_of_fog(&text)) result = read_inside(in, model, &text);
    nb_release(&in->scene->allocator, text.data);
    return result == NEBEL_OK || nb_json_stop(in->json, result);
}
