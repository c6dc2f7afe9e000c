/* The vertices of a model as places: what a nebula is distributed on. */
#include "assimp_builder.h"
#include "assimp_load.h"

#include <math.h>

static bool place_point(const nb_assimp *in, const struct aiVector3D *v, const nb_affine *place, double point[3])
{
    bool finite = true;
    for (int i = 0; i < 3; i++) {
        const double *row = place->m[i];
        point[i] = row[0] * (double)v->x + row[1] * (double)v->y + row[2] * (double)v->z + row[3] +
                   in->load->source->position[i];
        finite = finite && isfinite(point[i]);
    }
    return finite;
}

static nebel_result reserve_points(const nb_assimp *in, size_t more)
{
    const nb_model_load *load = in->load;
    nb_point_set *points = load->points;
    void *places = points->places;
    if (more > points->limit - points->count)
        return nb_model_fail(load, NEBEL_ERROR_LIMIT, "\"%s\" has more than %zu vertices, the most there may be",
                             load->source->file, points->limit);
    const bool room = nb_grow(&load->allocator, &places, sizeof *points->places, points->count, &points->capacity,
                              points->count + more);
    points->places = places;
    return room ? NEBEL_OK : nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
}

/* first[i] is the first vertex at the place of vertex i: some formats repeat a vertex for each of its triangles. */
static nebel_result add_distinct(nb_assimp *in, const struct aiMesh *mesh, const nb_affine *place,
                                 const uint32_t *first)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < mesh->mNumVertices; i++) count += first[i] == i;
    const nebel_result result = reserve_points(in, count);
    if (result != NEBEL_OK) return result;
    nb_point_set *points = in->load->points;
    for (uint32_t i = 0; i < mesh->mNumVertices; i++) {
        if (first[i] != i) continue;
        if (place_point(in, &mesh->mVertices[i], place, points->places[points->count]))
            points->count++;
        else
            in->left_out_points++;
    }
    return NEBEL_OK;
}

nebel_result nb_assimp_add_points(nb_assimp *in, const struct aiMesh *mesh, const nb_affine *place)
{
    const nb_model_load *load = in->load;
    const nb_weld_mesh draft = {
        .allocator = load->allocator, .positions = mesh->mVertices, .given_count = mesh->mNumVertices};
    if (mesh->mVertices == NULL || mesh->mNumVertices == 0) return NEBEL_OK;
    uint32_t *first = nb_allocate(&load->allocator, mesh->mNumVertices, sizeof *first);
    if (first == NULL || !nb_draft_find_like(&draft, NB_LIKE_POSITION, 0, mesh->mNumVertices, first)) {
        nb_release(&load->allocator, first);
        return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    }
    const nebel_result result = add_distinct(in, mesh, place, first);
    nb_release(&load->allocator, first);
    return result;
}
