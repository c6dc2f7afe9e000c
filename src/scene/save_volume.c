/* Whole volumes as JSON, for those that the file has not, or has as something else. */
#include "scene/save.h"
#include "scene/save_places.h"

#include <stdio.h>
#include <string.h>

/* Text that grows. Once memory is out nothing more is added. */
typedef struct writer {
    const nebel_allocator *allocator;
    const nb_space *space;
    nb_bytes text;
    bool good, is_first; /* whether a comma is due before the next member */
} writer;

static void put(writer *out, const char *words)
{
    out->good = out->good && nb_bytes_write(out->allocator, &out->text, out->text.size, words, strlen(words));
}

static void put_key(writer *out, const char *key)
{
    put(out, out->is_first ? " \"" : ", \"");
    put(out, key);
    put(out, "\": ");
    out->is_first = false;
}

static void put_text(writer *out, const char *key, const char *text)
{
    put_key(out, key);
    out->good = out->good && nb_edit_write_text(out->allocator, &out->text, text);
}

static void put_numbers(writer *out, size_t count, const double *numbers, nb_edit_style style)
{
    char text[NB_EDIT_NUMBERS];
    nb_edit_write_numbers(count, numbers, style, text);
    put(out, text);
}

static void open_object(writer *out, const char *key)
{
    put_key(out, key);
    put(out, "{");
    out->is_first = true;
}

static void close_object(writer *out)
{
    put(out, out->is_first ? "}" : " }");
    out->is_first = false;
}

/* Numbers of the type, and of those only what is not the default, where there is one. */
static void put_places(writer *out, const nb_place *places, unsigned mask, const void *structure, const void *defaults)
{
    for (size_t i = 0; places[i].key != NULL; i++) {
        if ((mask >> i & 1) == 0) continue;
        if (defaults != NULL && !nb_place_differs(defaults, structure, &places[i])) continue;
        put_key(out, places[i].key);
        put_numbers(out, places[i].count, nb_place_numbers(structure, &places[i]), places[i].style);
    }
}

static void put_shape(writer *out, const nebel_shape *shape);

static void put_planes(writer *out, const nebel_shape *shape)
{
    put_key(out, "planes");
    for (size_t i = 0; i < shape->plane_count; i++) {
        nebel_plane plane = shape->planes[i];
        nb_space_restore_plane(out->space, &plane);
        const double numbers[4] = {plane.normal[0], plane.normal[1], plane.normal[2], plane.distance};
        put(out, i == 0 ? "[" : ", ");
        put_numbers(out, 4, numbers, NB_EDIT_WHOLE);
    }
    put(out, "]");
}

static void put_parts(writer *out, const nebel_shape *shape)
{
    put_key(out, "shapes");
    for (size_t i = 0; i < shape->part_count; i++) {
        put(out, i == 0 ? "[" : ", ");
        put_shape(out, &shape->parts[i]);
    }
    put(out, "]");
    out->is_first = false;
}

/* Where all are zero, that means none. */
static void complete_transform(nebel_transform *transform)
{
    static const nebel_transform zero;
    if (memcmp(transform->rotation, zero.rotation, sizeof zero.rotation) == 0) transform->rotation[3] = 1;
    if (memcmp(transform->scale, zero.scale, sizeof zero.scale) != 0) return;
    for (int i = 0; i < 3; i++) transform->scale[i] = 1;
}

static bool is_plain(const nebel_transform *transform)
{
    for (size_t i = 0; nb_transform_places[i].key != NULL; i++)
        if (nb_place_differs(&nb_plain_transform, transform, &nb_transform_places[i])) return false;
    return true;
}

/* The shape's numbers are in metres still. */
static void put_shape(writer *out, const nebel_shape *shape)
{
    nebel_shape own = *shape;
    nb_space_restore_shape(out->space, &own);
    complete_transform(&own.transform);
    put(out, "{");
    out->is_first = true;
    put_text(out, "type", nb_shape_names[own.type]);
    put_places(out, nb_shape_places, nb_shape_masks[own.type], &own, NULL);
    if (own.type == NEBEL_SHAPE_CONVEX) put_planes(out, shape);
    if (own.type == NEBEL_SHAPE_UNION || own.type == NEBEL_SHAPE_INTERSECTION) put_parts(out, shape);
    if (!is_plain(&own.transform)) {
        open_object(out, "transform");
        put_places(out, nb_transform_places, NB_ALL_PLACES, &own.transform, &nb_plain_transform);
        close_object(out);
    }
    close_object(out);
}

static void put_density(writer *out, const nebel_density *density)
{
    if (density->type == NEBEL_DENSITY_CONSTANT) return;
    open_object(out, "density");
    put_text(out, "type", nb_density_names[density->type]);
    put_places(out, nb_density_places, nb_density_masks[density->type], density, NULL);
    if (density->type == NEBEL_DENSITY_HEIGHT) put_text(out, "below", nb_below_names[density->below]);
    if (density->type == NEBEL_DENSITY_RADIAL) {
        put_key(out, "power");
        put_numbers(out, 1, &(double){density->power}, NB_EDIT_EACH);
    }
    close_object(out);
}

/* `own` is in the file's numbers, but for its parts and planes. */
static void put_members(writer *out, const nebel_volume_desc *own, const nebel_shape *shape)
{
    static const nebel_volume_desc nothing = {.priority = 0};
    const bool has_fog = own->operation != NEBEL_OPERATION_EXCLUDE;
    const unsigned distances = 8 | 16;
    if (own->operation != NEBEL_OPERATION_ADD) put_text(out, "operation", nb_operation_names[own->operation]);
    if (own->priority != 0) {
        put_key(out, "priority");
        put_numbers(out, 1, &(double){own->priority}, NB_EDIT_EACH);
    }
    put_key(out, "shape");
    put_shape(out, shape);
    if (has_fog) {
        put_density(out, &own->density);
        put_key(out, "extinction");
        put_numbers(out, 3, own->extinction, NB_EDIT_AMOUNT);
    }
    put_places(out, nb_volume_places, has_fog ? NB_ALL_PLACES : distances, own, &nothing);
}

bool nb_save_write_volume(const nebel_allocator *allocator, const nb_space *space, const nebel_volume_desc *volume,
                          const char *name, nb_bytes *text)
{
    nebel_volume_desc own = *volume;
    writer out = {.allocator = allocator, .space = space, .good = true, .is_first = true};
    nb_space_restore_volume(space, &own);
    put(&out, "{");
    if (name[0] != '\0') put_text(&out, "name", name);
    put_members(&out, &own, &volume->shape);
    close_object(&out);
    out.good = out.good && nb_bytes_write(allocator, &out.text, out.text.size, "", 1);
    *text = out.text;
    if (!out.good) nb_release(allocator, text->data);
    return out.good;
}
