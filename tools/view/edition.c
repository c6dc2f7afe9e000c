#include "edition.h"

#include "shape.h"

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

static int make_room(nb_edition *edition)
{
    const size_t wanted = edition->capacity > 0 ? 2 * edition->capacity : 8;
    if (edition->count < edition->capacity) return 0;
    void *const volumes = realloc(edition->volumes, wanted * sizeof *edition->volumes);
    if (volumes != NULL) edition->volumes = volumes;
    void *const names = realloc(edition->names, wanted * sizeof *edition->names);
    if (names != NULL) edition->names = names;
    void *const sources = realloc(edition->sources, wanted * sizeof *edition->sources);
    if (sources != NULL) edition->sources = sources;
    if (volumes == NULL || names == NULL || sources == NULL) return -1;
    edition->capacity = wanted;
    return 0;
}

/* ---- volumes
 * ---------------------------------------------------------------------------------------------------------
 */

static int add(nb_edition *edition, const nebel_volume_desc *volume, const char *name, size_t source)
{
    if (make_room(edition) != 0) return -1;
    nebel_volume_desc own = *volume;
    char *const own_name = copy_text(name);
    if (nb_shape_own(&own.shape) != 0 || own_name == NULL) {
        nb_shape_free(&own.shape);
        free(own_name);
        return -1;
    }
    edition->volumes[edition->count] = own;
    edition->names[edition->count] = own_name;
    edition->sources[edition->count++] = source;
    return 0;
}

int nb_edition_add(nb_edition *edition, const nebel_volume_desc *volume, const char *name)
{
    return add(edition, volume, name, NEBEL_NEW_VOLUME);
}

int nb_edition_rename(nb_edition *edition, size_t index, const char *name)
{
    char *const own = copy_text(name);
    if (own == NULL) return -1;
    free(edition->names[index]);
    edition->names[index] = own;
    return 0;
}

void nb_edition_remove(nb_edition *edition, size_t index)
{
    const size_t behind = --edition->count - index;
    nb_shape_free(&edition->volumes[index].shape);
    free(edition->names[index]);
    memmove(edition->volumes + index, edition->volumes + index + 1, behind * sizeof *edition->volumes);
    memmove(edition->names + index, edition->names + index + 1, behind * sizeof *edition->names);
    memmove(edition->sources + index, edition->sources + index + 1, behind * sizeof *edition->sources);
}

/* ---- all of it
 * -------------------------------------------------------------------------------------------------------
 */

/* Those that are there are counted one by one, so that an edition that is not complete can be freed. */
static int add_nebulae(nb_edition *edition, const nebel_nebula_desc *nebulae, size_t count)
{
    edition->nebulae = calloc(count + 1, sizeof *edition->nebulae);
    for (size_t i = 0; i < count && edition->nebulae != NULL; i++) {
        edition->nebulae[i] = nebulae[i];
        edition->nebula_count = i + 1;
        if (nb_shape_own(&edition->nebulae[i].shape) != 0) return -1;
    }
    return edition->nebulae != NULL ? 0 : -1;
}

static int add_cells(nb_edition *edition, const nebel_cells_desc *desc)
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

int nb_edition_make(const nebel_scene_data *scene, nb_edition *edition)
{
    nb_edition made = {.max_opacity = scene->max_opacity};
    memcpy(made.background, scene->background, sizeof made.background);
    memcpy(made.ambient, scene->ambient, sizeof made.ambient);
    memcpy(made.sun_direction, scene->sun_direction, sizeof made.sun_direction);
    memcpy(made.sun_irradiance, scene->sun_irradiance, sizeof made.sun_irradiance);
    int result = add_nebulae(&made, scene->nebulae, scene->nebula_count);
    if (result == 0) result = add_cells(&made, scene->cells);
    for (size_t i = 0; i < scene->volume_count && result == 0; i++)
        result = add(&made, &scene->volumes[i], scene->volume_names[i], i);
    if (result != 0) nb_edition_free(&made);
    *edition = made;
    return result;
}

int nb_edition_copy(const nb_edition *from, nb_edition *to)
{
    nb_edition made = *from;
    made.volumes = NULL;
    made.names = NULL;
    made.sources = NULL;
    made.nebulae = NULL;
    made.cells = NULL;
    made.cells_desc.cell_count = 0;
    made.count = made.capacity = made.nebula_count = 0;
    int result = add_nebulae(&made, from->nebulae, from->nebula_count);
    if (result == 0 && from->cells != NULL) result = add_cells(&made, &from->cells_desc);
    for (size_t i = 0; i < from->count && result == 0; i++)
        result = add(&made, &from->volumes[i], from->names[i], from->sources[i]);
    if (result != 0) nb_edition_free(&made);
    *to = made;
    return result;
}

void nb_edition_free(nb_edition *edition)
{
    for (size_t i = 0; i < edition->count; i++) {
        nb_shape_free(&edition->volumes[i].shape);
        free(edition->names[i]);
    }
    for (size_t i = 0; i < edition->nebula_count; i++) nb_shape_free(&edition->nebulae[i].shape);
    for (size_t i = 0; i < edition->cells_desc.cell_count; i++) nb_shape_free(&edition->cells[i].shape);
    free(edition->volumes);
    free(edition->names);
    free(edition->sources);
    free(edition->nebulae);
    free(edition->cells);
    *edition = (nb_edition){.volumes = NULL};
}

void nb_edition_show(const nb_edition *edition, nebel_scene_data *scene)
{
    scene->volumes = edition->volumes;
    scene->volume_names = (const char *const *)edition->names;
    scene->volume_count = edition->count;
    scene->nebulae = edition->nebulae;
    scene->cells = edition->cells != NULL ? &edition->cells_desc : NULL;
    scene->max_opacity = edition->max_opacity;
    memcpy(scene->background, edition->background, sizeof scene->background);
    memcpy(scene->ambient, edition->ambient, sizeof scene->ambient);
    memcpy(scene->sun_direction, edition->sun_direction, sizeof scene->sun_direction);
    memcpy(scene->sun_irradiance, edition->sun_irradiance, sizeof scene->sun_irradiance);
}

size_t nb_edition_size(const nb_edition *edition)
{
    size_t size = sizeof *edition;
    for (size_t i = 0; i < edition->count; i++)
        size += sizeof *edition->volumes + nb_shape_size(&edition->volumes[i].shape) + strlen(edition->names[i]);
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

static int is_same_density(const nebel_density *a, const nebel_density *b)
{
    return a->type == b->type && a->below == b->below && a->power == b->power &&
           HAS_SAME(a, b, nebel_density, base, power) && HAS_SAME(a, b, nebel_density, center, distance) &&
           a->distance == b->distance;
}

int nb_edition_is_same_volume(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    return a->operation == b->operation && a->priority == b->priority && nb_shape_is_same(&a->shape, &b->shape) &&
           is_same_density(&a->density, &b->density) && HAS_SAME(a, b, nebel_volume_desc, extinction, cutoff) &&
           a->cutoff == b->cutoff;
}

static int is_same_nebula(const nebel_nebula_desc *a, const nebel_nebula_desc *b)
{
    return nb_shape_is_same(&a->shape, &b->shape) && is_same_density(&a->density, &b->density) &&
           a->count == b->count && a->seed == b->seed && a->profile == b->profile &&
           HAS_SAME(a, b, nebel_nebula_desc, size, colors) && a->turbulence == b->turbulence &&
           a->turbulence_size == b->turbulence_size;
}

int nb_edition_has_same_nebulae(const nb_edition *a, const nb_edition *b)
{
    if (a->nebula_count != b->nebula_count) return 0;
    for (size_t i = 0; i < a->nebula_count; i++)
        if (!is_same_nebula(&a->nebulae[i], &b->nebulae[i])) return 0;
    return 1;
}

static int is_same_cell(const nebel_cell *a, const nebel_cell *b)
{
    return nb_shape_is_same(&a->shape, &b->shape) && a->density == b->density &&
           memcmp(a->color, b->color, sizeof a->color) == 0;
}

int nb_edition_has_same_cells(const nb_edition *a, const nb_edition *b)
{
    const size_t count = a->cells_desc.cell_count;
    if (count != b->cells_desc.cell_count) return 0;
    for (size_t i = 0; i < count; i++)
        if (!is_same_cell(&a->cells[i], &b->cells[i])) return 0;
    return 1;
}

int nb_edition_has_same_sources(const nb_edition *a, const nb_edition *b)
{
    return a->count == b->count &&
           (a->count == 0 || memcmp(a->sources, b->sources, a->count * sizeof *a->sources) == 0);
}

int nb_edition_is_same(const nb_edition *a, const nb_edition *b)
{
    if (!nb_edition_has_same_sources(a, b) || !nb_edition_has_same_nebulae(a, b) || !nb_edition_has_same_cells(a, b) ||
        a->max_opacity != b->max_opacity || !HAS_SAME(a, b, nb_edition, background, max_opacity))
        return 0;
    for (size_t i = 0; i < a->count; i++)
        if (!nb_edition_is_same_volume(&a->volumes[i], &b->volumes[i]) || strcmp(a->names[i], b->names[i]) != 0)
            return 0;
    return 1;
}
