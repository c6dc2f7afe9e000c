#include "owned_shape.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static const nebel_transform plain = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};

const char *nb_shape_title(nebel_shape_type type)
{
    static const char *const titles[NEBEL_SHAPE_COUNT] = {"world",     "half space", "box",         "sphere",
                                                          "ellipsoid", "cylinder",   "capsule",     "cone",
                                                          "convex",    "union",      "intersection"};
    return titles[type];
}

/* ---- memory
 * ----------------------------------------------------------------------------------------------------------
 */

static void *copy_array(const void *from, size_t count, size_t size)
{
    void *const copy = malloc(count > 0 ? count * size : 1);
    if (copy != NULL && count > 0) memcpy(copy, from, count * size);
    return copy;
}

void nb_shape_free(nebel_shape *shape)
{
    for (size_t i = 0; i < shape->part_count; i++) nb_shape_free((nebel_shape *)&shape->parts[i]);
    free((void *)shape->parts);
    free((void *)shape->planes);
}

int nb_shape_own(nebel_shape *shape)
{
    const nebel_shape given = *shape;
    nebel_shape *parts = NULL;
    shape->parts = NULL;
    shape->planes = NULL;
    shape->part_count = 0;
    if (given.plane_count > 0) {
        shape->planes = copy_array(given.planes, given.plane_count, sizeof *given.planes);
        if (shape->planes == NULL) return -1;
    }
    if (given.part_count == 0) return 0;
    shape->parts = parts = calloc(given.part_count, sizeof *parts);
    for (size_t i = 0; i < given.part_count && parts != NULL; i++) {
        parts[i] = given.parts[i];
        shape->part_count = i + 1;
        if (nb_shape_own(&parts[i]) != 0) return -1;
    }
    return parts != NULL ? 0 : -1;
}

size_t nb_shape_size(const nebel_shape *shape)
{
    size_t size = shape->plane_count * sizeof *shape->planes;
    for (size_t i = 0; i < shape->part_count; i++) size += sizeof *shape + nb_shape_size(&shape->parts[i]);
    return size;
}

/* ---- comparison
 * ------------------------------------------------------------------------------------------------------
 */

int nb_shape_is_same(const nebel_shape *a, const nebel_shape *b)
{
    if (a->type != b->type || a->plane_count != b->plane_count || a->part_count != b->part_count ||
        memcmp(&a->transform, &b->transform, offsetof(nebel_shape, planes) - offsetof(nebel_shape, transform)) != 0)
        return 0;
    for (size_t i = 0; i < a->plane_count; i++)
        if (memcmp(&a->planes[i], &b->planes[i], sizeof *a->planes) != 0) return 0;
    for (size_t i = 0; i < a->part_count; i++)
        if (!nb_shape_is_same(&a->parts[i], &b->parts[i])) return 0;
    return 1;
}

/* ---- pieces
 * ----------------------------------------------------------------------------------------------------------
 */

int nb_shape_add_plane(nebel_shape *shape)
{
    const size_t count = shape->plane_count;
    nebel_plane *const planes = realloc((void *)shape->planes, (count + 1) * sizeof *planes);
    if (planes == NULL) return -1;
    planes[count] = count > 0 ? planes[count - 1] : (nebel_plane){{0, 1, 0}, 1};
    for (int i = 0; i < 3 && count > 0; i++) planes[count].normal[i] = 0 - planes[count].normal[i];
    if (count > 0) planes[count].distance += 1;
    shape->planes = planes;
    shape->plane_count = count + 1;
    return 0;
}

void nb_shape_remove_plane(nebel_shape *shape, size_t index)
{
    nebel_plane *const planes = (nebel_plane *)shape->planes;
    shape->plane_count--;
    memmove(planes + index, planes + index + 1, (shape->plane_count - index) * sizeof *planes);
}

static int append_part(nebel_shape *shape, const nebel_shape *part)
{
    const size_t count = shape->part_count;
    nebel_shape own = *part;
    if (nb_shape_own(&own) == 0) {
        nebel_shape *const parts = realloc((void *)shape->parts, (count + 1) * sizeof *parts);
        if (parts != NULL) {
            parts[count] = own;
            shape->parts = parts;
            shape->part_count = count + 1;
            return 0;
        }
    }
    nb_shape_free(&own);
    return -1;
}

int nb_shape_add_part(nebel_shape *shape)
{
    const nebel_shape last = shape->parts[shape->part_count - 1];
    return append_part(shape, &last);
}

void nb_shape_remove_part(nebel_shape *shape, size_t index)
{
    nebel_shape *const parts = (nebel_shape *)shape->parts;
    nb_shape_free(&parts[index]);
    shape->part_count--;
    memmove(parts + index, parts + index + 1, (shape->part_count - index) * sizeof *parts);
}

/* ---- other types
 * -----------------------------------------------------------------------------------------------------
 */

static void fill_box(nebel_shape *shape, const double place[3], double size)
{
    for (int i = 0; i < 3; i++) {
        shape->min[i] = place[i] - size / 2;
        shape->max[i] = place[i] + size / 2;
    }
}

/* Numbers of all types, where they would not do. */
static void complete(nebel_shape *shape, const double place[3], double size)
{
    const size_t bytes = sizeof shape->from;
    if (!(shape->min[0] < shape->max[0] && shape->min[1] < shape->max[1] && shape->min[2] < shape->max[2]))
        fill_box(shape, place, size);
    if (!(shape->radius > 0)) {
        shape->radius = size / 2;
        memcpy(shape->center, place, bytes);
    }
    for (int i = 0; i < 3; i++)
        if (!(shape->radii[i] > 0)) shape->radii[i] = size / 2;
    if (!(shape->radius_from > 0 || shape->radius_to > 0)) shape->radius_from = size / 2;
    if (memcmp(shape->from, shape->to, bytes) == 0) {
        memcpy(shape->from, place, bytes);
        memcpy(shape->to, place, bytes);
        shape->to[1] += size;
    }
    if (shape->normal[0] == 0 && shape->normal[1] == 0 && shape->normal[2] == 0) {
        memcpy(shape->point, place, bytes);
        shape->normal[1] = 1;
    }
}

/* The faces of the box that the shape would be. */
static int make_planes(nebel_shape *shape)
{
    nebel_plane *const planes = calloc(6, sizeof *planes);
    if (planes == NULL) return -1;
    for (int i = 0; i < 6; i++) {
        const int axis = i / 2;
        planes[i].normal[axis] = i % 2 == 0 ? 1 : -1;
        planes[i].distance = i % 2 == 0 ? shape->max[axis] : -shape->min[axis];
    }
    shape->planes = planes;
    shape->plane_count = 6;
    return 0;
}

/* What the shape was is its first part. */
static int make_parts(nebel_shape *shape, const nebel_shape *was)
{
    nebel_shape second = *shape;
    second.type = NEBEL_SHAPE_SPHERE;
    second.transform = plain;
    shape->transform = plain;
    if (append_part(shape, was) != 0) return -1;
    if (append_part(shape, &second) == 0) return 0;
    nb_shape_remove_part(shape, 0);
    free((void *)shape->parts);
    return -1;
}

static int has_parts(nebel_shape_type type)
{
    return type == NEBEL_SHAPE_UNION || type == NEBEL_SHAPE_INTERSECTION;
}

int nb_shape_change(nebel_shape *shape, nebel_shape_type type, const double place[3], double size)
{
    nebel_shape made = *shape;
    made.type = type;
    if (has_parts(type) && has_parts(shape->type)) {
        shape->type = type;
        return 0;
    }
    made.planes = NULL;
    made.parts = NULL;
    made.plane_count = made.part_count = 0;
    complete(&made, place, size);
    if (type == NEBEL_SHAPE_CONVEX && make_planes(&made) != 0) return -1;
    if (has_parts(type) && make_parts(&made, shape) != 0) return -1;
    nb_shape_free(shape);
    *shape = made;
    return 0;
}
