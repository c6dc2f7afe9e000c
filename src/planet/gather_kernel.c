/* What comes to a ray at its nodes, compiled once per instruction set: sunlight, and light scattered before. A node is a
 * lane, and does not depend on the others. */
#define NB_FAST
#define NB_DOUBLE

#include "gather.h"

#include "base/levels.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/planet.inc"

#include "depth.h"
#include "moments.h"

/* Behind the terminator light comes from near the horizon, and changes fast with the sun's height: where the sun is 5, 7 and
 * 10 degrees below the horizon a far finer table has up to 5, 8 and 21 % more or less of all light (`precise`: 3, 7 and 8).
 * Measured on the Earth; others may be worse. */
#define TWILIGHT_OFF 3.0

/* Nodes in lanes; `at` is the number of the first. */
typedef struct nb_nodes {
    int at;
    nb_real radius, sun, zenith; /* cosines of the sun and of the ray's direction to the zenith there */
    nb_real left[3];             /* weight and transmittance */
} nb_nodes;

static inline nb_nodes nodes_at(const nb_gather_job *job, int at)
{
    const nb_path *path = job->path;
    const nb_real s = nb_load_lanes(path->s + at), weight = nb_load_lanes(path->weight + at);
    const nb_real radius = nb_load_lanes(path->radius + at);
    const nb_real up = nb_splat(job->track.radius * job->aspect.height_of_sun) + s * nb_splat(job->aspect.sun);
    nb_nodes nodes = {
        .at = at, .radius = radius, .sun = up / radius, .zenith = (nb_splat(job->track.rise) + s) / radius};
    for (int c = 0; c < 3; c++) nodes.left[c] = weight * nb_load_lanes(path->transmittance[c] + at);
    return nodes;
}

static void add_sun(const nb_gather_job *job, const nb_nodes *nodes, nb_node_light *light)
{
    nb_real sunlight[3];
    nb_tracks_sunlight(job->airs, (nb_tracks){nodes->radius, nodes->radius * nodes->sun}, sunlight);
    for (int c = 0; c < 3; c++) nb_store_lanes(light->sun[c] + (nodes->at - job->first), nodes->left[c] * sunlight[c]);
}

/* ---- scattered often ------------------------------------------------------------------------- */

/* What air gives of all orders behind those that are kept, 1/m. */
NB_MOMENTS_INLINE nb_real weigh_rest(const nb_gather_job *job, int at, int c)
{
    nb_real sum = NB_F(0.0);
    for (int k = 0; k < job->airs->count; k++) {
        const nb_air *air = &job->airs->airs[k];
        const double times = job->rest[k] / NB_FOUR_PI * air->scattering[c] * air->moments[job->scatter->orders];
        if (air->scattering[c] > 0) sum = sum + nb_splat(times) * nb_load_lanes(job->path->density[k] + at);
    }
    return nb_abs(sum);
}

/* What air gives of the moments of one order, 1/m. */
NB_MOMENTS_INLINE nb_real weigh(const nb_gather_job *job, int at, int order, int c)
{
    nb_real sum = NB_F(0.0);
    for (int k = 0; k < job->airs->count; k++) {
        const nb_air *air = &job->airs->airs[k];
        const double times = (2 * order + 1) / NB_FOUR_PI * air->scattering[c] * air->moments[order];
        if (air->scattering[c] > 0) sum = sum + nb_splat(times) * nb_load_lanes(job->path->density[k] + at);
    }
    return sum;
}

/* For a first moment of 1: what the field of the spots gives towards a direction, and about what it would give more or
 * less if all orders were kept, as if the next one's moments were as large as those of the last one. */
typedef struct nb_scattered {
    nb_real light, missing;
} nb_scattered;

NB_MOMENTS_INLINE nb_scattered scatter(const nb_gather_job *job, int orders, const nb_spots *spots, int at,
                                       const nb_real basis[NB_FIELD], int c)
{
    nb_real sum = weigh(job, at, 0, c) * basis[0], square = NB_F(1.0);
    for (int order = 1, i = 1; order < orders; order++) {
        nb_real part = NB_F(0.0);
        square = NB_F(0.0);
        for (int m = 0; m <= order; m++, i++) {
            const nb_real moment = nb_moment_at(spots, i, c);
            part = part + basis[i] * moment;
            square = square + moment * moment;
        }
        sum = sum + weigh(job, at, order, c) * part;
    }
    return (nb_scattered){nb_max(NB_F(0.0), sum), weigh_rest(job, at, c) * nb_sqrt(square)};
}

NB_MOMENTS_INLINE void add_often(const nb_gather_job *job, int orders, const nb_nodes *nodes, nb_node_light *light)
{
    const int to = nodes->at - job->first;
    const nb_spots spots = nb_spots_of(job->scatter, job->airs, nodes->radius, nodes->sun);
    const nb_real dark = NB_F(TWILIGHT_OFF) * nb_max(NB_F(0.0), -nodes->sun);
    nb_real basis[NB_FIELD];
    nb_basis_of(orders, (nb_aspects){nodes->zenith, nb_splat(job->aspect.sun), nodes->sun}, basis);
    for (int c = 0; c < 3; c++) {
        const nb_real all = nodes->left[c] * nb_exp(nb_moment_at(&spots, 0, c));
        const nb_scattered scattered = scatter(job, orders, &spots, nodes->at, basis, c);
        nb_store_lanes(light->often[c] + to, all * scattered.light);
        nb_store_lanes(light->missing[c] + to, all * (scattered.missing + dark * scattered.light));
    }
}

static void add_often_by_few(const nb_gather_job *job, const nb_nodes *nodes, nb_node_light *light)
{
    add_often(job, NB_FEW_MOMENTS, nodes, light);
}

static void add_often_by_all(const nb_gather_job *job, const nb_nodes *nodes, nb_node_light *light)
{
    add_often(job, NB_MOMENTS, nodes, light);
}

void NB_SUFFIXED(nb_gather_)(const nb_gather_job *job, nb_node_light *light)
{
    for (int at = job->first; at < job->first + job->count; at += NB_WIDTH) {
        const nb_nodes nodes = nodes_at(job, at);
        if (job->wants_sun) add_sun(job, &nodes, light);
        if (job->scatter == NULL) continue;
        if (job->scatter->orders == NB_FEW_MOMENTS)
            add_often_by_few(job, &nodes, light);
        else
            add_often_by_all(job, &nodes, light);
    }
}
