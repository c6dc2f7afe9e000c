/* One sample of 16 x 16 pixels: rays, hits, shadows, fog, light. Everything is an array over the batch. */
#include "renderer.h"

#include <math.h>
#include <string.h>

NB_CLONES static void set_inside(const nb_frame *frame, uint32_t left, uint32_t top, int *inside)
{
    const uint32_t columns = frame->width - left, rows = frame->height - top;
    NB_SIMD
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const int in_row = nb_lane_x(i) < columns, in_column = nb_lane_y(i) < rows;
        inside[i] = -(in_row & in_column);
    }
}

/* ---- fog on the way to the camera
 * ------------------------------------------------------------------------------------ */

static void set_clear(nb_light_samples *samples)
{
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < NB_BATCH; i++) {
            samples->transmittance[c][i] = 1;
            samples->in_scattering[c][i] = 0;
        }
    }
    for (int i = 0; i < NB_BATCH; i++) samples->error[i] = 0;
}

/* From the ray's start, before it was advanced, to the hit or to infinity. */
static double distance_of(const nb_frame *frame, const nb_scratch *scratch, uint32_t i)
{
    if (scratch->hits.surface[i] == NB_NONE) return HUGE_VAL;
    return frame->view.advance * (double)scratch->rays.length[i] + (double)scratch->hits.t[i];
}

static size_t set_camera_rays(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_rays *rays = &scratch->rays;
    const double *position = frame->view.position;
    size_t count = 0;
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        if (!scratch->inside[i]) continue;
        scratch->fog_rays[count] = (nebel_ray){{position[0], position[1], position[2]},
                                               {rays->direction[0][i], rays->direction[1][i], rays->direction[2][i]},
                                               distance_of(frame, scratch, i)};
        scratch->lanes[count++] = i;
    }
    if (frame->view.projection != NEBEL_PROJECTION_ORTHOGRAPHIC) return count;
    for (size_t k = 0; k < count; k++) {
        for (int c = 0; c < 3; c++) scratch->fog_rays[k].origin[c] += rays->offset[c][scratch->lanes[k]];
    }
    return count;
}

static nebel_result trace_fog(const nb_frame *frame, const nebel_trace_desc *trace, nb_scratch *scratch, size_t count)
{
    if (count == 0) return NEBEL_OK;
    return nebel_trace(frame->renderer->fog, trace, count, scratch->fog_rays, sizeof(nebel_ray),
                       scratch->fog_lights, sizeof(nebel_light));
}

static nebel_result trace_camera_fog(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    if (frame->renderer->fog == NULL) {
        set_clear(samples);
        return NEBEL_OK;
    }
    const size_t count = set_camera_rays(frame, scratch);
    const nebel_result result = trace_fog(frame, &frame->trace, scratch, count);
    if (result != NEBEL_OK) return result;
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = scratch->lanes[k];
        const nebel_light *light = &scratch->fog_lights[k];
        samples->transmittance[0][i] = (float)light->transmittance[0];
        samples->transmittance[1][i] = (float)light->transmittance[1];
        samples->transmittance[2][i] = (float)light->transmittance[2];
        samples->in_scattering[0][i] = (float)light->in_scattering[0];
        samples->in_scattering[1][i] = (float)light->in_scattering[1];
        samples->in_scattering[2][i] = (float)light->in_scattering[2];
        samples->error[i] = (float)light->error;
    }
    return NEBEL_OK;
}

/* ---- surfaces
 * -------------------------------------------------------------------------------------------------------- */

static size_t set_sun_rays(const nb_frame *frame, nb_scratch *scratch)
{
    const double *origin = frame->renderer->geometry.origin, *sun = frame->lighting.sun_direction;
    float(*start)[NB_BATCH] = scratch->points.start;
    size_t count = 0;
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        if (!scratch->points.lit[i]) continue;
        scratch->fog_rays[count] = (nebel_ray){
            {origin[0] + (double)start[0][i], origin[1] + (double)start[1][i], origin[2] + (double)start[2][i]},
            {sun[0], sun[1], sun[2]},
            HUGE_VAL};
        scratch->lanes[count++] = i;
    }
    return count;
}

/* Irradiance of the sun over pi, before fog, in samples->color. */
NB_CLONES static void set_clear_sunlight(const float *irradiance, nb_scratch *scratch)
{
    const int *lit = scratch->points.lit;
    const float *cosine = scratch->points.cosine;
    for (int c = 0; c < 3; c++) {
        const float head_on = irradiance[c] * 0.318309886f;
        float *restrict color = scratch->samples.color[c];
        NB_SIMD
        for (int i = 0; i < NB_BATCH; i++) {
            const float light = head_on * cosine[i];
            color[i] = lit[i] ? light : 0;
        }
    }
}

static nebel_result set_sunlight(const nb_frame *frame, nb_scratch *scratch)
{
    set_clear_sunlight(frame->lighting.irradiance, scratch);
    if (frame->renderer->fog == NULL) return NEBEL_OK;
    const size_t count = set_sun_rays(frame, scratch);
    nebel_trace_desc trace = frame->trace;
    trace.transmittance_only = 1;
    const nebel_result result = trace_fog(frame, &trace, scratch, count);
    if (result != NEBEL_OK) return result;
    float(*color)[NB_BATCH] = scratch->samples.color;
    for (size_t k = 0; k < count; k++) {
        const double *transmittance = scratch->fog_lights[k].transmittance;
        const uint32_t i = scratch->lanes[k];
        color[0][i] *= (float)transmittance[0];
        color[1][i] *= (float)transmittance[1];
        color[2][i] *= (float)transmittance[2];
    }
    return NEBEL_OK;
}

/* color = transmittance * surface + in_scattering; Lambert's surface = reflectance * (irradiance / pi + ambient). */
NB_CLONES static void set_colors(const nb_lighting *lighting, nb_scratch *scratch)
{
    for (int c = 0; c < 3; c++) {
        const float ambient = lighting->ambient[c], background = lighting->background[c];
        const float *restrict reflectance = scratch->points.reflectance[c];
        const float *restrict transmittance = scratch->samples.transmittance[c];
        const float *restrict in_scattering = scratch->samples.in_scattering[c];
        const uint32_t *restrict surface = scratch->hits.surface;
        float *restrict color = scratch->samples.color[c];
        NB_SIMD
        for (int i = 0; i < NB_BATCH; i++) {
            const float reflected = reflectance[i] * (color[i] + ambient);
            color[i] = transmittance[i] * (surface[i] != NB_NONE ? reflected : background) + in_scattering[i];
        }
    }
}

static void set_points(const nb_place *place, nb_scratch *scratch)
{
    const uint32_t x = place->left - place->region_left, y = place->top - place->region_top;
    for (uint32_t i = 0; i < NB_BATCH; i += NB_BLOCK) {
        const uint32_t from = (y + nb_lane_y(i)) * NB_REGION + x + nb_lane_x(i);
        memcpy(scratch->x + i, scratch->region.x + from, NB_BLOCK * sizeof(float));
        memcpy(scratch->y + i, scratch->region.y + from, NB_BLOCK * sizeof(float));
    }
}

static void find_hits(const nb_frame *frame, const nb_place *place, nb_scratch *scratch)
{
    const nb_geometry *geometry = &frame->renderer->geometry;
    set_points(place, scratch);
    nb_view_rays(&frame->view, place->region_left, place->region_top, scratch->x, scratch->y, &scratch->rays);
    if (frame->rasters) {
        nb_raster_hits(geometry, &scratch->seen, place->left - place->region_left, place->top - place->region_top,
                       &scratch->rays, &scratch->hits);
    } else {
        nb_hits_trace(geometry->scene, &scratch->rays, scratch->inside, &scratch->packets, &scratch->hits);
    }
}

nebel_result nb_batch_render(const nb_frame *frame, const nb_place *place, nb_scratch *scratch)
{
    const nebel_renderer *renderer = frame->renderer;
    const nb_geometry *geometry = &renderer->geometry;
    const nb_lighting *lighting = &frame->lighting;
    set_inside(frame, place->left, place->top, scratch->inside);
    find_hits(frame, place, scratch);
    nebel_result result = trace_camera_fog(frame, scratch);
    if (result != NEBEL_OK) return result;
    nb_surface_points(geometry, renderer->scene, &renderer->table, &scratch->rays, &scratch->hits, lighting->sun,
                      &scratch->points);
    if (geometry->scene != NULL && lighting->has_sun) {
        nb_hits_shadow(geometry->scene, scratch->points.start, lighting->sun, scratch->points.lit, &scratch->packets);
    }
    result = set_sunlight(frame, scratch);
    if (result == NEBEL_OK) set_colors(lighting, scratch);
    return result;
}
