#include "vertex_fog.h"

#include <nebel/classic.h>

#include <epoxy/gl.h>
#include <math.h>

enum { FOG_SIZE = 4 * sizeof(float) };

static nebel_result make_attribute(const nb_meshes *meshes, nb_mesh *mesh)
{
    if (mesh->fog != 0) return NEBEL_OK;
    glGenBuffers(1, &mesh->fog);
    glBindBuffer(GL_ARRAY_BUFFER, mesh->fog);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(mesh->vertex_count * FOG_SIZE), NULL, GL_STREAM_DRAW);
    const nebel_result result = nb_context_check_memory(&meshes->log, "fog at vertices; use fewer triangles");
    if (result != NEBEL_OK) {
        glDeleteBuffers(1, &mesh->fog);
        mesh->fog = 0;
        return result;
    }
    glBindVertexArray(mesh->vertex_array);
    glEnableVertexAttribArray(NB_ATTRIBUTE_FOG);
    glVertexAttribPointer(NB_ATTRIBUTE_FOG, 4, GL_FLOAT, GL_FALSE, FOG_SIZE, NULL);
    return result;
}

/* As the ray to a place is seen. */
static nebel_cell_view view_towards(const nb_vertex_source *source, const double place[3])
{
    nebel_cell_view view = source->view;
    double depth = 0;
    for (int i = 0; i < 3; i++) depth += (place[i] - view.eye[i]) * view.forward[i];
    for (int i = 0; i < 3; i++) {
        if (source->projection == NEBEL_PROJECTION_PANORAMA) view.forward[i] = place[i] - view.eye[i];
        if (source->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) view.eye[i] = place[i] - depth * view.forward[i];
    }
    return view;
}

static void find_place(const nebel_vertices *vertices, size_t vertex, double place[3])
{
    const char *const positions = vertices->positions;
    const float *const p = (const float *)(const void *)(positions + vertex * vertices->position_stride);
    for (int i = 0; i < 3; i++) place[i] = vertices->origin[i] + (double)p[i];
}

/* A vertex in the eye of a panorama has no fog. */
static nebel_result fog_by_cells(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                 float (*out)[4])
{
    nebel_result result = NEBEL_OK;
    for (size_t v = 0; v < count && result == NEBEL_OK; v++) {
        nebel_cell_point point = {.position = {0, 0, 0}};
        nebel_cell_fog fog = {.alpha = 0};
        find_place(vertices, v, point.position);
        const nebel_cell_view view = view_towards(source, point.position);
        const int is_eye = view.forward[0] == 0 && view.forward[1] == 0 && view.forward[2] == 0;
        if (!is_eye) result = nebel_fog_cells(source->cells, &view, 1, &point, 0, &fog, 0);
        for (int i = 0; i < 3; i++) out[v][i] = (float)fog.color[i];
        out[v][3] = (float)fog.alpha;
    }
    return result;
}

/* What counts of a place in eye coordinates is its depth and its distance. */
static void fog_by_factor(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices, float (*out)[4])
{
    const nebel_factor_desc *const factor = source->factor;
    for (size_t v = 0; v < count; v++) {
        double place[3], length2 = 0, depth = 0;
        find_place(vertices, v, place);
        const nebel_cell_view view = view_towards(source, place);
        for (int i = 0; i < 3; i++) {
            const double way = place[i] - view.eye[i];
            length2 += way * way;
            depth += way * source->view.forward[i];
        }
        if (source->projection == NEBEL_PROJECTION_PANORAMA) depth = sqrt(length2);
        const double seen[3] = {sqrt(fmax(length2 - depth * depth, 0)), 0, depth};
        const double amount = 1 - nebel_compute_fog_factor(factor, nebel_compute_fog_coordinate(factor, seen, 0));
        for (int i = 0; i < 3; i++) out[v][i] = (float)(amount * factor->color[i]);
        out[v][3] = (float)amount;
    }
}

static nebel_result fog_by_parallel_rays(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                         float (*out)[4])
{
    nebel_result result = NEBEL_OK;
    for (size_t v = 0; v < count && result == NEBEL_OK; v++) {
        const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, out[v], 0};
        nebel_vertices one = *vertices;
        double place[3];
        one.positions = (const char *)vertices->positions + v * vertices->position_stride;
        find_place(vertices, v, place);
        const nebel_cell_view view = view_towards(source, place);
        for (int i = 0; i < 3; i++) one.eye[i] = view.eye[i];
        result = nebel_fog_vertices(source->fog, NULL, 1, &one, &output, 1);
    }
    return result;
}

nebel_result nb_vertex_fog_find(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                float (*out)[4])
{
    const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, out, 0};
    if (source->cells != NULL) return fog_by_cells(source, count, vertices, out);
    if (source->factor != NULL) {
        fog_by_factor(source, count, vertices, out);
        return NEBEL_OK;
    }
    if (source->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) return fog_by_parallel_rays(source, count, vertices, out);
    return nebel_fog_vertices(source->fog, NULL, count, vertices, &output, 1);
}

/* Positions are where OpenGL has them, and nowhere else. */
static nebel_result fill(const nb_meshes *meshes, const nb_mesh *mesh, const nb_vertex_source *source)
{
    const size_t count = mesh->vertex_count;
    const GLbitfield writing = GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT;
    nebel_vertices vertices = {.positions = nb_meshes_map(mesh->vertices, count * sizeof(nb_vertex), GL_MAP_READ_BIT),
                               .position_stride = sizeof(nb_vertex)};
    void *const out = nb_meshes_map(mesh->fog, count * FOG_SIZE, writing);
    const int mapped = vertices.positions != NULL && out != NULL;
    for (int i = 0; i < 3; i++) {
        vertices.origin[i] = mesh->origin[i];
        vertices.eye[i] = source->view.eye[i];
    }
    const nebel_result result = mapped ? nb_vertex_fog_find(source, count, &vertices, out) : NEBEL_OK;
    const int read = nb_meshes_unmap(mesh->vertices, vertices.positions), written = nb_meshes_unmap(mesh->fog, out);
    if (read && written) return result;
    return nb_fail(&meshes->log, NEBEL_ERROR_MEMORY, "OpenGL: no access to the vertices; try again");
}

nebel_result nb_vertex_fog_set(nb_meshes *meshes, const nb_vertex_source *source)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < meshes->count && result == NEBEL_OK; i++) {
        nb_mesh *const mesh = &meshes->list[i];
        if (mesh->index_count == 0) continue;
        result = make_attribute(meshes, mesh);
        if (result == NEBEL_OK) result = fill(meshes, mesh, source);
    }
    return result;
}
