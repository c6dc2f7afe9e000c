/* Where the voxels of a snapshot's grids lie among the texels. */
#ifndef NB_SHADER_PACK_VOXELS_H
#define NB_SHADER_PACK_VOXELS_H

#include <nebel/shader.h>

/* How many texels can be addressed: indices are exact floats. */
#define NB_MAX_TEXELS ((size_t)1 << 24)

/* The grid of a medium; NULL where its density is none. */
nebel_grid *nb_grid_of_medium(const nebel_lighting *lighting, size_t medium);

/* Those of the number as a float. */
uint32_t nb_texel_bits(double x);

/* LIMIT, with a message, where the texels are more than can be addressed. */
nebel_result nb_check_voxels(const nebel_lighting *lighting);

/* Writes the first texel of each grid, and of its lattice, into the words of the media. */
void nb_place_voxels(const nebel_lighting *lighting, nebel_texel_f32 *words);

#endif
