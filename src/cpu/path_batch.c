/* The reference renderer's part of a batch: a path for each pixel, and what their spread says of the error. */
#include "cpu_renderer.h"

#include <nebel/nebel.h>

#include <math.h>
#include <string.h>

/* So many bounces end a path where its scene does not. */
enum { MOST_BOUNCES = 10000 };

static void copy(const double from[3], double to[3])
{
    memcpy(to, from, 3 * sizeof *to);
}

/* Planets with air, and the sun behind it. Their sky is no ambient light here: paths find it. */
static nebel_result set_planets(nb_frame *frame, double time)
{
    const nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    nb_planet worlds[NEBEL_MAX_PLANETS];
    const int count = nb_planets_set(worlds, scene, frame->view.position);
    if (count == 0) return NEBEL_OK;
    frame->planets = nb_allocate(&renderer->allocator, (size_t)count, sizeof *frame->planets);
    if (frame->planets == NULL)
        return nb_fail(&renderer->log, NEBEL_ERROR_MEMORY, "frame: out of memory for the air of planets");
    for (int i = 0; i < count; i++) nb_planet_medium_set(&frame->planets[i], worlds[i].planet, time);
    frame->world.media.planets = frame->planets;
    frame->world.media.planet_count = count;
    frame->world.disc = frame->air.sun_radius = nb_planets_disc(scene);
    nb_planets_disc_light(scene, frame->air.sun_radius, frame->air.sun_light);
    frame->air.pixel = nb_view_pixel(&frame->view, frame->height);
    if (nb_surface_lighting_owns_ambient(scene))
        frame->world.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT};
    return NEBEL_OK;
}

nebel_result nb_path_batch_set(nb_frame *frame, const nebel_frame_desc *desc)
{
    const nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    nb_path_scene *world = &frame->world;
    if (renderer->method != NEBEL_METHOD_PATH) return NEBEL_OK;
    if (scene->max_opacity > 0 && scene->max_opacity < 1)
        return nb_fail(&renderer->log, NEBEL_ERROR_UNSUPPORTED,
                       "frame: max_opacity is a look that no light has; the reference cannot show it");
    const int has_fog = renderer->fog != NULL && nebel_get_volume_count(renderer->fog) > 0;
    *world = (nb_path_scene){.media.fog = has_fog ? renderer->fog : NULL,
                             .scene = scene,
                             .geometry = &renderer->geometry,
                             .table = &renderer->table,
                             .has_sun = frame->lighting.has_sun,
                             .bounces = desc->bounces != 0 ? desc->bounces : MOST_BOUNCES};
    copy(frame->lighting.sun_direction, world->to_sun);
    world->environment = frame->lighting.environment;
    if (world->has_sun) copy(scene->sun_irradiance, world->sun);
    frame->seed = desc->seed;
    const nebel_result result = set_planets(frame, desc->time);
    world->is_grey = nb_media_are_grey(&world->media);
    return result;
}

void nb_path_batch_free(nb_frame *frame)
{
    nb_release(&frame->renderer->allocator, frame->planets);
    frame->planets = NULL;
}

/* From where lengths along the ray count: before it was advanced to the geometry. */
static nebel_ray eye_ray(const nb_frame *frame, const nb_ray_batch *rays, int i)
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

/* Where the camera's ray ends, and what is behind everything. */
static void look(const nb_frame *frame, nb_scratch *scratch, int i, nb_path_eye *eye)
{
    eye->ray = eye_ray(frame, &scratch->rays, i);
    eye->first = nb_meeting_of(&scratch->hits, &scratch->points, i);
    const double advance = frame->view.advance * (double)scratch->rays.length[i];
    eye->first.t = eye->ray.t_max = advance + eye->first.t;
    nb_meeting_end_at_ground(&frame->world, &eye->ray, &eye->first);
    nb_cpu_planets_background(&frame->air, &frame->lighting, &scratch->rays, i, eye->background);
    if (!eye->first.is_ground) return;
    scratch->hits.surface[i] = NB_GROUND;
    scratch->hits.t[i] = (float)(eye->first.t - advance);
    for (int c = 0; c < 3; c++) scratch->points.normal[c][i] = eye->first.normal[c];
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

nebel_result nb_path_batch_trace(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch)
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
        nb_path_eye eye;
        nb_path_light light;
        look(frame, scratch, i, &eye);
        const nebel_result result = nb_path_trace(&frame->world, &eye, number, &scratch->lone, &light);
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

void nb_path_batch_finish(const nb_frame *frame, const nb_batch_place *place, const nb_scratch *scratch)
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
