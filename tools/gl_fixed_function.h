/* Classic fog drawn by the fixed pipeline of OpenGL: fog coordinates, blending and Gouraud's interpolation as hardware
 * has them (nebel/gl.h), over surfaces whose light nebel's renderer has made. */
#ifndef NB_TOOLS_GL_FIXED_FUNCTION_H
#define NB_TOOLS_GL_FIXED_FUNCTION_H

#include <nebel/gl.h>

typedef struct nb_gl_fixed_function {
    nebel_gl_renderer *renderer;
    const nebel_scene_data *scene; /* whose meshes the renderer has */
    const nebel_lighting *fog;     /* with its snapshot */
    nebel_log log;
} nb_gl_fixed_function;

/* Draws a frame of a perspective camera by FOG_COORD, TWO_PASS or ALPHA in a compatibility profile, and reads its
 * planes. Of n samples each pixel has k x k, the fewest that are no fewer. Errors: those of nebel_gl_render_frame,
 * nebel_compute_vertex_fog and nebel_create_gl_classic; MEMORY. */
nebel_result nb_gl_fixed_draw(const nb_gl_fixed_function *fixed, const nebel_gl_frame_desc *desc,
                              const nebel_gl_planes *planes);

#endif
