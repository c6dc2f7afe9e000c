/* Where in a pixel the samples lie: a (0,2)-sequence, shifted digit by digit for each pixel. Of 2^k samples every cell
 * of every split of the pixel into 2^k equal boxes holds exactly one (Niederreiter 1987; Kollig and Keller 2002). */
#ifndef NB_CPU_SAMPLING_H
#define NB_CPU_SAMPLING_H

#include "lanes.h"

/* One point in every pixel of a region, row after row, in pixels from the region's first. */
typedef struct nb_region_points {
    float x[NB_REGION * NB_REGION], y[NB_REGION * NB_REGION];
    double low, high; /* how far from the corners of their pixels they lie */
} nb_region_points;

/* Sample `index` of `count` for the region whose first pixel is (left, top) of the picture. Depends on pixel and sample
 * only. The only sample of a pixel is its centre. */
void nb_sample_region(uint32_t index, uint32_t count, uint32_t left, uint32_t top, nb_region_points *points);

#endif
