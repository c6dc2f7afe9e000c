#include "sheet.h"

#include <math.h>
#include <stdlib.h>

static const float far_away = 1e18f;

/* ---- rays ------------------------------------------------------------------------------------ */

/* Never 0, so that nothing is divided into NaN. */
NB_ALWAYS_INLINE float reciprocal(float x)
{
    const float size = x < 0 ? -x : x;
    const float least = x < 0 ? -1e-30f : 1e-30f;
    return 1 / (size < 1e-30f ? least : x);
}

/* What of each ray is within the box. */
NB_CLONES static void clip(const nb_lit_box *box, const nb_rays *rays, double advance, const float *distance,
                           float *restrict from, float *restrict to)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float skipped = (float)(advance * (double)rays->length[i]);
        float first = -skipped, last = distance[i] - skipped;
        last = last < far_away ? last : far_away;
        for (int c = 0; c < 3; c++) {
            const float inverse = reciprocal(rays->unit[c][i]);
            const float a = (box->low[c] - rays->start[c][i]) * inverse;
            const float b = (box->high[c] - rays->start[c][i]) * inverse;
            const float near = a < b ? a : b, far = a < b ? b : a;
            first = near > first ? near : first;
            last = far < last ? far : last;
        }
        from[i] = first;
        to[i] = last;
    }
}

void nb_shafts_clip(const nb_lit_box *box, const nb_rays *rays, double advance, const float *distance, float *from,
                    float *to)
{
    clip(box, rays, advance, distance, from, to);
}

NB_CLONES static void turn(const nb_shadow_tree *tree, const nb_rays *rays, int first, nb_shaft_rays *packet)
{
    for (int a = 0; a < 3; a++) {
        const float x = tree->axes[a][0], y = tree->axes[a][1], z = tree->axes[a][2];
        NB_SIMD
        for (int i = 0; i < NB_PACKET; i++) {
            const int k = first + i;
            const float way = x * rays->unit[0][k] + y * rays->unit[1][k] + z * rays->unit[2][k];
            packet->start[a][i] = x * rays->start[0][k] + y * rays->start[1][k] + z * rays->start[2][k];
            packet->way[a][i] = way;
            packet->inverse[a][i] = reciprocal(way);
        }
    }
}

/* ---- shadows --------------------------------------------------------------------------------- */

static int touch(float enter, float leave, float other_enter, float other_leave)
{
    const float gap = nb_closeness * fabsf(fminf(leave, other_leave));
    return (enter <= other_leave + gap) & (leave >= other_enter - gap);
}

int nb_shafts_keep(nb_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, nb_shaft_rays *rays)
{
    const float enter = rays->enter[lane], leave = rays->leave[lane];
    if (!(enter <= leave)) return 1;
    nb_shadow *before = rays->kept[lane] > 0 ? &shafts->shadows[rays->kept[lane] - 1] : NULL;
    if (before != NULL && touch(enter, leave, before->enter, before->leave)) {
        before->enter = fminf(enter, before->enter);
        before->leave = fmaxf(leave, before->leave);
        return 1;
    }
    if (shafts->shadow_count == shafts->shadow_capacity) {
        void *shadows = shafts->shadows;
        if (!nb_grow(allocator, &shadows, sizeof *shafts->shadows, shafts->shadow_count, &shafts->shadow_capacity,
                     shafts->shadow_count + 1))
            return 0;
        shafts->shadows = shadows;
    }
    shafts->shadows[shafts->shadow_count++] = (nb_shadow){lane, enter, leave};
    rays->kept[lane] = shafts->shadow_count;
    return 1;
}

/* Whether any ray may meet a shadow of this child where it is not known to be in shadow. */
NB_ALWAYS_INLINE int enters(const nb_shadow_node *node, int child, const nb_shaft_rays *rays)
{
    const float low_x = node->low[0][child], high_x = node->high[0][child];
    const float low_y = node->low[1][child], high_y = node->high[1][child], first = node->low[2][child];
    int some[NB_PACKET], any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float x = rays->start[0][i], y = rays->start[1][i], z = rays->start[2][i];
        const float ix = rays->inverse[0][i], iy = rays->inverse[1][i], iz = rays->inverse[2][i];
        const float ax = (low_x - x) * ix, bx = (high_x - x) * ix, ay = (low_y - y) * iy, by = (high_y - y) * iy;
        const float az = (first - z) * iz;
        float enter = rays->from[i], leave = rays->to[i];
        const float near_x = ax < bx ? ax : bx, far_x = ax < bx ? bx : ax;
        const float near_y = ay < by ? ay : by, far_y = ay < by ? by : ay;
        const float near_z = iz > 0 ? az : -INFINITY, far_z = iz > 0 ? INFINITY : az;
        enter = near_x > enter ? near_x : enter;
        enter = near_y > enter ? near_y : enter;
        enter = near_z > enter ? near_z : enter;
        leave = far_x < leave ? far_x : leave;
        leave = far_y < leave ? far_y : leave;
        leave = far_z < leave ? far_z : leave;
        some[i] = (enter < leave) & ((enter < rays->enter[i]) | (leave > rays->leave[i]));
    }
    for (int i = 0; i < NB_PACKET; i++) any |= some[i];
    return any;
}

typedef struct nb_visit {
    int level;
    size_t number; /* of the node; at level -1 of the leaf */
} nb_visit;

enum { VISITS = NB_SHADOW_LEVELS * NB_SHADOW_FAN };

NB_ALWAYS_INLINE int visit_leaf(nb_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                                size_t number, nb_shaft_rays *rays)
{
    const size_t first = number * NB_SHADOW_FAN, left = tree->count - first;
    const size_t count = left < NB_SHADOW_FAN ? left : NB_SHADOW_FAN;
    for (size_t i = 0; i < count; i++) {
        nb_stretch found;
        int fresh[NB_PACKET];
        nb_cross_prism(&tree->prisms[first + i], rays, &found);
        const nb_sheet *sheet = nb_shadow_tree_sheet(tree, first + i);
        if (sheet != NULL) {
            if (!nb_sheet_cast(sheet, NULL, shafts, allocator, &found, rays)) return 0;
            continue;
        }
        if (nb_extend(&found, rays, fresh) && !nb_replace(shafts, allocator, &found, fresh, rays)) return 0;
    }
    return 1;
}

/* The children that the rays enter, the farthest along them first, as the middle of the packet goes: what is found next
 * mostly touches what was found last. Returns how many. */
NB_ALWAYS_INLINE int list_children(const nb_shadow_node *node, const nb_visit *visit, const nb_shaft_rays *rays,
                                   nb_visit *children)
{
    const float x = rays->way[0][NB_PACKET / 2 + 1], y = rays->way[1][NB_PACKET / 2 + 1];
    float ways[NB_SHADOW_FAN];
    int count = 0;
    for (int k = 0; k < NB_SHADOW_FAN; k++) {
        if (!enters(node, k, rays)) continue;
        const float way = x * (node->low[0][k] + node->high[0][k]) + y * (node->low[1][k] + node->high[1][k]);
        int i = count++;
        for (; i > 0 && ways[i - 1] < way; i--) {
            ways[i] = ways[i - 1];
            children[i] = children[i - 1];
        }
        ways[i] = way;
        children[i] = (nb_visit){visit->level - 1, visit->number * NB_SHADOW_FAN + (size_t)k};
    }
    return count;
}

/* Returns 0 when memory is out. */
NB_CLONES static int walk(nb_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                          nb_shaft_rays *rays)
{
    nb_visit visits[VISITS];
    int count = 1;
    visits[0] = (nb_visit){tree->level_count - 1, 0};
    while (count > 0) {
        const nb_visit visit = visits[--count];
        if (visit.level >= 0)
            count += list_children(&tree->levels[visit.level][visit.number], &visit, rays, visits + count);
        else if (!visit_leaf(shafts, allocator, tree, visit.number, rays))
            return 0;
    }
    return 1;
}

/* ---- toggles --------------------------------------------------------------------------------- */

static int compare_shadows(const void *a, const void *b)
{
    const nb_shadow *x = a, *y = b;
    return (x->enter > y->enter) - (x->enter < y->enter);
}

/* Of one lane: few are sorted in place. */
static void sort_shadows(nb_shadow *shadows, size_t count)
{
    enum { FEW = 128 };
    if (count > FEW) {
        qsort(shadows, count, sizeof *shadows, compare_shadows);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        const nb_shadow moved = shadows[i];
        size_t k = i;
        for (; k > 0 && shadows[k - 1].enter > moved.enter; k--) shadows[k] = shadows[k - 1];
        shadows[k] = moved;
    }
}

/* Writes the shadows in `sorted`, lane after lane; ends[i] is where those of lane i end. */
static void sort_by_lane(nb_shafts *shafts, size_t ends[NB_PACKET])
{
    size_t places[NB_PACKET + 1] = {0};
    for (size_t i = 0; i < shafts->shadow_count; i++) places[shafts->shadows[i].lane + 1]++;
    for (size_t i = 0; i < NB_PACKET; i++) places[i + 1] += places[i];
    for (size_t i = 0; i < NB_PACKET; i++) ends[i] = places[i];
    for (size_t i = 0; i < shafts->shadow_count; i++)
        shafts->sorted[ends[shafts->shadows[i].lane]++] = shafts->shadows[i];
    for (size_t i = 0; i < NB_PACKET; i++) sort_shadows(shafts->sorted + places[i], ends[i] - places[i]);
}

/* From where fog begins to count, in which a shadow that begins with it begins at 0. */
static void toggle(nb_shafts *shafts, float t)
{
    shafts->toggles[shafts->toggle_count++] = fmaxf(t, 0);
}

/* The shadows of one lane, sorted, as toggles. */
static void join(nb_shafts *shafts, const nb_shadow *shadows, size_t count, float skipped)
{
    float enter = shadows[0].enter, leave = shadows[0].leave;
    for (size_t i = 1; i < count; i++) {
        if (shadows[i].enter > leave + nb_closeness * fabsf(leave)) {
            toggle(shafts, enter + skipped);
            toggle(shafts, leave + skipped);
            enter = shadows[i].enter;
            leave = shadows[i].leave;
        }
        leave = fmaxf(leave, shadows[i].leave);
    }
    toggle(shafts, enter + skipped);
    toggle(shafts, leave + skipped);
}

static int make_room(nb_shafts *shafts, const nebel_allocator *allocator)
{
    void *toggles = shafts->toggles, *sorted = shafts->sorted;
    const int grown =
        nb_grow(allocator, &toggles, sizeof *shafts->toggles, shafts->toggle_count, &shafts->toggle_capacity,
                shafts->toggle_count + 2 * shafts->shadow_count) &&
        nb_grow(allocator, &sorted, sizeof *shafts->sorted, 0, &shafts->sorted_capacity, shafts->shadow_count);
    shafts->toggles = toggles;
    shafts->sorted = sorted;
    return grown;
}

int nb_shafts_finish(nb_shafts *shafts, const nebel_allocator *allocator, nb_shaft_rays *rays, const float *length,
                     double advance, uint32_t *first)
{
    for (uint32_t i = 0; i < NB_PACKET; i++)
        if (!nb_shafts_keep(shafts, allocator, i, rays)) return 0;
    size_t ends[NB_PACKET], begin = 0;
    if (shafts->shadow_count > 0 && !make_room(shafts, allocator)) return 0;
    if (shafts->shadow_count > 0) sort_by_lane(shafts, ends);
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        first[i] = (uint32_t)shafts->toggle_count;
        if (shafts->shadow_count == 0 || ends[i] == begin) continue;
        join(shafts, shafts->sorted + begin, ends[i] - begin, (float)(advance * (double)length[i]));
        begin = ends[i];
    }
    return 1;
}

static int find_packet(nb_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                       const nb_rays *rays, double advance, int first, nb_shaft_rays *packet)
{
    for (int i = 0; i < NB_PACKET; i++) {
        packet->enter[i] = INFINITY;
        packet->leave[i] = -INFINITY;
        packet->kept[i] = 0;
    }
    turn(tree, rays, first, packet);
    shafts->shadow_count = 0;
    return walk(shafts, allocator, tree, packet) &&
           nb_shafts_finish(shafts, allocator, packet, rays->length + first, advance, shafts->first + first);
}

nebel_result nb_shafts_find(nb_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                            const nb_lit_box *box, const nb_rays *rays, double advance, const float *distance)
{
    float from[NB_BATCH], to[NB_BATCH];
    clip(box, rays, advance, distance, from, to);
    shafts->toggle_count = 0;
    for (int p = 0; p < NB_BATCH; p += NB_PACKET) {
        for (int i = 0; i < NB_PACKET; i++) shafts->first[p + i] = (uint32_t)shafts->toggle_count;
        if (tree->count == 0 || nb_is_empty(from + p, to + p)) continue;
        nb_shaft_rays packet;
        for (int i = 0; i < NB_PACKET; i++) {
            packet.from[i] = from[p + i];
            packet.to[i] = to[p + i];
        }
        if (!find_packet(shafts, allocator, tree, rays, advance, p, &packet)) return NEBEL_ERROR_MEMORY;
    }
    shafts->first[NB_BATCH] = (uint32_t)shafts->toggle_count;
    return NEBEL_OK;
}

void nb_shafts_free(nb_shafts *shafts, const nebel_allocator *allocator)
{
    nb_release(allocator, shafts->shadows);
    nb_release(allocator, shafts->sorted);
    nb_release(allocator, shafts->toggles);
}
