/* Meshes by triangles: each an instance that has its three corners with it, for panoramas. */
#ifndef NB_GL_TRIANGLE_INSTANCES_H
#define NB_GL_TRIANGLE_INSTANCES_H

#include "gl_meshes.h"

/* Attributes of an instance. */
enum { NB_CORNER_POSITION = 0, NB_CORNER_NORMAL = 3, NB_CORNER_UV = 6, NB_CORNER_FACE = 9, NB_CORNER_FOG = 10 };

/* Makes what is not there yet, of all meshes. Changes the bindings of ARRAY_BUFFER and the vertex array. MEMORY. */
nebel_result nb_triangle_instances_make(nb_meshes *meshes);

/* Gives the corners the fog of the vertices that nb_vertex_fog_set filled. Otherwise as above. */
nebel_result nb_triangle_instances_set_fog(nb_meshes *meshes);

/* Draws the triangles of a mesh, a strip of so many vertices each. Changes the vertex array. */
void nb_triangle_instances_draw(const nb_mesh *mesh, int vertices);

#endif
