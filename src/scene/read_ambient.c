/* The sections "ambient" and "background": a colour, or what depends on the direction. */
#include "image/image_codec.h"
#include "model/model.h"
#include "file/path.h"
#include "scene_data.h"

#include <string.h>

static bool is_word(const nb_json_node *node, const char *word)
{
    return node->type == NB_JSON_STRING && strlen(word) == node->string_size &&
           memcmp(node->string, word, node->string_size) == 0;
}

bool nb_keys_read_background(nb_scene_reader *in, const nb_json_node *node)
{
    nebel_scene_data *data = &in->scene->data;
    data->shows_ambient = is_word(node, "ambient");
    return data->shows_ambient || nb_key_value_color(in->json, node, &nb_range_light, data->background);
}

/* ---- gradients ------------------------------------------------------------------------------- */

static bool read_gradient(nb_scene_reader *in, const nb_json_node *node, nebel_environment *environment)
{
    enum { TYPE, ZENITH, HORIZON, GROUND, COUNT };
    static const char *const names[] = {"type", "zenith", "horizon", "ground"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(COUNT) - 1, "a gradient"};
    const nb_json_node *found[COUNT];
    environment->type = NEBEL_ENVIRONMENT_GRADIENT;
    return nb_key_value_members(in->json, node, &keys, found) &&
           nb_key_value_color(in->json, found[ZENITH], &nb_range_light, environment->zenith) &&
           nb_key_value_color(in->json, found[HORIZON], &nb_range_light, environment->horizon) &&
           nb_key_value_color(in->json, found[GROUND], &nb_range_light, environment->ground);
}

/* ---- maps ------------------------------------------------------------------------------------ */

/* Red, green and blue alone, in place. */
static nebel_result keep_colors(const nb_codec *codec, nebel_image *image)
{
    const int first[3] = {nb_image_channel(image, "R"), nb_image_channel(image, "G"), nb_image_channel(image, "B")};
    if (first[0] < 0 || first[1] < 0 || first[2] < 0)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: has no channels R, G and B", codec->name);
    const size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) {
        float color[3];
        for (int c = 0; c < 3; c++) color[c] = image->samples[i * image->channel_count + (size_t)first[c]];
        memcpy(&image->samples[3 * i], color, sizeof color);
    }
    return NEBEL_OK;
}

static nebel_result make_environment_map(const nb_codec *codec, const nebel_image *image, nebel_environment_map **map)
{
    nb_note note = {""};
    const nebel_environment_map_desc desc = {.host = {.allocator = codec->allocator, .log = nb_note_log(&note)},
                                             .width = image->width,
                                             .height = image->height,
                                             .pixels = image->samples};
    const nebel_result result = nebel_create_environment_map(&desc, map);
    return result == NEBEL_OK ? result : nb_fail(&codec->log, result, "%s: %s", codec->name, note.text);
}

/* Larger pictures are refused before memory is asked for. */
static nebel_result load_map(const nebel_scene *scene, const nebel_log *log, const char *file,
                             nebel_environment_map **map, double *bytes)
{
    const nb_codec codec = {.allocator = scene->allocator,
                            .log = *log,
                            .room = nb_scene_room(scene),
                            .name = file,
                            .most_pixels = (uint64_t)NEBEL_MAX_ENVIRONMENT_WIDTH * NEBEL_MAX_ENVIRONMENT_WIDTH / 2};
    nebel_image image;
    nebel_result result = nb_image_read(&codec, &image);
    if (result != NEBEL_OK) return result;
    result = keep_colors(&codec, &image);
    if (result == NEBEL_OK) result = make_environment_map(&codec, &image, map);
    *bytes = (double)image.width * image.height * (double)sizeof(float[3]);
    nb_image_release(&scene->allocator, &image);
    return result;
}

/* The core knows what intensity is too much for the brightest pixel. */
static bool try_environment(nb_scene_reader *in, const nb_json_node *node, const nebel_environment *environment)
{
    nebel_snapshot *empty = NULL;
    nebel_lighting *trial = NULL;
    nebel_result result = nebel_commit_fog(in->trial, &empty);
    if (result == NEBEL_OK)
        result = nebel_create_lighting(empty, &(nebel_lighting_desc){.environment = *environment}, &trial);
    nebel_release_lighting(trial);
    nebel_release_snapshot(empty);
    return result == NEBEL_OK || nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node, "%s", in->core_message);
}

static bool read_map_file(nb_scene_reader *in, const nb_json_node *node, nebel_environment *environment)
{
    nebel_scene *scene = in->scene;
    const char *path = "";
    nb_note note = {""};
    const nebel_log log = nb_note_log(&note);
    if (!nb_key_value_text(in->json, node, &scene->arena, &path)) return false;
    if (nebel_get_image_format(path) != NEBEL_IMAGE_EXR)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node,
                            "is \"%s\"; must be the path of an OpenEXR picture, .exr", path);
    const char *file = nb_path_join(&scene->arena, scene->folder, path);
    if (file == NULL || !nb_scene_keep_file(scene, file))
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->data.environment_path = file;
    double bytes = 0;
    const nebel_result result = load_map(scene, &log, file, &scene->environment_map, &bytes);
    environment->map = scene->environment_map;
    if (result != NEBEL_OK) return nb_json_fail(in->json, result, node, "%s", note.text);
    return nb_scene_charge(in, node, bytes, 0);
}

static bool read_map(nb_scene_reader *in, const nb_json_node *node, nebel_environment *environment)
{
    enum { TYPE, FILE_KEY, ROTATION, INTENSITY, COUNT };
    static const char *const names[] = {"type", "file", "rotation", "intensity"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(TYPE) | NB_BIT(FILE_KEY), "an environment"};
    static const nb_range rotation_range = {.low = -NEBEL_MAX_ENVIRONMENT_ROTATION,
                                            .high = NEBEL_MAX_ENVIRONMENT_ROTATION,
                                            .text = "a number of degrees from -1e6 to 1e6"};
    static const nb_range intensity_range = {
        .low = 0, .high = NEBEL_MAX_AMOUNT, .open = true, .text = "a number > 0 and < " NB_TEXT(NEBEL_MAX_AMOUNT)};
    const nb_json_node *found[COUNT];
    environment->type = NEBEL_ENVIRONMENT_MAP;
    environment->intensity = 1;
    return nb_key_value_members(in->json, node, &keys, found) &&
           nb_key_value_number(in->json, found[ROTATION], &rotation_range, &environment->rotation) &&
           nb_key_value_number(in->json, found[INTENSITY], &intensity_range, &environment->intensity) &&
           read_map_file(in, found[FILE_KEY], environment) &&
           try_environment(in, found[INTENSITY] != NULL ? found[INTENSITY] : node, environment);
}

bool nb_keys_read_ambient(nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const types[] = {"gradient", "environment"};
    nebel_scene_data *data = &in->scene->data;
    if (node->type != NB_JSON_OBJECT) return nb_key_value_color(in->json, node, &nb_range_light, data->ambient);
    const int type = nb_key_value_type(in->json, node, types, 2);
    if (type < 0) return false;
    return type == 0 ? read_gradient(in, node, &data->environment) : read_map(in, node, &data->environment);
}
