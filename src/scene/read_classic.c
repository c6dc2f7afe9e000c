/* The section "classic": what the methods of old hardware need. */
#include "scene_data.h"

#include "base/device.h"

#include <math.h>

const char *const nb_coordinate_names[NEBEL_COORDINATE_COUNT] = {"plane", "radial", "user"};
const char *const nb_stage_names[NEBEL_STAGE_COUNT] = {"vertex", "pixel"};
const char *const nb_curve_names[NEBEL_CURVE_TABLE] = {"physical", "linear", "exp", "exp2"};
const char *const nb_d3d9_mode_names[4] = {"none", "exp", "exp2", "linear"};

/* ---- response curves ------------------------------------------------------------------------- */

/* Weights at even distances become all entries, by lines between them. */
static float find_entry(const double *weights, size_t count, size_t entry)
{
    const double at = (double)(entry * (count - 1)) / (NEBEL_CURVE_ENTRIES - 1);
    const size_t first = (size_t)at < count - 1 ? (size_t)at : count - 2;
    const double part = at - (double)first;
    return (float)((1 - part) * weights[first] + part * weights[first + 1]);
}

static bool read_table(nb_scene_reader *in, const nb_json_node *node)
{
    nb_json *json = in->json;
    double weights[NEBEL_CURVE_ENTRIES];
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of 2 to 256 numbers")) return false;
    if (node->count < 2 || node->count > NEBEL_CURVE_ENTRIES)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "has %u weights; 2 to %d are possible",
                            (unsigned)node->count, NEBEL_CURVE_ENTRIES);
    if (!nb_key_value_numbers(json, node, &nb_range_fraction, node->count, weights)) return false;
    float *table = nb_arena_allocate(&in->scene->arena, NEBEL_CURVE_ENTRIES, sizeof *table);
    if (table == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    for (size_t i = 0; i < NEBEL_CURVE_ENTRIES; i++) table[i] = find_entry(weights, node->count, i);
    in->scene->data.classic_table = table;
    in->scene->data.classic_curve = NEBEL_CURVE_TABLE;
    return true;
}

static bool read_curve(nb_scene_reader *in, const nb_json_node *curve, const nb_json_node *table)
{
    int chosen = NEBEL_CURVE_PHYSICAL;
    if (!nb_key_value_replace_choice(in->json, curve, nb_curve_names, NEBEL_CURVE_TABLE, &chosen)) return false;
    if (curve != NULL && table != NULL)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, table, "there is a \"curve\", too; leave one of them out");
    in->scene->data.classic_curve = (nebel_curve_type)chosen;
    return read_table(in, table);
}

/* ---- Direct3D 9 ------------------------------------------------------------------------------ */

/* Numbers are parts of a byte, as in D3DCOLOR_COLORVALUE, and "#rrggbb" is bytes: neither is light. */
static bool read_stored_color(nb_json *json, const nb_json_node *node, double color[3])
{
    if (!nb_key_value_color(json, node, &nb_range_fraction, color)) return false;
    for (int c = 0; c < 3 && node != NULL && node->type == NB_JSON_STRING; c++) color[c] = nb_device_store(color[c]);
    return true;
}

static uint32_t pack_color(const double color[3])
{
    uint32_t packed = 0;
    for (int c = 0; c < 3; c++) packed = packed << 8 | (uint32_t)floor(255 * color[c] + .5);
    return packed;
}

/* Of an orthographic camera, in metres where they are left out. */
static bool read_clip_planes(nb_scene_reader *in, const nb_json_node *near_node, const nb_json_node *far_node)
{
    const double unit = in->space.unit;
    nebel_scene_data *const data = &in->scene->data;
    double near = 0, far = 1000 / unit;
    if (!nb_key_value_number(in->json, near_node, &nb_range_place, &near) ||
        !nb_key_value_number(in->json, far_node, &nb_range_place, &far))
        return false;
    data->classic_z_near = near * unit;
    data->classic_z_far = far * unit;
    return near < far || nb_json_fail(in->json, NEBEL_ERROR_FORMAT, far_node != NULL ? far_node : near_node,
                                      "z_near is %g and z_far %g; z_near must be less", near, far);
}

/* Absent numbers are those of a new device, in metres whatever the file's unit. */
static bool read_d3d9(nb_scene_reader *in, const nb_json_node *node)
{
    enum { VERTEX_MODE, TABLE_MODE, START, END, DENSITY, COLOR, RANGE, NEAR, FAR, COUNT };
    static const char *const d3d9_names[] = {"fog_vertex_mode",  "fog_table_mode", "fog_start",
                                             "fog_end",          "fog_density",    "fog_color",
                                             "range_fog_enable", "z_near",         "z_far"};
    static const nb_key_set keys = {d3d9_names, COUNT, NB_BIT(COUNT) - 1, 0, "\"d3d9\""};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    const double unit = in->space.unit;
    int vertex_mode = NEBEL_D3DFOG_NONE, table_mode = NEBEL_D3DFOG_NONE;
    double start = 0, end = 1 / unit, density = unit, color[3] = {0, 0, 0};
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {\"fog_vertex_mode\": ...}") ||
        !nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_replace_choice(json, found[VERTEX_MODE], nb_d3d9_mode_names, 4, &vertex_mode) ||
        !nb_key_value_replace_choice(json, found[TABLE_MODE], nb_d3d9_mode_names, 4, &table_mode) ||
        !nb_key_value_number(json, found[START], &nb_range_place, &start) ||
        !nb_key_value_number(json, found[END], &nb_range_place, &end) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_density, &density) ||
        !read_stored_color(json, found[COLOR], color) ||
        (found[RANGE] != NULL && !nb_key_value_is(json, found[RANGE], NB_JSON_BOOLEAN, "true or false")) ||
        !read_clip_planes(in, found[NEAR], found[FAR]))
        return false;
    nebel_d3d9_fog *d3d9 = nb_arena_allocate(&in->scene->arena, 1, sizeof *d3d9);
    if (d3d9 == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *d3d9 = (nebel_d3d9_fog){.fog_enable = 1,
                             .fog_color = pack_color(color),
                             .fog_table_mode = (uint32_t)table_mode,
                             .fog_vertex_mode = (uint32_t)vertex_mode,
                             .fog_start = (float)(start * unit),
                             .fog_end = (float)(end * unit),
                             .fog_density = (float)(density / unit),
                             .range_fog_enable = found[RANGE] != NULL && found[RANGE]->number != 0};
    in->scene->data.classic_d3d9 = d3d9;
    return true;
}

double nb_device_unit(const nebel_scene_data *scene, const nebel_d3d9_fog *fog, double unit)
{
    const int has_depth =
        scene->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC && fog->fog_table_mode != NEBEL_D3DFOG_NONE;
    return has_depth ? 1 : unit;
}

void nb_finish_classic(nb_scene_reader *in)
{
    nebel_d3d9_fog *const fog = (nebel_d3d9_fog *)in->scene->data.classic_d3d9;
    if (fog == NULL) return;
    const double back = nb_device_unit(&in->scene->data, fog, in->space.unit) / in->space.unit;
    fog->fog_start = (float)(back * (double)fog->fog_start);
    fog->fog_end = (float)(back * (double)fog->fog_end);
    fog->fog_density = (float)((double)fog->fog_density / back);
}

/* ---- fog factors ----------------------------------------------------------------------------- */

/* Absent numbers are those of a new OpenGL context, in metres whatever the file's unit. A program's own coordinates have
 * no unit. */
static void convert(const nb_file_units *space, const nb_json_node *end, const nb_json_node *density,
                    nebel_factor_desc *factor)
{
    if (factor->coordinate == NEBEL_COORDINATE_USER) return;
    factor->start *= space->unit;
    if (end != NULL) factor->end *= space->unit;
    if (density != NULL) factor->density /= space->unit;
}

bool nb_keys_read_classic(nb_scene_reader *in, const nb_json_node *node)
{
    enum { START, END, DENSITY, COLOR, COORDINATE, STAGE, CURVE, TABLE, D3D9, COUNT };
    static const char *const section_names[] = {"start", "end",   "density", "color", "coordinate",
                                                "stage", "curve", "table",   "d3d9"};
    static const nb_key_set keys = {section_names, COUNT, NB_BIT(COUNT) - 1, 0, "the section \"classic\""};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    int coordinate = 0, stage = 0;
    nebel_factor_desc *factor = nb_arena_allocate(&in->scene->arena, 1, sizeof *factor);
    if (factor == NULL) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *factor = (nebel_factor_desc){.end = 1, .density = 1};
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {\"density\": ...}") ||
        !nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[START], &nb_range_place, &factor->start) ||
        !nb_key_value_number(json, found[END], &nb_range_place, &factor->end) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_density, &factor->density) ||
        !nb_key_value_color(json, found[COLOR], &nb_range_light, factor->color) ||
        !nb_key_value_replace_choice(json, found[COORDINATE], nb_coordinate_names, NEBEL_COORDINATE_COUNT,
                                     &coordinate) ||
        !nb_key_value_replace_choice(json, found[STAGE], nb_stage_names, NEBEL_STAGE_COUNT, &stage) ||
        !read_curve(in, found[CURVE], found[TABLE]) || !read_d3d9(in, found[D3D9]))
        return false;
    factor->coordinate = (nebel_factor_coordinate)coordinate;
    factor->stage = (nebel_factor_stage)stage;
    convert(&in->space, found[END], found[DENSITY], factor);
    in->scene->data.classic = factor;
    return true;
}
