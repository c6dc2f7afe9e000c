#include "refine_meshes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Those of the mesh, and for each new vertex the mean of its parents; normals are made unit ones where they are used.
 */
static const float *refine(const nebel_tessellation *made, const float *given, size_t channels, float *out)
{
    const size_t before = made->input_vertex_count;
    if (given == NULL) return NULL;
    memcpy(out, given, before * channels * sizeof *out);
    for (size_t v = before; v < made->vertex_count; v++) {
        const uint32_t *const parents = made->parents[v - before];
        for (size_t c = 0; c < channels; c++)
            out[v * channels + c] = .5f * (out[parents[0] * channels + c] + out[parents[1] * channels + c]);
    }
    return out;
}

static nebel_result refine_mesh(const nebel_mesh *mesh, const nebel_tessellation *made, nebel_mesh *finer, float **room)
{
    *room = malloc((made->vertex_count + 1) * 5 * sizeof **room);
    if (*room == NULL) return NEBEL_ERROR_MEMORY;
    *finer = *mesh;
    finer->positions = made->positions[0];
    finer->normals = refine(made, mesh->normals, 3, *room);
    finer->uvs = refine(made, mesh->uvs, 2, *room + 3 * made->vertex_count);
    finer->indices = made->indices;
    finer->vertex_count = (uint32_t)made->vertex_count;
    finer->triangle_count = (uint32_t)made->triangle_count;
    return NEBEL_OK;
}

static nebel_result add_mesh(const nebel_snapshot *fog, const nebel_tessellation_desc *desc, size_t i,
                             nb_refined_scene *finer)
{
    const nebel_mesh *const mesh = &finer->data.meshes[i];
    nebel_triangles triangles = {.positions = mesh->positions,
                                 .vertex_count = mesh->vertex_count,
                                 .indices = mesh->indices,
                                 .triangle_count = mesh->triangle_count};
    for (int k = 0; k < 3; k++) triangles.origin[k] = mesh->origin[k];
    const nebel_result result = nebel_tessellate(fog, desc, &triangles, &finer->made[i]);
    if (result != NEBEL_OK) return result;
    const nebel_tessellation *const made = finer->made[i];
    finer->triangles_before += mesh->triangle_count;
    finer->triangles += made->triangle_count;
    finer->over_count += made->unresolved_count;
    finer->deepest_count += made->depth_limited_count;
    finer->error = made->error > finer->error ? made->error : finer->error;
    return refine_mesh(mesh, made, &finer->meshes[i], &finer->attributes[i]);
}

nebel_result nb_refine_make(const nebel_scene_data *scene, const nebel_snapshot *fog,
                            const nebel_tessellation_desc *desc, nb_refined_scene *finer)
{
    const size_t count = scene->mesh_count;
    *finer = (nb_refined_scene){.data = *scene};
    finer->meshes = calloc(count + 1, sizeof *finer->meshes);
    finer->made = calloc(count + 1, sizeof *finer->made);
    finer->attributes = calloc(count + 1, sizeof *finer->attributes);
    if (finer->meshes == NULL || finer->made == NULL || finer->attributes == NULL) return NEBEL_ERROR_MEMORY;
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < count && result == NEBEL_OK; i++) result = add_mesh(fog, desc, i, finer);
    finer->data.meshes = finer->meshes;
    return result;
}

void nb_refine_light(nb_refined_scene *finer, const nebel_scene_data *scene)
{
    memcpy(finer->data.sun_direction, scene->sun_direction, sizeof scene->sun_direction);
    memcpy(finer->data.sun_irradiance, scene->sun_irradiance, sizeof scene->sun_irradiance);
    finer->data.environment = scene->environment;
}

static int is_unproven(const nebel_scene *scene, double frame, size_t count)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_tessellation *made = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_get_scene_volume(scene, i, frame);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK)
        result = nebel_tessellate(snapshot, &(nebel_tessellation_desc){.max_depth = 1}, &(nebel_triangles){0}, &made);
    nebel_destroy_tessellation(made);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return result == NEBEL_ERROR_UNSUPPORTED;
}

/* By halves, because no volume proves anything of those before it. */
size_t nb_refine_find_unproven(const nebel_scene *scene, double frame)
{
    size_t proven = 0, count = nebel_get_scene_data(scene)->volume_count + 1;
    while (count - proven > 1) {
        const size_t middle = proven + (count - proven) / 2;
        *(is_unproven(scene, frame, middle) ? &count : &proven) = middle;
    }
    return proven;
}

void nb_refine_free(nb_refined_scene *finer)
{
    for (size_t i = 0; i < finer->data.mesh_count; i++) {
        if (finer->made != NULL) nebel_destroy_tessellation(finer->made[i]);
        if (finer->attributes != NULL) free(finer->attributes[i]);
    }
    free(finer->meshes);
    free(finer->made);
    free(finer->attributes);
    *finer = (nb_refined_scene){.triangles = 0};
}

static double edge_of(const nebel_mesh *mesh, uint32_t a, uint32_t b)
{
    double square = 0;
    for (size_t k = 0; k < 3; k++) {
        const double way = (double)mesh->positions[3 * (size_t)b + k] - (double)mesh->positions[3 * (size_t)a + k];
        square += way * way;
    }
    return sqrt(square);
}

double nb_refine_find_longest_edge(const nebel_scene_data *scene)
{
    double longest = 0;
    for (size_t i = 0; i < scene->mesh_count; i++) {
        const nebel_mesh *const mesh = &scene->meshes[i];
        for (size_t t = 0; t < mesh->triangle_count; t++)
            for (size_t k = 0; k < 3; k++)
                longest = fmax(longest, edge_of(mesh, mesh->indices[3 * t + k], mesh->indices[3 * t + (k + 1) % 3]));
    }
    return longest;
}
