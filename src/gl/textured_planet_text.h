/* GLSL of textured planets: their ground, their clouds, their air, and how they are laid over each other. */
#ifndef NB_GL_TEXTURED_PLANET_TEXT_H
#define NB_GL_TEXTURED_PLANET_TEXT_H

/* Behind the fog's text, RAY_WORD and the ray of a pixel: BALL, and what is drawn of it. */
extern const char nb_shell_sphere_text[], nb_shell_ground_text[], nb_shell_clouds_text[], nb_shell_air_text[];

/* Behind that of the veil: one of them, with the fog before it. */
extern const char nb_shell_over_text[];

#endif
