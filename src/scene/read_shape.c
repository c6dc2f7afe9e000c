/* Shapes of fog, and their transforms. */
#include "scene_data.h"

#include <math.h>
#include <string.h>

enum {
    SHAPE_TYPE,
    SHAPE_TRANSFORM,
    SHAPE_MIN,
    SHAPE_MAX,
    SHAPE_CENTER,
    SHAPE_RADIUS,
    SHAPE_RADII,
    SHAPE_FROM,
    SHAPE_TO,
    SHAPE_RADIUS_FROM,
    SHAPE_RADIUS_TO,
    SHAPE_POINT,
    SHAPE_NORMAL,
    SHAPE_PLANES,
    SHAPE_SHAPES,
    SHAPE_KEY_COUNT
};

static const char *const shape_key_names[] = {"type",      "transform", "min",    "max",    "center",
                                              "radius",    "radii",     "from",   "to",     "radius_from",
                                              "radius_to", "point",     "normal", "planes", "shapes"};

static const char *const shape_type_names[] = {"world",   "half_space", "box",    "sphere", "ellipsoid",   "cylinder",
                                               "capsule", "cone",       "convex", "union",  "intersection"};

/* In the order of nebel_shape_type. Only "transform" and "type" are not required. */
#define SHAPE_KEYS(required, owner)                                                                                    \
    {                                                                                                                  \
        shape_key_names, SHAPE_KEY_COUNT, (required) | NB_BIT(SHAPE_TYPE) | NB_BIT(SHAPE_TRANSFORM), (required), owner \
    }

static const nb_key_set shape_keys[NEBEL_SHAPE_COUNT] = {
    SHAPE_KEYS(0, "a shape \"world\""),
    SHAPE_KEYS(NB_BIT(SHAPE_POINT) | NB_BIT(SHAPE_NORMAL), "a half space"),
    SHAPE_KEYS(NB_BIT(SHAPE_MIN) | NB_BIT(SHAPE_MAX), "a box"),
    SHAPE_KEYS(NB_BIT(SHAPE_CENTER) | NB_BIT(SHAPE_RADIUS), "a sphere"),
    SHAPE_KEYS(NB_BIT(SHAPE_CENTER) | NB_BIT(SHAPE_RADII), "an ellipsoid"),
    SHAPE_KEYS(NB_BIT(SHAPE_FROM) | NB_BIT(SHAPE_TO) | NB_BIT(SHAPE_RADIUS), "a cylinder"),
    SHAPE_KEYS(NB_BIT(SHAPE_FROM) | NB_BIT(SHAPE_TO) | NB_BIT(SHAPE_RADIUS), "a capsule"),
    SHAPE_KEYS(NB_BIT(SHAPE_FROM) | NB_BIT(SHAPE_TO) | NB_BIT(SHAPE_RADIUS_FROM) | NB_BIT(SHAPE_RADIUS_TO), "a cone"),
    SHAPE_KEYS(NB_BIT(SHAPE_PLANES), "a convex body"),
    SHAPE_KEYS(NB_BIT(SHAPE_SHAPES), "a union"),
    SHAPE_KEYS(NB_BIT(SHAPE_SHAPES), "an intersection"),
};

static const nebel_transform no_transform = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};

static bool read_shape_transform(nb_json *json, const nb_json_node *node, nebel_transform *transform)
{
    enum { POSITION, ROTATION, SCALE, COUNT };
    static const char *const names[] = {"position", "rotation", "scale"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a transform"};
    const nb_json_node *found[COUNT];
    if (node == NULL) return true;
    return nb_key_value_members(json, node, &keys, found) &&
           nb_key_value_place(json, found[POSITION], transform->position) &&
           nb_key_value_quaternion(json, found[ROTATION], transform->rotation) &&
           nb_key_value_scale(json, found[SCALE], transform->scale);
}

/* The two ends of something, in the file's numbers, as far apart as the core wants them. `end` is one of them. */
bool nb_keys_read_check_apart(nb_json *json, const nb_json_node *end, const char *other, const double from[3],
                              const double to[3])
{
    double away[3];
    char wanted[NB_RANGE_TEXT];
    for (int i = 0; i < 3; i++) away[i] = to[i] * json->unit - from[i] * json->unit;
    const double distance = hypot(hypot(away[0], away[1]), away[2]);
    if (nb_range_holds(&nb_range_extent, 1, distance)) return true;
    if (distance == 0)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, end, "is the same place as \"%s\"; the two must lie apart",
                            other);
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, end, "lies %.15g m from \"%s\"; between them must be %s", distance,
                        other, nb_range_describe(&nb_range_extent, 1, wanted));
}

/* `min` or `max`, of which a key may have one alone. */
static bool check_box(nb_json *json, const nb_json_node *min, const nb_json_node *max, const nebel_shape *shape)
{
    const bool at_max = max != NULL;
    const nb_json_node *element = nb_json_first(json, at_max ? max : min);
    for (int i = 0; i < 3; i++, element = nb_json_next(json, element))
        if (shape->min[i] * json->unit >= shape->max[i] * json->unit)
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, element, "is %.15g; must be %s[%d], which is %.15g",
                                at_max ? shape->max[i] : shape->min[i], at_max ? "greater than min" : "less than max",
                                i, at_max ? shape->min[i] : shape->max[i]);
    return true;
}

static bool check_axis(nb_json *json, const nb_json_node *end, const nebel_shape *shape)
{
    const bool is_ball = memcmp(shape->from, shape->to, sizeof shape->to) == 0 && shape->type == NEBEL_SHAPE_CAPSULE;
    return is_ball ||
           nb_keys_read_check_apart(json, end, nb_json_has_key(end, "to") ? "from" : "to", shape->from, shape->to);
}

static bool check_cone(nb_json *json, const nb_json_node *radius, const nebel_shape *shape)
{
    if (shape->radius_from > 0 || shape->radius_to > 0) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, radius, "both radii are 0; one must be > 0");
}

static bool read_plane(nb_json *json, const nb_json_node *node, nebel_plane *plane)
{
    double n[4];
    if (!nb_key_value_numbers(json, node, &nb_range_any, 4, n)) return false;
    if (n[0] == 0 && n[1] == 0 && n[2] == 0)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "has the normal 0; one of nx, ny, nz must not be 0");
    if (!nb_key_value_check_direction(json, node, n)) return false;
    *plane = (nebel_plane){{n[0], n[1], n[2]}, n[3]};
    const double away = fabs(n[3] * json->unit), length = hypot(hypot(n[0], n[1]), n[2]);
    if (away <= NEBEL_MAX_LENGTH * length) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                        "lies %.15g m from the origin, the length of its normal counted; must be at most %s m",
                        away / length, NB_TEXT(NEBEL_MAX_LENGTH));
}

/* In metres, as the core will have them. */
static bool try_planes(nb_scene_reader *in, const nb_json_node *node, const nebel_shape *shape)
{
    nebel_plane planes[NEBEL_MAX_SHAPE_PLANES];
    nebel_volume_desc body = {.operation = NEBEL_OPERATION_EXCLUDE, .shape = *shape};
    for (size_t i = 0; i < shape->plane_count; i++) {
        planes[i] = shape->planes[i];
        planes[i].distance *= in->space.unit;
    }
    body.shape.planes = planes;
    body.shape.transform = no_transform;
    return nb_keys_read_try(in, node, "convex: ", &body);
}

static bool read_shape_planes(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape)
{
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of planes [nx, ny, nz, d]")) return false;
    if (node->count < 1 || node->count > NEBEL_MAX_SHAPE_PLANES)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds %lu planes; must hold 1 to %d",
                            (unsigned long)node->count, NEBEL_MAX_SHAPE_PLANES);
    nebel_plane *planes = nb_arena_allocate(&in->scene->arena, node->count, sizeof *planes);
    if (planes == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at), i++) {
        if (!read_plane(json, at, &planes[i])) return false;
    }
    shape->planes = planes;
    shape->plane_count = node->count;
    return try_planes(in, node, shape);
}

/* Where a shape is in its volume: so many groups around it, so many leaves before it. */
typedef struct nesting {
    int depth;
    size_t leaf_count;
} nesting;

static bool read_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape, nesting *where);

static bool read_parts(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape, nesting *where)
{
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of shapes")) return false;
    if (node->count < 1 || node->count > NEBEL_MAX_SHAPE_LEAVES)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds %lu shapes; must hold 1 to %d",
                            (unsigned long)node->count, NEBEL_MAX_SHAPE_LEAVES);
    nebel_shape *parts = nb_arena_allocate(&in->scene->arena, node->count, sizeof *parts);
    if (parts == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    where->depth++;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at), i++)
        if (!read_shape(in, at, &parts[i], where)) return false;
    where->depth--;
    shape->parts = parts;
    shape->part_count = node->count;
    return true;
}

static bool check_nesting(nb_json *json, const nb_json_node *node, const nesting *where)
{
    if (where->depth > NEBEL_MAX_SHAPE_NESTING)
        return nb_json_fail(json, NEBEL_ERROR_LIMIT, node, "is nested too deeply; at most %d shapes may be around it",
                            NEBEL_MAX_SHAPE_NESTING);
    if (where->leaf_count <= NEBEL_MAX_SHAPE_LEAVES) return true;
    return nb_json_fail(json, NEBEL_ERROR_LIMIT, node, "one volume is made of too many shapes; at most %d",
                        NEBEL_MAX_SHAPE_LEAVES);
}

static bool read_shape_members(nb_json *json, const nb_json_node *const *found, nebel_shape *shape)
{
    return read_shape_transform(json, found[SHAPE_TRANSFORM], &shape->transform) &&
           nb_key_value_place(json, found[SHAPE_MIN], shape->min) &&
           nb_key_value_place(json, found[SHAPE_MAX], shape->max) &&
           nb_key_value_place(json, found[SHAPE_CENTER], shape->center) &&
           nb_key_value_number(json, found[SHAPE_RADIUS], &nb_range_extent, &shape->radius) &&
           nb_key_value_numbers(json, found[SHAPE_RADII], &nb_range_extent, 3, shape->radii) &&
           nb_key_value_place(json, found[SHAPE_FROM], shape->from) &&
           nb_key_value_place(json, found[SHAPE_TO], shape->to) &&
           nb_key_value_number(json, found[SHAPE_RADIUS_FROM], &nb_range_end, &shape->radius_from) &&
           nb_key_value_number(json, found[SHAPE_RADIUS_TO], &nb_range_end, &shape->radius_to) &&
           nb_key_value_place(json, found[SHAPE_POINT], shape->point) &&
           nb_key_value_direction(json, found[SHAPE_NORMAL], shape->normal);
}

/* What one number has to do with another. */
static bool check_members(nb_json *json, const nb_json_node *const *found, const nebel_shape *shape)
{
    const nb_json_node *box = found[SHAPE_MAX] != NULL ? found[SHAPE_MAX] : found[SHAPE_MIN];
    const nb_json_node *axis = found[SHAPE_TO] != NULL ? found[SHAPE_TO] : found[SHAPE_FROM];
    const nb_json_node *cone = found[SHAPE_RADIUS_TO] != NULL ? found[SHAPE_RADIUS_TO] : found[SHAPE_RADIUS_FROM];
    return (box == NULL || check_box(json, found[SHAPE_MIN], found[SHAPE_MAX], shape)) &&
           (axis == NULL || check_axis(json, axis, shape)) && (cone == NULL || check_cone(json, cone, shape));
}

static bool read_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape, nesting *where)
{
    const nb_json_node *found[SHAPE_KEY_COUNT];
    nb_json *json = in->json;
    const int type = nb_key_value_type(json, node, shape_type_names, NEBEL_SHAPE_COUNT);
    if (type < 0 || !nb_key_value_members(json, node, &shape_keys[type], found)) return false;
    *shape = (nebel_shape){.type = (nebel_shape_type)type, .transform = no_transform};
    if (!read_shape_members(json, found, shape)) return false;
    where->leaf_count += found[SHAPE_SHAPES] == NULL;
    if (!check_nesting(json, node, where)) return false;
    if (found[SHAPE_SHAPES] != NULL) return read_parts(in, found[SHAPE_SHAPES], shape, where);
    return check_members(json, found, shape) &&
           (found[SHAPE_PLANES] == NULL || read_shape_planes(in, found[SHAPE_PLANES], shape));
}

bool nb_keys_read_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape)
{
    nesting where = {0, 0};
    return read_shape(in, node, shape, &where);
}

bool nb_keys_read_shape_key(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape)
{
    const nb_json_node *found[SHAPE_KEY_COUNT];
    nb_key_set keys = shape_keys[shape->type];
    keys.allowed &= ~(NB_BIT(SHAPE_TYPE) | NB_BIT(SHAPE_PLANES) | NB_BIT(SHAPE_SHAPES));
    keys.required = 0;
    return node == NULL || (nb_key_value_members(in->json, node, &keys, found) &&
                            read_shape_members(in->json, found, shape) && check_members(in->json, found, shape));
}
