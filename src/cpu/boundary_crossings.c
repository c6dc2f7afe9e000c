#include "boundary_crossings.h"

enum { WALL_VISITS = NB_WALL_LEVELS * NB_WALL_FAN };

typedef struct nb_crossing_visit {
    int level;
    uint32_t node;
} nb_crossing_visit;

/* Children that the beam may meet, as bits. */
NB_ALWAYS_INLINE uint32_t meet_walls(const nb_wall_node *node, const nb_beam *beam)
{
    const float *restrict first_x = beam->falls[0] ? node->high[0] : node->low[0];
    const float *restrict last_x = beam->falls[0] ? node->low[0] : node->high[0];
    const float *restrict first_y = beam->falls[1] ? node->high[1] : node->low[1];
    const float *restrict last_y = beam->falls[1] ? node->low[1] : node->high[1];
    const nb_beam b = *beam;
    const int least_rises = b.least_rise >= 0, most_rises = b.most_rise >= 0;
    uint32_t children = 0;
    NB_SIMD
    for (int i = 0; i < NB_WALL_FAN; i++) {
        float enter, leave;
        NB_BEAM_CROSS(&b, first_x[i], last_x[i], first_y[i], last_y[i], enter, leave);
        const float high = b.least + b.least_rise * (least_rises ? enter : leave);
        const float deep = b.most + b.most_rise * (most_rises ? leave : enter);
        const int meets = (enter <= leave) & (deep >= node->top[i]) & (high <= node->bottom[i]);
        children |= meets ? 1u << i : 0;
    }
    return children;
}

/* Puts a passage of each ray where it belongs. Returns 0 where there is no room. */
NB_ALWAYS_INLINE int sort_in(float *restrict passage, nb_boundary_crossings *passages)
{
    int any = 0;
    for (int k = 0; k < passages->count; k++) {
        float *restrict row = passages->rows[k];
        NB_SIMD
        for (int i = 0; i < NB_PACKET; i++) {
            const float a = row[i], b = passage[i];
            row[i] = a < b ? a : b;
            passage[i] = a < b ? b : a;
        }
    }
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) any |= passage[i] < INFINITY;
    if (!any) return 1;
    if (passages->count == NB_MAX_PASSAGES) return 0;
    memcpy(passages->rows[passages->count++], passage, sizeof passages->rows[0]);
    return 1;
}

/* A ray passes between both ends of a wall if it has them on different sides. Which end is on which side is the same for
 * all walls that have this end in common, so that no ray slips through between them. */
NB_ALWAYS_INLINE int pass_wall(const nb_shadow_boundary *wall, const nb_shaft_rays *rays, const float *restrict scale,
                               nb_boundary_crossings *passages)
{
    const nb_shadow_boundary w = *wall;
    uint32_t passage[NB_PACKET];
    float sorted[NB_PACKET];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float way_x = rays->way[0][i], way_y = rays->way[1][i];
        const float ax = w.from[0] - rays->start[0][i], ay = w.from[1] - rays->start[1][i];
        const float bx = w.to[0] - rays->start[0][i], by = w.to[1] - rays->start[1][i];
        const float a = way_x * ay - way_y * ax, b = way_x * by - way_y * bx, apart = a - b;
        const float u = a / (apart != 0 ? apart : 1);
        const float t = ((ax + u * (bx - ax)) * way_x + (ay + u * (by - ay)) * way_y) * scale[i];
        const float depth = rays->start[2][i] + t * rays->way[2][i];
        const int passes = ((a < 0) != (b < 0)) & (depth >= w.top[0] + u * (w.top[1] - w.top[0])) &
                           (depth <= w.bottom[0] + u * (w.bottom[1] - w.bottom[0])) & (t >= rays->from[i]) &
                           (t < rays->to[i]);
        union {
            float t;
            uint32_t bits;
        } number = {t};
        const uint32_t enters = a < 0 ? 0u : 1u;
        passage[i] = passes ? (number.bits & ~1u) | enters : 0x7f800000u; /* INFINITY */
    }
    memcpy(sorted, passage, sizeof sorted);
    return sort_in(sorted, passages);
}

NB_ALWAYS_INLINE int alternate(const nb_boundary_crossings *passages, int is_dark)
{
    uint32_t dark[NB_PACKET], wrong = 0;
    for (int i = 0; i < NB_PACKET; i++) dark[i] = (uint32_t)is_dark;
    for (int k = 0; k < passages->count; k++) {
        uint32_t row[NB_PACKET];
        memcpy(row, passages->rows[k], sizeof row);
        NB_SIMD
        for (int i = 0; i < NB_PACKET; i++) {
            const uint32_t is_there = row[i] != 0x7f800000u, enters = row[i] & 1;
            wrong |= is_there & ~(dark[i] ^ enters);
            dark[i] = enters;
        }
    }
    return (wrong & 1) == 0;
}

NB_CLONES static int find_passages(const nb_shadow_boundaries *walls, const nb_beam *beam, const nb_shaft_rays *rays,
                                   int is_dark, nb_boundary_crossings *passages)
{
    nb_crossing_visit visits[WALL_VISITS];
    float scale[NB_PACKET];
    int count = 1;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float x = rays->way[0][i], y = rays->way[1][i], square = x * x + y * y;
        scale[i] = 1 / (square > 1e-30f ? square : 1e-30f);
    }
    passages->count = 0;
    visits[0] = (nb_crossing_visit){walls->level_count - 1, 0};
    while (count > 0) {
        const nb_crossing_visit visit = visits[--count];
        uint32_t children = meet_walls(&walls->levels[visit.level][visit.node], beam);
        for (; children != 0; children &= children - 1) {
            const uint32_t child = NB_WALL_FAN * visit.node + (uint32_t)__builtin_ctz(children);
            if (visit.level > 0)
                visits[count++] = (nb_crossing_visit){visit.level - 1, child};
            else if (!pass_wall(&walls->walls[child], rays, scale, passages))
                return 0;
        }
    }
    return alternate(passages, is_dark);
}

int nb_boundary_crossings_find(const nb_shadow_boundaries *walls, const nb_beam *beam, const nb_shaft_rays *rays,
                               int is_dark, nb_boundary_crossings *passages)
{
    return find_passages(walls, beam, rays, is_dark, passages);
}
