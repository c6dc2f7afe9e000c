/* The sections "camera", its turntable and its keys. */
#include "scene_data.h"

enum {
    CAMERA_POSITION,
    CAMERA_LOOK_AT,
    CAMERA_UP,
    CAMERA_VERTICAL_FOV,
    CAMERA_VIEW_HEIGHT,
    CAMERA_PROJECTION,
    CAMERA_TURNTABLE,
    CAMERA_KEYS,
    CAMERA_FRAME,
    CAMERA_KEY_COUNT
};

static const char *const camera_key_names[] = {"position",   "look_at",   "up",   "vertical_fov", "view_height",
                                               "projection", "turntable", "keys", "frame"};

#define VIEW_KEYS                                                                                                      \
    (NB_BIT(CAMERA_POSITION) | NB_BIT(CAMERA_LOOK_AT) | NB_BIT(CAMERA_UP) | NB_BIT(CAMERA_VERTICAL_FOV) |              \
     NB_BIT(CAMERA_VIEW_HEIGHT))

static const nb_key_set camera_keys = {
    camera_key_names, CAMERA_KEY_COUNT,
    VIEW_KEYS | NB_BIT(CAMERA_PROJECTION) | NB_BIT(CAMERA_TURNTABLE) | NB_BIT(CAMERA_KEYS), 0, "a camera"};
static const nb_key_set key_keys = {camera_key_names, CAMERA_KEY_COUNT, VIEW_KEYS | NB_BIT(CAMERA_FRAME),
                                    NB_BIT(CAMERA_FRAME), "a camera key"};

static const nb_range fov_range = {.low = 0, .high = 180, .open = true, .text = "a number of degrees, > 0 and < 180"};

/* Without a look_at of its own a camera looks where the default one does, from wherever it is. */
static void look_ahead(nebel_camera *camera, const double ahead[3])
{
    for (int i = 0; i < 3; i++) camera->look_at[i] = camera->position[i] + ahead[i];
}

/* In metres, as it is used. */
static bool check_view(const nb_scene_reader *in, const nb_json_node *node, const nb_json_node *const *found,
                       nebel_camera camera)
{
    nb_json *json = in->json;
    const nb_json_node *at = found[CAMERA_LOOK_AT] != NULL ? found[CAMERA_LOOK_AT] : node;
    nb_file_units_convert_camera(&in->space, &camera);
    if (!nb_camera_is_apart(&camera))
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, at, "the camera looks at its own position; move one of them");
    if (found[CAMERA_UP] != NULL) at = found[CAMERA_UP];
    if (!nb_camera_is_upright(&camera))
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, at,
                            "the view is along \"up\"; give an \"up\" in another direction, such as [0, 0, -1]");
    return true;
}

/* Reads what a camera and its keys have in common. Without a look_at they look `ahead`; NULL: one was given before. */
static bool read_view(const nb_scene_reader *in, const nb_json_node *node, const nb_json_node *const *found,
                      const double *ahead, nebel_camera *camera)
{
    nb_json *json = in->json;
    if (!nb_key_value_place(json, found[CAMERA_POSITION], camera->position)) return false;
    if (found[CAMERA_LOOK_AT] == NULL && ahead != NULL) look_ahead(camera, ahead);
    return nb_key_value_place(json, found[CAMERA_LOOK_AT], camera->look_at) &&
           nb_key_value_direction(json, found[CAMERA_UP], camera->up) &&
           nb_key_value_number(json, found[CAMERA_VERTICAL_FOV], &fov_range, &camera->vertical_fov) &&
           nb_key_value_number(json, found[CAMERA_VIEW_HEIGHT], &nb_range_extent, &camera->view_height) &&
           check_view(in, node, found, *camera);
}

const char *const nb_projection_names[3] = {"perspective", "orthographic", "panorama"};

static bool read_projection(nb_json *json, const nb_json_node *node, nebel_projection *projection)
{
    if (node == NULL) return true;
    const int choice = nb_key_value_choice(json, node, nb_projection_names, 3);
    if (choice >= 0) *projection = (nebel_projection)choice;
    return choice >= 0;
}

static bool read_turntable(nb_json *json, const nb_json_node *node, uint32_t *frames)
{
    static const char *const turntable_names[] = {"frames"};
    static const nb_key_set keys = {turntable_names, 1, 1, 1, "a turntable"};
    const nb_json_node *found[1];
    int count = 0;
    if (node == NULL) return true;
    if (!nb_key_value_members(json, node, &keys, found) || !nb_key_value_integer(json, found[0], 1, 1000000, &count))
        return false;
    *frames = (uint32_t)count;
    return true;
}

static bool read_camera_key(const nb_scene_reader *in, const nb_json_node *node, const double *ahead,
                            nebel_camera_key *key)
{
    const nb_json_node *found[CAMERA_KEY_COUNT];
    return nb_key_value_members(in->json, node, &key_keys, found) &&
           nb_key_value_number(in->json, found[CAMERA_FRAME], &nb_range_frame, &key->frame) &&
           read_view(in, node, found, ahead, &key->camera);
}

static bool read_camera_keys(nb_scene_reader *in, const nb_json_node *node, const double *ahead)
{
    nebel_scene_data *data = &in->scene->data;
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array of camera keys")) return false;
    if (node->count == 0) return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "holds no key; give one or more");
    nebel_camera_key *keys = nb_arena_allocate(&in->scene->arena, node->count, sizeof *keys);
    if (keys == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(in->json, node); at != NULL; at = nb_json_next(in->json, at), i++) {
        keys[i].camera = data->camera;
        if (!read_camera_key(in, at, ahead, &keys[i])) return false;
        if (i > 0 && keys[i].frame <= keys[i - 1].frame)
            return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, at,
                                "its frame %.15g is not after the key before it, %.15g; frames must ascend",
                                keys[i].frame, keys[i - 1].frame);
    }
    for (i = 0; i < node->count; i++) nb_file_units_convert_camera(&in->space, &keys[i].camera);
    data->camera_keys = keys;
    data->camera_key_count = node->count;
    return true;
}

bool nb_keys_read_camera(nb_scene_reader *in, const nb_json_node *node)
{
    const nb_json_node *found[CAMERA_KEY_COUNT];
    nebel_scene_data *data = &in->scene->data;
    if (!nb_key_value_members(in->json, node, &camera_keys, found)) return false;
    if (found[CAMERA_TURNTABLE] != NULL && found[CAMERA_KEYS] != NULL)
        return nb_json_fail_key(in->json, NEBEL_ERROR_FORMAT, found[CAMERA_KEYS],
                                "a camera has \"turntable\" or \"keys\", not both; remove one");
    double ahead[3];
    nb_file_units_restore_camera(&in->space, &data->camera);
    for (int i = 0; i < 3; i++) ahead[i] = data->camera.look_at[i] - data->camera.position[i];
    if (!read_projection(in->json, found[CAMERA_PROJECTION], &data->camera.projection) ||
        !read_view(in, node, found, ahead, &data->camera) ||
        !read_turntable(in->json, found[CAMERA_TURNTABLE], &data->turntable_frames) ||
        !read_camera_keys(in, found[CAMERA_KEYS], found[CAMERA_LOOK_AT] == NULL ? ahead : NULL))
        return false;
    nb_file_units_convert_camera(&in->space, &data->camera);
    return true;
}
