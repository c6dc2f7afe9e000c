#include "delta_tracking.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* Where there is emission, a piece is stopped in at least so often. */
#define STOPS_OF_EMISSION 4

/* Weights below this are left to roulette. */
#define SMALL_WEIGHT 1e-3

/* Depth that flights through air alone collide by beyond its own: half of it spread as that is, half evenly over pieces. Less
 * where there are other media on the way, which most light comes from. */
#define MORE_DEPTH 1.5
#define MORE_DEPTH_AMID_OTHERS 0.5

/* Air that is thinner yet is none. */
#define MOST_BOOST 1e9

/* There stops are so many times more often than collisions, by which weights of those that pass stay small. */
#define STOPS_OF_AIR 8

/* A piece of a track, with the rate at which chance stops in it. */
typedef struct nb_majorant_piece {
    double end, rate; /* m, 1/m */
    double boost;     /* collisions are so many times more often than the extinction says */
} nb_majorant_piece;

/* How flights through air alone are to collide. */
typedef struct boosts {
    double depth; /* of such pieces, by their bounds */
    int pieces;
    double more; /* depth to add */
} boosts;

double nb_tracking_reach(const nebel_ray *ray)
{
    double reach = ray->t_max;
    for (int i = 0; i < 3; i++) {
        const double far = copysign(NEBEL_MAX_LENGTH, ray->direction[i]);
        if (ray->direction[i] != 0) reach = fmin(reach, (1 - 1e-12) * (far - ray->origin[i]) / ray->direction[i]);
    }
    return fmax(reach, 0);
}

static void start_walk(const nb_tracker *track, nb_media_part part, nb_media_walk *walk)
{
    nb_media_walk_start(track->media, &track->ray, track->ignore_distances, part, walk);
}

/* How much air alone is on the way. */
static nebel_result find_boosts(const nb_tracker *track, double reach, boosts *air)
{
    nb_media_walk walk;
    *air = (boosts){.more = MORE_DEPTH};
    if (!track->is_boosted) return NEBEL_OK;
    start_walk(track, NB_MEDIA_ALL, &walk);
    for (double t = 0; t < reach;) {
        const nebel_result result = nb_media_walk_to(&walk, t);
        if (result != NEBEL_OK) return result;
        const double end = fmin(walk.end, reach), rate = walk.extinction[track->channel];
        if (walk.is_air && rate > 0) {
            air->depth += rate * (end - t);
            air->pieces++;
        } else if (rate > 0) {
            air->more = MORE_DEPTH_AMID_OTHERS;
        }
        t = end;
    }
    return NEBEL_OK;
}

/* Of a piece of air alone. */
static void set_boost(const boosts *air, double from, nb_majorant_piece *p)
{
    const double depth = p->rate * (p->end - from);
    if (!(depth > 0)) return;
    p->boost = fmin(1 + 0.5 * air->more * (1 / air->depth + 1 / (air->pieces * depth)), MOST_BOOST);
    p->rate *= STOPS_OF_AIR * p->boost;
}

static nebel_result next_piece(const nb_tracker *track, nb_media_walk *walk, double t, double reach, const boosts *air,
                               nb_majorant_piece *p)
{
    const nebel_result result = nb_media_walk_to(walk, t);
    if (result != NEBEL_OK) return result;
    p->rate = walk->extinction[track->channel];
    p->boost = 1;
    p->end = fmin(walk->end, reach);
    if (nb_vector_largest(walk->emission) > 0) {
        if (p->rate == 0 && isinf(walk->end) && isinf(track->ray.t_max)) return NEBEL_ERROR_UNBOUNDED;
        p->rate = fmax(p->rate, STOPS_OF_EMISSION / (p->end - t));
    }
    if (track->is_boosted && walk->is_air) set_boost(air, t, p);
    return NEBEL_OK;
}

nebel_result nb_tracking_look(const nb_tracker *track, double t, nb_media_part part, nebel_sample_point *place,
                              nb_matter *matter)
{
    const nebel_ray *ray = &track->ray;
    for (int i = 0; i < 3; i++) place->position[i] = ray->origin[i] + t * ray->direction[i];
    place->distance = track->ignore_distances ? -1 : t;
    return nb_media_look(track->media, place, part, matter);
}

/* The way to the next stop at this rate. */
static double draw_way(double rate, nb_rng *chance)
{
    return rate > 0 ? -log1p(-nb_rng_next(chance)) / rate : HUGE_VAL;
}

/* Whether the flight ends at its stop, by chance, with what it weighs from there on. */
static int collides(const nb_majorant_piece *p, double extinction, nb_rng *chance, double *weight)
{
    const double part = p->boost * extinction / p->rate;
    if (nb_rng_next(chance) * p->rate < p->boost * extinction) {
        *weight /= p->boost;
        return 1;
    }
    if (p->boost > 1) *weight *= (1 - extinction / p->rate) / (1 - part);
    return 0;
}

nebel_result nb_tracking_fly(const nb_tracker *track, nb_rng *chance, nb_free_flight *flight)
{
    const double reach = !nb_media_are_empty(track->media) ? nb_tracking_reach(&track->ray) : 0;
    nb_media_walk walk;
    boosts air;
    memset(flight, 0, sizeof *flight);
    flight->weight = 1;
    nebel_result result = find_boosts(track, reach, &air);
    start_walk(track, NB_MEDIA_ALL, &walk);
    for (double t = 0; t < reach && result == NEBEL_OK;) {
        nb_majorant_piece p;
        result = next_piece(track, &walk, t, reach, &air, &p);
        while (result == NEBEL_OK && (t += draw_way(p.rate, chance)) < p.end) {
            result = nb_tracking_look(track, t, NB_MEDIA_ALL, &flight->place, &flight->matter);
            if (result != NEBEL_OK) return result;
            for (int c = 0; c < 3; c++) flight->shone[c] += flight->weight * flight->matter.all.emission[c] / p.rate;
            flight->t = t;
            flight->collided = collides(&p, flight->matter.all.extinction[track->channel], chance, &flight->weight);
            if (flight->collided) return NEBEL_OK;
        }
        t = p.end;
    }
    return result;
}

/* 0: the weight is gone. */
static int weight_survives(double *weight, nb_rng *chance)
{
    if (*weight >= SMALL_WEIGHT) return 1;
    *weight = nb_rng_next(chance) * SMALL_WEIGHT < *weight ? SMALL_WEIGHT : 0;
    return *weight > 0;
}

nebel_result nb_tracking_transmittance(const nb_tracker *track, nb_rng *chance, double *transmittance)
{
    const double reach = !nb_media_are_empty(track->media) ? nb_tracking_reach(&track->ray) : 0;
    const int channel = track->channel;
    const double air = nb_media_air_transmittance(track->media, &track->ray, channel);
    double weight = 1;
    *transmittance = 0;
    if (!(air > 0)) return NEBEL_OK;
    nb_media_walk walk;
    start_walk(track, NB_MEDIA_WITHOUT_AIR, &walk);
    for (double t = 0; t < reach;) {
        nebel_result result = nb_media_walk_to(&walk, t);
        if (result != NEBEL_OK) return result;
        const double rate = walk.extinction[channel], end = fmin(walk.end, reach);
        while ((t += draw_way(rate, chance)) < end) {
            nebel_sample_point place;
            nb_matter matter;
            result = nb_tracking_look(track, t, NB_MEDIA_WITHOUT_AIR, &place, &matter);
            if (result != NEBEL_OK) return result;
            weight *= fmax(1 - matter.all.extinction[channel] / rate, 0);
            if (!weight_survives(&weight, chance)) return NEBEL_OK;
        }
        t = end;
    }
    *transmittance = air * weight;
    return NEBEL_OK;
}
