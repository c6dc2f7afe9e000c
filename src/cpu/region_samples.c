#include "region_samples.h"

#include "frame/pixel_samples.h"

NB_CLONES static void set_points(float x, float y, nb_region_points *points)
{
    NB_SIMD
    for (uint32_t i = 0; i < NB_PIXELS; i++) {
        points->x[i] = (float)nb_lane_x(i) + x;
        points->y[i] = (float)nb_lane_y(i) + y;
    }
}

void nb_sample_region(uint32_t index, uint32_t count, nb_region_points *points)
{
    const nb_pixel_position point = nb_pixel_sample(index, count);
    set_points((float)point.x, (float)point.y, points);
}
