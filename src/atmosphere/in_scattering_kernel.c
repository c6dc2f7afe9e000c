/* What comes to a ray at its nodes, compiled once per instruction set: sunlight, and light scattered before. A node is a
 * lane, and does not depend on the others. */
#define NB_FAST
#define NB_DOUBLE

#include "in_scattering.h"

#include "base/isa_list.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/atmosphere.inc"

#include "optical_depth_lanes.h"
#include "radiance_moments_lanes.h"

/* Behind the terminator light comes from near the horizon, and changes fast with the sun's height: where the sun is 5, 7 and
 * 10 degrees below the horizon a far finer table has up to 5, 8 and 21 % more or less of all light (`precise`: 3, 7 and 8).
 * Measured on the Earth; others may be worse. */
#define TWILIGHT_OFF 3.0
/* The same of haze, which is off most where the terminator is seen from space. */
#define TWILIGHT_OFF_IN_HAZE 5.0

/* Nodes in lanes; `at` is the number of the first. */
typedef struct nb_nodes {
    int at;
    nb_real radius, sun, zenith; /* cosines of the sun and of the ray's direction to the zenith there */
    nb_real weight;
} nb_nodes;

NB_MOMENTS_INLINE nb_real left_of(const nb_nodes *nodes, const double transmittance[])
{
    return nodes->weight * nb_load_lanes(transmittance + nodes->at);
}

static inline nb_nodes nodes_at(const nb_gather_job *job, int at)
{
    const nb_ray_nodes *path = job->path;
    const nb_real s = nb_load_lanes(path->s + at), radius = nb_load_lanes(path->radius + at);
    const nb_real up = nb_splat(job->track.radius * job->aspect.height_of_sun) + s * nb_splat(job->aspect.sun);
    return (nb_nodes){.at = at,
                      .radius = radius,
                      .sun = up / radius,
                      .zenith = (nb_splat(job->track.rise) + s) / radius,
                      .weight = nb_load_lanes(path->weight + at)};
}

/* About what is off of light scattered by all air after peaks were cut off, as a part of what they would have scattered. Measured on flat
 * haze of depths 0.1 to 4 and g up to 0.9 the most is 0.15 (test_dense_air), and high over Mars, lit from below, 0.25. */
#define PEAK_OFF 0.3

/* Light that is scattered, and what of it may be wrong. */
typedef struct nb_scattered {
    nb_real light, missing;
} nb_scattered;

/* Sunlight that comes straight, and what comes ahead through air whose peaks do not count as scattering: they turn light that far, in
 * the mean so many times as the logarithm of their ratio says. */
static void add_sun(const nb_gather_job *job, const nb_nodes *nodes, nb_node_light *light)
{
    const int to = nodes->at - job->first;
    nb_real met[NEBEL_MAX_COMPONENTS];
    const nb_mask dark =
        nb_tracks_meet(job->airs, (nb_atmosphere_ray_lanes){nodes->radius, nodes->radius * nodes->sun}, met);
    for (int c = 0; c < 3; c++) {
        const nb_real sun = nb_select(dark, NB_F(0.0), nb_exp(-nb_depth_of(job->airs, met, c)));
        const nb_real straight = left_of(nodes, job->path->transmittance[c]) * sun;
        nb_store_lanes(light->sun[c] + to, straight);
        if (job->smooth == NULL) continue;
        const nb_real smooth_sun = nb_select(dark, NB_F(0.0), nb_exp(-nb_depth_of(job->smooth, met, c)));
        const nb_real ahead = left_of(nodes, job->path->smooth[c]) * smooth_sun, tiny = NB_F(1e-300);
        nb_store_lanes(light->ahead[c] + to, ahead);
        nb_store_lanes(light->lit[c] + to,
                       job->strays ? left_of(nodes, job->path->transmittance[c]) * smooth_sun : ahead);
        nb_store_lanes(light->turns[c] + to, nb_log(nb_max(ahead, tiny) / nb_max(straight, tiny)));
    }
}

/* ---- scattered often ------------------------------------------------------------------------- */

/* What air gives of all orders behind those that are kept, 1/m. */
NB_MOMENTS_INLINE nb_real weigh_rest(const nb_gather_job *job, int at, int c)
{
    nb_real sum = NB_F(0.0);
    for (int k = 0; k < job->airs->count; k++) {
        const nb_air_component *air = &job->airs->airs[k];
        const double times = job->rest[k] / NB_FOUR_PI * air->scattering[c] * air->moments[job->scatter->orders];
        if (air->scattering[c] > 0) sum = sum + nb_splat(times) * nb_load_lanes(job->path->density[k] + at);
    }
    return nb_abs(sum);
}

/* What air gives of the moments of one order, 1/m. */
NB_MOMENTS_INLINE nb_real weigh(const nb_gather_job *job, int at, int order, int c)
{
    const nb_air_components *airs = job->smooth != NULL ? job->smooth : job->airs;
    nb_real sum = NB_F(0.0);
    for (int k = 0; k < airs->count; k++) {
        const nb_air_component *air = &airs->airs[k];
        const double times = (2 * order + 1) / NB_FOUR_PI * air->scattering[c] * air->moments[order];
        if (air->scattering[c] > 0) sum = sum + nb_splat(times) * nb_load_lanes(job->path->density[k] + at);
    }
    return sum;
}

/* The part of what air scatters that peaks have. */
NB_MOMENTS_INLINE nb_real peak_part(const nb_gather_job *job, int at, int c)
{
    nb_real peaks = NB_F(0.0), all = NB_F(1e-300);
    for (int k = 0; k < job->airs->count; k++) {
        const nb_air_component *air = &job->airs->airs[k];
        const nb_real scattered = nb_splat(air->scattering[c]) * nb_load_lanes(job->path->density[k] + at);
        all = all + scattered;
        peaks = peaks + scattered * nb_splat(air->peak);
    }
    return peaks / all;
}

/* For a first moment of 1: what the field of the spots gives towards a direction, and about what it would give more or
 * less if all orders were kept, as if the next one's moments were as large as those of the last one. radiance: of the field itself. */
NB_MOMENTS_INLINE nb_scattered scatter(const nb_gather_job *job, int orders, const nb_moment_samples *spots, int at,
                                       const nb_real basis[NB_FIELD], int c, nb_real *radiance)
{
    nb_real sum = weigh(job, at, 0, c) * basis[0], square = NB_F(1.0), seen = basis[0];
    for (int order = 1, i = 1; order < orders; order++) {
        nb_real part = NB_F(0.0);
        square = NB_F(0.0);
        for (int m = 0; m <= order; m++, i++) {
            const nb_real moment = nb_moment_at(spots, i, c);
            part = part + basis[i] * moment;
            square = square + moment * moment;
        }
        sum = sum + weigh(job, at, order, c) * part;
        seen = seen + nb_splat(2 * order + 1) * part;
    }
    *radiance = nb_max(NB_F(0.0), seen) * nb_splat(1 / NB_FOUR_PI);
    if (job->strays) return (nb_scattered){sum, NB_F(0.0)}; /* nb_stray has all orders */
    nb_real missing = weigh_rest(job, at, c) * nb_sqrt(square);
    if (job->smooth != NULL)
        missing = missing + NB_F(PEAK_OFF) * peak_part(job, at, c) * nb_max(nb_abs(sum), weigh(job, at, 0, c));
    return (nb_scattered){sum, missing};
}

NB_MOMENTS_INLINE void add_often(const nb_gather_job *job, int orders, const nb_nodes *nodes, nb_node_light *light)
{
    const int to = nodes->at - job->first;
    const nb_moment_samples spots = nb_spots_of(job->scatter, job->airs, nodes->radius, nodes->sun);
    const nb_real dark = nb_splat(job->strays ? TWILIGHT_OFF_IN_HAZE : TWILIGHT_OFF) * nb_max(NB_F(0.0), -nodes->sun);
    nb_real basis[NB_FIELD];
    nb_basis_of(orders, (nb_moment_basis_lanes){nodes->zenith, nb_splat(job->aspect.sun), nodes->sun}, basis);
    for (int c = 0; c < 3; c++) {
        const double(*left)[NB_MAX_PATH] =
            job->smooth != NULL && !job->strays ? job->path->smooth : job->path->transmittance;
        const nb_real mean = nb_exp(nb_moment_at(&spots, 0, c)), all = left_of(nodes, left[c]) * mean;
        nb_real radiance;
        const nb_scattered scattered = scatter(job, orders, &spots, nodes->at, basis, c, &radiance);
        nb_store_lanes(light->radiance[c] + to, mean * radiance);
        nb_store_lanes(light->mean[c] + to, all);
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
        if (job->scatter != NULL && job->scatter->orders == NB_FEW_MOMENTS) add_often_by_few(job, &nodes, light);
        if (job->scatter != NULL && job->scatter->orders == NB_MOMENTS) add_often_by_all(job, &nodes, light);
        if (job->wants_sun) add_sun(job, &nodes, light);
    }
}
