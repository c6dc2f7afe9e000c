/* Fog in OpenGL: what a host engine in OpenGL 3.3 core or OpenGL ES 3.0 (or later) puts over its own picture.
 *
 *     nebel_gl *gl = NULL;
 *     nebel_create_gl(&(nebel_gl_desc){0}, &gl);          // in the host's context
 *
 *     nebel_gl_set_fog(gl, snapshot, &view);              // each frame: the fog as this eye sees it
 *     glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target);     // the host's own, with one colour texture
 *     nebel_gl_draw_fog(gl, &(nebel_gl_pass){.depth_texture = depth, .color_texture = color});
 *
 *     nebel_destroy_gl(gl);
 *
 * For fog in the host's own shaders see nebel/shader.h; nebel_gl_get_fog_resources hands out the buffer and textures that they
 * read. Link with libnebel_gl and libnebel.
 *
 * Light is linear, coming in and going out: colour textures and targets are float, or sRGB with the conversion switched
 * on. Pictures lie as OpenGL keeps them, the lowest row first.
 *
 * nebel creates no context and no window. Every function but nebel_destroy_gl wants the context current that
 * nebel_create_gl was called in, and no error pending in glGetError (only errors of memory are asked for there).
 * Transform feedback that is under way is paused for the time; OpenGL 3.3 without GL_ARB_transform_feedback2 can not
 * do that, and must have none.
 *
 * Which state is touched: every function leaves all state of the context as it found it. While it runs it changes
 *
 *   - the program, the vertex array, the active texture unit;
 *   - on texture units 0 to 6: the bindings of TEXTURE_2D and TEXTURE_2D_MULTISAMPLE and the sampler; of TEXTURE_2D_ARRAY
 *     on 5 and 6;
 *   - the bindings UNIFORM_BUFFER (general and index 0) and PIXEL_UNPACK_BUFFER, and the parameters UNPACK_*;
 *   - the viewport (the first of an array); SCISSOR_TEST (of all viewports), STENCIL_TEST, DEPTH_TEST, CULL_FACE,
 *     RASTERIZER_DISCARD, SAMPLE_COVERAGE, SAMPLE_SHADING, SAMPLE_MASK, SAMPLE_ALPHA_TO_COVERAGE, SAMPLE_ALPHA_TO_ONE,
 *     COLOR_LOGIC_OP, POLYGON_SMOOTH, MULTISAMPLE, PRIMITIVE_RESTART, CLIP_DISTANCEi, all switched off where they are;
 *   - the polygon mode;
 *   - of draw buffers 0 to 3: BLEND, the colour mask, the blend function and equation;
 *   - the sample mask; the draw framebuffer, to ask where the samples of a multisampled texture are, or to draw in several
 *     passes, with a query of ANY_SAMPLES_PASSED.
 *
 * What stays as the host has set it, because it belongs to the target: FRAMEBUFFER_SRGB, DITHER, the draw buffers, the
 * clip control, conditional rendering, and occlusion queries. Depth and stencil are never written.
 *
 * Threads: as OpenGL, one nebel_gl belongs to the thread in which its context is current.
 */
#ifndef NEBEL_GL_H
#define NEBEL_GL_H

#include <nebel/shader.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nebel_gl nebel_gl;

/* Where the packed fog lies. The host's own shaders are compiled for one of the two. */
typedef enum nebel_gl_storage {
    NEBEL_GL_STORAGE_BLOCK_OR_TEXTURE = 0, /* a uniform block of 16 KiB while the fog fits, else a float texture */
    NEBEL_GL_STORAGE_TEXTURE               /* always a float texture */
} nebel_gl_storage;

typedef struct nebel_gl_desc {
    nebel_allocator allocator;
    nebel_log log;
    nebel_gl_storage storage;
} nebel_gl_desc;

/* Makes what the passes need, in the current context; programs are compiled when a pass first needs them. Destroy it
 * with nebel_destroy_gl. On an error *gl is NULL. Errors: ARGUMENT, MEMORY, UNSUPPORTED (no current context; older than
 * OpenGL 3.3 or OpenGL ES 3.0). */
nebel_result nebel_create_gl(const nebel_gl_desc *desc, nebel_gl **gl);

/* Frees everything, in the context where it was made. Where that context is lost, or no longer current, the objects of
 * OpenGL are left alone: they went or go with it. NULL is fine. */
void nebel_destroy_gl(nebel_gl *gl);

/* Hands over the fog as one eye sees it: packed relative to the eye of `view`, with lists of volumes per screen tile
 * where there are more than a few. It holds until the next call, and the snapshot is retained until then. Snapshot
 * NULL: no fog. O(volumes + tiles), plus what the driver takes for the upload; nothing is packed again where snapshot
 * and eye are those of the last call, to the last bit, and nothing at all is done where the view is, too. Errors:
 * ARGUMENT (also a view that nebel_compute_view_rays refuses, with a width or height of 0 among them), MEMORY, LIMIT (more
 * volumes, larger grids or more phase functions of an environment than the largest texture holds), UNSUPPORTED (the
 * context is another one, or lost). On an error there is no fog.
 */
nebel_result nebel_gl_set_fog(nebel_gl *gl, nebel_snapshot *snapshot, const nebel_view *view);

typedef enum nebel_gl_output {
    NEBEL_GL_OUTPUT_COMPOSE = 0, /* transmittance * color + in-scattering; alpha of the colour texture */
    NEBEL_GL_OUTPUT_SPLIT,       /* in-scattering into draw buffer 0, transmittance into draw buffer 1; alpha 1 */
    NEBEL_GL_OUTPUT_BLEND, /* over what the target holds, each colour by its own transmittance; alpha stays. OpenGL, and
                              OpenGL ES with GL_EXT_blend_func_extended */
    NEBEL_GL_OUTPUT_BLEND_GRAY, /* the same with the mean of the three transmittances: right where fog takes all colours
                                   alike. Everywhere */
    NEBEL_GL_OUTPUT_COUNT
} nebel_gl_output;

/* A full-screen pass into the bound draw framebuffer. Texture names are of the host.
 *
 * Mesa's llvmpipe ends loops early: where a tile lists so many volumes that this may matter, the fog is drawn in several
 * passes, and waits for each, to draw no more than it takes. With an occlusion query of the host's under way, of any kind, it
 * cannot know: all 256 passes are drawn then, for the same picture, and the query counts them, too. Where that does not suffice, or several samples of a pixel or the air of a planet keep it
 * from that, the log is told once, with NEBEL_OK; see docs/shaders.md. */
typedef struct nebel_gl_pass {
    nebel_gl_output output;
    unsigned depth_texture; /* two-dimensional; a depth format, or the first component of a float format */
    unsigned color_texture; /* COMPOSE only; not the target */
    uint32_t samples; /* of the depth texture, and of the colour texture in COMPOSE: 0 or 1: no multisampling; else
                         both are multisampled with so many. COMPOSE gives the mean of what the samples see, SPLIT
                         the means of both; BLEND and BLEND_GREY want a target of as many samples, and blend each
                         of them by itself. OpenGL only */
    nebel_depth_desc depth; /* {0}: OpenGL's own */
    uint32_t x, y;          /* lower left pixel of the picture, in the textures and in the target alike */
} nebel_gl_pass;

/* Draws the fog of nebel_gl_set_fog over the pixels of its view.
 * Errors: ARGUMENT (no fog was set; a name that is no texture; a texture that is too small or of other samples, where
 * the context can tell; a colour texture that is also the target; a framebuffer that is incomplete, whose draw
 * buffers do not fit the output, or whose samples do not; a depth convention that nebel_compute_view_rays refuses), MEMORY,
 * UNSUPPORTED (multisampled textures in OpenGL ES 3.0, BLEND where the context cannot; a shader that the driver does
 * not take, with the driver's words; the context is another one, or lost). On an error nothing was drawn. */
nebel_result nebel_gl_draw_fog(nebel_gl *gl, const nebel_gl_pass *pass);

/* The fog of nebel_gl_set_fog, for the host's own shaders. */
typedef struct nebel_gl_fog_resources {
    unsigned block;            /* uniform buffer of 16 KiB for nebel_fog_block; 0 where the fog is in the texture */
    unsigned texture;          /* for nebel_fog_texture; 0 where the fog is in the block. Read with texelFetch alone */
    unsigned voxels;           /* for nebel_voxel_texture; 0: there are no grids */
    unsigned diffusion;        /* for nebel_diffusion_texture; 0: light is scattered once */
    unsigned environment;      /* for nebel_environment_texture; 0: fog scatters no light by direction. For fog alone */
    unsigned tiles;            /* for nebel_tile_texture; 0: without tiles, use nebel_trace */
    uint32_t tile_size;        /* pixels */
    uint32_t tile_columns;     /* tile of a pixel: x / tile_size + y / tile_size * tile_columns */
    uint32_t max_tile_volumes; /* volumes that the fullest tile lists */
    uint32_t features;         /* NEBEL_FEATURES: a shader compiled with these, or more, will do */
    size_t texel_count;
    double eye[3]; /* what positions are relative to [m] */
} nebel_gl_fog_resources;

/* The names stay what they are until the next nebel_gl_set_fog. Calls no OpenGL. Errors: ARGUMENT (also where no fog
 * was set). */
nebel_result nebel_gl_get_fog_resources(const nebel_gl *gl, nebel_gl_fog_resources *fog);

#ifdef __cplusplus
}
#endif
#endif
