#include "occluders.h"

#include "math/vector.h"

#include <math.h>

static void turn_corner(const double axes[3][3], const float *position, float corner[3])
{
    const double p[3] = {(double)position[0], (double)position[1], (double)position[2]};
    for (int i = 0; i < 3; i++) corner[i] = (float)nb_vector_dot(axes[i], p);
}

double nb_caster_area(const nb_occluder *t)
{
    const double bx = (double)t->corner[1][0] - (double)t->corner[0][0];
    const double by = (double)t->corner[1][1] - (double)t->corner[0][1];
    const double cx = (double)t->corner[2][0] - (double)t->corner[0][0];
    const double cy = (double)t->corner[2][1] - (double)t->corner[0][1];
    return bx * cy - by * cx;
}

/* The gradient of texture coordinates in the plane of the corners: of all that change along two edges as they do, the one
 * that does not change across the plane. Seen by the sun corners lie at one height. */
static nb_masked_occluder make_sheet(const nb_batch_surface *surface, const uint32_t *index, const nb_occluder *t,
                                     int is_for_sun)
{
    nb_masked_occluder sheet = {.mask = surface->mask};
    double edge[2][3], normal[3], across[2][3], texels[3][2];
    for (int k = 0; k < 3; k++) {
        const float *uv = surface->mesh->uvs + 2 * (size_t)index[k];
        texels[k][0] = isfinite(uv[0]) ? (double)uv[0] * surface->mask->width : 0;
        texels[k][1] = isfinite(uv[1]) ? (double)uv[1] * surface->mask->height : 0;
    }
    for (int i = 0; i < 3; i++) {
        const int counts = i < 2 || !is_for_sun;
        sheet.place[i] = counts ? (double)t->corner[0][i] : 0;
        for (int k = 0; k < 2; k++) edge[k][i] = counts ? (double)t->corner[k + 1][i] - (double)t->corner[0][i] : 0;
    }
    nb_vector_cross(edge[0], edge[1], normal);
    nb_vector_cross(edge[1], normal, across[0]);
    nb_vector_cross(normal, edge[0], across[1]);
    const double square = nb_vector_dot(normal, normal);
    for (int c = 0; c < 2; c++) {
        sheet.at[c] = texels[0][c];
        for (int i = 0; i < 3 && square > 0; i++)
            sheet.slope[c][i] =
                ((texels[1][c] - texels[0][c]) * across[0][i] + (texels[2][c] - texels[0][c]) * across[1][i]) / square;
    }
    return sheet;
}

static void fill_occluders(const nb_geometry *geometry, const double axes[3][3], int is_for_sun, nb_occluders *casters)
{
    uint32_t sheet_count = 0;
    for (size_t s = 0; s < geometry->surface_count; s++) {
        const nb_batch_surface *surface = &geometry->surfaces[s];
        for (size_t t = 0; t < surface->mesh->triangle_count; t++) {
            const uint32_t *index = surface->mesh->indices + 3 * t;
            nb_occluder *triangle = &casters->triangles[casters->count];
            for (int k = 0; k < 3; k++)
                turn_corner(axes, surface->positions + 3 * (size_t)index[k], triangle->corner[k]);
            const double area = nb_caster_area(triangle);
            const float depth = triangle->corner[0][2] + triangle->corner[1][2] + triangle->corner[2][2];
            if ((area == 0 && is_for_sun) || !isfinite(area) || !isfinite(depth)) continue;
            if (surface->mask != NULL) casters->sheets[sheet_count] = make_sheet(surface, index, triangle, is_for_sun);
            if (casters->numbers != NULL)
                casters->numbers[casters->count] = surface->mask != NULL ? sheet_count++ : NB_NONE;
            casters->count++;
        }
    }
}

nebel_result nb_occluders_list(const nb_geometry *geometry, const double axes[3][3], int is_for_sun,
                               nb_occluders *casters)
{
    const nebel_allocator *allocator = &geometry->allocator;
    size_t count = 0, holed = 0;
    for (size_t s = 0; s < geometry->surface_count; s++) {
        const size_t triangles = geometry->surfaces[s].mesh->triangle_count;
        count += triangles;
        holed += geometry->surfaces[s].mask != NULL ? triangles : 0;
    }
    *casters = (nb_occluders){.triangles = nb_allocate(allocator, count + 1, sizeof *casters->triangles)};
    if (casters->triangles == NULL) return NEBEL_ERROR_MEMORY;
    if (holed > 0) {
        casters->numbers = nb_allocate(allocator, count, sizeof *casters->numbers);
        casters->sheets = nb_allocate(allocator, holed, sizeof *casters->sheets);
        if (casters->numbers == NULL || casters->sheets == NULL) return NEBEL_ERROR_MEMORY;
    }
    fill_occluders(geometry, axes, is_for_sun, casters);
    return NEBEL_OK;
}

void nb_occluders_free(nb_occluders *casters, const nebel_allocator *allocator)
{
    nb_release(allocator, casters->triangles);
    nb_release(allocator, casters->numbers);
    nb_release(allocator, casters->sheets);
    *casters = (nb_occluders){.count = 0};
}

void nb_shadow_plane(const double normal[3], const double point[3], float plane[4])
{
    const double *n = normal, largest = fmax(fmax(fabs(n[0]), fabs(n[1])), fabs(n[2]));
    const double scale = largest > 0 ? 1 / largest : 0;
    for (int i = 0; i < 3; i++) plane[i] = (float)(n[i] * scale);
    plane[3] = (float)-(nb_vector_dot(n, point) * scale);
}
