/* One sample of 64 x 4 pixels: rays, hits, shadows, fog, light. Everything is an array over the batch. */
#include "cpu_classic.h"
#include "cpu_clouds.h"
#include "cpu_fog_irradiance.h"
#include "aerial_compose.h"
#include "cpu_textured_planet.h"

#include <math.h>
#include <string.h>

NB_CLONES static void set_inside(const nb_frame *frame, const nb_batch_place *place, int *inside)
{
    const uint32_t columns = frame->width - place->left, rows = frame->height - place->top, first = place->first;
    NB_SIMD
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const int in_row = nb_lane_x(first + i) < columns, in_column = nb_lane_y(first + i) < rows;
        inside[i] = -(in_row & in_column);
    }
}

/* ---- fog on the way to the camera ------------------------------------------------------------ */

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

/* From the ray's start, before it was advanced, to the hit or to infinity; 0 outside the picture, where nothing is
 * asked. In two loops: compilers do not speculate arithmetic. */
NB_CLONES static void set_distances(double advance, const nb_ray_batch *rays, const nb_hits *hits, const int *inside,
                                    float *restrict distance)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) distance[i] = (float)(advance * (double)rays->length[i] + (double)hits->t[i]);
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float to_hit = distance[i];
        const float way = hits->surface[i] == NB_NONE ? HUGE_VALF : to_hit;
        distance[i] = inside[i] ? way : 0;
    }
}

/* All from one place, or all in one direction. */
static nebel_ray_planes camera_rays(const nb_frame *frame, nb_scratch *scratch)
{
    nebel_ray_planes planes = {.t_max = scratch->distance};
    const int parallel = frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    for (int c = 0; c < 3; c++) {
        planes.origin[c] = frame->view.position[c];
        planes.direction[c] = frame->view.axes.forward[c];
        if (parallel)
            planes.offset[c] = scratch->offset[c];
        else
            planes.direction_double[c] = scratch->rays.direction[c];
        for (int i = 0; i < NB_BATCH && parallel; i++) scratch->offset[c][i] = (float)scratch->rays.offset[c][i];
    }
    return planes;
}

static nebel_transfer_planes light_samples(const nb_frame *frame, nb_light_samples *samples)
{
    nebel_transfer_planes planes = {.error = frame->planes->error != NULL ? samples->error : NULL};
    for (int c = 0; c < 3; c++) {
        planes.transmittance[c] = samples->transmittance[c];
        planes.in_scattering[c] = samples->in_scattering[c];
    }
    return planes;
}

/* Where the lights reach fog, to `trace`; `sunlit` lives as long as that. */
static nebel_result find_shafts(const nb_frame *frame, nb_scratch *scratch, nebel_ray_visibility *sunlit,
                                nebel_trace_desc *trace)
{
    const nebel_renderer *renderer = frame->renderer;
    nebel_result result = NEBEL_OK;
    if (frame->has_shafts) {
        result = nb_sun_shafts_find(&scratch->shafts, &renderer->allocator, &renderer->sun_cells, &frame->sunlit_box,
                                    &scratch->rays, frame->view.advance, scratch->distance, frame->eye);
        *sunlit = (nebel_ray_visibility){scratch->shafts.first, scratch->shafts.boundaries};
        trace->sun_visibility = sunlit;
    }
    if (frame->has_light_shafts && result == NEBEL_OK) {
        result = nb_light_shafts_find(&scratch->light_shafts, &renderer->allocator, &renderer->light_tree,
                                      renderer->lighting, &frame->lights_box, &scratch->rays, frame->view.advance,
                                      scratch->distance);
        trace->light_visibility = scratch->light_shafts.pieces;
    }
    return result;
}

/* Rays end at the planet's ground, too. */
static void end_at_ground(const float *ground, float *distance)
{
    for (int i = 0; i < NB_BATCH; i++) distance[i] = fminf(distance[i], ground[i]);
}

/* Fog and air up to scratch->distance. */
static nebel_result trace_haze(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    set_clear(samples);
    if (!frame->air.has_fog) return nb_aerial_add(frame, NULL, NULL, scratch);
    const nebel_ray_planes rays = camera_rays(frame, scratch);
    const nebel_transfer_planes transfers = light_samples(frame, samples);
    nebel_trace_desc trace = frame->trace;
    nebel_ray_visibility pieces;
    nebel_result result = find_shafts(frame, scratch, &pieces, &trace);
    if (result == NEBEL_OK) result = nb_fog_irradiance_trace(frame, &rays, &trace, &transfers, &scratch->air.nodes[0]);
    return result == NEBEL_OK ? nb_aerial_add(frame, &rays, &trace, scratch) : result;
}

static nebel_result trace_camera_fog(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    const int has_air = frame->air.count > 0;
    if (frame->renderer->method != NEBEL_METHOD_EXACT) {
        nb_classic_fog_trace(frame, scratch);
        return NEBEL_OK;
    }
    const int has_fog = frame->renderer->fog != NULL && !(has_air && !frame->air.has_fog);
    const int has_shells = frame->layers != NULL;
    if (!has_fog || has_air) set_clear(samples);
    if (!has_fog && has_shells) return nb_cpu_textured_trace(frame, NULL, NULL, scratch);
    if (!has_fog && !has_air) return NEBEL_OK;
    set_distances(frame->view.advance, &scratch->rays, &scratch->hits, scratch->inside, scratch->distance);
    if (has_air) end_at_ground(scratch->air.ground.distance, scratch->distance);
    if (has_shells) end_at_ground(scratch->shells.ground, scratch->distance);
    if (!has_fog) return nb_aerial_add(frame, NULL, NULL, scratch);
    const nebel_ray_planes rays = camera_rays(frame, scratch);
    const nebel_transfer_planes transfers = light_samples(frame, samples);
    nebel_trace_desc trace = frame->trace;
    nebel_ray_visibility pieces;
    const nebel_result result = find_shafts(frame, scratch, &pieces, &trace);
    if (result != NEBEL_OK) return result;
    const nebel_result traced = nb_fog_irradiance_trace(frame, &rays, &trace, &transfers, &scratch->air.nodes[0]);
    if (traced == NEBEL_OK && has_air) return nb_aerial_add(frame, &rays, &trace, scratch);
    return traced == NEBEL_OK && has_shells ? nb_cpu_textured_trace(frame, &rays, &trace, scratch) : traced;
}

/* ---- surfaces -------------------------------------------------------------------------------- */

/* The sun's light before fog, in samples->color. */
NB_CLONES static void set_clear_sunlight(const float *sunlight, nb_scratch *scratch)
{
    const int *lit = scratch->points.lit;
    const float *cosine = scratch->points.cosine;
    for (int c = 0; c < 3; c++) {
        const float head_on = sunlight[c];
        float *restrict color = scratch->samples.color[c];
        NB_SIMD
        for (int i = 0; i < NB_BATCH; i++) {
            const float light = head_on * cosine[i];
            color[i] = lit[i] ? light : 0;
        }
    }
}

NB_CLONES static void mask_ends(const int *restrict lit, float *restrict distance)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) distance[i] = lit[i] ? HUGE_VALF : 0;
}

/* On planets what is seen need not be near the geometry. */
static nb_ray_starts starts_of(const nb_frame *frame, const nb_scratch *scratch)
{
    const int has_air = frame->air.count > 0;
    nb_ray_starts starts;
    for (int c = 0; c < 3; c++) {
        starts.origin[c] = has_air ? frame->view.position[c] : frame->renderer->geometry.origin[c];
        starts.offset[c] = has_air ? scratch->air.start[c] : scratch->points.start[c];
    }
    return starts;
}

/* What fog leaves of the sun's light where it is lit at all. */
static nebel_result trace_sun_fog(const nb_frame *frame, nb_scratch *scratch, float (*transmittance)[NB_BATCH])
{
    const nb_ray_starts starts = starts_of(frame, scratch);
    nebel_ray_planes rays = {.t_max = scratch->distance};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int c = 0; c < 3; c++) {
        rays.origin[c] = starts.origin[c];
        rays.offset[c] = starts.offset[c];
        rays.direction[c] = frame->lighting.sun_direction[c];
        transfers.transmittance[c] = transmittance[c];
    }
    mask_ends(scratch->points.lit, scratch->distance);
    nebel_trace_desc trace = frame->trace;
    trace.ignore_distances = 1;
    return nebel_trace_planes(frame->renderer->fog, &trace, NB_BATCH, &rays, &transfers);
}

NB_CLONES static void dim(const float (*restrict transmittance)[NB_BATCH], float (*restrict color)[NB_BATCH])
{
    for (int c = 0; c < 3; c++) {
        NB_SIMD
        for (int i = 0; i < NB_BATCH; i++) color[c][i] *= transmittance[c][i];
    }
}

/* Methods that fog the snapshot's way to the camera leave the light of surfaces as it is. */
static int dims_sun(const nebel_renderer *renderer)
{
    if (renderer->fog == NULL) return 0;
    switch (renderer->method) {
    case NEBEL_METHOD_EXACT:
    case NEBEL_METHOD_VERTEX:
    case NEBEL_METHOD_ADDITIVE:
    case NEBEL_METHOD_FOG_COORD:
    case NEBEL_METHOD_TWO_PASS:
    case NEBEL_METHOD_ALPHA:
        return 1;
    default:
        return 0;
    }
}

static nebel_result set_sunlight(const nb_frame *frame, nb_scratch *scratch)
{
    set_clear_sunlight(frame->lighting.sunlight, scratch);
    if (frame->air.count > 0)
        nb_cpu_planets_dim_sun(frame->lighting.sunlight, &scratch->hits, &scratch->air, scratch->samples.color);
    nebel_result result = NEBEL_OK;
    if (frame->cloud_view != NULL) result = nb_cpu_clouds_shade(frame, scratch, scratch->samples.color);
    if (result != NEBEL_OK || !dims_sun(frame->renderer) || !frame->lighting.has_sun) return result;
    result = trace_sun_fog(frame, scratch, scratch->light_transmittance);
    if (result == NEBEL_OK) dim((const float(*)[NB_BATCH])scratch->light_transmittance, scratch->samples.color);
    return result;
}

/* What fog leaves of a point light's light where it is lit at all. */
static nebel_result trace_light_fog(const nb_frame *frame, const nb_ray_starts *starts, nb_scratch *scratch)
{
    nb_shadow_rays *ways = &scratch->light;
    nebel_ray_planes rays = {.t_max = ways->reach};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int c = 0; c < 3; c++) {
        rays.origin[c] = starts->origin[c];
        rays.offset[c] = starts->offset[c];
        rays.direction_float[c] = ways->direction[c];
        transfers.transmittance[c] = scratch->light_transmittance[c];
    }
    for (int i = 0; i < NB_BATCH; i++) ways->reach[i] = ways->lit[i] ? ways->reach[i] : 0;
    nebel_trace_desc trace = frame->trace;
    trace.ignore_distances = 1;
    return nebel_trace_planes(frame->renderer->fog, &trace, NB_BATCH, &rays, &transfers);
}

static void add_light(const nebel_light *light, int is_dimmed, nb_scratch *scratch)
{
    const nb_shadow_rays *ways = &scratch->light;
    for (int c = 0; c < 3; c++) {
        const float intensity = (float)light->intensity[c];
        for (int i = 0; i < NB_BATCH; i++) {
            if (!ways->lit[i]) continue;
            const float left = is_dimmed ? scratch->light_transmittance[c][i] : 1;
            scratch->samples.color[c][i] += intensity * ways->strength[i] * left;
        }
    }
}

static int is_lit_anywhere(const nb_shadow_rays *ways)
{
    int lit = 0;
    for (int i = 0; i < NB_BATCH; i++) lit |= ways->lit[i];
    return lit;
}

/* Point light by point light, to samples->color. */
static nebel_result add_point_lights(const nb_frame *frame, nb_scratch *scratch)
{
    const nebel_renderer *renderer = frame->renderer;
    const nb_geometry *geometry = &renderer->geometry;
    const nb_ray_starts starts = starts_of(frame, scratch);
    const int is_dimmed = dims_sun(renderer);
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < renderer->scene->light_count && result == NEBEL_OK; i++) {
        const nebel_light *light = &renderer->scene->lights[i];
        nb_shadow_rays_set(light, &starts, &scratch->hits, &scratch->points, &scratch->light);
        nb_shadow_rays_shadow(geometry->scene, &scratch->points, &scratch->light, &scratch->packets);
        if (!is_lit_anywhere(&scratch->light)) continue;
        if (is_dimmed) result = trace_light_fog(frame, &starts, scratch);
        add_light(light, is_dimmed, scratch);
    }
    return result;
}

/* color = transmittance * surface + in_scattering; Lambert's surface = reflectance * (irradiance / pi + ambient). */
NB_CLONES static void set_colors(const nb_surface_lighting *lighting, nb_scratch *scratch)
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

/* The same where ambient light depends on the direction: of the normal, or of the ray where the background shows it. */
static void set_colors_by_direction(const nb_surface_lighting *lighting, nb_scratch *scratch)
{
    const nb_light_samples *samples = &scratch->samples;
    for (int i = 0; i < NB_BATCH; i++) {
        double direction[3], light[3] = {0, 0, 0};
        const int is_surface = scratch->hits.surface[i] != NB_NONE;
        for (int c = 0; c < 3; c++)
            direction[c] = is_surface ? (double)scratch->points.normal[c][i] : scratch->rays.direction[c][i];
        if (is_surface)
            nebel_evaluate_environment_diffuse(&lighting->environment, direction, light);
        else if (lighting->shows_ambient)
            nebel_evaluate_environment(&lighting->environment, direction, light);
        for (int c = 0; c < 3; c++) {
            const float ambient = (float)light[c];
            const float reflected = scratch->points.reflectance[c][i] * (samples->color[c][i] + ambient);
            const float background = lighting->shows_ambient ? ambient : lighting->background[c];
            scratch->samples.color[c][i] =
                samples->transmittance[c][i] * (is_surface ? reflected : background) + samples->in_scattering[c][i];
        }
    }
}

/* The same on a planet: ambient light of the ground is the sky's there, and the sun is behind everything. */
static void set_colors_in_air(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_light_samples *samples = &scratch->samples;
    for (int i = 0; i < NB_BATCH; i++) {
        const uint32_t surface = scratch->hits.surface[i];
        double behind[3] = {0, 0, 0};
        if (surface == NB_NONE) {
            nb_cpu_planets_background(&frame->air, &frame->lighting, &scratch->rays, i, behind);
        } else {
            double normal[3], ambient[3];
            for (int c = 0; c < 3; c++) {
                normal[c] = (double)scratch->points.normal[c][i];
                ambient[c] = 0.31830988618379067 * (double)scratch->air.ground.sky[c][i];
            }
            if (surface != NB_GROUND) {
                nebel_evaluate_environment_diffuse(&frame->lighting.environment, normal, ambient);
                for (int c = 0; c < 3; c++) ambient[c] *= (double)scratch->air.sky_there[c][i];
            }
            for (int c = 0; c < 3; c++)
                behind[c] = (double)scratch->points.reflectance[c][i] * ((double)samples->color[c][i] + ambient[c]);
        }
        for (int c = 0; c < 3; c++)
            scratch->samples.color[c][i] =
                samples->transmittance[c][i] * (float)behind[c] + samples->in_scattering[c][i];
    }
}

static int has_one_light(const nb_surface_lighting *lighting)
{
    return lighting->environment.type == NEBEL_ENVIRONMENT_CONSTANT;
}

static void choose_colors(const nb_frame *frame, nb_scratch *scratch)
{
    if (frame->air.count > 0)
        set_colors_in_air(frame, scratch);
    else if (has_one_light(&frame->lighting))
        set_colors(&frame->lighting, scratch);
    else
        set_colors_by_direction(&frame->lighting, scratch);
}

/* Those behind the fog first. */
static void set_stored_colors(const nb_frame *frame, nb_scratch *scratch)
{
    const nb_light_samples fog = scratch->samples;
    nb_light_samples *const samples = &scratch->samples;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < NB_BATCH; i++) {
            samples->transmittance[c][i] = 1;
            samples->in_scattering[c][i] = 0;
        }
    choose_colors(frame, scratch);
    nb_classic_fog_blend(&fog, samples);
    memcpy(samples->transmittance, fog.transmittance, sizeof fog.transmittance);
    memcpy(samples->in_scattering, fog.in_scattering, sizeof fog.in_scattering);
}

static void find_hits(const nb_frame *frame, const nb_batch_place *place, uint32_t sample, nb_scratch *scratch)
{
    const nb_geometry *geometry = &frame->renderer->geometry;
    const nb_region_points *points = &scratch->points_of_region[sample];
    nb_view_rays(&frame->view, place->left, place->top, points->x + place->first, points->y + place->first,
                 &scratch->rays);
    if (frame->rasters) {
        nb_raster_hits(geometry, scratch->seen[sample].triangle + place->first, &scratch->rays, &scratch->hits);
    } else {
        nb_hits_trace(geometry->scene, &scratch->rays, scratch->inside, &scratch->packets, &scratch->hits);
    }
    nb_hits_refine(geometry, &scratch->rays, &scratch->hits);
}

static nebel_result light_surfaces(const nb_frame *frame, nb_scratch *scratch)
{
    const nebel_renderer *renderer = frame->renderer;
    const nb_geometry *geometry = &renderer->geometry;
    const nb_surface_lighting *lighting = &frame->lighting;
    nb_surface_points(geometry, renderer->scene, &renderer->table, &scratch->rays, &scratch->hits, lighting->sun,
                      &scratch->points);
    if (frame->air.count > 0)
        nb_cpu_planets_set_points(&frame->air, frame->view.advance, frame->view.start, geometry->origin, lighting->sun,
                                  &scratch->rays, &scratch->air, &scratch->hits, &scratch->points);
    if (frame->air.count > 0)
        nb_cpu_planets_set_irradiance(&frame->air, geometry->origin, &scratch->hits, &scratch->points, &scratch->air);
    if (lighting->has_sun) {
        nb_hits_shadow(geometry->scene, scratch->points.start, lighting->sun, scratch->points.lit, &scratch->packets);
    }
    nebel_result result = frame->cloud_view != NULL ? nb_cpu_clouds_shade_sky(frame, scratch) : NEBEL_OK;
    if (result == NEBEL_OK) result = set_sunlight(frame, scratch);
    return result == NEBEL_OK ? add_point_lights(frame, scratch) : result;
}

static void find_ground(const nb_frame *frame, nb_scratch *scratch)
{
    if (frame->air.count > 0)
        nb_cpu_planets_find_ground(&frame->air, frame->view.advance, &scratch->rays, scratch->inside, &scratch->hits,
                                   &scratch->air);
}

void nb_batch_find(const nb_frame *frame, const nb_batch_place *place, uint32_t sample, nb_scratch *scratch)
{
    set_inside(frame, place, scratch->inside);
    find_hits(frame, place, sample, scratch);
}

void nb_batch_find_centers(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch)
{
    set_inside(frame, place, scratch->inside);
    nb_view_rays(&frame->view, place->left, place->top, scratch->centers.x + place->first,
                 scratch->centers.y + place->first, &scratch->rays);
    for (int i = 0; i < NB_BATCH; i++) scratch->hits.surface[i] = NB_NONE;
    find_ground(frame, scratch);
}

nebel_result nb_batch_light(const nb_frame *frame, nb_scratch *scratch)
{
    const int has_air = frame->air.count > 0;
    nebel_result result = frame->layers != NULL ? nb_cpu_textured_find(frame, scratch) : NEBEL_OK;
    if (result == NEBEL_OK) result = trace_camera_fog(frame, scratch);
    if (result == NEBEL_OK && frame->cloud_view != NULL) result = nb_cpu_clouds_add(frame, trace_haze, scratch);
    const int has_surface = nb_hits_any(&scratch->hits) || (has_air && nb_cpu_planets_sees_ground(&scratch->air));
    if (result == NEBEL_OK && has_surface) result = light_surfaces(frame, scratch);
    if (result != NEBEL_OK) return result;
    if (nebel_method_blends_stored(frame->renderer->method))
        set_stored_colors(frame, scratch);
    else
        choose_colors(frame, scratch);
    if (frame->layers != NULL) nb_cpu_textured_blend(frame, scratch);
    return result;
}

nebel_result nb_batch_render(const nb_frame *frame, const nb_batch_place *place, uint32_t sample, nb_scratch *scratch)
{
    nb_batch_find(frame, place, sample, scratch);
    if (frame->renderer->method == NEBEL_METHOD_PATH) return nb_path_batch_trace(frame, place, scratch);
    find_ground(frame, scratch);
    return nb_batch_light(frame, scratch);
}
