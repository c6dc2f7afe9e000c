#include "cpu_fog_shadow.h"

#include <math.h>

nebel_result nb_fog_shadow_set(nb_frame *frame)
{
    nb_air_frame *const air = &frame->air;
    if (frame->cloud_view == NULL) return NEBEL_OK;
    return nb_cloud_shadow_extent_set(frame->renderer->scratch[0].clouds.workspace, frame->renderer->fog,
                                      air->owns_ambient, &air->roof);
}

/* ---- along rays ------------------------------------------------------------------------------ */

static nebel_result find(const nb_frame *frame, const nb_cloud_scratch *clouds, int lane, nb_fog_shadow *shade)
{
    const nb_air_frame *const air = &frame->air;
    nebel_ray ray;
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = air->position[c];
        ray.direction[c] = clouds->lifted.direction[c][lane];
    }
    return nb_fog_shadow_along(clouds->workspace, &air->roof, ray, air->pixel / (double)clouds->lifted.length[lane],
                               shade);
}

void nb_fog_shadow_start(nb_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) scratch->air.fog_shade[i].is_found = 0;
}

nebel_result nb_fog_shadow_find(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_aerial_batch_nodes *const end = &scratch->air.nodes[0];
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < NB_BATCH && result == NEBEL_OK; i++) {
        nb_fog_shadow *const shade = &scratch->air.fog_shade[i];
        float light = 0;
        for (int c = 0; c < 3; c++) light += end->fog_sun[c][i] + end->fog_sky[c][i];
        if (scratch->inside[i] && light > 0 && !shade->is_found) result = find(frame, &scratch->clouds, i, shade);
    }
    return result;
}

typedef struct shadow_sum {
    float length, integral, within;
    nb_value_range range;
} shadow_sum;

static void add_shade(shadow_sum *s, float length, float part, float within)
{
    s->length += length;
    s->integral += length * part;
    s->within += length * within;
    nb_part_widen(&s->range, part);
}

static float mean_of(const shadow_sum *s, float *doubt, float *within)
{
    const float mean = s->length > 0 ? s->integral / s->length : 1;
    *doubt = s->length > 0 ? fmaxf(0, fmaxf(s->range.most - mean, mean - s->range.least)) : 0;
    *within = s->length > 0 ? s->within / s->length : 0;
    return mean;
}

nb_segment_shadow nb_fog_shadow_between(const nb_fog_shadow *shade, float a, float b)
{
    const nebel_fog_shadow *const p = &shade->pieces;
    nb_segment_shadow between;
    shadow_sum sun = {.range = {HUGE_VALF, -HUGE_VALF}}, sky = sun;
    for (uint32_t k = 0; k < p->count && p->t[k] < b; k++) {
        const float length = fminf(b, p->t[k + 1]) - fmaxf(a, p->t[k]);
        if (!(length > 0)) continue;
        add_shade(&sun, length, p->sun_transmittance[k], p->error[k]);
        add_shade(&sky, length, p->sky_transmittance[k], p->error[k]);
    }
    /* Fog over clouds. */
    const float over = fminf(b, shade->end) - fmaxf(a, p->t[p->count]);
    if (over > 0) {
        add_shade(&sun, over, 1, 0);
        add_shade(&sky, over, shade->clear_sky, 0);
    }
    between.sun = mean_of(&sun, &between.sun_doubt, &between.sun_within);
    between.sky = mean_of(&sky, &between.sky_doubt, &between.sky_within);
    return between;
}

float nb_fog_shadow_cut(const nb_fog_shadow *shade, float a, float b)
{
    const nebel_fog_shadow *const p = &shade->pieces;
    uint32_t first = 0, end = 0;
    for (uint32_t k = 0; k <= p->count; k++) {
        if (!(p->t[k] > a)) first = k + 1;
        if (p->t[k] < b) end = k + 1;
    }
    return first < end ? p->t[(first + end - 1) / 2] : 0;
}
