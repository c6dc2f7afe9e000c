/* Where in a pixel the samples lie: a (0,2)-sequence, shifted digit by digit for each pixel. Of 2^k samples every cell of
 * every split of the pixel into 2^k equal boxes holds exactly one (Niederreiter 1987; Kollig and Keller 2002). */
#ifndef NB_CPU_SAMPLING_H
#define NB_CPU_SAMPLING_H

#include "lanes.h"

/* One sample of all pixels of a picture. */
typedef struct nb_sample {
    uint32_t x, y; /* digits of the point before the shift */
    int centered;  /* the only sample of a pixel is its centre */
} nb_sample;

/* Sample `index` of `count`. */
nb_sample nb_sample_make(uint32_t index, uint32_t count);

/* The points of a batch whose first pixel is (left, top), in pixels from there. Depends on pixel and sample only. */
void nb_sample_points(const nb_sample *sample, uint32_t left, uint32_t top, float *x, float *y);

#endif
