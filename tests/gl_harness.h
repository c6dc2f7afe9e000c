/* Evaluates GLSL over arrays in an OpenGL context without a window, for the tests that compare formulas with C.
 *
 *     nb_gl gl;
 *     if (!nb_gl_open(&gl, NB_GL_300ES)) fail_msg("%s", gl.fault);
 *     const unsigned program = nb_gl_compile(&gl, "", "out0 = vec4(nb_exp(in0.x));", 1, 1);
 *     if (!program || !nb_gl_evaluate(&gl, program, count, inputs, outputs)) fail_msg("%s", gl.fault);
 *     nb_gl_close(&gl);
 *
 * The vertex shader runs once per item and transform feedback writes what it computed. All formulas of
 * src/formulas/ORDER are at hand. */
#ifndef NB_GL_HARNESS_H
#define NB_GL_HARNESS_H

#include <stddef.h>

/* COMPATIBILITY has the fixed pipeline of OpenGL 1.x, too; nothing is evaluated in it. */
typedef enum nb_gl_language { NB_GL_330, NB_GL_300ES, NB_GL_COMPATIBILITY } nb_gl_language;

typedef struct nb_gl {
    void *display, *context;
    nb_gl_language language;
    unsigned program_inputs, program_outputs; /* of the last compiled program */
    char fault[4096];                         /* what went wrong last */
} nb_gl;

/* Makes the context current. 0 on failure; gl->fault says why, nothing need be closed. */
int nb_gl_open(nb_gl *gl, nb_gl_language language);

/* Closes the context and all programs with it. */
void nb_gl_close(nb_gl *gl);

/* A program whose main() is `body`, after the formulas and `functions`. It reads vec4 in0, in1, ... (at most 16) and
 * writes vec4 out0, out1, ... (at most 16). 0 on failure. */
unsigned nb_gl_compile(nb_gl *gl, const char *functions, const char *body, unsigned inputs, unsigned outputs);

/* The same behind the given texts, which end with NULL, instead of the formulas; they see no in0, out0 .... */
unsigned nb_gl_compile_texts(nb_gl *gl, const char *const *texts, const char *body, unsigned inputs, unsigned outputs);

/* Runs the program last compiled over `count` items of 4 * inputs floats into items of 4 * outputs floats. 0 on
 * failure. */
int nb_gl_evaluate(nb_gl *gl, unsigned program, size_t count, const float *inputs, float *outputs);

/* GL_VENDOR, GL_RENDERER and GL_VERSION in one line. */
void nb_gl_describe(char *text, size_t size);

#endif
