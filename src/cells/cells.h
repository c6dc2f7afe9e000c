/* Cells as queries want them: planes in world coordinates, portals as flat polygons. */
#ifndef NB_CELLS_CELLS_H
#define NB_CELLS_CELLS_H

#include "base/base.h"

#include <nebel/classic.h>

/* Inside where normal . x <= distance; `normal` is of unit length. tie < 0: a way that lies in the plane is inside. */
typedef struct nb_cell_plane {
    double normal[3], distance, tie;
} nb_cell_plane;

typedef struct nb_fog_cell {
    double low[3], high[3];
    size_t first_plane, plane_count;
    double density, color[3];
} nb_fog_cell;

/* Vertices go counterclockwise as seen against the normal. */
typedef struct nb_portal {
    size_t cells[2];
    size_t first_vertex, vertex_count;
    double normal[3];
} nb_portal;

struct nebel_cells {
    nebel_allocator allocator;
    nebel_cell_model model;
    nebel_cell_span span;
    int grouped;
    int has_walls;    /* portals were given */
    double tolerance; /* m: what is so small is nothing */

    size_t cell_count, plane_count, portal_count, vertex_count;
    size_t plane_capacity, portal_capacity, vertex_capacity;
    nb_fog_cell *cells;
    nb_cell_plane *planes;
    nb_portal *portals;
    double (*vertices)[3];
};

/* Signed distance from the plane, > 0 outside. */
static inline double nb_cell_plane_distance(const nb_cell_plane *plane, const double x[3])
{
    return plane->normal[0] * x[0] + plane->normal[1] * x[1] + plane->normal[2] * x[2] - plane->distance;
}

/* The portals between all cells that touch. Errors: MEMORY. */
nebel_result nb_cells_derive_portals(nebel_cells *cells);

/* Checks a portal between checked cells and adds it. Errors: VALUE, MEMORY. */
nebel_result nb_cells_add_portal(nebel_cells *cells, const nebel_log *log, size_t number, const nebel_portal *portal);

#endif
