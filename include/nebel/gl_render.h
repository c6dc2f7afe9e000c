/* A scene in OpenGL: the picture of the CPU renderer (nebel/render.h), drawn by OpenGL 3.3 core or OpenGL ES 3.0.
 *
 *     nebel_gl_renderer *renderer = NULL;
 *     nebel_create_gl_renderer(scene_data, fog, &(nebel_gl_renderer_desc){0}, &renderer);    // in a current context
 *
 *     nebel_gl_render_frame(renderer, &(nebel_gl_frame_desc){.camera = camera, .width = 1280, .height = 720});
 *     nebel_gl_get_textures(renderer, &textures);      // to show it, or
 *     nebel_gl_read_planes(renderer, &planes);         // to have it in memory
 *
 *     nebel_destroy_gl_renderer(renderer);
 *
 * Surfaces, light and fog are those of nebel/render.h: Lambert surfaces lit by the sun and the scene's lamps, which are
 * attenuated by all fog on their way, and by the ambient radiance; colour = transmittance * surface + in-scattering.
 * Both renderers look through the same points of each pixel. The sun's shadows, on surfaces and in fog, come from
 * maps fitted to what is seen, those of lamps from six maps around each, so their edges are a texel of the map wide.
 * Particles dim the sun, not lamps. Panoramas are no resampled views: each pixel has its own ray, which meets
 * surfaces, fog and particles exactly. Link with libnebel_gl and libnebel.
 *
 * A planet with air (`planets` of the scene, one) is drawn as by the CPU; its table is made anew in a frame whose eye or
 * sun is another than in the one before, which takes 50 to 230 ms. Its atmosphere must live as long as the renderer:
 * another one at the same address would be taken for the first. So must the layers of one that has them, whose shells are
 * surfaces of which a part is seen: each costs the fog and the particles of a frame once more.
 *
 * Contexts, threads and errors as in nebel/gl.h. Every function leaves the state of the context as it found it; beside
 * what nebel/gl.h lists it changes, while it runs, texture units 7 to 15, and TEXTURE_2D_ARRAY of units 10, 11, 12 and 14; both
 * framebuffers; the bindings ARRAY_BUFFER and PIXEL_PACK_BUFFER; the parameters PACK_*; CLAMP_READ_COLOR; the depth
 * function, mask and range; POLYGON_OFFSET_FILL, PRIMITIVE_RESTART_FIXED_INDEX, DEPTH_CLAMP, the provoking vertex and
 * the clip control, where they exist. Conditional rendering must not be under way: pictures would be missing within a
 * frame.
 */
#ifndef NEBEL_GL_RENDER_H
#define NEBEL_GL_RENDER_H

#include <nebel/gl.h>
#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nebel_gl_renderer nebel_gl_renderer;

typedef struct nebel_gl_renderer_desc {
    nebel_allocator allocator;
    nebel_log log;
    /* Texels of a side of each of the sun's four shadow maps, and of eight more where it lights fog, 64 to 16384; 0: 2048.
     * The six of a point or spot light have a quarter of it, less where they would take more than 128 MiB together, but 64. */
    uint32_t shadow_map_size;
    /* For threads that make tables of air and trace clouds; NULL: one part after the other. */
    nebel_parallel_for_fn run;
    void *run_user;
} nebel_gl_renderer_desc;

/* Copies meshes and textures of `scene` to the graphics processor; they are not read again. Light, lamps, background and
 * ambient are read anew for each frame, so `scene` must outlive the renderer. The maps around a lamp are drawn when it
 * is new or has moved. Where lamps are more than there is room for, GL_MAX_ARRAY_TEXTURE_LAYERS or 1,365, those that are
 * brightest at the eye cast shadows. The snapshot is retained; fog NULL: none.
 * On an error *renderer is NULL. O(vertices + triangles + texels). Errors: ARGUMENT and VALUE as nebel_create_cpu_renderer,
 * MEMORY, LIMIT (a texture larger than GL_MAX_TEXTURE_SIZE), UNSUPPORTED (no current context, or one that is too old or
 * cannot draw into textures of floats). */
nebel_result nebel_create_gl_renderer(const nebel_scene_data *scene, nebel_snapshot *fog,
                                      const nebel_gl_renderer_desc *desc, nebel_gl_renderer **renderer);

/* NULL is fine. As nebel_destroy_gl where the context is lost. */
void nebel_destroy_gl_renderer(nebel_gl_renderer *renderer);

/* The fog of the frames from now on. The snapshot is retained; NULL: none. Errors: ARGUMENT. */
nebel_result nebel_set_gl_renderer_fog(nebel_gl_renderer *renderer, nebel_snapshot *fog);

/* The particles of the frames from now on, beside the fog and not among it: commit that with
 * nebel_commit_scene_volumes_at. They are copied; count 0: none. Each is drawn as a ball whose transmittance and light
 * up to the surface behind it have closed forms, from the farthest centre to the nearest: particles that overlap take
 * their light from each other as if one were behind the other, and fog counts before a particle's middle. They dim
 * the sun unless a frame leaves that out. O(count log count) for each frame, and what they cover. Errors: ARGUMENT,
 * VALUE (numbers that nebel_add_volume would refuse), MEMORY, UNSUPPORTED (OpenGL ES without GL_EXT_float_blend). */
nebel_result nebel_set_gl_renderer_particles(nebel_gl_renderer *renderer, const nebel_particle *particles,
                                             size_t count);

/* The exact picture, or a classic technique in place of a part of it. */
typedef enum nebel_gl_method {
    NEBEL_GL_METHOD_EXACT = 0, /* fog of each pixel; particles count up to the surface, in closed form */
    NEBEL_GL_METHOD_FIVE_TAP,  /* each particle is a disc through its middle, across the view: all of it or nothing, by
                                  the classic comparison of depth at five places. Of a panorama depth is distance */
    NEBEL_GL_METHOD_VERTEX, /* fog at the vertices of surfaces, by nebel_compute_vertex_fog, interpolated over triangles:
                                  what fog coordinates, a second pass and alpha polygons draw (nebel/gl_classic.h). It
                                  has one transmittance, that of red. Where no surface is there is no fog. Rays of
                                  an orthographic camera begin in its plane, for CELLS, too */
    NEBEL_GL_METHOD_ADDITIVE, /* the same, but fog only adds its light, and transmittance is 1 */
    NEBEL_GL_METHOD_CELLS, /* the same by nebel_compute_cell_fog, in place of the renderer's fog, which still dims the sun:
                                  give it none where cells are all. Each ray of a panorama is its own axis of depth */
    NEBEL_GL_METHOD_CELLS_PIXEL, /* the same at each pixel, which the processor computes of the distances that OpenGL
                                    has drawn: half a microsecond for each, of few cells. For pictures, not for films */
    NEBEL_GL_METHOD_LINEAR,      /* a fog factor, at vertices or at each pixel, in place of the renderer's fog and
                               particles, which do not dim the sun either. With COORDINATE_USER c is what
                               NEBEL_VERTEX_COORDINATE gives for the renderer's fog at the vertices, 0 to 100 */
    NEBEL_GL_METHOD_EXP,
    NEBEL_GL_METHOD_EXP2,
    NEBEL_GL_METHOD_FOG_COORD, /* as VERTEX, but as streams of classic hardware: a coordinate and one colour */
    NEBEL_GL_METHOD_TWO_PASS,  /* light and amount, with a response curve or a colour */
    NEBEL_GL_METHOD_ALPHA,     /* a byte of alpha, in one colour of bytes */
    NEBEL_GL_METHOD_D3D9, /* the fog states of a Direct3D 9 device, as those of the factors in place of fog; without
                                  table and vertex fog specular alpha, the renderer's fog at vertices */
    NEBEL_GL_METHOD_COUNT
} nebel_gl_method;

/* Constants of FIVE_TAP, as those of nebel_five_taps in nebel/shader.h: a disc is drawn where the depths of the opaque
 * picture at the pixel and at four diagonal neighbours differ by more than `edge_threshold`, and where none of them is nearer
 * than the disc's own depth less `depth_margin`. Depth is the distance along the camera's axis. */
typedef struct nebel_depth_taps {
    double offset;           /* of the neighbours, as a share of the picture either way, >= 0 */
    double background_depth; /* depth where there is no surface [m] */
    double edge_threshold;   /* m, >= 0 */
    double depth_margin;     /* m */
    double brightness;       /* what light of drawn particles is multiplied by, >= 0 */
} nebel_depth_taps;

/* 0.0005, 100000, 0.5, 0.125, 1. Any thread. */
nebel_depth_taps nebel_gl_default_taps(void);

typedef struct nebel_gl_frame_desc {
    nebel_camera camera;
    uint32_t width, height; /* pixels, 1 to GL_MAX_TEXTURE_SIZE */
    uint32_t samples;       /* per pixel, 1 to 4096; 0: 4 */
    /* After each sample, and every tenth of a second or so while the processor walks through clouds: samples that are done.
     * Nonzero stops the frame. NULL: none. */
    int (*progress)(size_t done, size_t total, void *user);
    void *progress_user;
    nebel_gl_method method;
    const nebel_depth_taps *taps;    /* of FIVE_TAP; NULL: nebel_gl_default_taps */
    const nebel_cells *cells;        /* of CELLS and CELLS_PIXEL */
    const nebel_factor_desc *factor; /* of LINEAR, EXP and EXP2, but for its mode */
    const nebel_vertex_desc *vertex; /* of FOG_COORD and ALPHA, with a color; of TWO_PASS, NULL: {0} */
    const nebel_d3d9_fog *d3d9;      /* of D3D9; FOGENABLE counts as set */
    double z_near, z_far;            /* of D3D9 [m]: device depth 0 and 1 of an orthographic camera, by which table fog
                                        goes there; both 0: 0 and 1000 */
    int particles_leave_sun; /* 0: sunlight on surfaces is attenuated by all particles on its way, as on the CPU,
                                  exactly, by the lists of particles along it; for a new eye or sun O(particles) more,
                                  some microseconds each. Not where `fog` excludes, replaces or limits what particles
                                  do. Nonzero: sunlight passes particles by: for many of them and an eye that moves */
    double time;             /* as in nebel_frame_desc */
    int clouds_by_processor; /* 0: a planet with clouds of volume is refused. Nonzero: the processor walks through them along
                                the ray of each pixel, and dims the sun's light, which takes as long as on the CPU: for
                                pictures and films, not for windows */
} nebel_gl_frame_desc;

/* Draws a frame into textures of the renderer. Errors: ARGUMENT (also a method that there is not, or without what it
 * needs), VALUE (a camera, light or time as for nebel_render_frame; taps that are not finite or negative; a factor as for
 * nebel_resolve_factor), LIMIT (a picture, or a map of layers, too large for this context; fog or triangles that floats do not hold in this view; more than 4,096 lamps; stopped by progress),
 * MEMORY, UNSUPPORTED (more than one sample, or a textured planet, where OpenGL ES cannot blend floats; a planet with
 * clouds of volume where the processor may not walk through them, by another method than EXACT, or, if it has air, in an
 * orthographic view or with particles; a shader that the driver does not take; the context is another one, or lost). The first panorama copies the triangles of all
 * meshes: 108 bytes each, with fog per vertex 48 more. */
nebel_result nebel_gl_render_frame(nebel_gl_renderer *renderer, const nebel_gl_frame_desc *desc);

/* What the last frame is made of: RGBA32F, linear light, the lowest row first, without filters or mipmaps. */
typedef struct nebel_gl_textures {
    unsigned color;         /* rgb: transmittance * surface + in-scattering; a: share of samples that hit a surface */
    unsigned transmittance; /* rgb */
    unsigned in_scattering; /* rgb */
    unsigned surface; /* rgb: shading normal; a: distance [m]; both times the share of samples that hit a surface */
    uint32_t width, height;
} nebel_gl_textures;

/* The names hold until the next frame. Calls no OpenGL. Errors: ARGUMENT (also where no frame was drawn). */
nebel_result nebel_gl_get_textures(const nebel_gl_renderer *renderer, nebel_gl_textures *textures);

/* The planes of the last frame, as those of nebel_frame in nebel/render.h: caller memory, width * height pixels, top
 * row first, or NULL when not wanted. */
typedef struct nebel_gl_planes {
    float *color;         /* 3 */
    float *transmittance; /* 3 */
    float *in_scattering; /* 3 */
    float *depth;         /* 1: distance from the camera [m], mean over the samples that hit; INFINITY where none did */
    float *normal;        /* 3: mean of the world-space shading normals; 0 where nothing is hit */
} nebel_gl_planes;

/* Errors: ARGUMENT (also where no frame was drawn), MEMORY, UNSUPPORTED (the context is another one, or lost; the driver draws
 * nothing). */
nebel_result nebel_gl_read_planes(nebel_gl_renderer *renderer, const nebel_gl_planes *planes);

/* The view of a camera without near and far planes, for nebel_gl_set_fog and nebel_compute_view_rays with
 * NEBEL_DEPTH_ENCODING_RADIAL: the projection is infinite and begins 1e-6 m before the eye. Errors: ARGUMENT, VALUE as
 * for nebel_render_frame, UNSUPPORTED (a panorama, which no matrix makes). Any thread. */
nebel_result nebel_view_from_camera(const nebel_camera *camera, uint32_t width, uint32_t height, const nebel_log *log,
                                    nebel_view *view);

#ifdef __cplusplus
}
#endif
#endif
