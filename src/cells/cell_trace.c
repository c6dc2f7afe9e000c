/* The way from the eye to a point, as pieces in cells, as layers of fog. */
#include "cells.h"

#include "base/stride.h"
#include "math/vector.h"
#include "base/stream_layout.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* Planes whose normals are that near to a right angle with the view's axis are edge-on: C = 0. */
#define EDGE_ON 1e-12

/* A way from the eye: eye + t step, t from 0 to 1 at the point. */
typedef struct nb_cell_traversal {
    const nebel_cells *cells;
    const double *eye;
    int has_walls;
    const nebel_cell_point *point;
    double forward[3]; /* unit length */
    double step[3], length;
    double depth; /* Z of the point's surface at the point's x and y */
} nb_cell_traversal;

/* What is in one cell. Where it begins at the eye there is no entry, where it ends at the point no exit. */
typedef struct nb_cell_piece {
    size_t cell;
    double from, to;
    const nb_cell_plane *entry, *exit;
} nb_cell_piece;

/* ---- pieces ---------------------------------------------------------------------------------- */

/* Source: Cyrus and Beck, Generalized two- and three-dimensional clipping (1978). */
static int clip(const nb_cell_traversal *way, size_t number, nb_cell_piece *out)
{
    const nb_fog_cell *cell = &way->cells->cells[number];
    *out = (nb_cell_piece){number, 0, 1, NULL, NULL};
    for (size_t i = 0; i < cell->plane_count; i++) {
        const nb_cell_plane *plane = &way->cells->planes[cell->first_plane + i];
        const double along = nb_vector_dot(plane->normal, way->step), outside = nb_cell_plane_distance(plane, way->eye);
        if (along == 0 && (outside > 0 || (outside == 0 && plane->tie > 0))) return 0;
        if (along == 0) continue;
        const double t = -outside / along;
        if (along < 0 && t > out->from) {
            out->from = t;
            out->entry = plane;
        } else if (along > 0 && t < out->to) {
            out->to = t;
            out->exit = plane;
        }
        if (!(out->from < out->to)) return 0;
    }
    return 1;
}

/* By the place on the way; where cells overlap a little, by what they hold, never by their number. */
static int comes_before(const nb_cell_traversal *way, const nb_cell_piece *a, const nb_cell_piece *b)
{
    const nb_fog_cell *x = &way->cells->cells[a->cell], *y = &way->cells->cells[b->cell];
    if (a->from != b->from) return a->from < b->from;
    if (a->to != b->to) return a->to < b->to;
    if (x->density != y->density) return x->density < y->density;
    return memcmp(x->color, y->color, sizeof x->color) < 0;
}

static size_t find_pieces(const nb_cell_traversal *way, nb_cell_piece *pieces)
{
    size_t count = 0;
    for (size_t i = 0; i < way->cells->cell_count; i++) {
        nb_cell_piece found;
        if (!clip(way, i, &found)) continue;
        size_t place = count++;
        for (; place > 0 && comes_before(way, &found, &pieces[place - 1]); place--) pieces[place] = pieces[place - 1];
        pieces[place] = found;
    }
    return count;
}

/* ---- walls ----------------------------------------------------------------------------------- */

static int is_in_portal(const nebel_cells *cells, const nb_portal *portal, const double x[3])
{
    const double(*v)[3] = (const double(*)[3])cells->vertices + portal->first_vertex;
    const double *n = portal->normal;
    for (size_t i = 0; i < portal->vertex_count; i++) {
        const double *a = v[i], *b = v[(i + 1) % portal->vertex_count];
        const double edge[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, to[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};
        const double inwards[3] = {n[1] * edge[2] - n[2] * edge[1], n[2] * edge[0] - n[0] * edge[2],
                                   n[0] * edge[1] - n[1] * edge[0]};
        if (nb_vector_dot(inwards, to) < -cells->tolerance * nb_vector_length(edge)) return 0;
    }
    return 1;
}

static int is_open(const nb_cell_traversal *way, const nb_cell_piece *from, const nb_cell_piece *into)
{
    double x[3];
    for (int i = 0; i < 3; i++) x[i] = way->eye[i] + from->to * way->step[i];
    for (size_t i = 0; i < way->cells->portal_count; i++) {
        const nb_portal *portal = &way->cells->portals[i];
        const int joins = (portal->cells[0] == from->cell && portal->cells[1] == into->cell) ||
                          (portal->cells[1] == from->cell && portal->cells[0] == into->cell);
        if (joins && is_in_portal(way->cells, portal, x)) return 1;
    }
    return 0;
}

static int is_at_eye(const nb_cell_traversal *way, const nb_cell_piece *p)
{
    return p->from * way->length <= way->cells->tolerance;
}

/* How many of the pieces are seen: those up to the first wall. */
static size_t count_seen(const nb_cell_traversal *way, const nb_cell_piece *pieces, size_t count)
{
    if (!way->has_walls || count == 0) return count;
    if (!is_at_eye(way, &pieces[0])) return 0;
    size_t seen = 1;
    while (seen < count && is_open(way, &pieces[seen - 1], &pieces[seen])) seen++;
    return seen;
}

/* ---- spans ----------------------------------------------------------------------------------- */

/* Z of a plane at the point's own x and y, as it is printed: in view space A x + B y + C Z = D is n . x = distance, C
 * = n . forward, and from the point it is (distance - n . point) / C along the axis. `otherwise` where C = 0. */
static double find_printed_depth(const nb_cell_traversal *way, const double normal[3], double distance,
                                 double otherwise)
{
    const double *x = way->point->position;
    const double c = nb_vector_dot(normal, way->forward);
    if (!(fabs(c) > EDGE_ON * nb_vector_length(normal))) return otherwise;
    return nb_vector_dot(way->step, way->forward) + (distance - nb_vector_dot(normal, x)) / c;
}

static double find_place(const nb_cell_traversal *way, double t, const nb_cell_plane *plane)
{
    if (way->cells->span == NEBEL_SPAN_RAY) return t * way->length;
    const double depth = t * nb_vector_dot(way->step, way->forward);
    if (way->cells->span == NEBEL_SPAN_DEPTH || plane == NULL) return depth;
    return fmin(fmax(find_printed_depth(way, plane->normal, plane->distance, depth), 0), way->depth);
}

static double find_from(const nb_cell_traversal *way, const nb_cell_piece *p)
{
    return find_place(way, p->from, is_at_eye(way, p) ? NULL : p->entry);
}

static double find_to(const nb_cell_traversal *way, const nb_cell_piece *p)
{
    if (p->exit == NULL && way->cells->span == NEBEL_SPAN_PRINTED) return way->depth;
    return find_place(way, p->to, p->exit);
}

/* ---- layers ---------------------------------------------------------------------------------- */

static int is_same_fog(const nb_fog_cell *a, const nb_fog_cell *b)
{
    return a->density == b->density && a->color[0] == b->color[0] && a->color[1] == b->color[1] &&
           a->color[2] == b->color[2];
}

static int continues(const nb_cell_traversal *way, const nb_cell_piece *before, const nb_cell_piece *p)
{
    const nebel_cells *cells = way->cells;
    return cells->grouped && is_same_fog(&cells->cells[before->cell], &cells->cells[p->cell]) &&
           (p->from - before->to) * way->length <= cells->tolerance;
}

static double find_intensity(const nebel_cells *cells, double density, double span)
{
    const double amount = density * fmax(span, 0);
    if (cells->model == NEBEL_CELL_EXPONENTIAL) return 1 - nb_exp(-amount);
    return fmin(amount, 1);
}

static nebel_cell_segment make_layer(const nb_cell_traversal *way, const nb_cell_piece *first,
                                     const nb_cell_piece *last)
{
    const nb_fog_cell *cell = &way->cells->cells[first->cell];
    nebel_cell_segment layer = {
        .from = find_from(way, first), .to = find_to(way, last), .first_cell = first->cell, .last_cell = last->cell};
    memcpy(layer.color, cell->color, sizeof layer.color);
    layer.intensity = find_intensity(way->cells, cell->density, layer.to - layer.from);
    return layer;
}

/* Called for each layer, from the eye on. */
typedef void take_layer(const nebel_cell_segment *layer, void *user);

static void find_layers(const nb_cell_traversal *way, take_layer *take, void *user)
{
    nb_cell_piece pieces[NEBEL_MAX_CELLS];
    const size_t count = count_seen(way, pieces, find_pieces(way, pieces));
    for (size_t first = 0, last; first < count; first = last + 1) {
        last = first;
        if (way->cells->cells[pieces[first].cell].density == 0) continue;
        while (last + 1 < count && continues(way, &pieces[last], &pieces[last + 1])) last++;
        const nebel_cell_segment layer = make_layer(way, &pieces[first], &pieces[last]);
        take(&layer, user);
    }
}

/* ---- asking ---------------------------------------------------------------------------------- */

static int is_place(const double x[3])
{
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
}

static nebel_result set_view(const nebel_cells *cells, const nebel_cell_view *view, nb_cell_traversal *way)
{
    const double *f = view->forward, largest = fmax(fabs(f[0]), fmax(fabs(f[1]), fabs(f[2])));
    *way = (nb_cell_traversal){.cells = cells, .eye = view->eye, .has_walls = cells->has_walls && !view->ignore_walls};
    if (!is_place(view->eye)) return NEBEL_ERROR_ARGUMENT;
    if (cells->span == NEBEL_SPAN_RAY) return NEBEL_OK;
    if (!is_place(f) || !(largest > 0)) return NEBEL_ERROR_ARGUMENT;
    for (int i = 0; i < 3; i++) way->forward[i] = f[i] / largest;
    const double length = nb_vector_length(way->forward);
    for (int i = 0; i < 3; i++) way->forward[i] /= length;
    return NEBEL_OK;
}

/* 0: the point has no fog. */
static int set_point(nb_cell_traversal *way, const nebel_cell_point *point)
{
    way->point = point;
    if (!is_place(point->position)) return 0;
    for (int i = 0; i < 3; i++) way->step[i] = point->position[i] - way->eye[i];
    way->length = nb_vector_length(way->step);
    const double depth = nb_vector_dot(way->step, way->forward);
    way->depth = depth;
    if (way->cells->span == NEBEL_SPAN_PRINTED)
        way->depth = find_printed_depth(way, point->surface.normal, point->surface.distance, depth);
    return way->length > 0 && isfinite(way->length) && (way->cells->span == NEBEL_SPAN_RAY || depth > 0);
}

static void add_layer(const nebel_cell_segment *layer, void *user)
{
    nebel_cell_fog *fog = user;
    const double seen = 1 - fog->alpha;
    for (int c = 0; c < 3; c++) fog->color[c] += seen * layer->intensity * layer->color[c];
    fog->alpha = 1 - seen * (1 - layer->intensity);
}

/* Each element has bytes of its own. */
static int are_streams(const nb_memory_span *points, const nb_memory_span *fog, size_t n)
{
    if (n == 0) return 1;
    return points->stride >= points->size && fog->stride >= fog->size && nb_span_fits(points, n) &&
           nb_span_fits(fog, n) && !nb_spans_share_bytes(points, fog, n);
}

nebel_result nebel_compute_cell_fog(const nebel_cells *cells, const nebel_cell_view *view, size_t n,
                                    const nebel_cell_point *points, size_t point_stride, nebel_cell_fog *fog,
                                    size_t fog_stride)
{
    nb_cell_traversal way;
    if (cells == NULL || view == NULL || (n > 0 && (points == NULL || fog == NULL))) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = set_view(cells, view, &way);
    if (result != NEBEL_OK) return result;
    point_stride = nb_stride_of(point_stride, sizeof *points);
    fog_stride = nb_stride_of(fog_stride, sizeof *fog);
    const nb_memory_span from = {(uintptr_t)points, sizeof *points, point_stride};
    const nb_memory_span to = {(uintptr_t)fog, sizeof *fog, fog_stride};
    if (!are_streams(&from, &to, n)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        const nebel_cell_point *point = nb_stride_from(points, point_stride, i);
        nebel_cell_fog *out = nb_stride_to(fog, fog_stride, i);
        *out = (nebel_cell_fog){{0, 0, 0}, 0};
        if (set_point(&way, point)) find_layers(&way, add_layer, out);
    }
    return NEBEL_OK;
}

typedef struct nb_cell_list {
    nebel_cell_segment *layers;
    size_t room, count;
} nb_cell_list;

static void list_layer(const nebel_cell_segment *layer, void *user)
{
    nb_cell_list *to = user;
    if (to->count < to->room) to->layers[to->count] = *layer;
    to->count++;
}

nebel_result nebel_compute_cell_segments(const nebel_cells *cells, const nebel_cell_view *view,
                                         const nebel_cell_point *point, size_t room, nebel_cell_segment *layers,
                                         size_t *count)
{
    nb_cell_traversal way;
    if (cells == NULL || view == NULL || point == NULL || count == NULL || (room > 0 && layers == NULL))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = set_view(cells, view, &way);
    if (result != NEBEL_OK) return result;
    nb_cell_list to = {layers, room, 0};
    if (set_point(&way, point)) find_layers(&way, list_layer, &to);
    *count = to.count;
    return NEBEL_OK;
}
