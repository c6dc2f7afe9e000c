#include "embree_floor.h"

#include "measure.h"

#include <embree3/rtcore.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Rays go in packets of 4 x 4 pixels. A strip of packets is prepared, then traced, and only the tracing is timed: small
 * enough for the cache, large enough for the clock. */
enum { PACKET = 16, SIDE = 4, STRIP = 256 };

typedef struct strip {
    struct RTCRayHit16 rays[STRIP];
    struct RTCRay16 shadows[STRIP];
    _Alignas(64) int valid[STRIP][PACKET];
} strip;

struct nb_embree_floor {
    RTCDevice device;
    RTCScene scene;
    uint32_t width, height;
    float position[3], corner[3], step_x[3], step_y[3]; /* of the camera's rays */
    float sun[3];
    strip *strip;
    atomic_llong bytes;
};

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void normalize(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] /= length;
}

static void set_view(const nebel_camera *camera, nb_embree_floor *floor)
{
    double forward[3], right[3], up[3];
    for (int i = 0; i < 3; i++) forward[i] = camera->look_at[i] - camera->position[i];
    normalize(forward);
    cross(forward, camera->up, right);
    normalize(right);
    cross(right, forward, up);
    const double step = 2 * tan(camera->vertical_fov / 2 * 3.14159265358979323846 / 180) / floor->height;
    for (int i = 0; i < 3; i++) {
        floor->position[i] = (float)camera->position[i];
        floor->step_x[i] = (float)(right[i] * step);
        floor->step_y[i] = (float)(-up[i] * step);
        floor->corner[i] =
            (float)(forward[i] - right[i] * step * .5 * (floor->width - 1.) + up[i] * step * .5 * (floor->height - 1.));
    }
}

static bool count_bytes(void *user, ssize_t bytes, bool post)
{
    nb_embree_floor *const floor = user;
    (void)post;
    (void)atomic_fetch_add(&floor->bytes, bytes);
    return true;
}

static int build(const nb_terrain *terrain, nb_embree_floor *floor)
{
    floor->device = rtcNewDevice(NULL);
    if (floor->device == NULL) return -1;
    rtcSetDeviceMemoryMonitorFunction(floor->device, count_bytes, floor);
    floor->scene = rtcNewScene(floor->device);
    const RTCGeometry triangles = rtcNewGeometry(floor->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *const positions = rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                     3 * sizeof(float), terrain->vertex_count);
    if (positions == NULL) return -1;
    memcpy(positions, terrain->positions, 3 * sizeof(float) * terrain->vertex_count);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, terrain->indices, 0,
                               3 * sizeof(uint32_t), terrain->triangle_count);
    rtcCommitGeometry(triangles);
    rtcAttachGeometry(floor->scene, triangles);
    rtcReleaseGeometry(triangles);
    rtcCommitScene(floor->scene);
    return rtcGetDeviceError(floor->device) == RTC_ERROR_NONE ? 0 : -1;
}

nb_embree_floor *nb_embree_floor_make(const nb_bench_scene *scene, uint32_t width, uint32_t height)
{
    nb_embree_floor *const floor = calloc(1, sizeof *floor);
    if (floor == NULL) return NULL;
    floor->width = width;
    floor->height = height;
    floor->strip = aligned_alloc(64, (sizeof *floor->strip + 63) / 64 * 64);
    for (int i = 0; i < 3; i++) floor->sun[i] = (float)scene->data.sun_direction[i];
    set_view(&scene->data.camera, floor);
    if (floor->strip != NULL && build(&scene->terrain, floor) == 0) return floor;
    nb_embree_floor_free(floor);
    return NULL;
}

void nb_embree_floor_free(nb_embree_floor *floor)
{
    if (floor == NULL) return;
    if (floor->scene != NULL) rtcReleaseScene(floor->scene);
    if (floor->device != NULL) rtcReleaseDevice(floor->device);
    free(floor->strip);
    free(floor);
}

size_t nb_embree_floor_bytes(const nb_embree_floor *floor)
{
    const long long bytes = atomic_load(&floor->bytes);
    return bytes > 0 ? (size_t)bytes : 0;
}

/* ---- rays ------------------------------------------------------------------------------------ */

static void set_ray(const nb_embree_floor *floor, uint32_t packet, int lane, struct RTCRayHit16 *rays, int *valid)
{
    const uint32_t columns = floor->width / SIDE;
    const float x = (float)(packet % columns * SIDE + (uint32_t)lane % SIDE);
    const float y = (float)(packet / columns * SIDE + (uint32_t)lane / SIDE);
    float d[3];
    for (int i = 0; i < 3; i++) d[i] = floor->corner[i] + x * floor->step_x[i] + y * floor->step_y[i];
    const float scale = 1 / sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    struct RTCRay16 *const ray = &rays->ray;
    ray->org_x[lane] = floor->position[0];
    ray->org_y[lane] = floor->position[1];
    ray->org_z[lane] = floor->position[2];
    ray->dir_x[lane] = d[0] * scale;
    ray->dir_y[lane] = d[1] * scale;
    ray->dir_z[lane] = d[2] * scale;
    ray->tfar[lane] = INFINITY;
    ray->mask[lane] = ~0u;
    rays->hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    rays->hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    valid[lane] = -1;
}

/* From a hit towards the sun; nothing where there is no hit, or where the surface faces away. Returns whether there is
 * one. */
static int set_shadow(const nb_embree_floor *floor, const struct RTCRayHit16 *rays, int lane, struct RTCRay16 *shadow,
                      int *valid)
{
    const struct RTCRay16 *const ray = &rays->ray;
    const float lift = 1e-3f, t = ray->tfar[lane];
    float n[3] = {rays->hit.Ng_x[lane], rays->hit.Ng_y[lane], rays->hit.Ng_z[lane]};
    const float scale = 1 / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const float facing = ray->dir_x[lane] * n[0] + ray->dir_y[lane] * n[1] + ray->dir_z[lane] * n[2];
    for (int i = 0; i < 3; i++) n[i] *= facing > 0 ? -scale : scale;
    const float cosine = n[0] * floor->sun[0] + n[1] * floor->sun[1] + n[2] * floor->sun[2];
    const int wanted = rays->hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID && cosine > 0;
    valid[lane] = -wanted;
    if (!wanted) return 0;
    shadow->org_x[lane] = ray->org_x[lane] + t * ray->dir_x[lane] + lift * n[0];
    shadow->org_y[lane] = ray->org_y[lane] + t * ray->dir_y[lane] + lift * n[1];
    shadow->org_z[lane] = ray->org_z[lane] + t * ray->dir_z[lane] + lift * n[2];
    shadow->dir_x[lane] = floor->sun[0];
    shadow->dir_y[lane] = floor->sun[1];
    shadow->dir_z[lane] = floor->sun[2];
    shadow->tfar[lane] = INFINITY;
    shadow->mask[lane] = ~0u;
    return 1;
}

static double trace_primary(const nb_embree_floor *floor, uint32_t first, uint32_t count)
{
    strip *const s = floor->strip;
    memset(s->rays, 0, sizeof s->rays);
    for (uint32_t k = 0; k < count; k++) {
        for (int lane = 0; lane < PACKET; lane++) set_ray(floor, first + k, lane, &s->rays[k], s->valid[k]);
    }
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const double start = nb_clock_cpu();
    for (uint32_t k = 0; k < count; k++) rtcIntersect16(s->valid[k], floor->scene, &context, &s->rays[k]);
    return nb_clock_cpu() - start;
}

static double trace_shadows(const nb_embree_floor *floor, uint32_t count, nb_embree_rays *found)
{
    strip *const s = floor->strip;
    memset(s->shadows, 0, sizeof s->shadows);
    for (uint32_t k = 0; k < count; k++) {
        for (int lane = 0; lane < PACKET; lane++) {
            found->hits += s->rays[k].hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
            found->shadow_rays += (size_t)set_shadow(floor, &s->rays[k], lane, &s->shadows[k], s->valid[k]);
        }
    }
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const double start = nb_clock_cpu();
    for (uint32_t k = 0; k < count; k++) rtcOccluded16(s->valid[k], floor->scene, &context, &s->shadows[k]);
    return nb_clock_cpu() - start;
}

nb_embree_rays nb_embree_floor_trace(const nb_embree_floor *floor)
{
    nb_embree_rays found = {0};
    const uint32_t packets = floor->width / SIDE * (floor->height / SIDE);
    for (uint32_t first = 0; first < packets; first += STRIP) {
        const uint32_t count = packets - first < STRIP ? packets - first : STRIP;
        found.primary_seconds += trace_primary(floor, first, count);
        found.shadow_seconds += trace_shadows(floor, count, &found);
    }
    return found;
}
