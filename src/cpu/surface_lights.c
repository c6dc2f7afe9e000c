#include "surface_lights.h"

#include <nebel/light.h>

#include <math.h>

#define PI 3.14159265358979323846

/* As formulas/point_light.inc has it: full within the inner angle, nothing beyond the outer one. */
typedef struct nb_spot_cone {
    float axis[3], edge, rise;
} nb_spot_cone;

static nb_spot_cone spot_cone_of(const nebel_light *light)
{
    if (light->type != NEBEL_LIGHT_SPOT) return (nb_spot_cone){{0, 0, 0}, -1, 1e30f}; /* everything is within */
    const double edge = cos(light->outer_angle * (PI / 180)), inner = cos(light->inner_angle * (PI / 180));
    const double *d = light->direction, length = hypot(hypot(d[0], d[1]), d[2]);
    return (nb_spot_cone){{(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)},
                          (float)edge,
                          (float)fmin(1 / (inner - edge), 1e30)};
}

NB_CLONES static void set_ways(const nb_spot_cone *within, float radius, float clear, const float *restrict place,
                               const nb_ray_starts *starts, const nb_hits *hits, const nb_surface_batch *points,
                               nb_shadow_rays *ways)
{
    const float lx = place[0], ly = place[1], lz = place[2], edge = within->edge, rise = within->rise;
    const float *sx = starts->offset[0], *sy = starts->offset[1], *sz = starts->offset[2];
    const float ax = within->axis[0], ay = within->axis[1], az = within->axis[2];
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float x = lx - sx[i], y = ly - sy[i], z = lz - sz[i];
        const float square = x * x + y * y + z * z, distance = sqrtf(square);
        const float scale = 1 / (distance > 1e-18f ? distance : 1e-18f);
        const float dx = x * scale, dy = y * scale, dz = z * scale;
        const float cosine = points->normal[0][i] * dx + points->normal[1][i] * dy + points->normal[2][i] * dz;
        const float above = points->side[0][i] * dx + points->side[1][i] * dy + points->side[2][i] * dz;
        const float off = (-(ax * dx + ay * dy + az * dz) - edge) * rise;
        const float s = off < 1 ? (off > 0 ? off : 0) : 1;
        const float nearest = square > radius * radius ? square : radius * radius;
        const float strength = cosine / nearest * (s * s * (3 - 2 * s)) * 0.31830988618379067f;
        const float reach = distance - clear;
        ways->direction[0][i] = dx;
        ways->direction[1][i] = dy;
        ways->direction[2][i] = dz;
        ways->reach[i] = reach > 0 ? reach : 0;
        ways->shadowed[i] = distance > radius ? distance - radius : 0;
        ways->strength[i] = strength;
        ways->lit[i] = -((hits->surface[i] != NB_NONE) & (cosine > 0) & (above > 0) & (strength > 0));
    }
}

void nb_shadow_rays_set(const nebel_light *light, const nb_ray_starts *starts, const nb_hits *hits,
                        const nb_surface_batch *points, nb_shadow_rays *ways)
{
    const nb_spot_cone within = spot_cone_of(light);
    float place[3];
    for (int c = 0; c < 3; c++) place[c] = (float)(light->position[c] - starts->origin[c]);
    set_ways(&within, (float)fmax(light->radius, NEBEL_MIN_LIGHT_RADIUS), (float)light->radius, place, starts, hits,
             points, ways);
}

void nb_shadow_rays_shadow(RTCScene scene, nb_surface_batch *points, nb_shadow_rays *ways, nb_packets *packets)
{
    nb_hits_between(scene, points->start, ways->direction, ways->shadowed, ways->lit, packets);
}
