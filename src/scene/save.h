/* What nebel_save_scene does while the file is being read: every value that is not as wanted is put down for a change.
 */
#ifndef NB_SCENE_SAVE_H
#define NB_SCENE_SAVE_H

#include "scene/edit.h"
#include "scene/scene_internal.h"

struct nb_save {
    const nebel_scene_data *changed;
    nb_edit edit;
    nb_edit_object root; /* with the last section that was read */
    bool done[3];        /* sections that the file may lack */
};

/* After a section, or a volume, number `index` of the scene, has been read, while its tree is there. */
void nb_save_section(nb_save *save, const nb_scene_reader *in, const nb_json_node *node);
bool nb_save_volume(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index);

/* After everything. */
bool nb_save_rest(nb_save *save, const nb_scene_reader *in, const nb_json_node *root);

#endif
