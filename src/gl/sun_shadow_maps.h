/* Shadow maps, fitted to what is seen: each covers the surfaces of one range of distances and no more. */
#ifndef NB_GL_SUN_SHADOW_MAPS_H
#define NB_GL_SUN_SHADOW_MAPS_H

#include "gl_meshes.h"
#include "scene_programs.h"
#include "gl_targets.h"

/* Light coordinates are metres relative to the eye: two across the sun's light, and one against it. */
typedef struct nb_shadows {
    unsigned texture, buffer; /* 0: not made yet */
    uint32_t size;
    int count;                        /* of maps */
    float light[9];                   /* to light coordinates, by columns */
    double across[2][3];              /* the first two axes */
    float places[NB_MAX_MAPS][4];     /* low corner, texels per metre */
    float ends[NB_MAX_MAPS];          /* distance up to which a map is the finest; 0: the map is empty */
    float low, high;                  /* of everything that may cast shadows, against the light */
    float rounding;                   /* what heights may be off by [m] */
    double seen_low[2], seen_high[2]; /* of all surfaces that are seen; low above high: there are none */
    float *blocks;                    /* the survey, read back */
    size_t capacity;
    int leaning; /* depths are those of the farthest corners of texels, so that what leans does not shade the air above it */
    int sees_ground; /* which casts no shadow, and may reach far beyond all that does */
} nb_shadows;

/* Fog that the sun lights. */
typedef struct nb_sunlit_fog {
    double direction[3]; /* towards the sun, of length 1 */
    nebel_bounds bounds; /* no such fog is outside */
} nb_sunlit_fog;

/* The axes of a sun in this direction. */
void nb_shadows_turn(nb_shadows *shadows, const double sun[3]);

/* The same, turned so that no axis of the world lies along texels: the border of the shadow of what is upright would be off by
 * half a texel all along. Askew it is off to both sides in turns, which along a ray cancel. */
void nb_shadows_turn_fog(nb_shadows *shadows, const double sun[3]);

/* Surveys the surfaces of targets, whose pixels have these rays, and lays the maps. `program` is that of the survey;
 * the current vertex array has no attributes that matter. What is read back, and waited for, is a 64th of the picture.
 * MEMORY. */
nebel_result nb_shadows_fit(nb_shadows *shadows, const nb_context *context, const nebel_allocator *allocator,
                            const nebel_log *log, unsigned program, const nb_targets *targets, const nebel_rays *rays,
                            int panorama, const nb_meshes *meshes);

/* Lays the maps around all places before those surfaces where shadows may be in the fog. */
void nb_shadows_fit_fog(nb_shadows *shadows, const nb_shadows *surfaces, const nb_targets *targets,
                        const nebel_rays *rays, int panorama, const nb_meshes *meshes, const nb_sunlit_fog *fog);

/* Draws the maps. Depth is tested afterwards. MEMORY, UNSUPPORTED. */
nebel_result nb_shadows_draw(nb_shadows *shadows, const nb_context *context, const nebel_log *log, unsigned program,
                             const nb_meshes *meshes, const double eye[3]);

void nb_shadows_delete(const nb_shadows *shadows);

#endif
