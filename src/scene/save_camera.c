/* A changed camera and its motion, back into the file. */
#include "key_patch.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CAMERA_PLACE(member, count)                                                                                    \
    {                                                                                                                  \
#member, offsetof(nebel_camera, member), count, NB_EDIT_EACH                                                   \
    }

static const nb_key_entry camera_places[] = {
    CAMERA_PLACE(position, 3),     CAMERA_PLACE(look_at, 3),     CAMERA_PLACE(up, 3),
    CAMERA_PLACE(vertical_fov, 1), CAMERA_PLACE(view_height, 1), {NULL, 0, 0, NB_EDIT_EACH},
};

static bool has_same_view(const nebel_camera *a, const nebel_camera *b)
{
    for (size_t i = 0; camera_places[i].key != NULL; i++)
        if (nb_place_differs(a, b, &camera_places[i])) return false;
    return true;
}

/* ---- motion ---------------------------------------------------------------------------------- */

static bool has_same_motion(const nebel_scene_data *a, const nebel_scene_data *b)
{
    if (a->turntable_frames != b->turntable_frames || a->camera_key_count != b->camera_key_count) return false;
    for (size_t i = 0; i < a->camera_key_count; i++)
        if (a->camera_keys[i].frame != b->camera_keys[i].frame ||
            !has_same_view(&a->camera_keys[i].camera, &b->camera_keys[i].camera))
            return false;
    return true;
}

/* Whole: what a key left out it took from a camera that may be another now. */
static void write_key(nb_json_writer *out, const nb_file_units *space, const nebel_camera_key *key)
{
    nebel_camera own = key->camera;
    nb_file_units_restore_camera(space, &own);
    nb_json_writer_put(out, "{ \"frame\": ");
    nb_json_writer_put_numbers(out, 1, &key->frame, NB_EDIT_EACH);
    for (size_t i = 0; camera_places[i].key != NULL; i++) {
        nb_json_writer_put(out, ", \"");
        nb_json_writer_put(out, camera_places[i].key);
        nb_json_writer_put(out, "\": ");
        nb_json_writer_put_numbers(out, camera_places[i].count, nb_place_numbers(&own, &camera_places[i]),
                                   NB_EDIT_EACH);
    }
    nb_json_writer_put(out, " }");
}

/* The member that says how the camera moves: its key is `word`; NULL: none, it stands still. */
static const char *write_motion(nb_json_writer *out, const nb_file_units *space, const nebel_scene_data *scene)
{
    const double frames = scene->turntable_frames;
    if (scene->turntable_frames > 0) {
        nb_json_writer_put(out, "{ \"frames\": ");
        nb_json_writer_put_numbers(out, 1, &frames, NB_EDIT_EACH);
        nb_json_writer_put(out, " }");
        return "turntable";
    }
    for (size_t i = 0; i < scene->camera_key_count; i++) {
        nb_json_writer_put(out, i == 0 ? "[" : ", ");
        write_key(out, space, &scene->camera_keys[i]);
    }
    if (scene->camera_key_count == 0) return NULL;
    nb_json_writer_put(out, "]");
    return "keys";
}

static void save_motion(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *camera)
{
    const nb_json *json = in->json;
    const nb_json_node *turntable = nb_json_patch_member(json, camera->node, "turntable");
    const nb_json_node *was = turntable != NULL ? turntable : nb_json_patch_member(json, camera->node, "keys");
    nb_json_writer out = {.save = save};
    const char *key = write_motion(&out, &in->space, save->changed), *words = nb_json_writer_end(&out);
    if (words != NULL && key != NULL && was != NULL && nb_json_has_key(was, key))
        nb_json_patch_replace(&save->edit, was, words);
    else if (words != NULL && key != NULL)
        nb_json_patch_add(&save->edit, camera, key, words);
    if (was != NULL && (key == NULL || !nb_json_has_key(was, key)))
        nb_json_patch_remove_members(&save->edit, json, camera->node, (const char *const[]){"turntable", "keys", NULL});
    nb_release(&save->edit.arena.allocator, out.bytes.data);
}

/* ---- the camera ------------------------------------------------------------------------------ */

/* In a file without a camera, or with one that says no more than how it moves. Without a look_at it would look ahead
 * from wherever it is. */
static void write_camera(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node,
                         const nebel_camera *was, const nebel_camera *now)
{
    nb_json_writer out = {.save = save}, motion = {.save = save};
    const char *key = write_motion(&motion, &in->space, save->changed), *words = nb_json_writer_end(&motion);
    nb_json_writer_put(&out, "{ ");
    if (was->projection != now->projection) {
        nb_json_writer_put(&out, "\"projection\": ");
        nb_json_writer_put_text(&out, nb_projection_names[now->projection]);
    }
    for (size_t i = 0; camera_places[i].key != NULL; i++) {
        if (!nb_place_differs(was, now, &camera_places[i])) continue;
        nb_json_writer_put(&out, out.bytes.size > 2 ? ", " : "");
        nb_json_writer_put_text(&out, camera_places[i].key);
        nb_json_writer_put(&out, ": ");
        nb_json_writer_put_numbers(&out, camera_places[i].count, nb_place_numbers(now, &camera_places[i]),
                                   NB_EDIT_EACH);
    }
    if (key != NULL && words != NULL) {
        nb_json_writer_put(&out, out.bytes.size > 2 ? ", " : "");
        nb_json_writer_put_text(&out, key);
        nb_json_writer_put(&out, ": ");
        nb_json_writer_put(&out, words);
    }
    nb_json_writer_put(&out, " }");
    words = nb_json_writer_end(&out);
    if (words != NULL && node != NULL)
        nb_json_patch_replace(&save->edit, node, words);
    else if (words != NULL)
        nb_json_patch_add(&save->edit, &save->root, "camera", words);
    nb_release(&save->edit.arena.allocator, motion.bytes.data);
    nb_release(&save->edit.arena.allocator, out.bytes.data);
}

static void change_camera(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *camera,
                          const nebel_camera *was, const nebel_camera *now, bool has_moved)
{
    nb_key_patch_places(save, in->json, camera, camera_places, NB_ALL_PLACES, was, now);
    if (was->projection != now->projection)
        nb_json_patch_word(&save->edit, in->json, camera, "projection", nb_projection_names[now->projection]);
    /* Keys take what they leave out from the camera. */
    if (!has_same_motion(save->before, save->changed) || (has_moved && save->changed->camera_key_count > 0))
        save_motion(save, in, camera);
}

static bool has_motion_alone(const nb_json *json, const nb_json_node *camera)
{
    const nb_json_node *first = nb_json_first(json, camera);
    return camera->count == 1 && (nb_json_has_key(first, "turntable") || nb_json_has_key(first, "keys"));
}

void nb_key_patch_camera(nb_key_patch *save, const nb_scene_reader *in)
{
    const nb_json_node *node = nb_json_patch_member(in->json, save->root.node, "camera");
    const nb_json_patch_object camera = nb_json_patch_find(in->json, node);
    nebel_camera was = save->before->camera, now = save->changed->camera;
    const bool has_moved = !has_same_view(&was, &now);
    if (!has_moved && was.projection == now.projection && has_same_motion(save->before, save->changed)) return;
    nb_file_units_restore_camera(&in->space, &was);
    nb_file_units_restore_camera(&in->space, &now);
    /* Without a look_at of its own a camera looks ahead from wherever it is, so that one that moves needs one. */
    if (has_moved && nb_json_patch_member(in->json, node, "look_at") == NULL) was.look_at[0] = HUGE_VAL;
    if (camera.last_end == 0 || has_motion_alone(in->json, node))
        write_camera(save, in, node, &was, &now);
    else
        change_camera(save, in, &camera, &was, &now, has_moved);
}
