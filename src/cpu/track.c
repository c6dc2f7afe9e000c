#include "track.h"

#include <math.h>
#include <string.h>

/* Where there is emission, a piece is stopped in at least so often. */
#define STOPS_OF_EMISSION 4

/* Weights below this are left to roulette. */
#define SMALL_WEIGHT 1e-3

/* A piece of a track, with the rate at which chance stops in it. */
typedef struct piece {
    double end, rate; /* m, 1/m */
} piece;

double nb_track_reach(const nebel_ray *ray)
{
    double reach = ray->t_max;
    for (int i = 0; i < 3; i++) {
        const double far = copysign(NEBEL_MAX_LENGTH, ray->direction[i]);
        if (ray->direction[i] != 0) reach = fmin(reach, (1 - 1e-12) * (far - ray->origin[i]) / ray->direction[i]);
    }
    return fmax(reach, 0);
}

static double largest(const double rgb[3])
{
    return fmax(rgb[0], fmax(rgb[1], rgb[2]));
}

static nebel_result next_piece(const nb_track *track, double t, double reach, int wants_emission, piece *p)
{
    nebel_bound bound;
    const nebel_result result = nebel_bound_fog(track->fog, &track->ray, track->ignore_distances, t, &bound);
    if (result != NEBEL_OK) return result;
    p->rate = bound.extinction[track->channel];
    if (wants_emission && largest(bound.emission) > 0) {
        if (p->rate == 0 && isinf(bound.end) && isinf(track->ray.t_max)) return NEBEL_ERROR_UNBOUNDED;
        p->rate = fmax(p->rate, STOPS_OF_EMISSION / (fmin(bound.end, reach) - t));
    }
    p->end = fmin(bound.end, reach);
    return NEBEL_OK;
}

nebel_result nb_track_look(const nb_track *track, double t, nebel_place *place, nebel_matter *matter)
{
    const nebel_ray *ray = &track->ray;
    for (int i = 0; i < 3; i++) place->position[i] = ray->origin[i] + t * ray->direction[i];
    place->distance = track->ignore_distances ? -1 : t;
    return nebel_sample_fog(track->fog, 1, place, sizeof *place, matter, sizeof *matter);
}

/* The way to the next stop at this rate. */
static double draw_way(double rate, nb_chance *chance)
{
    return rate > 0 ? -log1p(-nb_chance_next(chance)) / rate : HUGE_VAL;
}

nebel_result nb_track_fly(const nb_track *track, nb_chance *chance, nb_flight *flight)
{
    const double reach = track->fog != NULL ? nb_track_reach(&track->ray) : 0;
    memset(flight, 0, sizeof *flight);
    for (double t = 0; t < reach;) {
        piece p;
        nebel_result result = next_piece(track, t, reach, 1, &p);
        if (result != NEBEL_OK) return result;
        while ((t += draw_way(p.rate, chance)) < p.end) {
            result = nb_track_look(track, t, &flight->place, &flight->matter);
            if (result != NEBEL_OK) return result;
            for (int c = 0; c < 3; c++) flight->shone[c] += flight->matter.emission[c] / p.rate;
            flight->collided = nb_chance_next(chance) * p.rate < flight->matter.extinction[track->channel];
            flight->t = t;
            if (flight->collided) return NEBEL_OK;
        }
        t = p.end;
    }
    return NEBEL_OK;
}

/* 0: the weight is gone. */
static int survives(double *weight, nb_chance *chance)
{
    if (*weight >= SMALL_WEIGHT) return 1;
    *weight = nb_chance_next(chance) * SMALL_WEIGHT < *weight ? SMALL_WEIGHT : 0;
    return *weight > 0;
}

nebel_result nb_track_transmittance(const nb_track *track, nb_chance *chance, double *transmittance)
{
    const double reach = track->fog != NULL ? nb_track_reach(&track->ray) : 0;
    double weight = 1;
    *transmittance = 0;
    for (double t = 0; t < reach;) {
        piece p;
        nebel_result result = next_piece(track, t, reach, 0, &p);
        if (result != NEBEL_OK) return result;
        while ((t += draw_way(p.rate, chance)) < p.end) {
            nebel_place place;
            nebel_matter matter;
            result = nb_track_look(track, t, &place, &matter);
            if (result != NEBEL_OK) return result;
            weight *= fmax(1 - matter.extinction[track->channel] / p.rate, 0);
            if (!survives(&weight, chance)) return NEBEL_OK;
        }
        t = p.end;
    }
    *transmittance = weight;
    return NEBEL_OK;
}
