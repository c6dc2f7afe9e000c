/* Where the lattices of light that is scattered more than once lie, for shaders. */
#ifndef NB_SHADER_PACK_DIFFUSION_H
#define NB_SHADER_PACK_DIFFUSION_H

#include <nebel/shader.h>

/* 0 where there is none. */
size_t nb_count_lattice_words(const nebel_lighting *lighting);

/* Where that of own light begins among them. */
size_t nb_own_lattice_word(const nebel_lighting *lighting);

/* LIMIT, with a message, where the nodes are more than can be addressed. */
nebel_result nb_check_lattices(const nebel_lighting *lighting);

/* As layout.h has them, relative to the eye. */
void nb_pack_lattice_words(const nebel_lighting *lighting, const long double eye[3], nebel_texel_f32 *words);

#endif
