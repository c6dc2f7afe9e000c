/* Factors of fog as coordinates, colours and alpha of vertices, compiled once per instruction set.
 *
 * Per vertex and stream 4 bytes come from the nearest cache; 7 operations make a byte of a number, 32 make four bytes
 * and a word of them. */
#define NB_FAST

#include "vertex_kernel.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "stream_packet.h"

#include <string.h>

/* Into [0, 1], in the order that makes a NaN 0. */
NB_INLINE nb_real weight_of(nb_real x)
{
    return nb_min(nb_max(x, NB_F(0.0)), NB_F(1.0));
}

/* ---- curves ---------------------------------------------------------------------------------- */

/* x >= 0, below 2^31 */
NB_INLINE nb_bits truncate(nb_real x)
{
#if NB_WIDTH == 1
    return (nb_bits)x;
#else
    return (nb_bits) __builtin_convertvector(x, nb_mask);
#endif
}

/* The last interval of the table is closed at both ends, where the weights of both entries are exact. */
NB_INLINE nb_real look_up(const float *table, nb_real amount)
{
    const nb_real place = weight_of(amount) * NB_F(255.0);
    const nb_bits below = truncate(nb_min(place, NB_F(254.0)));
    uint32_t index[NB_WIDTH];
    float low[NB_WIDTH], high[NB_WIDTH], start[NB_WIDTH];
    memcpy(index, &below, sizeof index);
    for (int i = 0; i < NB_WIDTH; i++) {
        low[i] = table[index[i]];
        high[i] = table[index[i] + 1];
        start[i] = (float)index[i];
    }
    const nb_real w = place - nb_load_lanes(start);
    return (NB_F(1.0) - w) * nb_load_lanes(low) + w * nb_load_lanes(high);
}

/* The amount of fog by a curve of the optical depth, not the physical one. Light that is gone has a depth at which every
 * curve has passed 1. */
NB_INLINE nb_real amount_of(const nb_vertices_job *job, nb_real transmittance)
{
    const nb_real depth = nb_max(nb_min(-nb_log(transmittance), NB_F(100.0)), NB_F(0.0));
    switch (job->curve) {
    case NB_CURVE_LINEAR:
        return depth;
    case NB_CURVE_EXP:
        return nb_expm1(depth);
    case NB_CURVE_EXP2:
        return nb_expm1(depth * depth);
    default:
        return look_up(job->table, depth);
    }
}

NB_INLINE void put_curve_in(const nb_vertices_job *job)
{
    if (job->curve == NB_CURVE_PHYSICAL) return;
    for (size_t i = 0; i < job->count; i += NB_WIDTH) {
        const nb_real amount = weight_of(amount_of(job, nb_load_lanes(job->factor + i)));
        nb_store_lanes(job->factor + i, NB_F(1.0) - amount);
    }
}

/* ---- a packet -------------------------------------------------------------------------------- */

/* 255 times the number, rounded to nearest, halves upwards. */
NB_INLINE nb_bits byte_of(nb_real x)
{
    return truncate(weight_of(x) * NB_F(255.0) + NB_F(0.5));
}

/* The light that fog adds in one colour to the packet that begins with vertex i. */
NB_INLINE nb_real light_of(const nb_vertices_job *job, int c, size_t i, nb_real amount)
{
    if (job->light[c] != NULL) return nb_load_lanes(job->light[c] + i);
    return amount * nb_splat(job->color[c]);
}

NB_INLINE nb_bits bytes_of(const nb_vertices_job *job, size_t i)
{
    const nb_real amount = NB_F(1.0) - nb_load_lanes(job->factor + i);
    const nb_bits red = byte_of(light_of(job, 0, i, amount)), green = byte_of(light_of(job, 1, i, amount));
    const nb_bits blue = byte_of(light_of(job, 2, i, amount));
    return red | (green << 8) | (blue << 16) | (byte_of(amount) << 24);
}

/* What a stream of four bytes a vertex holds. `kind` is a constant. */
NB_INLINE nb_bits word_of(const nb_vertices_job *job, nb_vertex_kind kind, size_t i)
{
    if (kind == NB_VERTEX_RGBA8) return bytes_of(job, i);
    const nb_real factor = nb_load_lanes(job->factor + i);
    if (kind == NB_VERTEX_FACTOR) return nb_to_bits(factor);
    if (kind == NB_VERTEX_SPECULAR_ALPHA) return byte_of(factor);
    if (kind == NB_VERTEX_ALPHA) return byte_of(NB_F(1.0) - factor);
    return nb_to_bits((NB_F(1.0) - factor) * nb_splat(job->coordinate_end));
}

/* ---- streams --------------------------------------------------------------------------------- */

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* Words one after the other, then the rest, or words apart. `kind` is a constant. */
NB_INLINE void write_words(const nb_vertices_job *job, nb_vertex_kind kind)
{
    const size_t count = job->count, stride = job->stride;
    size_t i = 0;
    for (; stride == 4 && i + NB_WIDTH <= count; i += NB_WIDTH) {
        const nb_bits words = word_of(job, kind, i);
        memcpy(job->data + 4 * i, &words, 4 * NB_WIDTH);
    }
    for (; i < count; i += NB_WIDTH) {
        const nb_bits words = word_of(job, kind, i);
        uint32_t lanes[NB_WIDTH];
        memcpy(lanes, &words, sizeof lanes);
        for (size_t k = 0; k < least(NB_WIDTH, count - i); k++) memcpy(job->data + (i + k) * stride, &lanes[k], 4);
    }
}

/* The last of four bytes: a D3DCOLOR is blue, green, red, alpha in memory. `kind` is a constant. */
NB_INLINE void write_alpha(const nb_vertices_job *job, nb_vertex_kind kind)
{
    for (size_t i = 0; i < job->count; i += NB_WIDTH) {
        const nb_bits words = word_of(job, kind, i);
        uint32_t lanes[NB_WIDTH];
        memcpy(lanes, &words, sizeof lanes);
        for (size_t k = 0; k < least(NB_WIDTH, job->count - i); k++)
            job->data[(i + k) * job->stride + 3] = (unsigned char)lanes[k];
    }
}

NB_INLINE void write_colors(const nb_vertices_job *job)
{
    for (size_t i = 0; i < job->count; i += NB_WIDTH) {
        const nb_real amount = NB_F(1.0) - nb_load_lanes(job->factor + i);
        float lanes[4][NB_WIDTH];
        for (int c = 0; c < 3; c++) nb_store_lanes(lanes[c], light_of(job, c, i, amount));
        nb_store_lanes(lanes[3], amount);
        for (size_t k = 0; k < least(NB_WIDTH, job->count - i); k++) {
            const float color[4] = {lanes[0][k], lanes[1][k], lanes[2][k], lanes[3][k]};
            memcpy(job->data + (i + k) * job->stride, color, sizeof color);
        }
    }
}

void NB_SUFFIXED(nb_vertices_)(const nb_vertices_job *job)
{
    const nb_vertices_job j = *job; /* no store to a stream can change it */
    put_curve_in(&j);
    switch (j.kind) {
    case NB_VERTEX_FACTOR:
        write_words(&j, NB_VERTEX_FACTOR);
        break;
    case NB_VERTEX_COORDINATE:
        write_words(&j, NB_VERTEX_COORDINATE);
        break;
    case NB_VERTEX_RGBA_FLOAT:
        write_colors(&j);
        break;
    case NB_VERTEX_RGBA8:
        write_words(&j, NB_VERTEX_RGBA8);
        break;
    case NB_VERTEX_SPECULAR_ALPHA:
        write_alpha(&j, NB_VERTEX_SPECULAR_ALPHA);
        break;
    case NB_VERTEX_ALPHA:
        write_alpha(&j, NB_VERTEX_ALPHA);
        break;
    }
}
