/* What the tests of classic fog in OpenGL share: a context with the fixed pipeline, a target, and a mesh in fog with
 * every stream that OpenGL takes. */
#ifndef CLASSIC_HELP_H
#define CLASSIC_HELP_H

#include "pass_help.h"

#include <nebel/gl.h>

/* Makes a context current and watches it. Where there is no OpenGL the test is left out, but in CI. */
void classic_open(nb_gl *context, nb_gl_language language);

/* ---- the target ------------------------------------------------------------------------------ */

enum { CLASSIC_SIZE = 64, CLASSIC_PIXELS = CLASSIC_SIZE * CLASSIC_SIZE };

/* Colour and depth. It is bound, and the viewport is set to it. */
typedef struct classic_target {
    unsigned color, depth, framebuffer;
} classic_target;

classic_target classic_make_target(unsigned internal_format);
void classic_delete_target(const classic_target *target);
void classic_clear(void);

typedef struct classic_image {
    float texels[CLASSIC_PIXELS][4];
} classic_image;

void classic_read(classic_image *image);

/* The largest difference of red, green or blue, and of alpha. */
double classic_compare(const classic_image *a, const classic_image *b);
double classic_compare_alpha(const classic_image *a, const classic_image *b);

/* ---- the mesh -------------------------------------------------------------------------------- */

enum { CLASSIC_COLUMNS = 25, CLASSIC_ROWS = 33, CLASSIC_VERTICES = CLASSIC_COLUMNS * CLASSIC_ROWS };
enum { CLASSIC_INDICES = 6 * (CLASSIC_COLUMNS - 1) * (CLASSIC_ROWS - 1) };

/* As an engine has it. Streams of nebel are in it. */
typedef struct classic_vertex {
    float place[3], normal[3], uv[2], color[4];
    float coordinate;
    float light[4];
    uint8_t bytes[4], alpha[4];
} classic_vertex;

/* Ground that becomes a wall and fills the picture, with fog on it. */
typedef struct classic_mesh {
    classic_vertex vertices[CLASSIC_VERTICES];
    uint16_t indices[CLASSIC_INDICES];
    matrix eye_from_object, clip_from_eye;
} classic_mesh;

/* The colour of the fog. */
extern const double classic_color[3];
extern const float classic_color_float[3];

void classic_make_mesh(classic_mesh *mesh);

/* A context with a target and the mesh. */
typedef struct classic_stage {
    nb_gl context;
    classic_target target;
} classic_stage;

void classic_start(classic_stage *stage, nb_gl_language language, unsigned internal_format, classic_mesh *mesh);
void classic_end(classic_stage *stage);

/* ---- the fixed pipeline ---------------------------------------------------------------------- */

/* Matrices, and the positions as the vertex array. */
void classic_set_mesh(const classic_mesh *mesh);

/* The first pass with vertex colours alone, or with lights, a texture with holes and an alpha test. Its state stays. */
void classic_draw_plain(const classic_mesh *mesh);
void classic_draw_rich(const classic_mesh *mesh);

/* The positions. */
void classic_draw_positions(const classic_mesh *mesh);

/* A stream of the mesh in memory. */
nebel_vertex_output classic_stream(classic_mesh *mesh, nebel_vertex_format format);

nebel_gl_classic *classic_create(nebel_gl_classic_kind kind);

/* The mesh by a method, after a clear. `rich`: as above. */
void classic_draw(nebel_gl_classic_kind kind, classic_mesh *mesh, nebel_vertex_format format, int rich);

#endif
