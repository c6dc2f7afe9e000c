/* Cells fog what is drawn, as an alpha polygon over each surface: alpha and colour at its vertices, linear in between
 * as Gouraud's interpolation is, with perspective. Where nothing is drawn there is no fog. */
#include "cell_fog.h"

#include <math.h>

/* The camera as cells want it. Orthographic rays begin in the camera's plane, beside its position; a panorama has no
 * axis but each ray itself. */
static nebel_cell_view view_towards(const nb_view *camera, const double place[3], int ignore_walls)
{
    nebel_cell_view view = {.ignore_walls = ignore_walls};
    double depth = 0;
    for (int i = 0; i < 3; i++) {
        view.eye[i] = camera->position[i];
        view.forward[i] = camera->forward[i];
        depth += (place[i] - camera->position[i]) * camera->forward[i];
    }
    for (int i = 0; i < 3; i++) {
        if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) view.eye[i] = place[i] - depth * camera->forward[i];
        if (camera->projection == NEBEL_PROJECTION_PANORAMA) view.forward[i] = place[i] - camera->position[i];
    }
    return view;
}

/* A place that is none, or is the eye, has no fog. */
static nb_vertex_fog fog_at(const nb_frame *frame, const double place[3])
{
    const int is_vertex = frame->renderer->cell_stage == NEBEL_CELLS_PER_VERTEX;
    const nebel_cell_view view = view_towards(&frame->view, place, is_vertex);
    const nebel_cell_point point = {.position = {place[0], place[1], place[2]}};
    nebel_cell_fog fog;
    if (nebel_fog_cells(frame->renderer->cells, &view, 1, &point, 0, &fog, 0) != NEBEL_OK)
        return (nb_vertex_fog){{0, 0, 0}, 0};
    return (nb_vertex_fog){{(float)fog.color[0], (float)fog.color[1], (float)fog.color[2]}, (float)fog.alpha};
}

/* ---- per vertex ------------------------------------------------------------------------------ */

static void set_surface(const nb_frame *frame, const nb_surface *surface)
{
    const nebel_mesh *mesh = surface->mesh;
    nb_vertex_fog *fog = frame->renderer->vertex_fog + surface->first_vertex;
#pragma omp parallel for schedule(static) num_threads(frame->renderer->threads)
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        double place[3];
        for (size_t i = 0; i < 3; i++) place[i] = mesh->origin[i] + (double)mesh->positions[3 * (size_t)v + i];
        fog[v] = fog_at(frame, place);
    }
}

void nb_cell_fog_set_vertices(const nb_frame *frame)
{
    const nb_geometry *geometry = &frame->renderer->geometry;
    for (size_t i = 0; i < geometry->surface_count; i++) set_surface(frame, &geometry->surfaces[i]);
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

void nb_cell_fog_trace(const nb_frame *frame, nb_scratch *scratch)
{
    nb_light_samples *samples = &scratch->samples;
    const nb_hits *hits = &scratch->hits;
    for (int i = 0; i < NB_BATCH; i++) {
        nb_vertex_fog fog = {{0, 0, 0}, 0};
        if (scratch->inside[i] && hits->surface[i] != NB_NONE)
            fog = frame->renderer->cell_stage == NEBEL_CELLS_PER_VERTEX ? interpolate(frame, hits, i)
                                                                        : fog_of_pixel(frame, &scratch->rays, hits, i);
        for (int c = 0; c < 3; c++) {
            samples->transmittance[c][i] = 1 - fog.alpha;
            samples->in_scattering[c][i] = fog.color[c];
        }
        samples->error[i] = 0;
    }
}
