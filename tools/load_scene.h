/* A scene and its fog, as every command needs them. */
#ifndef NB_TOOLS_LOAD_SCENE_H
#define NB_TOOLS_LOAD_SCENE_H

#include "messages.h"

#include <nebel/nebel.h>
#include <nebel/scene.h>

typedef struct nb_load_result {
    nebel_scene *scene;
    nebel_snapshot *fog;
    nebel_lighting *lighting; /* of the fog */
} nb_load_result;

/* Reads the scene file, with models where wanted, and makes its air and a snapshot of its fog at a frame, with its lights. Returns NB_DONE; or
 * NB_FAILED, said on standard error. `listener` must outlive the result. */
int nb_load_scene(const char *path, int with_models, double frame, nb_report_listener *listener,
                  nb_load_result *result);

/* The two halves of it. */
int nb_load_file(const char *path, int with_models, nb_report_listener *listener, nb_load_result *result);
int nb_load_fog(const char *path, double frame, nb_report_listener *listener, nb_load_result *result);

/* Lights the scene as at another frame, and puts the fog of that in place of what was, where sun or fog move at all. Returns a result; the log has said
 * why. */
nebel_result nb_load_move_fog(nb_load_result *result, double frame);

/* Fine with what a failed nb_load_scene left. */
void nb_load_free(nb_load_result *result);

#endif
