/* Meshes and textures in OpenGL. */
#ifndef NB_GL_GL_MESHES_H
#define NB_GL_GL_MESHES_H

#include "gl_caps.h"

#include <nebel/scene.h>

/* Vertex attributes. */
enum {
    NB_ATTRIBUTE_POSITION,
    NB_ATTRIBUTE_NORMAL,
    NB_ATTRIBUTE_UV,
    NB_ATTRIBUTE_FACE,
    NB_ATTRIBUTE_FOG,
    NB_ATTRIBUTE_EDGE, /* two */
};

/* The last vertex of each triangle is its own and holds what is constant on the triangle. */
typedef struct nb_vertex {
    float position[3], normal[3], uv[2], face[3];
    float edges[2][3]; /* from it to the first corner and to the second */
} nb_vertex;

#define NB_LARGE_EDGE 1e4 /* m: floats leave less than a millimeter of shorter ones */

/* normal . place = height, and a ball around the triangle, all around the mesh's origin. */
typedef struct nb_large_plane {
    double normal[3], height, middle[3], radius;
} nb_large_plane;

typedef struct nb_mesh {
    double origin[3];
    float low[3], high[3]; /* of the positions that are used */
    double longest;        /* edge of its triangles [m] */
    nb_large_plane *large; /* of triangles with edges above NB_LARGE_EDGE */
    size_t large_count;
    float base_color[3];
    unsigned vertex_array, vertices, indices, texture; /* texture 0: none */
    unsigned mask;                                     /* a texture; 0: no holes */
    float cutoff;                                      /* of its alpha; 0 without it */
    unsigned fog; /* per vertex: the light that fog adds, and the amount of fog; 0: not made yet */
    unsigned corner_array, corners, corner_fog; /* the same by triangles, as instances; 0: not made yet */
    size_t vertex_count;
    int index_count;
} nb_mesh;

typedef struct nb_meshes {
    nebel_allocator allocator;
    nebel_log log;
    nb_mesh *list;
    size_t count;
    unsigned *textures;
    size_t texture_count;
    double low[3], high[3]; /* of all meshes, in the world; low above high where there is nothing */
} nb_meshes;

/* Checks and copies. What was made before an error is freed by nb_meshes_delete. Changes the bindings of TEXTURE_2D on
 * the active unit, ARRAY_BUFFER and the vertex array. Errors: as nebel_create_gl_renderer. */
nebel_result nb_meshes_make(nb_meshes *meshes, const nb_context *context, const nebel_scene_data *scene);

/* From there to the box around a mesh [m], 0 within it. */
double nb_meshes_distance(const nb_mesh *mesh, const double place[3]);

/* The mask of a mesh, for a program that has it on NB_UNIT_MASK and the cutoff at this location. Changes the active unit.
 */
void nb_meshes_bind_mask(const nb_mesh *mesh, int cutoff);

/* A buffer's bytes in memory, as glMapBufferRange gives them, and back; 0 where the driver lost what was written.
 * Change the binding of ARRAY_BUFFER. */
void *nb_meshes_map(unsigned buffer, size_t size, unsigned access);
int nb_meshes_unmap(unsigned buffer, const void *mapped);

/* In OpenGL, where the context is still there; then in memory. */
void nb_meshes_delete(nb_meshes *meshes, int in_context);

#endif
