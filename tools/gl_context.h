/* An OpenGL context without a window: a graphics processor where there is one, else Mesa's software. */
#ifndef NB_GL_CONTEXT_TOOL_H
#define NB_GL_CONTEXT_TOOL_H

typedef enum nb_gl_api {
    NB_GL_API_DESKTOP,
    NB_GL_API_ES,
    NB_GL_API_FIXED /* OpenGL with the fixed pipeline, too: a compatibility profile */
} nb_gl_api;

typedef struct nb_gl_context {
    void *display, *context, *surface; /* of EGL */
    char fault[256];                   /* why there is none */
    int stage;                         /* how far the attempt came that `fault` is of */
    char renderer[256];                /* GL_RENDERER and GL_VERSION */
    char no_desktop[256];              /* nb_gl_context_open_any: why it is OpenGL ES; empty where it is not */
} nb_gl_context;

/* Makes a context of OpenGL 3.3, or OpenGL ES 3.0, current in this thread. Its framebuffer is one pixel: draw into
 * your own. Returns 0, or -1 with the reason, and what to do, in `fault`. */
int nb_gl_context_open(nb_gl_context *gl, nb_gl_api api);

/* OpenGL where it can be had, else OpenGL ES. */
int nb_gl_context_open_any(nb_gl_context *gl);

/* Destroys the context. Only after nb_gl_context_open has returned 0. */
void nb_gl_context_close(nb_gl_context *gl);

#endif
