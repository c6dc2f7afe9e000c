/* Light in clouds.
 *
 * Scattered once: the sun's light through the air and the optical depth of the way to the sun.
 *
 * Scattered often: what goes on nearly straight, a part g^2 of all, counts as not scattered (Joseph, Wiscombe and
 * Weinman, The Delta-Eddington Approximation for Radiative Flux Transfer, 1976). The place is taken for one in a slab of
 * cloud that absorbs nothing, whose flux F and mean radiance J along its depth x follow
 *
 *     dF/dx = E e^(-x/m)      dJ/dx = -3/(4 pi) ((1 - g') F - g' m E e^(-x/m))
 *
 * with g' = g / (1 + g) and m the cosine at which sunlight enters; nothing else enters on either side. The slab lies
 * across the sunlight where the way up is no shorter, and level where it is. */
#include "cloud_view.h"

#include "base/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI_F 3.14159265f

static float falling(float depth)
{
    return (float)nb_exp(-(double)depth);
}

/* ---- clear air ------------------------------------------------------------------------------- */

static nb_cloud_light clear_light(const nebel_cloud_view *view, double radius, double sun)
{
    const nebel_atmosphere *atmosphere = view->clouds->atmosphere;
    const nb_field field = nb_scatter_look_up(&atmosphere->scatter, &atmosphere->airs, radius, sun);
    nb_cloud_light light = {.sun = {0}};
    double direct[3];
    nb_track_sunlight(&atmosphere->airs, (nb_track){radius, radius * sun}, direct);
    for (int c = 0; c < 3; c++) {
        const double mean = field.moments[0][c] / (4 * 3.14159265358979323846);
        const double side = field.moments[1][c] / (2 * 3.14159265358979323846), e = view->sun.irradiance[c];
        light.sun[c] = (float)(e * direct[c]);
        light.above[c] = (float)(e * fmax(0, mean + side));
        light.below[c] = (float)(e * fmax(0, mean - side));
    }
    return light;
}

nebel_result nb_cloud_light_make(nebel_cloud_view *view)
{
    view->lights = nb_allocate(&view->allocator, NB_CLOUD_HEIGHTS, sizeof *view->lights);
    if (view->lights == NULL) return NEBEL_ERROR_MEMORY;
    for (int i = 0; i < NB_CLOUD_HEIGHTS; i++)
        for (int k = 0; k < NB_CLOUD_SUNS; k++)
            view->lights[i][k] = clear_light(view, view->low + (view->high - view->low) * i / (NB_CLOUD_HEIGHTS - 1.0),
                                             view->lowest_sun + (1 - view->lowest_sun) * k / (NB_CLOUD_SUNS - 1.0));
    return NEBEL_OK;
}

typedef struct nb_between {
    int low;
    float part;
} nb_between;

static nb_between between(double place, int count)
{
    const double bounded = nb_max(0, nb_min(count - 1, place));
    const int low = bounded < count - 2 ? (int)bounded : count - 2;
    return (nb_between){low, (float)(bounded - low)};
}

nb_cloud_light nb_cloud_clear_light(const nebel_cloud_view *view, const double place[3], double radius)
{
    const double sun = nb_vector_dot(place, view->sun.direction) / radius;
    const nb_between h =
        between((radius - view->low) / (view->high - view->low) * (NB_CLOUD_HEIGHTS - 1), NB_CLOUD_HEIGHTS);
    const nb_between s =
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

float nb_cloud_part_through(float depth, float mean_cosine)
{
    const float g = mean_cosine, apart = (1 - g * g) * depth;
    return (5 - falling(apart)) / (4 + 3 * (1 - g / (1 + g)) * apart);
}

/* Integral of 3 x^2 - 2 x^3 up to x = 1, and of 1 behind it: nb_cloud_base_thins. */
static float integral_of_rise(float x)
{
    return x < 1 ? x * x * x * (1 - 0.5f * x) : x - 0.5f;
}

nb_cloud_depths nb_cloud_bound_depths(const nebel_cloud_view *view, int k, double radius, const nb_cloud_depths *depths)
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

nb_cloud_ray nb_cloud_ray_make(const nebel_cloud_view *view, const double direction[3])
{
    nb_cloud_ray ray = {.sun = nb_max(-1, nb_min(1, nb_vector_dot(direction, view->sun.direction)))};
    memcpy(ray.direction, direction, sizeof ray.direction);
    for (int k = 0; k < view->clouds->layer_count; k++) {
        const nb_cloud_layer *layer = &view->clouds->layers[k];
        const double g = layer->mean_cosine, wide = g / (1 + g);
        const nebel_phase phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = wide};
        const nb_phase lobe = nb_phase_resolve(&phase);
        ray.phase[k] = (float)nb_phase_at(&layer->phase, ray.sun);
        ray.wide_phase[k] = (float)nb_phase_at(&lobe, ray.sun);
        ray.apart[k] = layer->apart;
    }
    return ray;
}

nb_cloud_parts nb_cloud_parts_of(float mean_cosine, const nb_cloud_depths *depths)
{
    const float g = mean_cosine, wide = g / (1 + g), apart = 1 - g * g;
    const float m = nb_smaller(1, (depths->up + 0.3f) / (depths->sun + 0.3f));
    const float x = apart * m * depths->sun, all = x + apart * nb_smaller(m * depths->away, depths->down);
    const float here = falling(x / m), there = falling(all / m);
    const float flux = m * (0.25f * (2 + 3 * m) + 0.25f * (2 - 3 * m) * there) / (1 + 0.75f * (1 - wide) * all);
    const float side = 0.75f / PI_F * wide * (flux - m * here);
    const float over = (1 - g) * depths->up, whole = over + (1 - g) * depths->down;
    const float from_above = (0.5f + 0.75f * (whole - over)) / (1 + 0.75f * whole);
    /* Half of the ground that is seen lies in this cloud's shadow. */
    const float ground = 0.5f + 0.5f * nb_cloud_part_through(depths->up + depths->down, g);
    return (nb_cloud_parts){
        .left = falling(depths->sun),
        .left_wide = falling(apart * depths->sun),
        .mean = (0.5f * m + 0.75f * m * m - 0.5f * flux - 0.75f * ((1 - wide) * flux * x + m * m * here)) / PI_F,
        .to_sun = m * side,
        .to_up = (1 - m) * side,
        .above = from_above,
        .below = (1 - from_above) * ground,
    };
}

nb_cloud_source nb_cloud_source_of(const nb_cloud_ray *ray, int layer, const nb_cloud_parts *parts,
                                   const nb_cloud_light *light, const double up[3])
{
    const float apart = ray->apart[layer], rise = (float)nb_vector_dot(ray->direction, up);
    const float often = nb_larger(0, parts->mean + parts->to_sun * (float)ray->sun + parts->to_up * rise);
    nb_cloud_source source;
    for (int c = 0; c < 3; c++) {
        source.once[c] = light->sun[c] * parts->left * (ray->phase[layer] - apart * ray->wide_phase[layer]);
        source.often[c] = light->sun[c] * apart * (often + parts->left_wide * ray->wide_phase[layer]);
        source.ambient[c] = parts->above * light->above[c] + parts->below * light->below[c];
    }
    return source;
}
