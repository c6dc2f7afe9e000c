/* Text of a file: is it UTF-8, and which line and column is a byte on? */
#ifndef NB_JSON_UTF8_H
#define NB_JSON_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* 1-based; columns count characters (UTF-8 code points). */
typedef struct nb_text_place {
    size_t offset;
    size_t line, column;
} nb_text_place;

#define NB_TEXT_START ((nb_text_place){0, 1, 1})

/* Moves a place to `offset`, which may lie before it. Walking on through a text costs O(size) in all. */
void nb_text_move(const char *text, nb_text_place *place, size_t offset);

/* The length of the UTF-8 sequence at `at`; 0 where there is none (also for overlong forms and surrogates). */
size_t nb_text_sequence(const char *text, size_t size, size_t at);

/* Finds the first byte that is neither UTF-8 nor allowed in JSON (control characters except tab and line ends).
 * True when there is none; otherwise *offset says where. */
bool nb_text_is_clean(const char *text, size_t size, size_t *offset);

/* The value of a hexadecimal digit, -1 of any other character. */
int nb_text_hex_digit(char c);

/* True when \uXXXX, with four hexadecimal digits, stands at `at`. */
bool nb_text_is_unicode_escape(const char *raw, size_t size, size_t at);

/* True when the JSON string between the quotes escapes a lone half of a surrogate pair. */
bool nb_text_has_lone_surrogate(const char *raw, size_t size);

/* How many single-character edits lead from a to b, up to 64 characters; larger ones count as far apart. */
size_t nb_text_distance(const char *a, size_t a_size, const char *b, size_t b_size);

static inline bool nb_text_is_digit(char c)
{
    return c >= '0' && c <= '9';
}

#endif
