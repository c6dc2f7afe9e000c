/* Light in clouds.
 *
 * Scattered once: the sun's light through the air and the optical depth of the way to the sun.
 *
 * Scattered often: what goes on nearly straight counts as not scattered (Wiscombe, The Delta-M Method, 1977). The place is
 * taken for one in an even slab of cloud that absorbs nothing, with a table of what that sends (cloud_slab.h). The slab lies
 * across the sunlight where the way up is no shorter, and level where it is. What is scattered once, and then goes on
 * nearly straight, has the phase function as it is beside its peak (Nakajima and Tanaka, Algorithms for Radiative
 * Intensity Calculations in Moderately Thick Atmospheres Using a Truncation Approximation, 1988). */
#include "cloud_lighting.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

static float falling(float depth)
{
    return (float)nb_exp(-(double)depth);
}

/* ---- clear air ------------------------------------------------------------------------------- */

static nb_cloud_light clear_light(const nebel_cloud_lighting *view, double radius, double sun)
{
    const nebel_atmosphere *atmosphere = view->clouds->atmosphere;
    const nb_radiance_moments field = nb_scattering_table_look_up(&atmosphere->scatter, &atmosphere->airs, radius, sun);
    nb_cloud_light light = {.sun = {0}};
    double direct[3];
    const double aside = sqrt(fmax(0, 1 - sun * sun));
    nb_atmosphere_ray_sunlight(&atmosphere->smooth, (nb_atmosphere_ray){radius, radius * sun}, direct);
    for (int c = 0; c < 3; c++) {
        const double mean = field.moments[0][c] / (4 * 3.14159265358979323846), e = view->sun.irradiance[c];
        const double down = sun * field.moments[1][c] + aside * field.moments[2][c];
        const double side = down / (2 * 3.14159265358979323846);
        light.sun[c] = (float)(e * direct[c]);
        light.above[c] = (float)(e * fmax(0, mean + side));
        light.below[c] = (float)(e * fmax(0, mean - side));
    }
    return light;
}

nebel_result nb_cloud_light_make(nebel_cloud_lighting *view)
{
    view->lights = nb_allocate(&view->allocator, NB_CLOUD_HEIGHTS, sizeof *view->lights);
    if (view->lights == NULL) return NEBEL_ERROR_MEMORY;
    for (int i = 0; i < NB_CLOUD_HEIGHTS; i++)
        for (int k = 0; k < NB_CLOUD_SUNS; k++)
            view->lights[i][k] = clear_light(view, view->low + (view->high - view->low) * i / (NB_CLOUD_HEIGHTS - 1.0),
                                             view->lowest_sun + (1 - view->lowest_sun) * k / (NB_CLOUD_SUNS - 1.0));
    return NEBEL_OK;
}

typedef struct nb_cloud_slab_fit {
    int low;
    float part;
} nb_cloud_slab_fit;

static nb_cloud_slab_fit between(double place, int count)
{
    const double bounded = nb_max(0, nb_min(count - 1, place));
    const int low = bounded < count - 2 ? (int)bounded : count - 2;
    return (nb_cloud_slab_fit){low, (float)(bounded - low)};
}

nb_cloud_light nb_cloud_clear_light(const nebel_cloud_lighting *view, const double place[3], double radius)
{
    const double sun = nb_vector_dot(place, view->sun.direction) / radius;
    const nb_cloud_slab_fit h =
        between((radius - view->low) / (view->high - view->low) * (NB_CLOUD_HEIGHTS - 1), NB_CLOUD_HEIGHTS);
    const nb_cloud_slab_fit s =
        between((sun - view->lowest_sun) / (1 - view->lowest_sun) * (NB_CLOUD_SUNS - 1), NB_CLOUD_SUNS);
    nb_cloud_light light = {.sun = {0}};
    for (int k = 0; k < 4; k++) {
        const float weight = (k & 1 ? h.part : 1 - h.part) * (k & 2 ? s.part : 1 - s.part);
        const nb_cloud_light *corner = &view->lights[h.low + (k & 1)][s.low + (k >> 1)];
        light.sun += weight * corner->sun;
        light.above += weight * corner->above;
        light.below += weight * corner->below;
    }
    return light;
}

/* ---- the slab -------------------------------------------------------------------------------- */

/* A sun that is lower enters slabs at this cosine. */
#define LOWEST_SUN 0.02f

float nb_cloud_part_through(const nb_cloud_layer *layer, float depth, double sun)
{
    const float cosine = nb_larger(LOWEST_SUN, (float)sun);
    const float through = nb_slab_through(layer->slab, depth * cosine, cosine);
    return through + layer->spill * (1 - through);
}

/* Integral of 3 x^2 - 2 x^3 up to x = 1, and of 1 behind it: nb_cloud_base_thins. */
static float integral_of_rise(float x)
{
    return x < 1 ? x * x * x * (1 - 0.5f * x) : x - 0.5f;
}

nb_cloud_depths nb_cloud_bound_depths(const nebel_cloud_lighting *view, int k, double radius,
                                      const nb_cloud_depths *depths)
{
    const nb_cloud_layer *layer = &view->clouds->layers[k];
    const float height = (float)(radius - layer->low) * layer->per_thickness;
    const float all = layer->extinction / layer->per_thickness, base = nb_cloud_base_thins(layer->kind);
    nb_cloud_depths bounded = *depths;
    if (layer->high >= view->high)
        bounded.up =
            nb_smaller(bounded.up, all * integral_of_rise(NB_CLOUD_TOP_THINS * (1 - height)) / NB_CLOUD_TOP_THINS);
    if (layer->low <= view->low) bounded.down = nb_smaller(bounded.down, all * integral_of_rise(base * height) / base);
    return bounded;
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* Angles between ray and sun: up to the first the way to the sun is the rest of the ray, from the second on it is one of its own, on which
 * other clouds lie. */
#define AHEAD_ANGLE 0.010
#define ASIDE_ANGLE 0.026

/* Light of many places knows nothing of which clouds are before the sun: up to the first of these angles a place's own
 * way to it counts, from the second on their mean. */
#define OWN_ANGLE 0.07
#define PREFILTER_ANGLE 0.17

/* The phase function has a peak half a degree wide: a pixel so many times its width from where that counts has a mean of it, over places
 * so far apart. */
#define NEAR_WIDTHS 3
#define PEAK_STEP 1e-3
enum { MOST_PEAK_STEPS = 24 };

/* 1 up to an angle, 0 from another on. */
static double part_within(double cosine, double from, double to)
{
    const double angle = sqrt(nb_max(0, 2 - 2 * cosine)), part = nb_min(1, nb_max(0, (to - angle) / (to - from)));
    return part * part * (3 - 2 * part);
}

static void add_direction(const nebel_cloud_lighting *view, double cosine, double weight, nb_cloud_ray *ray)
{
    const double ahead = part_within(cosine, AHEAD_ANGLE, ASIDE_ANGLE);
    ray->ahead += (float)(weight * ahead);
    for (int k = 0; k < view->clouds->layer_count; k++) {
        float values[4];
        nb_cloud_phase_at(&view->clouds->layers[k].phase, cosine, values);
        for (int c = 0; c < 3; c++) {
            const double phase = weight * (double)values[c];
            ray->phase[k][c] += (float)((1 - ahead) * phase);
            ray->ahead_phase[k][c] += (float)(ahead * phase);
        }
    }
}

/* Over a pixel where the phase function's peak is near, else of its middle. */
static void set_phases(const nebel_cloud_lighting *view, double spread, nb_cloud_ray *ray)
{
    const double width = nb_min(0.5, spread), near = nb_min(1.5, ASIDE_ANGLE + NEAR_WIDTHS * width);
    const int is_near = 2 - 2 * ray->sun < near * near;
    const int n = is_near ? (int)nb_min(MOST_PEAK_STEPS, 1 + width / PEAK_STEP) : 1;
    const double *direction = ray->direction, *sun = view->sun.direction;
    const double axis[3] = {fabs(direction[0]) < 0.7, !(fabs(direction[0]) < 0.7), 0};
    double across[2][3];
    nb_vector_cross(direction, axis, across[0]);
    nb_vector_make_unit(across[0]);
    nb_vector_cross(direction, across[0], across[1]);
    const double aside[2] = {width * nb_vector_dot(across[0], sun), width * nb_vector_dot(across[1], sun)};
    for (int i = 0; i < n * n; i++) {
        const double u = (i % n + 0.5) / n - 0.5, v = (i / n + 0.5) / n - 0.5;
        const double length = sqrt(1 + width * width * (u * u + v * v));
        const double cosine = (ray->sun + u * aside[0] + v * aside[1]) / length;
        add_direction(view, nb_max(-1, nb_min(1, cosine)), 1.0 / (n * n), ray);
    }
}

nb_cloud_ray nb_cloud_ray_make(const nebel_cloud_lighting *view, const double direction[3], double spread)
{
    nb_cloud_ray ray = {.sun = nb_max(-1, nb_min(1, nb_vector_dot(direction, view->sun.direction)))};
    memcpy(ray.direction, direction, sizeof ray.direction);
    for (int k = 0; k < view->clouds->layer_count; k++) {
        const nb_cloud_layer *layer = &view->clouds->layers[k];
        float values[4];
        nb_cloud_phase_at(&layer->phase, ray.sun, values);
        for (int c = 0; c < 3; c++) ray.wide_phase[k][c] = nb_smaller(layer->slab->cap[c], values[c]);
        ray.apart[k] = layer->apart;
    }
    set_phases(view, spread, &ray);
    ray.own = (float)part_within(ray.sun, OWN_ANGLE, PREFILTER_ANGLE);
    return ray;
}

/* Of light that falls by so many times e nothing is left. */
#define MOST_LOSS 12

/* What is so deep in a cloud no longer knows how its surface above is turned. */
#define TURNED_DEPTH 2.5f

/* The cosine of the sun to the slab's normal, which has the sun's way in the plane of that and straight up: it leads up where the way up
 * is as long as a level slab would have it, to the sun where it is no shorter than that to the sun, and the more to the sun the less
 * clouds are slabs: their light comes in by their sides, too. */
static float turn_of(const nb_cloud_layer *layer, const nb_cloud_depths *depths, float cosine)
{
    const float shallow = layer->shallow;
    const float shape = nb_smaller(1, (depths->up + shallow * cosine) / (depths->sun + shallow));
    const float turned = cosine + (shape - cosine) * TURNED_DEPTH / (TURNED_DEPTH + depths->up);
    if (!(layer->broken > 0)) return turned;
    return (float)nb_exp((1 - (double)layer->broken) * nb_log((double)turned));
}

/* Light that leaves a cloud aside is lost to a slab as if that absorbed it: diffused light falls as sinh does, and what a slab without loss
 * would have to be to send as much is deeper above and less deep below. */
static void lose_aside(double loss, nb_slab_place *place)
{
    const double falls = nb_exp(-nb_min(MOST_LOSS, loss * (double)place->above));
    const double lost = nb_exp(-2 * nb_min(MOST_LOSS, loss * (double)place->below));
    const double below = (1 - lost) / ((1 + lost) * loss);
    place->above = (float)(0.5 * (1 - falls) * ((1 + falls) / loss + (1 - falls) * below) / falls);
    place->below = (float)below;
}

static nb_slab_place slab_of(const nb_cloud_layer *layer, const nb_cloud_depths *depths, const nb_cloud_sight *sight)
{
    const float cosine = nb_larger(LOWEST_SUN, sight->sun);
    const float apart = layer->apart, m = turn_of(layer, depths, cosine);
    const float level = 1 - sight->sun * sight->sun, aside = sight->rise - sight->sun * sight->ahead;
    nb_slab_place place = {
        .above = apart * m * depths->sun,
        .below = apart * nb_smaller(m * depths->away, depths->down),
        .sun = m,
        .rise = m * sight->ahead + (level > 1e-6f ? sqrtf(nb_larger(0, 1 - m * m) / level) * aside : 0),
        .ahead = sight->ahead,
    };
    if (layer->loss > 0) lose_aside((double)(layer->loss / apart), &place);
    return place;
}

nb_cloud_irradiance nb_cloud_parts_of(const nb_cloud_layer *layer, const nb_cloud_depths *depths,
                                      const nb_cloud_sight *sight)
{
    const float g = (float)layer->phase.moments[1];
    const nb_slab_place place = slab_of(layer, depths, sight);
    const float over = (1 - g) * depths->up, whole = over + (1 - g) * depths->down;
    const float from_above = (0.5f + 0.75f * (whole - over)) / (1 + 0.75f * whole);
    /* Half of the ground that is seen lies in this cloud's shadow. */
    const float ground = 0.5f + 0.5f * nb_slab_through(layer->slab, depths->up + depths->down, 1);
    return (nb_cloud_irradiance){
        .left = falling(depths->sun),
        .left_wide = falling(layer->apart * depths->sun),
        .often = nb_slab_source(layer->slab, &place),
        .above = from_above,
        .below = (1 - from_above) * ground,
    };
}

nb_cloud_source nb_cloud_source_of(const nb_cloud_ray *ray, int layer, const nb_cloud_irradiance *parts,
                                   const nb_cloud_light *light)
{
    nb_cloud_source source;
    for (int c = 0; c < 3; c++) {
        const float wide = ray->wide_phase[layer][c];
        source.once[c] = light->sun[c] * parts->left * (ray->phase[layer][c] - (1 - ray->ahead) * wide);
        source.ahead[c] = light->sun[c] * (ray->ahead_phase[layer][c] - ray->ahead * wide);
        source.often[c] = light->sun[c] * (ray->apart[layer] * parts->often + parts->left_wide * wide);
        source.ambient[c] = parts->above * light->above[c] + parts->below * light->below[c];
    }
    return source;
}
