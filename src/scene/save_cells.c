/* Changed cells and portals, back into the file. */
#include "key_patch.h"

#include <string.h>

/* ---- cells ----------------------------------------------------------------------------------- */

static bool are_same_cells(const nebel_cells_desc *a, const nebel_cells_desc *b)
{
    if (b == NULL || a->cell_count != b->cell_count) return false;
    for (size_t i = 0; i < a->cell_count; i++)
        if (!nb_key_patch_is_same_form(&a->cells[i].shape, &b->cells[i].shape)) return false;
    return true;
}

static void change_cell(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, nebel_cell was,
                        nebel_cell now)
{
    const nb_json_patch_object cell = nb_json_patch_find(in->json, node);
    nb_key_patch_shape(save, in, nb_json_patch_member(in->json, node, "shape"), &was.shape, &now.shape);
    nb_file_units_restore_cell(&in->space, &was);
    nb_file_units_restore_cell(&in->space, &now);
    nb_key_patch_places(save, in->json, &cell, nb_cell_places, NB_ALL_PLACES, &was, &now);
}

/* ---- portals --------------------------------------------------------------------------------- */

/* An array, also an empty one, is all portals that there are; NULL: what the core finds. */
static bool has_same_portals(const nebel_cells_desc *a, const nebel_cells_desc *b)
{
    if ((a->portals == NULL) != (b->portals == NULL) || a->portal_count != b->portal_count) return false;
    for (size_t i = 0; i < a->portal_count; i++) {
        const nebel_portal *p = &a->portals[i], *q = &b->portals[i];
        if (p->cells[0] != q->cells[0] || p->cells[1] != q->cells[1] || p->vertex_count != q->vertex_count ||
            memcmp(p->vertices, q->vertices, p->vertex_count * sizeof *p->vertices) != 0)
            return false;
    }
    return true;
}

static void write_portal(nb_json_writer *out, const nb_file_units *space, const nebel_portal *portal,
                         const char *const *names)
{
    nb_json_writer_put(out, "{ \"cells\": [");
    nb_json_writer_put_text(out, names[portal->cells[0]]);
    nb_json_writer_put(out, ", ");
    nb_json_writer_put_text(out, names[portal->cells[1]]);
    nb_json_writer_put(out, "], \"polygon\": [");
    for (size_t i = 0; i < portal->vertex_count; i++) {
        double vertex[3] = {portal->vertices[i][0], portal->vertices[i][1], portal->vertices[i][2]};
        nb_file_units_restore_place(space, vertex);
        if (i > 0) nb_json_writer_put(out, ", ");
        nb_json_writer_put_numbers(out, 3, vertex, NB_EDIT_EACH);
    }
    nb_json_writer_put(out, "] }");
}

static void write_portals(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *section)
{
    const nebel_cells_desc *now = save->changed->cells;
    const nb_json_node *node = nb_json_patch_member(in->json, section->node, "portals");
    nb_json_writer out = {.save = save};
    nb_json_writer_put(&out, now->portals == NULL ? "\"derived\"" : "[");
    for (size_t i = 0; i < now->portal_count; i++) {
        if (i > 0) nb_json_writer_put(&out, ", ");
        write_portal(&out, &in->space, &now->portals[i], save->changed->cell_names);
    }
    if (now->portals != NULL) nb_json_writer_put(&out, "]");
    const char *words = nb_json_writer_end(&out);
    if (words != NULL && node != NULL)
        nb_json_patch_replace(&save->edit, node, words);
    else if (words != NULL)
        nb_json_patch_add(&save->edit, section, "portals", words);
    nb_release(&save->edit.arena.allocator, out.bytes.data);
}

/* Portals name their cells: those of cells that are called otherwise now do, too. */
static void rename_ends(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *portals)
{
    const nb_json_node *portal = nb_json_first(in->json, portals);
    for (size_t i = 0; portal != NULL; portal = nb_json_next(in->json, portal), i++) {
        const nb_json_node *end = nb_json_first(in->json, nb_json_patch_member(in->json, portal, "cells"));
        for (int k = 0; k < 2; k++, end = nb_json_next(in->json, end)) {
            const size_t cell = save->changed->cells->portals[i].cells[k];
            nb_json_writer out = {.save = save};
            if (strcmp(save->before->cell_names[cell], save->changed->cell_names[cell]) == 0) continue;
            nb_json_writer_put_text(&out, save->changed->cell_names[cell]);
            const char *words = nb_json_writer_end(&out);
            if (words != NULL) nb_json_patch_replace(&save->edit, end, words);
            nb_release(&save->edit.arena.allocator, out.bytes.data);
        }
    }
}

static void save_portals(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *section)
{
    const nb_json_node *node = nb_json_patch_member(in->json, section->node, "portals");
    if (!has_same_portals(save->before->cells, save->changed->cells))
        write_portals(save, in, section);
    else if (node != NULL && node->type == NB_JSON_ARRAY)
        rename_ends(save, in, node);
}

/* ---- the section ----------------------------------------------------------------------------- */

static void save_name(nb_key_patch *save, const nb_json *json, const nb_json_node *node, size_t index)
{
    const nb_json_patch_object cell = nb_json_patch_find(json, node);
    const char *name = save->changed->cell_names[index];
    if (strcmp(save->before->cell_names[index], name) != 0) nb_json_patch_word(&save->edit, json, &cell, "name", name);
}

static void save_grouping(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *section, bool grouped)
{
    const nb_json_node *grouping = nb_json_patch_member(json, section->node, "grouping");
    const char *word = grouped ? "true" : "false";
    if (grouping != NULL)
        nb_json_patch_replace(&save->edit, grouping, word);
    else
        nb_json_patch_add(&save->edit, section, "grouping", word);
}

bool nb_key_patch_cells(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node)
{
    const nebel_cells_desc *was = save->before->cells, *now = save->changed->cells;
    const nb_json_patch_object section = nb_json_patch_find(in->json, node);
    if (!are_same_cells(in->scene->data.cells, was) || !are_same_cells(was, now))
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "has other cells than those to be written; the file has changed, load it again");
    const nb_json_node *at = nb_json_first(in->json, nb_json_patch_member(in->json, node, "cells"));
    for (size_t i = 0; i < now->cell_count; i++, at = nb_json_next(in->json, at)) {
        change_cell(save, in, at, was->cells[i], now->cells[i]);
        save_name(save, in->json, at, i);
    }
    save_portals(save, in, &section);
    if (was->model != now->model)
        nb_json_patch_word(&save->edit, in->json, &section, "model", nb_cell_model_names[now->model]);
    if (was->span != now->span)
        nb_json_patch_word(&save->edit, in->json, &section, "span", nb_cell_span_names[now->span]);
    if (!was->ungrouped != !now->ungrouped) save_grouping(save, in->json, &section, !now->ungrouped);
    return true;
}
