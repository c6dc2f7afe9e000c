/* sRGB in bytes (IEC 61966-2-1), as tables. */
#ifndef NB_KERNELS_SRGB_H
#define NB_KERNELS_SRGB_H

#include <stdint.h>

/* Lights below count as the least, which is byte 0; those from 1 on as the most, which is byte 255. */
#define NB_SRGB_LEAST 0x1p-13f
#define NB_SRGB_MOST 0x1.fffffep-1f

enum {
    NB_SRGB_FIRST = 0x3900, /* the upper 16 bits of the least */
    NB_SRGB_BYTES = 13 * 128
};

/* Exactly rounded. */
extern const float nb_srgb_light[256];

/* A light's bits and the entry at their upper 16, counted from NB_SRGB_FIRST, add up to the nearest byte in bits 16 to 23;
 * those above are 0. scripts/make_srgb.py says how. */
extern const uint32_t nb_srgb_bytes[NB_SRGB_BYTES];

#endif
