/* Slopes of rays from one place: which row of a table a slope is, and where its ray goes. */
#ifndef NB_ATMOSPHERE_SKY_VIEW_ELEVATION_H
#define NB_ATMOSPHERE_SKY_VIEW_ELEVATION_H

#include "optical_depth.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/atmosphere.inc"

/* `radius` is at least the ground's. */
nb_elevation_map nb_elevation_map_make(const nb_air_components *airs, double radius);

/* Cosine and sine of the angle to the zenith. */
typedef struct nb_view_elevation {
    double cosine, sine;
} nb_view_elevation;

/* The slope of a row, with its reach. */
nb_view_elevation nb_elevation_map_slope(const nb_elevation_map *outlook, int falls, double row, nb_reach *reach);

#endif
