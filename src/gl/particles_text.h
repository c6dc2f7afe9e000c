/* What the programs of particles are made of: behind a head that defines SCENE_PARTICLES and SCENE_VEIL_LAYERS, see
 * nb_composite_key, and the texts of rays and fog. */
#ifndef NB_GL_PARTICLES_TEXT_H
#define NB_GL_PARTICLES_TEXT_H

extern const char nb_particle_vertex_text[], nb_round_particle_vertex_text[];

/* Of fragments: both, one after the other. */
extern const char nb_particle_start_text[], nb_particle_text[];

/* Of what lies behind: see_through_veil. */
extern const char nb_veil_text[];

/* The comparison of depth at five places asks this of the host: it stands before the fog's text. */
extern const char nb_five_tap_text[];

#endif
