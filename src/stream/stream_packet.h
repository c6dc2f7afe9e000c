/* Boxes and packets of segments, as the stream kernels see them. Included after formulas/elementary.inc, for float
 * only. */
#ifndef NB_STREAM_STREAM_PACKET_H
#define NB_STREAM_STREAM_PACKET_H

#include "stream_box.h"

#include "base/isa_list.h"

#include <math.h>

/* Packets travel in registers only inside one function. */
#define NB_INLINE static inline __attribute__((always_inline))

/* 2^x for x <= 0, 0 below -126.5 and 1 for a NaN: 2^n as an exponent times 2^f, |f| <= 1/2, by the weighted minimax
 * polynomial that scripts/fit_elementary.py finds, in Estrin's order, because packets wait for each other's results;
 * relative error 3e-7. The lowest bits of `shifted` are n + bias, whatever else it holds is shifted out. */
NB_INLINE nb_real nb_light_after(nb_real x)
{
    const nb_real shifter = NB_INTEGER * NB_F(1.5) + NB_BIAS;
    const nb_real y = nb_max(nb_min(x, NB_F(0.0)), -NB_BIAS);
    const nb_real shifted = y + shifter;
    const nb_real f = y - (shifted - shifter);
    const nb_real f2 = f * f;
    const nb_real low = NB_F(0.240222405) * f + NB_F(0.693146976), high = NB_F(0.00967161926) * f + NB_F(0.05550735);
    const nb_real p = (low + f2 * (high + f2 * NB_F(0.00132645981))) * f + NB_F(1.0);
    return nb_from_bits(nb_to_bits(shifted) << NB_SHIFT) * p;
}

/* A box before it meets a packet. Where all segments start at one place, low and high are relative to it. */
typedef struct nb_slabs {
    float low[3], high[3];
    float octaves; /* minus how many times a unit of length halves the light */
} nb_slabs;

static inline nb_slabs nb_make_slabs(const nb_fog_box *box, const float start[3])
{
    const float ln2 = 0.693147181f, most = 1e30f; /* 0 times it is 0 */
    nb_slabs slabs;
    for (int c = 0; c < 3; c++) {
        slabs.low[c] = box->low[c] - start[c];
        slabs.high[c] = box->high[c] - start[c];
    }
    slabs.octaves = -fminf(box->extinction, most) / ln2;
    return slabs;
}

/* A packet of segments: from + s way, 0 <= s <= limit. */
typedef struct nb_packet {
    nb_vec3 from, inverse; /* from is 0 where the slabs are relative to it */
    nb_real square;        /* of the way's length */
} nb_packet;

NB_INLINE nb_packet nb_make_packet(nb_vec3 from, nb_vec3 way)
{
    return (nb_packet){from, nb_vec3(NB_F(1.0) / way.x, NB_F(1.0) / way.y, NB_F(1.0) / way.z), nb_dot3(way, way)};
}

/* Where the ways cross two planes. A segment within a plane gets a NaN there, which nb_min and nb_max pass on as their
 * second argument and lose as their first: such a segment counts as inside the lower face and outside the upper one, so
 * that faces belong to one side as in nb_interval_slab. */
typedef struct nb_crossing {
    nb_real near, far;
} nb_crossing;

NB_INLINE nb_crossing nb_cross_slab(nb_real low, nb_real high, nb_real inverse)
{
    const nb_real a = low * inverse, b = high * inverse;
    return (nb_crossing){nb_min(b, a), nb_max(b, a)};
}

/* How much of s is inside: from 0 to limit. Never a NaN; 0 where the limit is one. */
NB_INLINE nb_real nb_part_inside(const nb_slabs *box, const nb_packet *p, nb_real limit)
{
    const nb_crossing x =
        nb_cross_slab(nb_splat(box->low[0]) - p->from.x, nb_splat(box->high[0]) - p->from.x, p->inverse.x);
    const nb_crossing y =
        nb_cross_slab(nb_splat(box->low[1]) - p->from.y, nb_splat(box->high[1]) - p->from.y, p->inverse.y);
    const nb_crossing z =
        nb_cross_slab(nb_splat(box->low[2]) - p->from.z, nb_splat(box->high[2]) - p->from.z, p->inverse.z);
    const nb_real enter = nb_max(x.near, nb_max(y.near, nb_max(z.near, NB_F(0.0))));
    const nb_real leave = nb_min(x.far, nb_min(y.far, nb_min(z.far, limit)));
    return nb_max(leave - enter, NB_F(0.0));
}

#endif
