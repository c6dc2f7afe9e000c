#include "utf8.h"

#include <stdint.h>

void nb_text_move(const char *text, nb_text_place *place, size_t offset)
{
    if (offset < place->offset) *place = NB_TEXT_START;
    for (; place->offset < offset; place->offset++) {
        const unsigned char byte = (unsigned char)text[place->offset];
        if (byte == '\n') {
            place->line++;
            place->column = 1;
        } else if ((byte & 0xC0) != 0x80) {
            place->column++;
        }
    }
}

/* Unicode 15, table 3-7: the second byte's range rules out overlong forms, surrogates and values above U+10FFFF. */
size_t nb_text_sequence(const char *text, size_t size, size_t at)
{
    const unsigned char *byte = (const unsigned char *)text + at;
    const unsigned char lead = byte[0];
    if (lead < 0x80) return 1;
    if (lead < 0xC2 || lead > 0xF4) return 0;
    const size_t length = lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    if (size - at < length) return 0;
    const unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    if (byte[1] < low || byte[1] > high) return 0;
    for (size_t i = 2; i < length; i++)
        if ((byte[i] & 0xC0) != 0x80) return 0;
    return length;
}

bool nb_text_is_clean(const char *text, size_t size, size_t *offset)
{
    for (size_t at = 0; at < size;) {
        const unsigned char byte = (unsigned char)text[at];
        const bool control = (byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r') || byte == 0x7F;
        const size_t length = control ? 0 : byte < 0x80 ? 1 : nb_text_sequence(text, size, at);
        if (length == 0) {
            *offset = at;
            return false;
        }
        at += length;
    }
    return true;
}

int nb_text_hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/* The code unit of \uXXXX at `at`, or -1 where there is no such escape. */
static int32_t escaped_unit(const char *raw, size_t size, size_t at)
{
    if (size - at < 6 || raw[at] != '\\' || raw[at + 1] != 'u') return -1;
    int32_t unit = 0;
    for (size_t i = 2; i < 6; i++) {
        const int digit = nb_text_hex_digit(raw[at + i]);
        if (digit < 0) return -1;
        unit = unit * 16 + digit;
    }
    return unit;
}

bool nb_text_is_unicode_escape(const char *raw, size_t size, size_t at)
{
    return escaped_unit(raw, size, at) >= 0;
}

bool nb_text_has_lone_surrogate(const char *raw, size_t size)
{
    for (size_t at = 0; at < size;) {
        const int32_t unit = escaped_unit(raw, size, at);
        if (unit >= 0xDC00 && unit <= 0xDFFF) return true;
        if (unit >= 0xD800 && unit < 0xDC00) {
            const int32_t second = size - at >= 12 ? escaped_unit(raw, size, at + 6) : -1;
            if (second < 0xDC00 || second > 0xDFFF) return true;
            at += 12;
        } else if (unit >= 0) {
            at += 6;
        } else {
            at += raw[at] == '\\' ? 2 : 1;
        }
    }
    return false;
}

static size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Levenshtein's distance, one row of the table at a time. */
size_t nb_text_distance(const char *a, size_t a_size, const char *b, size_t b_size)
{
    enum { LONGEST = 64 };
    if (a_size > LONGEST || b_size > LONGEST) return SIZE_MAX;
    size_t row[LONGEST + 1];
    for (size_t j = 0; j <= b_size; j++) row[j] = j;
    for (size_t i = 1; i <= a_size; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b_size; j++) {
            const size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = smaller(replaced, smaller(row[j], row[j - 1]) + 1);
        }
    }
    return row[b_size];
}
