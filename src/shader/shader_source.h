/* The texts that cmake/NebelShaderText.cmake makes. */
#ifndef NB_SHADER_SHADER_SOURCE_H
#define NB_SHADER_SHADER_SOURCE_H

extern const char nb_shader_text_glsl_330[], nb_shader_text_glsl_300_es[], nb_shader_text_glsl_450[],
    nb_shader_text_hlsl[];

#endif
