/* glTF as Assimp 5.2 understands it: what it would take for something else is made plain first. */
#ifndef NB_MODEL_GLTF_PREPARE_H
#define NB_MODEL_GLTF_PREPARE_H

#include "model.h"
#include "model_files.h"

/* Files that exist in memory alone, in place of the model and beside it. */
typedef struct nb_gltf_file {
    const char *name;
    nb_bytes bytes;
} nb_gltf_file;

enum { NB_GLTF_TEXT, NB_GLTF_CHUNK, NB_GLTF_EXTRA, NB_GLTF_FILE_COUNT };

typedef struct nb_gltf_files {
    nb_gltf_file files[NB_GLTF_FILE_COUNT]; /* the text replaces the model; without bytes nothing is replaced */
    char fault[512]; /* what is wrong with the JSON, which Assimp may take all the same; else "" */
} nb_gltf_files;

/* Refuses extensions that the file requires and nobody knows. Numbers of vertices that are not floats become floats, and
 * compressed buffer views are decompressed: Assimp then is to read made->files in place of the file. Release `made` also
 * after an error. Errors: FORMAT, LIMIT, MEMORY, UNSUPPORTED. */
nebel_result nb_gltf_prepare(const nb_model_load *load, nb_model_files *files, nb_gltf_files *made);

/* The same of a text that is there already, and becomes the callee's. */
nebel_result nb_gltf_prepare_text(const nb_model_load *load, nb_model_files *files, nb_bytes *text,
                                  nb_gltf_files *made);
void nb_gltf_release_files(const nebel_allocator *allocator, nb_gltf_files *made);

#endif
