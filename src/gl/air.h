/* The air of a scene's planet: its table as a texture, its ground, the disc of its sun. */
#ifndef NB_GL_AIR_H
#define NB_GL_AIR_H

#include "context.h"

#include <nebel/scene.h>

typedef struct nb_gl_air {
    unsigned texture;       /* the table, in OpenGL; 0: not made yet */
    nebel_air_view_desc of; /* what it is made of; no atmosphere: of nothing */
    nebel_air_view *view;   /* the same */
} nb_gl_air;

/* The planet of a scene that has air; NULL: there is none. */
const nebel_planet *nb_gl_air_planet(const nebel_scene_data *scene);

/* The sun of a scene; where there is none one of no light. */
nebel_sun nb_gl_air_sun(const nebel_scene_data *scene);

/* Makes the texture where it is not there already, bound to the active unit; wants the usual unpacking. `ends`: rays may end
 * before the ground. VALUE (a place or a sun that is none), MEMORY, LIMIT. */
nebel_result nb_gl_air_set(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                           const nb_context *context, const nebel_scene_data *scene, const double eye[3], int ends);

/* Uniforms of nb_air_light_text in the current program, which is `program`. */
void nb_gl_air_set_disc(unsigned program, const nebel_scene_data *scene);

/* In OpenGL. */
void nb_gl_air_delete(const nb_gl_air *air);

/* The rest. */
void nb_gl_air_release(nb_gl_air *air);

#endif
