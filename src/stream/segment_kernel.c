/* Segments through boxes of constant density: the hot path of per-vertex fog, compiled once per instruction set.
 *
 * In float throughout: coordinates are relative to an origin near the viewer, and boxes are well conditioned. Per
 * segment 12 or 24 bytes come and 4 go; 9 operations to find that a packet from one eye misses a box, and where it does
 * not, 3 divisions, a square root and 8 operations for the way, 20 per box and 19 for the exponential. */
#define NB_FAST

#include "segment_kernel.h"

#include "base/stride.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "stream_packet.h"

#include "box_reject.h"

#include <stdint.h>
#include <string.h>

/* Three floats of NB_WIDTH neighbours, `count` of which exist; the others repeat the first. */
static nb_vec3 load_points(const float *base, size_t stride, size_t first, size_t count)
{
    float lane[3][NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const float *p = nb_stride_from(base, stride, first + (i < count ? i : 0));
        for (int c = 0; c < 3; c++) lane[c][i] = p[c];
    }
    return nb_vec3(nb_load_lanes(lane[0]), nb_load_lanes(lane[1]), nb_load_lanes(lane[2]));
}

/* The same for a full packet of points that lie one after the other: three loads and shuffles instead of 3 NB_WIDTH
 * loads. */
#if NB_WIDTH == 4
NB_INLINE nb_vec3 load_packed(const float *p)
{
    const nb_real a = nb_load_lanes(p), b = nb_load_lanes(p + 4), c = nb_load_lanes(p + 8);
    const nb_real xy = __builtin_shufflevector(a, b, 0, 3, 6, 1), yz = __builtin_shufflevector(a, b, 1, 4, 7, 2);
    const nb_real z = __builtin_shufflevector(a, b, 2, 5, 0, 0);
    return nb_vec3(__builtin_shufflevector(xy, c, 0, 1, 2, 5), __builtin_shufflevector(yz, c, 0, 1, 2, 6),
                   __builtin_shufflevector(z, c, 0, 1, 4, 7));
}
#elif NB_WIDTH == 8
typedef float half __attribute__((vector_size(16)));

/* Two halves of a register, so that what follows stays within halves: crossing them costs three times as much. */
NB_INLINE nb_real load_halves(const float *low, const float *high)
{
    half a, b;
    memcpy(&a, low, sizeof a);
    memcpy(&b, high, sizeof b);
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}

NB_INLINE nb_vec3 load_packed(const float *p)
{
    const nb_real a = load_halves(p, p + 12), b = load_halves(p + 4, p + 16), c = load_halves(p + 8, p + 20);
    const nb_real xy = __builtin_shufflevector(b, c, 2, 3, 9, 10, 6, 7, 13, 14);
    const nb_real yz = __builtin_shufflevector(a, b, 1, 2, 8, 9, 5, 6, 12, 13);
    return nb_vec3(__builtin_shufflevector(a, xy, 0, 3, 8, 10, 4, 7, 12, 14),
                   __builtin_shufflevector(yz, xy, 0, 2, 9, 11, 4, 6, 13, 15),
                   __builtin_shufflevector(yz, c, 1, 3, 8, 11, 5, 7, 12, 15));
}
#elif NB_WIDTH == 16
NB_INLINE nb_vec3 load_packed(const float *p)
{
    const nb_real a = nb_load_lanes(p), b = nb_load_lanes(p + 16), c = nb_load_lanes(p + 32);
    const nb_real x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0);
    const nb_real y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0);
    const nb_real z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0);
    return nb_vec3(__builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29),
                   __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30),
                   __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31));
}
#else
NB_INLINE nb_vec3 load_packed(const float *p)
{
    return nb_vec3(nb_splat(p[0]), nb_splat(p[1]), nb_splat(p[2]));
}
#endif

/* ---- a packet -------------------------------------------------------------------------------- */

/* Light over the ways through the boxes named in `list`. */
NB_INLINE nb_real transmit_packet(const nb_slabs *boxes, const unsigned char *list, size_t count, nb_vec3 from,
                                  nb_vec3 way)
{
    const nb_packet p = nb_make_packet(from, way);
    nb_real octaves = NB_F(0.0);
    for (size_t i = 0; i < count; i++) {
        const nb_slabs *box = &boxes[list[i]];
        octaves = octaves + nb_part_inside(box, &p, nb_splat(1)) * nb_splat(box->octaves);
    }
    if (!nb_any(octaves < NB_F(0.0))) return nb_splat(1);
    return nb_light_after(octaves * nb_sqrt(p.square));
}

/* ---- streams --------------------------------------------------------------------------------- */

static void store_points(const nb_transmit_job *job, size_t first, size_t count, nb_real value)
{
    float lane[NB_WIDTH];
    nb_store_lanes(lane, value);
    for (size_t i = 0; i < count; i++) *(float *)nb_stride_to(job->out, job->out_stride, first + i) = lane[i];
}

/* Copies, which no store to the output can change; relative to the start where all segments share it. */
static void set_slabs(const nb_transmit_job *job, nb_slabs *boxes)
{
    const float zero[3] = {0, 0, 0};
    for (size_t i = 0; i < job->box_count; i++)
        boxes[i] = nb_make_slabs(&job->boxes[i], job->from_stride == 0 ? job->from : zero);
}

/* ---- what comes later ------------------------------------------------------------------------ */

/* So many segments have three cache lines of points and one of results; so many, three pages and one. */
enum { LINE = 16, PAGE = 1024 };

NB_INLINE const void *beyond(const float *p, size_t floats)
{
    return (const void *)((uintptr_t)p + sizeof *p * floats);
}

NB_INLINE void fetch_points(const float *points, size_t next, size_t line)
{
    for (size_t k = 0; k < 3; k++) __builtin_prefetch(beyond(points, 3 * next + line + PAGE * k), 0);
}

/* Asks for what the caller will want afterwards, the part that comes to the next LINE segments: while these are worked
 * on memory has nothing else to do. */
NB_INLINE void fetch_next(const nb_transmit_job *job, size_t i)
{
    enum { BYTES = 64 };
    const uintptr_t first = (uintptr_t)job->next + i * job->next_stride, end = first + LINE * job->next_stride;
    for (uintptr_t p = first; p < end; p += BYTES) __builtin_prefetch((const void *)p, 1);
}

/* Before the first of every LINE segments: asks memory for what the next PAGE of them needs there, one line of each of
 * its pages. Processors fetch ahead by themselves, but begin anew in every page and only once its address is
 * translated, and packets are too long for them to get there in time. Several pages at once keep as many requests under
 * way as memory takes. */
NB_INLINE void fetch_ahead(const nb_transmit_job *job, size_t i)
{
    const size_t line = i % PAGE, next = i - line + PAGE;
    if (i % LINE != 0) return;
    if (job->next != NULL) fetch_next(job, i);
    if (next + PAGE > job->count) return;
    fetch_points(job->to, next, line);
    if (job->from_stride != 0) fetch_points(job->from, next, line);
    __builtin_prefetch(beyond(job->out, next + line), 1);
}

/* ---- from one place -------------------------------------------------------------------------- */

/* Packets on their way through one box: each call of advance does a third of the work, on three packets. The chain of
 * operations of a packet takes 140 cycles and its work 25, and processors hold too few waiting operations to fill the
 * difference. */
typedef struct pipeline {
    nb_packet packet;
    nb_real exponent; /* of the packet before */
    float *out[2];    /* where the light of both goes */
} pipeline;

NB_INLINE pipeline make_pipeline(float *scratch)
{
    const nb_vec3 zero = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    return (pipeline){{zero, zero, nb_splat(0)}, nb_splat(0), {scratch, scratch}};
}

NB_INLINE void advance(pipeline *p, const nb_slabs *box, nb_vec3 way, float *out)
{
    const nb_vec3 zero = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    nb_store_lanes(p->out[1], nb_light_after(p->exponent));
    p->exponent = nb_part_inside(box, &p->packet, nb_splat(1)) * nb_splat(box->octaves) * nb_sqrt(p->packet.square);
    p->out[1] = p->out[0];
    p->packet = nb_make_packet(zero, way);
    p->out[0] = out;
}

/* Full packets only, as below. Returns how many segments are done. */
static size_t transmit_fan_through_one(const nb_transmit_job *job, const nb_slabs *boxes, const nb_box_reject *fences)
{
    const nb_vec3 from = nb_vec3(nb_splat(job->from[0]), nb_splat(job->from[1]), nb_splat(job->from[2]));
    const nb_slabs box = boxes[0];
    const nb_box_reject f = fences[0];
    const nb_transmit_job j = *job;
    float scratch[NB_WIDTH];
    pipeline p = make_pipeline(scratch);
    size_t i = 0;
    for (; i + NB_WIDTH <= j.count; i += NB_WIDTH) {
        fetch_ahead(&j, i);
        const nb_vec3 way = nb_sub3(load_packed(j.to + 3 * i), from);
        if (nb_is_missed(&f, way, way, 1))
            nb_store_lanes(j.out + i, nb_splat(1));
        else
            advance(&p, &box, way, j.out + i);
    }
    for (int inside = 0; inside < 2; inside++) advance(&p, &box, from, scratch); /* pushed out by any others */
    return i;
}

/* Full packets only, as below. Returns how many segments are done. */
static size_t transmit_fan(const nb_transmit_job *job, const nb_slabs *boxes, const nb_box_reject *fences)
{
    const nb_vec3 zero = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    const nb_vec3 from = nb_vec3(nb_splat(job->from[0]), nb_splat(job->from[1]), nb_splat(job->from[2]));
    const size_t box_count = job->box_count, count = job->count;
    unsigned char list[NB_FOG_BOXES];
    size_t i = 0;
    for (; i + NB_WIDTH <= count; i += NB_WIDTH) {
        fetch_ahead(job, i);
        const nb_vec3 way = nb_sub3(load_packed(job->to + 3 * i), from);
        const size_t found = nb_list_boxes(fences, box_count, way, way, 1, list);
        nb_store_lanes(job->out + i, found == 0 ? nb_splat(1) : transmit_packet(boxes, list, found, zero, way));
    }
    return i;
}

/* Asking costs half as much as a box itself. With many boxes it is done for blocks of packets at once; with few, blocks
 * would keep memory waiting while arithmetic is done. */
enum { PACKETS = 8, FEW_BOXES = 4 };

typedef struct nb_segment_block {
    nb_vec3 way[PACKETS];
    nb_vec3 low, high; /* over the packets, lane by lane */
} nb_segment_block;

NB_INLINE nb_vec3 least3(nb_vec3 a, nb_vec3 b)
{
    return nb_vec3(nb_min(a.x, b.x), nb_min(a.y, b.y), nb_min(a.z, b.z));
}

NB_INLINE void load_block(const float *to, nb_vec3 from, size_t packets, nb_segment_block *made)
{
    made->low = made->high = made->way[0] = nb_sub3(load_packed(to), from);
    for (size_t k = 1; k < packets; k++) {
        const nb_vec3 way = nb_sub3(load_packed(to + 3 * NB_WIDTH * k), from);
        made->low = least3(way, made->low);
        made->high = nb_most3(way, made->high);
        made->way[k] = way;
    }
}

static size_t transmit_blocks(const nb_transmit_job *job, const nb_slabs *boxes, const nb_box_reject *fences)
{
    const nb_vec3 zero = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    const nb_vec3 from = nb_vec3(nb_splat(job->from[0]), nb_splat(job->from[1]), nb_splat(job->from[2]));
    const size_t all = job->count / NB_WIDTH;
    unsigned char list[NB_FOG_BOXES];
    nb_segment_block b;
    for (size_t first = 0; first < all; first += PACKETS) {
        const size_t packets = all - first < PACKETS ? all - first : PACKETS;
        for (size_t k = 0; k < NB_WIDTH * packets; k += LINE) fetch_ahead(job, NB_WIDTH * first + k);
        load_block(job->to + 3 * NB_WIDTH * first, from, packets, &b);
        const size_t count = nb_list_boxes(fences, job->box_count, b.low, b.high, 0, list);
        float *const out = job->out + NB_WIDTH * first;
        for (size_t k = 0; k < packets; k++) {
            const nb_real light = count == 0 ? nb_splat(1) : transmit_packet(boxes, list, count, zero, b.way[k]);
            nb_store_lanes(out + NB_WIDTH * k, light);
        }
    }
    return NB_WIDTH * all;
}

static size_t transmit_from_one_place(const nb_transmit_job *job, const nb_slabs *boxes)
{
    nb_box_reject fences[NB_FOG_BOXES];
    for (size_t i = 0; i < job->box_count; i++) fences[i] = nb_make_fence(&boxes[i]);
    if (job->box_count == 1) return transmit_fan_through_one(job, boxes, fences);
    return job->box_count < FEW_BOXES ? transmit_fan(job, boxes, fences) : transmit_blocks(job, boxes, fences);
}

/* ---- any segments ---------------------------------------------------------------------------- */

static void list_all(unsigned char *list)
{
    for (int i = 0; i < NB_FOG_BOXES; i++) list[i] = (unsigned char)i;
}

/* Both ends one after the other: full packets only. Returns how many segments are done. */
static size_t transmit_pairs(const nb_transmit_job *job, const nb_slabs *boxes)
{
    unsigned char list[NB_FOG_BOXES];
    list_all(list);
    size_t i = 0;
    for (; i + NB_WIDTH <= job->count; i += NB_WIDTH) {
        fetch_ahead(job, i);
        const nb_vec3 from = load_packed(job->from + 3 * i);
        const nb_vec3 way = nb_sub3(load_packed(job->to + 3 * i), from);
        nb_store_lanes(job->out + i, transmit_packet(boxes, list, job->box_count, from, way));
    }
    return i;
}

/* Any strides, any number. */
static void transmit_spread(const nb_transmit_job *job, const nb_slabs *boxes, size_t first)
{
    const nb_vec3 zero = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    unsigned char list[NB_FOG_BOXES];
    list_all(list);
    for (size_t i = first; i < job->count; i += NB_WIDTH) {
        const size_t count = job->count - i < NB_WIDTH ? job->count - i : NB_WIDTH;
        const nb_vec3 from = load_points(job->from, job->from_stride, i, count);
        const nb_vec3 way = nb_sub3(load_points(job->to, job->to_stride, i, count), from);
        const nb_vec3 start = job->from_stride == 0 ? zero : from;
        store_points(job, i, count, transmit_packet(boxes, list, job->box_count, start, way));
    }
}

void NB_SUFFIXED(nb_transmit_)(const nb_transmit_job *job)
{
    const size_t packed = 3 * sizeof(float);
    nb_slabs boxes[NB_FOG_BOXES];
    size_t done = 0;
    set_slabs(job, boxes);
    if (job->to_stride == packed && job->out_stride == sizeof(float)) {
        if (job->from_stride == 0) done = transmit_from_one_place(job, boxes);
        if (job->from_stride == packed) done = transmit_pairs(job, boxes);
    }
    transmit_spread(job, boxes, done);
}
