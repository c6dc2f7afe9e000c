/* Fog between its key frames. */
#include "keys/keyframes.h"
#include "scene_data.h"

#include <math.h>
#include <string.h>

/* Which numbers of a volume move, and whether they have a range to keep. A box moves by its centre and its half
 * extents, which stand in for min and max, so that it never turns inside out. */
typedef struct nb_track_state {
    size_t offset, count;
    bool limited;
} nb_track_state;

#define MOVING(member, count, limited)                                                                                 \
    {                                                                                                                  \
        offsetof(nebel_volume_desc, member), count, limited                                                            \
    }

static const nb_track_state numbers[] = {
    MOVING(shape.transform.position, 3, false),
    MOVING(shape.transform.rotation, 4, false),
    MOVING(shape.transform.scale, 3, true),
    MOVING(shape.min, 3, false),
    MOVING(shape.max, 3, true),
    MOVING(shape.center, 3, false),
    MOVING(shape.radius, 1, true),
    MOVING(shape.radii, 3, true),
    MOVING(shape.from, 3, false),
    MOVING(shape.to, 3, false),
    MOVING(shape.radius_from, 1, true),
    MOVING(shape.radius_to, 1, true),
    MOVING(shape.point, 3, false),
    MOVING(shape.normal, 3, false),
    MOVING(density.base, 1, false),
    MOVING(density.scale_height, 1, true),
    MOVING(density.from, 3, false),
    MOVING(density.to, 3, false),
    MOVING(density.center, 3, false),
    MOVING(density.sigma, 1, true),
    MOVING(density.edge_width, 1, true),
    MOVING(density.radius, 1, true),
    MOVING(extinction, 3, true),
    MOVING(source, 3, true),
    MOVING(albedo, 3, true),
    MOVING(emission, 3, true),
};

static void pack_shape(nebel_shape *shape)
{
    nb_vector_normalize(shape->normal, 3);
    for (int i = 0; i < 3; i++) {
        const double min = shape->min[i], max = shape->max[i];
        shape->min[i] = min / 2 + max / 2;
        shape->max[i] = max / 2 - min / 2;
    }
}

static void unpack_shape(nebel_shape *shape)
{
    for (int i = 0; i < 3; i++) {
        const double middle = shape->min[i], half = shape->max[i];
        shape->min[i] = middle - half;
        shape->max[i] = middle + half;
    }
    if (shape->radius_from < NEBEL_MIN_LENGTH) shape->radius_from = 0;
    if (shape->radius_to < NEBEL_MIN_LENGTH) shape->radius_to = 0;
}

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += a[i] * b[i];
    return sum;
}

/* A quaternion and its negative are one rotation; of the two, the one nearer to the key's neighbour is the shorter way.
 */
static void align(const double neighbour[4], double rotation[4])
{
    if (dot(neighbour, rotation, 4) >= 0) return;
    for (int i = 0; i < 4; i++) rotation[i] = -rotation[i];
}

/* False where a place is too far away. */
static bool move_numbers(const nb_keyframes *around, const nebel_volume_desc at[4], nebel_volume_desc *volume)
{
    bool near = true;
    for (size_t n = 0; n < sizeof numbers / sizeof *numbers; n++)
        for (size_t i = 0; i < numbers[n].count; i++) {
            const size_t offset = numbers[n].offset + i * sizeof(double);
            double values[4], value;
            for (int k = 0; k < 4; k++) memcpy(&values[k], (const char *)&at[k] + offset, sizeof *values);
            value = nb_keyframes_between(around, numbers[n].limited, values);
            memcpy((char *)volume + offset, &value, sizeof value);
            near = near && (numbers[n].limited || fabs(value) <= NEBEL_MAX_LENGTH);
        }
    return near;
}

/* ---- where a cubic passes through nothing ---------------------------------------------------- */

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
}

/* Between keys that point in opposite directions a cubic of unit vectors may lose its direction: there the nearer key's
 * holds. */
static void mend_direction(const double *nearer, size_t count, double *direction)
{
    if (dot(direction, direction, count) < 1e-12) memcpy(direction, nearer, count * sizeof *direction);
}

/* The same for two places that must lie apart. */
static void mend_ends(const double from_nearer[3], const double to_nearer[3], const double from[3], double to[3])
{
    if (distance(from, to) > 1e-6 * distance(from_nearer, to_nearer)) return;
    for (int i = 0; i < 3; i++) to[i] = from[i] + (to_nearer[i] - from_nearer[i]);
}

/* False where rounding left nothing of a very small shape, or a base has come near its center. */
static bool is_sound(const nebel_volume_desc *volume)
{
    const nebel_shape *shape = &volume->shape;
    const nebel_density *density = &volume->density;
    const bool is_box = shape->type == NEBEL_SHAPE_BOX;
    const bool is_capsule = shape->type == NEBEL_SHAPE_CAPSULE;
    const bool has_axis = is_capsule || shape->type == NEBEL_SHAPE_CYLINDER || shape->type == NEBEL_SHAPE_CONE;
    const double axis = distance(shape->from, shape->to);
    for (int i = 0; i < 3; i++)
        if (is_box && !(shape->min[i] < shape->max[i])) return false;
    if (has_axis && axis < NEBEL_MIN_LENGTH && !(is_capsule && axis == 0)) return false;
    if (density->type == NEBEL_DENSITY_ALTITUDE)
        return density->radius + density->base >= NEBEL_MIN_ALTITUDE_RATIO * density->scale_height;
    return density->type != NEBEL_DENSITY_LINEAR || distance(density->from, density->to) >= NEBEL_MIN_LENGTH;
}

static void mend_volume(const nebel_volume_desc *nearer, nebel_volume_desc *volume)
{
    const nebel_shape *shape = &nearer->shape;
    const nebel_density *density = &nearer->density;
    mend_direction(shape->transform.rotation, 4, volume->shape.transform.rotation);
    mend_direction(shape->normal, 3, volume->shape.normal);
    mend_ends(shape->from, shape->to, volume->shape.from, volume->shape.to);
    mend_ends(density->from, density->to, volume->density.from, volume->density.to);
}

/* ---- a volume at a frame --------------------------------------------------------------------- */

static nebel_volume_desc volume_between(const nebel_volume_key *keys, const nb_keyframes *around)
{
    const nebel_volume_desc *nearer = &keys[nb_keyframes_nearer(around)].volume;
    nebel_volume_desc at[4], volume;
    for (int k = 0; k < 4; k++) {
        at[k] = keys[around->keys[k]].volume;
        pack_shape(&at[k].shape);
        nb_vector_normalize(at[k].shape.transform.rotation, 4);
    }
    align(at[1].shape.transform.rotation, at[0].shape.transform.rotation);
    align(at[1].shape.transform.rotation, at[2].shape.transform.rotation);
    align(at[2].shape.transform.rotation, at[3].shape.transform.rotation);
    volume = at[1];
    if (!move_numbers(around, at, &volume)) return *nearer;
    unpack_shape(&volume.shape);
    mend_volume(nearer, &volume);
    return is_sound(&volume) ? volume : *nearer;
}

nebel_volume_desc nebel_interpolate_volume(const nebel_volume_key *keys, size_t count, double frame)
{
    if (keys == NULL || count == 0) return (nebel_volume_desc){.priority = 0};
    nb_keyframes around;
    if (!nb_keyframes_find(&keys->frame, sizeof *keys, count, frame, &around)) return keys[around.keys[1]].volume;
    return volume_between(keys, &around);
}

nebel_volume_desc nebel_get_scene_volume(const nebel_scene *scene, size_t index, double frame)
{
    if (scene == NULL || index >= scene->data.volume_count) return (nebel_volume_desc){.priority = 0};
    const nebel_volume_track *entry = &scene->volume_entries[index];
    return entry->key_count > 0 ? nebel_interpolate_volume(entry->keys, entry->key_count, frame)
                                : scene->volumes[index];
}
