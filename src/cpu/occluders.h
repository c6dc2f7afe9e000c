/* Triangles that cast shadows into fog. */
#ifndef NB_CPU_OCCLUDERS_H
#define NB_CPU_OCCLUDERS_H

#include "embree_scene.h"

typedef struct nb_occluder {
    float corner[3][3];
} nb_occluder;

/* One with holes: its mask over places in its plane, or, for the sun, before and behind it as well. */
typedef struct nb_masked_occluder {
    const nb_alpha_mask *mask;
    double place[3], at[2]; /* a corner, in the frame of the casters, and there in texels */
    double slope[2][3];     /* texels per metre */
} nb_masked_occluder;

typedef struct nb_occluders {
    size_t count;
    nb_occluder *triangles;
    uint32_t *numbers; /* of each triangle's sheet, or NB_NONE; NULL: no triangle has holes */
    nb_masked_occluder *sheets;
} nb_occluders;

static inline int nb_has_holes(const nb_occluders *casters, uint32_t triangle)
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
double nb_caster_area(const nb_occluder *triangle);

/* Lists those that have a place, in the frame of these axes. Those that are level with the third axis are left out where
 * `is_for_sun`. To be freed whatever comes. Errors: MEMORY. */
nebel_result nb_occluders_list(const nb_geometry *geometry, const double axes[3][3], int is_for_sun,
                               nb_occluders *casters);

void nb_occluders_free(nb_occluders *casters, const nebel_allocator *allocator);

/* A plane of this normal through the point; scaled so that products with coordinates stay numbers. */
void nb_shadow_plane(const double normal[3], const double point[3], float plane[4]);

#endif
