#include "triangle_instances.h"

#include <epoxy/gl.h>
#include <string.h>

typedef struct nb_triangle_instance {
    float position[3][3], normal[3][3], uv[3][2], face[3];
} nb_triangle_instance;

enum { FOG_SIZE = 4 * sizeof(float), CORNERS_FOG_SIZE = 3 * FOG_SIZE };

/* ---- buffers --------------------------------------------------------------------------------- */

static nebel_result no_access(const nb_meshes *meshes)
{
    return nb_fail(&meshes->log, NEBEL_ERROR_MEMORY, "OpenGL: no access to the triangles; try again");
}

/* For each triangle, out of what vertices have. */
typedef void gather(const uint32_t *indices, const void *vertices, void *corners);

/* Fills a buffer of triangles, `size` bytes each, from one of vertices. */
static nebel_result fill_instances(const nb_meshes *meshes, const nb_mesh *mesh, unsigned from, size_t from_size,
                                   unsigned to, size_t size, gather *one)
{
    const size_t count = (size_t)mesh->index_count / 3;
    const uint32_t *const indices = nb_meshes_map(mesh->indices, 3 * count * sizeof *indices, GL_MAP_READ_BIT);
    const void *const vertices = nb_meshes_map(from, mesh->vertex_count * from_size, GL_MAP_READ_BIT);
    char *const corners = nb_meshes_map(to, count * size, GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT);
    const int good = indices != NULL && vertices != NULL && corners != NULL;
    for (size_t i = 0; i < count && good; i++) one(indices + 3 * i, vertices, corners + i * size);
    const int known = nb_meshes_unmap(mesh->indices, indices), read = nb_meshes_unmap(from, vertices),
              written = nb_meshes_unmap(to, corners);
    return known && read && written ? NEBEL_OK : no_access(meshes);
}

static nebel_result make_buffer(const nb_meshes *meshes, const nb_mesh *mesh, unsigned *name, size_t size)
{
    glGenBuffers(1, name);
    glBindBuffer(GL_ARRAY_BUFFER, *name);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)mesh->index_count / 3 * size), NULL, GL_STREAM_DRAW);
    return nb_context_check_memory(&meshes->log, "the triangles of a panorama; use fewer");
}

/* One for each corner, or for all three; to the bound buffer. */
static void set_attributes(GLuint place, GLuint count, GLint components, size_t size, size_t offset)
{
    for (GLuint i = 0; i < count; i++) {
        const size_t at = offset + i * (size_t)components * sizeof(float);
        glEnableVertexAttribArray(place + i);
        glVertexAttribPointer(place + i, components, GL_FLOAT, GL_FALSE, (GLsizei)size, (const void *)at);
        glVertexAttribDivisor(place + i, 1);
    }
}

/* ---- triangles ------------------------------------------------------------------------------- */

static void gather_triangle(const uint32_t *indices, const void *vertices, void *corners)
{
    const nb_vertex *const from = vertices;
    nb_triangle_instance *const to = corners;
    for (int k = 0; k < 3; k++) {
        const nb_vertex *const v = &from[indices[k]];
        memcpy(to->position[k], v->position, sizeof v->position);
        memcpy(to->normal[k], v->normal, sizeof v->normal);
        memcpy(to->uv[k], v->uv, sizeof v->uv);
    }
    memcpy(to->face, from[indices[2]].face, sizeof to->face);
}

static nebel_result make_triangles(const nb_meshes *meshes, nb_mesh *mesh)
{
    glGenVertexArrays(1, &mesh->corner_array);
    const nebel_result result = make_buffer(meshes, mesh, &mesh->corners, sizeof(nb_triangle_instance));
    if (result != NEBEL_OK) return result;
    glBindVertexArray(mesh->corner_array);
    set_attributes(NB_CORNER_POSITION, 3, 3, sizeof(nb_triangle_instance), offsetof(nb_triangle_instance, position));
    set_attributes(NB_CORNER_NORMAL, 3, 3, sizeof(nb_triangle_instance), offsetof(nb_triangle_instance, normal));
    set_attributes(NB_CORNER_UV, 3, 2, sizeof(nb_triangle_instance), offsetof(nb_triangle_instance, uv));
    set_attributes(NB_CORNER_FACE, 1, 3, sizeof(nb_triangle_instance), offsetof(nb_triangle_instance, face));
    return fill_instances(meshes, mesh, mesh->vertices, sizeof(nb_vertex), mesh->corners, sizeof(nb_triangle_instance),
                          gather_triangle);
}

static void drop_triangles(nb_mesh *mesh)
{
    glDeleteVertexArrays(1, &mesh->corner_array);
    glDeleteBuffers(1, &mesh->corners);
    mesh->corner_array = mesh->corners = 0;
}

nebel_result nb_triangle_instances_make(nb_meshes *meshes)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < meshes->count && result == NEBEL_OK; i++) {
        nb_mesh *const mesh = &meshes->list[i];
        if (mesh->index_count == 0 || mesh->corner_array != 0) continue;
        result = make_triangles(meshes, mesh);
        if (result != NEBEL_OK) drop_triangles(mesh);
    }
    return result;
}

/* ---- fog ------------------------------------------------------------------------------------- */

static void gather_fog(const uint32_t *indices, const void *vertices, void *corners)
{
    for (size_t k = 0; k < 3; k++) {
        memcpy((char *)corners + k * FOG_SIZE, (const char *)vertices + indices[k] * (size_t)FOG_SIZE, FOG_SIZE);
    }
}

static nebel_result make_fog(const nb_meshes *meshes, nb_mesh *mesh)
{
    const nebel_result result = make_buffer(meshes, mesh, &mesh->corner_fog, CORNERS_FOG_SIZE);
    if (result != NEBEL_OK) {
        glDeleteBuffers(1, &mesh->corner_fog);
        mesh->corner_fog = 0;
        return result;
    }
    glBindVertexArray(mesh->corner_array);
    set_attributes(NB_CORNER_FOG, 3, 4, CORNERS_FOG_SIZE, 0);
    return result;
}

nebel_result nb_triangle_instances_set_fog(nb_meshes *meshes)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < meshes->count && result == NEBEL_OK; i++) {
        nb_mesh *const mesh = &meshes->list[i];
        if (mesh->index_count == 0) continue;
        if (mesh->corner_fog == 0) result = make_fog(meshes, mesh);
        if (result != NEBEL_OK) return result;
        result = fill_instances(meshes, mesh, mesh->fog, FOG_SIZE, mesh->corner_fog, CORNERS_FOG_SIZE, gather_fog);
    }
    return result;
}

void nb_triangle_instances_draw(const nb_mesh *mesh, int vertices)
{
    glBindVertexArray(mesh->corner_array);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, vertices, mesh->index_count / 3);
}
