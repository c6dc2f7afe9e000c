/* What moves: keys of volumes and of the camera in an edition. */
#ifndef NB_TOOLS_VIEWER_KEYFRAME_EDIT_H
#define NB_TOOLS_VIEWER_KEYFRAME_EDIT_H

#include "document_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Puts what a volume is now into its key at a frame, which is made where there is none; the first one makes it move. 0,
 * or -1 where memory is out and nothing has changed. */
int nb_keys_set(nb_document_state *edition, size_t volume, double frame);

/* Without its last key a volume stays as it was there. */
void nb_keys_remove(nb_document_state *edition, size_t volume, size_t key);

/* Moves a key to another frame, no further than to its neighbours. */
void nb_keys_move(nb_document_state *edition, size_t volume, size_t key, double frame);

/* The same of the camera. */
int nb_keys_set_camera(nb_document_state *edition, const nebel_camera *camera, double frame);
void nb_keys_remove_camera(nb_document_state *edition, size_t key);
void nb_keys_move_camera(nb_document_state *edition, size_t key, double frame);

/* All volumes that move, as they are at a frame. */
void nb_keys_place(nb_document_state *edition, double frame);

/* What was changed by hand since `before`, of the same volumes at the same frame, goes into keys: numbers that move
 * into the key of that frame, all else into all keys. 0, or -1 where memory is out. */
int nb_keys_store(nb_document_state *edition, const nb_document_state *before, double frame);

/* The first and the last frame of all keys; 0: there is none. */
int nb_keys_find_range(const nb_document_state *edition, double range[2]);

#ifdef __cplusplus
}
#endif
#endif
