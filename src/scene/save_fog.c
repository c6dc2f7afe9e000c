/* Changed, new and lost volumes of fog, back into the file. */
#include "key_patch.h"
#include "math/vector.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_clear(const double extinction[3])
{
    return !(extinction[0] > 0 && extinction[1] > 0 && extinction[2] > 0);
}

/* In the place of another word for the amount. */
static void replace_amount(nb_key_patch *save, const nb_json_node *was, const char *key, const double numbers[3])
{
    char words[NB_EDIT_NUMBERS + 32], *const text = words + snprintf(words, 32, "\"%s\": ", key);
    nb_json_patch_write_numbers(3, numbers, NB_EDIT_AMOUNT, text);
    nb_json_patch_put(&save->edit, was->key_offset, was->end - was->key_offset, words);
}

static void find_lengths(double scale, const double extinction[3], double lengths[3])
{
    for (int i = 0; i < 3; i++) lengths[i] = scale / extinction[i];
}

/* Visibility, whose meaning its contrast is. */
static void save_visibility(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *volume,
                            const nb_json_node *word, const nb_written_volume *was, const nb_written_volume *now)
{
    double from[3], to[3];
    find_lengths(-log(was->entry.contrast), was->volume.extinction, from);
    find_lengths(-log(now->entry.contrast), now->volume.extinction, to);
    for (int i = 0; i < 3; i++)
        if (fabs(to[i] - from[i]) <= 1e-14 * from[i]) to[i] = from[i];
    if (nb_json_has_key(word, "visibility"))
        nb_json_patch_numbers(&save->edit, json, volume, "visibility", 3, from, to, NB_EDIT_AMOUNT);
    else
        replace_amount(save, word, "visibility", to);
    nb_json_patch_numbers(&save->edit, json, volume, "contrast", 1, &was->entry.contrast, &now->entry.contrast,
                          NB_EDIT_EACH);
}

/* Where the file leaves the amount to a preset. */
static void add_amount(nb_key_patch *save, const nb_json_patch_object *volume, const nb_written_volume *now)
{
    const double *extinction = now->volume.extinction;
    const bool is_plain = now->entry.contrast == nb_volume_entry_default().contrast || is_clear(extinction);
    double visibility[3];
    char words[NB_EDIT_NUMBERS];
    find_lengths(-log(now->entry.contrast), extinction, visibility);
    nb_json_patch_write_numbers(3, is_plain ? extinction : visibility, NB_EDIT_AMOUNT, words);
    nb_json_patch_add(&save->edit, volume, is_plain ? "extinction" : "visibility", words);
    if (is_plain) return;
    nb_json_patch_write_numbers(1, &now->entry.contrast, NB_EDIT_EACH, words);
    nb_json_patch_add(&save->edit, volume, "contrast", words);
}

/* The file's own word for the amount stays, unless it has none for an extinction of 0 or for a contrast. */
static void save_amount(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *volume,
                        const nb_written_volume *was, const nb_written_volume *now)
{
    const nb_json_node *visibility = nb_json_patch_member(json, volume->node, "visibility");
    const nb_json_node *path = nb_json_patch_member(json, volume->node, "mean_free_path");
    const nb_json_node *extinction = nb_json_patch_member(json, volume->node, "extinction");
    const nb_json_node *word = visibility != NULL ? visibility : path != NULL ? path : extinction;
    const double *from = was->volume.extinction, *to = now->volume.extinction;
    const bool has_other_contrast = was->entry.contrast != now->entry.contrast && !is_clear(to);
    double lengths_was[3], lengths_now[3];
    if (memcmp(from, to, sizeof lengths_was) == 0 && !has_other_contrast) return;
    if (word == NULL) {
        add_amount(save, volume, now);
        return;
    }
    if (!is_clear(to) && (visibility != NULL || has_other_contrast)) {
        save_visibility(save, json, volume, word, was, now);
    } else if (word == extinction) {
        nb_json_patch_numbers(&save->edit, json, volume, "extinction", 3, from, to, NB_EDIT_AMOUNT);
    } else if (is_clear(to)) {
        replace_amount(save, word, "extinction", to);
    } else {
        find_lengths(1, from, lengths_was);
        find_lengths(1, to, lengths_now);
        nb_json_patch_numbers(&save->edit, json, volume, "mean_free_path", 3, lengths_was, lengths_now, NB_EDIT_AMOUNT);
    }
}

static bool is_same_kind(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return a->operation == b->operation && nb_key_patch_is_same_form(&a->shape, &b->shape) &&
           a->density.type == b->density.type;
}

static bool has_changed_to(const double was[3], const double now[3])
{
    return !nb_vector_is_zero(now) && memcmp(was, now, sizeof(double[3])) != 0;
}

/* What the volume is now needs no such key, and the file may have it. */
static nb_removed_keys find_lost_keys(const nb_written_volume *was, const nb_written_volume *now)
{
    const nebel_volume_desc *a = &was->volume, *b = &now->volume;
    nb_removed_keys lost = {{NULL}};
    if (b->cutoff == 0 && a->cutoff != 0) nb_key_patch_lose(&lost, "cutoff");
    if (is_clear(b->extinction) && memcmp(a->extinction, b->extinction, sizeof a->extinction) != 0)
        nb_key_patch_lose(&lost, "contrast");
    if (has_changed_to(a->albedo, b->albedo) && nb_vector_is_zero(b->source)) nb_key_patch_lose(&lost, "source");
    if (has_changed_to(a->source, b->source) && nb_vector_is_zero(b->albedo)) {
        nb_key_patch_lose(&lost, "albedo");
        nb_key_patch_lose(&lost, "phase");
    }
    if (now->entry.key_count == 0 && was->entry.key_count > 0) nb_key_patch_lose(&lost, "keys");
    return lost;
}

static unsigned find_mask(const nb_removed_keys *lost)
{
    unsigned mask = NB_ALL_PLACES;
    for (size_t i = 0; lost->names[i] != NULL; i++)
        for (unsigned k = 0; nb_volume_places[k].key != NULL; k++)
            if (strcmp(nb_volume_places[k].key, lost->names[i]) == 0) mask &= ~(1u << k);
    return mask;
}

static void save_phase(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *volume,
                       const nb_written_volume *was, const nb_written_volume *now)
{
    const nebel_phase *to = &now->volume.phase;
    const nb_json_node *node = nb_json_patch_member(json, volume->node, "phase");
    /* A preset's own comes to light when its source goes. */
    const bool has_hidden = nb_json_patch_member(json, volume->node, "preset") != NULL &&
                            nb_json_patch_member(json, volume->node, "source") != NULL;
    char words[NB_EDIT_NUMBERS];
    if (nb_vector_is_zero(now->volume.albedo)) return;
    if (!has_hidden && nb_key_patch_same_phase(&was->volume.phase, to)) return;
    nb_key_patch_write_phase(to, words);
    if (node != NULL)
        nb_json_patch_replace(&save->edit, node, words);
    else
        nb_json_patch_add(&save->edit, volume, "phase", words);
}

/* Numbers of the volume alone; false where any of them is another one. */
static bool has_same_places(const nb_key_entry *places, unsigned mask, const void *a, const void *b)
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
static void find_kept_keys(const nb_key_patch *save, const nb_json *json, const nb_json_node *array,
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
static void save_keys(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *volume,
                      const nb_written_volume *was, const nb_written_volume *now)
{
    const nb_json_node *node = nb_json_patch_member(in->json, volume->node, "keys");
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    const size_t count = now->entry.key_count;
    char gap[64];
    nb_bytes text;
    if (count == 0 || has_same_keys(was, now)) return;
    nb_bytes *kept = nb_allocate_zero(allocator, count, sizeof *kept);
    if (kept != NULL) find_kept_keys(save, in->json, node, was, now, kept);
    find_gap(&save->edit, in->json, node, gap, sizeof gap);
    if (kept == NULL || !nb_key_patch_write_keys(allocator, &in->space, now, kept, gap, &text)) {
        save->edit.out_of_memory = true;
    } else {
        if (node != NULL)
            nb_json_patch_replace(&save->edit, node, (const char *)text.data);
        else
            nb_json_patch_add(&save->edit, volume, "keys", (const char *)text.data);
        nb_release(allocator, text.data);
    }
    nb_release(allocator, kept);
}

/* A key may have an albedo where the volume says that it has one, be it 0. */
static void save_lit_keys(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *volume,
                          const nb_written_volume *now)
{
    if (nb_vector_is_zero(now->volume.albedo) && nb_key_patch_has_lit_key(&now->entry) &&
        nb_json_patch_member(json, volume->node, "albedo") == NULL)
        nb_json_patch_add(&save->edit, volume, "albedo", "0");
}

/* In the file's numbers. */
static void save_fog(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *volume,
                     const nb_written_volume *was, const nb_written_volume *now)
{
    const nebel_volume_desc *a = &was->volume, *b = &now->volume;
    const nb_removed_keys lost = find_lost_keys(was, now);
    nb_key_patch_density(save, json, volume->node, &a->density, &b->density);
    nb_key_patch_integer(save, json, volume, "priority", a->priority, b->priority);
    nb_key_patch_places(save, json, volume, nb_volume_places, find_mask(&lost), a, b);
    save_lit_keys(save, json, volume, now);
    save_phase(save, json, volume, was, now);
    save_amount(save, json, volume, was, now);
    nb_json_patch_remove_members(&save->edit, json, volume->node, lost.names);
}

/* A volume as it stands in the file, or is to stand there. */
static nb_written_volume find_written(const nebel_scene_data *scene, size_t index)
{
    nb_written_volume found = {scene->volumes[index], nb_volume_entry_default(), scene->volume_names[index]};
    if (scene->volume_tracks == NULL) return found;
    found.entry = scene->volume_tracks[index];
    if (found.entry.key_count == 0) return found;
    found.volume = *found.entry.base;
    return found;
}

/* Without entries of its own a volume has those that it had. */
static nb_written_volume find_wanted(const nb_key_patch *save, size_t index, size_t target)
{
    nb_written_volume wanted = find_written(save->changed, target);
    if (save->changed->volume_tracks != NULL) return wanted;
    const nb_written_volume was = find_written(save->before, index);
    wanted.entry = was.entry;
    if (was.entry.key_count > 0) wanted.volume = was.volume;
    return wanted;
}

static void change_volume(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node,
                          const nb_written_volume *from, const nb_written_volume *to)
{
    const nb_json *json = in->json;
    nb_written_volume was = *from, now = *to;
    const nb_json_patch_object volume = nb_json_patch_find(json, node);
    nb_key_patch_shape(save, in, nb_json_patch_member(json, node, "shape"), &was.volume.shape, &now.volume.shape);
    save_keys(save, in, &volume, &was, &now);
    nb_file_units_restore_volume(&in->space, &was.volume);
    nb_file_units_restore_volume(&in->space, &now.volume);
    save_fog(save, json, &volume, &was, &now);
    if (strcmp(was.name, now.name) != 0) nb_json_patch_word(&save->edit, json, &volume, "name", now.name);
}

/* The words of a whole volume; NULL, with a note in the edit, when memory is out. */
static char *write_volume(nb_key_patch *save, const nb_scene_reader *in, const nb_written_volume *volume)
{
    nb_bytes text;
    if (nb_key_patch_write_volume(&save->edit.arena.allocator, &in->space, volume, &text)) return (char *)text.data;
    save->edit.out_of_memory = true;
    return NULL;
}

static void replace_volume(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node,
                           const nb_written_volume *volume)
{
    char *words = write_volume(save, in, volume);
    if (words != NULL) nb_json_patch_replace(&save->edit, node, words);
    nb_release(&save->edit.arena.allocator, words);
}

/* An entry that stands for itself: what other programs' settings become stays. */
static bool save_entry(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const size_t target = save->targets[index];
    const nebel_volume_origin origin = in->scene->volume_origins[index];
    const bool goes = target == NEBEL_NEW_VOLUME;
    if (!goes && (origin == NEBEL_VOLUME_STATIC || origin == NEBEL_VOLUME_ANIMATED)) {
        const nb_written_volume was = find_written(save->before, index), now = find_wanted(save, index, target);
        if (is_same_kind(&was.volume, &now.volume))
            change_volume(save, in, node, &was, &now);
        else
            replace_volume(save, in, node, &now);
    }
    return nb_key_patch_keep_span(save, in, &save->volumes, node, goes && origin != NEBEL_VOLUME_IMPORTED);
}

bool nb_key_patch_volume(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t first)
{
    for (size_t i = first; i < in->scene->data.volume_count; i++)
        if (i >= save->before->volume_count || !is_same_kind(&in->scene->volumes[i], &save->before->volumes[i]))
            return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                                "is another volume than the one to be written; the file has changed, load it again");
    if (first == in->scene->data.volume_count) return nb_key_patch_keep_span(save, in, &save->volumes, node, false);
    return save_entry(save, in, node, first);
}

bool nb_key_patch_check_removed(const nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *root)
{
    for (size_t i = 0; i < in->scene->data.volume_count; i++) {
        const nebel_volume_origin origin = in->scene->volume_origins[i];
        if (save->targets[i] != NEBEL_NEW_VOLUME || origin == NEBEL_VOLUME_STATIC || origin == NEBEL_VOLUME_ANIMATED)
            continue;
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "the volume \"%s\" comes from a model or another program; it cannot be removed",
                            in->scene->volume_names[i]);
    }
    return true;
}

/* ---- new fog --------------------------------------------------------------------------------- */

/* Behind the last entry that stays, on a line of its own where that one is; in an empty array behind its bracket. */
static void add_entry(nb_key_patch *save, const nb_json_node *array, const char *words)
{
    const nb_json_patch_span *last = NULL;
    char gap[64] = " ";
    for (size_t i = 0; i < save->volumes.count; i++)
        if (!save->volumes.spans[i].goes) last = &save->volumes.spans[i];
    if (last == NULL) {
        if (save->has_added) nb_json_patch_put(&save->edit, array->offset + 1, 0, ", ");
        nb_json_patch_put(&save->edit, array->offset + 1, 0, words);
        save->has_added = true;
        return;
    }
    size_t start = last->offset;
    while (start > 0 && strchr(" \t\r\n", save->edit.text[start - 1]) != NULL) start--;
    if (last->offset - start > 0 && last->offset - start < sizeof gap)
        snprintf(gap, sizeof gap, "%.*s", (int)(last->offset - start), save->edit.text + start);
    nb_json_patch_put(&save->edit, last->end, 0, ",");
    nb_json_patch_put(&save->edit, last->end, 0, gap);
    nb_json_patch_put(&save->edit, last->end, 0, words);
}

void nb_key_patch_entries(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *array)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    for (size_t i = 0; i < save->changed->volume_count; i++) {
        if (save->sources == NULL || save->sources[i] != NEBEL_NEW_VOLUME) continue;
        const nb_written_volume fresh = find_written(save->changed, i);
        char *words = write_volume(save, in, &fresh);
        if (words != NULL) add_entry(save, array, words);
        nb_release(allocator, words);
    }
    nb_json_patch_remove(&save->edit, save->volumes.spans, save->volumes.count);
}
