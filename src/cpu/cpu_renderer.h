/* The renderer and what each of its threads works in. */
#ifndef NB_CPU_CPU_RENDERER_H
#define NB_CPU_CPU_RENDERER_H

#include "cpu_planets.h"
#include "embree_scene.h"
#include "hits.h"
#include "light_shafts.h"
#include "surface_lights.h"
#include "path_tracer.h"
#include "rasterizer.h"
#include "region_samples.h"
#include "sun_shafts.h"
#include "cpu_surface.h"
#include "camera_rays.h"

#include "aerial/shadowed_air.h"
#include "aerial/cloud_compose.h"
#include "base/device.h"
#include "frame/surface_lighting.h"

#include <nebel/render.h>

/* One sample of every pixel of a batch. */
typedef struct nb_light_samples {
    float transmittance[3][NB_BATCH];
    float in_scattering[3][NB_BATCH];
    float error[NB_BATCH];
    float color[3][NB_BATCH];
} nb_light_samples;

/* Of the samples of the pixels of a region, for the reference. */
typedef struct nb_sums {
    double light[3][NB_PIXELS], square[3][NB_PIXELS];
} nb_sums;

/* What a thread works in: allocated once, aligned to 64 bytes. */
/* Shells of a planet, ray by ray, and what is laid over each other. */
typedef struct nb_shell_scratch {
    nebel_shell_hits hits[NB_BATCH];
    uint32_t most;                          /* of their counts, without the ground */
    float ground[NB_BATCH];                 /* its distance; INFINITY where it is not seen */
    float left[NB_BATCH], sum[3][NB_BATCH]; /* what the shells so far leave, and their light */
    float distance[NB_BATCH];               /* of a shell */
    float fog_left[3][NB_BATCH], light[3][NB_BATCH], light_before[3][NB_BATCH]; /* of fog up to there */
} nb_shell_scratch;

/* Clouds through the middles of pixels; for samples that see the sky where the middle just meets the ground along that ray lifted to
 * above the horizon. */
typedef struct nb_cloud_scratch {
    nebel_cloud_workspace *workspace;   /* for a frame with clouds */
    nb_ray_batch rays, rays_of_samples; /* the latter meanwhile */
    nb_ray_batch middles, lifted;       /* one of them each ray is: which, and whether they differ */
    int is_lifted[NB_BATCH], has_lifted[NB_BATCH];
    float reach[NB_BATCH]; /* m, how far they are known */
    int is_new[NB_BATCH];
    nebel_cloud_transfer nodes[NB_BATCH];
    nebel_ray asked[NB_BATCH]; /* one behind the other: rays that clouds are looked for along, and what is found */
    double spreads[NB_BATCH];
    nebel_cloud_transfer found[NB_BATCH];
    nb_shadowed_segment shaded[NB_BATCH][NB_SHADED_PIECES]; /* the air */
    uint32_t shaded_count[NB_BATCH];
    float over[NEBEL_MAX_CLOUD_NODES][3][NB_BATCH]; /* what a node adds to light that came from behind */
    nb_aerial_nodes air[NB_BATCH];
    nb_cloud_fog_nodes marks[NB_BATCH];
    int next[NB_BATCH];    /* the node to mark; -1: none */
    float doubt[NB_BATCH]; /* of light: by means between nodes, and as fog counts as spread evenly between marks */
    float end[NB_BATCH];   /* m, how far clouds matter to a sample */
    float distance[NB_BATCH];
    nb_light_samples samples;
} nb_cloud_scratch;

typedef struct nb_scratch {
    nb_packets packets;
    nb_region_points points_of_region[NB_TOGETHER],
        centers; /* centers: of frames with clouds, or whose batches may be even */
    nb_region_hits seen[NB_TOGETHER];
    _Alignas(64) int inside[NB_BATCH]; /* -1 within the picture, else 0 */
    nb_ray_batch rays;
    nb_hits hits;
    nb_surface_batch points;
    nb_light_samples samples;
    float distance[NB_BATCH];               /* m, over which fog is asked for */
    float offset[3][NB_BATCH];              /* of the rays' starts from the camera's position; orthographic only */
    float light_transmittance[3][NB_BATCH]; /* of the way to a light */
    uint32_t hit_counts[NB_PIXELS];         /* samples of a pixel that met a surface */
    nb_sun_shafts shafts;
    nb_light_shafts light_shafts;
    nb_shadow_rays light;
    nb_cpu_planets_scratch air;
    nb_shell_scratch shells;
    nb_cloud_scratch clouds;
    nb_single_ray lone; /* of a path behind its first surface */
    nb_sums sums;
} nb_scratch;

/* What fog does to a vertex: the light that it adds, and what it hides. */
typedef struct nb_vertex_fog {
    float color[3], alpha;
} nb_vertex_fog;

struct nebel_renderer {
    nebel_allocator allocator;
    nebel_log log;
    const nebel_scene_data *scene;
    nebel_lighting *lighting; /* NULL: no fog */
    nebel_snapshot *fog;      /* of the lighting; NULL: none */
    nebel_method method;
    const nebel_cells *cells; /* of the methods CELLS and CELLS_PIXEL */
    nebel_factor_desc factor; /* of the methods LINEAR, EXP, EXP2; resolved */
    nebel_vertex_desc look;   /* of FOG_COORD, TWO_PASS, ALPHA; resolved, of color and table below */
    double look_color[3];
    float look_table[NEBEL_CURVE_ENTRIES];
    nebel_d3d9_fog d3d9; /* of D3D9, switched on */
    nb_device_planes device_planes;
    nb_vertex_fog *vertex_fog; /* of all surfaces, for the frame that is rendered; NULL until a method asks for it */
    nebel_isa fog_isa;
    int threads;
    nb_geometry geometry;
    nb_sun_cells sun_cells;    /* for the last frame with fog that the sun lights */
    nb_shadow_tree light_tree; /* the same of point lights */
    nb_srgb_table table;
    void *scratch_memory;
    nb_scratch *scratch; /* one per thread */
};

typedef struct nb_frame {
    nebel_renderer *renderer;
    const nebel_frame *planes;
    nb_view view;
    nb_raster raster;
    int rasters; /* first hits come from `raster`, not from Embree */
    nb_surface_lighting lighting;
    nebel_trace_desc trace;
    int has_shafts; /* surfaces cast shadows into fog that the sun lights, which is in */
    nb_lit_box sunlit_box;
    nb_eye_visibility eye; /* in sunlight or not */
    int has_light_shafts;  /* the same of point lights */
    nb_lit_box lights_box;
    uint32_t width, height, samples;
    uint32_t first_sample, sample_count; /* those of the samples that are rendered */
    nebel_window window;                 /* of the picture that is rendered; the planes are as large */
    nb_air_frame air;
    const nebel_textured_planet *layers; /* NULL: none */
    nebel_cloud_lighting *cloud_view;    /* the same */
    nebel_textured_planet_query layer_view;
    nb_path_scene world;       /* of the method REFERENCE */
    nb_planet_medium *planets; /* of the same: those with air; NULL: none */
    uint32_t seed;
} nb_frame;

/* A batch of a region. */
typedef struct nb_batch_place {
    uint32_t left, top; /* first pixel of the region */
    uint32_t first;     /* lane of the region in which the batch begins */
    uint32_t sample;    /* of its pixels, counted from 0 */
} nb_batch_place;

/* Renders a sample of a batch into scratch->samples. The members `sample` of scratch->points_of_region and, where the
 * frame is rasterized, of scratch->seen belong to its region. */
nebel_result nb_batch_render(const nb_frame *frame, const nb_batch_place *place, uint32_t sample, nb_scratch *scratch);

/* Steps of the same: rays, and the models that they meet; or the rays of pixels' centres, and the ground of a planet with
 * air, as if there were no models; light, with methods but REFERENCE, where the ground has been found. */
void nb_batch_find(const nb_frame *frame, const nb_batch_place *place, uint32_t sample, nb_scratch *scratch);
void nb_batch_find_centers(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch);
nebel_result nb_batch_light(const nb_frame *frame, nb_scratch *scratch);

/* The reference in nb_batch_render's place: after first hits are found. Errors: VALUE, UNSUPPORTED, MEMORY; UNBOUNDED. */
nebel_result nb_path_batch_set(nb_frame *frame, const nebel_frame_desc *desc);
void nb_path_batch_free(nb_frame *frame);
nebel_result nb_path_batch_trace(const nb_frame *frame, const nb_batch_place *place, nb_scratch *scratch);

/* Colours in the precision that they were summed in, and the standard errors. */
void nb_path_batch_finish(const nb_frame *frame, const nb_batch_place *place, const nb_scratch *scratch);

/* Adds the sample of a batch to the planes: the first sample replaces what is there. */
void nb_planes_add(const nb_frame *frame, const nb_batch_place *place, int is_first, nb_scratch *scratch);

/* The place of a pixel of the picture, within the window, in a plane of one channel. */
static inline size_t nb_planes_pixel(const nb_frame *frame, uint32_t x, uint32_t y)
{
    return (size_t)(y - frame->window.top) * frame->window.width + (x - frame->window.left);
}

/* Makes means of sums. */
void nb_planes_finish(const nb_frame *frame, const nb_batch_place *place, const nb_scratch *scratch);

#endif
