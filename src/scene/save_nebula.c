/* Changed nebulae, back into the file. */
#include "key_patch.h"

#include <stdio.h>
#include <string.h>

static bool is_same_nebula(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return nb_key_patch_is_same_form(&a->shape, &b->shape) && a->density.type == b->density.type &&
           (a->points == NULL) == (b->points == NULL);
}

/* Text of its own for any number of them: some twenty bytes for each number. */
static void write_colors(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *nebula,
                         const nebel_nebula_desc *now)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    const nb_json_node *node = nb_json_patch_member(json, nebula->node, "colors");
    const size_t size = 8 + now->color_count * (NB_EDIT_NUMBERS + 2);
    char *words = nb_allocate(allocator, size, 1);
    size_t used = 0;
    if (words == NULL) {
        save->edit.out_of_memory = true;
        return;
    }
    for (size_t i = 0; i < now->color_count; i++) {
        used += (size_t)snprintf(words + used, size - used, i == 0 ? "[" : ", ");
        nb_json_patch_write_numbers(3, now->colors[i], NB_EDIT_AMOUNT, words + used);
        used += strlen(words + used);
    }
    snprintf(words + used, size - used, "]");
    if (node != NULL)
        nb_json_patch_replace(&save->edit, node, words);
    else
        nb_json_patch_add(&save->edit, nebula, "colors", words);
    nb_release(allocator, words);
}

static void save_colors(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *nebula,
                        const nebel_nebula_desc *was, const nebel_nebula_desc *now)
{
    if (now->color_count == 0) return;
    if (was->color_count != now->color_count) {
        write_colors(save, json, nebula, now);
        return;
    }
    const nb_json_node *node = nb_json_first(json, nb_json_patch_member(json, nebula->node, "colors"));
    for (size_t i = 0; i < now->color_count; i++, node = nb_json_next(json, node)) {
        char words[NB_EDIT_NUMBERS];
        if (memcmp(was->colors[i], now->colors[i], sizeof *now->colors) == 0) continue;
        nb_json_patch_write_numbers(3, now->colors[i], NB_EDIT_AMOUNT, words);
        nb_json_patch_replace(&save->edit, node, words);
    }
}

static void save_points(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, nebel_transform was,
                        nebel_transform now)
{
    const nb_json_patch_object points = nb_json_patch_find(in->json, nb_json_patch_member(in->json, node, "points"));
    if (points.node == NULL) return;
    nb_file_units_restore_placement(&in->space, was.position, was.rotation, was.scale);
    nb_file_units_restore_placement(&in->space, now.position, now.rotation, now.scale);
    nb_key_patch_places(save, in->json, &points, nb_transform_places, NB_ALL_PLACES, &was, &now);
}

static void change_nebula(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nb_json *json = in->json;
    nebel_nebula_desc was = save->before->nebulae[index], now = save->changed->nebulae[index];
    const nb_json_patch_object nebula = nb_json_patch_find(json, node);
    const bool loses_size = now.turbulence_scale == 0;
    nb_removed_keys lost = {{NULL}};
    if (loses_size) nb_key_patch_lose(&lost, "turbulence_scale");
    if (now.color_count == 0) nb_key_patch_lose(&lost, "colors");
    nb_key_patch_shape(save, in, nb_json_patch_member(json, node, "shape"), &was.shape, &now.shape);
    nb_file_units_restore_nebula(&in->space, &was);
    nb_file_units_restore_nebula(&in->space, &now);
    if (loses_size) was.turbulence_scale = 0;
    nb_key_patch_density(save, json, node, &was.density, &now.density);
    nb_key_patch_places(save, json, &nebula, nb_nebula_places, NB_ALL_PLACES, &was, &now);
    if (now.points == NULL) {
        nb_key_patch_integer(save, json, &nebula, "count", (double)was.count, (double)now.count);
        nb_key_patch_places(save, json, &nebula, nb_generated_places, NB_ALL_PLACES, &was, &now);
    }
    nb_key_patch_integer(save, json, &nebula, "seed", (double)was.seed, (double)now.seed);
    if (strcmp(save->before->nebula_names[index], save->changed->nebula_names[index]) != 0)
        nb_json_patch_word(&save->edit, json, &nebula, "name", save->changed->nebula_names[index]);
    if (was.profile != now.profile)
        nb_json_patch_word(&save->edit, json, &nebula, "profile", nb_profile_names[now.profile]);
    save_colors(save, json, &nebula, &was, &now);
    save_points(save, in, node, save->before->nebula_transforms[index], save->changed->nebula_transforms[index]);
    nb_json_patch_remove_members(&save->edit, json, node, lost.names);
}

bool nb_key_patch_nebula(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    if (index >= save->before->nebula_count ||
        !is_same_nebula(&in->scene->nebulae[index], &save->before->nebulae[index]))
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "is another nebula than the one to be written; the file has changed, load it again");
    change_nebula(save, in, node, index);
    return true;
}
