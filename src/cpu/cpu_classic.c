/* Classic fog is on what is drawn, as an alpha polygon over each surface: alpha and colour at its vertices, linear in
 * between as Gouraud's interpolation is, with perspective. Where nothing is drawn there is no fog. */
#include "cpu_classic.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

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
    if (nebel_compute_cell_fog(frame->renderer->cells, &view, 1, &point, 0, &fog, 0) != NEBEL_OK)
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

/* Of a color as hardware stores it. */
static nb_vertex_fog fog_of_color(double amount, const double color[3])
{
    nb_vertex_fog fog = {{0, 0, 0}, (float)amount};
    for (int c = 0; c < 3; c++) fog.color[c] = (float)(amount * color[c]);
    return fog;
}

static nb_vertex_fog fog_of_light(double amount, const double light[3])
{
    const double color[3] = {nb_device_store(light[0]), nb_device_store(light[1]), nb_device_store(light[2])};
    return fog_of_color(amount, color);
}

static nb_vertex_fog fog_of_coordinate(const nebel_factor_desc *factor, double coordinate)
{
    return fog_of_light(1 - nebel_compute_fog_factor(factor, coordinate), factor->color);
}

/* The device's factor of a vertex, or with table fog of a pixel. */
static nb_vertex_fog fog_of_device(const nb_frame *frame, const nebel_d3d9_vertex *vertex)
{
    const nebel_renderer *const renderer = frame->renderer;
    const nebel_d3d9_fog *const d3d9 = &renderer->d3d9;
    const double of_vertex = nebel_compute_d3d9_vertex_factor(d3d9, vertex);
    const int parallel = frame->view.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    const double depth =
        parallel ? nb_device_depth(&renderer->device_planes, vertex->position[2]) : vertex->position[2];
    double color[3];
    nebel_get_d3d9_color(d3d9, color);
    return fog_of_color(1 - nebel_compute_d3d9_pixel_factor(d3d9, of_vertex, depth), color);
}

static nb_vertex_fog fog_at(const nb_frame *frame, const double place[3])
{
    const nebel_renderer *renderer = frame->renderer;
    const nebel_method method = renderer->method;
    if (method == NEBEL_METHOD_CELLS || method == NEBEL_METHOD_CELLS_PIXEL) return fog_of_cells(frame, place);
    nebel_d3d9_vertex vertex = {.source = NEBEL_D3D9_FIXED};
    set_eye_coordinates(&frame->view, place, vertex.position);
    if (method == NEBEL_METHOD_D3D9) return fog_of_device(frame, &vertex);
    return fog_of_coordinate(&renderer->factor, nebel_compute_fog_coordinate(&renderer->factor, vertex.position, 0));
}

/* ---- fog of the snapshot --------------------------------------------------------------------- */

static int has_factor(const nebel_renderer *renderer)
{
    return renderer->method == NEBEL_METHOD_LINEAR || renderer->method == NEBEL_METHOD_EXP ||
           renderer->method == NEBEL_METHOD_EXP2;
}

static int is_by_user(const nebel_renderer *renderer)
{
    return has_factor(renderer) && renderer->factor.coordinate == NEBEL_COORDINATE_USER;
}

/* Whether the fog at vertices is the snapshot's. */
static int traces(const nebel_renderer *renderer)
{
    switch (renderer->method) {
    case NEBEL_METHOD_VERTEX:
    case NEBEL_METHOD_ADDITIVE:
    case NEBEL_METHOD_FOG_COORD:
    case NEBEL_METHOD_TWO_PASS:
    case NEBEL_METHOD_ALPHA:
        return 1;
    case NEBEL_METHOD_D3D9:
        return renderer->d3d9.fog_vertex_mode == NEBEL_D3DFOG_NONE &&
               renderer->d3d9.fog_table_mode == NEBEL_D3DFOG_NONE;
    default:
        return is_by_user(renderer);
    }
}

/* What a program hands over to the hardware. */
static nebel_vertex_format format_of(const nebel_renderer *renderer)
{
    switch (renderer->method) {
    case NEBEL_METHOD_ALPHA:
        return NEBEL_VERTEX_ALPHA;
    case NEBEL_METHOD_D3D9:
        return NEBEL_VERTEX_SPECULAR_ALPHA;
    case NEBEL_METHOD_FOG_COORD:
        return NEBEL_VERTEX_COORDINATE;
    default:
        return is_by_user(renderer) ? NEBEL_VERTEX_COORDINATE : NEBEL_VERTEX_RGBA_FLOAT;
    }
}

static nb_vertex_fog unpack_alpha(const nebel_renderer *renderer, double alpha)
{
    double color[3];
    for (int c = 0; c < 3; c++) color[c] = floor(255 * nb_device_store(renderer->look_color[c]) + .5) / 255;
    return fog_of_color(alpha, color);
}

static nb_vertex_fog unpack_colors(const nebel_renderer *renderer, const nb_vertex_fog *stream)
{
    nb_vertex_fog fog = *stream;
    if (!nebel_method_blends_stored(renderer->method)) return fog;
    for (int c = 0; c < 3; c++)
        fog.color[c] = (float)nb_device_store_fog((double)stream->alpha, (double)stream->color[c]);
    return fog;
}

/* What the hardware makes of it. Where the factor is one of pixels that is the coordinate, in the place of alpha. */
static nb_vertex_fog unpack(const nb_frame *frame, const nb_vertex_fog *stream)
{
    const nebel_renderer *const renderer = frame->renderer;
    enum { END = 100 };
    float coordinate;
    memcpy(&coordinate, stream, sizeof coordinate);
    const double byte = ((const unsigned char *)stream)[3] / 255.;
    const nebel_d3d9_vertex vertex = {.source = NEBEL_D3D9_TRANSFORMED, .specular_alpha = byte};
    switch (format_of(renderer)) {
    case NEBEL_VERTEX_ALPHA:
        return unpack_alpha(renderer, byte);
    case NEBEL_VERTEX_SPECULAR_ALPHA:
        return fog_of_device(frame, &vertex);
    case NEBEL_VERTEX_COORDINATE:
        if (!is_by_user(renderer)) return fog_of_light((double)coordinate / END, renderer->look_color);
        if (renderer->factor.stage == NEBEL_STAGE_PIXEL) return (nb_vertex_fog){{0, 0, 0}, coordinate};
        return fog_of_coordinate(&renderer->factor, (double)coordinate);
    default:
        return unpack_colors(renderer, stream);
    }
}

/* ---- per vertex ------------------------------------------------------------------------------ */

static void find_vertex(const nebel_mesh *mesh, size_t vertex, double place[3])
{
    for (size_t i = 0; i < 3; i++) place[i] = mesh->origin[i] + (double)mesh->positions[3 * vertex + i];
}

static nebel_result trace_vertices(const nb_frame *frame, const nebel_mesh *mesh, size_t first, size_t count,
                                   const double eye[3], nb_vertex_fog *fog)
{
    const nebel_renderer *renderer = frame->renderer;
    const nebel_vertex_format format = format_of(renderer);
    nebel_vertices vertices = {.positions = mesh->positions + 3 * first};
    for (int i = 0; i < 3; i++) {
        vertices.origin[i] = mesh->origin[i];
        vertices.eye[i] = eye[i];
    }
    nebel_vertex_desc desc = {.isa = NEBEL_ISA_DEFAULT};
    if (renderer->method == NEBEL_METHOD_FOG_COORD || renderer->method == NEBEL_METHOD_TWO_PASS ||
        renderer->method == NEBEL_METHOD_ALPHA)
        desc = renderer->look;
    desc.isa = renderer->fog_isa;
    desc.lighting = renderer->lighting;
    const nebel_vertex_output output = {format, fog + first, sizeof *fog};
    nebel_result result = NEBEL_OK;
    if (renderer->fog != NULL)
        result = nebel_compute_vertex_fog(renderer->fog, &desc, count, &vertices, &output, 1);
    else
        memset(fog + first, format == NEBEL_VERTEX_SPECULAR_ALPHA ? 0xff : 0, count * sizeof *fog);
    for (size_t v = first; v < first + count && result == NEBEL_OK; v++) fog[v] = unpack(frame, &fog[v]);
    return result;
}

static nebel_result set_vertices(const nb_frame *frame, const nebel_mesh *mesh, size_t first, size_t count,
                                 nb_vertex_fog *fog)
{
    const int from_snapshot = traces(frame->renderer);
    if (from_snapshot && frame->view.projection != NEBEL_PROJECTION_ORTHOGRAPHIC)
        return trace_vertices(frame, mesh, first, count, frame->view.position, fog);
    nebel_result result = NEBEL_OK;
    for (size_t v = first; v < first + count && result == NEBEL_OK; v++) {
        double place[3];
        find_vertex(mesh, v, place);
        if (from_snapshot)
            result = trace_vertices(frame, mesh, v, 1, view_towards(&frame->view, place).eye, fog);
        else
            fog[v] = fog_at(frame, place);
    }
    return result;
}

static nebel_result set_surface(const nb_frame *frame, const nb_batch_surface *surface)
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
    if (traces(renderer) || renderer->method == NEBEL_METHOD_CELLS) return 1;
    if (renderer->method == NEBEL_METHOD_D3D9) return renderer->d3d9.fog_table_mode == NEBEL_D3DFOG_NONE;
    return has_factor(renderer) && renderer->factor.stage == NEBEL_STAGE_VERTEX;
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
    const nb_batch_surface *surface = &frame->renderer->geometry.surfaces[hits->surface[lane]];
    const uint32_t *index = surface->mesh->indices + 3 * (size_t)hits->triangle[lane];
    const nb_vertex_fog *fog = frame->renderer->vertex_fog + surface->first_vertex;
    const nb_vertex_fog *a = &fog[index[0]], *b = &fog[index[1]], *c = &fog[index[2]];
    const float u = hits->u[lane], v = hits->v[lane], w = 1 - u - v;
    nb_vertex_fog mean = {{0, 0, 0}, w * a->alpha + u * b->alpha + v * c->alpha};
    for (int k = 0; k < 3; k++) mean.color[k] = fmaxf(w * a->color[k] + u * b->color[k] + v * c->color[k], 0);
    return mean;
}

/* ---- per pixel ------------------------------------------------------------------------------- */

static nb_vertex_fog fog_of_pixel(const nb_frame *frame, const nb_ray_batch *rays, const nb_hits *hits, int lane)
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

static nb_vertex_fog fog_of_lane(const nb_frame *frame, const nb_scratch *scratch, int lane)
{
    const nebel_renderer *renderer = frame->renderer;
    if (!is_per_vertex(renderer)) return fog_of_pixel(frame, &scratch->rays, &scratch->hits, lane);
    const nb_vertex_fog fog = interpolate(frame, &scratch->hits, lane);
    const int is_coordinate = is_by_user(renderer) && renderer->factor.stage == NEBEL_STAGE_PIXEL;
    return is_coordinate ? fog_of_coordinate(&renderer->factor, (double)fog.alpha) : fog;
}

void nb_classic_fog_trace(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    const int adds = frame->renderer->method == NEBEL_METHOD_ADDITIVE;
    for (int i = 0; i < NB_BATCH; i++) {
        nb_vertex_fog fog = {{0, 0, 0}, 0};
        if (scratch->inside[i] && scratch->hits.surface[i] != NB_NONE) fog = fog_of_lane(frame, scratch, i);
        for (int c = 0; c < 3; c++) {
            /* Rounding, also of weights at edges, leaves the range. */
            samples->transmittance[c][i] = adds ? 1 : fminf(fmaxf(1 - fog.alpha, 0), 1);
            samples->in_scattering[c][i] = fog.color[c];
        }
        samples->error[i] = 0;
    }
}

void nb_classic_fog_blend(const nb_light_samples *fog, nb_light_samples *samples)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < NB_BATCH; i++) {
            const double left = (double)fog->transmittance[c][i], surface = (double)samples->color[c][i];
            const double stored = left * nb_device_store(surface) + (double)fog->in_scattering[c][i];
            samples->color[c][i] = (float)nb_device_restore(stored);
        }
}
