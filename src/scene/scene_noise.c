/* Noise that moves or is given other numbers. The grid's name, the words of the file, says what it is made of. */
#include "key_patch.h"

#include <stdio.h>
#include <string.h>

/* ---- the words of a grid --------------------------------------------------------------------- */

/* What to do with them. */
typedef struct noise_task {
    nebel_scene_noise *noise;        /* what they say */
    const nebel_scene_noise *wanted; /* what they are to say; NULL: as it is */
    nb_edit *edit;                   /* of them, where something is wanted */
    bool is_noise;
} noise_task;

static bool is_noise_type(const nb_json *json, const nb_json_node *density)
{
    static const char name[] = "noise";
    const nb_json_node *type = nb_json_patch_member(json, density, "type");
    return type != NULL && type->type == NB_JSON_STRING && type->string_size == sizeof name - 1 &&
           memcmp(type->string, name, sizeof name - 1) == 0;
}

static bool take_density(nb_json *json, const nb_json_node *value, void *user)
{
    noise_task *task = user;
    if (nb_json_parent(json, value) == NULL || !is_noise_type(json, value)) return true;
    *task->noise = (nebel_scene_noise){.evolution = 0};
    if (!nb_keys_read_noise_numbers(json, value, task->noise)) return false;
    task->is_noise = true;
    const nb_json_patch_object object = nb_json_patch_find(json, value);
    if (task->wanted != NULL) nb_key_patch_noise(task->edit, json, &object, task->noise, task->wanted);
    return true;
}

/* nb_json reads objects: the words become a member of one. */
static const char before[] = "{\"density\":", after[] = "}";

static nebel_result wrap(const nebel_allocator *allocator, const char *words, char **whole)
{
    const size_t size = sizeof before + strlen(words) + sizeof after;
    *whole = nb_allocate(allocator, size, 1);
    if (*whole == NULL) return NEBEL_ERROR_MEMORY;
    snprintf(*whole, size, "%s%s%s", before, words, after);
    return NEBEL_OK;
}

static nebel_result read_words(const nebel_allocator *allocator, const nebel_log *log, const char *whole,
                               noise_task *task)
{
    static const char *const streamed[] = {NULL};
    nb_json json;
    const nb_json_desc desc = {.text = whole,
                               .size = strlen(whole),
                               .lead = sizeof before - 1,
                               .name = "noise",
                               .allocator = *allocator,
                               .log = *log,
                               .streamed = streamed,
                               .take = take_density,
                               .user = task};
    return nb_json_read(&json, &desc);
}

/* Grids of files have other words, those of other programs none: that is no error, and nobody is told. */
static nebel_result find_noise(const nebel_allocator *allocator, const nebel_grid *grid, nebel_scene_noise *noise,
                               bool *is_noise)
{
    noise_task task = {.noise = noise};
    char *whole;
    *is_noise = false;
    if (grid == NULL || nebel_get_grid_name(grid)[0] == '\0') return NEBEL_OK;
    nebel_result result = wrap(allocator, nebel_get_grid_name(grid), &whole);
    if (result != NEBEL_OK) return result;
    result = read_words(allocator, &(nebel_log){.write = NULL}, whole, &task);
    nb_release(allocator, whole);
    *is_noise = result == NEBEL_OK && task.is_noise;
    return result == NEBEL_ERROR_MEMORY ? result : NEBEL_OK;
}

int nebel_get_scene_noise(const nebel_scene *scene, const nebel_grid *grid, nebel_scene_noise *noise)
{
    bool is_noise;
    if (scene == NULL || noise == NULL) return 0;
    if (find_noise(&scene->allocator, grid, noise, &is_noise) != NEBEL_OK || !is_noise) return 0;
    nb_file_units_convert_noise(&scene->space, noise);
    return 1;
}

/* ---- at a frame ------------------------------------------------------------------------------ */

nebel_result nebel_get_scene_grid(const nebel_scene *scene, nebel_grid *grid, double frame, nebel_grid **at)
{
    nebel_scene_noise noise;
    bool is_noise = false;
    if (at == NULL) return NEBEL_ERROR_ARGUMENT;
    *at = NULL;
    if (scene == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!nb_scene_is_frame(scene, frame)) return NEBEL_ERROR_VALUE;
    const nebel_result result = frame != 0 ? find_noise(&scene->allocator, grid, &noise, &is_noise) : NEBEL_OK;
    if (result != NEBEL_OK) return nb_fail(&scene->log, result, "noise: out of memory");
    if (!is_noise || !nb_noise_moves(&noise)) {
        if (grid != NULL) *at = nebel_retain_grid(grid);
        return NEBEL_OK;
    }
    nb_file_units_convert_noise(&scene->space, &noise);
    nebel_noise_desc desc = noise.desc;
    desc.host.allocator = scene->allocator;
    desc.host.log = scene->log;
    desc.name = nebel_get_grid_name(grid);
    for (int k = 0; k < 3; k++) desc.offset[k] = noise.velocity[k] * frame;
    desc.time = noise.evolution * frame;
    return nebel_create_noise_grid(&desc, at);
}

/* ---- with other numbers ---------------------------------------------------------------------- */

#define NOISE_PLACE(name, member, count)                                                                               \
    {                                                                                                                  \
        name, offsetof(nebel_scene_noise, member), count, NB_EDIT_EACH                                                 \
    }

static const nb_key_entry places[] = {
    NOISE_PLACE("cells", desc.frequency, 3),   NOISE_PLACE("gain", desc.gain, 1),
    NOISE_PLACE("coverage", desc.coverage, 1), NOISE_PLACE("edge", desc.falloff, 3),
    NOISE_PLACE("velocity", velocity, 3),      NOISE_PLACE("evolution", evolution, 1),
};

void nb_key_patch_noise(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object,
                        const nebel_scene_noise *was, const nebel_scene_noise *now)
{
    const nebel_noise_desc *a = &was->desc, *b = &now->desc;
    const double size_was[] = {(double)a->size[0], (double)a->size[1], (double)a->size[2]};
    const double size_now[] = {(double)b->size[0], (double)b->size[1], (double)b->size[2]};
    nb_json_patch_numbers(edit, json, object, "size", 3, size_was, size_now, NB_EDIT_EACH);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        nb_json_patch_numbers(edit, json, object, places[i].key, places[i].count, nb_place_numbers(was, &places[i]),
                              nb_place_numbers(now, &places[i]), places[i].style);
    nb_json_patch_numbers(edit, json, object, "octaves", 1, &(double){a->octaves}, &(double){b->octaves}, NB_EDIT_EACH);
    nb_json_patch_numbers(edit, json, object, "seed", 1, &(double){a->seed}, &(double){b->seed}, NB_EDIT_EACH);
}

void nb_key_patch_noise_grid(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object,
                             const nebel_grid *was, const nebel_grid *now)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    nebel_scene_noise a, b;
    bool was_noise = false, is_noise = false;
    if (was == now) return;
    if (find_noise(allocator, was, &a, &was_noise) != NEBEL_OK || find_noise(allocator, now, &b, &is_noise) != NEBEL_OK)
        save->edit.out_of_memory = true;
    if (was_noise && is_noise) nb_key_patch_noise(&save->edit, json, object, &a, &b);
}

/* Without what wraps it. False when memory is out. */
static bool unwrap(const nebel_allocator *allocator, nb_bytes *bytes)
{
    const size_t size = bytes->size - strlen(before) - strlen(after);
    memmove(bytes->data, bytes->data + strlen(before), size);
    bytes->size = size;
    return nb_bytes_write(allocator, bytes, size, "", 1);
}

nebel_result nb_noise_words(const nebel_scene *scene, const char *words, const nebel_scene_noise *wanted,
                            nb_bytes *changed)
{
    nb_edit edit = {.arena = {.allocator = scene->allocator}};
    nebel_scene_noise was;
    noise_task task = {.noise = &was, .wanted = wanted, .edit = &edit};
    char *whole;
    nebel_result result = wrap(&scene->allocator, words, &whole);
    if (result != NEBEL_OK) return result;
    edit.text = whole;
    edit.size = strlen(whole);
    result = read_words(&scene->allocator, &scene->log, whole, &task);
    if (result == NEBEL_OK && (!nb_json_patch_apply(&edit, changed) || !unwrap(&scene->allocator, changed)))
        result = NEBEL_ERROR_MEMORY;
    nb_json_patch_release(&edit);
    nb_release(&scene->allocator, whole);
    return result;
}

/* What its words say, to their last digit: a scene that is saved and read again has the same. */
static nebel_result make_noise(const nebel_scene *scene, const char *words, nebel_grid **grid)
{
    nebel_scene_noise noise;
    noise_task task = {.noise = &noise};
    char *whole;
    nebel_result result = wrap(&scene->allocator, words, &whole);
    if (result != NEBEL_OK) return result;
    result = read_words(&scene->allocator, &scene->log, whole, &task);
    nb_release(&scene->allocator, whole);
    if (result != NEBEL_OK) return result;
    nb_file_units_convert_noise(&scene->space, &noise);
    noise.desc.host.allocator = scene->allocator;
    noise.desc.host.log = scene->log;
    noise.desc.name = words;
    return nebel_create_noise_grid(&noise.desc, grid);
}

nebel_result nebel_update_scene_noise(const nebel_scene *scene, const nebel_grid *grid, const nebel_scene_noise *noise,
                                      nebel_grid **changed)
{
    nebel_scene_noise was, wanted;
    bool is_noise;
    nb_bytes words = {0};
    if (changed == NULL) return NEBEL_ERROR_ARGUMENT;
    *changed = NULL;
    if (scene == NULL || noise == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = find_noise(&scene->allocator, grid, &was, &is_noise);
    if (result == NEBEL_OK && !is_noise) return NEBEL_ERROR_ARGUMENT;
    wanted = *noise;
    nb_file_units_restore_noise(&scene->space, &wanted);
    if (result == NEBEL_OK) result = nb_noise_words(scene, nebel_get_grid_name(grid), &wanted, &words);
    if (result == NEBEL_OK) result = make_noise(scene, (const char *)words.data, changed);
    nb_release(&scene->allocator, words.data);
    return result;
}
