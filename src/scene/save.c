/* Changed fog, back into the file that the scene came from. */
#include "scene/save.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- numbers --------------------------------------------------------------------------------- */

void nb_save_places(nb_save *save, const nb_json *json, const nb_edit_object *object, const nb_place *places,
                    unsigned mask, const void *was, const void *now)
{
    for (size_t i = 0; places[i].key != NULL; i++)
        if ((mask >> i & 1) != 0)
            nb_edit_numbers(&save->edit, json, object, places[i].key, places[i].count,
                            nb_place_numbers(was, &places[i]), nb_place_numbers(now, &places[i]), places[i].style);
}

void nb_save_object(nb_save *save, const nb_json *json, const nb_edit_object *owner, const char *key, const char *word,
                    const nb_place *places, const void *was, const void *now)
{
    const nb_edit_object object = nb_edit_find(json, nb_edit_member(json, owner->node, key));
    char words[6 * NB_EDIT_NUMBERS] = "{";
    if (object.last_end != 0) {
        nb_save_places(save, json, &object, places, NB_ALL_PLACES, was, now);
        return;
    }
    if (word[0] != '\0') snprintf(words, sizeof words, "{ %s", word);
    for (size_t i = 0; places[i].key != NULL; i++) {
        char numbers[NB_EDIT_NUMBERS];
        if (!nb_place_differs(was, now, &places[i])) continue;
        const size_t used = strlen(words);
        nb_edit_write_numbers(places[i].count, nb_place_numbers(now, &places[i]), places[i].style, numbers);
        snprintf(words + used, sizeof words - used, "%s\"%s\": %s", used > 1 ? ", " : " ", places[i].key, numbers);
    }
    if (words[1] == '\0') return;
    strcat(words, " }");
    if (object.node != NULL)
        nb_edit_replace(&save->edit, object.node, words);
    else
        nb_edit_add(&save->edit, owner, key, words);
}

void nb_save_lose(nb_lost_keys *lost, const char *key)
{
    size_t count = 0;
    while (lost->names[count] != NULL) count++;
    lost->names[count] = key;
}

bool nb_save_keep_span(nb_save *save, const nb_scene_reader *in, nb_span_list *list, const nb_json_node *node,
                       bool goes)
{
    void *spans = list->spans;
    if (!nb_grow(&save->edit.arena.allocator, &spans, sizeof *list->spans, list->count, &list->capacity,
                 list->count + 1))
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    list->spans = spans;
    list->spans[list->count++] = (nb_edit_span){node->offset, node->end, goes};
    return true;
}

/* ---- fog ------------------------------------------------------------------------------------- */

static bool is_zero(const double rgb[3])
{
    return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0;
}

static bool is_clear(const double extinction[3])
{
    return !(extinction[0] > 0 && extinction[1] > 0 && extinction[2] > 0);
}

/* In the place of another word for the amount. */
static void replace_amount(nb_save *save, const nb_json_node *was, const char *key, const double numbers[3])
{
    char words[NB_EDIT_NUMBERS + 32], *const text = words + snprintf(words, 32, "\"%s\": ", key);
    nb_edit_write_numbers(3, numbers, NB_EDIT_AMOUNT, text);
    nb_edit_put(&save->edit, was->key_offset, was->end - was->key_offset, words);
}

static void find_lengths(double scale, const double extinction[3], double lengths[3])
{
    for (int i = 0; i < 3; i++) lengths[i] = scale / extinction[i];
}

/* Visibility, whose meaning its contrast is. */
static void save_visibility(nb_save *save, const nb_json *json, const nb_edit_object *volume, const nb_json_node *word,
                            const nb_written_volume *was, const nb_written_volume *now)
{
    double from[3], to[3];
    find_lengths(-log(was->entry.contrast), was->volume.extinction, from);
    find_lengths(-log(now->entry.contrast), now->volume.extinction, to);
    for (int i = 0; i < 3; i++)
        if (fabs(to[i] - from[i]) <= 1e-14 * from[i]) to[i] = from[i];
    if (nb_json_has_key(word, "visibility"))
        nb_edit_numbers(&save->edit, json, volume, "visibility", 3, from, to, NB_EDIT_AMOUNT);
    else
        replace_amount(save, word, "visibility", to);
    nb_edit_numbers(&save->edit, json, volume, "contrast", 1, &was->entry.contrast, &now->entry.contrast, NB_EDIT_EACH);
}

/* The file's own word for the amount stays, unless it has none for an extinction of 0 or for a contrast. */
static void save_amount(nb_save *save, const nb_json *json, const nb_edit_object *volume, const nb_written_volume *was,
                        const nb_written_volume *now)
{
    const nb_json_node *visibility = nb_edit_member(json, volume->node, "visibility");
    const nb_json_node *path = nb_edit_member(json, volume->node, "mean_free_path");
    const nb_json_node *extinction = nb_edit_member(json, volume->node, "extinction");
    const nb_json_node *word = visibility != NULL ? visibility : path != NULL ? path : extinction;
    const double *from = was->volume.extinction, *to = now->volume.extinction;
    const bool has_other_contrast = was->entry.contrast != now->entry.contrast && !is_clear(to);
    double lengths_was[3], lengths_now[3];
    if (memcmp(from, to, sizeof lengths_was) == 0 && !has_other_contrast) return;
    if (word == NULL) return;
    if (!is_clear(to) && (visibility != NULL || has_other_contrast)) {
        save_visibility(save, json, volume, word, was, now);
    } else if (word == extinction) {
        nb_edit_numbers(&save->edit, json, volume, "extinction", 3, from, to, NB_EDIT_AMOUNT);
    } else if (is_clear(to)) {
        replace_amount(save, word, "extinction", to);
    } else {
        find_lengths(1, from, lengths_was);
        find_lengths(1, to, lengths_now);
        nb_edit_numbers(&save->edit, json, volume, "mean_free_path", 3, lengths_was, lengths_now, NB_EDIT_AMOUNT);
    }
}

static void save_integer(nb_save *save, const nb_json *json, const nb_edit_object *object, const char *key, double was,
                         double now)
{
    nb_edit_numbers(&save->edit, json, object, key, 1, &was, &now, NB_EDIT_EACH);
}

static void save_density(nb_save *save, const nb_json *json, const nb_json_node *node, const nebel_density *was,
                         const nebel_density *now)
{
    const nb_edit_object density = nb_edit_find(json, nb_edit_member(json, node, "density"));
    if (density.node == NULL) return;
    nb_save_places(save, json, &density, nb_density_places, nb_density_masks[now->type], was, now);
    if (now->type == NEBEL_DENSITY_RADIAL) save_integer(save, json, &density, "power", was->power, now->power);
    if (now->type == NEBEL_DENSITY_HEIGHT && was->below != now->below)
        nb_edit_word(&save->edit, json, &density, "below", nb_below_names[now->below]);
}

static void save_planes(nb_save *save, const nb_scene_reader *in, const nb_json_node *array, const nebel_shape *was,
                        const nebel_shape *now)
{
    const nb_json_node *node = array != NULL ? nb_json_first(in->json, array) : NULL;
    for (size_t i = 0; i < now->plane_count && node != NULL; i++, node = nb_json_next(in->json, node)) {
        nebel_plane a = was->planes[i], b = now->planes[i];
        nb_space_restore_plane(&in->space, &a);
        nb_space_restore_plane(&in->space, &b);
        const double from[4] = {a.normal[0], a.normal[1], a.normal[2], a.distance};
        const double to[4] = {b.normal[0], b.normal[1], b.normal[2], b.distance};
        nb_edit_elements(&save->edit, in->json, node, from, to);
    }
}

/* `was` and `now` are in metres. The depth is that of shapes in a file. */
static void save_shape(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, const nebel_shape *was,
                       const nebel_shape *now)
{
    const nb_edit_object shape = nb_edit_find(in->json, node);
    nebel_shape a = *was, b = *now;
    nb_space_restore_shape(&in->space, &a);
    nb_space_restore_shape(&in->space, &b);
    nb_save_places(save, in->json, &shape, nb_shape_places, nb_shape_masks[now->type], &a, &b);
    save_planes(save, in, nb_edit_member(in->json, node, "planes"), was, now);
    const nb_json_node *parts = nb_edit_member(in->json, node, "shapes");
    const nb_json_node *part = parts != NULL ? nb_json_first(in->json, parts) : NULL;
    for (size_t i = 0; i < now->part_count && part != NULL; i++, part = nb_json_next(in->json, part))
        save_shape(save, in, part, &was->parts[i], &now->parts[i]);
    nb_save_object(save, in->json, &shape, "transform", "", nb_transform_places, &a.transform, &b.transform);
}

static bool is_same_form(const nebel_shape *a, const nebel_shape *b)
{
    if (a->type != b->type || a->plane_count != b->plane_count || a->part_count != b->part_count) return false;
    for (size_t i = 0; i < a->part_count; i++)
        if (!is_same_form(&a->parts[i], &b->parts[i])) return false;
    return true;
}

static bool is_same_kind(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return a->operation == b->operation && is_same_form(&a->shape, &b->shape) && a->density.type == b->density.type;
}

static bool has_changed_to(const double was[3], const double now[3])
{
    return !is_zero(now) && memcmp(was, now, sizeof(double[3])) != 0;
}

/* What the volume is now needs no such key, and the file may have it. */
static nb_lost_keys find_lost_keys(const nb_written_volume *was, const nb_written_volume *now)
{
    const nebel_volume_desc *a = &was->volume, *b = &now->volume;
    nb_lost_keys lost = {{NULL}};
    if (b->cutoff == 0 && a->cutoff != 0) nb_save_lose(&lost, "cutoff");
    if (is_clear(b->extinction) && memcmp(a->extinction, b->extinction, sizeof a->extinction) != 0)
        nb_save_lose(&lost, "contrast");
    if (has_changed_to(a->albedo, b->albedo) && is_zero(b->source)) nb_save_lose(&lost, "source");
    if (has_changed_to(a->source, b->source) && is_zero(b->albedo)) {
        nb_save_lose(&lost, "albedo");
        nb_save_lose(&lost, "phase");
    }
    if (now->entry.key_count == 0 && was->entry.key_count > 0) nb_save_lose(&lost, "keys");
    return lost;
}

static unsigned find_mask(const nb_lost_keys *lost)
{
    unsigned mask = NB_ALL_PLACES;
    for (size_t i = 0; lost->names[i] != NULL; i++)
        for (unsigned k = 0; nb_volume_places[k].key != NULL; k++)
            if (strcmp(nb_volume_places[k].key, lost->names[i]) == 0) mask &= ~(1u << k);
    return mask;
}

static void save_phase(nb_save *save, const nb_json *json, const nb_edit_object *volume, const nb_written_volume *was,
                       const nb_written_volume *now)
{
    const nebel_phase *from = &was->entry.phase, *to = &now->entry.phase;
    const nb_json_node *node = nb_edit_member(json, volume->node, "phase");
    char words[NB_EDIT_NUMBERS];
    if (is_zero(now->volume.albedo)) return;
    if (from->type == to->type && from->g == to->g && from->diameter == to->diameter) return;
    nb_save_write_phase(to, words);
    if (node != NULL)
        nb_edit_replace(&save->edit, node, words);
    else
        nb_edit_add(&save->edit, volume, "phase", words);
}

/* Numbers of the volume alone; false where any of them is another one. */
static bool has_same_places(const nb_place *places, unsigned mask, const void *a, const void *b)
{
    for (size_t i = 0; places[i].key != NULL; i++)
        if ((mask >> i & 1) != 0 && nb_place_differs(a, b, &places[i])) return false;
    return true;
}

static bool has_same_numbers(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return has_same_places(nb_volume_places, NB_ALL_PLACES, a, b) &&
           memcmp(a->extinction, b->extinction, sizeof a->extinction) == 0 &&
           has_same_places(nb_shape_places, nb_shape_masks[b->shape.type], &a->shape, &b->shape) &&
           has_same_places(nb_transform_places, NB_ALL_PLACES, &a->shape.transform, &b->shape.transform) &&
           has_same_places(nb_density_places, nb_density_masks[b->density.type], &a->density, &b->density);
}

static bool is_same_key(const nebel_volume_key *a, const nebel_volume_key *b)
{
    return a->frame == b->frame && has_same_numbers(&a->volume, &b->volume);
}

/* What stands between the first two keys, or before the only one. */
static void find_gap(const nb_edit *edit, const nb_json *json, const nb_json_node *array, char *gap, size_t size)
{
    const nb_json_node *node = array != NULL ? nb_json_first(json, array) : NULL;
    if (node != NULL && nb_json_next(json, node) != NULL) node = nb_json_next(json, node);
    size_t start = node != NULL ? node->offset : 0;
    snprintf(gap, size, " ");
    while (start > 0 && strchr(" \t\r\n", edit->text[start - 1]) != NULL) start--;
    if (node != NULL && node->offset > start && node->offset - start < size)
        snprintf(gap, size, "%.*s", (int)(node->offset - start), edit->text + start);
}

/* Keys that are as they were keep their words, as long as what they leave out is what it was. */
static void find_kept_keys(const nb_save *save, const nb_json *json, const nb_json_node *array,
                           const nb_written_volume *was, const nb_written_volume *now, nb_bytes *kept)
{
    const nb_json_node *node = array != NULL ? nb_json_first(json, array) : NULL;
    if (!has_same_numbers(&was->volume, &now->volume)) return;
    for (size_t i = 0; i < was->entry.key_count && node != NULL; i++, node = nb_json_next(json, node))
        for (size_t k = 0; k < now->entry.key_count; k++)
            if (is_same_key(&was->entry.keys[i], &now->entry.keys[k]))
                kept[k] = (nb_bytes){.data = (unsigned char *)save->edit.text + node->offset,
                                     .size = node->end - node->offset};
}

static bool has_same_keys(const nb_written_volume *was, const nb_written_volume *now)
{
    if (was->entry.key_count != now->entry.key_count || !has_same_numbers(&was->volume, &now->volume)) return false;
    for (size_t i = 0; i < now->entry.key_count; i++)
        if (!is_same_key(&was->entry.keys[i], &now->entry.keys[i])) return false;
    return true;
}

/* `was` and `now` are in metres. */
static void save_keys(nb_save *save, const nb_scene_reader *in, const nb_edit_object *volume,
                      const nb_written_volume *was, const nb_written_volume *now)
{
    const nb_json_node *node = nb_edit_member(in->json, volume->node, "keys");
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    const size_t count = now->entry.key_count;
    char gap[64];
    nb_bytes text;
    if (count == 0 || has_same_keys(was, now)) return;
    nb_bytes *kept = nb_allocate_zero(allocator, count, sizeof *kept);
    if (kept != NULL) find_kept_keys(save, in->json, node, was, now, kept);
    find_gap(&save->edit, in->json, node, gap, sizeof gap);
    if (kept == NULL || !nb_save_write_keys(allocator, &in->space, now, kept, gap, &text)) {
        save->edit.out_of_memory = true;
    } else {
        if (node != NULL)
            nb_edit_replace(&save->edit, node, (const char *)text.data);
        else
            nb_edit_add(&save->edit, volume, "keys", (const char *)text.data);
        nb_release(allocator, text.data);
    }
    nb_release(allocator, kept);
}

/* A key may have an albedo where the volume says that it has one, be it 0. */
static void save_lit_keys(nb_save *save, const nb_json *json, const nb_edit_object *volume,
                          const nb_written_volume *now)
{
    if (is_zero(now->volume.albedo) && nb_save_has_lit_key(&now->entry) &&
        nb_edit_member(json, volume->node, "albedo") == NULL)
        nb_edit_add(&save->edit, volume, "albedo", "0");
}

/* In the file's numbers. */
static void save_fog(nb_save *save, const nb_json *json, const nb_edit_object *volume, const nb_written_volume *was,
                     const nb_written_volume *now)
{
    const nebel_volume_desc *a = &was->volume, *b = &now->volume;
    const nb_lost_keys lost = find_lost_keys(was, now);
    save_density(save, json, volume->node, &a->density, &b->density);
    save_integer(save, json, volume, "priority", a->priority, b->priority);
    nb_save_places(save, json, volume, nb_volume_places, find_mask(&lost), a, b);
    save_lit_keys(save, json, volume, now);
    save_phase(save, json, volume, was, now);
    save_amount(save, json, volume, was, now);
    nb_edit_remove_members(&save->edit, json, volume->node, lost.names);
}

/* A volume as it stands in the file, or is to stand there. */
static nb_written_volume find_written(const nebel_scene_data *scene, size_t index)
{
    nb_written_volume found = {scene->volumes[index], nb_volume_entry_default(), scene->volume_names[index]};
    if (scene->volume_entries == NULL) return found;
    found.entry = scene->volume_entries[index];
    if (found.entry.key_count == 0) return found;
    found.volume = *found.entry.own;
    return found;
}

/* Without entries of its own a volume has those that it had. */
static nb_written_volume find_wanted(const nb_save *save, size_t index, size_t target)
{
    nb_written_volume wanted = find_written(save->changed, target);
    if (save->changed->volume_entries != NULL) return wanted;
    const nb_written_volume was = find_written(save->before, index);
    wanted.entry = was.entry;
    if (was.entry.key_count > 0) wanted.volume = was.volume;
    return wanted;
}

static void change_volume(nb_save *save, const nb_scene_reader *in, const nb_json_node *node,
                          const nb_written_volume *from, const nb_written_volume *to)
{
    const nb_json *json = in->json;
    nb_written_volume was = *from, now = *to;
    const nb_edit_object volume = nb_edit_find(json, node);
    save_shape(save, in, nb_edit_member(json, node, "shape"), &was.volume.shape, &now.volume.shape);
    save_keys(save, in, &volume, &was, &now);
    nb_space_restore_volume(&in->space, &was.volume);
    nb_space_restore_volume(&in->space, &now.volume);
    save_fog(save, json, &volume, &was, &now);
    if (strcmp(was.name, now.name) != 0) nb_edit_word(&save->edit, json, &volume, "name", now.name);
}

/* The words of a whole volume; NULL, with a note in the edit, when memory is out. */
static char *write_volume(nb_save *save, const nb_scene_reader *in, const nb_written_volume *volume)
{
    nb_bytes text;
    if (nb_save_write_volume(&save->edit.arena.allocator, &in->space, volume, &text)) return (char *)text.data;
    save->edit.out_of_memory = true;
    return NULL;
}

static void replace_volume(nb_save *save, const nb_scene_reader *in, const nb_json_node *node,
                           const nb_written_volume *volume)
{
    char *words = write_volume(save, in, volume);
    if (words != NULL) nb_edit_replace(&save->edit, node, words);
    nb_release(&save->edit.arena.allocator, words);
}

/* An entry that stands for itself: what other programs' settings become stays. */
static bool save_entry(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const size_t target = save->targets[index];
    const nebel_volume_origin origin = in->scene->volume_origins[index];
    const bool goes = target == NEBEL_NEW_VOLUME;
    if (!goes && (origin == NEBEL_VOLUME_WRITTEN || origin == NEBEL_VOLUME_MOVING)) {
        const nb_written_volume was = find_written(save->before, index), now = find_wanted(save, index, target);
        if (is_same_kind(&was.volume, &now.volume))
            change_volume(save, in, node, &was, &now);
        else
            replace_volume(save, in, node, &now);
    }
    return nb_save_keep_span(save, in, &save->volumes, node, goes && origin != NEBEL_VOLUME_IMPORTED);
}

bool nb_save_volume(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t first)
{
    for (size_t i = first; i < in->scene->data.volume_count; i++)
        if (i >= save->before->volume_count || !is_same_kind(&in->scene->volumes[i], &save->before->volumes[i]))
            return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                                "is another volume than the one to be written; the file has changed, load it again");
    if (first == in->scene->data.volume_count) return nb_save_keep_span(save, in, &save->volumes, node, false);
    return save_entry(save, in, node, first);
}

bool nb_save_check_removed(const nb_save *save, const nb_scene_reader *in, const nb_json_node *root)
{
    for (size_t i = 0; i < in->scene->data.volume_count; i++) {
        const nebel_volume_origin origin = in->scene->volume_origins[i];
        if (save->targets[i] != NEBEL_NEW_VOLUME || origin == NEBEL_VOLUME_WRITTEN || origin == NEBEL_VOLUME_MOVING)
            continue;
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "the volume \"%s\" comes from a model or another program; it cannot be removed",
                            in->scene->volume_names[i]);
    }
    return true;
}

/* ---- new fog --------------------------------------------------------------------------------- */

/* Behind the last entry that stays, on a line of its own where that one is; in an empty array behind its bracket. */
static void add_entry(nb_save *save, const nb_json_node *array, const char *words)
{
    const nb_edit_span *last = NULL;
    char gap[64] = " ";
    for (size_t i = 0; i < save->volumes.count; i++)
        if (!save->volumes.spans[i].goes) last = &save->volumes.spans[i];
    if (last == NULL) {
        if (save->has_added) nb_edit_put(&save->edit, array->offset + 1, 0, ", ");
        nb_edit_put(&save->edit, array->offset + 1, 0, words);
        save->has_added = true;
        return;
    }
    size_t start = last->offset;
    while (start > 0 && strchr(" \t\r\n", save->edit.text[start - 1]) != NULL) start--;
    if (last->offset - start > 0 && last->offset - start < sizeof gap)
        snprintf(gap, sizeof gap, "%.*s", (int)(last->offset - start), save->edit.text + start);
    nb_edit_put(&save->edit, last->end, 0, ",");
    nb_edit_put(&save->edit, last->end, 0, gap);
    nb_edit_put(&save->edit, last->end, 0, words);
}

void nb_save_entries(nb_save *save, const nb_scene_reader *in, const nb_json_node *array)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    for (size_t i = 0; i < save->changed->volume_count; i++) {
        if (save->sources == NULL || save->sources[i] != NEBEL_NEW_VOLUME) continue;
        const nb_written_volume fresh = find_written(save->changed, i);
        char *words = write_volume(save, in, &fresh);
        if (words != NULL) add_entry(save, array, words);
        nb_release(allocator, words);
    }
    nb_edit_remove(&save->edit, save->volumes.spans, save->volumes.count);
}

/* ---- nebulae --------------------------------------------------------------------------------- */

static bool is_same_nebula(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return is_same_form(&a->shape, &b->shape) && a->density.type == b->density.type &&
           (a->points == NULL) == (b->points == NULL);
}

/* Text of its own for any number of them: some twenty bytes for each number. */
static void write_colors(nb_save *save, const nb_json *json, const nb_edit_object *nebula, const nebel_nebula_desc *now)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    const nb_json_node *node = nb_edit_member(json, nebula->node, "colors");
    const size_t size = 8 + now->color_count * (NB_EDIT_NUMBERS + 2);
    char *words = nb_allocate(allocator, size, 1);
    size_t used = 0;
    if (words == NULL) {
        save->edit.out_of_memory = true;
        return;
    }
    for (size_t i = 0; i < now->color_count; i++) {
        used += (size_t)snprintf(words + used, size - used, i == 0 ? "[" : ", ");
        nb_edit_write_numbers(3, now->colors[i], NB_EDIT_AMOUNT, words + used);
        used += strlen(words + used);
    }
    snprintf(words + used, size - used, "]");
    if (node != NULL)
        nb_edit_replace(&save->edit, node, words);
    else
        nb_edit_add(&save->edit, nebula, "colors", words);
    nb_release(allocator, words);
}

static void save_colors(nb_save *save, const nb_json *json, const nb_edit_object *nebula, const nebel_nebula_desc *was,
                        const nebel_nebula_desc *now)
{
    if (now->color_count == 0) return;
    if (was->color_count != now->color_count) {
        write_colors(save, json, nebula, now);
        return;
    }
    const nb_json_node *node = nb_json_first(json, nb_edit_member(json, nebula->node, "colors"));
    for (size_t i = 0; i < now->color_count; i++, node = nb_json_next(json, node)) {
        char words[NB_EDIT_NUMBERS];
        if (memcmp(was->colors[i], now->colors[i], sizeof *now->colors) == 0) continue;
        nb_edit_write_numbers(3, now->colors[i], NB_EDIT_AMOUNT, words);
        nb_edit_replace(&save->edit, node, words);
    }
}

static void save_points(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, nebel_transform was,
                        nebel_transform now)
{
    const nb_edit_object points = nb_edit_find(in->json, nb_edit_member(in->json, node, "points"));
    if (points.node == NULL) return;
    nb_space_restore_placement(&in->space, was.position, was.rotation, was.scale);
    nb_space_restore_placement(&in->space, now.position, now.rotation, now.scale);
    nb_save_places(save, in->json, &points, nb_transform_places, NB_ALL_PLACES, &was, &now);
}

static void change_nebula(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nb_json *json = in->json;
    nebel_nebula_desc was = save->before->nebulae[index], now = save->changed->nebulae[index];
    const nb_edit_object nebula = nb_edit_find(json, node);
    const bool loses_size = now.turbulence_size == 0;
    nb_lost_keys lost = {{NULL}};
    if (loses_size) nb_save_lose(&lost, "turbulence_size");
    if (now.color_count == 0) nb_save_lose(&lost, "colors");
    save_shape(save, in, nb_edit_member(json, node, "shape"), &was.shape, &now.shape);
    nb_space_restore_nebula(&in->space, &was);
    nb_space_restore_nebula(&in->space, &now);
    if (loses_size) was.turbulence_size = 0;
    save_density(save, json, node, &was.density, &now.density);
    nb_save_places(save, json, &nebula, nb_nebula_places, NB_ALL_PLACES, &was, &now);
    if (now.points == NULL) save_integer(save, json, &nebula, "count", (double)was.count, (double)now.count);
    save_integer(save, json, &nebula, "seed", (double)was.seed, (double)now.seed);
    if (was.profile != now.profile) nb_edit_word(&save->edit, json, &nebula, "profile", nb_profile_names[now.profile]);
    save_colors(save, json, &nebula, &was, &now);
    save_points(save, in, node, save->before->nebula_places[index], save->changed->nebula_places[index]);
    nb_edit_remove_members(&save->edit, json, node, lost.names);
}

bool nb_save_nebula(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    if (index >= save->before->nebula_count ||
        !is_same_nebula(&in->scene->nebulae[index], &save->before->nebulae[index]))
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "is another nebula than the one to be written; the file has changed, load it again");
    change_nebula(save, in, node, index);
    return true;
}

/* ---- cells ----------------------------------------------------------------------------------- */

static bool are_same_cells(const nebel_cells_desc *a, const nebel_cells_desc *b)
{
    if (b == NULL || a->cell_count != b->cell_count) return false;
    for (size_t i = 0; i < a->cell_count; i++)
        if (!is_same_form(&a->cells[i].shape, &b->cells[i].shape)) return false;
    return true;
}

static void change_cell(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, nebel_cell was,
                        nebel_cell now)
{
    const nb_edit_object cell = nb_edit_find(in->json, node);
    save_shape(save, in, nb_edit_member(in->json, node, "shape"), &was.shape, &now.shape);
    nb_space_restore_cell(&in->space, &was);
    nb_space_restore_cell(&in->space, &now);
    nb_save_places(save, in->json, &cell, nb_cell_places, NB_ALL_PLACES, &was, &now);
}

static void save_grouping(nb_save *save, const nb_json *json, const nb_edit_object *section, bool grouped)
{
    const nb_json_node *grouping = nb_edit_member(json, section->node, "grouping");
    const char *word = grouped ? "true" : "false";
    if (grouping != NULL)
        nb_edit_replace(&save->edit, grouping, word);
    else
        nb_edit_add(&save->edit, section, "grouping", word);
}

bool nb_save_cells(nb_save *save, nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_cells_desc *was = save->before->cells, *now = save->changed->cells;
    const nb_edit_object section = nb_edit_find(in->json, node);
    if (!are_same_cells(in->scene->data.cells, was) || !are_same_cells(was, now))
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "has other cells than those to be written; the file has changed, load it again");
    const nb_json_node *at = nb_json_first(in->json, nb_edit_member(in->json, node, "cells"));
    for (size_t i = 0; i < now->cell_count; i++, at = nb_json_next(in->json, at))
        change_cell(save, in, at, was->cells[i], now->cells[i]);
    if (was->model != now->model)
        nb_edit_word(&save->edit, in->json, &section, "model", nb_cell_model_names[now->model]);
    if (was->span != now->span) nb_edit_word(&save->edit, in->json, &section, "span", nb_cell_span_names[now->span]);
    if (!was->ungrouped != !now->ungrouped) save_grouping(save, in->json, &section, !now->ungrouped);
    return true;
}

/* ---- the file -------------------------------------------------------------------------------- */

/* What would be written is read as well: whatever is wrong with it is found before the file is. */
static nebel_result write_text(const char *path, const nebel_scene_desc *desc, const nb_bytes *bytes)
{
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    nebel_scene *scene = NULL;
    const nebel_result result = nebel_parse_scene((const char *)bytes->data, bytes->size, path, desc, &scene);
    nebel_destroy_scene(scene);
    return result == NEBEL_OK ? nb_file_write(&allocator, &desc->log, path, bytes) : result;
}

static nebel_result save_text(const char *path, const nebel_scene_desc *desc, nb_save *save)
{
    nebel_scene *scene = NULL;
    nb_bytes bytes;
    nebel_result result = nb_scene_parse(save->edit.text, save->edit.size, path, desc, save, &scene);
    nebel_destroy_scene(scene);
    if (result != NEBEL_OK || (save->edit.count == 0 && !save->edit.out_of_memory)) return result;
    if (!nb_edit_apply(&save->edit, &bytes)) return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "%s: out of memory", path);
    result = write_text(path, desc, &bytes);
    nb_release(&save->edit.arena.allocator, bytes.data);
    return result;
}

static bool find_targets(nb_save *save)
{
    const size_t before = save->before->volume_count, after = save->changed->volume_count;
    if (save->sources == NULL && before != after) return false;
    for (size_t i = 0; i < before; i++) save->targets[i] = save->sources == NULL ? i : NEBEL_NEW_VOLUME;
    for (size_t i = 0, least = 0; i < after && save->sources != NULL; i++) {
        const size_t source = save->sources[i];
        if (source == NEBEL_NEW_VOLUME) continue;
        if (source < least || source >= before) return false;
        save->targets[source] = i;
        least = source + 1;
    }
    return true;
}

static nebel_result save_file(const char *path, const nebel_scene_desc *desc, nb_save *save)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    nb_bytes bytes;
    nebel_result result = nb_file_read(allocator, &desc->log, NULL, "scene", path, NB_SCENE_TEXT_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    save->edit.text = (const char *)bytes.data;
    save->edit.size = bytes.size;
    result = save_text(path, desc, save);
    nb_edit_release(&save->edit);
    nb_release(allocator, save->volumes.spans);
    nb_release(allocator, save->models.spans);
    nb_release(allocator, bytes.data);
    return result;
}

nebel_result nebel_save_scene(const char *path, const nebel_scene_desc *desc, const nebel_scene_data *before,
                              const nebel_scene_data *changed, const size_t *sources)
{
    if (path == NULL || desc == NULL || before == NULL || changed == NULL || !nb_allocator_is_valid(&desc->allocator))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    nb_save save = {.before = before,
                    .changed = changed,
                    .sources = sources,
                    .targets = nb_allocate(&allocator, before->volume_count, sizeof(size_t)),
                    .edit = {.arena = {.allocator = allocator}}};
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (save.targets == NULL)
        nb_fail(&desc->log, result, "%s: out of memory", path);
    else if (!find_targets(&save))
        result = nb_fail(&desc->log, NEBEL_ERROR_ARGUMENT,
                         "%s: what volumes were must ascend, and name volumes that there were", path);
    else
        result = save_file(path, desc, &save);
    nb_release(&allocator, save.targets);
    return result;
}
