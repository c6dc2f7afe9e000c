#include "sky_view_elevation.h"

#include <math.h>

nb_elevation_map nb_elevation_map_make(const nb_air_components *airs, double radius)
{
    const double height = radius - airs->radius, share = height / radius;
    const double dip = sqrt(share * (1 + airs->radius / radius));
    return (nb_elevation_map){.radius = radius,
                              .ground = airs->radius,
                              .thickness = airs->top - airs->radius,
                              .height = height,
                              .dip = dip,
                              .ratio = airs->radius / radius,
                              .horizon = sqrt(0.5 * (1 + dip)),
                              .half_arc = sqrt(0.5 * share)};
}

static nb_view_elevation fall_slope(const nb_elevation_map *outlook, double row)
{
    const int outside = outlook->height > outlook->thickness;
    const double left = 1 - row, lacks = outside ? left * left / (left + NB_FALLING_SPACING * row) : left;
    const double half = (1 - lacks) * outlook->half_arc;
    const double across = outlook->ground * 2 * half * sqrt((1 - half) * (1 + half));
    const double down = outlook->height + 2 * outlook->ground * half * half;
    const double way = sqrt(across * across + down * down);
    return way > 0 ? (nb_view_elevation){-down / way, across / way} : (nb_view_elevation){-1, 0};
}

static nb_view_elevation rise_slope(const nb_elevation_map *outlook, double row)
{
    if (outlook->height > outlook->thickness) {
        const double sine = (outlook->ground + row * row * outlook->thickness) / outlook->radius;
        return (nb_view_elevation){-sqrt((1 - sine) * (1 + sine)), sine};
    }
    const double concentration = nb_row_concentration(*outlook),
                 left = row * row / (concentration - (concentration - 1) * row * row);
    const double half = outlook->horizon * (1 - left);
    return (nb_view_elevation){1 - 2 * half * half, 2 * half * sqrt((1 - half) * (1 + half))};
}

nb_view_elevation nb_elevation_map_slope(const nb_elevation_map *outlook, int falls, double row, nb_reach *reach)
{
    const nb_view_elevation slope = falls ? fall_slope(outlook, row) : rise_slope(outlook, row);
    *reach = falls ? nb_falling_reach(*outlook, slope.cosine, slope.sine)
                   : nb_rising_reach(*outlook, slope.cosine, slope.sine);
    reach->row = row;
    return slope;
}
