/* What Assimp 5.2 does not survive, looked at before it does: it reads an unfinished PLY header for ever, and stops the
 * process where its own post-processing meets faces that cannot be. */
#include "scene/assimp_load.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A PLY header longer than this is not believed. */
enum { HEADER_SIZE = 1 << 16 };

nebel_result nb_assimp_check_file(const nb_model_load *load)
{
    static const char end[] = "end_header";
    const char *file = load->source->file;
    char *header = nb_allocate(&load->allocator, HEADER_SIZE, 1);
    FILE *stream = header != NULL ? fopen(file, "rb") : NULL;
    const size_t size = stream != NULL ? fread(header, 1, HEADER_SIZE, stream) : 0;
    bool good = header != NULL && (size < 3 || (memcmp(header, "ply", 3) != 0 && memcmp(header, "PLY", 3) != 0));
    for (size_t i = 0; !good && i + sizeof end - 1 <= size; i++) good = memcmp(header + i, end, sizeof end - 1) == 0;
    if (stream != NULL) fclose(stream);
    nb_release(&load->allocator, header);
    if (header == NULL) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    if (good) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: its header does not end", file);
}

static bool is_finite(const struct aiVector3D *v)
{
    return isfinite(v->x) && isfinite(v->y) && isfinite(v->z);
}

/* A face with a corner that is not a number shrinks to a point, which is left out later. False where a corner does not
 * exist. */
static bool check_face(nb_assimp *in, const struct aiMesh *mesh, const struct aiFace *face)
{
    bool finite = true;
    for (unsigned k = 0; k < face->mNumIndices; k++) {
        if (face->mIndices[k] >= mesh->mNumVertices) return false;
        finite = finite && is_finite(&mesh->mVertices[face->mIndices[k]]);
    }
    for (unsigned k = 1; k < face->mNumIndices && !finite; k++) face->mIndices[k] = face->mIndices[0];
    in->left_out_triangles += finite ? 0 : 1;
    return face->mNumIndices > 0;
}

static unsigned primitive_type(unsigned corner_count)
{
    static const unsigned types[] = {aiPrimitiveType_POINT, aiPrimitiveType_LINE, aiPrimitiveType_TRIANGLE};
    return corner_count <= 3 ? types[corner_count - 1] : aiPrimitiveType_POLYGON;
}

/* Also tells Assimp which kinds of faces there are, since some of its readers miscount. */
static bool check_mesh(nb_assimp *in, struct aiMesh *mesh)
{
    mesh->mPrimitiveTypes = 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        if (!check_face(in, mesh, &mesh->mFaces[i])) return false;
        mesh->mPrimitiveTypes |= primitive_type(mesh->mFaces[i].mNumIndices);
    }
    for (unsigned i = 0; i < mesh->mNumVertices; i++)
        if (!is_finite(&mesh->mVertices[i])) mesh->mVertices[i] = (struct aiVector3D){0, 0, 0};
    return true;
}

nebel_result nb_assimp_check_meshes(nb_assimp *in, const struct aiScene *scene)
{
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        if (!check_mesh(in, scene->mMeshes[i]))
            return nb_model_fail(in->load, NEBEL_ERROR_FORMAT,
                                 "the model \"%s\" cannot be read: a face has no corners, or one that does not exist",
                                 in->load->source->file);
    return NEBEL_OK;
}
