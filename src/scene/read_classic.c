/* The section "classic": the numbers of the fog factors. */
#include "scene/scene_internal.h"

const char *const nb_coordinate_names[2] = {"plane", "radial"};
const char *const nb_stage_names[2] = {"vertex", "pixel"};

static bool read_choice(nb_json *json, const nb_json_node *node, const char *const *names, int *choice)
{
    if (node != NULL) *choice = nb_value_choice(json, node, names, 2);
    return *choice >= 0;
}

/* Absent numbers are those of a new OpenGL context, in metres whatever the file's unit. */
static void convert(const nb_space *space, const nb_json_node *end, const nb_json_node *density,
                    nebel_factor_desc *factor)
{
    factor->start *= space->unit;
    if (end != NULL) factor->end *= space->unit;
    if (density != NULL) factor->density /= space->unit;
}

bool nb_read_classic(nb_scene_reader *in, const nb_json_node *node)
{
    enum { START, END, DENSITY, COLOR, COORDINATE, STAGE, COUNT };
    static const char *const section_names[] = {"start", "end", "density", "color", "coordinate", "stage"};
    static const nb_keys keys = {section_names, COUNT, NB_BIT(COUNT) - 1, 0, "the section \"classic\""};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    int coordinate = 0, stage = 0;
    nebel_factor_desc *factor = nb_arena_allocate(&in->scene->arena, 1, sizeof *factor);
    if (factor == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *factor = (nebel_factor_desc){.end = 1, .density = 1};
    if (!nb_value_is(json, node, NB_JSON_OBJECT, "an object {\"density\": ...}") ||
        !nb_value_members(json, node, &keys, found) ||
        !nb_value_number(json, found[START], &nb_range_place, &factor->start) ||
        !nb_value_number(json, found[END], &nb_range_place, &factor->end) ||
        !nb_value_number(json, found[DENSITY], &nb_range_density, &factor->density) ||
        !nb_value_color(json, found[COLOR], &nb_range_light, factor->color) ||
        !read_choice(json, found[COORDINATE], nb_coordinate_names, &coordinate) ||
        !read_choice(json, found[STAGE], nb_stage_names, &stage))
        return false;
    convert(&in->space, found[END], found[DENSITY], factor);
    factor->coordinate = (nebel_factor_coordinate)coordinate;
    factor->stage = (nebel_factor_stage)stage;
    in->scene->data.classic = factor;
    return true;
}
