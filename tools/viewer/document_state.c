#include "document_state.h"

#include "owned_shape.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* ---- memory
 * ----------------------------------------------------------------------------------------------------------
 */

static char *copy_text(const char *text)
{
    const size_t size = strlen(text) + 1;
    char *const copy = malloc(size);
    if (copy != NULL) memcpy(copy, text, size);
    return copy;
}

static void *copy_array(const void *from, size_t count, size_t size)
{
    void *const copy = malloc(count * size + 1);
    if (copy != NULL && count > 0) memcpy(copy, from, count * size);
    return copy;
}

static int grow(void **array, size_t count, size_t size)
{
    void *const larger = realloc(*array, count * size);
    if (larger != NULL) *array = larger;
    return larger != NULL ? 0 : -1;
}

static int make_room(nb_document_state *edition)
{
    const size_t wanted = edition->capacity > 0 ? 2 * edition->capacity : 8;
    if (edition->count < edition->capacity) return 0;
    if (grow((void **)&edition->volumes, wanted, sizeof *edition->volumes) != 0 ||
        grow((void **)&edition->names, wanted, sizeof *edition->names) != 0 ||
        grow((void **)&edition->sources, wanted, sizeof *edition->sources) != 0 ||
        grow((void **)&edition->entries, wanted, sizeof *edition->entries) != 0)
        return -1;
    edition->capacity = wanted;
    return 0;
}

/* ---- entries
 * ---------------------------------------------------------------------------------------------------------
 */

nebel_volume_track nb_document_state_plain_entry(void)
{
    return (nebel_volume_track){.contrast = 0.05};
}

/* Parts and planes are those of the volume, at every frame. */
static void strip(nebel_shape *shape)
{
    shape->parts = NULL;
    shape->planes = NULL;
    shape->part_count = shape->plane_count = 0;
}

static void free_entry(nebel_volume_track *entry)
{
    free((void *)entry->keys);
    free((void *)entry->base);
    *entry = nb_document_state_plain_entry();
}

static int own_entry(nebel_volume_track *entry)
{
    const nebel_volume_track given = *entry;
    entry->keys = NULL;
    entry->base = NULL;
    if (given.key_count == 0) return 0;
    nebel_volume_key *const keys = copy_array(given.keys, given.key_count, sizeof *keys);
    nebel_volume_desc *const own = copy_array(given.base, 1, sizeof *own);
    entry->keys = keys;
    entry->base = own;
    if (keys == NULL || own == NULL) {
        free_entry(entry);
        return -1;
    }
    for (size_t i = 0; i < given.key_count; i++) strip(&keys[i].volume.shape);
    strip(&own->shape);
    return 0;
}

/* ---- volumes
 * ---------------------------------------------------------------------------------------------------------
 */

static int add(nb_document_state *edition, const nebel_volume_desc *volume, const nebel_volume_track *entry,
               const char *name, size_t source)
{
    if (make_room(edition) != 0) return -1;
    nebel_volume_desc own = *volume;
    nebel_volume_track own_keys = *entry;
    char *const own_name = copy_text(name);
    const int shape_failed = nb_shape_own(&own.shape), entry_failed = own_entry(&own_keys);
    if (shape_failed || entry_failed || own_name == NULL) {
        nb_shape_free(&own.shape);
        free_entry(&own_keys);
        free(own_name);
        return -1;
    }
    nebel_retain_grid(own.density.grid);
    edition->volumes[edition->count] = own;
    edition->entries[edition->count] = own_keys;
    edition->names[edition->count] = own_name;
    edition->sources[edition->count++] = source;
    return 0;
}

int nb_document_state_add(nb_document_state *edition, const nebel_volume_desc *volume, const nebel_volume_track *entry,
                          const char *name)
{
    return add(edition, volume, entry, name, NEBEL_NEW_VOLUME);
}

int nb_document_state_rename(nb_document_state *edition, size_t index, const char *name)
{
    char *const own = copy_text(name);
    if (own == NULL) return -1;
    free(edition->names[index]);
    edition->names[index] = own;
    return 0;
}

void nb_document_state_remove(nb_document_state *edition, size_t index)
{
    const size_t behind = --edition->count - index;
    nb_shape_free(&edition->volumes[index].shape);
    nebel_release_grid(edition->volumes[index].density.grid);
    free_entry(&edition->entries[index]);
    free(edition->names[index]);
    memmove(edition->volumes + index, edition->volumes + index + 1, behind * sizeof *edition->volumes);
    memmove(edition->names + index, edition->names + index + 1, behind * sizeof *edition->names);
    memmove(edition->entries + index, edition->entries + index + 1, behind * sizeof *edition->entries);
    memmove(edition->sources + index, edition->sources + index + 1, behind * sizeof *edition->sources);
}

/* ---- all of it
 * -------------------------------------------------------------------------------------------------------
 */

static int own_nebula(nebel_nebula_desc *nebula)
{
    const double(*const given)[3] = nebula->colors;
    nebel_retain_grid(nebula->density.grid);
    nebula->colors = NULL;
    if (nebula->color_count > 0) nebula->colors = copy_array(given, nebula->color_count, sizeof *given);
    const int has_failed = nebula->color_count > 0 && nebula->colors == NULL;
    return nb_shape_own(&nebula->shape) != 0 || has_failed ? -1 : 0;
}

/* Those that are there are counted one by one, so that an edition that is not complete can be freed. */
static int add_nebulae(nb_document_state *edition, const nebel_nebula_desc *nebulae, const nebel_transform *places,
                       size_t count)
{
    edition->nebulae = calloc(count + 1, sizeof *edition->nebulae);
    edition->nebula_places = copy_array(places, count, sizeof *places);
    for (size_t i = 0; i < count && edition->nebulae != NULL; i++) {
        edition->nebulae[i] = nebulae[i];
        edition->nebula_count = i + 1;
        if (own_nebula(&edition->nebulae[i]) != 0) return -1;
    }
    return edition->nebulae != NULL && edition->nebula_places != NULL ? 0 : -1;
}

int nb_document_state_set_colors(nebel_nebula_desc *nebula, size_t count)
{
    double(*const colors)[3] = malloc((count + 1) * sizeof *colors);
    if (colors == NULL) return -1;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            colors[i][c] = nebula->color_count == 0  ? 1
                           : i < nebula->color_count ? nebula->colors[i][c]
                                                     : nebula->colors[nebula->color_count - 1][c];
    free((void *)nebula->colors);
    nebula->colors = (const double(*)[3])colors;
    nebula->color_count = count;
    return 0;
}

static int add_models(nb_document_state *edition, const nebel_scene_model *models, size_t count)
{
    edition->models = copy_array(models, count, sizeof *models);
    edition->model_count = edition->models != NULL ? count : 0;
    return edition->models != NULL ? 0 : -1;
}

static int add_lights(nb_document_state *edition, const nebel_light *lights, size_t count)
{
    edition->lights = copy_array(lights, count, sizeof *lights);
    edition->light_count = edition->lights != NULL ? count : 0;
    return edition->lights != NULL ? 0 : -1;
}

/* What is made of them is made anew where they change. */
static int add_planets(nb_document_state *edition, const nebel_planet *planets, size_t count)
{
    edition->planets = copy_array(planets, count, sizeof *planets);
    edition->planet_count = edition->planets != NULL ? count : 0;
    for (size_t i = 0; i < edition->planet_count; i++) {
        edition->planets[i].atmosphere = NULL;
        edition->planets[i].clouds = NULL;
        edition->planets[i].textured = NULL;
    }
    return edition->planets != NULL ? 0 : -1;
}

static int add_camera_keys(nb_document_state *edition, const nebel_camera_key *keys, size_t count)
{
    edition->camera_keys = copy_array(keys, count, sizeof *keys);
    edition->camera_key_count = edition->camera_keys != NULL ? count : 0;
    return edition->camera_keys != NULL ? 0 : -1;
}

static int add_cells(nb_document_state *edition, const nebel_cells_desc *desc)
{
    if (desc == NULL) return 0;
    edition->cells_desc = *desc;
    edition->cells_desc.cell_count = 0;
    edition->cells_desc.cells = edition->cells = calloc(desc->cell_count + 1, sizeof *edition->cells);
    for (size_t i = 0; i < desc->cell_count && edition->cells != NULL; i++) {
        edition->cells[i] = desc->cells[i];
        edition->cells_desc.cell_count = i + 1;
        if (nb_shape_own(&edition->cells[i].shape) != 0) return -1;
    }
    return edition->cells != NULL ? 0 : -1;
}

/* What a section has that is added: fog that one sees. */
static const nebel_factor_desc plain_classic = {.end = 100, .density = 0.03, .color = {0.5, 0.5, 0.5}};

int nb_document_state_make(const nebel_scene_data *scene, nb_document_state *edition)
{
    nb_document_state made = {.max_opacity = scene->max_opacity,
                              .has_sun = scene->has_sun,
                              .has_classic = scene->classic != NULL,
                              .classic = scene->classic != NULL ? *scene->classic : plain_classic};
    memcpy(made.background, scene->background, sizeof made.background);
    memcpy(made.ambient, scene->ambient, sizeof made.ambient);
    made.environment = scene->environment;
    made.environment.map = NULL;
    made.shows_ambient = scene->shows_ambient;
    memcpy(made.sun_direction, scene->sun_direction, sizeof made.sun_direction);
    memcpy(made.sun_irradiance, scene->sun_irradiance, sizeof made.sun_irradiance);
    int result = add_nebulae(&made, scene->nebulae, scene->nebula_transforms, scene->nebula_count);
    if (result == 0) result = add_models(&made, scene->models, scene->model_count);
    if (result == 0) result = add_lights(&made, scene->lights, scene->light_count);
    if (result == 0) result = add_camera_keys(&made, scene->camera_keys, scene->camera_key_count);
    if (result == 0) result = add_planets(&made, scene->planets, scene->planet_count);
    if (result == 0) result = add_cells(&made, scene->cells);
    for (size_t i = 0; i < scene->volume_count && result == 0; i++)
        result = add(&made, &scene->volumes[i], &scene->volume_tracks[i], scene->volume_names[i], i);
    if (result != 0) nb_document_state_free(&made);
    *edition = made;
    return result;
}

int nb_document_state_copy(const nb_document_state *from, nb_document_state *to)
{
    nb_document_state made = *from;
    made.volumes = NULL;
    made.names = NULL;
    made.sources = NULL;
    made.entries = NULL;
    made.nebulae = NULL;
    made.nebula_places = NULL;
    made.models = NULL;
    made.lights = NULL;
    made.camera_keys = NULL;
    made.planets = NULL;
    made.cells = NULL;
    made.cells_desc.cell_count = 0;
    made.count = made.capacity = made.nebula_count = made.model_count = made.light_count = made.camera_key_count = 0;
    made.planet_count = 0;
    int result = add_nebulae(&made, from->nebulae, from->nebula_places, from->nebula_count);
    if (result == 0) result = add_models(&made, from->models, from->model_count);
    if (result == 0) result = add_lights(&made, from->lights, from->light_count);
    if (result == 0) result = add_camera_keys(&made, from->camera_keys, from->camera_key_count);
    if (result == 0) result = add_planets(&made, from->planets, from->planet_count);
    if (result == 0 && from->cells != NULL) result = add_cells(&made, &from->cells_desc);
    for (size_t i = 0; i < from->count && result == 0; i++)
        result = add(&made, &from->volumes[i], &from->entries[i], from->names[i], from->sources[i]);
    if (result != 0) nb_document_state_free(&made);
    *to = made;
    return result;
}

void nb_document_state_free(nb_document_state *edition)
{
    for (size_t i = 0; i < edition->count; i++) {
        nb_shape_free(&edition->volumes[i].shape);
        nebel_release_grid(edition->volumes[i].density.grid);
        free_entry(&edition->entries[i]);
        free(edition->names[i]);
    }
    for (size_t i = 0; i < edition->nebula_count; i++) {
        nb_shape_free(&edition->nebulae[i].shape);
        nebel_release_grid(edition->nebulae[i].density.grid);
        free((void *)edition->nebulae[i].colors);
    }
    for (size_t i = 0; i < edition->cells_desc.cell_count; i++) nb_shape_free(&edition->cells[i].shape);
    free(edition->volumes);
    free(edition->names);
    free(edition->sources);
    free(edition->entries);
    free(edition->nebulae);
    free(edition->nebula_places);
    free(edition->models);
    free(edition->lights);
    free(edition->camera_keys);
    free(edition->planets);
    free(edition->cells);
    *edition = (nb_document_state){.volumes = NULL};
}

/* What the file says of a volume without its keys has the parts and planes that the volume has now. */
static void lend_pieces(nb_document_state *edition)
{
    for (size_t i = 0; i < edition->count; i++) {
        const nebel_shape *const from = &edition->volumes[i].shape;
        nebel_volume_desc *const own = (nebel_volume_desc *)edition->entries[i].base;
        if (own == NULL) continue;
        own->shape.parts = from->parts;
        own->shape.planes = from->planes;
        own->shape.part_count = from->part_count;
        own->shape.plane_count = from->plane_count;
    }
}

void nb_document_state_show(nb_document_state *edition, nebel_scene_data *scene)
{
    lend_pieces(edition);
    scene->volumes = edition->volumes;
    scene->volume_tracks = edition->entries;
    scene->volume_names = (const char *const *)edition->names;
    scene->volume_count = edition->count;
    scene->nebulae = edition->nebulae;
    scene->nebula_transforms = edition->nebula_places;
    scene->models = edition->models;
    scene->model_count = edition->model_count;
    scene->lights = edition->lights;
    scene->light_count = edition->light_count;
    scene->camera_keys = edition->camera_keys;
    scene->camera_key_count = edition->camera_key_count;
    scene->planets = edition->planets;
    scene->planet_count = edition->planet_count;
    scene->cells = edition->cells != NULL ? &edition->cells_desc : NULL;
    scene->classic = edition->has_classic ? &edition->classic : NULL;
    scene->has_sun = edition->has_sun;
    scene->max_opacity = edition->max_opacity;
    memcpy(scene->background, edition->background, sizeof scene->background);
    memcpy(scene->ambient, edition->ambient, sizeof scene->ambient);
    scene->environment = nb_document_state_environment(edition, scene->environment.map);
    scene->shows_ambient = edition->shows_ambient;
    memcpy(scene->sun_direction, edition->sun_direction, sizeof scene->sun_direction);
    memcpy(scene->sun_irradiance, edition->sun_irradiance, sizeof scene->sun_irradiance);
}

size_t nb_document_state_size(const nb_document_state *edition)
{
    size_t size = sizeof *edition;
    for (size_t i = 0; i < edition->count; i++)
        size += sizeof *edition->volumes + sizeof *edition->entries + nb_shape_size(&edition->volumes[i].shape) +
                (edition->entries[i].key_count + 1) * sizeof(nebel_volume_key) + strlen(edition->names[i]);
    size += edition->model_count * sizeof *edition->models;
    size += edition->light_count * sizeof *edition->lights;
    size += edition->camera_key_count * sizeof *edition->camera_keys;
    size += edition->planet_count * sizeof *edition->planets;
    for (size_t i = 0; i < edition->nebula_count; i++)
        size += sizeof *edition->nebulae + nb_shape_size(&edition->nebulae[i].shape);
    for (size_t i = 0; i < edition->cells_desc.cell_count; i++)
        size += sizeof *edition->cells + nb_shape_size(&edition->cells[i].shape);
    return size;
}

/* ---- comparison: bit by bit, but for padding and addresses
 * -----------------------------------------------------------
 */

/* Members that follow each other without padding: doubles all. */
#define HAS_SAME(a, b, type, first, behind)                                                                            \
    (memcmp(&(a)->first, &(b)->first, offsetof(type, behind) - offsetof(type, first)) == 0)

/* The file's words, which are the name of a grid, say all of it. */
static int is_same_grid(const nebel_grid *a, const nebel_grid *b)
{
    if (a == b) return 1;
    return a != NULL && b != NULL && nebel_get_grid_name(a)[0] != '\0' &&
           strcmp(nebel_get_grid_name(a), nebel_get_grid_name(b)) == 0;
}

static int is_same_density(const nebel_density *a, const nebel_density *b)
{
    return a->type == b->type && a->below == b->below && a->power == b->power &&
           HAS_SAME(a, b, nebel_density, base, power) && HAS_SAME(a, b, nebel_density, center, edge_width) &&
           a->edge_width == b->edge_width && is_same_grid(a->grid, b->grid);
}

static int is_same_phase(const nebel_phase *a, const nebel_phase *b)
{
    return a->type == b->type && a->g == b->g && a->alpha == b->alpha && a->diameter == b->diameter;
}

int nb_document_state_is_same_volume(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return a->operation == b->operation && a->priority == b->priority && nb_shape_is_same(&a->shape, &b->shape) &&
           is_same_density(&a->density, &b->density) && HAS_SAME(a, b, nebel_volume_desc, extinction, phase) &&
           is_same_phase(&a->phase, &b->phase) && HAS_SAME(a, b, nebel_volume_desc, emission, cutoff) &&
           a->cutoff == b->cutoff;
}

static int is_same_still(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    nebel_volume_desc bare_a = *a, bare_b = *b;
    strip(&bare_a.shape);
    strip(&bare_b.shape);
    return nb_document_state_is_same_volume(&bare_a, &bare_b);
}

int nb_document_state_is_same_entry(const nebel_volume_track *a, const nebel_volume_track *b)
{
    if (a->contrast != b->contrast || a->key_count != b->key_count) return 0;
    for (size_t i = 0; i < a->key_count; i++)
        if (a->keys[i].frame != b->keys[i].frame || !is_same_still(&a->keys[i].volume, &b->keys[i].volume)) return 0;
    return a->key_count == 0 || is_same_still(a->base, b->base);
}

static int has_same_colors(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return a->color_count == b->color_count &&
           (a->color_count == 0 || memcmp(a->colors, b->colors, a->color_count * sizeof *a->colors) == 0);
}

static int is_same_nebula(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return nb_shape_is_same(&a->shape, &b->shape) && is_same_density(&a->density, &b->density) &&
           a->count == b->count && a->dimming == b->dimming && a->seed == b->seed && a->profile == b->profile &&
           HAS_SAME(a, b, nebel_nebula_desc, radius_range, colors) && has_same_colors(a, b) &&
           a->turbulence == b->turbulence && a->turbulence_scale == b->turbulence_scale;
}

int nb_document_state_has_same_nebulae(const nb_document_state *a, const nb_document_state *b)
{
    if (a->nebula_count != b->nebula_count) return 0;
    for (size_t i = 0; i < a->nebula_count; i++)
        if (!is_same_nebula(&a->nebulae[i], &b->nebulae[i]) ||
            memcmp(&a->nebula_places[i], &b->nebula_places[i], sizeof *a->nebula_places) != 0)
            return 0;
    return 1;
}

static int is_same_cell(const nebel_cell *a, const nebel_cell *b)
{
    return nb_shape_is_same(&a->shape, &b->shape) && a->density == b->density &&
           memcmp(a->color, b->color, sizeof a->color) == 0;
}

int nb_document_state_has_same_cells(const nb_document_state *a, const nb_document_state *b)
{
    const nebel_cells_desc *const from = &a->cells_desc, *const to = &b->cells_desc;
    if (from->cell_count != to->cell_count || from->model != to->model || from->span != to->span ||
        from->ungrouped != to->ungrouped)
        return 0;
    for (size_t i = 0; i < from->cell_count; i++)
        if (!is_same_cell(&a->cells[i], &b->cells[i])) return 0;
    return 1;
}

static int is_same_model(const nebel_scene_model *a, const nebel_scene_model *b)
{
    return a->model_index == b->model_index && a->has_color == b->has_color &&
           HAS_SAME(a, b, nebel_scene_model, position, has_color) && memcmp(a->color, b->color, sizeof a->color) == 0;
}

int nb_document_state_has_same_models(const nb_document_state *a, const nb_document_state *b)
{
    if (a->model_count != b->model_count) return 0;
    for (size_t i = 0; i < a->model_count; i++)
        if (!is_same_model(&a->models[i], &b->models[i])) return 0;
    return 1;
}

static int is_same_light(const nebel_light *a, const nebel_light *b)
{
    return a->type == b->type && HAS_SAME(a, b, nebel_light, position, outer_angle) && a->outer_angle == b->outer_angle;
}

int nb_document_state_has_same_lights(const nb_document_state *a, const nb_document_state *b)
{
    if (a->light_count != b->light_count) return 0;
    for (size_t i = 0; i < a->light_count; i++)
        if (!is_same_light(&a->lights[i], &b->lights[i])) return 0;
    return 1;
}

static int are_same_airs(const nebel_atmosphere_desc *a, const nebel_atmosphere_desc *b)
{
    if (a->component_count != b->component_count ||
        memcmp(a->ground_albedo, b->ground_albedo, sizeof a->ground_albedo) != 0)
        return 0;
    for (uint32_t i = 0; i < a->component_count; i++) {
        const nebel_atmosphere_component *const from = &a->components[i], *const to = &b->components[i];
        if (!HAS_SAME(from, to, nebel_atmosphere_component, scattering, phase) ||
            !is_same_phase(&from->phase, &to->phase) || from->scale_height != to->scale_height ||
            from->center_height != to->center_height || from->half_width != to->half_width)
            return 0;
    }
    return 1;
}

static int are_same_clouds(const nebel_planet *a, const nebel_planet *b)
{
    if (a->cloud_layer_count != b->cloud_layer_count) return 0;
    for (uint32_t i = 0; i < a->cloud_layer_count; i++) {
        const nebel_cloud_layer *const from = &a->cloud_layers[i], *const to = &b->cloud_layers[i];
        if (!HAS_SAME(from, to, nebel_cloud_layer, base, seed) || memcmp(from->wind, to->wind, sizeof from->wind) != 0)
            return 0;
    }
    return 1;
}

static int are_same_shells(const nebel_textured_planet_desc *a, const nebel_textured_planet_desc *b)
{
    if (a->rotation_period != b->rotation_period || a->land_coverage != b->land_coverage ||
        a->cloud_shell_count != b->cloud_shell_count || a->atmosphere.is_disabled != b->atmosphere.is_disabled ||
        !HAS_SAME(&a->atmosphere, &b->atmosphere, nebel_atmosphere_shell, height, ramp_count))
        return 0;
    for (uint32_t i = 0; i < a->cloud_shell_count; i++) {
        const nebel_cloud_shell *const from = &a->cloud_shells[i], *const to = &b->cloud_shells[i];
        if (!HAS_SAME(from, to, nebel_cloud_shell, height, coverage_map) ||
            !HAS_SAME(from, to, nebel_cloud_shell, uv_tiling, seed))
            return 0;
    }
    return 1;
}

int nb_document_state_has_same_planets(const nb_document_state *a, const nb_document_state *b)
{
    if (a->planet_count != b->planet_count) return 0;
    for (size_t i = 0; i < a->planet_count; i++) {
        const nebel_planet *const from = &a->planets[i], *const to = &b->planets[i];
        if (from->sun_angular_diameter != to->sun_angular_diameter ||
            !are_same_airs(&from->atmosphere_desc, &to->atmosphere_desc) || !are_same_clouds(from, to) ||
            !are_same_shells(&from->textured_desc, &to->textured_desc))
            return 0;
    }
    return 1;
}

int nb_document_state_has_same_camera_keys(const nb_document_state *a, const nb_document_state *b)
{
    if (a->camera_key_count != b->camera_key_count) return 0;
    for (size_t i = 0; i < a->camera_key_count; i++) {
        const nebel_camera_key *const from = &a->camera_keys[i], *const to = &b->camera_keys[i];
        if (from->frame != to->frame || from->camera.projection != to->camera.projection ||
            !HAS_SAME(&from->camera, &to->camera, nebel_camera, position, projection))
            return 0;
    }
    return 1;
}

static int has_same_classic(const nb_document_state *a, const nb_document_state *b)
{
    const nebel_factor_desc *const from = &a->classic, *const to = &b->classic;
    return a->has_classic == b->has_classic && from->coordinate == to->coordinate && from->stage == to->stage &&
           HAS_SAME(from, to, nebel_factor_desc, start, color) &&
           memcmp(from->color, to->color, sizeof from->color) == 0;
}

static int has_same_environment(const nb_document_state *a, const nb_document_state *b)
{
    const nebel_environment *const from = &a->environment, *const to = &b->environment;
    return a->shows_ambient == b->shows_ambient && from->type == to->type &&
           memcmp(from->zenith, to->zenith, sizeof from->zenith) == 0 &&
           memcmp(from->horizon, to->horizon, sizeof from->horizon) == 0 &&
           memcmp(from->ground, to->ground, sizeof from->ground) == 0 && from->rotation == to->rotation &&
           from->intensity == to->intensity;
}

nebel_environment nb_document_state_environment(const nb_document_state *edition, nebel_environment_map *map)
{
    nebel_environment environment = edition->environment;
    memcpy(environment.radiance, edition->ambient, sizeof environment.radiance);
    environment.map = map;
    if (environment.type == NEBEL_ENVIRONMENT_MAP && map == NULL) environment.type = NEBEL_ENVIRONMENT_CONSTANT;
    return environment;
}

int nb_document_state_has_same_light(const nb_document_state *a, const nb_document_state *b)
{
    return a->has_sun == b->has_sun && a->max_opacity == b->max_opacity &&
           HAS_SAME(a, b, nb_document_state, background, max_opacity) && has_same_environment(a, b) &&
           has_same_classic(a, b);
}

int nb_document_state_has_same_sources(const nb_document_state *a, const nb_document_state *b)
{
    return a->count == b->count &&
           (a->count == 0 || memcmp(a->sources, b->sources, a->count * sizeof *a->sources) == 0);
}

int nb_document_state_is_same(const nb_document_state *a, const nb_document_state *b)
{
    if (!nb_document_state_has_same_sources(a, b) || !nb_document_state_has_same_nebulae(a, b) ||
        !nb_document_state_has_same_cells(a, b) || !nb_document_state_has_same_models(a, b) ||
        !nb_document_state_has_same_lights(a, b) || !nb_document_state_has_same_light(a, b) ||
        !nb_document_state_has_same_planets(a, b) || !nb_document_state_has_same_camera_keys(a, b))
        return 0;
    for (size_t i = 0; i < a->count; i++)
        if (!nb_document_state_is_same_volume(&a->volumes[i], &b->volumes[i]) ||
            !nb_document_state_is_same_entry(&a->entries[i], &b->entries[i]) || strcmp(a->names[i], b->names[i]) != 0)
            return 0;
    return 1;
}
