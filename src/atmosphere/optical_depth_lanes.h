/* Optical depth along rays through air, in lanes. Included after formulas/atmosphere.inc, of doubles. */
#ifndef NB_ATMOSPHERE_OPTICAL_DEPTH_LANES_H
#define NB_ATMOSPHERE_OPTICAL_DEPTH_LANES_H

#include "optical_depth.h"

/* Rays in lanes, each as an nb_track. */
typedef struct nb_atmosphere_ray_lanes {
    nb_real radius, rise;
} nb_atmosphere_ray_lanes;

/* How far a ray from the ground or above lies behind the place where it is lowest, off the centre. */
static inline nb_real nb_lowest_radius(nb_atmosphere_ray_lanes track)
{
    return nb_sqrt(nb_max(NB_F(0.0), track.radius * track.radius - track.rise * track.rise));
}

static inline nb_atmosphere_ray_lanes nb_tracks_ahead(nb_atmosphere_ray_lanes track, nb_real length)
{
    const nb_real square = track.radius * track.radius + length * (NB_F(2.0) * track.rise + length);
    return (nb_atmosphere_ray_lanes){nb_sqrt(nb_max(NB_F(0.0), square)), track.rise + length};
}

/* The square of half the chord that a sphere cuts off the ray's line; below 0 where they do not meet. */
static inline nb_real nb_half_chord_square(nb_atmosphere_ray_lanes track, nb_real sphere)
{
    return (sphere - track.radius) * (sphere + track.radius) + track.rise * track.rise;
}

static inline nb_real nb_tracks_leave(nb_atmosphere_ray_lanes track, nb_real sphere)
{
    const nb_real half = nb_sqrt(nb_max(NB_F(0.0), nb_half_chord_square(track, sphere)));
    return nb_max(NB_F(0.0), half - track.rise);
}

/* ---- rays that go up ------------------------------------------------------------------------- */

static inline nb_real nb_density_of(const nb_air_component *air, nb_real height)
{
    if (air->scale > 0) return nb_exp(-height / nb_splat(air->scale));
    return nb_max(NB_F(0.0), NB_F(1.0) - nb_abs(height - nb_splat(air->center)) / nb_splat(air->width));
}

/* How far a ray has come when it is `height` above its start. */
static inline nb_real nb_reach_height(nb_atmosphere_ray_lanes track, nb_real height)
{
    const nb_real climb = nb_max(NB_F(0.0), height) * (NB_F(2.0) * track.radius + height);
    const nb_real way = climb / (track.rise + nb_sqrt(track.rise * track.rise + climb));
    return nb_select(climb > NB_F(0.0), way, NB_F(0.0));
}

/* The density of a layer integrated from a to b, between which it has no edge: it is nearly a parabola of the way. */
static inline nb_real nb_layer_piece(const nb_air_component *air, nb_atmosphere_ray_lanes track, nb_real height,
                                     nb_real a, nb_real b)
{
    static const double nodes[] = {0.2386191860831969, 0.6612093864662645, 0.9324695142031521};
    static const double weights[] = {0.4679139345726910, 0.3607615730481386, 0.1713244923791704};
    const nb_real half = NB_F(0.5) * (b - a);
    nb_real sum = NB_F(0.0);
    for (int i = 0; i < 6; i++) {
        const nb_real s = a + half * nb_splat(1 + (i % 2 ? nodes[i / 2] : -nodes[i / 2]));
        const nb_real here = height + nb_air_height(track.radius, track.rise, s);
        sum = sum + nb_splat(weights[i / 2]) * nb_density_of(air, here);
    }
    return half * sum;
}

static inline nb_real nb_layer_length(const nb_air_component *air, nb_atmosphere_ray_lanes track, nb_real height,
                                      nb_real length)
{
    nb_real from = nb_min(nb_reach_height(track, nb_splat(air->center - air->width) - height), length);
    nb_real sum = NB_F(0.0);
    for (int i = 0; i < 2; i++) {
        const nb_real edge = nb_splat(air->center + i * air->width);
        const nb_real to = nb_max(from, nb_min(nb_reach_height(track, edge - height), length));
        if (nb_any(to > from)) sum = sum + nb_layer_piece(air, track, height, from, to);
        from = to;
    }
    return sum;
}

/* Adds what `length` m meet of each kind of air, in metres of density 1. */
static inline void nb_add_rising(const nb_air_components *airs, nb_atmosphere_ray_lanes track, nb_real length,
                                 nb_real met[])
{
    const nb_real height = track.radius - nb_splat(airs->radius);
    for (int i = 0; i < airs->count; i++) {
        const nb_air_component *air = &airs->airs[i];
        met[i] = met[i] + (air->scale > 0 ? nb_density_of(air, height) *
                                                nb_air_length(track.radius, track.rise, nb_splat(air->scale), length)
                                          : nb_layer_length(air, track, height, length));
    }
}

static inline nb_real nb_depth_of(const nb_air_components *airs, const nb_real met[], int c)
{
    nb_real depth = NB_F(0.0);
    for (int i = 0; i < airs->count; i++) depth = depth + nb_splat(airs->airs[i].extinction[c]) * met[i];
    return depth;
}

/* ---- towards a sun --------------------------------------------------------------------------- */

/* Where the planet hides the sun in whose direction the rays go. */
static inline nb_mask nb_tracks_are_dark(const nb_air_components *airs, nb_atmosphere_ray_lanes track)
{
    return nb_and(track.rise<NB_F(0.0), nb_half_chord_square(track, nb_splat(airs->radius))> NB_F(0.0));
}

/* What rays to the sun meet of each kind of air. Returns the mask of those in the shadow of the planet. A ray that goes down first
 * goes up from its lowest place on both sides. */
static inline nb_mask nb_tracks_meet(const nb_air_components *airs, nb_atmosphere_ray_lanes track,
                                     nb_real met[NEBEL_MAX_COMPONENTS])
{
    const nb_mask dark = nb_tracks_are_dark(airs, track), falls = track.rise < NB_F(0.0);
    for (int i = 0; i < airs->count; i++) met[i] = NB_F(0.0);
    if (nb_all(dark)) return dark;
    const nb_real length = nb_tracks_leave(track, nb_splat(airs->top)), back = nb_select(falls, -track.rise, NB_F(0.0));
    const nb_atmosphere_ray_lanes up = {nb_select(falls, nb_lowest_radius(track), track.radius),
                                        nb_select(falls, NB_F(0.0), track.rise)};
    if (nb_any(nb_and(falls, nb_not(dark)))) nb_add_rising(airs, up, back, met);
    nb_add_rising(airs, up, length - back, met);
    return dark;
}

/* What air leaves of the sun's light: 0 in the shadow of the planet. */
static inline void nb_tracks_sunlight(const nb_air_components *airs, nb_atmosphere_ray_lanes track, nb_real light[3])
{
    nb_real met[NEBEL_MAX_COMPONENTS];
    const nb_mask dark = nb_tracks_meet(airs, track, met);
    for (int c = 0; c < 3; c++) light[c] = nb_select(dark, NB_F(0.0), nb_exp(-nb_depth_of(airs, met, c)));
}

#endif
