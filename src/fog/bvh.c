#include "bvh.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- building
 * --------------------------------------------------------------------------------------------------------
 *
 * Top down, depth first, over an array of boxes already rounded to float. Each range is split along the axis on which
 * its centers spread most, at the one of 15 equally spaced planes with the least expected cost (surface area heuristic
 * in bins: Wald, On fast construction of SAH-based bounding volume hierarchies, 2007). Leaves hold one box: what
 * follows a hit costs many times a box test. */

enum { BINS = 16 };

/* A box while building; the node's layout, so that a leaf is a copy. */
typedef nb_bvh_node item;

/* A range of items that still needs its node filled. */
typedef struct nb_bvh_task {
    uint32_t node, first, count, depth;
} nb_bvh_task;

typedef struct nb_bvh_bounds {
    float low[3], high[3];
} nb_bvh_bounds;

typedef struct bin {
    nb_bvh_bounds box;
    uint32_t count;
} bin;

static nb_bvh_bounds no_bounds(void)
{
    return (nb_bvh_bounds){{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
}

static void enclose(nb_bvh_bounds *b, const float low[3], const float high[3])
{
    for (int k = 0; k < 3; k++) {
        b->low[k] = low[k] < b->low[k] ? low[k] : b->low[k];
        b->high[k] = high[k] > b->high[k] ? high[k] : b->high[k];
    }
}

/* Half the surface of a box; in double, where no float extent overflows. */
static double half_area(const nb_bvh_bounds *b)
{
    double e[3];
    for (int k = 0; k < 3; k++) e[k] = (double)b->high[k] - (double)b->low[k];
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

static double center(const item *it, int axis)
{
    return (double)it->low[axis] + (double)it->high[axis];
}

/* The next float is always taken, even where none is needed: the relative coordinate has itself been rounded. */
static float round_down(double x)
{
    const float nearest = x > (double)FLT_MAX ? FLT_MAX : x < -(double)FLT_MAX ? -FLT_MAX : (float)x;
    return nearest > -FLT_MAX ? nextafterf(nearest, -FLT_MAX) : -HUGE_VALF;
}

static float round_up(double x)
{
    return -round_down(-x);
}

static int box_is_valid(const nb_aabb *box)
{
    for (int k = 0; k < 3; k++)
        if (!isfinite(box->low[k]) || !isfinite(box->high[k]) || box->low[k] > box->high[k]) return 0;
    return 1;
}

/* The middle of all boxes becomes the origin. 0 when a box is not one. */
static int find_origin(const nb_aabb *boxes, size_t n, nb_bvh *bvh)
{
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (size_t i = 0; i < n; i++) {
        if (!box_is_valid(&boxes[i])) return 0;
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], boxes[i].low[k]);
            high[k] = fmax(high[k], boxes[i].high[k]);
        }
    }
    bvh->extent = 0;
    for (int k = 0; k < 3; k++) {
        bvh->origin[k] = low[k] / 2 + high[k] / 2;
        bvh->extent = fmax(bvh->extent, fmax(high[k] - bvh->origin[k], bvh->origin[k] - low[k]));
    }
    return 1;
}

static void fill_items(const nb_aabb *boxes, size_t n, const nb_bvh *bvh, item *items)
{
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) {
            items[i].low[k] = round_down(boxes[i].low[k] - bvh->origin[k]);
            items[i].high[k] = round_up(boxes[i].high[k] - bvh->origin[k]);
        }
        items[i].index = NB_BVH_LEAF | (uint32_t)i;
        items[i].unused = 0;
    }
}

/* Where along which axis to cut, and in which bin an item lies: (center - start) * scale. */
typedef struct cut {
    int axis, bin;
    double start, scale;
} cut;

static int bin_of(const cut *c, const item *it)
{
    const int b = (int)((center(it, c->axis) - c->start) * c->scale);
    return b < BINS - 1 ? b : BINS - 1;
}

/* The longest axis of the centers, and the grid of bins on it. 0 when all centers coincide or are out of range. */
static int choose_axis(const item *items, uint32_t n, cut *c)
{
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const double x = center(&items[i], k);
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    c->axis = 0;
    for (int k = 1; k < 3; k++)
        if (high[k] - low[k] > high[c->axis] - low[c->axis]) c->axis = k;
    const double spread = high[c->axis] - low[c->axis];
    c->start = low[c->axis];
    c->scale = BINS / spread;
    return spread > 0 && isfinite(spread) && isfinite(c->scale);
}

static void fill_bins(const item *items, uint32_t n, const cut *c, bin bins[BINS])
{
    for (int b = 0; b < BINS; b++) bins[b] = (bin){no_bounds(), 0};
    for (uint32_t i = 0; i < n; i++) {
        bin *const b = &bins[bin_of(c, &items[i])];
        enclose(&b->box, items[i].low, items[i].high);
        b->count++;
    }
}

/* The bin that starts the right side where area times count is least on both sides together. The first and the last bin
 * are never empty, so every cut leaves something on both sides. */
static int cheapest_cut(const bin bins[BINS])
{
    double right_cost[BINS];
    nb_bvh_bounds box = no_bounds();
    uint32_t count = 0;
    for (int b = BINS - 1; b > 0; b--) {
        enclose(&box, bins[b].box.low, bins[b].box.high);
        count += bins[b].count;
        right_cost[b] = half_area(&box) * count;
    }
    int best = BINS / 2;
    double least = HUGE_VAL;
    box = no_bounds();
    count = 0;
    for (int b = 1; b < BINS; b++) {
        enclose(&box, bins[b - 1].box.low, bins[b - 1].box.high);
        count += bins[b - 1].count;
        const double cost = half_area(&box) * count + right_cost[b];
        if (cost < least) {
            least = cost;
            best = b;
        }
    }
    return best;
}

/* Moves the items of the left side to the front; how many they are. */
static uint32_t partition(item *items, uint32_t n, const cut *c)
{
    uint32_t i = 0, j = n;
    while (i < j) {
        if (bin_of(c, &items[i]) < c->bin) {
            i++;
        } else {
            const item swap = items[--j];
            items[j] = items[i];
            items[i] = swap;
        }
    }
    return i;
}

/* How many items go left. Halves in the order they lie in, where nothing better is to be had or depth has run out. */
static uint32_t split(item *items, uint32_t n, uint32_t depth)
{
    cut c;
    if (n == 2 || depth >= NB_BVH_SPLIT_DEPTH || !choose_axis(items, n, &c)) return n / 2;
    bin bins[BINS];
    fill_bins(items, n, &c, bins);
    c.bin = cheapest_cut(bins);
    const uint32_t left = partition(items, n, &c);
    return left > 0 && left < n ? left : n / 2;
}

/* Leaves and their links first; the boxes of inner nodes are joined afterwards, children before parents. */
static void build_topology(item *items, uint32_t n, nb_bvh_node *nodes)
{
    nb_bvh_task stack[NB_BVH_DEPTH + 1];
    int waiting = 0;
    uint32_t used = 1;
    stack[waiting++] = (nb_bvh_task){0, 0, n, 0};
    while (waiting > 0) {
        const nb_bvh_task t = stack[--waiting];
        if (t.count == 1) {
            nodes[t.node] = items[t.first];
            continue;
        }
        const uint32_t left = split(items + t.first, t.count, t.depth);
        nodes[t.node].index = used;
        nodes[t.node].unused = 0;
        stack[waiting++] = (nb_bvh_task){used + 1, t.first + left, t.count - left, t.depth + 1};
        stack[waiting++] = (nb_bvh_task){used, t.first, left, t.depth + 1};
        used += 2;
    }
}

/* Children have larger numbers than their parents, so one pass backwards meets every box before it is needed. */
static void join_boxes(nb_bvh_node *nodes, size_t count)
{
    for (size_t i = count; i-- > 0;) {
        nb_bvh_node *const node = &nodes[i];
        if (node->index & NB_BVH_LEAF) continue;
        nb_bvh_bounds box = no_bounds();
        for (size_t child = node->index; child < (size_t)node->index + 2; child++)
            enclose(&box, nodes[child].low, nodes[child].high);
        memcpy(node->low, box.low, sizeof box.low);
        memcpy(node->high, box.high, sizeof box.high);
    }
}

nebel_result nb_bvh_build(const nebel_allocator *allocator, const nb_aabb *boxes, size_t n, nb_bvh *out)
{
    *out = (nb_bvh){{0}, 0, NULL, 0};
    if (n == 0) return NEBEL_OK;
    if (n > NB_MAX_BVH_BOXES) return NEBEL_ERROR_LIMIT;
    nb_bvh bvh = *out;
    if (!find_origin(boxes, n, &bvh)) return NEBEL_ERROR_VALUE;
    bvh.node_count = 2 * n - 1;
    bvh.nodes = nb_allocate(allocator, bvh.node_count, sizeof *bvh.nodes);
    item *const items = nb_allocate(allocator, n, sizeof *items);
    if (bvh.nodes == NULL || items == NULL) {
        nb_release(allocator, bvh.nodes);
        nb_release(allocator, items);
        return NEBEL_ERROR_MEMORY;
    }
    fill_items(boxes, n, &bvh, items);
    build_topology(items, (uint32_t)n, bvh.nodes);
    join_boxes(bvh.nodes, bvh.node_count);
    nb_release(allocator, items);
    *out = bvh;
    return NEBEL_OK;
}

void nb_bvh_free(const nebel_allocator *allocator, nb_bvh *bvh)
{
    nb_release(allocator, bvh->nodes);
    *bvh = (nb_bvh){{0}, 0, NULL, 0};
}

/* ---- walking
 * ---------------------------------------------------------------------------------------------------------
 *
 * The slab test (Kay and Kajiya, 1986), made conservative. With u = 2^-53 and o' the rounded origin relative to the
 * tree's:
 *
 *  - with reach = max(|o'|, extent), o' is off by u reach, low - o' is rounded by 2 u reach, and a direction that is
 * off by 4 u misleads by 8 u reach where it crosses the tree. All this is within a padding of 64 u reach that pushes
 * every face outwards before the difference is taken. The sign of a padded difference is therefore right, with room for
 * those who ask about a box with a margin of 16 u reach (part_in_bounds in trace_intersect.h).
 *  - a distance is off by u for the product and 5 u for the direction and its inverse, which keeps its sign; the last
 *    comparison allows 16 u for both sides together.
 *  - a direction of 0 is a huge inverse: between the faces the distances are -huge and +huge, outside them both lie
 * beyond any other. The padding is > 0 unless everything is in one point, which is then met at t = 0. */

static const double padding_per_reach = 32 * DBL_EPSILON;
static const double slack = 1 + 8 * DBL_EPSILON;

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static void extend(double range[2], double x)
{
    range[0] = smaller(range[0], x);
    range[1] = larger(range[1], x);
}

static void add_lane(nb_bvh_cursor *cursor, const nb_bvh *bvh, const double origin[3], const double inverse[3],
                     double t_max)
{
    const int lane = cursor->lane_count++;
    double relative[3], reach = bvh->extent;
    for (int k = 0; k < 3; k++) {
        relative[k] = origin[k] - bvh->origin[k];
        reach = fmax(reach, fabs(relative[k]));
    }
    const double padding = padding_per_reach * reach;
    for (int k = 0; k < 3; k++) {
        cursor->below[k][lane] = relative[k] + padding;
        cursor->above[k][lane] = relative[k] - padding;
        cursor->inverse[k][lane] = inverse[k];
    }
    cursor->t_max[lane] = t_max;
}

static void start(nb_bvh_cursor *cursor, const nb_bvh *bvh)
{
    cursor->nodes = bvh->nodes;
    cursor->lane_count = 0;
    cursor->last_hit = 0;
    cursor->depth = 0;
    if (bvh->node_count > 0) cursor->stack[cursor->depth++] = 0;
}

/* Along an axis on which all lanes look the same way, they enter through the same face. */
static void join_lanes(nb_bvh_cursor *cursor)
{
    cursor->beam_t_max = 0;
    for (int lane = 0; lane < cursor->lane_count; lane++)
        cursor->beam_t_max = larger(cursor->beam_t_max, cursor->t_max[lane]);
    for (int k = 0; k < 3; k++) {
        nb_bvh_beam *const beam = &cursor->beam[k];
        *beam = (nb_bvh_beam){{HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, -HUGE_VAL}, 0};
        int positive = 0;
        for (int lane = 0; lane < cursor->lane_count; lane++) {
            const int forward = cursor->inverse[k][lane] > 0;
            const double below = cursor->below[k][lane], above = cursor->above[k][lane];
            positive += forward;
            extend(beam->entry_origin, forward ? below : above);
            extend(beam->leave_origin, forward ? above : below);
            extend(beam->inverse, cursor->inverse[k][lane]);
        }
        beam->sign = positive == cursor->lane_count ? 1 : positive == 0 ? -1 : 0;
    }
}

void nb_bvh_begin(nb_bvh_cursor *cursor, const nb_bvh *bvh, int lane_count, unsigned active,
                  const double (*origin)[NB_BVH_LANES], const double (*inverse)[NB_BVH_LANES], const double *t_max)
{
    start(cursor, bvh);
    for (int lane = 0; lane < lane_count; lane++) {
        if (!(active >> lane & 1)) continue;
        const double o[3] = {origin[0][lane], origin[1][lane], origin[2][lane]};
        const double i[3] = {inverse[0][lane], inverse[1][lane], inverse[2][lane]};
        add_lane(cursor, bvh, o, i, t_max[lane]);
    }
    join_lanes(cursor);
}

void nb_bvh_begin_ray(nb_bvh_cursor *cursor, const nb_bvh *bvh, const double origin[3], const double inverse[3],
                      double t_max)
{
    start(cursor, bvh);
    add_lane(cursor, bvh, origin, inverse, t_max);
}

static int lane_touches(const nb_bvh_cursor *cursor, int lane, const nb_bvh_node *node)
{
    double enter = 0, leave = cursor->t_max[lane];
    for (int k = 0; k < 3; k++) {
        const double inverse = cursor->inverse[k][lane];
        const double a = ((double)node->low[k] - cursor->below[k][lane]) * inverse;
        const double b = ((double)node->high[k] - cursor->above[k][lane]) * inverse;
        enter = larger(enter, smaller(a, b));
        leave = smaller(leave, larger(a, b));
    }
    return enter <= leave * slack;
}

/* 0: no lane can touch the node. Products of the ranges' ends bound the products of all lanes. */
static int beam_touches(const nb_bvh_cursor *cursor, const nb_bvh_node *node)
{
    double enter = 0, leave = cursor->beam_t_max;
    for (int k = 0; k < 3; k++) {
        const nb_bvh_beam *const beam = &cursor->beam[k];
        if (beam->sign > 0) {
            const double first = (double)node->low[k] - beam->entry_origin[1];
            const double last = (double)node->high[k] - beam->leave_origin[0];
            enter = larger(enter, first * beam->inverse[first > 0 ? 0 : 1]);
            leave = smaller(leave, last * beam->inverse[last > 0 ? 1 : 0]);
        } else if (beam->sign < 0) {
            const double first = (double)node->high[k] - beam->entry_origin[0];
            const double last = (double)node->low[k] - beam->leave_origin[1];
            enter = larger(enter, first * beam->inverse[first < 0 ? 1 : 0]);
            leave = smaller(leave, last * beam->inverse[last < 0 ? 0 : 1]);
        }
    }
    return enter <= leave * slack;
}

static int touches(nb_bvh_cursor *cursor, const nb_bvh_node *node)
{
    if (cursor->lane_count > 1 && !beam_touches(cursor, node)) return 0;
    for (int i = 0, lane = cursor->last_hit; i < cursor->lane_count; i++) {
        if (lane_touches(cursor, lane, node)) {
            cursor->last_hit = lane;
            return 1;
        }
        lane = lane + 1 < cursor->lane_count ? lane + 1 : 0;
    }
    return 0;
}

int nb_bvh_next(nb_bvh_cursor *cursor, uint32_t *index)
{
    while (cursor->depth > 0) {
        const nb_bvh_node *const node = &cursor->nodes[cursor->stack[--cursor->depth]];
        if (!touches(cursor, node)) continue;
        if (node->index & NB_BVH_LEAF) {
            *index = node->index & ~NB_BVH_LEAF;
            return 1;
        }
        cursor->stack[cursor->depth++] = node->index + 1;
        cursor->stack[cursor->depth++] = node->index;
    }
    return 0;
}
