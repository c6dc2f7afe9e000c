/* The samples of a region. */
#ifndef NB_CPU_REGION_SAMPLES_H
#define NB_CPU_REGION_SAMPLES_H

#include "batch_layout.h"

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
    const float half = .5f / (float)count;
    return (nb_sample_range){half, 1 - half};
}

/* Sample `index` of `count`. Depends on nothing else. */
void nb_sample_region(uint32_t index, uint32_t count, nb_region_points *points);

#endif
