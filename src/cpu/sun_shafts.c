#include "boundary_crossings.h"
#include "masked_triangle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float far_away = 1e18f;

/* ---- rays ------------------------------------------------------------------------------------ */

/* What of each ray is within the box. */
NB_CLONES static void clip(const nb_lit_box *box, const nb_ray_batch *rays, double advance, const float *distance,
                           float *restrict from, float *restrict to)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float skipped = (float)(advance * (double)rays->length[i]);
        float first = -skipped, last = distance[i] - skipped;
        last = last < far_away ? last : far_away;
        for (int c = 0; c < 3; c++) {
            const float inverse = nb_reciprocal(rays->unit[c][i]);
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

void nb_sun_shafts_clip(const nb_lit_box *box, const nb_ray_batch *rays, double advance, const float *distance,
                        float *from, float *to)
{
    clip(box, rays, advance, distance, from, to);
}

NB_CLONES static void turn_packet(const nb_sun_cells *cells, const nb_ray_batch *rays, int first, nb_shaft_rays *packet)
{
    for (int a = 0; a < 3; a++) {
        const float x = cells->axes[a][0], y = cells->axes[a][1], z = cells->axes[a][2];
        NB_SIMD
        for (int i = 0; i < NB_PACKET; i++) {
            const int k = first + i;
            const float way = x * rays->unit[0][k] + y * rays->unit[1][k] + z * rays->unit[2][k];
            packet->start[a][i] = x * rays->start[0][k] + y * rays->start[1][k] + z * rays->start[2][k];
            packet->way[a][i] = way;
            packet->inverse[a][i] = nb_reciprocal(way);
        }
    }
}

/* ---- the eye --------------------------------------------------------------------------------- */

nb_eye_visibility nb_sun_shafts_eye(const nb_sun_cells *cells, const nb_geometry *geometry, const nb_view *view)
{
    struct RTCIntersectContext context;
    float eye[3], turned[3], margin = 0;
    if (view->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) return NB_EYE_UNKNOWN;
    for (int i = 0; i < 3; i++) eye[i] = nb_clamp_coordinate((float)view->start[i]);
    for (int a = 0; a < 3; a++) {
        const float *axis = cells->axes[a];
        turned[a] = axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2];
        margin = nb_most(margin, 4 * nb_closeness * fabsf(eye[a]));
    }
    if (nb_shadow_boundaries_meet(&cells->walls, turned, margin)) return NB_EYE_UNKNOWN;
    struct RTCRay ray = {.org_x = eye[0],
                         .org_y = eye[1],
                         .org_z = eye[2],
                         .dir_x = -cells->axes[2][0],
                         .dir_y = -cells->axes[2][1],
                         .dir_z = -cells->axes[2][2],
                         .tfar = INFINITY,
                         .mask = UINT32_MAX};
    rtcInitIntersectContext(&context);
    rtcOccluded1(geometry->scene, &context, &ray);
    return ray.tfar < 0 ? NB_EYE_IN_SHADOW : NB_EYE_IN_LIGHT;
}

/* ---- shadows --------------------------------------------------------------------------------- */

static int touch(float enter, float leave, float other_enter, float other_leave)
{
    const float gap = nb_closeness * fabsf(nb_least(leave, other_leave));
    return (enter <= other_leave + gap) & (leave >= other_enter - gap);
}

int nb_sun_shafts_keep(nb_sun_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, nb_shaft_rays *rays)
{
    const float enter = rays->enter[lane], leave = rays->leave[lane];
    if (!(enter <= leave)) return 1;
    nb_shadow *before = rays->kept[lane] > 0 ? &shafts->shadows[rays->kept[lane] - 1] : NULL;
    if (before != NULL && touch(enter, leave, before->enter, before->leave)) {
        before->enter = nb_least(enter, before->enter);
        before->leave = nb_most(leave, before->leave);
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

/* ---- cells ----------------------------------------------------------------------------------- */

/* Children as bits of a number: those in whose shadows the beam may come, and, 16 bits above them, those in which it is
 * in shadow all along. */
typedef struct nb_met {
    uint32_t children;
    float begin[NB_CELL_FAN], end[NB_CELL_FAN]; /* m along the beam */
} nb_met;

NB_ALWAYS_INLINE void meet_cells(const nb_cell_node *node, const nb_beam *beam, nb_met *met)
{
    const float *restrict first_x = beam->falls[0] ? node->high[0] : node->low[0];
    const float *restrict last_x = beam->falls[0] ? node->low[0] : node->high[0];
    const float *restrict first_y = beam->falls[1] ? node->high[1] : node->low[1];
    const float *restrict last_y = beam->falls[1] ? node->low[1] : node->high[1];
    const nb_border z = beam->depth;
    const float soonest = beam->rises ? 0 : -INFINITY, latest = beam->rises ? INFINITY : 0;
    const float least = beam->least, rise = beam->least_rise;
    const nb_beam b = *beam;
    uint32_t children = 0;
    NB_SIMD
    for (int i = 0; i < NB_CELL_FAN; i++) {
        float enter, leave;
        NB_BEAM_CROSS(&b, first_x[i], last_x[i], first_y[i], last_y[i], enter, leave);
        const float deep = (node->nearest[i] - z.at) * z.scale;
        const float in_z = deep + soonest, out_z = deep + latest;
        enter = enter > in_z ? enter : in_z;
        leave = leave < out_z ? leave : out_z;
        const float depth = least + rise * (rise >= 0 ? enter : leave);
        met->begin[i] = enter;
        met->end[i] = leave;
        const uint32_t meets = enter <= leave ? 1u << i : 0, hides = depth >= node->covered[i] ? 0x10000u << i : 0;
        children |= meets | hides;
    }
    met->children = children;
}

enum { SUN_VISITS = (NB_CELL_LEVELS + NB_LEAF_LEVELS) * NB_CELL_FAN };

typedef struct nb_shaft_visit {
    float begin, end; /* m along the rays */
    uint32_t child;   /* NB_CELL_FAN times the number of the node that it belongs to, and its place there */
    int is_dark;
} nb_shaft_visit;

/* Numbers of children, the farthest along the beam first: what is found next mostly touches what was found last. How far
 * is not below 0, so that it is in the order of its bits; the last four of them make room for the number. */
NB_ALWAYS_INLINE int sort_children(const nb_met *met, uint32_t *order)
{
    int count = 0;
    for (uint32_t left = met->children & 0xffff; left != 0; left &= left - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(left);
        uint32_t key;
        int i = count++;
        memcpy(&key, &met->begin[k], sizeof key);
        key = (key & ~(uint32_t)(NB_CELL_FAN - 1)) | k;
        for (; i > 0 && order[i - 1] < key; i--) order[i] = order[i - 1];
        order[i] = key;
    }
    return count;
}

/* Returns how many. */
NB_ALWAYS_INLINE int list_children(const nb_cell_node *nodes, uint32_t number, const nb_beam *beam,
                                   nb_shaft_visit *visits)
{
    nb_met met;
    uint32_t order[NB_CELL_FAN];
    meet_cells(&nodes[number], beam, &met);
    const int count = sort_children(&met, order);
    for (int i = 0; i < count; i++) {
        const uint32_t k = order[i] % NB_CELL_FAN;
        visits[i] = (nb_shaft_visit){beam->from + met.begin[k], beam->from + met.end[k], NB_CELL_FAN * number + k,
                                     (int)(met.children >> 16 >> k & 1)};
    }
    return count;
}

/* Whether any ray is asked for between these places, and not known to be in shadow there. */
NB_ALWAYS_INLINE int is_open(const nb_shaft_visit *visit, const nb_shaft_rays *rays)
{
    const float begin = visit->begin, end = visit->end;
    int any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float first = rays->from[i] > begin ? rays->from[i] : begin;
        const float last = rays->to[i] < end ? rays->to[i] : end;
        any |= (first < last) & ((first < rays->enter[i]) | (last > rays->leave[i]));
    }
    return any;
}

/* What a cell leaves of each ray. */
NB_ALWAYS_INLINE void cross_cell(const nb_cell_node *node, uint32_t child, const nb_shaft_rays *rays,
                                 nb_shaft_interval *found)
{
    const float low_x = node->low[0][child], high_x = node->high[0][child];
    const float low_y = node->low[1][child], high_y = node->high[1][child];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float x = rays->start[0][i], y = rays->start[1][i], ix = rays->inverse[0][i], iy = rays->inverse[1][i];
        const float ax = (low_x - x) * ix, bx = (high_x - x) * ix, ay = (low_y - y) * iy, by = (high_y - y) * iy;
        const float near_x = ax < bx ? ax : bx, far_x = ax < bx ? bx : ax;
        const float near_y = ay < by ? ay : by, far_y = ay < by ? by : ay;
        float enter = rays->from[i], leave = rays->to[i];
        enter = near_x > enter ? near_x : enter;
        enter = near_y > enter ? near_y : enter;
        leave = far_x < leave ? far_x : leave;
        leave = far_y < leave ? far_y : leave;
        found->enter[i] = enter;
        found->leave[i] = leave;
    }
}

NB_ALWAYS_INLINE void cross_prism(const nb_prism *prism, const nb_shaft_rays *rays, nb_shaft_interval *found)
{
    for (int i = 0; i < NB_PACKET; i++) {
        found->enter[i] = rays->from[i];
        found->leave[i] = rays->to[i];
    }
    for (int k = 0; k < 3; k++) nb_cut_side(prism->planes[k], rays, found);
    nb_cut(prism->planes[3], rays, found);
}

/* Prisms that were cut out of the rays not long ago: a triangle is in all cells that it touches. */
enum { RECENT = 64 };

typedef struct nb_recent {
    uint32_t children[RECENT];
} nb_recent;

NB_ALWAYS_INLINE int is_recent(const nb_recent *recent, uint32_t child)
{
    return recent->children[child % RECENT] == child;
}

/* Returns 0 when memory is out. */
NB_CLONES static int walk(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_sun_cells *cells,
                          const nb_beam *beam, nb_shaft_rays *rays)
{
    nb_shaft_visit visits[SUN_VISITS];
    nb_recent recent;
    memset(&recent, 0, sizeof recent); /* of no prism: that of a node */
    int count = list_children(cells->nodes, 0, beam, visits);
    while (count > 0) {
        const nb_shaft_visit visit = visits[--count];
        const nb_cell_node *node = &cells->nodes[visit.child / NB_CELL_FAN];
        const uint32_t place = visit.child % NB_CELL_FAN, child = node->child[place];
        nb_shaft_interval found;
        int fresh[NB_PACKET];
        if (is_recent(&recent, child) || !is_open(&visit, rays)) continue;
        if (visit.is_dark) {
            cross_cell(node, place, rays, &found);
        } else if ((child & NB_IS_PRISM) != 0) {
            const uint32_t prism = child & ~NB_IS_PRISM;
            recent.children[child % RECENT] = child;
            const nb_masked_occluder *sheet = nb_sun_cells_sheet(cells, prism);
            cross_prism(&cells->prisms[prism], rays, &found);
            if (sheet != NULL && !nb_masked_triangle_cast(sheet, NULL, shafts, allocator, &found, rays)) return 0;
            if (sheet != NULL) continue;
        } else {
            count += list_children(cells->nodes, child, beam, visits + count);
            continue;
        }
        if (nb_extend(&found, rays, fresh) && !nb_replace(shafts, allocator, &found, fresh, rays)) return 0;
    }
    return 1;
}

/* ---- boundaries --------------------------------------------------------------------------------- */

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
static void sort_by_lane(nb_sun_shafts *shafts, size_t ends[NB_PACKET])
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
static void boundary(nb_sun_shafts *shafts, float t)
{
    shafts->boundaries[shafts->boundary_count++] = nb_most(t, 0);
}

/* The shadows of one lane, sorted, as boundaries. */
static void join(nb_sun_shafts *shafts, const nb_shadow *shadows, size_t count, float skipped)
{
    float enter = shadows[0].enter, leave = shadows[0].leave;
    for (size_t i = 1; i < count; i++) {
        if (shadows[i].enter > leave + nb_closeness * fabsf(leave)) {
            boundary(shafts, enter + skipped);
            boundary(shafts, leave + skipped);
            enter = shadows[i].enter;
            leave = shadows[i].leave;
        }
        leave = nb_most(leave, shadows[i].leave);
    }
    boundary(shafts, enter + skipped);
    boundary(shafts, leave + skipped);
}

static int reserve_boundaries(nb_sun_shafts *shafts, const nebel_allocator *allocator, size_t more)
{
    void *boundaries = shafts->boundaries;
    const int grown = nb_grow(allocator, &boundaries, sizeof *shafts->boundaries, shafts->boundary_count,
                              &shafts->boundary_capacity, shafts->boundary_count + more);
    shafts->boundaries = boundaries;
    return grown;
}

static int reserve_shadows(nb_sun_shafts *shafts, const nebel_allocator *allocator)
{
    void *sorted = shafts->sorted;
    const int grown =
        nb_grow(allocator, &sorted, sizeof *shafts->sorted, 0, &shafts->sorted_capacity, shafts->shadow_count);
    shafts->sorted = sorted;
    return grown && reserve_boundaries(shafts, allocator, 2 * shafts->shadow_count);
}

int nb_sun_shafts_finish(nb_sun_shafts *shafts, const nebel_allocator *allocator, nb_shaft_rays *rays,
                         const float *length, double advance, uint32_t *first)
{
    for (uint32_t i = 0; i < NB_PACKET; i++)
        if (!nb_sun_shafts_keep(shafts, allocator, i, rays)) return 0;
    size_t ends[NB_PACKET], begin = 0;
    if (shafts->shadow_count > 0 && !reserve_shadows(shafts, allocator)) return 0;
    if (shafts->shadow_count > 0) sort_by_lane(shafts, ends);
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        first[i] = (uint32_t)shafts->boundary_count;
        if (shafts->shadow_count == 0 || ends[i] == begin) continue;
        join(shafts, shafts->sorted + begin, ends[i] - begin, (float)(advance * (double)length[i]));
        begin = ends[i];
    }
    return 1;
}

/* By the prisms behind triangles. Returns 0 when memory is out. */
static int find_by_prisms(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_sun_cells *cells,
                          const float *length, double advance, uint32_t *first, nb_shaft_rays *packet)
{
    for (int i = 0; i < NB_PACKET; i++) {
        packet->enter[i] = INFINITY;
        packet->leave[i] = -INFINITY;
        packet->kept[i] = 0;
    }
    nb_beam beam;
    nb_beam_set(&beam, packet);
    shafts->shadow_count = 0;
    return walk(shafts, allocator, cells, &beam, packet) &&
           nb_sun_shafts_finish(shafts, allocator, packet, length, advance, first);
}

/* What of the passages of a ray is asked for, as boundaries. There is room for them. */
static void add_crossings(nb_sun_shafts *shafts, const nb_boundary_crossings *passages, int ray, int is_dark,
                          float from, float to, float skipped)
{
    int k = 0;
    for (; k < passages->count && passages->rows[k][ray] <= from; k++) is_dark = nb_enters(passages->rows[k][ray]);
    if (is_dark) boundary(shafts, from + skipped);
    for (; k < passages->count && passages->rows[k][ray] < to; k++) {
        is_dark = nb_enters(passages->rows[k][ray]);
        boundary(shafts, passages->rows[k][ray] + skipped);
    }
    if (is_dark) boundary(shafts, to + skipped);
}

/* By walls, from the eye on. Returns 0 where that is not possible. */
static int find_passages_from_eye(const nb_shadow_boundaries *walls, const nb_shaft_rays *packet, const float *skipped,
                                  int is_dark, nb_boundary_crossings *passages)
{
    nb_shaft_rays rays = *packet;
    nb_beam beam;
    for (int i = 0; i < NB_PACKET; i++) rays.from[i] = packet->from[i] < packet->to[i] ? -skipped[i] : INFINITY;
    nb_beam_set(&beam, &rays);
    return nb_boundary_crossings_find(walls, &beam, &rays, is_dark, passages);
}

static int find_sun_packet(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_sun_cells *cells,
                           const nb_ray_batch *rays, double advance, nb_eye_visibility eye, int first,
                           nb_shaft_rays *packet)
{
    nb_boundary_crossings passages;
    float skipped[NB_PACKET];
    turn_packet(cells, rays, first, packet);
    for (int i = 0; i < NB_PACKET; i++) skipped[i] = (float)(advance * (double)rays->length[first + i]);
    const int by_walls = eye != NB_EYE_UNKNOWN && cells->walls.level_count > 0 &&
                         find_passages_from_eye(&cells->walls, packet, skipped, eye == NB_EYE_IN_SHADOW, &passages);
    shafts->by_walls += (size_t)by_walls;
    shafts->by_prisms += (size_t)!by_walls;
    if (!by_walls)
        return find_by_prisms(shafts, allocator, cells, rays->length + first, advance, shafts->first + first, packet);
    if (!reserve_boundaries(shafts, allocator, (size_t)(passages.count + 2) * NB_PACKET)) return 0;
    for (int i = 0; i < NB_PACKET; i++) {
        shafts->first[first + i] = (uint32_t)shafts->boundary_count;
        if (packet->from[i] < packet->to[i])
            add_crossings(shafts, &passages, i, eye == NB_EYE_IN_SHADOW, packet->from[i], packet->to[i], skipped[i]);
    }
    return 1;
}

nebel_result nb_sun_shafts_find(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_sun_cells *cells,
                                const nb_lit_box *box, const nb_ray_batch *rays, double advance, const float *distance,
                                nb_eye_visibility eye)
{
    float from[NB_BATCH], to[NB_BATCH];
    clip(box, rays, advance, distance, from, to);
    shafts->boundary_count = 0;
    for (int p = 0; p < NB_BATCH; p += NB_PACKET) {
        for (int i = 0; i < NB_PACKET; i++) shafts->first[p + i] = (uint32_t)shafts->boundary_count;
        if (cells->node_count == 0 || nb_is_empty(from + p, to + p)) continue;
        nb_shaft_rays packet;
        for (int i = 0; i < NB_PACKET; i++) {
            packet.from[i] = from[p + i];
            packet.to[i] = to[p + i];
        }
        if (!find_sun_packet(shafts, allocator, cells, rays, advance, eye, p, &packet)) return NEBEL_ERROR_MEMORY;
    }
    shafts->first[NB_BATCH] = (uint32_t)shafts->boundary_count;
    return NEBEL_OK;
}

void nb_sun_shafts_free(nb_sun_shafts *shafts, const nebel_allocator *allocator)
{
    nb_release(allocator, shafts->shadows);
    nb_release(allocator, shafts->sorted);
    nb_release(allocator, shafts->boundaries);
}
