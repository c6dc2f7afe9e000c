/* Classic fog in OpenGL: fog per vertex, drawn as engines of 1999 to 2005 draw it.
 *
 * Such an engine has meshes and functions that draw them, each mesh in a layout of its own. So nothing is drawn here:
 * nebel_compute_vertex_fog writes one number or colour per vertex into the engine's own arrays, and what follows puts OpenGL
 * into the state in which the engine's own draw call makes fog of it, and back.
 *
 *     nebel_gl_classic *classic = NULL;
 *     nebel_create_gl_classic(&(nebel_gl_classic_desc){.log = log}, &classic);    // in the engine's context
 *     method = nebel_gl_get_classic_method(classic);          // TWO_PASS where the context lacks fog coordinates
 *
 *     // The stream follows from the method: feed refuses another one.
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
 * Between begin and end any number of meshes may be drawn, each after a feed of its own. A program that draws between
 * glBegin and glEnd feeds nothing: it calls glFogCoordf(coordinate) or glColor4ubv(color) before each vertex.
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
 * nebel_create_gl_classic was called in, and no error pending. Threads as in nebel/gl.h.
 */
#ifndef NEBEL_GL_CLASSIC_H
#define NEBEL_GL_CLASSIC_H

#include <nebel/classic.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum nebel_gl_classic_kind {
    NEBEL_GL_CLASSIC_FOG_COORD = 0,
    NEBEL_GL_CLASSIC_TWO_PASS,
    NEBEL_GL_CLASSIC_ADDITIVE,
    NEBEL_GL_CLASSIC_ALPHA,
    NEBEL_GL_CLASSIC_COUNT
} nebel_gl_classic_kind;

typedef struct nebel_gl_classic nebel_gl_classic;

typedef struct nebel_gl_classic_desc {
    nebel_allocator allocator;
    nebel_log log;
    nebel_gl_classic_kind kind; /* wanted */
    double coordinate_end;      /* FOG_COORD: as in nebel_vertex_desc, > 0; 0: 100 */
} nebel_gl_classic_desc;

/* Asks the current context what it can. Where FOG_COORD is wanted and neither OpenGL 1.4 nor GL_EXT_fog_coord is there
 * the method is TWO_PASS, and the log is told so. On an error *classic is NULL. Errors: ARGUMENT, VALUE (coordinate_end
 * is negative or not finite), MEMORY, UNSUPPORTED (no current context, or one that is too old). */
nebel_result nebel_create_gl_classic(const nebel_gl_classic_desc *desc, nebel_gl_classic **classic);

/* Not between begin and end. Calls no OpenGL. NULL is fine. */
void nebel_destroy_gl_classic(nebel_gl_classic *classic);

/* The method that is used. */
nebel_gl_classic_kind nebel_gl_get_classic_method(const nebel_gl_classic *classic);

/* Sets the state of the method. `color` is that of the fog for FOG_COORD; the others have it in their streams, and NULL
 * will do. Errors: ARGUMENT (FOG_COORD without a colour; after another begin), LIMIT (an attribute stack is full).
 * Nothing has changed then. */
nebel_result nebel_gl_begin_classic_fog(nebel_gl_classic *classic, const float color[3]);

/* The next draw calls take their fog from `stream`, as nebel_compute_vertex_fog wrote it: in memory, or in the buffer object
 * of that name, where `data` is the offset of the first vertex's (buffer 0: memory). It must lie there until they have
 * drawn. For the fixed pipeline alone. Errors: ARGUMENT (not after begin; a format that is not the method's; no data; a
 * stride that is shorter than the format or longer than INT32_MAX; a name that is no buffer; memory while a vertex
 * array object is bound), UNSUPPORTED (no fixed pipeline). */
nebel_result nebel_gl_bind_classic_stream(nebel_gl_classic *classic, const nebel_vertex_output *stream,
                                          unsigned buffer);

/* Puts the state back. Errors: ARGUMENT (not after begin). */
nebel_result nebel_gl_end_classic_fog(nebel_gl_classic *classic);

/* Functions for the engine's shaders, in every version of GLSL, for vertex and fragment stages; zero-terminated; lives
 * for ever; put it behind #version. It makes highp the default precision in OpenGL ES. Calls no OpenGL; any thread.
 *
 *     vec4 nebel_classic_fog_coord(vec4 surface, float coordinate, float end, vec3 color);
 *         FOG_COORD: the fragment's colour. `end` is coordinate_end.
 *     vec4 nebel_classic_alpha(vec3 color, float amount);
 *         ALPHA: the second pass's output of the interpolated amount.
 *
 * TWO_PASS and ADDITIVE put out the interpolated stream as it is. */
const char *nebel_gl_classic_shader_source(void);

#ifdef __cplusplus
}
#endif
#endif
