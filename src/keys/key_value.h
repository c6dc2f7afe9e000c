/* Checked values out of a JSON tree. Every function logs what is wrong with the place, and what is allowed, and then
 * returns false. Where `node` is NULL (the key is absent) the readers leave their target as it is and return true. */
#ifndef NB_KEYS_KEY_VALUE_H
#define NB_KEYS_KEY_VALUE_H

#include "json/json.h"
#include "key_range.h"

/* The keys an object may have, at most 32; bit i of a mask stands for names[i]. */
typedef struct nb_key_set {
    const char *const *names;
    uint32_t count;
    uint32_t allowed, required;
    const char *owner; /* "a sphere": whose keys they are, in messages */
} nb_key_set;

#define NB_BIT(i) ((uint32_t)1 << (i))

/* Sorts the members of an object into found[0..count), NULL where absent. Unknown, repeated and missing keys are
 * errors. */
bool nb_key_value_members(nb_json *json, const nb_json_node *object, const nb_key_set *keys,
                          const nb_json_node **found);

/* The same where keys have a prefix in the file ("": none): members without it are none of ours. */
bool nb_key_value_members_after(nb_json *json, const nb_json_node *object, const char *prefix, const nb_key_set *keys,
                                const nb_json_node **found);

/* Whether the member's key is the name, with the prefix ("": none) before it. */
bool nb_key_value_is_key(const nb_json_node *node, const char *prefix, const char *name);

/* Fails because of the node's key, which was there before, at `first`. Returns false. */
bool nb_key_value_fail_repeated(nb_json *json, const nb_json_node *node, size_t first);

/* Where `key` is among names: its index; otherwise an error at the key that lists the allowed ones and returns -1. */
int nb_key_value_find_key(nb_json *json, const nb_json_node *node, const nb_key_set *keys);

/* The type of an object's tree: the value of its member "type", as an index into names; -1 after an error. */
int nb_key_value_type(nb_json *json, const nb_json_node *object, const char *const *names, int count);

/* An index into names, of a string; -1 after an error. */
int nb_key_value_choice(nb_json *json, const nb_json_node *node, const char *const *names, int count);

/* The same into *choice, which stays as it is without a node. False after an error. */
bool nb_key_value_replace_choice(nb_json *json, const nb_json_node *node, const char *const *names, int count,
                                 int *choice);

bool nb_key_value_is(nb_json *json, const nb_json_node *node, nb_json_type type, const char *wanted);

bool nb_key_value_number(nb_json *json, const nb_json_node *node, const nb_range *range, double *value);
bool nb_key_value_integer(nb_json *json, const nb_json_node *node, int low, int high, int *value);
bool nb_key_value_numbers(nb_json *json, const nb_json_node *node, const nb_range *range, size_t count, double *values);
bool nb_key_value_place(nb_json *json, const nb_json_node *node, double place[3]);
bool nb_key_value_direction(nb_json *json, const nb_json_node *node, double vector[3]);  /* not zero; length kept */
bool nb_key_value_rotation(nb_json *json, const nb_json_node *node, double rotation[4]); /* not zero; normalised */
/* Not zero, with all its digits, though not of length 1: dividing by the length rounds, and a silhouette shows it. The
 * longest number is from .5 to 1. */
bool nb_key_value_quaternion(nb_json *json, const nb_json_node *node, double rotation[4]);
bool nb_key_value_scale(nb_json *json, const nb_json_node *node, double scale[3]); /* one number or three */

/* Whether a vector that is a direction has a length that the core takes; `node` is its array. */
bool nb_key_value_check_direction(nb_json *json, const nb_json_node *node, const double vector[3]);

bool nb_key_value_amount(nb_json *json, const nb_json_node *node, const nb_range *range,
                         double rgb[3]); /* one or three */

/* The same, or "#rrggbb" or "#rgb": an sRGB color, made linear. 0 and 1 must be in the range. */
bool nb_key_value_color(nb_json *json, const nb_json_node *node, const nb_range *range, double color[3]);

/* Of one channel, >= 0. */
double nb_key_value_linear_from_srgb(double value);

/* Whether an array has no more elements. For before any is read: two too many alike would be told of each other. */
bool nb_key_value_at_most(nb_json *json, const nb_json_node *array, uint32_t most, const char *owner, const char *what);

/* What stands behind lengths in metres where the file's are in another unit; else "". */
#define NB_UNIT_NOTE 64
const char *nb_key_value_note_unit(const nb_json *json, char note[NB_UNIT_NOTE]);

/* Fails with what the core said of numbers of an object, "components[2].center_height: is ...", and more. Points at the number, or at the
 * innermost of what is around it that the file has. Returns false. */
bool nb_key_value_fail_within(nb_json *json, const nb_json_node *object, const char *message, const char *more);

/* Copies a string without zero bytes into the arena. */
bool nb_key_value_text(nb_json *json, const nb_json_node *node, nb_arena *arena, const char **text);

#endif
