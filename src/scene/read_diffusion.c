/* The section "multiple_scattering". */
#include "scene_data.h"

/* Level, and of one height. */
static bool read_ground(nb_scene_reader *in, const nb_json_node *node, nebel_diffusion_desc *desc)
{
    enum { HEIGHT, ALBEDO, COUNT };
    static const char *const names[] = {"height", "albedo"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "the ground"};
    const nb_json_node *found[COUNT];
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_OBJECT, "an object {\"height\": ..., \"albedo\": ...}") ||
        !nb_key_value_members(in->json, node, &keys, found) ||
        !nb_key_value_number(in->json, found[HEIGHT], &nb_range_place, &desc->ground_height) ||
        !nb_key_value_color(in->json, found[ALBEDO], &nb_range_fraction, desc->ground_albedo))
        return false;
    desc->has_ground = 1;
    desc->ground_height *= in->space.unit;
    return true;
}

bool nb_keys_read_multiple_scattering(nb_scene_reader *in, const nb_json_node *node)
{
    enum { MODEL, MAX_CELLS, GROUND, COUNT };
    static const char *const names[] = {"model", "max_cells", "ground"};
    static const char *const model_names[] = {"diffusion"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(MODEL), "multiple scattering"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    int cells = 0;
    nebel_diffusion_desc *desc = nb_arena_allocate(&in->scene->arena, 1, sizeof *desc);
    if (desc == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *desc = (nebel_diffusion_desc){0};
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {\"model\": ...}") ||
        !nb_key_value_members(json, node, &keys, found) ||
        nb_key_value_choice(json, found[MODEL], model_names, 1) < 0 ||
        (found[MAX_CELLS] != NULL &&
         !nb_key_value_integer(json, found[MAX_CELLS], NEBEL_MIN_DIFFUSION_CELLS, NEBEL_MAX_DIFFUSION_CELLS, &cells)) ||
        !read_ground(in, found[GROUND], desc))
        return false;
    desc->max_cells = (uint32_t)cells;
    const double lattice = nb_diffusion_cells(desc);
    if (!nb_scene_charge(in, node, lattice * NB_CELL_BYTES, lattice * NB_CELL_SECONDS)) return false;
    in->scene->budget.lattice = lattice;
    in->scene->data.diffusion = desc;
    return true;
}
