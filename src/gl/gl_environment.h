/* Ambient light by direction, in a texture that stays while it does. */
#ifndef NB_GL_GL_ENVIRONMENT_H
#define NB_GL_GL_ENVIRONMENT_H

#include "gl_caps.h"

#include <nebel/light.h>
#include <nebel/shader.h>

typedef struct nb_environment {
    unsigned name;      /* in OpenGL; 0: not made yet */
    nebel_lighting *of; /* what it was made of, of which it is an owner; NULL: of nothing */
} nb_environment;

/* Makes the texture of a snapshot's environment, where it is not there already. Changes the texture of the active unit;
 * wants the usual unpacking. LIMIT, MEMORY. */
nebel_result nb_environment_set(nb_environment *environment, const nebel_allocator *allocator, const nebel_log *log,
                                const nb_context *context, nebel_lighting *lighting, int surfaces);

/* The same, for surfaces, where there is no fog. */
nebel_result nb_environment_show(nb_environment *environment, const nebel_allocator *allocator, const nebel_log *log,
                                 const nb_context *context, const nebel_environment *light);

/* In OpenGL. */
void nb_environment_delete(const nb_environment *environment);

#endif
