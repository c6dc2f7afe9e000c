/* Where the sun's shadows have sides.
 *
 * Between the eye and the surface that it sees a ray passes no surface, so that on its way light and shadow change
 * nowhere but at a *wall*: what is between an edge that the sun sees and the surface that it sees next beside that edge.
 * On one side of a wall all is in the shadow of what has the edge, on the other all is lit. There are few walls, and a ray
 * passes through hardly more of them than it has ends of shadows.
 *
 * Whether a ray passes a wall is known to rounding only, and a ray that slips through where two walls meet would have all
 * behind that place wrong. But light and shadow alternate: whoever looks for walls learns of each where it leads from
 * and to, and must ask the prisms (sun_cells.h) where that does not fit. */
#ifndef NB_CPU_SHADOW_BOUNDARIES_H
#define NB_CPU_SHADOW_BOUNDARIES_H

#include "sun_cell_occlusion.h"

enum {
    NB_WALL_FAN = 16,   /* children of a node */
    NB_WALL_LEVELS = 8, /* 16^8 walls */
};

/* Shadow is to the left of the way between both places of the plane; over them it reaches from `top` to `bottom`, which
 * is 1e30 where there is no surface. Depths change evenly between the places. */
typedef struct nb_shadow_boundary {
    float from[2], to[2], top[2], bottom[2];
} nb_shadow_boundary;

/* Of children that there are not, `low` is above `high`. */
typedef struct nb_wall_node {
    float low[2][NB_WALL_FAN], high[2][NB_WALL_FAN], top[NB_WALL_FAN], bottom[NB_WALL_FAN];
} nb_wall_node;

typedef struct nb_shadow_boundaries {
    nb_shadow_boundary *walls;
    size_t count, capacity;
    int is_unknown; /* there are holes in surfaces, or too many triangles over each other */
    uint64_t looks; /* at triangles, while walls were looked for */
    nb_wall_node *nodes;
    int level_count;
    nb_wall_node *levels[NB_WALL_LEVELS]; /* those above walls first; the last has one node */
} nb_shadow_boundaries;

/* Adds the walls in a cell. `list` has the triangles that the sun may see there; edges along the high sides of a cell are
 * those of the next one, if that is not `last` in this direction. Returns 0 when memory is out. */
int nb_shadow_boundaries_add(nb_shadow_boundaries *walls, const nebel_allocator *allocator, const nb_occluders *casters,
                             const uint32_t *list, size_t count, const nb_sun_cell *cell, const nb_sun_cell *last);

/* Makes the tree when all walls are there, which are within these bounds. Returns 0 when memory is out. */
int nb_shadow_boundaries_finish(nb_shadow_boundaries *walls, const nebel_allocator *allocator,
                                const nb_sun_cell *bounds);

/* Whether a wall is so near that rounding may say on which side the place is. */
int nb_shadow_boundaries_meet(const nb_shadow_boundaries *walls, const float place[3], float margin);

void nb_shadow_boundaries_free(nb_shadow_boundaries *walls, const nebel_allocator *allocator);

#endif
