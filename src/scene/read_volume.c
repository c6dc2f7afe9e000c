/* One entry of the section "fog". */
#include "scene/scene_internal.h"

#include <math.h>
#include <string.h>

enum {
    NAME,
    SHAPE,
    OPERATION,
    DENSITY,
    EXTINCTION,
    MEAN_FREE_PATH,
    VISIBILITY,
    CONTRAST,
    SOURCE,
    ALBEDO,
    PHASE,
    EMISSION,
    VOLUME_KEY_COUNT
};

static const char *const key_names[] = {"name",       "shape",          "operation",  "density",
                                        "extinction", "mean_free_path", "visibility", "contrast",
                                        "source",     "albedo",         "phase",      "emission"};

#define EXCLUDE_KEYS (NB_BIT(NAME) | NB_BIT(SHAPE) | NB_BIT(OPERATION))

static const nb_keys volume_keys[] = {
    {key_names, VOLUME_KEY_COUNT, NB_BIT(VOLUME_KEY_COUNT) - 1, NB_BIT(SHAPE), "a volume"},
    {key_names, VOLUME_KEY_COUNT, EXCLUDE_KEYS, NB_BIT(SHAPE), "a volume with \"operation\": \"exclude\""}};

static bool read_operation(nb_json *json, const nb_json_node *volume, nebel_operation *operation)
{
    static const char *const names[] = {"add", "exclude"};
    for (const nb_json_node *node = nb_json_first(json, volume); node != NULL; node = nb_json_next(json, node)) {
        if (!nb_json_has_key(node, "operation")) continue;
        const int choice = nb_value_choice(json, node, names, 2);
        if (choice < 0) return false;
        *operation = (nebel_operation)choice;
    }
    return true;
}

/* ---- amount
 * ---------------------------------------------------------------------------------------------------------- */

static double extinction_from_path(double path, double contrast)
{
    (void)contrast;
    return 1 / path;
}

static bool read_length(nb_json *json, const nb_json_node *node, double contrast,
                        double (*convert)(double length, double contrast), double extinction[3])
{
    double length[3];
    if (!nb_value_amount(json, node, &nb_range_positive, length)) return false;
    for (int i = 0; i < 3; i++) {
        extinction[i] = convert(length[i], contrast);
        if (!isfinite(extinction[i]))
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                                "%.15g m is too short; its extinction is too large a number", length[i]);
    }
    return true;
}

static bool check_amount_count(nb_json *json, const nb_json_node *volume, const nb_json_node *const *found)
{
    const nb_json_node *first = NULL;
    for (int i = EXTINCTION; i <= VISIBILITY; i++) {
        if (found[i] == NULL) continue;
        if (first != NULL)
            return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[i],
                                    "the amount is given twice; keep one of extinction, mean_free_path, visibility");
        first = found[i];
    }
    if (first != NULL) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, volume,
                        "the amount is missing; give one of extinction, mean_free_path, visibility");
}

static bool read_amount(nb_json *json, const nb_json_node *volume, const nb_json_node *const *found,
                        double extinction[3])
{
    static const nb_range contrast_range = {0, 1, true, "a number > 0 and < 1"};
    double contrast = 0.05;
    if (!check_amount_count(json, volume, found)) return false;
    if (found[CONTRAST] != NULL && found[VISIBILITY] == NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[CONTRAST],
                                "belongs to \"visibility\", which is absent");
    if (!nb_value_number(json, found[CONTRAST], &contrast_range, &contrast)) return false;
    if (found[EXTINCTION] != NULL) return nb_value_amount(json, found[EXTINCTION], &nb_range_not_negative, extinction);
    if (found[VISIBILITY] != NULL)
        return read_length(json, found[VISIBILITY], contrast, nebel_extinction_from_visibility, extinction);
    return read_length(json, found[MEAN_FREE_PATH], 0, extinction_from_path, extinction);
}

/* ---- light
 * ----------------------------------------------------------------------------------------------------------- */

static void remember_lit(nb_scene_reader *in, const nb_json_node *albedo, const double color[3])
{
    if (in->lit_offset != 0 || (color[0] == 0 && color[1] == 0 && color[2] == 0)) return;
    in->lit_offset = albedo->offset;
    nb_json_path(in->json, albedo, in->lit_path);
}

static bool read_light(nb_scene_reader *in, const nb_json_node *const *found, nebel_volume_desc *volume)
{
    nb_json *json = in->json;
    if (found[SOURCE] != NULL && found[ALBEDO] != NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[ALBEDO],
                                "a volume has \"source\" or \"albedo\", not both; remove one");
    if (found[PHASE] != NULL && found[ALBEDO] == NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[PHASE], "belongs to \"albedo\", which is absent");
    if (!nb_value_color(json, found[SOURCE], &nb_range_not_negative, volume->source) ||
        !nb_value_color(json, found[ALBEDO], &nb_range_fraction, volume->albedo) || !nb_read_phase(in, found[PHASE]) ||
        !nb_value_color(json, found[EMISSION], &nb_range_not_negative, volume->emission))
        return false;
    if (found[ALBEDO] != NULL) remember_lit(in, found[ALBEDO], volume->albedo);
    return true;
}

/* ---- volume
 * ---------------------------------------------------------------------------------------------------------- */

bool nb_read_try(nb_scene_reader *in, const nb_json_node *node, const char *subject, const nebel_volume_desc *volume)
{
    nebel_volume_id id;
    in->core_message[0] = '\0';
    nebel_result result = nebel_add_volume(in->trial, volume, &id);
    if (result == NEBEL_OK) result = nebel_remove_volume(in->trial, id);
    if (result == NEBEL_OK) return true;
    const bool kept = result == NEBEL_ERROR_MEMORY || result == NEBEL_ERROR_LIMIT || result == NEBEL_ERROR_UNSUPPORTED;
    const char *text = in->core_message[0] != '\0' ? in->core_message : nebel_result_text(result);
    const size_t known = strlen(subject);
    if (strncmp(text, subject, known) == 0) text += known;
    return nb_json_fail(in->json, kept ? result : NEBEL_ERROR_FORMAT, node, "%s", text);
}

static bool keep_volume(nb_scene_reader *in, const nb_json_node *node, const nebel_volume_desc *volume,
                        const char *name)
{
    nebel_scene *scene = in->scene;
    const size_t count = scene->data.volume_count;
    void *volumes = scene->volumes;
    void *names = (void *)scene->volume_names;
    const bool room = nb_grow(&scene->allocator, &volumes, sizeof *volume, count, &scene->volume_capacity, count + 1);
    scene->volumes = volumes;
    const bool name_room = nb_grow(&scene->allocator, &names, sizeof name, count, &scene->name_capacity, count + 1);
    scene->volume_names = names;
    if (!room || !name_room) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->volumes[count] = *volume;
    scene->volume_names[count] = name;
    scene->data.volume_count = count + 1;
    return true;
}

bool nb_read_volume(nb_scene_reader *in, const nb_json_node *node)
{
    const nb_json_node *found[VOLUME_KEY_COUNT];
    nb_json *json = in->json;
    nebel_volume_desc volume = {.operation = NEBEL_OPERATION_ADD};
    const char *name = "";
    if (!nb_value_is(json, node, NB_JSON_OBJECT, "a volume {\"shape\": ...}") ||
        !read_operation(json, node, &volume.operation) ||
        !nb_value_members(json, node, &volume_keys[volume.operation], found) ||
        !nb_value_text(json, found[NAME], &in->scene->arena, &name) || !nb_read_shape(in, found[SHAPE], &volume.shape))
        return false;
    if (volume.operation == NEBEL_OPERATION_ADD &&
        (!nb_read_density(in, found[DENSITY], volume.shape.type, &volume.density) ||
         !read_amount(json, node, found, volume.extinction) || !read_light(in, found, &volume)))
        return false;
    nb_space_convert_volume(&in->space, &volume);
    return nb_read_try(in, node, "", &volume) && keep_volume(in, node, &volume, name);
}
