/* Segments in, transmittances out: a few boxes take the stream kernel, everything else the march. */
#include "box_fog.h"
#include "fog/snapshot.h"

#include "base/isa.h"
#include "base/isa_list.h"
#include "base/stride.h"
#include "stream/segment_kernel.h"

#include <math.h>

#define TRANSMIT_KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_transmit_##suffix,
static nb_transmit_fn *const transmit_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(TRANSMIT_KERNEL)};

/* A ray of no length where the segment has none or is not finite. */
static nebel_ray ray_of_segment(const nebel_segments *segments, const float *from, const float *to)
{
    nebel_ray ray = {.origin = {segments->origin[0], segments->origin[1], segments->origin[2]}, .direction = {1, 0, 0}};
    double way[3], square = 0;
    for (int c = 0; c < 3; c++) {
        way[c] = (double)to[c] - (double)from[c];
        square += way[c] * way[c];
    }
    if (!(square > 0 && square < HUGE_VAL)) return ray;
    for (int c = 0; c < 3; c++) {
        ray.origin[c] += (double)from[c];
        ray.direction[c] = way[c];
    }
    ray.t_max = sqrt(square);
    return ray;
}

static int starts_too_far(const nebel_ray *ray)
{
    return !(fabs(ray->origin[0]) <= NEBEL_MAX_LENGTH && fabs(ray->origin[1]) <= NEBEL_MAX_LENGTH &&
             fabs(ray->origin[2]) <= NEBEL_MAX_LENGTH);
}

/* Through the march, a few rays at a time. */
static nebel_result trace_segments(const nebel_snapshot *snapshot, nebel_isa isa, int channel, size_t n,
                                   const nebel_segments *segments, float *out, size_t out_stride)
{
    enum { BATCH = 64 };
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT,
                                   .isa = isa,
                                   .transmittance_only = 1,
                                   .ignore_distances = segments->ignore_distances};
    for (size_t first = 0; first < n; first += BATCH) {
        nebel_ray rays[BATCH];
        nebel_transfer transfers[BATCH];
        const size_t count = n - first < BATCH ? n - first : BATCH;
        for (size_t i = 0; i < count; i++) {
            rays[i] = ray_of_segment(segments, nb_stride_from(segments->from, segments->from_stride, first + i),
                                     nb_stride_from(segments->to, segments->to_stride, first + i));
            if (starts_too_far(&rays[i]))
                return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "segment %zu: must start at most 1e15 m away",
                               first + i);
        }
        const nebel_result result =
            nebel_trace(snapshot, &desc, count, rays, sizeof *rays, transfers, sizeof *transfers);
        if (result != NEBEL_OK) return result;
        for (size_t i = 0; i < count; i++)
            *(float *)nb_stride_to(out, out_stride, first + i) = (float)transfers[i].transmittance[channel];
    }
    return NEBEL_OK;
}

nebel_result nebel_compute_segment_transmittance(const nebel_snapshot *snapshot, nebel_isa isa, int channel, size_t n,
                                                 const nebel_segments *segments, float *out, size_t out_stride)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (segments == NULL || (n > 0 && (segments->to == NULL || out == NULL)))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "segments: to and out must not be NULL");
    if ((segments->from_stride | segments->to_stride | out_stride) % sizeof(float) != 0)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "segments: strides must be multiples of %zu",
                       sizeof(float));
    if (channel < 0 || channel > 2) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "channel: must be 0, 1 or 2");
    for (int c = 0; c < 3; c++)
        if (!(fabs(segments->origin[c]) <= NEBEL_MAX_LENGTH))
            return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT,
                           "segments origin: must be finite and at most 1e15 m away");
    nb_transmit_fn *kernel = transmit_kernels[nb_isa_select(isa)];
    if (kernel == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_UNSUPPORTED, "instruction set %s: not available here",
                       nebel_isa_name(isa));
    if (n == 0) return NEBEL_OK;
    static const float at_origin[3] = {0, 0, 0};
    nebel_segments s = *segments;
    s.from_stride = s.from != NULL ? nb_stride_of(s.from_stride, 3 * sizeof(float)) : 0;
    s.to_stride = nb_stride_of(s.to_stride, 3 * sizeof(float));
    if (s.from == NULL) s.from = at_origin; /* again and again */
    const size_t stride = nb_stride_of(out_stride, sizeof(float));
    nb_fog_box boxes[NB_FOG_BOXES];
    if (!nb_boxes_list(snapshot, s.origin, channel, s.ignore_distances, boxes))
        return trace_segments(snapshot, isa, channel, n, &s, out, stride);
    kernel(&(nb_transmit_job){boxes, snapshot->medium_count, n, s.from, s.to, s.from_stride, s.to_stride, stride, out,
                              NULL, 0});
    return NEBEL_OK;
}
