#include "scene/edit.h"

#include <stdio.h>
#include <string.h>

/* ---- pieces
 * ---------------------------------------------------------------------------------------------------------- */

static void add_piece(nb_edit *edit, size_t offset, size_t size, const char *words)
{
    void *pieces = edit->pieces;
    char *copy = nb_arena_copy_text(&edit->arena, words, strlen(words));
    if (copy == NULL || !nb_grow(&edit->arena.allocator, &pieces, sizeof *edit->pieces, edit->count, &edit->capacity,
                                 edit->count + 1)) {
        edit->out_of_memory = true;
        return;
    }
    edit->pieces = pieces;
    edit->pieces[edit->count++] = (nb_edit_piece){offset, size, copy};
}

/* By place, and by age where several are added at one place, which qsort would not keep. There are few pieces, and most
 * come in order. */
static void sort_pieces(nb_edit *edit)
{
    for (size_t i = 1; i < edit->count; i++)
        for (size_t k = i; k > 0 && edit->pieces[k - 1].offset > edit->pieces[k].offset; k--) {
            const nb_edit_piece later = edit->pieces[k - 1];
            edit->pieces[k - 1] = edit->pieces[k];
            edit->pieces[k] = later;
        }
}

static bool append(const nb_edit *edit, nb_bytes *bytes, const char *words, size_t size)
{
    return nb_bytes_write(&edit->arena.allocator, bytes, bytes->size, words, size);
}

bool nb_edit_apply(nb_edit *edit, nb_bytes *bytes)
{
    size_t at = 0;
    *bytes = (nb_bytes){0};
    sort_pieces(edit);
    bool good = !edit->out_of_memory;
    for (size_t i = 0; i < edit->count && good; i++) {
        const nb_edit_piece *piece = &edit->pieces[i];
        good = append(edit, bytes, edit->text + at, piece->offset - at) &&
               append(edit, bytes, piece->words, strlen(piece->words));
        at = piece->offset + piece->size;
    }
    if (good && append(edit, bytes, edit->text + at, edit->size - at)) return true;
    nb_release(&edit->arena.allocator, bytes->data);
    return false;
}

void nb_edit_release(nb_edit *edit)
{
    nb_release(&edit->arena.allocator, edit->pieces);
    nb_arena_release(&edit->arena);
}

/* ---- values
 * ---------------------------------------------------------------------------------------------------------- */

/* 15 digits: all that a decimal number keeps on its way through a double, so that 0.1 stays 0.1 and conversions of
 * units leave no dust. */
static int write_number(double number, char *text, size_t size)
{
    const int length = snprintf(text, size, "%.15g", number + 0.0);
    for (int i = 0; i < length; i++)
        if (strchr("0123456789+-e", text[i]) == NULL) text[i] = '.'; /* the locale's */
    return length;
}

void nb_edit_write_numbers(size_t count, const double *numbers, nb_edit_style style, char *text)
{
    const size_t size = NB_EDIT_NUMBERS;
    bool is_one = count == 1;
    if (style == NB_EDIT_AMOUNT && count == 3) is_one = numbers[0] == numbers[1] && numbers[1] == numbers[2];
    if (is_one) {
        write_number(numbers[0], text, size);
        return;
    }
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        used += (size_t)snprintf(text + used, size - used, "%s", i == 0 ? "[" : ", ");
        used += (size_t)write_number(numbers[i], text + used, size - used);
    }
    snprintf(text + used, size - used, "]");
}

void nb_edit_replace(nb_edit *edit, const nb_json_node *node, const char *value)
{
    add_piece(edit, node->offset, node->end - node->offset, value);
}

const nb_json_node *nb_edit_member(const nb_json *json, const nb_json_node *object, const char *key)
{
    if (object == NULL || object->type != NB_JSON_OBJECT) return NULL;
    const nb_json_node *node = nb_json_first(json, object);
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

nb_edit_object nb_edit_find(const nb_json *json, const nb_json_node *object)
{
    nb_edit_object found = {.node = object};
    if (object == NULL) return found;
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node)) {
        found.last_key = node->key_offset;
        found.last_end = node->end;
    }
    return found;
}

/* ---- new members
 * ----------------------------------------------------------------------------------------------------- */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/* Where the remark ends that stands behind a value on its line; `at` where there is none. */
static size_t skip_remark(const nb_edit *edit, size_t at)
{
    size_t end = at;
    while (end < edit->size && (edit->text[end] == ' ' || edit->text[end] == '\t')) end++;
    if (edit->size - end < 2 || edit->text[end] != '/' || edit->text[end + 1] != '/') return at;
    while (end < edit->size && edit->text[end] != '\n' && edit->text[end] != '\r') end++;
    return end;
}

/* Whether another member was added there before. */
static bool has_comma(const nb_edit *edit, size_t offset)
{
    for (size_t i = 0; i < edit->count; i++)
        if (edit->pieces[i].offset == offset && strcmp(edit->pieces[i].words, ",") == 0) return true;
    return false;
}

/* A new member stands behind the last one as that one's key stands behind what is before it: on a line of its own or on
 * the same. A remark stays with the value that it follows. */
void nb_edit_add(nb_edit *edit, const nb_edit_object *object, const char *key, const char *value)
{
    char words[4 * NB_EDIT_NUMBERS + 128], gap[64] = " ";
    size_t start = object->last_key;
    while (start > 0 && is_blank(edit->text[start - 1])) start--;
    const size_t gap_size = object->last_key - start;
    if (gap_size > 0 && gap_size < sizeof gap) snprintf(gap, sizeof gap, "%.*s", (int)gap_size, edit->text + start);
    const size_t behind = skip_remark(edit, object->last_end);
    if (behind > object->last_end && strchr(gap, '\n') == NULL) strcpy(gap, "\n");
    const bool is_second = has_comma(edit, object->last_end);
    if (!is_second) add_piece(edit, object->last_end, 0, ",");
    snprintf(words, sizeof words, "%s%s\"%s\": %s", is_second ? "," : "", gap, key, value);
    add_piece(edit, behind, 0, words);
}

/* ---- numbers
 * --------------------------------------------------------------------------------------------------------- */

static void replace_elements(nb_edit *edit, const nb_json *json, const nb_json_node *array, const double *was,
                             const double *now)
{
    char text[NB_EDIT_NUMBERS];
    size_t i = 0;
    for (const nb_json_node *node = nb_json_first(json, array); node != NULL; node = nb_json_next(json, node), i++) {
        if (was[i] == now[i]) continue;
        nb_edit_write_numbers(1, &now[i], NB_EDIT_EACH, text);
        nb_edit_replace(edit, node, text);
    }
}

void nb_edit_numbers(nb_edit *edit, const nb_json *json, const nb_edit_object *object, const char *key, size_t count,
                     const double *was, const double *now, nb_edit_style style)
{
    char text[NB_EDIT_NUMBERS];
    if (memcmp(was, now, count * sizeof *was) == 0) return;
    const nb_json_node *node = nb_edit_member(json, object->node, key);
    if (node != NULL && node->type == NB_JSON_ARRAY && node->count == count && style != NB_EDIT_WHOLE) {
        replace_elements(edit, json, node, was, now);
        return;
    }
    nb_edit_write_numbers(count, now, style, text);
    if (node != NULL)
        nb_edit_replace(edit, node, text);
    else
        nb_edit_add(edit, object, key, text);
}

void nb_edit_word(nb_edit *edit, const nb_json *json, const nb_edit_object *object, const char *key, const char *word)
{
    char text[NB_EDIT_NUMBERS];
    const nb_json_node *node = nb_edit_member(json, object->node, key);
    snprintf(text, sizeof text, "\"%s\"", word);
    if (node != NULL)
        nb_edit_replace(edit, node, text);
    else
        nb_edit_add(edit, object, key, text);
}
