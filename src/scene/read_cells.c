/* The section "cells": convex cells of fog and the portals between them. */
#include "scene_data.h"

#include <string.h>

/* In the order of nebel_cell_model and nebel_cell_span. */
static const char *const cell_model_names[] = {"linear", "exponential"};
static const char *const span_names[] = {"ray", "depth", "printed"};

/* ---- cells ----------------------------------------------------------------------------------- */

enum { CELL_NAME, CELL_SHAPE, CELL_DENSITY, CELL_COLOR, CELL_KEY_COUNT };

static const char *const cell_names[] = {"name", "shape", "density", "color"};
static const nb_key_set cell_keys = {cell_names, CELL_KEY_COUNT, NB_BIT(CELL_KEY_COUNT) - 1, NB_BIT(CELL_SHAPE),
                                     "a cell"};

/* What the section becomes, in the scene's arena. */
typedef struct cells_draft {
    nebel_cells_desc *desc;
    nebel_cell *cells;
    const char **names;
} cells_draft;

/* The first of `count` cells with that name; `count` where there is none. */
static size_t find_name(const cells_draft *draft, size_t count, const char *name)
{
    size_t i = 0;
    while (i < count && strcmp(draft->names[i], name) != 0) i++;
    return i;
}

static bool check_name(nb_json *json, const nb_json_node *node, const cells_draft *draft, size_t index)
{
    const char *name = draft->names[index];
    const size_t first = name[0] != '\0' ? find_name(draft, index, name) : index;
    if (first == index) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                        "is the name of cells[%zu], too; portals need to tell them apart", first);
}

static bool check_cell_shape(nb_json *json, const nb_json_node *node, nebel_shape_type type)
{
    if (type == NEBEL_SHAPE_BOX || type == NEBEL_SHAPE_CONVEX) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                        "is neither a box nor a convex body of planes; split what is not convex into cells that touch");
}

static bool read_cell(nb_scene_reader *in, const nb_json_node *node, const cells_draft *draft, size_t index)
{
    const nb_json_node *found[CELL_KEY_COUNT];
    nb_json *json = in->json;
    nebel_cell *cell = &draft->cells[index];
    *cell = (nebel_cell){.density = 0};
    draft->names[index] = "";
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "a cell {\"shape\": ...}") ||
        !nb_key_value_members(json, node, &cell_keys, found) ||
        !nb_key_value_text(json, found[CELL_NAME], &in->scene->arena, &draft->names[index]) ||
        !check_name(json, found[CELL_NAME], draft, index) || !nb_keys_read_shape(in, found[CELL_SHAPE], &cell->shape) ||
        !check_cell_shape(json, found[CELL_SHAPE], cell->shape.type) ||
        !nb_key_value_number(json, found[CELL_DENSITY], &nb_range_amount, &cell->density) ||
        !nb_key_value_color(json, found[CELL_COLOR], &nb_range_light, cell->color))
        return false;
    nb_file_units_convert_cell(&in->space, cell);
    return true;
}

static bool read_list(nb_scene_reader *in, const nb_json_node *node, cells_draft *draft)
{
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of cells")) return false;
    if (node->count < 1 || node->count > NEBEL_MAX_CELLS)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds %lu cells; must hold 1 to %d",
                            (unsigned long)node->count, NEBEL_MAX_CELLS);
    draft->cells = nb_arena_allocate(&in->scene->arena, node->count, sizeof *draft->cells);
    draft->names = nb_arena_allocate(&in->scene->arena, node->count, sizeof *draft->names);
    if (draft->cells == NULL || draft->names == NULL)
        return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at))
        if (!read_cell(in, at, draft, i++)) return false;
    draft->desc->cells = draft->cells;
    draft->desc->cell_count = node->count;
    return true;
}

/* ---- portals --------------------------------------------------------------------------------- */

static bool read_ends(nb_scene_reader *in, const nb_json_node *node, const cells_draft *draft, nebel_portal *portal)
{
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of the names of two cells")) return false;
    if (node->count != 2)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "names %lu cells; a portal joins two",
                            (unsigned long)node->count);
    const nb_json_node *at = nb_json_first(json, node);
    for (int i = 0; i < 2; i++, at = nb_json_next(json, at)) {
        const char *name = "";
        if (!nb_key_value_text(json, at, &in->scene->arena, &name)) return false;
        portal->cells[i] = name[0] != '\0' ? find_name(draft, draft->desc->cell_count, name) : draft->desc->cell_count;
        if (portal->cells[i] == draft->desc->cell_count)
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, at, "is the name of no cell");
    }
    return true;
}

static bool read_polygon(nb_scene_reader *in, const nb_json_node *node, nebel_portal *portal)
{
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of vertices [x, y, z]")) return false;
    if (node->count < 3 || node->count > NEBEL_MAX_PORTAL_VERTICES)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds %lu vertices; must hold 3 to %d",
                            (unsigned long)node->count, NEBEL_MAX_PORTAL_VERTICES);
    double(*vertices)[3] = nb_arena_allocate(&in->scene->arena, node->count, sizeof *vertices);
    if (vertices == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at), i++) {
        if (!nb_key_value_place(json, at, vertices[i])) return false;
        nb_file_units_convert_place(&in->space, vertices[i]);
    }
    portal->vertices = (const double(*)[3])vertices;
    portal->vertex_count = node->count;
    return true;
}

static bool read_portal(nb_scene_reader *in, const nb_json_node *node, const cells_draft *draft, nebel_portal *portal)
{
    enum { CELLS, POLYGON, COUNT };
    static const char *const portal_names[] = {"cells", "polygon"};
    static const nb_key_set keys = {portal_names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(COUNT) - 1, "a portal"};
    const nb_json_node *found[COUNT];
    return nb_key_value_is(in->json, node, NB_JSON_OBJECT, "a portal {\"cells\": ..., \"polygon\": ...}") &&
           nb_key_value_members(in->json, node, &keys, found) && read_ends(in, found[CELLS], draft, portal) &&
           read_polygon(in, found[POLYGON], portal);
}

/* An array, also an empty one, is all portals that there are; "derived" is what the core finds. */
static bool read_portals(nb_scene_reader *in, const nb_json_node *node, const cells_draft *draft)
{
    static const char *const derived_names[] = {"derived"};
    nb_json *json = in->json;
    if (node == NULL) return true;
    if (node->type == NB_JSON_STRING) return nb_key_value_choice(json, node, derived_names, 1) >= 0;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "\"derived\" or an array of portals")) return false;
    nebel_portal *portals = nb_arena_allocate(&in->scene->arena, node->count, sizeof *portals);
    if (portals == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at))
        if (!read_portal(in, at, draft, &portals[i++])) return false;
    draft->desc->portals = portals;
    draft->desc->portal_count = node->count;
    return true;
}

/* ---- the section ----------------------------------------------------------------------------- */

static bool read_manner(nb_json *json, const nb_json_node *model, const nb_json_node *span,
                        const nb_json_node *grouping, nebel_cells_desc *desc)
{
    int chosen_model = 0, chosen_span = 0;
    if (!nb_key_value_replace_choice(json, model, cell_model_names, NEBEL_CELL_MODEL_COUNT, &chosen_model) ||
        !nb_key_value_replace_choice(json, span, span_names, NEBEL_SPAN_COUNT, &chosen_span) ||
        (grouping != NULL && !nb_key_value_is(json, grouping, NB_JSON_BOOLEAN, "true or false")))
        return false;
    desc->model = (nebel_cell_model)chosen_model;
    desc->span = (nebel_cell_span)chosen_span;
    desc->ungrouped = grouping != NULL && grouping->number == 0;
    return true;
}

static const nb_json_node *find_element(const nb_json *json, const nb_json_node *array, size_t index)
{
    const nb_json_node *at = nb_json_first(json, array);
    for (; at != NULL && index > 0; index--) at = nb_json_next(json, at);
    return at;
}

/* What the core says of a cell or portal begins with which one it is, and the path says that already. */
static bool fail_as_core(nb_scene_reader *in, nebel_result result, const nb_json_node *node, bool is_element)
{
    const bool kept = result == NEBEL_ERROR_MEMORY || result == NEBEL_ERROR_LIMIT;
    const char *text = in->core_message[0] != '\0' ? in->core_message : nebel_result_text(result);
    const char *rest = is_element ? strstr(text, ": ") : NULL;
    return nb_json_fail(in->json, kept ? result : NEBEL_ERROR_FORMAT, node, "%s", rest != NULL ? rest + 2 : text);
}

static bool try_cells(nb_scene_reader *in, const nb_json_node *node, const nb_json_node *list,
                      const nb_json_node *portals, const nebel_cells_desc *desc)
{
    size_t cell, portal;
    nebel_cells *cells = NULL;
    nebel_cells_desc tried = *desc;
    tried.host.allocator = in->scene->allocator;
    tried.host.log = (nebel_log){nb_keys_read_keep_message, in};
    tried.failed_cell = &cell;
    tried.failed_portal = &portal;
    in->core_message[0] = '\0';
    const nebel_result result = nebel_create_cells(&tried, &cells);
    nebel_destroy_cells(cells);
    if (result == NEBEL_OK) return true;
    if (cell != SIZE_MAX) return fail_as_core(in, result, find_element(in->json, list, cell), true);
    if (portal != SIZE_MAX) return fail_as_core(in, result, find_element(in->json, portals, portal), true);
    return fail_as_core(in, result, node, false);
}

bool nb_keys_read_cells(nb_scene_reader *in, const nb_json_node *node)
{
    enum { CELLS, PORTALS, MODEL, SPAN, GROUPING, COUNT };
    static const char *const section_names[] = {"cells", "portals", "model", "span", "grouping"};
    static const nb_key_set keys = {section_names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(CELLS), "the section \"cells\""};
    const nb_json_node *found[COUNT];
    cells_draft draft = {.desc = nb_arena_allocate(&in->scene->arena, 1, sizeof *draft.desc)};
    if (draft.desc == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *draft.desc = (nebel_cells_desc){.cells = NULL};
    if (!nb_key_value_is(in->json, node, NB_JSON_OBJECT, "an object {\"cells\": [...]}") ||
        !nb_key_value_members(in->json, node, &keys, found) || !read_list(in, found[CELLS], &draft) ||
        !read_portals(in, found[PORTALS], &draft) ||
        !read_manner(in->json, found[MODEL], found[SPAN], found[GROUPING], draft.desc) ||
        !try_cells(in, node, found[CELLS], found[PORTALS], draft.desc))
        return false;
    in->scene->data.cells = draft.desc;
    in->scene->data.cell_names = draft.names;
    return true;
}
