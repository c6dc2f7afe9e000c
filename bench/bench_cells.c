/* Fog in cells at vertices, one after the other through rooms in a row, against the magazine's code, which asks every
 * room. */
#include "groups.h"
#include "scalar_baseline.h"
#include "measure.h"

#include <nebel/classic.h>

#include <math.h>

static const char failed[] = "cells: a query failed or gave another fog than the magazine's code";

enum { MOST_ROOMS = 64, POINTS = 4096 };

/* Rooms 1 m long along x, each with a fog of its own, so that none are grouped; the eye is in the first. */
typedef struct nb_cell_row {
    size_t room_count;
    nebel_cell rooms[MOST_ROOMS];
    nb_old_box boxes[MOST_ROOMS];
    nebel_cells *cells;
    nebel_cell_point points[POINTS];
    nebel_cell_fog fog[POINTS];
    nb_old_vertex old[POINTS];
    int rounds;
} nb_cell_row;

static const nebel_cell_view view = {.eye = {.5, 1, 1.5}, .forward = {1, 0, 0}};

static double run_cells(void *user)
{
    nb_cell_row *const row = user;
    const double start = nb_clock_cpu();
    for (int i = 0; i < row->rounds; i++)
        if (nebel_compute_cell_fog(row->cells, &view, POINTS, row->points, 0, row->fog, 0) != NEBEL_OK) return -1;
    return nb_clock_cpu() - start;
}

static double run_magazine(void *user)
{
    nb_cell_row *const row = user;
    const nb_old_camera camera = {{(float)view.eye[0], (float)view.eye[1], (float)view.eye[2]}};
    const double start = nb_clock_cpu();
    for (int i = 0; i < row->rounds; i++) nb_magazine_fog(&camera, row->boxes, row->room_count, row->old, POINTS);
    return nb_clock_cpu() - start;
}

static int agree(const nb_cell_row *row)
{
    for (size_t i = 0; i < POINTS; i++)
        if (!(fabs(1 - row->fog[i].alpha - (double)row->old[i].transmittance) < 1e-4)) return 0;
    return 1;
}

static void make_rooms(nb_cell_row *row)
{
    for (size_t i = 0; i < row->room_count; i++) {
        const double low = (double)i, density = .5 * (double)(1 + i % 3) / (double)row->room_count;
        row->rooms[i] = (nebel_cell){.shape = {.type = NEBEL_SHAPE_BOX, .min = {low, 0, 0}, .max = {low + 1, 3, 3}},
                                     .density = density};
        row->boxes[i] = (nb_old_box){{(float)low, 0, 0}, {(float)low + 1, 3, 3}, (float)density};
    }
}

/* In the last room, so that every way goes through all of them. */
static void make_points(nb_cell_row *row)
{
    for (size_t i = 0; i < POINTS; i++) {
        const double x = (double)row->room_count - .5, y = .05 + 2.9 * (double)(i % 64) / 63,
                     z = .05 + 2.9 * (double)(i / 64) / 63;
        row->points[i] = (nebel_cell_point){.position = {x, y, z}};
        row->old[i] = (nb_old_vertex){.position = {(float)x, (float)y, (float)z}};
    }
}

static const char *measure_row(nb_cell_row *row, const nb_bench_desc *desc, nb_figures *figures)
{
    nb_contest contests[2] = {{.run = run_magazine, .user = row}, {.run = run_cells, .user = row}};
    make_rooms(row);
    make_points(row);
    const nebel_cells_desc cells = {
        .cells = row->rooms, .cell_count = row->room_count, .model = NEBEL_CELL_EXPONENTIAL};
    if (nebel_create_cells(&cells, &row->cells) != NEBEL_OK) return failed;
    const int status = nb_measure(contests, 2, desc->quick ? 1 : 15);
    nebel_destroy_cells(row->cells);
    if (status != 0 || !agree(row)) return failed;
    const double asked = 1e-6 * POINTS * row->rounds;
    nb_figure figure = {.group = "Fog in cells at vertices, one thread",
                        .unit = "M vertices/s",
                        .value = asked / contests[1].seconds,
                        .floor_name = "the magazine's code",
                        .floor = asked / contests[0].seconds};
    (void)snprintf(figure.name, sizeof figure.name, "through %zu cells", row->room_count);
    nb_figures_add(figures, &figure);
    return NULL;
}

const char *nb_bench_cells(const nb_bench_desc *desc, nb_figures *figures)
{
    static nb_cell_row row;
    const char *fault = NULL;
    for (row.room_count = 4; row.room_count <= MOST_ROOMS && fault == NULL; row.room_count *= 4) {
        row.rounds = desc->quick ? 1 : (int)(256 / row.room_count);
        fault = measure_row(&row, desc, figures);
    }
    return fault;
}
