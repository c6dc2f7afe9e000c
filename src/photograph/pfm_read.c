/* Portable float maps: "Pf", width, height, scale, then floats from the bottom row up; a negative scale says little endian. Source:
 * P. Debevec, "PFM Portable FloatMap Image Format". */
#include "depth_read.h"

#include <ctype.h>
#include <stdio.h>

bool nb_pfm_is(const nb_bytes *bytes)
{
    return bytes->size >= 3 && bytes->data[0] == 'P' && (bytes->data[1] == 'f' || bytes->data[1] == 'F') &&
           isspace(bytes->data[2]);
}

static nebel_result fail_pfm(const nb_codec *codec, const char *what)
{
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: not a good PFM: %s", codec->name, what);
}

/* The next word of the header, up to 31 letters, and one white space behind it; "" where there is none. */
static void read_word(const nb_bytes *bytes, size_t *at, char word[32])
{
    size_t size = 0;
    while (*at < bytes->size && isspace(bytes->data[*at])) (*at)++;
    while (*at < bytes->size && !isspace(bytes->data[*at]) && size < 31) word[size++] = (char)bytes->data[(*at)++];
    word[size] = '\0';
    if (*at < bytes->size) (*at)++;
}

/* 0: it is no whole number from 1 to 9 digits. */
static uint64_t whole_of(const char *word)
{
    uint64_t number = 0;
    const size_t size = strlen(word);
    if (size == 0 || size > 9 || strspn(word, "0123456789") != size) return 0;
    for (; *word != '\0'; word++) number = number * 10 + (uint64_t)(*word - '0');
    return number;
}

/* Digits, and what belongs to a number, with one sign at most before it; all but zeros. Its size does not matter, as that of most
 * files is 1. */
static bool is_scale(const char *word)
{
    const char *const digits = word + (*word == '-' || *word == '+');
    return strspn(digits, "0123456789.eE+-") == strlen(digits) && strpbrk(digits, "123456789") != NULL &&
           (isdigit((unsigned char)*digits) || *digits == '.');
}

static float read_float(const unsigned char *at, bool is_little)
{
    float number;
    uint32_t bits = 0;
    for (int i = 0; i < 4; i++) bits |= (uint32_t)at[is_little ? i : 3 - i] << 8 * i;
    memcpy(&number, &bits, sizeof number);
    return number;
}

nebel_result nb_pfm_read(const nb_codec *codec, const nb_bytes *bytes, nb_depth_numbers *numbers)
{
    char width[32], height[32], scale[32];
    size_t at = 3;
    if (bytes->data[1] == 'F') return fail_pfm(codec, "it is a picture in color; depth is \"Pf\", one number a pixel");
    read_word(bytes, &at, width);
    read_word(bytes, &at, height);
    read_word(bytes, &at, scale);
    const uint64_t w = whole_of(width), h = whole_of(height);
    if (w == 0 || h == 0 || !is_scale(scale)) return fail_pfm(codec, "its header has no width, height and scale");
    const nebel_result result = nb_depth_allocate(codec, w, h, NEBEL_DEPTH_FILES_FLOAT, numbers);
    if (result != NEBEL_OK) return result;
    if (bytes->size - at < w * h * sizeof(float)) return fail_pfm(codec, "the file ends too early");
    for (size_t y = 0; y < h; y++)
        for (size_t x = 0; x < w; x++)
            numbers->floats[(h - 1 - y) * w + x] = read_float(bytes->data + at + (y * w + x) * 4, scale[0] == '-');
    return NEBEL_OK;
}
