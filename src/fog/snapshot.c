#include "snapshot.h"

#include "diffusion/diffusion.h"
#include "medium/grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int compare_media(const void *a, const void *b)
{
    return nb_volume_compare(&((const nb_medium *)a)->body, &((const nb_medium *)b)->body);
}

static double proportion_of(const nb_volume *v)
{
    const double extent = (v->high[0] - v->low[0]) + (v->high[1] - v->low[1]) + (v->high[2] - v->low[2]);
    double most = 1;
    for (size_t i = 0; i < v->leaf_count; i++)
        if (!v->leaves[i].aligned) most = fmax(most, v->leaves[i].scale * extent);
    return most;
}

static double densest_of(const nebel_density *density)
{
    return density->type == NEBEL_DENSITY_GRID ? nb_grid_peak(density->grid) : 1;
}

static void find_moments(nb_medium *medium)
{
    const nb_volume *v = &medium->body;
    const double cosine = v->lit ? nebel_phase_mean_cosine(&v->described_phase) : 0;
    medium->ahead = cosine > 0 ? cosine * cosine : 0;
    medium->turned_cosine = cosine > 0 ? cosine / (1 + cosine) : cosine;
}

static void light_medium(nb_medium *medium, const nebel_fog *fog)
{
    const nb_volume *v = &medium->body;
    double ambient[3];
    nb_environment_most(&fog->sky, ambient);
    for (int c = 0; c < 3; c++) {
        medium->radiance[c] = v->lit ? v->albedo[c] * ambient[c] : v->source[c];
        medium->light[c] = medium->radiance[c] * v->extinction[c] + v->emission[c];
        medium->densest = fmax(medium->densest, v->extinction[c]);
        medium->brightest = fmax(medium->brightest, medium->light[c]);
        medium->emits = medium->emits || v->emission[c] > 0;
        medium->shine[c] = v->albedo[c] * fog->sun.irradiance[c];
        medium->is_sunlit = medium->is_sunlit || medium->shine[c] * v->extinction[c] > 0;
        medium->is_lamplit = medium->is_lamplit || (fog->lamp_count > 0 && v->albedo[c] * v->extinction[c] > 0);
    }
    medium->densest *= densest_of(&v->density);
    medium->brightest *= densest_of(&v->density);
    medium->proportion = proportion_of(v);
}

static void free_snapshot(nebel_snapshot *s)
{
    const nebel_allocator allocator = s->allocator;
    for (size_t i = 0; i < s->medium_count; i++) {
        nb_volume_free(&allocator, &s->media[i].body);
        nb_sun_lattice_release(s->media[i].lattice);
    }
    nb_diffusion_free(&allocator, s->diffusion);
    nb_diffusion_free(&allocator, s->own_diffusion);
    for (size_t i = 0; i < s->skylight_count; i++) nb_environment_filter_release(s->skylights[i].filter);
    nebel_release_environment_map(s->sky.map);
    nb_bvh_free(&allocator, &s->bvh);
    nb_release(&allocator, s->media);
    nb_release(&allocator, s->skylights);
    nb_release(&allocator, s->lamps);
    nb_release(&allocator, s->endless);
    nb_release(&allocator, s->bounded);
    nb_release(&allocator, s);
}

static int may_join(const nb_medium *medium)
{
    const nb_volume *v = &medium->body;
    return v->operation == NEBEL_OPERATION_ADD && v->density.type == NEBEL_DENSITY_CONSTANT && v->leaf_count == 1 &&
           !medium->emits && !medium->is_sunlit && !medium->is_lamplit && medium->sky == NULL;
}

/* Of the media that may join, those of the rank that has most of them do. */
static void join_media(nebel_snapshot *s)
{
    size_t counted = 0;
    for (size_t i = 0; i < s->medium_count; i++) {
        nb_medium *medium = &s->media[i];
        if (i > 0 && medium->body.rank != s->media[i - 1].body.rank) counted = 0;
        if (!may_join(medium) || ++counted <= s->joining_count) continue;
        s->joining_count = counted;
        s->joining = medium;
    }
    for (size_t i = 0; i < s->medium_count; i++)
        s->media[i].joins = may_join(&s->media[i]) && s->media[i].body.rank == s->joining->body.rank;
}

static int has_body(const nb_volume *volume)
{
    for (int i = 0; i < 3; i++)
        if (!(volume->low[i] <= volume->high[i])) return 0;
    return 1;
}

/* What a snapshot takes of a fog, and how. */
typedef struct nb_medium_selection {
    int is_scaled; /* see scale_medium */
    int is_level;  /* fog without an end along x or z alone */
} nb_medium_selection;

static int is_level(const nb_volume *volume)
{
    return isinf(volume->low[0]) || isinf(volume->high[0]) || isinf(volume->low[2]) || isinf(volume->high[2]);
}

/* Fog that takes from light what does not go straight on, and gives none. */
static void scale_medium(nb_medium *medium)
{
    nb_volume *v = &medium->body;
    for (int c = 0; c < 3; c++) {
        v->extinction[c] *= 1 - (v->lit ? v->albedo[c] * medium->ahead : 0);
        v->albedo[c] = v->source[c] = v->emission[c] = 0;
    }
    v->lit = 0;
}

/* Copies the volumes that can touch a ray. 0 when memory is out. */
static int copy_media(const nebel_fog *fog, nb_medium_selection of, nebel_snapshot *s)
{
    s->media = nb_allocate_zero(&s->allocator, fog->slot_count, sizeof *s->media);
    if (s->media == NULL) return 0;
    for (size_t i = 0; i < fog->slot_count; i++) {
        const nb_fog_slot *slot = &fog->slots[i];
        if (!slot->used || !has_body(&slot->volume) || (of.is_level && !is_level(&slot->volume))) continue;
        nb_medium *medium = &s->media[s->medium_count];
        if (!nb_volume_copy(&s->allocator, &slot->volume, &medium->body)) return 0;
        medium->slot = i;
        s->medium_count++;
        find_moments(medium);
        if (of.is_scaled) scale_medium(medium);
        light_medium(medium, fog);
        s->is_sunlit = s->is_sunlit || medium->is_sunlit;
        s->covering_count += nb_volume_covers(&medium->body) ? 1 : 0;
        s->is_lamplit = s->is_lamplit || medium->is_lamplit;
        s->has_parts = s->has_parts || nb_volume_covers(&medium->body) || medium->body.leaf_count > 1;
        for (int c = 0; c < 3; c++) s->largest_radiance = fmax(s->largest_radiance, medium->radiance[c]);
    }
    return 1;
}

/* 0 when memory is out. */
static int copy_lamps(const nebel_fog *fog, nebel_snapshot *s)
{
    s->lamp_count = fog->lamp_count;
    if (s->lamp_count == 0) return 1;
    s->lamps = nb_allocate(&s->allocator, s->lamp_count, sizeof *s->lamps);
    if (s->lamps != NULL) memcpy(s->lamps, fog->lamps, s->lamp_count * sizeof *s->lamps);
    return s->lamps != NULL;
}

static const nb_environment_light *find_skylight(const nebel_snapshot *s, const nb_phase *phase)
{
    for (size_t i = 0; i < s->skylight_count; i++)
        if (nb_phase_compare(nb_environment_filter_phase(s->skylights[i].filter), phase) == 0) return &s->skylights[i];
    return NULL;
}

static nebel_result add_skylight(nebel_snapshot *s, nb_medium *medium)
{
    if (s->skylight_count == NEBEL_MAX_ENVIRONMENT_PHASES)
        return nb_fail(&s->log, NEBEL_ERROR_LIMIT, "environment: more than %d phase functions scatter it",
                       NEBEL_MAX_ENVIRONMENT_PHASES);
    nb_environment_filter *filter = nb_environment_filter_make(&s->allocator, &s->sky, &medium->body.phase);
    if (filter == NULL) return NEBEL_ERROR_MEMORY;
    s->skylights[s->skylight_count] = nb_skylight_of(&s->sky, filter);
    medium->sky = &s->skylights[s->skylight_count++];
    return NEBEL_OK;
}

/* Media of one phase function share what it makes of the sky. */
static nebel_result light_from_sky(const nebel_fog *fog, nebel_snapshot *s)
{
    nebel_result result = NEBEL_OK;
    s->sky = fog->sky;
    (void)nebel_retain_environment_map(s->sky.map);
    if (s->sky.type == NEBEL_ENVIRONMENT_CONSTANT) return NEBEL_OK;
    s->skylights = nb_allocate(&s->allocator, NEBEL_MAX_ENVIRONMENT_PHASES, sizeof *s->skylights);
    if (s->skylights == NULL) return NEBEL_ERROR_MEMORY;
    for (size_t i = 0; i < s->medium_count && result == NEBEL_OK; i++) {
        nb_medium *medium = &s->media[i];
        if (!medium->body.lit) continue;
        medium->sky = find_skylight(s, &medium->body.phase);
        if (medium->sky == NULL) result = add_skylight(s, medium);
    }
    return result;
}

static int is_bounded(const nb_volume *volume)
{
    for (int i = 0; i < 3; i++)
        if (!isfinite(volume->low[i]) || !isfinite(volume->high[i])) return 0;
    return 1;
}

static nebel_result index_media(nebel_snapshot *s)
{
    s->endless = nb_allocate(&s->allocator, s->medium_count, sizeof *s->endless);
    s->bounded = nb_allocate(&s->allocator, s->medium_count, sizeof *s->bounded);
    nb_aabb *boxes = nb_allocate(&s->allocator, s->medium_count, sizeof *boxes);
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (s->endless != NULL && s->bounded != NULL && boxes != NULL) {
        for (size_t i = 0; i < s->medium_count; i++) {
            const nb_volume *body = &s->media[i].body;
            if (!is_bounded(body)) {
                s->endless[s->endless_count++] = (uint32_t)i;
                continue;
            }
            memcpy(boxes[s->bounded_count].low, body->low, sizeof body->low);
            memcpy(boxes[s->bounded_count].high, body->high, sizeof body->high);
            s->bounded[s->bounded_count++] = (uint32_t)i;
        }
        result = nb_bvh_build(&s->allocator, boxes, s->bounded_count, &s->bvh);
    }
    nb_release(&s->allocator, boxes);
    return result;
}

/* Adding +0 makes every zero positive, as the march does with directions of its own. */
static void point_to_sun(nebel_snapshot *s, const nebel_sun *sun)
{
    const double *d = sun->direction;
    const double size = fmax(fmax(fabs(d[0]), fabs(d[1])), fabs(d[2]));
    if (!(size > 0)) return;
    const double x = d[0] / size, y = d[1] / size, z = d[2] / size, length = sqrt(x * x + y * y + z * z);
    s->to_sun[0] = x / length + 0;
    s->to_sun[1] = y / length + 0;
    s->to_sun[2] = z / length + 0;
    memcpy(s->irradiance, sun->irradiance, sizeof s->irradiance);
}

static int is_gray(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++) {
        const double *extinction = s->media[i].body.extinction;
        if (extinction[0] != extinction[1] || extinction[1] != extinction[2]) return 0;
    }
    return 1;
}

/* More bodies with flat faces than these have so many turns that steps are better adaptive. */
#define MOST_FLAT 8

static int is_flat(const nb_volume *body)
{
    const nb_leaf *leaf = &body->leaves[0];
    return leaf->type == NB_LEAF_WORLD || leaf->type == NB_LEAF_BOX ||
           (leaf->type == NB_LEAF_PLANES && leaf->face_count <= NB_MAX_EDGED_FACES);
}

/* Whether all media are convex bodies of constant density that add. */
static int is_added(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++) {
        const nb_volume *body = &s->media[i].body;
        if (nb_volume_covers(body) || body->leaf_count != 1 || body->density.type != NEBEL_DENSITY_CONSTANT) return 0;
    }
    return 1;
}

/* Fewer media than these are better asked from turn to turn. */
#define LEAST_LIT_CROWD 9

/* Whether depths of the body are a sum over others and it, and have a closed form whose ends slack moves by no more than
 * itself. */
static int adds_depth(const nb_volume *body)
{
    const nebel_density *density = &body->density;
    const int grows = density->type == NEBEL_DENSITY_HEIGHT && density->below == NEBEL_BELOW_GROW;
    if (density->type == NEBEL_DENSITY_GRID || density->type == NEBEL_DENSITY_ALTITUDE) return 0;
    return !nb_volume_covers(body) && body->leaf_count == 1 && (!grows || body->leaves[0].type == NB_LEAF_WORLD);
}

/* What lamps light has one phase function, which is a part of what is seen from places. */
static int is_lit_crowd(const nebel_snapshot *s)
{
    const nb_phase *phase = NULL;
    if (s->medium_count < LEAST_LIT_CROWD || !(s->is_sunlit || s->is_lamplit)) return 0;
    for (size_t i = 0; i < s->medium_count; i++) {
        const nb_volume *body = &s->media[i].body;
        if (!adds_depth(body)) return 0;
        if (!s->media[i].is_lamplit) continue;
        if (phase != NULL && nb_phase_compare(phase, &body->phase) != 0) return 0;
        phase = &body->phase;
    }
    return 1;
}

static int are_flat(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++)
        if (!is_flat(&s->media[i].body)) return 0;
    return 1;
}

static nb_sun_depth_method find_way_to_sun(const nebel_snapshot *s)
{
    if (!s->is_sunlit) return NB_SUN_DEPTH_MARCHED;
    if (s->is_added) return s->medium_count <= MOST_FLAT && are_flat(s) ? NB_SUN_DEPTH_FLAT : NB_SUN_DEPTH_ADDED;
    const nb_volume *body = &s->media[0].body;
    if (s->medium_count != 1 || nb_volume_covers(body) || body->leaf_count != 1) return NB_SUN_DEPTH_MARCHED;
    if (body->density.type == NEBEL_DENSITY_GRID) return NB_SUN_DEPTH_GRID;
    if (body->leaves[0].type != NB_LEAF_WORLD) return NB_SUN_DEPTH_MARCHED;
    if (body->density.type == NEBEL_DENSITY_ALTITUDE) return NB_SUN_DEPTH_ALTITUDE;
    const int is_height = body->density.type == NEBEL_DENSITY_HEIGHT && body->density.below == NEBEL_BELOW_GROW;
    return is_height && s->to_sun[1] > 0 ? NB_SUN_DEPTH_HEIGHT : NB_SUN_DEPTH_MARCHED;
}

/* ---- lattices -------------------------------------------------------------------------------- */

void nb_way_in_cells(const nebel_snapshot *s, const nb_volume *body, double way[3])
{
    const nb_leaf *leaf = &body->leaves[0];
    double rate[3];
    nb_grid_rate(body->density.grid, leaf->low, leaf->high, rate);
    for (int i = 0; i < 3; i++) {
        const double *row = &leaf->matrix[3 * i];
        const double turned = row[0] * s->to_sun[0] + row[1] * s->to_sun[1] + row[2] * s->to_sun[2];
        way[i] = rate[i] * (leaf->aligned ? s->to_sun[i] : turned);
    }
}

static int needs_lattice(const nebel_snapshot *s)
{
    return s->way_to_sun == NB_SUN_DEPTH_GRID && nb_grid_is_linear(s->media[0].body.density.grid);
}

/* Two columns per cell where they come to no more than 64 MiB. */
static const nb_sun_lattice_limit lattice_limit = {2, (size_t)1 << 25, 1};

/* The one of the commit before where it still serves. 0 when memory is out. */
static int take_lattice(const nebel_fog *fog, const nebel_snapshot *s, nb_medium *medium)
{
    nb_fog_slot *slot = &fog->slots[medium->slot];
    nebel_grid *grid = medium->body.density.grid;
    double way[3];
    nb_way_in_cells(s, &medium->body, way);
    if (slot->lattice == NULL || !nb_sun_lattice_is_of(slot->lattice, grid, way)) {
        nb_sun_lattice_release(slot->lattice);
        slot->lattice = nb_sun_lattice_make(grid, &s->allocator, way, lattice_limit);
    }
    medium->lattice = nb_sun_lattice_retain(slot->lattice);
    return medium->lattice != NULL;
}

static int take_lattices(const nebel_fog *fog, nebel_snapshot *s)
{
    return !needs_lattice(s) || take_lattice(fog, s, &s->media[0]);
}

static nebel_result make_snapshot(const nebel_fog *fog, nb_medium_selection of, nebel_snapshot **snapshot)
{
    nebel_snapshot *s = nb_allocate_zero(&fog->allocator, 1, sizeof *s);
    *snapshot = NULL;
    if (s == NULL) return NEBEL_ERROR_MEMORY;
    s->allocator = fog->allocator;
    s->log = fog->log;
    s->max_opacity = fog->max_opacity > 0 ? fog->max_opacity : 1;
    s->diffusing = fog->diffusion;
    atomic_init(&s->owners, 1);
    point_to_sun(s, &fog->sun);
    const int is_whole = !of.is_scaled && !of.is_level; /* of others nobody asks the light */
    nebel_result result = copy_media(fog, of, s) && copy_lamps(fog, s) ? NEBEL_OK : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK && is_whole) result = light_from_sky(fog, s);
    if (result == NEBEL_OK) {
        qsort(s->media, s->medium_count, sizeof *s->media, compare_media);
        join_media(s);
        s->is_gray = is_gray(s);
        s->is_added = is_added(s);
        s->way_to_sun = find_way_to_sun(s);
        s->is_lit_crowd = is_lit_crowd(s);
        result = take_lattices(fog, s) ? index_media(s) : NEBEL_ERROR_MEMORY;
    }
    if (result == NEBEL_OK)
        *snapshot = s;
    else
        free_snapshot(s);
    return result;
}

/* Looks that no light has. */
static nebel_result refuse_looks(const nebel_fog *fog, const nebel_snapshot *s)
{
    if (s->max_opacity < 1)
        return nb_fail(&fog->log, NEBEL_ERROR_UNSUPPORTED,
                       "max_opacity is no physical fog, and diffusion (multiple scattering) cannot compute its light; "
                       "leave out max_opacity %g, or diffusion",
                       s->max_opacity);
    for (size_t i = 0; i < s->medium_count; i++)
        if (nb_volume_has_distances(&s->media[i].body))
            return nb_fail(&fog->log, NEBEL_ERROR_UNSUPPORTED,
                           "fog[%zu].start, cutoff: are no physical fog, and diffusion (multiple scattering) cannot "
                           "compute its light; leave out both, or diffusion",
                           s->media[i].slot);
    return NEBEL_OK;
}

static nebel_result diffuse_selected(const nebel_fog *fog, const nebel_snapshot *s, int level, int is_own,
                                     nb_diffusion **made)
{
    nebel_snapshot *scaled = NULL;
    nebel_result result = make_snapshot(fog, (nb_medium_selection){.is_scaled = 1, .is_level = level}, &scaled);
    if (result == NEBEL_OK) result = nb_diffusion_make(fog, s, scaled, is_own, made);
    nebel_release_snapshot(scaled);
    return result;
}

static nebel_result diffuse_level(const nebel_fog *fog, nb_diffusion **made)
{
    nebel_snapshot *level = NULL;
    nebel_result result = make_snapshot(fog, (nb_medium_selection){.is_level = 1}, &level);
    if (result == NEBEL_OK) result = diffuse_selected(fog, level, 1, 0, made);
    nebel_release_snapshot(level);
    return result;
}

static nebel_result diffuse(const nebel_fog *fog, nebel_snapshot *s)
{
    const int has_sun = s->is_sunlit || nb_environment_is_dimmed(fog, s), has_own = nb_find_own_light(s).has;
    nebel_result result = has_sun || has_own ? refuse_looks(fog, s) : NEBEL_OK;
    if (result == NEBEL_OK && has_own) result = diffuse_selected(fog, s, 0, 1, &s->own_diffusion);
    if (result == NEBEL_OK && has_sun) result = diffuse_selected(fog, s, 0, 0, &s->diffusion);
    if (result != NEBEL_OK || s->diffusion == NULL || !nb_diffusion_lattice_has_bodies(&s->diffusion->lattice))
        return result;
    return diffuse_level(fog, &s->diffusion->beside);
}

nebel_result nebel_commit_fog(nebel_fog *fog, nebel_snapshot **snapshot)
{
    if (snapshot != NULL) *snapshot = NULL;
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    if (snapshot == NULL)
        return nb_fail(&fog->log, NEBEL_ERROR_ARGUMENT, "snapshot: the place for it must not be NULL");
    nebel_snapshot *s;
    nebel_result result = make_snapshot(fog, (nb_medium_selection){0}, &s);
    if (result == NEBEL_OK && fog->diffusion.max_cells > 0) result = diffuse(fog, s);
    if (result == NEBEL_OK) {
        *snapshot = s;
        return NEBEL_OK;
    }
    nebel_release_snapshot(s);
    if (result == NEBEL_ERROR_UNSUPPORTED || result == NEBEL_ERROR_LIMIT) return result;
    return nb_fail(&fog->log, result, "snapshot: out of memory for %zu volumes", fog->slot_count);
}

nebel_snapshot *nebel_retain_snapshot(nebel_snapshot *snapshot)
{
    if (snapshot != NULL) atomic_fetch_add_explicit(&snapshot->owners, 1, memory_order_relaxed);
    return snapshot;
}

void nebel_release_snapshot(nebel_snapshot *snapshot)
{
    if (snapshot == NULL) return;
    if (atomic_fetch_sub_explicit(&snapshot->owners, 1, memory_order_acq_rel) == 1) free_snapshot(snapshot);
}

size_t nebel_get_volume_count(const nebel_snapshot *snapshot)
{
    if (snapshot == NULL) return 0;
    return snapshot->medium_count;
}

int nebel_snapshot_sunlit_fog(const nebel_snapshot *snapshot, nebel_sunlit_fog *fog)
{
    if (snapshot == NULL || fog == NULL || !snapshot->is_sunlit) return 0;
    for (int c = 0; c < 3; c++) {
        fog->direction[c] = snapshot->to_sun[c];
        fog->min[c] = HUGE_VAL;
        fog->max[c] = -HUGE_VAL;
        for (size_t i = 0; i < snapshot->medium_count; i++) {
            if (!snapshot->media[i].is_sunlit) continue;
            fog->min[c] = fmin(fog->min[c], snapshot->media[i].body.low[c]);
            fog->max[c] = fmax(fog->max[c], snapshot->media[i].body.high[c]);
        }
    }
    return 1;
}

int nebel_snapshot_lamplit_fog(const nebel_snapshot *snapshot, double min[3], double max[3])
{
    if (snapshot == NULL || min == NULL || max == NULL || !snapshot->is_lamplit) return 0;
    for (int c = 0; c < 3; c++) {
        min[c] = HUGE_VAL;
        max[c] = -HUGE_VAL;
        for (size_t i = 0; i < snapshot->medium_count; i++) {
            if (!snapshot->media[i].is_lamplit) continue;
            min[c] = fmin(min[c], snapshot->media[i].body.low[c]);
            max[c] = fmax(max[c], snapshot->media[i].body.high[c]);
        }
    }
    return 1;
}

size_t nebel_snapshot_lamp_count(const nebel_snapshot *snapshot)
{
    if (snapshot == NULL) return 0;
    return snapshot->lamp_count;
}

void nebel_snapshot_lamp(const nebel_snapshot *snapshot, size_t number, double position[3], double *radius)
{
    if (snapshot == NULL || number >= snapshot->lamp_count || position == NULL || radius == NULL) return;
    const nb_light *lamp = &snapshot->lamps[number];
    for (int c = 0; c < 3; c++) position[c] = lamp->place[c];
    *radius = lamp->clear;
}
