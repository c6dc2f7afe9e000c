/* Segments through boxes of constant density: the hot path of per-vertex fog, compiled once per instruction set.
 *
 * In float throughout: coordinates are relative to an origin near the viewer, and boxes are well conditioned. Per segment 24 to 28 bytes
 * come and 4 go; per box about 30 operations, of which only the slab test is done where every lane misses. */
#define NB_FAST

#include "transmit.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define JOIN_NAMES(a, b) a##b
#define SUFFIXED(prefix, suffix) JOIN_NAMES(prefix, suffix)

static const float *at(const float *base, size_t stride, size_t i)
{
    return (const float *)(const void *)((const char *)base + i * stride);
}

/* Three floats of NB_WIDTH neighbours, `count` of which exist; the others repeat the first. */
static nb_vec3 load_points(const float *base, size_t stride, size_t first, size_t count)
{
    float lane[3][NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) {
        const float *p = at(base, stride, first + (i < count ? i : 0));
        for (int c = 0; c < 3; c++) lane[c][i] = p[c];
    }
    return nb_vec3(nb_load_lanes(lane[0]), nb_load_lanes(lane[1]), nb_load_lanes(lane[2]));
}

/* The same for a full packet of points that lie one after the other: three loads and shuffles instead of 3 NB_WIDTH loads. */
#if NB_WIDTH == 4
static nb_vec3 load_packed(const float *p)
{
    const nb_real a = nb_load_lanes(p), b = nb_load_lanes(p + 4), c = nb_load_lanes(p + 8);
    const nb_real xy = __builtin_shufflevector(a, b, 0, 3, 6, 1), yz = __builtin_shufflevector(a, b, 1, 4, 7, 2);
    const nb_real z = __builtin_shufflevector(a, b, 2, 5, 0, 0);
    return nb_vec3(__builtin_shufflevector(xy, c, 0, 1, 2, 5), __builtin_shufflevector(yz, c, 0, 1, 2, 6),
                   __builtin_shufflevector(z, c, 0, 1, 4, 7));
}
#elif NB_WIDTH == 8
static nb_vec3 load_packed(const float *p)
{
    const nb_real a = nb_load_lanes(p), b = nb_load_lanes(p + 8), c = nb_load_lanes(p + 16);
    const nb_real x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 0, 0);
    const nb_real y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 0, 0, 0);
    const nb_real z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 0, 0, 0);
    return nb_vec3(__builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 10, 13),
                   __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 8, 11, 14),
                   __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 9, 12, 15));
}
#elif NB_WIDTH == 16
static nb_vec3 load_packed(const float *p)
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
static nb_vec3 load_packed(const float *p)
{
    return nb_vec3(nb_splat(p[0]), nb_splat(p[1]), nb_splat(p[2]));
}
#endif

/* A packet of segments, from + s way, 0 <= s <= 1. */
typedef struct segment {
    nb_vec3 from, inverse; /* bounded reciprocals of the way */
    nb_real length;
} segment;

static segment make_segment(nb_vec3 from, nb_vec3 to)
{
    const nb_vec3 way = nb_sub3(to, from);
    return (segment){from, nb_vec3(nb_rcp_bounded(way.x), nb_rcp_bounded(way.y), nb_rcp_bounded(way.z)), nb_length3(way)};
}

/* The optical depth over a packet. Faces belong to one side as in nb_interval_slab. */
static nb_real box_depth(const nb_transmit_job *job, const segment *s)
{
    nb_real depth = NB_F(0.0);
    for (size_t i = 0; i < job->box_count; i++) {
        const nb_fog_box *box = &job->boxes[i];
        const nb_real x0 = (nb_splat(box->low[0]) - s->from.x) * s->inverse.x;
        const nb_real x1 = (nb_splat(box->high[0]) - s->from.x) * s->inverse.x;
        const nb_real y0 = (nb_splat(box->low[1]) - s->from.y) * s->inverse.y;
        const nb_real y1 = (nb_splat(box->high[1]) - s->from.y) * s->inverse.y;
        const nb_real z0 = (nb_splat(box->low[2]) - s->from.z) * s->inverse.z;
        const nb_real z1 = (nb_splat(box->high[2]) - s->from.z) * s->inverse.z;
        const nb_real enter = nb_max(nb_max(nb_min(x0, x1), nb_min(y0, y1)), nb_max(nb_min(z0, z1), NB_F(0.0)));
        const nb_real leave = nb_min(nb_min(nb_max(x0, x1), nb_max(y0, y1)), nb_min(nb_max(z0, z1), NB_F(1.0)));
        const nb_mask hit = enter < leave;
        if (!nb_any(hit)) continue;
        const nb_real inside = (leave - enter) * s->length * nb_splat(box->extinction);
        depth = depth + nb_select(hit, inside, NB_F(0.0));
    }
    return depth;
}

static nb_real transmit_packet(const nb_transmit_job *job, nb_vec3 from, nb_vec3 to)
{
    const segment s = make_segment(from, to);
    const nb_real depth = box_depth(job, &s);
    return nb_select(depth >= NB_F(0.0), nb_exp(-depth), NB_F(1.0));
}

static void store_points(const nb_transmit_job *job, size_t first, size_t count, nb_real value)
{
    float lane[NB_WIDTH];
    nb_store_lanes(lane, value);
    for (size_t i = 0; i < count; i++)
        *(float *)(void *)((char *)job->out + (first + i) * job->out_stride) = lane[i];
}

void SUFFIXED(nb_transmit_, NB_SUFFIX)(const nb_transmit_job *job)
{
    const size_t packed = 3 * sizeof(float);
    nb_vec3 from = nb_vec3(nb_splat(job->from[0]), nb_splat(job->from[1]), nb_splat(job->from[2]));
    size_t i = 0;
    if (job->to_stride == packed && job->out_stride == sizeof(float) && (job->from_stride == 0 || job->from_stride == packed))
        for (; i + NB_WIDTH <= job->count; i += NB_WIDTH) {
            if (job->from_stride != 0) from = load_packed(job->from + 3 * i);
            nb_store_lanes(job->out + i, transmit_packet(job, from, load_packed(job->to + 3 * i)));
        }
    for (; i < job->count; i += NB_WIDTH) {
        const size_t count = job->count - i < NB_WIDTH ? job->count - i : NB_WIDTH;
        from = load_points(job->from, job->from_stride, i, count);
        store_points(job, i, count, transmit_packet(job, from, load_points(job->to, job->to_stride, i, count)));
    }
}
