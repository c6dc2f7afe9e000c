/* sRGB in bytes (IEC 61966-2-1), as tables. */
#ifndef NB_STREAM_SRGB_H
#define NB_STREAM_SRGB_H

#include <stdint.h>

/* The second table covers this range. Darker light rounds to byte 0, as the minimum does. Brighter light clamps to 255. */
#define NB_SRGB_MIN_LIGHT 0x1p-13f
#define NB_SRGB_MAX_LIGHT 0x1.fffffep-1f

enum {
    NB_SRGB_FIRST = 0x3900, /* the upper 16 bits of the minimum */
    NB_SRGB_BYTES = 13 * 128
};

/* The linear light of each byte, rounded to nearest. */
extern const float nb_srgb_light[256];

/* The entry at index (bits >> 16) - NB_SRGB_FIRST plus the bits of the light is the nearest byte, in bits 16 to 23. The bits
 * above are 0. scripts/make_srgb.py explains why. */
extern const uint32_t nb_srgb_bytes[NB_SRGB_BYTES];

#endif
