/* What Embree sees of the sun and of point lights from a place. */
#ifndef TEST_SHADOWS_H
#define TEST_SHADOWS_H

#include "test_render_scene.h"

#include "cpu/cpu_renderer.h"

/* Whether something is between the place and `reach` m from it in this direction. */
static inline int is_hidden(const nb_geometry *geometry, const float place[3], const double way[3], float reach)
{
    struct RTCIntersectContext context;
    struct RTCRay ray = {.org_x = place[0],
                         .org_y = place[1],
                         .org_z = place[2],
                         .dir_x = (float)way[0],
                         .dir_y = (float)way[1],
                         .dir_z = (float)way[2],
                         .tfar = reach,
                         .mask = UINT32_MAX};
    rtcInitIntersectContext(&context);
    rtcOccluded1(geometry->scene, &context, &ray);
    return ray.tfar < 0;
}

static inline int is_in_shadow(const nb_geometry *geometry, const float place[3], const double sun[3])
{
    return is_hidden(geometry, place, sun, INFINITY);
}

/* Of the point light, relative to the place; its length. */
static inline double way_to_light(const nb_geometry *geometry, const float place[3], const nebel_light *light,
                                  double way[3])
{
    for (int i = 0; i < 3; i++) way[i] = light->position[i] - geometry->origin[i] - (double)place[i];
    const double distance = nb_vector_length(way);
    nb_vector_make_unit(way);
    return distance;
}

static inline int is_in_shadow_of_light(const nb_geometry *geometry, const float place[3], const nebel_light *light)
{
    double way[3];
    const double distance = way_to_light(geometry, place, light, way);
    return distance > light->radius && is_hidden(geometry, place, way, (float)(distance - light->radius));
}

#endif
