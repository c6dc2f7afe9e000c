/* Changed ambient light and background, back into the file that the scene came from. */
#include "key_patch.h"

#include <stdio.h>
#include <string.h>

/* In the place of the section, or where it would stand. */
static void put_member(nb_key_patch *save, const nb_json_node *node, const char *key, const char *words)
{
    if (node != NULL)
        nb_json_patch_replace(&save->edit, node, words);
    else
        nb_json_patch_add(&save->edit, &save->root, key, words);
}

static void put_color(nb_key_patch *save, const nb_json_node *node, const char *key, const double color[3])
{
    char words[NB_EDIT_NUMBERS];
    nb_json_patch_write_numbers(3, color, NB_EDIT_AMOUNT, words);
    put_member(save, node, key, words);
}

static void put_gradient(nb_key_patch *save, const nb_json_node *node, const nebel_environment *now)
{
    char zenith[NB_EDIT_NUMBERS], horizon[NB_EDIT_NUMBERS], ground[NB_EDIT_NUMBERS], words[4 * NB_EDIT_NUMBERS];
    nb_json_patch_write_numbers(3, now->zenith, NB_EDIT_AMOUNT, zenith);
    nb_json_patch_write_numbers(3, now->horizon, NB_EDIT_AMOUNT, horizon);
    nb_json_patch_write_numbers(3, now->ground, NB_EDIT_AMOUNT, ground);
    snprintf(words, sizeof words, "{ \"type\": \"gradient\", \"zenith\": %s, \"horizon\": %s, \"ground\": %s }", zenith,
             horizon, ground);
    put_member(save, node, "ambient", words);
}

static void change_environment(nb_key_patch *save, const nb_json *json, const nb_json_node *node)
{
    const nebel_environment *was = &save->before->environment, *now = &save->changed->environment;
    const nb_json_patch_object object = nb_json_patch_find(json, node);
    nb_edit *edit = &save->edit;
    if (now->type == NEBEL_ENVIRONMENT_GRADIENT) {
        nb_json_patch_numbers(edit, json, &object, "zenith", 3, was->zenith, now->zenith, NB_EDIT_AMOUNT);
        nb_json_patch_numbers(edit, json, &object, "horizon", 3, was->horizon, now->horizon, NB_EDIT_AMOUNT);
        nb_json_patch_numbers(edit, json, &object, "ground", 3, was->ground, now->ground, NB_EDIT_AMOUNT);
    } else {
        nb_json_patch_numbers(edit, json, &object, "rotation", 1, &was->rotation, &now->rotation, NB_EDIT_EACH);
        nb_json_patch_numbers(edit, json, &object, "intensity", 1, &was->intensity, &now->intensity, NB_EDIT_EACH);
    }
}

/* A file whose ambient light has become of another type is refused at its end, as is a map that is new. */
void nb_key_patch_ambient(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_scene_data *was = save->before, *now = save->changed;
    const nebel_environment_type type = now->environment.type;
    if (in->scene->data.environment.type != was->environment.type) return;
    if (type == NEBEL_ENVIRONMENT_CONSTANT && was->environment.type == type)
        nb_json_patch_numbers(&save->edit, in->json, &save->root, "ambient", 3, was->ambient, now->ambient,
                              NB_EDIT_AMOUNT);
    else if (was->environment.type == type)
        change_environment(save, in->json, node);
    else if (type == NEBEL_ENVIRONMENT_GRADIENT)
        put_gradient(save, node, &now->environment);
    else
        put_color(save, node, "ambient", now->ambient);
}

void nb_key_patch_background(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_scene_data *was = save->before, *now = save->changed;
    if (!was->shows_ambient && !now->shows_ambient)
        nb_json_patch_numbers(&save->edit, in->json, &save->root, "background", 3, was->background, now->background,
                              NB_EDIT_AMOUNT);
    else if (now->shows_ambient && !was->shows_ambient)
        put_member(save, node, "background", "\"ambient\"");
    else if (!now->shows_ambient)
        put_color(save, node, "background", now->background);
}
