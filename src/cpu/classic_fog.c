/* Classic fog is on what is drawn, as an alpha polygon over each surface: alpha and colour at its vertices, linear in
 * between as Gouraud's interpolation is, with perspective. Where nothing is drawn there is no fog. */
#include "classic_fog.h"

#include "base/vector.h"

#include <math.h>

/* The camera as cells want it. Orthographic rays begin in the camera's plane, beside its position; a panorama has no
 * axis but each ray itself. */
static nebel_cell_view view_towards(const nb_view *camera, const double place[3])
{
    nebel_cell_view view = {.ignore_walls = 0};
    double depth = 0;
    for (int i = 0; i < 3; i++) {
        view.eye[i] = camera->position[i];
        view.forward[i] = camera->axes.forward[i];
        depth += (place[i] - camera->position[i]) * camera->axes.forward[i];
    }
    for (int i = 0; i < 3; i++) {
        if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC)
            view.eye[i] = place[i] - depth * camera->axes.forward[i];
        if (camera->projection == NEBEL_PROJECTION_PANORAMA) view.forward[i] = place[i] - camera->position[i];
    }
    return view;
}

/* ---- fog of a place -------------------------------------------------------------------------- */

/* A place that is none, or is the eye, has no fog. */
static nb_vertex_fog fog_of_cells(const nb_frame *frame, const double place[3])
{
    nebel_cell_view view = view_towards(&frame->view, place);
    view.ignore_walls = frame->renderer->method == NEBEL_METHOD_CELLS;
    const nebel_cell_point point = {.position = {place[0], place[1], place[2]}};
    nebel_cell_fog fog;
    if (nebel_fog_cells(frame->renderer->cells, &view, 1, &point, 0, &fog, 0) != NEBEL_OK)
        return (nb_vertex_fog){{0, 0, 0}, 0};
    return (nb_vertex_fog){{(float)fog.color[0], (float)fog.color[1], (float)fog.color[2]}, (float)fog.alpha};
}

/* Each ray of a panorama is its own axis, and of an orthographic camera each begins beside its position. */
static void set_eye_coordinates(const nb_view *camera, const double place[3], double out[3])
{
    const nebel_cell_view view = view_towards(camera, place);
    const double way[3] = {place[0] - view.eye[0], place[1] - view.eye[1], place[2] - view.eye[2]};
    const int panorama = camera->projection == NEBEL_PROJECTION_PANORAMA;
    out[0] = panorama ? 0 : nb_vector_dot(way, camera->axes.right);
    out[1] = panorama ? 0 : nb_vector_dot(way, camera->axes.up);
    out[2] = panorama ? nb_vector_length(way) : nb_vector_dot(way, camera->axes.forward);
}

static nb_vertex_fog fog_of_factor(const nb_frame *frame, const double place[3])
{
    const nebel_factor_desc *factor = &frame->renderer->factor;
    double seen[3];
    set_eye_coordinates(&frame->view, place, seen);
    const double amount = 1 - nebel_compute_fog_factor(factor, nebel_compute_fog_coordinate(factor, seen, 0));
    nb_vertex_fog fog = {{0, 0, 0}, (float)amount};
    for (int c = 0; c < 3; c++) fog.color[c] = (float)(amount * factor->color[c]);
    return fog;
}

static nb_vertex_fog fog_at(const nb_frame *frame, const double place[3])
{
    const nebel_method method = frame->renderer->method;
    return method == NEBEL_METHOD_CELLS || method == NEBEL_METHOD_CELLS_PIXEL ? fog_of_cells(frame, place)
                                                                              : fog_of_factor(frame, place);
}

/* ---- per vertex ------------------------------------------------------------------------------ */

static void find_vertex(const nebel_mesh *mesh, size_t vertex, double place[3])
{
    for (size_t i = 0; i < 3; i++) place[i] = mesh->origin[i] + (double)mesh->positions[3 * vertex + i];
}

static nebel_result trace_vertices(const nb_frame *frame, const nebel_mesh *mesh, size_t first, size_t count,
                                   const double eye[3], nb_vertex_fog *fog)
{
    nebel_vertices vertices = {.positions = mesh->positions + 3 * first};
    for (int i = 0; i < 3; i++) {
        vertices.origin[i] = mesh->origin[i];
        vertices.eye[i] = eye[i];
    }
    const nebel_vertex_desc desc = {.isa = frame->renderer->fog_isa};
    const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, fog + first, sizeof *fog};
    return nebel_fog_vertices(frame->renderer->fog, &desc, count, &vertices, &output, 1);
}

static nebel_result set_vertices(const nb_frame *frame, const nebel_mesh *mesh, size_t first, size_t count,
                                 nb_vertex_fog *fog)
{
    const nebel_method method = frame->renderer->method;
    const int traces = method == NEBEL_METHOD_VERTEX || method == NEBEL_METHOD_ADDITIVE;
    if (traces && frame->view.projection != NEBEL_PROJECTION_ORTHOGRAPHIC)
        return trace_vertices(frame, mesh, first, count, frame->view.position, fog);
    nebel_result result = NEBEL_OK;
    for (size_t v = first; v < first + count && result == NEBEL_OK; v++) {
        double place[3];
        find_vertex(mesh, v, place);
        if (traces)
            result = trace_vertices(frame, mesh, v, 1, view_towards(&frame->view, place).eye, fog);
        else
            fog[v] = fog_at(frame, place);
    }
    return result;
}

static nebel_result set_surface(const nb_frame *frame, const nb_surface *surface)
{
    enum { BLOCK = 1024 };
    const nebel_mesh *mesh = surface->mesh;
    nb_vertex_fog *fog = frame->renderer->vertex_fog + surface->first_vertex;
    int failed = NEBEL_OK;
#pragma omp parallel for schedule(static) num_threads(frame->renderer->threads)
    for (size_t first = 0; first < mesh->vertex_count; first += BLOCK) {
        const size_t left = mesh->vertex_count - first;
        const nebel_result result = set_vertices(frame, mesh, first, left < BLOCK ? left : BLOCK, fog);
        if (result == NEBEL_OK) continue;
#pragma omp atomic write
        failed = result;
    }
    return (nebel_result)failed;
}

/* Of the factors each pixel may have its own. */
static int is_per_vertex(const nebel_renderer *renderer)
{
    switch (renderer->method) {
    case NEBEL_METHOD_CELLS:
        return 1;
    case NEBEL_METHOD_VERTEX:
    case NEBEL_METHOD_ADDITIVE:
        return renderer->fog != NULL;
    case NEBEL_METHOD_LINEAR:
    case NEBEL_METHOD_EXP:
    case NEBEL_METHOD_EXP2:
        return renderer->factor.stage == NEBEL_STAGE_VERTEX;
    default:
        return 0;
    }
}

nebel_result nb_classic_fog_set_vertices(const nb_frame *frame)
{
    const nb_geometry *geometry = &frame->renderer->geometry;
    nebel_result result = NEBEL_OK;
    if (!is_per_vertex(frame->renderer)) return result;
    for (size_t i = 0; i < geometry->surface_count && result == NEBEL_OK; i++)
        result = set_surface(frame, &geometry->surfaces[i]);
    return result;
}

static nb_vertex_fog interpolate(const nb_frame *frame, const nb_hits *hits, int lane)
{
    const nb_surface *surface = &frame->renderer->geometry.surfaces[hits->surface[lane]];
    const uint32_t *index = surface->mesh->indices + 3 * (size_t)hits->triangle[lane];
    const nb_vertex_fog *fog = frame->renderer->vertex_fog + surface->first_vertex;
    const nb_vertex_fog *a = &fog[index[0]], *b = &fog[index[1]], *c = &fog[index[2]];
    const float u = hits->u[lane], v = hits->v[lane], w = 1 - u - v;
    nb_vertex_fog mean = {{0, 0, 0}, w * a->alpha + u * b->alpha + v * c->alpha};
    for (int k = 0; k < 3; k++) mean.color[k] = w * a->color[k] + u * b->color[k] + v * c->color[k];
    return mean;
}

/* ---- per pixel ------------------------------------------------------------------------------- */

static nb_vertex_fog fog_of_pixel(const nb_frame *frame, const nb_rays *rays, const nb_hits *hits, int lane)
{
    const double way = frame->view.advance + (double)hits->t[lane] / (double)rays->length[lane];
    const int parallel = frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    double place[3];
    for (int i = 0; i < 3; i++) {
        const double start = frame->view.position[i] + (parallel ? rays->offset[i][lane] : 0);
        place[i] = start + way * rays->direction[i][lane];
    }
    return fog_at(frame, place);
}

/* ---- both ------------------------------------------------------------------------------------ */

static int is_clear(const nebel_renderer *renderer)
{
    return (renderer->method == NEBEL_METHOD_VERTEX || renderer->method == NEBEL_METHOD_ADDITIVE) &&
           renderer->fog == NULL;
}

void nb_classic_fog_trace(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    const nb_hits *hits = &scratch->hits;
    const nebel_renderer *renderer = frame->renderer;
    const int per_vertex = is_per_vertex(renderer), adds = renderer->method == NEBEL_METHOD_ADDITIVE;
    for (int i = 0; i < NB_BATCH; i++) {
        nb_vertex_fog fog = {{0, 0, 0}, 0};
        if (scratch->inside[i] && hits->surface[i] != NB_NONE && !is_clear(renderer))
            fog = per_vertex ? interpolate(frame, hits, i) : fog_of_pixel(frame, &scratch->rays, hits, i);
        for (int c = 0; c < 3; c++) {
            samples->transmittance[c][i] = adds ? 1 : 1 - fog.alpha;
            samples->in_scattering[c][i] = fog.color[c];
        }
        samples->error[i] = 0;
    }
}
