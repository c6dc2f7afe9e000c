#include "cpu_textured_planet.h"

#include <math.h>
#include <string.h>

nebel_result nb_cpu_textured_set(nb_frame *frame, const nebel_frame_desc *desc)
{
    static const double up[3] = {0, 1, 0};
    nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    if (scene->planet_count == 0 || scene->planets[0].textured == NULL) return NEBEL_OK;
    if (renderer->method != NEBEL_METHOD_EXACT)
        return nb_fail(&renderer->log, NEBEL_ERROR_UNSUPPORTED,
                       "planets are drawn by the method exact alone: ask for no other method, or leave the planet out");
    const double pixel = nb_view_pixel(&frame->view, frame->height);
    frame->layers = scene->planets[0].textured;
    frame->layer_view =
        (nebel_textured_planet_query){.time = desc->time, .pixel_spread = pixel / sqrt((double)frame->samples)};
    /* The pixels of parallel rays do not grow. */
    if (frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC) frame->layer_view.pixel_spread = 0;
    nebel_evaluate_environment_diffuse(&frame->lighting.environment, up, frame->layer_view.ambient);
    if (!scene->has_sun) return NEBEL_OK;
    memcpy(frame->layer_view.sun.direction, scene->sun_direction, sizeof scene->sun_direction);
    memcpy(frame->layer_view.sun.irradiance, scene->sun_irradiance, sizeof scene->sun_irradiance);
    return NEBEL_OK;
}

static nebel_ray ray_of(const nb_frame *frame, const nb_ray_batch *rays, int lane)
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = frame->view.position[c];
        ray.direction[c] = rays->direction[c][lane];
        if (frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC) ray.origin[c] += rays->offset[c][lane];
    }
    return ray;
}

nebel_result nb_cpu_textured_find(const nb_frame *frame, nb_scratch *scratch)
{
    nb_shell_scratch *shells = &scratch->shells;
    shells->most = 0;
    for (int i = 0; i < NB_BATCH; i++) {
        nebel_shell_hits *hits = &shells->hits[i];
        hits->count = 0;
        shells->ground[i] = HUGE_VALF;
        if (!scratch->inside[i]) continue;
        nebel_ray ray = ray_of(frame, &scratch->rays, i);
        if (scratch->hits.surface[i] != NB_NONE)
            ray.t_max = frame->view.advance * (double)scratch->rays.length[i] + (double)scratch->hits.t[i];
        const nebel_result result = nebel_trace_textured_planet(frame->layers, &frame->layer_view, 1, &ray, 0, hits, 0);
        if (result != NEBEL_OK) return result;
        if (hits->count > 0 && hits->hits[hits->count - 1].is_ground) {
            hits->count--;
            shells->ground[i] = (float)hits->hits[hits->count].t;
            scratch->hits.surface[i] = NB_NONE;
        }
        shells->most = hits->count > shells->most ? hits->count : shells->most;
    }
    return NEBEL_OK;
}

/* The ground is drawn in its own light, whatever the background is. */
static void show_ground(const nb_frame *frame, nb_scratch *scratch, int lane)
{
    const nb_light_samples *samples = &scratch->samples;
    const nebel_shell_hits *hits = &scratch->shells.hits[lane];
    const nebel_shell_hit *ground = &hits->hits[hits->count];
    const nebel_ray ray = ray_of(frame, &scratch->rays, lane);
    const nebel_textured_planet_desc *planet = &frame->renderer->scene->planets[0].textured_desc;
    const double length = (double)scratch->rays.length[lane];
    for (int c = 0; c < 3; c++) {
        const double place = ray.origin[c] + ground->t * ray.direction[c] / length;
        scratch->points.normal[c][lane] = (float)((place - planet->center[c]) / planet->radius);
        scratch->samples.color[c][lane] =
            samples->transmittance[c][lane] * (float)ground->radiance[c] + samples->in_scattering[c][lane];
    }
    scratch->hits.surface[lane] = NB_GROUND;
    scratch->hits.t[lane] = (float)(ground->t - frame->view.advance * length);
}

/* Of one shell of each ray. */
static void blend_shell(nb_shell_scratch *shells, uint32_t number)
{
    for (int i = 0; i < NB_BATCH; i++) {
        if (number >= shells->hits[i].count) continue;
        const nebel_shell_hit *hit = &shells->hits[i].hits[number];
        for (int c = 0; c < 3; c++) {
            const float light = shells->light[c][i] - shells->light_before[c][i];
            shells->sum[c][i] += shells->left[i] * (light + shells->fog_left[c][i] * (float)hit->radiance[c]);
            shells->light_before[c][i] = shells->light[c][i];
        }
        shells->left[i] *= (float)(1 - hit->opacity);
    }
}

/* Fog up to one shell of each ray. */
static nebel_result trace_shell(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                                nb_shell_scratch *shells, uint32_t number)
{
    nebel_ray_planes rays = *fog;
    nebel_transfer_planes transfers = {.error = NULL};
    for (int i = 0; i < NB_BATCH; i++)
        shells->distance[i] = number < shells->hits[i].count ? (float)shells->hits[i].hits[number].t : 0;
    rays.t_max = shells->distance;
    for (int c = 0; c < 3; c++) {
        transfers.transmittance[c] = shells->fog_left[c];
        transfers.in_scattering[c] = shells->light[c];
    }
    return nebel_trace_planes(frame->renderer->fog, trace, NB_BATCH, &rays, &transfers);
}

static void start(nb_shell_scratch *shells)
{
    memset(shells->sum, 0, sizeof shells->sum);
    memset(shells->light, 0, sizeof shells->light);
    memset(shells->light_before, 0, sizeof shells->light_before);
    for (int i = 0; i < NB_BATCH; i++) {
        shells->left[i] = 1;
        for (int c = 0; c < 3; c++) shells->fog_left[c][i] = 1;
    }
}

nebel_result nb_cpu_textured_trace(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                                   nb_scratch *scratch)
{
    nb_shell_scratch *shells = &scratch->shells;
    start(shells);
    for (uint32_t k = 0; k < shells->most; k++) {
        nebel_result result = NEBEL_OK;
        if (fog != NULL) result = trace_shell(frame, fog, trace, shells, k);
        if (result != NEBEL_OK) return result;
        blend_shell(shells, k);
    }
    return NEBEL_OK;
}

void nb_cpu_textured_blend(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_shell_scratch *shells = &scratch->shells;
    for (int i = 0; i < NB_BATCH; i++)
        if (shells->ground[i] < HUGE_VALF) show_ground(frame, scratch, i);
    for (int c = 0; c < 3 && shells->most > 0; c++) {
        float *restrict color = scratch->samples.color[c];
        for (int i = 0; i < NB_BATCH; i++)
            color[i] = shells->sum[c][i] + shells->left[i] * (color[i] - shells->light_before[c][i]);
    }
}
