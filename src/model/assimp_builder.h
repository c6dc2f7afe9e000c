/* A mesh between Assimp and what is kept of it: which of its vertices are one, and which must be several because an
 * edge is sharp. Vectors have the type they come in. */
#ifndef NB_MODEL_ASSIMP_BUILDER_H
#define NB_MODEL_ASSIMP_BUILDER_H

#include "base/base.h"

#include <assimp/vector3.h>

#include <stdbool.h>

typedef struct nb_weld_mesh {
    nebel_allocator allocator;
    const struct aiVector3D *positions, *uvs; /* of the given vertices; uvs may be NULL */
    const struct aiVector3D *normals;         /* of all vertices; NULL where none were given and none are made yet */
    struct aiVector3D *made_normals;          /* owned; what `normals` points to once they are made */
    uint32_t given_count;                     /* < 2^31 */
    uint32_t copy_count;                      /* of vertices, numbered after the given ones */
    uint32_t *copied;                         /* the given vertex that each copy equals but for its normal */
    uint32_t triangle_count;                  /* at most NB_MAX_TRIANGLES */
    uint32_t *corners;                        /* 3 per triangle: vertices */
} nb_weld_mesh;

/* What two vertices must have in common to be one. */
typedef enum nb_weld_key { NB_LIKE_POSITION, NB_LIKE_ALL } nb_weld_key;

/* For each vertex from `begin` to before `end`, the first of them that is like it. False when memory is out. */
bool nb_draft_find_like(const nb_weld_mesh *draft, nb_weld_key likeness, uint32_t begin, uint32_t end, uint32_t *first);

/* Makes normals. Around one place each triangle counts once; triangles that turn away from each other by more than 60
 * degrees do not see each other there: their edge stays sharp, and the vertex gets a copy for each side. A normal
 * without a direction is 0. False when memory is out. */
bool nb_draft_smooth(nb_weld_mesh *draft);

/* Makes vertices from `begin` on that are alike one. The corners get new numbers, and *kept receives for each of
 * *kept_count new vertices the old one; those of no triangle are dropped. Free *kept with nb_release. False when memory
 * is out. */
bool nb_draft_join(const nb_weld_mesh *draft, uint32_t begin, uint32_t **kept, uint32_t *kept_count);

/* The given vertex that has a vertex's position and uvs. */
static inline uint32_t nb_draft_origin(const nb_weld_mesh *draft, uint32_t vertex)
{
    return vertex < draft->given_count ? vertex : draft->copied[vertex - draft->given_count];
}

#endif
