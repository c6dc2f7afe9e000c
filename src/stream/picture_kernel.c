/* Fog over pieces of rows of a picture, compiled once per instruction set.
 *
 * Bytes stay together, a pixel in each lane of 32 bits; other samples become planes of floats first.
 */
#define NB_FAST

#include "picture_kernel.h"
#include "srgb.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "stream_packet.h"

#include <string.h>

enum { PIECE = NB_PICTURE_PIECE };

/* ---- sRGB (IEC 61966-2-1) -------------------------------------------------------------------- */

#define DARKEST_POWER NB_F(0.04045)   /* below it sRGB is linear; */
#define DARKEST_LIGHT NB_F(0.0031308) /* the same as light */
#define SLOPE 12.92f

NB_INLINE nb_real power(nb_real x, float exponent)
{
    return nb_exp(nb_splat(exponent) * nb_log(nb_max(x, NB_TINY)));
}

NB_INLINE nb_real decode(nb_real c)
{
    const nb_real p = power((c + NB_F(0.055)) * nb_splat(1 / 1.055f), 2.4f);
    return nb_select(c > DARKEST_POWER, p, c * nb_splat(1 / SLOPE));
}

NB_INLINE nb_real encode(nb_real x)
{
    const nb_real p = NB_F(1.055) * power(x, 1 / 2.4f) - NB_F(0.055);
    return nb_select(x > DARKEST_LIGHT, p, x * nb_splat(SLOPE));
}

/* ---- light ----------------------------------------------------------------------------------- */

typedef struct light {
    nb_real transmittance[3], in_scattering[3];
} light;

/* What one of a haze's pixels has of it, packets of them. */
typedef struct haze {
    nb_real octaves, nearest_x, nearest, growth;
    int along_ray;
} haze;

static haze make_haze(const nb_picture_haze *h)
{
    return (haze){.octaves = nb_splat(h->octaves),
                  .nearest_x = nb_splat(h->nearest_x),
                  .nearest = nb_splat(h->nearest),
                  .growth = nb_splat(h->growth),
                  .along_ray = h->along_ray};
}

/* Not less than 0 nor NaN is what fog acts on: the exponential of everything else is 1. */
NB_INLINE nb_real transmittance_of(const haze *h, nb_real x, nb_real depth)
{
    nb_real way = depth;
    if (!h->along_ray) {
        const nb_real across = x - h->nearest_x;
        way = depth * nb_sqrt(across * (across * h->growth) + h->nearest);
    }
    return nb_light_after(way * h->octaves);
}

/* The transmittance of a haze's piece. */
static void fill_transmittance(const nb_picture_job *job, float *transmittance)
{
    const nb_picture_haze *const given = job->haze;
    const haze h = make_haze(given);
    float depth[PIECE] = {0}, lanes[NB_WIDTH];
    memcpy(depth, given->depth, sizeof *depth * job->count);
    for (uint32_t i = 0; i < NB_WIDTH; i++) lanes[i] = (float)(given->first + i);
    nb_real x = nb_load_lanes(lanes);
    for (uint32_t i = 0; i < job->count; i += NB_WIDTH) {
        nb_store_lanes(transmittance + i, transmittance_of(&h, x, nb_load_lanes(depth + i)));
        x = x + nb_splat(NB_WIDTH);
    }
}

/* A packet's light; in-scattering is `scale` where white is. `is_haze` is a constant. */
NB_INLINE light light_at(const nb_picture_job *job, const float *haze_transmittance, uint32_t at, float scale,
                         int is_haze)
{
    light l;
    for (int c = 0; c < 3; c++) {
        if (is_haze) {
            l.transmittance[c] = nb_load_lanes(haze_transmittance + at);
            l.in_scattering[c] = (NB_F(1.0) - l.transmittance[c]) * nb_splat(job->haze->radiance[c] * scale);
        } else {
            l.transmittance[c] = nb_load_lanes(job->transmittance[c] + at);
            l.in_scattering[c] = nb_load_lanes(job->in_scattering[c] + at) * nb_splat(scale);
        }
    }
    return l;
}

static void keep_transmittance(const nb_picture_job *job, const float *haze_transmittance)
{
    for (uint32_t i = 0; i < job->count; i++) {
        float kept[3];
        for (int c = 0; c < 3; c++) kept[c] = job->haze != NULL ? haze_transmittance[i] : job->transmittance[c][i];
        memcpy(job->kept + i * sizeof kept, kept, sizeof kept);
    }
}

/* ---- bytes ----------------------------------------------------------------------------------- */

/* Pixels of three bytes to words and back, eight at a time, as long as 32 bytes are there. Returns how many are done. */
#if defined(NB_ISA_AVX2) || defined(NB_ISA_AVX512)
enum { TRIPLES = 8, TRIPLES_READ = 11 };

static uint32_t load_triples(const unsigned char *from, uint32_t count, uint32_t *words)
{
    const __m256i halves = _mm256_setr_epi32(0, 1, 2, 3, 3, 4, 5, 6);
    const __m256i spread =
        _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1));
    uint32_t i = 0;
    for (; i + TRIPLES_READ <= count; i += TRIPLES) {
        const __m256i bytes = _mm256_loadu_si256((const __m256i *)(const void *)(from + 3 * (size_t)i));
        const __m256i pixels = _mm256_shuffle_epi8(_mm256_permutevar8x32_epi32(bytes, halves), spread);
        _mm256_storeu_si256((__m256i *)(void *)(words + i), pixels);
    }
    return i;
}

static uint32_t store_triples(const uint32_t *words, uint32_t count, unsigned char *to)
{
    const __m256i halves = _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 3, 7);
    const __m256i gather =
        _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1));
    uint32_t i = 0;
    for (; i + TRIPLES_READ <= count; i += TRIPLES) {
        const __m256i pixels = _mm256_loadu_si256((const __m256i *)(const void *)(words + i));
        const __m256i bytes = _mm256_permutevar8x32_epi32(_mm256_shuffle_epi8(pixels, gather), halves);
        _mm256_storeu_si256((__m256i *)(void *)(to + 3 * (size_t)i), bytes);
    }
    return i;
}
#else
static uint32_t load_triples(const unsigned char *from, uint32_t count, uint32_t *words)
{
    (void)from;
    (void)count;
    (void)words;
    return 0;
}

static uint32_t store_triples(const uint32_t *words, uint32_t count, unsigned char *to)
{
    (void)words;
    (void)count;
    (void)to;
    return 0;
}
#endif

/* A pixel to each word, the first sample lowest; of three samples, with the next pixel's first behind them but for the last
 * pixel, behind which nothing may be read. */
NB_INLINE void load_bytes(const nb_picture_job *job, uint32_t *words)
{
    const uint32_t last = job->count - 1;
    if (job->type == NEBEL_PIXEL_RGBA8) {
        memcpy(words, job->color, 4 * (size_t)job->count);
        return;
    }
    uint32_t i = load_triples(job->color, job->count, words);
    for (; i < last; i++) memcpy(words + i, job->color + 3 * (size_t)i, 4);
    memcpy(words + last, job->color + 3 * (size_t)last, 3);
}

/* From the first to the last, each over the fourth byte of the one before. */
NB_INLINE void store_bytes(const nb_picture_job *job, const uint32_t *words)
{
    const uint32_t last = job->count - 1;
    if (job->type == NEBEL_PIXEL_RGBA8) {
        memcpy(job->out, words, 4 * (size_t)job->count);
        return;
    }
    unsigned char *const out = job->out;
    uint32_t i = store_triples(words, job->count, out);
    for (; i < last; i++) memcpy(out + 3 * (size_t)i, words + i, 4);
    memcpy(out + 3 * (size_t)last, words + last, 3);
}

/* ---- bytes as they stand --------------------------------------------------------------------- */

/* In-scattering is 255 where white is. The sum is not negative. */
NB_INLINE nb_bits fog_byte(nb_bits byte, nb_real transmittance, nb_real in_scattering)
{
    const nb_real x = nb_from_bits(byte | NB_INTEGER_BITS) - NB_INTEGER;
    const nb_real sum = nb_min(transmittance * x + in_scattering, NB_F(255.0));
    return nb_to_bits(sum + NB_INTEGER) - NB_INTEGER_BITS;
}

/* `is_haze` is a constant. */
NB_INLINE void fog_words(const nb_picture_job *job, const float *haze_transmittance, uint32_t *words, int is_haze)
{
    for (uint32_t i = 0; i < job->count; i += NB_WIDTH) {
        const light l = light_at(job, haze_transmittance, i, 255, is_haze);
        float lanes[NB_WIDTH];
        memcpy(lanes, words + i, sizeof lanes);
        const nb_bits pixel = nb_to_bits(nb_load_lanes(lanes));
        nb_bits done = pixel & 0xff000000u;
        for (int c = 0; c < 3; c++)
            done = done | fog_byte((pixel >> (8 * c)) & 0xffu, l.transmittance[c], l.in_scattering[c]) << (8 * c);
        nb_store_lanes(lanes, nb_from_bits(done));
        memcpy(words + i, lanes, sizeof lanes);
    }
}

static void fog_stored(const nb_picture_job *job, const float *haze_transmittance)
{
    uint32_t words[PIECE] = {0};
    load_bytes(job, words);
    if (job->haze != NULL)
        fog_words(job, haze_transmittance, words, 1);
    else
        fog_words(job, haze_transmittance, words, 0);
    store_bytes(job, words);
}

/* ---- bytes in linear light ------------------------------------------------------------------- */

/* Table entries are loaded one by one, because gather instructions take longer on many processors. A packet of 16 lanes is
 * joined from two halves: its 16 indices would not fit into the registers. */
#if defined(NB_ISA_AVX512)
enum { PART_WIDTH = 8 };
typedef float part __attribute__((vector_size(4 * PART_WIDTH)));

NB_INLINE nb_real join(const part *parts)
{
    return _mm512_insertf32x8(_mm512_castps256_ps512((__m256)parts[0]), (__m256)parts[1], 1);
}
#else
enum { PART_WIDTH = NB_WIDTH };
typedef nb_real part;

NB_INLINE nb_real join(const part *parts)
{
    return parts[0];
}
#endif

enum { PARTS = NB_WIDTH / PART_WIDTH };

NB_INLINE nb_real light_of_bytes(const unsigned char *from, uint32_t step)
{
    part parts[PARTS];
    for (uint32_t p = 0; p < PARTS; p++) {
        float lanes[PART_WIDTH];
        for (uint32_t i = 0; i < PART_WIDTH; i++) lanes[i] = nb_srgb_light[from[step * (p * PART_WIDTH + i)]];
        memcpy(&parts[p], lanes, sizeof lanes);
    }
    return join(parts);
}

/* Returns the bytes in bits 16 to 23. Indices are loaded from memory, because extracting them from a vector takes longer. */
NB_INLINE nb_bits bytes_of_light(const uint32_t *lights)
{
    part parts[PARTS];
    for (uint32_t p = 0; p < PARTS; p++) {
        uint32_t lanes[PART_WIDTH];
        for (uint32_t i = 0; i < PART_WIDTH; i++)
            lanes[i] = nb_srgb_bytes[(size_t)(lights[p * PART_WIDTH + i] >> 16) - NB_SRGB_FIRST];
        memcpy(&parts[p], lanes, sizeof lanes);
    }
    nb_real all;
    memcpy(&all, lights, sizeof all);
    return nb_to_bits(all) + nb_to_bits(join(parts));
}

/* `step`, the size of a pixel, and `is_haze` are constants. */
NB_INLINE void blend_lights(const nb_picture_job *job, const float *haze_transmittance, uint32_t lights[3][PIECE],
                            uint32_t step, int is_haze)
{
    unsigned char padded[4 * PIECE];
    const unsigned char *from = job->color;
    if (job->count % NB_WIDTH != 0) {
        memset(padded, 0, sizeof padded);
        from = memcpy(padded, job->color, step * (size_t)job->count);
    }
    for (uint32_t i = 0; i < job->count; i += NB_WIDTH) {
        const light l = light_at(job, haze_transmittance, i, 1, is_haze);
        for (uint32_t c = 0; c < 3; c++) {
            const nb_real sum = l.transmittance[c] * light_of_bytes(from + step * i + c, step) + l.in_scattering[c];
            const nb_real clamped = nb_max(nb_min(sum, nb_splat(NB_SRGB_MAX_LIGHT)), nb_splat(NB_SRGB_MIN_LIGHT));
            memcpy(lights[c] + i, &clamped, sizeof clamped);
        }
    }
}

/* Replaces the colors of `words` and keeps their alpha. */
static void encode_lights(uint32_t lights[3][PIECE], uint32_t count, uint32_t *words)
{
    for (uint32_t i = 0; i < count; i += NB_WIDTH) {
        nb_bits pixel;
        memcpy(&pixel, words + i, sizeof pixel);
        const nb_bits r = bytes_of_light(lights[0] + i), g = bytes_of_light(lights[1] + i);
        const nb_bits b = bytes_of_light(lights[2] + i);
        pixel = (pixel & 0xff000000u) | r >> 16 | (g >> 8 & 0xff00u) | (b & 0xff0000u);
        memcpy(words + i, &pixel, sizeof pixel);
    }
}

static void fog_linear(const nb_picture_job *job, const float *haze_transmittance)
{
    uint32_t words[PIECE] = {0}, lights[3][PIECE];
    const int has_alpha = job->type == NEBEL_PIXEL_RGBA8;
    if (has_alpha) load_bytes(job, words);
    if (has_alpha && job->haze != NULL)
        blend_lights(job, haze_transmittance, lights, 4, 1);
    else if (has_alpha)
        blend_lights(job, haze_transmittance, lights, 4, 0);
    else if (job->haze != NULL)
        blend_lights(job, haze_transmittance, lights, 3, 1);
    else
        blend_lights(job, haze_transmittance, lights, 3, 0);
    encode_lights(lights, job->count, words);
    store_bytes(job, words);
}

/* ---- other samples --------------------------------------------------------------------------- */

/* IEEE 754 binary16 to float: the exponent's bias is 127 instead of 15, and multiplying sets it right for numbers below
 * the normal ones, too. */
NB_INLINE float float_of_half(uint16_t half)
{
    const uint32_t shifted = (uint32_t)(half & 0x7fff) << 13, sign = (uint32_t)(half & 0x8000) << 16;
    float number;
    memcpy(&number, &shifted, sizeof number);
    number *= 0x1p112f;
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    if ((half & 0x7c00) == 0x7c00) bits = 0x7f800000u | (uint32_t)(half & 0x3ff) << 13;
    bits |= sign;
    memcpy(&number, &bits, sizeof number);
    return number;
}

/* To nearest, ties to even; infinite from 65520 on. */
NB_INLINE uint16_t half_of_float(float number)
{
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000);
    bits &= 0x7fffffffu;
    if (bits > 0x7f800000u) return (uint16_t)(sign | 0x7e00);
    if (bits >= 0x477ff000u) return (uint16_t)(sign | 0x7c00);
    if (bits < 0x38800000u) { /* below the normal ones: adding 1/2 rounds at their last bit, 2^-24 */
        float small;
        memcpy(&small, &bits, sizeof small);
        small += 0.5f;
        memcpy(&bits, &small, sizeof bits);
        return (uint16_t)(sign | (bits - 0x3f000000u));
    }
    bits += 0xfffu + (bits >> 13 & 1);
    return (uint16_t)(sign | (bits - 0x38000000u) >> 13);
}

NB_INLINE float read_sample(const unsigned char *at, nebel_pixel_type type)
{
    uint16_t half;
    float number;
    if (type == NEBEL_PIXEL_RGBA_FLOAT || type == NEBEL_PIXEL_RGB_FLOAT) {
        memcpy(&number, at, sizeof number);
        return number;
    }
    memcpy(&half, at, sizeof half);
    if (type == NEBEL_PIXEL_RGBA_HALF || type == NEBEL_PIXEL_RGB_HALF) return float_of_half(half);
    return (float)half * (1 / 65535.0f);
}

NB_INLINE void write_sample(unsigned char *at, nebel_pixel_type type, float number)
{
    if (type == NEBEL_PIXEL_RGBA_FLOAT || type == NEBEL_PIXEL_RGB_FLOAT) {
        memcpy(at, &number, sizeof number);
        return;
    }
    uint16_t half = 0;
    if (type == NEBEL_PIXEL_RGBA_HALF || type == NEBEL_PIXEL_RGB_HALF)
        half = half_of_float(number);
    else if (number > 0)
        half = (uint16_t)((number < 1 ? number : 1) * 65535.0f + 0.5f);
    memcpy(at, &half, sizeof half);
}

static void fog_planes(const nb_picture_job *job, const float *haze_transmittance, float planes[3][PIECE])
{
    for (uint32_t i = 0; i < job->count; i += NB_WIDTH) {
        const light l = job->haze != NULL ? light_at(job, haze_transmittance, i, 1, 1) : light_at(job, NULL, i, 1, 0);
        for (int c = 0; c < 3; c++) {
            nb_real x = nb_load_lanes(planes[c] + i);
            x = l.transmittance[c] * (job->srgb ? decode(x) : x) + l.in_scattering[c];
            nb_store_lanes(planes[c] + i, job->srgb ? encode(x) : x);
        }
    }
}

static void fog_samples(const nb_picture_job *job, const float *haze_transmittance)
{
    float planes[3][PIECE] = {{0}};
    const nebel_pixel_type type = job->type;
    const int has_alpha = type == NEBEL_PIXEL_RGBA16 || type == NEBEL_PIXEL_RGBA_HALF || type == NEBEL_PIXEL_RGBA_FLOAT;
    const size_t size = type == NEBEL_PIXEL_RGBA_FLOAT || type == NEBEL_PIXEL_RGB_FLOAT ? 4 : 2;
    const size_t step = (has_alpha ? 4 : 3) * size;
    for (uint32_t i = 0; i < job->count; i++)
        for (size_t c = 0; c < 3; c++) planes[c][i] = read_sample(job->color + i * step + c * size, type);
    fog_planes(job, haze_transmittance, planes);
    for (uint32_t i = 0; i < job->count; i++) {
        for (size_t c = 0; c < 3; c++) write_sample(job->out + i * step + c * size, type, planes[c][i]);
        if (has_alpha) memmove(job->out + i * step + 3 * size, job->color + i * step + 3 * size, size);
    }
}

void NB_SUFFIXED(nb_picture_)(const nb_picture_job *job)
{
    float transmittance[PIECE];
    if (job->haze != NULL) fill_transmittance(job, transmittance);
    if (job->type != NEBEL_PIXEL_RGBA8 && job->type != NEBEL_PIXEL_RGB8)
        fog_samples(job, transmittance);
    else if (job->srgb)
        fog_linear(job, transmittance);
    else
        fog_stored(job, transmittance);
    if (job->kept != NULL) keep_transmittance(job, transmittance);
}
