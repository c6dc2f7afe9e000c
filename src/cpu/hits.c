#include "hits.h"

#include <math.h>
#include <string.h>

enum { ROW = NB_PACKET * sizeof(float) };

static void fill_row(float *row, float value)
{
    for (int i = 0; i < NB_PACKET; i++) row[i] = value;
}

/* tnear, time, mask, flags and the identity of a ray are the same for all. */
static void set_constants(struct RTCRay16 *ray)
{
    fill_row(ray->tnear, 0);
    fill_row(ray->time, 0);
    fill_row(ray->tfar, INFINITY);
    memset(ray->mask, 0xff, sizeof ray->mask);
    memset(ray->id, 0, sizeof ray->id);
    memset(ray->flags, 0, sizeof ray->flags);
}

static struct RTCIntersectContext coherent_context(void)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    return context;
}

static int any(const int *active)
{
    int found = 0;
    for (int i = 0; i < NB_PACKET; i++) found |= active[i];
    return found;
}

static void set_packet(struct RTCRayHit16 *packet, const nb_ray_batch *rays, int first)
{
    struct RTCRay16 *ray = &packet->ray;
    set_constants(ray);
    memcpy(ray->org_x, rays->start[0] + first, ROW);
    memcpy(ray->org_y, rays->start[1] + first, ROW);
    memcpy(ray->org_z, rays->start[2] + first, ROW);
    memcpy(ray->dir_x, rays->unit[0] + first, ROW);
    memcpy(ray->dir_y, rays->unit[1] + first, ROW);
    memcpy(ray->dir_z, rays->unit[2] + first, ROW);
    memset(packet->hit.geomID, 0xff, sizeof packet->hit.geomID);
    memset(packet->hit.instID, 0xff, sizeof packet->hit.instID);
}

static void get_packet(const struct RTCRayHit16 *packet, nb_hits *hits, int first)
{
    memcpy(hits->surface + first, packet->hit.geomID, ROW);
    memcpy(hits->triangle + first, packet->hit.primID, ROW);
    memcpy(hits->t + first, packet->ray.tfar, ROW);
    memcpy(hits->u + first, packet->hit.u, ROW);
    memcpy(hits->v + first, packet->hit.v, ROW);
    memcpy(hits->normal[0] + first, packet->hit.Ng_x, ROW);
    memcpy(hits->normal[1] + first, packet->hit.Ng_y, ROW);
    memcpy(hits->normal[2] + first, packet->hit.Ng_z, ROW);
}

void nb_hits_trace(RTCScene scene, const nb_ray_batch *rays, const int *active, nb_packets *packets, nb_hits *hits)
{
    struct RTCIntersectContext context = coherent_context();
    for (int p = 0; p < NB_PACKETS; p++) {
        const int first = p * NB_PACKET;
        struct RTCRayHit16 *packet = &packets->rays[p];
        set_packet(packet, rays, first);
        if (scene != NULL && any(active + first)) rtcIntersect16(active + first, scene, &context, packet);
        get_packet(packet, hits, first);
    }
}

static int is_large(const nb_geometry *geometry, const nb_ray_batch *rays, const nb_hits *hits, int i)
{
    float rise = 0, length2 = 0;
    if (hits->surface[i] == NB_NONE) return 0;
    for (int k = 0; k < 3; k++) {
        rise += hits->normal[k][i] * rays->unit[k][i];
        length2 += hits->normal[k][i] * hits->normal[k][i];
    }
    const float distance = hits->t[i] * fabsf(rise), edge = geometry->surfaces[hits->surface[i]].longest_edge;
    return NB_LONG_EDGE * distance < edge * sqrtf(length2);
}

void nb_hits_refine(const nb_geometry *geometry, const nb_ray_batch *rays, nb_hits *hits)
{
    for (int i = 0; i < NB_BATCH; i++) {
        if (!is_large(geometry, rays, hits, i)) continue;
        const nb_batch_surface *const surface = &geometry->surfaces[hits->surface[i]];
        const float start[3] = {rays->start[0][i], rays->start[1][i], rays->start[2][i]};
        const float unit[3] = {rays->unit[0][i], rays->unit[1][i], rays->unit[2][i]};
        double cosine;
        const double t = nb_surface_distance(surface, hits->triangle[i], start, unit, &cosine);
        if (t > 0 && fabs(t - (double)hits->t[i]) * cosine <= 0x1p-20 * (double)surface->longest_edge)
            hits->t[i] = (float)t;
    }
}

static void set_ray_starts(struct RTCRay16 *ray, float (*start)[NB_BATCH], int first)
{
    memcpy(ray->org_x, start[0] + first, ROW);
    memcpy(ray->org_y, start[1] + first, ROW);
    memcpy(ray->org_z, start[2] + first, ROW);
}

/* Clears active[i] where something lies on the way, whose end is in ray->tfar. */
static void find_shadows(RTCScene scene, struct RTCRay16 *ray, int *active)
{
    struct RTCIntersectContext context = coherent_context();
    if (scene == NULL) return;
    for (int i = 0; i < NB_PACKET; i++) ray->tfar[i] = active[i] ? ray->tfar[i] : -1;
    rtcOccluded16(active, scene, &context, ray);
    for (int i = 0; i < NB_PACKET; i++)
        if (ray->tfar[i] < 0) active[i] = 0;
}

void nb_hits_shadow(RTCScene scene, float (*start)[NB_BATCH], const float direction[3], int *active,
                    nb_packets *packets)
{
    struct RTCRay16 *ray = &packets->rays[0].ray;
    set_constants(ray);
    fill_row(ray->dir_x, direction[0]);
    fill_row(ray->dir_y, direction[1]);
    fill_row(ray->dir_z, direction[2]);
    for (int first = 0; first < NB_BATCH; first += NB_PACKET) {
        if (!any(active + first)) continue;
        set_ray_starts(ray, start, first);
        fill_row(ray->tfar, INFINITY);
        find_shadows(scene, ray, active + first);
    }
}

void nb_hits_between(RTCScene scene, float (*start)[NB_BATCH], float (*direction)[NB_BATCH], const float *reach,
                     int *active, nb_packets *packets)
{
    struct RTCRay16 *ray = &packets->rays[0].ray;
    set_constants(ray);
    for (int first = 0; first < NB_BATCH; first += NB_PACKET) {
        if (!any(active + first)) continue;
        set_ray_starts(ray, start, first);
        memcpy(ray->dir_x, direction[0] + first, ROW);
        memcpy(ray->dir_y, direction[1] + first, ROW);
        memcpy(ray->dir_z, direction[2] + first, ROW);
        memcpy(ray->tfar, reach + first, ROW);
        find_shadows(scene, ray, active + first);
    }
}
