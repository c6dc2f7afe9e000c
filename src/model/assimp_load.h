/* Models through Assimp: its scene graph, its meshes, its materials. */
#ifndef NB_MODEL_ASSIMP_LOAD_H
#define NB_MODEL_ASSIMP_LOAD_H

#include "gltf_prepare.h"

#include <assimp/cfileio.h>
#include <assimp/scene.h>

/* What a material says, once it has been looked at. */
typedef struct nb_assimp_surface {
    bool known;
    float base_color[3];
    int32_t texture;    /* or -1 */
    int32_t mask;       /* or -1: no holes */
    float alpha_cutoff; /* > 0 and <= 1 with a mask, else 0 */
    bool is_clear;      /* all of it is a hole */
    unsigned uv_index;  /* which set of coordinates both take */
    bool has_uv_map;    /* they go through a map, v downwards */
    double uv_map[2][3];
} nb_assimp_surface;

typedef struct nb_loaded_texture {
    const char *key;
    bool of_grey;
    int32_t index;                /* or -1 where it cannot be read */
    uint8_t min_alpha, max_alpha; /* of all texels */
} nb_loaded_texture;

typedef struct nb_assimp {
    const nb_model_load *load;
    const struct aiScene *scene;
    nb_arena scratch;
    nb_model_files files;
    nb_gltf_files made;          /* read in place of some */
    const char *name;            /* of what Assimp reads */
    struct aiFileIO io;          /* opens them */
    nb_assimp_surface *surfaces; /* one for each material */
    nb_loaded_texture *textures; /* those already tried */
    size_t loaded_count, loaded_capacity;
    uint64_t left_out_faces, left_out_triangles; /* points and lines; triangles with bad corners */
    uint64_t left_out_points;                    /* not finite */
    uint64_t left_out_masks, left_out_clear;     /* meshes: with a mask but nothing to place it; all of them a hole */
} nb_assimp;

/* Refuse, or mend, what Assimp would not survive: before it reads the file, and before it works on what it read.
 * Errors: FORMAT, MEMORY. */
nebel_result nb_assimp_check_file(const nb_model_load *load);
nebel_result nb_assimp_check_meshes(nb_assimp *in, const struct aiScene *scene);

/* Says why a file could not be read, given Assimp's reason, NULL where it gives none. Errors: FORMAT, MEMORY. */
nebel_result nb_assimp_refuse(const nb_assimp *in, const char *reason);

/* Makes Assimp open what in->files allows. */
void nb_assimp_set_files(nb_assimp *in);

/* Adds one mesh of the model at a place. A mesh without triangles adds nothing. */
nebel_result nb_assimp_add_mesh(nb_assimp *in, const struct aiMesh *mesh, const nb_affine *place);

/* Adds the vertices of one mesh to load->points. */
nebel_result nb_assimp_add_points(nb_assimp *in, const struct aiMesh *mesh, const nb_affine *place);

/* Finds the surface of a material; a texture that cannot be read leaves the plain colour and a note in the log. */
nebel_result nb_assimp_find_surface(nb_assimp *in, unsigned material, nb_assimp_surface *surface);

/* Finds the texture of this name. With `of_grey` its alpha is the grey of a picture that has no alpha of its own. */
nebel_result nb_assimp_find_texture(nb_assimp *in, char *path, bool of_grey, nb_loaded_texture *found);

/* Finds which coordinates a texture of a material takes, and their map. */
void nb_assimp_find_uvs(const nb_assimp *in, const struct aiMaterial *material, enum aiTextureType type,
                        unsigned uv_index, nb_assimp_surface *surface);

/* Finds the mask of a material, in the members of a surface whose texture is known. */
nebel_result nb_assimp_find_mask(nb_assimp *in, const struct aiMaterial *material, nb_assimp_surface *surface);

#endif
