/* Arrays of NumPy: a magic word, the length of a header, the header (a Python dictionary), the numbers. Source: NEP 1, "A simple
 * file format for NumPy arrays". */
#include "depth_read.h"

#include <stdio.h>
#include <stdlib.h>

enum { MOST_HEADER = 4096 };

typedef struct header {
    char type[8];
    uint64_t width, height;
    size_t data; /* where the numbers begin */
} header;

bool nb_npy_is(const nb_bytes *bytes)
{
    return bytes->size >= 10 && memcmp(bytes->data, "\x93NUMPY", 6) == 0;
}

static nebel_result fail_npy(const nb_codec *codec, const char *what)
{
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: not a good NPY: %s", codec->name, what);
}

/* What stands behind a key, without blanks; NULL: no such key. */
static const char *find_key(const char *text, const char *key)
{
    const char *at = strstr(text, key);
    if (at == NULL) return NULL;
    at += strlen(key);
    at += strspn(at, " ");
    if (*at != ':') return NULL;
    at++;
    return at + strspn(at, " ");
}

/* 0 unless there is a whole number from 1 to 9 digits; *at is then behind it and the blanks that follow. */
static uint64_t read_whole(const char **at)
{
    const size_t digits = strspn(*at, "0123456789");
    if (digits == 0 || digits > 9) return 0;
    const uint64_t number = strtoul(*at, NULL, 10);
    *at += digits;
    *at += strspn(*at, " ");
    return number;
}

/* "(height, width)" */
static bool read_shape(const char *at, header *head)
{
    if (at == NULL || *at != '(') return false;
    at++;
    head->height = read_whole(&at);
    if (head->height == 0 || *at != ',') return false;
    at++;
    at += strspn(at, " ");
    head->width = read_whole(&at);
    return head->width != 0 && (*at == ')' || (*at == ',' && at[1] == ')'));
}

static nebel_result read_dictionary(const nb_codec *codec, const char *text, header *head)
{
    const char *type = find_key(text, "'descr'"), *order = find_key(text, "'fortran_order'");
    if (type == NULL || order == NULL || *type != '\'') return fail_npy(codec, "its header is not understood");
    const size_t size = strcspn(type + 1, "'");
    if (size >= sizeof head->type) return fail_npy(codec, "its numbers have names; save one array of numbers");
    memcpy(head->type, type + 1, size);
    head->type[size] = '\0';
    if (strncmp(order, "False", 5) != 0)
        return fail_npy(codec, "it is in Fortran's order; save numpy.ascontiguousarray of it");
    if (!read_shape(find_key(text, "'shape'"), head))
        return fail_npy(codec, "depth has two dimensions, rows and columns; save array.squeeze()");
    return NEBEL_OK;
}

static nebel_result read_header(const nb_codec *codec, const nb_bytes *bytes, header *head)
{
    char text[MOST_HEADER + 1];
    const unsigned char *b = bytes->data;
    const size_t start = b[6] == 1 ? 10 : 12;
    if (bytes->size < start) return fail_npy(codec, "the file ends too early");
    const size_t size = b[6] == 1 ? (size_t)b[8] | (size_t)b[9] << 8
                                  : (size_t)b[8] | (size_t)b[9] << 8 | (size_t)b[10] << 16 | (size_t)b[11] << 24;
    if (size > MOST_HEADER || size > bytes->size - start) return fail_npy(codec, "its header is too long");
    memcpy(text, b + start, size);
    text[size] = '\0';
    head->data = start + size;
    return read_dictionary(codec, text, head);
}

static float float_of(const unsigned char *at)
{
    uint32_t bits = 0;
    float number;
    for (int i = 0; i < 4; i++) bits |= (uint32_t)at[i] << 8 * i;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static float float_of_double(const unsigned char *at)
{
    uint64_t bits = 0;
    double number;
    for (int i = 0; i < 8; i++) bits |= (uint64_t)at[i] << 8 * i;
    memcpy(&number, &bits, sizeof number);
    return (float)number;
}

static void convert_npy(const nb_bytes *bytes, const header *head, size_t size, nb_depth_numbers *numbers)
{
    const unsigned char *at = bytes->data + head->data;
    for (size_t i = 0; i < head->width * head->height; i++, at += size) {
        if (size == 2)
            numbers->shorts[i] = (uint16_t)(at[0] | at[1] << 8);
        else
            numbers->floats[i] = size == 4 ? float_of(at) : float_of_double(at);
    }
}

nebel_result nb_npy_read(const nb_codec *codec, const nb_bytes *bytes, nb_depth_numbers *numbers)
{
    static const struct {
        const char *name;
        size_t size;
        int files;
    } types[] = {
        {"<f4", 4, NEBEL_DEPTH_FILES_FLOAT}, {"<f8", 8, NEBEL_DEPTH_FILES_FLOAT}, {"<u2", 2, NEBEL_DEPTH_FILES_16_BIT}};
    header head = {0};
    nebel_result result = read_header(codec, bytes, &head);
    if (result != NEBEL_OK) return result;
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (strcmp(head.type, types[i].name) != 0) continue;
        result = nb_depth_allocate(codec, head.width, head.height, types[i].files, numbers);
        if (result != NEBEL_OK) return result;
        if ((bytes->size - head.data) / types[i].size / head.width < head.height)
            return fail_npy(codec, "the file ends too early");
        convert_npy(bytes, &head, types[i].size, numbers);
        return NEBEL_OK;
    }
    return nb_fail(&codec->log, NEBEL_ERROR_UNSUPPORTED,
                   "%s: an array of '%s'; save it as float32, float64 or uint16, little endian", codec->name,
                   head.type);
}
