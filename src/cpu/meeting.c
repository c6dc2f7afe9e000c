/* What rays of the reference meet: surfaces, by Embree, and the ground of planets. */
#include "path_tracer.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* ---- surfaces -------------------------------------------------------------------------------- */

void nb_lone_ray_clear(nb_single_ray *lone)
{
    memset(lone, 0, sizeof *lone);
    for (int i = 0; i < NB_BATCH; i++) lone->hits.surface[i] = NB_NONE;
}

nb_path_vertex nb_meeting_of(const nb_hits *hits, const nb_surface_batch *points, int i)
{
    nb_path_vertex meeting = {.t = HUGE_VAL};
    if (hits->surface[i] == NB_NONE) return meeting;
    meeting.t = (double)hits->t[i];
    meeting.cosine = points->cosine[i];
    meeting.lit = points->lit[i] != 0;
    for (int c = 0; c < 3; c++) {
        meeting.reflectance[c] = points->reflectance[c][i];
        meeting.normal[c] = points->normal[c][i];
        meeting.side[c] = points->side[c][i];
        meeting.start[c] = points->start[c][i];
    }
    return meeting;
}

static void set_ray(const nb_geometry *geometry, const double origin[3], const double direction[3], struct RTCRay *ray)
{
    memset(ray, 0, sizeof *ray);
    ray->org_x = nb_clamp_coordinate((float)(origin[0] - geometry->origin[0]));
    ray->org_y = nb_clamp_coordinate((float)(origin[1] - geometry->origin[1]));
    ray->org_z = nb_clamp_coordinate((float)(origin[2] - geometry->origin[2]));
    ray->dir_x = (float)direction[0];
    ray->dir_y = (float)direction[1];
    ray->dir_z = (float)direction[2];
    ray->tfar = HUGE_VALF;
    ray->mask = UINT32_MAX;
}

int nb_meeting_is_shadowed(const nb_geometry *geometry, const double origin[3], const double direction[3], double reach)
{
    struct RTCRay ray;
    struct RTCIntersectContext context;
    if (geometry->scene == NULL || reach == 0) return 0;
    rtcInitIntersectContext(&context);
    set_ray(geometry, origin, direction, &ray);
    ray.tfar = (float)reach;
    rtcOccluded1(geometry->scene, &context, &ray);
    return ray.tfar < 0;
}

static void take_hit(const struct RTCRayHit *found, nb_ray_batch *rays, nb_hits *hits)
{
    const struct RTCRay *ray = &found->ray;
    const float start[3] = {ray->org_x, ray->org_y, ray->org_z}, unit[3] = {ray->dir_x, ray->dir_y, ray->dir_z};
    const float normal[3] = {found->hit.Ng_x, found->hit.Ng_y, found->hit.Ng_z};
    for (int k = 0; k < 3; k++) {
        rays->start[k][0] = start[k];
        rays->unit[k][0] = unit[k];
        hits->normal[k][0] = normal[k];
    }
    hits->surface[0] = found->hit.geomID;
    hits->triangle[0] = found->hit.primID;
    hits->t[0] = ray->tfar;
    hits->u[0] = found->hit.u;
    hits->v[0] = found->hit.v;
}

static nb_path_vertex find_surface(const nb_path_scene *world, const nebel_ray *along, nb_single_ray *lone)
{
    struct RTCRayHit found;
    struct RTCIntersectContext context;
    const float sun[3] = {(float)world->to_sun[0], (float)world->to_sun[1], (float)world->to_sun[2]};
    if (world->geometry->scene == NULL) return (nb_path_vertex){.t = HUGE_VAL};
    rtcInitIntersectContext(&context);
    set_ray(world->geometry, along->origin, along->direction, &found.ray);
    found.hit.geomID = found.hit.primID = found.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(world->geometry->scene, &context, &found);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return (nb_path_vertex){.t = HUGE_VAL};
    take_hit(&found, &lone->rays, &lone->hits);
    nb_surface_points(world->geometry, world->scene, world->table, &lone->rays, &lone->hits, sun, &lone->points);
    return nb_meeting_of(&lone->hits, &lone->points, 0);
}

/* ---- grounds --------------------------------------------------------------------------------- */

/* Surfaces on the ground touch it: they are seen where they lie this little behind it, which is more than rounding. */
static double past_ground(double t)
{
    return 1e-5 * t + 1e-3;
}

void nb_meeting_end_at_ground(const nb_path_scene *world, nebel_ray *ray, nb_path_vertex *meeting)
{
    const nb_ground_hit hit = nb_media_find_ground(&world->media, ray);
    const int meets_surface = meeting->t < HUGE_VAL;
    /* From on the ground or below it all surfaces are seen before it. */
    if (hit.world == NULL || (meets_surface && (hit.t == 0 || hit.t + past_ground(meeting->t) >= meeting->t))) return;
    *meeting = (nb_path_vertex){.t = hit.t, .is_ground = 1};
    ray->t_max = hit.t;
    for (int c = 0; c < 3; c++) {
        meeting->reflectance[c] = (float)hit.world->planet->atmosphere_desc.ground_albedo[c];
        meeting->normal[c] = meeting->side[c] = (float)hit.normal[c];
        meeting->place[c] = hit.place[c];
    }
    meeting->cosine = (float)nb_vector_dot(hit.normal, world->to_sun);
    meeting->lit = world->has_sun && meeting->cosine > 0;
}

nb_path_vertex nb_meeting_find(const nb_path_scene *world, nebel_ray *ray, nb_single_ray *lone)
{
    nb_path_vertex meeting = find_surface(world, ray, lone);
    ray->t_max = meeting.t;
    nb_meeting_end_at_ground(world, ray, &meeting);
    return meeting;
}
