/* Whole volumes as JSON, for those that the file has not, or has as something else. */
#include "key_patch.h"
#include "math/vector.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Text that grows. Once memory is out nothing more is added. */
typedef struct writer {
    const nebel_allocator *allocator;
    const nb_file_units *space;
    nb_bytes text;
    bool good, is_first; /* whether a comma is due before the next member */
} writer;

static void put_words(writer *out, const char *words)
{
    out->good = out->good && nb_bytes_write(out->allocator, &out->text, out->text.size, words, strlen(words));
}

static void put_key(writer *out, const char *key)
{
    put_words(out, out->is_first ? " \"" : ", \"");
    put_words(out, key);
    put_words(out, "\": ");
    out->is_first = false;
}

static void put_text(writer *out, const char *key, const char *text)
{
    put_key(out, key);
    out->good = out->good && nb_json_patch_write_text(out->allocator, &out->text, text);
}

static void put_numbers(writer *out, size_t count, const double *numbers, nb_json_patch_style style)
{
    char text[NB_EDIT_NUMBERS];
    nb_json_patch_write_numbers(count, numbers, style, text);
    put_words(out, text);
}

static void open_object(writer *out, const char *key)
{
    put_key(out, key);
    put_words(out, "{");
    out->is_first = true;
}

static void close_object(writer *out)
{
    put_words(out, out->is_first ? "}" : " }");
    out->is_first = false;
}

/* Numbers of the type, and of those only what is not the default, where there is one. */
static void put_places(writer *out, const nb_key_entry *places, unsigned mask, const void *structure,
                       const void *defaults)
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
        nb_file_units_restore_plane(out->space, &plane);
        const double numbers[4] = {plane.normal[0], plane.normal[1], plane.normal[2], plane.distance};
        put_words(out, i == 0 ? "[" : ", ");
        put_numbers(out, 4, numbers, NB_EDIT_WHOLE);
    }
    put_words(out, "]");
}

static void put_parts(writer *out, const nebel_shape *shape)
{
    put_key(out, "shapes");
    for (size_t i = 0; i < shape->part_count; i++) {
        put_words(out, i == 0 ? "[" : ", ");
        put_shape(out, &shape->parts[i]);
    }
    put_words(out, "]");
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
    nb_file_units_restore_shape(out->space, &own);
    complete_transform(&own.transform);
    put_words(out, "{");
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
    if (density->type == NEBEL_DENSITY_GRID) { /* its name is what the file said of it */
        put_key(out, "density");
        put_words(out, nebel_get_grid_name(density->grid)[0] != '\0' ? nebel_get_grid_name(density->grid)
                                                                     : "{ \"file\": \"\" }");
        return;
    }
    open_object(out, "density");
    put_text(out, "type", nb_density_names[density->type]);
    put_places(out, nb_density_places, nb_density_masks[density->type], density, NULL);
    if (density->type == NEBEL_DENSITY_HEIGHT || density->type == NEBEL_DENSITY_ALTITUDE)
        put_text(out, "below", nb_below_names[density->below]);
    if (density->type == NEBEL_DENSITY_RADIAL) {
        put_key(out, "power");
        put_numbers(out, 1, &(double){density->power}, NB_EDIT_EACH);
    }
    close_object(out);
}

void nb_key_patch_write_phase(const nebel_phase *phase, char text[NB_EDIT_NUMBERS])
{
    const bool is_draine = phase->type == NEBEL_PHASE_DRAINE, is_droplets = phase->type == NEBEL_PHASE_DROPLETS;
    const bool has_g =
        is_draine || phase->type == NEBEL_PHASE_HENYEY_GREENSTEIN || phase->type == NEBEL_PHASE_CORNETTE_SHANKS;
    char number[NB_EDIT_NUMBERS], first[40] = "", second[40] = "";
    nb_json_patch_write_numbers(1, has_g ? &phase->g : &phase->diameter, NB_EDIT_EACH, number);
    if (has_g || is_droplets) snprintf(first, sizeof first, ", \"%s\": %.24s", has_g ? "g" : "diameter", number);
    nb_json_patch_write_numbers(1, &phase->alpha, NB_EDIT_EACH, number);
    if (is_draine) snprintf(second, sizeof second, ", \"alpha\": %.24s", number);
    snprintf(text, NB_EDIT_NUMBERS, "{ \"type\": \"%.20s\"%s%s }", nb_phase_names[phase->type], first, second);
}

bool nb_key_patch_has_lit_key(const nebel_volume_track *entry)
{
    for (size_t i = 0; i < entry->key_count; i++)
        if (!nb_vector_is_zero(entry->keys[i].volume.albedo)) return true;
    return false;
}

/* As an extinction, unless the entry has a contrast that only a visibility can say. */
static void put_amount(writer *out, const nebel_volume_desc *own, double contrast)
{
    const double *rgb = own->extinction;
    double visibility[3];
    const bool is_plain_amount =
        contrast == nb_volume_entry_default().contrast || !(rgb[0] > 0 && rgb[1] > 0 && rgb[2] > 0);
    for (int i = 0; i < 3; i++) visibility[i] = -log(contrast) / rgb[i];
    put_key(out, is_plain_amount ? "extinction" : "visibility");
    put_numbers(out, 3, is_plain_amount ? rgb : visibility, NB_EDIT_AMOUNT);
    if (is_plain_amount) return;
    put_key(out, "contrast");
    put_numbers(out, 1, &contrast, NB_EDIT_EACH);
}

static void put_phase(writer *out, const nebel_phase *phase)
{
    char text[NB_EDIT_NUMBERS];
    if (phase->type == NEBEL_PHASE_ISOTROPIC) return;
    nb_key_patch_write_phase(phase, text);
    put_key(out, "phase");
    put_words(out, text);
}

/* ---- keys ------------------------------------------------------------------------------------ */

static bool has_difference(const nb_key_entry *places, unsigned mask, const void *was, const void *now)
{
    for (size_t i = 0; places[i].key != NULL; i++)
        if ((mask >> i & 1) != 0 && nb_place_differs(was, now, &places[i])) return true;
    return false;
}

/* Both in the file's numbers. */
static void put_shape_key(writer *out, const nebel_shape *own, const nebel_shape *key)
{
    const unsigned mask = nb_shape_masks[own->type];
    const bool moves = has_difference(nb_transform_places, NB_ALL_PLACES, &own->transform, &key->transform);
    if (!moves && !has_difference(nb_shape_places, mask, own, key)) return;
    open_object(out, "shape");
    put_places(out, nb_shape_places, mask, key, own);
    if (moves) {
        open_object(out, "transform");
        put_places(out, nb_transform_places, NB_ALL_PLACES, &key->transform, &own->transform);
        close_object(out);
    }
    close_object(out);
}

static void put_density_key(writer *out, const nebel_density *own, const nebel_density *key)
{
    const unsigned mask = nb_density_masks[own->type];
    if (!has_difference(nb_density_places, mask, own, key)) return;
    open_object(out, "density");
    put_places(out, nb_density_places, mask, key, own);
    close_object(out);
}

/* What differs from the volume itself. Start and cutoff do not move. */
static void put_key_object(writer *out, const nebel_volume_desc *own, const nebel_volume_key *key)
{
    const unsigned light = 1 | 2 | 4;
    nebel_volume_desc volume = key->volume;
    nb_file_units_restore_volume(out->space, &volume);
    complete_transform(&volume.shape.transform);
    put_words(out, "{");
    out->is_first = true;
    put_key(out, "frame");
    put_numbers(out, 1, &key->frame, NB_EDIT_EACH);
    put_shape_key(out, &own->shape, &volume.shape);
    if (own->operation != NEBEL_OPERATION_EXCLUDE) {
        put_density_key(out, &own->density, &volume.density);
        if (memcmp(own->extinction, volume.extinction, sizeof own->extinction) != 0) {
            put_key(out, "extinction");
            put_numbers(out, 3, volume.extinction, NB_EDIT_AMOUNT);
        }
        put_places(out, nb_volume_places, light, &volume, own);
    }
    close_object(out);
}

static void put_keys(writer *out, const nb_written_volume *volume, const nb_bytes *kept, const char *gap)
{
    nebel_volume_desc own = volume->volume;
    nb_file_units_restore_volume(out->space, &own);
    complete_transform(&own.shape.transform);
    put_words(out, "[");
    for (size_t i = 0; i < volume->entry.key_count; i++) {
        put_words(out, i > 0 ? "," : "");
        put_words(out, i > 0 ? gap : "");
        if (kept != NULL && kept[i].size > 0)
            out->good =
                out->good && nb_bytes_write(out->allocator, &out->text, out->text.size, kept[i].data, kept[i].size);
        else
            put_key_object(out, &own, &volume->entry.keys[i]);
    }
    put_words(out, "]");
    out->is_first = false;
}

/* ---- volumes --------------------------------------------------------------------------------- */

static bool finish(writer *out, nb_bytes *text)
{
    out->good = out->good && nb_bytes_write(out->allocator, &out->text, out->text.size, "", 1);
    *text = out->text;
    if (!out->good) nb_release(out->allocator, text->data);
    return out->good;
}

bool nb_key_patch_write_keys(const nebel_allocator *allocator, const nb_file_units *space,
                             const nb_written_volume *volume, const nb_bytes *kept, const char *gap, nb_bytes *text)
{
    writer out = {.allocator = allocator, .space = space, .good = true};
    put_keys(&out, volume, kept, gap);
    return finish(&out, text);
}

/* `own` is in the file's numbers, but for its parts and planes. */
static void put_members(writer *out, const nebel_volume_desc *own, const nb_written_volume *written)
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
    put_shape(out, &written->volume.shape);
    if (has_fog) {
        put_density(out, &own->density);
        put_amount(out, own, written->entry.contrast);
    }
    put_places(out, nb_volume_places, has_fog ? NB_ALL_PLACES : distances, own, &nothing);
    if (has_fog && !nb_vector_is_zero(own->albedo)) put_phase(out, &own->phase);
    if (has_fog && nb_vector_is_zero(own->albedo) && nb_key_patch_has_lit_key(&written->entry)) {
        put_key(out, "albedo");
        put_words(out, "0");
    }
    if (written->entry.key_count == 0) return;
    put_key(out, "keys");
    put_keys(out, written, NULL, " ");
}

bool nb_key_patch_write_volume(const nebel_allocator *allocator, const nb_file_units *space,
                               const nb_written_volume *volume, nb_bytes *text)
{
    nebel_volume_desc own = volume->volume;
    writer out = {.allocator = allocator, .space = space, .good = true, .is_first = true};
    nb_file_units_restore_volume(space, &own);
    put_words(&out, "{");
    if (volume->name[0] != '\0') put_text(&out, "name", volume->name);
    put_members(&out, &own, volume);
    close_object(&out);
    return finish(&out, text);
}
