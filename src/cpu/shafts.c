#include "shafts.h"

#include <math.h>
#include <stdlib.h>

#define ALWAYS_INLINE static inline __attribute__((always_inline))

/* Shadows that are nearer to each other than this part of the way there are one: the triangles of a surface have
 * common edges, but their prisms meet to rounding only. */
static const float closeness = 0x1p-18f;

static const float far_away = 1e18f;

/* A packet of rays in the sun's frame. */
typedef struct nb_sun_rays {
    float start[3][NB_PACKET], way[3][NB_PACKET], inverse[3][NB_PACKET];
    float from[NB_PACKET], to[NB_PACKET];     /* what of them is in fog that the sun lights; from >= to: nothing */
    float enter[NB_PACKET], leave[NB_PACKET]; /* the shadow that was found last; enter > leave: none yet */
} nb_sun_rays;

/* ---- rays ------------------------------------------------------------------------------------ */

/* Never 0, so that nothing is divided into NaN. */
ALWAYS_INLINE float reciprocal(float x)
{
    const float size = x < 0 ? -x : x;
    const float least = x < 0 ? -1e-30f : 1e-30f;
    return 1 / (size < 1e-30f ? least : x);
}

/* What of each ray is within the box. */
NB_CLONES static void clip(const nb_sunlit_box *box, const nb_rays *rays, double advance, const float *distance,
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

NB_CLONES static void turn(const nb_sun_tree *tree, const nb_rays *rays, int first, nb_sun_rays *packet)
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

static int keep(nb_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, float enter, float leave)
{
    void *shadows = shafts->shadows;
    if (!nb_grow(allocator, &shadows, sizeof *shafts->shadows, shafts->shadow_count, &shafts->shadow_capacity,
                 shafts->shadow_count + 1))
        return 0;
    shafts->shadows = shadows;
    shafts->shadows[shafts->shadow_count++] = (nb_shadow){lane, enter, leave};
    return 1;
}

/* What a prism or a box leaves of each ray, and in which lanes that is anything. */
typedef struct nb_stretch {
    float enter[NB_PACKET], leave[NB_PACKET];
    int some[NB_PACKET];
} nb_stretch;

/* Shadows that touch the last one make it longer; others take its place. */
static int add_shadows(nb_shafts *shafts, const nebel_allocator *allocator, const nb_stretch *found, nb_sun_rays *rays)
{
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        if (!found->some[i]) continue;
        const float enter = found->enter[i], leave = found->leave[i], gap = closeness * fabsf(leave);
        if (enter <= rays->leave[i] + gap && leave >= rays->enter[i] - gap) {
            rays->enter[i] = fminf(enter, rays->enter[i]);
            rays->leave[i] = fmaxf(leave, rays->leave[i]);
            continue;
        }
        if (rays->enter[i] <= rays->leave[i] && !keep(shafts, allocator, i, rays->enter[i], rays->leave[i])) return 0;
        rays->enter[i] = enter;
        rays->leave[i] = leave;
    }
    return 1;
}

/* One side of a prism: where at + t rise >= 0. */
ALWAYS_INLINE void cut(float at, float rise, float *enter, float *leave)
{
    const float t = -at / rise;
    const float first = rise > 0 ? t : -INFINITY, level = at < 0 ? -INFINITY : INFINITY;
    const float last = rise < 0 ? t : rise > 0 ? INFINITY : level;
    *enter = first > *enter ? first : *enter;
    *leave = last < *leave ? last : *leave;
}

ALWAYS_INLINE int cross_prism(const nb_prism *prism, const nb_sun_rays *rays, nb_stretch *found)
{
    int any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float x = rays->start[0][i], y = rays->start[1][i], z = rays->start[2][i];
        const float dx = rays->way[0][i], dy = rays->way[1][i], dz = rays->way[2][i];
        const float *cap = prism->cap;
        float enter = rays->from[i], leave = rays->to[i];
        for (int k = 0; k < 3; k++) {
            const float *edge = prism->edge[k];
            cut(edge[0] * x + edge[1] * y + edge[2], edge[0] * dx + edge[1] * dy, &enter, &leave);
        }
        cut(cap[0] * x + cap[1] * y + cap[2] * z + cap[3], cap[0] * dx + cap[1] * dy + cap[2] * dz, &enter, &leave);
        found->enter[i] = enter;
        found->leave[i] = leave;
        found->some[i] = enter < leave;
    }
    for (int i = 0; i < NB_PACKET; i++) any |= found->some[i];
    return any;
}

/* Whether any ray may meet a shadow of this child where it is not known to be in shadow. */
ALWAYS_INLINE int enters(const nb_sun_node *node, int child, const nb_sun_rays *rays)
{
    const float low_x = node->low[0][child], high_x = node->high[0][child];
    const float low_y = node->low[1][child], high_y = node->high[1][child], first = node->first[child];
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

enum { VISITS = NB_SUN_LEVELS * NB_SUN_FAN };

ALWAYS_INLINE int visit_leaf(nb_shafts *shafts, const nebel_allocator *allocator, const nb_sun_tree *tree,
                             size_t number, nb_sun_rays *rays)
{
    const size_t first = number * NB_SUN_FAN, left = tree->prism_count - first;
    const size_t count = left < NB_SUN_FAN ? left : NB_SUN_FAN;
    for (size_t i = 0; i < count; i++) {
        nb_stretch found;
        if (cross_prism(&tree->prisms[first + i], rays, &found) && !add_shadows(shafts, allocator, &found, rays))
            return 0;
    }
    return 1;
}

/* Returns 0 when memory is out. */
NB_CLONES static int walk(nb_shafts *shafts, const nebel_allocator *allocator, const nb_sun_tree *tree,
                          nb_sun_rays *rays)
{
    nb_visit visits[VISITS];
    int count = 1;
    visits[0] = (nb_visit){tree->level_count - 1, 0};
    while (count > 0) {
        const nb_visit visit = visits[--count];
        if (visit.level < 0) {
            if (!visit_leaf(shafts, allocator, tree, visit.number, rays)) return 0;
            continue;
        }
        const nb_sun_node *node = &tree->levels[visit.level][visit.number];
        for (int k = 0; k < NB_SUN_FAN; k++)
            if (enters(node, k, rays))
                visits[count++] = (nb_visit){visit.level - 1, visit.number * NB_SUN_FAN + (size_t)k};
    }
    return 1;
}

/* ---- toggles --------------------------------------------------------------------------------- */

static int compare_shadows(const void *a, const void *b)
{
    const nb_shadow *x = a, *y = b;
    if (x->lane != y->lane) return x->lane < y->lane ? -1 : 1;
    return (x->enter > y->enter) - (x->enter < y->enter);
}

/* From where fog begins to count, in which a shadow that begins with it begins at 0. */
static void toggle(nb_shafts *shafts, float t)
{
    shafts->toggles[shafts->toggle_count++] = fmaxf(t, 0);
}

/* The shadows of one lane, sorted, as toggles. Returns the first shadow of the next lane. */
static size_t join(nb_shafts *shafts, size_t i, float skipped)
{
    const uint32_t lane = shafts->shadows[i].lane;
    float enter = shafts->shadows[i].enter, leave = shafts->shadows[i].leave;
    for (i++; i < shafts->shadow_count && shafts->shadows[i].lane == lane; i++) {
        const nb_shadow *next = &shafts->shadows[i];
        if (next->enter > leave + closeness * fabsf(leave)) {
            toggle(shafts, enter + skipped);
            toggle(shafts, leave + skipped);
            enter = next->enter;
            leave = next->leave;
        }
        leave = fmaxf(leave, next->leave);
    }
    toggle(shafts, enter + skipped);
    toggle(shafts, leave + skipped);
    return i;
}

/* The toggles of a packet, of the shadows that were kept and the last one of each ray. */
static int finish(nb_shafts *shafts, const nebel_allocator *allocator, const nb_sun_rays *rays, const float *length,
                  double advance, uint32_t *first)
{
    for (uint32_t i = 0; i < NB_PACKET; i++)
        if (rays->enter[i] < rays->leave[i] && !keep(shafts, allocator, i, rays->enter[i], rays->leave[i])) return 0;
    void *toggles = shafts->toggles;
    if (!nb_grow(allocator, &toggles, sizeof *shafts->toggles, shafts->toggle_count, &shafts->toggle_capacity,
                 shafts->toggle_count + 2 * shafts->shadow_count))
        return 0;
    shafts->toggles = toggles;
    if (shafts->shadow_count > 1)
        qsort(shafts->shadows, shafts->shadow_count, sizeof *shafts->shadows, compare_shadows);
    size_t k = 0;
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        first[i] = (uint32_t)shafts->toggle_count;
        if (k < shafts->shadow_count && shafts->shadows[k].lane == i)
            k = join(shafts, k, (float)(advance * (double)length[i]));
    }
    return 1;
}

static int is_empty(const float *from, const float *to)
{
    int some = 0;
    for (int i = 0; i < NB_PACKET; i++) some |= from[i] < to[i];
    return !some;
}

static int find_packet(nb_shafts *shafts, const nebel_allocator *allocator, const nb_sun_tree *tree,
                       const nb_rays *rays, double advance, int first, nb_sun_rays *packet)
{
    for (int i = 0; i < NB_PACKET; i++) {
        packet->enter[i] = INFINITY;
        packet->leave[i] = -INFINITY;
    }
    turn(tree, rays, first, packet);
    shafts->shadow_count = 0;
    return walk(shafts, allocator, tree, packet) &&
           finish(shafts, allocator, packet, rays->length + first, advance, shafts->first + first);
}

nebel_result nb_shafts_find(nb_shafts *shafts, const nebel_allocator *allocator, const nb_sun_tree *tree,
                            const nb_sunlit_box *box, const nb_rays *rays, double advance, const float *distance)
{
    float from[NB_BATCH], to[NB_BATCH];
    clip(box, rays, advance, distance, from, to);
    shafts->toggle_count = 0;
    for (int p = 0; p < NB_BATCH; p += NB_PACKET) {
        for (int i = 0; i < NB_PACKET; i++) shafts->first[p + i] = (uint32_t)shafts->toggle_count;
        if (tree->prism_count == 0 || is_empty(from + p, to + p)) continue;
        nb_sun_rays packet;
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
    nb_release(allocator, shafts->toggles);
}
