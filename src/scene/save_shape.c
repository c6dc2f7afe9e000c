/* What sections share: numbers, shapes and densities, back into the file. */
#include "key_patch.h"

#include <stdio.h>
#include <string.h>

/* ---- numbers --------------------------------------------------------------------------------- */

void nb_key_patch_places(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object,
                         const nb_key_entry *places, unsigned mask, const void *was, const void *now)
{
    for (size_t i = 0; places[i].key != NULL; i++)
        if ((mask >> i & 1) != 0)
            nb_json_patch_numbers(&save->edit, json, object, places[i].key, places[i].count,
                                  nb_place_numbers(was, &places[i]), nb_place_numbers(now, &places[i]),
                                  places[i].style);
}

/* What differs, as an object; false: nothing does. */
static bool write_members(const nb_key_entry *places, const void *was, const void *now, char *words, size_t size)
{
    size_t used = (size_t)snprintf(words, size, "{");
    for (size_t i = 0; places[i].key != NULL; i++) {
        char numbers[NB_EDIT_NUMBERS];
        if (!nb_place_differs(was, now, &places[i])) continue;
        nb_json_patch_write_numbers(places[i].count, nb_place_numbers(now, &places[i]), places[i].style, numbers);
        snprintf(words + used, size - used, "%s\"%s\": %s", used > 1 ? ", " : " ", places[i].key, numbers);
        used += strlen(words + used);
    }
    snprintf(words + used, size - used, " }");
    return used > 1;
}

void nb_key_patch_entry(nb_key_patch *save, const nb_json *json, const nb_json_node *node, const nb_key_entry *places,
                        const void *was, const void *now)
{
    const nb_json_patch_object object = nb_json_patch_find(json, node);
    char words[10 * NB_EDIT_NUMBERS];
    if (object.last_end != 0)
        nb_key_patch_places(save, json, &object, places, NB_ALL_PLACES, was, now);
    else if (write_members(places, was, now, words, sizeof words))
        nb_json_patch_replace(&save->edit, node, words);
}

void nb_key_patch_object(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *owner, const char *key,
                         const nb_key_entry *places, const void *was, const void *now)
{
    const nb_json_node *node = nb_json_patch_member(json, owner->node, key);
    char words[10 * NB_EDIT_NUMBERS];
    if (node != NULL)
        nb_key_patch_entry(save, json, node, places, was, now);
    else if (write_members(places, was, now, words, sizeof words))
        nb_json_patch_add(&save->edit, owner, key, words);
}

void nb_key_patch_lose(nb_removed_keys *lost, const char *key)
{
    size_t count = 0;
    while (lost->names[count] != NULL) count++;
    lost->names[count] = key;
}

bool nb_key_patch_keep_span(nb_key_patch *save, const nb_scene_reader *in, nb_span_list *list, const nb_json_node *node,
                            bool goes)
{
    void *spans = list->spans;
    if (!nb_grow(&save->edit.arena.allocator, &spans, sizeof *list->spans, list->count, &list->capacity,
                 list->count + 1))
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    list->spans = spans;
    list->spans[list->count++] = (nb_json_patch_span){node->offset, node->end, goes};
    return true;
}

void nb_key_patch_integer(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object, const char *key,
                          double was, double now)
{
    nb_json_patch_numbers(&save->edit, json, object, key, 1, &was, &now, NB_EDIT_EACH);
}

/* ---- words ----------------------------------------------------------------------------------- */

static void add_bytes(nb_json_writer *out, const char *words, size_t size)
{
    nb_edit *edit = &out->save->edit;
    if (!edit->out_of_memory && !nb_bytes_write(&edit->arena.allocator, &out->bytes, out->bytes.size, words, size))
        edit->out_of_memory = true;
}

void nb_json_writer_put(nb_json_writer *out, const char *words)
{
    add_bytes(out, words, strlen(words));
}

void nb_json_writer_put_text(nb_json_writer *out, const char *text)
{
    nb_edit *edit = &out->save->edit;
    if (!edit->out_of_memory && !nb_json_patch_write_text(&edit->arena.allocator, &out->bytes, text))
        edit->out_of_memory = true;
}

void nb_json_writer_put_numbers(nb_json_writer *out, size_t count, const double *numbers, nb_json_patch_style style)
{
    char text[NB_EDIT_NUMBERS];
    nb_json_patch_write_numbers(count, numbers, style, text);
    nb_json_writer_put(out, text);
}

const char *nb_json_writer_end(nb_json_writer *out)
{
    add_bytes(out, "", 1);
    return out->save->edit.out_of_memory ? NULL : (const char *)out->bytes.data;
}

/* ---- shapes ---------------------------------------------------------------------------------- */

void nb_key_patch_density(nb_key_patch *save, const nb_json *json, const nb_json_node *node, const nebel_density *was,
                          const nebel_density *now)
{
    const nb_json_patch_object density = nb_json_patch_find(json, nb_json_patch_member(json, node, "density"));
    if (density.node == NULL) return;
    if (now->type == NEBEL_DENSITY_GRID) nb_key_patch_noise_grid(save, json, &density, was->grid, now->grid);
    nb_key_patch_places(save, json, &density, nb_density_places, nb_density_masks[now->type], was, now);
    if (now->type == NEBEL_DENSITY_RADIAL) nb_key_patch_integer(save, json, &density, "power", was->power, now->power);
    if ((now->type == NEBEL_DENSITY_HEIGHT || now->type == NEBEL_DENSITY_ALTITUDE) && was->below != now->below)
        nb_json_patch_word(&save->edit, json, &density, "below", nb_below_names[now->below]);
}

static void save_planes(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *array,
                        const nebel_shape *was, const nebel_shape *now)
{
    const nb_json_node *node = array != NULL ? nb_json_first(in->json, array) : NULL;
    for (size_t i = 0; i < now->plane_count && node != NULL; i++, node = nb_json_next(in->json, node)) {
        nebel_plane a = was->planes[i], b = now->planes[i];
        nb_file_units_restore_plane(&in->space, &a);
        nb_file_units_restore_plane(&in->space, &b);
        const double from[4] = {a.normal[0], a.normal[1], a.normal[2], a.distance};
        const double to[4] = {b.normal[0], b.normal[1], b.normal[2], b.distance};
        nb_json_patch_elements(&save->edit, in->json, node, from, to);
    }
}

/* `was` and `now` are in metres. The depth is that of shapes in a file. */
void nb_key_patch_shape(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, const nebel_shape *was,
                        const nebel_shape *now)
{
    const nb_json_patch_object shape = nb_json_patch_find(in->json, node);
    nebel_shape a = *was, b = *now;
    nb_file_units_restore_shape(&in->space, &a);
    nb_file_units_restore_shape(&in->space, &b);
    nb_key_patch_places(save, in->json, &shape, nb_shape_places, nb_shape_masks[now->type], &a, &b);
    save_planes(save, in, nb_json_patch_member(in->json, node, "planes"), was, now);
    const nb_json_node *parts = nb_json_patch_member(in->json, node, "shapes");
    const nb_json_node *part = parts != NULL ? nb_json_first(in->json, parts) : NULL;
    for (size_t i = 0; i < now->part_count && part != NULL; i++, part = nb_json_next(in->json, part))
        nb_key_patch_shape(save, in, part, &was->parts[i], &now->parts[i]);
    nb_key_patch_object(save, in->json, &shape, "transform", nb_transform_places, &a.transform, &b.transform);
}

bool nb_key_patch_is_same_form(const nebel_shape *a, const nebel_shape *b)
{
    if (a->type != b->type || a->plane_count != b->plane_count || a->part_count != b->part_count) return false;
    for (size_t i = 0; i < a->part_count; i++)
        if (!nb_key_patch_is_same_form(&a->parts[i], &b->parts[i])) return false;
    return true;
}
