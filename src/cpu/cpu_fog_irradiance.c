#include "cpu_fog_irradiance.h"

#include "cpu_fog_shadow.h"

#include <math.h>
#include <string.h>

/* As parts of the sun's light and of the sky's: a step of a picture of 255 is 0.9 % of light where it is bright. */
#define LEAST_CHANGE (1 / 128.)

/* ---- the frame ------------------------------------------------------------------------------- */

/* Whether two places have another light. */
static int differ(const nb_air_frame *air, const nebel_irradiance *a, const nebel_irradiance *b)
{
    double brightest = 0, sun = 0;
    int sky = 0;
    for (int c = 0; c < 3; c++) {
        brightest = fmax(brightest, fmax(a->sun[c], b->sun[c]));
        sun = fmax(sun, fabs(a->sun[c] - b->sun[c]));
        sky |= fabs(a->sky[c] - b->sky[c]) > LEAST_CHANGE * fmax(a->sky[c], b->sky[c]);
    }
    return sun > LEAST_CHANGE * brightest || (air->owns_ambient && sky);
}

static void find_middle(const double min[3], const double max[3], double middle[3])
{
    for (int c = 0; c < 3; c++) middle[c] = 0.5 * (min[c] + max[c]);
}

/* Whether light is the same all over a box. From corner to corner of one that is thinner than the air it changes steadily. */
static int is_even(const nb_air_frame *air, const double min[3], const double max[3])
{
    double middle[3];
    for (int c = 0; c < 3; c++)
        if (!(max[c] - min[c] < air->worlds[0].top - air->worlds[0].radius)) return 0;
    find_middle(min, max, middle);
    const nebel_irradiance light = nb_cpu_planets_ask(air, middle);
    for (int corner = 0; corner < 8; corner++) {
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = (corner >> c & 1) != 0 ? max[c] : min[c];
        const nebel_irradiance there = nb_cpu_planets_ask(air, place);
        if (differ(air, &light, &there)) return 0;
    }
    return 1;
}

/* Where it is even, clouds shade all fog as they do the origin. */
static nebel_result find_cloud_shade(const nb_frame *frame, float *part)
{
    static const double origin[1][3] = {{0, 0, 0}};
    *part = 1;
    if (frame->cloud_view == NULL || frame->air.roof.is_shaded) return NEBEL_OK;
    return nebel_compute_cloud_sun_transmittance(frame->renderer->scratch[0].clouds.workspace, NB_FOG_SHADE_ORIGIN, 1,
                                                 origin, 0, part);
}

static void light_at(const nb_air_frame *air, const double place[3], double sun[3], double sky[3])
{
    nb_cpu_planets_light_at(air, NB_IRRADIANCE_OF_FOG, place, sun, sky);
    for (int c = 0; c < 3; c++) {
        sun[c] *= (double)air->cloud_shade;
        if (!air->owns_ambient) sky[c] = 1;
    }
}

/* Without tables, to `sun`, where it is the same everywhere. */
static void set_even_light(nb_air_frame *air, const nebel_planet *home, const double place[3], nebel_sun *sun)
{
    static const double origin[3] = {0, 0, 0};
    const nebel_irradiance there = nb_cpu_planets_ask(air, place);
    const nebel_sun bright = {.direction = {air->to_sun[0], air->to_sun[1], air->to_sun[2]}, .irradiance = {1, 1, 1}};
    double around_there[3], around_here[3];
    nb_irradiance_around(air->worlds[nb_planets_nearest(air->worlds, air->count, place)].planet, &bright, place,
                         around_there);
    nb_irradiance_around(home, &bright, origin, around_here);
    for (int c = 0; c < 3; c++) {
        sun->irradiance[c] *= there.sun[c] * (double)air->cloud_shade;
        air->sun_at_eye[c] = 1;
        air->sky_at_eye[c] = air->owns_ambient ? exp((double)nb_irradiance_part(around_there[c], around_here[c])) : 1;
    }
}

/* The renderer's lights, with another sun. */
static nebel_result light_by_sun(const nebel_renderer *renderer, const nebel_sun *sun, nebel_lighting **made)
{
    const nebel_light *lights;
    const size_t light_count = nebel_get_lighting_lights(renderer->lighting, &lights);
    const nebel_lighting_desc desc = {.sun = *sun,
                                      .environment = nebel_get_lighting_environment(renderer->lighting),
                                      .light_count = light_count,
                                      .lights = lights,
                                      .diffusion = nebel_get_lighting_diffusion(renderer->lighting),
                                      .previous = renderer->lighting};
    return nebel_create_lighting(renderer->fog, &desc, made);
}

nebel_result nb_fog_irradiance_set(nb_frame *frame)
{
    nb_air_frame *air = &frame->air;
    const nebel_renderer *renderer = frame->renderer;
    const nebel_scene_data *scene = renderer->scene;
    double middle[3] = {0, 0, 0};
    nebel_bounds bounds;
    if (!air->has_fog || !scene->has_sun) return NEBEL_OK;
    const int is_far = nebel_get_scattering_bounds(renderer->fog, NEBEL_BOUNDS_WITHOUT_LEVEL_FOG, &bounds) &&
                       !nb_irradiance_is_near(&scene->planets[0], scene->sun_direction, bounds.min, bounds.max);
    nebel_result result = nb_fog_shadow_set(frame);
    if (result != NEBEL_OK || !(is_far || air->roof.is_shaded)) return result;
    nebel_sun sun = nb_surface_lighting_sun(scene);
    if (is_far) find_middle(bounds.min, bounds.max, middle);
    air->is_fog_even = !is_far || is_even(air, bounds.min, bounds.max);
    result = find_cloud_shade(frame, &air->cloud_shade);
    if (air->is_fog_even)
        set_even_light(air, &scene->planets[0], middle, &sun);
    else if (result == NEBEL_OK)
        result = nb_cpu_planets_set_irradiances(air, &scene->planets[0], &renderer->log);
    if (result == NEBEL_OK && !air->is_fog_even) light_at(air, air->position, air->sun_at_eye, air->sky_at_eye);
    return result == NEBEL_OK ? light_by_sun(renderer, &sun, &air->daylit) : result;
}

/* ---- along rays ------------------------------------------------------------------------------ */

nebel_result nb_fog_irradiance_trace(const nb_frame *frame, const nebel_ray_planes *rays, const nebel_trace_desc *trace,
                                     const nebel_transfer_planes *transfers, nb_aerial_batch_nodes *node)
{
    if (!nb_fog_irradiance_is(&frame->air))
        return nebel_trace_planes(frame->renderer->fog, trace, NB_BATCH, rays, transfers);
    nebel_trace_desc by_groups = *trace;
    nebel_transfer_planes planes = *transfers;
    by_groups.lighting = frame->air.daylit;
    by_groups.ignore_max_opacity = 1;
    for (int c = 0; c < 3; c++) {
        planes.in_scattering[c] = NULL;
        planes.group[NEBEL_LIGHT_GROUP_SUN].in_scattering[c] = node->fog_sun[c];
        planes.group[NEBEL_LIGHT_GROUP_ENVIRONMENT].in_scattering[c] = node->fog_sky[c];
        planes.group[NEBEL_LIGHT_GROUP_LOCAL].in_scattering[c] = transfers->in_scattering[c];
    }
    return nebel_trace_planes(frame->renderer->fog, &by_groups, NB_BATCH, rays, &planes);
}

void nb_fog_irradiance_light(const nb_frame *frame, const nb_ray_batch *rays, nb_aerial_batch_nodes *node)
{
    const nb_air_frame *air = &frame->air;
    for (int i = 0; i < NB_BATCH; i++) {
        double place[3], sun[3], sky[3];
        if (!(node->at[i] > 0)) continue;
        for (int c = 0; c < 3; c++)
            place[c] = air->position[c] + (double)node->at[i] * rays->direction[c][i] / (double)rays->length[i];
        if (!air->is_fog_even) light_at(air, place, sun, sky);
        for (int c = 0; c < 3; c++) {
            node->sun[c][i] = (float)(air->is_fog_even ? air->sun_at_eye : sun)[c];
            node->sky[c][i] = (float)(air->is_fog_even ? air->sky_at_eye : sky)[c];
        }
    }
}

/* Where a ray is nearest to the middle of a ball, and half of what the ball cuts out of it; 0: it does not meet it. */
static double pass_ball(const nb_planet *world, const double position[3], const double unit[3], double *half)
{
    double to[3], square = world->top * world->top;
    for (int c = 0; c < 3; c++) to[c] = world->center[c] - position[c];
    const double along = nb_vector_dot(to, unit);
    for (int c = 0; c < 3; c++) square -= pow(to[c] - along * unit[c], 2);
    *half = sqrt(fmax(0, square));
    return square > 0 ? along : 0;
}

static double pass_first(const nb_air_frame *air, const nb_ray_batch *rays, int lane, double *half)
{
    double unit[3], nearest = 0;
    for (int c = 0; c < 3; c++) unit[c] = rays->direction[c][lane] / (double)rays->length[lane];
    for (int k = 0; k < air->count && !(nearest > 0); k++)
        nearest = pass_ball(&air->worlds[k], air->position, unit, half);
    return nearest;
}

float nb_fog_irradiance_lowest(const nb_air_frame *air, const nb_ray_batch *rays, int lane)
{
    double half = 0;
    return (float)fmax(0, pass_first(air, rays, lane, &half));
}

float nb_fog_irradiance_enters(const nb_air_frame *air, const nb_ray_batch *rays, int lane)
{
    double half = 0;
    const double nearest = pass_first(air, rays, lane, &half);
    return (float)fmax(0, nearest - half);
}
