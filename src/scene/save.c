/* Changed fog and light, back into the file that the scene came from. */
#include "scene/save.h"
#include "scene/save_places.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- numbers --------------------------------------------------------------------------------- */

static void save_places(nb_save *save, const nb_json *json, const nb_edit_object *object, const nb_place *places,
                        unsigned mask, const void *was, const void *now)
{
    for (size_t i = 0; places[i].key != NULL; i++)
        if ((mask >> i & 1) != 0)
            nb_edit_numbers(&save->edit, json, object, places[i].key, places[i].count,
                            nb_place_numbers(was, &places[i]), nb_place_numbers(now, &places[i]), places[i].style);
}

/* The same for an object that the file may lack: then it is added, with what has changed. */
static void save_object(nb_save *save, const nb_json *json, const nb_edit_object *owner, const char *key,
                        const nb_place *places, const void *was, const void *now)
{
    const nb_edit_object object = nb_edit_find(json, nb_edit_member(json, owner->node, key));
    char words[4 * NB_EDIT_NUMBERS] = "{";
    if (object.last_end != 0) {
        save_places(save, json, &object, places, NB_ALL_PLACES, was, now);
        return;
    }
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

/* ---- fog ------------------------------------------------------------------------------------- */

static bool is_zero(const double rgb[3])
{
    return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0;
}

/* The file's own word for the amount stays, unless it has none for an extinction of 0. */
static void save_amount(nb_save *save, const nb_json *json, const nb_edit_object *volume, const double was[3],
                        const double now[3])
{
    const nb_json_node *visibility = nb_edit_member(json, volume->node, "visibility");
    const nb_json_node *path = nb_edit_member(json, volume->node, "mean_free_path");
    const nb_json_node *contrast = nb_edit_member(json, volume->node, "contrast");
    const nb_json_node *length = visibility != NULL ? visibility : path;
    double scale = 1, lengths_was[3], lengths_now[3];
    if (memcmp(was, now, sizeof lengths_was) == 0) return;
    if (length == NULL) {
        nb_edit_numbers(&save->edit, json, volume, "extinction", 3, was, now, NB_EDIT_AMOUNT);
        return;
    }
    if (!(now[0] > 0 && now[1] > 0 && now[2] > 0)) {
        char words[NB_EDIT_NUMBERS + 16] = "\"extinction\": ";
        nb_edit_write_numbers(3, now, NB_EDIT_AMOUNT, words + strlen(words));
        nb_edit_put(&save->edit, length->key_offset, length->end - length->key_offset, words);
        return;
    }
    if (visibility != NULL) scale = -log(contrast != NULL ? contrast->number : 0.05);
    for (int i = 0; i < 3; i++) {
        lengths_was[i] = scale / was[i];
        lengths_now[i] = was[i] == now[i] ? lengths_was[i] : scale / now[i];
    }
    nb_edit_numbers(&save->edit, json, volume, visibility != NULL ? "visibility" : "mean_free_path", 3, lengths_was,
                    lengths_now, NB_EDIT_AMOUNT);
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
    save_places(save, json, &density, nb_density_places, nb_density_masks[now->type], was, now);
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
    save_places(save, in->json, &shape, nb_shape_places, nb_shape_masks[now->type], &a, &b);
    save_planes(save, in, nb_edit_member(in->json, node, "planes"), was, now);
    const nb_json_node *parts = nb_edit_member(in->json, node, "shapes");
    const nb_json_node *part = parts != NULL ? nb_json_first(in->json, parts) : NULL;
    for (size_t i = 0; i < now->part_count && part != NULL; i++, part = nb_json_next(in->json, part))
        save_shape(save, in, part, &was->parts[i], &now->parts[i]);
    save_object(save, in->json, &shape, "transform", nb_transform_places, &a.transform, &b.transform);
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

/* What the volume is now needs no such key, and the file may have it. */
typedef struct lost_keys {
    const char *names[6]; /* NULL ends them */
    unsigned mask;        /* the places of the volume that stay */
} lost_keys;

static void lose(lost_keys *lost, const char *key)
{
    size_t count = 0;
    while (lost->names[count] != NULL) count++;
    lost->names[count] = key;
    for (unsigned i = 0; nb_volume_places[i].key != NULL; i++)
        if (strcmp(nb_volume_places[i].key, key) == 0) lost->mask &= ~(1u << i);
}

static bool has_changed_to(const double was[3], const double now[3])
{
    return !is_zero(now) && memcmp(was, now, sizeof(double[3])) != 0;
}

static lost_keys find_lost_keys(const nebel_volume_desc *was, const nebel_volume_desc *now)
{
    lost_keys lost = {.mask = NB_ALL_PLACES};
    const bool is_clear = !(now->extinction[0] > 0 && now->extinction[1] > 0 && now->extinction[2] > 0);
    if (now->cutoff == 0 && was->cutoff != 0) lose(&lost, "cutoff");
    if (is_clear && memcmp(was->extinction, now->extinction, sizeof was->extinction) != 0) lose(&lost, "contrast");
    if (has_changed_to(was->albedo, now->albedo) && is_zero(now->source)) lose(&lost, "source");
    if (has_changed_to(was->source, now->source) && is_zero(now->albedo)) {
        lose(&lost, "albedo");
        lose(&lost, "phase");
    }
    return lost;
}

static void save_fog(nb_save *save, const nb_json *json, const nb_edit_object *volume, const nebel_volume_desc *was,
                     const nebel_volume_desc *now)
{
    const lost_keys lost = find_lost_keys(was, now);
    save_density(save, json, volume->node, &was->density, &now->density);
    save_integer(save, json, volume, "priority", was->priority, now->priority);
    save_places(save, json, volume, nb_volume_places, lost.mask, was, now);
    save_amount(save, json, volume, was->extinction, now->extinction);
    nb_edit_remove_members(&save->edit, json, volume->node, lost.names);
}

static void change_volume(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, size_t index,
                          size_t target)
{
    const nb_json *json = in->json;
    const char *name = save->changed->volume_names[target];
    nebel_volume_desc was = save->before->volumes[index], now = save->changed->volumes[target];
    const nb_edit_object volume = nb_edit_find(json, node);
    save_shape(save, in, nb_edit_member(json, node, "shape"), &was.shape, &now.shape);
    nb_space_restore_volume(&in->space, &was);
    nb_space_restore_volume(&in->space, &now);
    save_fog(save, json, &volume, &was, &now);
    if (strcmp(save->before->volume_names[index], name) != 0) nb_edit_word(&save->edit, json, &volume, "name", name);
}

/* The words of a whole volume; NULL, with a note in the edit, when memory is out. */
static char *write_volume(nb_save *save, const nb_scene_reader *in, size_t target)
{
    nb_bytes text;
    if (nb_save_write_volume(&save->edit.arena.allocator, &in->space, &save->changed->volumes[target],
                             save->changed->volume_names[target], &text))
        return (char *)text.data;
    save->edit.out_of_memory = true;
    return NULL;
}

static void replace_volume(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, size_t target)
{
    char *words = write_volume(save, in, target);
    if (words != NULL) nb_edit_replace(&save->edit, node, words);
    nb_release(&save->edit.arena.allocator, words);
}

static bool keep_span(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, bool goes)
{
    void *spans = save->spans;
    if (!nb_grow(&save->edit.arena.allocator, &spans, sizeof *save->spans, save->span_count, &save->span_capacity,
                 save->span_count + 1))
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    save->spans = spans;
    save->spans[save->span_count++] = (nb_edit_span){node->offset, node->end, goes};
    return true;
}

/* An entry that stands for itself: what other programs' settings become stays. */
static bool save_entry(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const size_t target = save->targets[index];
    const nebel_volume_origin origin = in->scene->volume_origins[index];
    const bool goes = target == NEBEL_NEW_VOLUME;
    if (!goes && origin == NEBEL_VOLUME_WRITTEN) {
        if (is_same_kind(&save->before->volumes[index], &save->changed->volumes[target]))
            change_volume(save, in, node, index, target);
        else
            replace_volume(save, in, node, target);
    }
    return keep_span(save, in, node, goes && origin != NEBEL_VOLUME_IMPORTED);
}

bool nb_save_volume(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t first)
{
    for (size_t i = first; i < in->scene->data.volume_count; i++)
        if (i >= save->before->volume_count || !is_same_kind(&in->scene->volumes[i], &save->before->volumes[i]))
            return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                                "is another volume than the one to be written; the file has changed, load it again");
    if (first == in->scene->data.volume_count) return keep_span(save, in, node, false);
    return save_entry(save, in, node, first);
}

/* Of volumes that go, all do; those that models and other programs bring cannot. */
static bool check_removed(const nb_save *save, const nb_scene_reader *in, const nb_json_node *root)
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
    for (size_t i = 0; i < save->span_count; i++)
        if (!save->spans[i].goes) last = &save->spans[i];
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

static void save_entries(nb_save *save, const nb_scene_reader *in, const nb_json_node *array)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    for (size_t i = 0; i < save->changed->volume_count; i++) {
        if (save->sources == NULL || save->sources[i] != NEBEL_NEW_VOLUME) continue;
        char *words = write_volume(save, in, i);
        if (words != NULL) add_entry(save, array, words);
        nb_release(allocator, words);
    }
    nb_edit_remove(&save->edit, save->spans, save->span_count);
}

/* ---- nebulae --------------------------------------------------------------------------------- */

static bool is_same_nebula(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return is_same_form(&a->shape, &b->shape) && a->density.type == b->density.type &&
           (a->points == NULL) == (b->points == NULL);
}

static void change_nebula(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nb_json *json = in->json;
    nebel_nebula_desc was = save->before->nebulae[index], now = save->changed->nebulae[index];
    const nb_edit_object nebula = nb_edit_find(json, node);
    const bool loses_size = now.turbulence_size == 0;
    save_shape(save, in, nb_edit_member(json, node, "shape"), &was.shape, &now.shape);
    nb_space_restore_nebula(&in->space, &was);
    nb_space_restore_nebula(&in->space, &now);
    if (loses_size) was.turbulence_size = 0;
    save_density(save, json, node, &was.density, &now.density);
    save_places(save, json, &nebula, nb_nebula_places, NB_ALL_PLACES, &was, &now);
    if (now.points == NULL) save_integer(save, json, &nebula, "count", (double)was.count, (double)now.count);
    save_integer(save, json, &nebula, "seed", (double)was.seed, (double)now.seed);
    if (was.profile != now.profile) nb_edit_word(&save->edit, json, &nebula, "profile", nb_profile_names[now.profile]);
    if (loses_size) nb_edit_remove_members(&save->edit, json, node, (const char *const[]){"turbulence_size", NULL});
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
    save_places(save, in->json, &cell, nb_cell_places, NB_ALL_PLACES, &was, &now);
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

/* ---- camera and light ------------------------------------------------------------------------ */

#define CAMERA_PLACE(member, count)                                                                                    \
    {                                                                                                                  \
#member, offsetof(nebel_camera, member), count, NB_EDIT_EACH                                                   \
    }

static const nb_place camera_places[] = {
    CAMERA_PLACE(position, 3),     CAMERA_PLACE(look_at, 3),     CAMERA_PLACE(up, 3),
    CAMERA_PLACE(vertical_fov, 1), CAMERA_PLACE(view_height, 1), {NULL, 0, 0, NB_EDIT_EACH},
};

static bool is_same_camera(const nebel_camera *a, const nebel_camera *b)
{
    for (size_t i = 0; camera_places[i].key != NULL; i++)
        if (nb_place_differs(a, b, &camera_places[i])) return false;
    return true;
}

/* Without a look_at of its own a camera looks ahead from wherever it is, so that one that moves needs one. */
static void save_camera(nb_save *save, const nb_scene_reader *in)
{
    const nb_json_node *camera = nb_edit_member(in->json, save->root.node, "camera");
    nebel_camera was = save->before->camera, now = save->changed->camera;
    if (is_same_camera(&was, &now)) return;
    nb_space_restore_camera(&in->space, &was);
    nb_space_restore_camera(&in->space, &now);
    if (nb_edit_member(in->json, camera, "look_at") == NULL) was.look_at[0] = HUGE_VAL;
    save_object(save, in->json, &save->root, "camera", camera_places, &was, &now);
}

static void save_sun(nb_save *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_scene_data *before = save->before, *changed = save->changed;
    const nb_edit_object sun = nb_edit_find(in->json, node);
    double was[3], now[3];
    memcpy(was, before->sun_direction, sizeof was);
    memcpy(now, changed->sun_direction, sizeof now);
    nb_space_restore_direction(&in->space, was);
    nb_space_restore_direction(&in->space, now);
    nb_edit_numbers(&save->edit, in->json, &sun, "direction", 3, was, now, NB_EDIT_WHOLE);
    nb_edit_numbers(&save->edit, in->json, &sun, "irradiance", 3, before->sun_irradiance, changed->sun_irradiance,
                    NB_EDIT_AMOUNT);
}

enum { CAMERA, AMBIENT, BACKGROUND, MAX_OPACITY, SECTIONS };

static const char *const section_names[SECTIONS] = {"camera", "ambient", "background", "max_opacity"};

static void save_section(nb_save *save, const nb_scene_reader *in, int section)
{
    const nebel_scene_data *was = save->before, *now = save->changed;
    const double *const from[SECTIONS] = {NULL, was->ambient, was->background, &was->max_opacity};
    const double *const to[SECTIONS] = {NULL, now->ambient, now->background, &now->max_opacity};
    save->done[section] = true;
    if (section == CAMERA)
        save_camera(save, in);
    else
        nb_edit_numbers(&save->edit, in->json, &save->root, section_names[section], section == MAX_OPACITY ? 1 : 3,
                        from[section], to[section], NB_EDIT_AMOUNT);
}

void nb_save_section(nb_save *save, const nb_scene_reader *in, const nb_json_node *node)
{
    save->root = (nb_edit_object){nb_json_parent(in->json, node), node->key_offset, node->end};
    for (int i = 0; i < SECTIONS; i++)
        if (nb_json_has_key(node, section_names[i])) save_section(save, in, i);
    if (nb_json_has_key(node, "sun")) save_sun(save, in, node);
    if (nb_json_has_key(node, "fog")) save_entries(save, in, node);
}

bool nb_save_rest(nb_save *save, const nb_scene_reader *in, const nb_json_node *root)
{
    save->root.node = root;
    for (int i = 0; i < SECTIONS; i++)
        if (!save->done[i]) save_section(save, in, i);
    if (in->scene->data.volume_count != save->before->volume_count)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has %zu volumes of fog where %zu were; the file has changed, load it again",
                            in->scene->data.volume_count, save->before->volume_count);
    if (in->scene->data.cells == NULL && save->before->cells != NULL)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has no cells where some were; the file has changed, load it again");
    return check_removed(save, in, root);
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
    nb_release(allocator, save->spans);
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
