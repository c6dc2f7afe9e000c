#include "scene/assimp_load.h"

#include <math.h>
#include <string.h>

typedef struct builder {
    nb_assimp *in;
    const struct aiMesh *mesh;
    nb_affine place;
    double normal_matrix[3][3];
    bool mirrored;
    bool *bad; /* vertices that are not numbers */
} builder;

/* Normals turn by the inverse of the transpose. Its direction is that of the cofactors, with the determinant's sign;
 * they exist also where a node is flattened. */
static void find_normal_matrix(builder *out)
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

static bool place_position(const builder *out, const struct aiVector3D *v, float *position)
{
    for (int i = 0; i < 3; i++) {
        const double *row = out->place.m[i];
        position[i] = (float)(row[0] * (double)v->x + row[1] * (double)v->y + row[2] * (double)v->z + row[3]);
    }
    if (isfinite(position[0]) && isfinite(position[1]) && isfinite(position[2])) return true;
    memset(position, 0, 3 * sizeof *position);
    return false;
}

static void store_unit(double vector[3], float *result)
{
    nb_vector_normalize(vector, 3);
    for (int i = 0; i < 3; i++) result[i] = (float)vector[i];
}

/* Leaves 0 where there is no direction. */
static void place_normal(const builder *out, const struct aiVector3D *n, float *normal)
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

static void place_vertices(const builder *out, nebel_mesh *mesh)
{
    float *positions = (float *)mesh->positions, *normals = (float *)mesh->normals;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        out->bad[i] = !place_position(out, &out->mesh->mVertices[i], positions + 3 * (size_t)i);
        if (out->mesh->mNormals != NULL)
            place_normal(out, &out->mesh->mNormals[i], normals + 3 * (size_t)i);
        else
            memset(normals + 3 * (size_t)i, 0, 3 * sizeof *normals);
    }
}

static void place_uvs(const struct aiVector3D *source, nebel_mesh *mesh)
{
    float *uvs = (float *)mesh->uvs;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        uvs[2 * (size_t)i] = isfinite(source[i].x) ? source[i].x : 0;
        uvs[2 * (size_t)i + 1] = isfinite(source[i].y) ? source[i].y : 0;
    }
}

/* A mirror turns triangles inside out; two corners change places to undo it. Triangles without an area are left out. */
static void place_triangles(const builder *out, nebel_mesh *mesh)
{
    uint32_t *indices = (uint32_t *)mesh->indices;
    mesh->triangle_count = 0;
    for (unsigned i = 0; i < out->mesh->mNumFaces; i++) {
        const struct aiFace *face = &out->mesh->mFaces[i];
        bool good = true;
        if (face->mNumIndices != 3) continue;
        for (int k = 0; k < 3; k++)
            good = good && face->mIndices[k] < mesh->vertex_count && !out->bad[face->mIndices[k]];
        if (face->mIndices[0] == face->mIndices[1] || face->mIndices[1] == face->mIndices[2]) continue;
        if (!good) {
            out->in->left_out_triangles++;
            continue;
        }
        uint32_t *corner = indices + 3 * (size_t)mesh->triangle_count++;
        corner[0] = face->mIndices[0];
        corner[1] = face->mIndices[out->mirrored ? 2 : 1];
        corner[2] = face->mIndices[out->mirrored ? 1 : 2];
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

static uint32_t count_triangles(nb_assimp *in, const struct aiMesh *mesh)
{
    uint32_t count = 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        if (mesh->mFaces[i].mNumIndices == 3)
            count++;
        else
            in->left_out_faces++;
    }
    return count;
}

static const struct aiVector3D *find_uvs(const struct aiMesh *mesh, nb_surface *surface)
{
    const struct aiVector3D *uvs = surface->texture >= 0 && surface->uv_index < AI_MAX_NUMBER_OF_TEXTURECOORDS
                                       ? mesh->mTextureCoords[surface->uv_index]
                                       : NULL;
    if (uvs == NULL) surface->texture = -1;
    return uvs;
}

static void fill(const builder *out, const nb_surface *surface, const struct aiVector3D *uvs, nebel_mesh *mesh)
{
    place_vertices(out, mesh);
    place_triangles(out, mesh);
    mend_normals(mesh);
    if (uvs != NULL) place_uvs(uvs, mesh);
    mesh->texture = surface->texture;
    for (int i = 0; i < 3; i++) {
        mesh->base_color[i] = surface->base_color[i];
        mesh->origin[i] = out->in->load->source->position[i];
    }
}

nebel_result nb_assimp_add_mesh(nb_assimp *in, const struct aiMesh *source, const nb_affine *place)
{
    const nebel_allocator *allocator = &in->load->allocator;
    builder out = {.in = in, .mesh = source, .place = *place};
    nb_surface surface;
    nebel_mesh mesh;
    const uint32_t triangle_count = count_triangles(in, source);
    if (triangle_count == 0 || source->mVertices == NULL) return NEBEL_OK;
    const nebel_result result = nb_assimp_find_surface(in, source->mMaterialIndex, &surface);
    if (result != NEBEL_OK) return result;
    const struct aiVector3D *uvs = find_uvs(source, &surface);
    out.bad = nb_allocate(allocator, source->mNumVertices, sizeof *out.bad);
    if (out.bad == NULL || !nb_mesh_allocate(allocator, source->mNumVertices, triangle_count, uvs != NULL, &mesh)) {
        nb_release(allocator, out.bad);
        return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    }
    find_normal_matrix(&out);
    fill(&out, &surface, uvs, &mesh);
    nb_release(allocator, out.bad);
    if (mesh.triangle_count > 0) return nb_model_add_mesh(in->load, &mesh);
    nb_mesh_release(allocator, &mesh);
    return NEBEL_OK;
}
