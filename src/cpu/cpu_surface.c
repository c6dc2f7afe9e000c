#include "cpu_surface.h"

#include <math.h>

/* IEC 61966-2-1 */
void nb_srgb_table_set(nb_srgb_table *table)
{
    for (int i = 0; i < 256; i++) {
        const double s = i / 255.0;
        table->linear[i] = (float)(s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4));
    }
}

/* ---- textures -------------------------------------------------------------------------------- */

/* The part of a texture coordinate after the point; 0 for what has none. */
static float wrap(float x)
{
    const float part = x - floorf(x);
    return part >= 0 && part < 1 ? part : 0;
}

typedef struct nb_taps {
    uint32_t first, second; /* neighbouring texels */
    float weight;           /* of the second */
} nb_taps;

/* Texel centres lie at halves. */
static nb_taps find_taps(float coordinate, uint32_t size)
{
    const double place = (double)wrap(coordinate) * size + size - .5;
    const double whole = floor(place);
    const uint32_t first = (uint32_t)((uint64_t)whole % size);
    return (nb_taps){first, first + 1 < size ? first + 1 : 0, (float)(place - whole)};
}

static float lerp(float a, float b, float weight)
{
    return a + (b - a) * weight;
}

static void sample_texture(const nebel_texture *texture, const nb_srgb_table *table, float u, float v, float color[3])
{
    const nb_taps x = find_taps(u, texture->width), y = find_taps(v, texture->height);
    const uint8_t *top = texture->rgba + 4 * (size_t)y.first * texture->width;
    const uint8_t *bottom = texture->rgba + 4 * (size_t)y.second * texture->width;
    for (size_t c = 0; c < 3; c++) {
        const float above =
            lerp(table->linear[top[4 * (size_t)x.first + c]], table->linear[top[4 * (size_t)x.second + c]], x.weight);
        const float below = lerp(table->linear[bottom[4 * (size_t)x.first + c]],
                                 table->linear[bottom[4 * (size_t)x.second + c]], x.weight);
        color[c] = lerp(above, below, y.weight);
    }
}

/* ---- points ---------------------------------------------------------------------------------- */

/* Unit normals of the triangles, turned to the camera, also for shading until smooth ones are known. Scaled by the
 * largest component first: squares of the areas of small and large triangles leave the range of float. */
NB_CLONES static void set_sides(const nb_ray_batch *rays, const nb_hits *hits, nb_surface_batch *points)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float x = hits->normal[0][i], y = hits->normal[1][i], z = hits->normal[2][i];
        const float ax = x < 0 ? -x : x, ay = y < 0 ? -y : y, az = z < 0 ? -z : z;
        const float axy = ax > ay ? ax : ay, largest = axy > az ? axy : az;
        const float scale = 1 / largest;
        const float sx = x * scale, sy = y * scale, sz = z * scale;
        const float along = sx * rays->unit[0][i] + sy * rays->unit[1][i] + sz * rays->unit[2][i];
        const float length = sqrtf(sx * sx + sy * sy + sz * sz);
        const float unit = (along > 0 ? -1 : 1) / length;
        points->normal[0][i] = points->side[0][i] = sx * unit;
        points->normal[1][i] = points->side[1][i] = sy * unit;
        points->normal[2][i] = points->side[2][i] = sz * unit;
    }
}

/* Three numbers of each corner of a triangle. */
typedef struct nb_surface_corners {
    const float *at[3];
} nb_surface_corners;

static nb_surface_corners corners_of(const nebel_mesh *mesh, const float *numbers, uint32_t triangle)
{
    const uint32_t *index = mesh->indices + 3 * (size_t)triangle;
    return (nb_surface_corners){
        {numbers + 3 * (size_t)index[0], numbers + 3 * (size_t)index[1], numbers + 3 * (size_t)index[2]}};
}

static void set_smooth_normal(const nebel_mesh *mesh, const nb_hits *hits, int i, nb_surface_batch *points)
{
    const nb_surface_corners normal = corners_of(mesh, mesh->normals, hits->triangle[i]);
    const float u = hits->u[i], v = hits->v[i], w = 1 - u - v;
    for (int k = 0; k < 3; k++) {
        points->normal[k][i] = w * normal.at[0][k] + u * normal.at[1][k] + v * normal.at[2][k];
    }
}

static void multiply_texture(const nebel_texture *texture, const nb_srgb_table *table, const nebel_mesh *mesh,
                             const nb_hits *hits, int i, nb_surface_batch *points)
{
    const uint32_t *index = mesh->indices + 3 * (size_t)hits->triangle[i];
    const float *a = mesh->uvs + 2 * (size_t)index[0];
    const float *b = mesh->uvs + 2 * (size_t)index[1];
    const float *c = mesh->uvs + 2 * (size_t)index[2];
    const float u = hits->u[i], v = hits->v[i], w = 1 - u - v;
    float color[3];
    sample_texture(texture, table, w * a[0] + u * b[0] + v * c[0], w * a[1] + u * b[1] + v * c[1], color);
    for (int k = 0; k < 3; k++) points->reflectance[k][i] *= color[k];
}

/* What has to be fetched from the meshes. */
static void fetch(const nb_geometry *geometry, const nebel_scene_data *scene, const nb_srgb_table *table,
                  const nb_hits *hits, nb_surface_batch *points)
{
    for (int i = 0; i < NB_BATCH; i++) {
        if (hits->surface[i] == NB_NONE) continue;
        const nb_batch_surface *surface = &geometry->surfaces[hits->surface[i]];
        const nebel_mesh *mesh = surface->mesh;
        points->edge[i] = surface->longest_edge;
        if (surface->is_coarse) points->edge[i] = fminf(points->edge[i], NB_LONG_EDGE * hits->t[i]);
        for (int k = 0; k < 3; k++) points->reflectance[k][i] = mesh->base_color[k];
        if (mesh->normals != NULL) set_smooth_normal(mesh, hits, i, points);
        if (mesh->texture >= 0 && mesh->uvs != NULL) {
            multiply_texture(&scene->textures[mesh->texture], table, mesh, hits, i, points);
        }
    }
}

/* Unit length, on the side of the camera; the triangle's own where the interpolated normal is none. The interpolated
 * one alone says whether a surface faces the sun: its triangles would leave a hard line along their edges. */
NB_CLONES static void finish_normals(const float *restrict sun, nb_surface_batch *points)
{
    const float sun_x = sun[0], sun_y = sun[1], sun_z = sun[2];
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float sx = points->side[0][i], sy = points->side[1][i], sz = points->side[2][i];
        const float x = points->normal[0][i], y = points->normal[1][i], z = points->normal[2][i];
        const float length2 = x * x + y * y + z * z;
        const float scale = (x * sx + y * sy + z * sz < 0 ? -1 : 1) / sqrtf(length2);
        const int smooth = length2 > 1e-12f && length2 < 1e12f;
        const float nx = smooth ? x * scale : sx, ny = smooth ? y * scale : sy, nz = smooth ? z * scale : sz;
        const float cosine = nx * sun_x + ny * sun_y + nz * sun_z;
        points->normal[0][i] = nx;
        points->normal[1][i] = ny;
        points->normal[2][i] = nz;
        points->cosine[i] = cosine;
        const float above = sx * sun_x + sy * sun_y + sz * sun_z;
        points->lit[i] = -(cosine > 0);
        points->away[i] = -((cosine > 0) & !(above > 0));
        points->rise[i] = 0;
    }
}

/* How far the round surface that the normals stand for lies above its triangle: the heights of the corners' tangent
 * planes, in the mean that interpolates the corners. With P = sum w_i V_i that is
 *     sum w_i (V_i - P) . N_i = sum over edges w_i w_j (V_i - V_j) . (N_i - N_j).
 * After Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021, whose heights are bounded one by one. */
static float height_of_tangents(const nebel_mesh *mesh, const nb_hits *hits, int i)
{
    const nb_surface_corners place = corners_of(mesh, mesh->positions, hits->triangle[i]);
    const nb_surface_corners normal = corners_of(mesh, mesh->normals, hits->triangle[i]);
    const float u = hits->u[i], v = hits->v[i], weight[3] = {1 - u - v, u, v};
    float height = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3;
        float bend = 0;
        for (int k = 0; k < 3; k++) {
            bend += (place.at[a][k] - place.at[b][k]) * (normal.at[a][k] - normal.at[b][k]);
        }
        height += weight[a] * weight[b] * bend;
    }
    return height;
}

/* Triangles that face away from the sun where their normals do not would shade themselves: shadow rays start on the
 * round surface there. Hollow ones do shade themselves. */
static void set_rises(const nb_geometry *geometry, const nb_hits *hits, nb_surface_batch *points)
{
    for (int i = 0; i < NB_BATCH; i++) {
        if (!points->away[i] || hits->surface[i] == NB_NONE) continue;
        const nebel_mesh *mesh = geometry->surfaces[hits->surface[i]].mesh;
        if (mesh->normals == NULL) continue;
        const float *given = corners_of(mesh, mesh->normals, hits->triangle[i]).at[0];
        const float turn =
            given[0] * points->normal[0][i] + given[1] * points->normal[1][i] + given[2] * points->normal[2][i];
        const float height = height_of_tangents(mesh, hits, i);
        points->rise[i] = fmaxf(turn < 0 ? -height : height, 0);
    }
}

/* Starts of shadow rays. A hit lies off the plane of its triangle by a few rounding errors (2^-24) of the numbers that
 * went into it: the way to it, its coordinates, and the edges of the triangle. 2^-20 of their sum is on the safe side. Edges
 * that are longer yet were left out by nb_hits_refine, and are again where the shadow ray meets their triangle.
 */
NB_CLONES static void lift(const nb_ray_batch *rays, const nb_hits *hits, nb_surface_batch *points)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float t = hits->t[i];
        const float x = rays->start[0][i] + t * rays->unit[0][i];
        const float y = rays->start[1][i] + t * rays->unit[1][i];
        const float z = rays->start[2][i] + t * rays->unit[2][i];
        const float ax = x < 0 ? -x : x, ay = y < 0 ? -y : y, az = z < 0 ? -z : z;
        const float axy = ax > ay ? ax : ay, largest = axy > az ? axy : az;
        const float height = 0x1p-20f * (t + largest + points->edge[i]), rise = points->rise[i];
        const float px = x + rise * points->normal[0][i] + height * points->side[0][i];
        const float py = y + rise * points->normal[1][i] + height * points->side[1][i];
        const float pz = z + rise * points->normal[2][i] + height * points->side[2][i];
        const int hit = hits->surface[i] != NB_NONE;
        points->start[0][i] = hit ? nb_clamp_coordinate(px) : 0;
        points->start[1][i] = hit ? nb_clamp_coordinate(py) : 0;
        points->start[2][i] = hit ? nb_clamp_coordinate(pz) : 0;
        points->lit[i] = hit ? points->lit[i] : 0;
    }
}

void nb_surface_points(const nb_geometry *geometry, const nebel_scene_data *scene, const nb_srgb_table *table,
                       const nb_ray_batch *rays, const nb_hits *hits, const float sun[3], nb_surface_batch *points)
{
    set_sides(rays, hits, points);
    fetch(geometry, scene, table, hits, points);
    finish_normals(sun, points);
    set_rises(geometry, hits, points);
    lift(rays, hits, points);
}
