#include "fog_shade.h"

#include <math.h>

/* As wide as nebel_find_scene_light takes the shade of the origin. */
#define ORIGIN_WIDTH 200.

/* Of shade, over all of the fog: less is a step of a picture of 255. */
#define LEAST_CHANGE (1 / 128.)

/* Over wider fog, m, it is taken to change. */
#define MOST_EVEN 2e4

/* ---- the frame ------------------------------------------------------------------------------- */

typedef struct range {
    float least, most;
} range;

static void widen(range *r, float part)
{
    r->least = fminf(r->least, part);
    r->most = fmaxf(r->most, part);
}

static nebel_result ask(const nb_frame *frame, double width, const double place[1][3], range *sun, range *sky)
{
    nebel_cloud_workspace *const workspace = frame->renderer->scratch[0].clouds.workspace;
    float of_sun, of_sky;
    nebel_result result = nebel_shade_clouds(workspace, width, 1, place, 0, &of_sun);
    if (result == NEBEL_OK) result = nebel_shade_sky(workspace, width, 1, place, 0, &of_sky);
    if (result != NEBEL_OK) return result;
    widen(sun, of_sun);
    widen(sky, of_sky);
    return NEBEL_OK;
}

/* Over the fog, and to the origin, whose shade the snapshot has. */
static nebel_result is_even(const nb_frame *frame, int *even)
{
    enum { PLACES = 5 };
    static const double origin[1][3] = {{0, 0, 0}};
    const double *const min = frame->air.fog_min, *const max = frame->air.fog_max;
    range sun = {1, 0}, sky = {1, 0};
    *even = 0;
    for (int c = 0; c < 3; c++)
        if (!(max[c] - min[c] < MOST_EVEN)) return NEBEL_OK;
    const double width = fmax(ORIGIN_WIDTH, fmax(max[0] - min[0], max[2] - min[2]) / PLACES);
    nebel_result result = ask(frame, ORIGIN_WIDTH, origin, &sun, &sky);
    for (int i = 0; i < PLACES * PLACES && result == NEBEL_OK; i++) {
        const double place[1][3] = {{min[0] + (max[0] - min[0]) * (i % PLACES + 0.5) / PLACES, 0.5 * (min[1] + max[1]),
                                     min[2] + (max[2] - min[2]) * ((int)(i / PLACES) + 0.5) / PLACES}};
        result = ask(frame, width, place, &sun, &sky);
    }
    *even = (double)(sun.most - sun.least) <= LEAST_CHANGE * (double)sun.most &&
            (double)(sky.most - sky.least) <= LEAST_CHANGE * (double)sky.most;
    return result;
}

nebel_result nb_fog_shade_set(nb_frame *frame)
{
    static const double origin[1][3] = {{0, 0, 0}};
    nb_air *const air = &frame->air;
    nebel_sunlit_fog fog;
    range sun = {1, 0}, sky = {1, 0};
    int even;
    if (frame->cloud_view == NULL || !nebel_snapshot_sunlit_fog(frame->renderer->fog, &fog)) return NEBEL_OK;
    for (int c = 0; c < 3; c++) {
        air->fog_min[c] = fog.min[c];
        air->fog_max[c] = fog.max[c];
    }
    nebel_result result = is_even(frame, &even);
    if (result != NEBEL_OK || even) return result;
    air->is_fog_shaded = 1;
    result = ask(frame, ORIGIN_WIDTH, origin, &sun, &sky);
    air->per_origin_sky = 1 / fmaxf(sky.most, 1e-6f);
    return result;
}

/* ---- along rays ------------------------------------------------------------------------------ */

/* Where a ray is within the box of the fog; returns whether it is. */
static int cross_fog(const nb_air *air, const nebel_ray *ray, const double unit[3], double at[2])
{
    at[0] = 0;
    at[1] = HUGE_VAL;
    for (int c = 0; c < 3; c++) {
        if (unit[c] == 0) {
            if (ray->origin[c] < air->fog_min[c] || ray->origin[c] > air->fog_max[c]) return 0;
            continue;
        }
        const double a = (air->fog_min[c] - ray->origin[c]) / unit[c], b = (air->fog_max[c] - ray->origin[c]) / unit[c];
        at[0] = fmax(at[0], fmin(a, b));
        at[1] = fmin(at[1], fmax(a, b));
    }
    return at[0] < at[1];
}

static nebel_result find(const nb_frame *frame, const nb_cloud_scratch *clouds, int lane, nb_fog_shade *shade)
{
    const nb_air *const air = &frame->air;
    const double length = (double)clouds->rays.length[lane];
    nebel_ray ray;
    double unit[3], at[2];
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = air->position[c];
        ray.direction[c] = clouds->rays.direction[c][lane];
        unit[c] = ray.direction[c] / length;
    }
    *shade = (nb_fog_shade){.is_found = 1, .clear_sky = air->owns_ambient ? air->per_origin_sky : 1};
    if (!cross_fog(air, &ray, unit, at)) return NEBEL_OK;
    ray.t_max = at[1];
    shade->end = (float)at[1];
    const nebel_result result = nebel_shade_fog(clouds->workspace, &ray, at[0], air->pixel / length, &shade->pieces);
    if (shade->pieces.count == 0) shade->pieces.t[0] = (float)at[0]; /* all of it is in clear light */
    for (uint32_t k = 0; k < shade->pieces.count; k++)
        shade->pieces.sky[k] = air->owns_ambient ? shade->pieces.sky[k] * air->per_origin_sky : 1;
    return result;
}

void nb_fog_shade_start(nb_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) scratch->air.fog_shade[i].is_found = 0;
}

nebel_result nb_fog_shade_find(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_air_knots *const end = &scratch->air.knots[0];
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < NB_BATCH && result == NEBEL_OK; i++) {
        nb_fog_shade *const shade = &scratch->air.fog_shade[i];
        float light = 0;
        for (int c = 0; c < 3; c++) light += end->fog_sun[c][i] + end->fog_sky[c][i];
        if (scratch->inside[i] && light > 0 && !shade->is_found) result = find(frame, &scratch->clouds, i, shade);
    }
    return result;
}

typedef struct sum {
    float length, integral, within;
    range range;
} sum;

static void add(sum *s, float length, float part, float within)
{
    s->length += length;
    s->integral += length * part;
    s->within += length * within;
    widen(&s->range, part);
}

static float mean_of(const sum *s, float *doubt, float *within)
{
    const float mean = s->length > 0 ? s->integral / s->length : 1;
    *doubt = s->length > 0 ? fmaxf(0, fmaxf(s->range.most - mean, mean - s->range.least)) : 0;
    *within = s->length > 0 ? s->within / s->length : 0;
    return mean;
}

nb_shade_between nb_fog_shade_between(const nb_fog_shade *shade, float a, float b)
{
    const nebel_fog_shade *const p = &shade->pieces;
    nb_shade_between between;
    sum sun = {.range = {HUGE_VALF, -HUGE_VALF}}, sky = sun;
    for (uint32_t k = 0; k < p->count && p->t[k] < b; k++) {
        const float length = fminf(b, p->t[k + 1]) - fmaxf(a, p->t[k]);
        if (!(length > 0)) continue;
        add(&sun, length, p->sun[k], p->error[k]);
        add(&sky, length, p->sky[k], p->error[k]);
    }
    /* Fog over clouds. */
    const float over = fminf(b, shade->end) - fmaxf(a, p->t[p->count]);
    if (over > 0) {
        add(&sun, over, 1, 0);
        add(&sky, over, shade->clear_sky, 0);
    }
    between.sun = mean_of(&sun, &between.sun_doubt, &between.sun_within);
    between.sky = mean_of(&sky, &between.sky_doubt, &between.sky_within);
    return between;
}

float nb_fog_shade_cut(const nb_fog_shade *shade, float a, float b)
{
    const nebel_fog_shade *const p = &shade->pieces;
    uint32_t first = 0, end = 0;
    for (uint32_t k = 0; k <= p->count; k++) {
        if (!(p->t[k] > a)) first = k + 1;
        if (p->t[k] < b) end = k + 1;
    }
    return first < end ? p->t[(first + end - 1) / 2] : 0;
}
