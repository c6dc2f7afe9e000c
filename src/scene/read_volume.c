/* One entry of the section "fog". */
#include "scene/import.h"

#include <limits.h>
#include <math.h>
#include <string.h>

enum {
    VOLUME_NAME,
    VOLUME_SHAPE,
    VOLUME_OPERATION,
    VOLUME_PRIORITY,
    VOLUME_DENSITY,
    VOLUME_PRESET,
    VOLUME_EXTINCTION,
    VOLUME_MEAN_FREE_PATH,
    VOLUME_VISIBILITY,
    VOLUME_CONTRAST,
    VOLUME_SOURCE,
    VOLUME_ALBEDO,
    VOLUME_PHASE,
    VOLUME_EMISSION,
    VOLUME_START,
    VOLUME_CUTOFF,
    VOLUME_KEYS,
    VOLUME_FRAME,
    VOLUME_KEY_COUNT
};

static const char *const volume_key_names[] = {
    "name",     "shape",  "operation", "priority", "density",  "preset", "extinction", "mean_free_path", "visibility",
    "contrast", "source", "albedo",    "phase",    "emission", "start",  "cutoff",     "keys",           "frame"};

#define PLACE_KEYS                                                                                                     \
    (NB_BIT(VOLUME_NAME) | NB_BIT(VOLUME_OPERATION) | NB_BIT(VOLUME_PRIORITY) | NB_BIT(VOLUME_START) |                 \
     NB_BIT(VOLUME_CUTOFF))
#define EXCLUDE_KEYS (PLACE_KEYS | NB_BIT(VOLUME_SHAPE) | NB_BIT(VOLUME_KEYS))
#define FOG_KEYS (NB_BIT(VOLUME_KEY_COUNT) - 1 - NB_BIT(VOLUME_FRAME))
#define STILL_KEYS (PLACE_KEYS | NB_BIT(VOLUME_PRESET) | NB_BIT(VOLUME_PHASE) | NB_BIT(VOLUME_KEYS))
#define MOVING_KEYS (FOG_KEYS - STILL_KEYS + NB_BIT(VOLUME_FRAME))

/* In the order of nebel_operation. */
static const nb_key_set volume_keys[] = {
    {volume_key_names, VOLUME_KEY_COUNT, FOG_KEYS, NB_BIT(VOLUME_SHAPE), "a volume"},
    {volume_key_names, VOLUME_KEY_COUNT, EXCLUDE_KEYS, NB_BIT(VOLUME_SHAPE),
     "a volume with \"operation\": \"exclude\""},
    {volume_key_names, VOLUME_KEY_COUNT, FOG_KEYS, NB_BIT(VOLUME_SHAPE), "a volume"}};
static const nb_key_set moving_keys[] = {
    {volume_key_names, VOLUME_KEY_COUNT, MOVING_KEYS, NB_BIT(VOLUME_FRAME), "a key of fog"},
    {volume_key_names, VOLUME_KEY_COUNT, NB_BIT(VOLUME_FRAME) | NB_BIT(VOLUME_SHAPE), NB_BIT(VOLUME_FRAME),
     "a key of excluded fog"},
    {volume_key_names, VOLUME_KEY_COUNT, MOVING_KEYS, NB_BIT(VOLUME_FRAME), "a key of fog"}};

static bool read_operation(nb_json *json, const nb_json_node *volume, const char *prefix, nebel_operation *operation)
{
    static const char *const names[] = {"add", "exclude", "replace"};
    for (const nb_json_node *node = nb_json_first(json, volume); node != NULL; node = nb_json_next(json, node)) {
        if (!nb_key_value_is_key(node, prefix, "operation")) continue;
        const int choice = nb_key_value_choice(json, node, names, 3);
        if (choice < 0) return false;
        *operation = (nebel_operation)choice;
    }
    return true;
}

/* ---- amount ---------------------------------------------------------------------------------- */

/* Through `length` fog is of optical depth `depth`. The shortest one is where the extinction is the largest. */
static bool read_length(nb_json *json, const nb_json_node *node, double depth, double extinction[3])
{
    const nb_range range = {
        .low = depth / NEBEL_MAX_AMOUNT, .high = HUGE_VAL, .dimension = NB_LENGTH, .text = "a length"};
    double length[3];
    if (!nb_key_value_amount(json, node, &range, length)) return false;
    for (int i = 0; i < 3; i++) extinction[i] = fmin(depth / length[i], NEBEL_MAX_AMOUNT * json->unit);
    return true;
}

static bool check_amount_count(nb_json *json, const nb_json_node *const *found)
{
    const nb_json_node *first = NULL;
    for (int i = VOLUME_EXTINCTION; i <= VOLUME_VISIBILITY; i++) {
        if (found[i] == NULL) continue;
        if (first != NULL)
            return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[i],
                                    "the amount is given twice; keep one of extinction, mean_free_path, visibility");
        first = found[i];
    }
    return true;
}

static bool check_amount_given(nb_json *json, const nb_json_node *volume, const nb_json_node *const *found)
{
    if (found[VOLUME_EXTINCTION] != NULL || found[VOLUME_MEAN_FREE_PATH] != NULL || found[VOLUME_VISIBILITY] != NULL ||
        found[VOLUME_PRESET] != NULL)
        return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, volume,
                        "the amount is missing; give one of extinction, mean_free_path, visibility, or a preset");
}

/* An amount that is not given leaves `extinction` as it is, as a contrast does. */
static bool read_amount(nb_json *json, const nb_json_node *const *found, double extinction[3], double *contrast)
{
    static const nb_range contrast_range = {.low = 0, .high = 1, .open = true, .text = "a number > 0 and < 1"};
    if (!check_amount_count(json, found)) return false;
    if (found[VOLUME_CONTRAST] != NULL && found[VOLUME_VISIBILITY] == NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[VOLUME_CONTRAST],
                                "belongs to \"visibility\", which is absent");
    if (!nb_key_value_number(json, found[VOLUME_CONTRAST], &contrast_range, contrast)) return false;
    if (found[VOLUME_EXTINCTION] != NULL)
        return nb_key_value_amount(json, found[VOLUME_EXTINCTION], &nb_range_amount, extinction);
    if (found[VOLUME_VISIBILITY] != NULL)
        return read_length(json, found[VOLUME_VISIBILITY], nebel_extinction_from_visibility(1, *contrast), extinction);
    return found[VOLUME_MEAN_FREE_PATH] == NULL || read_length(json, found[VOLUME_MEAN_FREE_PATH], 1, extinction);
}

/* ---- presets --------------------------------------------------------------------------------- */

/* What other keys may replace: a source stands for the light. */
static bool read_volume_preset(nb_json *json, const nb_json_node *const *found, nebel_volume_desc *volume)
{
    enum { MOST_PRESETS = 16 };
    const char *names[MOST_PRESETS];
    size_t count;
    const nebel_fog_preset *const presets = nebel_list_fog_presets(&count);
    if (found[VOLUME_PRESET] == NULL) return true;
    if (count > MOST_PRESETS) count = MOST_PRESETS;
    for (size_t i = 0; i < count; i++) names[i] = presets[i].name;
    const int choice = nb_key_value_choice(json, found[VOLUME_PRESET], names, (int)count);
    if (choice < 0) return false;
    const nebel_fog_preset *const preset = &presets[choice];
    for (int i = 0; i < 3; i++) volume->extinction[i] = preset->extinction[i] * json->unit;
    if (found[VOLUME_SOURCE] != NULL) return true;
    memcpy(volume->albedo, preset->albedo, sizeof volume->albedo);
    volume->phase = preset->phase;
    return true;
}

/* ---- light ----------------------------------------------------------------------------------- */

/* Whether a volume has an albedo, be it 0. */
static bool is_lit(const nb_json_node *const *found)
{
    return found[VOLUME_ALBEDO] != NULL || (found[VOLUME_PRESET] != NULL && found[VOLUME_SOURCE] == NULL);
}

static bool read_volume_light(nb_scene_reader *in, const nb_json_node *const *found, nebel_volume_desc *volume)
{
    nb_json *json = in->json;
    if (found[VOLUME_SOURCE] != NULL && found[VOLUME_ALBEDO] != NULL)
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[VOLUME_ALBEDO],
                                "a volume has \"source\" or \"albedo\", not both; remove one");
    if (found[VOLUME_PHASE] != NULL && !is_lit(found))
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[VOLUME_PHASE],
                                "belongs to \"albedo\", which is absent");
    if (!nb_key_value_color(json, found[VOLUME_SOURCE], &nb_range_light, volume->source) ||
        !nb_key_value_color(json, found[VOLUME_ALBEDO], &nb_range_fraction, volume->albedo) ||
        !nb_keys_read_phase(in, found[VOLUME_PHASE], &volume->phase) ||
        !nb_key_value_color(json, found[VOLUME_EMISSION], &nb_range_amount, volume->emission))
        return false;
    return true;
}

/* ---- keeping --------------------------------------------------------------------------------- */

bool nb_keys_read_try(nb_scene_reader *in, const nb_json_node *node, const char *subject,
                      const nebel_volume_desc *volume)
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

nebel_volume_track nb_volume_entry_default(void)
{
    return (nebel_volume_track){.contrast = 0.05};
}

static bool keep_volume(nb_scene_reader *in, const nb_json_node *node, const nebel_volume_desc *volume,
                        const nebel_volume_track *entry, const char *name, nebel_volume_origin origin)
{
    if (!nb_scene_charge(in, node, NB_VOLUME_BYTES, NB_VOLUME_SECONDS)) return false;
    nebel_scene *scene = in->scene;
    const size_t count = scene->data.volume_count;
    void *volumes = scene->volumes;
    void *names = (void *)scene->volume_names;
    const bool room = nb_grow(&scene->allocator, &volumes, sizeof *volume, count, &scene->volume_capacity, count + 1);
    scene->volumes = volumes;
    const bool name_room = nb_grow(&scene->allocator, &names, sizeof name, count, &scene->name_capacity, count + 1);
    scene->volume_names = names;
    void *origins = scene->volume_origins;
    const bool origin_room =
        nb_grow(&scene->allocator, &origins, sizeof origin, count, &scene->origin_capacity, count + 1);
    scene->volume_origins = origins;
    void *entries = scene->volume_entries;
    const bool entry_room =
        nb_grow(&scene->allocator, &entries, sizeof *entry, count, &scene->entry_capacity, count + 1);
    scene->volume_entries = entries;
    if (!room || !name_room || !origin_room || !entry_room)
        return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    scene->volumes[count] = *volume;
    scene->volume_names[count] = name;
    scene->volume_origins[count] = origin;
    scene->volume_entries[count] = *entry;
    scene->data.volume_count = count + 1;
    scene->data.animated_volume_count += entry->key_count > 0;
    return true;
}

/* ---- keys ------------------------------------------------------------------------------------ */

/* A volume is lit in one way at all frames, so that it is in between, too. */
static bool check_light_key(nb_json *json, const nb_json_node *const *entry, const nb_json_node *const *found)
{
    if (found[VOLUME_SOURCE] != NULL && is_lit(entry))
        return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[VOLUME_SOURCE],
                                "does not go with the volume's \"albedo\"; a volume has one of them at all frames");
    if (found[VOLUME_ALBEDO] == NULL || is_lit(entry)) return true;
    return nb_json_fail_key(json, NEBEL_ERROR_FORMAT, found[VOLUME_ALBEDO],
                            "moves only where the volume itself has an \"albedo\"; give it one, 0 perhaps");
}

/* A scale that changes its sign would pass through 0. */
static bool check_scale_signs(nb_json *json, const nb_json_node *node, const nebel_volume_desc *volume,
                              const nebel_volume_desc *before)
{
    for (int i = 0; i < 3; i++)
        if ((volume->shape.transform.scale[i] < 0) != (before->shape.transform.scale[i] < 0))
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                                "its scale has another sign than that of the key before; between them it would be 0");
    return true;
}

static bool read_volume_key(nb_scene_reader *in, const nb_json_node *node, const nb_json_node *const *entry,
                            nebel_volume_key *key)
{
    const nb_json_node *found[VOLUME_KEY_COUNT];
    nb_json *json = in->json;
    nebel_volume_desc *volume = &key->volume;
    double contrast = nb_volume_entry_default().contrast;
    return nb_key_value_members(json, node, &moving_keys[volume->operation], found) &&
           nb_key_value_number(json, found[VOLUME_FRAME], &nb_range_frame, &key->frame) &&
           nb_keys_read_shape_key(in, found[VOLUME_SHAPE], &volume->shape) &&
           nb_keys_read_density_key(in, found[VOLUME_DENSITY], &volume->density) &&
           read_amount(json, found, volume->extinction, &contrast) && check_light_key(json, entry, found) &&
           read_volume_light(in, found, volume);
}

/* The parts are those of the volume, which are converted with it, once. */
static void convert_key(const nb_file_units *space, nebel_volume_desc *volume)
{
    const size_t planes = volume->shape.plane_count, parts = volume->shape.part_count;
    volume->shape.plane_count = volume->shape.part_count = 0;
    nb_file_units_convert_volume(space, volume);
    volume->shape.plane_count = planes;
    volume->shape.part_count = parts;
}

static bool read_key_list(nb_scene_reader *in, const nb_json_node *list, const nb_json_node *const *entry,
                          const nebel_volume_desc *volume, nebel_volume_key *keys)
{
    nb_json *json = in->json;
    size_t i = 0;
    for (const nb_json_node *at = nb_json_first(json, list); at != NULL; at = nb_json_next(json, at), i++) {
        keys[i].volume = *volume;
        if (!read_volume_key(in, at, entry, &keys[i])) return false;
        if (i > 0 && keys[i].frame <= keys[i - 1].frame)
            return nb_json_fail(json, NEBEL_ERROR_FORMAT, at,
                                "its frame %.15g is not after the key before it, %.15g; frames must ascend",
                                keys[i].frame, keys[i - 1].frame);
        if (i > 0 && !check_scale_signs(json, at, &keys[i].volume, &keys[i - 1].volume)) return false;
    }
    return true;
}

/* `volume` is still in the file's numbers. */
static bool read_volume_keys(nb_scene_reader *in, const nb_json_node *list, const nb_json_node *const *found,
                             const nebel_volume_desc *volume, nebel_volume_track *entry)
{
    if (list == NULL) return true;
    if (!nb_key_value_is(in->json, list, NB_JSON_ARRAY, "an array of keys {\"frame\": ...}")) return false;
    if (list->count == 0) return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, list, "holds no key; give one or more");
    nebel_volume_key *keys = nb_arena_allocate(&in->scene->arena, list->count, sizeof *keys);
    if (keys == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, list, "out of memory");
    if (!read_key_list(in, list, found, volume, keys)) return false;
    for (size_t i = 0; i < list->count; i++) convert_key(&in->space, &keys[i].volume);
    entry->keys = keys;
    entry->key_count = list->count;
    return true;
}

static bool try_keys(nb_scene_reader *in, const nb_json_node *list, const nebel_volume_track *entry)
{
    const nb_json_node *node = list != NULL ? nb_json_first(in->json, list) : NULL;
    for (size_t i = 0; i < entry->key_count; i++, node = nb_json_next(in->json, node))
        if (!nb_keys_read_try(in, node, "", &entry->keys[i].volume)) return false;
    return true;
}

/* The volume itself goes into the entry; in its place comes what it is at frame 0. */
static bool start_moving(nb_scene_reader *in, const nb_json_node *node, nebel_volume_desc *volume,
                         nebel_volume_track *entry)
{
    if (entry->key_count == 0) return true;
    nebel_volume_desc *own = nb_arena_allocate(&in->scene->arena, 1, sizeof *own);
    if (own == NULL) return nb_json_fail(in->json, NEBEL_ERROR_MEMORY, node, "out of memory");
    *own = *volume;
    entry->base = own;
    *volume = nebel_interpolate_volume(entry->keys, entry->key_count, 0);
    return true;
}

/* ---- volume ---------------------------------------------------------------------------------- */

static bool finish_volume(nb_scene_reader *in, const nb_json_node *node, const nb_json_node *const *found,
                          nebel_volume_desc *volume, nebel_volume_track *entry, const char *name)
{
    if (!read_volume_keys(in, found[VOLUME_KEYS], found, volume, entry)) return false;
    nb_file_units_convert_volume(&in->space, volume);
    if (in->node != NULL && !nb_keys_read_place_volume(in, node, volume)) return false;
    if (!nb_keys_read_try(in, node, "", volume) || !try_keys(in, found[VOLUME_KEYS], entry) ||
        !start_moving(in, node, volume, entry))
        return false;
    nebel_volume_origin origin = in->node != NULL ? NEBEL_VOLUME_FROM_NODE : NEBEL_VOLUME_STATIC;
    if (entry->key_count > 0) origin = NEBEL_VOLUME_ANIMATED;
    return keep_volume(in, node, volume, entry, name, origin);
}

/* A node of a model has its shape from the modelling program, where it names none, and does not move. */
static bool read_volume_members(nb_scene_reader *in, const nb_json_node *node, nebel_volume_desc *volume,
                                const nb_json_node **found)
{
    const char *prefix = in->node != NULL ? in->node->prefix : "";
    if (!nb_key_value_is(in->json, node, NB_JSON_OBJECT, "a volume {\"shape\": ...}") ||
        !read_operation(in->json, node, prefix, &volume->operation))
        return false;
    nb_key_set keys = volume_keys[volume->operation];
    if (in->node == NULL)
        return nb_key_value_members(in->json, node, &keys, found) &&
               nb_keys_read_shape(in, found[VOLUME_SHAPE], &volume->shape);
    keys.allowed &= ~NB_BIT(VOLUME_KEYS);
    keys.required = 0;
    keys.owner = "a fog node";
    return nb_key_value_members_after(in->json, node, prefix, &keys, found) &&
           nb_keys_read_node_shape(in, found[VOLUME_SHAPE], &volume->shape);
}

static bool read_name(nb_scene_reader *in, const nb_json_node *node, const char **name)
{
    if (node != NULL || in->node == NULL) return nb_key_value_text(in->json, node, &in->scene->arena, name);
    *name = nb_arena_copy_text(&in->scene->arena, in->node->name, strlen(in->node->name));
    return *name != NULL;
}

/* ---- fog of other programs ------------------------------------------------------------------- */

/* A source of the entry's own stands for the lights of the engine. */
static bool keep_imported(nb_scene_reader *in, const nb_json_node *const found[3], nebel_volume_desc *volume,
                          const char *name)
{
    static const double black[3] = {0};
    const nebel_volume_track entry = nb_volume_entry_default();
    if (found[2] != NULL) memcpy(volume->albedo, black, sizeof black);
    if (!nb_key_value_color(in->json, found[2], &nb_range_light, volume->source)) return false;
    return nb_keys_read_try(in, found[1], "", volume) &&
           keep_volume(in, found[1], volume, &entry, name, NEBEL_VOLUME_IMPORTED);
}

static bool keep_opacity(nb_scene_reader *in, const nb_json_node *node, double max_opacity)
{
    if (max_opacity == 0) return true;
    const double before = in->imported_opacity;
    in->imported_opacity = max_opacity;
    return before == 0 || before == max_opacity ||
           nb_json_fail(in->json, NEBEL_ERROR_UNSUPPORTED, node,
                        "has a largest opacity of %.15g, and other fog has %.15g; all fog here has one", max_opacity,
                        before);
}

static bool read_imported(nb_scene_reader *in, const nb_json_node *node)
{
    static const char *const names[] = {"name", "import", "source"};
    static const nb_key_set keys = {names, 3, 7, 2, "imported fog"};
    const nb_json_node *found[3];
    const char *name = "";
    nb_import fog = {.count = 0};
    if (!nb_key_value_members(in->json, node, &keys, found) ||
        !nb_key_value_text(in->json, found[0], &in->scene->arena, &name) || !nb_keys_read_import(in, found[1], &fog) ||
        !keep_opacity(in, found[1], fog.max_opacity))
        return false;
    for (size_t i = 0; i < fog.count; i++)
        if (!keep_imported(in, found, &fog.volumes[i], name)) return false;
    return true;
}

static bool is_imported(const nb_json *json, const nb_json_node *volume)
{
    const nb_json_node *node = volume->type == NB_JSON_OBJECT ? nb_json_first(json, volume) : NULL;
    while (node != NULL && !nb_json_has_key(node, "import")) node = nb_json_next(json, node);
    return node != NULL;
}

/* What all volumes have, also those without fog. */
static bool read_place(nb_json *json, const nb_json_node *const *found, nebel_volume_desc *volume)
{
    if (!nb_key_value_integer(json, found[VOLUME_PRIORITY], INT_MIN, INT_MAX, &volume->priority) ||
        !nb_key_value_number(json, found[VOLUME_START], &nb_range_distance, &volume->start) ||
        !nb_key_value_number(json, found[VOLUME_CUTOFF], &nb_range_distance, &volume->cutoff))
        return false;
    if (found[VOLUME_CUTOFF] == NULL || volume->cutoff > volume->start) return true;
    return nb_json_fail(json, NEBEL_ERROR_FORMAT, found[VOLUME_CUTOFF], "is %.15g; must be more than \"start\", %.15g",
                        volume->cutoff, volume->start);
}

bool nb_keys_read_volume(nb_scene_reader *in, const nb_json_node *node)
{
    if (in->node == NULL && is_imported(in->json, node)) return read_imported(in, node);
    const nb_json_node *found[VOLUME_KEY_COUNT];
    nb_json *json = in->json;
    nebel_volume_desc volume = {.operation = NEBEL_OPERATION_ADD};
    nebel_volume_track entry = nb_volume_entry_default();
    const char *name = "";
    if (!read_volume_members(in, node, &volume, found) || !read_place(json, found, &volume)) return false;
    if (!read_name(in, found[VOLUME_NAME], &name)) return nb_json_fail(json, NEBEL_ERROR_MEMORY, node, "out of memory");
    if (volume.operation != NEBEL_OPERATION_EXCLUDE &&
        (!nb_keys_read_density(in, found[VOLUME_DENSITY], volume.shape.type, &volume.density) ||
         !check_amount_given(json, node, found) || !read_volume_preset(json, found, &volume) ||
         !read_amount(json, found, volume.extinction, &entry.contrast) || !read_volume_light(in, found, &volume)))
        return false;
    return finish_volume(in, node, found, &volume, &entry, name);
}
