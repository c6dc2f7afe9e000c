#include "shadow_boundaries.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST = NB_MAX_COVER, /* triangles of a cell; over more of them walls are not looked for */
    MOST_SPLITS = 2 * MOST + 2,
    DEEPEST = 24, /* a part of an edge is divided so often, at most */
};

static const float bottomless = 1e30f;

/* ---- edges ----------------------------------------------------------------------------------- */

/* From its lower end to the other one, in an order that neighbours agree about. */
typedef struct nb_boundary_edge {
    const float *a, *b;
    int is_left; /* the triangle is to the left of the edge */
} nb_boundary_edge;

static int is_place(const float *a, const float *b)
{
    return (a[0] == b[0]) & (a[1] == b[1]) & (a[2] == b[2]);
}

static nb_boundary_edge edge_of(const nb_occluder *t, int k)
{
    const float *a = t->corner[k], *b = t->corner[(k + 1) % 3];
    const int turns_left = nb_caster_area(t) > 0, forward = nb_comes_first(a, b);
    return forward ? (nb_boundary_edge){a, b, turns_left} : (nb_boundary_edge){b, a, !turns_left};
}

/* The same for both ways along an edge; seldom the same for different edges. */
static uint32_t key_of(const float *a, const float *b)
{
    static const uint32_t factors[3] = {0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du};
    uint32_t key = 0;
    for (int i = 0; i < 3; i++) {
        const float place[2] = {a[i] + 0.0f, b[i] + 0.0f}; /* one zero of both */
        uint32_t bits[2];
        memcpy(bits, place, sizeof bits);
        for (int k = 0; k < 2; k++) key += (bits[k] ^ bits[k] >> 15) * factors[i];
    }
    return key;
}

static void set_keys(const nb_occluders *casters, const uint32_t *list, size_t count, uint32_t *keys)
{
    for (size_t i = 0; i < count; i++) {
        const nb_occluder *t = &casters->triangles[list[i]];
        for (int k = 0; k < 3; k++) keys[3 * i + (size_t)k] = key_of(t->corner[k], t->corner[(k + 1) % 3]);
    }
}

static int is_same(const nb_boundary_edge *a, const nb_boundary_edge *b)
{
    return is_place(a->a, b->a) && is_place(a->b, b->b);
}

/* Whether no triangle has the edge on its other side. Edges have the numbers of their keys. Others than the first one that
 * is the same are none, so that walls are looked for once. */
static int is_outline(const nb_occluders *casters, const uint32_t *list, const uint32_t *keys, size_t count,
                      size_t number, const nb_boundary_edge *edge)
{
    for (size_t n = 0; n < 3 * count; n++) {
        if (keys[n] != keys[number] || n == number) continue;
        const nb_boundary_edge other = edge_of(&casters->triangles[list[n / 3]], (int)(n % 3));
        if (is_same(&other, edge) && (n < number || other.is_left != edge->is_left)) return 0;
    }
    return 1;
}

/* ---- what lies over and under an edge -------------------------------------------------------- */

/* A part of the edge, in shares of it, and depths at both ends of the part. */
typedef struct nb_boundary_span {
    double begin, end, depth[2];
} nb_boundary_span;

static inline double depth_at(const nb_boundary_span *s, double u)
{
    const double way = s->end - s->begin;
    return way > 0 ? s->depth[0] + (s->depth[1] - s->depth[0]) * ((u - s->begin) / way) : s->depth[0];
}

/* What of the edge is where offset + u rise >= 0. */
static void clip_span(double offset, double rise, nb_boundary_span *s)
{
    if (rise > 0)
        s->begin = fmax(s->begin, -offset / rise);
    else if (rise < 0)
        s->end = fmin(s->end, -offset / rise);
    else if (offset < 0)
        s->end = -1;
}

static void clip_to_cell(const nb_boundary_edge *e, const nb_sun_cell *cell, nb_boundary_span *s)
{
    for (int i = 0; i < 2; i++) {
        const double a = (double)e->a[i], way = (double)e->b[i] - a;
        clip_span(a - (double)cell->low[i], way, s);
        clip_span((double)cell->high[i] - a, -way, s);
    }
}

/* Depth where corners have these weights; what rounding makes of none is none. */
static double depth_between(const nb_occluder *t, const double weights[3])
{
    double sum = 0, all = 0;
    for (int k = 0; k < 3; k++) {
        const double weight = fmax(weights[k], 0);
        sum += weight * (double)t->corner[k][2];
        all += weight;
    }
    return sum / all;
}

/* What the triangle has of the part of an edge; nothing: 0. */
static int span_of(const nb_occluder *t, const nb_boundary_edge *e, const nb_boundary_span *part, nb_boundary_span *s)
{
    const double side = nb_caster_area(t) > 0 ? 1 : -1;
    double offset[3], rise[3];
    *s = *part;
    for (int k = 0; k < 3; k++) {
        const float *p = t->corner[(k + 1) % 3], *q = t->corner[(k + 2) % 3];
        const double x = side * ((double)q[0] - (double)p[0]), y = side * ((double)q[1] - (double)p[1]);
        offset[k] = x * ((double)e->a[1] - (double)p[1]) - y * ((double)e->a[0] - (double)p[0]);
        rise[k] = x * ((double)e->b[1] - (double)e->a[1]) - y * ((double)e->b[0] - (double)e->a[0]);
        clip_span(offset[k], rise[k], s);
    }
    if (!(s->end - s->begin > 1e-7)) return 0;
    for (int i = 0; i < 2; i++) {
        const double u = i == 0 ? s->begin : s->end;
        const double weights[3] = {offset[0] + u * rise[0], offset[1] + u * rise[1], offset[2] + u * rise[2]};
        s->depth[i] = depth_between(t, weights);
    }
    return 1;
}

static int triangle_has_edge(const nb_occluder *t, const nb_boundary_edge *e)
{
    int ends = 0;
    for (int k = 0; k < 3; k++) ends += is_place(t->corner[k], e->a) || is_place(t->corner[k], e->b);
    return ends == 2;
}

/* ---- walls of an edge ------------------------------------------------------------------------ */

typedef struct nb_outline {
    nb_shadow_boundaries *walls;
    const nebel_allocator *allocator;
    nb_boundary_edge edge;
    nb_boundary_span whole; /* the edge with its own depths */
    nb_boundary_span spans[MOST];
    size_t count;
} nb_outline;

static void place_on_edge(const nb_outline *o, double u, float place[2])
{
    for (int i = 0; i < 2; i++) {
        const double a = (double)o->edge.a[i], b = (double)o->edge.b[i];
        place[i] = (float)(u == 1 ? b : a + u * (b - a));
    }
}

/* From u = begin to end, over a surface of these depths. Returns 0 when memory is out. */
static int add_wall(nb_outline *o, double begin, double end, double first, double last)
{
    nb_shadow_boundaries *walls = o->walls;
    void *grown = walls->walls;
    if (!nb_grow(o->allocator, &grown, sizeof *walls->walls, walls->count, &walls->capacity, walls->count + 1))
        return 0;
    walls->walls = grown;
    nb_shadow_boundary wall;
    const int k = o->edge.is_left ? 0 : 1;
    place_on_edge(o, begin, k == 0 ? wall.from : wall.to);
    place_on_edge(o, end, k == 0 ? wall.to : wall.from);
    wall.top[k] = (float)depth_at(&o->whole, begin);
    wall.top[1 - k] = (float)depth_at(&o->whole, end);
    wall.bottom[k] = (float)first;
    wall.bottom[1 - k] = (float)last;
    walls->walls[walls->count++] = wall;
    return 1;
}

/* Where the edge is above the surface. */
static int add_above(nb_outline *o, double begin, double end, double first, double last)
{
    const double top[2] = {depth_at(&o->whole, begin), depth_at(&o->whole, end)};
    const double height[2] = {first - top[0], last - top[1]};
    const double noise = 1e-7 * (fabs(top[0]) + fabs(top[1]));
    if (height[0] <= noise && height[1] <= noise) return 1;
    if (height[0] >= 0 && height[1] >= 0) return add_wall(o, begin, end, first, last);
    const double share = height[0] / (height[0] - height[1]);
    const double middle = begin + share * (end - begin), depth = depth_at(&o->whole, middle);
    return height[0] > 0 ? add_wall(o, begin, middle, first, depth) : add_wall(o, middle, end, depth, last);
}

/* The one of those that are all along the part whose depth at u is least; NULL: there is none. */
static const nb_boundary_span *nearest_at(const nb_outline *o, double begin, double end, double u)
{
    const nb_boundary_span *nearest = NULL;
    for (size_t i = 0; i < o->count; i++) {
        const nb_boundary_span *s = &o->spans[i];
        if (s->begin > begin || s->end < end) continue;
        if (nearest == NULL || depth_at(s, u) < depth_at(nearest, u)) nearest = s;
    }
    return nearest;
}

/* A part of the edge on which no span begins or ends. What is least at both ends of a part is least all along it. */
static int add_edge_part(nb_outline *o, double begin, double end, int level)
{
    const nb_boundary_span *first = nearest_at(o, begin, end, begin), *last = nearest_at(o, begin, end, end);
    if (first == NULL) return add_above(o, begin, end, (double)bottomless, (double)bottomless);
    const double gap[2] = {depth_at(last, begin) - depth_at(first, begin), depth_at(first, end) - depth_at(last, end)};
    const double middle = begin + (end - begin) * (gap[0] / (gap[0] + gap[1]));
    if (first == last || level == DEEPEST || !(gap[0] > 0 && gap[1] > 0) || !(middle > begin && middle < end))
        return add_above(o, begin, end, depth_at(first, begin), depth_at(last, end));
    return add_edge_part(o, begin, middle, level + 1) && add_edge_part(o, middle, end, level + 1);
}

/* Where spans begin or end, in rising order. */
static size_t list_splits(const nb_outline *o, double *splits)
{
    size_t count = 0;
    splits[count++] = o->whole.begin;
    splits[count++] = o->whole.end;
    for (size_t i = 0; i < o->count; i++) {
        splits[count++] = o->spans[i].begin;
        splits[count++] = o->spans[i].end;
    }
    for (size_t i = 1; i < count; i++) {
        const double moved = splits[i];
        size_t k = i;
        for (; k > 0 && splits[k - 1] > moved; k--) splits[k] = splits[k - 1];
        splits[k] = moved;
    }
    return count;
}

static int add_outline(nb_outline *o, const nb_occluders *casters, const uint32_t *list, size_t count,
                       const nb_boundary_span *part)
{
    const nb_boundary_edge *e = &o->edge;
    double splits[MOST_SPLITS];
    o->count = 0;
    for (size_t i = 0; i < count; i++) {
        const nb_occluder *t = &casters->triangles[list[i]];
        if (!triangle_has_edge(t, e)) o->count += (size_t)span_of(t, e, part, &o->spans[o->count]);
    }
    const double a = (double)e->a[2], way = (double)e->b[2] - a;
    o->whole = (nb_boundary_span){part->begin, part->end, {a + part->begin * way, a + part->end * way}};
    const size_t ends = list_splits(o, splits);
    o->walls->looks += count + ends * o->count;
    for (size_t i = 1; i < ends; i++)
        if (splits[i] > splits[i - 1] && !add_edge_part(o, splits[i - 1], splits[i], 0)) return 0;
    return 1;
}

/* An edge along the high side of a cell, beyond which there is another one. */
static int is_of_next(const nb_boundary_edge *e, const nb_sun_cell *cell, const nb_sun_cell *last)
{
    int next = 0;
    for (int i = 0; i < 2; i++)
        next |= (e->a[i] == cell->high[i]) & (e->b[i] == cell->high[i]) & (cell->high[i] < last->high[i]);
    return next;
}

/* Leaves and the like are all edges, with many others over each: prisms are cheaper there than walls are found. */
static int is_enough(const nb_shadow_boundaries *walls, const nb_occluders *casters, size_t count)
{
    const uint64_t most = 10000000 + 64 * (uint64_t)casters->count;
    return casters->numbers != NULL || count > MOST || walls->looks > most;
}

int nb_shadow_boundaries_add(nb_shadow_boundaries *walls, const nebel_allocator *allocator, const nb_occluders *casters,
                             const uint32_t *list, size_t count, const nb_sun_cell *cell, const nb_sun_cell *last)
{
    nb_outline outline = {.walls = walls, .allocator = allocator};
    uint32_t keys[3 * MOST];
    walls->looks += 3 * count;
    walls->is_unknown = walls->is_unknown || is_enough(walls, casters, count);
    if (walls->is_unknown) return 1;
    set_keys(casters, list, count, keys);
    for (size_t n = 0; n < 3 * count; n++) {
        nb_boundary_span part = {0, 1, {0, 0}};
        outline.edge = edge_of(&casters->triangles[list[n / 3]], (int)(n % 3));
        clip_to_cell(&outline.edge, cell, &part);
        if (!(part.begin < part.end) || is_of_next(&outline.edge, cell, last)) continue;
        if (!is_outline(casters, list, keys, count, n, &outline.edge)) continue;
        if (!add_outline(&outline, casters, list, count, &part)) return 0;
    }
    return 1;
}

/* ---- tree ------------------------------------------------------------------------------------ */

/* A wall's place on a curve that stays near where it is: Morton, A Computer Oriented Geodetic Data Base, 1966. */
typedef struct nb_placed {
    uint64_t place;
    nb_shadow_boundary wall;
} nb_placed;

static uint64_t spread_bits(uint64_t x)
{
    static const uint64_t masks[5] = {0x0000ffff0000ffffu, 0x00ff00ff00ff00ffu, 0x0f0f0f0f0f0f0f0fu,
                                      0x3333333333333333u, 0x5555555555555555u};
    for (int i = 0; i < 5; i++) x = (x | x << (16 >> i)) & masks[i];
    return x;
}

static uint64_t wall_place(const nb_shadow_boundary *wall, const nb_sun_cell *bounds)
{
    uint64_t place = 0;
    const float x = bounds->high[0] - bounds->low[0], y = bounds->high[1] - bounds->low[1];
    const double scale = 0x1p32 / fmax((double)nb_most(x, y), 1e-30);
    for (int i = 0; i < 2; i++) {
        const float middle = 0.5f * (wall->from[i] + wall->to[i]);
        const double at = fmin(fmax((double)(middle - bounds->low[i]) * scale, 0), 0x1p32 - 1);
        place |= spread_bits((uint64_t)at) << i;
    }
    return place;
}

static int compare_placed(const void *a, const void *b)
{
    const nb_placed *p = a, *q = b;
    if (p->place != q->place) return p->place > q->place ? 1 : -1;
    return memcmp(&p->wall, &q->wall, sizeof p->wall);
}

static int sort_walls(nb_shadow_boundaries *walls, const nebel_allocator *allocator, const nb_sun_cell *bounds)
{
    nb_placed *placed = nb_allocate(allocator, walls->count, sizeof *placed);
    if (placed == NULL) return 0;
    for (size_t i = 0; i < walls->count; i++)
        placed[i] = (nb_placed){wall_place(&walls->walls[i], bounds), walls->walls[i]};
    qsort(placed, walls->count, sizeof *placed, compare_placed);
    for (size_t i = 0; i < walls->count; i++) walls->walls[i] = placed[i].wall;
    nb_release(allocator, placed);
    return 1;
}

static void set_empty(nb_wall_node *node)
{
    for (int k = 0; k < NB_WALL_FAN; k++) {
        node->low[0][k] = node->low[1][k] = node->top[k] = INFINITY;
        node->high[0][k] = node->high[1][k] = node->bottom[k] = -INFINITY;
    }
}

/* More than rounding may move a ray. */
static void bound_wall(const nb_shadow_boundary *wall, nb_wall_node *node, size_t k)
{
    for (int i = 0; i < 2; i++) {
        const float low = nb_least(wall->from[i], wall->to[i]), high = nb_most(wall->from[i], wall->to[i]);
        const float margin = 0x1p-20f * nb_most(-low, high);
        node->low[i][k] = low - margin;
        node->high[i][k] = high + margin;
    }
    const float top = nb_least(wall->top[0], wall->top[1]), bottom = nb_most(wall->bottom[0], wall->bottom[1]);
    const float margin = 0x1p-20f * nb_most(-top, bottom < bottomless ? bottom : top);
    node->top[k] = top - margin;
    node->bottom[k] = bottom + margin;
}

static void bound_node(const nb_wall_node *below, nb_wall_node *node, size_t k)
{
    for (int c = 0; c < NB_WALL_FAN; c++) {
        for (int i = 0; i < 2; i++) {
            node->low[i][k] = nb_least(node->low[i][k], below->low[i][c]);
            node->high[i][k] = nb_most(node->high[i][k], below->high[i][c]);
        }
        node->top[k] = nb_least(node->top[k], below->top[c]);
        node->bottom[k] = nb_most(node->bottom[k], below->bottom[c]);
    }
}

static size_t parents_of(size_t count)
{
    return (count + NB_WALL_FAN - 1) / NB_WALL_FAN;
}

int nb_shadow_boundaries_finish(nb_shadow_boundaries *walls, const nebel_allocator *allocator,
                                const nb_sun_cell *bounds)
{
    size_t all = 0;
    if (walls->is_unknown) nb_shadow_boundaries_free(walls, allocator);
    if (walls->count == 0) return 1;
    if (!sort_walls(walls, allocator, bounds)) return 0;
    for (size_t count = walls->count; count > 1 || all == 0; all += count) count = parents_of(count);
    walls->nodes = nb_allocate(allocator, all, sizeof *walls->nodes);
    if (walls->nodes == NULL) return 0;
    nb_wall_node *level = walls->nodes;
    size_t below = walls->count;
    for (int number = 0; below > 1 || number == 0; number++) {
        const size_t count = parents_of(below);
        for (size_t n = 0; n < count; n++) set_empty(&level[n]);
        for (size_t n = 0; n < below; n++) {
            nb_wall_node *node = &level[n / NB_WALL_FAN];
            if (number == 0)
                bound_wall(&walls->walls[n], node, n % NB_WALL_FAN);
            else
                bound_node(&walls->levels[number - 1][n], node, n % NB_WALL_FAN);
        }
        walls->levels[number] = level;
        walls->level_count = number + 1;
        level += count;
        below = count;
    }
    return 1;
}

void nb_shadow_boundaries_free(nb_shadow_boundaries *walls, const nebel_allocator *allocator)
{
    nb_release(allocator, walls->walls);
    nb_release(allocator, walls->nodes);
    *walls = (nb_shadow_boundaries){.count = 0};
}

/* Whether the place is as near to the line through the wall as that, in the plane. */
static int touches(const nb_shadow_boundary *wall, const float place[3], float margin)
{
    const double x = (double)wall->to[0] - (double)wall->from[0], y = (double)wall->to[1] - (double)wall->from[1];
    const double off = x * ((double)place[1] - (double)wall->from[1]) - y * ((double)place[0] - (double)wall->from[0]);
    return fabs(off) <= (double)margin * hypot(x, y);
}

static int is_near(const nb_wall_node *node, int k, const float place[3], float margin)
{
    int near = (place[2] >= node->top[k] - margin) & (place[2] <= node->bottom[k] + margin);
    for (int i = 0; i < 2; i++)
        near &= (place[i] >= node->low[i][k] - margin) & (place[i] <= node->high[i][k] + margin);
    return near;
}

static int node_meets_place(const nb_shadow_boundaries *walls, int level, size_t number, const float place[3],
                            float margin)
{
    const nb_wall_node *node = &walls->levels[level][number];
    for (int k = 0; k < NB_WALL_FAN; k++) {
        const size_t child = NB_WALL_FAN * number + (size_t)k;
        if (is_near(node, k, place, margin) && (level == 0 ? touches(&walls->walls[child], place, margin)
                                                           : node_meets_place(walls, level - 1, child, place, margin)))
            return 1;
    }
    return 0;
}

int nb_shadow_boundaries_meet(const nb_shadow_boundaries *walls, const float place[3], float margin)
{
    return walls->level_count > 0 && node_meets_place(walls, walls->level_count - 1, 0, place, margin);
}
