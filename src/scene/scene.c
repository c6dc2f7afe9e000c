/* Scenes: read, kept, given back. */
#include "math/hash.h"
#include "image/image_codec.h"
#include "file/file.h"
#include "model/model.h"
#include "file/path.h"
#include "key_patch.h"
#include "scene_data.h"

#include <stdio.h>
#include <math.h>
#include <string.h>

enum {
    SECTION_NEBEL,
    SECTION_UP,
    SECTION_UNIT,
    SECTION_CAMERA,
    SECTION_BACKGROUND,
    SECTION_SUN,
    SECTION_AMBIENT,
    SECTION_MAX_OPACITY,
    SECTION_LIGHTS,
    SECTION_MODELS,
    SECTION_FOG,
    SECTION_NEBULA,
    SECTION_CELLS,
    SECTION_CLASSIC,
    SECTION_MULTIPLE_SCATTERING,
    SECTION_PLANET,
    SECTION_COUNT = NB_SCENE_SECTIONS
};

static const char *const section_names[] = {
    "nebel", "up",     "unit",  "camera",  "background",          "sun",   "ambient", "max_opacity", "lights", "models",
    "fog",   "nebula", "cells", "classic", "multiple_scattering", "planet"};
static const char *const streamed_names[] = {"lights", "models", "fog", "nebula", NULL};
static const nb_key_set section_keys = {section_names, SECTION_COUNT, NB_BIT(SECTION_COUNT) - 1,
                                        NB_BIT(SECTION_NEBEL) | NB_BIT(SECTION_FOG), "a scene"};

/* ---- reading --------------------------------------------------------------------------------- */

static bool read_version(nb_json *json, const nb_json_node *node)
{
    double version = 0;
    if (!nb_key_value_number(json, node, &nb_range_any, &version)) return false;
    if (version == 1) return true;
    return nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, node, "is %.15g; this program reads version 1", version);
}

/* Known since find_space, unless it is wrong. */
static bool read_space(nb_scene_reader *in, const nb_json_node *node, int section)
{
    return section == SECTION_UP ? nb_keys_read_up(in->json, node, &in->space)
                                 : nb_keys_read_unit(in->json, node, &in->space);
}

static bool read_section(nb_scene_reader *in, const nb_json_node *node)
{
    nebel_scene_data *data = &in->scene->data;
    const int section = nb_key_value_find_key(in->json, node, &section_keys);
    if (section < 0) return false;
    if ((in->seen & NB_BIT(section)) != 0)
        return nb_key_value_fail_repeated(in->json, node, in->section_offsets[section]);
    in->seen |= NB_BIT(section);
    in->section_offsets[section] = node->key_offset;
    switch (section) {
    case SECTION_NEBEL:
        return read_version(in->json, node);
    case SECTION_UP:
    case SECTION_UNIT:
        return read_space(in, node, section);
    case SECTION_CAMERA:
        return nb_keys_read_camera(in, node);
    case SECTION_BACKGROUND:
        return nb_keys_read_background(in, node);
    case SECTION_SUN:
        return nb_keys_read_sun(in, node);
    case SECTION_AMBIENT:
        in->scene->has_ambient = true;
        return nb_keys_read_ambient(in, node);
    case SECTION_MAX_OPACITY:
        return nb_key_value_number(in->json, node, &nb_range_fraction, &data->max_opacity);
    case SECTION_CELLS:
        return nb_keys_read_cells(in, node) && (in->save == NULL || nb_key_patch_cells(in->save, in, node));
    case SECTION_CLASSIC:
        return nb_keys_read_classic(in, node);
    case SECTION_MULTIPLE_SCATTERING:
        return nb_keys_read_multiple_scattering(in, node);
    case SECTION_PLANET:
        return nb_keys_read_planet(in, node) && (in->save == NULL || nb_key_patch_planets(in->save, in, node));
    default:
        return nb_key_value_is(in->json, node, NB_JSON_ARRAY, "an array [...]");
    }
}

static bool read_fog(nb_scene_reader *in, const nb_json_node *node)
{
    const size_t index = in->scene->data.volume_count;
    return nb_keys_read_volume(in, node) && (in->save == NULL || nb_key_patch_volume(in->save, in, node, index));
}

static bool read_nebula(nb_scene_reader *in, const nb_json_node *node)
{
    const size_t index = in->scene->data.nebula_count;
    return nb_keys_read_nebula(in, node) && (in->save == NULL || nb_key_patch_nebula(in->save, in, node, index));
}

static bool read_model(nb_scene_reader *in, const nb_json_node *node)
{
    const size_t index = in->scene->model_count;
    return nb_keys_read_model(in, node) && (in->save == NULL || nb_key_patch_model(in->save, in, node, index));
}

static bool read_light(nb_scene_reader *in, const nb_json_node *node)
{
    const size_t index = in->scene->data.light_count;
    return nb_keys_read_light(in, node) && (in->save == NULL || nb_key_patch_light(in->save, in, node, index));
}

static bool read_element(nb_scene_reader *in, const nb_json_node *array, const nb_json_node *node)
{
    if (nb_json_has_key(array, "fog")) return read_fog(in, node);
    if (nb_json_has_key(array, "nebula")) return read_nebula(in, node);
    if (nb_json_has_key(array, "models")) return read_model(in, node);
    return read_light(in, node);
}

/* Sections come in any order, so what joins two of them waits for the end. */
static bool check_whole(nb_scene_reader *in, const nb_json_node *root)
{
    const uint32_t missing = section_keys.required & ~in->seen;
    if (missing != 0)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, root, "the key \"%s\" is missing; a scene needs it",
                            (missing & NB_BIT(SECTION_NEBEL)) != 0 ? "nebel" : "fog");
    nb_finish_classic(in);
    if ((in->seen & NB_BIT(SECTION_MAX_OPACITY)) == 0) in->scene->data.max_opacity = in->imported_opacity;
    return true;
}

static bool take_scene_value(nb_json *json, const nb_json_node *value, void *user)
{
    nb_scene_reader *in = user;
    const nb_json_node *parent = nb_json_parent(json, value);
    if (parent == NULL) return check_whole(in, value) && (in->save == NULL || nb_key_patch_rest(in->save, in, value));
    if (nb_json_parent(json, parent) != NULL) return read_element(in, parent, value);
    if (!read_section(in, value)) return false;
    if (in->save != NULL) nb_key_patch_section(in->save, in, value);
    return true;
}

void nb_keys_read_keep_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    nb_scene_reader *in = user;
    (void)level, (void)result;
    snprintf(in->core_message, sizeof in->core_message, "%s", message);
}

/* What a file's numbers mean, and over which planet fog is, may stand behind them, and those are gone once they are read: a first
 * reading looks for that alone, and for whether there is too much noise, which is made as it is read. What else is wrong is left for the second one to say. */
static bool take_space(nb_json *json, const nb_json_node *value, void *user)
{
    nb_scene_reader *in = user;
    nb_file_units *space = &in->space, wanted = *space;
    const nb_json_node *parent = nb_json_parent(json, value);
    if (parent == NULL) return true;
    if (nb_json_parent(json, parent) != NULL) return nb_scene_count_noise(in, value);
    if (nb_json_has_key(value, "up") && nb_keys_read_up(json, value, &wanted)) space->z_up = wanted.z_up;
    if (nb_json_has_key(value, "unit") && nb_keys_read_unit(json, value, &wanted)) space->unit = wanted.unit;
    if (nb_json_has_key(value, "planet")) in->ball = nb_find_sphere(json, value);
    return json->result == NEBEL_OK;
}

static nebel_result find_space(const nb_json_desc *whole, nb_scene_reader *in)
{
    nb_json json, *const second = in->json;
    nb_json_desc desc = *whole;
    desc.log = (nebel_log){NULL, NULL};
    desc.take = take_space;
    desc.user = in;
    in->json = &json;
    const nebel_result result = nb_json_read(&json, &desc);
    in->json = second;
    if (result == NEBEL_ERROR_MEMORY) nb_fail(&whole->log, result, "%s: out of memory", whole->name);
    return result == NEBEL_ERROR_MEMORY || (result == NEBEL_ERROR_LIMIT && in->over_budget) ? result : NEBEL_OK;
}

static nebel_result read_scene(nebel_scene *scene, const char *text, size_t size, const char *name, nb_key_patch *save)
{
    nb_json json;
    nb_scene_reader in = {
        .json = &json, .scene = scene, .save = save, .space = NB_SPACE_OURS, .ball = nb_find_sphere(NULL, NULL)};
    const nebel_fog_desc fog = {.host = {.allocator = scene->allocator, .log = {nb_keys_read_keep_message, &in}}};
    nb_json_desc desc = {.text = text,
                         .size = size,
                         .name = name,
                         .allocator = scene->allocator,
                         .log = scene->log,
                         .streamed = streamed_names,
                         .take = take_scene_value,
                         .user = &in};
    scene->folder = nb_path_folder(&scene->arena, name);
    nebel_result result = scene->folder != NULL ? nebel_create_fog(&fog, &in.trial) : NEBEL_ERROR_MEMORY;
    if (result != NEBEL_OK) return nb_fail(&scene->log, result, "%s: %s", name, nebel_result_text(result));
    result = find_space(&desc, &in);
    desc.unit = in.space.unit;
    scene->space = in.space;
    if (result == NEBEL_OK) result = nb_json_read(&json, &desc);
    nebel_destroy_fog(in.trial);
    scene->data.volumes = scene->volumes;
    scene->data.volume_names = scene->volume_names;
    scene->data.volume_tracks = scene->volume_entries;
    scene->data.lights = scene->lights;
    scene->data.light_names = scene->light_names;
    scene->data.nebulae = scene->nebulae;
    scene->data.nebula_names = scene->nebula_names;
    scene->data.nebula_transforms = scene->nebula_places;
    scene->data.models = scene->placements;
    scene->data.model_count = scene->model_count;
    scene->data.paths = scene->files;
    return result;
}

static nebel_scene *create_scene(const nebel_scene_desc *desc)
{
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_scene *scene = nb_allocate_zero(&allocator, 1, sizeof *scene);
    if (scene == NULL) return NULL;
    scene->allocator = scene->arena.allocator = allocator;
    scene->log = desc->host.log;
    scene->parallel = desc->host.parallel;
    scene->budget.most = desc->memory;
    scene->reader.in_process = desc->models_in_process != 0;
    scene->reader.program = nb_model_default_program();
    if (desc->model_reader != NULL)
        scene->reader.program = nb_arena_copy_text(&scene->arena, desc->model_reader, strlen(desc->model_reader));
    if (scene->reader.program == NULL) {
        nebel_destroy_scene(scene);
        return NULL;
    }
    scene->data.camera = nb_camera_default();
    return scene;
}

static nebel_result check_arguments(const char *name, const void *text, size_t size, const nebel_scene_desc *desc,
                                    nebel_scene **scene)
{
    if (scene != NULL) *scene = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (name == NULL || scene == NULL || (text == NULL && size > 0))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "a scene needs a text, a name and a place to go; one is NULL");
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "an allocator needs both its functions; one is NULL");
    return NEBEL_OK;
}

nebel_result nb_scene_parse(const char *text, size_t size, const char *name, const nebel_scene_desc *desc,
                            nb_key_patch *save, nebel_scene **scene)
{
    nebel_result result = check_arguments(name, text, size, desc, scene);
    if (result != NEBEL_OK) return result;
    if (size > NB_SCENE_TEXT_LIMIT)
        return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT, "%s: larger than %zu bytes, the most that is read", name,
                       NB_SCENE_TEXT_LIMIT);
    nebel_scene *fresh = create_scene(desc);
    if (fresh == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "%s: out of memory", name);
    result = read_scene(fresh, text, size, name, save);
    if (result == NEBEL_OK)
        *scene = fresh;
    else
        nebel_destroy_scene(fresh);
    return result;
}

nebel_result nebel_parse_scene(const char *text, size_t size, const char *name, const nebel_scene_desc *desc,
                               nebel_scene **scene)
{
    return nb_scene_parse(text, size, name, desc, NULL, scene);
}

nebel_result nebel_load_scene(const char *path, const nebel_scene_desc *desc, nebel_scene **scene)
{
    nb_bytes bytes;
    nebel_result result = check_arguments(path, path, 0, desc, scene);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    result = nb_file_read_stream(&allocator, &desc->host.log, "scene", path, NB_SCENE_TEXT_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = nebel_parse_scene((const char *)bytes.data, bytes.size, path, desc, scene);
    nb_release(&allocator, bytes.data);
    return result;
}

/* ---- the scene ------------------------------------------------------------------------------- */

const nebel_scene_data *nebel_get_scene_data(const nebel_scene *scene)
{
    if (scene == NULL) return NULL;
    return &scene->data;
}

nebel_volume_origin nebel_get_volume_origin(const nebel_scene *scene, size_t index)
{
    if (scene == NULL || index >= scene->data.volume_count) return NEBEL_VOLUME_STATIC;
    return scene->volume_origins[index];
}

static nebel_result generate_particles(const nebel_scene *scene, nebel_particle *particles)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->data.nebula_count && result == NEBEL_OK; i++) {
        nebel_nebula_desc desc = scene->nebulae[i];
        desc.host.allocator = scene->allocator;
        desc.host.log = scene->log;
        result = nebel_generate_nebula(&desc, particles);
        particles += desc.count;
    }
    return result;
}

nebel_result nebel_generate_scene_particles(const nebel_scene *scene, nebel_particle **particles)
{
    if (particles != NULL) *particles = NULL;
    if (scene == NULL || particles == NULL) return NEBEL_ERROR_ARGUMENT;
    const size_t count = scene->data.particle_count;
    nebel_particle *made = nb_allocate(&scene->allocator, count, sizeof *made);
    if (made == NULL) return nb_fail(&scene->log, NEBEL_ERROR_MEMORY, "out of memory for %zu particles", count);
    const nebel_result result = generate_particles(scene, made);
    if (result == NEBEL_OK)
        *particles = made;
    else
        nb_release(&scene->allocator, made);
    return result;
}

void nebel_free_scene_particles(const nebel_scene *scene, nebel_particle *particles)
{
    if (scene == NULL) return;
    nb_release(&scene->allocator, particles);
}

static nebel_result add_particles(nebel_fog *fog, const nebel_scene *scene)
{
    nebel_particle *particles = NULL;
    if (scene->data.particle_count == 0) return NEBEL_OK;
    nebel_result result = nebel_generate_scene_particles(scene, &particles);
    for (size_t i = 0; i < scene->data.particle_count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&particles[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    nebel_free_scene_particles(scene, particles);
    return result;
}

/* What a grid is at a frame, with one more owner; noise with another seed where there is one. */
static nebel_result find_grid(const nebel_scene *scene, nebel_grid *grid, double frame, const uint32_t *seed,
                              nebel_grid **at)
{
    nebel_scene_noise noise;
    nebel_grid *changed = NULL;
    if (seed == NULL || grid == NULL || !nebel_get_scene_noise(scene, grid, &noise))
        return nebel_get_scene_grid(scene, grid, frame, at);
    *at = NULL;
    noise.desc.seed = nb_mix_bits(noise.desc.seed ^ nb_mix_bits(*seed)) >> 1; /* scene files take 31 bits */
    nebel_result result = nebel_update_scene_noise(scene, grid, &noise, &changed);
    if (result == NEBEL_OK) result = nebel_get_scene_grid(scene, changed, frame, at);
    nebel_release_grid(changed);
    return result;
}

static nebel_result add_volumes(nebel_fog *fog, const nebel_scene *scene, double frame, const uint32_t *seed)
{
    const nebel_scene_data *data = &scene->data;
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < data->volume_count && result == NEBEL_OK; i++) {
        nebel_volume_desc volume = nebel_get_scene_volume(scene, i, frame);
        result = find_grid(scene, volume.density.grid, frame, seed, &volume.density.grid);
        if (result == NEBEL_OK) result = nebel_add_volume(fog, &volume, NULL);
        nebel_release_grid(volume.density.grid);
    }
    return result;
}

static nebel_result add_cells(nebel_fog *fog, const nebel_cells_desc *cells)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; cells != NULL && i < cells->cell_count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_cell(&cells->cells[i]);
        if (cells->cells[i].density > 0) result = nebel_add_volume(fog, &volume, NULL);
    }
    return result;
}

bool nb_scene_is_frame(const nebel_scene *scene, double frame)
{
    if (fabs(frame) <= NB_MAX_FRAME) return true;
    nb_fail(&scene->log, NEBEL_ERROR_VALUE, "frame: is %g; must be within -1e12 and 1e12", frame);
    return false;
}

static nebel_result commit(const nebel_scene *scene, double frame, int with_particles, const uint32_t *seed,
                           nebel_snapshot **snapshot)
{
    if (scene == NULL || snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_fog *fog = NULL;
    nebel_fog_desc desc = {.host = {.allocator = scene->allocator, .log = scene->log}};
    *snapshot = NULL;
    if (!nb_scene_is_frame(scene, frame)) return NEBEL_ERROR_VALUE;
    desc.max_opacity = scene->data.max_opacity;
    nebel_result result = nebel_create_fog(&desc, &fog);
    if (result == NEBEL_OK) result = add_volumes(fog, scene, frame, seed);
    if (result == NEBEL_OK) result = add_cells(fog, scene->data.cells);
    if (result == NEBEL_OK && with_particles) result = add_particles(fog, scene);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, snapshot);
    nebel_destroy_fog(fog);
    return result;
}

nebel_result nebel_commit_scene_fog_at(const nebel_scene *scene, double frame, nebel_snapshot **snapshot)
{
    return commit(scene, frame, 1, NULL, snapshot);
}

nebel_result nebel_commit_scene_fog_anew(const nebel_scene *scene, double frame, uint32_t seed,
                                         nebel_snapshot **snapshot)
{
    return commit(scene, frame, 1, &seed, snapshot);
}

nebel_result nebel_commit_scene_volumes_at(const nebel_scene *scene, double frame, nebel_snapshot **snapshot)
{
    return commit(scene, frame, 0, NULL, snapshot);
}

nebel_result nebel_commit_scene_fog(const nebel_scene *scene, nebel_snapshot **snapshot)
{
    return nebel_commit_scene_fog_at(scene, 0, snapshot);
}

nebel_result nebel_create_scene_lighting(const nebel_scene *scene, nebel_snapshot *snapshot, double frame,
                                         const nebel_lighting *previous, nebel_lighting **made)
{
    if (scene == NULL || snapshot == NULL || made == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_lighting_desc desc = {.host = {.allocator = scene->allocator, .log = scene->log},
                                .lights = scene->data.lights,
                                .light_count = scene->data.light_count,
                                .diffusion = scene->data.diffusion,
                                .previous = previous};
    *made = NULL;
    const nebel_result result = nebel_find_scene_light(scene, frame, &desc.sun, &desc.environment);
    if (result != NEBEL_OK) return result;
    if (desc.environment.type == NEBEL_ENVIRONMENT_CONSTANT)
        memcpy(desc.environment.radiance, scene->data.ambient, sizeof desc.environment.radiance);
    return nebel_create_lighting(snapshot, &desc, made);
}

void nebel_destroy_scene(nebel_scene *scene)
{
    if (scene == NULL) return;
    const nebel_allocator allocator = scene->allocator;
    nb_models_release(scene);
    nb_arena_release(&scene->arena);
    nb_release(&allocator, scene->volumes);
    nb_release(&allocator, (void *)scene->volume_names);
    nb_release(&allocator, scene->volume_origins);
    nb_release(&allocator, scene->volume_entries);
    nb_release(&allocator, scene->lights);
    nb_release(&allocator, (void *)scene->light_names);
    nb_release(&allocator, scene->nebulae);
    nb_release(&allocator, (void *)scene->nebula_names);
    nb_release(&allocator, scene->nebula_places);
    nb_release(&allocator, scene->models);
    nb_release(&allocator, scene->placements);
    nb_release(&allocator, (void *)scene->files);
    nebel_release_environment_map(scene->environment_map);
    nebel_destroy_clouds(scene->clouds);
    for (int i = 0; i < NEBEL_MAX_PLANETS; i++) nebel_destroy_atmosphere(scene->atmospheres[i]);
    nebel_destroy_textured_planet(scene->layers);
    for (size_t i = 0; i < scene->map_count; i++) nb_image_release(&allocator, &scene->maps[i]);
    for (size_t i = 0; i < scene->grid_count; i++) nebel_release_grid(scene->grids[i]);
    nb_release(&allocator, (void *)scene->grids);
    nb_release(&allocator, scene);
}
