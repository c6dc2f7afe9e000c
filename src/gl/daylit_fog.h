/* Fog over which daylight changes, as src/cpu/daylit_fog.h has it: lit by the sun above the air, of which the pass takes what
 * there is at its place. No OpenGL. */
#ifndef NB_GL_DAYLIT_FOG_H
#define NB_GL_DAYLIT_FOG_H

#include "base/base.h"

#include <nebel/scene.h>

typedef struct nb_gl_daylit_fog {
    nebel_snapshot *of,
        *lit; /* what was asked for last; NULL: nothing. The same in the sun above the air; NULL: needs none */
    nebel_sun sun;
} nb_gl_daylit_fog;

/* Sets daylit->lit, for `fog`, which may be NULL. Tells once of fog that cannot be lit so. MEMORY, and errors of
 * nebel_relight. */
nebel_result nb_gl_daylit_fog_set(nb_gl_daylit_fog *daylit, const nebel_log *log, const nebel_scene_data *scene,
                                  nebel_snapshot *fog);

void nb_gl_daylit_fog_release(nb_gl_daylit_fog *daylit);

#endif
