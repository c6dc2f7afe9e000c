#include "embree_scene.h"

#include "frame/mesh_check.h"
#include "math/vector.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The origin lies on a grid of cells of this size around the scene's centre, in the cell of the camera: it follows from
 * scene and camera alone, not from frames before. Within a cell floats are exact to 0.03 mm, at one metre from the eye
 * a twentieth of a pixel of a picture 1280 wide. */
static const double smallest_cell = 1024;

/* Positions of a mesh have themselves no more digits than its radius allows: finer cells would gain nothing. */
static const double cell_in_radii = 8;

/* ---- checks ---------------------------------------------------------------------------------- */

static nebel_result check_texture(const nebel_scene_data *scene, size_t number, const nebel_log *log)
{
    const nebel_texture *texture = &scene->textures[number];
    if (texture->width != 0 && texture->height != 0 && texture->rgba != NULL) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_ARGUMENT, "texture %zu: it has no texels", number);
}

static int has_finite_numbers(const nebel_mesh *mesh)
{
    int good = 1;
    for (int i = 0; i < 3; i++) good &= isfinite(mesh->origin[i]) && isfinite(mesh->base_color[i]);
    return good;
}

static nebel_result check_members(const nebel_scene_data *scene, size_t number, const nebel_log *log)
{
    const nebel_mesh *mesh = &scene->meshes[number];
    if (mesh->triangle_count > 0 && (mesh->positions == NULL || mesh->indices == NULL)) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "mesh %zu: it has triangles but no positions or no indices", number);
    }
    if (mesh->texture >= 0 && (size_t)mesh->texture >= scene->texture_count) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "mesh %zu: there is no texture %d", number, (int)mesh->texture);
    }
    if (!has_finite_numbers(mesh)) {
        return nb_fail(log, NEBEL_ERROR_VALUE, "mesh %zu: origin and base_color must be finite numbers", number);
    }
    return nb_holes_check(scene, number, log);
}

static nebel_result check_indices(const nebel_mesh *mesh, size_t number, const nebel_log *log)
{
    uint32_t largest = 0;
    const size_t count = 3 * (size_t)mesh->triangle_count;
    for (size_t i = 0; i < count; i++) largest = mesh->indices[i] > largest ? mesh->indices[i] : largest;
    if (count == 0 || largest < mesh->vertex_count) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_ARGUMENT, "mesh %zu: index %u, but there are only %u vertices", number,
                   (unsigned)largest, (unsigned)mesh->vertex_count);
}

static nebel_result check_scene(const nebel_scene_data *scene, const nebel_log *log)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->texture_count && result == NEBEL_OK; i++) result = check_texture(scene, i, log);
    for (size_t i = 0; i < scene->mesh_count && result == NEBEL_OK; i++) {
        result = check_members(scene, i, log);
        if (result == NEBEL_OK) result = check_indices(&scene->meshes[i], i, log);
    }
    return result;
}

/* ---- measures -------------------------------------------------------------------------------- */

static float longest_edge(const nebel_mesh *mesh)
{
    float longest2 = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        for (int k = 0; k < 3; k++) {
            const float *a = mesh->positions + 3 * (size_t)mesh->indices[3 * t + (size_t)k];
            const float *b = mesh->positions + 3 * (size_t)mesh->indices[3 * t + (size_t)(k + 1) % 3];
            const float x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
            const float length2 = x * x + y * y + z * z;
            longest2 = length2 > longest2 ? length2 : longest2;
        }
    }
    return sqrtf(longest2);
}

/* Vertices that are not finite are left out; Embree leaves out their triangles. */
static void set_bounds(nb_batch_surface *surface)
{
    for (size_t i = 0; i < 3; i++) {
        float low = INFINITY, high = -INFINITY;
        const float *positions = surface->mesh->positions + i;
        for (size_t v = 0; v < surface->mesh->vertex_count; v++) {
            const float p = isfinite(positions[3 * v]) ? positions[3 * v] : low;
            low = p < low ? p : low;
            high = p > high && isfinite(p) ? p : high;
        }
        surface->low[i] = low;
        surface->high[i] = high;
    }
}

/* Triangles of an edge of a 16th of their surface are few enough to be looked at one by one. */
#define COARSE 16.0f

double nb_surface_distance(const nb_batch_surface *surface, uint32_t triangle, const float start[3],
                           const float unit[3], double *cosine)
{
    const nebel_mesh *const mesh = surface->mesh;
    const uint32_t *const index = mesh->indices + 3 * (size_t)triangle;
    double a[3], b[3], normal[3], height = 0, rise = 0;
    for (int k = 0; k < 3; k++) {
        const double corner = (double)mesh->positions[3 * (size_t)index[0] + (size_t)k];
        a[k] = (double)mesh->positions[3 * (size_t)index[1] + (size_t)k] - corner;
        b[k] = (double)mesh->positions[3 * (size_t)index[2] + (size_t)k] - corner;
    }
    nb_vector_cross(a, b, normal);
    for (int k = 0; k < 3; k++) {
        const double corner = (double)mesh->positions[3 * (size_t)index[0] + (size_t)k];
        height += normal[k] * (corner + surface->shift[k] - (double)start[k]);
        rise += normal[k] * (double)unit[k];
    }
    if (cosine != NULL) *cosine = fabs(rise) / nb_vector_length(normal);
    return height / rise;
}

static void measure(nb_geometry *geometry, nb_batch_surface *surface)
{
    set_bounds(surface);
    surface->longest_edge = longest_edge(surface->mesh);
    float widest = 0;
    for (int i = 0; i < 3; i++) widest = fmaxf(widest, surface->high[i] - surface->low[i]);
    surface->is_coarse = COARSE * surface->longest_edge > widest;
    for (int i = 0; i < 3; i++) {
        const float radius = fmaxf(-surface->low[i], surface->high[i]);
        geometry->largest_radius = fmax(geometry->largest_radius, (double)radius);
    }
}

/* ---- Embree ---------------------------------------------------------------------------------- */

static void report(void *user, enum RTCError code, const char *text)
{
    const nebel_log *log = user;
    nb_fail(log, code == RTC_ERROR_OUT_OF_MEMORY ? NEBEL_ERROR_MEMORY : NEBEL_ERROR_UNSUPPORTED, "Embree: %s",
            text != NULL ? text : "no message");
}

static nebel_result result_of(enum RTCError error)
{
    switch (error) {
    case RTC_ERROR_NONE:
        return NEBEL_OK;
    case RTC_ERROR_OUT_OF_MEMORY:
        return NEBEL_ERROR_MEMORY;
    default:
        return NEBEL_ERROR_UNSUPPORTED;
    }
}

static const char *isa_option(nebel_isa isa)
{
    switch (isa) {
    case NEBEL_ISA_SCALAR:
    case NEBEL_ISA_SSE2:
        return ",isa=sse2";
    case NEBEL_ISA_AVX2:
        return ",isa=avx2";
    case NEBEL_ISA_AVX512:
        return ",isa=avx512";
    default:
        return "";
    }
}

/* Memory that is out is reported where it is for all that the renderer takes. */
static nebel_result fail_device(const nb_geometry *geometry, const char *options)
{
    const enum RTCError error = rtcGetDeviceError(NULL);
    const nebel_result result = result_of(error);
    if (result == NEBEL_ERROR_MEMORY) return result;
    return nb_fail(&geometry->log, result, "Embree does not start with \"%s\": %s", options,
                   error == RTC_ERROR_UNSUPPORTED_CPU ? "this processor lacks the instruction set"
                                                      : "too little memory or too few threads may be had");
}

static nebel_result make_device(nb_geometry *geometry, nebel_isa isa, int threads)
{
    char options[64];
    snprintf(options, sizeof options, "threads=%d%s", threads, isa_option(isa));
    geometry->device = rtcNewDevice(options);
    if (geometry->device == NULL) return fail_device(geometry, options);
    rtcSetDeviceErrorFunction(geometry->device, report, &geometry->log);
    return NEBEL_OK;
}

/* ---- numbers of triangles -------------------------------------------------------------------- */

static size_t fans(size_t count)
{
    return (count + NB_FAN - 1) / NB_FAN;
}

static nebel_result set_ids(nb_geometry *geometry)
{
    size_t count = 0;
    for (size_t s = 0; s < geometry->surface_count; s++) count += fans(geometry->surfaces[s].mesh->triangle_count);
    if (count >= UINT32_MAX / NB_FAN) {
        return nb_fail(&geometry->log, NEBEL_ERROR_ARGUMENT, "scene: more than 4 billion triangles");
    }
    geometry->owners = nb_allocate(&geometry->allocator, count, sizeof *geometry->owners);
    if (geometry->owners == NULL) return NEBEL_ERROR_MEMORY;
    size_t leaf = 0;
    for (uint32_t s = 0; s < geometry->surface_count; s++) {
        geometry->surfaces[s].first_id = (uint32_t)(leaf * NB_FAN);
        const size_t end = leaf + fans(geometry->surfaces[s].mesh->triangle_count);
        while (leaf < end) geometry->owners[leaf++] = s;
    }
    geometry->node_counts[0] = count;
    return NEBEL_OK;
}

static nebel_result make_tree(nb_geometry *geometry)
{
    size_t total = geometry->node_counts[0];
    geometry->level_count = 1;
    for (size_t count = total; count > 1; total += count) {
        count = fans(count);
        geometry->node_counts[geometry->level_count++] = count;
    }
    geometry->nodes = nb_allocate(&geometry->allocator, total + 1, sizeof(nb_node));
    if (geometry->nodes == NULL) return NEBEL_ERROR_MEMORY;
    nb_node *level = (nb_node *)(((uintptr_t)geometry->nodes + sizeof *level - 1) / sizeof *level * sizeof *level);
    for (int i = 0; i < geometry->level_count; i++) {
        geometry->levels[i] = level;
        level += geometry->node_counts[i];
    }
    return NEBEL_OK;
}

static nebel_result find_mask(nb_geometry *geometry, const nebel_scene_data *scene, const nebel_mesh *mesh,
                              const nb_alpha_mask **found)
{
    if (mesh->alpha_cutoff == 0) return NEBEL_OK;
    for (size_t i = 0; i < geometry->mask_count && *found == NULL; i++) {
        const nb_alpha_mask *mask = &geometry->masks[i];
        if (mask->number == mesh->mask && mask->cutoff == mesh->alpha_cutoff) *found = mask;
    }
    if (*found != NULL) return NEBEL_OK;
    *found = &geometry->masks[geometry->mask_count++];
    return nb_alpha_mask_make((nb_alpha_mask *)*found, &geometry->allocator, scene, mesh->mask, mesh->alpha_cutoff);
}

static nebel_result make_surface(nb_geometry *geometry, const nebel_scene_data *scene, const nebel_mesh *mesh)
{
    nb_batch_surface *surface = &geometry->surfaces[geometry->surface_count++];
    surface->mesh = mesh;
    surface->first_vertex = geometry->vertex_count;
    geometry->vertex_count += mesh->vertex_count;
    surface->positions = nb_allocate(&geometry->allocator, mesh->vertex_count + (size_t)1, 3 * sizeof(float));
    surface->ends = nb_allocate(&geometry->allocator, mesh->vertex_count, 4 * sizeof *surface->ends);
    if (surface->positions == NULL || surface->ends == NULL) return NEBEL_ERROR_MEMORY;
    memset(surface->positions + 3 * (size_t)mesh->vertex_count, 0, 3 * sizeof(float));
    measure(geometry, surface);
    return find_mask(geometry, scene, mesh, &surface->mask);
}

nebel_result nb_geometry_make(nb_geometry *geometry, const nebel_scene_data *scene, nebel_isa isa, int threads)
{
    nebel_result result = check_scene(scene, &geometry->log);
    if (result != NEBEL_OK) return result;
    geometry->surfaces = nb_allocate_zero(&geometry->allocator, scene->mesh_count, sizeof *geometry->surfaces);
    geometry->masks = nb_allocate_zero(&geometry->allocator, scene->mesh_count, sizeof *geometry->masks);
    if (geometry->surfaces == NULL || geometry->masks == NULL) return NEBEL_ERROR_MEMORY;
    for (size_t i = 0; i < scene->mesh_count && result == NEBEL_OK; i++) {
        if (scene->meshes[i].triangle_count > 0) result = make_surface(geometry, scene, &scene->meshes[i]);
    }
    if (result == NEBEL_OK) result = set_ids(geometry);
    if (result == NEBEL_OK) result = make_tree(geometry);
    return result == NEBEL_OK ? make_device(geometry, isa, threads) : result;
}

/* ---- building -------------------------------------------------------------------------------- */

/* The corners of all meshes in world coordinates. */
static void world_bounds(const nb_geometry *geometry, double low[3], double high[3])
{
    for (int i = 0; i < 3; i++) {
        low[i] = HUGE_VAL;
        high[i] = -HUGE_VAL;
        for (size_t s = 0; s < geometry->surface_count; s++) {
            const nb_batch_surface *surface = &geometry->surfaces[s];
            low[i] = fmin(low[i], surface->mesh->origin[i] + (double)surface->low[i]);
            high[i] = fmax(high[i], surface->mesh->origin[i] + (double)surface->high[i]);
        }
    }
}

/* What is too far out for Embree becomes no number, which it leaves out with its triangles, as rasterizing does. */
static void move_positions(const double origin[3], nb_batch_surface *surface)
{
    const nebel_mesh *mesh = surface->mesh;
    double *const shift = surface->shift;
    for (int i = 0; i < 3; i++) shift[i] = mesh->origin[i] - origin[i];
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        for (size_t i = 0; i < 3; i++) {
            const float moved = (float)((double)mesh->positions[3 * v + i] + shift[i]);
            surface->positions[3 * v + i] = fabsf(moved) < 1e18f ? moved : NAN;
        }
    }
}

/* Rays pass through holes. Embree has what it met in rows of N numbers, in the order of RTCHit; names for them in C++
 * alone. */
static void drop_holes(const struct RTCFilterFunctionNArguments *met)
{
    const nb_batch_surface *surface = met->geometryUserPtr;
    const float *us = (const float *)met->hit + 3 * (size_t)met->N, *vs = us + met->N;
    const unsigned *triangles = (const unsigned *)met->hit + 5 * (size_t)met->N;
    for (unsigned i = 0; i < met->N; i++) {
        if (met->valid[i] == 0) continue;
        const uint32_t *index = surface->mesh->indices + 3 * (size_t)triangles[i];
        const float weights[3] = {1 - us[i] - vs[i], us[i], vs[i]};
        float place[2] = {0, 0};
        for (int k = 0; k < 3; k++) {
            const float *uv = surface->mesh->uvs + 2 * (size_t)index[k];
            for (int c = 0; c < 2; c++) place[c] += isfinite(uv[c]) ? weights[k] * uv[c] : 0;
        }
        if (nb_alpha_mask_is_hole(surface->mask, place[0], place[1])) met->valid[i] = 0;
    }
}

/* Shadow rays start beside the triangle that they leave. Embree may meet it, or its neighbours in the same plane, all the same,
 * within the rounding of its corners. Rows of N numbers of the rays: start, least t, direction, time, t of what is met. */
static void drop_false_shadows(const struct RTCFilterFunctionNArguments *met)
{
    const nb_batch_surface *surface = met->geometryUserPtr;
    const float *rays = (const float *)met->ray;
    const unsigned *triangles = (const unsigned *)met->hit + 5 * (size_t)met->N;
    const size_t n = met->N;
    for (size_t i = 0; i < n; i++) {
        if (met->valid[i] == 0 || rays[8 * n + i] > 0x1p-16f * surface->longest_edge) continue;
        const float start[3] = {rays[i], rays[n + i], rays[2 * n + i]};
        const float unit[3] = {rays[4 * n + i], rays[5 * n + i], rays[6 * n + i]};
        if (!(nb_surface_distance(surface, triangles[i], start, unit, NULL) > 0)) met->valid[i] = 0;
    }
    if (surface->mask != NULL) drop_holes(met);
}

static nebel_result attach(nb_geometry *geometry, size_t number)
{
    const nb_batch_surface *surface = &geometry->surfaces[number];
    const RTCGeometry triangles = rtcNewGeometry(geometry->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (triangles == NULL) return result_of(rtcGetDeviceError(geometry->device));
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, surface->positions, 0,
                               3 * sizeof(float), surface->mesh->vertex_count);
    rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, surface->mesh->indices, 0,
                               3 * sizeof(uint32_t), surface->mesh->triangle_count);
    rtcSetGeometryUserData(triangles, &geometry->surfaces[number]);
    if (surface->mask != NULL) rtcSetGeometryIntersectFilterFunction(triangles, drop_holes);
    if (surface->mask != NULL || surface->is_coarse)
        rtcSetGeometryOccludedFilterFunction(triangles, surface->is_coarse ? drop_false_shadows : drop_holes);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(geometry->scene, triangles, (unsigned)number);
    rtcReleaseGeometry(triangles);
    return result_of(rtcGetDeviceError(geometry->device));
}

static nebel_result build_scene(nb_geometry *geometry)
{
    if (geometry->scene != NULL) rtcReleaseScene(geometry->scene);
    geometry->scene = rtcNewScene(geometry->device);
    if (geometry->scene == NULL) return result_of(rtcGetDeviceError(geometry->device));
    /* Without this flag rays slip through where triangles meet: one in fifty thousand at the poles of a sphere. */
    rtcSetSceneFlags(geometry->scene, RTC_SCENE_FLAG_ROBUST);
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < geometry->surface_count && result == NEBEL_OK; i++) {
        move_positions(geometry->origin, &geometry->surfaces[i]);
        result = attach(geometry, i);
    }
    if (result == NEBEL_OK) {
        rtcCommitScene(geometry->scene);
        result = result_of(rtcGetDeviceError(geometry->device));
    }
    if (result == NEBEL_OK) return NEBEL_OK;
    rtcReleaseScene(geometry->scene);
    geometry->scene = NULL;
    return result;
}

/* The centre of the cell in which the part of the scene lies that is nearest to the camera. */
static void choose_origin(const nb_geometry *geometry, const double camera[3], const double low[3],
                          const double high[3], double origin[3])
{
    const double cell = fmax(smallest_cell, cell_in_radii * geometry->largest_radius);
    for (int i = 0; i < 3; i++) {
        const double center = .5 * low[i] + .5 * high[i];
        const double nearest = fmin(fmax(camera[i], low[i]), high[i]);
        origin[i] = center + cell * round((nearest - center) / cell);
    }
}

nebel_result nb_geometry_place(nb_geometry *geometry, const double camera[3])
{
    if (geometry->surface_count == 0) return NEBEL_OK;
    double low[3], high[3], origin[3];
    world_bounds(geometry, low, high);
    if (!(low[0] <= high[0] && low[1] <= high[1] && low[2] <= high[2])) return NEBEL_OK;
    choose_origin(geometry, camera, low, high, origin);
    if (geometry->scene != NULL && memcmp(origin, geometry->origin, sizeof origin) == 0) return NEBEL_OK;
    for (int i = 0; i < 3; i++) {
        geometry->origin[i] = origin[i];
        geometry->bounds_min[i] = (float)(low[i] - origin[i]);
        geometry->bounds_max[i] = (float)(high[i] - origin[i]);
    }
    return build_scene(geometry);
}

void nb_geometry_free(nb_geometry *geometry)
{
    if (geometry->scene != NULL) rtcReleaseScene(geometry->scene);
    if (geometry->device != NULL) rtcReleaseDevice(geometry->device);
    for (size_t i = 0; i < geometry->surface_count; i++) {
        nb_release(&geometry->allocator, geometry->surfaces[i].positions);
        nb_release(&geometry->allocator, geometry->surfaces[i].ends);
    }
    for (size_t i = 0; i < geometry->mask_count; i++) nb_alpha_mask_free(&geometry->masks[i], &geometry->allocator);
    nb_release(&geometry->allocator, geometry->masks);
    nb_release(&geometry->allocator, geometry->nodes);
    nb_release(&geometry->allocator, geometry->owners);
    nb_release(&geometry->allocator, geometry->surfaces);
}
