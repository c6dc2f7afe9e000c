/* A scene while it is being changed: what the file says, and what stands in its place for now. */
#ifndef NB_TOOLS_VIEWER_DOCUMENT_H
#define NB_TOOLS_VIEWER_DOCUMENT_H

#include "document_state.h"
#include "undo.h"

typedef struct nb_document {
    nebel_scene *scene;        /* with the models */
    nebel_scene *file;         /* as it was read or written last; `scene` until it is written */
    nebel_scene_data data;     /* for the renderers: the camera is ours, fog and light are those of `now` */
    nb_document_state now;     /* to be changed */
    nb_document_state good;    /* the last one that the fog has taken */
    nb_document_state written; /* what the file says */
    nb_undo_stack history;
    nebel_fog *fog; /* the volumes of `good` */
    nebel_volume_id *ids;
    double fog_frame;          /* that its noise is of */
    nebel_lighting *volumes;   /* of the fog, with its snapshot */
    nebel_lighting *whole;     /* with the particles; NULL: not asked for yet */
    nebel_particle *particles; /* of all nebulae */
    size_t particle_count;
    nebel_cells *cells;   /* of `good`; NULL: the scene has none */
    int models_are_stale; /* the scene's meshes are not where the models of `good` are */
    int planets_are_new; /* the scene's air, clouds and layers are others: renderers that know the old ones are to go */
    double frame;        /* of what moves */
    nebel_log log;
} nb_document;

/* Loads the scene with its models, in place of nothing. The log must outlive the draft. On an error nothing is to be
 * closed. */
nebel_result nb_document_open(const char *path, double frame, const nebel_log *log, nb_document *draft);

/* Fine with zeros. */
void nb_document_close(nb_document *draft);

/* Points `data` to the draft, which has been copied, and has the sun there as it is at the frame. */
void nb_document_show(nb_document *draft);

/* Puts `now` into new snapshots. If it is not valid, all of it is what it was before, and the log says why. Where there is a planet
 * nobody may render `data` meanwhile, here and in what follows: its sky is made anew, where the sun has changed, and its air,
 * where planets have. */
nebel_result nb_document_commit(nb_document *draft);

/* All fog with its particles, as volumes. The lighting is the draft's, until the next change. */
nebel_result nb_document_whole(nb_document *draft, nebel_lighting **whole);

/* Loads the models of `good` anew. Nobody may use the meshes of `data` meanwhile: they are others then, unless that
 * fails. */
nebel_result nb_document_place_models(nb_document *draft);

/* Goes to another frame: everything that moves. Volumes that stand still keep their changes. */
nebel_result nb_document_set_frame(nb_document *draft, double frame);

/* A step back or forth; 0: there is none. */
int nb_document_undo(nb_document *draft, nebel_result *result);
int nb_document_redo(nb_document *draft, nebel_result *result);

/* Whether anything that the file could hold is not as the file says; the camera does not count. */
int nb_document_is_changed(const nb_document *draft);

/* What the volume of `now` comes from; those that are new will stand in the file. */
nebel_volume_origin nb_document_origin(const nb_document *draft, size_t volume);

/* The first and the last frame at which anything moves; 0: nothing does. */
int nb_document_find_frames(const nb_document *draft, double range[2]);

/* Whether what was saved cannot be shown without the scene being read anew: models that have gone, or have taken fog
 * with them. */
int nb_document_must_be_read(const nb_document *draft);

/* Whether the camera is one that the file could hold. */
int nb_document_can_save_camera(const nb_document *draft);

/* Reads a scene file and drops it again: whether it is good. The log says why it is not. */
nebel_result nb_document_try_file(const char *path, const nebel_log *log);

/* Writes what has changed into the file. On an error the file is as it was, and the log has said why. */
nebel_result nb_document_save(nb_document *draft, const char *path, int with_camera);

#endif
