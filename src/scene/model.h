/* Models become meshes: what the loaders share. */
#ifndef NB_SCENE_MODEL_H
#define NB_SCENE_MODEL_H

#include "scene/codec.h"
#include "scene/scene_internal.h"

/* The most triangles of all models together. */
#define NB_MAX_TRIANGLES ((uint64_t)1 << 28)

typedef struct nb_point_set {
    double (*places)[3]; /* m */
    size_t count, capacity;
    size_t limit; /* the most there may be */
} nb_point_set;

/* What a loader works with; `set` receives the meshes, or `points` the vertices. */
typedef struct nb_model_load {
    nebel_allocator allocator;
    nebel_log log;
    const nb_model_source *source;
    nb_model_set *set;
    nb_point_set *points;
} nb_model_load;

nebel_result nb_heightfield_load(const nb_model_load *load);
nebel_result nb_assimp_load(const nb_model_load *load);

/* The vertices of a model, those at one place once, in metres and where load->source places them. Goes to load->points.
 */
nebel_result nb_assimp_load_points(const nb_model_load *load);

/* Memory for positions and normals, uvs where wanted. False when memory is out; release the mesh also then. */
bool nb_mesh_allocate_vertices(const nebel_allocator *allocator, uint32_t count, bool has_uvs, nebel_mesh *mesh);
void nb_mesh_release(const nebel_allocator *allocator, nebel_mesh *mesh);

/* Hand over a mesh or a texture, also its memory on failure. Errors: LIMIT, MEMORY. */
nebel_result nb_model_add_mesh(const nb_model_load *load, nebel_mesh *mesh);
nebel_result nb_model_add_texture(const nb_model_load *load, const nebel_texture *texture, int32_t *index);

/* LIMIT, and says that there are more than NB_MAX_TRIANGLES. */
nebel_result nb_model_refuse_triangles(const nb_model_load *load);

/* Logs "FILE:LINE:COLUMN: models[0].file: message" and returns the result. */
nebel_result nb_model_fail(const nb_model_load *load, nebel_result result, const char *format, ...) NB_PRINTF(3, 4);

/* A log that keeps the last message, so that it can be passed on with the model's place before it. */
typedef struct nb_note {
    char text[512];
} nb_note;

nebel_log nb_note_log(nb_note *note);

#endif
