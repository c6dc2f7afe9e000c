/* Streams of segments through boxes of constant density, one kernel per instruction set. */
#ifndef NB_STREAM_SEGMENT_KERNEL_H
#define NB_STREAM_SEGMENT_KERNEL_H

#include "stream_box.h"

#include <stddef.h>

typedef struct nb_transmit_job {
    const nb_fog_box *boxes;
    size_t box_count; /* 0 to NB_FOG_BOXES */
    size_t count;
    const float *from, *to; /* three floats each; strides in bytes */
    size_t from_stride, to_stride, out_stride;
    float *out;
    const void *next; /* memory that is wanted afterwards, next_stride bytes for each segment; NULL: none */
    size_t next_stride;
} nb_transmit_job;

typedef void nb_transmit_fn(const nb_transmit_job *job);

nb_transmit_fn nb_transmit_scalar, nb_transmit_sse2, nb_transmit_avx2, nb_transmit_avx512, nb_transmit_neon;

#endif
