/* Fog over pieces of rows of a picture, whatever its samples are, one kernel per instruction set. */
#ifndef NB_STREAM_PICTURE_KERNEL_H
#define NB_STREAM_PICTURE_KERNEL_H

#include <nebel/nebel.h>

/* The most pixels of a piece: what is made of them on the way stays near the processor. A multiple of every packet. */
enum { NB_PICTURE_PIECE = 256 };

/* Fog of one density and color everywhere. */
typedef struct nb_picture_haze {
    float octaves; /* minus how many times a meter halves the light */
    float radiance[3];
    int along_ray; /* depth is a distance, not a multiple of the way at depth 1 */
    /* The square of that way at pixel x of the row is nearest + growth (x - nearest_x)^2. */
    float nearest_x, nearest, growth;
    uint32_t first;             /* of the row's pixels, the piece's first */
    const unsigned char *depth; /* of the piece */
} nb_picture_haze;

typedef struct nb_picture_job {
    nebel_pixel_type type;
    int srgb;
    uint32_t count;             /* 1 to NB_PICTURE_PIECE */
    const unsigned char *color; /* of the piece; out may be color */
    unsigned char *out;
    const nb_picture_haze *haze; /* NULL: the next two, with room for a whole piece each */
    const float *transmittance[3], *in_scattering[3];
    unsigned char *kept; /* NULL, or where transmittance goes, three floats a pixel */
} nb_picture_job;

typedef void nb_picture_fn(const nb_picture_job *job);

nb_picture_fn nb_picture_scalar, nb_picture_sse2, nb_picture_avx2, nb_picture_avx512, nb_picture_neon;

#endif
