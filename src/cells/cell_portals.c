/* Portals: given ones are checked, others found where cells touch.
 *
 * A face of a cell is a polygon: a large square in its plane, cut by the cell's other planes. Source: Sutherland and
 * Hodgman, Reentrant polygon clipping (1974). */
#include "cells.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* A square that is cut by the planes of two cells; each cut adds one vertex at most. */
enum { MOST_VERTICES = 4 + 2 * NEBEL_MAX_SHAPE_PLANES };

/* Of the tolerance: how far beyond a plane a vertex may lie and is still kept, so that planes that go through vertices
 * take none away. */
#define KEPT 1e-3

typedef struct polygon {
    double (*vertices)[3], (*spare)[3];
    size_t count;
} polygon;

static void subtract(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}

/* ---- polygons -------------------------------------------------------------------------------- */

/* Twice the area as a vector along the normal (Newell's method), from the first vertex so that far places lose nothing.
 */
static void find_area(const double (*vertices)[3], size_t count, double area[3])
{
    area[0] = area[1] = area[2] = 0;
    for (size_t i = 1; i + 1 < count; i++) {
        double a[3], b[3], part[3];
        subtract(vertices[i], vertices[0], a);
        subtract(vertices[i + 1], vertices[0], b);
        nb_vector_cross(a, b, part);
        for (int k = 0; k < 3; k++) area[k] += part[k];
    }
}

/* Mean width: area over half the way around. */
static double find_width(const double (*vertices)[3], size_t count, const double area[3])
{
    double around = 0;
    for (size_t i = 0; i < count; i++) {
        double edge[3];
        subtract(vertices[(i + 1) % count], vertices[i], edge);
        around += nb_vector_length(edge);
    }
    return around > 0 ? nb_vector_length(area) / around : 0;
}

static void set_square(polygon *square, const nb_cell_plane *plane, const nb_fog_cell *cell)
{
    double center[3], u[3], v[3], diagonal[3], axis[3] = {0, 0, 0};
    int smallest = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(plane->normal[i]) < fabs(plane->normal[smallest])) smallest = i;
    axis[smallest] = 1;
    nb_vector_cross(axis, plane->normal, u);
    const double length = nb_vector_length(u);
    for (int i = 0; i < 3; i++) u[i] /= length;
    nb_vector_cross(plane->normal, u, v);
    subtract(cell->high, cell->low, diagonal);
    for (int i = 0; i < 3; i++) center[i] = (cell->low[i] + cell->high[i]) / 2;
    const double half = 2 * nb_vector_length(diagonal), off = nb_cell_plane_distance(plane, center);
    static const double corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < 3; i++)
            square->vertices[c][i] =
                center[i] - off * plane->normal[i] + half * (corners[c][0] * u[i] + corners[c][1] * v[i]);
    square->count = 4;
}

static void cut(polygon *p, const nb_cell_plane *plane, double slack)
{
    size_t count = 0;
    for (size_t i = 0; i < p->count; i++) {
        const double *a = p->vertices[i], *b = p->vertices[(i + 1) % p->count];
        const double from = nb_cell_plane_distance(plane, a), to = nb_cell_plane_distance(plane, b);
        if (from <= slack) memcpy(p->spare[count++], a, sizeof *p->spare);
        if ((from <= slack) == (to <= slack)) continue;
        const double t = fmin(fmax(from / (from - to), 0), 1);
        for (int k = 0; k < 3; k++) p->spare[count][k] = a[k] + t * (b[k] - a[k]);
        count++;
    }
    double(*swap)[3] = p->vertices;
    p->vertices = p->spare;
    p->spare = swap;
    p->count = count;
}

/* By all planes of the cell but one; NO_FACE: by all. */
#define NO_FACE SIZE_MAX

static void cut_all(const nebel_cells *cells, const nb_fog_cell *cell, size_t but, double slack, polygon *p)
{
    for (size_t i = 0; i < cell->plane_count && p->count > 0; i++)
        if (i != but) cut(p, &cells->planes[cell->first_plane + i], slack);
}

static void drop_repeated(polygon *p, double slack)
{
    size_t count = 0;
    for (size_t i = 0; i < p->count; i++) {
        double step[3];
        subtract(p->vertices[i], p->vertices[(i + p->count - 1) % p->count], step);
        if (nb_vector_length(step) > slack) memcpy(p->spare[count++], p->vertices[i], sizeof *p->spare);
    }
    double(*swap)[3] = p->vertices;
    p->vertices = p->spare;
    p->spare = swap;
    p->count = count;
}

/* ---- portals --------------------------------------------------------------------------------- */

static int keep_portal(nebel_cells *cells, const size_t ends[2], const double (*vertices)[3], size_t count,
                       const double area[3])
{
    void *portals = cells->portals, *all = cells->vertices;
    const size_t portal_count = cells->portal_count, vertex_count = cells->vertex_count;
    const int room = nb_grow(&cells->allocator, &portals, sizeof *cells->portals, portal_count, &cells->portal_capacity,
                             portal_count + 1);
    cells->portals = portals;
    const int vertex_room = nb_grow(&cells->allocator, &all, sizeof *cells->vertices, vertex_count,
                                    &cells->vertex_capacity, vertex_count + count);
    cells->vertices = all;
    if (!room || !vertex_room) return 0;
    nb_portal *portal = &cells->portals[cells->portal_count++];
    *portal = (nb_portal){{ends[0], ends[1]}, vertex_count, count, {0, 0, 0}};
    memcpy(cells->vertices[vertex_count], vertices, count * sizeof *vertices);
    cells->vertex_count += count;
    const double length = nb_vector_length(area);
    for (int i = 0; i < 3; i++) portal->normal[i] = area[i] / length;
    return 1;
}

size_t nebel_get_cell_portal_count(const nebel_cells *cells)
{
    if (cells == NULL) return 0;
    return cells->portal_count;
}

nebel_portal nebel_get_cell_portal(const nebel_cells *cells, size_t index)
{
    if (cells == NULL || index >= cells->portal_count) return (nebel_portal){.vertices = NULL};
    const nb_portal *portal = &cells->portals[index];
    return (nebel_portal){{portal->cells[0], portal->cells[1]},
                          (const double(*)[3])cells->vertices + portal->first_vertex,
                          portal->vertex_count};
}

/* ---- derived --------------------------------------------------------------------------------- */

static int lies_in(const nb_cell_plane *plane, const polygon *p, double tolerance)
{
    for (size_t i = 0; i < p->count; i++)
        if (fabs(nb_cell_plane_distance(plane, p->vertices[i])) > tolerance) return 0;
    return 1;
}

/* What face `a` of the first cell and face `b` of the second share. 0: memory is out. */
static int join_faces(nebel_cells *cells, const size_t ends[2], size_t a, size_t b, polygon *work)
{
    const nb_fog_cell *first = &cells->cells[ends[0]], *second = &cells->cells[ends[1]];
    const nb_cell_plane *face = &cells->planes[first->first_plane + a];
    const nb_cell_plane *other = &cells->planes[second->first_plane + b];
    const double slack = KEPT * cells->tolerance;
    double area[3];
    if (nb_vector_dot(face->normal, other->normal) > -0.5) return 1;
    set_square(work, face, first);
    cut_all(cells, first, a, slack, work);
    cut_all(cells, second, b, slack, work);
    drop_repeated(work, slack);
    if (work->count < 3 || !lies_in(other, work, cells->tolerance)) return 1;
    const double(*vertices)[3] = (const double(*)[3])work->vertices;
    find_area(vertices, work->count, area);
    if (find_width(vertices, work->count, area) <= cells->tolerance) return 1;
    return keep_portal(cells, ends, vertices, work->count, area);
}

/* Whether the face comes near the second cell anywhere; most do not, and need not be compared with its faces. */
static int comes_near(const nebel_cells *cells, const nb_fog_cell *first, size_t a, const nb_fog_cell *second,
                      polygon *work)
{
    double area[3];
    set_square(work, &cells->planes[first->first_plane + a], first);
    cut_all(cells, second, NO_FACE, cells->tolerance, work);
    cut_all(cells, first, a, KEPT * cells->tolerance, work);
    find_area((const double(*)[3])work->vertices, work->count, area);
    return find_width((const double(*)[3])work->vertices, work->count, area) > cells->tolerance;
}

static int are_near(const nebel_cells *cells, const nb_fog_cell *a, const nb_fog_cell *b)
{
    for (int i = 0; i < 3; i++)
        if (fmax(a->low[i], b->low[i]) - fmin(a->high[i], b->high[i]) > cells->tolerance) return 0;
    return 1;
}

static int join_cells(nebel_cells *cells, const size_t ends[2], polygon *work)
{
    const nb_fog_cell *first = &cells->cells[ends[0]], *second = &cells->cells[ends[1]];
    if (!are_near(cells, first, second)) return 1;
    for (size_t a = 0; a < first->plane_count; a++) {
        if (!comes_near(cells, first, a, second, work)) continue;
        for (size_t b = 0; b < second->plane_count; b++)
            if (!join_faces(cells, ends, a, b, work)) return 0;
    }
    return 1;
}

nebel_result nb_cells_derive_portals(nebel_cells *cells)
{
    double(*memory)[3] = nb_allocate(&cells->allocator, 2 * (size_t)MOST_VERTICES, sizeof *memory);
    int good = memory != NULL;
    if (!good) return NEBEL_ERROR_MEMORY;
    polygon work = {memory, memory + MOST_VERTICES, 0};
    for (size_t a = 0; a < cells->cell_count && good; a++)
        for (size_t b = a + 1; b < cells->cell_count && good; b++)
            good = join_cells(cells, (const size_t[2]){a, b}, &work);
    nb_release(&cells->allocator, memory);
    return good ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

/* ---- given ----------------------------------------------------------------------------------- */

static nebel_result check_portal_ends(const nebel_cells *cells, const nebel_log *log, size_t number,
                                      const nebel_portal *portal)
{
    for (int i = 0; i < 2; i++)
        if (portal->cells[i] >= cells->cell_count)
            return nb_fail(log, NEBEL_ERROR_VALUE, "portal %zu: names cell %zu; there are %zu, counted from 0", number,
                           portal->cells[i], cells->cell_count);
    if (portal->cells[0] == portal->cells[1])
        return nb_fail(log, NEBEL_ERROR_VALUE, "portal %zu: joins cell %zu with itself; it must join two", number,
                       portal->cells[0]);
    if (portal->vertices == NULL || portal->vertex_count < 3 || portal->vertex_count > NEBEL_MAX_PORTAL_VERTICES)
        return nb_fail(log, NEBEL_ERROR_VALUE, "portal %zu: has %zu vertices; must have 3 to %d", number,
                       portal->vertex_count, NEBEL_MAX_PORTAL_VERTICES);
    return NEBEL_OK;
}

/* How far a place is outside the cell; <= 0: inside. */
static double find_way_out(const nebel_cells *cells, const nb_fog_cell *cell, const double x[3])
{
    double way = -HUGE_VAL;
    for (size_t i = 0; i < cell->plane_count; i++)
        way = fmax(way, nb_cell_plane_distance(&cells->planes[cell->first_plane + i], x));
    return way;
}

/* Cells do not overlap: a polygon in both is in the face that they share, and flat as that is. */
static nebel_result check_places(const nebel_cells *cells, const nebel_log *log, size_t number,
                                 const nebel_portal *portal)
{
    for (size_t v = 0; v < portal->vertex_count; v++) {
        const double *x = portal->vertices[v];
        if (!(isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2])))
            return nb_fail(log, NEBEL_ERROR_VALUE, "portal %zu: vertex %zu is not finite", number, v);
        for (int i = 0; i < 2; i++) {
            const double way = find_way_out(cells, &cells->cells[portal->cells[i]], x);
            if (way <= cells->tolerance) continue;
            return nb_fail(log, NEBEL_ERROR_VALUE,
                           "portal %zu: vertex %zu is %g m outside cell %zu; a portal lies where its two cells touch",
                           number, v, way, portal->cells[i]);
        }
    }
    return NEBEL_OK;
}

/* Every vertex on the inner side of every edge: neither dents nor loops. */
static int is_convex(const nebel_portal *portal, const double normal[3], double tolerance)
{
    for (size_t i = 0; i < portal->vertex_count; i++) {
        double edge[3], inwards[3], way[3];
        subtract(portal->vertices[(i + 1) % portal->vertex_count], portal->vertices[i], edge);
        nb_vector_cross(normal, edge, inwards);
        for (size_t v = 0; v < portal->vertex_count; v++) {
            subtract(portal->vertices[v], portal->vertices[i], way);
            if (nb_vector_dot(inwards, way) < -tolerance * nb_vector_length(edge)) return 0;
        }
    }
    return 1;
}

static nebel_result check_form(const nebel_cells *cells, const nebel_log *log, size_t number,
                               const nebel_portal *portal, double area[3])
{
    double normal[3];
    find_area(portal->vertices, portal->vertex_count, area);
    if (find_width(portal->vertices, portal->vertex_count, area) <= cells->tolerance)
        return nb_fail(log, NEBEL_ERROR_VALUE, "portal %zu: has no area", number);
    const double length = nb_vector_length(area);
    for (int i = 0; i < 3; i++) normal[i] = area[i] / length;
    if (is_convex(portal, normal, 2 * cells->tolerance)) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_VALUE,
                   "portal %zu: is not convex; give its vertices in order, and split it where it has a dent", number);
}

nebel_result nb_cells_add_portal(nebel_cells *cells, const nebel_log *log, size_t number, const nebel_portal *portal)
{
    double area[3];
    nebel_result result = check_portal_ends(cells, log, number, portal);
    if (result == NEBEL_OK) result = check_places(cells, log, number, portal);
    if (result == NEBEL_OK) result = check_form(cells, log, number, portal, area);
    if (result != NEBEL_OK) return result;
    if (keep_portal(cells, portal->cells, portal->vertices, portal->vertex_count, area)) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_MEMORY, "portal %zu: out of memory", number);
}
