/* One entry of the section "models", whose files are read later, by nebel_load_scene_models; and the points of a
 * nebula, which are read at once, since a scene knows how many particles it has. */

#include "scene_data.h"

#include "model/model.h"
#include "file/path.h"

#include <stdio.h>
#include <string.h>

enum {
    MODEL_FILE,
    MODEL_UP,
    MODEL_UNIT,
    MODEL_POSITION,
    MODEL_ROTATION,
    MODEL_SCALE,
    MODEL_FOLDER,
    MODEL_HEIGHTFIELD,
    MODEL_COLOR,
    MODEL_KEY_COUNT
};

static const char *const model_key_names[] = {"file",  "up",     "unit",        "position", "rotation",
                                              "scale", "folder", "heightfield", "color"};
static const nb_key_set model_keys = {model_key_names, MODEL_KEY_COUNT, NB_BIT(MODEL_KEY_COUNT) - 1, 0, "a model"};

static const nb_model_source unplaced = {.space = {false, 1}, .rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};

static const char *describe_place(nb_scene_reader *in, const nb_json_node *node)
{
    char path[NB_JSON_PATH], where[NB_JSON_PATH + 48];
    nb_json_path(in->json, node, path);
    const nb_text_place place = nb_json_place(in->json, node->offset);
    const int size = snprintf(where, sizeof where, ":%zu:%zu: %s", place.line, place.column, path);
    if (size < 0) return NULL;
    const char *tail = nb_arena_copy_text(&in->scene->arena, where, (size_t)size);
    return tail != NULL ? nb_path_join(&in->scene->arena, in->json->desc.name, tail) : NULL;
}

static bool read_model_file(nb_scene_reader *in, const nb_json_node *node, nb_model_source *model)
{
    nb_arena *arena = &in->scene->arena;
    const char *file = "";
    if (!nb_key_value_text(in->json, node, arena, &file)) return false;
    if (file[0] == '\0')
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "is empty; must be the path of a file");
    model->file = nb_path_join(arena, in->scene->folder, file);
    model->where = describe_place(in, node);
    if (model->file != NULL && model->where != NULL && nb_scene_keep_file(in->scene, model->file)) return true;
    return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
}

/* With its slash at the end. */
static bool read_folder(nb_scene_reader *in, const nb_json_node *node, nb_model_source *model)
{
    nb_arena *arena = &in->scene->arena;
    const char *folder = "";
    if (node == NULL) return true;
    if (!nb_key_value_text(in->json, node, arena, &folder)) return false;
    if (folder[0] == '\0')
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "is empty; must be the path of a folder");
    const char *path = nb_path_join(arena, in->scene->folder, folder);
    const bool is_whole = path != NULL && path[strlen(path) - 1] == '/';
    char *ended = path != NULL && !is_whole ? nb_arena_allocate(arena, strlen(path) + 2, 1) : NULL;
    if (ended != NULL) snprintf(ended, strlen(path) + 2, "%s/", path);
    model->folder = is_whole ? path : ended;
    return model->folder != NULL || nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
}

static bool read_heightfield(nb_scene_reader *in, const nb_json_node *node, nb_model_source *model)
{
    enum { HEIGHTFIELD_FILE, SIZE, HEIGHT, COUNT };
    static const char *const names[] = {"file", "size", "height"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(COUNT) - 1, "a heightfield"};
    const nb_json_node *found[COUNT];
    model->is_heightfield = true;
    return nb_key_value_members(in->json, node, &keys, found) && read_model_file(in, found[HEIGHTFIELD_FILE], model) &&
           nb_key_value_numbers(in->json, found[SIZE], &nb_range_extent, 2, model->size) &&
           nb_key_value_number(in->json, found[HEIGHT], &nb_range_extent, &model->height);
}

static bool check_model_kind(nb_json *json, const nb_json_node *node, const nb_json_node *const *found)
{
    if (found[MODEL_FILE] == NULL && found[MODEL_HEIGHTFIELD] == NULL)
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is neither; a model has \"file\" or \"heightfield\"");
    if (found[MODEL_HEIGHTFIELD] == NULL) return true;
    for (int i = MODEL_FILE; i <= MODEL_FOLDER; i++) {
        if (i == MODEL_POSITION || found[i] == NULL) continue;
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[i],
                                "does not go with \"heightfield\", which has: position, color");
    }
    return true;
}

bool nb_keys_read_up(nb_json *json, const nb_json_node *node, nb_file_units *space)
{
    static const char *const names[] = {"y", "z"};
    if (node == NULL) return true;
    const int choice = nb_key_value_choice(json, node, names, 2);
    space->z_up = choice == 1;
    return choice >= 0;
}

bool nb_keys_read_unit(nb_json *json, const nb_json_node *node, nb_file_units *space)
{
    static const nb_range range = {.low = 1e-9, .high = 1e18, .text = "a number of metres from 1e-9 to 1e18"};
    return nb_key_value_number(json, node, &range, &space->unit);
}

static void convert_model(const nb_file_units *space, nb_model_source *model)
{
    nb_file_units_convert_placement(space, model->position, model->rotation, model->scale);
    for (int i = 0; i < 2; i++) model->size[i] *= space->unit;
    model->height *= space->unit;
}

static bool read_placement(nb_json *json, const nb_json_node *const *found, nb_model_source *model)
{
    return nb_keys_read_up(json, found[MODEL_UP], &model->space) &&
           nb_keys_read_unit(json, found[MODEL_UNIT], &model->space) &&
           nb_key_value_place(json, found[MODEL_POSITION], model->position) &&
           nb_key_value_rotation(json, found[MODEL_ROTATION], model->rotation) &&
           nb_key_value_scale(json, found[MODEL_SCALE], model->scale);
}

/* What the public face says of a model. */
static nebel_scene_model describe_model(const nb_model_source *source, size_t index)
{
    nebel_scene_model model = {.model_index = index,
                               .path = source->file,
                               .is_heightfield = source->is_heightfield,
                               .has_fog = source->has_fog,
                               .height = source->height,
                               .has_color = source->has_color};
    memcpy(model.position, source->position, sizeof model.position);
    memcpy(model.rotation, source->rotation, sizeof model.rotation);
    memcpy(model.scale, source->scale, sizeof model.scale);
    memcpy(model.size, source->size, sizeof model.size);
    memcpy(model.color, source->color, sizeof model.color);
    return model;
}

static bool keep_model(nb_scene_reader *in, const nb_json_node *node, const nb_model_source *model)
{
    nebel_scene *scene = in->scene;
    void *models = scene->models;
    const size_t count = scene->model_count;
    const bool room = nb_grow(&scene->allocator, &models, sizeof *model, count, &scene->model_capacity, count + 1);
    scene->models = models;
    void *placements = scene->placements;
    const bool place_room = nb_grow(&scene->allocator, &placements, sizeof *scene->placements, count,
                                    &scene->placement_capacity, count + 1);
    scene->placements = placements;
    if (!room || !place_room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->models[count] = *model;
    scene->placements[count] = describe_model(model, count);
    scene->model_count++;
    return true;
}

bool nb_keys_read_model(nb_scene_reader *in, const nb_json_node *node)
{
    const nb_json_node *found[MODEL_KEY_COUNT];
    nb_json *json = in->json;
    nb_model_source model = unplaced;
    if (!nb_key_value_members(json, node, &model_keys, found) || !check_model_kind(json, node, found)) return false;
    model.has_color = found[MODEL_COLOR] != NULL;
    const bool is_file = found[MODEL_FILE] != NULL;
    if (!(is_file ? read_model_file(in, found[MODEL_FILE], &model)
                  : read_heightfield(in, found[MODEL_HEIGHTFIELD], &model)) ||
        !read_folder(in, found[MODEL_FOLDER], &model) || !read_placement(json, found, &model) ||
        !nb_key_value_color(json, found[MODEL_COLOR], &nb_range_fraction, model.color))
        return false;
    convert_model(&in->space, &model);
    return (!is_file || nb_keys_read_nodes(in, found[MODEL_FILE], &model)) && keep_model(in, node, &model);
}

/* ---- points ---------------------------------------------------------------------------------- */

static const nb_key_set points_keys = {model_key_names, MODEL_KEY_COUNT,
                                       NB_BIT(MODEL_KEY_COUNT) - 1 - NB_BIT(MODEL_HEIGHTFIELD) - NB_BIT(MODEL_COLOR),
                                       NB_BIT(MODEL_FILE), "a set of points"};

/* A copy of the points that lives as long as the scene. */
static bool keep_points(nb_scene_reader *in, const nb_json_node *node, const nb_point_set *points,
                        nebel_nebula_desc *nebula)
{
    double(*places)[3] = nb_arena_allocate(&in->scene->arena, points->count, sizeof *places);
    if (places == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    memcpy(places, points->places, points->count * sizeof *places);
    nebula->points = (const double(*)[3])places;
    nebula->count = points->count;
    return true;
}

bool nb_keys_read_points(nb_scene_reader *in, const nb_json_node *node, size_t limit, nebel_nebula_desc *nebula,
                         nebel_transform *place)
{
    const nb_json_node *found[MODEL_KEY_COUNT];
    nb_model_source model = unplaced;
    nb_point_set points = {.limit = limit};
    const nb_model_load load = {.allocator = in->scene->allocator,
                                .log = in->scene->log,
                                .source = &model,
                                .points = &points,
                                .reader = in->scene->reader,
                                .opened = nb_scene_note_file,
                                .opened_user = in->scene,
                                .most_bytes = nb_scene_most_memory(in->scene),
                                .most_seconds = nb_scene_most_seconds(in->scene),
                                .seconds = &in->scene->budget.seconds};
    if (node == NULL) return true;
    if (!nb_key_value_members(in->json, node, &points_keys, found) || !read_model_file(in, found[MODEL_FILE], &model) ||
        !read_folder(in, found[MODEL_FOLDER], &model) || !read_placement(in->json, found, &model))
        return false;
    convert_model(&in->space, &model);
    memcpy(place->position, model.position, sizeof place->position);
    memcpy(place->rotation, model.rotation, sizeof place->rotation);
    memcpy(place->scale, model.scale, sizeof place->scale);
    const nebel_result result = nb_model_read(&load);
    const bool good = result == NEBEL_OK ? keep_points(in, node, &points, nebula) : nb_json_stop(in->json, result);
    nb_release(&load.allocator, points.places);
    return good;
}
