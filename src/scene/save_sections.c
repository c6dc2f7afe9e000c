/* Changed light and models, back into the file that the scene came from. */
#include "key_patch.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- light ----------------------------------------------------------------------------------- */

static void restore_sun(const nb_file_units *space, const nebel_scene_data *scene, double direction[3])
{
    memcpy(direction, scene->sun_direction, sizeof scene->sun_direction);
    nb_file_units_restore_direction(space, direction);
}

static void save_sun(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_scene_data *before = save->before, *changed = save->changed;
    const nb_json_patch_object sun = nb_json_patch_find(in->json, node);
    double was[3], now[3];
    restore_sun(&in->space, before, was);
    restore_sun(&in->space, changed, now);
    nb_json_patch_numbers(&save->edit, in->json, &sun, "direction", 3, was, now, NB_EDIT_WHOLE);
    nb_json_patch_numbers(&save->edit, in->json, &sun, "irradiance", 3, before->sun_irradiance, changed->sun_irradiance,
                          NB_EDIT_AMOUNT);
}

static void add_sun(nb_key_patch *save, const nb_file_units *space)
{
    char direction[NB_EDIT_NUMBERS], irradiance[NB_EDIT_NUMBERS], words[3 * NB_EDIT_NUMBERS];
    double now[3];
    restore_sun(space, save->changed, now);
    nb_json_patch_write_numbers(3, now, NB_EDIT_EACH, direction);
    nb_json_patch_write_numbers(3, save->changed->sun_irradiance, NB_EDIT_AMOUNT, irradiance);
    snprintf(words, sizeof words, "{ \"direction\": %s, \"irradiance\": %s }", direction, irradiance);
    nb_json_patch_add(&save->edit, &save->root, "sun", words);
}

/* ---- point lights ----------------------------------------------------------------------------------- */

static void restore_light(const nb_file_units *space, nebel_light *light)
{
    nb_file_units_restore_place(space, light->position);
    nb_file_units_restore_direction(space, light->direction);
    light->radius /= space->unit;
}

static void change_light(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, nebel_light was,
                         nebel_light now)
{
    const nb_json_patch_object object = nb_json_patch_find(in->json, node);
    restore_light(&in->space, &was);
    restore_light(&in->space, &now);
    nb_key_patch_places(save, in->json, &object, nb_light_places, NB_ALL_PLACES, &was, &now);
}

bool nb_key_patch_light(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nebel_scene_data *before = save->before;
    if (index >= before->light_count || in->scene->lights[index].type != before->lights[index].type)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "is another light than the one to be written; the file has changed, load it again");
    change_light(save, in, node, before->lights[index], save->changed->lights[index]);
    return true;
}

/* ---- models ---------------------------------------------------------------------------------- */

static const nebel_scene_model *find_model(const nebel_scene_data *scene, size_t source)
{
    for (size_t i = 0; i < scene->model_count; i++)
        if (scene->models[i].model_index == source) return &scene->models[i];
    return NULL;
}

static void restore_model(const nb_file_units *space, nebel_scene_model *model)
{
    nb_file_units_restore_placement(space, model->position, model->rotation, model->scale);
    for (int i = 0; i < 2; i++) model->size[i] /= space->unit;
    model->height /= space->unit;
}

static void save_model_color(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object,
                             const nebel_scene_model *was, const nebel_scene_model *now)
{
    double from[3];
    memcpy(from, was->color, sizeof from);
    if (!was->has_color) from[0] = HUGE_VAL;
    if (now->has_color) nb_json_patch_numbers(&save->edit, json, object, "color", 3, from, now->color, NB_EDIT_AMOUNT);
    if (was->has_color && !now->has_color)
        nb_json_patch_remove_members(&save->edit, json, object->node, (const char *const[]){"color", NULL});
}

static void change_model(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, nebel_scene_model was,
                         nebel_scene_model now)
{
    const nb_json_patch_object object = nb_json_patch_find(in->json, node);
    const nb_json_patch_object field =
        nb_json_patch_find(in->json, nb_json_patch_member(in->json, node, "heightfield"));
    restore_model(&in->space, &was);
    restore_model(&in->space, &now);
    nb_key_patch_places(save, in->json, &object, nb_model_places, field.node != NULL ? 1 : NB_ALL_PLACES, &was, &now);
    if (field.node != NULL)
        nb_key_patch_places(save, in->json, &field, nb_height_field_places, NB_ALL_PLACES, &was, &now);
    save_model_color(save, in->json, &object, &was, &now);
}

bool nb_key_patch_model(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nebel_scene_data *before = save->before;
    if (index >= before->model_count || strcmp(in->scene->models[index].file, before->models[index].path) != 0)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "is another model than the one to be written; the file has changed, load it again");
    const nebel_scene_model *now = find_model(save->changed, index);
    if (now != NULL) change_model(save, in, node, before->models[index], *now);
    return nb_key_patch_keep_span(save, in, &save->models, node, now == NULL);
}

/* ---- sections -------------------------------------------------------------------------------- */

enum {
    SAVE_CAMERA,
    SAVE_AMBIENT,
    SAVE_BACKGROUND,
    SAVE_MAX_OPACITY,
    SAVE_SUN,
    SAVE_CLASSIC,
    SAVE_FOG,
    SAVE_MODELS,
    SAVE_SECTIONS
};

static const char *const saved_names[SAVE_SECTIONS] = {"camera", "ambient", "background", "max_opacity",
                                                       "sun",    "classic", "fog",        "models"};

/* Of a section that comes or goes as a whole. */
static bool is_there(const nebel_scene_data *scene, int section)
{
    if (section == SAVE_SUN) return scene->has_sun;
    return section == SAVE_CLASSIC ? scene->classic != NULL : true;
}

/* `node`: where it stands; NULL: it is not in the file. */
static void save_light(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, int section)
{
    if (section == SAVE_AMBIENT)
        nb_key_patch_ambient(save, in, node);
    else if (section == SAVE_BACKGROUND)
        nb_key_patch_background(save, in, node);
    else
        nb_json_patch_numbers(&save->edit, in->json, &save->root, saved_names[section], 1, &save->before->max_opacity,
                              &save->changed->max_opacity, NB_EDIT_AMOUNT);
}

/* One that is in the file, and stays there. */
static void save_section(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, int section)
{
    switch (section) {
    case SAVE_CAMERA:
        nb_key_patch_camera(save, in);
        break;
    case SAVE_SUN:
        save_sun(save, in, node);
        break;
    case SAVE_CLASSIC:
        nb_key_patch_classic(save, in, node);
        break;
    case SAVE_FOG:
        nb_key_patch_entries(save, in, node);
        break;
    case SAVE_MODELS:
        nb_json_patch_remove(&save->edit, save->models.spans, save->models.count);
        break;
    default:
        save_light(save, in, node, section);
    }
}

void nb_key_patch_section(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node)
{
    int section = 0;
    while (section < SAVE_SECTIONS && !nb_json_has_key(node, saved_names[section])) section++;
    /* A file that has got such a section since is refused at its end. */
    const bool is_new = section < SAVE_SECTIONS && !is_there(save->before, section);
    const bool goes = section < SAVE_SECTIONS && !is_there(save->changed, section);
    save->sections[save->section_count++] = (nb_json_patch_span){node->key_offset, node->end, goes};
    if (!goes) save->root = (nb_json_patch_object){nb_json_parent(in->json, node), node->key_offset, node->end};
    if (section == SAVE_SECTIONS) return;
    save->done |= 1u << section;
    if (!goes && !is_new) save_section(save, in, node, section);
}

/* One that is not in the file. */
static void add_section(nb_key_patch *save, const nb_scene_reader *in, int section)
{
    if (section == SAVE_CAMERA)
        nb_key_patch_camera(save, in);
    else if (section <= SAVE_MAX_OPACITY)
        save_light(save, in, NULL, section);
    else if (section == SAVE_SUN && save->changed->has_sun)
        add_sun(save, &in->space);
    else if (section == SAVE_CLASSIC && save->changed->classic != NULL)
        nb_key_patch_add_classic(save, &in->space);
}

static bool check_counts(const nb_scene_reader *in, const nb_key_patch *save, const nb_json_node *root)
{
    const nebel_scene_data *before = save->before, *changed = save->changed;
    const nebel_scene_data *now = &in->scene->data;
    if (now->volume_count != before->volume_count)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has %zu volumes of fog where %zu were; the file has changed, load it again",
                            now->volume_count, before->volume_count);
    if (in->scene->model_count != before->model_count)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has %zu models where %zu were; the file has changed, load it again",
                            in->scene->model_count, before->model_count);
    if (now->light_count != before->light_count)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has %zu lights where %zu were; the file has changed, load it again", now->light_count,
                            before->light_count);
    /* The sky of a planet is in no file. */
    const bool is_sky = before->environment.type == NEBEL_ENVIRONMENT_MAP && before->environment_path == NULL;
    if (now->environment.type != before->environment.type && !is_sky)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "has not the ambient light that it had; the file has changed, load it again");
    if (now->environment.type != changed->environment.type && changed->environment.type == NEBEL_ENVIRONMENT_MAP &&
        !is_sky)
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                            "names no picture of its ambient light; write one into the file");
    if ((now->cells == NULL) == (before->cells == NULL) && (now->classic == NULL) == (before->classic == NULL) &&
        now->has_sun == before->has_sun && nb_key_patch_has_same_planets(now, before))
        return true;
    return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, root,
                        "has not the sections that it had; the file has changed, load it again");
}

bool nb_key_patch_rest(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *root)
{
    if (!check_counts(in, save, root) || !nb_key_patch_check_removed(save, in, root)) return false;
    save->root.node = root;
    for (int i = 0; i < SAVE_SECTIONS; i++)
        if ((save->done >> i & 1) == 0) add_section(save, in, i);
    nb_json_patch_remove(&save->edit, save->sections, save->section_count);
    return true;
}
