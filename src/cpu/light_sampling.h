/* Point lights by chance, as the reference renderer finds them: one of many, and places along a ray that it lights. */
#ifndef NB_CPU_LIGHT_SAMPLING_H
#define NB_CPU_LIGHT_SAMPLING_H

#include <nebel/scene.h>

/* A point light as a place sees it. */
typedef struct nb_sampled_light {
    double direction[3]; /* towards the point light, of length 1; 0 in its very place */
    double reach;        /* m, to its surface */
    double shadowed;     /* m, to where nothing casts a shadow any more */
    double beam;         /* 1/m^2: irradiance of what faces a point light of 1 W/sr, within its cone */
    double fluence;      /* 1/m^2: the same from all sides, for fog */
} nb_sampled_light;

/* Before anything that is in the way. Of a point light without a radius, and nearer than 1 mm, as everywhere. */
nb_sampled_light nb_light_sight_from(const nebel_light *light, const double place[3]);

/* What a point light weighs among others where one of them is chosen: at the ray's origin, by the light that it brings
 * there;
 * along the ray up to t_max, by what its light would add up to, were there no cone and the fog thin and even. */
typedef double nb_light_weigh(const nebel_light *light, const nebel_ray *ray);
double nb_light_weight_at(const nebel_light *light, const nebel_ray *ray);
double nb_light_weight_along(const nebel_light *light, const nebel_ray *ray);

/* Of all point lights together. */
double nb_lights_sum(const nebel_scene_data *scene, nb_light_weigh *weigh, const nebel_ray *ray);

/* The point light that 0 <= chance < 1 falls to, each as often as its part of `sum`, which is more than 0. */
const nebel_light *nb_lights_choose(const nebel_scene_data *scene, nb_light_weigh *weigh, const nebel_ray *ray,
                                    double sum, double chance);

/* A ray from its origin to t_max, which is finite, as a point light sees it pass. */
typedef struct nb_light_pass {
    double start; /* m along the ray: of its origin, from the place closest to the point light */
    double aside; /* m: how far that is from the point light, no less than the point light's radius */
    double angle; /* that the point light sees it go */
    double t_max;
} nb_light_pass;

nb_light_pass nb_passing_of(const nebel_light *light, const nebel_ray *ray);

/* Equiangular sampling: Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media",
 * 2012, section 4. A place from 0 <= chance < 1, m along the ray, and the density of such places, 1/m. */
double nb_passing_draw(const nb_light_pass *passing, double chance);
double nb_passing_density(const nb_light_pass *passing, double t);

/* Of places by such chances, for point lights that are chosen by what they weigh along the ray; `sum` is that of all.
 * 1/m */
double nb_lights_density(const nebel_scene_data *scene, const nebel_ray *ray, double sum, double t);

#endif
