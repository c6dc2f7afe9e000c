/* The scene renderer: what is in it. */
#ifndef NB_GL_GL_RENDERER_H
#define NB_GL_GL_RENDERER_H

#include "gl_planets.h"
#include "gl_camera.h"
#include "gl_cloud_shadow.h"
#include "cloud_picture.h"
#include "gl_fog_irradiance.h"
#include "gl_environment.h"
#include "light_maps.h"
#include "gl_meshes.h"
#include "gl_particles.h"
#include "gl_scene_state.h"
#include "scene_programs.h"
#include "sun_shadow_maps.h"
#include "shaft_maps.h"
#include "gl_textured_planet.h"
#include "gl_targets.h"

struct nebel_gl_renderer {
    nebel_allocator allocator;
    nebel_log log;
    const nebel_scene_data *scene;
    nebel_lighting *fog; /* NULL: none */
    nb_gl_daylit_fog daylit;
    nb_context context;
    unsigned vertex_array; /* without attributes */
    nebel_gl *eye_fog;     /* as the eye sees it */
    nebel_gl *sun_fog;     /* with tiles as the sun sees them */
    nebel_gl *sun_cloud;   /* the particles, so, too */
    nebel_lighting *cloud; /* of the particles; NULL: not made yet */
    nb_meshes meshes;
    nb_scene_programs shading;
    nb_shadows shadows;
    nb_shaft_maps shafts;
    nb_light_maps lights;
    nb_environment environment; /* of the scene, for surfaces and the background */
    nb_gl_air air;
    nb_gl_shells shells;
    nb_gl_clouds clouds;
    nb_gl_cloud_shade cloud_shade;
    unsigned cloud_ends, cloud_over, cloud_dimming; /* textures of the size of the picture; 0: not made yet */
    nb_targets targets;
    nb_particles particles;
    int has_judged_particles; /* whether they should take light that they do not take, and said so */
    int has_frame;
};

/* Particles are asked for no light in fog, nor for that of point lights: tells the log where they should be, once for
 * each fog and cloud. */
void nb_renderer_judge_particles(nebel_gl_renderer *renderer);

#endif
