#define _POSIX_C_SOURCE 200809L
#include "json.h"

#include "json_memory.h"
#include "json_syntax.h"
#include "number.h"

#include <math.h>
#include <string.h>
#include <yajl/yajl_parse.h>

typedef struct nb_json_reader {
    nb_json *json;
    nb_json_memory memory;
    yajl_handle parser;
    locale_t c_locale;
    size_t end;  /* of the last token: where the search for the next one starts */
    bool at_end; /* the whole text has been seen: a number at its very end comes now */
} nb_json_reader;

/* ---- where tokens are ------------------------------------------------------------------------ */

/* The first byte of the token after `at`: yajl tells only where tokens end. */
static size_t find_token(const nb_json *json, size_t at)
{
    at = nb_json_skip_blanks(json, at, NULL);
    while (at < json->desc.size && (json->desc.text[at] == ',' || json->desc.text[at] == ':'))
        at = nb_json_skip_blanks(json, at + 1, NULL);
    return at;
}

static uint32_t take_token(nb_json_reader *in)
{
    const size_t start = find_token(in->json, in->end);
    in->end = in->at_end ? in->json->desc.size : yajl_get_bytes_consumed(in->parser);
    return (uint32_t)start;
}

/* ---- building trees -------------------------------------------------------------------------- */

static bool fail_at(nb_json *json, nebel_result result, size_t offset, const char *message)
{
    return nb_json_fail_at(json, result, offset, "", "%s", message);
}

static bool fail_memory(nb_json *json)
{
    if (json->result != NEBEL_OK) return false;
    json->result = nb_fail(&json->desc.log, NEBEL_ERROR_MEMORY, "%s: out of memory while reading", json->desc.name);
    return false;
}

static bool is_in_text(const nb_json *json, const char *string)
{
    const uintptr_t at = (uintptr_t)string, text = (uintptr_t)json->desc.text;
    return at >= text && at - text < json->desc.size;
}

/* A string with escapes lies in yajl's buffer for a moment only: it is copied, and its escapes looked at once more,
 * since yajl turns half a surrogate pair into a question mark. */
static bool keep_string(nb_json_reader *in, nb_arena *arena, const nb_json_node *about, uint32_t start,
                        const char **string, size_t size)
{
    nb_json *json = in->json;
    char path[NB_JSON_PATH];
    if (is_in_text(json, *string) || size == 0) return true;
    if (nb_text_has_lone_surrogate(json->desc.text + start, in->end - start)) {
        nb_json_path(json, about, path);
        return nb_json_fail_at(json, NEBEL_ERROR_FORMAT, start, path,
                               "an escape \\uD800 to \\uDFFF stands alone; these come in pairs, or write the "
                               "character itself");
    }
    *string = nb_arena_copy_text(arena, *string, size);
    return *string != NULL || fail_memory(json);
}

static void link_child(nb_json *json, uint32_t child)
{
    nb_json_node *parent = &json->nodes[json->open[json->depth - 1]];
    uint32_t *last = &json->last[json->depth - 1];
    if (*last != 0)
        json->nodes[*last].next = child;
    else
        parent->first = child;
    *last = child;
    json->nodes[child].parent = json->open[json->depth - 1];
    json->nodes[child].index = parent->count++;
}

static nb_json_node *add_node(nb_json_reader *in, nb_json_type type)
{
    nb_json *json = in->json;
    const uint32_t start = take_token(in);
    void *nodes = json->nodes;
    if (json->node_count == NB_JSON_MAX_NODES) {
        fail_at(json, NEBEL_ERROR_LIMIT, start, "too many values in one part of the scene; at most 8388608");
        return NULL;
    }
    if (!nb_grow(&json->desc.allocator, &nodes, sizeof(nb_json_node), json->node_count, &json->node_capacity,
                 json->node_count + 1)) {
        fail_memory(json);
        return NULL;
    }
    json->nodes = nodes;
    if (json->depth == 0 && type != NB_JSON_OBJECT) {
        nb_json_fail_at(json, NEBEL_ERROR_FORMAT, start, "",
                        "found %s; a scene is an object and begins with {: at least {\"nebel\": 1, \"fog\": []}",
                        nb_json_type_name(type));
        return NULL;
    }
    nb_json_node *node = &json->nodes[json->node_count];
    *node = json->key;
    json->key = (nb_json_node){0};
    node->type = type;
    node->offset = start;
    node->end = (uint32_t)in->end;
    if (json->depth > 0) link_child(json, (uint32_t)json->node_count);
    json->node_count++;
    return node;
}

static bool is_streamed(const nb_json *json, const nb_json_node *node)
{
    if (node->type != NB_JSON_ARRAY || node->parent != 0) return false;
    for (const char *const *name = json->desc.streamed; *name != NULL; name++)
        if (nb_json_has_key(node, *name)) return true;
    return false;
}

/* Drops the trees from node `first` on, the last child of the innermost open container. */
static void drop_nodes(nb_json *json, uint32_t first)
{
    json->nodes[json->open[json->depth - 1]].first = 0;
    json->last[json->depth - 1] = 0;
    json->node_count = first;
    nb_arena_release(&json->strings);
}

/* Called when a value is complete, before the next one starts. Hands it over when it is a tree of its own. */
static bool close_value(nb_json *json, uint32_t index)
{
    const nb_json_node *node = &json->nodes[index];
    const bool section = json->depth == 1;
    const bool element = json->depth == 2 && is_streamed(json, nb_json_parent(json, node));
    if (!section && !element) return true;
    if (!json->desc.take(json, node, json->desc.user)) return false;
    drop_nodes(json, index);
    return true;
}

static bool close_scalar(nb_json *json, const nb_json_node *node)
{
    return close_value(json, (uint32_t)(node - json->nodes));
}

static bool open_container(nb_json_reader *in, nb_json_type type)
{
    nb_json *json = in->json;
    if (json->depth == NB_JSON_MAX_DEPTH)
        return fail_at(json, NEBEL_ERROR_LIMIT, find_token(json, in->end), "nested too deeply; at most 64 levels");
    const nb_json_node *node = add_node(in, type);
    if (node == NULL) return false;
    json->open[json->depth] = (uint32_t)(node - json->nodes);
    json->last[json->depth] = 0;
    json->depth++;
    return true;
}

static bool close_container(nb_json_reader *in)
{
    nb_json *json = in->json;
    take_token(in);
    json->depth--;
    json->nodes[json->open[json->depth]].end = (uint32_t)in->end;
    if (json->depth == 0) return json->desc.take(json, json->nodes, json->desc.user);
    return close_value(json, json->open[json->depth]);
}

/* ---- yajl's events --------------------------------------------------------------------------- */

static int on_null(void *user)
{
    nb_json_reader *in = user;
    const nb_json_node *node = add_node(in, NB_JSON_NULL);
    return node != NULL && close_scalar(in->json, node);
}

static int on_boolean(void *user, int value)
{
    nb_json_reader *in = user;
    nb_json_node *node = add_node(in, NB_JSON_BOOLEAN);
    if (node == NULL) return 0;
    node->number = value;
    return close_scalar(in->json, node);
}

static int on_number(void *user, const char *text, size_t size)
{
    nb_json_reader *in = user;
    nb_json_node *node = add_node(in, NB_JSON_NUMBER);
    if (node == NULL) return 0;
    if (!nb_number_parse(text, size, in->c_locale, &node->number))
        return nb_json_fail(in->json, NEBEL_ERROR_LIMIT, node, "a number of %zu characters; at most %d", size,
                            NB_NUMBER_LENGTH);
    if (!isfinite(node->number))
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "the number is too large; at most 1.797e308");
    return nb_json_check_number(in->json, node) && close_scalar(in->json, node);
}

static int on_string(void *user, const unsigned char *text, size_t size)
{
    nb_json_reader *in = user;
    nb_json_node *node = add_node(in, NB_JSON_STRING);
    if (node == NULL) return 0;
    node->string = (const char *)text;
    node->string_size = (uint32_t)size;
    return keep_string(in, &in->json->strings, node, node->offset, &node->string, size) && close_scalar(in->json, node);
}

static int on_key(void *user, const unsigned char *text, size_t size)
{
    nb_json_reader *in = user;
    nb_json *json = in->json;
    const uint32_t start = take_token(in);
    json->key = (nb_json_node){.key = (const char *)text, .key_size = (uint32_t)size, .key_offset = start};
    return keep_string(in, json->depth == 1 ? &json->section_keys : &json->strings,
                       &json->nodes[json->open[json->depth - 1]], start, &json->key.key, size);
}

static int on_object(void *user)
{
    return open_container(user, NB_JSON_OBJECT);
}

static int on_array(void *user)
{
    return open_container(user, NB_JSON_ARRAY);
}

static int on_end(void *user)
{
    return close_container(user);
}

static const yajl_callbacks callbacks = {
    .yajl_null = on_null,
    .yajl_boolean = on_boolean,
    .yajl_number = on_number,
    .yajl_string = on_string,
    .yajl_start_map = on_object,
    .yajl_map_key = on_key,
    .yajl_end_map = on_end,
    .yajl_start_array = on_array,
    .yajl_end_array = on_end,
};

/* ---- reading --------------------------------------------------------------------------------- */

/* Between setjmp and here nothing is held but yajl's memory, which is given back as a whole. */
static void run_parser(nb_json_reader *in)
{
    nb_json *json = in->json;
    if (setjmp(in->memory.out_of_memory) != 0) {
        fail_memory(json);
        return;
    }
    in->parser = yajl_alloc(&callbacks, &in->memory.functions, in);
    yajl_config(in->parser, yajl_allow_comments, 1);
    yajl_status status = yajl_parse(in->parser, (const unsigned char *)json->desc.text, json->desc.size);
    in->at_end = status == yajl_status_ok;
    if (in->at_end) status = yajl_complete_parse(in->parser);
    const bool refused = status == yajl_status_error;
    if (refused || (status == yajl_status_ok && nb_json_skip_blanks(json, in->end, NULL) > json->desc.size))
        nb_json_explain(json, in->end);
}

static void read_text(nb_json *json)
{
    nb_json_reader in = {.json = json, .c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0)};
    if (in.c_locale == (locale_t)0) {
        fail_memory(json);
        return;
    }
    nb_json_memory_start(&in.memory, &json->desc.allocator);
    run_parser(&in);
    nb_json_memory_release(&in.memory);
    freelocale(in.c_locale);
}

nebel_result nb_json_read(nb_json *json, const nb_json_desc *desc)
{
    *json = (nb_json){.desc = *desc, .place = NB_TEXT_START, .unit = desc->unit > 0 ? desc->unit : 1};
    json->strings.allocator = json->section_keys.allocator = desc->allocator;
    if (nb_json_check_text(json)) read_text(json);
    nb_arena_release(&json->strings);
    nb_arena_release(&json->section_keys);
    nb_release(&desc->allocator, json->nodes);
    json->nodes = NULL;
    return json->result;
}
