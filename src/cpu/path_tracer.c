#include "path_tracer.h"

#include "math/vector.h"
#include "light_sampling.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Paths that carry less are left to roulette. */
#define SMALL_THROUGHPUT 0.125

/* So often a path sends another one off about the sun where phase functions are peaked; so many may wait. */
#define SUNWARD 0.3
enum { MOST_WAITING = 64 };

/* What of the camera's ray a path stands for. Before air, which is thin, light that it scatters and light from behind it have
 * a path each; fog has one for both. */
typedef enum path_share { ALL, SCATTERED, PASSED } path_share;

/* A path that waits until the one that it left is done. */
typedef struct waiting_path {
    nebel_ray ray;
    double throughput[3], promise;
    uint32_t bounces; /* behind it */
} waiting_path;

/* A path at work. */
typedef struct path {
    const nb_path_scene *world;
    const nb_path_eye *eye;
    path_share share;
    nb_single_ray *lone;
    nb_rng chance;
    int channel;
    nebel_ray ray;
    int is_first;         /* the ray is the camera's */
    double throughput[3]; /* what light from here on counts */
    double promise;       /* how much of the sun the next bounce may send along the path, at least 1 */
    uint32_t bounces;     /* so far */
    waiting_path waiting[MOST_WAITING];
    int waiting_count;
    double radiance[3];
    double shone[3];     /* what it had when its first ray ended */
    double came_through; /* what its first ray left of light from behind the media */
} path;

/* ---- directions ------------------------------------------------------------------------------ */

/* The direction at an angle to the axis, by chance around it. */
static void turn_about(const double axis[3], double cosine, nb_rng *chance, double direction[3])
{
    const double angle = 2 * PI * nb_rng_next(chance), sine = sqrt(fmax(0, 1 - cosine * cosine));
    double across[3] = {0, 0, 0}, third[3];
    int least = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(axis[i]) < fabs(axis[least])) least = i;
    double helper[3] = {0, 0, 0};
    helper[least] = 1;
    nb_vector_cross(axis, helper, across);
    (void)nb_vector_make_unit(across);
    nb_vector_cross(axis, across, third);
    for (int i = 0; i < 3; i++)
        direction[i] = cosine * axis[i] + sine * (cos(angle) * across[i] + sin(angle) * third[i]);
    (void)nb_vector_make_unit(direction);
}

/* Lambert: as often as the cosine. What points below the triangle, where shading normals lean, is mirrored up. */
static void reflect_diffusely(const nb_path_vertex *at, nb_rng *chance, double direction[3])
{
    double normal[3] = {(double)at->normal[0], (double)at->normal[1], (double)at->normal[2]};
    const double side[3] = {(double)at->side[0], (double)at->side[1], (double)at->side[2]};
    (void)nb_vector_make_unit(normal);
    turn_about(normal, sqrt(1 - nb_rng_next(chance)), chance, direction);
    const double below = nb_vector_dot(direction, side);
    for (int i = 0; i < 3 && below < 0; i++) direction[i] -= 2 * below * side[i];
}

/* ---- light ----------------------------------------------------------------------------------- */

static void add_radiance(path *p, const double light[3], double share)
{
    for (int c = 0; c < 3; c++) p->radiance[c] += p->throughput[c] * light[c] * share;
}

/* Adds `share` of the light that comes to a place from a direction, from `reach` away, and gets there past what casts
 * shadows on the first `shadowed` metres of its way. */
static nebel_result add_arriving(path *p, const double origin[3], const double direction[3], double reach,
                                 double shadowed, const double light[3], double share)
{
    const nb_path_scene *world = p->world;
    if (!(share > 0) || nb_meeting_is_shadowed(world->geometry, origin, direction, shadowed)) return NEBEL_OK;
    nb_tracker way = {.media = &world->media, .ray.t_max = reach, .ignore_distances = 1, .channel = p->channel};
    memcpy(way.ray.origin, origin, sizeof way.ray.origin);
    memcpy(way.ray.direction, direction, sizeof way.ray.direction);
    double transmittance = 1;
    nebel_result result = NEBEL_OK;
    if (!nb_media_are_empty(&world->media)) result = nb_tracking_transmittance(&way, &p->chance, &transmittance);
    if (result == NEBEL_OK) add_radiance(p, light, share * transmittance);
    return result;
}

/* Sunlight that reaches a place, `share` of which goes on along the path. */
static nebel_result add_sunlight(path *p, const double origin[3], double share)
{
    const nb_path_scene *world = p->world;
    if (!world->has_sun) return NEBEL_OK;
    const double left = nb_media_sun_left(&world->media, origin, world->to_sun, world->disc);
    return add_arriving(p, origin, world->to_sun, HUGE_VAL, HUGE_VAL, world->sun, left * share);
}

/* ---- point lights ----------------------------------------------------------------------------------- */

/* A ray along which fog may be lit by point lights. */
typedef struct lit_ray {
    nb_tracker track; /* as far as there may be fog */
    double sum;       /* what all point lights weigh along it; 0: none lights it */
} lit_ray;

/* A point light that was chosen for a place, as often as its probability says. */
typedef struct chosen_light {
    const nebel_light *light; /* NULL: none shines there */
    nb_sampled_light sight;
    double probability;
} chosen_light;

static lit_ray light_ray(const nb_path_scene *world, const nb_tracker *track)
{
    lit_ray lit = {.track = *track, .sum = 0};
    if (nb_media_are_empty(&world->media) || world->scene->light_count == 0) return lit;
    lit.track.ray.t_max = nb_tracking_reach(&track->ray);
    lit.sum = nb_lights_sum(world->scene, nb_light_weight_along, &lit.track.ray);
    return lit;
}

static chosen_light choose_light(path *p, const double place[3])
{
    const nebel_scene_data *scene = p->world->scene;
    const nebel_ray here = {.origin = {place[0], place[1], place[2]}};
    const double sum = nb_lights_sum(scene, nb_light_weight_at, &here);
    if (!(sum > 0)) return (chosen_light){.light = NULL};
    const nebel_light *light = nb_lights_choose(scene, nb_light_weight_at, &here, sum, nb_rng_next(&p->chance));
    return (chosen_light){light, nb_light_sight_from(light, place), nb_light_weight_at(light, &here) / sum};
}

/* `share` of the light of point lights that comes to a place in fog, times what the phase function sends along the
 * path. */
static nebel_result add_scattered(path *p, const double place[3], const nb_scatterer *scatterer, const double share[3])
{
    const chosen_light chosen = choose_light(p, place);
    if (chosen.light == NULL) return NEBEL_OK;
    const nb_sampled_light *sight = &chosen.sight;
    const double cosine = fmin(fmax(nb_vector_dot(p->ray.direction, sight->direction), -1), 1);
    const double value = nb_scatterer_value(scatterer, cosine) * sight->fluence / chosen.probability;
    double light[3];
    for (int c = 0; c < 3; c++) light[c] = chosen.light->intensity[c] * share[c];
    return add_arriving(p, place, sight->direction, sight->reach, sight->shadowed, light, value);
}

/* One of the media that scatter at a place, by chance. */
static nebel_result choose_scatterer(path *p, const nebel_sample_point *place, const nb_matter *matter,
                                     nb_scatterer *scatterer)
{
    const nb_path_scene *world = p->world;
    const int channel = world->is_grey ? -1 : p->channel;
    return nb_media_choose(&world->media, place, matter, channel, nb_rng_next(&p->chance), scatterer);
}

/* Places in light are found in two ways: where a flight collides, and as point lights see the ray pass. This is how
 * many there are per metre by both, as if no fog were before them: the balance heuristic of Veach and Guibas,
 * "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995, but for that fog, whose transmittance is
 * known by chance alone. Any weights that add up to 1 are right in the mean. */
static double density_of(const path *p, const lit_ray *lit, double extinction, double t)
{
    return extinction + nb_lights_density(p->world->scene, &lit->track.ray, lit->sum, t);
}

/* Where a flight collides, once the throughput is that of what is scattered there. */
static nebel_result add_colliding_light(path *p, const lit_ray *lit, const nb_free_flight *flight,
                                        const nb_scatterer *scatterer)
{
    if (!(lit->sum > 0)) return NEBEL_OK;
    const double extinction = flight->matter.all.extinction[p->channel];
    const double share = extinction / density_of(p, lit, extinction, flight->t);
    return add_scattered(p, flight->place.position, scatterer, (const double[3]){share, share, share});
}

/* Where a point light sees the ray pass. */
static nebel_result add_passing_light(path *p, const lit_ray *lit)
{
    const nb_path_scene *world = p->world;
    if (!(lit->sum > 0)) return NEBEL_OK;
    const nebel_ray *ray = &lit->track.ray;
    const nebel_light *light =
        nb_lights_choose(world->scene, nb_light_weight_along, ray, lit->sum, nb_rng_next(&p->chance));
    const nb_light_pass passing = nb_passing_of(light, ray);
    nb_tracker way = lit->track;
    way.ray.t_max = nb_passing_draw(&passing, nb_rng_next(&p->chance));
    nebel_sample_point place;
    nb_matter matter;
    nb_scatterer scatterer;
    double transmittance, share[3];
    nebel_result result = nb_tracking_look(&way, way.ray.t_max, NB_MEDIA_ALL, &place, &matter);
    if (result == NEBEL_OK) result = choose_scatterer(p, &place, &matter, &scatterer);
    if (result != NEBEL_OK || scatterer.probability == 0) return result;
    result = nb_tracking_transmittance(&way, &p->chance, &transmittance);
    if (result != NEBEL_OK || transmittance == 0) return result;
    const double density = density_of(p, lit, matter.all.extinction[p->channel], way.ray.t_max);
    for (int c = 0; c < 3; c++) share[c] = transmittance * scatterer.scattering[c] / scatterer.probability / density;
    return add_scattered(p, place.position, &scatterer, share);
}

/* At a surface. */
static nebel_result add_reflected(path *p, const nb_path_vertex *at)
{
    const double normal[3] = {(double)at->normal[0], (double)at->normal[1], (double)at->normal[2]};
    const double side[3] = {(double)at->side[0], (double)at->side[1], (double)at->side[2]};
    if (p->world->scene->light_count == 0) return NEBEL_OK;
    const chosen_light chosen = choose_light(p, p->ray.origin);
    const nb_sampled_light *sight = &chosen.sight;
    if (chosen.light == NULL || nb_vector_dot(side, sight->direction) <= 0) return NEBEL_OK;
    const double share = nb_vector_dot(normal, sight->direction) * sight->beam / (PI * chosen.probability);
    return add_arriving(p, p->ray.origin, sight->direction, sight->reach, sight->shadowed, chosen.light->intensity,
                        share);
}

/* Ambient light from where the path goes on. */
static void add_ambient(path *p)
{
    double ambient[3];
    nebel_evaluate_environment(&p->world->environment, p->ray.direction, ambient);
    add_radiance(p, ambient, 1);
}

/* What is behind everything. */
static void add_background(path *p)
{
    if (p->is_first)
        add_radiance(p, p->eye->background, 1);
    else
        add_ambient(p);
}

/* ---- bounces --------------------------------------------------------------------------------- */

static double cosine_between(const double a[3], const double b[3])
{
    return fmin(fmax(nb_vector_dot(a, b), -1), 1);
}

/* Goes on from a place in a direction with what that counts. */
static void head(path *p, const double place[3], const double direction[3], double weight)
{
    memcpy(p->ray.origin, place, sizeof p->ray.origin);
    memcpy(p->ray.direction, direction, sizeof p->ray.direction);
    p->ray.t_max = HUGE_VAL;
    for (int c = 0; c < 3; c++) p->throughput[c] *= weight;
}

/* Of a direction that is drawn by the phase function, and as often as `part` says by the same about the sun: what each counts,
 * by the balance heuristic. At most 1, so that the weights of many bounces do not drift apart. */
static double weigh(path *p, const nb_turns *turns, double part, const double direction[3])
{
    const double cosine = cosine_between(p->ray.direction, direction);
    const double value = nb_turns_value(turns, cosine);
    p->promise = 1;
    if (part == 0) return value / nb_turns_density(turns, cosine);
    const double sunward = cosine_between(p->world->to_sun, direction);
    p->promise = fmax(1, nb_turns_value(turns, sunward));
    return value / (nb_turns_density(turns, cosine) + part * nb_turns_density(turns, sunward));
}

/* Drops and dust send most light on nearly straight, so that paths that chance turns towards the sun would be rare and bright:
 * more of them are sent there, and all count less. */
static void leave_sunward(path *p, const nb_turns *turns, const double place[3])
{
    path other;
    double direction[3];
    memcpy(&other, p, offsetof(path, waiting));
    turn_about(p->world->to_sun, nb_turns_draw(turns, nb_rng_next(&p->chance)), &p->chance, direction);
    head(&other, place, direction, weigh(&other, turns, SUNWARD, direction));
    waiting_path *next = &p->waiting[p->waiting_count++];
    *next = (waiting_path){.ray = other.ray, .promise = other.promise, .bounces = p->bounces};
    memcpy(next->throughput, other.throughput, sizeof next->throughput);
}

/* Sends the path on. */
static void scatter_path(path *p, const nb_scatterer *scatterer, const double place[3])
{
    const nb_turns *turns = scatterer->turns;
    const double chance = nb_rng_next(&p->chance);
    double direction[3];
    if (turns == NULL) {
        turn_about(p->ray.direction, nebel_sample_phase(&scatterer->phase, chance), &p->chance, direction);
        p->promise = 1;
        head(p, place, direction, 1);
        return;
    }
    const double part = turns->is_peaked && p->world->has_sun && p->waiting_count < MOST_WAITING ? SUNWARD : 0;
    if (part > 0 && nb_rng_next(&p->chance) < part) leave_sunward(p, turns, place);
    turn_about(p->ray.direction, nb_turns_draw(turns, chance), &p->chance, direction);
    head(p, place, direction, weigh(p, turns, part, direction));
}

/* Scatters at a collision. The throughput is 0 where the light is absorbed. */
static nebel_result scatter(path *p, const lit_ray *lit, const nb_free_flight *flight)
{
    const nb_path_scene *world = p->world;
    nb_scatterer scatterer;
    nebel_result result = choose_scatterer(p, &flight->place, &flight->matter, &scatterer);
    if (result != NEBEL_OK) return result;
    for (int c = 0; c < 3; c++) {
        const double scattered = scatterer.probability > 0 ? scatterer.scattering[c] / scatterer.probability : 0;
        p->throughput[c] *= scattered / flight->matter.all.extinction[p->channel];
    }
    if (scatterer.probability == 0) return NEBEL_OK;
    const double cosine = cosine_between(p->ray.direction, world->to_sun);
    result = add_sunlight(p, flight->place.position, nb_scatterer_value(&scatterer, cosine));
    if (result == NEBEL_OK) result = add_colliding_light(p, lit, flight, &scatterer);
    scatter_path(p, &scatterer, flight->place.position);
    return result;
}

static nebel_result reflect(path *p, const nb_path_vertex *at)
{
    const double *origin = p->world->geometry->origin;
    for (int c = 0; c < 3; c++) {
        p->throughput[c] *= (double)at->reflectance[c];
        p->ray.origin[c] = at->is_ground ? at->place[c] : origin[c] + (double)at->start[c];
    }
    reflect_diffusely(at, &p->chance, p->ray.direction);
    p->promise = 1;
    nebel_result result = add_reflected(p, at);
    if (result == NEBEL_OK && at->lit) result = add_sunlight(p, p->ray.origin, (double)at->cosine / PI);
    return result;
}

/* ---- paths ----------------------------------------------------------------------------------- */

/* 0: the path ends, and others carry its light. What goes on just beside the sun is worth more than it carries. */
static int path_survives(path *p)
{
    const double most = p->promise * fmax(p->throughput[0], fmax(p->throughput[1], p->throughput[2]));
    if (most >= SMALL_THROUGHPUT) return 1;
    if (nb_rng_next(&p->chance) * SMALL_THROUGHPUT >= most) return 0;
    for (int c = 0; c < 3; c++) p->throughput[c] *= SMALL_THROUGHPUT / most;
    return 1;
}

/* The first ray of a path of light from behind the media, which has no flight. */
static nebel_result pass_media(path *p, const nb_tracker *track, nb_free_flight *flight)
{
    memset(flight, 0, sizeof *flight);
    return nb_tracking_transmittance(track, &p->chance, &flight->weight);
}

static nebel_result fly(path *p, const nb_tracker *track, const lit_ray *lit, nb_free_flight *flight)
{
    nebel_result result = add_passing_light(p, lit);
    if (result == NEBEL_OK) result = nb_tracking_fly(track, &p->chance, flight);
    if (result == NEBEL_OK) add_radiance(p, flight->shone, 1);
    return result;
}

/* One ray of the path, to its next bounce. *ended: nothing more comes. */
static nebel_result go_on(path *p, const nb_path_vertex *at, nb_free_flight *flight, int *ended)
{
    const nb_path_scene *world = p->world;
    const path_share share = p->is_first ? p->share : ALL;
    const nb_tracker track = {&world->media, p->ray, !p->is_first, p->channel, share == SCATTERED};
    const lit_ray lit = light_ray(world, &track);
    nebel_result result = share == PASSED ? pass_media(p, &track, flight) : fly(p, &track, &lit, flight);
    if (result != NEBEL_OK) return result;
    if (p->is_first) {
        memcpy(p->shone, p->radiance, sizeof p->shone);
        p->came_through = flight->collided ? 0 : flight->weight;
    }
    for (int c = 0; c < 3; c++) p->throughput[c] *= flight->weight;
    const int is_lost = share == SCATTERED && !flight->collided;
    *ended = is_lost || (!flight->collided && at->t == HUGE_VAL);
    if (*ended && !is_lost)
        add_background(p);
    else if (!*ended)
        result = flight->collided ? scatter(p, &lit, flight) : reflect(p, at);
    p->ray.t_max = HUGE_VAL;
    return result;
}

/* Follows a path until it ends; others may wait then. */
static nebel_result follow(path *p, const nb_path_vertex *first)
{
    const nb_path_scene *world = p->world;
    nb_path_vertex at = *first;
    for (;;) {
        nb_free_flight flight;
        int ended;
        p->bounces++;
        const nebel_result result = go_on(p, &at, &flight, &ended);
        if (result != NEBEL_OK) return result;
        p->is_first = 0;
        if (!ended && p->bounces == world->bounces) add_ambient(p);
        if (ended || p->bounces == world->bounces || !path_survives(p)) return NEBEL_OK;
        at = nb_meeting_find(world, &p->ray, p->lone);
    }
}

/* Follows the path of one channel, or of all where they are alike, and those that it leaves. */
static nebel_result follow_all(path *p)
{
    nebel_result result = follow(p, &p->eye->first);
    while (result == NEBEL_OK && p->waiting_count > 0) {
        const waiting_path *next = &p->waiting[--p->waiting_count];
        p->ray = next->ray;
        p->promise = next->promise;
        p->bounces = next->bounces;
        memcpy(p->throughput, next->throughput, sizeof p->throughput);
        if (p->bounces == p->world->bounces || !path_survives(p)) continue;
        const nb_path_vertex at = nb_meeting_find(p->world, &p->ray, p->lone);
        result = follow(p, &at);
    }
    return result;
}

/* Adds a path to the channels that it stands for. */
static void gather_path(const path *p, int is_grey, nb_path_light *light)
{
    for (int k = p->channel; k < (is_grey ? 3 : p->channel + 1); k++) {
        light->color[k] += p->radiance[k];
        if (p->share != SCATTERED) light->transmittance[k] = p->came_through;
        if (p->share == ALL)
            light->in_scattering[k] = p->came_through > 0 ? p->shone[k] : p->radiance[k];
        else if (p->share == SCATTERED)
            light->in_scattering[k] = p->radiance[k];
    }
}

nebel_result nb_path_trace(const nb_path_scene *world, const nb_path_eye *eye, const uint32_t number[4],
                           nb_single_ray *lone, nb_path_light *light)
{
    static const path_share whole[] = {ALL}, parts[] = {SCATTERED, PASSED};
    const int has_air = world->media.planet_count > 0;
    const path_share *shares = has_air ? parts : whole;
    const nb_rng stream = nb_rng_of(number[0], number[1], number[2], number[3]);
    memset(light, 0, sizeof *light);
    for (int c = 0; c < (world->is_grey ? 1 : 3); c++) {
        nb_rng chance = stream;
        chance.state += (uint64_t)c << 62;
        for (int i = 0; i < (has_air ? 2 : 1); i++) {
            path p = {.world = world, .eye = eye, .share = shares[i], .lone = lone, .chance = chance};
            p.channel = c;
            p.ray = eye->ray;
            p.is_first = 1;
            p.promise = 1;
            for (int k = 0; k < 3; k++) p.throughput[k] = world->is_grey || k == c ? 1 : 0;
            const nebel_result result = follow_all(&p);
            if (result != NEBEL_OK) return result;
            chance = p.chance;
            gather_path(&p, world->is_grey, light);
        }
    }
    return NEBEL_OK;
}
