/* The models of a scene: which files they name, and what is loaded of them. */
#include "scene_data.h"

#include <string.h>

static void release_set(const nebel_allocator *allocator, nb_model_set *set)
{
    for (size_t i = 0; i < set->mesh_count; i++) nb_mesh_release(allocator, &set->meshes[i]);
    for (size_t i = 0; i < set->texture_count; i++) nb_release(allocator, (void *)set->textures[i].rgba);
    nb_release(allocator, set->meshes);
    nb_release(allocator, set->textures);
    *set = (nb_model_set){0};
}

void nb_models_release(nebel_scene *scene)
{
    release_set(&scene->allocator, &scene->loaded);
}

/* ---- loading --------------------------------------------------------------------------------- */

/* The model of the file, as it is wanted. */
static nb_model_source place_source(const nb_model_source *source, const nebel_scene_model *model)
{
    nb_model_source placed = *source;
    memcpy(placed.position, model->position, sizeof placed.position);
    memcpy(placed.rotation, model->rotation, sizeof placed.rotation);
    memcpy(placed.scale, model->scale, sizeof placed.scale);
    memcpy(placed.size, model->size, sizeof placed.size);
    memcpy(placed.color, model->color, sizeof placed.color);
    placed.height = model->height;
    placed.has_color = model->has_color != 0;
    return placed;
}

/* ---- the files --------------------------------------------------------------------------------- */

bool nb_scene_keep_file(nebel_scene *scene, const char *file)
{
    void *files = (void *)scene->files;
    const size_t count = scene->data.path_count;
    const bool room = nb_grow(&scene->allocator, &files, sizeof file, count, &scene->file_capacity, count + 1);
    scene->files = files;
    if (!room) return false;
    scene->files[scene->data.path_count++] = file;
    return true;
}

/* Where memory is out the file is not among them, which fails nothing. */
void nb_scene_note_file(void *user, const char *path, const struct stat *status)
{
    nebel_scene *scene = user;
    (void)status;
    for (size_t i = 0; i < scene->data.path_count; i++)
        if (strcmp(scene->files[i], path) == 0) return;
    const char *kept =
        scene->data.path_count < NB_MAX_FILES ? nb_arena_copy_text(&scene->arena, path, strlen(path)) : NULL;
    if (kept != NULL) nb_scene_keep_file(scene, kept);
    scene->data.paths = scene->files;
}

static nebel_result load_all(nebel_scene *scene, const nebel_scene_model *models, size_t count, nb_model_set *set)
{
    nebel_result result = NEBEL_OK;
    double seconds = scene->budget.seconds;
    set->bytes = scene->budget.memory;
    for (size_t i = 0; i < count && result == NEBEL_OK; i++) {
        const nb_model_source source = place_source(&scene->models[models[i].model_index], &models[i]);
        const nb_model_load load = {.allocator = scene->allocator,
                                    .log = scene->log,
                                    .source = &source,
                                    .set = set,
                                    .reader = scene->reader,
                                    .opened = nb_scene_note_file,
                                    .opened_user = scene,
                                    .most_bytes = nb_scene_most_memory(scene),
                                    .most_seconds = nb_scene_most_seconds(scene),
                                    .seconds = &seconds};
        result = nb_model_read(&load);
    }
    return result;
}

nebel_result nebel_load_scene_models(nebel_scene *scene)
{
    if (scene == NULL) return NEBEL_ERROR_ARGUMENT;
    return scene->models_loaded ? NEBEL_OK : nebel_reload_scene_models(scene, scene->placements, scene->model_count);
}

nebel_result nebel_reload_scene_models(nebel_scene *scene, const nebel_scene_model *models, size_t count)
{
    nb_model_set set = {0};
    if (scene == NULL || (models == NULL && count > 0)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < count; i++)
        if (models[i].model_index >= scene->model_count)
            return nb_fail(&scene->log, NEBEL_ERROR_ARGUMENT, "models: number %zu comes from none of the file", i);
    const nebel_result result = load_all(scene, models, count, &set);
    if (result != NEBEL_OK) {
        release_set(&scene->allocator, &set);
        return result;
    }
    nb_models_release(scene);
    scene->loaded = set;
    scene->models_loaded = true;
    scene->data.meshes = set.meshes;
    scene->data.mesh_count = set.mesh_count;
    scene->data.textures = set.textures;
    scene->data.texture_count = set.texture_count;
    return NEBEL_OK;
}
