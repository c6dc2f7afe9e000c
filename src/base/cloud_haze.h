/* Clouds with volume among air and fog along a ray, from knot to knot: between two of them transmittances count as their mean. */
#ifndef NB_CLOUD_HAZE_H
#define NB_CLOUD_HAZE_H

#include <nebel/clouds.h>

/* What air and fog do up to each knot. */
typedef struct nb_cloud_haze {
    float left[3][NEBEL_MAX_CLOUD_KNOTS], light[3][NEBEL_MAX_CLOUD_KNOTS];
} nb_cloud_haze;

/* What is asked of the air of a ray: many rays in one direction, up to knots->t. */
typedef struct nb_cloud_rays {
    double along[3][NEBEL_MAX_CLOUD_KNOTS];
    const double *direction[3];
    nebel_light_planes lights; /* of the haze */
} nb_cloud_rays;

static inline void nb_cloud_haze_ask(const nebel_cloud_knots *knots, const double direction[3], nb_cloud_haze *haze,
                                     nb_cloud_rays *rays)
{
    rays->lights.error = NULL;
    for (int c = 0; c < 3; c++) {
        for (uint32_t k = 0; k < knots->count; k++) rays->along[c][k] = direction[c];
        rays->direction[c] = rays->along[c];
        rays->lights.transmittance[c] = haze->left[c];
        rays->lights.in_scattering[c] = haze->light[c];
    }
}

/* Of one colour: left and light of air and fog up to the first knot and up to the last. Fog is mostly before all clouds: what is
 * not counts as spread evenly over the way between these. */
static inline void nb_cloud_haze_add_fog(const nebel_cloud_knots *knots, int c, const float left[2],
                                         const float light[2], nb_cloud_haze *haze)
{
    const uint32_t last = knots->count - 1;
    const float begin = knots->t[0], way = knots->t[last] - begin, air_light = haze->light[c][0];
    const float from = haze->left[c][0] > 0 ? left[0] / haze->left[c][0] : 0;
    const float to = haze->left[c][last] > 0 ? left[1] / haze->left[c][last] : 0;
    const float rest = light[1] - light[0] - from * (haze->light[c][last] - air_light);
    for (uint32_t k = 0; k <= last; k++) {
        const float part = way > 0 ? (knots->t[k] - begin) / way : 0;
        haze->left[c][k] *= from + part * (to - from);
        haze->light[c][k] = light[0] + from * (haze->light[c][k] - air_light) + part * rest;
    }
}

/* Of one colour, the light up to each knot, without what of the haze before it clouds leave. */
static inline void nb_cloud_haze_sum(const nebel_cloud_knots *knots, int c, const nb_cloud_haze *haze,
                                     float over[NEBEL_MAX_CLOUD_KNOTS])
{
    float sum = haze->light[c][0];
    over[0] = 0;
    for (uint32_t k = 1; k < knots->count; k++) {
        sum += 0.5f * (haze->left[c][k] + haze->left[c][k - 1]) *
               (knots->in_scattering[k][c] - knots->in_scattering[k - 1][c]);
        sum += 0.5f * (knots->transmittance[k] + knots->transmittance[k - 1]) *
               (haze->light[c][k] - haze->light[c][k - 1]);
        over[k] = sum - knots->transmittance[k] * haze->light[c][k];
    }
}

/* The knot before a surface, and the part of the way to the next one; behind the last one that. The surface is behind the
 * first. */
static inline uint32_t nb_cloud_haze_find(uint32_t count, const float *t, float end, float *part)
{
    uint32_t k = count - 1;
    *part = 0;
    if (!(end < t[k])) return k;
    while (k > 0 && t[k] > end) k--;
    *part = (end - t[k]) / (t[k + 1] - t[k]);
    return k;
}

#endif
