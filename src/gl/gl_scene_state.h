/* The state of the context that the renderer changes beside that of the passes, kept and put back. nebel/gl.h
 * has the list in words. */
#ifndef NB_GL_GL_SCENE_STATE_H
#define NB_GL_GL_SCENE_STATE_H

#include "gl_state.h"

enum { NB_SCENE_UNITS = 9, NB_SCENE_ARRAYS = 4, NB_SCENE_PACK = 6 };

typedef struct nb_scene_state {
    nb_gl_state base;
    nb_unpacking unpacking;
    GLint textures[NB_SCENE_UNITS], samplers[NB_SCENE_UNITS]; /* of units 7 to 15 */
    GLint array_textures[NB_SCENE_ARRAYS];                    /* of units 10, 11, 12 and 14 */
    GLint read_framebuffer, array_buffer, pack_buffer, pack[NB_SCENE_PACK];
    GLint depth_function;
    GLboolean depth_mask;
    GLfloat depth_range[2];
    uint32_t switches; /* bits: which were on */
    GLint provoking_vertex, clip_control[2], clamp_read;
} nb_scene_state;

/* Saves, and sets what no part of the renderer wants otherwise: memory is read and written as C arrays lie, depth is
 * tested only where it is switched on, with the least winning, and goes from 0 to 1. */
void nb_scene_state_enter(const nb_context *context, nb_scene_state *state);
void nb_scene_state_leave(const nb_context *context, const nb_scene_state *state);

#endif
