/* A changed camera, back into the file. */
#include "scene/save.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CAMERA_PLACE(member, count)                                                                                    \
    {                                                                                                                  \
#member, offsetof(nebel_camera, member), count, NB_EDIT_EACH                                                   \
    }

static const nb_place camera_places[] = {
    CAMERA_PLACE(position, 3),     CAMERA_PLACE(look_at, 3),     CAMERA_PLACE(up, 3),
    CAMERA_PLACE(vertical_fov, 1), CAMERA_PLACE(view_height, 1), {NULL, 0, 0, NB_EDIT_EACH},
};

static bool is_same_camera(const nebel_camera *a, const nebel_camera *b)
{
    for (size_t i = 0; camera_places[i].key != NULL; i++)
        if (nb_place_differs(a, b, &camera_places[i])) return false;
    return a->projection == b->projection;
}

/* Without a look_at of its own a camera looks ahead from wherever it is, so that one that moves needs one. */
void nb_save_camera(nb_save *save, const nb_scene_reader *in)
{
    const nb_json_node *camera = nb_edit_member(in->json, save->root.node, "camera");
    const nb_edit_object object = nb_edit_find(in->json, camera);
    nebel_camera was = save->before->camera, now = save->changed->camera;
    char projection[NB_EDIT_NUMBERS] = "";
    if (is_same_camera(&was, &now)) return;
    if (was.projection != now.projection)
        snprintf(projection, sizeof projection, "\"projection\": \"%s\"", nb_projection_names[now.projection]);
    nb_space_restore_camera(&in->space, &was);
    nb_space_restore_camera(&in->space, &now);
    if (nb_edit_member(in->json, camera, "look_at") == NULL) was.look_at[0] = HUGE_VAL;
    nb_save_object(save, in->json, &save->root, "camera", projection, camera_places, &was, &now);
    if (object.last_end != 0 && projection[0] != '\0')
        nb_edit_word(&save->edit, in->json, &object, "projection", nb_projection_names[now.projection]);
}
