/* How much diffuse light leaves the lattice along rays, beside what leaves by diffusion. */
#include "diffusion.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Places on an end along each of its axes, and directions at each. */
enum { PLACES = 6, HEIGHTS = 4, TURNS = 16 };

_Static_assert((int)HEIGHTS *(int)TURNS == (int)NB_DIFFUSION_RAYS, "the rays of a place are gathered at once");

/* Gains beyond these are no matter of where light is near an end. */
#define LEAST_GAIN 0.5
#define MOST_GAIN 2

/* By what factor an end's gain may differ from that of all: what diffusion says of one side of thin fog that scatters
 * forwards is not to be trusted as far as what it says of all. */
#define GAIN_OF_SIDE 1.25

/* Gauss's rule of four nodes for integrals of f(m) from 0 to 1. */
static const double cosines[HEIGHTS] = {0.06943184420297371, 0.33000947820757187, 0.66999052179242813,
                                        0.93056815579702629};
static const double shares[HEIGHTS] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                       0.17392742256872693};

/* What leaves along rays [m^2]: what is diffuse, and all else. */
typedef struct nb_flux_balance {
    double diffuse[3], rest[3];
} nb_flux_balance;

typedef struct nb_energy_survey {
    const nebel_lighting *lighting;
    const nb_diffusion *diffusion;
    double ground[3]; /* radiance of the ground, in the mean */
} nb_energy_survey;

/* The k-th ray inwards, of length 1, with its part of the integral over the cosine and the solid angle. */
static double set_ray(int axis, int side, int k, nebel_ray *ray)
{
    const double cosine = cosines[k / TURNS], sine = sqrt(1 - cosine * cosine);
    const double angle = 2 * PI * (k % TURNS + 0.5) / TURNS;
    ray->direction[axis] = side ? -cosine : cosine;
    ray->direction[(axis + 1) % 3] = sine * cos(angle);
    ray->direction[(axis + 2) % 3] = sine * sin(angle);
    ray->t_max = HUGE_VAL;
    return shares[k / TURNS] * cosine * 2 * PI / TURNS;
}

/* How far a ray goes to the ground, in the lattice; HUGE_VAL: it leaves it elsewhere, or there is none. */
static double way_to_ground(const nb_diffusion_lattice *l, const nebel_ray *ray)
{
    if (l->ends[1][0] != NB_END_GROUND || !(ray->direction[1] < 0)) return HUGE_VAL;
    const double way = (l->low[1] - ray->origin[1]) / ray->direction[1];
    for (int a = 0; a < 3; a += 2) {
        const double at = ray->origin[a] + way * ray->direction[a];
        if (l->ends[a][0] != NB_END_LEVEL && !(l->low[a] <= at && at <= l->high[a])) return HUGE_VAL;
    }
    return way;
}

/* Adds what comes straight from the ground. */
static nebel_result add_ground(const nb_energy_survey *v, nebel_ray rays[NB_DIFFUSION_RAYS],
                               const double weights[NB_DIFFUSION_RAYS], nb_flux_balance *sum)
{
    nebel_transfer transfers[NB_DIFFUSION_RAYS];
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .transmittance_only = 1, .ignore_distances = 1};
    double seen[NB_DIFFUSION_RAYS];
    for (int k = 0; k < NB_DIFFUSION_RAYS; k++) {
        rays[k].t_max = way_to_ground(&v->diffusion->lattice, &rays[k]);
        seen[k] = isfinite(rays[k].t_max) ? weights[k] : 0;
    }
    const nebel_result result =
        nebel_trace(v->diffusion->scaled, &desc, NB_DIFFUSION_RAYS, rays, sizeof *rays, transfers, sizeof *transfers);
    for (int k = 0; k < NB_DIFFUSION_RAYS && result == NEBEL_OK; k++)
        for (int c = 0; c < 3; c++) sum->rest[c] += seen[k] * v->ground[c] * transfers[k].transmittance[c];
    return result;
}

/* Adds what leaves around a place. */
static nebel_result add_place(const nb_energy_survey *v, int axis, int side, const double place[3], double area,
                              nb_flux_balance *sum)
{
    nebel_ray rays[NB_DIFFUSION_RAYS];
    nb_diffusion_gathered gathered[NB_DIFFUSION_RAYS];
    double weights[NB_DIFFUSION_RAYS];
    for (int k = 0; k < NB_DIFFUSION_RAYS; k++) {
        weights[k] = area * set_ray(axis, side, k, &rays[k]);
        for (int a = 0; a < 3; a++) rays[k].origin[a] = place[a];
    }
    const nebel_result result = nb_diffusion_gather(v->lighting, v->diffusion, 0, NB_DIFFUSION_RAYS, rays, gathered);
    for (int k = 0; k < NB_DIFFUSION_RAYS; k++) {
        for (int c = 0; c < 3; c++) {
            sum->diffuse[c] += weights[k] * gathered[k].diffuse[c];
            sum->rest[c] += weights[k] * (gathered[k].light[c] - gathered[k].diffuse[c]);
        }
    }
    const int has_ground = v->ground[0] > 0 || v->ground[1] > 0 || v->ground[2] > 0;
    return result == NEBEL_OK && has_ground ? add_ground(v, rays, weights, sum) : result;
}

/* Through one end of the lattice. */
static nebel_result gather_end(const nb_energy_survey *v, int axis, int side, nb_flux_balance *sum)
{
    const nb_diffusion_lattice *l = &v->diffusion->lattice;
    const int across[2] = {(axis + 1) % 3, (axis + 2) % 3};
    const int count[2] = {l->size[across[0]] > 1 ? PLACES : 1, l->size[across[1]] > 1 ? PLACES : 1};
    double area = 1;
    nebel_result result = NEBEL_OK;
    for (int k = 0; k < 2; k++) area *= (l->high[across[k]] - l->low[across[k]]) / count[k];
    *sum = (nb_flux_balance){{0}, {0}};
    for (int i = 0; i < count[0] * count[1] && result == NEBEL_OK; i++) {
        const int at[2] = {i % count[0], i / count[0]};
        double place[3];
        place[axis] = side ? l->high[axis] : l->low[axis];
        for (int k = 0; k < 2; k++) {
            const double width = l->high[across[k]] - l->low[across[k]];
            place[across[k]] = l->low[across[k]] + (at[k] + 0.5) / count[k] * width;
        }
        result = add_place(v, axis, side, place, area, sum);
    }
    return result;
}

/* What makes the rest and so much of what is diffuse add up to `leaving`. */
static double find_gain(double leaving, double rest, double diffuse, double least, double most)
{
    return fmin(fmax(diffuse > 0 ? (leaving - rest) / diffuse : 1, least), most);
}

/* `ends`: of each axis and side; nothing where they are not open. */
static void balance_channel(nb_diffusion *d, int c, const nb_diffuse_light *light, const nb_flux_balance ends[6])
{
    double leaving = light->lost, diffuse = 0, rest = 0;
    for (int i = 0; i < 6; i++) {
        if (d->lattice.ends[i / 2][i % 2] != NB_END_OPEN) continue;
        leaving += light->leaving[i / 2][i % 2];
        diffuse += ends[i].diffuse[c];
        rest += ends[i].rest[c];
    }
    /* What is lost counts for every end as rays say. */
    const double part = diffuse + rest > 0 ? light->lost / (diffuse + rest) : 0;
    const double all = find_gain(leaving, rest, diffuse, LEAST_GAIN, MOST_GAIN);
    for (int i = 0; i < 6; i++) {
        const int axis = i / 2, side = i % 2;
        d->gain[c][axis][side] = all;
        if (d->lattice.ends[axis][side] != NB_END_OPEN) continue;
        const double through = light->leaving[axis][side] + part * (ends[i].diffuse[c] + ends[i].rest[c]);
        d->gain[c][axis][side] =
            find_gain(through, ends[i].rest[c], ends[i].diffuse[c], all / GAIN_OF_SIDE, all * GAIN_OF_SIDE);
    }
}

nebel_result nb_diffusion_balance(const nebel_lighting *lighting, nb_diffusion *diffusion,
                                  const nb_diffuse_light light[3])
{
    nb_flux_balance ends[6];
    nb_energy_survey v = {.lighting = lighting, .diffusion = diffusion};
    for (int c = 0; c < 3; c++) {
        v.ground[c] = light[c < diffusion->channel_count ? c : 0].ground;
        for (int i = 0; i < 6; i++) diffusion->gain[c][i / 2][i % 2] = 1;
    }
    for (int i = 0; i < 6; i++) {
        if (diffusion->lattice.ends[i / 2][i % 2] != NB_END_OPEN) continue;
        const nebel_result result = gather_end(&v, i / 2, i % 2, &ends[i]);
        if (result != NEBEL_OK) return result;
    }
    for (int c = 0; c < diffusion->channel_count; c++) balance_channel(diffusion, c, &light[c], ends);
    return NEBEL_OK;
}
