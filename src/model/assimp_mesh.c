#include "assimp_builder.h"
#include "assimp_load.h"

#include <math.h>
#include <string.h>

typedef struct nb_mesh_builder {
    nb_assimp *in;
    nb_weld_mesh draft;
    nb_affine place;
    double normal_matrix[3][3];
    bool mirrored;
} nb_mesh_builder;

/* Normals turn by the inverse of the transpose. Its direction is that of the cofactors, with the determinant's sign;
 * they exist also where a node is flattened. */
static void find_normal_matrix(nb_mesh_builder *out)
{
    const double(*m)[4] = (const double(*)[4])out->place.m;
    double determinant = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            out->normal_matrix[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
    for (int j = 0; j < 3; j++) determinant += m[0][j] * out->normal_matrix[0][j];
    out->mirrored = determinant < 0;
    for (int i = 0; i < 3 && out->mirrored; i++)
        for (int j = 0; j < 3; j++) out->normal_matrix[i][j] = -out->normal_matrix[i][j];
}

static void place_position(const nb_mesh_builder *out, const struct aiVector3D *v, float *position)
{
    for (int i = 0; i < 3; i++) {
        const double *row = out->place.m[i];
        position[i] = (float)(row[0] * (double)v->x + row[1] * (double)v->y + row[2] * (double)v->z + row[3]);
    }
}

static void store_unit(double vector[3], float *result)
{
    nb_vector_normalize(vector, 3);
    for (int i = 0; i < 3; i++) result[i] = (float)vector[i];
}

/* Leaves 0 where there is no direction. */
static void place_normal(const nb_mesh_builder *out, const struct aiVector3D *n, float *normal)
{
    double turned[3];
    for (int i = 0; i < 3; i++) {
        const double *row = out->normal_matrix[i];
        turned[i] = row[0] * (double)n->x + row[1] * (double)n->y + row[2] * (double)n->z;
        if (!isfinite(turned[i])) {
            memset(normal, 0, 3 * sizeof *normal);
            return;
        }
    }
    store_unit(turned, normal);
}

/* Vertex i of the mesh is vertex kept[i] of the draft; without `kept`, i. */
static uint32_t number_in_draft(const uint32_t *kept, uint32_t i)
{
    return kept != NULL ? kept[i] : i;
}

static void place_mesh_vertices(const nb_mesh_builder *out, const uint32_t *kept, nebel_mesh *mesh)
{
    const nb_weld_mesh *draft = &out->draft;
    float *positions = (float *)mesh->positions, *normals = (float *)mesh->normals;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        const uint32_t vertex = number_in_draft(kept, i);
        place_position(out, &draft->positions[nb_draft_origin(draft, vertex)], positions + 3 * (size_t)i);
        place_normal(out, &draft->normals[vertex], normals + 3 * (size_t)i);
    }
}

static void map_uv(const double map[2][3], float uv[2])
{
    const double u = (double)uv[0], v = (double)uv[1];
    for (int i = 0; i < 2; i++) {
        const float mapped = (float)(map[i][0] * u + map[i][1] * v + map[i][2]);
        uv[i] = isfinite(mapped) ? mapped : 0;
    }
}

static void place_uvs(const nb_weld_mesh *draft, const nb_assimp_surface *surface, const uint32_t *kept,
                      nebel_mesh *mesh)
{
    float *uvs = (float *)mesh->uvs;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        const struct aiVector3D *uv = &draft->uvs[nb_draft_origin(draft, number_in_draft(kept, i))];
        uvs[2 * (size_t)i] = isfinite(uv->x) ? uv->x : 0;
        uvs[2 * (size_t)i + 1] = isfinite(uv->y) ? 1 - uv->y : 0; /* Assimp counts from the bottom */
        if (surface->has_uv_map) map_uv(surface->uv_map, uvs + 2 * (size_t)i);
    }
}

static bool is_finite_place(const float *v)
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static bool is_same(const float *a, const float *b)
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* A mirror turns triangles inside out; two corners change places to undo it. Triangles with two corners at one place
 * are left out, and those with a corner that was taken beyond the floats. */
static void place_mesh_triangles(const nb_mesh_builder *out, nebel_mesh *mesh)
{
    uint32_t *indices = (uint32_t *)mesh->indices, count = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t corner[3] = {indices[3 * i], indices[3 * i + (out->mirrored ? 2 : 1)],
                                    indices[3 * i + (out->mirrored ? 1 : 2)]};
        const float *p[3];
        for (int k = 0; k < 3; k++) p[k] = mesh->positions + 3 * (size_t)corner[k];
        if (!is_finite_place(p[0]) || !is_finite_place(p[1]) || !is_finite_place(p[2]))
            out->in->left_out_triangles++;
        else if (!is_same(p[0], p[1]) && !is_same(p[1], p[2]) && !is_same(p[2], p[0]))
            memcpy(indices + 3 * (size_t)count++, corner, sizeof corner);
    }
    mesh->triangle_count = count;
}

/* No triangle uses them any more. */
static void clear_broken_positions(nebel_mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        float *position = (float *)mesh->positions + 3 * i;
        if (!is_finite_place(position)) memset(position, 0, 3 * sizeof *position);
    }
}

static void find_face_normal(const nebel_mesh *mesh, const uint32_t *corner, float *normal)
{
    double edges[2][3], product[3];
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < 3; i++)
            edges[e][i] = (double)mesh->positions[3 * (size_t)corner[e + 1] + (size_t)i] -
                          (double)mesh->positions[3 * (size_t)corner[0] + (size_t)i];
    for (int i = 0; i < 3; i++)
        product[i] = edges[0][(i + 1) % 3] * edges[1][(i + 2) % 3] - edges[0][(i + 2) % 3] * edges[1][(i + 1) % 3];
    if (product[0] == 0 && product[1] == 0 && product[2] == 0) product[1] = 1;
    store_unit(product, normal);
}

/* A normal that is missing or no direction becomes that of a triangle it belongs to; where that has none either, up. */
static void mend_normals(nebel_mesh *mesh)
{
    float *normals = (float *)mesh->normals;
    for (size_t i = 0; i < 3 * (size_t)mesh->triangle_count; i++) {
        float *normal = normals + 3 * (size_t)mesh->indices[i];
        if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
            find_face_normal(mesh, mesh->indices + i / 3 * 3, normal);
    }
}

static bool is_triangle(const struct aiMesh *mesh, const struct aiFace *face)
{
    bool good = face->mNumIndices == 3;
    for (int k = 0; k < 3 && good; k++) good = face->mIndices[k] < mesh->mNumVertices;
    return good;
}

static uint32_t count_triangles(nb_assimp *in, const struct aiMesh *mesh)
{
    uint32_t count = 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        if (is_triangle(mesh, &mesh->mFaces[i]))
            count++;
        else
            in->left_out_faces++;
    }
    return count;
}

static const struct aiVector3D *find_uvs(nb_assimp *in, const struct aiMesh *mesh, nb_assimp_surface *surface)
{
    const bool wanted = surface->texture >= 0 || surface->mask >= 0;
    const struct aiVector3D *uvs =
        wanted && surface->uv_index < AI_MAX_NUMBER_OF_TEXTURECOORDS ? mesh->mTextureCoords[surface->uv_index] : NULL;
    if (uvs != NULL) return uvs;
    in->left_out_masks += surface->mask >= 0;
    surface->texture = surface->mask = -1;
    surface->alpha_cutoff = 0;
    return NULL;
}

static void collect_triangles(const struct aiMesh *mesh, uint32_t *corner)
{
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *face = &mesh->mFaces[i];
        for (int k = 0; k < 3 && is_triangle(mesh, face); k++) *corner++ = face->mIndices[k];
    }
}

/* Makes normals where there are none. Then joins vertices: all where no two triangles have one in common, otherwise the
 * copies that sharp edges made. */
static bool find_vertices(nb_weld_mesh *draft, uint32_t **kept, uint32_t *count)
{
    *count = draft->given_count;
    if (draft->normals == NULL && !nb_draft_smooth(draft)) return false;
    const bool is_indexed = draft->given_count < 3 * (uint64_t)draft->triangle_count;
    if (is_indexed && draft->copy_count == 0) return true;
    return nb_draft_join(draft, is_indexed ? draft->given_count : 0, kept, count);
}

static void fill(const nb_mesh_builder *out, const nb_assimp_surface *surface, const uint32_t *kept, nebel_mesh *mesh)
{
    place_mesh_vertices(out, kept, mesh);
    if (out->draft.uvs != NULL) place_uvs(&out->draft, surface, kept, mesh);
    place_mesh_triangles(out, mesh);
    clear_broken_positions(mesh);
    mend_normals(mesh);
    mesh->texture = surface->texture;
    mesh->mask = surface->mask;
    mesh->alpha_cutoff = surface->alpha_cutoff;
    for (int i = 0; i < 3; i++) {
        mesh->base_color[i] = surface->base_color[i];
        mesh->origin[i] = out->in->load->source->position[i];
    }
}

static bool build_mesh(nb_mesh_builder *out, const struct aiMesh *source, const nb_assimp_surface *surface,
                       nebel_mesh *mesh)
{
    nb_weld_mesh *draft = &out->draft;
    uint32_t *kept = NULL, vertex_count = 0;
    draft->corners = nb_allocate(&draft->allocator, draft->triangle_count, 3 * sizeof *draft->corners);
    if (draft->corners == NULL) return false;
    *mesh = (nebel_mesh){.indices = draft->corners, .triangle_count = draft->triangle_count};
    collect_triangles(source, draft->corners);
    const bool good = find_vertices(draft, &kept, &vertex_count) &&
                      nb_mesh_allocate_vertices(&draft->allocator, vertex_count, draft->uvs != NULL, mesh);
    if (good)
        fill(out, surface, kept, mesh);
    else
        nb_mesh_release(&draft->allocator, mesh);
    nb_release(&draft->allocator, kept);
    nb_release(&draft->allocator, draft->copied);
    nb_release(&draft->allocator, draft->made_normals);
    return good;
}

nebel_result nb_assimp_add_mesh(nb_assimp *in, const struct aiMesh *source, const nb_affine *place)
{
    const nb_model_load *load = in->load;
    nb_assimp_surface surface;
    nebel_mesh mesh;
    const uint32_t triangle_count = count_triangles(in, source);
    if (triangle_count == 0 || source->mVertices == NULL) return NEBEL_OK;
    if (triangle_count > NB_MAX_TRIANGLES) return nb_model_refuse_triangles(load);
    nebel_result result = nb_model_check_room(load, nb_mesh_bytes(0, false, triangle_count));
    if (result == NEBEL_OK) result = nb_assimp_find_surface(in, source->mMaterialIndex, &surface);
    if (result != NEBEL_OK) return result;
    in->left_out_clear += surface.is_clear;
    if (surface.is_clear) return NEBEL_OK;
    nb_mesh_builder out = {.in = in,
                           .draft = {.allocator = load->allocator,
                                     .positions = source->mVertices,
                                     .normals = source->mNormals,
                                     .uvs = find_uvs(in, source, &surface),
                                     .given_count = source->mNumVertices,
                                     .triangle_count = triangle_count},
                           .place = *place};
    find_normal_matrix(&out);
    if (!build_mesh(&out, source, &surface, &mesh)) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    if (mesh.triangle_count > 0) return nb_model_add_mesh(load, &mesh);
    nb_mesh_release(&load->allocator, &mesh);
    return NEBEL_OK;
}
