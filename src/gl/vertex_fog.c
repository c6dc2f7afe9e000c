#include "vertex_fog.h"

#include <nebel/classic.h>

#include <epoxy/gl.h>

enum { FOG_SIZE = 4 * sizeof(float) };

static nebel_result make_attribute(const nb_meshes *meshes, nb_mesh *mesh)
{
    if (mesh->fog != 0) return NEBEL_OK;
    glGenBuffers(1, &mesh->fog);
    glBindVertexArray(mesh->vertex_array);
    glBindBuffer(GL_ARRAY_BUFFER, mesh->fog);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(mesh->vertex_count * FOG_SIZE), NULL, GL_STREAM_DRAW);
    glEnableVertexAttribArray(NB_ATTRIBUTE_FOG);
    glVertexAttribPointer(NB_ATTRIBUTE_FOG, 4, GL_FLOAT, GL_FALSE, FOG_SIZE, NULL);
    return nb_context_check_memory(&meshes->log, "fog at vertices; use fewer triangles");
}

static void *map(unsigned buffer, size_t size, GLbitfield access)
{
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    return glMapBufferRange(GL_ARRAY_BUFFER, 0, (GLsizeiptr)size, access);
}

/* 0 where the driver lost what was written. */
static int unmap(unsigned buffer, const void *mapped)
{
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    return mapped != NULL && glUnmapBuffer(GL_ARRAY_BUFFER);
}

/* Positions are where OpenGL has them, and nowhere else. */
static nebel_result fill(const nb_meshes *meshes, const nb_mesh *mesh, const nebel_snapshot *fog, const double eye[3])
{
    const size_t count = mesh->vertex_count;
    const GLbitfield writing = GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT;
    nebel_vertices vertices = {.positions = map(mesh->vertices, count * NB_VERTEX_SIZE, GL_MAP_READ_BIT),
                               .position_stride = NB_VERTEX_SIZE};
    const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, map(mesh->fog, count * FOG_SIZE, writing), 0};
    const int mapped = vertices.positions != NULL && output.data != NULL;
    for (int i = 0; i < 3; i++) {
        vertices.origin[i] = mesh->origin[i];
        vertices.eye[i] = eye[i];
    }
    const nebel_result result = mapped ? nebel_fog_vertices(fog, NULL, count, &vertices, &output, 1) : NEBEL_OK;
    const int read = unmap(mesh->vertices, vertices.positions), written = unmap(mesh->fog, output.data);
    if (read && written) return result;
    return nb_fail(&meshes->log, NEBEL_ERROR_MEMORY, "OpenGL: no access to the vertices; try again");
}

nebel_result nb_vertex_fog_set(nb_meshes *meshes, const nebel_snapshot *fog, const double eye[3])
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < meshes->count && result == NEBEL_OK; i++) {
        nb_mesh *const mesh = &meshes->list[i];
        if (mesh->index_count == 0) continue;
        result = make_attribute(meshes, mesh);
        if (result == NEBEL_OK) result = fill(meshes, mesh, fog, eye);
    }
    return result;
}
