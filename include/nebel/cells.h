/* Fog in cells with portals: the fog of engines whose world is made of convex rooms.
 *
 * Every cell has a density D [1/m] and a colour F. What a cell does to a surface of colour P is
 *
 *     I = D (Zmax - Zmin), clamped to 0..1;    pixel = I F + (1 - I) P
 *
 * where Zmin is the depth at which the cell is entered, through the plane of a portal, and Zmax that of the surface or
 * of the portal through which the cell is left. The cell of the eye begins at the eye.
 *
 *     const nebel_cell rooms[] = {
 *         {.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, 0, 0}, .max = {4, 3, 9}}},                        // no fog
 *         {.shape = {.type = NEBEL_SHAPE_BOX, .min = {4, 0, 0}, .max = {9, 3, 9}},
 *          .density = .1, .color = {.5, .5, .6}}};
 *     nebel_cells *cells = NULL;
 *     nebel_create_cells(&(nebel_cells_desc){.cells = rooms, .cell_count = 2}, &cells);
 *
 *     const nebel_cell_view view = {.eye = {1, 1, 4}, .forward = {1, 0, 0}};
 *     const nebel_cell_point point = {.position = {9, 1, 4}};
 *     nebel_cell_fog fog;
 *     nebel_compute_cell_fog(cells, &view, 1, &point, 0, &fog, 0);
 *     // fog.alpha = .1 * 5; pixel = fog.color + (1 - fog.alpha) * surface
 *
 * Two cells, each drawn in turn, give I_a + I_b - I_a I_b, while the linear model over both is I_a + I_b: a seam. Cells
 * that touch and have the same density and colour are therefore grouped along the ray and fogged once over their whole
 * span; `ungrouped` shows the seam. The exponential model I = 1 - exp(-D length) has none: with the span RAY it is the
 * fog of nebel_volume_from_cell for each cell, exactly.
 *
 * Source: the technique of engines of cells and portals around 2000; docs/classic.md has its printed form, what is
 * wrong with it, and pictures. Nothing here calls a graphics interface.
 */
#ifndef NEBEL_CELLS_H
#define NEBEL_CELLS_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- describing cells ------------------------------------------------------------------------ */

#define NEBEL_MAX_CELLS 1024
#define NEBEL_MAX_PORTAL_VERTICES 64

typedef struct nebel_cell {
    nebel_shape shape; /* a box or a convex body, with its transform; it must end in every direction */
    double density;    /* D, 1/m, >= 0; 0: no fog */
    double color[3];   /* F, radiance of opaque fog, >= 0 */
} nebel_cell;

/* A convex polygon through which one sees from one cell into another. */
typedef struct nebel_portal {
    size_t cells[2];             /* two different ones */
    const double (*vertices)[3]; /* m, either way round; where the two cells touch */
    size_t vertex_count;         /* 3 to NEBEL_MAX_PORTAL_VERTICES */
} nebel_portal;

typedef enum nebel_cell_model {
    NEBEL_CELL_LINEAR = 0,  /* I = D span */
    NEBEL_CELL_EXPONENTIAL, /* I = 1 - exp(-D span) */
    NEBEL_CELL_MODEL_COUNT
} nebel_cell_model;

/* What Zmax - Zmin is. */
typedef enum nebel_cell_span {
    NEBEL_SPAN_RAY = 0, /* m along the ray from the eye to the point */
    NEBEL_SPAN_DEPTH,   /* m of depth along the view's axis, where the ray crosses the planes: the formula as it was
                            meant. Changes when the camera turns */
    NEBEL_SPAN_PRINTED, /* m of depth as printed: Z = -(A x + B y + D) / C of the planes at the point's own x and y,
                            which with perspective is not where the ray crosses them */
    NEBEL_SPAN_COUNT
} nebel_cell_span;

/* Cells must not overlap. Lengths below 1e-6 of the extent of all cells, or 1e-12 of their largest coordinate, count as
 * nothing: cells that near touch, and cells that overlap as little do not. */
typedef struct nebel_cells_desc {
    nebel_allocator allocator;
    nebel_log log;
    const nebel_cell *cells; /* 1 to NEBEL_MAX_CELLS */
    size_t cell_count;
    const nebel_portal *portals; /* the only ways from cell to cell, all else being walls; NULL: there are no walls, and
                                    the portals are wherever cells touch */
    size_t portal_count;
    nebel_cell_model model;
    nebel_cell_span span;
    int ungrouped;                       /* nonzero: each cell is fogged for itself */
    size_t *failed_cell, *failed_portal; /* NULL, or where the index of what is wrong is written: SIZE_MAX where it is
                                            none */
} nebel_cells_desc;

typedef struct nebel_cells nebel_cells;

/* Checks cells and portals and makes them ready for queries. Everything is copied. The order of the cells means
 * nothing. Cost: every pair of cells once, and every face of those that touch. On an error *cells is NULL. Errors:
 * ARGUMENT (NULL, an unknown model or span), LIMIT (too many), MEMORY, and VALUE: a cell that is neither box nor convex
 * body, that is empty (planes that face inwards), without end, or overlaps another; a density that is negative or not
 * finite; a portal of one and the same or of unknown cells, that is not convex or of no area, or does not lie
 * where its cells touch. */
nebel_result nebel_create_cells(const nebel_cells_desc *desc, nebel_cells **cells);
void nebel_destroy_cells(nebel_cells *cells); /* NULL is fine */

/* The portals, given or derived; arrays of the second live as long as the cells. Vertices of derived ones go
 * counterclockwise as seen from cells[1]. index < nebel_get_cell_portal_count. Any thread. */
size_t nebel_get_cell_portal_count(const nebel_cells *cells);
nebel_portal nebel_get_cell_portal(const nebel_cells *cells, size_t index);

/* The same fog as a volume for nebel_add_volume: extinction D in all colours, source F. Its arrays are the cell's. Any
 * thread. */
nebel_volume_desc nebel_volume_from_cell(const nebel_cell *cell);

/* ---- asking ---------------------------------------------------------------------------------- */

typedef struct nebel_cell_view {
    double eye[3];     /* m */
    double forward[3]; /* the view's axis, any length but 0; Z counts from the eye along it, > 0 in front. Not read with
                          NEBEL_SPAN_RAY */
    int ignore_walls;  /* nonzero: fog as though there were no walls. For vertices: a wall may hide one whose polygon is
                          seen beside it, and that part of it is interpolated */
} nebel_cell_view;

typedef struct nebel_cell_point {
    double position[3];  /* m, of a vertex or another point of a surface */
    nebel_plane surface; /* of its polygon, for Zmax; normal 0, or seen edge-on: the point's own Z. Read with
                            NEBEL_SPAN_PRINTED alone */
} nebel_cell_point;

/* What the cells do to the point: pixel = color + (1 - alpha) P. */
typedef struct nebel_cell_fog {
    double color[3]; /* of all fog before the point, weakened by the fog before that */
    double alpha;    /* 0 to 1 */
} nebel_cell_fog;

/* One fog on the way, as an engine draws it: an alpha polygon in the colour, behind those that come before it. */
typedef struct nebel_cell_segment {
    double color[3];
    double intensity;             /* I, 0 to 1 */
    double from, to;              /* Zmin and Zmax, or m along the ray */
    size_t first_cell, last_cell; /* cells in which it begins and ends */
} nebel_cell_segment;

/* What the cells do to each of n points. Strides in bytes; 0: without gaps. points and fog share no bytes,
 * but may lie in the same structures.
 *
 * The way goes straight from the eye to the point. With portals given it begins in the eye's cell and ends where it
 * leaves a cell other than through a portal: behind that wall there is no fog, as there is none for an eye outside all
 * cells. Without, fog is wherever cells are, and an eye outside sees it through their faces. Cells behind the eye do
 * nothing. An eye in a portal is in the cell that it looks into. With DEPTH and FAITHFUL a point that is not in front
 * of the eye (Z <= 0) has no fog; with FAITHFUL a plane that is seen edge-on (C = 0) is met where the ray crosses it,
 * and Z is kept between 0 and the point's Zmax. A way that runs in a face belongs to one of the two cells, by the rule
 * of docs/scene-file.md. A point that is not finite has no fog. Any thread. Errors: ARGUMENT (NULL, an eye that is not
 * finite, a forward that has no direction, a stride shorter than its elements, points and fog that share bytes). */
nebel_result nebel_compute_cell_fog(const nebel_cells *cells, const nebel_cell_view *view, size_t n,
                                    const nebel_cell_point *points, size_t point_stride, nebel_cell_fog *fog,
                                    size_t fog_stride);

/* The layers of fog before one point, from the eye on, as many as there is room for; in *count how many there are, at
 * most NEBEL_MAX_CELLS. Any thread. Errors as nebel_compute_cell_fog. */
nebel_result nebel_compute_cell_segments(const nebel_cells *cells, const nebel_cell_view *view,
                                         const nebel_cell_point *point, size_t room, nebel_cell_segment *layers,
                                         size_t *count);

#ifdef __cplusplus
}
#endif
#endif
