/* The shadows that the sun casts behind the triangles of a geometry.
 *
 * In a frame whose third axis points away from the sun the shadow of a triangle is a prism without end: within the
 * three edges as they look from the sun, and behind the triangle. It is cut out of a ray by four planes, so that the
 * ends of shadows on a ray are found as exactly as floats allow, whatever the size of what casts them: there is no map
 * whose texels could be too coarse.
 *
 * The plane that the sun looks at is divided into cells of few triangles each. Of each cell is known before which depth
 * nothing in it is in shadow, and often a depth from which on all of it is (sun_cell_occlusion.h): only where a ray passes between
 * both are prisms cut out of it. */
#ifndef NB_CPU_SUN_CELLS_H
#define NB_CPU_SUN_CELLS_H

#include "shadow_boundaries.h"

enum {
    NB_CELL_FAN = 16,    /* children of a node */
    NB_CELL_LEVELS = 12, /* of cells, at most */
    NB_LEAF_LEVELS = 8,  /* of nodes in a cell that is not divided: 16^8 triangles */
};

/* A place p is in shadow where plane[0..2] . p + plane[3] >= 0 for each: those of the edges, and that of the triangle.
 */
typedef struct nb_prism {
    float planes[4][4];
} nb_prism;

/* Children are cells, which are nodes in their turn, or triangles. */
typedef struct nb_cell_node {
    float low[2][NB_CELL_FAN], high[2][NB_CELL_FAN]; /* what a child takes of the plane */
    float nearest[NB_CELL_FAN];                      /* where its shadows begin; INFINITY: there is no such child */
    float covered[NB_CELL_FAN];                      /* from where on all of it is in shadow; INFINITY: not known */
    uint32_t child[NB_CELL_FAN];                     /* number of a node, or NB_IS_PRISM and that of a prism */
} nb_cell_node;

#define NB_IS_PRISM 0x80000000u

typedef struct nb_sun_cells {
    double sun[3], origin[3]; /* of the geometry, when this was built */
    int is_built;
    float axes[3][3]; /* of the frame, in the world */
    nb_prism *prisms;
    size_t prism_count, prism_capacity;
    uint32_t *numbers; /* of each prism's sheet, or NB_NONE; NULL: no triangle has holes */
    nb_masked_occluder *sheets;
    size_t number_capacity;
    nb_cell_node *nodes; /* the first is above all; none: there are no shadows */
    size_t node_count, node_capacity;
    nb_shadow_boundaries walls;
} nb_sun_cells;

/* Builds for a sun in this direction, of length 1, or keeps what is built where that is for the same sun and place.
 * Errors: MEMORY; there are no cells then. */
nebel_result nb_sun_cells_set(nb_sun_cells *cells, const nb_geometry *geometry, const double sun[3]);

/* NULL: the triangle has no holes. */
static inline const nb_masked_occluder *nb_sun_cells_sheet(const nb_sun_cells *cells, uint32_t prism)
{
    return cells->numbers == NULL || cells->numbers[prism] == NB_NONE ? NULL : &cells->sheets[cells->numbers[prism]];
}

void nb_sun_cells_free(nb_sun_cells *cells, const nebel_allocator *allocator);

#endif
