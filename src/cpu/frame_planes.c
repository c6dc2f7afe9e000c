/* From batches in blocks of 4 x 4 to the rows of the caller's planes. */
#include "cpu_renderer.h"

#include <math.h>

/* A part of the window. */
typedef struct nb_area {
    uint32_t left, top, columns, rows;
} nb_area;

static nb_area area_of(const nb_frame *frame, const nb_batch_place *place)
{
    const nebel_window *window = &frame->window;
    const uint32_t left = place->left - window->left, top = place->top + nb_lane_y(place->first) - window->top;
    return (nb_area){left, top, nb_lesser(NB_REGION, window->width - left), nb_lesser(NB_BLOCK, window->height - top)};
}

/* Lane of a pixel in its batch: the inverse of nb_lane_x and nb_lane_y. */
static uint32_t batch_lane(uint32_t x, uint32_t y)
{
    return x / NB_BLOCK * NB_PACKET + y * NB_BLOCK + x % NB_BLOCK;
}

static void set_vectors(float *plane, uint32_t width, const nb_area *area, const float (*v)[NB_BATCH])
{
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = plane + 3 * ((size_t)(area->top + y) * width + area->left);
        const uint32_t first = batch_lane(0, y);
        for (uint32_t x = 0; x < area->columns; x++) {
            const uint32_t i = first + x / NB_BLOCK * NB_PACKET + x % NB_BLOCK;
            row[3 * x] = v[0][i];
            row[3 * x + 1] = v[1][i];
            row[3 * x + 2] = v[2][i];
        }
    }
}

static void add_vectors(float *plane, uint32_t width, const nb_area *area, int is_first, const float (*v)[NB_BATCH])
{
    if (is_first) {
        set_vectors(plane, width, area, v);
        return;
    }
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = plane + 3 * ((size_t)(area->top + y) * width + area->left);
        const uint32_t first = batch_lane(0, y);
        for (uint32_t x = 0; x < area->columns; x++) {
            const uint32_t i = first + x / NB_BLOCK * NB_PACKET + x % NB_BLOCK;
            row[3 * x] += v[0][i];
            row[3 * x + 1] += v[1][i];
            row[3 * x + 2] += v[2][i];
        }
    }
}

static void add_normals(float *plane, uint32_t width, const nb_area *area, int is_first, const nb_scratch *scratch)
{
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = plane + 3 * ((size_t)(area->top + y) * width + area->left);
        for (uint32_t x = 0; x < area->columns; x++) {
            const uint32_t i = batch_lane(x, y);
            const int hit = scratch->hits.surface[i] != NB_NONE;
            for (uint32_t c = 0; c < 3; c++) {
                row[3 * x + c] = (is_first ? 0 : row[3 * x + c]) + (hit ? scratch->points.normal[c][i] : 0);
            }
        }
    }
}

static void widen_errors(float *plane, uint32_t width, const nb_area *area, int is_first, const float *error)
{
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = plane + (size_t)(area->top + y) * width + area->left;
        for (uint32_t x = 0; x < area->columns; x++) {
            const float e = error[batch_lane(x, y)];
            row[x] = is_first || e > row[x] ? e : row[x];
        }
    }
}

static void add_depths(const nb_frame *frame, const nb_area *area, int is_first, const nb_scratch *scratch,
                       uint32_t *counts)
{
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = frame->planes->depth + (size_t)(area->top + y) * frame->window.width + area->left;
        for (uint32_t x = 0; x < area->columns; x++) {
            const uint32_t i = batch_lane(x, y);
            const int hit = scratch->hits.surface[i] != NB_NONE;
            const float t = (float)(frame->view.advance * (double)scratch->rays.length[i]) + scratch->hits.t[i];
            row[x] = (is_first ? 0 : row[x]) + (hit ? t : 0);
            counts[i] = (is_first ? 0 : counts[i]) + (hit ? 1 : 0);
        }
    }
}

void nb_planes_add(const nb_frame *frame, const nb_batch_place *place, int is_first, nb_scratch *scratch)
{
    const nebel_frame *planes = frame->planes;
    const nb_light_samples *samples = &scratch->samples;
    const nb_area area = area_of(frame, place);
    const uint32_t width = frame->window.width;
    if (planes->color != NULL) add_vectors(planes->color, width, &area, is_first, samples->color);
    if (planes->transmittance != NULL)
        add_vectors(planes->transmittance, width, &area, is_first, samples->transmittance);
    if (planes->in_scattering != NULL)
        add_vectors(planes->in_scattering, width, &area, is_first, samples->in_scattering);
    if (planes->normal != NULL) add_normals(planes->normal, width, &area, is_first, scratch);
    if (planes->error != NULL) widen_errors(planes->error, width, &area, is_first, samples->error);
    if (planes->depth != NULL) add_depths(frame, &area, is_first, scratch, scratch->hit_counts + place->first);
}

static void scale(float *plane, uint32_t width, const nb_area *area, size_t channels, float factor)
{
    if (plane == NULL) return;
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = plane + channels * ((size_t)(area->top + y) * width + area->left);
        for (size_t x = 0; x < channels * area->columns; x++) row[x] *= factor;
    }
}

static void divide_depths(const nb_frame *frame, const nb_area *area, const uint32_t *counts)
{
    for (uint32_t y = 0; y < area->rows; y++) {
        float *row = frame->planes->depth + (size_t)(area->top + y) * frame->window.width + area->left;
        for (uint32_t x = 0; x < area->columns; x++) {
            const uint32_t count = counts[batch_lane(x, y)];
            row[x] = count > 0 ? row[x] / (float)count : INFINITY;
        }
    }
}

void nb_planes_finish(const nb_frame *frame, const nb_batch_place *place, const nb_scratch *scratch)
{
    const nebel_frame *planes = frame->planes;
    const nb_area area = area_of(frame, place);
    if (planes->depth != NULL) divide_depths(frame, &area, scratch->hit_counts + place->first);
    if (frame->sample_count == 1) return;
    const float factor = 1 / (float)frame->sample_count;
    scale(planes->color, frame->window.width, &area, 3, factor);
    scale(planes->transmittance, frame->window.width, &area, 3, factor);
    scale(planes->in_scattering, frame->window.width, &area, 3, factor);
    scale(planes->normal, frame->window.width, &area, 3, factor);
}
