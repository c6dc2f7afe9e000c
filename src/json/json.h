/* JSON whose values know their place in the file.
 *
 * yajl reads the text; this file builds small trees of it. A tree is handed over as soon as it is complete and then
 * dropped: every member of the root object is one tree, and so is every element of the arrays named in `streamed`. A
 * file with a million volumes therefore needs memory for one volume. Elements come before the (then empty) array they
 * are in, the root object comes last. */
#ifndef NB_JSON_JSON_H
#define NB_JSON_JSON_H

#include "base/base.h"
#include "base/arena.h"
#include "utf8.h"

#include <stdbool.h>

typedef enum nb_json_type {
    NB_JSON_NULL,
    NB_JSON_BOOLEAN,
    NB_JSON_NUMBER,
    NB_JSON_STRING,
    NB_JSON_ARRAY,
    NB_JSON_OBJECT
} nb_json_type;

/* Nodes name each other by index; 0, the root object, stands for none. Offsets count bytes of the text, which is
 * shorter than 4 GiB. */
typedef struct nb_json_node {
    const char *key, *string; /* decoded, not terminated; in the text or in the tree's own memory */
    double number;
    uint32_t key_size, string_size;
    uint32_t offset, key_offset;
    uint32_t end; /* of the value: the first byte behind it */
    uint32_t parent, next, first;
    uint32_t count; /* children so far */
    uint32_t index; /* place among the parent's children */
    nb_json_type type;
} nb_json_node;

/* The largest tree and the deepest nesting. */
#define NB_JSON_MAX_NODES ((uint32_t)1 << 23)
#define NB_JSON_MAX_DEPTH 64

typedef struct nb_json nb_json;

/* "a number", for messages. */
const char *nb_json_type_name(nb_json_type type);

/* Takes a complete tree. False, after nb_json_fail, stops the reading. */
typedef bool (*nb_json_take)(nb_json *json, const nb_json_node *value, void *user);

typedef struct nb_json_desc {
    const char *text;
    size_t size;
    size_t lead;      /* bytes before what the user wrote, without a line's end: places count from behind them */
    const char *name; /* of the file, in messages */
    double unit;      /* m: that of the text's lengths, on which their limits depend; 0: 1 */
    nebel_allocator allocator;
    nebel_log log;
    const char *const *streamed; /* names, NULL ends them */
    nb_json_take take;
    void *user;
} nb_json_desc;

struct nb_json {
    nb_json_desc desc;
    nebel_result result; /* of the first error */
    nb_text_place place;
    double unit; /* as the description's */

    nb_json_node *nodes;
    size_t node_count, node_capacity;
    uint32_t open[NB_JSON_MAX_DEPTH]; /* the containers around the next value, outermost first */
    uint32_t last[NB_JSON_MAX_DEPTH]; /* and their last children */
    size_t depth;
    nb_json_node key; /* waiting for its value: only its key is set */

    nb_arena strings;      /* of the tree being built: those that hold escapes */
    nb_arena section_keys; /* the same for the root's keys */
};

/* Reads desc->text and hands over its trees. The result is that of the first error, which has been logged. `json`
 * answers questions during the call only. */
nebel_result nb_json_read(nb_json *json, const nb_json_desc *desc);

const nb_json_node *nb_json_parent(const nb_json *json, const nb_json_node *node);
const nb_json_node *nb_json_first(const nb_json *json, const nb_json_node *node); /* NULL: no children */
const nb_json_node *nb_json_next(const nb_json *json, const nb_json_node *node);  /* NULL: the last one */
bool nb_json_has_key(const nb_json_node *node, const char *key);

/* Line and column of a byte of the text. */
nb_text_place nb_json_place(nb_json *json, size_t offset);

/* Writes "fog[3].shape.radius", without outer steps where it is long; "" for the root. */
#define NB_JSON_PATH 160
void nb_json_path(const nb_json *json, const nb_json_node *node, char path[NB_JSON_PATH]);

/* Logs "FILE:LINE:COLUMN: path: message" and keeps the result. Returns false. */
bool nb_json_fail(nb_json *json, nebel_result result, const nb_json_node *node, const char *format, ...)
    NB_PRINTF(4, 5);

/* The same for memory that is out. */
bool nb_json_fail_memory(nb_json *json, const nb_json_node *node);

/* The same, pointing at the node's key. */
bool nb_json_fail_key(nb_json *json, nebel_result result, const nb_json_node *node, const char *format, ...)
    NB_PRINTF(4, 5);

/* The same, for a place whose tree is gone. */
bool nb_json_fail_at(nb_json *json, nebel_result result, size_t offset, const char *path, const char *format, ...)
    NB_PRINTF(5, 6);

/* Ends the reading for a reason that has been logged. Returns false. */
bool nb_json_stop(nb_json *json, nebel_result result);

#endif
