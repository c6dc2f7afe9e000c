/* Fog per vertex: blocks of vertices become transmittances, by the stream kernel where the fog is a few boxes and by
 * the march where it is not; a second kernel makes of those what the program's vertices hold. A block stays in the
 * nearest cache between both. */
#include <nebel/classic.h>

#include "base/base.h"
#include "base/isa.h"
#include "base/isa_list.h"
#include "base/stream_layout.h"
#include "stream/segment_kernel.h"
#include "stream/vertex_kernel.h"
#include "trace/box_fog.h"

#include <float.h>
#include <math.h>
#include <string.h>

_Static_assert((int)NEBEL_CURVE_TABLE == (int)NB_CURVE_TABLE && (int)NEBEL_VERTEX_ALPHA == (int)NB_VERTEX_ALPHA,
               "the kernel's lists are those of the public face");

#define TRANSMIT(NAME, suffix) [NEBEL_ISA_##NAME] = nb_transmit_##suffix,
#define WRITE(NAME, suffix) [NEBEL_ISA_##NAME] = nb_vertices_##suffix,
static nb_transmit_fn *const transmit_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(TRANSMIT)};
static nb_vertices_fn *const write_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(WRITE)};

/* ---- descriptions ---------------------------------------------------------------------------- */

nebel_result nebel_resolve_vertex_desc(const nebel_vertex_desc *desc, nebel_vertex_desc *resolved)
{
    if (desc == NULL || resolved == NULL || (unsigned)desc->isa >= NEBEL_ISA_COUNT) return NEBEL_ERROR_ARGUMENT;
    if (desc->channel < 0 || desc->channel > 2 || (unsigned)desc->curve >= NEBEL_CURVE_COUNT)
        return NEBEL_ERROR_ARGUMENT;
    if (desc->curve == NEBEL_CURVE_TABLE && desc->table == NULL) return NEBEL_ERROR_ARGUMENT;
    for (int c = 0; c < 3 && desc->color != NULL; c++)
        if (!(desc->color[c] >= 0 && desc->color[c] <= (double)FLT_MAX)) return NEBEL_ERROR_VALUE;
    if (!(desc->coordinate_end >= 0 && desc->coordinate_end <= (double)FLT_MAX)) return NEBEL_ERROR_VALUE;
    *resolved = *desc;
    if (desc->coordinate_end == 0) resolved->coordinate_end = 100;
    return NEBEL_OK;
}

/* ---- a call ---------------------------------------------------------------------------------- */

/* What holds for all blocks of a call. */
typedef struct call {
    const nebel_snapshot *snapshot;
    const nebel_lighting *lighting; /* of it */
    nebel_isa level;                /* chosen */
    nebel_vertex_desc desc;
    nebel_vertices vertices;
    float start[3];   /* the eye from the origin of the positions */
    int by_boxes;     /* the fog is `boxes`, and where its light is wanted it has one color */
    int traces_light; /* the march gives light, too */
    float color[3];   /* of the light where it is the amount of fog times a color */
    nb_fog_box boxes[NB_FOG_BOXES];
} call;

/* Numbers of a block, and the directions of its rays. */
typedef struct nb_vertex_block {
    size_t first, count;
    float points[3 * NB_VERTEX_BLOCK];
    float factor[NB_VERTEX_BLOCK];
    float direction[3][NB_VERTEX_BLOCK], t_max[NB_VERTEX_BLOCK];
    float light[3][NB_VERTEX_BLOCK];
} nb_vertex_block;

/* Bytes; of longer ones most is not read. */
enum { LONGEST_STRUCTURE = 256 };

static const unsigned char *position_at(const nebel_vertices *vertices, size_t i)
{
    return (const unsigned char *)vertices->positions + i * vertices->position_stride;
}

/* The block's positions one after the other: where they are, or copied. */
static const float *gather_points(const nebel_vertices *vertices, nb_vertex_block *b)
{
    const size_t size = 3 * sizeof(float), stride = vertices->position_stride;
    const unsigned char *from = position_at(vertices, b->first);
    if (stride == size && (uintptr_t)from % _Alignof(float) == 0) return (const float *)(const void *)from;
    for (size_t i = 0; i < b->count; i++, from += stride) {
        memcpy(b->points + 3 * i, from, size);
    }
    return b->points;
}

/* ---- through the march ----------------------------------------------------------------------- */

/* Rays that nothing is asked of where the vertex is at the eye, no place, or beyond all reach. */
static void set_ray(const call *c, const float point[3], nb_vertex_block *b, size_t i)
{
    double way[3], square = 0;
    for (int k = 0; k < 3; k++) {
        way[k] = (c->vertices.origin[k] - c->vertices.eye[k]) + (double)point[k];
        square += way[k] * way[k];
    }
    const int is_way = square > 0 && square < 1e60;
    for (int k = 0; k < 3; k++) b->direction[k][i] = is_way ? (float)way[k] : 0;
    b->t_max[i] = is_way ? (float)sqrt(square) : 0;
}

static nebel_result trace_block(const call *c, nb_vertex_block *b)
{
    const float *const points = gather_points(&c->vertices, b);
    for (size_t i = 0; i < b->count; i++) set_ray(c, points + 3 * i, b, i);
    nebel_ray_planes rays = {.t_max = b->t_max};
    nebel_transfer_planes transfers = {0};
    transfers.transmittance[c->desc.channel] = b->factor;
    for (int k = 0; k < 3; k++) {
        rays.origin[k] = c->vertices.eye[k];
        rays.direction_float[k] = b->direction[k];
        if (c->traces_light) transfers.in_scattering[k] = b->light[k];
    }
    return nebel_trace_planes(c->snapshot, &(nebel_trace_desc){.lighting = c->lighting, .isa = c->desc.isa}, b->count,
                              &rays, &transfers);
}

/* ---- blocks ---------------------------------------------------------------------------------- */

/* Structures are so much memory that the next block's are asked for while this one's fog is found. */
static void transmit_block(const call *c, nb_vertex_block *b)
{
    const size_t stride = c->vertices.position_stride;
    nb_transmit_job job = {.boxes = c->boxes,
                           .box_count = c->snapshot->medium_count,
                           .count = b->count,
                           .from = c->start,
                           .to = gather_points(&c->vertices, b),
                           .to_stride = 3 * sizeof(float),
                           .out_stride = sizeof(float),
                           .out = b->factor,
                           .next_stride = stride};
    if (stride != job.to_stride && stride <= LONGEST_STRUCTURE)
        job.next = (const void *)((uintptr_t)position_at(&c->vertices, b->first) + b->count * stride);
    transmit_kernels[c->level](&job);
}

/* A last packet reaches beyond the vertices, and is to find numbers there. */
static void pad(const call *c, nb_vertex_block *b)
{
    enum { LANES = 16 };
    for (size_t i = b->count; i % LANES != 0; i++) {
        b->factor[i] = 1;
        for (int k = 0; k < 3 && c->traces_light; k++) b->light[k][i] = 0;
    }
}

static nebel_result find_factors(const call *c, nb_vertex_block *b)
{
    nebel_result result = NEBEL_OK;
    if (c->by_boxes)
        transmit_block(c, b);
    else
        result = trace_block(c, b);
    pad(c, b);
    return result;
}

/* After the first stream the factors have the curve in them. */
static void write_block(const call *c, const nebel_vertex_output *outputs, size_t output_count, nb_vertex_block *b)
{
    nb_vertices_job job = {.count = b->count,
                           .factor = b->factor,
                           .curve = (nb_curve_kind)c->desc.curve,
                           .table = c->desc.table,
                           .coordinate_end = (float)c->desc.coordinate_end};
    for (int k = 0; k < 3; k++) {
        job.color[k] = c->color[k];
        job.light[k] = c->traces_light ? b->light[k] : NULL;
    }
    for (size_t i = 0; i < output_count; i++) {
        job.kind = (nb_vertex_kind)outputs[i].format;
        job.stride = nb_layout_stride(&outputs[i]);
        job.data = (unsigned char *)outputs[i].data + b->first * job.stride;
        write_kernels[c->level](&job);
        job.curve = NB_CURVE_PHYSICAL;
    }
}

/* Small blocks of structures, so that those of the next one have room in the nearest cache, too. */
static size_t most_in_block(const call *c)
{
    return c->vertices.position_stride == 3 * sizeof(float) ? NB_VERTEX_BLOCK : NB_VERTEX_BLOCK / 4;
}

static nebel_result run(const call *c, size_t n, const nebel_vertex_output *outputs, size_t output_count)
{
    const size_t most = most_in_block(c);
    nb_vertex_block b;
    for (b.first = 0; b.first < n; b.first += b.count) {
        b.count = n - b.first < most ? n - b.first : most;
        const nebel_result result = find_factors(c, &b);
        if (result != NEBEL_OK) return result;
        write_block(c, outputs, output_count, &b);
    }
    return NEBEL_OK;
}

/* ---- the public query ------------------------------------------------------------------------ */

static int is_color(nebel_vertex_format format)
{
    return format == NEBEL_VERTEX_RGBA_FLOAT || format == NEBEL_VERTEX_RGBA8;
}

static int wants_color(const nebel_vertex_output *outputs, size_t output_count)
{
    for (size_t i = 0; i < output_count; i++)
        if (is_color(outputs[i].format)) return 1;
    return 0;
}

static const char *fault_of_places(const nebel_vertices *v)
{
    for (int c = 0; c < 3; c++)
        if (!(fabs(v->eye[c]) <= NEBEL_MAX_LENGTH) || !(fabs(v->origin[c]) <= NEBEL_MAX_LENGTH))
            return "eye and origin must be finite and at most 1e15 m away";
    return NULL;
}

static const char *vertex_fog_fault(const call *c, size_t n, const nebel_vertex_output *outputs, size_t output_count)
{
    const char *fault = fault_of_places(&c->vertices);
    if (fault == NULL) fault = nb_layout_fault(n, &c->vertices, outputs, output_count);
    if (fault != NULL) return fault;
    if (c->desc.curve != NEBEL_CURVE_PHYSICAL && c->desc.color == NULL && wants_color(outputs, output_count))
        return "a response curve needs a color: the fog's own light belongs to the curve PHYSICAL";
    return NULL;
}

/* Which way the fog goes, and whose light it has. */
static void choose_way(call *c, int wants_light)
{
    c->by_boxes = nb_boxes_list(c->snapshot, c->vertices.origin, c->desc.channel, 0, c->boxes) &&
                  (!wants_light || nb_boxes_have_one_color(c->lighting));
    c->traces_light = wants_light && !c->by_boxes;
    for (int k = 0; k < 3; k++) {
        const double *const own = c->snapshot->medium_count > 0 ? c->lighting->media[0].radiance : NULL;
        const double *const color = c->desc.color != NULL ? c->desc.color : own;
        c->color[k] = color != NULL ? (float)color[k] : 0;
        c->start[k] = (float)(c->vertices.eye[k] - c->vertices.origin[k]);
    }
}

nebel_result nebel_compute_vertex_fog(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc, size_t n,
                                      const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                                      size_t output_count)
{
    static const nebel_vertex_desc none;
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (vertices == NULL || (output_count > 0 && outputs == NULL))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "vertices: vertices and outputs must not be NULL");
    const nebel_lighting *lighting = nb_lighting_of(snapshot, desc != NULL ? desc->lighting : NULL);
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    call c = {.snapshot = snapshot, .lighting = lighting, .vertices = *vertices};
    const nebel_result result = nebel_resolve_vertex_desc(desc != NULL ? desc : &none, &c.desc);
    if (result == NEBEL_ERROR_VALUE)
        return nb_fail(&snapshot->log, result,
                       "vertices: color and coordinate_end must be finite floats and not negative");
    if (result != NEBEL_OK)
        return nb_fail(&snapshot->log, result,
                       "vertices: channel must be 0, 1 or 2, isa and curve one of theirs, and TABLE needs a table");
    const char *fault = vertex_fog_fault(&c, n, outputs, output_count);
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "vertices: %s", fault);
    c.level = nb_isa_select(c.desc.isa);
    if (c.level == NEBEL_ISA_COUNT)
        return nb_fail(&snapshot->log, NEBEL_ERROR_UNSUPPORTED, "instruction set %s: not available here",
                       nebel_isa_name(c.desc.isa));
    if (c.vertices.position_stride == 0) c.vertices.position_stride = 3 * sizeof(float);
    choose_way(&c, c.desc.color == NULL && wants_color(outputs, output_count));
    return run(&c, n, outputs, output_count);
}
