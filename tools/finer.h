/* A scene in smaller triangles. */
#ifndef NB_FINER_H
#define NB_FINER_H

#include <nebel/classic.h>
#include <nebel/scene.h>

/* What the scene's meshes become for one eye; the rest of the scene is as it was. */
typedef struct nb_finer {
    nebel_scene_data data;
    nebel_mesh *meshes;
    nebel_tessellation **made;
    float **attributes; /* of each mesh: normals, then texture coordinates */
    size_t triangles_before, triangles, over_count;
    double error;
} nb_finer;

/* Tessellates every mesh, so that fog at its vertices is within `bound` for this eye. Errors: those of
 * nebel_tessellate. */
nebel_result nb_finer_make(const nebel_scene_data *scene, const nebel_snapshot *fog, const double eye[3], double bound,
                           nb_finer *finer);
void nb_finer_free(nb_finer *finer);

#endif
