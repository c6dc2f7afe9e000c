#include "keyframe_edit.h"

#include "camera_control.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static nebel_volume_key *keys_of(nebel_volume_track *entry)
{
    return (nebel_volume_key *)entry->keys;
}

/* Keys have neither parts nor planes. */
static nebel_volume_desc bare(const nebel_volume_desc *volume)
{
    nebel_volume_desc copy = *volume;
    copy.shape.parts = NULL;
    copy.shape.planes = NULL;
    copy.shape.part_count = copy.shape.plane_count = 0;
    return copy;
}

/* The first key that is not before a frame. */
static size_t find(const nebel_volume_track *entry, double frame)
{
    size_t i = 0;
    while (i < entry->key_count && entry->keys[i].frame < frame) i++;
    return i;
}

static int make_own(nebel_volume_track *entry, const nebel_volume_desc *volume)
{
    if (entry->base != NULL) return 0;
    nebel_volume_desc *const own = malloc(sizeof *own);
    if (own == NULL) return -1;
    *own = bare(volume);
    entry->base = own;
    return 0;
}

static int insert(nebel_volume_track *entry, size_t at, const nebel_volume_desc *volume)
{
    nebel_volume_key *const keys = realloc(keys_of(entry), (entry->key_count + 1) * sizeof *keys);
    if (keys == NULL) return -1;
    entry->keys = keys;
    if (make_own(entry, volume) != 0) return -1;
    memmove(keys + at + 1, keys + at, (entry->key_count - at) * sizeof *keys);
    entry->key_count++;
    return 0;
}

int nb_keys_set(nb_document_state *edition, size_t volume, double frame)
{
    nebel_volume_track *const entry = &edition->entries[volume];
    const size_t at = find(entry, frame);
    const int is_new = at == entry->key_count || entry->keys[at].frame != frame;
    if (is_new && insert(entry, at, &edition->volumes[volume]) != 0) return -1;
    keys_of(entry)[at] = (nebel_volume_key){frame, bare(&edition->volumes[volume])};
    return 0;
}

/* A volume at a frame has its own parts and planes. */
static void place(nb_document_state *edition, size_t index, double frame)
{
    const nebel_volume_track *const entry = &edition->entries[index];
    const nebel_shape own = edition->volumes[index].shape;
    if (entry->key_count == 0) return;
    edition->volumes[index] = nebel_interpolate_volume(entry->keys, entry->key_count, frame);
    nebel_shape *const shape = &edition->volumes[index].shape;
    shape->parts = own.parts;
    shape->planes = own.planes;
    shape->part_count = own.part_count;
    shape->plane_count = own.plane_count;
}

void nb_keys_place(nb_document_state *edition, double frame)
{
    for (size_t i = 0; i < edition->count; i++) place(edition, i, frame);
}

void nb_keys_remove(nb_document_state *edition, size_t volume, size_t key)
{
    nebel_volume_track *const entry = &edition->entries[volume];
    nebel_volume_key *const keys = keys_of(entry);
    if (entry->key_count == 1) {
        place(edition, volume, keys->frame);
        free(keys);
        free((void *)entry->base);
        entry->keys = NULL;
        entry->base = NULL;
    } else {
        memmove(keys + key, keys + key + 1, (entry->key_count - key - 1) * sizeof *keys);
    }
    entry->key_count--;
}

void nb_keys_move(nb_document_state *edition, size_t volume, size_t key, double frame)
{
    nebel_volume_track *const entry = &edition->entries[volume];
    const int has_room_before = key == 0 || frame > entry->keys[key - 1].frame;
    const int has_room_behind = key + 1 == entry->key_count || frame < entry->keys[key + 1].frame;
    if (has_room_before && has_room_behind) keys_of(entry)[key].frame = frame;
}

/* What kind of thing a volume is holds at all frames. */
static void store_kind(nebel_volume_desc *to, const nebel_volume_desc *from)
{
    to->operation = from->operation;
    to->priority = from->priority;
    to->start = from->start;
    to->cutoff = from->cutoff;
    if (to->shape.type != from->shape.type) to->shape = bare(from).shape;
    if (to->density.type != from->density.type) to->density = from->density;
    to->density.below = from->density.below;
    to->density.power = from->density.power;
    to->density.grid = from->density.grid;
}

static int store(nb_document_state *edition, const nb_document_state *before, size_t index, double frame)
{
    nebel_volume_track *const entry = &edition->entries[index];
    const nebel_volume_desc now = bare(&edition->volumes[index]);
    nebel_volume_desc was = bare(&before->volumes[index]);
    if (entry->key_count == 0 || before->entries[index].key_count == 0) return 0;
    store_kind((nebel_volume_desc *)entry->base, &now);
    for (size_t i = 0; i < entry->key_count; i++) store_kind(&keys_of(entry)[i].volume, &now);
    store_kind(&was, &now);
    return nb_document_state_is_same_volume(&was, &now) ? 0 : nb_keys_set(edition, index, frame);
}

int nb_keys_store(nb_document_state *edition, const nb_document_state *before, double frame)
{
    int result = 0;
    if (!nb_document_state_has_same_sources(edition, before)) return 0;
    for (size_t i = 0; i < edition->count && result == 0; i++) result = store(edition, before, i, frame);
    return result;
}

/* ---- the camera
 * ------------------------------------------------------------------------------------------------------
 */

int nb_keys_set_camera(nb_document_state *edition, const nebel_camera *camera, double frame)
{
    const size_t count = edition->camera_key_count;
    nebel_camera_key *const keys = realloc(edition->camera_keys, (count + 1) * sizeof *keys);
    nebel_camera_key key = {frame, nb_navigate_round(*camera)};
    size_t at = 0;
    if (keys == NULL) return -1;
    edition->camera_keys = keys;
    if (count > 0) key.camera.projection = keys->camera.projection;
    while (at < count && keys[at].frame < frame) at++;
    if (at == count || keys[at].frame != frame) {
        memmove(keys + at + 1, keys + at, (count - at) * sizeof *keys);
        edition->camera_key_count++;
    }
    keys[at] = key;
    return 0;
}

void nb_keys_remove_camera(nb_document_state *edition, size_t key)
{
    nebel_camera_key *const gone = edition->camera_keys + key;
    memmove(gone, gone + 1, (--edition->camera_key_count - key) * sizeof *gone);
}

void nb_keys_move_camera(nb_document_state *edition, size_t key, double frame)
{
    nebel_camera_key *const keys = edition->camera_keys;
    const int has_room_before = key == 0 || frame > keys[key - 1].frame;
    const int has_room_behind = key + 1 == edition->camera_key_count || frame < keys[key + 1].frame;
    if (has_room_before && has_room_behind) keys[key].frame = frame;
}

/* ---- time
 * ------------------------------------------------------------------------------------------------------------
 */

int nb_keys_find_range(const nb_document_state *edition, double range[2])
{
    const size_t count = edition->camera_key_count;
    int has_keys = count > 0;
    if (has_keys) {
        range[0] = edition->camera_keys[0].frame;
        range[1] = edition->camera_keys[count - 1].frame;
    }
    for (size_t i = 0; i < edition->count; i++) {
        const nebel_volume_track *const entry = &edition->entries[i];
        if (entry->key_count == 0) continue;
        const double first = entry->keys[0].frame, last = entry->keys[entry->key_count - 1].frame;
        range[0] = has_keys ? fmin(range[0], first) : first;
        range[1] = has_keys ? fmax(range[1], last) : last;
        has_keys = 1;
    }
    return has_keys;
}
