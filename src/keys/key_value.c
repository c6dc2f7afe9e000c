#include "key_value.h"

#include "math/affine.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- names ----------------------------------------------------------------------------------- */

/* Lists in messages are cut at this size. */
enum { LIST_SIZE = 480 };

typedef struct nb_text_list {
    char text[LIST_SIZE];
    size_t size;
} nb_text_list;

static void append(nb_text_list *names, const char *prefix, const char *name)
{
    const size_t room = sizeof names->text - names->size;
    const int length = snprintf(names->text + names->size, room, "%s%s%s", names->size > 0 ? ", " : "", prefix, name);
    if (length > 0) names->size += (size_t)length < room ? (size_t)length : room - 1;
}

static bool is_near(const char *word, size_t size, const char *name)
{
    const size_t length = strlen(name), limit = length < 5 ? 1 : length < 10 ? 2 : 3;
    return nb_text_distance(word, size, name, length) <= limit;
}

/* "; did you mean "radius"?" for the nearest of the allowed names, "" where none is near. */
static void suggest(const char *word, size_t size, const char *prefix, const char *const *names, uint32_t count,
                    uint32_t allowed, char text[64])
{
    size_t best = SIZE_MAX;
    text[0] = '\0';
    for (uint32_t i = 0; i < count; i++) {
        if ((allowed & NB_BIT(i)) == 0 || !is_near(word, size, names[i])) continue;
        const size_t distance = nb_text_distance(word, size, names[i], strlen(names[i]));
        if (distance >= best) continue;
        best = distance;
        snprintf(text, 64, "; did you mean \"%s%s\"?", prefix, names[i]);
    }
}

static void fail_unknown_key(nb_json *json, const nb_json_node *node, const char *prefix, const nb_key_set *keys)
{
    nb_text_list allowed = {.size = 0};
    char suggestion[64];
    for (uint32_t i = 0; i < keys->count; i++)
        if ((keys->allowed & NB_BIT(i)) != 0) append(&allowed, prefix, keys->names[i]);
    const size_t skipped = strlen(prefix);
    suggest(node->key + skipped, node->key_size - skipped, prefix, keys->names, keys->count, keys->allowed, suggestion);
    nb_json_fail_key(json, NEBEL_ERROR_FORMAT, node, "unknown key; %s has: %s%s", keys->owner, allowed.text,
                     suggestion);
}

static bool has_prefix(const nb_json_node *node, const char *prefix)
{
    const size_t size = strlen(prefix);
    return node->key_size >= size && (size == 0 || memcmp(node->key, prefix, size) == 0);
}

bool nb_key_value_is_key(const nb_json_node *node, const char *prefix, const char *name)
{
    const size_t skipped = strlen(prefix), size = strlen(name);
    return node->key != NULL && has_prefix(node, prefix) && node->key_size == skipped + size &&
           memcmp(node->key + skipped, name, size) == 0;
}

static int find_member_key(nb_json *json, const nb_json_node *node, const char *prefix, const nb_key_set *keys)
{
    for (uint32_t i = 0; i < keys->count; i++)
        if ((keys->allowed & NB_BIT(i)) != 0 && nb_key_value_is_key(node, prefix, keys->names[i])) return (int)i;
    fail_unknown_key(json, node, prefix, keys);
    return -1;
}

int nb_key_value_find_key(nb_json *json, const nb_json_node *node, const nb_key_set *keys)
{
    return find_member_key(json, node, "", keys);
}

static bool fail_missing(nb_json *json, const nb_json_node *object, const nb_key_set *keys, uint32_t missing)
{
    uint32_t i = 0;
    while ((missing & NB_BIT(i)) == 0) i++;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, object, "the key \"%s\" is missing; %s needs it", keys->names[i],
                        keys->owner);
}

bool nb_key_value_fail_repeated(nb_json *json, const nb_json_node *node, size_t first)
{
    const nb_text_place place = nb_json_place(json, first);
    return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, node,
                            "the key appears twice, first at line %zu, column %zu; remove one", place.line,
                            place.column);
}

bool nb_key_value_members_after(nb_json *json, const nb_json_node *object, const char *prefix, const nb_key_set *keys,
                                const nb_json_node **found)
{
    uint32_t seen = 0;
    if (!nb_key_value_is(json, object, NB_JSON_OBJECT, "an object {...}")) return false;
    for (uint32_t i = 0; i < keys->count; i++) found[i] = NULL;
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node)) {
        if (!has_prefix(node, prefix)) continue;
        const int key = find_member_key(json, node, prefix, keys);
        if (key < 0) return false;
        if (found[key] != NULL) return nb_key_value_fail_repeated(json, node, found[key]->key_offset);
        seen |= NB_BIT(key);
        found[key] = node;
    }
    const uint32_t missing = keys->required & ~seen;
    return missing == 0 || fail_missing(json, object, keys, missing);
}

bool nb_key_value_members(nb_json *json, const nb_json_node *object, const nb_key_set *keys, const nb_json_node **found)
{
    return nb_key_value_members_after(json, object, "", keys, found);
}

int nb_key_value_choice(nb_json *json, const nb_json_node *node, const char *const *names, int count)
{
    nb_text_list allowed = {.size = 0};
    char suggestion[64];
    for (int i = 0; i < count; i++) {
        const size_t size = strlen(names[i]);
        const bool equal = node->string_size == size && memcmp(node->string, names[i], size) == 0;
        if (node->type == NB_JSON_STRING && equal) return i;
        append(&allowed, "", names[i]);
    }
    if (node->type != NB_JSON_STRING) {
        nb_key_value_is(json, node, NB_JSON_STRING, "a string");
        return -1;
    }
    suggest(node->string, node->string_size, "", names, (uint32_t)count, UINT32_MAX, suggestion);
    nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "unknown; must be one of: %s%s", allowed.text, suggestion);
    return -1;
}

int nb_key_value_type(nb_json *json, const nb_json_node *object, const char *const *names, int count)
{
    nb_text_list allowed = {.size = 0};
    if (!nb_key_value_is(json, object, NB_JSON_OBJECT, "an object {\"type\": ...}")) return -1;
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node))
        if (nb_json_has_key(node, "type")) return nb_key_value_choice(json, node, names, count);
    for (int i = 0; i < count; i++) append(&allowed, "", names[i]);
    nb_json_fail(json, NEBEL_ERROR_FORMAT, object, "the key \"type\" is missing; must be one of: %s", allowed.text);
    return -1;
}

/* ---- numbers --------------------------------------------------------------------------------- */

bool nb_key_value_replace_choice(nb_json *json, const nb_json_node *node, const char *const *names, int count,
                                 int *choice)
{
    if (node != NULL) *choice = nb_key_value_choice(json, node, names, count);
    return *choice >= 0;
}

bool nb_key_value_is(nb_json *json, const nb_json_node *node, nb_json_type type, const char *wanted)
{
    if (node->type == type) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is %s; must be %s", nb_json_type_name(node->type), wanted);
}

bool nb_key_value_number(nb_json *json, const nb_json_node *node, const nb_range *range, double *value)
{
    char wanted[NB_RANGE_TEXT];
    if (node == NULL) return true;
    if (node->type != NB_JSON_NUMBER)
        return nb_key_value_is(json, node, NB_JSON_NUMBER, nb_range_describe(range, json->unit, wanted));
    if (!nb_range_holds(range, json->unit, node->number))
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is %.15g; must be %s", node->number,
                            nb_range_describe(range, json->unit, wanted));
    *value = node->number;
    return true;
}

bool nb_key_value_integer(nb_json *json, const nb_json_node *node, int low, int high, int *value)
{
    char text[64];
    double number = 0;
    if (node == NULL) return true;
    snprintf(text, sizeof text, "a whole number from %d to %d", low, high);
    const nb_range range = {.low = low, .high = high, .text = text};
    if (!nb_key_value_number(json, node, &range, &number)) return false;
    if (number != floor(number))
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is %.15g; must be %s", number, text);
    *value = (int)number;
    return true;
}

bool nb_key_value_numbers(nb_json *json, const nb_json_node *node, const nb_range *range, size_t count, double *values)
{
    if (node == NULL) return true;
    if (node->type != NB_JSON_ARRAY)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is %s; must be an array of %zu numbers",
                            nb_json_type_name(node->type), count);
    if (node->count != count)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "has %lu elements; must be an array of %zu numbers%s",
                            (unsigned long)node->count, count,
                            node->count == 2 * count ? "; decimals have a point, 0.5" : "");
    const nb_json_node *element = nb_json_first(json, node);
    for (size_t i = 0; i < count; i++, element = nb_json_next(json, element))
        if (!nb_key_value_number(json, element, range, &values[i])) return false;
    return true;
}

bool nb_key_value_place(nb_json *json, const nb_json_node *node, double place[3])
{
    return nb_key_value_numbers(json, node, &nb_range_place, 3, place);
}

static bool is_zero(const double *vector, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (vector[i] != 0) return false;
    return true;
}

bool nb_key_value_check_direction(nb_json *json, const nb_json_node *node, const double vector[3])
{
    const double length = hypot(hypot(vector[0], vector[1]), vector[2]);
    if (length == 0) return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "has no direction; one number must not be 0");
    if (length >= NEBEL_MIN_DIRECTION && length <= NEBEL_MAX_DIRECTION) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                        "is %.15g long; the length of a direction must be from " NB_TEXT(
                            NEBEL_MIN_DIRECTION) " to " NB_TEXT(NEBEL_MAX_DIRECTION) ", 1 for example",
                        length);
}

bool nb_key_value_direction(nb_json *json, const nb_json_node *node, double vector[3])
{
    if (node == NULL) return true;
    return nb_key_value_numbers(json, node, &nb_range_any, 3, vector) &&
           nb_key_value_check_direction(json, node, vector);
}

bool nb_key_value_quaternion(nb_json *json, const nb_json_node *node, double rotation[4])
{
    if (node == NULL) return true;
    if (!nb_key_value_numbers(json, node, &nb_range_any, 4, rotation)) return false;
    if (is_zero(rotation, 4))
        return nb_json_fail(
            json, NEBEL_ERROR_FORMAT, node,
            "a quaternion [x, y, z, w] of zeros is no rotation; [0, 0, 0, 1] leaves things as they are");
    double most = 0;
    for (int i = 0; i < 4; i++) most = fmax(most, fabs(rotation[i]));
    int exponent;
    frexp(most, &exponent);
    for (int i = 0; i < 4; i++) rotation[i] = ldexp(rotation[i], -exponent);
    return true;
}

bool nb_key_value_rotation(nb_json *json, const nb_json_node *node, double rotation[4])
{
    if (!nb_key_value_quaternion(json, node, rotation)) return false;
    if (node != NULL) nb_vector_normalize(rotation, 4);
    return true;
}

static bool read_one_or_three(nb_json *json, const nb_json_node *node, const nb_range *range, const char *wanted,
                              double values[3])
{
    if (node->type == NB_JSON_ARRAY) return nb_key_value_numbers(json, node, range, 3, values);
    if (!nb_key_value_is(json, node, NB_JSON_NUMBER, wanted) || !nb_key_value_number(json, node, range, &values[0]))
        return false;
    values[1] = values[2] = values[0];
    return true;
}

bool nb_key_value_scale(nb_json *json, const nb_json_node *node, double scale[3])
{
    return node == NULL || read_one_or_three(json, node, &nb_range_factor, "a number or an array of 3 numbers", scale);
}

bool nb_key_value_amount(nb_json *json, const nb_json_node *node, const nb_range *range, double rgb[3])
{
    if (node == NULL) return true;
    return read_one_or_three(json, node, range, "a number or an array of 3 numbers [r, g, b]", rgb);
}

/* IEC 61966-2-1:1999, section 5.2. */
double nb_key_value_linear_from_srgb(double value)
{
    return value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
}

/* "#rgb" is short for "#rrggbb". */
static bool parse_color(const char *text, size_t size, double color[3])
{
    if ((size != 4 && size != 7) || text[0] != '#') return false;
    const size_t digits = size / 3;
    for (size_t i = 0; i < 3; i++) {
        const int high = nb_text_hex_digit(text[1 + i * digits]), low = nb_text_hex_digit(text[(i + 1) * digits]);
        if (high < 0 || low < 0) return false;
        color[i] = nb_key_value_linear_from_srgb((16 * high + low) / 255.0);
    }
    return true;
}

bool nb_key_value_color(nb_json *json, const nb_json_node *node, const nb_range *range, double color[3])
{
    if (node == NULL) return true;
    if (node->type != NB_JSON_STRING)
        return read_one_or_three(json, node, range, "a number, an array of 3 numbers [r, g, b], or \"#rrggbb\"", color);
    if (parse_color(node->string, node->string_size, color)) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                        "is no color; \"#\" and 6 hexadecimal digits, as in \"#ffcc88\", or 3 of them, are sRGB");
}

/* ---- arrays ---------------------------------------------------------------------------------- */

bool nb_key_value_at_most(nb_json *json, const nb_json_node *array, uint32_t most, const char *owner, const char *what)
{
    for (const nb_json_node *one = nb_json_first(json, array); one != NULL; one = nb_json_next(json, one))
        if (one->index == most)
            return nb_json_fail(json, NEBEL_ERROR_LIMIT, one, "is one too many; %s has at most %u %s", owner,
                                (unsigned)most, what);
    return true;
}

/* ---- what the core says ---------------------------------------------------------------------- */

const char *nb_key_value_note_unit(const nb_json *json, char note[NB_UNIT_NOTE])
{
    note[0] = '\0';
    if (json->unit != 1) snprintf(note, NB_UNIT_NOTE, " (in metres; the file's unit is %.15g m)", json->unit);
    return note;
}

/* The innermost of a node and what it holds that the path leads to or through. */
static const nb_json_node *find_on_path(const nb_json *json, const nb_json_node *node, const char *path)
{
    for (const nb_json_node *one = nb_json_first(json, node); one != NULL;) {
        char here[NB_JSON_PATH];
        nb_json_path(json, one, here);
        const size_t size = strlen(here);
        const bool is_on_path = strncmp(path, here, size) == 0 && strchr(".[", path[size]) != NULL;
        if (is_on_path) node = one;
        one = is_on_path ? nb_json_first(json, node) : nb_json_next(json, one);
    }
    return node;
}

bool nb_key_value_fail_within(nb_json *json, const nb_json_node *object, const char *message, const char *more)
{
    char outer[NB_JSON_PATH], path[2 * NB_JSON_PATH], note[NB_UNIT_NOTE];
    const int step = (int)strcspn(message, ":");
    nb_json_path(json, object, outer);
    snprintf(path, sizeof path, "%s.%.*s", outer, step, message);
    return nb_json_fail_at(json, NEBEL_ERROR_FORMAT, find_on_path(json, object, path)->offset, path, "%s%s%s",
                           message + step + 2, more, nb_key_value_note_unit(json, note));
}

/* ---- text ------------------------------------------------------------------------------------ */

bool nb_key_value_text(nb_json *json, const nb_json_node *node, nb_arena *arena, const char **text)
{
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_STRING, "a string")) return false;
    if (node->string_size > 0 && memchr(node->string, '\0', node->string_size) != NULL)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds a zero character (\\u0000); remove it");
    *text = nb_arena_copy_text(arena, node->string, node->string_size);
    return *text != NULL || nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
}
