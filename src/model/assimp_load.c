#include "assimp_load.h"
#include "gltf.h"
#include "file/path.h"

#include <assimp/cimport.h>
#include <assimp/postprocess.h>

#include <threads.h>

/* Nodes seen but not yet visited; larger scene graphs are refused. */
enum { MAX_NODES_WAITING = 1 << 20 };

/* Assimp keeps the reason of the last failure in one place for all threads: imports go one after the other. */
static once_flag import_once = ONCE_FLAG_INIT;
static mtx_t import_lock;

static void prepare_lock(void)
{
    mtx_init(&import_lock, mtx_plain);
}

/* ---- import ---------------------------------------------------------------------------------- */

static bool has_polygons(const struct aiScene *scene)
{
    bool found = false;
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        found = found || (scene->mMeshes[i]->mPrimitiveTypes & aiPrimitiveType_POLYGON) != 0;
    return found;
}

/* Points need no faces, which validation asks for. */
static nebel_result import_points(nb_assimp *in)
{
    in->scene = aiImportFileEx(in->name, 0, &in->io);
    return in->scene != NULL ? NEBEL_OK : nb_assimp_refuse(in, aiGetErrorString());
}

/* Reads the file as it is, checks it, and only then has it worked on. Assimp's own validation belongs to the reading: a
 * scene that fails in the second step is freed twice. What Assimp could do beyond that takes it more memory and time
 * than reading, and is done on our copy. */
static nebel_result import_locked(nb_assimp *in)
{
    if (in->load->points != NULL) return import_points(in);
    const struct aiScene *raw = aiImportFileEx(in->name, aiProcess_ValidateDataStructure, &in->io);
    if (raw == NULL) return nb_assimp_refuse(in, aiGetErrorString());
    const nebel_result result = nb_assimp_check_meshes(in, raw);
    if (result != NEBEL_OK) {
        aiReleaseImport(raw);
        return result;
    }
    in->scene = has_polygons(raw) ? aiApplyPostProcessing(raw, aiProcess_Triangulate) : raw;
    return in->scene != NULL ? NEBEL_OK : nb_assimp_refuse(in, NULL);
}

static nebel_result import(nb_assimp *in)
{
    call_once(&import_once, prepare_lock);
    mtx_lock(&import_lock);
    const nebel_result result = import_locked(in);
    mtx_unlock(&import_lock);
    return result;
}

/* ---- transforms ------------------------------------------------------------------------------ */

static nb_affine from_assimp(const struct aiMatrix4x4 *matrix)
{
    return (nb_affine){{{(double)matrix->a1, (double)matrix->a2, (double)matrix->a3, (double)matrix->a4},
                        {(double)matrix->b1, (double)matrix->b2, (double)matrix->b3, (double)matrix->b4},
                        {(double)matrix->c1, (double)matrix->c2, (double)matrix->c3, (double)matrix->c4}}};
}

/* ---- the scene graph ------------------------------------------------------------------------- */

typedef struct waiting {
    const struct aiNode *node;
    nb_affine place; /* of its parent */
} waiting;

typedef struct stack {
    waiting *items;
    size_t count, capacity;
} stack;

static nebel_result push(const nb_assimp *in, stack *nodes, const struct aiNode *node, const nb_affine *place)
{
    void *items = nodes->items;
    if (nodes->count == MAX_NODES_WAITING)
        return nb_model_fail(in->load, NEBEL_ERROR_LIMIT, "\"%s\" has too many nodes", in->load->source->file);
    if (!nb_grow(&in->load->allocator, &items, sizeof *nodes->items, nodes->count, &nodes->capacity, nodes->count + 1))
        return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    nodes->items = items;
    nodes->items[nodes->count++] = (waiting){node, *place};
    return NEBEL_OK;
}

static nebel_result take_assimp_mesh(nb_assimp *in, const struct aiMesh *mesh, const nb_affine *place)
{
    return in->load->points != NULL ? nb_assimp_add_points(in, mesh, place) : nb_assimp_add_mesh(in, mesh, place);
}

static nebel_result visit(nb_assimp *in, stack *nodes)
{
    const waiting top = nodes->items[--nodes->count];
    const nb_affine own = from_assimp(&top.node->mTransformation), place = nb_affine_compose(&top.place, &own);
    nebel_result result = NEBEL_OK;
    for (unsigned i = 0; i < top.node->mNumMeshes && result == NEBEL_OK; i++)
        if (top.node->mMeshes[i] < in->scene->mNumMeshes)
            result = take_assimp_mesh(in, in->scene->mMeshes[top.node->mMeshes[i]], &place);
    for (unsigned i = top.node->mNumChildren; i > 0 && result == NEBEL_OK; i--)
        result = push(in, nodes, top.node->mChildren[i - 1], &place);
    return result;
}

static nebel_result walk(nb_assimp *in)
{
    stack nodes = {0};
    nb_affine place = nb_model_place(in->load->source);
    for (int i = 0; i < 3; i++) place.m[i][3] = 0; /* the position stays apart, as the meshes' origin */
    nebel_result result = push(in, &nodes, in->scene->mRootNode, &place);
    while (nodes.count > 0 && result == NEBEL_OK) result = visit(in, &nodes);
    nb_release(&in->load->allocator, nodes.items);
    return result;
}

/* ---- loading --------------------------------------------------------------------------------- */

static void note_left_out(const nb_assimp *in)
{
    const nb_model_load *load = in->load;
    const char *file = load->source->file;
    if (in->left_out_faces > 0)
        nb_model_note(load, "%llu points and lines of \"%s\" are left out; only triangles are drawn",
                      (unsigned long long)in->left_out_faces, file);
    if (in->left_out_triangles > 0)
        nb_model_note(load, "%llu triangles of \"%s\" are left out; their corners are not numbers or do not exist",
                      (unsigned long long)in->left_out_triangles, file);
    if (in->left_out_masks > 0)
        nb_model_note(load,
                      "%llu meshes of \"%s\" are drawn without holes; they have an alpha mask, but no "
                      "texture coordinates to place it",
                      (unsigned long long)in->left_out_masks, file);
    if (in->left_out_clear > 0)
        nb_model_note(load, "%llu meshes of \"%s\" are left out; their alpha is below the cutoff everywhere",
                      (unsigned long long)in->left_out_clear, file);
}

static nebel_result convert_meshes(nb_assimp *in)
{
    const nb_model_load *load = in->load;
    const uint64_t before = load->set->triangle_count;
    in->surfaces = nb_arena_allocate(&in->scratch, in->scene->mNumMaterials, sizeof *in->surfaces);
    if (in->surfaces == NULL) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    const nebel_result result = walk(in);
    if (result != NEBEL_OK) return result;
    note_left_out(in);
    if (load->set->triangle_count > before || load->source->has_fog) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT, "\"%s\" holds no triangle", load->source->file);
}

static nebel_result convert_points(nb_assimp *in)
{
    const nb_model_load *load = in->load;
    const nebel_result result = walk(in);
    if (result != NEBEL_OK) return result;
    if (in->left_out_points > 0)
        nb_model_note(load, "%llu vertices of \"%s\" are left out; they are not numbers",
                      (unsigned long long)in->left_out_points, load->source->file);
    if (load->points->count > 0) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_FORMAT, "\"%s\" holds no vertex", load->source->file);
}

/* Where reading went on without what a file names, or in spite of what is wrong. */
static void note_refusal(const nb_assimp *in)
{
    if (in->made.fault[0] != '\0')
        nb_model_note(in->load, "\"%s\" is read as far as it goes: %s", in->load->source->file, in->made.fault);
    if (in->files.refusal != NB_REFUSAL_NONE)
        nb_model_note(in->load, "\"%s\" is read without \"%s\", which it names: it %s", in->load->source->file,
                      in->files.refused, nb_model_files_refusal_text(in->files.refusal));
}

static nebel_result take_scene(nb_assimp *in)
{
    note_refusal(in);
    if (in->scene->mRootNode == NULL)
        return nb_model_fail(in->load, NEBEL_ERROR_FORMAT, "\"%s\" holds nothing", in->load->source->file);
    return in->load->points != NULL ? convert_points(in) : convert_meshes(in);
}

static nebel_result prepare_files(nb_assimp *in)
{
    const nb_gltf_file *text = &in->made.files[NB_GLTF_TEXT];
    nebel_result result = nb_gltf_prepare(in->load, &in->files, &in->made);
    in->name = in->files.name;
    if (result != NEBEL_OK || text->bytes.size == 0) return result;
    const char *folder = nb_path_folder(&in->scratch, in->files.name);
    in->name = folder != NULL ? nb_path_join(&in->scratch, folder, text->name) : NULL;
    return in->name != NULL ? NEBEL_OK : nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
}

static nebel_result load_assimp_file(nb_assimp *in)
{
    const nb_model_load *load = in->load;
    nebel_result result = nb_assimp_check_file(load);
    if (result == NEBEL_OK) result = prepare_files(in);
    if (result == NEBEL_OK) result = import(in);
    if (result == NEBEL_OK) result = take_scene(in);
    if (in->scene != NULL && load->sink == NULL) aiReleaseImport(in->scene); /* behind a sink the process ends */
    nb_gltf_release_files(&load->allocator, &in->made);
    nb_release(&load->allocator, in->textures);
    nb_arena_release(&in->scratch);
    return result;
}

nebel_result nb_assimp_load(const nb_model_load *load)
{
    nb_assimp in = {.load = load,
                    .scratch = {.allocator = load->allocator},
                    .files = {.file = load->source->file,
                              .name = load->name,
                              .folder = load->folder,
                              .has_uris = nb_gltf_is(load->name),
                              .opened = load->opened,
                              .user = load->opened_user}};
    nebel_result result = nb_model_files_begin(&in.files, &load->log);
    nb_assimp_set_files(&in);
    if (result == NEBEL_OK) result = load_assimp_file(&in);
    nb_model_files_end(&in.files);
    return result;
}
