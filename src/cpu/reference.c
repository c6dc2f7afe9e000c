/* The reference renderer's part of a batch: a path for each pixel, and what their spread says of the error. */
#include "renderer.h"

#include <nebel/places.h>

#include <math.h>
#include <string.h>

/* So many bounces end a path where its scene does not. */
enum { MOST_BOUNCES = 10000 };

static void copy(const double from[3], double to[3])
{
    memcpy(to, from, 3 * sizeof *to);
}

nebel_result nb_reference_set(nb_frame *frame, const nebel_frame_desc *desc)
{
    const nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    nb_path_world *world = &frame->world;
    if (renderer->method != NEBEL_METHOD_REFERENCE) return NEBEL_OK;
    if (scene->max_opacity > 0 && scene->max_opacity < 1)
        return nb_fail(&renderer->log, NEBEL_ERROR_UNSUPPORTED,
                       "frame: max_opacity is a look that no light has; the reference cannot show it");
    *world = (nb_path_world){.fog = renderer->fog,
                             .scene = scene,
                             .geometry = &renderer->geometry,
                             .table = &renderer->table,
                             .has_sun = frame->lighting.has_sun,
                             .is_grey = renderer->fog == NULL || nebel_is_fog_grey(renderer->fog),
                             .bounces = desc->bounces != 0 ? desc->bounces : MOST_BOUNCES};
    copy(frame->lighting.sun_direction, world->to_sun);
    world->environment = frame->lighting.environment;
    world->shows_ambient = frame->lighting.shows_ambient;
    copy(scene->background, world->background);
    if (world->has_sun) copy(scene->sun_irradiance, world->sun);
    frame->seed = desc->seed;
    return NEBEL_OK;
}

/* From where lengths along the ray count: before it was advanced to the geometry. */
static nebel_ray eye_ray(const nb_frame *frame, const nb_rays *rays, int i)
{
    const int parallel = frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    nebel_ray ray = {.t_max = HUGE_VAL};
    double square = 0;
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = frame->view.position[c] + (parallel ? rays->offset[c][i] : 0);
        ray.direction[c] = rays->direction[c][i];
        square += ray.direction[c] * ray.direction[c];
    }
    for (int c = 0; c < 3; c++) ray.direction[c] /= sqrt(square);
    return ray;
}

static void put(const nb_path_light *light, uint32_t lane, int i, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    for (int c = 0; c < 3; c++) {
        samples->color[c][i] = (float)light->color[c];
        samples->transmittance[c][i] = (float)light->transmittance[c];
        samples->in_scattering[c][i] = (float)light->in_scattering[c];
        scratch->sums.light[c][lane] += light->color[c];
        scratch->sums.square[c][lane] += light->color[c] * light->color[c];
    }
    samples->error[i] = 0;
}

static void clear_sums(uint32_t first, nb_sums *sums)
{
    for (int c = 0; c < 3; c++) {
        memset(sums->light[c] + first, 0, NB_BATCH * sizeof(double));
        memset(sums->square[c] + first, 0, NB_BATCH * sizeof(double));
    }
}

nebel_result nb_reference_trace(const nb_frame *frame, const nb_place *place, nb_scratch *scratch)
{
    const nebel_renderer *renderer = frame->renderer;
    if (nb_hits_any(&scratch->hits))
        nb_surface_points(&renderer->geometry, renderer->scene, &renderer->table, &scratch->rays, &scratch->hits,
                          frame->lighting.sun, &scratch->points);
    nb_lone_ray_clear(&scratch->lone);
    if (place->sample == frame->first_sample) clear_sums(place->first, &scratch->sums);
    for (int i = 0; i < NB_BATCH; i++) {
        if (!scratch->inside[i]) continue;
        const uint32_t lane = place->first + (uint32_t)i;
        const uint32_t number[4] = {place->left + nb_lane_x(lane), place->top + nb_lane_y(lane), place->sample,
                                    frame->seed};
        const nb_meeting meeting = nb_meeting_of(&scratch->hits, &scratch->points, i);
        nebel_ray eye = eye_ray(frame, &scratch->rays, i);
        eye.t_max = frame->view.advance * (double)scratch->rays.length[i] + meeting.t;
        nb_path_light light;
        const nebel_result result = nb_path_trace(&frame->world, &eye, &meeting, number, &scratch->lone, &light);
        if (result != NEBEL_OK) return result;
        put(&light, lane, i, scratch);
    }
    return NEBEL_OK;
}

/* The standard error of a mean of n, from the sums of n numbers and of their squares. */
static double standard_error(double sum, double square, uint32_t n)
{
    const double mean = sum / n;
    return n > 1 ? sqrt(fmax(square / n - mean * mean, 0) / (n - 1)) : 0;
}

void nb_reference_finish(const nb_frame *frame, const nb_place *place, const nb_scratch *scratch)
{
    const nb_sums *sums = &scratch->sums;
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const uint32_t lane = place->first + i, x = place->left + nb_lane_x(lane), y = place->top + nb_lane_y(lane);
        if (x >= frame->width || y >= frame->height) continue;
        const size_t pixel = 3 * nb_planes_pixel(frame, x, y);
        for (int c = 0; c < 3; c++) {
            const double sum = sums->light[c][lane];
            if (frame->planes->color != NULL)
                frame->planes->color[pixel + (size_t)c] = (float)(sum / frame->sample_count);
            if (frame->planes->standard_error != NULL)
                frame->planes->standard_error[pixel + (size_t)c] =
                    (float)standard_error(sum, sums->square[c][lane], frame->sample_count);
        }
    }
}
