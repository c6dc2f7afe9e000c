/* Clouds' shade on fog by its place, for renderers: whether it is the same all over a snapshot's fog, and what it is along rays. */
#ifndef NB_AERIAL_FOG_SHADOW_H
#define NB_AERIAL_FOG_SHADOW_H

#include "math/vector.h"

#include <nebel/planet.h>
#include <nebel/nebel.h>

#include <math.h>
#include <string.h>

/* How wide the shade of the origin is, m: as scenes are in which fog stands. */
#define NB_FOG_SHADE_ORIGIN 200.

/* Of shade, over all of the fog: less is a step of a picture of 255. */
#define NB_FOG_SHADE_CHANGE (1 / 128.)

/* Over wider fog, m, it is taken to change. */
#define NB_MAX_FOG_SHADE_EVEN 2e4

typedef struct nb_cloud_shadow_extent {
    int is_shaded;         /* clouds leave other light here than there: fog is to be shaded by its place */
    int owns_ambient;      /* ambient light is the planet's sky */
    float clear_sky;       /* over clouds, as part of that which fog has at the origin */
    double min[3], max[3]; /* of the fog */
} nb_cloud_shadow_extent;

typedef struct nb_value_range {
    float least, most;
} nb_value_range;

static inline void nb_part_widen(nb_value_range *r, float part)
{
    r->least = fminf(r->least, part);
    r->most = fmaxf(r->most, part);
}

static inline nebel_result nb_cloud_shadow_extent_ask(nebel_cloud_workspace *clouds, double width,
                                                      const double place[1][3], nb_value_range *sun,
                                                      nb_value_range *sky)
{
    float of_sun, of_sky;
    nebel_result result = nebel_compute_cloud_sun_transmittance(clouds, width, 1, place, 0, &of_sun);
    if (result == NEBEL_OK) result = nebel_compute_cloud_sky_transmittance(clouds, width, 1, place, 0, &of_sky);
    if (result != NEBEL_OK) return result;
    nb_part_widen(sun, of_sun);
    nb_part_widen(sky, of_sky);
    return NEBEL_OK;
}

static inline int nb_cloud_shadow_extent_is_small(const nb_cloud_shadow_extent *roof)
{
    for (int c = 0; c < 3; c++)
        if (!(roof->max[c] - roof->min[c] < NB_MAX_FOG_SHADE_EVEN)) return 0;
    return 1;
}

/* Over the fog, and to the origin, whose shade the snapshot has. */
static inline nebel_result nb_cloud_shadow_extent_compare(nebel_cloud_workspace *clouds, nb_cloud_shadow_extent *roof,
                                                          nb_value_range *sun, nb_value_range *sky)
{
    enum { PLACES = 5 };
    const double *const min = roof->min, *const max = roof->max;
    const double width = fmax(NB_FOG_SHADE_ORIGIN, fmax(max[0] - min[0], max[2] - min[2]) / PLACES);
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < PLACES * PLACES && result == NEBEL_OK; i++) {
        const double place[1][3] = {{min[0] + (max[0] - min[0]) * (i % PLACES + 0.5) / PLACES, 0.5 * (min[1] + max[1]),
                                     min[2] + (max[2] - min[2]) * ((int)(i / PLACES) + 0.5) / PLACES}};
        result = nb_cloud_shadow_extent_ask(clouds, width, place, sun, sky);
    }
    roof->is_shaded = (double)(sun->most - sun->least) > NB_FOG_SHADE_CHANGE * (double)sun->most ||
                      (double)(sky->most - sky->least) > NB_FOG_SHADE_CHANGE * (double)sky->most;
    return result;
}

/* owns_ambient: see nb_cloud_shadow_extent. Where the origin is in the night the snapshot has no sun, but fog may lie by day. Errors:
 * ARGUMENT. */
static inline nebel_result nb_cloud_shadow_extent_set(nebel_cloud_workspace *clouds, const nebel_snapshot *snapshot,
                                                      int owns_ambient, nb_cloud_shadow_extent *roof)
{
    static const double origin[1][3] = {{0, 0, 0}};
    nb_value_range sun = {1, 0}, sky = {1, 0};
    *roof = (nb_cloud_shadow_extent){.owns_ambient = owns_ambient, .clear_sky = 1};
    nebel_bounds fog;
    if (!nebel_get_scattering_bounds(snapshot, 0, &fog)) return NEBEL_OK;
    memcpy(roof->min, fog.min, sizeof roof->min);
    memcpy(roof->max, fog.max, sizeof roof->max);
    nebel_result result = nb_cloud_shadow_extent_ask(clouds, NB_FOG_SHADE_ORIGIN, origin, &sun, &sky);
    if (owns_ambient) roof->clear_sky = 1 / fmaxf(sky.most, 1e-6f);
    roof->is_shaded = !nb_cloud_shadow_extent_is_small(roof);
    return result == NEBEL_OK && !roof->is_shaded ? nb_cloud_shadow_extent_compare(clouds, roof, &sun, &sky) : result;
}

/* ---- along a ray ----------------------------------------------------------------------------- */

/* What clouds leave, in parts: of the sun, and of the sky as of that which fog has at the origin. */
typedef struct nb_fog_shadow {
    int is_found;
    nebel_fog_shadow pieces;
    float end;       /* m, no fog is beyond */
    float clear_sky; /* over clouds, from the last piece on */
} nb_fog_shadow;

/* Where a ray is within the box of the fog; returns whether it is. */
static inline int nb_cloud_shadow_extent_cross(const nb_cloud_shadow_extent *roof, const nebel_ray *ray,
                                               const double unit[3], double at[2])
{
    at[0] = 0;
    at[1] = HUGE_VAL;
    for (int c = 0; c < 3; c++) {
        if (unit[c] == 0) {
            if (ray->origin[c] < roof->min[c] || ray->origin[c] > roof->max[c]) return 0;
            continue;
        }
        const double a = (roof->min[c] - ray->origin[c]) / unit[c], b = (roof->max[c] - ray->origin[c]) / unit[c];
        at[0] = fmax(at[0], fmin(a, b));
        at[1] = fmin(at[1], fmax(a, b));
    }
    return at[0] < at[1];
}

/* Along the whole ray, whatever its t_max; spread as of nebel_trace_cloud_shadow_on_fog. Errors: ARGUMENT. */
static inline nebel_result nb_fog_shadow_along(nebel_cloud_workspace *clouds, const nb_cloud_shadow_extent *roof,
                                               nebel_ray ray, double spread, nb_fog_shadow *shade)
{
    double unit[3], at[2];
    const double length = nb_vector_length(ray.direction);
    *shade = (nb_fog_shadow){.is_found = 1, .clear_sky = roof->clear_sky};
    for (int c = 0; c < 3; c++) unit[c] = ray.direction[c] / length;
    if (!nb_cloud_shadow_extent_cross(roof, &ray, unit, at)) return NEBEL_OK;
    ray.t_max = at[1];
    shade->end = (float)at[1];
    const nebel_result result = nebel_trace_cloud_shadow_on_fog(clouds, &ray, at[0], spread, &shade->pieces);
    if (shade->pieces.count == 0) shade->pieces.t[0] = (float)at[0]; /* all of it is in clear light */
    for (uint32_t k = 0; k < shade->pieces.count; k++)
        shade->pieces.sky_transmittance[k] =
            roof->owns_ambient ? shade->pieces.sky_transmittance[k] * roof->clear_sky : 1;
    return result;
}

#endif
