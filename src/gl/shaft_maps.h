/* The shadows of models in sunlit fog: shadow maps of all that may shade it, and of the nearest and farthest of blocks of
 * their texels, so that rays through them pass over what is all lit or all dark. */
#ifndef NB_GL_SHAFT_MAPS_H
#define NB_GL_SHAFT_MAPS_H

#include "sun_shadow_maps.h"

typedef struct nb_shaft_maps {
    nb_shadows maps; /* the finest level */
    /* Array of least and greatest depth: a layer for each map of its blocks of 8 texels either way, then one of 64; 0:
     * not made yet. */
    unsigned ranges;
    unsigned buffer, program;
} nb_shaft_maps;

/* Lays the maps around the fog before the surfaces that `surfaces` has surveyed in this frame, and draws them; the axes of
 * maps.light are known. `program` is nb_scene_programs.shadow; the current vertex array has no attributes that matter. MEMORY,
 * UNSUPPORTED. */
nebel_result nb_shaft_maps_draw(nb_shaft_maps *shafts, const nb_context *context, const nebel_log *log,
                                unsigned program, unsigned vertex_array, const nb_shadows *surfaces,
                                const nb_targets *targets, const nebel_rays *rays, int panorama,
                                const nb_meshes *meshes, const nb_sunlit_fog *fog);

/* Sets what nb_shaft_text reads in the current program, and binds textures to the units of shadow maps and of the veil. */
void nb_shaft_maps_set(const nb_shaft_maps *shafts, unsigned program);

void nb_shaft_maps_delete(const nb_shaft_maps *shafts);

/* Comes before the fog's text, which takes NEBEL_SUN_VISIBILITY from it. */
extern const char nb_shaft_text[];

#endif
