/* The renderer and what each of its threads works in. */
#ifndef NB_CPU_RENDERER_H
#define NB_CPU_RENDERER_H

#include "geometry.h"
#include "hits.h"
#include "raster.h"
#include "sampling.h"
#include "surface.h"
#include "view.h"

#include <nebel/render.h>

/* One sample of every pixel of a batch. */
typedef struct nb_light_samples {
    float transmittance[3][NB_BATCH];
    float in_scattering[3][NB_BATCH];
    float error[NB_BATCH];
    float color[3][NB_BATCH];
} nb_light_samples;

/* What a thread works in: allocated once, aligned to 64 bytes. */
typedef struct nb_scratch {
    nb_packets packets;
    nb_region_points region;
    float x[NB_BATCH], y[NB_BATCH];    /* of these points those of the batch */
    _Alignas(64) int inside[NB_BATCH]; /* -1 within the picture, else 0 */
    nb_rays rays;
    nb_hits hits;
    nb_points points;
    nb_light_samples samples;
    float distance[NB_BATCH];             /* m, over which fog is asked for */
    float offset[3][NB_BATCH];            /* of the rays' starts from the camera's position; orthographic only */
    float sun_transmittance[3][NB_BATCH]; /* of the way to the sun */
    nb_seen seen;
    uint32_t hit_counts[NB_REGION * NB_REGION]; /* samples of a pixel that met a surface */
} nb_scratch;

struct nebel_renderer {
    nebel_allocator allocator;
    nebel_log log;
    const nebel_scene_data *scene;
    nebel_snapshot *fog; /* NULL: none */
    nebel_isa fog_isa;
    int threads;
    nb_geometry geometry;
    nb_srgb_table table;
    void *scratch_memory;
    nb_scratch *scratch; /* one per thread */
};

/* The light of a frame, in float. */
typedef struct nb_lighting {
    float background[3], ambient[3];
    float sun[3], irradiance[3]; /* 0 where there is no sun */
    double sun_direction[3];
    int has_sun;
} nb_lighting;

typedef struct nb_frame {
    nebel_renderer *renderer;
    const nebel_frame *planes;
    nb_view view;
    nb_raster raster;
    int rasters; /* first hits come from `raster`, not from Embree */
    nb_lighting lighting;
    nebel_trace_desc trace;
    uint32_t width, height, samples;
} nb_frame;

/* A batch of a region: both first pixels are in pixels of the picture. */
typedef struct nb_place {
    uint32_t left, top, region_left, region_top;
} nb_place;

/* Renders one sample of a batch into scratch->samples. scratch->region holds the points of its region and, where the
 * frame is rasterized, scratch->seen what is seen there. */
nebel_result nb_batch_render(const nb_frame *frame, const nb_place *place, nb_scratch *scratch);

/* Adds the samples of a batch to the planes: the first sample replaces what is there. `hit_counts` belongs to the
 * batch's first pixel; its rows are NB_REGION long. */
void nb_planes_add(const nb_frame *frame, uint32_t left, uint32_t top, int is_first, const nb_scratch *scratch,
                   uint32_t *hit_counts);

/* Makes means of sums. */
void nb_planes_finish(const nb_frame *frame, uint32_t left, uint32_t top, const uint32_t *hit_counts);

#endif
