/* Changed cells and portals, back into the file. */
#include "scene/save.h"

#include <stdio.h>
#include <string.h>

static bool are_same_cells(const nebel_cells_desc *a, const nebel_cells_desc *b)
{
    if (b == NULL || a->cell_count != b->cell_count) return false;
    for (size_t i = 0; i < a->cell_count; i++)
        if (!nb_save_is_same_form(&a->cells[i].shape, &b->cells[i].shape)) return false;
    return true;
}

static void change_cell(nb_save *save, const nb_scene_reader *in, const nb_json_node *node, nebel_cell was,
                        nebel_cell now)
{
    const nb_edit_object cell = nb_edit_find(in->json, node);
    nb_save_shape(save, in, nb_edit_member(in->json, node, "shape"), &was.shape, &now.shape);
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
