/* A scene while it is being changed: what the file says, and what stands in its place for now. */
#ifndef NB_DRAFT_H
#define NB_DRAFT_H

#include <nebel/nebel.h>
#include <nebel/scene.h>

#include <stddef.h>

typedef struct nb_draft {
    nebel_scene *scene;
    nebel_scene_data data;      /* for the renderers; camera and light are ours, and so are the volumes */
    nebel_volume_desc *volumes; /* data.volumes; their planes and parts are the scene's */
    nebel_volume_desc *good;    /* the last ones that the fog has taken */
    nebel_volume_desc *written; /* what the file says */
    nebel_scene_data file;      /* ... of camera and light */
    nebel_volume_id *ids;
    nebel_fog *fog;
    nebel_snapshot *snapshot; /* of the fog */
    double frame;             /* of what moves */
    nebel_log log;
} nb_draft;

/* Loads the scene with its models, in place of nothing. The log must outlive the draft. On an error nothing is to be
 * closed. */
nebel_result nb_draft_open(const char *path, double frame, const nebel_log *log, nb_draft *draft);

/* Fine with zeros. */
void nb_draft_close(nb_draft *draft);

/* Puts volumes and ambient light as they are in `data` into a new snapshot. A volume that is not valid gets its last
 * good numbers back, and the log says why. */
nebel_result nb_draft_commit(nb_draft *draft);

/* Goes to another frame: everything that moves. Volumes that stand still keep their changes. */
nebel_result nb_draft_set_frame(nb_draft *draft, double frame);

/* Whether anything that the file could hold is not as the file says; the camera does not count. */
int nb_draft_is_changed(const nb_draft *draft);

/* Whether the camera is one that the file could hold. */
int nb_draft_can_save_camera(const nb_draft *draft);

/* Writes what has changed into the file. On an error the file is as it was, and the log has said why. */
nebel_result nb_draft_save(nb_draft *draft, const char *path, int with_camera);

/* Whether the volume is another one from frame to frame. */
int nb_draft_is_moving(const nb_draft *draft, size_t volume);

#endif
