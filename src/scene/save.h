/* What nebel_save_scene does while the file is being read: every value that is not as wanted is put down for a change.
 */
#ifndef NB_SCENE_SAVE_H
#define NB_SCENE_SAVE_H

#include "scene/edit.h"
#include "scene/scene_internal.h"

struct nb_save {
    const nebel_scene_data *before, *changed;
    const size_t *sources; /* of the volumes of `changed`; NULL: the same volumes */
    size_t *targets;       /* where each volume of `before` is in `changed`; NEBEL_NEW_VOLUME: nowhere */
    nb_edit edit;
    nb_edit_object root; /* with the last section that was read */
    bool done[4];        /* sections that the file may lack */
    nb_edit_span *spans; /* entries of the section "fog" */
    size_t span_count, span_capacity;
    bool has_added; /* an entry to an array without any */
};

/* After a section, an entry of fog, whose volumes begin with number `first` of the scene, a nebula or the cells have
 * been read, while the tree is there. */
void nb_save_section(nb_save *save, const nb_scene_reader *in, const nb_json_node *node);
bool nb_save_volume(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t first);
bool nb_save_nebula(nb_save *save, nb_scene_reader *in, const nb_json_node *node, size_t index);
bool nb_save_cells(nb_save *save, nb_scene_reader *in, const nb_json_node *node);

/* After everything. */
bool nb_save_rest(nb_save *save, const nb_scene_reader *in, const nb_json_node *root);

/* Writes a whole volume as JSON, with a zero byte behind it. False when memory is out. Free text->data with nb_release.
 */
bool nb_save_write_volume(const nebel_allocator *allocator, const nb_space *space, const nebel_volume_desc *volume,
                          const char *name, nb_bytes *text);

#endif
