/* Fog over which daylight changes, as src/cpu/cpu_fog_irradiance.h has it: lit by the sun above the air, or by that under the air of the
 * origin, of which the pass takes what air and clouds leave at its place. No OpenGL. */
#ifndef NB_GL_GL_FOG_IRRADIANCE_H
#define NB_GL_GL_FOG_IRRADIANCE_H

#include "base/base.h"
#include "aerial/fog_shadow.h"

#include <nebel/scene.h>

typedef struct nb_gl_daylit_fog {
    nebel_lighting *of, *lit;    /* what was asked for last; NULL: nothing. The same in such a sun; NULL: needs none */
    nebel_sun sun;               /* of the scene */
    int by_air;                  /* the air leaves more or less by place */
    nb_cloud_shadow_extent roof; /* what clouds leave */
} nb_gl_daylit_fog;

/* Sets daylit->lit, for `fog`, which may be NULL. `clouds`: of the scene at this time; NULL: it has none. Tells once of fog that
 * cannot be lit so. MEMORY, and errors of nebel_create_lighting. */
nebel_result nb_gl_daylit_fog_set(nb_gl_daylit_fog *daylit, const nebel_log *log, const nebel_scene_data *scene,
                                  nebel_cloud_workspace *clouds, nebel_lighting *fog);

void nb_gl_daylit_fog_release(nb_gl_daylit_fog *daylit);

#endif
