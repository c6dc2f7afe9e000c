/* A scene and its fog, as every command needs them. */
#ifndef NB_LOAD_H
#define NB_LOAD_H

#include "report.h"

#include <nebel/nebel.h>
#include <nebel/scene.h>

typedef struct nb_load_result {
    nebel_scene *scene;
    nebel_snapshot *fog;
} nb_load_result;

/* Reads the scene file, with models where wanted, and makes a snapshot of its fog. Returns NB_DONE; or NB_FAILED, said
 * on standard error. `listener` must outlive the result. */
int nb_load_scene(const char *path, int with_models, nb_report_listener *listener, nb_load_result *result);

/* Fine with what a failed nb_load_scene left. */
void nb_load_free(nb_load_result *result);

#endif
