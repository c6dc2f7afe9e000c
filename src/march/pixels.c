/* Fog over a finished picture: a few boxes of one colour take the stream kernel, everything else the march. */
#include "boxes.h"

#include "base/cpu.h"
#include "base/levels.h"
#include "kernels/pixels.h"

#include <math.h>
#include <string.h>

#define KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_pixels_##suffix,
static nb_pixels_fn *const kernels[NEBEL_ISA_COUNT + 1] = {NB_LEVELS(KERNEL)};

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

static const char *fault_of(const nebel_pixels *p)
{
    if (p->depth == NULL || p->color == NULL || p->out == NULL) return "depth, color and out must not be NULL";
    if (p->width < 1 || p->width > 65536 || p->height < 1 || p->height > 65536)
        return "width and height must be 1 to 65536";
    const size_t row = 4 * (size_t)p->width;
    if ((p->depth_pitch != 0 && p->depth_pitch < row) || (p->color_pitch != 0 && p->color_pitch < row) ||
        (p->out_pitch != 0 && p->out_pitch < row))
        return "a pitch is shorter than a row";
    if (p->first_row >= p->height || p->row_count > p->height - p->first_row) return "the rows are not in the picture";
    if (p->depth_type != NEBEL_DEPTH_AXIS && p->depth_type != NEBEL_DEPTH_RAY) return "depth_type is unknown";
    return fault_of_rays(p);
}

static nb_pixels_job make_job(const nebel_pixels *p)
{
    const size_t row = 4 * (size_t)p->width;
    nb_pixels_job job = {.along_ray = p->depth_type == NEBEL_DEPTH_RAY,
                         .width = p->width,
                         .first_row = p->first_row,
                         .row_count = p->row_count != 0 ? p->row_count : p->height - p->first_row,
                         .depth = (const unsigned char *)p->depth,
                         .color = p->color,
                         .out = p->out,
                         .depth_pitch = p->depth_pitch != 0 ? p->depth_pitch : row,
                         .color_pitch = p->color_pitch != 0 ? p->color_pitch : row,
                         .out_pitch = p->out_pitch != 0 ? p->out_pitch : row};
    memcpy(job.corner, p->corner, sizeof job.corner);
    memcpy(job.step_x, p->step_x, sizeof job.step_x);
    memcpy(job.step_y, p->step_y, sizeof job.step_y);
    return job;
}

/* ---- through the march ----------------------------------------------------------------------- */

enum { BATCH = 64 };

/* A ray of no length where there is no way or no depth. */
static nebel_ray ray_of_pixel(const nebel_pixels *p, const nb_pixels_job *job, uint32_t x, uint32_t y, float depth)
{
    nebel_ray ray = {.origin = {p->eye[0], p->eye[1], p->eye[2]}, .direction = {1, 0, 0}};
    double way[3], square = 0;
    for (int c = 0; c < 3; c++) {
        way[c] = (double)job->corner[c] + x * (double)job->step_x[c] + y * (double)job->step_y[c];
        square += way[c] * way[c];
    }
    if (!(depth > 0) || !(square > 0)) return ray;
    memcpy(ray.direction, way, sizeof way);
    ray.t_max = job->along_ray ? (double)depth : (double)depth * sqrt(square);
    return ray;
}

static unsigned char byte_of(double light)
{
    return (unsigned char)(fmin(fmax(light, 0), 255) + .5);
}

static void blend(const nebel_light *light, const unsigned char *color, unsigned char *out)
{
    for (int c = 0; c < 3; c++) out[c] = byte_of(light->transmittance[c] * color[c] + 255 * light->in_scattering[c]);
    out[3] = color[3];
}

static nebel_result trace_batch(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, const nebel_pixels *p,
                                const nb_pixels_job *job, uint32_t y, uint32_t first)
{
    nebel_ray rays[BATCH];
    nebel_light lights[BATCH];
    const uint32_t count = job->width - first < BATCH ? job->width - first : BATCH;
    const unsigned char *depths = job->depth + y * job->depth_pitch, *colors = job->color + y * job->color_pitch;
    unsigned char *out = job->out + y * job->out_pitch;
    for (uint32_t i = 0; i < count; i++) {
        float depth;
        memcpy(&depth, depths + 4 * (size_t)(first + i), sizeof depth);
        rays[i] = ray_of_pixel(p, job, first + i, y, depth);
    }
    const nebel_result result = nebel_trace(snapshot, desc, count, rays, sizeof *rays, lights, sizeof *lights);
    if (result != NEBEL_OK) return result;
    for (uint32_t i = 0; i < count; i++)
        blend(&lights[i], colors + 4 * (size_t)(first + i), out + 4 * (size_t)(first + i));
    return NEBEL_OK;
}

static nebel_result trace_pixels(const nebel_snapshot *snapshot, nebel_isa isa, const nebel_pixels *p,
                                 const nb_pixels_job *job)
{
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = isa};
    for (uint32_t y = job->first_row; y < job->first_row + job->row_count; y++)
        for (uint32_t first = 0; first < job->width; first += BATCH) {
            const nebel_result result = trace_batch(snapshot, &desc, p, job, y, first);
            if (result != NEBEL_OK) return result;
        }
    return NEBEL_OK;
}

/* ---- the public query ------------------------------------------------------------------------ */

static void set_radiance(const nebel_snapshot *snapshot, nb_pixels_job *job)
{
    for (int c = 0; c < 3 && snapshot->medium_count > 0; c++) {
        const double radiance = fmin(snapshot->media[0].radiance[c], 1);
        job->radiance[c] = (uint32_t)(radiance * NB_PIXEL_WHITE + .5);
    }
}

nebel_result nebel_fog_pixels(const nebel_snapshot *snapshot, nebel_isa isa, const nebel_pixels *pixels)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    const char *fault = pixels != NULL ? fault_of(pixels) : "must not be NULL";
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "pixels: %s", fault);
    nb_pixels_fn *kernel = kernels[nb_cpu_choose(isa)];
    if (kernel == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_UNSUPPORTED, "instruction set %s: not available here",
                       nebel_isa_name(isa));
    nb_pixels_job job = make_job(pixels);
    nb_fog_box boxes[NB_FOG_BOXES];
    if (!nb_boxes_have_one_color(snapshot) || !nb_boxes_list(snapshot, pixels->eye, 0, 0, boxes))
        return trace_pixels(snapshot, isa, pixels, &job);
    set_radiance(snapshot, &job);
    job.boxes = boxes;
    job.box_count = snapshot->medium_count;
    kernel(&job);
    return NEBEL_OK;
}
