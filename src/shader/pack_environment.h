/* The filters of environments among their words: see environment.c. */
#ifndef NB_SHADER_PACK_ENVIRONMENT_H
#define NB_SHADER_PACK_ENVIRONMENT_H

#include <nebel/shader.h>

/* LIMIT when they are too many. */
nebel_result nb_check_environment(const nebel_lighting *lighting);

/* Tells each packed medium where the filter of its phase function is. */
void nb_place_filters(const nebel_lighting *lighting, nebel_texel_f32 *words);

#endif
