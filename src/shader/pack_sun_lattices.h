/* Lattices of what lies between voxels and the sun (light/sun_lattice.h), among the texels behind the grids. */
#ifndef NB_SHADER_PACK_SUN_LATTICES_H
#define NB_SHADER_PACK_SUN_LATTICES_H

#include <nebel/shader.h>

/* How many texels they take if there is room for so many: they become coarser where that is little, but may take more. */
size_t nb_count_sun_lattice_texels(const nebel_lighting *lighting, size_t room);

/* Writes the first texel of each, of which `first` is the first of all, into the words of the media. */
void nb_place_sun_lattices(const nebel_lighting *lighting, size_t room, size_t first, nebel_texel_f32 *words);

/* Writes all of them from `texels` on. MEMORY. */
nebel_result nb_pack_sun_lattices(const nebel_lighting *lighting, size_t room, nebel_texel_u32 *texels);

/* Whether both have the same. */
int nb_same_sun_lattices(const nebel_lighting *a, const nebel_lighting *b);

#endif
