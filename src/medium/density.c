#include "density.h"

#include "grid.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/shapes.inc"
#include "formulas/profiles.inc"

static nb_wvec3 to_leaf(const nb_leaf *leaf, const double place[3])
{
    double offset[3], local[3];
    for (int i = 0; i < 3; i++) offset[i] = (place[i] - leaf->origin[i]) - leaf->origin_rest[i];
    for (int i = 0; i < 3; i++) {
        const double *row = &leaf->matrix[3 * i];
        local[i] = row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2];
    }
    return nb_wvec3((nb_wide)local[0], (nb_wide)local[1], (nb_wide)local[2]);
}

static int is_within(double x, double low, double high)
{
    return low <= x && x < high;
}

static int is_behind_faces(const nb_volume *volume, const nb_leaf *leaf, const double p[3])
{
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &volume->faces[leaf->first_face + i];
        if (!(face->normal[0] * p[0] + face->normal[1] * p[1] + face->normal[2] * p[2] <= face->distance)) return 0;
    }
    return 1;
}

static int is_in_leaf(const nb_volume *volume, const nb_leaf *leaf, const double place[3])
{
    const nb_wvec3 local = to_leaf(leaf, place);
    const double p[3] = {(double)local.x, (double)local.y, (double)local.z};
    const double across = p[0] * p[0] + p[1] * p[1];
    switch (leaf->type) {
    case NB_LEAF_WORLD:
        return 1;
    case NB_LEAF_PLANES:
        return is_behind_faces(volume, leaf, p);
    case NB_LEAF_BOX:
        return is_within(p[0], leaf->low[0], leaf->high[0]) && is_within(p[1], leaf->low[1], leaf->high[1]) &&
               is_within(p[2], leaf->low[2], leaf->high[2]);
    case NB_LEAF_SPHERE:
        return across + p[2] * p[2] <= leaf->radius * leaf->radius;
    case NB_LEAF_CYLINDER:
        return across <= 1 && is_within(p[2], 0, 1);
    case NB_LEAF_CONE: {
        const double radius = leaf->radius + leaf->slope * p[2];
        return across <= radius * radius && is_within(p[2], 0, 1);
    }
    default: {
        const double beyond = p[2] - fmin(fmax(p[2], 0), leaf->length);
        return across + beyond * beyond <= 1;
    }
    }
}

int nb_volume_holds(const nb_volume *volume, const double place[3])
{
    int stack[NB_STEP_STACK], top = 0;
    size_t leaf = 0;
    for (size_t i = 0; i < volume->step_count; i++) {
        if (volume->steps[i] == NB_OP_LEAF) {
            stack[top++] = is_in_leaf(volume, &volume->leaves[leaf++], place);
            continue;
        }
        top--;
        stack[top - 1] = volume->steps[i] == NB_OP_UNION ? stack[top - 1] || stack[top] : stack[top - 1] && stack[top];
    }
    return stack[0];
}

static double square_distance(const double a[3], const double b[3])
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

static double linear_density(const nebel_density *density, const double place[3])
{
    double along = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        const double axis = density->to[i] - density->from[i];
        along += (place[i] - density->from[i]) * axis;
        square += axis * axis;
    }
    return nb_linear_density(along / square);
}

static double radial_density(const nb_volume *volume, const double place[3])
{
    const nb_leaf *ball = &volume->leaves[0];
    const nb_wvec3 p = nb_wscale3(to_leaf(ball, place), 1 / (nb_wide)ball->radius);
    return nb_radial_density(nb_narrow(1 - nb_wdot3(p, p)), 0, volume->density.power);
}

static double soft_edge_density(const nb_volume *volume, const double place[3])
{
    const nb_leaf *box = &volume->leaves[0];
    const nb_wide inverse = 1 / (nb_wide)volume->density.edge_width;
    const nb_wvec3 p = to_leaf(box, place);
    const nb_wvec3 low = nb_wvec3((nb_wide)box->low[0], (nb_wide)box->low[1], (nb_wide)box->low[2]);
    const nb_wvec3 high = nb_wvec3((nb_wide)box->high[0], (nb_wide)box->high[1], (nb_wide)box->high[2]);
    const nb_wvec3 middle = nb_wscale3(nb_wadd3(low, high), NB_W(0.5));
    const nb_wvec3 size = nb_wscale3(nb_wsub3(high, low), NB_W(0.5) * inverse);
    return nb_soft_edge_density(nb_wscale3(nb_wsub3(p, middle), inverse), size);
}

/* In a leaf's frame, which has a radius of 1. */
static double round_edge_density(const nb_volume *volume, const double place[3])
{
    const nb_leaf *leaf = &volume->leaves[0];
    const nb_soft_edge *edge = &volume->edge;
    const int ball = leaf->type == NB_LEAF_SPHERE;
    const nb_wvec3 p = nb_wscale3(to_leaf(leaf, place), ball ? 1 / (nb_wide)leaf->radius : 1);
    const nb_round_edge at =
        nb_round_edge_of(p, nb_wvec3(0, 0, 0), ball ? 1 : (nb_wide)leaf->radius, (nb_wide)leaf->slope,
                         leaf->type == NB_LEAF_CAPSULE ? (nb_wide)leaf->length : 1, (nb_wide)edge->gain,
                         (nb_wide)edge->steepness, (nb_wide)edge->inner, nb_leaf_edge_form(leaf));
    return nb_round_edge_density(at.side, at.q, at.ends.x, nb_leaf_edge_form(leaf));
}

static double planes_edge_density(const nb_volume *volume, const double place[3])
{
    const nb_leaf *leaf = &volume->leaves[0];
    const nb_wvec3 p = to_leaf(leaf, place);
    double least = 1;
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &volume->faces[leaf->first_face + i];
        const double along =
            face->normal[0] * (double)p.x + face->normal[1] * (double)p.y + face->normal[2] * (double)p.z;
        least = fmin(least, (face->distance - along) * face->inverse_length / volume->density.edge_width);
    }
    return fmax(least, 0);
}

static double edge_density(const nb_volume *volume, const double place[3])
{
    switch (volume->leaves[0].type) {
    case NB_LEAF_BOX:
        return soft_edge_density(volume, place);
    case NB_LEAF_PLANES:
        return planes_edge_density(volume, place);
    default:
        return round_edge_density(volume, place);
    }
}

static double density_at_height(const nebel_density *density, double height)
{
    const double u = height / density->scale_height;
    return density->below == NEBEL_BELOW_GROW ? nb_height_density(u) : nb_height_capped_density(u);
}

static double height_density(const nebel_density *density, double y)
{
    return density_at_height(density, y - density->base);
}

static double altitude_density(const nebel_density *density, const double place[3])
{
    const double radius = sqrt(square_distance(place, density->center));
    return density_at_height(density, radius - density->radius - density->base);
}

static double gaussian_density(const nebel_density *density, const double place[3])
{
    return nb_gaussian_density(square_distance(place, density->center) / (2 * density->sigma * density->sigma), 0);
}

static double grid_density(const nb_volume *volume, const double place[3])
{
    double rate[3], cells[3];
    const nebel_grid *grid = volume->density.grid;
    const nb_leaf *box = &volume->leaves[0];
    const nb_wvec3 p = to_leaf(box, place);
    const double at[3] = {(double)p.x, (double)p.y, (double)p.z};
    nb_grid_rate(grid, box->low, box->high, rate);
    for (int i = 0; i < 3; i++) cells[i] = nb_grid_margin(grid) + (at[i] - box->low[i]) * rate[i];
    return nb_grid_density(grid, cells);
}

double nb_density_within(const nb_volume *volume, const double place[3])
{
    const nebel_density *density = &volume->density;
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        return height_density(density, place[1]);
    case NEBEL_DENSITY_LINEAR:
        return linear_density(density, place);
    case NEBEL_DENSITY_RADIAL:
        return radial_density(volume, place);
    case NEBEL_DENSITY_GAUSSIAN:
        return gaussian_density(density, place);
    case NEBEL_DENSITY_SOFT_EDGE:
        return edge_density(volume, place);
    case NEBEL_DENSITY_GRID:
        return grid_density(volume, place);
    case NEBEL_DENSITY_ALTITUDE:
        return altitude_density(density, place);
    default:
        return 1;
    }
}

double nb_density_at(const nb_volume *volume, const double place[3])
{
    return nb_volume_holds(volume, place) ? nb_density_within(volume, place) : 0;
}

/* ---- bounds along a ray ---------------------------------------------------------------------- */

static void place_at(const nb_line *line, double t, double place[3])
{
    for (int i = 0; i < 3; i++)
        place[i] = line->direction[i] == 0 ? line->origin[i] : line->origin[i] + t * line->direction[i];
}

/* How far `point` lies along the line. */
static double along_line(const nb_line *line, const double point[3])
{
    double along = 0;
    for (int i = 0; i < 3; i++) along += (point[i] - line->origin[i]) * line->direction[i];
    return along;
}

/* What ends nowhere is at one of its ends in the end, or level. */
static double most_linear(const nebel_density *density, const nb_line *line, double from, double to)
{
    double rise = 0, start[3], end[3];
    for (int i = 0; i < 3; i++) rise += line->direction[i] * (density->to[i] - density->from[i]);
    if (isinf(to) && rise > 0) return 1;
    place_at(line, from, start);
    place_at(line, isinf(to) ? from : to, end);
    return fmax(linear_density(density, start), linear_density(density, end));
}

double nb_density_most(const nb_volume *volume, const nb_line *line, double from, double to)
{
    const nebel_density *density = &volume->density;
    double place[3];
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        place_at(line, line->direction[1] < 0 ? to : from, place);
        return height_density(density, place[1]);
    case NEBEL_DENSITY_LINEAR:
        return most_linear(density, line, from, to);
    case NEBEL_DENSITY_GAUSSIAN:
        place_at(line, fmin(fmax(along_line(line, density->center), from), to), place);
        return gaussian_density(density, place);
    case NEBEL_DENSITY_GRID:
        return nb_grid_peak(density->grid);
    case NEBEL_DENSITY_ALTITUDE:
        place_at(line, fmin(fmax(along_line(line, density->center), from), to), place);
        return altitude_density(density, place);
    default:
        return 1;
    }
}

double nb_density_peak(const nebel_density *density)
{
    return density->type == NEBEL_DENSITY_GRID ? nb_grid_peak(density->grid) : 1;
}

/* Under the base of fog that is capped there, and where fog that grows is at its limit, nothing changes any more. */
static double height_scale(const nebel_density *density, const nb_line *line, double from)
{
    double place[3];
    place_at(line, from, place);
    const double u = (place[1] - density->base) / density->scale_height;
    const double level = density->below == NEBEL_BELOW_GROW ? -log(NB_FAR) : 0;
    return line->direction[1] < 0 && u < level ? HUGE_VAL : density->scale_height / fabs(line->direction[1]);
}

static double linear_scale(const nebel_density *density, const nb_line *line, double from)
{
    double rise = 0, square = 0, along = 0;
    for (int i = 0; i < 3; i++) {
        const double axis = density->to[i] - density->from[i];
        rise += line->direction[i] * axis;
        along += (line->origin[i] - density->from[i]) * axis;
        square += axis * axis;
    }
    const double u = (along + from * rise) / square;
    return (rise > 0 && u > 1) || (rise < 0 && u < 0) ? HUGE_VAL : 0.25 * square / fabs(rise);
}

/* The height changes by a scale height over this length, or over the scale height divided by the slope. */
static double altitude_scale(const nebel_density *density, const nb_line *line, double from)
{
    double place[3];
    place_at(line, from, place);
    const double radius = fmax(sqrt(square_distance(place, density->center)), density->scale_height);
    const double slope = fabs(from - along_line(line, density->center)) / radius;
    return density->scale_height / fmax(slope, sqrt(density->scale_height / radius));
}

double nb_density_scale(const nb_volume *volume, const nb_line *line, double from)
{
    switch (volume->density.type) {
    case NEBEL_DENSITY_HEIGHT:
        return height_scale(&volume->density, line, from);
    case NEBEL_DENSITY_LINEAR:
        return linear_scale(&volume->density, line, from);
    case NEBEL_DENSITY_GAUSSIAN:
        return 0.5 * volume->density.sigma;
    case NEBEL_DENSITY_ALTITUDE:
        return altitude_scale(&volume->density, line, from);
    default:
        return HUGE_VAL;
    }
}
