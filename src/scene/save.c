/* Changed numbers, back into the file that the scene came from. */
#include "scene/save.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- where numbers stand
 * --------------------------------------------------------------------------------------------- */

typedef struct place {
    const char *key;
    size_t offset, count;
    nb_edit_style style;
} place;

#define PLACE(type, member, count, style)                                                                              \
    {                                                                                                                  \
#member, offsetof(type, member), count, style                                                                  \
    }

static const place volume_places[] = {
    PLACE(nebel_volume_desc, start, 1, NB_EDIT_EACH),      PLACE(nebel_volume_desc, cutoff, 1, NB_EDIT_EACH),
    PLACE(nebel_volume_desc, source, 3, NB_EDIT_AMOUNT),   PLACE(nebel_volume_desc, albedo, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_volume_desc, emission, 3, NB_EDIT_AMOUNT),
};

static const place shape_places[] = {
    PLACE(nebel_shape, min, 3, NB_EDIT_EACH),       PLACE(nebel_shape, max, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, center, 3, NB_EDIT_EACH),    PLACE(nebel_shape, radius, 1, NB_EDIT_EACH),
    PLACE(nebel_shape, radii, 3, NB_EDIT_EACH),     PLACE(nebel_shape, from, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, to, 3, NB_EDIT_EACH),        PLACE(nebel_shape, radius_from, 1, NB_EDIT_EACH),
    PLACE(nebel_shape, radius_to, 1, NB_EDIT_EACH), PLACE(nebel_shape, point, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, normal, 3, NB_EDIT_EACH),
};

static const place transform_places[] = {
    PLACE(nebel_transform, position, 3, NB_EDIT_EACH),
    PLACE(nebel_transform, rotation, 4, NB_EDIT_WHOLE),
    PLACE(nebel_transform, scale, 3, NB_EDIT_AMOUNT),
};

static const place density_places[] = {
    PLACE(nebel_density, base, 1, NB_EDIT_EACH),     PLACE(nebel_density, scale_height, 1, NB_EDIT_EACH),
    PLACE(nebel_density, from, 3, NB_EDIT_EACH),     PLACE(nebel_density, to, 3, NB_EDIT_EACH),
    PLACE(nebel_density, center, 3, NB_EDIT_EACH),   PLACE(nebel_density, sigma, 1, NB_EDIT_EACH),
    PLACE(nebel_density, distance, 1, NB_EDIT_EACH),
};

static const place camera_places[] = {
    PLACE(nebel_camera, position, 3, NB_EDIT_EACH),    PLACE(nebel_camera, look_at, 3, NB_EDIT_EACH),
    PLACE(nebel_camera, up, 3, NB_EDIT_EACH),          PLACE(nebel_camera, vertical_fov, 1, NB_EDIT_EACH),
    PLACE(nebel_camera, view_height, 1, NB_EDIT_EACH),
};

#define COUNT_OF(array) (sizeof(array) / sizeof *(array))

static const double *numbers_at(const void *structure, const place *where)
{
    return (const double *)((const char *)structure + where->offset);
}

static bool differs(const void *was, const void *now, const place *where)
{
    return memcmp(numbers_at(was, where), numbers_at(now, where), where->count * sizeof(double)) != 0;
}

static void save_places(nb_save *save, const nb_json *json, const nb_edit_object *object, const place *places,
                        size_t count, const void *was, const void *now)
{
    for (size_t i = 0; i < count; i++)
        nb_edit_numbers(&save->edit, json, object, places[i].key, places[i].count, numbers_at(was, &places[i]),
                        numbers_at(now, &places[i]), places[i].style);
}

/* The same for an object that the file may lack: then it is added, with what has changed. */
static void save_object(nb_save *save, const nb_json *json, const nb_edit_object *owner, const char *key,
                        const place *places, size_t count, const void *was, const void *now)
{
    const nb_edit_object object = nb_edit_find(json, nb_edit_member(json, owner->node, key));
    char words[4 * NB_EDIT_NUMBERS] = "{";
    if (object.last_end != 0) {
        save_places(save, json, &object, places, count, was, now);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        char numbers[NB_EDIT_NUMBERS];
        if (!differs(was, now, &places[i])) continue;
        const size_t used = strlen(words);
        nb_edit_write_numbers(places[i].count, numbers_at(now, &places[i]), places[i].style, numbers);
        snprintf(words + used, sizeof words - used, "%s\"%s\": %s", used > 1 ? ", " : " ", places[i].key, numbers);
    }
    if (words[1] == '\0') return;
    strcat(words, " }");
    if (object.node != NULL)
        nb_edit_replace(&save->edit, object.node, words);
    else
        nb_edit_add(&save->edit, owner, key, words);
}

/* ---- fog
 * ------------------------------------------------------------------------------------------------------------- */

/* The file's own word for the amount stays. */
static bool save_amount(nb_save *save, nb_json *json, const nb_edit_object *volume, const double was[3],
                        const double now[3])
{
    const nb_json_node *visibility = nb_edit_member(json, volume->node, "visibility");
    const nb_json_node *path = nb_edit_member(json, volume->node, "mean_free_path");
    const nb_json_node *contrast = nb_edit_member(json, volume->node, "contrast");
    const nb_json_node *length = visibility != NULL ? visibility : path;
    double scale = 1, lengths_was[3], lengths_now[3];
    if (memcmp(was, now, sizeof lengths_was) == 0) return true;
    if (length == NULL) {
        nb_edit_numbers(&save->edit, json, volume, "extinction", 3, was, now, NB_EDIT_AMOUNT);
        return true;
    }
    if (visibility != NULL) scale = -log(contrast != NULL ? contrast->number : 0.05);
    for (int i = 0; i < 3; i++) {
        if (!(now[i] > 0))
            return nb_json_fail(json, NEBEL_ERROR_VALUE, length,
                                "cannot be written: fog that is nowhere has no such length; give the file an "
                                "\"extinction\" in its place");
        lengths_was[i] = scale / was[i];
        lengths_now[i] = was[i] == now[i] ? lengths_was[i] : scale / now[i];
    }
    nb_edit_numbers(&save->edit, json, volume, visibility != NULL ? "visibility" : "mean_free_path", 3, lengths_was,
                    lengths_now, NB_EDIT_AMOUNT);
    return true;
}

static void save_integer(nb_save *save, const nb_json *json, const nb_edit_object *object, const char *key, int was,
                         int now)
{
    nb_edit_numbers(&save->edit, json, object, key, 1, &(double){was}, &(double){now}, NB_EDIT_EACH);
}

static void save_density(nb_save *save, const nb_json *json, const nb_json_node *node, const nebel_density *was,
                         const nebel_density *now)
{
    const nb_edit_object density = nb_edit_find(json, nb_edit_member(json, node, "density"));
    if (density.node == NULL) return;
    save_places(save, json, &density, density_places, COUNT_OF(density_places), was, now);
    save_integer(save, json, &density, "power", was->power, now->power);
    if (was->below == now->below) return;
    nb_edit_word(&save->edit, json, &density, "below", now->below == NEBEL_BELOW_CONSTANT ? "constant" : "grow");
}

static bool is_same_kind(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return a->operation == b->operation && a->shape.type == b->shape.type && a->density.type == b->density.type;
}

bool nb_save_volume(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    nb_json *json = in->json;
    if (index >= save->changed->volume_count ||
        !is_same_kind(&in->scene->volumes[index], &save->changed->volumes[index]))
        return nb_json_fail(json, NEBEL_ERROR_ARGUMENT, node,
                            "is another volume than the one to be written; the file has changed, load it again");
    if (in->scene->volume_origins[index] != NEBEL_VOLUME_WRITTEN) return true;
    nebel_volume_desc was = in->scene->volumes[index], now = save->changed->volumes[index];
    nb_space_restore_volume(&in->space, &was);
    nb_space_restore_volume(&in->space, &now);
    const nb_edit_object volume = nb_edit_find(json, node);
    const nb_edit_object shape = nb_edit_find(json, nb_edit_member(json, node, "shape"));
    save_places(save, json, &shape, shape_places, COUNT_OF(shape_places), &was.shape, &now.shape);
    save_object(save, json, &shape, "transform", transform_places, COUNT_OF(transform_places), &was.shape.transform,
                &now.shape.transform);
    save_density(save, json, node, &was.density, &now.density);
    save_integer(save, json, &volume, "priority", was.priority, now.priority);
    save_places(save, json, &volume, volume_places, COUNT_OF(volume_places), &was, &now);
    return save_amount(save, json, &volume, was.extinction, now.extinction);
}

/* ---- camera and light
 * ------------------------------------------------------------------------------------------------ */

static bool is_same_camera(const nebel_camera *a, const nebel_camera *b)
{
    for (int i = 0; i < 3; i++)
        if (a->position[i] != b->position[i] || a->look_at[i] != b->look_at[i] || a->up[i] != b->up[i]) return false;
    return a->vertical_fov == b->vertical_fov && a->view_height == b->view_height && a->projection == b->projection;
}

/* Without a look_at of its own a camera looks ahead from wherever it is, so that one that moves needs one. */
static void save_camera(nb_save *save, const nb_scene_reader *in)
{
    const nb_json_node *camera = nb_edit_member(in->json, save->root.node, "camera");
    nebel_camera was = in->scene->data.camera, now = save->changed->camera;
    if (is_same_camera(&was, &now)) return;
    nb_space_restore_camera(&in->space, &was);
    nb_space_restore_camera(&in->space, &now);
    if (nb_edit_member(in->json, camera, "look_at") == NULL) was.look_at[0] = HUGE_VAL;
    save_object(save, in->json, &save->root, "camera", camera_places, COUNT_OF(camera_places), &was, &now);
}

static void save_sun(nb_save *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_scene_data *data = &in->scene->data;
    const nb_edit_object sun = nb_edit_find(in->json, node);
    double was[3], now[3];
    memcpy(was, data->sun_direction, sizeof was);
    memcpy(now, save->changed->sun_direction, sizeof now);
    nb_space_restore_direction(&in->space, was);
    nb_space_restore_direction(&in->space, now);
    nb_edit_numbers(&save->edit, in->json, &sun, "direction", 3, was, now, NB_EDIT_WHOLE);
    nb_edit_numbers(&save->edit, in->json, &sun, "irradiance", 3, data->sun_irradiance, save->changed->sun_irradiance,
                    NB_EDIT_AMOUNT);
}

enum { CAMERA, AMBIENT, BACKGROUND, SECTIONS };

static void save_section(nb_save *save, const nb_scene_reader *in, int section)
{
    const nebel_scene_data *was = &in->scene->data, *now = save->changed;
    save->done[section] = true;
    if (section == CAMERA) save_camera(save, in);
    if (section == AMBIENT)
        nb_edit_numbers(&save->edit, in->json, &save->root, "ambient", 3, was->ambient, now->ambient, NB_EDIT_AMOUNT);
    if (section == BACKGROUND)
        nb_edit_numbers(&save->edit, in->json, &save->root, "background", 3, was->background, now->background,
                        NB_EDIT_AMOUNT);
}

void nb_save_section(nb_save *save, const nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const names[SECTIONS] = {"camera", "ambient", "background"};
    save->root = (nb_edit_object){nb_json_parent(in->json, node), node->key_offset, node->end};
    for (int i = 0; i < SECTIONS; i++)
        if (nb_json_has_key(node, names[i])) save_section(save, in, i);
    if (nb_json_has_key(node, "sun")) save_sun(save, in, node);
}

bool nb_save_rest(nb_save *save, const nb_scene_reader *in, const nb_json_node *root)
{
    save->root.node = root;
    for (int i = 0; i < SECTIONS; i++)
        if (!save->done[i]) save_section(save, in, i);
    if (in->scene->data.volume_count == save->changed->volume_count) return true;
    return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                        "has %zu volumes of fog where %zu were to be written; the file has changed, load it again",
                        in->scene->data.volume_count, save->changed->volume_count);
}

/* ---- the file
 * -------------------------------------------------------------------------------------------------------- */

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

nebel_result nebel_save_scene(const char *path, const nebel_scene_desc *desc, const nebel_scene_data *changed)
{
    nb_bytes bytes;
    if (path == NULL || desc == NULL || changed == NULL || !nb_allocator_is_valid(&desc->allocator))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->allocator);
    nebel_result result = nb_file_read(&allocator, &desc->log, NULL, "scene", path, NB_SCENE_TEXT_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    nb_save save = {.changed = changed,
                    .edit = {.text = (const char *)bytes.data, .size = bytes.size, .arena = {.allocator = allocator}}};
    result = save_text(path, desc, &save);
    nb_edit_release(&save.edit);
    nb_release(&allocator, bytes.data);
    return result;
}
