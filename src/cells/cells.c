/* Cells, checked and made ready. */
#include "cells.h"

#include "medium/medium_check.h"
#include "medium/convex.h"
#include "medium/volume.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* What counts as nothing. Of the extent of all cells: some rounding errors of a float, in which models and tools keep
 * their vertices. Of the largest coordinate: many of a double. */
#define TOLERANCE_OF_EXTENT 1e-6
#define TOLERANCE_OF_PLACE 1e-12

nebel_volume_desc nebel_volume_from_cell(const nebel_cell *cell)
{
    if (cell == NULL) return (nebel_volume_desc){.priority = 0};
    nebel_volume_desc volume = {.shape = cell->shape};
    for (int c = 0; c < 3; c++) {
        volume.extinction[c] = cell->density;
        volume.source[c] = cell->color[c];
    }
    return volume;
}

/* ---- one cell -------------------------------------------------------------------------------- */

/* Messages of the core about a cell, which do not know its number. */
typedef struct nb_cell_note {
    const nebel_log *log;
    size_t cell;
} nb_cell_note;

static void pass_on(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    const nb_cell_note *about = user;
    nb_log_message(about->log, level, result, "cell %zu: %s", about->cell, message);
}

static nebel_result check_cell(const nebel_log *log, const nebel_cell *cell)
{
    if (cell->shape.type != NEBEL_SHAPE_BOX && cell->shape.type != NEBEL_SHAPE_CONVEX)
        return nb_fail(log, NEBEL_ERROR_VALUE,
                       "its shape is neither a box nor a convex body of planes; split what is not convex into cells "
                       "that touch");
    if (!(cell->density >= 0 && cell->density <= NEBEL_MAX_AMOUNT))
        return nb_fail(log, NEBEL_ERROR_VALUE, "density is %g; must be from 0 (no fog) to %g per metre", cell->density,
                       NEBEL_MAX_AMOUNT);
    return nb_check_color(log, "color", cell->color, NEBEL_MAX_AMOUNT);
}

static int add_plane(nebel_cells *cells, nb_fog_cell *cell, const nb_leaf *leaf, const double local[3], double distance,
                     double tie)
{
    long double n[3] = {0, 0, 0}, square = 0, d = (long double)distance;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) n[i] += leaf->exact_matrix[3 * k + i] * (long double)local[k];
        square += n[i] * n[i];
        d += n[i] * leaf->exact_origin[i];
    }
    const long double length = sqrtl(square);
    const nb_cell_plane plane = {
        {(double)(n[0] / length), (double)(n[1] / length), (double)(n[2] / length)}, (double)(d / length), tie};
    void *planes = cells->planes;
    const size_t count = cells->plane_count;
    const int room = nb_grow(&cells->allocator, &planes, sizeof plane, count, &cells->plane_capacity, count + 1);
    cells->planes = planes;
    if (!room) return 0;
    cells->planes[cells->plane_count++] = plane;
    cell->plane_count++;
    return 1;
}

static int add_box(nebel_cells *cells, nb_fog_cell *cell, const nb_leaf *leaf)
{
    for (int i = 0; i < 3; i++) {
        double normal[3] = {0, 0, 0};
        normal[i] = -1;
        if (!add_plane(cells, cell, leaf, normal, -leaf->low[i], -1)) return 0;
        normal[i] = 1;
        if (!add_plane(cells, cell, leaf, normal, leaf->high[i], 1)) return 0;
    }
    return 1;
}

static int add_faces(nebel_cells *cells, nb_fog_cell *cell, const nb_volume *volume)
{
    const nb_leaf *leaf = &volume->leaves[0];
    if (leaf->type == NB_LEAF_BOX) return add_box(cells, cell, leaf);
    for (size_t i = 0; i < volume->face_count; i++) {
        const nb_face *face = &volume->faces[i];
        if (!add_plane(cells, cell, leaf, face->normal, face->distance, face->tie)) return 0;
    }
    return 1;
}

static nebel_result check_cell_ends(const nebel_log *log, const nb_volume *volume)
{
    static const char *const ways[2][3] = {{"-x", "-y", "-z"}, {"+x", "+y", "+z"}};
    for (int i = 0; i < 3; i++)
        for (int side = 0; side < 2; side++)
            if (!isfinite(side ? volume->high[i] : volume->low[i]))
                return nb_fail(log, NEBEL_ERROR_VALUE,
                               "has no end towards %s; a cell needs planes all around, whose normals point out of it",
                               ways[side][i]);
    return NEBEL_OK;
}

static nebel_result set_cell(nebel_cells *cells, const nebel_log *log, const nebel_cell *from, nb_fog_cell *cell)
{
    nebel_result result = check_cell(log, from);
    if (result != NEBEL_OK) return result;
    nb_volume volume;
    const nebel_volume_desc desc = nebel_volume_from_cell(from);
    result = nb_volume_resolve(&cells->allocator, log, &desc, &volume);
    if (result != NEBEL_OK) return result;
    *cell = (nb_fog_cell){.first_plane = cells->plane_count, .density = from->density};
    memcpy(cell->color, from->color, sizeof cell->color);
    memcpy(cell->low, volume.low, sizeof cell->low);
    memcpy(cell->high, volume.high, sizeof cell->high);
    result = check_cell_ends(log, &volume);
    if (result == NEBEL_OK && !add_faces(cells, cell, &volume))
        result = nb_fail(log, NEBEL_ERROR_MEMORY, "out of memory");
    nb_volume_free(&cells->allocator, &volume);
    return result;
}

/* ---- all cells ------------------------------------------------------------------------------- */

static void set_tolerance(nebel_cells *cells)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < cells->cell_count; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], cells->cells[i].low[k]);
            high[k] = fmax(high[k], cells->cells[i].high[k]);
        }
    for (int k = 0; k < 3; k++) {
        const double of_place = TOLERANCE_OF_PLACE * fmax(fabs(low[k]), fabs(high[k]));
        cells->tolerance = fmax(cells->tolerance, fmax(TOLERANCE_OF_EXTENT * (high[k] - low[k]), of_place));
    }
}

static size_t inset_planes(const nebel_cells *cells, const nb_fog_cell *cell, double (*planes)[4])
{
    for (size_t i = 0; i < cell->plane_count; i++) {
        const nb_cell_plane *plane = &cells->planes[cell->first_plane + i];
        memcpy(planes[i], plane->normal, sizeof plane->normal);
        planes[i][3] = plane->distance - cells->tolerance;
    }
    return cell->plane_count;
}

static int are_apart(const nebel_cells *cells, const nb_fog_cell *a, const nb_fog_cell *b)
{
    for (int i = 0; i < 3; i++)
        if (fmin(a->high[i], b->high[i]) - fmax(a->low[i], b->low[i]) <= cells->tolerance) return 1;
    return 0;
}

static int overlap(const nebel_cells *cells, const nb_fog_cell *a, const nb_fog_cell *b, double (*planes)[4])
{
    double low[3], high[3];
    if (are_apart(cells, a, b)) return 0;
    size_t count = inset_planes(cells, a, planes);
    count += inset_planes(cells, b, planes + count);
    return nb_convex_bounds((const double(*)[4])planes, count, low, high);
}

static nebel_result check_overlaps(nebel_cells *cells, const nebel_cells_desc *desc)
{
    double(*planes)[4] = nb_allocate(&cells->allocator, 2 * (size_t)NEBEL_MAX_SHAPE_PLANES, sizeof *planes);
    nebel_result result = NEBEL_OK;
    if (planes == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "cells: out of memory");
    for (size_t b = 1; b < cells->cell_count && result == NEBEL_OK; b++)
        for (size_t a = 0; a < b && result == NEBEL_OK; a++)
            if (overlap(cells, &cells->cells[a], &cells->cells[b], planes)) {
                result = nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                                 "cell %zu: overlaps cell %zu; cells may touch, but share no place", b, a);
                if (desc->failed_cell != NULL) *desc->failed_cell = b;
            }
    nb_release(&cells->allocator, planes);
    return result;
}

static nebel_result set_cells(nebel_cells *cells, const nebel_cells_desc *desc)
{
    cells->cells = nb_allocate_zero(&cells->allocator, desc->cell_count, sizeof *cells->cells);
    if (cells->cells == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "cells: out of memory");
    for (size_t i = 0; i < desc->cell_count; i++) {
        nb_cell_note about = {&desc->host.log, i};
        const nebel_log log = {pass_on, &about};
        const nebel_result result = set_cell(cells, &log, &desc->cells[i], &cells->cells[i]);
        if (result != NEBEL_OK) {
            if (desc->failed_cell != NULL) *desc->failed_cell = i;
            return result;
        }
        cells->cell_count++;
    }
    set_tolerance(cells);
    return check_overlaps(cells, desc);
}

static nebel_result set_portals(nebel_cells *cells, const nebel_cells_desc *desc)
{
    if (!cells->has_walls) {
        if (nb_cells_derive_portals(cells) == NEBEL_OK) return NEBEL_OK;
        return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "cells: out of memory for portals");
    }
    for (size_t i = 0; i < desc->portal_count; i++) {
        const nebel_result result = nb_cells_add_portal(cells, &desc->host.log, i, &desc->portals[i]);
        if (result == NEBEL_OK) continue;
        if (desc->failed_portal != NULL) *desc->failed_portal = i;
        return result;
    }
    return NEBEL_OK;
}

static nebel_result check_desc(const nebel_cells_desc *desc)
{
    const nebel_log *log = &desc->host.log;
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "cells: the allocator needs allocate and release, or neither");
    if (desc->cells == NULL || desc->cell_count == 0)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "cells: there are none; at least one is needed");
    if (desc->portals == NULL && desc->portal_count > 0)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "cells: portals is NULL, but portal_count is %zu",
                       desc->portal_count);
    if (desc->model < 0 || desc->model >= NEBEL_CELL_MODEL_COUNT || desc->span < 0 || desc->span >= NEBEL_SPAN_COUNT)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "cells: model %d or span %d is none", (int)desc->model,
                       (int)desc->span);
    if (desc->cell_count > NEBEL_MAX_CELLS)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "cells: there are %zu; at most %d", desc->cell_count, NEBEL_MAX_CELLS);
    return NEBEL_OK;
}

nebel_result nebel_create_cells(const nebel_cells_desc *desc, nebel_cells **cells)
{
    if (cells == NULL) return NEBEL_ERROR_ARGUMENT;
    *cells = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (desc->failed_cell != NULL) *desc->failed_cell = SIZE_MAX;
    if (desc->failed_portal != NULL) *desc->failed_portal = SIZE_MAX;
    nebel_result result = check_desc(desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_cells *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "cells: out of memory");
    made->allocator = allocator;
    made->model = desc->model;
    made->span = desc->span;
    made->grouped = !desc->ungrouped;
    made->has_walls = desc->portals != NULL;
    result = set_cells(made, desc);
    if (result == NEBEL_OK) result = set_portals(made, desc);
    if (result == NEBEL_OK)
        *cells = made;
    else
        nebel_destroy_cells(made);
    return result;
}

void nebel_destroy_cells(nebel_cells *cells)
{
    if (cells == NULL) return;
    const nebel_allocator allocator = cells->allocator;
    nb_release(&allocator, cells->cells);
    nb_release(&allocator, cells->planes);
    nb_release(&allocator, cells->portals);
    nb_release(&allocator, cells->vertices);
    nb_release(&allocator, cells);
}
