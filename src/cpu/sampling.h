/* Where in a pixel the samples lie: a (0,2)-sequence, shifted digit by digit for each pixel. Of 2^k samples every cell
 * of every split of the pixel into 2^k equal boxes holds exactly one (Niederreiter 1987; Kollig and Keller 2002). */
#ifndef NB_CPU_SAMPLING_H
#define NB_CPU_SAMPLING_H

#include "lanes.h"

/* One point in every pixel of a region, in pixels from the corner of the region's first. */
typedef struct nb_region_points {
    float x[NB_PIXELS], y[NB_PIXELS];
} nb_region_points;

/* How far from the corner of a pixel its points lie where there are `count` of them. */
typedef struct nb_sample_range {
    float low, high;
} nb_sample_range;

static inline nb_sample_range nb_sample_range_of(uint32_t count)
{
    return count == 1 ? (nb_sample_range){.5f, .5f} : (nb_sample_range){0, 1};
}

/* Sample `index` of `count` for the region whose first pixel is (left, top) of the picture. Depends on pixel and sample
 * only. The only sample of a pixel is its centre. */
void nb_sample_region(uint32_t index, uint32_t count, uint32_t left, uint32_t top, nb_region_points *points);

#endif
