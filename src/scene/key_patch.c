/* Changed scenes, back into the file that they came from. */
#include "key_patch.h"

#include <string.h>

/* What would be written is read as well: whatever is wrong with it is found before the file is. */
static nebel_result write_text(const char *path, const nebel_scene_desc *desc, const nb_bytes *bytes)
{
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_scene *scene = NULL;
    const nebel_result result = nebel_parse_scene((const char *)bytes->data, bytes->size, path, desc, &scene);
    nebel_destroy_scene(scene);
    return result == NEBEL_OK ? nb_file_write(&allocator, &desc->host.log, path, bytes) : result;
}

static nebel_result save_text(const char *path, const nebel_scene_desc *desc, nb_key_patch *save)
{
    nebel_scene *scene = NULL;
    nb_bytes bytes;
    nebel_result result = nb_scene_parse(save->edit.text, save->edit.size, path, desc, save, &scene);
    nebel_destroy_scene(scene);
    if (result != NEBEL_OK || (save->edit.count == 0 && !save->edit.out_of_memory)) return result;
    if (!nb_json_patch_apply(&save->edit, &bytes))
        return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "%s: out of memory", path);
    result = write_text(path, desc, &bytes);
    nb_release(&save->edit.arena.allocator, bytes.data);
    return result;
}

static bool find_targets(nb_key_patch *save)
{
    const size_t before = save->before->volume_count, after = save->changed->volume_count;
    if (save->sources == NULL && before != after) return false;
    for (size_t i = 0; i < before; i++) save->targets[i] = save->sources == NULL ? i : NEBEL_NEW_VOLUME;
    for (size_t i = 0, least = 0; i < after && save->sources != NULL; i++) {
        const size_t source = save->sources[i];
        if (source == NEBEL_NEW_VOLUME) continue;
        if (source < least || source >= before) return false;
        save->targets[source] = i;
        least = source + 1;
    }
    return true;
}

static nebel_result save_file(const char *path, const nebel_scene_desc *desc, nb_key_patch *save)
{
    const nebel_allocator *allocator = &save->edit.arena.allocator;
    nb_bytes bytes;
    nebel_result result = nb_file_read(allocator, &desc->host.log, NULL, "scene", path, NB_SCENE_TEXT_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    save->edit.text = (const char *)bytes.data;
    save->edit.size = bytes.size;
    result = save_text(path, desc, save);
    nb_json_patch_release(&save->edit);
    nb_release(allocator, save->volumes.spans);
    nb_release(allocator, save->models.spans);
    nb_release(allocator, bytes.data);
    return result;
}

nebel_result nebel_save_scene(const char *path, const nebel_scene_desc *desc, const nebel_scene_data *before,
                              const nebel_scene_data *changed, const size_t *sources)
{
    if (path == NULL || desc == NULL || before == NULL || changed == NULL ||
        !nb_allocator_is_valid(&desc->host.allocator))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nb_key_patch save = {.before = before,
                         .changed = changed,
                         .sources = sources,
                         .targets = nb_allocate(&allocator, before->volume_count, sizeof(size_t)),
                         .edit = {.arena = {.allocator = allocator}}};
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (save.targets == NULL)
        nb_fail(&desc->host.log, result, "%s: out of memory", path);
    else if (!find_targets(&save))
        result = nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                         "%s: what volumes were must ascend, and name volumes that there were", path);
    else
        result = save_file(path, desc, &save);
    nb_release(&allocator, save.targets);
    return result;
}

bool nb_key_patch_same_phase(const nebel_phase *a, const nebel_phase *b)
{
    return a->type == b->type && a->g == b->g && a->alpha == b->alpha && a->diameter == b->diameter;
}
