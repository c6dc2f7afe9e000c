#include "ray_reader.h"

#include "decimal.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 7, TMAX = 6, QUOTED = 40 };

static const char *const number_names[NUMBERS] = {"ox", "oy", "oz", "dx", "dy", "dz", "tmax"};

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
static int
reject(nb_ray_list *rays, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(rays->problem, sizeof rays->problem, format, arguments);
    va_end(arguments);
    return 0;
}

static int is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static int reserve_entry(nb_ray_list *rays)
{
    if (rays->count < rays->capacity) return 1;
    const size_t most = SIZE_MAX / sizeof *rays->entries;
    const size_t wanted = rays->capacity == 0 ? 1024 : rays->capacity <= most / 2 ? 2 * rays->capacity : 0;
    nb_rays_entry *const grown = wanted > 0 ? realloc(rays->entries, wanted * sizeof *grown) : NULL;
    if (grown == NULL) return reject(rays, "out of memory after %zu rays; trace them in parts", rays->count);
    rays->entries = grown;
    rays->capacity = wanted;
    return 1;
}

static int read_number(nb_ray_list *rays, const char *text, size_t size, int which, double *number)
{
    const int shown = size < QUOTED ? (int)size : QUOTED;
    const char *const more = size > QUOTED ? "..." : "";
    switch (nb_decimal_read(text, size, number)) {
    case NB_DECIMAL_GOOD:
        break;
    case NB_DECIMAL_TOO_LARGE:
        return reject(rays, "%s is '%.*s%s', which no 64-bit number holds; write a smaller one", number_names[which],
                      shown, text, more);
    case NB_DECIMAL_MALFORMED:
        return reject(rays, "%s is '%.*s%s', which is no number; write a decimal number such as 1, -0.5 or 2e3%s",
                      number_names[which], shown, text, more,
                      memchr(text, ',', size) != NULL ? "; blanks or tabs stand between them, no commas" : "");
    }
    if (which != TMAX && isinf(*number)) {
        return reject(rays, "%s is infinite; only tmax may be inf", number_names[which]);
    }
    return 1;
}

/* Up to NUMBERS + 1 numbers, so that one too many is seen. Returns how many, or -1 on an error. */
static int read_numbers(nb_ray_list *rays, const char *text, const char *end, double *numbers)
{
    int count = 0;
    for (;;) {
        while (text < end && is_blank(*text)) text++;
        if (text == end || count > NUMBERS) return count;
        const char *const start = text;
        while (text < end && !is_blank(*text)) text++;
        if (count < NUMBERS && !read_number(rays, start, (size_t)(text - start), count, &numbers[count])) return -1;
        count++;
    }
}

static int check_ray(nb_ray_list *rays, const double *numbers)
{
    if (numbers[3] == 0 && numbers[4] == 0 && numbers[5] == 0) {
        return reject(rays, "the direction dx dy dz is 0 0 0; give it a length");
    }
    if (numbers[TMAX] < 0) return reject(rays, "tmax is %g; it is a length: 0 or more, or inf", numbers[TMAX]);
    return 1;
}

static int take_line(nb_ray_list *rays, const char *text, size_t size)
{
    if (rays->line == 1 && size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
        size -= 3;
    }
    if (size > 0 && text[size - 1] == '\r') size--;
    const char *const comment = memchr(text, '#', size);
    double n[NUMBERS];
    const int count = read_numbers(rays, text, comment != NULL ? comment : text + size, n);
    if (count <= 0) return count == 0;
    if (count != NUMBERS) {
        return reject(rays, "%s %d numbers where 7 belong; write ox oy oz dx dy dz tmax",
                      count > NUMBERS ? "more than" : "only", count > NUMBERS ? NUMBERS : count);
    }
    if (!check_ray(rays, n) || !reserve_entry(rays)) return 0;
    rays->entries[rays->count++] =
        (nb_rays_entry){.ray = {.origin = {n[0], n[1], n[2]}, .direction = {n[3], n[4], n[5]}, .t_max = n[TMAX] + 0.},
                        .line = rays->line};
    return 1;
}

static int reject_length(nb_ray_list *rays)
{
    return reject(rays, "the line is longer than %d bytes; break it up", NB_RAYS_LONGEST_LINE);
}

/* Keeps the beginning of a line until its end comes. */
static int keep_partial(nb_ray_list *rays, const char *data, size_t size)
{
    if (size > NB_RAYS_LONGEST_LINE - rays->partial_size) return reject_length(rays);
    if (rays->partial == NULL) rays->partial = malloc(NB_RAYS_LONGEST_LINE);
    if (rays->partial == NULL) return reject(rays, "out of memory");
    memcpy(rays->partial + rays->partial_size, data, size);
    rays->partial_size += size;
    return 1;
}

static int take_partial(nb_ray_list *rays)
{
    const size_t size = rays->partial_size;
    rays->partial_size = 0;
    return take_line(rays, rays->partial, size);
}

int nb_rays_feed(nb_ray_list *rays, const char *data, size_t size)
{
    const char *const end = data + size;
    while (data < end) {
        if (rays->partial_size == 0) rays->line++;
        const char *const newline = memchr(data, '\n', (size_t)(end - data));
        const size_t length = (size_t)((newline != NULL ? newline : end) - data);
        if (newline == NULL) return keep_partial(rays, data, length);
        if (rays->partial_size > 0) {
            if (!keep_partial(rays, data, length) || !take_partial(rays)) return 0;
        } else if (length > NB_RAYS_LONGEST_LINE) {
            return reject_length(rays);
        } else if (!take_line(rays, data, length)) {
            return 0;
        }
        data = newline + 1;
    }
    return 1;
}

int nb_rays_finish(nb_ray_list *rays)
{
    return rays->partial_size == 0 || take_partial(rays);
}

void nb_rays_free(nb_ray_list *rays)
{
    free(rays->entries);
    free(rays->partial);
    *rays = (nb_ray_list){0};
}
