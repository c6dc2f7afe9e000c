/* Frames drawn by OpenGL, without a window. */
#ifndef NB_TOOLS_GL_OFFSCREEN_H
#define NB_TOOLS_GL_OFFSCREEN_H

#include "gl_context.h"
#include "load_scene.h"

#include <nebel/gl.h>
#include <nebel/render.h>

typedef struct nb_gl_offscreen {
    nb_gl_context context;
    nebel_gl_renderer *renderer; /* NULL: there is no context */
    const nb_load_result *loaded;
    const nebel_scene_data *scene; /* what is drawn */
    nebel_log log;
    int is_fixed; /* the context has the fixed pipeline */
} nb_gl_offscreen;

/* Opens a context, of OpenGL ES where there is no OpenGL, and hands it `scene`: what is loaded, or the same in smaller
 * triangles. With the fixed pipeline where the method is one of its own, the driver has it
 * and it can draw the scene. Notes which driver it is, and what it cannot. NB_DONE; or NB_FAILED, said on standard error, with nothing to close. `loaded` and `scene` must outlive the
 * painter. */
int nb_gl_painter_open(nb_gl_offscreen *painter, const char *name, const nb_load_result *loaded,
                       const nebel_scene_data *scene, nebel_method method, nb_report_listener *listener);

/* Draws a frame with the fog that is loaded for it, and reads its planes. Returns a result; the log has said why. */
nebel_result nb_gl_painter_draw(nb_gl_offscreen *painter, double frame, const nebel_gl_frame_desc *desc,
                                const nebel_gl_planes *planes);

/* Fine with what a failed nb_gl_painter_open left, and with zeros. */
void nb_gl_painter_close(nb_gl_offscreen *painter);

#endif
