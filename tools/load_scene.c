#include "load_scene.h"

#include "reader.h"

#include <nebel/render.h>

void nb_load_free(nb_load_result *result)
{
    nebel_release_snapshot(result->fog);
    nebel_destroy_scene(result->scene);
    *result = (nb_load_result){0};
}

nebel_result nb_load_move_fog(nb_load_result *result, double frame)
{
    nebel_snapshot *moved = NULL;
    const nebel_scene_data *const scene = nebel_get_scene_data(result->scene);
    if (scene->animated_volume_count == 0 && scene->sun_key_count == 0) return NEBEL_OK;
    nebel_result failed = nebel_set_scene_frame(result->scene, frame);
    if (failed != NEBEL_OK) return failed;
    failed = nebel_commit_scene_fog_at(result->scene, frame, &moved);
    if (failed != NEBEL_OK) return failed;
    nebel_release_snapshot(result->fog);
    result->fog = moved;
    return NEBEL_OK;
}

static int finish(const char *path, nebel_result done, nb_report_listener *listener, nb_load_result *result)
{
    if (done == NEBEL_OK) return NB_DONE;
    nb_load_free(result);
    return nb_report_result(listener, path, done);
}

int nb_load_file(const char *path, int with_models, nb_report_listener *listener, nb_load_result *result)
{
    *result = (nb_load_result){0};
    const nebel_scene_desc desc = {.log = nb_report_log(listener),
                                   .run = nebel_parallel_for_openmp,
                                   .model_reader = nb_reader_path(),
                                   .memory = nb_reader_memory()};
    nebel_result done = nebel_load_scene(path, &desc, &result->scene);
    if (done == NEBEL_OK && with_models) done = nebel_load_scene_models(result->scene);
    return finish(path, done, listener, result);
}

int nb_load_fog(const char *path, double frame, nb_report_listener *listener, nb_load_result *result)
{
    nebel_result done = nebel_set_scene_frame(result->scene, frame);
    if (done == NEBEL_OK) done = nebel_load_scene_planets(result->scene);
    if (done == NEBEL_OK) done = nebel_commit_scene_fog_at(result->scene, frame, &result->fog);
    return finish(path, done, listener, result);
}

int nb_load_scene(const char *path, int with_models, double frame, nb_report_listener *listener, nb_load_result *result)
{
    const int status = nb_load_file(path, with_models, listener, result);
    return status == NB_DONE ? nb_load_fog(path, frame, listener, result) : status;
}
