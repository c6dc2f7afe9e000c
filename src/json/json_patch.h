/* Changes to a text: other numbers at the places of values, everything else as it was. */
#ifndef NB_JSON_JSON_PATCH_H
#define NB_JSON_JSON_PATCH_H

#include "base/bytes.h"
#include "json.h"

typedef struct nb_json_patch_piece {
    size_t offset, size; /* what goes */
    char *words;         /* what comes in its place; in the edit's arena */
} nb_json_patch_piece;

/* The text lives as long as the edit. */
typedef struct nb_edit {
    const char *text;
    size_t size;
    nb_arena arena;
    nb_json_patch_piece *pieces;
    size_t count, capacity;
    bool out_of_memory; /* one or more pieces are missing */
} nb_edit;

/* An object of the text, and the member behind which others may be added. */
typedef struct nb_json_patch_object {
    const nb_json_node *node;  /* NULL: not in the text */
    size_t last_key, last_end; /* of its last member */
} nb_json_patch_object;

/* Of a tree that is complete; NULL: none. */
nb_json_patch_object nb_json_patch_find(const nb_json *json, const nb_json_node *object);

/* The member of that name; NULL: none. */
const nb_json_node *nb_json_patch_member(const nb_json *json, const nb_json_node *object, const char *key);

typedef enum nb_json_patch_style {
    NB_EDIT_EACH,  /* of an array, the elements that change */
    NB_EDIT_WHOLE, /* all of them: they mean something together */
    NB_EDIT_AMOUNT /* each; three equal numbers may be one */
} nb_json_patch_style;

/* Puts numbers that are not what they were in the place of the key's value. A key that is missing is added. */
void nb_json_patch_numbers(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object, const char *key,
                           size_t count, const double *was, const double *now, nb_json_patch_style style);

/* The same for the elements of an array of numbers. */
void nb_json_patch_elements(nb_edit *edit, const nb_json *json, const nb_json_node *array, const double *was,
                            const double *now);

/* Puts a text in quotes in the place of the key's value, or adds it. */
void nb_json_patch_word(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object, const char *key,
                        const char *word);

/* Adds a member whose value is given as JSON. */
void nb_json_patch_add(nb_edit *edit, const nb_json_patch_object *object, const char *key, const char *value);

void nb_json_patch_replace(nb_edit *edit, const nb_json_node *node, const char *value);

/* One of the elements of an array, or of the members of an object with their keys, and whether it goes. */
typedef struct nb_json_patch_span {
    size_t offset, end;
    bool goes;
} nb_json_patch_span;

/* Takes elements or members out, with the commas and blanks that joined them. `spans` are all that the array or object
 * has, in their order. Remarks between them stay. What is added behind the last one that stays is added before. */
void nb_json_patch_remove(nb_edit *edit, const nb_json_patch_span *spans, size_t count);

/* The same for members that go by their names; NULL ends the list. Names that are not there are no matter. */
void nb_json_patch_remove_members(nb_edit *edit, const nb_json *json, const nb_json_node *object,
                                  const char *const *keys);

/* Puts words in the place of any piece of the text. */
void nb_json_patch_put(nb_edit *edit, size_t offset, size_t size, const char *words);

/* Appends a text in quotes, with what must be escaped. False when memory is out. */
bool nb_json_patch_write_text(const nebel_allocator *allocator, nb_bytes *bytes, const char *text);

/* Writes 1 or more numbers as JSON. The text holds at least NB_EDIT_NUMBERS characters. */
#define NB_EDIT_NUMBERS 128
void nb_json_patch_write_numbers(size_t count, const double *numbers, nb_json_patch_style style, char *text);

/* The text with all changes. False when memory is out. Free bytes->data with nb_release. */
bool nb_json_patch_apply(nb_edit *edit, nb_bytes *bytes);

void nb_json_patch_release(nb_edit *edit);

#endif
