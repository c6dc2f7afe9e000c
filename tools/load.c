#include "load.h"

void nb_load_free(nb_load_result *result)
{
    nebel_release_snapshot(result->fog);
    nebel_destroy_scene(result->scene);
    *result = (nb_load_result){0};
}

nebel_result nb_load_move_fog(nb_load_result *result, double frame)
{
    nebel_snapshot *moved = NULL;
    if (nebel_scene_contents(result->scene)->moving_volume_count == 0) return NEBEL_OK;
    const nebel_result failed = nebel_commit_scene_fog_at(result->scene, frame, &moved);
    if (failed != NEBEL_OK) return failed;
    nebel_release_snapshot(result->fog);
    result->fog = moved;
    return NEBEL_OK;
}

int nb_load_scene(const char *path, int with_models, double frame, nb_report_listener *listener, nb_load_result *result)
{
    *result = (nb_load_result){0};
    const nebel_scene_desc desc = {.log = nb_report_log(listener)};
    nebel_result failed = nebel_load_scene(path, &desc, &result->scene);
    if (failed == NEBEL_OK && with_models) failed = nebel_load_scene_models(result->scene);
    if (failed == NEBEL_OK) failed = nebel_commit_scene_fog_at(result->scene, frame, &result->fog);
    if (failed == NEBEL_OK) return NB_DONE;
    nb_load_free(result);
    return nb_report_result(listener, path, failed);
}
