#include "load_scene.h"

#include "reader.h"

#include <nebel/render.h>

void nb_load_free(nb_load_result *result)
{
    nebel_release_lighting(result->lighting);
    nebel_release_snapshot(result->fog);
    nebel_destroy_scene(result->scene);
    *result = (nb_load_result){0};
}

/* Lights a snapshot, of which it becomes an owner, in place of what was there, which stays on an error. */
static nebel_result use_fog(nb_load_result *result, nebel_snapshot *fog, double frame)
{
    nebel_lighting *lighting = NULL;
    const nebel_result failed = nebel_create_scene_lighting(result->scene, fog, frame, result->lighting, &lighting);
    if (failed != NEBEL_OK) return failed;
    (void)nebel_retain_snapshot(fog);
    nebel_release_lighting(result->lighting);
    nebel_release_snapshot(result->fog);
    result->fog = fog;
    result->lighting = lighting;
    return NEBEL_OK;
}

static nebel_result make_fog(nb_load_result *result, double frame)
{
    nebel_snapshot *fog = NULL;
    nebel_result failed = nebel_commit_scene_fog_at(result->scene, frame, &fog);
    if (failed == NEBEL_OK) failed = use_fog(result, fog, frame);
    nebel_release_snapshot(fog);
    return failed;
}

nebel_result nb_load_move_fog(nb_load_result *result, double frame)
{
    const nebel_scene_data *const scene = nebel_get_scene_data(result->scene);
    if (scene->animated_volume_count == 0 && scene->sun_key_count == 0) return NEBEL_OK;
    nebel_result failed = nebel_set_scene_frame(result->scene, frame);
    if (failed != NEBEL_OK) return failed;
    /* Where the sun alone moves the fog stays what it is. */
    return scene->animated_volume_count > 0 ? make_fog(result, frame) : use_fog(result, result->fog, frame);
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
    const nebel_scene_desc desc = {.host = {.log = nb_report_log(listener), .parallel.run = nebel_parallel_for_openmp},
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
    if (done == NEBEL_OK) done = make_fog(result, frame);
    return finish(path, done, listener, result);
}

int nb_load_scene(const char *path, int with_models, double frame, nb_report_listener *listener, nb_load_result *result)
{
    const int status = nb_load_file(path, with_models, listener, result);
    return status == NB_DONE ? nb_load_fog(path, frame, listener, result) : status;
}
