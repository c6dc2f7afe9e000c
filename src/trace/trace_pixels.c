/* Fog over a finished picture: a few boxes of one colour over bytes take the stream kernel, one fog everywhere its closed form,
 * everything else the march. */
#include "box_fog.h"

#include "base/isa.h"
#include "base/isa_list.h"
#include "stream/picture_kernel.h"
#include "stream/pixel_kernel.h"

#include <math.h>
#include <string.h>

#define BOXES(NAME, suffix) [NEBEL_ISA_##NAME] = nb_pixels_##suffix,
static nb_pixels_fn *const box_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(BOXES)};

#define PICTURE(NAME, suffix) [NEBEL_ISA_##NAME] = nb_picture_##suffix,
static nb_picture_fn *const picture_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(PICTURE)};

/* ---- kinds of pixels ------------------------------------------------------------------------- */

typedef struct kind {
    unsigned char channels, sample_size, is_whole;
} kind;

static const kind kinds[NEBEL_PIXEL_COUNT] = {
    [NEBEL_PIXEL_RGBA8] = {4, 1, 1},      [NEBEL_PIXEL_RGB8] = {3, 1, 1},      [NEBEL_PIXEL_RGBA16] = {4, 2, 1},
    [NEBEL_PIXEL_RGB16] = {3, 2, 1},      [NEBEL_PIXEL_RGBA_HALF] = {4, 2, 0}, [NEBEL_PIXEL_RGB_HALF] = {3, 2, 0},
    [NEBEL_PIXEL_RGBA_FLOAT] = {4, 4, 0}, [NEBEL_PIXEL_RGB_FLOAT] = {3, 4, 0},
};

static int is_known(nebel_pixel_type type)
{
    return (unsigned)type < NEBEL_PIXEL_COUNT;
}

size_t nebel_pixel_size(nebel_pixel_type type)
{
    return is_known(type) ? (size_t)kinds[type].channels * kinds[type].sample_size : 0;
}

/* ---- checks ---------------------------------------------------------------------------------- */

static const char *fault_of_rays(const nebel_pixels *p)
{
    for (int c = 0; c < 3; c++) {
        if (!(fabs(p->eye[c]) <= NEBEL_MAX_LENGTH)) return "eye must be finite and at most 1e15 m away";
        if (!(fabsf(p->corner[c]) <= 1e15f) || !(fabsf(p->step_x[c]) <= 1e15f) || !(fabsf(p->step_y[c]) <= 1e15f))
            return "corner, step_x and step_y must be finite and at most 1e15";
    }
    return NULL;
}

/* Whether rows lie within their pitch and on the boundaries of their numbers. */
static const char *fault_of_pitches(const nebel_pixels *p)
{
    const size_t row = p->width * nebel_pixel_size(p->type), number = kinds[p->type].sample_size;
    if ((p->depth_pitch != 0 && p->depth_pitch < 4 * (size_t)p->width) ||
        (p->color_pitch != 0 && p->color_pitch < row) || (p->output_pitch != 0 && p->output_pitch < row) ||
        (p->transmittance_pitch != 0 && p->transmittance_pitch < 12 * (size_t)p->width))
        return "a pitch is shorter than a row";
    if (p->transmittance_pitch % sizeof(float) != 0) return "transmittance_pitch must be a multiple of 4";
    if (p->color_pitch % number != 0 || p->output_pitch % number != 0)
        return "the pitches of color and out must be multiples of the size of a sample";
    return NULL;
}

static const char *fault_of(const nebel_pixels *p)
{
    if (p->depth == NULL || p->color == NULL || p->output == NULL) return "depth, color and out must not be NULL";
    if (p->width < 1 || p->width > 65536 || p->height < 1 || p->height > 65536)
        return "width and height must be 1 to 65536";
    if (!is_known(p->type)) return "type is unknown";
    if (p->srgb && !kinds[p->type].is_whole) return "srgb must be 0 where samples are floats, which are light";
    if (p->first_row >= p->height || p->row_count > p->height - p->first_row) return "the rows are not in the picture";
    if (p->depth_type != NEBEL_PIXEL_DEPTH_AXIAL && p->depth_type != NEBEL_PIXEL_DEPTH_RADIAL)
        return "depth_type is unknown";
    const char *fault = fault_of_pitches(p);
    return fault != NULL ? fault : fault_of_rays(p);
}

/* ---- the ways of boxes over bytes ------------------------------------------------------------ */

static size_t pitch_of(size_t given, size_t row)
{
    return given != 0 ? given : row;
}

static uint32_t end_row(const nebel_pixels *p)
{
    return p->row_count != 0 ? p->first_row + p->row_count : p->height;
}

static void set_radiance(const nebel_lighting *lighting, nb_pixels_job *job)
{
    for (int c = 0; c < 3 && lighting->snapshot->medium_count > 0; c++) {
        const double radiance = fmin(lighting->media[0].radiance[c], 1);
        job->radiance[c] = (uint32_t)(radiance * NB_PIXEL_WHITE + .5);
    }
}

static void fog_boxes(const nebel_lighting *lighting, nb_pixels_fn *kernel, const nebel_pixels *p,
                      const nb_fog_box *boxes)
{
    const size_t row = 4 * (size_t)p->width;
    nb_pixels_job job = {.boxes = boxes,
                         .box_count = lighting->snapshot->medium_count,
                         .along_ray = p->depth_type == NEBEL_PIXEL_DEPTH_RADIAL,
                         .width = p->width,
                         .first_row = p->first_row,
                         .row_count = end_row(p) - p->first_row,
                         .depth = (const unsigned char *)p->depth,
                         .color = p->color,
                         .out = p->output,
                         .depth_pitch = pitch_of(p->depth_pitch, row),
                         .color_pitch = pitch_of(p->color_pitch, row),
                         .out_pitch = pitch_of(p->output_pitch, row)};
    memcpy(job.corner, p->corner, sizeof job.corner);
    memcpy(job.step_x, p->step_x, sizeof job.step_x);
    memcpy(job.step_y, p->step_y, sizeof job.step_y);
    set_radiance(lighting, &job);
    kernel(&job);
}

/* ---- pieces of rows -------------------------------------------------------------------------- */

enum { PIECE = NB_PICTURE_PIECE };

/* A piece of a row, as it goes to the kernel and through the march. */
typedef struct piece {
    const nebel_pixels *pixels;
    const nebel_snapshot *snapshot;
    nebel_isa isa;
    nb_picture_fn *kernel;
    nb_picture_haze *haze; /* NULL: the march */
    uint32_t x, y, count;
} piece;

static const unsigned char *depth_of(const piece *at)
{
    const nebel_pixels *p = at->pixels;
    return (const unsigned char *)p->depth + at->y * pitch_of(p->depth_pitch, 4 * (size_t)p->width) + 4 * (size_t)at->x;
}

static nb_picture_job make_job(const piece *at)
{
    const nebel_pixels *p = at->pixels;
    const size_t size = nebel_pixel_size(p->type), row = size * p->width, kept = 3 * sizeof(float);
    nb_picture_job job = {.type = p->type,
                          .srgb = p->srgb,
                          .count = at->count,
                          .color =
                              (const unsigned char *)p->color + at->y * pitch_of(p->color_pitch, row) + at->x * size,
                          .out = (unsigned char *)p->output + at->y * pitch_of(p->output_pitch, row) + at->x * size,
                          .haze = at->haze};
    if (p->transmittance != NULL)
        job.kept = (unsigned char *)p->transmittance + at->y * pitch_of(p->transmittance_pitch, kept * p->width) +
                   at->x * kept;
    return job;
}

/* Rays in planes, and their light; each as long as the kernel wants them. */
typedef struct planes {
    double direction[3][PIECE];
    float t_max[PIECE], transmittance[3][PIECE], in_scattering[3][PIECE];
} planes;

/* A ray of no length where there is no way or no depth. */
static void set_ray(const nebel_pixels *p, uint32_t x, uint32_t y, float depth, planes *all, uint32_t i)
{
    double square = 0;
    for (int c = 0; c < 3; c++) {
        const double way = (double)p->corner[c] + x * (double)p->step_x[c] + y * (double)p->step_y[c];
        all->direction[c][i] = way;
        square += way * way;
    }
    all->t_max[i] = 0;
    if (!(depth > 0) || !(square > 0)) return;
    all->t_max[i] = p->depth_type == NEBEL_PIXEL_DEPTH_RADIAL ? depth : (float)((double)depth * sqrt(square));
}

static nebel_result trace_piece(const piece *at)
{
    planes all = {0};
    const nebel_pixels *p = at->pixels;
    const unsigned char *depths = depth_of(at);
    for (uint32_t i = 0; i < at->count; i++) {
        float depth;
        memcpy(&depth, depths + 4 * (size_t)i, sizeof depth);
        set_ray(p, at->x + i, at->y, depth, &all, i);
    }
    nb_picture_job job = make_job(at);
    nebel_ray_planes rays = {.origin = {p->eye[0], p->eye[1], p->eye[2]}, .t_max = all.t_max};
    nebel_transfer_planes transfers = {0};
    for (int c = 0; c < 3; c++) {
        rays.direction_double[c] = all.direction[c];
        job.transmittance[c] = transfers.transmittance[c] = all.transmittance[c];
        job.in_scattering[c] = transfers.in_scattering[c] = all.in_scattering[c];
    }
    const nebel_result result =
        nebel_trace_planes(at->snapshot, &(nebel_trace_desc){.lighting = at->pixels->lighting, .isa = at->isa},
                           at->count, &rays, &transfers);
    if (result == NEBEL_OK) at->kernel(&job);
    return result;
}

static nebel_result haze_piece(const piece *at)
{
    at->haze->first = at->x;
    at->haze->depth = depth_of(at);
    const nb_picture_job job = make_job(at);
    at->kernel(&job);
    return NEBEL_OK;
}

/* Splits the way at depth 1 into a part along the row and a part across it: the sum of their squares cancels nothing. A step
 * too small to change the way counts as 0. */
static void aim_row(const nebel_pixels *p, uint32_t y, nb_picture_haze *haze)
{
    double square = 0, along = 0, step = 0;
    for (int c = 0; c < 3; c++) {
        const double corner = (double)p->corner[c] + y * (double)p->step_y[c], step_x = (double)p->step_x[c];
        square += corner * corner;
        along += corner * step_x;
        step += step_x * step_x;
    }
    const int is_still = !(step > 1e-26 * square);
    haze->nearest_x = is_still ? 0 : (float)(-along / step);
    haze->nearest = (float)(is_still ? square : fmax(square - along * along / step, 0));
    haze->growth = is_still ? 0 : (float)step;
}

static nebel_result fog_pieces(piece *at)
{
    const nebel_pixels *p = at->pixels;
    for (at->y = p->first_row; at->y < end_row(p); at->y++) {
        if (at->haze != NULL) aim_row(p, at->y, at->haze);
        for (at->x = 0; at->x < p->width; at->x += PIECE) {
            at->count = p->width - at->x < PIECE ? p->width - at->x : PIECE;
            const nebel_result result = at->haze != NULL ? haze_piece(at) : trace_piece(at);
            if (result != NEBEL_OK) return result;
        }
    }
    return NEBEL_OK;
}

static nb_picture_haze make_haze(const nebel_lighting *lighting, const nebel_pixels *p)
{
    const double ln2 = 0.69314718055994531, most = 1e30; /* 0 times it is 0 */
    const nb_medium *medium = &lighting->snapshot->media[0];
    nb_picture_haze haze = {.octaves = (float)(-fmin(medium->body.extinction[0], most) / ln2),
                            .along_ray = p->depth_type == NEBEL_PIXEL_DEPTH_RADIAL};
    for (int c = 0; c < 3; c++) haze.radiance[c] = (float)lighting->media[0].radiance[c];
    return haze;
}

/* ---- the public query ------------------------------------------------------------------------ */

nebel_result nebel_apply_fog_to_pixels(const nebel_snapshot *snapshot, nebel_isa isa, const nebel_pixels *pixels)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    const char *fault = pixels != NULL ? fault_of(pixels) : "must not be NULL";
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "pixels: %s", fault);
    const nebel_lighting *lighting = nb_lighting_of(snapshot, pixels->lighting);
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_isa chosen = nb_isa_select(isa);
    if (box_kernels[chosen] == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_UNSUPPORTED, "instruction set %s: not available here",
                       nebel_isa_name(isa));
    const int is_plain = pixels->type == NEBEL_PIXEL_RGBA8 && !pixels->srgb && pixels->transmittance == NULL;
    nb_fog_box boxes[NB_FOG_BOXES];
    if (is_plain && nb_boxes_have_one_color(lighting) && nb_boxes_list(snapshot, pixels->eye, 0, 0, boxes)) {
        fog_boxes(lighting, box_kernels[chosen], pixels, boxes);
        return NEBEL_OK;
    }
    piece all = {.pixels = pixels, .snapshot = snapshot, .isa = isa, .kernel = picture_kernels[chosen]};
    nb_picture_haze haze;
    if (nb_boxes_are_haze(lighting)) {
        haze = make_haze(lighting, pixels);
        all.haze = &haze;
    }
    return fog_pieces(&all);
}
