/* The light of fog, estimated from a picture by its dark channel. See nebel/photograph.h for the sources.
 *
 * Every number becomes a key of 16 bits that grows with it, so that ranks are found by counting. */
#include <nebel/photograph.h>

#include "image/image_codec.h"

#include <math.h>

/* Half the side of the square in which the darkest color is looked for, and its side. */
enum { REACH = 7, SIDE = 2 * REACH + 1, KEYS = 65536 };

typedef struct sampler {
    const unsigned char *pixels;
    size_t pixel_size, sample_size;
    bool is_float;
} sampler;

static bool make_sampler(const nebel_photograph *photograph, sampler *from)
{
    *from = (sampler){photograph->pixels, nebel_pixel_size(photograph->type), 4, false};
    switch (photograph->type) {
    case NEBEL_PIXEL_RGB8:
    case NEBEL_PIXEL_RGBA8:
        from->sample_size = 1;
        return true;
    case NEBEL_PIXEL_RGB16:
    case NEBEL_PIXEL_RGBA16:
        from->sample_size = 2;
        return true;
    case NEBEL_PIXEL_RGB_FLOAT:
    case NEBEL_PIXEL_RGBA_FLOAT:
        from->is_float = true;
        return true;
    default:
        return false;
    }
}

/* 0 to 1, or light. */
static double sample_of(const sampler *from, size_t pixel, size_t channel)
{
    const unsigned char *at = from->pixels + pixel * from->pixel_size + channel * from->sample_size;
    uint16_t whole;
    float real;
    if (from->is_float) {
        memcpy(&real, at, sizeof real);
        return real > 0 ? (double)real : 0; /* a NaN is none */
    }
    if (from->sample_size == 1) return *at / 255.0;
    memcpy(&whole, at, sizeof whole);
    return whole / 65535.0;
}

/* The upper half of a positive float's bits, without the sign: 8 bits of its significand. */
static uint16_t key_of(const sampler *from, double value)
{
    const float real = (float)value;
    uint32_t bits;
    if (!from->is_float) return (uint16_t)(value * 65535 + .5);
    memcpy(&bits, &real, sizeof bits);
    return (uint16_t)(bits >> 15);
}

/* ITU-R BT.601, as usual for brightness of stored color. */
static uint16_t brightness_of(const sampler *from, size_t pixel)
{
    return key_of(from, .299 * sample_of(from, pixel, 0) + .587 * sample_of(from, pixel, 1) +
                            .114 * sample_of(from, pixel, 2));
}

static void fill_darkest(const sampler *from, size_t count, uint16_t *keys)
{
    const unsigned char *at = from->pixels;
    if (from->sample_size == 1) {
        for (size_t i = 0; i < count; i++, at += from->pixel_size) {
            const unsigned low = at[0] < at[1] ? at[0] : at[1];
            keys[i] = (uint16_t)(257 * (low < at[2] ? low : at[2]));
        }
        return;
    }
    for (size_t i = 0; i < count; i++)
        keys[i] = key_of(from, fmin(sample_of(from, i, 0), fmin(sample_of(from, i, 1), sample_of(from, i, 2))));
}

/* ---- the least within a square --------------------------------------------------------------- */

/* to[i] = the lesser of a[i] and b[i]; `to` is apart from both. */
static void take_lesser(uint16_t *restrict to, const uint16_t *a, const uint16_t *b, size_t count)
{
    for (size_t i = 0; i < count; i++) to[i] = a[i] < b[i] ? a[i] : b[i];
}

/* Two rows with REACH largest keys before a row and SIDE behind it. */
typedef struct padding {
    uint16_t *a, *b;
} padding;

/* A row to the least of SIDE neighbors: of 2, 4, 8 and, where two of these overlap, 15. */
static void find_least_in_row(const padding *p, uint16_t *row, size_t width)
{
    const size_t whole = width + 2 * REACH;
    memcpy(p->a + REACH, row, width * sizeof *row);
    memset(p->a + REACH + width, 0xff, (REACH + SIDE) * sizeof *p->a);
    take_lesser(p->b, p->a, p->a + 1, whole + 6);
    take_lesser(p->a, p->b, p->b + 2, whole + 4);
    take_lesser(p->b, p->a, p->a + 4, whole);
    take_lesser(row, p->b, p->b + REACH, width);
    memset(p->a, 0xff, REACH * sizeof *p->a);
}

static void find_least_in_rows(uint16_t *keys, size_t width, size_t height, uint16_t *rows)
{
    const padding p = {rows, rows + width + 2 * SIDE};
    memset(p.a, 0xff, REACH * sizeof *p.a);
    for (size_t y = 0; y < height; y++) find_least_in_row(&p, keys + y * width, width);
}

/* The least of the rows from y on, of 2, 4 and 8, then of 8 that end at y and 8 that begin there. Rows behind the last count as
 * the last one, which changes nothing. Each step goes down, so that the row it reads is still as it was. */
static void find_least_in_columns(uint16_t *keys, uint16_t *eights, uint16_t *row, size_t width, size_t height)
{
    memcpy(eights, keys, width * height * sizeof *keys);
    for (size_t step = 1; step <= 4; step *= 2)
        for (size_t y = 0; y + 1 < height; y++) {
            const size_t other = y + step < height ? y + step : height - 1;
            take_lesser(row, eights + y * width, eights + other * width, width);
            memcpy(eights + y * width, row, width * sizeof *row);
        }
    for (size_t y = 0; y < height; y++) {
        const uint16_t *above = eights + (y > REACH ? y - REACH : 0) * width;
        take_lesser(keys + y * width, above, eights + y * width, width);
    }
}

/* ---- ranks ----------------------------------------------------------------------------------- */

/* The largest key that so many have or exceed. */
static uint16_t find_key_from_above(const uint32_t *counts, size_t wanted)
{
    size_t found = 0;
    int key = KEYS - 1;
    for (; key > 0; key--) {
        found += counts[key];
        if (found >= wanted) break;
    }
    return (uint16_t)key;
}

/* The key of the median, the lower one of two. */
static uint16_t find_median(const uint32_t *counts, size_t all)
{
    size_t found = 0;
    int key = 0;
    for (; key < KEYS - 1; key++) {
        found += counts[key];
        if (found > (all - 1) / 2) break;
    }
    return (uint16_t)key;
}

static void choose(const sampler *from, const uint16_t *dark, size_t count, uint32_t *counts, double airlight[3])
{
    size_t candidates = 0, i = 0;
    memset(counts, 0, KEYS * sizeof *counts);
    for (size_t k = 0; k < count; k++) counts[dark[k]]++;
    const uint16_t least = find_key_from_above(counts, count / 1000 > 1 ? count / 1000 : 1);
    memset(counts, 0, KEYS * sizeof *counts);
    for (size_t k = 0; k < count; k++) {
        if (dark[k] < least) continue;
        counts[brightness_of(from, k)]++;
        candidates++;
    }
    const uint16_t median = find_median(counts, candidates);
    while (dark[i] < least || brightness_of(from, i) != median) i++;
    for (size_t c = 0; c < 3; c++) airlight[c] = sample_of(from, i, c);
}

nebel_result nebel_estimate_airlight(const nebel_host *host, const nebel_photograph *photograph, double airlight[3])
{
    nb_codec codec;
    sampler from;
    if (host == NULL || photograph == NULL || airlight == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_codec_prepare(host, "airlight", &codec);
    if (result != NEBEL_OK) return result;
    const size_t width = photograph->width, height = photograph->height, count = width * height;
    if (photograph->pixels == NULL || count == 0 || !make_sampler(photograph, &from))
        return nb_fail(&codec.log, NEBEL_ERROR_ARGUMENT, "airlight: the picture has no pixels, or halves");
    uint16_t *keys = nb_allocate(&codec.allocator, count, sizeof *keys);
    uint16_t *eights = nb_allocate(&codec.allocator, count, sizeof *eights);
    uint16_t *rows = nb_allocate(&codec.allocator, 2 * (width + 2 * SIDE), sizeof *rows);
    uint32_t *counts = nb_allocate(&codec.allocator, KEYS, sizeof *counts);
    if (keys != NULL && eights != NULL && rows != NULL && counts != NULL) {
        fill_darkest(&from, count, keys);
        find_least_in_rows(keys, width, height, rows);
        find_least_in_columns(keys, eights, rows, width, height);
        choose(&from, keys, count, counts, airlight);
    } else {
        result = nb_fail(&codec.log, NEBEL_ERROR_MEMORY, "airlight: out of memory");
    }
    nb_release(&codec.allocator, keys);
    nb_release(&codec.allocator, eights);
    nb_release(&codec.allocator, rows);
    nb_release(&codec.allocator, counts);
    return result;
}
