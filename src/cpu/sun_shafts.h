/* Where the sun reaches the rays of a batch past the surfaces: the ends of shadows along each of them. */
#ifndef NB_CPU_SUN_SHAFTS_H
#define NB_CPU_SUN_SHAFTS_H

#include "sun_cells.h"
#include "camera_rays.h"

/* The fog that the sun lights, relative to the origin of the geometry; infinite where it has no end. */
typedef struct nb_lit_box {
    float low[3], high[3];
} nb_lit_box;

/* Where rays begin. */
typedef enum nb_eye_visibility {
    NB_EYE_UNKNOWN = 0, /* or each at another place */
    NB_EYE_IN_LIGHT,
    NB_EYE_IN_SHADOW
} nb_eye_visibility;

/* A stretch of a packet's ray in shadow. */
typedef struct nb_shadow {
    uint32_t lane;
    float enter, leave;
} nb_shadow;

/* What a thread works in; all zero at first. */
typedef struct nb_sun_shafts {
    nb_shadow *shadows; /* of a packet, as they were found */
    size_t shadow_count, shadow_capacity;
    nb_shadow *sorted; /* the same by lane, as many as there is room for the others */
    size_t sorted_capacity;
    float *boundaries; /* m from where fog begins to count, which is before a ray is advanced */
    size_t boundary_count, boundary_capacity;
    uint32_t first[NB_BATCH + 1]; /* see nebel_ray_visibility */
    size_t by_walls, by_prisms;   /* packets, up to now */
} nb_sun_shafts;

/* Whether the eye of the view is in shadow, in the sun that cells are made for. UNKNOWN, too, where it is so near the
 * border of a shadow that rounding would say. */
nb_eye_visibility nb_sun_shafts_eye(const nb_sun_cells *cells, const nb_geometry *geometry, const nb_view *view);

/* `distance` is how far fog is asked for along each ray, 0 where it is not, and `advance` as in nb_view. Where the eye is
 * known rays must end before they pass a surface; the ends of shadows are found with far less work then. Errors:
 * MEMORY. */
nebel_result nb_sun_shafts_find(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_sun_cells *cells,
                                const nb_lit_box *box, const nb_ray_batch *rays, double advance, const float *distance,
                                nb_eye_visibility eye);

void nb_sun_shafts_free(nb_sun_shafts *shafts, const nebel_allocator *allocator);

#endif
