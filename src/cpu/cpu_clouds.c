#include "cpu_clouds.h"

#include "cloud_air.h"
#include "cpu_fog_shadow.h"
#include "aerial_compose.h"

#include "aerial/cloud_eclipse.h"
#include "aerial/cloud_pixels.h"

#include <math.h>
#include <string.h>

_Static_assert((int)NB_CLOUD_PIXELS_COLUMNS == (int)NB_REGION && (int)NB_CLOUD_SHARE == (int)NB_BATCH,
               "a batch is a block");

/* ---- the frame ------------------------------------------------------------------------------- */

nebel_result nb_cpu_clouds_set(nb_frame *frame, const nebel_frame_desc *desc)
{
    nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    if (frame->air.count == 0 || scene->planets[0].clouds == NULL) return NEBEL_OK;
    const nebel_cloud_lighting_desc view = {.clouds = scene->planets[0].clouds,
                                            .sun = nb_surface_lighting_sun(scene),
                                            .time = desc->time,
                                            .tolerance = fmin(1, desc->tolerance),
                                            .isa = renderer->fog_isa,
                                            .host = {.allocator = renderer->allocator, .log = renderer->log}};
    nebel_result result = nebel_create_cloud_lighting(&view, &frame->cloud_view);
    for (int i = 0; i < renderer->threads && result == NEBEL_OK; i++)
        result = nebel_create_cloud_workspace(frame->cloud_view, &renderer->scratch[i].clouds.workspace);
    return result;
}

void nb_cpu_clouds_free(nb_frame *frame)
{
    if (frame->cloud_view == NULL) return;
    for (int i = 0; i < frame->renderer->threads; i++) {
        nebel_destroy_cloud_workspace(frame->renderer->scratch[i].clouds.workspace);
        frame->renderer->scratch[i].clouds.workspace = NULL;
    }
    nebel_destroy_cloud_lighting(frame->cloud_view);
}

/* ---- along the middles of pixels ------------------------------------------------------------- */

/* The air has the shade of those that are lifted. */
static void lift_rays(const nb_frame *frame, nb_cloud_scratch *clouds)
{
    const nb_air_frame *air = &frame->air;
    int any = 0;
    clouds->middles = clouds->rays;
    for (int i = 0; i < NB_BATCH; i++) {
        const double pixel = air->pixel / (double)clouds->rays.length[i];
        double direction[3];
        for (int c = 0; c < 3; c++) direction[c] = clouds->rays.direction[c][i];
        clouds->is_lifted[i] = clouds->has_lifted[i] =
            frame->samples > 1 && nb_planets_lift(air->worlds, air->count, air->position, pixel, direction);
        for (int c = 0; c < 3; c++) clouds->rays.direction[c][i] = direction[c];
        any |= clouds->has_lifted[i];
    }
    if (any) nb_view_finish_rays(&frame->view, &clouds->rays);
    clouds->lifted = clouds->rays;
}

nebel_result nb_cpu_clouds_start(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch)
{
    nb_cloud_scratch *clouds = &scratch->clouds;
    nb_view_rays(&frame->view, place->left, place->top, scratch->centers.x + place->first,
                 scratch->centers.y + place->first, &clouds->rays);
    memset(clouds->reach, 0, sizeof clouds->reach);
    lift_rays(frame, clouds);
    nb_fog_shadow_start(scratch);
    for (uint32_t i = 0; i < NB_BATCH; i++) clouds->nodes[i].count = clouds->shaded_count[i] = 0;
    return nb_cloud_air_shade(frame, place, clouds);
}

static void unit_of(const nb_cloud_scratch *clouds, const nebel_ray *ray, uint32_t lane, double unit[3])
{
    for (int c = 0; c < 3; c++) unit[c] = ray->direction[c] / (double)clouds->rays.length[lane];
}

/* How far the ground is through the middle of a pixel. */
static float ground_of(const nb_frame *frame, const nb_cloud_scratch *clouds, uint32_t lane)
{
    const nebel_ray ray = nb_cloud_air_ray(frame, clouds, lane);
    double unit[3];
    unit_of(clouds, &ray, lane, unit);
    return (float)nb_planets_cloudy_ground(frame->air.worlds, frame->air.count, ray.origin, unit);
}

/* How far clouds matter to a sample. A ray that goes on from there to the ground is not followed beyond it. */
static float end_of(const nb_frame *frame, const nb_scratch *scratch, uint32_t lane)
{
    const float distance = scratch->distance[lane];
    if (!(scratch->air.ground.distance[lane] < HUGE_VALF)) return distance;
    const nebel_ray ray = nb_cloud_air_ray(frame, &scratch->clouds, lane);
    double unit[3];
    unit_of(&scratch->clouds, &ray, lane, unit);
    const nb_planet *world = &frame->air.worlds[scratch->air.world[lane]];
    return (float)nb_cloud_ground_end(world->center, ray.origin, unit, (double)distance);
}

/* Whether what was found for another sample of a pixel does for one. */
static int is_found(const nb_cloud_scratch *clouds, int lane)
{
    const nebel_cloud_transfer *nodes = &clouds->nodes[lane];
    const float last = nodes->count > 0 ? nodes->t[nodes->count - 1] : 0;
    return nb_cloud_is_found(nodes->count, nodes->t[0], last, clouds->reach[lane], clouds->end[lane]);
}

static void take_ray(const nb_ray_batch *from, int lane, nb_ray_batch *to)
{
    to->length[lane] = from->length[lane];
    for (int c = 0; c < 3; c++) {
        to->direction[c][lane] = from->direction[c][lane];
        to->unit[c][lane] = from->unit[c][lane];
        to->start[c][lane] = from->start[c][lane];
    }
}

/* As a sample sees the sky or does not. What was found along the other ray is no more. */
static void choose_ray(const nb_scratch *scratch, int lane, nb_cloud_scratch *clouds)
{
    const int sees_sky = scratch->distance[lane] == HUGE_VALF;
    if (!clouds->has_lifted[lane] || clouds->is_lifted[lane] == sees_sky) return;
    take_ray(sees_sky ? &clouds->lifted : &clouds->middles, lane, &clouds->rays);
    clouds->is_lifted[lane] = sees_sky;
    clouds->nodes[lane].count = 0;
    clouds->reach[lane] = 0;
}

static uint32_t cloud_lane(int pixel)
{
    return nb_lane_at((uint32_t)pixel % NB_REGION, (uint32_t)pixel / NB_REGION);
}

/* Some pixels of a block, all at once. */
static nebel_result trace_pixels(const nb_frame *frame, const int is_asked[NB_CLOUD_SHARE], nb_cloud_scratch *clouds)
{
    const nb_air_frame *const air = &frame->air;
    uint32_t count = 0, lanes[NB_BATCH];
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        const uint32_t lane = cloud_lane(i);
        if (!is_asked[i]) continue;
        clouds->asked[count] = nb_cloud_air_ray(frame, clouds, lane);
        clouds->asked[count].t_max = (double)clouds->end[lane];
        clouds->spreads[count] = air->pixel / (double)clouds->rays.length[lane];
        lanes[count++] = lane;
    }
    const nebel_result result = nebel_trace_clouds(clouds->workspace, count, clouds->asked, sizeof *clouds->asked, 0,
                                                   clouds->spreads, clouds->found, sizeof *clouds->found);
    for (uint32_t k = 0; k < count && result == NEBEL_OK; k++) {
        nb_cloud_eclipse(air->worlds, air->count, &clouds->asked[k], air->to_sun, air->sun_radius, &clouds->found[k]);
        clouds->nodes[lanes[k]] = clouds->found[k];
    }
    return result;
}

static nebel_result trace_block(const nb_frame *frame, nb_cloud_pixel_block *block, nb_cloud_scratch *clouds)
{
    nebel_result result = NEBEL_OK;
    nb_cloud_pixels_block_begin(block);
    for (int level = 0; level < NB_CLOUD_PIXELS_LEVELS && result == NEBEL_OK; level++) {
        int is_asked[NB_CLOUD_SHARE];
        nb_cloud_pixels_block_ask(block, level, is_asked);
        result = trace_pixels(frame, is_asked, clouds);
    }
    return result;
}

/* As far as samples go. *any: whether there are clouds. */
static nebel_result trace_clouds(const nb_frame *frame, nb_scratch *scratch, int *any)
{
    nb_cloud_scratch *clouds = &scratch->clouds;
    nb_cloud_pixel_block block;
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        const uint32_t lane = cloud_lane(i);
        if (scratch->inside[lane]) {
            choose_ray(scratch, (int)lane, clouds);
            clouds->end[lane] = end_of(frame, scratch, lane);
        }
        block.ground[i] = ground_of(frame, clouds, lane);
        block.is_wanted[i] = scratch->inside[lane] && !is_found(clouds, (int)lane);
        block.is_open[i] = scratch->distance[lane] == HUGE_VALF || scratch->air.ground.distance[lane] < HUGE_VALF;
        block.is_open[i] &= !clouds->is_lifted[lane];
        block.nodes[i] = &clouds->nodes[lane];
    }
    const nebel_result result = trace_block(frame, &block, clouds);
    *any = 0;
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        const uint32_t lane = cloud_lane(i);
        if (block.is_wanted[i]) clouds->reach[lane] = clouds->end[lane];
        clouds->is_new[lane] = block.is_wanted[i] && clouds->nodes[lane].count > 0;
        *any |= clouds->is_new[lane];
    }
    return result;
}

/* ---- among air and fog ----------------------------------------------------------------------- */

/* Marks the nodes that are next. */
static nebel_result mark(const nb_frame *frame, nb_aerial_fn haze, nb_scratch *scratch)
{
    nb_cloud_scratch *clouds = &scratch->clouds;
    for (int i = 0; i < NB_BATCH; i++)
        scratch->distance[i] = clouds->next[i] >= 0 ? clouds->nodes[i].t[clouds->next[i]] : 0;
    const nebel_result result = haze(frame, scratch);
    for (int i = 0; i < NB_BATCH; i++) {
        float left[3], light[3];
        if (clouds->next[i] < 0) continue;
        for (int c = 0; c < 3; c++) {
            left[c] = scratch->samples.transmittance[c][i];
            light[c] = scratch->samples.in_scattering[c][i];
        }
        nb_cloud_mark(&clouds->marks[i], (uint32_t)clouds->next[i], left, light);
    }
    return result;
}

/* What is next. *any: whether anything is. */
static nebel_result choose_samples(const nb_frame *frame, nb_cloud_scratch *clouds, int *any)
{
    int is_longer[NB_BATCH] = {0};
    *any = 0;
    for (int i = 0; i < NB_BATCH; i++) {
        nebel_cloud_transfer *nodes = &clouds->nodes[i];
        const uint32_t count = nodes->count;
        clouds->next[i] = -1;
        if (!clouds->is_new[i]) continue;
        clouds->next[i] =
            nb_cloud_compose_next(nodes, &clouds->marks[i], &clouds->air[i], frame->air.tolerance, &clouds->doubt[i]);
        *any |= clouds->next[i] >= 0;
        is_longer[i] = nodes->count > count;
    }
    return nb_cloud_air_find(frame, is_longer, clouds);
}

/* Along the middles of pixels, as air and clouds are: what is found of a ray up to one of its marks is known up to the others. */
static nebel_result find_fog(const nb_frame *frame, nb_aerial_fn haze, nb_scratch *scratch)
{
    nebel_result result = NEBEL_OK;
    int any = 1;
    scratch->clouds.rays_of_samples = scratch->rays;
    scratch->rays = scratch->clouds.rays;
    memset(scratch->clouds.marks, 0, sizeof scratch->clouds.marks);
    while (result == NEBEL_OK && any) {
        result = choose_samples(frame, &scratch->clouds, &any);
        if (result == NEBEL_OK && any) result = mark(frame, haze, scratch);
        if (result == NEBEL_OK && any) nb_aerial_keep(scratch);
    }
    nb_aerial_forget(scratch);
    scratch->rays = scratch->clouds.rays_of_samples;
    return result;
}

/* Of one ray. */
static void mix_lane(int has_fog, nb_cloud_scratch *clouds, int lane)
{
    const nebel_cloud_transfer *nodes = &clouds->nodes[lane];
    const nb_aerial_nodes *air = &clouds->air[lane];
    nb_aerial_nodes haze = *air;
    for (int c = 0; c < 3; c++) {
        float over[NEBEL_MAX_CLOUD_NODES];
        if (has_fog) nb_cloud_compose_add_fog(nodes, &clouds->marks[lane], c, air, &haze);
        nb_cloud_compose_sum(nodes, c, &haze, over);
        for (uint32_t k = 0; k < nodes->count; k++) clouds->over[k][c][lane] = over[k];
    }
    clouds->doubt[lane] += nb_cloud_compose_missed(nodes, &haze);
}

static nebel_result mix_haze(const nb_frame *frame, nb_aerial_fn haze, nb_scratch *scratch)
{
    nb_cloud_scratch *clouds = &scratch->clouds;
    for (int i = 0; i < NB_BATCH; i++)
        if (clouds->is_new[i]) clouds->doubt[i] = 0;
    nebel_result result = nb_cloud_air_find(frame, clouds->is_new, clouds);
    if (result == NEBEL_OK && frame->air.has_fog) {
        memcpy(clouds->distance, scratch->distance, sizeof clouds->distance);
        clouds->samples = scratch->samples;
        result = find_fog(frame, haze, scratch);
        scratch->samples = clouds->samples;
        memcpy(scratch->distance, clouds->distance, sizeof clouds->distance);
    }
    for (int i = 0; i < NB_BATCH && result == NEBEL_OK; i++)
        if (clouds->is_new[i]) mix_lane(frame->air.has_fog, clouds, i);
    return result;
}

/* Before a surface within the clouds they are as between the nodes around it. */
static void lay_over(nb_scratch *scratch, int lane)
{
    const nb_cloud_scratch *clouds = &scratch->clouds;
    const nebel_cloud_transfer *nodes = &clouds->nodes[lane];
    nb_light_samples *samples = &scratch->samples;
    const float end = clouds->end[lane];
    float part;
    if (!(end > nodes->t[0])) return;
    const uint32_t k = nb_cloud_compose_find(nodes->count, nodes->t, end, &part);
    const uint32_t next = part > 0 ? k + 1 : k;
    const float left = (1 - part) * nodes->transmittance[k] + part * nodes->transmittance[next];
    for (int c = 0; c < 3; c++) {
        const float over = (1 - part) * clouds->over[k][c][lane] + part * clouds->over[next][c][lane];
        samples->in_scattering[c][lane] = fmaxf(0, left * samples->in_scattering[c][lane] + over);
        samples->transmittance[c][lane] *= left;
    }
    samples->error[lane] += nodes->error + clouds->doubt[lane];
}

nebel_result nb_cpu_clouds_add(const nb_frame *frame, nb_aerial_fn haze, nb_scratch *scratch)
{
    int any;
    nebel_result result = trace_clouds(frame, scratch, &any);
    if (result == NEBEL_OK && any) result = mix_haze(frame, haze, scratch);
    for (int i = 0; i < NB_BATCH && result == NEBEL_OK; i++)
        if (scratch->clouds.nodes[i].count > 0) lay_over(scratch, i);
    return result;
}

/* ---- shadows --------------------------------------------------------------------------------- */

/* The place of a surface; returns the width of its shadows. */
static double find_place(const nb_frame *frame, const nb_scratch *scratch, int lane, double place[1][3])
{
    double square = 0;
    for (int c = 0; c < 3; c++) {
        const double from_eye = (double)scratch->air.start[c][lane];
        place[0][c] = frame->view.position[c] + from_eye;
        square += from_eye * from_eye;
    }
    return 4 * frame->air.pixel * sqrt(square);
}

nebel_result nb_cpu_clouds_shade(const nb_frame *frame, nb_scratch *scratch, float (*color)[NB_BATCH])
{
    for (int i = 0; i < NB_BATCH; i++) {
        double place[1][3];
        float part;
        if (!scratch->points.lit[i]) continue;
        const double width = find_place(frame, scratch, i, place);
        const nebel_result result = nebel_compute_cloud_sun_transmittance(scratch->clouds.workspace, width, 1,
                                                                          (const double(*)[3])place, 0, &part);
        if (result != NEBEL_OK) return result;
        for (int c = 0; c < 3; c++) color[c][i] *= part;
    }
    return NEBEL_OK;
}

nebel_result nb_cpu_clouds_shade_sky(const nb_frame *frame, nb_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const uint32_t surface = scratch->hits.surface[i];
        double place[1][3];
        float part;
        if (surface == NB_NONE || (surface != NB_GROUND && !frame->air.owns_ambient)) continue;
        const double width = find_place(frame, scratch, i, place);
        const nebel_result result = nebel_compute_cloud_sky_transmittance(scratch->clouds.workspace, width, 1,
                                                                          (const double(*)[3])place, 0, &part);
        if (result != NEBEL_OK) return result;
        for (int c = 0; c < 3; c++) {
            scratch->air.ground.sky[c][i] *= part;
            scratch->air.sky_there[c][i] *= part;
        }
    }
    return NEBEL_OK;
}
