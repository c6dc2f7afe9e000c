#include "target.h"

#include "report.h"

#include <nebel/scene.h>

#include <string.h>

static int ends_with(const char *path, const char *ending)
{
    const size_t size = strlen(path), ending_size = strlen(ending);
    if (size <= ending_size) return 0;
    for (size_t i = 0; i < ending_size; i++) {
        const char c = path[size - ending_size + i];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != ending[i]) return 0;
    }
    return 1;
}

nb_target_kind nb_target_find_kind(const char *path)
{
    if (ends_with(path, ".png")) return NB_TARGET_PNG;
    return ends_with(path, ".exr") ? NB_TARGET_EXR : NB_TARGET_NONE;
}

int nb_target_check(const char *path)
{
    nb_report_listener listener = {0};
    const nebel_scene_desc desc = {.log = nb_report_log(&listener)};
    const nebel_result result = nebel_check_image_path(path, &desc);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&listener, path, result);
}
