#include "gl_meshes.h"

#include "scene_programs.h"

#include "frame/mesh_check.h"
#include "math/vector.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* ---- checks ---------------------------------------------------------------------------------- */

static nebel_result check_textures(const nb_meshes *meshes, const nb_context *context, const nebel_scene_data *scene)
{
    for (size_t i = 0; i < scene->texture_count; i++) {
        const nebel_texture *const t = &scene->textures[i];
        if (t->width == 0 || t->height == 0 || t->rgba == NULL) {
            return nb_fail(&meshes->log, NEBEL_ERROR_ARGUMENT, "texture %zu: it has no texels", i);
        }
        if (t->width > context->widest || t->height > context->widest) {
            return nb_fail(&meshes->log, NEBEL_ERROR_LIMIT,
                           "texture %zu: %u x %u texels; this OpenGL has at most %u either way: use a smaller picture",
                           i, (unsigned)t->width, (unsigned)t->height, (unsigned)context->widest);
        }
    }
    return NEBEL_OK;
}

static int has_finite_numbers(const nebel_mesh *mesh)
{
    int good = 1;
    for (int i = 0; i < 3; i++) good &= isfinite(mesh->origin[i]) && isfinite(mesh->base_color[i]);
    return good;
}

static nebel_result check_indices(const nb_meshes *meshes, const nebel_mesh *mesh, size_t number)
{
    uint32_t largest = 0;
    const size_t count = 3 * (size_t)mesh->triangle_count;
    if (count > INT32_MAX || mesh->vertex_count > UINT32_MAX - mesh->triangle_count) {
        return nb_fail(&meshes->log, NEBEL_ERROR_LIMIT, "mesh %zu: %u triangles are too many for OpenGL; split it",
                       number, (unsigned)mesh->triangle_count);
    }
    for (size_t i = 0; i < count; i++) largest = mesh->indices[i] > largest ? mesh->indices[i] : largest;
    if (count == 0 || largest < mesh->vertex_count) return NEBEL_OK;
    return nb_fail(&meshes->log, NEBEL_ERROR_ARGUMENT, "mesh %zu: index %u, but there are only %u vertices", number,
                   (unsigned)largest, (unsigned)mesh->vertex_count);
}

static nebel_result check_mesh(const nb_meshes *meshes, const nebel_scene_data *scene, size_t number)
{
    const nebel_mesh *const mesh = &scene->meshes[number];
    if (mesh->triangle_count > 0 && (mesh->positions == NULL || mesh->indices == NULL)) {
        return nb_fail(&meshes->log, NEBEL_ERROR_ARGUMENT, "mesh %zu: it has triangles but no positions or no indices",
                       number);
    }
    if (mesh->texture >= 0 && (size_t)mesh->texture >= scene->texture_count) {
        return nb_fail(&meshes->log, NEBEL_ERROR_ARGUMENT, "mesh %zu: there is no texture %d", number,
                       (int)mesh->texture);
    }
    if (!has_finite_numbers(mesh)) {
        return nb_fail(&meshes->log, NEBEL_ERROR_VALUE, "mesh %zu: origin and base_color must be finite numbers",
                       number);
    }
    const nebel_result result = nb_holes_check(scene, number, &meshes->log);
    return result == NEBEL_OK ? check_indices(meshes, mesh, number) : result;
}

/* ---- vertices -------------------------------------------------------------------------------- */

/* A mesh on its way to OpenGL. */
typedef struct nb_gl_mesh_builder {
    const nebel_mesh *mesh;
    nb_mesh *made;
    nb_vertex *vertices;
    uint32_t *indices;
    size_t vertex_count, index_count;
} nb_gl_mesh_builder;

static const float *position_of(const nebel_mesh *mesh, uint32_t index)
{
    return mesh->positions + 3 * (size_t)index;
}

static nb_vertex vertex_of(const nebel_mesh *mesh, uint32_t index)
{
    nb_vertex v = {.uv = {0, 0}};
    memcpy(v.position, position_of(mesh, index), sizeof v.position);
    if (mesh->normals != NULL) memcpy(v.normal, mesh->normals + 3 * (size_t)index, sizeof v.normal);
    for (size_t k = 0; k < 2 && mesh->uvs != NULL; k++) {
        const float at = mesh->uvs[2 * (size_t)index + k];
        v.uv[k] = isfinite(at) ? at : 0;
    }
    return v;
}

/* The unit normal, in double because squares of the areas of small and large triangles leave the range of float. 0
 * where a triangle has no area or is not finite. */
static int set_face(const float *a, const float *b, const float *c, float face[3])
{
    double along[3], across[3], normal[3], length2 = 0;
    for (int i = 0; i < 3; i++) {
        along[i] = (double)b[i] - (double)a[i];
        across[i] = (double)c[i] - (double)a[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        normal[i] = along[j] * across[k] - along[k] * across[j];
        length2 += normal[i] * normal[i];
    }
    if (!(length2 > 0 && isfinite(length2))) return 0;
    for (int i = 0; i < 3; i++) face[i] = (float)(normal[i] / sqrt(length2));
    return 1;
}

static void include_vertex(nb_mesh *made, const float *position)
{
    for (int i = 0; i < 3; i++) {
        made->low[i] = fminf(made->low[i], position[i]);
        made->high[i] = fmaxf(made->high[i], position[i]);
    }
}

static double length_between(const float *a, const float *b)
{
    double square = 0;
    for (int i = 0; i < 3; i++) square += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
    return sqrt(square);
}

static nebel_result fail_mesh_memory(const nb_meshes *meshes)
{
    return nb_fail(&meshes->log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory; use fewer triangles");
}

static double longest_edge(const nebel_mesh *mesh, const uint32_t *corners)
{
    double longest = 0;
    for (int k = 0; k < 3; k++) {
        longest = fmax(longest, length_between(position_of(mesh, corners[k]), position_of(mesh, corners[(k + 1) % 3])));
    }
    return longest;
}

static void add_triangle(nb_gl_mesh_builder *d, const uint32_t *corners)
{
    const nebel_mesh *const mesh = d->mesh;
    nb_vertex last = vertex_of(mesh, corners[2]);
    if (!set_face(position_of(mesh, corners[0]), position_of(mesh, corners[1]), last.position, last.face)) return;
    for (int k = 0; k < 3; k++) include_vertex(d->made, position_of(mesh, corners[k]));
    d->made->longest = fmax(d->made->longest, longest_edge(mesh, corners));
    for (int e = 0; e < 2; e++) {
        for (int k = 0; k < 3; k++) last.edges[e][k] = position_of(mesh, corners[e])[k] - last.position[k];
    }
    d->indices[d->index_count++] = corners[0];
    d->indices[d->index_count++] = corners[1];
    d->indices[d->index_count++] = (uint32_t)d->vertex_count;
    d->vertices[d->vertex_count++] = last;
}

static nb_large_plane plane_of(const nebel_mesh *mesh, const uint32_t *corners)
{
    const float *const p[3] = {position_of(mesh, corners[0]), position_of(mesh, corners[1]),
                               position_of(mesh, corners[2])};
    double a[3], b[3];
    nb_large_plane plane = {.height = 0, .radius = longest_edge(mesh, corners)};
    for (int i = 0; i < 3; i++) {
        a[i] = (double)p[1][i] - (double)p[0][i];
        b[i] = (double)p[2][i] - (double)p[0][i];
        plane.middle[i] = (double)p[0][i] + (a[i] + b[i]) / 3;
    }
    nb_vector_cross(a, b, plane.normal);
    (void)nb_vector_make_unit(plane.normal);
    for (int i = 0; i < 3; i++) plane.height += plane.normal[i] * (double)p[0][i];
    return plane;
}

static nebel_result find_large(const nb_meshes *meshes, const nebel_mesh *mesh, nb_mesh *made)
{
    size_t count = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        count += longest_edge(mesh, mesh->indices + 3 * t) > NB_LARGE_EDGE;
    }
    if (count == 0) return NEBEL_OK;
    made->large = nb_allocate(&meshes->allocator, count, sizeof *made->large);
    if (made->large == NULL) return fail_mesh_memory(meshes);
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *const corners = mesh->indices + 3 * t;
        if (longest_edge(mesh, corners) > NB_LARGE_EDGE) made->large[made->large_count++] = plane_of(mesh, corners);
    }
    return NEBEL_OK;
}

static void fill_mesh(nb_gl_mesh_builder *d)
{
    const nebel_mesh *const mesh = d->mesh;
    for (int i = 0; i < 3; i++) {
        d->made->low[i] = HUGE_VALF;
        d->made->high[i] = -HUGE_VALF;
    }
    for (uint32_t i = 0; i < mesh->vertex_count; i++) d->vertices[d->vertex_count++] = vertex_of(mesh, i);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) add_triangle(d, mesh->indices + 3 * (size_t)t);
    d->made->vertex_count = d->vertex_count;
    d->made->index_count = (int)d->index_count;
}

static void set_attribute(GLuint place, GLint size, size_t offset)
{
    glEnableVertexAttribArray(place);
    glVertexAttribPointer(place, size, GL_FLOAT, GL_FALSE, sizeof(nb_vertex), (const void *)offset);
}

static nebel_result upload_mesh(const nb_meshes *meshes, const nb_gl_mesh_builder *d)
{
    nb_mesh *const made = d->made;
    glGenVertexArrays(1, &made->vertex_array);
    glGenBuffers(1, &made->vertices);
    glGenBuffers(1, &made->indices);
    glBindVertexArray(made->vertex_array);
    glBindBuffer(GL_ARRAY_BUFFER, made->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(d->vertex_count * sizeof(nb_vertex)), d->vertices, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, made->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(d->index_count * sizeof(uint32_t)), d->indices, GL_STATIC_DRAW);
    set_attribute(NB_ATTRIBUTE_POSITION, 3, offsetof(nb_vertex, position));
    set_attribute(NB_ATTRIBUTE_NORMAL, 3, offsetof(nb_vertex, normal));
    set_attribute(NB_ATTRIBUTE_UV, 2, offsetof(nb_vertex, uv));
    set_attribute(NB_ATTRIBUTE_FACE, 3, offsetof(nb_vertex, face));
    set_attribute(NB_ATTRIBUTE_EDGE, 3, offsetof(nb_vertex, edges[0]));
    set_attribute(NB_ATTRIBUTE_EDGE + 1, 3, offsetof(nb_vertex, edges[1]));
    return nb_context_check_memory(&meshes->log, "the meshes; use fewer triangles");
}

static nebel_result make_mesh(nb_meshes *meshes, const nebel_mesh *mesh, nb_mesh *made)
{
    const size_t triangles = mesh->triangle_count;
    nb_gl_mesh_builder d = {.mesh = mesh, .made = made};
    d.vertices = nb_allocate(&meshes->allocator, mesh->vertex_count + triangles, sizeof *d.vertices);
    d.indices = nb_allocate(&meshes->allocator, 3 * triangles, sizeof *d.indices);
    const int room = d.vertices != NULL && d.indices != NULL;
    nebel_result result = room ? NEBEL_OK : fail_mesh_memory(meshes);
    memcpy(made->origin, mesh->origin, sizeof made->origin);
    memcpy(made->base_color, mesh->base_color, sizeof made->base_color);
    if (mesh->texture >= 0 && mesh->uvs != NULL) made->texture = meshes->textures[mesh->texture];
    if (mesh->alpha_cutoff > 0) {
        made->mask = meshes->textures[mesh->mask];
        made->cutoff = mesh->alpha_cutoff - 0.125f / 255; /* as the CPU renderer has it */
    }
    if (result == NEBEL_OK) result = find_large(meshes, mesh, made);
    if (result == NEBEL_OK) {
        fill_mesh(&d);
        result = upload_mesh(meshes, &d);
    }
    nb_release(&meshes->allocator, d.vertices);
    nb_release(&meshes->allocator, d.indices);
    return result;
}

double nb_meshes_distance(const nb_mesh *mesh, const double place[3])
{
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double at = place[i] - mesh->origin[i];
        const double beside = fmax(fmax((double)mesh->low[i] - at, at - (double)mesh->high[i]), 0);
        square += beside * beside;
    }
    return sqrt(square);
}

static void include_mesh(nb_meshes *meshes, const nb_mesh *made)
{
    for (int i = 0; i < 3; i++) {
        meshes->low[i] = fmin(meshes->low[i], made->origin[i] + (double)made->low[i]);
        meshes->high[i] = fmax(meshes->high[i], made->origin[i] + (double)made->high[i]);
    }
}

/* ---- textures -------------------------------------------------------------------------------- */

/* As the CPU renderer looks texels up: between four of them in linear light, without smaller versions. */
static nebel_result make_mesh_texture(const nb_meshes *meshes, const nebel_texture *texture, unsigned *name)
{
    glGenTextures(1, name);
    glBindTexture(GL_TEXTURE_2D, *name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, (GLsizei)texture->width, (GLsizei)texture->height, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, texture->rgba);
    return nb_context_check_memory(&meshes->log, "the textures; use smaller pictures");
}

/* ---- all ------------------------------------------------------------------------------------- */

static nebel_result make_textures(nb_meshes *meshes, const nebel_scene_data *scene)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->texture_count && result == NEBEL_OK; i++) {
        result = make_mesh_texture(meshes, &scene->textures[i], &meshes->textures[i]);
        meshes->texture_count = i + 1;
    }
    return result;
}

static nebel_result make_meshes(nb_meshes *meshes, const nebel_scene_data *scene)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->mesh_count && result == NEBEL_OK; i++) {
        nb_mesh *const made = &meshes->list[meshes->count];
        result = check_mesh(meshes, scene, i);
        if (result != NEBEL_OK || scene->meshes[i].triangle_count == 0) continue;
        meshes->count++;
        result = make_mesh(meshes, &scene->meshes[i], made);
        include_mesh(meshes, made);
    }
    return result;
}

nebel_result nb_meshes_make(nb_meshes *meshes, const nb_context *context, const nebel_scene_data *scene)
{
    for (int i = 0; i < 3; i++) {
        meshes->low[i] = HUGE_VAL;
        meshes->high[i] = -HUGE_VAL;
    }
    nebel_result result = check_textures(meshes, context, scene);
    if (result != NEBEL_OK) return result;
    meshes->list = nb_allocate_zero(&meshes->allocator, scene->mesh_count, sizeof *meshes->list);
    meshes->textures = nb_allocate_zero(&meshes->allocator, scene->texture_count, sizeof *meshes->textures);
    if (meshes->list == NULL || meshes->textures == NULL) return fail_mesh_memory(meshes);
    result = make_textures(meshes, scene);
    return result == NEBEL_OK ? make_meshes(meshes, scene) : result;
}

static void delete_mesh_objects(const nb_meshes *meshes)
{
    glDeleteTextures((GLsizei)meshes->texture_count, meshes->textures);
    for (size_t i = 0; i < meshes->count; i++) {
        const nb_mesh *const mesh = &meshes->list[i];
        const GLuint arrays[] = {mesh->vertex_array, mesh->corner_array};
        const GLuint buffers[] = {mesh->vertices, mesh->indices, mesh->fog, mesh->corners, mesh->corner_fog};
        glDeleteVertexArrays(2, arrays);
        glDeleteBuffers(5, buffers);
    }
}

void nb_meshes_bind_mask(const nb_mesh *mesh, int cutoff)
{
    glUniform1f(cutoff, mesh->cutoff);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_MASK);
    glBindTexture(GL_TEXTURE_2D, mesh->mask);
    glBindSampler(NB_UNIT_MASK, 0);
}

void *nb_meshes_map(unsigned buffer, size_t size, unsigned access)
{
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    return glMapBufferRange(GL_ARRAY_BUFFER, 0, (GLsizeiptr)size, access);
}

int nb_meshes_unmap(unsigned buffer, const void *mapped)
{
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    return mapped != NULL && glUnmapBuffer(GL_ARRAY_BUFFER);
}

void nb_meshes_delete(nb_meshes *meshes, int in_context)
{
    if (in_context) delete_mesh_objects(meshes);
    for (size_t i = 0; i < meshes->count; i++) nb_release(&meshes->allocator, meshes->list[i].large);
    nb_release(&meshes->allocator, meshes->list);
    nb_release(&meshes->allocator, meshes->textures);
}
