#include "snapshot.h"

#include "fog.h"
#include "medium/density.h"

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

static void find_moments(nb_medium *medium)
{
    const nb_volume *v = &medium->body;
    const double cosine = v->lit ? nebel_phase_mean_cosine(&v->described_phase) : 0;
    medium->ahead = cosine > 0 ? cosine * cosine : 0;
    medium->turned_cosine = cosine > 0 ? cosine / (1 + cosine) : cosine;
}

static const double most_grown = 1e18; /* no density is more, as formulas/profiles.inc has it */

static double peak_of(const nb_volume *v)
{
    const nebel_density *density = &v->density;
    const int grows = density->below == NEBEL_BELOW_GROW &&
                      (density->type == NEBEL_DENSITY_HEIGHT || density->type == NEBEL_DENSITY_ALTITUDE);
    if (!grows) return nb_density_peak(density);
    if (density->type == NEBEL_DENSITY_ALTITUDE || !isfinite(v->low[1])) return most_grown;
    return fmin(exp((density->base - v->low[1]) / density->scale_height), most_grown);
}

static void find_limits(nb_medium *medium)
{
    const nb_volume *v = &medium->body;
    for (int c = 0; c < 3; c++) {
        medium->densest = fmax(medium->densest, v->extinction[c]);
        medium->emits = medium->emits || v->emission[c] > 0;
    }
    medium->densest *= nb_density_peak(&v->density);
    medium->peak = peak_of(v);
    medium->proportion = proportion_of(v);
}

static void free_snapshot(nebel_snapshot *s)
{
    const nebel_allocator allocator = s->allocator;
    for (size_t i = 0; i < s->medium_count; i++) nb_volume_free(&allocator, &s->media[i].body);
    nb_bvh_free(&allocator, &s->bvh);
    nb_release(&allocator, s->media);
    nb_release(&allocator, s->unlit.media);
    nb_release(&allocator, s->endless);
    nb_release(&allocator, s->bounded);
    nb_release(&allocator, s);
}

static int has_body(const nb_volume *volume)
{
    for (int i = 0; i < 3; i++)
        if (!(volume->low[i] <= volume->high[i])) return 0;
    return 1;
}

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

/* Copies a volume that can touch a ray. 0 when memory is out. */
static int copy_medium(nebel_snapshot *s, nb_medium_selection of, const nb_volume *volume, size_t slot)
{
    if (!has_body(volume) || (of.is_level && !is_level(volume))) return 1;
    nb_medium *medium = &s->media[s->medium_count];
    if (!nb_volume_copy(&s->allocator, volume, &medium->body)) return 0;
    medium->slot = slot;
    s->medium_count++;
    find_moments(medium);
    if (of.is_scaled) scale_medium(medium);
    find_limits(medium);
    s->covering_count += nb_volume_covers(&medium->body) ? 1 : 0;
    s->has_parts = s->has_parts || nb_volume_covers(&medium->body) || medium->body.leaf_count > 1;
    return 1;
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

static int is_gray(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++) {
        const double *extinction = s->media[i].body.extinction;
        if (extinction[0] != extinction[1] || extinction[1] != extinction[2]) return 0;
    }
    return 1;
}

/* Growing fog is no denser at its ends than this, else slack there is better had from the density there. */
#define MAX_GROWN 1e3

int nb_medium_adds_depth(const nb_medium *medium)
{
    const nb_volume *body = &medium->body;
    const nebel_density *density = &body->density;
    if (density->type == NEBEL_DENSITY_GRID || density->type == NEBEL_DENSITY_ALTITUDE) return 0;
    return !nb_volume_covers(body) && body->leaf_count == 1 &&
           (medium->peak <= MAX_GROWN || body->leaves[0].type == NB_LEAF_WORLD);
}

static int adds_depths(const nebel_snapshot *s)
{
    for (size_t i = 0; i < s->medium_count; i++) {
        const nb_volume *body = &s->media[i].body;
        const int is_grid = body->density.type == NEBEL_DENSITY_GRID && !nb_volume_covers(body);
        if (!is_grid && !nb_medium_adds_depth(&s->media[i])) return 0;
    }
    return 1;
}

static nebel_snapshot *open_snapshot(const nebel_allocator *allocator, const nebel_log *log, double max_opacity,
                                     size_t capacity)
{
    nebel_snapshot *s = nb_allocate_zero(allocator, 1, sizeof *s);
    if (s == NULL) return NULL;
    s->allocator = *allocator;
    s->log = *log;
    s->max_opacity = max_opacity;
    s->unlit.snapshot = s;
    s->unlit.allocator = *allocator;
    s->unlit.log = *log;
    atomic_init(&s->owners, 1);
    s->media = nb_allocate_zero(allocator, capacity, sizeof *s->media);
    return s;
}

static nebel_result finish_snapshot(nebel_snapshot *s)
{
    static const double dark[3] = {0, 0, 0};
    qsort(s->media, s->medium_count, sizeof *s->media, compare_media);
    s->is_gray = is_gray(s);
    s->adds_depths = adds_depths(s);
    s->unlit.media = nb_allocate_zero(&s->allocator, s->medium_count, sizeof *s->unlit.media);
    if (s->unlit.media == NULL) return NEBEL_ERROR_MEMORY;
    nb_light_media(&s->unlit, dark, dark);
    nb_join_media(&s->unlit);
    return index_media(s);
}

static nebel_result close_snapshot(nebel_snapshot *s, int all_copied, nebel_snapshot **snapshot)
{
    const nebel_result result = all_copied ? finish_snapshot(s) : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK)
        *snapshot = s;
    else
        free_snapshot(s);
    return result;
}

nebel_result nb_snapshot_select(const nebel_snapshot *from, nb_medium_selection of, nebel_snapshot **made)
{
    nebel_snapshot *s = open_snapshot(&from->allocator, &from->log, from->max_opacity, from->medium_count);
    *made = NULL;
    if (s == NULL) return NEBEL_ERROR_MEMORY;
    int all = s->media != NULL;
    for (size_t i = 0; i < from->medium_count && all; i++)
        all = copy_medium(s, of, &from->media[i].body, from->media[i].slot);
    return close_snapshot(s, all, made);
}

nebel_result nebel_commit_fog(nebel_fog *fog, nebel_snapshot **snapshot)
{
    if (snapshot != NULL) *snapshot = NULL;
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    if (snapshot == NULL)
        return nb_fail(&fog->log, NEBEL_ERROR_ARGUMENT, "snapshot: the place for it must not be NULL");
    nebel_snapshot *s =
        open_snapshot(&fog->allocator, &fog->log, fog->max_opacity > 0 ? fog->max_opacity : 1, fog->slot_count);
    int all = s != NULL && s->media != NULL;
    for (size_t i = 0; i < fog->slot_count && all; i++)
        if (fog->slots[i].used) all = copy_medium(s, (nb_medium_selection){0}, &fog->slots[i].volume, i);
    const nebel_result result = s != NULL ? close_snapshot(s, all, snapshot) : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK) return NEBEL_OK;
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

double nebel_get_max_opacity(const nebel_snapshot *snapshot)
{
    return snapshot != NULL ? snapshot->max_opacity : 1;
}

size_t nebel_get_volume_count(const nebel_snapshot *snapshot)
{
    if (snapshot == NULL) return 0;
    return snapshot->medium_count;
}

/* ---- where fog is ---------------------------------------------------------------------------- */

nebel_bounds nb_no_bounds(void)
{
    return (nebel_bounds){{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
}

void nb_bounds_add(nebel_bounds *bounds, const nb_volume *body)
{
    for (int c = 0; c < 3; c++) {
        bounds->min[c] = fmin(bounds->min[c], body->low[c]);
        bounds->max[c] = fmax(bounds->max[c], body->high[c]);
    }
}

/* Level fog without end bends with no ground. */
static int is_flat_for_ever(const nb_volume *body)
{
    return body->density.type != NEBEL_DENSITY_ALTITUDE && is_level(body);
}

int nebel_get_scattering_bounds(const nebel_snapshot *snapshot, uint32_t flags, nebel_bounds *bounds)
{
    nebel_bounds all = nb_no_bounds();
    if (snapshot == NULL || bounds == NULL) return 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        const double *albedo = body->albedo;
        if (!body->lit || !(albedo[0] > 0 || albedo[1] > 0 || albedo[2] > 0)) continue;
        if ((flags & NEBEL_BOUNDS_WITHOUT_LEVEL_FOG) == 0 || !is_flat_for_ever(body)) nb_bounds_add(&all, body);
    }
    if (all.min[0] > all.max[0]) return 0;
    *bounds = all;
    return 1;
}
