/* A table of what air does to the rays of one place: see view.c. */
#ifndef NB_ATMOSPHERE_SKY_VIEW_H
#define NB_ATMOSPHERE_SKY_VIEW_H

#include "atmosphere.h"
#include "sky_view_lookup.h"
#include "sky_view_elevation.h"

enum {
    NB_VIEW_FALLING = 60, /* rows that end at the ground */
    NB_VIEW_RISING = 64,  /* and others */
    NB_VIEW_ROWS = NB_VIEW_FALLING + NB_VIEW_RISING,
    NB_VIEW_COLUMNS = 25,      /* from within shallow air */
    NB_VIEW_MORE_COLUMNS = 73, /* where day and night are seen at once */
    NB_VIEW_LEVELS = 12,       /* from low in the air, beside the one at the start */
    NB_VIEW_MORE_LEVELS = 20,  /* from high up */
    NB_VIEW_SUNS = 257,
};

struct nebel_sky_view {
    nebel_allocator allocator;
    const nebel_atmosphere *atmosphere;
    nebel_sun sun;
    nb_elevation_map outlook;
    double up[3], ahead[3], aside[3]; /* ahead: level, towards the sun */
    nb_view_elevation sun_slope;
    int columns;
    int levels; /* NB_VIEW_LEVELS or NB_VIEW_MORE_LEVELS, or 1: the ends alone */
    int scatterers[NEBEL_MAX_COMPONENTS], scatterer_count;
    int size;                /* of an entry, a multiple of four: see below */
    float *entries;          /* [row][column][level 0..levels] */
    double (*extinction)[4]; /* [row][level 0..levels], 1/m, and what interpolation may miss of it */
    double brightest;        /* light of a whole ray, as if all scattered evenly */
    nb_gauss_rule rule;
    double sunlight[NB_VIEW_SUNS][3]; /* what air leaves of the sun on the ground, evenly over the root of the cosine of
                                         its angle to the zenith */
    const nb_sky_view_kernel *look;
};

/* In an entry, all per metre and for a sun of irradiance 1 but for the last two: what was scattered once by each kind of
 * air that scatters, for a phase function of 1; more often; how much of that is in doubt, of the brightest colour under
 * the view's sun; and what part of the light interpolation may miss. */
static inline int nb_view_often(const nebel_sky_view *view)
{
    return 3 * view->scatterer_count;
}

static inline float *nb_view_entry(const nebel_sky_view *view, int row, int column, int level)
{
    const size_t place =
        ((size_t)row * (size_t)view->columns + (size_t)column) * ((size_t)view->levels + 1) + (size_t)level;
    return view->entries + place * (size_t)view->size;
}

static inline double *nb_view_extinction(const nebel_sky_view *view, int row, int level)
{
    return view->extinction[row * (view->levels + 1) + level];
}

#endif
