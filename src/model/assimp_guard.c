#define _POSIX_C_SOURCE 200809L
/* What Assimp 5.2 does not survive, looked at before it does: it reads an unfinished PLY header for ever, and stops the
 * process where its own post-processing meets faces that cannot be. And what it says too little about. */
#include "assimp_load.h"
#include "gltf.h"
#include "file/path.h"

#include <assimp/cimport.h>

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- the file before it is read -------------------------------------------------------------- */

/* A PLY header longer than this is not believed. */
enum { HEAD_SIZE = 1 << 16 };

typedef struct file_head {
    unsigned char *bytes;
    size_t size;
    unsigned long long file_size;
} file_head;

static nebel_result read_head(const nb_model_load *load, file_head *head)
{
    FILE *stream = nb_file_open_stream(&load->log, load->source->where, "model", load->source->file);
    if (stream == NULL) return NEBEL_ERROR_FILE;
    head->size = fread(head->bytes, 1, HEAD_SIZE, stream);
    const long end = fseek(stream, 0, SEEK_END) == 0 ? ftell(stream) : -1;
    head->file_size = end >= 0 ? (unsigned long long)end : head->size;
    fclose(stream);
    return NEBEL_OK;
}

static bool begins_with(const file_head *head, const char *magic)
{
    return head->size >= strlen(magic) && memcmp(head->bytes, magic, strlen(magic)) == 0;
}

static nebel_result check_ply(const nb_model_load *load, const file_head *head)
{
    static const char end[] = "end_header";
    for (size_t i = 0; i + sizeof end - 1 <= head->size; i++)
        if (memcmp(head->bytes + i, end, sizeof end - 1) == 0) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                         "the model \"%s\" begins like PLY, but its header does not end; is the file complete?",
                         load->source->file);
}

/* "" where there is none. */
static const char *suffix_of(const char *file)
{
    const char *dot = strrchr(nb_path_name(file), '.');
    return dot != NULL ? dot : "";
}

/* Assimp takes a file for binary glTF by its name alone, and one that is cut short for no model at all. */
static nebel_result check_glb(const nb_model_load *load, const file_head *head)
{
    const char *file = load->source->file;
    if (head->size < NB_GLB_HEADER)
        return nb_model_fail(
            load, NEBEL_ERROR_FORMAT,
            "the model \"%s\" begins like binary glTF, but ends after %zu bytes, inside its header; copy "
            "or export it again",
            file, head->size);
    const unsigned long long version = nb_gltf_word(head->bytes + 4), length = nb_gltf_word(head->bytes + 8);
    if (version < 1 || version > 2)
        return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                             "the model \"%s\" begins like binary glTF, but of version %llu; versions 1 and 2 are read",
                             file, version);
    if (length > head->file_size)
        return nb_model_fail(
            load, NEBEL_ERROR_FORMAT,
            "the model \"%s\" is cut short: its glTF header announces %llu bytes, %llu are missing; copy "
            "or export it again",
            file, length, length - head->file_size);
    if (strcasecmp(suffix_of(file), ".glb") == 0) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" is binary glTF; give it a name that ends in .glb",
                         file);
}

static nebel_result check_file_head(const nb_model_load *load, const file_head *head)
{
    if (head->file_size == 0)
        return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" is empty; copy or export it again",
                             load->source->file);
    if (begins_with(head, "ply") || begins_with(head, "PLY")) return check_ply(load, head);
    if (begins_with(head, "glTF")) return check_glb(load, head);
    if (strcasecmp(suffix_of(load->source->file), ".glb") != 0) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                         "the model \"%s\" is called .glb, but is no binary glTF; copy or export it again",
                         load->source->file);
}

nebel_result nb_assimp_check_file(const nb_model_load *load)
{
    file_head head = {.bytes = nb_allocate(&load->allocator, HEAD_SIZE, 1)};
    if (head.bytes == NULL) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    nebel_result result = read_head(load, &head);
    if (result == NEBEL_OK) result = check_file_head(load, &head);
    nb_release(&load->allocator, head.bytes);
    return result;
}

/* ---- what went wrong when it was read -------------------------------------------------------- */

nebel_result nb_assimp_refuse(const nb_assimp *in, const char *reason)
{
    static const char unknown[] = "No suitable reader";
    const nb_model_load *load = in->load;
    const char *file = load->source->file, *suffix = suffix_of(file);
    if (reason == NULL || reason[0] == '\0') reason = "its parts contradict each other";
    if (strstr(reason, "bad_alloc") != NULL) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    if (in->files.refusal != NB_REFUSAL_NONE)
        return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: it names \"%s\", which %s",
                             file, in->files.refused, nb_model_files_refusal_text(in->files.refusal));
    if (in->made.fault[0] != '\0')
        return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: %s", file, in->made.fault);
    size_t size = strlen(reason);
    while (size > 0 && (reason[size - 1] == '.' || reason[size - 1] == '\n')) size--;
    if (strncmp(reason, unknown, sizeof unknown - 1) != 0)
        return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: %.*s; is it complete?", file,
                             size < 512 ? (int)size : 512, reason);
    if (suffix[0] != '\0' && aiIsExtensionSupported(suffix) == AI_TRUE)
        return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                             "the model \"%s\" cannot be read: its content is not what %s in its name promises; is it "
                             "complete?",
                             file, suffix);
    return nb_model_fail(
        load, NEBEL_ERROR_FORMAT,
        "the model \"%s\" cannot be read: neither its name nor its content tells a known format; names "
        "may end in .glb, .gltf, .obj, .ply, .stl, .fbx, .dae, .3ds and others",
        file);
}

/* ---- the meshes before they are worked on ---------------------------------------------------- */

static bool is_finite_vector(const struct aiVector3D *v)
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
        finite = finite && is_finite_vector(&mesh->mVertices[face->mIndices[k]]);
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
static bool check_assimp_mesh(nb_assimp *in, struct aiMesh *mesh)
{
    mesh->mPrimitiveTypes = 0;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        if (!check_face(in, mesh, &mesh->mFaces[i])) return false;
        mesh->mPrimitiveTypes |= primitive_type(mesh->mFaces[i].mNumIndices);
    }
    for (unsigned i = 0; i < mesh->mNumVertices; i++)
        if (!is_finite_vector(&mesh->mVertices[i])) mesh->mVertices[i] = (struct aiVector3D){0, 0, 0};
    return true;
}

nebel_result nb_assimp_check_meshes(nb_assimp *in, const struct aiScene *scene)
{
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        if (!check_assimp_mesh(in, scene->mMeshes[i]))
            return nb_model_fail(in->load, NEBEL_ERROR_FORMAT,
                                 "the model \"%s\" cannot be read: a face has no corners, or one that does not exist",
                                 in->load->source->file);
    return NEBEL_OK;
}
