/* What a glTF file holds beside its meshes. */
#ifndef NB_MODEL_GLTF_H
#define NB_MODEL_GLTF_H

#include "math/affine.h"
#include "file/file.h"
#include "json/json.h"

/* glTF 2.0, section 4.4: magic, version and length of the file; then chunks of length, type, content, JSON first. Numbers are
 * four bytes each, the lowest first. */
enum { NB_GLB_HEADER = 12, NB_GLB_CHUNK_HEADER = 8 };

static inline uint32_t nb_gltf_word(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* Whether the name says that it is glTF. */
bool nb_gltf_is(const char *file);

/* The JSON of a .gltf or .glb file; nothing where the file is another one, or cannot be read, which loading it will
 * say. Free text->data with nb_release. Errors: MEMORY. */
nebel_result nb_gltf_read_text(const nebel_allocator *allocator, const char *file, nb_bytes *text);

typedef struct nb_gltf_link {
    uint32_t parent, child; /* nodes; of roots, scene and node */
} nb_gltf_link;

typedef struct nb_gltf_links {
    nb_gltf_link *items;
    size_t count, capacity;
} nb_gltf_links;

/* How the nodes of a file hang together. */
typedef struct nb_gltf_tree {
    nebel_allocator allocator;
    nb_affine *places; /* of each node in its parent, and in the world once all are known */
    size_t count, capacity;
    nb_gltf_links children, roots;
    double scene;      /* which one is shown */
    uint32_t *parents; /* of each node, once all are known */
} nb_gltf_tree;

/* Reads the tree. `desc` needs text, size, name, allocator and log. Release the tree also after an error. */
nebel_result nb_gltf_read_tree(const nb_json_desc *desc, nb_gltf_tree *tree);
void nb_gltf_release_tree(nb_gltf_tree *tree);

/* Where a node is in the world. False where the scene does not show it. */
bool nb_gltf_find_place(const nb_gltf_tree *tree, size_t node, nb_affine *place);

#endif
