#include "lit_fog.h"

#include "lit_density.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* ---- which fog is where ---------------------------------------------------------------------- */

static int has_parts(const nebel_shape *s)
{
    return s->type == NEBEL_SHAPE_UNION || s->type == NEBEL_SHAPE_INTERSECTION;
}

void lit_fog_prepare(const lit_scene *scene, lit_fog *fog)
{
    fog->scene = scene;
    fog->leaf_count = 0;
    fog->is_sum = 1;
    assert(scene->volume_count <= LIT_MAX_VOLUMES);
    for (size_t i = 0; i < scene->volume_count; i++) {
        const nebel_volume_desc *v = &scene->volumes[i];
        fog->first_leaf[i] = fog->leaf_count;
        lit_list_leaves(&v->shape, fog->leaves, LIT_MAX_LEAVES, &fog->leaf_count);
        if (v->operation != NEBEL_OPERATION_ADD || has_parts(&v->shape)) fog->is_sum = 0;
    }
    fog->first_leaf[scene->volume_count] = fog->leaf_count;
}

static int is_in_shape(const nebel_shape *s, const lit_map *m, size_t *leaf, double t)
{
    if (!has_parts(s)) {
        const lit_span *at_leaf = &m->leaves[(*leaf)++];
        return at_leaf->enter <= t && t < at_leaf->leave;
    }
    int any = 0, all = 1;
    for (size_t i = 0; i < s->part_count; i++) {
        const int is_in = is_in_shape(&s->parts[i], m, leaf, t);
        any = any || is_in;
        all = all && is_in;
    }
    return s->type == NEBEL_SHAPE_UNION ? any : all;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* By insertion where they are few: most are, and in order. */
void lit_sort(double *numbers, size_t count)
{
    if (count > 40) {
        qsort(numbers, count, sizeof numbers[0], ascending);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        const double x = numbers[i];
        size_t k = i;
        for (; k > 0 && numbers[k - 1] > x; k--) numbers[k] = numbers[k - 1];
        numbers[k] = x;
    }
}

void lit_fog_map(const lit_fog *fog, const lit_line *l, double end, lit_map *m)
{
    m->event_count = m->active_count = 0;
    m->events[m->event_count++] = 0;
    for (size_t i = 0; i < fog->scene->volume_count; i++) {
        int is_met = 0;
        for (size_t k = fog->first_leaf[i]; k < fog->first_leaf[i + 1]; k++) {
            const lit_span s = m->leaves[k] = lit_in_leaf(&fog->leaves[k], l);
            if (!(s.enter < s.leave && s.leave > 0 && s.enter < end)) continue;
            if (s.enter > 0) m->events[m->event_count++] = s.enter;
            if (s.leave < end) m->events[m->event_count++] = s.leave;
            is_met = 1;
        }
        if (is_met) m->active[m->active_count++] = i;
    }
    m->events[m->event_count++] = end;
    lit_sort(m->events, m->event_count);
}

void lit_fog_mark(const lit_fog *fog, const lit_map *m, double t, lit_marks *marks)
{
    size_t in[LIT_MAX_VOLUMES], in_count = 0;
    marks->count = 0;
    for (size_t i = 0; i < m->active_count; i++) {
        size_t leaf = fog->first_leaf[m->active[i]];
        if (is_in_shape(&fog->scene->volumes[m->active[i]].shape, m, &leaf, t)) in[in_count++] = m->active[i];
    }
    for (size_t i = 0; i < in_count; i++) {
        const nebel_volume_desc *v = &fog->scene->volumes[in[i]];
        int is_there = v->operation != NEBEL_OPERATION_EXCLUDE;
        for (size_t k = 0; k < in_count && is_there; k++) {
            const nebel_volume_desc *other = &fog->scene->volumes[in[k]];
            if (other->operation == NEBEL_OPERATION_EXCLUDE && other->priority >= v->priority) is_there = 0;
            if (other->operation == NEBEL_OPERATION_REPLACE && other->priority > v->priority) is_there = 0;
        }
        if (is_there) marks->volumes[marks->count++] = in[i];
    }
}

/* ---- densities ------------------------------------------------------------------------------- */

double lit_fog_density(const lit_fog *fog, size_t volume, const lit_line *l, double t)
{
    const lit_medium medium = lit_medium_on(fog, volume, l);
    return lit_density_at(&medium, t);
}

double lit_fog_amount(const lit_fog *fog, size_t volume, const lit_line *l, double a, double b)
{
    if (fog->scene->volumes[volume].density.type == NEBEL_DENSITY_CONSTANT) return b - a;
    const lit_medium medium = lit_medium_on(fog, volume, l);
    return lit_density_amount(&medium, a, b);
}

void lit_fog_cut(const lit_fog *fog, size_t volume, const lit_line *l, double a, double b, lit_cuts *cuts)
{
    const lit_medium medium = lit_medium_on(fog, volume, l);
    lit_density_cut(&medium, a, b, cuts);
}

void lit_add_cut(lit_cuts *cuts, double t)
{
    if (cuts->count < LIT_MAX_CUTS && isfinite(t)) cuts->at[cuts->count++] = t;
}

/* ---- depths ---------------------------------------------------------------------------------- */

static void add_volume(const lit_fog *fog, size_t volume, const lit_line *l, double a, double b, double depth[3])
{
    const double *extinction = fog->scene->volumes[volume].extinction;
    const double amount = lit_fog_amount(fog, volume, l, a, b);
    for (int c = 0; c < 3; c++)
        if (extinction[c] > 0) depth[c] += extinction[c] * amount;
}

void lit_fog_add_depth(const lit_fog *fog, const lit_line *l, const lit_marks *marks, double a, double b,
                       double depth[3])
{
    for (size_t i = 0; i < marks->count; i++) add_volume(fog, marks->volumes[i], l, a, b, depth);
}

/* e^-800 is no double. */
static int is_opaque(const double depth[3])
{
    return depth[0] > 800 && depth[1] > 800 && depth[2] > 800;
}

static void sum_volumes(const lit_fog *fog, const lit_line *l, double end, double depth[3])
{
    for (size_t i = 0; i < fog->leaf_count && !is_opaque(depth); i++) {
        const lit_span s = lit_meet(lit_in_leaf(&fog->leaves[i], l), (lit_span){0, end});
        if (s.enter < s.leave) add_volume(fog, i, l, s.enter, fmin(s.leave, 1e18), depth);
    }
}

void lit_fog_depth(const lit_fog *fog, const lit_line *l, double end, double depth[3])
{
    static lit_map m;
    lit_marks marks;
    for (int c = 0; c < 3; c++) depth[c] = 0;
    if (fog->is_sum) {
        sum_volumes(fog, l, end, depth);
        return;
    }
    lit_fog_map(fog, l, end, &m);
    for (size_t i = 0; i + 1 < m.event_count && !is_opaque(depth); i++) {
        const double a = m.events[i], b = m.events[i + 1];
        if (!(b > a)) continue;
        lit_fog_mark(fog, &m, isfinite(b) ? 0.5 * (a + b) : 2 * fabs(a) + 1, &marks);
        lit_fog_add_depth(fog, l, &marks, a, fmin(b, 1e18), depth);
    }
}
