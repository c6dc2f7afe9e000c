#include "packet_beam.h"

/* What rays do along an axis. */
typedef struct nb_spread {
    float low, high, way_low, way_high; /* places where the beam begins; changes of them for each m */
} nb_spread;

NB_ALWAYS_INLINE float least_of_lanes(float *values)
{
    for (int half = NB_PACKET / 2; half > 0; half /= 2) {
        NB_SIMD
        for (int i = 0; i < half; i++) values[i] = values[i + half] < values[i] ? values[i + half] : values[i];
    }
    return values[0];
}

NB_ALWAYS_INLINE float most_of_lanes(float *values)
{
    for (int half = NB_PACKET / 2; half > 0; half /= 2) {
        NB_SIMD
        for (int i = 0; i < half; i++) values[i] = values[i + half] > values[i] ? values[i + half] : values[i];
    }
    return values[0];
}

NB_ALWAYS_INLINE nb_spread spread_along(const nb_shaft_rays *rays, int axis, float from)
{
    float low[NB_PACKET], high[NB_PACKET], way_low[NB_PACKET], way_high[NB_PACKET];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float way = rays->way[axis][i], start = rays->start[axis][i] + way * from;
        const int counts = rays->from[i] < rays->to[i];
        low[i] = counts ? start : INFINITY;
        high[i] = counts ? start : -INFINITY;
        way_low[i] = counts ? way : INFINITY;
        way_high[i] = counts ? way : -INFINITY;
    }
    nb_spread s = {least_of_lanes(low), most_of_lanes(high), least_of_lanes(way_low), most_of_lanes(way_high)};
    const float rounding = 0x1p-21f * (s.high > -s.low ? s.high : -s.low);
    s.low -= rounding;
    s.high += rounding;
    return s;
}

/* Where rays part, some rising and some falling, they enter by the low border if at all, and never leave. */
NB_ALWAYS_INLINE void set_axis(nb_beam *beam, int axis, const nb_spread *s)
{
    const nb_border low = {s->high, nb_reciprocal(s->way_high), 0}, high = {s->low, nb_reciprocal(s->way_low), 0};
    beam->falls[axis] = s->way_high < 0;
    beam->enter[axis] = beam->falls[axis] ? high : low;
    beam->leave[axis] = beam->falls[axis] ? low : high;
    if (s->way_low < 0 && s->way_high >= 0) beam->leave[axis] = (nb_border){0, 0, INFINITY};
}

NB_CLONES static void set_beam(nb_beam *beam, const nb_shaft_rays *rays)
{
    float first[NB_PACKET], last[NB_PACKET];
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const int counts = rays->from[i] < rays->to[i];
        first[i] = counts ? rays->from[i] : INFINITY;
        last[i] = counts ? rays->to[i] : -INFINITY;
    }
    const float from = least_of_lanes(first);
    beam->from = from;
    beam->length = most_of_lanes(last) - from;
    for (int axis = 0; axis < 2; axis++) {
        const nb_spread s = spread_along(rays, axis, from);
        set_axis(beam, axis, &s);
    }
    const nb_spread s = spread_along(rays, 2, from);
    beam->rises = s.way_high >= 0;
    beam->depth = (nb_border){s.high, nb_reciprocal(s.way_high), 0};
    beam->most = s.high;
    beam->most_rise = s.way_high;
    beam->least = s.low;
    beam->least_rise = s.way_low;
}

void nb_beam_set(nb_beam *beam, const nb_shaft_rays *rays)
{
    set_beam(beam, rays);
}
