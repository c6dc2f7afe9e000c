/* Questions about a tree, and messages that say where in the file it is. */
#include "json.h"

#include <stdio.h>
#include <string.h>

const char *nb_json_type_name(nb_json_type type)
{
    static const char *const names[] = {"null", "true or false", "a number", "a string", "an array", "an object"};
    return names[type];
}

const nb_json_node *nb_json_parent(const nb_json *json, const nb_json_node *node)
{
    return node == json->nodes ? NULL : &json->nodes[node->parent];
}

const nb_json_node *nb_json_first(const nb_json *json, const nb_json_node *node)
{
    return node->first != 0 ? &json->nodes[node->first] : NULL;
}

const nb_json_node *nb_json_next(const nb_json *json, const nb_json_node *node)
{
    return node->next != 0 ? &json->nodes[node->next] : NULL;
}

bool nb_json_has_key(const nb_json_node *node, const char *key)
{
    const size_t size = strlen(key);
    return node->key != NULL && node->key_size == size && memcmp(node->key, key, size) == 0;
}

nb_text_place nb_json_place(nb_json *json, size_t offset)
{
    nb_text_move(json->desc.text, &json->place, offset);
    nb_text_place place = json->place;
    if (place.line == 1 && place.column > json->desc.lead) place.column -= json->desc.lead;
    return place;
}

/* Keys longer than this are cut in messages. */
enum { KEY_SHOWN = 40 };

static size_t write_step(const nb_json_node *node, char *step, size_t size)
{
    int length;
    if (node->key == NULL) {
        length = snprintf(step, size, "[%lu]", (unsigned long)node->index);
    } else {
        size_t shown = node->key_size < KEY_SHOWN ? node->key_size : KEY_SHOWN;
        while (shown > 0 && shown < node->key_size && (node->key[shown] & 0xC0) == 0x80) shown--;
        const char *dot = node->parent == 0 ? "" : ".";
        length = snprintf(step, size, "%s%.*s%s", dot, (int)shown, node->key, shown < node->key_size ? "..." : "");
    }
    return length > 0 ? (size_t)length : 0;
}

/* Steps are written from the innermost outwards, from the end of the buffer to its start; what does not fit is left out
 * at the start. */
void nb_json_path(const nb_json *json, const nb_json_node *node, char path[NB_JSON_PATH])
{
    size_t start = NB_JSON_PATH - 1;
    path[start] = '\0';
    for (; node != NULL && node != json->nodes; node = nb_json_parent(json, node)) {
        char step[KEY_SHOWN + 8];
        const size_t length = write_step(node, step, sizeof step);
        if (length > start) break;
        start -= length;
        memcpy(path + start, step, length);
    }
    memmove(path, path + start, NB_JSON_PATH - start);
    for (char *at = path; *at != '\0'; at++)
        if ((unsigned char)*at < 0x20 || *at == 0x7F) *at = '?';
}

static bool fail_formatted(nb_json *json, nebel_result result, size_t offset, const char *path, const char *format,
                           va_list arguments)
{
    if (json->result != NEBEL_OK) return false;
    json->result = result;
    if (json->desc.log.write == NULL) return false;
    char message[768];
    vsnprintf(message, sizeof message, format, arguments);
    const nb_text_place place = nb_json_place(json, offset);
    nb_fail(&json->desc.log, result, "%s:%zu:%zu: %s%s%s", json->desc.name, place.line, place.column, path,
            path[0] != '\0' ? ": " : "", message);
    return false;
}

bool nb_json_fail(nb_json *json, nebel_result result, const nb_json_node *node, const char *format, ...)
{
    char path[NB_JSON_PATH];
    nb_json_path(json, node, path);
    va_list arguments;
    va_start(arguments, format);
    fail_formatted(json, result, node->offset, path, format, arguments);
    va_end(arguments);
    return false;
}

bool nb_json_fail_memory(nb_json *json, const nb_json_node *node)
{
    return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
}

bool nb_json_fail_key(nb_json *json, nebel_result result, const nb_json_node *node, const char *format, ...)
{
    char path[NB_JSON_PATH];
    nb_json_path(json, node, path);
    va_list arguments;
    va_start(arguments, format);
    fail_formatted(json, result, node->key_offset, path, format, arguments);
    va_end(arguments);
    return false;
}

bool nb_json_fail_at(nb_json *json, nebel_result result, size_t offset, const char *path, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fail_formatted(json, result, offset, path, format, arguments);
    va_end(arguments);
    return false;
}

bool nb_json_stop(nb_json *json, nebel_result result)
{
    if (json->result == NEBEL_OK) json->result = result;
    return false;
}
