/* Fog at the vertices of meshes, as one eye sees them. */
#ifndef NB_GL_GL_VERTEX_FOG_H
#define NB_GL_GL_VERTEX_FOG_H

#include "gl_meshes.h"

/* What fogs the vertices: volumes, or cells, a fog factor or a device's vertex fog in their place. Rays of an orthographic camera begin in the plane across
 * them through the eye; each ray of a panorama is its own axis. */
typedef struct nb_vertex_source {
    const nebel_lighting *fog;
    const nebel_cells *cells;        /* NULL: none */
    const nebel_factor_desc *factor; /* resolved; NULL: none */
    const nebel_d3d9_fog *d3d9;      /* NULL: none */
    const nebel_vertex_desc *look;   /* of the volumes; NULL: {0} */
    int blends_stored;               /* colors are to be as hardware stores them; those of `factor` are so already */
    nebel_vertex_format format;      /* what hardware is given of the volumes */
    nebel_cell_view view;            /* of unit forward */
    nebel_projection projection;
} nb_vertex_source;

/* Fills the attribute NB_ATTRIBUTE_FOG of all meshes. Changes the bindings of ARRAY_BUFFER and the vertex array.
 * Errors: MEMORY, and those of nebel_compute_vertex_fog or nebel_compute_cell_fog. */
nebel_result nb_vertex_fog_set(nb_meshes *meshes, const nb_vertex_source *source);

/* The same of places in memory, whose stride is not 0: the light that fog adds, and the amount of fog. Calls no OpenGL. */
nebel_result nb_vertex_fog_find(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                float (*fog)[4]);

#endif
