#include "aerial_compose.h"

#include "cpu_fog_irradiance.h"
#include "cpu_fog_shadow.h"

#include <math.h>
#include <string.h>

/* The node 0 of a lane is where its ray ends. The start is none: nothing is before it. */
typedef struct nb_aerial_node {
    float at, fog_left[3], fog_light[3], air_left[3], air_light[3];
    float fog_sun[3], fog_sky[3], sun[3], sky[3]; /* of daylit fog, else 0 */
    nb_segment_shadow shade;                      /* of clouds, from the node before */
    float fog_sum[3], limit[3]; /* of daylit fog with max_opacity: its light, what the limit keeps of it */
} nb_aerial_node;

static nb_aerial_node start_of(const nb_air_frame *air)
{
    nb_aerial_node node = {.fog_left = {1, 1, 1}, .air_left = {1, 1, 1}, .limit = {1, 1, 1}};
    for (int c = 0; c < 3 && nb_fog_irradiance_is(air); c++) {
        node.sun[c] = (float)air->sun_at_eye[c];
        node.sky[c] = (float)air->sky_at_eye[c];
    }
    return node;
}

static nb_aerial_node node_of(const nb_air_frame *air, const nb_cpu_planets_scratch *scratch, int lane, int place)
{
    const nb_aerial_batch_nodes *nodes = &scratch->nodes[scratch->order[lane][place]];
    nb_aerial_node node = {.at = nodes->at[lane], .shade = {.sun = 1, .sky = 1}, .limit = {1, 1, 1}};
    if (air->roof.is_shaded) node.shade = nodes->shade[lane];
    for (int c = 0; c < 3; c++) {
        node.fog_left[c] = nodes->fog_left[c][lane];
        node.fog_light[c] = nodes->fog_light[c][lane];
        node.air_left[c] = nodes->air_left[c][lane];
        node.air_light[c] = nodes->air_light[c][lane];
    }
    for (int c = 0; c < 3 && nb_fog_irradiance_is(air); c++) {
        node.fog_sun[c] = nodes->fog_sun[c][lane];
        node.fog_sky[c] = nodes->fog_sky[c][lane];
        node.sun[c] = nodes->sun[c][lane];
        node.sky[c] = nodes->sky[c][lane];
    }
    return node;
}

/* Without clouds' shade, what fog between two nodes has from the sun and from the sky, in the mean of the light of both. */
static float sun_between(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return 0.5f * (a->sun[c] + b->sun[c]) * (b->fog_sun[c] - a->fog_sun[c]);
}

static float sky_between(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return 0.5f * (a->sky[c] + b->sky[c]) * (b->fog_sky[c] - a->fog_sky[c]);
}

/* The same without max_opacity, with what fog has of its own. */
static float unlimited_between(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return (b->fog_light[c] - a->fog_light[c]) + b->shade.sun * sun_between(a, b, c) +
           b->shade.sky * sky_between(a, b, c);
}

static float most_opacity(const nb_air_frame *air)
{
    return (float)nebel_get_max_opacity(nebel_get_lighting_snapshot(air->daylit));
}

/* max_opacity limits all light up to a place, not that of pieces (see nebel_set_max_opacity). */
static void limit_opacity(const nb_air_frame *air, const nb_aerial_node *before, nb_aerial_node *node)
{
    const float most = most_opacity(air);
    for (int c = 0; c < 3; c++) {
        node->fog_sum[c] = before->fog_sum[c] + unlimited_between(before, node, c);
        node->limit[c] = most > 0 ? most / fmaxf(most, 1 - node->fog_left[c]) : node->fog_left[c] < 1 ? 0 : 1;
        node->fog_left[c] = fmaxf(node->fog_left[c], 1 - most);
    }
}

static int is_limited(const nb_air_frame *air)
{
    return nb_fog_irradiance_is(air) && most_opacity(air) < 1;
}

/* The node of a place behind the one before. */
static nb_aerial_node node_after(const nb_air_frame *air, const nb_cpu_planets_scratch *scratch, int lane, int place,
                                 const nb_aerial_node *before)
{
    nb_aerial_node node = node_of(air, scratch, lane, place);
    if (is_limited(air)) limit_opacity(air, before, &node);
    return node;
}

/* The light of fog between two nodes. */
static float fog_between(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    if (!(b->limit[c] < 1)) return unlimited_between(a, b, c);
    return b->limit[c] * b->fog_sum[c] - a->limit[c] * a->fog_sum[c];
}

/* By how much that may be off: all fog may be at one place. */
static float shade_doubt(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return b->limit[c] *
           (fabsf(b->shade.sun_doubt * sun_between(a, b, c)) + fabsf(b->shade.sky_doubt * sky_between(a, b, c)));
}

/* The same within pieces of shade. */
static float within(const nb_aerial_node *a, const nb_aerial_node *b)
{
    float most = 0;
    for (int c = 0; c < 3; c++)
        most = fmaxf(most, 0.5f * (a->air_left[c] + b->air_left[c]) * b->limit[c] *
                               (fabsf(b->shade.sun_within * sun_between(a, b, c)) +
                                fabsf(b->shade.sky_within * sky_between(a, b, c))));
    return most;
}

static float fog_doubt(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return 0.5f * b->limit[c] *
               (fabsf((b->sun[c] - a->sun[c]) * (b->fog_sun[c] - a->fog_sun[c])) +
                fabsf((b->sky[c] - a->sky[c]) * (b->fog_sky[c] - a->fog_sky[c]))) +
           shade_doubt(a, b, c);
}

/* Light of 1 may be off by the tolerance, brighter light by as much more, and light darker than DARK by less, though no less than
 * LEAST_PART: eyes and screens tell dark shades apart that are nearer to each other. */
#define DARK 0.25f
#define LEAST_PART 0.03125f

/* The light of a lane by what is known. */
static void sum_light(const nb_air_frame *air, const nb_cpu_planets_scratch *scratch, int lane, float light[3])
{
    nb_aerial_node before = start_of(air);
    for (int c = 0; c < 3; c++) light[c] = 0;
    for (int i = 0; i < scratch->count[lane]; i++) {
        const nb_aerial_node here = node_after(air, scratch, lane, i, &before);
        for (int c = 0; c < 3; c++)
            light[c] += 0.5f * (before.fog_left[c] + here.fog_left[c]) * (here.air_light[c] - before.air_light[c]) +
                        0.5f * (before.air_left[c] + here.air_left[c]) * fog_between(&before, &here, c);
        before = here;
    }
}

/* What may be off of each colour of a lane, in tolerances. */
static void find_scales(const nb_air_frame *air, const nb_cpu_planets_scratch *scratch, int lane, float scales[3])
{
    float light[3];
    sum_light(air, scratch, lane, light);
    for (int c = 0; c < 3; c++) scales[c] = fmaxf(light[c], fmaxf(LEAST_PART, fminf(1, light[c] / DARK)));
}

/* What is in doubt of the light between two nodes. */
static float color_doubt(const nb_aerial_node *a, const nb_aerial_node *b, int c)
{
    return 0.5f * fabsf((a->fog_left[c] - b->fog_left[c]) * (b->air_light[c] - a->air_light[c])) +
           0.5f * fabsf((a->air_left[c] - b->air_left[c]) * fog_between(a, b, c)) +
           0.5f * (a->air_left[c] + b->air_left[c]) * fog_doubt(a, b, c);
}

static float doubt(const nb_aerial_node *a, const nb_aerial_node *b, const float scales[3])
{
    float most = 0;
    for (int c = 0; c < 3; c++) most = fmaxf(most, color_doubt(a, b, c) / scales[c]);
    return most;
}

/* The piece of a lane that is in doubt most, with the nodes at its ends, and all doubts, in those scales. */
static int find_worst(const nb_air_frame *air, const nb_cpu_planets_scratch *scratch, int lane, const float scales[3],
                      nb_aerial_node *a, nb_aerial_node *b, float *all)
{
    int worst = 0;
    float most = -1;
    nb_aerial_node before = start_of(air);
    *all = 0;
    for (int i = 0; i < scratch->count[lane]; i++) {
        const nb_aerial_node here = node_after(air, scratch, lane, i, &before);
        const float is = doubt(&before, &here, scales);
        *all += is;
        if (is > most) {
            most = is;
            worst = i;
            *a = before;
            *b = here;
        }
        before = here;
    }
    return worst;
}

/* Whether most of the doubt is about where in the shade of clouds fog is. */
static int is_by_shade(const nb_aerial_node *a, const nb_aerial_node *b, const float scales[3])
{
    float most = 0;
    for (int c = 0; c < 3; c++)
        most = fmaxf(most, 0.5f * (a->air_left[c] + b->air_left[c]) * shade_doubt(a, b, c) / scales[c]);
    return most > 0.5f * doubt(a, b, scales);
}

/* Fog is mostly near and air far: what begins at the eye is cut where air begins to count, other long pieces nearer to
 * their start. */
static float cut_piece(const nb_frame *frame, const nb_scratch *scratch, int lane, const nb_aerial_node *a,
                       const nb_aerial_node *b, const float scales[3])
{
    const nb_ray_batch *const rays = &scratch->rays;
    if (is_by_shade(a, b, scales)) return nb_fog_shadow_cut(&scratch->air.fog_shade[lane], a->at, b->at);
    if (a->at == 0 && nb_fog_irradiance_is(&frame->air) && !frame->air.is_fog_even) {
        const float enters = nb_fog_irradiance_enters(&frame->air, rays, lane);
        if (enters > 0 && enters < b->at) return enters;
    }
    if (a->at > 0) return b->at > 8 * a->at ? 4 * a->at : 0.5f * (a->at + b->at);
    float counts = 0;
    for (int c = 0; c < 3; c++) counts = fmaxf(counts, fmaxf(b->air_light[c], 1 - b->air_left[c]) / scales[c]);
    return b->at * fminf(0.5f, fmaxf(1e-6f, frame->air.tolerance / counts));
}

/* Of the piece up to a node. */
static void shade_piece(nb_cpu_planets_scratch *scratch, int lane, int place)
{
    static const nb_segment_shadow none = {.sun = 1, .sky = 1};
    const uint8_t *const order = scratch->order[lane];
    const nb_fog_shadow *const shade = &scratch->fog_shade[lane];
    nb_aerial_batch_nodes *const nodes = &scratch->nodes[order[place]];
    const float before = place > 0 ? scratch->nodes[order[place - 1]].at[lane] : 0;
    nodes->shade[lane] = shade->is_found ? nb_fog_shadow_between(shade, before, nodes->at[lane]) : none;
}

static void insert(nb_cpu_planets_scratch *scratch, int lane, int place, int node)
{
    uint8_t *order = scratch->order[lane];
    memmove(order + place + 1, order + place, (size_t)(scratch->count[lane] - place));
    order[place] = (uint8_t)node;
    scratch->count[lane]++;
}

/* A fresh one, before the one at a place. */
static void cut_at(const nb_air_frame *air, nb_cpu_planets_scratch *scratch, int lane, int place, float at)
{
    scratch->fresh.at[lane] = scratch->nodes[scratch->known[lane]].at[lane] = at;
    insert(scratch, lane, place, scratch->known[lane]++);
    for (int i = place; i < place + 2 && air->roof.is_shaded; i++) shade_piece(scratch, lane, i);
}

static void copy_lane(const nb_aerial_batch_nodes *from, int lane, nb_aerial_batch_nodes *to)
{
    to->at[lane] = from->at[lane];
    for (int c = 0; c < 3; c++) {
        to->fog_left[c][lane] = from->fog_left[c][lane];
        to->fog_light[c][lane] = from->fog_light[c][lane];
        to->air_left[c][lane] = from->air_left[c][lane];
        to->air_light[c][lane] = from->air_light[c][lane];
        to->fog_sun[c][lane] = from->fog_sun[c][lane];
        to->fog_sky[c][lane] = from->fog_sky[c][lane];
        to->sun[c][lane] = from->sun[c][lane];
        to->sky[c][lane] = from->sky[c][lane];
    }
}

/* Fresh nodes have been found. */
static void keep_fresh(nb_cpu_planets_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++)
        if (scratch->fresh.at[i] > 0) copy_lane(&scratch->fresh, i, &scratch->nodes[scratch->known[i] - 1]);
}

/* Before which node a place is. */
static int node_place(const nb_cpu_planets_scratch *scratch, int lane, float at)
{
    int place = 0;
    while (scratch->nodes[scratch->order[lane][place]].at[lane] < at) place++;
    return place;
}

/* All that is known of a ray before its end, which comes last. */
static void put_in_order(const nb_air_frame *air, nb_cpu_planets_scratch *scratch, int lane)
{
    const float end = scratch->nodes[0].at[lane];
    scratch->order[lane][0] = 0;
    scratch->count[lane] = 1;
    for (int k = 1; k < scratch->known[lane]; k++) {
        const float at = scratch->nodes[k].at[lane];
        if (at < end) insert(scratch, lane, node_place(scratch, lane, at), k);
    }
    for (int i = 0; i < scratch->count[lane] && air->roof.is_shaded; i++) shade_piece(scratch, lane, i);
}

/* By clouds. */
static void shade(const nb_cloud_scratch *clouds, nb_aerial_batch_nodes *node)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < NB_BATCH; i++)
            node->air_light[c][i] = nb_shadowed_air_light(clouds->shaded[i], clouds->shaded_count[i], c, node->at[i],
                                                          node->air_light[c][i]);
}

static nebel_result trace_node(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                               nb_scratch *scratch, nb_aerial_batch_nodes *node)
{
    const double *const direction[3] = {scratch->rays.direction[0], scratch->rays.direction[1],
                                        scratch->rays.direction[2]};
    nebel_ray_planes rays = *fog;
    nebel_transfer_planes transfers = {.error = NULL}, air = {.error = node->air_error};
    rays.t_max = node->at;
    for (int c = 0; c < 3; c++) {
        transfers.transmittance[c] = node->fog_left[c];
        transfers.in_scattering[c] = node->fog_light[c];
        air.transmittance[c] = node->air_left[c];
        air.in_scattering[c] = node->air_light[c];
    }
    nebel_result result = nb_fog_irradiance_trace(frame, &rays, trace, &transfers, node);
    if (nb_fog_irradiance_is(&frame->air)) nb_fog_irradiance_light(frame, &scratch->rays, node);
    if (result == NEBEL_OK) result = nb_cpu_planets_trace(&frame->air, NB_BATCH, direction, node->at, &air);
    if (result == NEBEL_OK && frame->cloud_view != NULL) shade(&scratch->clouds, node);
    return result;
}

/* The first node of daylit fog, which light at both ends of a ray does not tell of; 0: none, or it is there already. */
static float first_cut(const nb_frame *frame, const nb_scratch *scratch, int lane)
{
    const nb_aerial_batch_nodes *end = &scratch->air.nodes[0];
    const float place = nb_fog_irradiance_lowest(&frame->air, &scratch->rays, lane);
    float light = 0;
    for (int c = 0; c < 3; c++) light = fmaxf(light, end->fog_sun[c][lane] + end->fog_sky[c][lane]);
    for (int k = 1; k < scratch->air.known[lane]; k++)
        if (scratch->air.nodes[k].at[lane] == place) return 0;
    return place < end->at[lane] && light > frame->air.tolerance ? place : 0;
}

/* One more node for each lane that needs it; returns whether any did. */
static int choose_nodes(const nb_frame *frame, nb_scratch *scratch, int is_first)
{
    nb_cpu_planets_scratch *air = &scratch->air;
    int any = 0;
    is_first = is_first && nb_fog_irradiance_is(&frame->air) && !frame->air.is_fog_even;
    for (int i = 0; i < NB_BATCH; i++) {
        float all, first, scales[3];
        air->fresh.at[i] = 0;
        if (!scratch->inside[i] || air->known[i] == NB_AIR_NODES) continue;
        if (is_first && (first = first_cut(frame, scratch, i)) > 0) {
            cut_at(&frame->air, air, i, node_place(air, i, first), first);
            any = 1;
            continue;
        }
        find_scales(&frame->air, air, i, scales);
        nb_aerial_node a, b;
        const int worst = find_worst(&frame->air, air, i, scales, &a, &b, &all);
        if (all <= frame->air.tolerance) continue;
        const float place = cut_piece(frame, scratch, i, &a, &b, scales);
        if (!(place > a.at && place < b.at)) continue;
        cut_at(&frame->air, air, i, worst, place);
        any = 1;
    }
    return any;
}

/* Of rays without fog. */
static void take_air(nb_scratch *scratch)
{
    const nb_aerial_batch_nodes *all = &scratch->air.nodes[0];
    for (int c = 0; c < 3; c++) {
        memcpy(scratch->samples.transmittance[c], all->air_left[c], sizeof all->air_left[c]);
        memcpy(scratch->samples.in_scattering[c], all->air_light[c], sizeof all->air_light[c]);
    }
    memcpy(scratch->samples.error, all->air_error, sizeof all->air_error);
}

/* What the limit adds to the error: the light of fog up to the end is off by as much as what the limit keeps of it. */
static float limit_error(const nb_aerial_node *end, float most, float error)
{
    float worst = 0;
    for (int c = 0; c < 3; c++)
        if (end->limit[c] < 1 && most > 0)
            worst = fmaxf(worst, fabsf(end->fog_sum[c]) * end->limit[c] * end->limit[c] / most * error);
    return worst;
}

static void sum_up(const nb_air_frame *of, nb_scratch *scratch, int lane)
{
    static const float plain[3] = {1, 1, 1};
    const nb_cpu_planets_scratch *air = &scratch->air;
    nb_light_samples *samples = &scratch->samples;
    nb_aerial_node before = start_of(of), a, b;
    float light[3], all = 0;
    (void)find_worst(of, air, lane, plain, &a, &b, &all);
    for (int i = 0; i < air->count[lane]; i++) {
        const nb_aerial_node here = node_after(of, air, lane, i, &before);
        all += within(&before, &here);
        before = here;
    }
    sum_light(of, air, lane, light);
    if (is_limited(of)) all += limit_error(&before, most_opacity(of), samples->error[lane]);
    for (int c = 0; c < 3; c++) {
        if (is_limited(of)) samples->transmittance[c][lane] = before.fog_left[c];
        samples->transmittance[c][lane] *= air->nodes[0].air_left[c][lane];
        samples->in_scattering[c][lane] = fmaxf(light[c], 0);
    }
    samples->error[lane] += air->nodes[0].air_error[lane] + all;
}

/* Air has an end, rays need not: beyond it neither adds anything to the other. */
static void set_first(const nb_frame *frame, nb_scratch *scratch)
{
    nb_cpu_planets_scratch *air = &scratch->air;
    for (int i = 0; i < NB_BATCH; i++) {
        if (!air->is_kept) air->known[i] = 1;
        air->nodes[0].at[i] = scratch->inside[i] ? fminf(scratch->distance[i], (float)frame->air.reach) : 0;
    }
    for (int c = 0; c < 3; c++) {
        memcpy(air->nodes[0].fog_left[c], scratch->samples.transmittance[c], sizeof air->nodes[0].fog_left[c]);
        memcpy(air->nodes[0].fog_light[c], scratch->samples.in_scattering[c], sizeof air->nodes[0].fog_light[c]);
    }
}

void nb_aerial_keep(nb_scratch *scratch)
{
    nb_cpu_planets_scratch *air = &scratch->air;
    air->is_kept = 1;
    for (int i = 0; i < NB_BATCH; i++)
        if (air->nodes[0].at[i] > 0 && air->known[i] < NB_AIR_NODES)
            copy_lane(&air->nodes[0], i, &air->nodes[air->known[i]++]);
}

void nb_aerial_forget(nb_scratch *scratch)
{
    scratch->air.is_kept = 0;
}

nebel_result nb_aerial_add(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                           nb_scratch *scratch)
{
    nb_aerial_batch_nodes *first = &scratch->air.nodes[0];
    const double *const direction[3] = {scratch->rays.direction[0], scratch->rays.direction[1],
                                        scratch->rays.direction[2]};
    nebel_transfer_planes transfers = {.error = first->air_error};
    for (int c = 0; c < 3; c++) {
        transfers.transmittance[c] = first->air_left[c];
        transfers.in_scattering[c] = first->air_light[c];
    }
    set_first(frame, scratch);
    nebel_result result =
        nb_cpu_planets_trace(&frame->air, NB_BATCH, direction, frame->air.ends ? first->at : NULL, &transfers);
    if (result == NEBEL_OK && frame->cloud_view != NULL) shade(&scratch->clouds, first);
    if (fog == NULL) {
        take_air(scratch);
        return result;
    }
    if (nb_fog_irradiance_is(&frame->air)) nb_fog_irradiance_light(frame, &scratch->rays, first);
    if (result == NEBEL_OK && frame->air.roof.is_shaded) result = nb_fog_shadow_find(frame, scratch);
    for (int i = 0; i < NB_BATCH; i++) put_in_order(&frame->air, &scratch->air, i);
    for (int k = 1; result == NEBEL_OK && choose_nodes(frame, scratch, k == 1); k++) {
        result = trace_node(frame, fog, trace, scratch, &scratch->air.fresh);
        keep_fresh(&scratch->air);
    }
    for (int i = 0; i < NB_BATCH && result == NEBEL_OK; i++) sum_up(&frame->air, scratch, i);
    return result;
}
