/* The nebel CPU renderer: surfaces by Embree, fog by nebel, one picture.
 *
 *     nebel_renderer *renderer = NULL;
 *     nebel_create_cpu_renderer(scene_data, lighting, &(nebel_cpu_renderer_desc){0}, &renderer);
 *     nebel_render_frame(renderer, &(nebel_frame_desc){.camera = camera, .width = 1280, .height = 720}, &frame);
 *
 * Lambert surfaces lit by the sun and the scene's point lights (ray-traced shadows; their light is attenuated by all
 * fog on its way) and by the ambient radiance; transmittance and in-scattering from nebel_trace in float. On planets
 * with air, fog far from the origin that scatters has the scene's sun and the fog's ambient light as they are at its
 * place (docs/planet.md). The same picture, bit for bit, for every thread count. Link with libnebel_cpu and libnebel.
 */
#ifndef NEBEL_RENDER_H
#define NEBEL_RENDER_H

#include <nebel/classic.h>
#include <nebel/nebel.h>
#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nebel_renderer nebel_renderer;

typedef struct nebel_cpu_renderer_desc {
    nebel_host host;
    nebel_isa isa;    /* for fog and for Embree; DEFAULT: the best of this processor */
    int thread_count; /* of OpenMP, which does what host.parallel does elsewhere; 0: all */
} nebel_cpu_renderer_desc;

/* Builds the acceleration structure over the meshes of `scene`, which must outlive the renderer, as must nothing else:
 * the lighting, whose snapshot has the fog, is retained. lighting NULL: no fog. Errors: ARGUMENT, VALUE, MEMORY,
 * UNSUPPORTED. */
NEBEL_API nebel_result nebel_create_cpu_renderer(const nebel_scene_data *scene, nebel_lighting *lighting,
                                                 const nebel_cpu_renderer_desc *desc, nebel_renderer **renderer);
NEBEL_API void nebel_destroy_renderer(nebel_renderer *renderer);

/* The fog of the frames from now on, and its light, for what moves. The lighting is retained; NULL: no fog. Not while a
 * frame is rendered. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_set_renderer_lighting(nebel_renderer *renderer, nebel_lighting *lighting);

/* Where the fog of cells is computed. */
typedef enum nebel_cell_stage {
    NEBEL_CELLS_PER_VERTEX = 0, /* and interpolated over each triangle, with perspective, as hardware does */
    NEBEL_CELLS_PER_PIXEL,
    NEBEL_CELL_STAGE_COUNT
} nebel_cell_stage;

/* Fogs surfaces by cells from now on, in place of the snapshot's fog: an alpha polygon of nebel_compute_cell_fog over
 * each. Classic: where no surface is there is no fog, and sunlight comes through undimmed. Of a frame, `error` is then
 * 0. Of an orthographic camera all rays begin in its plane; of a panorama each ray is its own axis of depth. The cells
 * must outlive the frames; NULL: the snapshot's fog again. Not while a frame is rendered. Errors: ARGUMENT, MEMORY. */
NEBEL_API nebel_result nebel_set_renderer_cells(nebel_renderer *renderer, const nebel_cells *cells,
                                                nebel_cell_stage stage);

/* How fog gets onto a picture: the one list, of the CPU and of OpenGL. All but EXACT fog surfaces alone; where no
 * surface is there is no fog. */
typedef enum nebel_method {
    NEBEL_METHOD_EXACT = 0,   /* the snapshot's fog, at each sample */
    NEBEL_METHOD_CELLS,       /* nebel_set_renderer_cells, at vertices */
    NEBEL_METHOD_CELLS_PIXEL, /* the same at each sample */
    NEBEL_METHOD_VERTEX,   /* the snapshot's fog at vertices, by nebel_compute_vertex_fog, between them linear over the
                                 triangle, with perspective. It has one transmittance, that of red */
    NEBEL_METHOD_ADDITIVE, /* the same, but fog only adds its light, and transmittance is 1 */
    NEBEL_METHOD_LINEAR,   /* a fog factor in place of the snapshot's fog, at vertices or at each sample */
    NEBEL_METHOD_EXP,
    NEBEL_METHOD_EXP2,
    NEBEL_METHOD_FIVE_TAP,  /* of OpenGL: nebel/gl.h */
    NEBEL_METHOD_FOG_COORD, /* the snapshot's fog at vertices, as what hardware takes: a coordinate, with one colour */
    NEBEL_METHOD_TWO_PASS, /* the light that it adds and its amount: as VERTEX, but with a response curve or a colour */
    NEBEL_METHOD_ALPHA,    /* a byte of alpha over polygons in one colour, of bytes, too */
    NEBEL_METHOD_D3D9,     /* the fog states of a Direct3D 9 device */
    NEBEL_METHOD_PATH,     /* paths of light, by chance and without bias: docs/reference.md. Fog, surfaces, air and
                               clouds are lit by each other too; slow */
    NEBEL_METHOD_COUNT
} nebel_method;

/* The word of `nebel render --method`; NULL: there is no such method. Any thread. */
NEBEL_API const char *nebel_method_name(nebel_method method);

/* 1: the method imitates hardware of its time: LINEAR, EXP, EXP2, FOG_COORD, TWO_PASS, ALPHA and D3D9. What such
 * hardware stores in its frame buffer is blended: colors in sRGB, at most 1. `color` of a frame is linear light again;
 * what the hardware shows is nebel_encode_srgb of it, without a tone curve. `in_scattering` is what is added to stored
 * colors. Any thread. */
NEBEL_API int nebel_method_blends_stored(nebel_method method);

/* What methods need; what a method does not need is not read. */
typedef struct nebel_method_desc {
    const nebel_factor_desc *factor; /* LINEAR, EXP, EXP2; its mode is the method's. COORDINATE_USER is what
                                        NEBEL_VERTEX_COORDINATE gives for the snapshot's fog at the vertices, 0 to 100,
                                        linear in between */
    const nebel_vertex_desc *vertex; /* FOG_COORD and ALPHA, with a color; TWO_PASS, NULL: {0}. Its isa and its
                                        coordinate_end are not read */
    const nebel_d3d9_fog *d3d9;      /* D3D9. FOGENABLE counts as set. Table fog goes by metres of depth; of an
                                        orthographic camera by device depth, 0 at z_near to 1 at z_far. Without table and
                                        vertex fog the factor is specular alpha, the snapshot's fog at the vertices, in
                                        bytes */
    double z_near, z_far;            /* of D3D9 [m]; both 0: 0 and 1000 */
} nebel_method_desc;

/* The method of the frames from now on: all but CELLS, CELLS_PIXEL and FIVE_TAP. desc may be NULL for EXACT, VERTEX,
 * ADDITIVE and TWO_PASS; it is copied. With the snapshot's fog at vertices the sun comes through it as with EXACT; with
 * factors and D3D9 nothing dims it. Of all but EXACT the frame's `error` is 0. Of an orthographic camera all rays begin
 * in its plane; of a panorama each ray is its own axis of depth. Not while a frame is rendered. Errors: ARGUMENT
 * (another method, or without what it needs), VALUE, MEMORY; the method is then as it was. */
NEBEL_API nebel_result nebel_set_renderer_method(nebel_renderer *renderer, nebel_method method,
                                                 const nebel_method_desc *desc);

/* Called from one thread at a time with 0 <= done <= total; return nonzero to stop the frame. */
typedef int (*nebel_progress_fn)(size_t done, size_t total, void *user);

/* A rectangle of a picture, in pixels; its first row is the upper one. */
typedef struct nebel_window {
    uint32_t left, top, width, height;
} nebel_window;

enum { NEBEL_WINDOW_STEP = 64 };

typedef struct nebel_frame_desc {
    nebel_camera camera;
    uint32_t width, height; /* pixels, 1 to 32768 */
    uint32_t samples;       /* per pixel, 1 to 4096; 0: 4. Stratified, the same in every
                               pixel; of one sample the centre. Box filter. */
    double tolerance;       /* as in nebel_trace_desc */
    nebel_progress_fn progress;
    void *progress_user;
    /* Of PATH: how often light is scattered or reflected at most. 1 is what EXACT shows; 0: until paths end by
     * themselves, at most 10000 times. Other seeds give independent pictures. */
    uint32_t bounces, seed;
    /* Within 1e12: what a textured planet has turned by, in the unit of its rotation_period, and clouds have moved by, in that
     * of their winds; frames in scenes. */
    double time;
    /* The part of the picture that is rendered, for pictures in bands or tiles; all 0: the whole. `left` and `top` are multiples of
     * NEBEL_WINDOW_STEP, and so are `width` and `height` unless the window ends with the picture. Pixels are those of the whole picture, bit for bit. */
    nebel_window window;
    /* Of the samples of a pixel, those that are rendered: sample_count of them from first_sample on; a count of 0: all. Each is what it is among all, and the
     * planes have the mean of those that are rendered: for motion, one frame for each sample. */
    uint32_t first_sample, sample_count;
} nebel_frame_desc;

/* One frame in linear light. Every plane is caller memory, width * height pixels (of the window, where there is one),
 * top row first, or NULL when not wanted. */
typedef struct nebel_frame {
    float *color;         /* 3: transmittance * surface + in_scattering */
    float *transmittance; /* 3: mean over the samples */
    float *in_scattering; /* 3 */
    float *depth;         /* 1: distance from the camera [m], mean over the samples that hit; INFINITY where none did */
    float *normal;        /* 3: mean of the world-space shading normals; 0 where nothing is hit */
    float *error;         /* 1: largest error bound of the samples */
    /* 3: of color, with PATH and 2 samples or more. What differs within a pixel counts as chance, though samples
     * are spread evenly there. Other methods leave it as it is. */
    float *standard_error;
} nebel_frame;

/* Renders. Uses OpenMP with the renderer's number of threads. One frame at a time per renderer.
 * Errors: ARGUMENT, VALUE, MEMORY, UNBOUNDED, CANCELLED (by progress). */
NEBEL_API nebel_result nebel_render_frame(nebel_renderer *renderer, const nebel_frame_desc *desc,
                                          const nebel_frame *frame);

/* Exposure (stops; 0 leaves the light as it is), a filmic tone curve for each channel and the sRGB transfer function; n
 * pixels of 3 floats, out may be in. Black stays 0, middle grey 0.18 stays 0.18, 1 comes out as 0.70 before the
 * transfer function, the limit is 1. Within 2e-6 of the exact curve; NaN and negative light give 0. Any thread. */
NEBEL_API void nebel_tone_map(size_t n, const float *linear, double exposure, float *srgb);

/* The same without the tone curve: what frame buffers of classic hardware show. Light above 1 is 1. Any thread. */
NEBEL_API void nebel_encode_srgb(size_t n, const float *linear, double exposure, float *srgb);

/* Runs parts on threads of OpenMP: for nebel_parallel.run. `user` is a const int *, how many threads there
 * are, 1 to 1024; NULL: as many as processors. Any thread. */
NEBEL_API void nebel_parallel_for_openmp(size_t parts, void (*part)(void *data, size_t i), void *data, void *user);

/* The Embree version this build uses, "Embree 3.13.5". Never NULL. */
NEBEL_API const char *nebel_cpu_libraries(void);

#ifdef __cplusplus
}
#endif
#endif
