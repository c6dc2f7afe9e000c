/* Fog in OpenGL: what a host engine in OpenGL 3.3 core or OpenGL ES 3.0 (or later) puts over its own picture.
 *
 *     nebel_gl *gl = NULL;
 *     nebel_create_gl(&(nebel_gl_desc){0}, &gl);          // in the host's context
 *
 *     nebel_gl_set_fog(gl, lighting, &view);              // each frame: the fog as this eye sees it
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

#include <nebel/classic.h>
#include <nebel/scene.h>
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
    nebel_host host;
    nebel_gl_storage storage;
} nebel_gl_desc;

/* Makes what the passes need, in the current context; programs are compiled when a pass first needs them. Destroy it
 * with nebel_destroy_gl. On an error *gl is NULL. Errors: ARGUMENT, MEMORY, UNSUPPORTED (no current context; older than
 * OpenGL 3.3 or OpenGL ES 3.0). */
NEBEL_API nebel_result nebel_create_gl(const nebel_gl_desc *desc, nebel_gl **gl);

/* Frees everything, in the context where it was made. Where that context is lost, or no longer current, the objects of
 * OpenGL are left alone: they went or go with it. NULL is fine. */
NEBEL_API void nebel_destroy_gl(nebel_gl *gl);

/* Hands over the fog as one eye sees it: packed relative to the eye of `view`, with lists of volumes per screen tile
 * where there are more than a few. It holds until the next call, and the lighting is retained until then, whose
 * snapshot has the fog. NULL: no fog. O(volumes + tiles), plus what the driver takes for the upload; nothing is packed again where lighting
 * and eye are those of the last call, to the last bit, and nothing at all is done where the view is, too. Errors:
 * ARGUMENT (also a view that nebel_compute_view_rays refuses, with a width or height of 0 among them), MEMORY, LIMIT (more
 * volumes, larger grids or more phase functions of an environment than the largest texture holds), UNSUPPORTED (the
 * context is another one, or lost). On an error there is no fog.
 */
NEBEL_API nebel_result nebel_gl_set_fog(nebel_gl *gl, nebel_lighting *lighting, const nebel_view *view);

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
 * from that, the log gets one warning; see docs/shaders.md. */
typedef struct nebel_gl_pass {
    nebel_gl_output output;
    unsigned depth_texture; /* two-dimensional; a depth format, or the first component of a float format */
    unsigned color_texture; /* COMPOSE only; not the target */
    uint32_t samples; /* of the depth texture, and of the colour texture in COMPOSE: 0 or 1: no multisampling; else
                         both are multisampled with so many. COMPOSE gives the mean of what the samples see, SPLIT
                         the means of both; BLEND and BLEND_GRAY want a target of as many samples, and blend each
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
NEBEL_API nebel_result nebel_gl_draw_fog(nebel_gl *gl, const nebel_gl_pass *pass);

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
NEBEL_API nebel_result nebel_gl_get_fog_resources(const nebel_gl *gl, nebel_gl_fog_resources *fog);

/* ==== fog per vertex in OpenGL ==================================================================== */

/* Classic fog in OpenGL: fog per vertex, drawn as engines of 1999 to 2005 draw it.
 *
 * Such an engine has meshes and functions that draw them, each mesh in a layout of its own. So nothing is drawn here:
 * nebel_compute_vertex_fog writes one number or colour per vertex into the engine's own arrays, and what follows puts OpenGL
 * into the state in which the engine's own draw call makes fog of it, and back.
 *
 *     nebel_gl_classic *classic = NULL;
 *     nebel_create_gl_classic(&(nebel_gl_classic_desc){.host.log = log}, &classic);    // in the engine's context
 *     method = nebel_gl_get_classic_method(classic);          // TWO_PASS where the context lacks fog coordinates
 *
 *     // The stream follows from the method: nebel_gl_bind_classic_stream refuses another one.
 *     // FOG_COORD, one pass: the mesh as ever, within
 *     const nebel_vertex_output fog = {NEBEL_VERTEX_COORDINATE, &mesh[0].fog, sizeof *mesh};
 *     nebel_compute_vertex_fog(snapshot, NULL, count, &points, &fog, 1);
 *     nebel_gl_begin_classic_fog(classic, color);
 *     nebel_gl_bind_classic_stream(classic, &fog, 0);
 *     draw_mesh(mesh);
 *     nebel_gl_end_classic_fog(classic);
 *
 *     // TWO_PASS, ADDITIVE: the mesh as ever, and then its positions alone, within
 *     const nebel_vertex_output fog = {NEBEL_VERTEX_RGBA8, &mesh[0].fog, sizeof *mesh};
 *     draw_mesh(mesh);
 *     nebel_gl_begin_classic_fog(classic, NULL);
 *     nebel_gl_bind_classic_stream(classic, &fog, 0);
 *     draw_positions(mesh);
 *     nebel_gl_end_classic_fog(classic);
 *
 * Between begin and end any number of meshes may be drawn, each after a nebel_gl_bind_classic_stream of its own. A program that draws between
 * glBegin and glEnd binds none: it calls glFogCoordf(coordinate) or glColor4ubv(color) before each vertex.
 *
 * What the methods draw, with P what the surface looks like, a the amount of fog, L the light that fog adds:
 *
 *   FOG_COORD  (1 - a) P + a color, in one pass. The coordinate is 100 a: NEBEL_VERTEX_COORDINATE. OpenGL 1.4 or
 *              GL_EXT_fog_coord.
 *   TWO_PASS   (1 - a) P + L. NEBEL_VERTEX_RGBA8 or NEBEL_VERTEX_RGBA_FLOAT. Everywhere.
 *   ADDITIVE   P + L: the same streams, without weakening the surface, as old programs drew it. Fog before bright
 *              surfaces is too bright: where P is white and fog is white nothing of it is seen. Where the first pass
 *              was fogged to black by FOG_COORD it is (1 - a) P + L. Everywhere.
 *   ALPHA      (1 - a) P + a F: NEBEL_VERTEX_ALPHA, F the colour in the vertices' own bytes. Everywhere.
 *
 * Alpha of the target stays as it is. Colours are interpolated with perspective, fog coordinates too. OpenGL clamps
 * vertex colours to 1. Second passes draw where depth is equal to the first one's, so that the holes of an alpha test
 * stay holes; what was drawn twice in the first pass is fogged twice. Depth must be written by the first pass and come
 * out the same: same matrices, same vertices, same kind of pipeline.
 *
 * Programs in GLSL: where a compatibility profile has a current program, and everywhere in core profiles and OpenGL ES,
 * the engine's own shaders take the place of the fixed pipeline; nebel_gl_classic_shader_source is what they call. There begin
 * sets blending and depth alone (for FOG_COORD nothing), and the engine hands the stream to an attribute of its own,
 * smooth, with glVertexAttribPointer. Vertex shaders of both passes declare `invariant gl_Position;` and compute it
 * alike, or depth is not equal.
 *
 * Which state is touched, until end puts it back:
 *
 *   - core profiles and OpenGL ES: BLEND, the blend function and equation (of draw buffer 0), the depth function and
 *     mask;
 *   - contexts with the fixed pipeline: for all methods the client state of arrays, the current colour and fog
 *     coordinate; for FOG_COORD the switch and the parameters of FOG but its density; for the others FOG, LIGHTING,
 *     ALPHA_TEST, COLOR_SUM, COLOR_LOGIC_OP and the textures of all units, switched off; BLEND, the blend function and
 *     equation, the depth function and mask, the shade model, before OpenGL 3.3 the colour mask. They are kept on the
 *     attribute stacks (glPushAttrib: CURRENT, ENABLE, FOG, COLOR_BUFFER, LIGHTING; glPushClientAttrib: VERTEX_ARRAY):
 *     what the engine itself changes of these groups before end goes back, too.
 *
 * DEPTH_TEST, stencil, culling, polygon offset, programs and matrices are those of the engine.
 *
 * Contexts from OpenGL 1.1 and OpenGL ES 3.0. Core profiles from 3.3. Every function wants the context current that
 * nebel_create_gl_classic was called in, and no error pending. Threads as above.
 */

typedef enum nebel_gl_classic_kind {
    NEBEL_GL_CLASSIC_FOG_COORD = 0,
    NEBEL_GL_CLASSIC_TWO_PASS,
    NEBEL_GL_CLASSIC_ADDITIVE,
    NEBEL_GL_CLASSIC_ALPHA,
    NEBEL_GL_CLASSIC_COUNT
} nebel_gl_classic_kind;

typedef struct nebel_gl_classic nebel_gl_classic;

typedef struct nebel_gl_classic_desc {
    nebel_host host;
    nebel_gl_classic_kind kind; /* wanted */
    double coordinate_end;      /* FOG_COORD: as in nebel_vertex_desc, > 0; 0: 100 */
} nebel_gl_classic_desc;

/* Asks the current context what it can. Where FOG_COORD is wanted and neither OpenGL 1.4 nor GL_EXT_fog_coord is there
 * the method is TWO_PASS, and the log gets a warning. On an error *classic is NULL. Errors: ARGUMENT, VALUE (coordinate_end
 * is negative or not finite), MEMORY, UNSUPPORTED (no current context, or one that is too old). */
NEBEL_API nebel_result nebel_create_gl_classic(const nebel_gl_classic_desc *desc, nebel_gl_classic **classic);

/* Not between begin and end. Calls no OpenGL. NULL is fine. */
NEBEL_API void nebel_destroy_gl_classic(nebel_gl_classic *classic);

/* The method that is used. */
NEBEL_API nebel_gl_classic_kind nebel_gl_get_classic_method(const nebel_gl_classic *classic);

/* Sets the state of the method. `color` is that of the fog for FOG_COORD; the others have it in their streams, and NULL
 * will do. Errors: ARGUMENT (FOG_COORD without a colour; after another begin), LIMIT (an attribute stack is full).
 * Nothing has changed then. */
NEBEL_API nebel_result nebel_gl_begin_classic_fog(nebel_gl_classic *classic, const float color[3]);

/* The next draw calls take their fog from `stream`, as nebel_compute_vertex_fog wrote it: in memory, or in the buffer object
 * of that name, where `data` is the offset of the first vertex's (buffer 0: memory). It must lie there until they have
 * drawn. For the fixed pipeline alone. Errors: ARGUMENT (not after begin; a format that is not the method's; no data; a
 * stride that is shorter than the format or longer than INT32_MAX; a name that is no buffer; memory while a vertex
 * array object is bound), UNSUPPORTED (no fixed pipeline). */
NEBEL_API nebel_result nebel_gl_bind_classic_stream(nebel_gl_classic *classic, const nebel_vertex_output *stream,
                                                    unsigned buffer);

/* Puts the state back. Errors: ARGUMENT (not after begin). */
NEBEL_API nebel_result nebel_gl_end_classic_fog(nebel_gl_classic *classic);

/* Functions for the engine's shaders, in every version of GLSL, for vertex and fragment stages; zero-terminated; lives
 * for ever; put it behind #version. It makes highp the default precision in OpenGL ES. Calls no OpenGL; any thread.
 *
 *     vec4 nebel_classic_fog_coord(vec4 surface, float coordinate, float end, vec3 color);
 *         FOG_COORD: the fragment's colour. `end` is coordinate_end.
 *     vec4 nebel_classic_alpha(vec3 color, float amount);
 *         ALPHA: the second pass's output of the interpolated amount.
 *
 * TWO_PASS and ADDITIVE put out the interpolated stream as it is. */
NEBEL_API const char *nebel_gl_classic_shader_source(void);

/* ==== scenes in OpenGL ============================================================================ */

/* A scene in OpenGL: the picture of the CPU renderer (nebel/render.h), drawn by OpenGL 3.3 core or OpenGL ES 3.0.
 *
 *     nebel_gl_renderer *renderer = NULL;
 *     nebel_create_gl_renderer(scene_data, lighting, &(nebel_gl_renderer_desc){0}, &renderer);    // in a current context
 *
 *     nebel_gl_render_frame(renderer, &(nebel_gl_frame_desc){.camera = camera, .width = 1280, .height = 720});
 *     nebel_gl_get_textures(renderer, &textures);      // to show it, or
 *     nebel_gl_read_planes(renderer, &planes);         // to have it in memory
 *
 *     nebel_destroy_gl_renderer(renderer);
 *
 * Surfaces, light and fog are those of nebel/render.h: Lambert surfaces lit by the sun and the scene's point lights,
 * which are attenuated by all fog on their way, and by the ambient radiance; colour = transmittance * surface +
 * in-scattering. Both renderers look through the same points of each pixel. The sun's shadows, on surfaces and in fog,
 * come from maps fitted to what is seen, those of point lights from six maps around each, so their edges are a texel of
 * the map wide. Particles dim the sun, not point lights. Panoramas are no resampled views: each pixel has its own ray,
 * which meets surfaces, fog and particles exactly. Link with libnebel_gl and libnebel.
 *
 * A planet with air (`planets` of the scene, one) is drawn as by the CPU; its table is made anew in a frame whose eye or
 * sun is another than in the one before, which takes 50 to 230 ms. Its atmosphere must live as long as the renderer:
 * another one at the same address would be taken for the first. So must a textured planet, whose shells are
 * surfaces of which a part is seen: each costs the fog and the particles of a frame once more.
 *
 * Contexts, threads and errors as above. Every function leaves the state of the context as it found it; beside
 * what is listed there it changes, while it runs, texture units 7 to 15, and TEXTURE_2D_ARRAY of units 10, 11, 12 and 14; both
 * framebuffers; the bindings ARRAY_BUFFER and PIXEL_PACK_BUFFER; the parameters PACK_*; CLAMP_READ_COLOR; the depth
 * function, mask and range; POLYGON_OFFSET_FILL, PRIMITIVE_RESTART_FIXED_INDEX, DEPTH_CLAMP, the provoking vertex and
 * the clip control, where they exist. Conditional rendering must not be under way: pictures would be missing within a
 * frame.
 */

typedef struct nebel_gl_renderer nebel_gl_renderer;

typedef struct nebel_gl_renderer_desc {
    nebel_host host; /* threads make tables of air and trace clouds */
    /* Texels of a side of each of the sun's four shadow maps, and of eight more where it lights fog, 64 to 16384; 0: 2048.
     * The six of a point or spot light have a quarter of it, less where they would take more than 128 MiB together, but 64. */
    uint32_t shadow_map_size;
} nebel_gl_renderer_desc;

/* Copies meshes and textures of `scene` to the graphics processor; they are not read again. Light, point lights,
 * background and ambient are read anew for each frame, so `scene` must outlive the renderer. The maps around a point
 * light are drawn when it is new or has moved. Where point lights are more than there is room for,
 * GL_MAX_ARRAY_TEXTURE_LAYERS or 1,365, those that are brightest at the eye cast shadows. The lighting, whose snapshot
 * has the fog, is retained; NULL: no fog. On an error *renderer is NULL. O(vertices + triangles + texels). Errors:
 * ARGUMENT and VALUE as nebel_create_cpu_renderer, MEMORY, LIMIT (a texture larger than GL_MAX_TEXTURE_SIZE),
 * UNSUPPORTED (no current context, or one that is too old or cannot draw into textures of floats). */
NEBEL_API nebel_result nebel_create_gl_renderer(const nebel_scene_data *scene, nebel_lighting *lighting,
                                                const nebel_gl_renderer_desc *desc, nebel_gl_renderer **renderer);

/* NULL is fine. As nebel_destroy_gl where the context is lost. */
NEBEL_API void nebel_destroy_gl_renderer(nebel_gl_renderer *renderer);

/* The fog of the frames from now on, and its light. The lighting is retained; NULL: no fog. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_set_gl_renderer_lighting(nebel_gl_renderer *renderer, nebel_lighting *lighting);

/* The particles of the frames from now on, beside the fog and not among it: commit that with
 * nebel_commit_scene_volumes_at. They are copied; count 0: none. Each is drawn as a ball whose transmittance and light
 * up to the surface behind it have closed forms, from the farthest centre to the nearest: particles that overlap take
 * their light from each other as if one were behind the other, and fog counts before a particle's middle. They dim
 * the sun unless a frame leaves that out. O(count log count) for each frame, and what they cover. Errors: ARGUMENT,
 * VALUE (numbers that nebel_add_volume would refuse), MEMORY, UNSUPPORTED (OpenGL ES without GL_EXT_float_blend). */
NEBEL_API nebel_result nebel_set_gl_renderer_particles(nebel_gl_renderer *renderer, const nebel_particle *particles,
                                                       size_t count);

/* The exact picture, or a classic technique in place of a part of it. */
typedef enum nebel_gl_method {
    NEBEL_GL_METHOD_EXACT = 0, /* fog of each pixel; particles count up to the surface, in closed form */
    NEBEL_GL_METHOD_FIVE_TAP,  /* each particle is a disc through its middle, across the view: all of it or nothing, by
                                  the classic comparison of depth at five places. Of a panorama depth is distance */
    NEBEL_GL_METHOD_VERTEX, /* fog at the vertices of surfaces, by nebel_compute_vertex_fog, interpolated over triangles:
                                  what fog coordinates, a second pass and alpha polygons draw (above). It
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
NEBEL_API nebel_depth_taps nebel_gl_default_taps(void);

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
                                  some microseconds each. Not where the renderer's fog excludes, replaces or limits what particles
                                  do. Nonzero: sunlight passes particles by: for many of them and an eye that moves */
    double time;             /* as in nebel_frame_desc */
    int clouds_by_processor; /* 0: a planet with clouds of volume is refused. Nonzero: the processor walks through them along
                                the ray of each pixel, and dims the sun's light, which takes as long as on the CPU: for
                                pictures and films, not for windows */
} nebel_gl_frame_desc;

/* Draws a frame into textures of the renderer. Errors: ARGUMENT (also a method that there is not, or without what it
 * needs), VALUE (a camera, light or time as for nebel_render_frame; taps that are not finite or negative; a factor as for
 * nebel_resolve_factor), LIMIT (a picture, or a map of a textured planet, too large for this context; fog or triangles
 * that floats do not hold in this view; more than 4,096 point lights), CANCELLED (by progress),
 * MEMORY, UNSUPPORTED (more than one sample, or a textured planet, where OpenGL ES cannot blend floats; a planet with
 * clouds of volume where the processor may not walk through them, by another method than EXACT, or, if it has air, in an
 * orthographic view or with particles; a shader that the driver does not take; the context is another one, or lost). The first panorama copies the triangles of all
 * meshes: 108 bytes each, with fog per vertex 48 more. */
NEBEL_API nebel_result nebel_gl_render_frame(nebel_gl_renderer *renderer, const nebel_gl_frame_desc *desc);

/* What the last frame is made of: RGBA32F, linear light, the lowest row first, without filters or mipmaps. */
typedef struct nebel_gl_textures {
    unsigned color;         /* rgb: transmittance * surface + in-scattering; a: share of samples that hit a surface */
    unsigned transmittance; /* rgb */
    unsigned in_scattering; /* rgb */
    unsigned surface; /* rgb: shading normal; a: distance [m]; both times the share of samples that hit a surface */
    uint32_t width, height;
} nebel_gl_textures;

/* The names hold until the next frame. Calls no OpenGL. Errors: ARGUMENT (also where no frame was drawn). */
NEBEL_API nebel_result nebel_gl_get_textures(const nebel_gl_renderer *renderer, nebel_gl_textures *textures);

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
NEBEL_API nebel_result nebel_gl_read_planes(nebel_gl_renderer *renderer, const nebel_gl_planes *planes);

/* The view of a camera without near and far planes, for nebel_gl_set_fog and nebel_compute_view_rays with
 * NEBEL_DEPTH_ENCODING_RADIAL: the projection is infinite and begins 1e-6 m before the eye. Errors: ARGUMENT, VALUE as
 * for nebel_render_frame, UNSUPPORTED (a panorama, which no matrix makes). Any thread. */
NEBEL_API nebel_result nebel_view_from_camera(const nebel_camera *camera, uint32_t width, uint32_t height,
                                              const nebel_log *log, nebel_view *view);

#ifdef __cplusplus
}
#endif

#endif
