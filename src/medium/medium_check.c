#include "medium_check.h"

#include "phase.h"
#include "volume.h"

#include <math.h>

static int is_zero(const double *v, int n)
{
    for (int i = 0; i < n; i++)
        if (v[i] != 0) return 0;
    return 1;
}

static int is_place(const double v[3])
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(v[i]) <= NEBEL_MAX_LENGTH)) return 0;
    return 1;
}

static int is_extent(double x)
{
    return x >= NEBEL_MIN_LENGTH && x <= NEBEL_MAX_LENGTH;
}

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static nebel_result bad(const nebel_log *log, const char *what, const char *rule)
{
    return nb_fail(log, NEBEL_ERROR_VALUE, "%s: %s", what, rule);
}

#define LEAST NB_TEXT(NEBEL_MIN_LENGTH)
#define MOST NB_TEXT(NEBEL_MAX_LENGTH)
#define PLACE_RULE "must be three finite numbers, at most " MOST " m from the origin"
#define EXTENT_RULE "must be a length from " LEAST " to " MOST " m"
#define APART_RULE "must be apart, " LEAST " to " MOST " m"
#define DIRECTION_LENGTHS NB_TEXT(NEBEL_MIN_DIRECTION) " to " NB_TEXT(NEBEL_MAX_DIRECTION)
#define DIRECTION_RULE "must be three finite numbers, not all zero, of a length from " DIRECTION_LENGTHS

static int is_direction(double length)
{
    return length >= NEBEL_MIN_DIRECTION && length <= NEBEL_MAX_DIRECTION;
}

static double length_of(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

nebel_result nb_check_color(const nebel_log *log, const char *what, const double color[3], double largest)
{
    for (int i = 0; i < 3; i++)
        if (!(color[i] >= 0 && color[i] <= largest))
            return nb_fail(log, NEBEL_ERROR_VALUE, "%s: every channel must be within 0 and %g; it is %g", what, largest,
                           color[i]);
    return NEBEL_OK;
}

static nebel_result check_transform(const nebel_log *log, const nebel_transform *transform)
{
    if (!is_place(transform->position)) return bad(log, "transform position", PLACE_RULE);
    if (!is_zero(transform->rotation, 4)) {
        const double length = hypot(hypot(transform->rotation[0], transform->rotation[1]),
                                    hypot(transform->rotation[2], transform->rotation[3]));
        if (!is_direction(length))
            return bad(log, "transform rotation",
                       "must be a finite quaternion x y z w, not zero, of a length from " DIRECTION_LENGTHS);
    }
    if (!is_zero(transform->scale, 3))
        for (int i = 0; i < 3; i++)
            if (!(fabs(transform->scale[i]) >= NEBEL_MIN_SCALE && fabs(transform->scale[i]) <= NEBEL_MAX_SCALE))
                return bad(log, "transform scale",
                           "is singular; each factor must be within " NB_TEXT(NEBEL_MIN_SCALE) " and " NB_TEXT(
                               NEBEL_MAX_SCALE) " in size");
    return NEBEL_OK;
}

static nebel_result check_box(const nebel_log *log, const nebel_shape *shape)
{
    if (!is_place(shape->min) || !is_place(shape->max)) return bad(log, "box min and max", PLACE_RULE);
    for (int i = 0; i < 3; i++)
        if (!(shape->min[i] < shape->max[i])) return bad(log, "box", "min must be less than max on every axis");
    return NEBEL_OK;
}

static nebel_result check_round(const nebel_log *log, const nebel_shape *shape)
{
    if (!is_place(shape->center)) return bad(log, "center", PLACE_RULE);
    if (shape->type == NEBEL_SHAPE_SPHERE)
        return is_extent(shape->radius) ? NEBEL_OK : bad(log, "sphere radius", EXTENT_RULE);
    for (int i = 0; i < 3; i++)
        if (!is_extent(shape->radii[i])) return bad(log, "ellipsoid radii", EXTENT_RULE);
    return NEBEL_OK;
}

static nebel_result check_shape_axis(const nebel_log *log, const nebel_shape *shape)
{
    if (!is_place(shape->from) || !is_place(shape->to)) return bad(log, "from and to", PLACE_RULE);
    const double length = distance(shape->from, shape->to);
    if (shape->type == NEBEL_SHAPE_CAPSULE) {
        if (!is_extent(shape->radius)) return bad(log, "capsule radius", EXTENT_RULE);
        return length == 0 || is_extent(length) ? NEBEL_OK : bad(log, "capsule axis", EXTENT_RULE);
    }
    if (!is_extent(length)) return bad(log, "from and to", APART_RULE);
    if (shape->type == NEBEL_SHAPE_CYLINDER)
        return is_extent(shape->radius) ? NEBEL_OK : bad(log, "cylinder radius", EXTENT_RULE);
    const double radii[2] = {shape->radius_from, shape->radius_to};
    for (int i = 0; i < 2; i++)
        if (!(radii[i] == 0 || is_extent(radii[i]))) return bad(log, "cone radii", "must be 0 or " EXTENT_RULE);
    return radii[0] + radii[1] > 0 ? NEBEL_OK : bad(log, "cone radii", "must not both be 0");
}

static nebel_result check_convex(const nebel_log *log, const nebel_shape *shape)
{
    if (shape->planes == NULL || shape->plane_count == 0)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "convex: needs at least one plane");
    if (shape->plane_count > NEBEL_MAX_SHAPE_PLANES)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "convex: %zu planes; at most %d", shape->plane_count,
                       NEBEL_MAX_SHAPE_PLANES);
    for (size_t i = 0; i < shape->plane_count; i++) {
        const nebel_plane *plane = &shape->planes[i];
        const double length = length_of(plane->normal);
        if (!is_direction(length)) return bad(log, "convex plane normal", DIRECTION_RULE);
        if (!(fabs(plane->distance) <= NEBEL_MAX_LENGTH * length))
            return bad(log, "convex plane distance", "must be finite and at most " MOST " m");
    }
    return NEBEL_OK;
}

static nebel_result check_shape(const nebel_log *log, const nebel_shape *shape, int depth, size_t *leaves);

static nebel_result check_parts(const nebel_log *log, const nebel_shape *shape, int depth, size_t *leaves)
{
    if (shape->parts == NULL || shape->part_count == 0)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "union or intersection: needs at least one part");
    for (size_t i = 0; i < shape->part_count; i++) {
        const nebel_result result = check_shape(log, &shape->parts[i], depth + 1, leaves);
        if (result != NEBEL_OK) return result;
    }
    return NEBEL_OK;
}

static nebel_result check_shape(const nebel_log *log, const nebel_shape *shape, int depth, size_t *leaves)
{
    if (depth > NEBEL_MAX_SHAPE_NESTING)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "shape: parts are nested more than %d deep", NEBEL_MAX_SHAPE_NESTING);
    const nebel_result result = check_transform(log, &shape->transform);
    if (result != NEBEL_OK) return result;
    if (shape->type == NEBEL_SHAPE_UNION || shape->type == NEBEL_SHAPE_INTERSECTION)
        return check_parts(log, shape, depth, leaves);
    if (++*leaves > NEBEL_MAX_SHAPE_LEAVES)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "shape: more than %d parts", NEBEL_MAX_SHAPE_LEAVES);
    switch (shape->type) {
    case NEBEL_SHAPE_WORLD:
        return NEBEL_OK;
    case NEBEL_SHAPE_HALF_SPACE:
        if (!is_place(shape->point)) return bad(log, "half space point", PLACE_RULE);
        return is_direction(length_of(shape->normal)) ? NEBEL_OK : bad(log, "half space normal", DIRECTION_RULE);
    case NEBEL_SHAPE_BOX:
        return check_box(log, shape);
    case NEBEL_SHAPE_SPHERE:
    case NEBEL_SHAPE_ELLIPSOID:
        return check_round(log, shape);
    case NEBEL_SHAPE_CYLINDER:
    case NEBEL_SHAPE_CAPSULE:
    case NEBEL_SHAPE_CONE:
        return check_shape_axis(log, shape);
    case NEBEL_SHAPE_CONVEX:
        return check_convex(log, shape);
    default:
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "shape: type %d is unknown", (int)shape->type);
    }
}

/* Where fog thins out with y, or with the distance from a centre. */
static nebel_result check_height(const nebel_log *log, const nebel_density *density)
{
    if (!(fabs(density->base) <= NEBEL_MAX_LENGTH))
        return bad(log, "height base", "must be finite, at most " MOST " m");
    if (density->below != NEBEL_BELOW_GROW && density->below != NEBEL_BELOW_CONSTANT)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "height below: %d is unknown", (int)density->below);
    return is_extent(density->scale_height) ? NEBEL_OK : bad(log, "scale height", EXTENT_RULE);
}

static nebel_result check_altitude(const nebel_log *log, const nebel_density *density)
{
    if (!is_place(density->center)) return bad(log, "altitude center", PLACE_RULE);
    if (!is_extent(density->radius)) return bad(log, "altitude radius", EXTENT_RULE);
    const nebel_result result = check_height(log, density);
    if (result != NEBEL_OK) return result;
    if (!(density->radius + density->base >= NEBEL_MIN_ALTITUDE_RATIO * density->scale_height))
        return bad(log, "altitude base",
                   "must be at least " NB_TEXT(NEBEL_MIN_ALTITUDE_RATIO) " scale heights from the center");
    return NEBEL_OK;
}

static nebel_result check_density(const nebel_log *log, const nebel_density *density, const nebel_shape *shape)
{
    switch (density->type) {
    case NEBEL_DENSITY_CONSTANT:
        return NEBEL_OK;
    case NEBEL_DENSITY_HEIGHT:
        return check_height(log, density);
    case NEBEL_DENSITY_ALTITUDE:
        return check_altitude(log, density);
    case NEBEL_DENSITY_LINEAR:
        if (!is_place(density->from) || !is_place(density->to)) return bad(log, "linear from and to", PLACE_RULE);
        return is_extent(distance(density->from, density->to)) ? NEBEL_OK : bad(log, "linear from and to", APART_RULE);
    case NEBEL_DENSITY_RADIAL:
        if (shape->type != NEBEL_SHAPE_SPHERE && shape->type != NEBEL_SHAPE_ELLIPSOID)
            return bad(log, "radial density", "needs a sphere or an ellipsoid");
        return density->power >= 1 && density->power <= 3 ? NEBEL_OK : bad(log, "radial power", "must be 1, 2 or 3");
    case NEBEL_DENSITY_GAUSSIAN:
        if (!is_place(density->center)) return bad(log, "gaussian center", PLACE_RULE);
        return is_extent(density->sigma) ? NEBEL_OK : bad(log, "gaussian sigma", EXTENT_RULE);
    case NEBEL_DENSITY_SOFT_EDGE:
        if (shape->type == NEBEL_SHAPE_WORLD || shape->type == NEBEL_SHAPE_UNION ||
            shape->type == NEBEL_SHAPE_INTERSECTION)
            return bad(log, "soft edge", "needs a shape with a surface that is no union or intersection");
        return is_extent(density->edge_width) ? NEBEL_OK : bad(log, "soft edge distance", EXTENT_RULE);
    case NEBEL_DENSITY_GRID:
        if (density->grid == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "grid density: grid must not be NULL");
        return shape->type == NEBEL_SHAPE_BOX ? NEBEL_OK : bad(log, "grid density", "needs a box");
    default:
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "density: type %d is unknown", (int)density->type);
    }
}

static nebel_result check_light(const nebel_log *log, const nebel_volume_desc *desc)
{
    const char *fault = nb_phase_fault(&desc->phase);
    if (fault != NULL) return nb_fail(log, NEBEL_ERROR_VALUE, "%s", fault);
    nebel_result result = nb_check_color(log, "extinction", desc->extinction, NEBEL_MAX_AMOUNT);
    if (result == NEBEL_OK) result = nb_check_color(log, "source", desc->source, NEBEL_MAX_AMOUNT);
    if (result == NEBEL_OK) result = nb_check_color(log, "albedo", desc->albedo, 1);
    if (result == NEBEL_OK) result = nb_check_color(log, "emission", desc->emission, NEBEL_MAX_AMOUNT);
    if (result == NEBEL_OK && !is_zero(desc->source, 3) && !is_zero(desc->albedo, 3))
        return bad(log, "source and albedo", "a volume has one or the other");
    return result;
}

static nebel_result check_distances(const nebel_log *log, const nebel_volume_desc *desc)
{
    if (!(desc->start >= 0 && desc->start <= NEBEL_MAX_LENGTH))
        return bad(log, "start", "must be a distance from 0 to " MOST " m");
    if (!(desc->cutoff == 0 || (desc->cutoff > desc->start && desc->cutoff <= NEBEL_MAX_LENGTH)))
        return bad(log, "cutoff", "must be 0, for none, or more than start and at most " MOST " m");
    return NEBEL_OK;
}

nebel_result nb_check_volume(const nebel_log *log, const nebel_volume_desc *desc)
{
    size_t leaves = 0;
    nebel_result result = check_shape(log, &desc->shape, 0, &leaves);
    if (result == NEBEL_OK) result = check_distances(log, desc);
    if (result != NEBEL_OK) return result;
    if (desc->operation == NEBEL_OPERATION_EXCLUDE) return NEBEL_OK;
    if (desc->operation != NEBEL_OPERATION_ADD && desc->operation != NEBEL_OPERATION_REPLACE)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "operation: %d is unknown", (int)desc->operation);
    const nebel_result density = check_density(log, &desc->density, &desc->shape);
    return density != NEBEL_OK ? density : check_light(log, desc);
}
