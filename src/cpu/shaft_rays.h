/* A packet of rays, and what shadows leave of it: what those of the sun and those of point lights have in common. */
#ifndef NB_CPU_SHAFT_RAYS_H
#define NB_CPU_SHAFT_RAYS_H

#include "sun_shafts.h"

#include <math.h>

/* Shadows that are nearer to each other than this part of the way there are one: the triangles of a surface have
 * common edges, but their shadows meet to rounding only. */
static const float nb_closeness = 0x1p-18f;

/* Never 0, so that nothing is divided into NaN. */
NB_ALWAYS_INLINE float nb_reciprocal(float x)
{
    const float size = x < 0 ? -x : x;
    const float least = x < 0 ? -1e-30f : 1e-30f;
    return 1 / (size < 1e-30f ? least : x);
}

/* A packet of rays in the sun's frame, or relative to a point light. */
typedef struct nb_shaft_rays {
    float start[3][NB_PACKET], way[3][NB_PACKET], inverse[3][NB_PACKET];
    float from[NB_PACKET], to[NB_PACKET];     /* what of them is in fog that is lit; from >= to: nothing */
    float enter[NB_PACKET], leave[NB_PACKET]; /* the shadow that was found last; enter > leave: none yet */
    size_t kept[NB_PACKET];                   /* the number of the one that was kept before, and 1; 0: none yet */
} nb_shaft_rays;

/* What of each ray is within the box and asked for, in m from its start. */
void nb_sun_shafts_clip(const nb_lit_box *box, const nb_ray_batch *rays, double advance, const float *distance,
                        float *from, float *to);

/* Keeps the last shadow of a lane, as a part of the one that was kept before where it touches that. Returns 0 when
 * memory is out. */
int nb_sun_shafts_keep(nb_sun_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, nb_shaft_rays *rays);

/* The boundaries of a packet, of the shadows that were kept and the last one of each ray; `first` is as `offsets` of nebel_ray_visibility.
 * Returns 0 when memory is out. */
int nb_sun_shafts_finish(nb_sun_shafts *shafts, const nebel_allocator *allocator, nb_shaft_rays *rays,
                         const float *length, double advance, uint32_t *first);

/* Whether nothing is asked for of a packet. */
static inline int nb_is_empty(const float *from, const float *to)
{
    int some = 0;
    for (int i = 0; i < NB_PACKET; i++) some |= from[i] < to[i];
    return !some;
}

/* What a prism leaves of each ray. */
typedef struct nb_shaft_interval {
    float enter[NB_PACKET], leave[NB_PACKET];
} nb_shaft_interval;

/* Shadows that touch the last one, at the place where the first of both ends, make it longer; others take its place.
 * Returns whether in any lane there was one that is to be kept; what takes its place is in `found` still. */
NB_ALWAYS_INLINE int nb_extend(const nb_shaft_interval *found, nb_shaft_rays *rays, int *restrict fresh)
{
    int any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float enter = found->enter[i], leave = found->leave[i], first = rays->enter[i], last = rays->leave[i];
        const float end = leave < last ? leave : last, gap = nb_closeness * (end < 0 ? -end : end);
        const int some = enter < leave, touches = (enter <= last + gap) & (leave >= first - gap);
        const float least = enter < first ? enter : first, most = leave > last ? leave : last;
        const int longer = some & touches;
        rays->enter[i] = longer ? least : first;
        rays->leave[i] = longer ? most : last;
        fresh[i] = some & !touches;
    }
    for (int i = 0; i < NB_PACKET; i++) any |= fresh[i];
    return any;
}

static inline int nb_replace(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shaft_interval *found,
                             const int *fresh, nb_shaft_rays *rays)
{
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        if (!fresh[i]) continue;
        if (!nb_sun_shafts_keep(shafts, allocator, i, rays)) return 0;
        rays->enter[i] = found->enter[i];
        rays->leave[i] = found->leave[i];
    }
    return 1;
}

/* What of a ray is on the good side of a plane, which it is `at` m from, in units of the plane, and goes away from by
 * `rise` with each metre. A ray that is level goes away so slowly that it is met beyond all places. */
#define NB_CUT(at, rise, enter, leave)                                                                                 \
    do {                                                                                                               \
        const float steep = (rise) != 0 ? (rise) : 1e-30f, t = -(at) / steep;                                          \
        const float first = steep > 0 ? t : -INFINITY, last = steep > 0 ? INFINITY : t;                                \
        (enter) = first > (enter) ? first : (enter);                                                                   \
        (leave) = last < (leave) ? last : (leave);                                                                     \
    } while (0)

/* One side of a prism. */
NB_ALWAYS_INLINE void nb_cut(const float *plane, const nb_shaft_rays *rays, nb_shaft_interval *stretch)
{
    const float a = plane[0], b = plane[1], c = plane[2], d = plane[3];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float at = a * rays->start[0][i] + b * rays->start[1][i] + c * rays->start[2][i] + d;
        const float rise = a * rays->way[0][i] + b * rays->way[1][i] + c * rays->way[2][i];
        float enter = stretch->enter[i], leave = stretch->leave[i];
        NB_CUT(at, rise, enter, leave);
        stretch->enter[i] = enter;
        stretch->leave[i] = leave;
    }
}

/* One that the third axis runs along. */
NB_ALWAYS_INLINE void nb_cut_side(const float *plane, const nb_shaft_rays *rays, nb_shaft_interval *stretch)
{
    const float a = plane[0], b = plane[1], d = plane[3];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float at = a * rays->start[0][i] + b * rays->start[1][i] + d;
        const float rise = a * rays->way[0][i] + b * rays->way[1][i];
        float enter = stretch->enter[i], leave = stretch->leave[i];
        NB_CUT(at, rise, enter, leave);
        stretch->enter[i] = enter;
        stretch->leave[i] = leave;
    }
}

NB_ALWAYS_INLINE void nb_cross_prism(const nb_prism *prism, const nb_shaft_rays *rays, nb_shaft_interval *found)
{
    for (int i = 0; i < NB_PACKET; i++) {
        found->enter[i] = rays->from[i];
        found->leave[i] = rays->to[i];
    }
    nb_cut(prism->planes[0], rays, found);
    nb_cut(prism->planes[1], rays, found);
    nb_cut(prism->planes[2], rays, found);
    nb_cut(prism->planes[3], rays, found);
}

#endif
