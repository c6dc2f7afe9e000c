/* A scene in smaller triangles. */
#ifndef NB_TOOLS_REFINE_MESHES_H
#define NB_TOOLS_REFINE_MESHES_H

#include <nebel/classic.h>
#include <nebel/scene.h>

/* What the scene's meshes become for one eye; the rest of the scene is as it was. */
typedef struct nb_refined_scene {
    nebel_scene_data data;
    nebel_mesh *meshes;
    nebel_tessellation **made;
    float **attributes;                                            /* of each mesh: normals, then texture coordinates */
    size_t triangles_before, triangles, over_count, deepest_count; /* of all meshes */
    double error;
} nb_refined_scene;

/* Tessellates every mesh, each within the limits of `desc`. Errors: those of nebel_tessellate. */
nebel_result nb_refine_make(const nebel_scene_data *scene, const nebel_snapshot *fog,
                            const nebel_tessellation_desc *desc, nb_refined_scene *finer);

/* Lights it as the scene is lit now. */
void nb_refine_light(nb_refined_scene *finer, const nebel_scene_data *scene);

/* The volume with which the fog of the scene up to there has no proof at a frame; their number where none is found. */
size_t nb_refine_find_unproven(const nebel_scene *scene, double frame);
void nb_refine_free(nb_refined_scene *finer);

/* m */
double nb_refine_find_longest_edge(const nebel_scene_data *scene);

#endif
