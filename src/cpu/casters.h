/* Triangles that cast shadows into fog. */
#ifndef NB_CPU_CASTERS_H
#define NB_CPU_CASTERS_H

#include "geometry.h"

typedef struct nb_caster {
    float corner[3][3];
} nb_caster;

/* One with holes: its mask over places in its plane, or, for the sun, before and behind it as well. */
typedef struct nb_sheet {
    const nb_mask *mask;
    double place[3], at[2]; /* a corner, in the frame of the casters, and there in texels */
    double slope[2][3];     /* texels per metre */
} nb_sheet;

typedef struct nb_casters {
    size_t count;
    nb_caster *triangles;
    uint32_t *numbers; /* of each triangle's sheet, or NB_NONE; NULL: no triangle has holes */
    nb_sheet *sheets;
} nb_casters;

static inline int nb_has_holes(const nb_casters *casters, uint32_t triangle)
{
    return casters->numbers != NULL && casters->numbers[triangle] != NB_NONE;
}

/* Of numbers; in line, as those of the C library are not. */
static inline float nb_least(float a, float b)
{
    return a < b ? a : b;
}

static inline float nb_most(float a, float b)
{
    return a > b ? a : b;
}

/* Twice the area that one sees who looks along the third axis; > 0 where the corners go round to the left. */
double nb_caster_area(const nb_caster *triangle);

/* Lists those that have a place, in the frame of these axes. Those that are level with the third axis are left out where
 * `is_for_sun`. To be freed whatever comes. Errors: MEMORY. */
nebel_result nb_casters_list(const nb_geometry *geometry, const double axes[3][3], int is_for_sun, nb_casters *casters);

void nb_casters_free(nb_casters *casters, const nebel_allocator *allocator);

/* A plane of this normal through the point; scaled so that products with coordinates stay numbers. */
void nb_shadow_plane(const double normal[3], const double point[3], float plane[4]);

#endif
