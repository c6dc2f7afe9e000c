/* Fog of one colour in boxes of constant density over a picture in bytes, one kernel per instruction set. */
#ifndef NB_STREAM_PIXEL_KERNEL_H
#define NB_STREAM_PIXEL_KERNEL_H

#include "stream_box.h"

#include <stddef.h>
#include <stdint.h>

typedef struct nb_pixels_job {
    const nb_fog_box *boxes; /* relative to the eye */
    size_t box_count;
    uint32_t radiance[3]; /* 0 to NB_PIXEL_WHITE */
    int along_ray;        /* depth is a distance, not a multiple of the way at depth 1 */
    float corner[3], step_x[3], step_y[3];
    uint32_t width, first_row, row_count;
    const unsigned char *depth, *color; /* of the picture's first row; pitches in bytes */
    unsigned char *out;
    size_t depth_pitch, color_pitch, out_pitch;
} nb_pixels_job;

/* 255 with 8 more bits. */
#define NB_PIXEL_WHITE 65280u

typedef void nb_pixels_fn(const nb_pixels_job *job);

nb_pixels_fn nb_pixels_scalar, nb_pixels_sse2, nb_pixels_avx2, nb_pixels_avx512, nb_pixels_neon;

#endif
