/* Rooms in a row, and random worlds of convex cells: a cube cut again and again by planes between two of its places, so
 * that the cells fill it without a gap. */
#ifndef CELL_WORLD_H
#define CELL_WORLD_H

#include "fog_help.h"

#include <nebel/classic.h>

#include <math.h>

/* A room from x0 to x1. */
#define BOX(x0, x1, d, r, g, b)                                                                                        \
    {                                                                                                                  \
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {x0, -2, -2}, .max = {x1, 2, 2}}, .density = d, .color = { r, g, b } \
    }

static inline nebel_cells *create(const nebel_cells_desc *desc)
{
    fog_messages messages = {0};
    nebel_cells_desc logged = *desc;
    nebel_cells *cells = NULL;
    logged.host.log = fog_messages_log(&messages);
    if (nebel_create_cells(&logged, &cells) != NEBEL_OK) fail_msg("%s", messages.text);
    return cells;
}

enum { WORLD_CELLS = 12, WORLD_PLANES = 6 + WORLD_CELLS };

#define WORLD_HALF 10.0

typedef struct cell_world {
    size_t count;
    nebel_cell cells[WORLD_CELLS];
    nebel_plane planes[WORLD_CELLS][WORLD_PLANES];
} cell_world;

static inline void world_place(uint64_t *state, double x[3])
{
    for (int i = 0; i < 3; i++) x[i] = dice(state, -WORLD_HALF, WORLD_HALF);
}

static inline double world_outside(const nebel_plane *plane, const double x[3])
{
    return plane->normal[0] * x[0] + plane->normal[1] * x[1] + plane->normal[2] * x[2] - plane->distance;
}

static inline int world_holds(const nebel_cell *cell, const double x[3])
{
    for (size_t i = 0; i < cell->shape.plane_count; i++)
        if (world_outside(&cell->shape.planes[i], x) > 0) return 0;
    return 1;
}

/* The cell of a place; `count` where there is none. */
static inline size_t world_find(const cell_world *world, const double x[3])
{
    size_t i = 0;
    while (i < world->count && !world_holds(&world->cells[i], x)) i++;
    return i;
}

/* Cuts the cell in which two random places are, halfway between them. */
static inline void world_cut(cell_world *world, uint64_t *state)
{
    double a[3], b[3], middle = 0;
    size_t cut;
    do {
        world_place(state, a);
        world_place(state, b);
        cut = world_find(world, a);
    } while (cut == world->count || !world_holds(&world->cells[cut], b));
    nebel_plane plane = {.distance = 0};
    for (int i = 0; i < 3; i++) {
        plane.normal[i] = b[i] - a[i];
        middle += plane.normal[i] * (a[i] + b[i]) / 2;
    }
    plane.distance = middle;
    nebel_cell *first = &world->cells[cut], *second = &world->cells[world->count];
    const size_t planes = first->shape.plane_count;
    *second = *first;
    second->shape.planes = world->planes[world->count];
    memcpy(world->planes[world->count], world->planes[cut], planes * sizeof plane);
    world->planes[cut][planes] = plane;
    for (int i = 0; i < 3; i++) plane.normal[i] = -plane.normal[i];
    plane.distance = -plane.distance;
    world->planes[world->count][planes] = plane;
    first->shape.plane_count = second->shape.plane_count = planes + 1;
    world->count++;
}

/* Of the cells one in four has no fog, and others share what they have. */
static inline void world_make(cell_world *world, size_t count, uint64_t *state)
{
    static const double densities[4] = {0, .02, .05, .3}, colors[2][3] = {{.9, .5, .1}, {.2, .4, .8}};
    *world = (cell_world){.count = 1};
    world->cells[0].shape = (nebel_shape){.type = NEBEL_SHAPE_CONVEX, .planes = world->planes[0], .plane_count = 6};
    for (int i = 0; i < 6; i++) {
        world->planes[0][i] = (nebel_plane){.distance = WORLD_HALF};
        world->planes[0][i].normal[i / 2] = i % 2 ? 1 : -1;
    }
    while (world->count < count) world_cut(world, state);
    for (size_t i = 0; i < count; i++) {
        world->cells[i].density = densities[dice_below(state, 4)];
        memcpy(world->cells[i].color, colors[dice_below(state, 2)], sizeof colors[0]);
    }
}

#endif
