#include "light_sampling.h"

#include "math/vector.h"

#include <nebel/light.h>

#include <math.h>

#define PI 3.14159265358979323846

/* ---- places ---------------------------------------------------------------------------------- */

/* The part of its light that a spot sends off its axis. */
static double spot_falloff(const nebel_light *light, const double direction[3])
{
    if (light->type != NEBEL_LIGHT_SPOT) return 1;
    const double outer = cos(light->outer_angle * (PI / 180)), inner = cos(light->inner_angle * (PI / 180));
    double axis[3] = {light->direction[0], light->direction[1], light->direction[2]};
    (void)nb_vector_make_unit(axis);
    const double cosine = -nb_vector_dot(axis, direction);
    if (cosine >= inner) return 1;
    if (cosine <= outer) return 0;
    const double s = (cosine - outer) / (inner - outer);
    return s * s * (3 - 2 * s);
}

nb_sampled_light nb_light_sight_from(const nebel_light *light, const double place[3])
{
    nb_sampled_light sight;
    for (int i = 0; i < 3; i++) sight.direction[i] = light->position[i] - place[i];
    const double distance = nb_vector_length(sight.direction), radius = fmax(light->radius, NEBEL_MIN_LIGHT_RADIUS);
    for (int i = 0; i < 3 && distance > 0; i++) sight.direction[i] /= distance;
    const double nearest = fmax(distance, radius), part = radius / nearest;
    sight.reach = fmax(distance - light->radius, 0);
    sight.shadowed = fmax(distance - radius, 0);
    sight.beam = spot_falloff(light, sight.direction) / (nearest * nearest);
    sight.fluence = sight.beam * 2 / (1 + sqrt(1 - part * part));
    return sight;
}

/* ---- rays ------------------------------------------------------------------------------------ */

nb_light_pass nb_passing_of(const nebel_light *light, const nebel_ray *ray)
{
    double to_light[3], aside[3];
    for (int i = 0; i < 3; i++) to_light[i] = light->position[i] - ray->origin[i];
    nb_light_pass p = {.start = -nb_vector_dot(to_light, ray->direction), .t_max = ray->t_max};
    for (int i = 0; i < 3; i++) aside[i] = to_light[i] + p.start * ray->direction[i];
    p.aside = fmax(nb_vector_length(aside), fmax(light->radius, NEBEL_MIN_LIGHT_RADIUS));
    /* One angle between two places; as the difference of two it would be lost to rounding far from the point light. */
    p.angle = atan2(p.aside * p.t_max, p.aside * p.aside + p.start * (p.start + p.t_max));
    return p;
}

double nb_passing_draw(const nb_light_pass *p, double chance)
{
    const double angle = chance * p->angle, square = p->start * p->start + p->aside * p->aside;
    const double down = p->aside * cos(angle) - p->start * sin(angle);
    return down > 0 ? fmin(square * sin(angle) / down, p->t_max) : p->t_max;
}

double nb_passing_density(const nb_light_pass *p, double t)
{
    const double from = p->start + t;
    return p->aside / (p->angle * (p->aside * p->aside + from * from));
}

/* ---- one of many ----------------------------------------------------------------------------- */

double nb_light_weight_at(const nebel_light *light, const nebel_ray *ray)
{
    return nb_vector_largest(light->intensity) * nb_light_sight_from(light, ray->origin).fluence;
}

double nb_light_weight_along(const nebel_light *light, const nebel_ray *ray)
{
    const nb_light_pass passing = nb_passing_of(light, ray);
    return nb_vector_largest(light->intensity) * passing.angle / passing.aside;
}

double nb_lights_sum(const nebel_scene_data *scene, nb_light_weigh *weigh, const nebel_ray *ray)
{
    double sum = 0;
    for (size_t i = 0; i < scene->light_count; i++) sum += weigh(&scene->lights[i], ray);
    return sum;
}

const nebel_light *nb_lights_choose(const nebel_scene_data *scene, nb_light_weigh *weigh, const nebel_ray *ray,
                                    double sum, double chance)
{
    const nebel_light *chosen = NULL;
    double left = chance * sum;
    for (size_t i = 0; i < scene->light_count && (chosen == NULL || left >= 0); i++) {
        const double weight = weigh(&scene->lights[i], ray);
        if (weight > 0) chosen = &scene->lights[i]; /* the last one, where rounding leaves some */
        left -= weight;
    }
    return chosen;
}

double nb_lights_density(const nebel_scene_data *scene, const nebel_ray *ray, double sum, double t)
{
    double density = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const nb_light_pass passing = nb_passing_of(&scene->lights[i], ray);
        const double part = nb_light_weight_along(&scene->lights[i], ray) / sum;
        if (part > 0) density += part * nb_passing_density(&passing, t);
    }
    return density;
}
