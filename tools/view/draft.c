#include "draft.h"

#include "navigate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *copy_array(const void *from, size_t count, size_t size)
{
    void *const copy = malloc(count > 0 ? count * size : 1);
    if (copy != NULL && count > 0) memcpy(copy, from, count * size);
    return copy;
}

static nebel_result allocate(nb_draft *draft)
{
    const size_t count = draft->data.volume_count;
    draft->volumes = copy_array(draft->data.volumes, count, sizeof *draft->volumes);
    draft->good = copy_array(draft->data.volumes, count, sizeof *draft->good);
    draft->written = copy_array(draft->data.volumes, count, sizeof *draft->written);
    draft->ids = calloc(count + 1, sizeof *draft->ids);
    draft->file = draft->data;
    draft->data.volumes = draft->volumes;
    if (draft->volumes != NULL && draft->good != NULL && draft->written != NULL && draft->ids != NULL) return NEBEL_OK;
    draft->log.write(NEBEL_ERROR_MEMORY, "memory is out for the scene", draft->log.user);
    return NEBEL_ERROR_MEMORY;
}

static nebel_result add_particles(nb_draft *draft)
{
    nebel_particle *particles = NULL;
    if (draft->data.particle_count == 0) return NEBEL_OK;
    nebel_result result = nebel_make_scene_particles(draft->scene, &particles);
    for (size_t i = 0; i < draft->data.particle_count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_particle_volume(&particles[i]);
        result = nebel_add_volume(draft->fog, &volume, NULL);
    }
    nebel_free_scene_particles(draft->scene, particles);
    return result;
}

static nebel_result fill_fog(nb_draft *draft)
{
    nebel_fog_desc desc = {.log = draft->log};
    memcpy(desc.ambient, draft->data.ambient, sizeof desc.ambient);
    nebel_result result = nebel_create_fog(&desc, &draft->fog);
    for (size_t i = 0; i < draft->data.volume_count && result == NEBEL_OK; i++) {
        result = nebel_add_volume(draft->fog, &draft->volumes[i], &draft->ids[i]);
    }
    if (result == NEBEL_OK) result = add_particles(draft);
    return result == NEBEL_OK ? nebel_commit_fog(draft->fog, &draft->snapshot) : result;
}

static void place_frame(nb_draft *draft, double frame)
{
    draft->frame = frame;
    for (size_t i = 0; i < draft->data.volume_count; i++) {
        if (nb_draft_is_moving(draft, i)) draft->volumes[i] = nebel_scene_volume(draft->scene, i, frame);
    }
    if (draft->data.camera_key_count > 0 || draft->data.turntable_frames > 0) {
        draft->data.camera = nebel_scene_camera(draft->scene, frame);
    }
}

nebel_result nb_draft_open(const char *path, double frame, const nebel_log *log, nb_draft *draft)
{
    const nebel_scene_desc desc = {.log = *log};
    *draft = (nb_draft){.log = *log};
    nebel_result result = nebel_load_scene(path, &desc, &draft->scene);
    if (result == NEBEL_OK) result = nebel_load_scene_models(draft->scene);
    if (result == NEBEL_OK) {
        draft->data = *nebel_scene_contents(draft->scene);
        result = allocate(draft);
    }
    if (result == NEBEL_OK) {
        place_frame(draft, frame);
        result = fill_fog(draft);
    }
    if (result != NEBEL_OK) nb_draft_close(draft);
    return result;
}

void nb_draft_close(nb_draft *draft)
{
    nebel_release_snapshot(draft->snapshot);
    nebel_destroy_fog(draft->fog);
    free(draft->volumes);
    free(draft->good);
    free(draft->written);
    free(draft->ids);
    nebel_destroy_scene(draft->scene);
    *draft = (nb_draft){.scene = NULL};
}

/* A change that the fog does not take is undone. Volumes are compared as bytes, so that their padding is copied, too.
 */
static nebel_result change_volumes(nb_draft *draft)
{
    nebel_result first = NEBEL_OK;
    for (size_t i = 0; i < draft->data.volume_count; i++) {
        if (memcmp(&draft->volumes[i], &draft->good[i], sizeof *draft->good) == 0) continue;
        const nebel_result result = nebel_change_volume(draft->fog, draft->ids[i], &draft->volumes[i]);
        if (result == NEBEL_OK) {
            memcpy(&draft->good[i], &draft->volumes[i], sizeof *draft->good);
        } else {
            memcpy(&draft->volumes[i], &draft->good[i], sizeof *draft->good);
            if (first == NEBEL_OK) first = result;
        }
    }
    return first;
}

nebel_result nb_draft_commit(nb_draft *draft)
{
    nebel_snapshot *fresh = NULL;
    const nebel_result changed = change_volumes(draft);
    nebel_result result = nebel_set_ambient(draft->fog, draft->data.ambient);
    if (result == NEBEL_OK) result = nebel_commit_fog(draft->fog, &fresh);
    if (result != NEBEL_OK) return result;
    nebel_release_snapshot(draft->snapshot);
    draft->snapshot = fresh;
    return changed;
}

nebel_result nb_draft_set_frame(nb_draft *draft, double frame)
{
    place_frame(draft, frame);
    return nb_draft_commit(draft);
}

int nb_draft_is_moving(const nb_draft *draft, size_t volume)
{
    return nebel_scene_volume_origin(draft->scene, volume) == NEBEL_VOLUME_MOVING;
}

/* ---- the file
 * --------------------------------------------------------------------------------------------------------
 */

static int is_same(const double a[3], const double b[3])
{
    return memcmp(a, b, sizeof(double[3])) == 0;
}

int nb_draft_is_changed(const nb_draft *draft)
{
    const nebel_scene_data *const now = &draft->data, *const was = &draft->file;
    for (size_t i = 0; i < now->volume_count; i++) {
        if (nebel_scene_volume_origin(draft->scene, i) == NEBEL_VOLUME_WRITTEN &&
            memcmp(&draft->volumes[i], &draft->written[i], sizeof *draft->written) != 0)
            return 1;
    }
    return !is_same(now->background, was->background) || !is_same(now->ambient, was->ambient) ||
           !is_same(now->sun_direction, was->sun_direction) || !is_same(now->sun_irradiance, was->sun_irradiance);
}

int nb_draft_can_save_camera(const nb_draft *draft)
{
    return draft->file.camera_key_count == 0 && draft->file.turntable_frames == 0 &&
           draft->file.camera.projection != NEBEL_PROJECTION_PANORAMA;
}

/* To a hundred-thousandth of the distance: nobody sees the difference, and the file stays readable. */
static nebel_camera round_camera(nebel_camera camera)
{
    const double step = pow(10, floor(log10(nb_navigate_distance(&camera))) - 5);
    for (int i = 0; i < 3; i++) {
        camera.position[i] = rint(camera.position[i] / step) * step;
        camera.look_at[i] = rint(camera.look_at[i] / step) * step;
    }
    camera.view_height = rint(camera.view_height / step) * step;
    return camera;
}

nebel_result nb_draft_save(nb_draft *draft, const char *path, int with_camera)
{
    const nebel_scene_desc desc = {.log = draft->log};
    nebel_scene_data changed = draft->data;
    changed.camera = draft->file.camera;
    if (with_camera && nb_draft_can_save_camera(draft)) changed.camera = round_camera(draft->data.camera);
    const nebel_result result = nebel_save_scene(path, &desc, nebel_scene_contents(draft->scene), &changed, NULL);
    if (result != NEBEL_OK) return result;
    draft->file = changed;
    memcpy(draft->written, draft->volumes, changed.volume_count * sizeof *draft->written);
    return NEBEL_OK;
}
