/* A density whose voxels are in files, which are read at once. */
#include "scene_data.h"

#include "model/model.h"
#include "file/path.h"
#include "grid_file/grid_file.h"

#include <string.h>

enum { GRID_TYPE, GRID_FILE, GRID_FILTER, GRID_GRID, GRID_SLICES, GRID_SIZE, GRID_VOXELS, GRID_KEY_COUNT };

static const char *const grid_key_names[] = {"type", "file", "filter", "grid", "slices", "size", "voxels"};
static const char *const filter_names[] = {"linear", "nearest"};
static const char *const voxel_names[] = {"float", "uint8", "uint16"};

#define ANY_FILE (NB_BIT(GRID_TYPE) | NB_BIT(GRID_FILE) | NB_BIT(GRID_FILTER))

/* In the order of nb_voxel_file. */
static const nb_key_set grid_keys[] = {
    {grid_key_names, GRID_KEY_COUNT, ANY_FILE | NB_BIT(GRID_SIZE) | NB_BIT(GRID_VOXELS),
     NB_BIT(GRID_FILE) | NB_BIT(GRID_SIZE) | NB_BIT(GRID_VOXELS), "a grid of numbers (no .nvdb, .vdb, .png)"},
    {grid_key_names, GRID_KEY_COUNT, ANY_FILE | NB_BIT(GRID_GRID), NB_BIT(GRID_FILE), "a grid of NanoVDB"},
    {grid_key_names, GRID_KEY_COUNT, ANY_FILE | NB_BIT(GRID_SLICES), NB_BIT(GRID_FILE) | NB_BIT(GRID_SLICES),
     "a grid of pictures"},
    {grid_key_names, GRID_KEY_COUNT, ANY_FILE | NB_BIT(GRID_GRID), NB_BIT(GRID_FILE), "a grid of OpenVDB"}};

static nb_voxel_file kind_of(const nb_json *json, const nb_json_node *object)
{
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node))
        if (nb_json_has_key(node, "file") && node->type == NB_JSON_STRING)
            return nb_voxel_file_kind(node->string, node->string_size);
    return NB_VOXELS_NUMBERS;
}

/* Before the kind of file says which keys there must be. */
static bool names_file(nb_json *json, const nb_json_node *object)
{
    for (const nb_json_node *node = nb_json_first(json, object); node != NULL; node = nb_json_next(json, node))
        if (nb_json_has_key(node, "file") && !nb_key_value_is(json, node, NB_JSON_STRING, "the path of a file"))
            return false;
    return true;
}

static bool read_choices(nb_json *json, const nb_json_node *const *found, nebel_grid_file *file)
{
    int filter = 0, type = 0;
    if (found[GRID_FILTER] != NULL) filter = nb_key_value_choice(json, found[GRID_FILTER], filter_names, 2);
    if (found[GRID_VOXELS] != NULL) type = nb_key_value_choice(json, found[GRID_VOXELS], voxel_names, 3);
    file->filter = (nebel_grid_filter)filter;
    file->type = (nebel_voxel_type)type;
    return filter >= 0 && type >= 0;
}

bool nb_keys_read_grid_size(nb_json *json, const nb_json_node *node, size_t size[3])
{
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of three numbers of voxels")) return false;
    if (node->count != 3)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "holds %u numbers; must be an array of three",
                            (unsigned)node->count);
    int i = 0;
    for (const nb_json_node *at = nb_json_first(json, node); at != NULL; at = nb_json_next(json, at), i++) {
        int count = 0;
        if (!nb_key_value_integer(json, at, 1, NEBEL_MAX_GRID_SIZE, &count)) return false;
        size[i] = (size_t)count;
    }
    return true;
}

static bool read_grid_file(nb_scene_reader *in, const nb_json_node *const *found, nebel_grid_file *file)
{
    nb_arena *arena = &in->scene->arena;
    const char *path = "";
    int slices = 0;
    if (!nb_key_value_text(in->json, found[GRID_FILE], arena, &path) ||
        (found[GRID_GRID] != NULL && !nb_key_value_text(in->json, found[GRID_GRID], arena, &file->grid_name)) ||
        !nb_key_value_integer(in->json, found[GRID_SLICES], 1, NEBEL_MAX_GRID_SIZE, &slices) ||
        !nb_keys_read_grid_size(in->json, found[GRID_SIZE], file->size) || !read_choices(in->json, found, file))
        return false;
    if (path[0] == '\0')
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, found[GRID_FILE], "is empty; must be the path of a file");
    file->slice_count = (size_t)slices;
    file->path = nb_path_join(arena, in->scene->folder, path);
    return file->path != NULL || nb_json_fail(in->json, NEBEL_ERROR_MEMORY, found[GRID_FILE], "out of memory");
}

bool nb_scene_keep_grid(nb_scene_reader *in, const nb_json_node *node, nebel_grid *grid)
{
    nebel_scene *scene = in->scene;
    void *grids = (void *)scene->grids;
    const size_t count = scene->grid_count;
    const bool room = nb_grow(&scene->allocator, &grids, sizeof grid, count, &scene->grid_capacity, count + 1);
    scene->grids = grids;
    if (room) scene->grids[scene->grid_count++] = grid;
    if (!room) nebel_release_grid(grid);
    return room || nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
}

bool nb_keys_read_grid(nb_scene_reader *in, const nb_json_node *node, nebel_density *density)
{
    const nb_json_node *found[GRID_KEY_COUNT];
    nb_json *json = in->json;
    nebel_grid_file file = {.filter = NEBEL_GRID_FILTER_LINEAR};
    nb_note note = {""};
    const nebel_scene_desc desc = {.host = {.allocator = in->scene->allocator, .log = nb_note_log(&note)},
                                   .memory = nb_scene_room(in->scene)};
    if (!names_file(json, node) || !nb_key_value_members(json, node, &grid_keys[kind_of(json, node)], found) ||
        !read_grid_file(in, found, &file))
        return false;
    file.name = nb_arena_copy_text(&in->scene->arena, json->desc.text + node->offset, node->end - node->offset);
    if (file.name == NULL || !nb_scene_keep_file(in->scene, file.path))
        return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *density = (nebel_density){.type = NEBEL_DENSITY_GRID};
    uint64_t bytes = 0;
    const nebel_result result = nb_voxels_load(&file, &desc, &in->space, &density->grid, &bytes);
    if (result != NEBEL_OK) return nb_json_fail(json, result, found[GRID_FILE], "%s", note.text);
    return nb_scene_keep_grid(in, node, density->grid) && nb_scene_charge(in, node, (double)bytes, 0);
}
