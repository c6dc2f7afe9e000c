/* What the tests of the passes share: a context in which every error of OpenGL is a failure, textures, pictures with
 * depth, and what nebel_trace says about the same pixels. */
#ifndef PASS_HELP_H
#define PASS_HELP_H

#include "unit.h"
#include "gl_harness.h"
#include "projections.h"

#include <nebel/gl.h>

/* ---- the context ----------------------------------------------------------------------------- */

/* Makes a context current and watches it. */
void pass_open(nb_gl *context, nb_gl_language language);

/* Fails where OpenGL reported an error since it was asked last. */
void pass_expect_no_errors(void);

/* How many errors were reported since it was asked last, which are forgiven. */
int pass_take_errors(void);

/* Fails where OpenGL reported an error, and closes. */
void pass_close(nb_gl *context);

/* How many textures, buffers, vertex arrays, samplers, framebuffers, programs and shaders there are among the first
 * names. */
int pass_count_objects(void);

/* ---- textures -------------------------------------------------------------------------------- */

/* Of floats: `components` 1, 4; depth: a depth buffer's format. The filters are what a new texture has. NULL: empty. */
unsigned pass_color_texture(int width, int height, int components, const float *texels);
unsigned pass_depth_texture(int width, int height, const float *texels);

/* A framebuffer that draws into the textures; second 0: none. It is bound. */
unsigned pass_framebuffer(unsigned first, unsigned second);

/* The texels of a texture of four components, lowest row first. */
void pass_read(unsigned texture, int width, int height, float *texels);

void pass_delete_texture(unsigned texture);
void pass_delete_framebuffer(unsigned framebuffer);

/* Compiles a shader of so many texts into a program; `kind`: GL_VERTEX_SHADER, GL_FRAGMENT_SHADER. */
void pass_attach(unsigned program, unsigned kind, int count, const char *const *texts);
void pass_link(unsigned program);

/* ---- pictures -------------------------------------------------------------------------------- */

enum { PASS_WIDTH = 96, PASS_HEIGHT = 64, PASS_PIXELS = PASS_WIDTH * PASS_HEIGHT };

/* A view of balls over a plain, and what is stored for each pixel. */
typedef struct pass_picture {
    nebel_view view;
    range clip;
    nebel_depth_desc depth;
    float stored[PASS_PIXELS];
} pass_picture;

/* Where all cameras stand. */
extern const double pass_eye[3];

/* The view of a camera of some kind at pass_eye. */
nebel_view pass_view(int kind, range clip, double yaw, double pitch);

/* Depths, as the convention stores them; sky where nothing is hit. The view must have PASS_PIXELS pixels at most. */
void pass_fill(pass_picture *picture);

/* What nebel_trace says in double about the ray of a pixel up to what is stored there. */
nebel_transfer pass_trace(const nebel_lighting *fog, const pass_picture *picture, int x, int y);

/* ---- comparison ------------------------------------------------------------------------------ */

typedef struct pass_difference {
    size_t fogged, beyond_step; /* pixels that contain fog, and those of them more than 1/255 off */
    double largest;
} pass_difference;

/* Two numbers of a pixel; `fogged` where the pixel counts. */
void pass_note(pass_difference *difference, const float *got, const double *wanted, int fogged);

/* Boxes, height fog and a ball around pass_eye, which is inside some of it, and `more` small balls; below 0: without
 * any ball. Without lights. */
nebel_lighting *pass_fog(int more);

#endif
