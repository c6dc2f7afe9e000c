/* Texts of the air of planets, behind the fog's text with NEBEL_SKY_VIEW and SCENE_WORLDS, the number of planets. */
#ifndef NB_GL_AERIAL_TEXT_H
#define NB_GL_AERIAL_TEXT_H

/* In the head of a program; "" where there are no planets. Returns text. */
enum { NB_AIR_HEAD = 320 };
const char *nb_air_head(int worlds, char text[NB_AIR_HEAD]);

/* Before the fog's text: where it finds words. */
extern const char nb_air_words_text[];

/* Behind it and before the other ones: the air and the ground of all. */
extern const char nb_air_planets_text[];

/* Declares daylight_at, the light of the sun and of the sky at a place, as models and fog have it. Behind the way to the sun,
 * scene_sun. */
extern const char nb_air_places_text[];

/* Declares what pass_haze does piece by piece. */
extern const char nb_air_pieces_text[];

/* Declares pass_haze, what fog and air do along a ray. `entry`: of its tile's list, if there are tiles. */
extern const char nb_air_aerial_text[];

/* The ground into the targets of surfaces. */
extern const char nb_air_ground_text[];

/* Declares sun_disc. Behind the texts of rays, of the sun and of places. */
extern const char nb_air_sun_text[];

/* Declares light_ground, which says what a white ground reflects of the sky and, where it faces it, of the sun; and light_model,
 * which makes of the ambient light and of the sun's what they are at a place. */
extern const char nb_air_light_text[];

#endif
