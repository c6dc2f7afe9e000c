/* Where in a pixel its samples look. */
#ifndef NB_FRAME_PIXEL_SAMPLES_H
#define NB_FRAME_PIXEL_SAMPLES_H

#include <stdint.h>

/* In pixels from the upper left corner: 0 to 1. */
typedef struct nb_pixel_position {
    double x, y;
} nb_pixel_position;

/* The van der Corput sequence in base 2, its first digit turned over. */
static inline uint32_t nb_pixel_digits(uint32_t i)
{
    uint32_t digits = 0;
    for (int bit = 0; bit < 32; bit++) digits |= (i >> bit & 1) << (31 - bit);
    return digits ^ 1u << 31;
}

/* Sample `index` of `count`, the same in every pixel: what differed from pixel to pixel would be noise along edges.
 * J. Hammersley's points (1960), column by column and, turned as they are, of 4 samples the rotated grid: of 2^k every
 * cell of every split of the pixel into 2^k equal boxes holds one. Rows are handed out by rank, so that those of any
 * count are as far apart, and one sample is the centre. */
static inline nb_pixel_position nb_pixel_sample(uint32_t index, uint32_t count)
{
    const uint32_t digits = nb_pixel_digits(index);
    uint32_t rank = 0;
    for (uint32_t i = 0; i < count; i++) rank += nb_pixel_digits(i) < digits;
    return (nb_pixel_position){(index + .5) / count, (rank + .5) / count};
}

#endif
