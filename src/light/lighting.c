#include "lighting.h"

#include "light_lattice.h"

#include "medium/density.h"
#include "medium/grid.h"
#include "medium/medium_check.h"

#include <math.h>
#include <string.h>

/* ---- descriptions ---------------------------------------------------------------------------- */

static const char *fault_of_diffusion(const nebel_diffusion_desc *desc)
{
    if (desc->max_cells != 0 &&
        (desc->max_cells < NEBEL_MIN_DIFFUSION_CELLS || desc->max_cells > NEBEL_MAX_DIFFUSION_CELLS))
        return "max_cells: must be 0 or within " NB_TEXT(NEBEL_MIN_DIFFUSION_CELLS) " and " NB_TEXT(
            NEBEL_MAX_DIFFUSION_CELLS);
    if (!desc->has_ground) return NULL;
    if (!(fabs(desc->ground_height) <= NEBEL_MAX_LENGTH)) return "ground_height: must be at most 1e15 m";
    for (int c = 0; c < 3; c++)
        if (!(desc->ground_albedo[c] >= 0 && desc->ground_albedo[c] <= 1))
            return "ground_albedo: must be within 0 and 1";
    return NULL;
}

static int shines(const nebel_sun *sun)
{
    return sun->irradiance[0] != 0 || sun->irradiance[1] != 0 || sun->irradiance[2] != 0;
}

static nebel_result check_sun(const nebel_log *log, const nebel_sun *sun)
{
    const double *d = sun->direction, length = hypot(hypot(d[0], d[1]), d[2]);
    if (shines(sun) && !(length >= NEBEL_MIN_DIRECTION && length <= NEBEL_MAX_DIRECTION))
        return nb_fail(log, NEBEL_ERROR_VALUE,
                       "sun direction: must be three finite numbers, not all zero, of a length from " NB_TEXT(
                           NEBEL_MIN_DIRECTION) " to " NB_TEXT(NEBEL_MAX_DIRECTION));
    return nb_check_color(log, "sun irradiance", sun->irradiance, NEBEL_MAX_AMOUNT);
}

nebel_result nb_check_lighting(const nebel_log *log, const nebel_lighting_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "allocator: needs allocate and release, or neither");
    if (desc->light_count > 0 && desc->lights == NULL)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "lights: must not be NULL");
    nebel_result result = check_sun(log, &desc->sun);
    if (result == NEBEL_OK) result = nb_check_sky(log, &desc->environment);
    if (result == NEBEL_OK) result = nb_check_lights(log, desc->light_count, desc->lights);
    const char *fault = desc->diffusion != NULL ? fault_of_diffusion(desc->diffusion) : NULL;
    if (result == NEBEL_OK && fault != NULL) return nb_fail(log, NEBEL_ERROR_VALUE, "diffusion: %s", fault);
    return result;
}

/* What `previous` has prepared may serve again only if it is kept by the same allocator, which may have to live as long as either. */
static const nebel_lighting *choose_previous(const nebel_lighting *lighting, const nebel_lighting *previous)
{
    const nebel_allocator *a = &lighting->allocator;
    if (previous == NULL) return NULL;
    const nebel_allocator *b = &previous->allocator;
    return a->allocate == b->allocate && a->release == b->release && a->user == b->user ? previous : NULL;
}

/* ---- the sun --------------------------------------------------------------------------------- */

/* Adding +0 makes every zero positive, as the march does with directions of its own. */
static void point_to_sun(nebel_lighting *lighting, const nebel_sun *sun)
{
    const double *d = sun->direction;
    const double size = fmax(fmax(fabs(d[0]), fabs(d[1])), fabs(d[2]));
    if (!shines(sun)) return;
    const double x = d[0] / size, y = d[1] / size, z = d[2] / size, length = sqrt(x * x + y * y + z * z);
    lighting->to_sun[0] = x / length + 0;
    lighting->to_sun[1] = y / length + 0;
    lighting->to_sun[2] = z / length + 0;
    memcpy(lighting->irradiance, sun->irradiance, sizeof lighting->irradiance);
}

/* More bodies with flat faces than these have so many turns that steps are better adaptive. */
#define MOST_FLAT 8

static int is_flat(const nb_volume *body)
{
    const nb_leaf *leaf = &body->leaves[0];
    return leaf->type == NB_LEAF_WORLD || leaf->type == NB_LEAF_BOX ||
           (leaf->type == NB_LEAF_PLANES && leaf->face_count <= NB_MAX_EDGED_FACES);
}

static int are_flat(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++)
        if (!is_flat(&s->media[i].body)) return 0;
    return 1;
}

static int are_constant(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++)
        if (s->media[i].body.density.type != NEBEL_DENSITY_CONSTANT) return 0;
    return 1;
}

static nb_sun_depth_method choose_sun_depth_method(const nebel_lighting *lighting)
{
    const nebel_snapshot *s = lighting->snapshot;
    if (!lighting->scatters_sun) return NB_SUN_DEPTH_MARCHED;
    if (s->adds_depths && are_constant(s))
        return s->medium_count <= MOST_FLAT && are_flat(s) ? NB_SUN_DEPTH_FLAT : NB_SUN_DEPTH_ADDED;
    const nb_volume *body = &s->media[0].body;
    const nb_sun_depth_method other = s->adds_depths ? NB_SUN_DEPTH_SUMMED : NB_SUN_DEPTH_MARCHED;
    if (s->medium_count != 1 || nb_volume_covers(body) || body->leaf_count != 1) return other;
    if (body->density.type == NEBEL_DENSITY_GRID) return NB_SUN_DEPTH_GRID;
    if (body->leaves[0].type != NB_LEAF_WORLD) return other;
    if (body->density.type == NEBEL_DENSITY_ALTITUDE) return NB_SUN_DEPTH_ALTITUDE;
    const int is_height = body->density.type == NEBEL_DENSITY_HEIGHT && body->density.below == NEBEL_BELOW_GROW;
    return is_height && lighting->to_sun[1] > 0 ? NB_SUN_DEPTH_HEIGHT : other;
}

void nb_way_in_cells(const nebel_lighting *lighting, const nb_volume *body, double way[3])
{
    const nb_leaf *leaf = &body->leaves[0];
    const double *const to_sun = lighting->to_sun;
    double rate[3];
    nb_grid_rate(body->density.grid, leaf->low, leaf->high, rate);
    for (int i = 0; i < 3; i++) {
        const double *row = &leaf->matrix[3 * i];
        const double turned = row[0] * to_sun[0] + row[1] * to_sun[1] + row[2] * to_sun[2];
        way[i] = rate[i] * (leaf->aligned ? to_sun[i] : turned);
    }
}

/* Two columns per cell where those of all voxels come to no more than 64 MiB. */
static const nb_sun_lattice_limit lattice_limit = {2, (size_t)1 << 25, 1};

static int wants_lattice(const nebel_lighting *lighting, size_t medium)
{
    const nebel_density *density = &lighting->snapshot->media[medium].body.density;
    const nb_sun_depth_method method = lighting->sun_depth_method;
    return (method == NB_SUN_DEPTH_GRID || method == NB_SUN_DEPTH_SUMMED) && density->type == NEBEL_DENSITY_GRID &&
           nb_grid_is_linear(density->grid);
}

/* The lattice of a lighting that would be made anew for such a grid and way. NULL: it has none. */
static nb_sun_lattice *find_lattice(const nebel_lighting *lighting, const nebel_grid *grid, const double way[3],
                                    nb_sun_lattice_limit limit)
{
    for (size_t i = 0; lighting != NULL && i < lighting->snapshot->medium_count; i++) {
        nb_sun_lattice *lattice = lighting->media[i].sun_lattice;
        if (lattice != NULL && nb_sun_lattice_is_of(lattice, grid, way, limit)) return lattice;
    }
    return NULL;
}

/* Of voxels whose depth to the sun is a term of a sum; those that the lighting before has where they still serve. 0 when
 * memory is out. */
static int take_sun_lattices(nebel_lighting *lighting, const nebel_lighting *previous)
{
    nb_sun_lattice_limit limit = lattice_limit;
    size_t count = 0;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) count += wants_lattice(lighting, i) ? 1 : 0;
    if (count > 0) limit.most_nodes /= count;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_volume *body = &lighting->snapshot->media[i].body;
        double way[3];
        if (!wants_lattice(lighting, i)) continue;
        nb_way_in_cells(lighting, body, way);
        nb_sun_lattice *known = find_lattice(lighting, body->density.grid, way, limit);
        if (known == NULL) known = find_lattice(previous, body->density.grid, way, limit);
        lighting->media[i].sun_lattice =
            known != NULL ? nb_sun_lattice_retain(known)
                          : nb_sun_lattice_make(body->density.grid, &lighting->allocator, way, limit);
        if (lighting->media[i].sun_lattice == NULL) return 0;
    }
    return 1;
}

/* ---- point and spot lights ------------------------------------------------------------------- */

/* 0 when memory is out. */
static int copy_lights(nebel_lighting *lighting, size_t count, const nebel_light *lights)
{
    if (count == 0) return 1;
    lighting->lights = nb_allocate(&lighting->allocator, count, sizeof *lighting->lights);
    lighting->described_lights = nb_allocate(&lighting->allocator, count, sizeof *lights);
    if (lighting->lights == NULL || lighting->described_lights == NULL) return 0;
    memcpy(lighting->described_lights, lights, count * sizeof *lights);
    for (size_t i = 0; i < count; i++) lighting->lights[i] = nb_light_resolve(&lights[i]);
    lighting->light_count = count;
    return 1;
}

/* Fewer media than these are better asked from turn to turn. */
#define LEAST_COMMON 9

/* Common steps go along a ray once for each light and phase function. */
#define MOST_PHASES 4

/* Depths have to add. The steps of voxels alone in sunlight are their cells. */
static nb_common_steps choose_common_steps(const nebel_lighting *lighting)
{
    const nebel_snapshot *s = lighting->snapshot;
    const int has_company = s->medium_count > 1 || lighting->scatters_lights;
    int has_voxels = 0;
    if (!(lighting->scatters_sun || lighting->scatters_lights)) return NB_COMMON_STEPS_NEVER;
    if (lighting->phase_count > MOST_PHASES) return NB_COMMON_STEPS_NEVER;
    for (size_t i = 0; i < s->medium_count; i++) {
        const nebel_density *density = &s->media[i].body.density;
        const int is_voxels = density->type == NEBEL_DENSITY_GRID && !nb_volume_covers(&s->media[i].body);
        if (is_voxels && !nb_grid_is_linear(density->grid)) return NB_COMMON_STEPS_NEVER;
        if (!is_voxels && !nb_medium_adds_depth(&s->media[i])) return NB_COMMON_STEPS_NEVER;
        has_voxels = has_voxels || is_voxels;
    }
    if (has_voxels) return has_company ? NB_COMMON_STEPS_IN_FLOAT : NB_COMMON_STEPS_NEVER;
    return s->medium_count >= LEAST_COMMON ? NB_COMMON_STEPS_ALWAYS : NB_COMMON_STEPS_NEVER;
}

/* Numbers the phase functions that scatter point lights, up to one more than common steps can have. */
static void number_phases(nebel_lighting *lighting)
{
    const nebel_snapshot *s = lighting->snapshot;
    for (size_t i = 0; i < s->medium_count && lighting->phase_count <= MOST_PHASES; i++) {
        nb_medium_light *lit = &lighting->media[i];
        size_t known = 0;
        if (!lit->scatters_lights) continue;
        while (known < i && (!lighting->media[known].scatters_lights ||
                             nb_phase_compare(&s->media[known].body.phase, &s->media[i].body.phase) != 0))
            known++;
        lit->phase = known < i ? lighting->media[known].phase : lighting->phase_count++;
    }
}

/* ---- the environment ------------------------------------------------------------------------- */

static const nb_environment_light *find_environment_light(const nebel_lighting *lighting, const nb_phase *phase)
{
    for (size_t i = 0; i < lighting->environment_light_count; i++) {
        const nb_environment_light *light = &lighting->environment_lights[i];
        if (nb_phase_compare(nb_environment_filter_phase(light->filter), phase) == 0) return light;
    }
    return NULL;
}

/* Filters of gradients are the same for all of them, and those of maps are kept by the map. */
static nb_environment_filter *take_filter(const nebel_lighting *lighting, const nebel_lighting *previous,
                                          const nb_phase *phase)
{
    const int is_gradient = lighting->environment.type == NEBEL_ENVIRONMENT_GRADIENT && previous != NULL &&
                            previous->environment.type == NEBEL_ENVIRONMENT_GRADIENT;
    const nb_environment_light *before = is_gradient ? find_environment_light(previous, phase) : NULL;
    return before != NULL ? nb_environment_filter_retain(before->filter)
                          : nb_environment_filter_make(&lighting->allocator, &lighting->environment, phase);
}

static nebel_result add_environment_light(nebel_lighting *lighting, const nebel_lighting *previous,
                                          const nb_phase *phase)
{
    if (lighting->environment_light_count == NEBEL_MAX_ENVIRONMENT_PHASES)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT, "environment: more than %d phase functions scatter it",
                       NEBEL_MAX_ENVIRONMENT_PHASES);
    nb_environment_filter *filter = take_filter(lighting, previous, phase);
    if (filter == NULL) return NEBEL_ERROR_MEMORY;
    lighting->environment_lights[lighting->environment_light_count++] =
        nb_environment_light_of(&lighting->environment, filter);
    return NEBEL_OK;
}

/* Media of one phase function share what it makes of the environment. */
static nebel_result light_by_environment(nebel_lighting *lighting, const nebel_lighting *previous)
{
    const nebel_snapshot *s = lighting->snapshot;
    nebel_result result = NEBEL_OK;
    if (lighting->environment.type == NEBEL_ENVIRONMENT_CONSTANT) return NEBEL_OK;
    lighting->environment_lights =
        nb_allocate(&lighting->allocator, NEBEL_MAX_ENVIRONMENT_PHASES, sizeof *lighting->environment_lights);
    if (lighting->environment_lights == NULL) return NEBEL_ERROR_MEMORY;
    for (size_t i = 0; i < s->medium_count && result == NEBEL_OK; i++) {
        const nb_phase *phase = &s->media[i].body.phase;
        if (!s->media[i].body.lit) continue;
        if (find_environment_light(lighting, phase) == NULL) result = add_environment_light(lighting, previous, phase);
        lighting->media[i].environment = find_environment_light(lighting, phase);
    }
    return result;
}

/* ---- all of it ------------------------------------------------------------------------------- */

const nb_light_lattices *nb_light_lattices_of(const nebel_lighting *lighting)
{
    _Atomic(nb_light_lattices *) *slot = (_Atomic(nb_light_lattices *) *)&lighting->light_lattices; /* a cache */
    nb_light_lattices *known = atomic_load_explicit(slot, memory_order_acquire);
    if (known == NULL) {
        nb_light_lattices *made =
            nb_light_lattices_open(&lighting->allocator, lighting->snapshot, lighting->light_count);
        if (made == NULL) return NULL;
        if (atomic_compare_exchange_strong_explicit(slot, &known, made, memory_order_acq_rel, memory_order_acquire))
            known = made;
        else
            nb_light_lattices_free(made);
    }
    nb_light_lattices_fill(known, lighting->snapshot, lighting->lights);
    return known;
}

void nb_free_lighting(nebel_lighting *lighting)
{
    const nebel_allocator allocator = lighting->allocator;
    const size_t count = lighting->media != NULL ? lighting->snapshot->medium_count : 0;
    for (size_t i = 0; i < count; i++) nb_sun_lattice_release(lighting->media[i].sun_lattice);
    for (size_t i = 0; i < lighting->environment_light_count; i++)
        nb_environment_filter_release(lighting->environment_lights[i].filter);
    nebel_release_environment_map(lighting->environment.map);
    nb_light_lattices_free(atomic_load(&lighting->light_lattices));
    nb_release(&allocator, lighting->media);
    nb_release(&allocator, lighting->lights);
    nb_release(&allocator, lighting->described_lights);
    nb_release(&allocator, lighting->environment_lights);
    nebel_release_snapshot(lighting->snapshot);
    nb_release(&allocator, lighting);
}

static nebel_lighting *open_lighting(nebel_snapshot *snapshot, const nebel_lighting_desc *desc)
{
    const nebel_allocator allocator =
        desc->host.allocator.allocate != NULL ? nb_resolve_allocator(&desc->host.allocator) : snapshot->allocator;
    nebel_lighting *lighting = nb_allocate_zero(&allocator, 1, sizeof *lighting);
    if (lighting == NULL) return NULL;
    lighting->allocator = allocator;
    lighting->log = desc->host.log.write != NULL ? desc->host.log : snapshot->log;
    lighting->snapshot = nebel_retain_snapshot(snapshot);
    lighting->environment = desc->environment;
    if (desc->environment.type == NEBEL_ENVIRONMENT_MAP)
        (void)nebel_retain_environment_map(desc->environment.map);
    else
        lighting->environment.map = NULL;
    if (desc->diffusion != NULL) {
        lighting->diffusion_desc = *desc->diffusion;
        if (desc->diffusion->max_cells == 0) lighting->diffusion_desc.max_cells = NEBEL_DEFAULT_DIFFUSION_CELLS;
    }
    atomic_init(&lighting->owners, 1);
    return lighting;
}

static nebel_result fill_lighting(nebel_lighting *lighting, const nebel_lighting_desc *desc)
{
    const nebel_lighting *previous = choose_previous(lighting, desc->previous);
    double ambient[3];
    lighting->media = nb_allocate_zero(&lighting->allocator, lighting->snapshot->medium_count, sizeof *lighting->media);
    if (lighting->media == NULL || !copy_lights(lighting, desc->light_count, desc->lights)) return NEBEL_ERROR_MEMORY;
    point_to_sun(lighting, &desc->sun);
    nb_environment_most(&lighting->environment, ambient);
    nb_light_media(lighting, ambient, desc->sun.irradiance);
    const nebel_result result = light_by_environment(lighting, previous);
    if (result != NEBEL_OK) return result;
    nb_join_media(lighting);
    lighting->sun_depth_method = choose_sun_depth_method(lighting);
    number_phases(lighting);
    lighting->common_steps = choose_common_steps(lighting);
    return take_sun_lattices(lighting, previous) ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

nebel_result nb_prepare_lighting(nebel_snapshot *snapshot, const nebel_lighting_desc *desc, nebel_lighting **made)
{
    nebel_lighting *lighting = open_lighting(snapshot, desc);
    *made = NULL;
    if (lighting == NULL) return NEBEL_ERROR_MEMORY;
    const nebel_result result = fill_lighting(lighting, desc);
    if (result == NEBEL_OK)
        *made = lighting;
    else
        nb_free_lighting(lighting);
    return result;
}
