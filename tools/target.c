#include "target.h"

#include "interrupt.h"
#include "report.h"

#include <nebel/scene.h>

int nb_target_check(const char *path)
{
    nb_report_listener listener = {0};
    const nebel_scene_desc desc = {.log = nb_report_log(&listener)};
    nb_interrupt_hold();
    const nebel_result result = nebel_check_image_path(path, &desc);
    nb_interrupt_release();
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&listener, path, result);
}
