/* A planet of the model "textured": a ball, shells of clouds, a shell of air. */
#include "image/image_codec.h"
#include "model/model.h"
#include "file/path.h"
#include "scene_data.h"

#include <string.h>

static const nb_range planet_radius_range = {.low = 1, .high = 1e12, .dimension = NB_LENGTH, .text = "a length"};
static const nb_range shell_height_range = {
    .low = 0, .high = 1e12, .open = true, .dimension = NB_LENGTH, .text = "a height above the ground"};
static const nb_range period_range = {.low = -1e12, .high = 1e12, .text = "a number of frames from -1e12 to 1e12"};
static const nb_range part_range = {
    .low = 0, .high = 1, .open = true, .text = "a number between 0 and 1, without them"};

/* ---- maps ------------------------------------------------------------------------------------ */

/* One channel of grey pictures and of the mean of others, or three, linear where the file's are not. `texels` may be the picture's. */
static void keep_channels(const nebel_image *image, const int first[3], int channels, bool is_linear, float *texels)
{
    const size_t count = (size_t)image->width * image->height, n = image->channel_count;
    for (size_t i = 0; i < count; i++) {
        float color[3];
        for (int c = 0; c < 3; c++) {
            const float value = image->samples[i * n + (size_t)first[c]];
            color[c] = is_linear || channels == 1 ? value : (float)nb_key_value_linear_from_srgb((double)value);
        }
        if (channels == 1) color[0] = (color[0] + color[1] + color[2]) / 3;
        memcpy(&texels[(size_t)channels * i], color, (size_t)channels * sizeof *color);
    }
}

/* Where texels go: where samples are, if they are no more. */
static bool make_room(const nb_codec *codec, size_t count, int channels, const nebel_image *image, float **texels)
{
    *texels = image->samples;
    if (image->channel_count < (size_t)channels) *texels = nb_allocate(&codec->allocator, count, sizeof **texels);
    return *texels != NULL;
}

static nebel_result set_map(const nb_codec *codec, nebel_image *image, int channels, nebel_planet_map *map)
{
    static const char *const colors[3] = {"R", "G", "B"};
    int first[3];
    float *texels;
    if (image->width > NEBEL_MAX_PLANET_MAP_SIZE || image->height > NEBEL_MAX_PLANET_MAP_SIZE)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: has %u x %u pixels; a map has at most %d on each side",
                       codec->name, (unsigned)image->width, (unsigned)image->height, NEBEL_MAX_PLANET_MAP_SIZE);
    for (int c = 0; c < 3; c++) {
        first[c] = nb_image_channel(image, colors[c]);
        if (first[c] < 0) first[c] = nb_image_channel(image, "Y");
        if (first[c] < 0)
            return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: has neither channels R, G and B nor Y", codec->name);
    }
    const size_t count = (size_t)image->width * image->height * (size_t)channels;
    if (!make_room(codec, count, channels, image, &texels))
        return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    keep_channels(image, first, channels, nebel_get_image_format(codec->name) == NEBEL_IMAGE_EXR, texels);
    if (texels != image->samples) nb_release(&codec->allocator, image->samples);
    image->samples = texels;
    *map = (nebel_planet_map){image->width, image->height, channels, texels};
    for (size_t i = 0; i < count; i++)
        if (!(image->samples[i] >= 0 && image->samples[i] <= 1))
            return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: holds %g; a map holds numbers from 0 to 1",
                           codec->name, (double)image->samples[i]);
    return NEBEL_OK;
}

bool nb_keys_read_map(nb_scene_reader *in, const nb_json_node *node, int channels, nebel_planet_map *map)
{
    nebel_scene *scene = in->scene;
    const char *path = "";
    nb_note note = {""};
    if (node == NULL) return true;
    if (!nb_key_value_text(in->json, node, &scene->arena, &path)) return false;
    if (nebel_get_image_format(path) == NEBEL_IMAGE_NONE)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node,
                            "is \"%s\"; must be the path of a picture, .png or .exr", path);
    const char *file = nb_path_join(&scene->arena, scene->folder, path);
    if (file == NULL || !nb_scene_keep_file(scene, file))
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    const nb_codec codec = {
        .allocator = scene->allocator, .log = nb_note_log(&note), .name = file, .room = nb_scene_room(scene)};
    nebel_image *image = &scene->maps[scene->map_count];
    nebel_result result = nb_image_read(&codec, image);
    if (result == NEBEL_OK) {
        scene->map_count++;
        result = set_map(&codec, image, channels, map);
    }
    if (result != NEBEL_OK) return nb_json_fail(in->json, result, node, "%s", note.text);
    return nb_scene_charge(in, node, (double)map->width * (double)map->height * channels * (double)sizeof(float), 0);
}

bool nb_keys_read_seed(nb_scene_reader *in, const nb_json_node *node, uint32_t *seed)
{
    int number = (int)*seed;
    if (node == NULL) return true;
    if (!nb_key_value_integer(in->json, node, 0, INT32_MAX, &number)) return false;
    *seed = (uint32_t)number;
    return true;
}

/* ---- shells ---------------------------------------------------------------------------------- */

static bool read_cloud(nb_scene_reader *in, const nb_json_node *node, nebel_cloud_shell *shell)
{
    enum { HEIGHT, ROTATION_PERIOD, COLOR, COVERAGE_MAP, DETAIL_MAP, UV_TILING, GAIN, COVERAGE, SEED, COUNT };
    static const char *const names[] = {"height", "rotation_period", "color", "coverage_map", "detail_map", "uv_tiling",
                                        "gain",   "coverage",        "seed"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a shell of clouds"};
    static const nb_range tiling_range = {.low = -1e3, .high = 1e3, .text = "a number from -1000 to 1000"};
    static const nb_range gain_range = {
        .low = 0, .high = 1e3, .open = true, .text = "a number between 0 and 1000, without them"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {...}") ||
        !nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[HEIGHT], &shell_height_range, &shell->height) ||
        !nb_key_value_number(json, found[ROTATION_PERIOD], &period_range, &shell->rotation_period) ||
        !nb_key_value_color(json, found[COLOR], &nb_range_fraction, shell->color) ||
        !nb_keys_read_map(in, found[COVERAGE_MAP], 1, &shell->coverage_map) ||
        !nb_keys_read_map(in, found[DETAIL_MAP], 1, &shell->detail_map) ||
        !nb_key_value_numbers(json, found[UV_TILING], &tiling_range, 3, shell->uv_tiling) ||
        !nb_key_value_number(json, found[GAIN], &gain_range, &shell->gain) ||
        !nb_key_value_number(json, found[COVERAGE], &part_range, &shell->coverage) ||
        !nb_keys_read_seed(in, found[SEED], &shell->seed))
        return false;
    shell->height *= in->space.unit;
    return true;
}

static bool read_clouds(nb_scene_reader *in, const nb_json_node *node, nebel_textured_planet_desc *desc)
{
    if (node == NULL) return true;
    if (!nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array of shells of clouds") ||
        !nb_key_value_at_most(in->json, node, NEBEL_MAX_CLOUD_SHELLS, "a planet", "shells of clouds"))
        return false;
    for (const nb_json_node *one = nb_json_first(in->json, node); one != NULL; one = nb_json_next(in->json, one))
        if (!read_cloud(in, one, &desc->cloud_shells[desc->cloud_shell_count++])) return false;
    return true;
}

static bool read_ramp(nb_json *json, const nb_json_node *node, nebel_atmosphere_shell *air)
{
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_ARRAY, "an array of colours") ||
        !nb_key_value_at_most(json, node, NEBEL_MAX_RAMP_COLORS, "a ramp", "colours"))
        return false;
    for (const nb_json_node *one = nb_json_first(json, node); one != NULL; one = nb_json_next(json, one))
        if (!nb_key_value_color(json, one, &nb_range_fraction, air->ramp[air->ramp_count++])) return false;
    return air->ramp_count > 0 || nb_json_fail(json, NEBEL_ERROR_FORMAT, node, "is empty; leave it out for a blue one");
}

static bool read_air_shell(nb_scene_reader *in, const nb_json_node *node, nebel_atmosphere_shell *air)
{
    enum { HEIGHT, BRIGHTNESS, RAMP, COUNT };
    static const char *const names[] = {"height", "brightness", "ramp"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a shell of air"};
    static const nb_range brightness_range = {.low = 0, .high = 1e6, .text = "a number from 0 to 1e6"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    if (node == NULL) return true;
    if (!nb_key_value_is(json, node, NB_JSON_OBJECT, "an object {...}") ||
        !nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[HEIGHT], &shell_height_range, &air->height) ||
        !nb_key_value_number(json, found[BRIGHTNESS], &brightness_range, &air->brightness) ||
        !read_ramp(json, found[RAMP], air))
        return false;
    air->height *= in->space.unit;
    air->is_disabled = found[BRIGHTNESS] != NULL && air->brightness == 0;
    return true;
}

/* ---- planets --------------------------------------------------------------------------------- */

static bool turns(const nebel_textured_planet_desc *planet)
{
    bool does = planet->rotation_period != 0;
    for (uint32_t i = 0; i < planet->cloud_shell_count; i++)
        does = does || planet->cloud_shells[i].rotation_period != 0;
    return does;
}

bool nb_keys_read_layers(nb_scene_reader *in, const nb_json_node *node, nebel_textured_planet_desc *desc)
{
    enum {
        MODEL,
        CENTER,
        RADIUS,
        ROTATION,
        ROTATION_PERIOD,
        COLOR_MAP,
        LAND_COVERAGE,
        SEED,
        CLOUDS,
        ATMOSPHERE,
        COUNT
    };
    static const char *const names[] = {"model",     "center",        "radius", "rotation", "rotation_period",
                                        "color_map", "land_coverage", "seed",   "clouds",   "atmosphere"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, NB_BIT(MODEL), "a textured planet"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double radius = 6.36e6 / in->space.unit, scale[3] = {1, 1, 1};
    *desc = (nebel_textured_planet_desc){.rotation = {0, 0, 0, 1}};
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[RADIUS], &planet_radius_range, &radius) ||
        !nb_key_value_place(json, found[CENTER], desc->center) ||
        !nb_key_value_rotation(json, found[ROTATION], desc->rotation) ||
        !nb_key_value_number(json, found[ROTATION_PERIOD], &period_range, &desc->rotation_period) ||
        !nb_keys_read_map(in, found[COLOR_MAP], 3, &desc->color_map) ||
        !nb_key_value_number(json, found[LAND_COVERAGE], &part_range, &desc->land_coverage) ||
        !nb_keys_read_seed(in, found[SEED], &desc->seed) || !read_clouds(in, found[CLOUDS], desc) ||
        !read_air_shell(in, found[ATMOSPHERE], &desc->atmosphere))
        return false;
    desc->radius = radius * in->space.unit;
    nb_file_units_convert_placement(&in->space, desc->center, desc->rotation, scale);
    if (found[CENTER] == NULL) desc->center[1] = -desc->radius;
    in->scene->data.has_endless_motion |= turns(desc);
    return true;
}
