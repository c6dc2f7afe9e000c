/* Texts of the air of planets, behind the fog's text with NEBEL_AIR. */
#ifndef NB_GL_AIR_TEXT_H
#define NB_GL_AIR_TEXT_H

/* Declares pass_haze, what fog and air do along a ray; wants nebel_light pass_up_to(nebel_sight, int entry, float t), the fog
 * alone, which it declares. The program takes PASS_KNOTS times as many turns as that at most. */
extern const char nb_air_haze_text[];

/* The ground into the targets of surfaces. */
extern const char nb_air_ground_text[];

/* Declares sun_disc, and light_ground, which says what a white ground reflects of the sky and, where it faces it, of the sun.
 * Behind the texts of rays and of the sun. */
extern const char nb_air_light_text[];

#endif
