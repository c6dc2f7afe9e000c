#include "cpu_classic.h"
#include "cpu_clouds.h"
#include "cpu_fog_irradiance.h"
#include "uniform_batch.h"
#include "cpu_textured_planet.h"

#include <math.h>
#include <omp.h>
#include <string.h>

/* What the threads of a frame share. */
typedef struct nb_frame_progress {
    const nebel_frame_desc *desc;
    size_t total, done;  /* parts: a few samples of a region */
    size_t step;         /* parts between two calls of progress */
    int stop;            /* a thread failed or the caller had enough */
    nebel_result result; /* of the first that failed */
} nb_frame_progress;

/* ---- checks ---------------------------------------------------------------------------------- */

static nebel_result check_desc(const nebel_frame_desc *desc, const nebel_log *log)
{
    if (desc->width < 1 || desc->width > 32768 || desc->height < 1 || desc->height > 32768) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "frame: %u x %u pixels; 1 to 32768 are possible", (unsigned)desc->width,
                       (unsigned)desc->height);
    }
    if (desc->samples > 4096) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "frame: %u samples; 1 to 4096 are possible", (unsigned)desc->samples);
    }
    const uint32_t samples = desc->samples != 0 ? desc->samples : 4;
    if (desc->sample_count > samples ||
        desc->first_sample > samples - (desc->sample_count > 0 ? desc->sample_count : samples))
        return nb_fail(log, NEBEL_ERROR_VALUE, "frame: %u samples from number %u on, of %u; they must be among them",
                       (unsigned)desc->sample_count, (unsigned)desc->first_sample, (unsigned)samples);
    if (!(fabs(desc->time) <= 1e12))
        return nb_fail(log, NEBEL_ERROR_VALUE, "frame: time is %g; must be within -1e12 and 1e12", desc->time);
    if (!(desc->tolerance >= 0) || isinf(desc->tolerance)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "frame: tolerance is %g, it must be above 0, or 0 for %g",
                       desc->tolerance, NEBEL_DEFAULT_TOLERANCE);
    }
    return NEBEL_OK;
}

/* A window ends where regions end: what is found once for a batch is then found as in the whole picture. */
static int is_good_side(uint32_t first, uint32_t size, uint32_t whole)
{
    const uint32_t left = first <= whole ? whole - first : 0;
    return first % NB_REGION == 0 && size > 0 && size <= left && (size % NB_REGION == 0 || size == left);
}

_Static_assert((int)NEBEL_WINDOW_STEP == (int)NB_REGION, "windows end where regions end");

static nebel_result set_window(nb_frame *frame, const nebel_frame_desc *desc)
{
    const nebel_window *wanted = &desc->window;
    frame->window = *wanted;
    if (wanted->left == 0 && wanted->top == 0 && wanted->width == 0 && wanted->height == 0)
        frame->window = (nebel_window){0, 0, desc->width, desc->height};
    if (is_good_side(frame->window.left, frame->window.width, desc->width) &&
        is_good_side(frame->window.top, frame->window.height, desc->height))
        return NEBEL_OK;
    return nb_fail(
        &frame->renderer->log, NEBEL_ERROR_VALUE,
        "frame: a window of %u x %u pixels at %u, %u; it must be within the picture, begin at multiples of %d and "
        "have multiples of %d, or end with the picture",
        (unsigned)wanted->width, (unsigned)wanted->height, (unsigned)wanted->left, (unsigned)wanted->top,
        NEBEL_WINDOW_STEP, NEBEL_WINDOW_STEP);
}

static nb_lit_box lit_box_of(const nb_geometry *geometry, const nebel_bounds *bounds)
{
    nb_lit_box box;
    for (int c = 0; c < 3; c++) {
        box.low[c] = (float)(bounds->min[c] - geometry->origin[c]);
        box.high[c] = (float)(bounds->max[c] - geometry->origin[c]);
    }
    return box;
}

/* Surfaces between the sun or point lights and fog that they light. */
static nebel_result set_shafts(nb_frame *frame)
{
    nebel_renderer *renderer = frame->renderer;
    const nb_geometry *geometry = &renderer->geometry;
    const int may = renderer->fog != NULL && renderer->method == NEBEL_METHOD_EXACT && geometry->scene != NULL;
    nebel_bounds by_sun, by_lights;
    nebel_result result = NEBEL_OK;
    const nebel_lighting *lighting = nb_fog_irradiance_is(&frame->air) ? frame->air.daylit : renderer->lighting;
    frame->has_shafts = may && nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_SUN, &by_sun);
    frame->has_light_shafts = may && nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_LOCAL, &by_lights);
    if (frame->has_shafts) {
        frame->sunlit_box = lit_box_of(geometry, &by_sun);
        result = nb_sun_cells_set(&renderer->sun_cells, geometry, nebel_get_lighting_sun(lighting).direction);
        frame->eye = nb_sun_shafts_eye(&renderer->sun_cells, geometry, &frame->view);
    }
    if (frame->has_light_shafts && result == NEBEL_OK) {
        frame->lights_box = lit_box_of(geometry, &by_lights);
        result = nb_shadow_tree_set_lights(&renderer->light_tree, geometry, renderer->threads);
    }
    if (result == NEBEL_OK) return NEBEL_OK;
    return nb_fail(&renderer->log, result, "frame: out of memory for the shadows that surfaces cast into fog");
}

/* What cannot be drawn with air is refused, not left out. */
static nebel_result set_frame_air(nb_frame *frame, const nebel_frame_desc *desc)
{
    nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    if (scene->planet_count == 0 || scene->planets[0].atmosphere == NULL) return NEBEL_OK;
    if (renderer->method != NEBEL_METHOD_EXACT && renderer->method != NEBEL_METHOD_PATH)
        return nb_fail(
            &renderer->log, NEBEL_ERROR_UNSUPPORTED,
            "planets are drawn by the methods exact and reference alone: ask for no other method, or leave the "
            "planet out");
    if (frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC)
        return nb_fail(&renderer->log, NEBEL_ERROR_UNSUPPORTED,
                       "frame: orthographic cameras see no planets; take a perspective one or a panorama");
    if (renderer->method == NEBEL_METHOD_PATH) return NEBEL_OK;
    const double tolerance = desc->tolerance > 0 ? desc->tolerance : NEBEL_DEFAULT_TOLERANCE;
    frame->air.tolerance = (float)tolerance;
    frame->air.pixel = nb_view_pixel(&frame->view, frame->height);
    frame->air.has_fog = renderer->fog != NULL && nebel_get_volume_count(renderer->fog) > 0;
    return nb_cpu_planets_set(
        &frame->air, scene, &renderer->allocator, &renderer->log, frame->view.position, frame->lighting.sun_direction,
        frame->air.has_fog || scene->planets[0].clouds != NULL || renderer->geometry.scene != NULL, renderer->threads);
}

static nebel_result set_frame(nb_frame *frame, const nebel_frame_desc *desc)
{
    nebel_renderer *renderer = frame->renderer;
    nb_geometry *geometry = &renderer->geometry;
    nebel_result result = check_desc(desc, &renderer->log);
    if (result == NEBEL_OK) result = set_window(frame, desc);
    if (result == NEBEL_OK) result = nb_surface_lighting_set(&frame->lighting, renderer->scene, &renderer->log);
    if (result == NEBEL_OK)
        result = nb_view_set(&frame->view, &desc->camera, desc->width, desc->height, &renderer->log);
    if (result != NEBEL_OK) return result;
    result = nb_geometry_place(geometry, frame->view.position);
    if (result != NEBEL_OK) return nb_fail(&renderer->log, result, "frame: the surfaces could not be built");
    nb_view_place(&frame->view, geometry->origin, geometry->bounds_min, geometry->bounds_max);
    frame->width = desc->width;
    frame->height = desc->height;
    frame->samples = desc->samples != 0 ? desc->samples : 4;
    frame->first_sample = desc->first_sample;
    frame->sample_count = desc->sample_count != 0 ? desc->sample_count : frame->samples;
    frame->rasters = nb_raster_is_apt(geometry, frame->view.projection, desc->width, desc->height);
    if (frame->rasters) {
        const nb_raster_target picture = {desc->width, desc->height, nb_sample_range_of(frame->samples)};
        nb_raster_set(&frame->raster, geometry, &frame->view, &picture, renderer->threads);
    }
    frame->trace = (nebel_trace_desc){.lighting = renderer->lighting,
                                      .precision = NEBEL_PRECISION_FLOAT,
                                      .isa = renderer->fog_isa,
                                      .tolerance = desc->tolerance};
    result = nb_classic_fog_set_vertices(frame);
    if (result != NEBEL_OK)
        return nb_fail(&renderer->log, result, "frame: fog at a vertex: %s", nebel_result_text(result));
    result = nb_path_batch_set(frame, desc);
    if (result == NEBEL_OK) result = set_frame_air(frame, desc);
    if (result == NEBEL_OK) result = nb_cpu_clouds_set(frame, desc);
    if (result == NEBEL_OK) result = nb_fog_irradiance_set(frame);
    if (result == NEBEL_OK) result = set_shafts(frame);
    return result == NEBEL_OK ? nb_cpu_textured_set(frame, desc) : result;
}

/* ---- regions --------------------------------------------------------------------------------- */

static nebel_result render_batch(const nb_frame *frame, const nb_batch_place *place, uint32_t first, uint32_t count,
                                 nb_scratch *scratch)
{
    nb_batch_place now = *place;
    int is_even = 0;
    nebel_result result = frame->cloud_view != NULL ? nb_cpu_clouds_start(frame, place, scratch) : NEBEL_OK;
    if (result == NEBEL_OK && nb_uniform_batch_may_be(frame))
        result = nb_uniform_batch_render(frame, place, count, scratch, &is_even);
    for (uint32_t s = 0; s < count && result == NEBEL_OK; s++) {
        now.sample = first + s;
        if (!is_even) result = nb_batch_render(frame, &now, s, scratch);
        if (result != NEBEL_OK) return result;
        nb_planes_add(frame, &now, now.sample == frame->first_sample, scratch);
    }
    return result;
}

/* Samples first to first + count - 1. */
static nebel_result render_samples(const nb_frame *frame, uint32_t left, uint32_t top, uint32_t first, uint32_t count,
                                   nb_scratch *scratch)
{
    for (uint32_t s = 0; s < count; s++) {
        nb_sample_region(first + s, frame->samples, &scratch->points_of_region[s]);
    }
    if (nb_uniform_batch_may_be(frame) || frame->cloud_view != NULL) nb_sample_region(0, 1, &scratch->centers);
    if (frame->rasters) {
        nb_raster_region(&frame->raster, left, top, count, scratch->points_of_region, scratch->seen);
    }
    nb_batch_place place = {left, top, 0, 0};
    for (; place.first < NB_PIXELS && top + nb_lane_y(place.first) < frame->height; place.first += NB_BATCH) {
        const nebel_result result = render_batch(frame, &place, first, count, scratch);
        if (result != NEBEL_OK) return result;
    }
    return NEBEL_OK;
}

/* One thread at a time. */
static void finish_part(nb_frame_progress *state, nebel_result result)
{
    state->done++;
    if (result == NEBEL_OK && state->result == NEBEL_OK && state->desc->progress != NULL &&
        (state->done % state->step == 0 || state->done == state->total) &&
        state->desc->progress(state->done, state->total, state->desc->progress_user) != 0) {
        result = NEBEL_ERROR_CANCELLED;
    }
    if (result == NEBEL_OK || state->result != NEBEL_OK) return;
    state->result = result;
#pragma omp atomic write
    state->stop = 1;
}

/* Returns whether that was the last one to be done. */
static int count_part(nb_frame_progress *state, nebel_result result)
{
    int stop;
#pragma omp critical(nb_count_part)
    finish_part(state, result);
#pragma omp atomic read
    stop = state->stop;
    return stop;
}

static uint32_t count_groups(const nb_frame *frame)
{
    return (frame->sample_count + NB_TOGETHER - 1) / NB_TOGETHER;
}

static uint32_t count_regions(uint32_t pixels)
{
    return (pixels + NB_REGION - 1) / NB_REGION;
}

static void render_region(const nb_frame *frame, size_t number, nb_frame_progress *state, nb_scratch *scratch)
{
    const uint32_t columns = count_regions(frame->window.width);
    const uint32_t left = frame->window.left + (uint32_t)(number % columns) * NB_REGION;
    const uint32_t top = frame->window.top + (uint32_t)(number / columns) * NB_REGION;
    for (uint32_t first = 0; first < frame->sample_count; first += NB_TOGETHER) {
        const uint32_t rest = frame->sample_count - first, count = rest < NB_TOGETHER ? rest : NB_TOGETHER;
        const nebel_result result = render_samples(frame, left, top, frame->first_sample + first, count, scratch);
        if (count_part(state, result)) return;
    }
    nb_batch_place place = {left, top, 0, 0};
    for (; place.first < NB_PIXELS && top + nb_lane_y(place.first) < frame->height; place.first += NB_BATCH) {
        nb_planes_finish(frame, &place, scratch);
        if (frame->renderer->method == NEBEL_METHOD_PATH) nb_path_batch_finish(frame, &place, scratch);
    }
}

static void render_regions(const nb_frame *frame, size_t regions, nb_frame_progress *state)
{
#pragma omp parallel for schedule(dynamic, 1) num_threads(frame->renderer->threads)
    for (size_t i = 0; i < regions; i++) {
        int stop;
#pragma omp atomic read
        stop = state->stop;
        if (stop) continue;
        render_region(frame, i, state, &frame->renderer->scratch[omp_get_thread_num()]);
    }
}

static void free_frame(nb_frame *frame)
{
    nb_cpu_clouds_free(frame);
    nb_path_batch_free(frame);
    nb_cpu_planets_free(&frame->air);
}

nebel_result nebel_render_frame(nebel_renderer *renderer, const nebel_frame_desc *desc, const nebel_frame *frame)
{
    if (renderer == NULL || desc == NULL || frame == NULL) return NEBEL_ERROR_ARGUMENT;
    nb_frame made = {.renderer = renderer, .planes = frame};
    const nebel_result result = set_frame(&made, desc);
    if (result != NEBEL_OK) {
        free_frame(&made);
        return result;
    }
    const size_t regions = (size_t)count_regions(made.window.width) * count_regions(made.window.height);
    const size_t parts = regions * count_groups(&made);
    nb_frame_progress state = {.desc = desc, .total = parts, .step = (parts + 99) / 100};
    render_regions(&made, regions, &state);
    free_frame(&made);
    if (state.result == NEBEL_ERROR_CANCELLED) return nb_fail(&renderer->log, state.result, "frame: stopped");
    if (state.result != NEBEL_OK) {
        return nb_fail(&renderer->log, state.result, "frame: fog along a ray: %s", nebel_result_text(state.result));
    }
    return NEBEL_OK;
}
