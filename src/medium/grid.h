/* Voxels as the core keeps them, and what a ray meets in them.
 *
 * A ray is seen in cells: places where the density is one polynomial. With nearest voxels these are the voxels, n
 * along an axis; with linear ones the cubes between the middles of eight voxels, n + 1, of which the outermost are
 * half outside. A box of fog has its low corner at `margin` and its high one at n + margin. Everything here is
 * computed one ray after the other in double, so that no instruction set can differ. */
#ifndef NB_MEDIUM_GRID_H
#define NB_MEDIUM_GRID_H

#include <nebel/nebel.h>

#include <stdint.h>

/* Where the box begins, in cells. */
double nb_grid_margin(const nebel_grid *grid);

/* Cells per unit of a box's coordinates along each axis, finite for the thinnest box. */
void nb_grid_rate(const nebel_grid *grid, const double low[3], const double high[3], double rate[3]);

/* The largest density anywhere. */
double nb_grid_peak(const nebel_grid *grid);

/* A total order on what grids are, whatever their addresses. NULL is the least. */
int nb_grid_compare(const nebel_grid *a, const nebel_grid *b);

/* A ray in cells: from + slope t, t in metres. */
typedef struct nb_grid_line {
    double from[3], slope[3];
} nb_grid_line;

typedef struct nb_grid_sum {
    double value; /* the integral of the density [m] */
    double error; /* by how much it may be off */
} nb_grid_sum;

/* What may be more by any amount. */
#define NB_GRID_ENDLESS 1e18

/* The density integrated from 0 to `length` metres. `noise`: by how many cells each coordinate may be off. Where it
 * comes to `enough` the rest may be left out, and the error is NB_GRID_ENDLESS. */
nb_grid_sum nb_grid_integral(const nebel_grid *grid, const nb_grid_line *line, double length, double noise,
                             double enough);

/* How far along the line the integral from 0 reaches each of `count` ascending shares of `amount`, which is what it
 * comes to at `length`. */
void nb_grid_places(const nebel_grid *grid, const nb_grid_line *line, double length, double amount, int count,
                    const double *share, double *place);

/* The density integrated from 0 to each of `count` ascending places along the line, of which `length` is none beyond. */
void nb_grid_sums(const nebel_grid *grid, const nb_grid_line *line, double length, int count, const double *place,
                  double *sum);

/* Whether the density is interpolated between voxels. */
int nb_grid_is_linear(const nebel_grid *grid);

/* How many cells there are along an axis, and where the box ends in them. */
int nb_grid_cells(const nebel_grid *grid, int axis);
double nb_grid_end(const nebel_grid *grid, int axis);

/* The density at a place. */
double nb_grid_density(const nebel_grid *grid, const double place[3]);

/* How far it is to where the ray enters a cell of another polynomial, at least `least`; HUGE_VAL where it never does.
 * Whole bricks of one density are one cell. */
double nb_grid_kink(const nebel_grid *grid, const nb_grid_line *line, double least);

/* The same to where rules for light that comes from elsewhere, to whose depth all cells add, had better begin anew:
 * the faces of bricks, and of nearest voxels. */
double nb_grid_border(const nebel_grid *grid, const nb_grid_line *line, double least);

/* A bound of |density| where each coordinate is a complex number within `reach` of the place, with the polynomial that
 * holds at the place. */
double nb_grid_ceiling(const nebel_grid *grid, const double place[3], const double reach[3]);

#endif
