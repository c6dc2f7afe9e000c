/* A table of what air does to the rays of one place.
 *
 * Its rows are slopes, its columns turns away from the sun, its levels shares of the way. Entries are means over the way so
 * far, not sums: those hardly change near the eye, so that also the first metres are right. */
#include "base/parallel.h"
#include "sky_view.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

enum { NODES = 4 }; /* of a piece of a ray: pieces are many */

/* Estimates of errors from second differences are this often taken, */
#define SAFETY 3
/* and what is missed amid entries. */
#define SAFETY_AMID 2

/* Rows may be asked for between those of the table. */
static nb_view_elevation row_slope(const nebel_sky_view *view, double row, nb_reach *reach)
{
    if (row < NB_VIEW_FALLING) return nb_elevation_map_slope(&view->outlook, 1, row / (NB_VIEW_FALLING - 1.0), reach);
    return nb_elevation_map_slope(&view->outlook, 0, (row - NB_VIEW_FALLING) / (NB_VIEW_RISING - 1.0), reach);
}

/* ---- making ---------------------------------------------------------------------------------- */

/* Columns lie evenly over the sine of half the turn, in which light is smooth at both ends. */
static double column_cosine(const nebel_sky_view *view, double column)
{
    const double half = column / (view->columns - 1.0);
    return 1 - 2 * half * half;
}

static void write_entry(const nebel_sky_view *view, const nb_in_scattered *gathered, double per, float *entry)
{
    const nebel_atmosphere *atmosphere = view->atmosphere;
    static const double none[3] = {0, 0, 0};
    const int often = nb_view_often(view);
    double off = 0;
    for (int i = 0; i < view->scatterer_count; i++)
        for (int c = 0; c < 3; c++) entry[3 * i + c] = (float)(per * gathered->once[view->scatterers[i]][c]);
    for (int c = 0; c < 3; c++) {
        entry[often + c] = (float)(per * gathered->often[c]);
        off = fmax(off, view->sun.irradiance[c] * nb_gathered_off(atmosphere, gathered, none, c));
    }
    entry[often + 3] = (float)(per * off);
}

/* What the columns of a row share: the ray, the ends of its levels, and nodes along it where no shadow cuts it. */
typedef struct nb_row {
    nb_view_elevation slope;
    nb_reach reach;
    nb_atmosphere_ray track;
    double ends[NB_VIEW_MORE_LEVELS];
    nb_ray_nodes path;
} nb_row;

static nb_moment_basis column_aspect(const nebel_sky_view *view, const nb_row *row, double column)
{
    const nb_view_elevation slope = row->slope, to_sun = view->sun_slope;
    const double sun = slope.cosine * to_sun.cosine + slope.sine * to_sun.sine * column_cosine(view, column);
    const double height_of_sun = (view->outlook.radius * to_sun.cosine + row->reach.begin * sun) / row->track.radius;
    return (nb_moment_basis){fmax(-1, fmin(1, row->track.rise / row->track.radius)), fmax(-1, fmin(1, sun)),
                             fmax(-1, fmin(1, height_of_sun))};
}

/* Returns what is scattered just where the ray begins. */
static nb_in_scattered gather_column(const nebel_sky_view *view, const nb_row *row, nb_moment_basis aspect,
                                     nb_in_scattered gathered[])
{
    const nebel_atmosphere *atmosphere = view->atmosphere;
    double cuts[2];
    int is_cut = 0;
    nb_find_shadow(&atmosphere->airs, row->track, aspect, cuts);
    for (int i = 0; i < 2; i++) is_cut |= cuts[i] > 0 && cuts[i] < row->reach.span;
    if (is_cut) return nb_gather(atmosphere, &view->rule, row->track, aspect, view->levels, row->ends, gathered);
    return nb_gather_path(atmosphere, row->track, aspect, &row->path, view->levels, row->ends, gathered);
}

static void fill_column(nebel_sky_view *view, int number, const nb_row *row, int column)
{
    nb_in_scattered gathered[NB_VIEW_MORE_LEVELS];
    const nb_in_scattered start = gather_column(view, row, column_aspect(view, row, column), gathered);
    write_entry(view, &start, 1, nb_view_entry(view, number, column, 0));
    for (int level = 0; level < view->levels; level++)
        write_entry(view, row->reach.span > 0 ? &gathered[level] : &start,
                    row->reach.span > 0 ? 1 / row->ends[level] : 1, nb_view_entry(view, number, column, level + 1));
}

static void fill_extinction(nebel_sky_view *view, int row, nb_atmosphere_ray track, const double ends[])
{
    const nb_air_components *airs = &view->atmosphere->airs;
    for (int c = 0; c < 3; c++) nb_view_extinction(view, row, 0)[c] = 0;
    for (int k = 0; k < airs->count; k++)
        for (int c = 0; c < 3; c++)
            nb_view_extinction(view, row, 0)[c] +=
                airs->airs[k].extinction[c] * nb_air_density(&airs->airs[k], track.radius - airs->radius);
    for (int level = 1; level <= view->levels; level++) {
        const double way = ends[level - 1];
        double *extinction = nb_view_extinction(view, row, level);
        for (int c = 0; c < 3; c++) extinction[c] = nb_view_extinction(view, row, 0)[c];
        if (!(way > 0)) continue;
        nb_atmosphere_ray_depth(airs, track, way, extinction);
        for (int c = 0; c < 3; c++) extinction[c] /= way;
    }
}

/* before: how far before the levels of the table its ends are, 0 or 1/2 of a step; the first one half of the way, as means are
 * linear there. */
static void set_row(const nebel_sky_view *view, double number, double before, nb_row *row)
{
    const nb_air_components *airs = &view->atmosphere->airs;
    row->slope = row_slope(view, number, &row->reach);
    row->track = (nb_atmosphere_ray){row->reach.begin > 0 ? airs->top : view->outlook.radius,
                                     view->outlook.radius * row->slope.cosine + row->reach.begin};
    for (int level = 0; level < view->levels; level++)
        row->ends[level] =
            row->reach.span * nb_level_end(row->reach.dense, row->reach.soft, (level + 1 - before) / view->levels);
    if (before > 0)
        row->ends[0] = 0.5 * row->reach.span * nb_level_end(row->reach.dense, row->reach.soft, 1.0 / view->levels);
    nb_ray_nodes_lay(airs, nb_atmosphere_smooth(view->atmosphere), &view->rule, row->track, row->reach.span,
                     view->levels, row->ends, &row->path);
}

static void fill_row(void *data, size_t number)
{
    nebel_sky_view *view = data;
    nb_row row;
    set_row(view, (double)number, 0, &row);
    fill_extinction(view, (int)number, row.track, row.ends);
    for (int column = 0; column < view->columns; column++) fill_column(view, (int)number, &row, column);
}

/* Of one colour, as if all scattered evenly. */
static double brightness(const nebel_sky_view *view, const float *entry, int c)
{
    const int often = nb_view_often(view);
    double sum = (double)entry[often + c];
    for (int i = 0; i < view->scatterer_count; i++) sum += 0.07957747154594767 * (double)entry[3 * i + c];
    return view->sun.irradiance[c] * sum;
}

/* What interpolation misses amid entries: between two rows and two levels, of extinction, and of light as a part of the
 * brightest entry around. */
typedef struct nb_missed {
    double extinction, light;
} nb_missed;

typedef struct nb_estimates {
    nebel_sky_view *view;
    /* Behind the row, and before the level; that at the start is not counted. */
    nb_missed missed[NB_VIEW_ROWS][NB_VIEW_MORE_LEVELS];
} nb_estimates;

/* The two levels between which an end of set_row with `before` is; whole rays have entries of their own. */
static int first_level(const nebel_sky_view *view, int cell)
{
    return view->levels > 1 ? cell : 1;
}

static double missed_extinction(nebel_sky_view *view, int number, const nb_row *row, int cell)
{
    double depth[3] = {0, 0, 0}, most = 0;
    nb_atmosphere_ray_depth(&view->atmosphere->airs, row->track, row->ends[cell], depth);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int i = 0; i < 2; i++)
            sum += nb_view_extinction(view, number + i, first_level(view, cell))[c] +
                   nb_view_extinction(view, number + i, cell + 1)[c];
        most = fmax(most, fabs(depth[c] / row->ends[cell] - sum / 4));
    }
    return most;
}

static double missed_light(const nebel_sky_view *view, int number, int column, const nb_in_scattered *gathered,
                           double end, int cell)
{
    float exact[NB_VIEW_SIZE];
    double worst = 0, brightest = 0;
    write_entry(view, gathered, 1 / end, exact);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int i = 0; i < 8; i++) {
            const int level = i / 4 == 0 ? first_level(view, cell) : cell + 1;
            const double light = brightness(view, nb_view_entry(view, number + i % 2, column + i / 2 % 2, level), c);
            sum += light;
            brightest = fmax(brightest, light);
        }
        worst = fmax(worst, fabs(brightness(view, exact, c) - sum / 8));
    }
    return brightest > 0 ? worst / brightest : 0;
}

/* Behind a row, in three of the columns. */
static void measure_row(void *data, size_t row_number)
{
    nb_estimates *estimates = data;
    nebel_sky_view *view = estimates->view;
    const int number = (int)row_number;
    nb_row row;
    nb_in_scattered gathered[NB_VIEW_MORE_LEVELS];
    if (number == NB_VIEW_FALLING - 1 || number == NB_VIEW_ROWS - 1) return;
    set_row(view, number + 0.5, view->levels > 1 ? 0.5 : 0, &row);
    if (!(row.ends[0] > 0)) return;
    for (int cell = 0; cell < view->levels; cell++)
        estimates->missed[number][cell].extinction = missed_extinction(view, number, &row, cell);
    for (int i = 0; i < 3; i++) {
        const int column = i * (view->columns - 2) / 2;
        gather_column(view, &row, column_aspect(view, &row, column + 0.5), gathered);
        for (int cell = 0; cell < view->levels; cell++) {
            double *light = &estimates->missed[number][cell].light;
            *light = fmax(*light, missed_light(view, number, column, &gathered[cell], row.ends[cell], cell));
        }
    }
}

/* The most that is missed around an entry. */
static nb_missed missed_around(const nb_estimates *estimates, int row, int level)
{
    nb_missed most = {0, 0};
    for (int i = 0; i < 4; i++) {
        const int before = row - i / 2, cell = level - i % 2;
        if (before < 0 || cell < 0 || cell >= estimates->view->levels) continue;
        const nb_missed *missed = &estimates->missed[before][cell];
        most.extinction = fmax(most.extinction, missed->extinction);
        most.light = fmax(most.light, missed->light);
    }
    return most;
}

/* The second difference of three entries, of which the first and last may be missing; `most` becomes at least as bright as each. */
static double bend(const nebel_sky_view *view, const float *before, const float *entry, const float *behind, int c,
                   double *most)
{
    if (before == NULL || behind == NULL) return 0;
    const double first = brightness(view, before, c), last = brightness(view, behind, c);
    *most = fmax(*most, fmax(first, last));
    return fabs(first - 2 * brightness(view, entry, c) + last);
}

/* Linear interpolation between values a step apart misses an eighth of the second difference. */
static void estimate_extinction(nebel_sky_view *view, int row, int level, double missed)
{
    const int first = row == 0 || row == NB_VIEW_FALLING, last = row == NB_VIEW_FALLING - 1 || row == NB_VIEW_ROWS - 1;
    double worst = 0;
    for (int c = 0; c < 3; c++) {
        const double here = nb_view_extinction(view, row, level)[c];
        double off = 0;
        if (!first && !last)
            off += fabs(nb_view_extinction(view, row - 1, level)[c] - 2 * here +
                        nb_view_extinction(view, row + 1, level)[c]);
        if (level > 0 && level < view->levels)
            off += fabs(nb_view_extinction(view, row, level - 1)[c] - 2 * here +
                        nb_view_extinction(view, row, level + 1)[c]);
        worst = fmax(worst, off);
    }
    nb_view_extinction(view, row, level)[3] = fmax(SAFETY * worst / 8, SAFETY_AMID * missed);
}

/* The same of light. */
static void estimate_row(void *data, size_t number)
{
    const nb_estimates *estimates = data;
    nebel_sky_view *view = estimates->view;
    const int row = (int)number;
    const int first = row == 0 || row == NB_VIEW_FALLING, last = row == NB_VIEW_FALLING - 1 || row == NB_VIEW_ROWS - 1;
    for (int level = 0; level <= view->levels; level++) {
        const nb_missed missed = missed_around(estimates, row, level);
        estimate_extinction(view, row, level, missed.extinction);
        for (int column = 0; column < view->columns; column++) {
            float *entry = nb_view_entry(view, row, column, level);
            double most = 0, worst = 0;
            for (int c = 0; c < 3; c++) {
                const double off =
                    bend(view, first ? NULL : nb_view_entry(view, row - 1, column, level), entry,
                         last ? NULL : nb_view_entry(view, row + 1, column, level), c, &most) +
                    bend(view, column == 0 ? NULL : nb_view_entry(view, row, column - 1, level), entry,
                         column == view->columns - 1 ? NULL : nb_view_entry(view, row, column + 1, level), c, &most) +
                    bend(view, level == 0 ? NULL : entry - view->size, entry,
                         level == view->levels ? NULL : entry + view->size, c, &most);
                worst = fmax(worst, off / 8);
                most = fmax(most, brightness(view, entry, c));
            }
            const double part = most > 0 ? SAFETY * worst / most : 0;
            entry[nb_view_often(view) + 4] = (float)fmax(part, SAFETY_AMID * missed.light);
        }
    }
}

static void estimate(nebel_sky_view *view, const nebel_parallel *parts)
{
    nb_estimates estimates = {.view = view};
    nb_parallel_for(parts, NB_VIEW_ROWS, measure_row, &estimates);
    nb_parallel_for(parts, NB_VIEW_ROWS, estimate_row, &estimates);
}

static void set_sunlight(nebel_sky_view *view)
{
    const nb_air_components *airs = &view->atmosphere->airs;
    for (int i = 0; i < NB_VIEW_SUNS; i++) {
        const double root = i / (NB_VIEW_SUNS - 1.0);
        nb_atmosphere_ray_sunlight(airs, (nb_atmosphere_ray){airs->radius, airs->radius * root * root},
                                   view->sunlight[i]);
    }
}

static double brightest_of(const nebel_sky_view *view)
{
    double most = 0;
    for (int row = 0; row < NB_VIEW_ROWS; row++) {
        nb_reach reach;
        row_slope(view, row, &reach);
        for (int column = 0; column < view->columns; column++)
            for (int c = 0; c < 3; c++)
                most = fmax(most, reach.span * brightness(view, nb_view_entry(view, row, column, view->levels), c));
    }
    return most;
}

/* Up, and level towards the sun; anywhere level where the sun is in the zenith. */
static void set_axes(nebel_sky_view *view, const double place[3])
{
    static const double top[3] = {0, 1, 0};
    memcpy(view->up, place, sizeof view->up);
    if (!nb_vector_make_unit(view->up)) memcpy(view->up, top, sizeof view->up);
    const double along = nb_vector_dot(view->up, view->sun.direction);
    for (int c = 0; c < 3; c++) view->ahead[c] = view->sun.direction[c] - along * view->up[c];
    const double sine = nb_vector_length(view->ahead);
    view->sun_slope = (nb_view_elevation){fmax(-1, fmin(1, along)), fmin(1, sine)};
    if (!(sine > 1e-9)) {
        const double x[3] = {fabs(view->up[0]) < 0.5, 0, !(fabs(view->up[0]) < 0.5)};
        nb_vector_cross(view->up, x, view->ahead);
    }
    nb_vector_make_unit(view->ahead);
    nb_vector_cross(view->up, view->ahead, view->aside);
}

static nebel_result allocate(nebel_sky_view *view)
{
    const size_t count = (size_t)NB_VIEW_ROWS * (size_t)view->columns * ((size_t)view->levels + 1);
    view->size = (3 * view->scatterer_count + 5 + 3) / 4 * 4;
    view->entries = nb_allocate_zero(&view->allocator, count, (size_t)view->size * sizeof *view->entries);
    view->extinction =
        nb_allocate_zero(&view->allocator, (size_t)NB_VIEW_ROWS * ((size_t)view->levels + 1), sizeof *view->extinction);
    return view->entries != NULL && view->extinction != NULL ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

/* From space day and night are seen at once, and so they are in air that is deep for the planet. */
static int sees_day_and_night(const nebel_sky_view *view)
{
    const nb_elevation_map *outlook = &view->outlook;
    return outlook->height > outlook->thickness || outlook->thickness > 0.1 * view->atmosphere->airs.radius;
}

/* Rays may pass places where air is many times as dense as at the eye. */
static int is_high(const nebel_sky_view *view)
{
    return view->outlook.height > 0.2 * view->outlook.thickness;
}

static void set_up(nebel_sky_view *view, const nebel_sky_view_desc *desc)
{
    const nebel_atmosphere *atmosphere = desc->atmosphere;
    double place[3];
    nb_air_from_center(atmosphere, desc->position, place);
    set_axes(view, place);
    view->outlook = nb_elevation_map_make(&atmosphere->airs, fmax(atmosphere->airs.radius, nb_vector_length(place)));
    view->columns = sees_day_and_night(view) ? NB_VIEW_MORE_COLUMNS : NB_VIEW_COLUMNS;
    view->levels = !desc->has_ray_ends ? 1 : is_high(view) ? NB_VIEW_MORE_LEVELS : NB_VIEW_LEVELS;
    view->rule = nb_gauss_rule_make(desc->has_ray_ends ? NODES : NB_MAX_RULE);
    for (int k = 0; k < atmosphere->airs.count; k++) {
        const double *scattering = atmosphere->airs.airs[k].scattering;
        if (scattering[0] + scattering[1] + scattering[2] > 0) view->scatterers[view->scatterer_count++] = k;
    }
}

nebel_result nebel_create_sky_view(const nebel_sky_view_desc *desc, nebel_sky_view **view)
{
    nebel_sun sun;
    if (view == NULL) return NEBEL_ERROR_ARGUMENT;
    *view = NULL;
    if (desc == NULL || !nb_allocator_is_valid(&desc->host.allocator)) return NEBEL_ERROR_ARGUMENT;
    if (desc->atmosphere == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "air view: atmosphere: is NULL; make one first");
    if (!nb_air_resolve_sun(&desc->sun, &sun))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "air view: %s", nb_air_sun_fault);
    if (!nb_air_is_place(desc->position))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "air view: position: is (%g, %g, %g); each must be within -1e15 and 1e15", desc->position[0],
                       desc->position[1], desc->position[2]);
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_sky_view *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "air: out of memory");
    made->allocator = allocator;
    made->atmosphere = desc->atmosphere;
    made->sun = sun;
    made->look = nb_sky_view_choose(NEBEL_ISA_DEFAULT);
    set_up(made, desc);
    if (allocate(made) != NEBEL_OK) {
        nebel_destroy_sky_view(made);
        return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "air: out of memory");
    }
    if (!nb_air_components_are_empty(&made->atmosphere->airs)) {
        nb_parallel_for(&desc->host.parallel, NB_VIEW_ROWS, fill_row, made);
        estimate(made, &desc->host.parallel);
        made->brightest = brightest_of(made);
    }
    set_sunlight(made);
    *view = made;
    return NEBEL_OK;
}

void nebel_destroy_sky_view(nebel_sky_view *view)
{
    if (view == NULL) return;
    const nebel_allocator allocator = view->allocator;
    nb_release(&allocator, view->entries);
    nb_release(&allocator, view->extinction);
    nb_release(&allocator, view);
}
