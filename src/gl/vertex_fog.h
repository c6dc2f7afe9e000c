/* Fog at the vertices of meshes, as one eye sees them. */
#ifndef NB_GL_VERTEX_FOG_H
#define NB_GL_VERTEX_FOG_H

#include "meshes.h"

/* Fills the attribute NB_ATTRIBUTE_FOG of all meshes. Changes the bindings of ARRAY_BUFFER and the vertex array.
 * Errors: MEMORY, and those of nebel_fog_vertices. */
nebel_result nb_vertex_fog_set(nb_meshes *meshes, const nebel_snapshot *fog, const double eye[3]);

#endif
