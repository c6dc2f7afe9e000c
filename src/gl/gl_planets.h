/* The air of a scene's planets: their tables as a texture, their ground, the light at places in it, the disc of the sun. */
#ifndef NB_GL_GL_PLANETS_H
#define NB_GL_GL_PLANETS_H

#include "gl_caps.h"

#include "aerial/planets.h"

typedef struct nb_gl_air {
    nebel_parallel parallel;
    unsigned texture;                                 /* all tables, in OpenGL; 0: not made yet */
    nebel_sky_view_desc of;                           /* what they are made of, but for the planet */
    const nebel_atmosphere *made[NEBEL_MAX_PLANETS];  /* the same */
    nb_planet worlds[NEBEL_MAX_PLANETS];              /* in the order of their tables */
    int count;                                        /* 0: nothing is made */
    int first[NEBEL_MAX_PLANETS];                     /* words of the texture: where the table of a world begins */
    int light[NEBEL_MAX_PLANETS];                     /* from there on, where the light at places begins; -1: none */
    nb_irradiance_table *daylight[NEBEL_MAX_PLANETS]; /* of planets as the scene has them; NULL: not made yet */
    const nebel_atmosphere *home;                     /* of `daylight` */
} nb_gl_air;

/* The first planet of a scene where it has air; NULL: there is none. */
const nebel_planet *nb_gl_planets_planet(const nebel_scene_data *scene);

/* Makes the texture where it is not there already, bound to the active unit; wants the usual unpacking. `ends`: rays may end
 * before the ground. `is_lit`: the light at places is asked for. VALUE (a place or a sun that is none), MEMORY, LIMIT. */
nebel_result nb_gl_planets_set(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                               const nb_context *context, const nebel_scene_data *scene, const double eye[3], int ends,
                               int is_lit);

/* Uniforms of nb_air_planets_text, and of nb_air_light_text, in the current program, which is `program`. */
void nb_gl_planets_set_list(const nb_gl_air *air, unsigned program);
void nb_gl_planets_set_light(const nb_gl_air *air, unsigned program, const nebel_scene_data *scene);

/* Those of nb_air_places_text, and of nb_air_aerial_text by daylight. */
void nb_gl_planets_set_irradiance(const nb_gl_air *air, unsigned program, const nebel_scene_data *scene,
                                  float even_shade);

/* Of fog that clouds shade by its place. */
void nb_gl_planets_set_reach(const nb_gl_air *air, unsigned program);

/* In OpenGL. */
void nb_gl_planets_delete(const nb_gl_air *air);

/* The rest. */
void nb_gl_planets_release(nb_gl_air *air, const nebel_allocator *allocator);

#endif
