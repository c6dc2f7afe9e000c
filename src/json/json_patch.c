#include "json_patch.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* A volume has no more members than this. */
enum { NB_EDIT_MEMBERS = 32 };

/* ---- pieces ---------------------------------------------------------------------------------- */

void nb_json_patch_put(nb_edit *edit, size_t offset, size_t size, const char *words)
{
    void *pieces = edit->pieces;
    char *copy = nb_arena_copy_text(&edit->arena, words, strlen(words));
    if (copy == NULL || !nb_grow(&edit->arena.allocator, &pieces, sizeof *edit->pieces, edit->count, &edit->capacity,
                                 edit->count + 1)) {
        edit->out_of_memory = true;
        return;
    }
    edit->pieces = pieces;
    edit->pieces[edit->count++] = (nb_json_patch_piece){offset, size, copy};
}

/* By place, and by age where several are added at one place, which qsort would not keep. There are few pieces, and most
 * come in order. */
static void sort_pieces(nb_edit *edit)
{
    for (size_t i = 1; i < edit->count; i++)
        for (size_t k = i; k > 0 && edit->pieces[k - 1].offset > edit->pieces[k].offset; k--) {
            const nb_json_patch_piece later = edit->pieces[k - 1];
            edit->pieces[k - 1] = edit->pieces[k];
            edit->pieces[k] = later;
        }
}

static bool append(const nb_edit *edit, nb_bytes *bytes, const char *words, size_t size)
{
    return nb_bytes_write(&edit->arena.allocator, bytes, bytes->size, words, size);
}

bool nb_json_patch_apply(nb_edit *edit, nb_bytes *bytes)
{
    size_t at = 0;
    *bytes = (nb_bytes){0};
    sort_pieces(edit);
    bool good = !edit->out_of_memory;
    for (size_t i = 0; i < edit->count && good; i++) {
        const nb_json_patch_piece *piece = &edit->pieces[i];
        good = append(edit, bytes, edit->text + at, piece->offset - at) &&
               append(edit, bytes, piece->words, strlen(piece->words));
        at = piece->offset + piece->size;
    }
    if (good && append(edit, bytes, edit->text + at, edit->size - at)) return true;
    nb_release(&edit->arena.allocator, bytes->data);
    return false;
}

void nb_json_patch_release(nb_edit *edit)
{
    nb_release(&edit->arena.allocator, edit->pieces);
    nb_arena_release(&edit->arena);
}

/* ---- values ---------------------------------------------------------------------------------- */

/* 15 digits: all that a decimal number keeps on its way through a double, so that 0.1 stays 0.1 and conversions of
 * units leave no dust. */
static int write_number(double number, char *text, size_t size)
{
    const int length = snprintf(text, size, "%.15g", number + 0.0);
    for (int i = 0; i < length; i++)
        if (strchr("0123456789+-e", text[i]) == NULL) text[i] = '.'; /* the locale's */
    return length;
}

void nb_json_patch_write_numbers(size_t count, const double *numbers, nb_json_patch_style style, char *text)
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

void nb_json_patch_replace(nb_edit *edit, const nb_json_node *node, const char *value)
{
    nb_json_patch_put(edit, node->offset, node->end - node->offset, value);
}

const nb_json_node *nb_json_patch_member(const nb_json *json, const nb_json_node *object, const char *key)
{
    if (object == NULL || object->type != NB_JSON_OBJECT) return NULL;
    const nb_json_node *node = nb_json_first(json, object);
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

nb_json_patch_object nb_json_patch_find(const nb_json *json, const nb_json_node *object)
{
    nb_json_patch_object found = {.node = object};
    if (object == NULL) return found;
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node)) {
        found.last_key = node->key_offset;
        found.last_end = node->end;
    }
    return found;
}

/* ---- new members ----------------------------------------------------------------------------- */

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

/* Words that may be of any length: printed twice, once for their size. */
NB_PRINTF(4, 5) static void put_words(nb_edit *edit, size_t offset, size_t size, const char *format, ...)
{
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = vsnprintf(NULL, 0, format, arguments);
    va_end(arguments);
    char *words = length < 0 ? NULL : nb_allocate(&edit->arena.allocator, (size_t)length + 1, 1);
    if (words != NULL) {
        vsnprintf(words, (size_t)length + 1, format, again);
        nb_json_patch_put(edit, offset, size, words);
    } else {
        edit->out_of_memory = true;
    }
    va_end(again);
    nb_release(&edit->arena.allocator, words);
}

/* A new member stands behind the last one as that one's key stands behind what is before it: on a line of its own or on
 * the same. A remark stays with the value that it follows. */
void nb_json_patch_add(nb_edit *edit, const nb_json_patch_object *object, const char *key, const char *value)
{
    char gap[64] = " ";
    size_t start = object->last_key;
    while (start > 0 && is_blank(edit->text[start - 1])) start--;
    const size_t gap_size = object->last_key - start;
    if (gap_size > 0 && gap_size < sizeof gap) snprintf(gap, sizeof gap, "%.*s", (int)gap_size, edit->text + start);
    const size_t behind = skip_remark(edit, object->last_end);
    if (behind > object->last_end && strchr(gap, '\n') == NULL) strcpy(gap, "\n");
    const bool is_second = has_comma(edit, object->last_end);
    if (!is_second) nb_json_patch_put(edit, object->last_end, 0, ",");
    put_words(edit, behind, 0, "%s%s\"%s\": %s", is_second ? "," : "", gap, key, value);
}

/* ---- what goes ------------------------------------------------------------------------------- */

/* The first comma from `at` on that is in no remark. Between two elements there is one. */
static size_t find_comma(const nb_edit *edit, size_t at)
{
    while (at < edit->size && edit->text[at] != ',') {
        const char *line_end = NULL;
        const size_t left = edit->size - at;
        if (left > 1 && memcmp(edit->text + at, "//", 2) == 0) {
            line_end = memchr(edit->text + at, '\n', left);
            at = line_end != NULL ? (size_t)(line_end - edit->text) : edit->size;
        } else if (left > 1 && memcmp(edit->text + at, "/*", 2) == 0) {
            at += 2;
            while (at + 2 < edit->size && memcmp(edit->text + at, "*/", 2) != 0) at++;
            at += 2;
        } else {
            at++;
        }
    }
    return at;
}

static bool is_all_blank(const nb_edit *edit, size_t from, size_t to)
{
    while (from < to && is_blank(edit->text[from])) from++;
    return from == to;
}

/* The piece from `from` to `to`, without what stands between `gap` and `gap_end` in it where that is not blank. */
static void cut(nb_edit *edit, size_t from, size_t gap, size_t gap_end, size_t to)
{
    if (is_all_blank(edit, gap, gap_end)) {
        nb_json_patch_put(edit, from, to - from, "");
        return;
    }
    nb_json_patch_put(edit, from, gap - from, "");
    nb_json_patch_put(edit, gap_end, to - gap_end, "");
}

/* Behind one that stays, the comma before it goes as well; otherwise the one behind it. */
void nb_json_patch_remove(nb_edit *edit, const nb_json_patch_span *spans, size_t count)
{
    bool has_kept = false;
    for (size_t i = 0; i < count; i++) {
        const nb_json_patch_span *span = &spans[i];
        if (!span->goes) {
            has_kept = true;
        } else if (has_kept) {
            const size_t comma = find_comma(edit, spans[i - 1].end);
            cut(edit, comma, comma + 1, span->offset, span->end);
        } else if (i + 1 < count) {
            const size_t comma = find_comma(edit, span->end), next = spans[i + 1].offset;
            cut(edit, span->offset, span->end, comma, is_all_blank(edit, comma + 1, next) ? next : comma + 1);
        } else {
            nb_json_patch_put(edit, span->offset, span->end - span->offset, "");
        }
    }
}

static bool is_among(const nb_json_node *node, const char *const *keys)
{
    while (*keys != NULL && !nb_json_has_key(node, *keys)) keys++;
    return *keys != NULL;
}

void nb_json_patch_remove_members(nb_edit *edit, const nb_json *json, const nb_json_node *object,
                                  const char *const *keys)
{
    nb_json_patch_span spans[NB_EDIT_MEMBERS];
    size_t count = 0;
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL && count < NB_EDIT_MEMBERS;
         node = nb_json_next(json, node))
        spans[count++] = (nb_json_patch_span){node->key_offset, node->end, is_among(node, keys)};
    nb_json_patch_remove(edit, spans, count);
}

/* ---- numbers --------------------------------------------------------------------------------- */

void nb_json_patch_elements(nb_edit *edit, const nb_json *json, const nb_json_node *array, const double *was,
                            const double *now)
{
    char text[NB_EDIT_NUMBERS];
    size_t i = 0;
    for (const nb_json_node *node = nb_json_first(json, array); node != NULL; node = nb_json_next(json, node), i++) {
        if (was[i] == now[i]) continue;
        nb_json_patch_write_numbers(1, &now[i], NB_EDIT_EACH, text);
        nb_json_patch_replace(edit, node, text);
    }
}

void nb_json_patch_numbers(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object, const char *key,
                           size_t count, const double *was, const double *now, nb_json_patch_style style)
{
    char text[NB_EDIT_NUMBERS];
    if (memcmp(was, now, count * sizeof *was) == 0) return;
    const nb_json_node *node = nb_json_patch_member(json, object->node, key);
    if (node != NULL && node->type == NB_JSON_ARRAY && node->count == count && style != NB_EDIT_WHOLE) {
        nb_json_patch_elements(edit, json, node, was, now);
        return;
    }
    nb_json_patch_write_numbers(count, now, style, text);
    if (node != NULL)
        nb_json_patch_replace(edit, node, text);
    else
        nb_json_patch_add(edit, object, key, text);
}

bool nb_json_patch_write_text(const nebel_allocator *allocator, nb_bytes *bytes, const char *text)
{
    bool good = nb_bytes_write(allocator, bytes, bytes->size, "\"", 1);
    for (; *text != '\0' && good; text++) {
        char escaped[8];
        const char *form = *text == '"' || *text == '\\' ? "\\%c" : (unsigned char)*text < 0x20 ? "\\u%04x" : "%c";
        const int size = snprintf(escaped, sizeof escaped, form, *text);
        good = nb_bytes_write(allocator, bytes, bytes->size, escaped, (size_t)size);
    }
    return good && nb_bytes_write(allocator, bytes, bytes->size, "\"", 1);
}

void nb_json_patch_word(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object, const char *key,
                        const char *word)
{
    const nebel_allocator *allocator = &edit->arena.allocator;
    const nb_json_node *node = nb_json_patch_member(json, object->node, key);
    nb_bytes text = {0};
    if (!nb_json_patch_write_text(allocator, &text, word) || !nb_bytes_write(allocator, &text, text.size, "", 1))
        edit->out_of_memory = true;
    else if (node != NULL)
        nb_json_patch_replace(edit, node, (const char *)text.data);
    else
        nb_json_patch_add(edit, object, key, (const char *)text.data);
    nb_release(allocator, text.data);
}
