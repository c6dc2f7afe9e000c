#include "gl_vertex_fog.h"

#include "base/device.h"

#include <nebel/classic.h>

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

enum { VERTEX_FOG_SIZE = 4 * sizeof(float) };

static nebel_result make_attribute(const nb_meshes *meshes, nb_mesh *mesh)
{
    if (mesh->fog != 0) return NEBEL_OK;
    glGenBuffers(1, &mesh->fog);
    glBindBuffer(GL_ARRAY_BUFFER, mesh->fog);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(mesh->vertex_count * VERTEX_FOG_SIZE), NULL, GL_STREAM_DRAW);
    const nebel_result result = nb_context_check_memory(&meshes->log, "fog at vertices; use fewer triangles");
    if (result != NEBEL_OK) {
        glDeleteBuffers(1, &mesh->fog);
        mesh->fog = 0;
        return result;
    }
    glBindVertexArray(mesh->vertex_array);
    glEnableVertexAttribArray(NB_ATTRIBUTE_FOG);
    glVertexAttribPointer(NB_ATTRIBUTE_FOG, 4, GL_FLOAT, GL_FALSE, VERTEX_FOG_SIZE, NULL);
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

static void find_vertex_place(const nebel_vertices *vertices, size_t vertex, double place[3])
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
        find_vertex_place(vertices, v, point.position);
        const nebel_cell_view view = view_towards(source, point.position);
        const int is_eye = view.forward[0] == 0 && view.forward[1] == 0 && view.forward[2] == 0;
        if (!is_eye) result = nebel_compute_cell_fog(source->cells, &view, 1, &point, 0, &fog, 0);
        for (int i = 0; i < 3; i++) out[v][i] = (float)fog.color[i];
        out[v][3] = (float)fog.alpha;
    }
    return result;
}

/* ---- factors --------------------------------------------------------------------------------- */

/* What counts of a place in eye coordinates is its depth and its distance. */
static void find_seen(const nb_vertex_source *source, const double place[3], double seen[3])
{
    const nebel_cell_view view = view_towards(source, place);
    double length2 = 0, depth = 0;
    for (int i = 0; i < 3; i++) {
        const double way = place[i] - view.eye[i];
        length2 += way * way;
        depth += way * source->view.forward[i];
    }
    if (source->projection == NEBEL_PROJECTION_PANORAMA) depth = sqrt(length2);
    seen[0] = sqrt(fmax(length2 - depth * depth, 0));
    seen[1] = 0;
    seen[2] = depth;
}

static void set_color(double amount, const double color[3], float out[4])
{
    for (int i = 0; i < 3; i++) out[i] = (float)(amount * color[i]);
    out[3] = (float)amount;
}

static void set_light_color(double amount, const double light[3], float out[4])
{
    const double color[3] = {nb_device_store(light[0]), nb_device_store(light[1]), nb_device_store(light[2])};
    set_color(amount, color, out);
}

static void set_factor_color(const nebel_factor_desc *factor, double coordinate, float out[4])
{
    set_color(1 - nebel_compute_fog_factor(factor, coordinate), factor->color, out);
}

static void set_device_color(const nebel_d3d9_fog *d3d9, const nebel_d3d9_vertex *vertex, float out[4])
{
    double color[3];
    nebel_get_d3d9_color(d3d9, color);
    set_color(1 - nebel_compute_d3d9_vertex_factor(d3d9, vertex), color, out);
}

static int is_by_place(const nb_vertex_source *source)
{
    if (source->d3d9 != NULL) return source->d3d9->fog_vertex_mode != NEBEL_D3DFOG_NONE;
    return source->factor != NULL && source->factor->coordinate != NEBEL_COORDINATE_USER;
}

static void fog_by_place(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices, float (*out)[4])
{
    for (size_t v = 0; v < count; v++) {
        nebel_d3d9_vertex vertex = {.source = NEBEL_D3D9_FIXED};
        double place[3];
        find_vertex_place(vertices, v, place);
        find_seen(source, place, vertex.position);
        if (source->d3d9 != NULL)
            set_device_color(source->d3d9, &vertex, out[v]);
        else
            set_factor_color(source->factor, nebel_compute_fog_coordinate(source->factor, vertex.position, 0), out[v]);
    }
}

/* ---- volumes --------------------------------------------------------------------------------- */

static nebel_result trace(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices, float (*out)[4])
{
    const nebel_vertex_output output = {source->format, out, sizeof *out};
    if (source->fog != NULL) {
        nebel_vertex_desc desc = source->look != NULL ? *source->look : (nebel_vertex_desc){.channel = 0};
        desc.lighting = source->fog;
        return nebel_compute_vertex_fog(nebel_get_lighting_snapshot(source->fog), &desc, count, vertices, &output, 1);
    }
    memset(out, source->format == NEBEL_VERTEX_SPECULAR_ALPHA ? 0xff : 0, count * sizeof *out);
    return NEBEL_OK;
}

static nebel_result trace_parallel(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                   float (*out)[4])
{
    nebel_result result = NEBEL_OK;
    for (size_t v = 0; v < count && result == NEBEL_OK; v++) {
        nebel_vertices one = *vertices;
        double place[3];
        one.positions = (const char *)vertices->positions + v * vertices->position_stride;
        find_vertex_place(vertices, v, place);
        const nebel_cell_view view = view_towards(source, place);
        for (int i = 0; i < 3; i++) one.eye[i] = view.eye[i];
        result = trace(source, 1, &one, &out[v]);
    }
    return result;
}

static void unpack_coordinate(const nb_vertex_source *source, float out[4])
{
    enum { END = 100 };
    const double coordinate = (double)out[0];
    if (source->factor == NULL)
        set_light_color(coordinate / END, source->look->color, out);
    else if (source->factor->stage == NEBEL_STAGE_VERTEX)
        set_factor_color(source->factor, coordinate, out);
    else
        out[3] = (float)coordinate;
}

/* What hardware makes of what it is given. Where the factor is one of pixels that is the coordinate, in the place of
 * the amount. */
static void unpack(const nb_vertex_source *source, float out[4])
{
    const double byte = ((const unsigned char *)out)[3] / 255.;
    const nebel_d3d9_vertex vertex = {.source = NEBEL_D3D9_TRANSFORMED, .specular_alpha = byte};
    double color[3];
    switch (source->format) {
    case NEBEL_VERTEX_COORDINATE:
        unpack_coordinate(source, out);
        break;
    case NEBEL_VERTEX_SPECULAR_ALPHA:
        set_device_color(source->d3d9, &vertex, out);
        break;
    case NEBEL_VERTEX_ALPHA:
        for (int i = 0; i < 3; i++) color[i] = floor(255 * nb_device_store(source->look->color[i]) + .5) / 255;
        set_color(byte, color, out);
        break;
    default:
        for (int i = 0; i < 3 && source->blends_stored; i++)
            out[i] = (float)nb_device_store_fog((double)out[3], (double)out[i]);
        break;
    }
}

nebel_result nb_vertex_fog_find(const nb_vertex_source *source, size_t count, const nebel_vertices *vertices,
                                float (*out)[4])
{
    if (source->cells != NULL) return fog_by_cells(source, count, vertices, out);
    if (is_by_place(source)) {
        fog_by_place(source, count, vertices, out);
        return NEBEL_OK;
    }
    const int parallel = source->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    const nebel_result result =
        parallel ? trace_parallel(source, count, vertices, out) : trace(source, count, vertices, out);
    for (size_t v = 0; v < count && result == NEBEL_OK; v++) unpack(source, out[v]);
    return result;
}

/* ---- attributes ------------------------------------------------------------------------------ */

/* Positions are where OpenGL has them, and nowhere else. */
static nebel_result fill_vertex_fog(const nb_meshes *meshes, const nb_mesh *mesh, const nb_vertex_source *source)
{
    const size_t count = mesh->vertex_count;
    const GLbitfield writing = GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT;
    nebel_vertices vertices = {.positions = nb_meshes_map(mesh->vertices, count * sizeof(nb_vertex), GL_MAP_READ_BIT),
                               .position_stride = sizeof(nb_vertex)};
    void *const out = nb_meshes_map(mesh->fog, count * VERTEX_FOG_SIZE, writing);
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
        if (result == NEBEL_OK) result = fill_vertex_fog(meshes, mesh, source);
    }
    return result;
}
