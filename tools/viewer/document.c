#define _POSIX_C_SOURCE 200809L
#include "document.h"

#include "../signals.h"
#include "../reader.h"
#include "keyframe_edit.h"
#include "camera_control.h"

#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static nebel_result fail_memory(const nb_document *draft)
{
    draft->log.write(NEBEL_LOG_ERROR, NEBEL_ERROR_MEMORY, "out of memory for the scene", draft->log.user);
    return NEBEL_ERROR_MEMORY;
}

/* ---- fog
 * -------------------------------------------------------------------------------------------------------------
 */

/* The sky, as light_scene has made it. */
static const nebel_scene_data *find_light(const nb_document *draft)
{
    return nebel_get_scene_data(draft->scene);
}

/* Keys are the file's alone. */
static nebel_sun find_sun(const nb_document *draft, const nb_document_state *edition)
{
    const nebel_scene_data *const data = &draft->data;
    nebel_sun sun = {{0}, {0}};
    if (!edition->has_sun) return sun;
    if (data->sun_key_count > 0) return nebel_interpolate_sun(data->sun_keys, data->sun_key_count, draft->frame);
    memcpy(sun.direction, edition->sun_direction, sizeof sun.direction);
    memcpy(sun.irradiance, edition->sun_irradiance, sizeof sun.irradiance);
    return sun;
}

/* The scene's direction has been made a unit one, which rounds it. */
static int is_lit_by(const nebel_scene_data *scene, int has_sun, const nebel_sun *sun)
{
    if (!has_sun || !scene->has_sun) return has_sun == scene->has_sun;
    for (int i = 0; i < 3; i++)
        if (fabs(scene->sun_direction[i] - sun->direction[i]) > 1e-12) return 0;
    return memcmp(scene->sun_irradiance, sun->irradiance, sizeof sun->irradiance) == 0;
}

/* Before the fog is made or changed. Nobody may render the scene meanwhile. */
static nebel_result light_scene(nb_document *draft, const nb_document_state *edition)
{
    const nebel_sun sun = find_sun(draft, edition);
    if (is_lit_by(find_light(draft), edition->has_sun, &sun)) return NEBEL_OK;
    const nebel_result result = nebel_set_scene_sun(draft->scene, edition->has_sun ? &sun : NULL);
    draft->data.environment.map = nebel_get_scene_data(draft->scene)->environment.map;
    return result;
}

static int does_planet_move(const nebel_planet *planet)
{
    int result = planet->model == NEBEL_PLANET_TEXTURED && planet->textured_desc.rotation_period != 0;
    for (uint32_t i = 0; i < planet->textured_desc.cloud_shell_count; i++)
        result |= planet->textured_desc.cloud_shells[i].rotation_period != 0;
    for (uint32_t i = 0; i < planet->cloud_layer_count; i++)
        result |= planet->cloud_layers[i].wind[0] != 0 || planet->cloud_layers[i].wind[1] != 0;
    return result;
}

/* What the file has that moves without end, or noise and planets that do so now. */
static int moves_on(const nb_document *draft)
{
    int result = nebel_get_scene_data(draft->file)->has_endless_motion;
    for (size_t i = 0; i < draft->now.planet_count; i++) result |= does_planet_move(&draft->now.planets[i]);
    for (size_t i = 0; i < draft->now.count && !result; i++) {
        nebel_scene_noise noise;
        if (nebel_get_scene_noise(draft->scene, draft->now.volumes[i].density.grid, &noise))
            result = noise.evolution != 0 || noise.velocity[0] != 0 || noise.velocity[1] != 0 || noise.velocity[2] != 0;
    }
    return result;
}

void nb_document_show(nb_document *draft)
{
    nebel_scene_data *const data = &draft->data;
    nb_document_state_show(&draft->now, data);
    data->planets = find_light(draft)->planets;
    data->has_endless_motion = moves_on(draft);
    if (!data->has_sun) return;
    const nebel_sun sun = find_sun(draft, &draft->now);
    memcpy(data->sun_direction, sun.direction, sizeof sun.direction);
    memcpy(data->sun_irradiance, sun.irradiance, sizeof sun.irradiance);
}

/* What fog has of the sun, and of ambient light, which is the edition's. */
static nebel_result find_fog_light(const nb_document *draft, const nb_document_state *edition, nebel_sun *sun,
                                   nebel_environment *ambient)
{
    nebel_environment sky;
    *ambient = nb_document_state_environment(edition, find_light(draft)->environment.map);
    const nebel_result result = nebel_find_scene_light(draft->scene, draft->frame, sun, &sky);
    if (result == NEBEL_OK && ambient->type == NEBEL_ENVIRONMENT_MAP && find_light(draft)->environment_path == NULL)
        ambient->intensity = sky.intensity;
    return result;
}

/* Also where it fails the fog is the caller's. */
static nebel_result create_fog(const nb_document *draft, const nb_document_state *edition, nebel_fog **fog)
{
    return nebel_create_fog(&(nebel_fog_desc){.host.log = draft->log, .max_opacity = edition->max_opacity}, fog);
}

/* The edition's light, for fog of the draft. */
static nebel_result light_fog(const nb_document *draft, const nb_document_state *edition, nebel_snapshot *snapshot,
                              nebel_lighting **made)
{
    nebel_lighting_desc desc = {.host.log = draft->log,
                                .lights = edition->lights,
                                .light_count = edition->light_count,
                                .diffusion = nebel_get_scene_data(draft->file)->diffusion,
                                .previous = draft->volumes};
    const nebel_result result = find_fog_light(draft, edition, &desc.sun, &desc.environment);
    return result == NEBEL_OK ? nebel_create_lighting(snapshot, &desc, made) : result;
}

/* A volume as it is at the present frame; its grid has one more owner, also where this fails. */
static nebel_result find_volume(const nb_document *draft, const nb_document_state *edition, size_t index,
                                nebel_volume_desc *volume)
{
    *volume = edition->volumes[index];
    nebel_grid *const grid = volume->density.type == NEBEL_DENSITY_GRID ? volume->density.grid : NULL;
    return nebel_get_scene_grid(draft->scene, grid, draft->frame, &volume->density.grid);
}

static nebel_result add_volume(const nb_document *draft, const nb_document_state *edition, size_t index, nebel_fog *fog,
                               nebel_volume_id *id)
{
    nebel_volume_desc volume;
    nebel_result result = find_volume(draft, edition, index, &volume);
    if (result == NEBEL_OK) result = nebel_add_volume(fog, &volume, id);
    nebel_release_grid(volume.density.grid);
    return result;
}

static nebel_result change_volume(const nb_document *draft, const nb_document_state *edition, size_t index)
{
    nebel_volume_desc volume;
    nebel_result result = find_volume(draft, edition, index, &volume);
    if (result == NEBEL_OK) result = nebel_update_volume(draft->fog, draft->ids[index], &volume);
    nebel_release_grid(volume.density.grid);
    return result;
}

/* The snapshot is let go. */
static nebel_result use_fog(nb_document *draft, const nb_document_state *edition, nebel_snapshot *snapshot)
{
    nebel_lighting *fresh = NULL;
    const nebel_result result = light_fog(draft, edition, snapshot, &fresh);
    nebel_release_snapshot(snapshot);
    if (result != NEBEL_OK) return result;
    nebel_release_lighting(draft->volumes);
    nebel_release_lighting(draft->whole);
    draft->volumes = fresh;
    draft->whole = NULL;
    draft->fog_frame = draft->frame;
    return NEBEL_OK;
}

static nebel_result commit_fog(nb_document *draft, const nb_document_state *edition)
{
    nebel_snapshot *snapshot = NULL;
    const nebel_result result = nebel_commit_fog(draft->fog, &snapshot);
    return result == NEBEL_OK ? use_fog(draft, edition, snapshot) : result;
}

/* As exact fog, each for itself. */
static nebel_result add_cells(nebel_fog *fog, const nb_document_state *edition)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < edition->cells_desc.cell_count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_cell(&edition->cells[i]);
        if (edition->cells[i].density > 0) result = nebel_add_volume(fog, &volume, NULL);
    }
    return result;
}

/* Cells that overlap are no scene. */
static nebel_result make_cells(nb_document *draft, const nb_document_state *edition)
{
    nebel_cells_desc desc = edition->cells_desc;
    nebel_cells *cells = NULL;
    if (edition->cells == NULL) return NEBEL_OK;
    desc.host.log = draft->log;
    const nebel_result result = nebel_create_cells(&desc, &cells);
    if (result != NEBEL_OK) return result;
    nebel_destroy_cells(draft->cells);
    draft->cells = cells;
    return NEBEL_OK;
}

/* In place of the fog that is there. On an error that one stays. */
static nebel_result fill_fog(nb_document *draft, const nb_document_state *edition)
{
    nebel_fog *fog = NULL;
    nebel_volume_id *const ids = calloc(edition->count + 1, sizeof *ids);
    if (ids == NULL) return fail_memory(draft);
    nebel_result result = create_fog(draft, edition, &fog);
    for (size_t i = 0; i < edition->count && result == NEBEL_OK; i++)
        result = add_volume(draft, edition, i, fog, &ids[i]);
    if (result == NEBEL_OK) result = add_cells(fog, edition);
    if (result != NEBEL_OK) {
        nebel_destroy_fog(fog);
        free(ids);
        return result;
    }
    nebel_destroy_fog(draft->fog);
    free(draft->ids);
    draft->fog = fog;
    draft->ids = ids;
    return commit_fog(draft, edition);
}

static int has_changed(const nb_document *draft, const nebel_volume_desc *was, const nebel_volume_desc *now)
{
    const int may_move = draft->data.has_endless_motion && now->density.type == NEBEL_DENSITY_GRID;
    return !nb_document_state_is_same_volume(now, was) || (may_move && draft->frame != draft->fog_frame);
}

/* Only numbers of the edition are not as they were. Where they are those of light alone the fog is not committed again. */
static nebel_result change_fog(nb_document *draft, const nb_document_state *was, const nb_document_state *now)
{
    const double max_opacity = now->max_opacity > 0 ? now->max_opacity : 1;
    nebel_snapshot *const before = nebel_get_lighting_snapshot(draft->volumes);
    int has_same_fog = before != NULL && nebel_get_max_opacity(before) == max_opacity;
    nebel_result result = nebel_set_max_opacity(draft->fog, max_opacity);
    for (size_t i = 0; i < now->count && result == NEBEL_OK; i++) {
        if (!has_changed(draft, &was->volumes[i], &now->volumes[i])) continue;
        has_same_fog = 0;
        result = change_volume(draft, now, i);
    }
    if (result != NEBEL_OK) return result;
    return has_same_fog ? use_fog(draft, now, nebel_retain_snapshot(before)) : commit_fog(draft, now);
}

/* ---- particles
 * -------------------------------------------------------------------------------------------------------
 */

static void rotate(const double q[4], double direction, double p[3])
{
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double x = direction * q[0] / length, y = direction * q[1] / length, z = direction * q[2] / length;
    const double w = q[3] / length;
    /* p + 2 w (v x p) + 2 v x (v x p), v the vector of the quaternion. */
    const double a = y * p[2] - z * p[1], b = z * p[0] - x * p[2], c = x * p[1] - y * p[0];
    const double moved[3] = {p[0] + 2 * (w * a + y * c - z * b), p[1] + 2 * (w * b + z * a - x * c),
                             p[2] + 2 * (w * c + x * b - y * a)};
    memcpy(p, moved, sizeof moved);
}

static void move_point(const nebel_transform *from, const nebel_transform *to, double p[3])
{
    for (int i = 0; i < 3; i++) p[i] -= from->position[i];
    rotate(from->rotation, -1, p);
    for (int i = 0; i < 3; i++) p[i] *= to->scale[i] / from->scale[i];
    rotate(to->rotation, 1, p);
    for (int i = 0; i < 3; i++) p[i] += to->position[i];
}

/* The scene's points, where the edition has put them: to be freed. */
static double (*place_points(const nb_document *draft, const nb_document_state *edition, size_t index))[3]
{
    const nebel_nebula_desc *const nebula = &edition->nebulae[index];
    const nebel_transform *const from = &nebel_get_scene_data(draft->scene)->nebula_transforms[index];
    double(*const points)[3] = malloc((nebula->count + 1) * sizeof *points);
    for (size_t i = 0; i < nebula->count && points != NULL; i++) {
        memcpy(points[i], nebula->points[i], sizeof *points);
        move_point(from, &edition->nebula_places[index], points[i]);
    }
    return points;
}

static nebel_result scatter_nebula(const nb_document *draft, const nb_document_state *edition, size_t index,
                                   nebel_particle *particles)
{
    nebel_nebula_desc desc = edition->nebulae[index];
    desc.host.log = draft->log;
    const nebel_transform *const from = &nebel_get_scene_data(draft->scene)->nebula_transforms[index];
    if (desc.points == NULL || memcmp(from, &edition->nebula_places[index], sizeof *from) == 0)
        return nebel_generate_nebula(&desc, particles);
    double(*const points)[3] = place_points(draft, edition, index);
    if (points == NULL) return fail_memory(draft);
    desc.points = (const double(*)[3])points;
    const nebel_result result = nebel_generate_nebula(&desc, particles);
    free(points);
    return result;
}

static nebel_result scatter(const nb_document *draft, const nb_document_state *edition, nebel_particle *particles)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < edition->nebula_count && result == NEBEL_OK; i++) {
        result = scatter_nebula(draft, edition, i, particles);
        particles += edition->nebulae[i].count;
    }
    return result;
}

/* In place of those that are there. On an error they stay. */
static nebel_result generate_particles(nb_document *draft, const nb_document_state *edition)
{
    size_t count = 0;
    for (size_t i = 0; i < edition->nebula_count; i++) count += edition->nebulae[i].count;
    nebel_particle *const particles = calloc(count + 1, sizeof *particles);
    if (particles == NULL) return fail_memory(draft);
    const nebel_result result = scatter(draft, edition, particles);
    if (result != NEBEL_OK) {
        free(particles);
        return result;
    }
    free(draft->particles);
    draft->particles = particles;
    draft->particle_count = count;
    nebel_release_lighting(draft->whole);
    draft->whole = NULL;
    return NEBEL_OK;
}

static nebel_result add_all(const nb_document *draft, nebel_fog *fog)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < draft->good.count && result == NEBEL_OK; i++)
        result = add_volume(draft, &draft->good, i, fog, NULL);
    if (result == NEBEL_OK) result = add_cells(fog, &draft->good);
    for (size_t i = 0; i < draft->particle_count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&draft->particles[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    return result;
}

nebel_result nb_document_whole(nb_document *draft, nebel_lighting **whole)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_result result = NEBEL_OK;
    if (draft->whole == NULL && draft->particle_count == 0) {
        draft->whole = nebel_retain_lighting(draft->volumes);
    } else if (draft->whole == NULL) {
        result = create_fog(draft, &draft->good, &fog);
        if (result == NEBEL_OK) result = add_all(draft, fog);
        if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
        if (result == NEBEL_OK) result = light_fog(draft, &draft->good, snapshot, &draft->whole);
        nebel_release_snapshot(snapshot);
        nebel_destroy_fog(fog);
    }
    *whole = draft->whole;
    return result;
}

/* ---- what moves
 * ------------------------------------------------------------------------------------------------------
 */

nebel_volume_origin nb_document_origin(const nb_document *draft, size_t volume)
{
    const size_t source = draft->now.sources[volume];
    if (draft->now.entries[volume].key_count > 0) return NEBEL_VOLUME_ANIMATED;
    const nebel_volume_origin origin =
        source == NEBEL_NEW_VOLUME ? NEBEL_VOLUME_STATIC : nebel_get_volume_origin(draft->file, source);
    return origin == NEBEL_VOLUME_ANIMATED ? NEBEL_VOLUME_STATIC : origin;
}

/* Whether the file could hold its changes. */
static int is_saved(const nb_document *draft, size_t volume)
{
    const nebel_volume_origin origin = nb_document_origin(draft, volume);
    return origin == NEBEL_VOLUME_STATIC || origin == NEBEL_VOLUME_ANIMATED;
}

/* Ten seconds at 24 a second, of what moves on without end. */
static const double usual_frames = 240;

/* Nonzero. */
static int widen(double range[2], int has_range, double first, double last)
{
    range[0] = has_range ? fmin(range[0], first) : first;
    range[1] = has_range ? fmax(range[1], last) : last;
    return 1;
}

int nb_document_find_frames(const nb_document *draft, double range[2])
{
    const nebel_scene_data *const data = &draft->data;
    const size_t suns = data->sun_key_count;
    int has_range = nb_keys_find_range(&draft->now, range);
    if (suns > 0) has_range = widen(range, has_range, data->sun_keys[0].frame, data->sun_keys[suns - 1].frame);
    if (data->turntable_frames > 0) return widen(range, has_range, 0, data->turntable_frames);
    return data->has_endless_motion && !has_range ? widen(range, 0, 0, usual_frames) : has_range;
}

/* What the file says stands at the same frame, to be compared. */
static void place_volumes(nb_document *draft)
{
    nb_keys_place(&draft->now, draft->frame);
    nb_keys_place(&draft->written, draft->frame);
}

static void place_camera(nb_document *draft)
{
    const nb_document_state *const now = &draft->now;
    if (now->camera_key_count > 0)
        draft->data.camera = nebel_interpolate_camera(now->camera_keys, now->camera_key_count, draft->frame);
    else if (draft->data.turntable_frames > 0)
        draft->data.camera = nebel_get_scene_camera(draft->file, draft->frame);
}

/* ---- open and close
 * --------------------------------------------------------------------------------------------------
 */

static nebel_result make_editions(nb_document *draft)
{
    const nebel_scene_data *const scene = nebel_get_scene_data(draft->scene);
    if (nb_document_state_make(scene, &draft->written) != 0 || nb_document_state_make(scene, &draft->now) != 0)
        return fail_memory(draft);
    place_volumes(draft);
    place_camera(draft);
    return nb_document_state_copy(&draft->now, &draft->good) == 0 ? NEBEL_OK : fail_memory(draft);
}

/* A window reads its scene again and saves it: what is no file would wait for a writer. */
static nebel_result load(const char *path, const nebel_scene_desc *desc, nebel_scene **scene)
{
    static const char message[] = "the scene is a device, a pipe or a socket; name a file";
    struct stat status;
    if (stat(path, &status) != 0 || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))
        return nebel_load_scene(path, desc, scene);
    *scene = NULL;
    if (desc->host.log.write != NULL)
        desc->host.log.write(NEBEL_LOG_ERROR, NEBEL_ERROR_FILE, message, desc->host.log.user);
    return NEBEL_ERROR_FILE;
}

nebel_result nb_document_open(const char *path, double frame, const nebel_log *log, nb_document *draft)
{
    const nebel_scene_desc desc = {.host = {.log = *log, .parallel.run = nebel_parallel_for_openmp},
                                   .model_reader = nb_reader_path(),
                                   .memory = nb_reader_memory()};
    *draft = (nb_document){.log = *log, .frame = frame};
    nebel_result result = load(path, &desc, &draft->scene);
    if (result == NEBEL_OK) result = nebel_load_scene_models(draft->scene);
    if (result == NEBEL_OK) result = nebel_load_scene_planets(draft->scene);
    if (result == NEBEL_OK) {
        draft->file = draft->scene;
        draft->data = *nebel_get_scene_data(draft->scene);
        result = make_editions(draft);
    }
    if (result == NEBEL_OK) result = light_scene(draft, &draft->good);
    if (result == NEBEL_OK) nb_document_show(draft);
    if (result == NEBEL_OK) result = make_cells(draft, &draft->good);
    if (result == NEBEL_OK) result = fill_fog(draft, &draft->good);
    if (result == NEBEL_OK) result = generate_particles(draft, &draft->good);
    if (result != NEBEL_OK) nb_document_close(draft);
    return result;
}

void nb_document_close(nb_document *draft)
{
    nebel_release_lighting(draft->volumes);
    nebel_release_lighting(draft->whole);
    nebel_destroy_fog(draft->fog);
    nebel_destroy_cells(draft->cells);
    free(draft->ids);
    free(draft->particles);
    nb_history_forget(&draft->history);
    nb_document_state_free(&draft->now);
    nb_document_state_free(&draft->good);
    nb_document_state_free(&draft->written);
    if (draft->file != draft->scene) nebel_destroy_scene(draft->file);
    nebel_destroy_scene(draft->scene);
    *draft = (nb_document){.scene = NULL};
}

/* ---- changes
 * ---------------------------------------------------------------------------------------------------------
 */

/* Nobody may render the scene meanwhile. */
static nebel_result make_planets(nb_document *draft, const nb_document_state *edition)
{
    const nebel_result result = nebel_update_scene_planets(draft->scene, edition->planets);
    if (result != NEBEL_OK) return result;
    draft->planets_are_new = 1;
    draft->data.environment.map = find_light(draft)->environment.map;
    return NEBEL_OK;
}

static nebel_result apply(nb_document *draft)
{
    const nb_document_state *const now = &draft->now, *const was = &draft->good;
    nebel_result result = light_scene(draft, now);
    if (result == NEBEL_OK && !nb_document_state_has_same_planets(now, was)) result = make_planets(draft, now);
    if (result == NEBEL_OK && !nb_document_state_has_same_nebulae(now, was)) result = generate_particles(draft, now);
    const int has_other_cells = !nb_document_state_has_same_cells(now, was);
    if (result == NEBEL_OK && has_other_cells) result = make_cells(draft, now);
    if (result != NEBEL_OK) return result;
    return nb_document_state_has_same_sources(now, was) && !has_other_cells ? change_fog(draft, was, now)
                                                                            : fill_fog(draft, now);
}

/* The same the other way, from whatever has been reached. */
static void revert(nb_document *draft)
{
    nb_document_state back;
    if (nb_document_state_copy(&draft->good, &back) != 0) return;
    if (draft->planets_are_new && !nb_document_state_has_same_planets(&draft->now, &draft->good))
        (void)make_planets(draft, &draft->good);
    if (!nb_document_state_has_same_cells(&draft->now, &draft->good)) (void)make_cells(draft, &draft->good);
    if (!nb_document_state_has_same_nebulae(&draft->now, &draft->good)) (void)generate_particles(draft, &draft->good);
    nb_document_state_free(&draft->now);
    draft->now = back;
    (void)light_scene(draft, &draft->good);
    (void)fill_fog(draft, &draft->good);
}

/* `good` becomes what `now` is. */
static nebel_result settle(nb_document *draft, int is_step)
{
    nb_document_state fresh;
    nebel_result result = apply(draft);
    if (result == NEBEL_OK && nb_document_state_copy(&draft->now, &fresh) != 0) result = fail_memory(draft);
    if (result != NEBEL_OK) {
        revert(draft);
    } else {
        if (is_step) nb_history_note(&draft->history, &draft->good);
        if (!nb_document_state_has_same_models(&draft->now, &draft->good)) draft->models_are_stale = 1;
        nb_document_state_free(&draft->good);
        draft->good = fresh;
    }
    nb_document_show(draft);
    return result;
}

nebel_result nb_document_place_models(nb_document *draft)
{
    const nebel_result result = nebel_reload_scene_models(draft->scene, draft->good.models, draft->good.model_count);
    const nebel_scene_data *const scene = nebel_get_scene_data(draft->scene);
    draft->models_are_stale = 0;
    draft->data.meshes = scene->meshes;
    draft->data.mesh_count = scene->mesh_count;
    draft->data.textures = scene->textures;
    draft->data.texture_count = scene->texture_count;
    return result;
}

nebel_result nb_document_commit(nb_document *draft)
{
    if (nb_keys_store(&draft->now, &draft->good, draft->frame) != 0) return fail_memory(draft);
    nb_keys_place(&draft->now, draft->frame);
    return nb_document_state_is_same(&draft->now, &draft->good) ? NEBEL_OK : settle(draft, 1);
}

nebel_result nb_document_set_frame(nb_document *draft, double frame)
{
    draft->frame = frame;
    place_volumes(draft);
    place_camera(draft);
    return settle(draft, 0);
}

int nb_document_undo(nb_document *draft, nebel_result *result)
{
    if (!nb_history_undo(&draft->history, &draft->now)) return 0;
    place_volumes(draft);
    *result = settle(draft, 0);
    return 1;
}

int nb_document_redo(nb_document *draft, nebel_result *result)
{
    if (!nb_history_redo(&draft->history, &draft->now)) return 0;
    place_volumes(draft);
    *result = settle(draft, 0);
    return 1;
}

/* ---- the file
 * --------------------------------------------------------------------------------------------------------
 */

int nb_document_is_changed(const nb_document *draft)
{
    const nb_document_state *const now = &draft->now, *const was = &draft->written;
    if (!nb_document_state_has_same_sources(now, was) || !nb_document_state_has_same_nebulae(now, was) ||
        !nb_document_state_has_same_cells(now, was) || !nb_document_state_has_same_models(now, was) ||
        !nb_document_state_has_same_lights(now, was) || !nb_document_state_has_same_light(now, was) ||
        !nb_document_state_has_same_planets(now, was) || !nb_document_state_has_same_camera_keys(now, was))
        return 1;
    for (size_t i = 0; i < now->count; i++) {
        if (!is_saved(draft, i)) continue;
        if (!nb_document_state_is_same_volume(&now->volumes[i], &was->volumes[i]) ||
            !nb_document_state_is_same_entry(&now->entries[i], &was->entries[i]) ||
            strcmp(now->names[i], was->names[i]) != 0)
            return 1;
    }
    return 0;
}

int nb_document_must_be_read(const nb_document *draft)
{
    const nebel_scene_data *const scene = nebel_get_scene_data(draft->scene);
    const nb_document_state *const now = &draft->now;
    int brings_fog = 0;
    for (size_t i = 0; i < now->model_count; i++) brings_fog |= scene->models[now->models[i].model_index].has_fog;
    return now->model_count != scene->model_count ||
           (brings_fog && !nb_document_state_has_same_models(now, &draft->written));
}

int nb_document_can_save_camera(const nb_document *draft)
{
    return draft->now.camera_key_count == 0 && draft->data.turntable_frames == 0;
}

/* That of the scene that stays; by its name, which is what the file says of it. */
static nebel_grid *find_grid(const nb_document *draft, nebel_grid *grid)
{
    const nebel_scene_data *const scene = nebel_get_scene_data(draft->scene);
    for (size_t i = 0; i < scene->volume_count && grid != NULL; i++) {
        nebel_grid *const own = scene->volumes[i].density.grid;
        if (own != NULL && strcmp(nebel_get_grid_name(own), nebel_get_grid_name(grid)) == 0) return own;
    }
    return grid;
}

/* Its keys have the same one, without owning it. */
static void adopt_grid(const nb_document *draft, nb_document_state *edition, size_t index)
{
    nebel_grid *const fresh = edition->volumes[index].density.grid, *const own = find_grid(draft, fresh);
    const nebel_volume_track *const entry = &edition->entries[index];
    if (own == fresh) return;
    edition->volumes[index].density.grid = nebel_retain_grid(own);
    for (size_t i = 0; i < entry->key_count; i++) ((nebel_volume_key *)entry->keys)[i].volume.density.grid = own;
    if (entry->base != NULL) ((nebel_volume_desc *)entry->base)->density.grid = own;
    nebel_release_grid(fresh);
}

/* Points, portals and grids are those of the scene that stays. */
static void adopt_arrays(const nb_document *draft, nb_document_state *edition)
{
    const nebel_nebula_desc *const own = nebel_get_scene_data(draft->scene)->nebulae;
    for (size_t i = 0; i < edition->nebula_count; i++) {
        edition->nebulae[i].points = own[i].points;
        if (own[i].points != NULL) edition->nebulae[i].count = own[i].count;
    }
    if (edition->cells != NULL) edition->cells_desc.portals = draft->now.cells_desc.portals;
    for (size_t i = 0; i < edition->count; i++) adopt_grid(draft, edition, i);
}

static void exchange(nebel_volume_desc *a, nebel_volume_desc *b)
{
    const nebel_volume_desc kept = *a;
    *a = *b;
    *b = kept;
}

/* What the file holds is as it says now, to the last digit. Changes that it does not hold stay as long as the volumes
 * are the same ones; with others, what is known by their old places is forgotten. */
static nebel_result use_written(nb_document *draft, int has_moved)
{
    nb_document_state now;
    if (nb_document_state_copy(&draft->written, &now) != 0) return fail_memory(draft);
    for (size_t i = 0; i < now.count && !has_moved; i++)
        if (!is_saved(draft, i)) exchange(&now.volumes[i], &draft->now.volumes[i]);
    nb_document_state_free(&draft->now);
    draft->now = now;
    if (has_moved) nb_history_forget(&draft->history);
    place_volumes(draft);
    return settle(draft, 0);
}

/* The file is read again, without its models, so that `written` is what it says. */
static nebel_result read_back(nb_document *draft, const char *path)
{
    const nebel_scene_desc desc = {
        .host.log = draft->log, .model_reader = nb_reader_path(), .memory = nb_reader_memory()};
    const int has_moved = !nb_document_state_has_same_sources(&draft->now, &draft->written);
    nebel_scene *fresh = NULL;
    nb_document_state written;
    nebel_result result = load(path, &desc, &fresh);
    if (result == NEBEL_OK) result = nebel_load_scene_planets(fresh);
    if (result == NEBEL_OK && nb_document_state_make(nebel_get_scene_data(fresh), &written) != 0)
        result = fail_memory(draft);
    if (result != NEBEL_OK) {
        nebel_destroy_scene(fresh);
        return result;
    }
    adopt_arrays(draft, &written);
    if (draft->file != draft->scene) nebel_destroy_scene(draft->file);
    nb_document_state_free(&draft->written);
    draft->file = fresh;
    draft->written = written;
    return use_written(draft, has_moved);
}

nebel_result nb_document_try_file(const char *path, const nebel_log *log)
{
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = *log, .model_reader = nb_reader_path(), .memory = nb_reader_memory()};
    const nebel_result result = load(path, &desc, &scene);
    nebel_destroy_scene(scene);
    return result;
}

nebel_result nb_document_save(nb_document *draft, const char *path, int with_camera)
{
    const nebel_scene_desc desc = {
        .host.log = draft->log, .model_reader = nb_reader_path(), .memory = nb_reader_memory()};
    nebel_scene_data before = *nebel_get_scene_data(draft->file);
    /* Those of the contents are as the scene is now. */
    before.planets = draft->written.planets;
    before.has_sun = draft->written.has_sun;
    memcpy(before.sun_direction, draft->written.sun_direction, sizeof before.sun_direction);
    memcpy(before.sun_irradiance, draft->written.sun_irradiance, sizeof before.sun_irradiance);
    nebel_scene_data changed = before;
    nb_document_state_show(&draft->now, &changed);
    if (with_camera && nb_document_can_save_camera(draft)) changed.camera = nb_navigate_round(draft->data.camera);
    if (changed.camera_key_count > 0) changed.camera.projection = changed.camera_keys->camera.projection;
    nb_interrupt_hold();
    const nebel_result result = nebel_save_scene(path, &desc, &before, &changed, draft->now.sources);
    nb_interrupt_release();
    return result == NEBEL_OK ? read_back(draft, path) : result;
}
